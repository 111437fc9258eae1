// The reference solution against solutions that owe nothing to it: a parabola, and a sparse factorisation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "benchmarks/prepared_scene.h"
#include "model/io/scene_io.h"
#include "oracles/comparison/reference_solution.h"
#include "oracles/relations/relations.h"
#include "reference_cpu/reference.h"
#include "tuning/reference_solution.h"

namespace cutproof::tuning::refinement_test {
namespace {

using benchmarks::PreparedScene;

Scene scene_of(const std::string& text) { return io::parse_scene(text, "test"); }

constexpr const char* kFalling = R"({"version": 5, "name": "falling",
  "body": {"shape": {"kind": "box", "size": [0.04, 0.03, 0.03]}, "spacing": 0.01},
  "frame": {"length": 0.016, "count": 6}, "step": {"acceleration": "none", "gravity": [0, 0, -9.81]}})";

// A body that falls freely: x = g t² / 2. Implicit Euler falls g t dt / 2 farther.
TEST(ReferenceSolution, OfShortTimeStepsIsTheParabola) {
  const ReferenceSolution solution(ReferenceKind::limit, scene_of(kFalling), "test", {}, 1e-6);
  const double h = 0.01, g = 9.81, t = 6 * 0.016;
  ASSERT_EQ(solution.trajectory().frames.size(), 6u);
  const PreparedScene prepared(scene_of(kFalling), "test", {});
  const double fallen = solution.trajectory().frames.back().x[0].z - prepared.start().x[0].z;
  // 1e-6 h cannot be reached: the last level allowed is taken.
  const int32_t substeps = solution.levels().back().substeps;
  EXPECT_EQ(substeps, ReferenceSolution::kMostSubsteps);
  const double dt = 0.016 / substeps;
  EXPECT_NEAR(fallen, -g * t * t / 2 - g * t * dt / 2, 1e-9 * h);
  EXPECT_NEAR(solution.known_to_h(), g * t * dt / 2 / h, 1e-9);
  EXPECT_LE(std::abs(fallen + g * t * t / 2) / h, 1.0001 * solution.known_to_h());
}

TEST(ReferenceSolution, IsRefinedUntilItIsKnown) {
  const ReferenceSolution rough(ReferenceKind::limit, scene_of(kFalling), "test", {}, 1);
  EXPECT_EQ(rough.levels().size(), 3u) << "two distances tell how fast it comes nearer";
  EXPECT_FALSE(rough.levels().front().apart_h);
  EXPECT_NEAR(rough.known_to_h(), *rough.levels().back().apart_h, 1e-9) << "first order";
  EXPECT_FALSE(observed_order(rough.levels(), 0));
  EXPECT_FALSE(observed_order(rough.levels(), 1)) << "one distance has not fallen";
  EXPECT_NEAR(observed_order(rough.levels(), 2).value(), 1, 1e-6);
  ReferenceSolution fine(ReferenceKind::limit, scene_of(kFalling), "test", {}, 0.005);
  EXPECT_GT(fine.levels().size(), 3u);
  EXPECT_LE(fine.known_to_h(), 0.005);
  const std::size_t levels = fine.levels().size();
  fine.refine();
  EXPECT_EQ(fine.levels().size(), levels + 1);
  EXPECT_TRUE(fine.nothing_removed());
}

TEST(ReferenceSolution, TellsTheOrderInWhichItsLevelsComeNearer) {
  const auto order = [](std::optional<double> before, std::optional<double> after) {
    const std::vector<RefinementLevel> levels = {{1, 1, {}, {}}, {2, 1, before, {}}, {4, 1, after, {}}};
    return observed_order(levels, 2);
  };
  EXPECT_DOUBLE_EQ(order(0.4, 0.1).value(), 2);
  EXPECT_DOUBLE_EQ(order(0.1, 0.2).value(), -1);
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(order({}, 0.1));
  EXPECT_FALSE(order(infinity, 0.1));
  EXPECT_FALSE(order(0.1, infinity));
  EXPECT_FALSE(order(1e-8, 1e-10)) << "rounding";
}

// Distances that fall by r from level to level are followed by 1 / r, 1 / r², … of the last one.
TEST(ReferenceSolution, IsKnownAsItsLevelsComeNearer) {
  const auto known = [](std::vector<double> apart) {
    std::vector<RefinementLevel> levels(1);
    for (const double distance : apart) levels.push_back({1, 1, distance, {}});
    return remaining_error(levels);
  };
  EXPECT_DOUBLE_EQ(known({1, 0.5, 0.25}), 0.25);                         // first order
  EXPECT_DOUBLE_EQ(known({1, 0.1, 0.01}), 0.01);                         // faster: not less than the last
  EXPECT_DOUBLE_EQ(known({0.068, 0.042}), 0.042 / (0.068 / 0.042 - 1));  // slower: more
  double series = 0;
  for (double term = 0.8 * 0.5; term > 1e-16; term *= 0.8) series += term;
  EXPECT_NEAR(known({0.5 / 0.8, 0.5}), series, 1e-12);
  constexpr double kNothing = std::numeric_limits<double>::infinity();
  EXPECT_EQ(known({0.043, 0.048}), kNothing);  // no nearer
  EXPECT_EQ(known({0.05, 0.05}), kNothing);
  EXPECT_DOUBLE_EQ(known({0.6, 0.5, 0.01}), 0.05) << "a lucky last one: by the least factor, 1.2";
  EXPECT_EQ(known({0.052, 0.15, 0.010}), kNothing) << "a lucky last one after one that was no nearer";
  EXPECT_EQ(known({kNothing, 0.05}), kNothing) << "the level before had other parts";
  EXPECT_EQ(known({kNothing, 0.1, 0.05}), 0.05);
  EXPECT_EQ(known({0.05, kNothing}), kNothing);
  EXPECT_EQ(known({0.05}), kNothing) << "one distance tells nothing of the next";
  EXPECT_EQ(known({}), kNothing);
  EXPECT_EQ(known({1e-15, 2e-15}), 2e-15) << "what rounding leaves does not fall";
  const auto text = [](std::vector<double> apart) {
    std::vector<RefinementLevel> levels(1);
    for (const double distance : apart) levels.push_back({1, 1, distance, {}});
    return known_to(levels);
  };
  EXPECT_EQ(text({1, 0.5, 0.25}), "known to 0.25 h");
  EXPECT_NE(text({0.043, 0.048}).find("keep falling"), std::string::npos);
  EXPECT_NE(text({kNothing, 0.05}).find("other parts"), std::string::npos);
}

// However near levels are, a removal that falls between two of them makes a distance of its own. Of the liver, with
// retardation, levels of 64, 128, 256 and 512 substeps are 0.019, 0.0097, 0.0093 and 0.080 h from the one before:
// the third level would be known to 0.010 h.
TEST(ReferenceSolution, IsNotKnownWhileItsLastThreeLevelsRemoveOtherParticlesOrInOtherFrames) {
  struct Level {
    double apart_h;
    int64_t in_another_frame, alive_in_one;
  };
  const auto levels_of = [](const std::vector<Level>& given) {
    std::vector<RefinementLevel> levels(1);
    for (const Level& level : given) {
      levels.push_back({1, 1, level.apart_h, {level.in_another_frame, level.alive_in_one, 0}, {}});
    }
    return levels;
  };
  const auto known = [&](const std::vector<Level>& given) { return remaining_error(levels_of(given)); };
  constexpr double kNothing = std::numeric_limits<double>::infinity();
  EXPECT_EQ(known({{0.019, 6, 2}, {0.0097, 1, 0}}), kNothing) << "the liver";
  EXPECT_EQ(known({{0.032, 8, 5}, {0.0097, 0, 0}}), kNothing) << "detection in every substep: 0.053 h follow";
  EXPECT_EQ(known({{1, 0, 0}, {0.5, 1, 0}}), kNothing);
  EXPECT_EQ(known({{1, 0, 0}, {0.5, 0, 1}}), kNothing);
  EXPECT_EQ(known({{1, 0, 1}, {0.5, 0, 0}}), kNothing);
  EXPECT_EQ(known({{1e-3, 0, 1}, {1e-12, 0, 0}}), kNothing) << "not by rounding either";
  EXPECT_DOUBLE_EQ(known({{1, 0, 0}, {0.5, 0, 0}}), 0.5);
  EXPECT_DOUBLE_EQ(known({{2, 1, 1}, {1, 0, 0}, {0.5, 0, 0}}), 0.5) << "three levels that agree";
  EXPECT_NE(known_to(levels_of({{0.019, 6, 2}, {0.0097, 1, 0}})).find("do not remove the same"), std::string::npos);
  EXPECT_NE(known_to(levels_of({{0.05, 0, 0}, {0.05, 0, 0}})).find("keep falling"), std::string::npos);
}

// A block is pulled aside by its end and comes to rest again, where every solution is the same: in the end nothing is
// seen any more of how far they were apart.
TEST(ReferenceSolution, IsKnownToTheGreatestDistanceOfAnyFrame) {
  Scene scene = scene_of(R"({"version": 5, "name": "pulled",
    "body": {"shape": {"kind": "box", "size": [0.08, 0.03, 0.03]}, "spacing": 0.01}, "clusters": {"side": 2},
    "frame": {"length": 0.016, "count": 40}, "step": {"acceleration": "none", "substeps": 1, "stiffness": 3e5, "damping": 40},
    "grips": [{"low": [0, 0, 0], "high": [0.2, 1, 1], "end": 0.064, "velocity": [0, 0, 0.3]},
              {"low": [0, 0, 0], "high": [0.2, 1, 1], "start": 0.064}]})");
  const ReferenceSolution solution(ReferenceKind::substeps, scene, "test", {}, 1);
  ASSERT_EQ(solution.levels().size(), 3u);
  std::vector<std::vector<std::vector<Vec3>>> runs;  // of each level, frame by frame
  for (const RefinementLevel& level : solution.levels()) {
    scene.step.iterations = level.iterations.value();
    const PreparedScene prepared(scene, "test", {});
    const std::unique_ptr<Backend> backend = reference::make_backend();
    prepared.run(*backend, [&, frames = &runs.emplace_back()](double) {
      frames->push_back(backend->snapshot().front().x);
      return true;
    });
  }
  const auto apart = [&](std::size_t level) {
    std::vector<double> distances;
    for (std::size_t f = 0; f < runs[level].size(); ++f) {
      double squares = 0;
      for (std::size_t i = 0; i < runs[level][f].size(); ++i) {
        const Vec3 d = runs[level][f][i] - runs[level - 1][f][i];
        squares += dot(d, d);
      }
      distances.push_back(std::sqrt(squares / static_cast<double>(runs[level][f].size())) / 0.01);
    }
    return distances;
  };
  const std::vector<double> first = apart(1), last = apart(2);
  const double before = *std::max_element(first.begin(), first.end());
  const double greatest = *std::max_element(last.begin(), last.end());
  ASSERT_GT(greatest, 1e-3);
  ASSERT_LT(last.back(), greatest / 10) << "the error does not peak in the middle, so this shows nothing";
  ASSERT_GT(before, greatest);
  const double known = std::max(greatest, greatest / (before / greatest - 1));
  EXPECT_NEAR(solution.known_to_h(), known, 1e-9 * known);
}

// Each substep solved exactly, one after the other, by Cholesky factorisation.
TEST(ReferenceSolution, OfItsOwnSubstepsIsWhatASparseFactorisationFinds) {
  const Scene scene = scene_of(R"({"version": 5, "name": "hanging",
    "body": {"shape": {"kind": "box", "size": [0.08, 0.03, 0.03]}, "spacing": 0.01}, "clusters": {"side": 2},
    "frame": {"length": 0.016, "count": 5},
    "step": {"acceleration": "none", "substeps": 2, "gravity": [0, 0, -9.81], "damping": 3},
    "grips": [{"low": [0, 0, 0], "high": [0.2, 1, 1]}]})");
  const ReferenceSolution solution(ReferenceKind::substeps, scene, "test", {}, 1e-9);
  EXPECT_EQ(solution.levels().back().substeps, 2);
  EXPECT_LE(solution.known_to_h(), 1e-9);

  const PreparedScene prepared(scene, "test", {});
  State state = prepared.start();
  double moved = 0;
  // Every substep is like the first: no blade, and what is held stays where it is.
  const cutproof::Setup single = oracles::single_substep_setup(prepared.setup(), 0);
  const double dt = single.substep_length.front(), decay = std::exp(-single.step.damping * dt);
  for (std::size_t f = 0; f < 5; ++f) {
    for (int substep = 0; substep < 2; ++substep) {
      oracles::ReferenceSolution exact = oracles::reference_solution(single, state);
      ASSERT_TRUE(exact.converged);
      for (std::size_t i = 0; i < state.x.size(); ++i) state.v[i] = (decay / dt) * (exact.x[i] - state.x[i]);
      state.x = std::move(exact.x);
      state.clusters.rotation = std::move(exact.rotation);
    }
    const oracles::Pose pose{state.x, state.alive, 1}, rest{prepared.start().x, state.alive, 1};
    EXPECT_LE(oracles::poses_apart(prepared.setup(), pose, solution.trajectory().frames[f]).position.max, 1e-8) << f;
    moved = std::max(moved, oracles::poses_apart(prepared.setup(), pose, rest).position.max);
  }
  EXPECT_GT(moved, 0.05) << "it hangs from a grip: it has to move, else nothing is compared";
}

// A press on a floor with friction, and its cut.
Scene pressed() {
  return scene_of(R"({"version": 5, "name": "pressed",
    "body": {"shape": {"kind": "box", "size": [0.06, 0.03, 0.03]}, "spacing": 0.01}, "clusters": {"side": 2},
    "frame": {"length": 0.016, "count": 24}, "step": {"substeps": 2, "gravity": [0, 0, -9.81], "damping": 5},
    "ground": {"friction": 0.4}, "detect": {"criterion": "distance", "remove": "one"},
    "blade": {"length": 0.08, "depth": 0.06, "speed": 0.15, "friction": 0.2, "strokes": [
      {"points": [[0.5, 0.5, 1.3], [0.5, 0.5, 0.2]], "along": [0, 1, 0]}]}})");
}

// All of a state, after every frame: positions, velocities, rotations, what contacts have done, and who was removed.
TEST(SolvedSteps, AreTheReferencesWithIterationsThatAreEnough) {
  Scene scene = pressed();
  scene.step.iterations = 600;
  scene.step.acceleration = Acceleration::none;
  const PreparedScene prepared(scene, "test", {});
  const cutproof::Setup& setup = prepared.setup();
  const double h = setup.body.grid.spacing, dt = setup.substep_length.front();
  double mass = 0;
  for (const double m : setup.body.mass) mass += m;
  const auto iterated = reference::make_backend();
  SolvedSteps solved;
  iterated->load({setup}, {prepared.start()});
  solved.load({setup}, {prepared.start()});
  double impulses = 0;
  int64_t removed = 0;
  for (int64_t frame = 0; frame < setup.frame_count(); ++frame) {
    iterated->run(Span{});
    solved.run(Span{});
    const State a = iterated->snapshot().front(), b = solved.snapshot().front();
    ASSERT_EQ(a.frame, b.frame);
    ASSERT_EQ(a.removed, b.removed) << frame;
    ASSERT_EQ(a.alive, b.alive) << frame;
    ASSERT_EQ(a.clusters.members, b.clusters.members) << frame;
    for (std::size_t i = 0; i < a.x.size(); ++i) {
      ASSERT_LE(norm(a.x[i] - b.x[i]), 1e-8 * h) << frame;
      ASSERT_LE(norm(a.v[i] - b.v[i]) * dt, 1e-8 * h) << frame;
    }
    for (std::size_t c = 0; c < a.clusters.rotation.size(); ++c) {
      for (std::size_t k = 0; k < 9; ++k) {
        ASSERT_NEAR(a.clusters.rotation[c].m[k], b.clusters.rotation[c].m[k], 1e-8) << frame;
      }
    }
    ASSERT_LE(norm(a.impulse - b.impulse) * dt / mass, 1e-8 * h) << frame;
    impulses = std::max(impulses, norm(a.impulse) * dt / mass / h);
    removed += static_cast<int64_t>(a.removed.size());
  }
  EXPECT_GT(impulses, 1e-3);
  EXPECT_GT(removed, 0);
  EXPECT_EQ(solved.count().by_iteration, 0);
  EXPECT_EQ(solved.count().substeps, setup.frame_count() * setup.step.substeps);
}

// After levels of the reference comes one in which every substep is solved, and meets them. It is the last, and none of
// it is the reference's step.
TEST(ReferenceSolution, OfItsOwnSubstepsEndsWithEachOfThemSolved) {
  const Scene scene = pressed();
  ReferenceSolution solution(ReferenceKind::substeps, scene, "test", {}, 1e-7);
  ASSERT_TRUE(solution.levels().back().iterations);
  const std::size_t levels = solution.levels().size();
  solution.refine();
  ASSERT_EQ(solution.levels().size(), levels + 1);
  const RefinementLevel& last = solution.levels().back();
  EXPECT_FALSE(last.iterations);
  EXPECT_GE(last.solved.substeps, 48);
  EXPECT_EQ(last.solved.by_iteration, 0);
  EXPECT_LE(*last.apart_h, 1e-7);
  EXPECT_FALSE(solution.nothing_removed()) << "no cut, so this shows less than it should";
  solution.refine();
  EXPECT_EQ(solution.levels().size(), levels + 1) << "there is none after it";
}

// Where iterations do not lead far enough: the answer is had all the same, and what they lack shows.
TEST(ReferenceSolution, IsSolvedWhereIterationsAreTooFew) {
  const Scene scene = scene_of(R"({"version": 5, "name": "stiff",
    "body": {"shape": {"kind": "box", "size": [0.16, 0.02, 0.02]}, "spacing": 0.01}, "clusters": {"side": 2},
    "frame": {"length": 0.016, "count": 4},
    "step": {"acceleration": "none", "substeps": 1, "stiffness": 1e7, "gravity": [0, 0, -9.81]},
    "grips": [{"low": [0, 0, 0], "high": [0.1, 1, 1]}]})");
  const ReferenceSolution solution(ReferenceKind::substeps, scene, "test", {}, 1e-6);
  EXPECT_FALSE(solution.levels().back().iterations);
  EXPECT_EQ(solution.levels()[solution.levels().size() - 2].iterations, ReferenceSolution::kMostIterations);
  EXPECT_EQ(solution.levels().back().solved.unsolved, 0);
  EXPECT_GT(*solution.levels().back().apart_h, 1e-6);
}

// A blade so fast that its frames are divided: those of the scene are counted all the same, and each part runs once.
TEST(PreparedScene, CountsFramesOfTheSceneWhereTheyAreDivided) {
  const Scene scene = scene_of(R"({"version": 5, "name": "cut",
    "body": {"shape": {"kind": "box", "size": [0.05, 0.03, 0.03]}, "spacing": 0.01}, "clusters": {"side": 2},
    "frame": {"length": 0.016, "settle": 0.04}, "step": {"acceleration": "none", "substeps": 1},
    "detect": {"criterion": "distance", "remove": "both"},
    "blade": {"speed": 2, "start": 0.03, "strokes": [
      {"points": [[0.3, 0.5, 1.5], [0.3, 0.5, -0.5]], "along": [0, 1, 0], "pause": 0.02},
      {"points": [[0.7, 0.5, 1.5], [0.7, 0.5, -0.5]], "along": [0, 1, 0]}]}})");
  const PreparedScene prepared(scene, "test", {});
  const cutproof::Setup& setup = prepared.setup();
  int64_t parts = 0;
  double time = 0;
  std::vector<int64_t> expected(setup.stroke_end.size(), -1);
  for (int64_t frame = 0; frame < prepared.frame_count(); ++frame) {
    double length = 0;
    prepared.for_parts_of(frame, [&] {
      for (std::size_t s = 0; s < expected.size(); ++s) {
        if (setup.stroke_end[s] == parts) expected[s] = frame;
      }
      length += setup.substep_length.at(static_cast<std::size_t>(parts++));
    });
    EXPECT_NEAR(length, 0.016, 1e-12) << frame;
    time += length;
  }
  EXPECT_EQ(parts, setup.frame_count());
  EXPECT_GT(parts, prepared.frame_count()) << "no frame is divided, so this shows nothing";
  ASSERT_EQ(expected.size(), 2u);
  EXPECT_GE(expected[0], 2);
  EXPECT_GT(expected[1], expected[0]);
  EXPECT_LT(expected[1], prepared.frame_count() - 1);
  EXPECT_EQ(prepared.stroke_end(), expected);

  // Seconds add up, each frame of the scene is seen once, and a run ends where nobody wants to see more.
  const std::unique_ptr<Backend> backend = reference::make_backend();
  int64_t seen = 0;
  double before = 0;
  prepared.run(*backend, [&](double seconds) {
    EXPECT_GT(seconds, before);
    before = seconds;
    return ++seen < 3;
  });
  EXPECT_EQ(seen, 3);
  const std::vector<int64_t> ends = PreparedScene(scene, "test", 3).stroke_end();
  EXPECT_EQ(ends, (std::vector<int64_t>{expected[0] < 3 ? expected[0] : -1, -1}));
}

Trajectory trajectory(std::vector<int32_t> components, std::vector<int64_t> stroke_end) {
  Trajectory made;
  for (const int32_t count : components) made.frames.push_back({{}, {}, count});
  made.stroke_end = std::move(stroke_end);
  return made;
}

TEST(EventsApart, AreCountedByParticleAndByCluster) {
  const auto alive = [](std::vector<std::vector<uint8_t>> frames) {
    Trajectory made;
    for (std::vector<uint8_t>& frame : frames) made.frames.push_back({{}, std::move(frame), 1});
    return made;
  };
  // Of five particles one stays, one goes at once, one from the second frame on, and so on.
  const Trajectory solution = alive({{1, 0, 1, 1, 1}, {1, 0, 0, 1, 1}, {1, 0, 0, 0, 1}});
  const auto expect = [&](const Trajectory& other, int64_t in_another_frame, int64_t alive_in_one) {
    for (const bool swapped : {false, true}) {
      const EventsApart apart = swapped ? events_apart(other, solution) : events_apart(solution, other);
      EXPECT_EQ(apart.in_another_frame, in_another_frame);
      EXPECT_EQ(apart.alive_in_one, alive_in_one);
    }
  };
  expect(solution, 0, 0);
  expect(alive({{1, 1, 1, 1, 1}, {1, 0, 0, 1, 1}, {1, 0, 0, 0, 1}}), 1, 0);  // the second goes later
  expect(alive({{1, 0, 1, 1, 1}, {1, 0, 0, 0, 1}, {1, 0, 0, 0, 0}}), 1, 1);  // the fourth earlier, and the last one
  expect(alive({{1, 0, 1, 1, 1}, {1, 0, 1, 1, 1}, {1, 0, 1, 1, 1}}), 0, 2);
  // What comes after the last frame of the shorter one is not known of it.
  expect(alive({{1, 0, 1, 1, 1}, {1, 0, 0, 1, 1}}), 0, 0);
  expect({}, 0, 0);
  // Clusters, where both have the same particles.
  Trajectory one = solution, other = alive({{1, 1, 1, 1, 1}, {1, 0, 0, 1, 1}, {1, 0, 0, 0, 1}});
  for (Trajectory* made : {&one, &other}) made->frames[1].clusters = {3, 5, 7};
  one.frames[0].clusters = {1, 2};
  EXPECT_EQ(events_apart(one, other).clusters_in_one, 0) << "the first frame has other particles, too";
  other.frames[2].clusters = {9};
  EXPECT_EQ(events_apart(one, other).clusters_in_one, 1);
  other.frames[1].clusters = {2, 4, 5, 7, 8};
  EXPECT_EQ(events_apart(one, other).clusters_in_one, 3);
  EXPECT_EQ(events_apart(other, one).clusters_in_one, 3);
}

TEST(DifferenceInParts, IsSeenAtTheEndOfStrokesAndOfTheScene) {
  const Trajectory solution = trajectory({1, 1, 2, 2}, {1, 2});
  EXPECT_EQ(difference_in_parts(solution, solution), "");
  // A stroke may end in another frame: a blade takes whole substeps.
  EXPECT_EQ(difference_in_parts(solution, trajectory({1, 1, 1, 2, 2}, {1, 3})), "");
  EXPECT_NE(difference_in_parts(solution, trajectory({1, 2, 2, 2}, {1, 2})).find("after stroke 1"), std::string::npos);
  EXPECT_NE(difference_in_parts(solution, trajectory({1, 1, 2, 3}, {1, 2})).find("at the end"), std::string::npos);
  // Between them parts may come a frame earlier or later.
  EXPECT_EQ(difference_in_parts(trajectory({1, 1, 2, 2}, {}), trajectory({1, 2, 2, 2}, {})), "");
  // A stroke that one of the two does not reach is not compared.
  EXPECT_EQ(difference_in_parts(trajectory({1, 1}, {0, -1}), trajectory({1, 1}, {0, 1})), "");
}

}  // namespace
}  // namespace cutproof::tuning::refinement_test
