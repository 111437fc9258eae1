#include "benchmarks/cut_cube.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fixtures/bodies.h"
#include "fixtures/build.h"
#include "fixtures/cook.h"
#include "reference_cpu/reference.h"

namespace cutproof::benchmarks {

ReadyScene make_cut_cube(int32_t side, int32_t core) {
  Scene spec;
  spec.name = fmt::format("cube_{}_cores_{}", side, core);
  spec.frame_length = kCutCubeSubstepLength;
  spec.clusters.side = core;
  spec.step.substeps = 1;
  spec.step.iterations = 0;  // nothing moves: a geometric cut does not ask where the tissue is now
  spec.step.stiffness = kCutCubeStiffness;
  spec.detect = {.criterion = Criterion::geometric};
  spec.skin.wanted = false;

  ReadyScene cube;
  cube.name = spec.name;
  Setup& setup = cube.setup;
  setup.body = fixtures::block(side, side, side, kCutCubeSpacing);
  fixtures::take_stage_parameters(spec, setup);
  BladeSpec blade;
  blade.thickness = 0.5;
  blade.speed = kCutCubeSpacing / spec.frame_length;
  StrokeSpec stroke;
  const double cut = (std::floor(0.5 * side) + 0.5 + 1.0 / 3) / side, beyond = 1.0 / side;
  stroke.points = {{-beyond, 0.5, cut}, {1 + beyond, 0.5, cut}};
  stroke.back = {-1, 0, 0};
  stroke.along = Vec3{0, 1, 0};
  blade.strokes = {stroke};
  spec.blade = blade;
  fixtures::resolve_schedule(spec, "command line", {}, setup);
  cube.state = fixtures::cook(setup.body, spec.clusters, spec.expand, spec.merge, spec.seed);
  return cube;
}

std::vector<Cut> cuts_of(const ReadyScene& cube) {
  const auto backend = reference::make_backend();
  backend->load({cube.setup}, {cube.state});
  auto run_to = [&, frame = int64_t{0}](int64_t end) mutable {
    for (; frame < end; ++frame) backend->run({});
    return backend->snapshot().front();
  };
  const int64_t all = cube.setup.frame_count(), half = all / 2;
  const State middle = run_to(half), next = run_to(half + 1), later = run_to(half + std::max<int64_t>(2, all / 4));
  return {{"one frame", middle, next}, {"quarter", middle, later}, {"whole", cube.state, run_to(all)}};
}

}  // namespace cutproof::benchmarks
