// All oracles together: on bodies at the limits, on broken states, and through the judge.
#include "oracles/oracles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <random>
#include <set>
#include <string>

#include "oracles/figures.h"
#include "oracles/surface/surface.h"
#include "tests/oracles/corruptions.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::oracles_test {
namespace {

using namespace cutproof::tests;

constexpr std::array<StateOracle, 10> kOracles = {
    well_formed, cluster_connectivity, coverage,    component_match, skin_match,
    isolation,   edge_cover,           rest_frames, finite,          merge_maximality};

TEST(OneStateOracles, AcceptASolidBlockWithItsSkin) {
  const Block block;
  for (const auto oracle : kOracles) {
    const Verdict verdict = oracle(block.setup, block.state);
    expect_holds(verdict);
    if (oracle != merge_maximality) {
      EXPECT_GT(verdict.checked, 0) << verdict.property;
    }
  }
}

TEST(OneStateOracles, AcceptABodyOfNoParticles) {
  const auto setup = setup_of(body_of({}));
  const State state = state_of(setup.body, {});
  for (const auto oracle : kOracles) expect_holds(oracle(setup, state));
  expect_holds(no_pass(setup, state));
}

TEST(OneStateOracles, AcceptABodyOfOneParticle) {
  auto setup = setup_of(block_body(1, 1, 1));
  State state = state_of(setup.body, {{0}}, 2, 10);
  state.edge_covered = true;
  state.skin = convex_cell_skin(setup, state);
  for (const auto oracle : kOracles) expect_holds(oracle(setup, state));
}

TEST(OneStateOracles, AcceptABodyThatIsCutAwayEntirely) {
  Block block;
  remove_particles(block.state, range(0, block.setup.body.particle_count()));
  block.state.clusters = clusters_of(block.setup.body, {});
  block.state.skin = {};
  block.state.frame = 3;
  for (const auto oracle : kOracles) expect_holds(oracle(block.setup, block.state));
}

TEST(Figures, HaveSixDigitsUnlessThoseHideWhatIsSaid) {
  EXPECT_EQ(figure(1.0000000000000002), "1");
  EXPECT_EQ(figure(1.0 / 3), "0.333333");
  EXPECT_EQ(figure_beside(1.0000000000000002, 1), "1.0000000000000002");
  EXPECT_EQ(figure_beside(1, 1), "1");
  EXPECT_EQ(figure_beside(0.25000004, 0.25), "0.25000004");
  EXPECT_EQ(figure_beside(kNan, kNan), figure(kNan));
  EXPECT_EQ(sentence("{} {:.3g} {} {}", 2.0 / 3, 2.0 / 3, 1'234'567, "h"), "0.666667 0.667 1234567 h");
}

TEST(OneStateOracles, SayThatTheyCouldNotJudgeAStateThatIsNotWellFormed) {
  Block block;
  block.state.clusters.members[5] = 1000;
  for (const auto oracle : kOracles) {
    const Verdict verdict = oracle(block.setup, block.state);
    EXPECT_FALSE(verdict.holds);
    if (oracle == well_formed) continue;
    EXPECT_NE(verdict.witness.text.find("could not be judged"), std::string::npos) << verdict.property;
    EXPECT_EQ(verdict.checked, 0);
  }
}

TEST(OneStateOracles, SurviveRandomCorruption) {
  constexpr uint64_t kSeed = 7;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  int64_t rejected = 0;
  for (int round = 0; round < 4000; ++round) {
    Block block(3, 3, 2);
    block.setup.has_blade = true;
    block.setup.blade_moves.assign(4, BladeMove{{}, {}, true, 0});
    const int count = 1 + static_cast<int>(random() % 3);
    for (int k = 0; k < count; ++k) corrupt(block.state, random);
    for (const auto oracle : kOracles) rejected += oracle(block.setup, block.state).holds ? 0 : 1;
    (void)no_pass(block.setup, block.state);
    (void)weak_couplings(block.setup, block.state);
    for (const PropertyList* list : properties()) {
      for (const Property& property : *list) {
        if (property.check_state != nullptr && round % 10 == 0) (void)ask(property, block.setup, block.state);
      }
    }
    if (round % 10 == 0) (void)judge(block.setup, block.state, round % 20 == 0, properties());
  }
  EXPECT_GT(rejected, 4000);
}

TEST(StageOracles, SayThatTheyCouldNotJudgeIfEitherStateIsNotWellFormed) {
  const Pair good = cut_row();
  for (const bool before : {true, false}) {
    Pair pair = good;
    (before ? pair.before : pair.after).clusters.members[0] = -5;
    for (const auto oracle : {detection, split_exactness, merge_legality, expansion}) {
      const Verdict verdict = oracle(pair.setup, pair.before, pair.after);
      EXPECT_FALSE(verdict.holds);
      EXPECT_NE(verdict.witness.text.find("could not be judged"), std::string::npos);
      EXPECT_NE(verdict.witness.text.find(before ? "before the stage" : "after the stage"), std::string::npos);
    }
  }
}

TEST(StageOracles, SurviveRandomCorruption) {
  constexpr uint64_t kSeed = 13;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  int64_t rejected = 0;
  for (int round = 0; round < 4000; ++round) {
    Pair pair = cut_row();
    pair.setup.split.debris = static_cast<int32_t>(random() % 4);
    pair.setup.expand.rule = random() % 2 == 0 ? ExpandRule::edge_cover : ExpandRule::published;
    pair.setup.expand.depth = static_cast<int32_t>(random() % 4);
    pair.setup.detect.criterion = static_cast<Criterion>(random() % 4);
    pair.setup.has_blade = true;
    pair.setup.blade = {1, 1, 0.1, 0};
    pair.setup.blade_moves.assign(4, BladeMove{{}, {{5, 0, 0}, {0, 1, 0}, {0, 0, 1}}, true, 0});
    pair.before.tau = 3;
    pair.before.cap = 6;
    const int count = 1 + static_cast<int>(random() % 3);
    for (int k = 0; k < count; ++k) corrupt(random() % 2 == 0 ? pair.before : pair.after, random);
    for (const auto oracle : {detection, split_exactness, merge_legality, expansion}) {
      rejected += oracle(pair.setup, pair.before, pair.after).holds ? 0 : 1;
    }
    for (const Stage stage : kStages) (void)judge_stage(pair.setup, stage, pair.before, pair.after, properties());
  }
  EXPECT_GT(rejected, 4000);
}

TEST(JudgeStage, AcceptsARightSplitAndRejectsAWrongOne) {
  Pair pair = cut_row();
  for (const Verdict& verdict : judge_stage(pair.setup, Stage::split, pair.before, pair.after, properties())) {
    expect_holds(verdict);
    EXPECT_EQ(verdict.stage, Stage::split);
  }
  pair.after.x[0].x = 100;
  int rejected = 0;
  for (const Verdict& verdict : judge_stage(pair.setup, Stage::split, pair.before, pair.after, properties())) {
    if (!verdict.holds) {
      ++rejected;
      EXPECT_EQ(verdict.property, "untouched");
    }
  }
  EXPECT_EQ(rejected, 1);
}

// --- What is not finite ----------------------------------------------------------------------------------------------

// A frame of a block that coasts, all of it well formed. Numbers such as 1e300 are finite, but their squares are not.
Pair coasting_block() {
  const Block block;
  Pair pair{block.setup, block.state, block.state};
  pair.setup.step.gravity = {};
  return pair;
}

TEST(NotFinite, MomentumOfPositionsOrVelocitiesBeyondMeasure) {
  const Pair good = coasting_block();
  expect_holds(momentum(good.setup, good.before, good.after));
  Pair far = good;
  for (State* state : {&far.before, &far.after}) state->x.assign(state->x.size(), {1e300, 1e300, 1e300});
  const Verdict positions = momentum(far.setup, far.before, far.after);
  EXPECT_FALSE(positions.holds) << positions.measured << " against " << positions.bound;
  EXPECT_NE(positions.witness.text.find("not finite"), std::string::npos) << positions.witness.text;
  Pair fast = good;
  for (State* state : {&fast.before, &fast.after}) state->v.assign(state->v.size(), {1e300, 1e300, 1e300});
  const Verdict velocities = momentum(fast.setup, fast.before, fast.after);
  EXPECT_FALSE(velocities.holds) << velocities.measured << " against " << velocities.bound;
  EXPECT_FALSE(velocities.witness.text.empty());
}

TEST(NotFinite, SkinVerticesOfPositionsBeyondMeasure) {
  Block block;
  expect_holds(skin_vertices(block.setup, block.state));
  block.state.x.assign(block.state.x.size(), {1e300, 1e300, 1e300});
  EXPECT_FALSE(skin_vertices(block.setup, block.state).holds) << "the skin stayed where it was";
  block.state.skin.position.assign(block.state.skin.position.size(), {1e300, 1e300, 1e300});
  const Verdict verdict = skin_vertices(block.setup, block.state);
  EXPECT_FALSE(verdict.holds) << verdict.measured << " against " << verdict.bound;
  EXPECT_FALSE(verdict.witness.text.empty());
}

TEST(NotFinite, RestFramesOfAGridBeyondMeasure) {
  Block block;
  expect_holds(rest_frames(block.setup, block.state));
  block.setup.body.grid.spacing = 1e300;
  const Verdict verdict = rest_frames(block.setup, block.state);
  EXPECT_FALSE(verdict.holds) << verdict.measured << " against " << verdict.bound;
  EXPECT_FALSE(verdict.witness.text.empty());
}

TEST(NotFinite, RotationsBeyondMeasure) {
  Block block;
  expect_holds(rotation_quality(block.setup, block.state));
  block.state.clusters.rotation[2].m.fill(1e300);
  const Verdict verdict = rotation_quality(block.setup, block.state);
  EXPECT_FALSE(verdict.holds);
  EXPECT_EQ(verdict.witness.clusters, Numbers{2});
}

TEST(NotFinite, FailsInTheJudgeToo) {
  Block block;
  block.state.x.assign(block.state.x.size(), {1e300, 1e300, 1e300});
  block.state.skin.position.assign(block.state.skin.position.size(), {1e300, 1e300, 1e300});
  int rejected = 0;
  for (const Verdict& verdict : judge(block.setup, block.state, true, properties())) rejected += verdict.holds ? 0 : 1;
  EXPECT_GT(rejected, 0);
}

// --- Judge -----------------------------------------------------------------------------------------------------------

std::set<std::string> names_of(const std::vector<Verdict>& verdicts) {
  std::set<std::string> names;
  for (const Verdict& verdict : verdicts) names.insert(verdict.property);
  EXPECT_EQ(names.size(), verdicts.size());
  return names;
}

TEST(Judge, AcceptsABlockAndNamesEveryPropertyOnce) {
  const Block block;
  const auto verdicts = judge(block.setup, block.state, true, properties());
  for (const Verdict& verdict : verdicts) {
    expect_holds(verdict);
    EXPECT_EQ(verdict.stage, Stage::skin);
  }
  const auto names = names_of(verdicts);
  for (const char* name : {"well formed", "finite", "cluster connectivity", "coverage", "component match", "isolation",
                           "edge cover", "rest frames", "merge maximality"}) {
    EXPECT_TRUE(names.contains(name)) << name;
  }
  EXPECT_GT(verdicts.size(), judge(block.setup, block.state, false, properties()).size());
}

TEST(Judge, AsksNothingOfClustersBetweenDetectAndSplit) {
  Row row(5, {{0, 1, 2, 3, 4}});
  remove_particles(row.state, {2});
  for (const Verdict& verdict : judge(row.setup, row.state, Stage::detect, true, properties())) expect_holds(verdict);
  EXPECT_FALSE(names_of(judge(row.setup, row.state, Stage::detect, true, properties())).contains("coverage"));
  EXPECT_TRUE(names_of(judge(row.setup, row.state, Stage::split, true, properties())).contains("coverage"));
}

TEST(Judge, AsksForCouplingAfterSplitOnlyWhereItIsPromised) {
  Row row(5, {{0, 1}, {2, 3, 4}});
  EXPECT_FALSE(names_of(judge(row.setup, row.state, Stage::split, true, properties())).contains("isolation"));
  EXPECT_TRUE(names_of(judge(row.setup, row.state, Stage::expand, true, properties())).contains("isolation"));
  row.state.edge_covered = true;
  EXPECT_TRUE(names_of(judge(row.setup, row.state, Stage::split, true, properties())).contains("isolation"));
}

TEST(Judge, JudgesNothingElseOfAStateThatIsNotWellFormed) {
  Block block;
  block.state.clusters.offsets[1] = -7;
  for (const Verdict& verdict : judge(block.setup, block.state, true, properties()))
    EXPECT_FALSE(verdict.holds) << verdict.property;
}

// What Judge keeps from state to state must never change what it says: it is asked beside one that has seen nothing.
void expect_same(const std::vector<Verdict>& remembering, const std::vector<Verdict>& fresh) {
  ASSERT_EQ(remembering.size(), fresh.size());
  for (std::size_t k = 0; k < fresh.size(); ++k) {
    SCOPED_TRACE(fresh[k].property);
    EXPECT_EQ(remembering[k].property, fresh[k].property);
    EXPECT_EQ(remembering[k].stage, fresh[k].stage);
    EXPECT_EQ(remembering[k].frame, fresh[k].frame);
    EXPECT_EQ(remembering[k].holds, fresh[k].holds);
    EXPECT_EQ(remembering[k].checked, fresh[k].checked);
    EXPECT_EQ(remembering[k].witness, fresh[k].witness);
    EXPECT_EQ(std::isnan(remembering[k].measured), std::isnan(fresh[k].measured));
    if (!std::isnan(fresh[k].measured)) {
      EXPECT_EQ(remembering[k].measured, fresh[k].measured);
    }
  }
}

TEST(Judge, SaysTheSameWhateverItHasSeenBefore) {
  constexpr uint64_t kSeed = 11;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  std::mt19937_64 random(kSeed);
  int64_t held = 0, failed = 0;
  for (int round = 0; round < 150 && !HasFailure(); ++round) {
    const Block block(3, 3, 2);
    Judge judging(block.setup, properties());
    std::deque<State> states = {block.state};  // each must stay where it is
    for (int step = 0; step < 12; ++step) {
      const State& last = states.back();
      // Now and then back to a good state, so that not everything stays broken.
      State next = random() % 3 == 0 ? block.state : last;
      if (random() % 2 == 0 && !next.alive.empty()) next.alive[random() % next.alive.size()] ^= 1;
      if (random() % 2 == 0) corrupt(next, random);
      states.push_back(std::move(next));
      const State& now = states.back();
      const Stage stage = kStages[random() % kStages.size()];
      const auto of_state = judge(block.setup, now, stage, false, properties());
      expect_same(judging.stage(stage, last, now), judge_stage(block.setup, stage, last, now, properties()));
      expect_same(judging.state(now, stage, false), of_state);
      EXPECT_EQ(judging.component_count(now), graph_components(block.setup, now).count);
      for (const Verdict& verdict : of_state) ++(verdict.holds ? held : failed);
    }
  }
  EXPECT_GT(held, 1000);
  EXPECT_GT(failed, 1000);
}

TEST(Judge, SeesAClusterFallApartUnderTheSameNumber) {
  Row row(5, {{0, 1, 2, 3, 4}});
  Judge judging(row.setup, properties());
  const auto connectivity = [&](const State& state) {
    for (const Verdict& verdict : judging.state(state, Stage::split, false)) {
      if (verdict.property == "cluster connectivity") return verdict.holds;
    }
    return false;
  };
  EXPECT_TRUE(connectivity(row.state));
  State cut = row.state;  // the same members, one of them dead
  remove_particles(cut, {2});
  EXPECT_FALSE(connectivity(cut));
  EXPECT_TRUE(connectivity(row.state));
  Row gap(5, {{0, 1, 3, 4}});  // all alive, other members
  EXPECT_FALSE(connectivity(gap.state));
}

}  // namespace
}  // namespace cutproof::oracles::oracles_test
