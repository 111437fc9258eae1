#include "benchmarks/scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "benchmarks/report.h"
#include "benchmarks/times.h"
#include "fixtures/bodies.h"
#include "fixtures/build.h"
#include "fixtures/cook.h"
#include "model/rules.h"

namespace cutproof::benchmarks {

Cooking cooking_of(const std::string& name) {
  const auto known = choice_named<Cooking>(name);
  require_option(known.has_value(), "--clusters", fmt::format("clusters cannot be cooked by '{}'", name),
                 fmt::format("use {}", fmt::join(names_of(Cooking{}), " or ")));
  return *known;
}

void sample_as_paper(Scene& spec) {
  spec.clusters.method = Cooking::sampled;
  spec.clusters.spacing = spec.clusters.radius = 4.5;
  spec.expand.rule = ExpandRule::published;
}

BenchScene make_bench_scene(int64_t particles, int64_t frames, Cooking cooking) {
  const bool box = particles <= kLargestBox;
  const std::string kind = box ? "box" : "kidney";
  const auto begin = Clock::now();

  Scene spec;
  spec.name = fmt::format("{}_{}", kind, particles);
  Shape shape;
  shape.kind = box ? Shape::Kind::box : Shape::Kind::kidney;
  shape.size = box ? Vec3{0.2, 0.1, 0.05} : Vec3{0.11, 0.06, 0.05};  // [m]
  spec.body.shape = shape;
  spec.body.particles = particles;
  spec.step.substeps = 4;
  spec.step.iterations = 4;
  spec.step.acceleration = Acceleration::none;  // as is the next one: comparable with earlier results
  spec.detect.remove = RemovedEnds::both;
  spec.step.stiffness = 1e5;
  spec.step.damping = 5;
  if (cooking == Cooking::sampled) sample_as_paper(spec);

  BenchScene scene;
  scene.name = spec.name;
  scene.cooking = cooking;
  Setup& setup = scene.setup;
  setup.body = fixtures::sample(fixtures::solid_from_shape(shape, kind), spec.body, "command line");
  fixtures::take_stage_parameters(spec, setup);

  // The blade moves along x. A quarter of the body lies before the timed frames, and some tissue is left after them.
  const fixtures::Bounds bounds = fixtures::path_box(setup.body);
  const Vec3 extent = bounds.high - bounds.low;
  const double h = setup.body.grid.spacing;
  const double layers = extent.x / h;
  scene.advance = std::min(1.0, 0.5 * layers / static_cast<double>(frames + kJudgedFrames));
  scene.warm_up = static_cast<int64_t>(std::ceil(0.25 * layers / scene.advance));
  const int64_t all = scene.warm_up + frames + kJudgedFrames;

  // Halfway between two layers of nodes: on a layer rounding would decide the side of the blade.
  const double cut = std::floor(0.5 * extent.z / h) * h / extent.z;
  const double start = 1 + h / extent.x;
  BladeSpec blade;
  blade.thickness = 0.5;
  blade.speed = scene.advance * h / spec.frame_length;
  StrokeSpec stroke;
  stroke.points = {{start, 0.5, cut}, {start - scene.advance * h * static_cast<double>(all) / extent.x, 0.5, cut}};
  stroke.back = {1, 0, 0};
  stroke.along = Vec3{0, 1, 0};
  blade.strokes = {stroke};
  spec.blade = blade;
  GripSpec grip;
  grip.high = {0.1, 1, 1};
  spec.grips = {grip};
  fixtures::resolve_schedule(spec, "command line", {}, setup);

  scene.state = fixtures::cook(setup.body, spec.clusters, spec.expand, spec.merge, spec.seed);
  scene.build_seconds = seconds_since(begin);
  return scene;
}

void require_timed_sizes(const std::vector<int64_t>& sizes) {
  constexpr int64_t kLeast = 100, kMost = 1'000'000'000;
  for (const int64_t size : sizes) {
    require_option(size >= kLeast && size <= kMost, "--sizes", fmt::format("{} particles cannot be timed", size),
                   fmt::format("give numbers from {} to {}, separated by commas", kLeast, kMost));
  }
}

}  // namespace cutproof::benchmarks
