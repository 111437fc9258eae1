// Clusters that keep their volume (docs/design/method.md §3) on every backend: what a material of that Poisson ratio
// does by hand, hard starts, and the answer of a substep.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

#include "fixtures/cook.h"
#include "gpu/backends.h"
#include "oracles/comparison/reference_solution.h"
#include "oracles/iterates/probe.h"
#include "oracles/oracles.h"
#include "oracles/relations/relations.h"
#include "tests/gpu/kernels/every_backend.h"
#include "tests/oracles/comparison/twisted_block.h"

namespace cutproof::volume_test {
namespace {

using tests::distance;
using tests::EveryBackend;
using tests::obstructed_block;
using tests::pressed_block;
using tests::Scene;
using tests::twisted_block;

// Differs from particle to particle.
Vec3 noise_of(std::size_t i) {
  const auto k = static_cast<double>(i);
  return {std::sin(7 * k), std::sin(11 * k), std::cos(5 * k)};
}

// At rest but for noise, of six iterations in each substep.
Scene displaced_block(int32_t nx, int32_t ny, int32_t nz, int32_t side, double volume_share, double far) {
  Scene scene{tests::setup_of(tests::block_body(nx, ny, nz, 0.01)), {}};
  scene.setup.step.volume_share = volume_share;
  scene.setup.step.iterations = 6;
  scene.state = tests::state_of(scene.setup.body, tests::box_clusters(nx, ny, nz, side));
  for (std::size_t i = 0; i < scene.state.x.size(); ++i) scene.state.x[i] += far * noise_of(i);
  return scene;
}

class VolumeKept : public EveryBackend {
 protected:
  // To the end of the schedule.
  State run(const Scene& scene) {
    State now = scene.state;
    for (int64_t frame = 0; frame < scene.setup.frame_count(); ++frame) {
      now = step(scene.setup, now);
      ++now.frame;
    }
    return now;
  }
  void expect_right(const Scene& scene) {
    State before = scene.state;
    before.precision = backend_->precision();
    const oracles::IterateProbe probe(scene.setup, before, oracles::Iterates::all, 1);
    const Verdict iterates = probe.judged(oracles::shown_iterates(*backend_, {&probe, 1}).front());
    EXPECT_TRUE(iterates.holds) << iterates.witness.text;
    const State after = step(scene.setup, before);
    for (const Verdict& verdict :
         {oracles::admissible_step(scene.setup, before, after), oracles::momentum(scene.setup, before, after),
          oracles::energy_is_monotone(*backend_, scene.setup, scene.state, 12),
          oracles::rest_is_fixed(*backend_, scene.setup, scene.state)}) {
      EXPECT_TRUE(verdict.holds) << verdict.property << ": " << verdict.witness.text;
      EXPECT_GT(verdict.checked, 0) << verdict.property << ": " << verdict.vacuous;
    }
  }
};

TEST_P(VolumeKept, ComesToTheAnswerOfItsSubstep) {
  for (const double share : {0.5, 0.94}) {
    for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
      for (const Scene& given :
           {twisted_block(12, 1.0, 1.3, 0.01), obstructed_block(1e5), pressed_block(1e5, 0), pressed_block(1e5, 0.3)}) {
        Scene scene = given;
        scene.setup.step.volume_share = share;
        scene.setup.step.acceleration = acceleration;
        scene.setup.step.iterations = 400;
        const oracles::SubstepAnswer answer = oracles::substep_answer(scene.setup, scene.state);
        ASSERT_TRUE(answer.converged);
        const State now = step(scene.setup, scene.state);
        EXPECT_LT(distance(scene.setup, now.x, answer.x), tolerance(1e-8, 2e-4)) << share;
      }
    }
  }
}

// From any start: inverted, mirrored, collapsed to a plane, a line, a point, dilated beyond where the answer jumps.
TEST_P(VolumeKept, IsRightFromHardStarts) {
  const std::pair<const char*, Vec3> starts[] = {
      {"inverted", {-1, -1, -1}}, {"mirrored", {-1, 1, 1}}, {"flat", {1, 1, 0}},        {"line", {1, 0, 0}},
      {"point", {0, 0, 0}},       {"dilated", {3, 3, 3}},   {"small", {0.2, 0.2, 0.2}}, {"long", {2.5, 0.7, 0.6}}};
  for (const auto& [name, scale] : starts) {
    SCOPED_TRACE(name);
    Scene scene = twisted_block(5, 0, 1, 0.01);
    scene.setup.step.volume_share = 0.9;
    scene.setup.step.iterations = 6;
    for (std::size_t i = 0; i < scene.state.x.size(); ++i) {
      Vec3& x = scene.state.x[i];
      const Vec3 d = x - Vec3{0.03, 0.03, 0.03}, noise = 1e-4 * noise_of(i);
      x = Vec3{0.03, 0.03, 0.03} + Vec3{scale.x * d.x, scale.y * d.y, scale.z * d.z} + noise;
      scene.state.v[i] = {};
    }
    expect_right(scene);
  }
}

// A layer, a rod, one particle, and a layer beside a block have no volume to keep: they hold their shape along their
// extent.
TEST_P(VolumeKept, IsRightForThinPieces) {
  const std::array<int32_t, 3> sizes[] = {{7, 6, 1}, {8, 1, 1}, {1, 1, 1}, {6, 6, 2}, {9, 2, 2}};
  for (const auto& [nx, ny, nz] : sizes) {
    for (const double far : {2e-4, 2e-3}) {
      SCOPED_TRACE(testing::Message() << nx << " x " << ny << " x " << nz << ", displaced by " << far);
      expect_right(displaced_block(nx, ny, nz, 4, 0.9, far));
    }
  }
}

// A body that comes to rest within a frame rounds by the frame's first places.
TEST(Iterates, OfABodyThatComesToRestWithinAFrameHold) {
  const std::unique_ptr<Backend> host = gpu::make_host_backend();
  for (const double share : {0.0, 0.9}) {
    const Scene scene = displaced_block(6, 6, 6, 2, share, 2e-4);
    State before = scene.state;
    before.precision = host->precision();
    const oracles::IterateProbe probe(scene.setup, before, oracles::Iterates::all, 1);
    EXPECT_TRUE(probe.judged(oracles::shown_iterates(*host, {&probe, 1}).front()).holds) << share;
  }
}

TEST_P(VolumeKept, StaysAtRestToTheLastBit) {
  Scene scene = twisted_block(9, 0, 1, 0.01);
  scene.setup.step.volume_share = 0.94;
  scene.setup.step.iterations = 20;
  for (Vec3& v : scene.state.v) v = {};
  const State now = step(scene.setup, scene.state);
  if (backend_->precision() == Precision::binary32) {
    EXPECT_EQ(now.x, scene.state.x);
  } else {
    EXPECT_LT(distance(scene.setup, now.x, scene.state.x), 1e-12);
  }
}

// Its neighbour in a batch keeps volume; it does not.
TEST_P(VolumeKept, ChangesNoBitOfABodyThatDoesNot) {
  Scene plain = twisted_block(6, 0.7, 1.2, 0.01), other = plain;
  other.setup.step.volume_share = 0.9;
  const State alone = step(plain.setup, plain.state);
  backend_->load({plain.setup, other.setup}, {plain.state, other.state});
  backend_->run({Stage::step, Stage::step});
  const std::vector<State> both = backend_->snapshot();
  EXPECT_EQ(both[0].x, alone.x);
  EXPECT_EQ(both[0].v, alone.v);
  EXPECT_NE(both[1].x, alone.x);
  EXPECT_EQ(both[1].x, step(other.setup, other.state).x);
}

// A bar of n × w × w particles whose first layers are held, in tiles of two edges a side.
struct Bar {
  Bar(int32_t length, int32_t wide, double share, double stiffness)
      : n(length), w(wide), scene{tests::setup_of(tests::block_body(length, wide, wide, kSpacing)), {}} {
    scene.setup.step.volume_share = share;
    scene.setup.step.stiffness = stiffness;
    scene.setup.step.acceleration = Acceleration::chebyshev;
    scene.setup.step.iterations = 24;
    scene.setup.step.substeps = 1;
    scene.state = fixtures::cook(scene.setup.body, {.method = Cooking::tiles, .side = side}, {}, {}, 1);
  }
  void hold(int32_t from, int32_t to, Vec3 way) {
    Grip grip;
    for (int32_t i = 0; i < scene.setup.body.particle_count(); ++i) {
      if (from <= i % n && i % n < to) grip.particles.push_back(i);
    }
    const auto frames = scene.setup.substep_length.size();
    grip.active.assign(frames, 1);
    grip.displacement.assign(frames, (1 / static_cast<double>(frames)) * way);
    scene.setup.grips.push_back(grip);
  }
  // Mean displacement along `axis` of the layer at this place along it, of the cross-sections from `from` to `to`.
  double mean(const State& state, int axis, int32_t layer, int32_t from, int32_t to) const {
    double sum = 0, count = 0;
    for (int32_t i = 0; i < scene.setup.body.particle_count(); ++i) {
      const std::array<int32_t, 3> place = {i % n, i / n % w, i / n / w};
      if (place[0] < from || place[0] >= to || place[static_cast<std::size_t>(axis)] != layer) continue;
      sum += state.x[static_cast<std::size_t>(i)][axis] - scene.setup.body.rest_position(i)[axis];
      count += 1;
    }
    return sum / count;
  }
  // Between layers that lie a multiple of the clusters' side apart, because strain is not even within a cluster.
  double along(const State& state, int32_t from, int32_t to) const {
    return (mean(state, 0, to, to, to + 1) - mean(state, 0, from, from, from + 1)) / ((to - from) * kSpacing);
  }
  double across(const State& state, int32_t from, int32_t to) const {
    double sum = 0;
    for (const int axis : {1, 2}) {
      for (int32_t layer = 0; layer + side < w; ++layer) {
        sum += mean(state, axis, layer + side, from, to) - mean(state, axis, layer, from, to);
      }
    }
    return sum / (2 * (w - side) * side * kSpacing);
  }

  static constexpr double kSpacing = 0.01;
  static constexpr int32_t side = 2;
  int32_t n, w;
  Scene scene;
};

// β of this Poisson ratio in tiles (docs/design/method.md §3, Volume).
double share_of(double poisson_ratio) { return 1 - (1 - 2 * poisson_ratio) / (1 + poisson_ratio); }

// A bar that hangs from its end: strain ρ g (L - x) / E along it, and -ν times that across it.
TEST_P(VolumeKept, HasTheModuliOfItsMaterial) {
  for (const double poisson_ratio : {0.45, 0.3}) {
    if (poisson_ratio < 0.45 && backend_->precision() == Precision::binary64) continue;  // the reference takes long
    const int32_t length = 21, wide = 7, from = 6, to = 14;
    const double h = Bar::kSpacing, young = 12.5;  // E / ρ [m²/s²]
    const double stiffness = young / ((1 - 2 * poisson_ratio) * h * h / 2);
    Bar bar(length, wide, share_of(poisson_ratio), stiffness);
    constexpr int kFrames = 240;
    bar.scene.setup.substep_length.assign(kFrames, 0.002);
    bar.scene.setup.step.damping = 36;  // critical
    bar.scene.setup.step.gravity = {1, 0, 0};
    bar.hold(0, 1, {});
    const State now = run(bar.scene);
    const double along = bar.along(now, from, to), across = bar.across(now, from, to + 1);
    const double expected = bar.scene.setup.step.gravity.x * (length - (from + to + 1) / 2.0) * h / young;
    std::printf("nu %.2f: E %.4f of the formula's, nu %.4f\n", poisson_ratio, expected / along, -across / along);
    EXPECT_NEAR(expected / along, 1, 0.05) << poisson_ratio;
    EXPECT_NEAR(-across / along, poisson_ratio, 0.02);
  }
}

// Its middle stretched by a fifth, a bar keeps its volume within 2 %; without a share it gains a fifth.
TEST_P(VolumeKept, KeepsTheVolumeOfAStretchedBar) {
  for (const auto& [poisson_ratio, pulled] : {std::pair{0.45, 0.188}, {0.0, 0.2}}) {
    const int32_t length = 21, wide = 7, from = 6, to = 14;
    Bar bar(length, wide, share_of(poisson_ratio), 1e5 / (1 - 2 * poisson_ratio));
    constexpr int kFrames = 150;
    bar.scene.setup.substep_length.assign(kFrames, 0.004);
    bar.scene.setup.step.damping = 30;
    bar.hold(0, 2, {});
    bar.hold(length - 2, length, {pulled * (length - 2) * Bar::kSpacing, 0, 0});
    const State now = run(bar.scene);
    const double along = bar.along(now, from, to), across = bar.across(now, from, to + 1);
    const double volume = (1 + along) * (1 + across) * (1 + across);
    std::printf("nu %.2f: stretched by %.3f, volume %.4f\n", poisson_ratio, along, volume);
    EXPECT_NEAR(along, 0.2, 0.01);
    EXPECT_NEAR(volume, poisson_ratio > 0 ? 1 : 1.2, 0.02);
  }
}

INSTANTIATE_TEST_SUITE_P(Over, VolumeKept, ::testing::ValuesIn(tests::all_backends()),
                         [](const auto& named) { return named.param.name; });

}  // namespace
}  // namespace cutproof::volume_test
