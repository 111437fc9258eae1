// The ideal cut of tissue that moves: known where the tissue moves as a whole, and where it is shifted during the cut.
#include "oracles/comparison/carried_sweep.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <vector>

#include "oracles/comparison/cut_geometry.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles::carried_sweep_test {
namespace {

using tests::block_body;
using tests::convex_cell_skin;
using tests::range;
using tests::setup_of;
using tests::state_of;

constexpr double kH = 0.01;
// Where the map of the particles is exact: it is solved from sums of at most 100 terms, and the matrix that is inverted
// has 0.01 h² of a side of at most 2.5² h² at least, so rounding is below 100 · 625 u = 1e-11; and in what is counted
// along lines there is no rounding, as long as no line is that near to an edge.
constexpr double kRounding = 1e-9;  // [h], [h²]
constexpr int kFrames = 6;

// A block of 9 × 6 × 6 particles, which rest at x = 1 … 9 h, y, z = 1 … 6 h, and a plate at right angles to x that goes
// down through where it rests at x = 5 h in six frames, from z = 9 h to z = -1 h; both as `moved` at that time (of 0 to
// 6 frames) puts the tissue, and `blade_moved` the blade.
struct MovingCut {
  cutproof::Setup setup;
  std::vector<State> states;  // as each frame begins, and the last one's end
  CarriedSweep sweep;

  using Motion = std::function<Vec3(Vec3, double)>;
  // `gone`: whether a particle that rests there is gone when a frame begins.
  MovingCut(
      const Motion& moved, const Motion& blade_moved, double depth = 20,
      const std::function<bool(Vec3, int)>& gone = [](Vec3, int) { return false; })
      : setup(setup_of(block_body(9, 6, 6, kH), kFrames)), sweep(setup) {
    setup.has_blade = true;
    setup.blade = {20 * kH, depth * kH, 0, 0};
    const int substeps = setup.step.substeps;
    setup.blade_moves.clear();
    const auto pose = [&](int k) {
      const double time = static_cast<double>(k) / substeps;
      const Vec3 edge = {5 * kH, 3.5 * kH, (9 - 10 * time / kFrames) * kH};
      const auto direction = [&](Vec3 d) { return blade_moved(edge + d, time) - blade_moved(edge, time); };
      return BladePose{blade_moved(edge, time), direction({0, 1, 0}), direction({0, 0, 1})};
    };
    for (int k = 0; k < kFrames * substeps; ++k) setup.blade_moves.push_back({pose(k), pose(k + 1), true, 0});
    const State rest = state_of(setup.body, {range(0, setup.body.particle_count())});
    for (int frame = 0; frame <= kFrames; ++frame) {
      State& state = states.emplace_back(rest);
      state.frame = frame;
      for (std::size_t i = 0; i < state.x.size(); ++i) {
        state.x[i] = moved(rest.x[i], frame);
        state.alive[i] = gone(rest.x[i], frame) ? 0 : 1;
      }
      if (frame > 0) sweep.add(states[static_cast<std::size_t>(frame) - 1], state);
    }
  }
  // With the particles gone that rest in layers x = `layer` h where z is above and below 3.5 h.
  CutGeometry without(int above, int below) const {
    State after = states.back();
    std::vector<int32_t> gone;
    for (int32_t k = 0; k < 6; ++k) {
      for (int32_t j = 0; j < 6; ++j) gone.push_back((k >= 3 ? above : below) - 1 + 9 * (j + 6 * k));
    }
    tests::remove_particles(after, gone);
    after.skin = convex_cell_skin(setup, after);
    return cut_geometry(setup, states.front(), after, sweep.surface());
  }
};

Vec3 still(Vec3 p, double) { return p; }
// Turns about the block's middle and drifts, all in all by 1.2 radians and 30 h.
Vec3 rigidly(Vec3 p, double time) {
  const Vec3 middle = {5 * kH, 3.5 * kH, 3.5 * kH};
  const double angle = 0.2 * time, c = std::cos(angle), s = std::sin(angle);
  const Vec3 d = p - middle;
  return middle + Vec3{c * d.x - s * d.y, s * d.x + c * d.y, d.z} + Vec3{5 * kH * time, 0, 0};
}

TEST(CarriedSweep, OfTissueThatLiesStillIsTheSweep) {
  const MovingCut cut(still, still);
  const CutGeometry carried = cut.without(5, 5);
  State after = cut.states.back();
  const CutGeometry swept = cut_geometry(cut.setup, cut.states.front(), after);
  EXPECT_NEAR(carried.cut_area, 6 * 6, kRounding);
  EXPECT_NEAR(carried.cut_area, swept.cut_area, kRounding);
  EXPECT_EQ(carried.least_per_area.value(), 1);
  EXPECT_NEAR(carried.skin_to_ideal.value(), 0.5, kRounding);
  // Where it is within reach of the tissue, and nowhere else.
  for (const auto& triangle : cut.sweep.surface()) {
    for (const Vec3 p : triangle) {
      EXPECT_NEAR(p.x, 5 * kH, kRounding * kH);
      EXPECT_LT(p.z, (6 + CarriedSweep::kReach) * kH);
    }
  }
}

// Straight ways between the states of two frames are chords of the turn, of φ = 0.2 radians. What goes along them is
// drawn together towards the middle of the block, which lies in the cut, and turned by
//   arg(1 - s + s e^iφ) = s φ - s (1 - s) (1 - 2 s) φ³ / 6 + …
// after the share s of the frame: at most 0.0963 φ³ / 6 = 1.3e-4 less or more than the blade. So of the tissue, which
// reaches 3 h to either side of the middle, points of the cut are at most 4e-4 h off. Rows of them lie 0.2 h apart or
// more; so triangles are tilted by less than 2 · 4e-4 / 0.2 = 4e-3, and of their area 8e-6 at most is lost.
TEST(CarriedSweep, TurnsAndDriftsWithTheTissue) {
  const MovingCut cut(rigidly, rigidly);
  const CutGeometry carried = cut.without(5, 5);
  EXPECT_NEAR(carried.cut_area, 6 * 6, 8e-6 * 36);
  EXPECT_NEAR(carried.least_per_area.value() * carried.cut_area, 36, kRounding);
  EXPECT_NEAR(carried.skin_to_ideal.value(), 0.5, 4e-4);
  // From the outermost lines, h / 8 within the tissue, to the skin, which ends at the outermost particles.
  EXPECT_NEAR(carried.ideal_to_skin.value(), std::hypot(0.5, 3.0 / 8, 3.0 / 8), 4e-4);
  // Where the blade went in the world it met no tissue at rest at all: it comes down to z = 6.5 h after 1.5 frames, and
  // there, 7.5 h to the side and turned by 0.3 radians, it is beyond x = 9.5 h.
  State after = cut.states.back();
  EXPECT_EQ(cut_geometry(cut.setup, cut.states.front(), after).cut_area, 0);
}

// Tissue that is shifted to the side by 2 h while the blade is half way through: the cut lies in x = 5 h above, and in
// x = 3 h below, and that is where particles have to be gone.
TEST(CarriedSweep, LiesWhereTheTissueWasWhenTheBladePassed) {
  const auto shifted = [](Vec3 p, double time) { return p + Vec3{(time > 3.2 ? 2 : 0) * kH, 0, 0}; };
  // Of frame 3, in which it is shifted, the blade passes z = 4 h to 2.33 h.
  const MovingCut cut(shifted, still);
  const CutGeometry right = cut.without(5, 3);
  // Between, the cut slants from (5, 4) h to (3, 7/3) h. The skin's vertex that is farthest from it lies over the
  // uppermost particle that is gone below, at (3, 3.5) h: |(-2, -1/2) × (-2, -5/3)| / |(2, 5/3)|.
  const double slant = std::hypot(2, 5.0 / 3);
  EXPECT_NEAR(right.hausdorff().value(), (10.0 / 3 - 1) / slant, kRounding);
  // The far side of a gap that is 2 h off.
  EXPECT_NEAR(cut.without(5, 5).hausdorff().value(), 2.5, kRounding) << "a cut where the blade was in the world is off";
  EXPECT_NEAR(cut.without(3, 3).hausdorff().value(), 2.5, kRounding);
  // In the frame in which the tissue is shifted the blade passes 5/3 h of it, and comes 2 h to the side. Of the rows of
  // lines along x, h/4 apart, six or seven are counted as slanting instead of 20/3: each row is 6 h wide, and a
  // slanting one counts less by its normal. Of those along z eight slant, which is right.
  const double area = 6 * (6 - 5.0 / 3 + slant), row = 6 * 0.25 * (1 - 5.0 / 3 / slant);
  EXPECT_NEAR(right.cut_area, area, 2.0 / 3 * row + kRounding);
  // What comes behind the cutting edge cuts nothing: the back of a blade of 2 h passes where the tissue is open.
  EXPECT_NEAR(MovingCut(shifted, still, 2).without(5, 3).cut_area, area, 2.0 / 3 * row + kRounding);
}

// Of bent tissue, of which the blade takes particles away, each frame's particles say something else of where a point
// rests. The surface goes on from frame to frame all the same: none of its edges inside the tissue has one triangle.
TEST(CarriedSweep, HasNoGapsBetweenFrames) {
  const auto bent = [](Vec3 p, double) { return p + Vec3{4 * p.z * p.z, 0, 0}; };  // by 1.44 h at the top
  const auto passed = [](Vec3 p, int frame) {
    return std::abs(p.x - 5 * kH) < 0.1 * kH && p.z > (9 - 10.0 * frame / kFrames) * kH;
  };
  const MovingCut cut(bent, still, 20, passed);
  using Edge = std::array<std::array<double, 3>, 2>;
  std::map<Edge, int> triangles;
  for (const auto& triangle : cut.sweep.surface()) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 p = triangle[k], q = triangle[(k + 1) % 3];
      Edge edge = {{{p.x, p.y, p.z}, {q.x, q.y, q.z}}};
      if (edge[1] < edge[0]) std::swap(edge[0], edge[1]);
      ++triangles[edge];
    }
  }
  int inside = 0;
  for (const auto& [edge, count] : triangles) {
    const auto within = [&ends = edge](std::size_t axis) {
      return std::min(ends[0][axis], ends[1][axis]) > 0.5 * kH && std::max(ends[0][axis], ends[1][axis]) < 6.5 * kH;
    };
    if (!within(1) || !within(2)) continue;
    ++inside;
    EXPECT_EQ(count, 2) << "at y = " << edge[0][1] / kH << " h, z = " << edge[0][2] / kH << " h";
  }
  EXPECT_GT(inside, 1000);
}

TEST(CarriedSweep, StretchedTissueIsCutAsFarAsItRests) {
  // Twice as long along z, about z = 3.5 h: the blade passes from z = 9 h, which rests at 6.25 h, to -1 h: 1.25 h.
  const auto stretched = [](Vec3 p, double) { return Vec3{p.x, p.y, 3.5 * kH + 2 * (p.z - 3.5 * kH)}; };
  const MovingCut cut(stretched, still);
  // From the top, 6.5 h, down to 1.25 h. That is half way between two rows of lines, h/8 from each, and what the map is
  // drawn towards a rotation moves the end by less: by about 1 % of how far it is from the middle of what is near.
  EXPECT_NEAR(cut.without(5, 5).cut_area, 6 * (6.5 - 1.25), kRounding);
}

// At its edge tissue is on one side alone, and only its stretch tells where a point rests: a blade that goes flat
// through the uppermost particles, of tissue that is half as high again. Within reach are two layers, 1.5 h apart; let
// the lower have the share w of the weight, which is at most a half, because it is farther. Then p is 1.5 w h above the
// middle, and the square of the spread is 2.25 w (1 - w) h², to which 0.01 h² towards the rotation is added. So of the
// difference between 1 and 2/3 a share of at most 0.01 / (2.25 w (1 - w)) is taken for what is not determined, and
// p is carried off by 0.5 w · 0.01 / (2.25 w (1 - w)) <= 0.0045 h; as much again where, at a side, the middles of the
// two layers do not lie above each other.
TEST(CarriedSweep, KnowsByTheStretchWhereTheEdgeRests) {
  cutproof::Setup setup = setup_of(block_body(9, 6, 6, kH), 1);
  setup.has_blade = true;
  setup.blade = {20 * kH, 20 * kH, 0, 0};
  setup.blade_moves.clear();
  const int substeps = setup.step.substeps;
  const auto height = [](double rest) { return 3.5 * kH + 1.5 * (rest - 3.5 * kH); };
  const auto pose = [&](int k) {
    return BladePose{{(12 - 14.0 * k / substeps) * kH, 3.5 * kH, height(6 * kH)}, {0, 1, 0}, {1, 0, 0}};
  };
  for (int k = 0; k < substeps; ++k) setup.blade_moves.push_back({pose(k), pose(k + 1), true, 0});
  State before = state_of(setup.body, {range(0, setup.body.particle_count())});
  for (Vec3& x : before.x) x.z = height(x.z);
  State after = before;
  after.frame = 1;
  CarriedSweep sweep(setup);
  sweep.add(before, after);
  int points = 0;
  for (const auto& triangle : sweep.surface()) {
    for (const Vec3 p : triangle) {
      if (p.x < 1 * kH || p.x > 9 * kH || p.y < 1 * kH || p.y > 6 * kH) continue;
      ++points;
      EXPECT_NEAR(p.z, 6 * kH, 0.009 * kH);
    }
  }
  EXPECT_GT(points, 1000);
}

TEST(CarriedSweep, IsNothingWithoutABladeThatIsDown) {
  MovingCut cut(still, still);
  for (BladeMove& move : cut.setup.blade_moves) move.down = false;
  CarriedSweep sweep(cut.setup);
  EXPECT_FALSE(sweep.wants(0));
  sweep.add(cut.states[0], cut.states[1]);
  EXPECT_TRUE(sweep.surface().empty());
  cut.setup.has_blade = false;
  EXPECT_FALSE(sweep.wants(0));
}

TEST(CarriedSweep, KnowsNoFrameThatTheSetupHasNot) {
  MovingCut cut(still, still);
  const CarriedSweep sweep(cut.setup);
  EXPECT_TRUE(sweep.wants(0) && sweep.wants(kFrames - 1));
  using Limits = std::numeric_limits<int64_t>;
  for (const int64_t frame : {int64_t{-1}, int64_t{kFrames}, Limits::min(), Limits::max()}) {
    EXPECT_FALSE(sweep.wants(frame)) << frame;
    CarriedSweep added(cut.setup);
    State before = cut.states[2];
    before.frame = frame;
    added.add(before, cut.states[3]);
    EXPECT_TRUE(added.surface().empty()) << frame;
  }
}

// The surface of a cut in which `harm` is done to the states before.
template <class Harm>
std::vector<std::array<Vec3, 3>> surface_of_harmed(const MovingCut& cut, const Harm& harm) {
  std::vector<State> states = cut.states;
  for (State& state : states) harm(state);
  CarriedSweep sweep(cut.setup);
  for (std::size_t frame = 0; frame < kFrames; ++frame) sweep.add(states[frame], states[frame + 1]);
  return sweep.surface();
}

// A particle beside the cut that is nowhere, or beyond all numbers of cells, counts as one that is gone.
TEST(CarriedSweep, PassesOverParticlesThatAreNowhere) {
  const MovingCut cut(rigidly, rigidly);
  constexpr std::size_t kBeside = 4 + 9 * (2 + 6 * 2);  // x = 5 h, y = z = 3 h
  const auto gone = surface_of_harmed(cut, [&](State& state) { state.alive[kBeside] = 0; });
  EXPECT_NE(gone, cut.sweep.surface());
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();
  for (const double wrong : {kNaN, kInfinity, -kInfinity, 1e300, -1e300, 1e30, -1e30}) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto place = [&](State& state) { state.x[kBeside][axis] = wrong; };
      EXPECT_EQ(surface_of_harmed(cut, place), gone) << wrong;
    }
  }
  // In one of the states only: gone in the two frames that it bounds.
  CarriedSweep once(cut.setup), without(cut.setup);
  for (std::size_t frame = 0; frame < kFrames; ++frame) {
    State before = cut.states[frame], after = cut.states[frame + 1];
    (frame == 3 ? before : after).x[kBeside].z = frame == 3 || frame == 2 ? kNaN : after.x[kBeside].z;
    once.add(before, after);
    before = cut.states[frame];
    if (frame == 3 || frame == 2) before.alive[kBeside] = 0;
    without.add(before, cut.states[frame + 1]);
  }
  EXPECT_EQ(once.surface(), without.surface());
}

TEST(CarriedSweep, HasNoSurfaceInAFrameWhoseStatesAreNotWellFormed) {
  const MovingCut cut(still, still);
  // Short in the state between the third frame and the fourth: neither has a surface, and none leads across.
  std::vector<State> states = cut.states;
  states[3].x.resize(100);
  CarriedSweep sweep(cut.setup);
  std::size_t before = 0;
  for (std::size_t frame = 0; frame < kFrames; ++frame) {
    sweep.add(states[frame], states[frame + 1]);
    if (frame == 1) before = sweep.surface().size();
    if (frame == 2 || frame == 3) {
      EXPECT_EQ(sweep.surface().size(), before);
    }
  }
  ASSERT_GT(before, 0);
  ASSERT_GT(sweep.surface().size(), before);
  // The edge is at z = 9 - 10/6 k h after k frames.
  for (std::size_t t = before; t < sweep.surface().size(); ++t) {
    for (const Vec3 p : sweep.surface()[t]) EXPECT_LT(p.z, (9 - 40.0 / 6 + 1e-9) * kH);
  }
  const auto all_short = [](State& state) { state.x.resize(1); };
  EXPECT_TRUE(surface_of_harmed(cut, all_short).empty());
}

// Nobody says how a single particle is turned: then it is not.
TEST(CarriedSweep, FewParticlesAreCarriedAsFarAsTheySay) {
  cutproof::Setup setup = setup_of(block_body(1, 1, 1, kH), 1);
  setup.has_blade = true;
  setup.blade = {20 * kH, 20 * kH, 0, 0};
  setup.blade_moves.clear();
  const int substeps = setup.step.substeps;
  for (int k = 0; k < substeps; ++k) {
    const auto pose = [&](int at) {
      return BladePose{{8 * kH, kH, (3 - 4.0 * at / substeps) * kH}, {0, 1, 0}, {0, 0, 1}};
    };
    setup.blade_moves.push_back({pose(k), pose(k + 1), true, 0});
  }
  State before = state_of(setup.body, {{0}});
  before.x[0] = before.x[0] + Vec3{7 * kH, 0, 0};
  State after = before;
  after.frame = 1;
  CarriedSweep sweep(setup);
  sweep.add(before, after);
  const CutGeometry geometry = cut_geometry(setup, before, after, sweep.surface());
  EXPECT_NEAR(geometry.cut_area, 1, kRounding);
}

}  // namespace
}  // namespace cutproof::oracles::carried_sweep_test
