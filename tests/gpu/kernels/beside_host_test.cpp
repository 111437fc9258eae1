// Each backend beside `host`, as two runs of anybody's simulator: off by no more than 64 times what one rounding in
// each frame makes of a run of `host` (docs/reference/relate.md).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "fixtures/build.h"
#include "model/io/scene_io.h"
#include "oracles/runs/run_relation.h"
#include "tests/gpu/kernels/every_backend.h"

namespace cutproof::beside_host_test {
namespace {

using tests::EveryBackend;

// A block on the ground that one stroke cuts in two.
constexpr const char* kScene = R"({"version": 5, "name": "block",
  "body": {"shape": {"kind": "box", "size": [0.12, 0.08, 0.08]}, "spacing": 0.01},
  "clusters": {"side": 7}, "frame": {"settle": 0.1}, "detect": {"criterion": "geometric"}, "ground": {"friction": 0.5},
  "blade": {"speed": 1, "strokes": [{"points": [[0.5, 0.5, 1.3], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]},
  "expect": {"components_at_end": 2, "shells_at_end": 2}})";

// Frames of one backend. `seed`: of the disturbance in each frame; 0: none.
std::vector<State> run_of(Backend& backend, const cutproof::Setup& setup, const State& start, int64_t frames,
                          uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<State> states = {start};
  backend.load({setup}, {start});
  for (int64_t f = 0; f < frames; ++f) {
    if (seed != 0) {
      State state = backend.snapshot().front();
      const auto disturb = [&](std::vector<Vec3>& all) {
        double greatest = 0;
        for (const Vec3 a : all) greatest = std::max({greatest, std::abs(a.x), std::abs(a.y), std::abs(a.z)});
        const auto size = static_cast<float>(greatest);
        const double unit = double{std::nextafter(size, INFINITY)} - double{size};
        for (Vec3& a : all) {
          for (int axis = 0; axis < 3; ++axis) a[axis] += random() % 2 == 0 ? unit : -unit;
        }
      };
      disturb(state.x);
      disturb(state.v);
      backend.load({setup}, {state});
    }
    backend.run({Stage::step, Stage::skin});
    states.push_back(backend.snapshot().front());
  }
  return states;
}

oracles::RelatedRun related(const State& state, int64_t frame, double dt, oracles::RunCoupling& coupling) {
  coupling.offsets = state.clusters.offsets;
  coupling.members = state.clusters.members;
  oracles::RelatedRun run;
  run.frame.index = frame;
  run.frame.time = static_cast<double>(frame) * dt;
  run.frame.positions = state.x;
  run.frame.velocities = state.v;
  run.frame.alive = state.alive;
  run.coupling = &coupling;
  run.is_new_coupling = true;
  return run;
}

class BesideTheHost : public EveryBackend {};

TEST_P(BesideTheHost, IsOffByNoMoreThanNoise) {
  fixtures::Built built = fixtures::build(io::parse_scene(kScene, "scene"), "scene");
  built.setup.step.gravity = {0, 0, -9.81};
  for (std::size_t i = 0; i < built.state.x.size(); ++i) {
    const Vec3 x = built.state.x[i];
    built.state.v[i] = cross({5, -3, 9}, x) + Vec3{8 * x.x, 0, -5 * x.z};
  }
  const int64_t frames = built.setup.frame_count();
  const double dt = built.setup.substep_length.front() * built.setup.step.substeps;
  const auto host = gpu::make_host_backend(2, {});
  const std::vector<State> first = run_of(*host, built.setup, built.state, frames, 0);
  const std::vector<State> other = run_of(*backend_, built.setup, built.state, frames, 0);
  std::vector<std::vector<State>> noise;
  for (const uint64_t seed : {1, 2, 3}) noise.push_back(run_of(*host, built.setup, built.state, frames, seed));
  oracles::RunHeader header;
  header.u = 0x1p-24;
  header.spacing = built.setup.body.grid.spacing;
  header.steps = built.setup.step.substeps;
  oracles::RunRelation relation(oracles::RunMap::parse("same"), header, header, 3, false);
  double ratio = 0, distance = 0, noisy = 0;
  for (std::size_t f = 0; f < first.size(); ++f) {
    std::vector<oracles::RunCoupling> couplings(5);
    std::vector<oracles::RelatedRun> disturbed;
    const auto frame = static_cast<int64_t>(f);
    for (std::size_t k = 0; k < 3; ++k) {
      disturbed.push_back(related(noise[k][f], frame, dt, couplings[k]));
      noisy = std::max(noisy, tests::distance(built.setup, first[f].x, noise[k][f].x));
    }
    distance = tests::distance(built.setup, first[f].x, other[f].x);
    if (noisy > 0) ratio = std::max(ratio, distance / noisy);
    relation.see(related(first[f], frame, dt, couplings[3]), related(other[f], frame, dt, couplings[4]), disturbed);
  }
  relation.finish();
  std::printf("%s: in %lld frames off by %.2g times the noise at most; %.1e h in the last one, noise %.1e h\n",
              GetParam().name.c_str(), static_cast<long long>(frames), ratio, distance, noisy);
  for (const Verdict& verdict : relation.verdicts()) {
    EXPECT_TRUE(verdict.holds) << verdict.property << ": " << verdict.witness.text;
  }
  EXPECT_GT(noisy, 0);
  EXPECT_LT(std::count(first.back().alive.begin(), first.back().alive.end(), 1), std::ssize(first.back().alive))
      << "nothing was cut";
}

INSTANTIATE_TEST_SUITE_P(Over, BesideTheHost, ::testing::ValuesIn(tests::all_backends()),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace cutproof::beside_host_test
