// A step judged iterate by iterate: the reference's holds in every iterate, and what is least wrong in one does not.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "model/at.h"
#include "oracles/contact.h"
#include "oracles/iterates/probe.h"
#include "oracles/noise.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/pressed_block.h"

namespace cutproof::oracles::iterates_test {
namespace {

using namespace cutproof::tests;

// The reference, but for what a fault does to setups that are loaded and to states that are shown.
class Faulty final : public Backend {
 public:
  std::function<void(cutproof::Setup&)> of_setup = [](cutproof::Setup&) {};
  // Of states that are given, and of states after a run; `iterations`: that the last substep has had.
  std::function<void(State&)> of_given = [](State&) {};
  std::function<void(State&, int32_t iterations)> of_state = [](State&, int32_t) {};
  bool shows = true, only_frames = false;
  Precision arithmetic = Precision::binary64;

  std::string name() const override { return "faulty"; }
  Precision precision() const override { return arithmetic; }
  bool can_run(Span span) const override { return !only_frames || span == Span{}; }
  bool shows_iterates() const override { return shows; }
  void load(std::vector<cutproof::Setup> setups, std::vector<State> states) override {
    iterations_.clear();
    for (cutproof::Setup& setup : setups) {
      iterations_.push_back(setup.step.iterations - setup.withheld_iterations);
      of_setup(setup);
    }
    for (State& state : states) of_given(state);
    inner_->load(std::move(setups), std::move(states));
    has_run_ = false;
  }
  void run(Span span) override {
    inner_->run(span);
    has_run_ = true;
  }
  std::vector<State> snapshot() const override {
    std::vector<State> states = inner_->snapshot();
    for (std::size_t b = 0; b < states.size(); ++b) {
      if (has_run_) of_state(states[b], iterations_[b]);
      states[b].precision = arithmetic;
    }
    return states;
  }
  SpanReport report() const override { return inner_->report(); }

 private:
  std::unique_ptr<Backend> inner_ = reference::make_backend();
  std::vector<int32_t> iterations_;
  bool has_run_ = false;
};

Verdict judged(Backend& backend, const StepScene& scene, Iterates wanted = Iterates::all, uint64_t seed = 1) {
  State before = scene.before;
  before.precision = backend.precision();
  const IterateProbe probe(scene.setup, before, wanted, seed);
  return probe.judged(shown_iterates(backend, {&probe, 1}).front());
}

TEST(Iterates, OfTheReferenceHoldWithEveryCauseAtWork) {
  for (const Solver solver : {Solver::implicit, Solver::published}) {
    for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
      for (const double retardation : {0.0, 0.0004, 0.004, 0.1}) {  // dt is 4 ms
        if (solver == Solver::published && (acceleration != Acceleration::none || retardation > 0)) continue;
        const double volume_share = solver == Solver::implicit && retardation != 0.004 ? 0.9 : 0;
        const StepScene scene = pressed_block(solver, acceleration, retardation, volume_share);
        for (const bool shows : {true, false}) {
          Faulty right;
          right.shows = shows;
          right.only_frames = !shows;
          const Verdict verdict = judged(right, scene);
          expect_holds(verdict);
          EXPECT_EQ(verdict.inconclusive, 0);
          EXPECT_GT(verdict.measured, 0.02) << "the bounds must be near to what they bound";
        }
      }
    }
  }
}

struct Wrong {
  const char* what;
  double least;  // that is rejected; nothing of a tenth of it is asked
  std::function<void(Faulty&, double)> make;
};
void PrintTo(const Wrong& wrong, std::ostream* os) { *os << wrong.what; }

std::function<void(Faulty&, double)> parameter(double StepParameters::*member) {
  return [member](Faulty& faulty, double off) {
    faulty.of_setup = [member, off](cutproof::Setup& setup) { setup.step.*member *= 1 + off; };
  };
}
// Of states after `iterations` iterations; -1: of all.
std::function<void(Faulty&, double)> state(int32_t after, void (*edit)(State&, double)) {
  return [after, edit](Faulty& faulty, double off) {
    faulty.of_state = [after, edit, off](State& state, int32_t iterations) {
      if (after < 0 || iterations == after) edit(state, off);
    };
  };
}

const Wrong kLeast[] = {
    {"stiffness", 1e-11, parameter(&StepParameters::stiffness)},
    {"damping", 1e-10, parameter(&StepParameters::damping)},
    {"retardation", 1e-11, parameter(&StepParameters::retardation)},
    {"volume_share", 1e-10, parameter(&StepParameters::volume_share)},
    {"gravity", 1e-11,
     [](Faulty& faulty, double off) {
       faulty.of_setup = [off](cutproof::Setup& setup) { setup.step.gravity = (1 + off) * setup.step.gravity; };
     }},
    {"wall", 1e-12,
     [](Faulty& faulty, double off) {
       faulty.of_setup = [off](cutproof::Setup& setup) { setup.walls[0].offset += off * kSpacing; };
     }},
    {"friction", 1e-8,
     [](Faulty& faulty, double off) {
       faulty.of_setup = [off](cutproof::Setup& setup) { setup.walls[0].friction *= 1 + off; };
     }},
    {"blade", 1e-12,
     [](Faulty& faulty, double off) {
       faulty.of_setup = [off](cutproof::Setup& setup) {
         for (BladeMove& move : setup.blade_moves) move.to.edge.x += off * kSpacing;
       };
     }},
    {"grip", 1e-12,
     [](Faulty& faulty, double off) {
       faulty.of_setup = [off](cutproof::Setup& setup) {
         for (Vec3& d : setup.grips[0].displacement) d.y += off * kSpacing;
       };
     }},
    {"place of the prediction", 1e-12, state(0, [](State& s, double off) { s.x[kInside].y += off * kSpacing; })},
    {"place of an iterate", 1e-12, state(2, [](State& s, double off) { s.x[kInside].y += off * kSpacing; })},
    // Not of the last iterate, from which the next substep begins.
    {"velocity", 1e-12, state(2, [](State& s, double off) { s.v[kInside].y += off * kSpacing / 0.004; })},
    {"rotation", 1e-12,
     state(3,
           [](State& s, double off) {
             Mat3& r = s.clusters.rotation[3];
             const Mat3 was = r;
             for (int k = 0; k < 3; ++k) {
               r(0, k) -= off * was(1, k);
               r(1, k) += off * was(0, k);
             }
           })},
    {"length of a rotation", 1e-14,
     state(3,
           [](State& s, double off) {
             for (double& entry : s.clusters.rotation[3].m) entry *= 1 + off;
           })},
    {"impulse", 2e-12, state(1, [](State& s, double off) { s.impulse = (1 + off) * s.impulse; })},
    {"flag", 1, state(2, [](State& s, double) { s.clusters.degenerate[3] = 1; })},
};

class LeastWrong : public ::testing::TestWithParam<Wrong> {};
TEST_P(LeastWrong, IsRejected) {
  for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
    const StepScene scene = pressed_block(Solver::implicit, acceleration, 0.0004, 0.5);
    Faulty faulty;
    GetParam().make(faulty, GetParam().least);
    const Verdict verdict = judged(faulty, scene);
    EXPECT_FALSE(verdict.holds) << verdict.measured;
    EXPECT_FALSE(verdict.witness.text.empty());
  }
}
INSTANTIATE_TEST_SUITE_P(OfAnIterate, LeastWrong, ::testing::ValuesIn(kLeast), [](const auto& wrong) {
  std::string name = wrong.param.what;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
});

// A sample looks at one iteration in each step, and one more; faults of all iterations are in every sample.
TEST(Iterates, ThatAreSampledShowWhatIsWrongInAll) {
  const StepScene scene = pressed_block();
  for (uint64_t seed = 0; seed < 20; ++seed) {
    Faulty right, stiff;
    stiff.of_setup = [](cutproof::Setup& setup) { setup.step.stiffness *= 1 + 1e-10; };
    expect_holds(judged(right, scene, Iterates::sampled, seed));
    EXPECT_FALSE(judged(stiff, scene, Iterates::sampled, seed).holds) << seed;
  }
}

// It is asked for a frame of its own, while the frame as it is is one of two.
TEST(Iterates, OfAnotherStepThanThatOfTheFrameAreNotBelieved) {
  StepScene scene = pressed_block();
  const auto twice = [](auto& values) {
    const auto once = values;
    values.insert(values.end(), once.begin(), once.end());
  };
  twice(scene.setup.substep_length);
  twice(scene.setup.blade_moves);
  twice(scene.setup.grips[0].active);
  twice(scene.setup.grips[0].displacement);
  for (const bool shows : {true, false}) {
    Faulty right, soft;
    right.shows = soft.shows = shows;
    soft.of_setup = [](cutproof::Setup& setup) {
      if (setup.frame_count() > 1) setup.step.stiffness /= 2;
    };
    expect_holds(judged(right, scene));
    EXPECT_FALSE(judged(soft, scene).holds);
  }
}

// Half a turn about an axis of its shape leaves Rᵀ A symmetric.
TEST(Iterates, RejectAStationaryRotationThatIsNotTheBest) {
  const StepScene scene = pressed_block();
  const Clusters& clusters = scene.before.clusters;
  int rejected = 0;
  for (const int axis : {0, 1, 2}) {
    StepScene still = scene;
    still.setup.walls.clear();
    still.setup.grips.clear();
    still.setup.has_blade = false;
    still.setup.blade_moves.clear();
    still.setup.step.gravity = {};
    still.setup.step.stiffness = 0;  // so that places say nothing of rotations
    for (std::size_t i = 0; i < still.before.x.size(); ++i) {
      still.before.x[i] = still.setup.body.rest_position(static_cast<int32_t>(i));
      still.before.v[i] = {};
    }
    Faulty turned;
    turned.of_state = [&](State& state, int32_t iterations) {
      if (iterations != 1) return;
      for (int k = 0; k < 3; ++k) state.clusters.rotation[3](k, k) *= k == axis ? 1 : -1;
    };
    const Verdict verdict = judged(turned, still);
    rejected += verdict.holds ? 0 : 1;
    EXPECT_TRUE(verdict.holds || verdict.witness.clusters == std::vector<int32_t>{clusters.number[3]});
  }
  EXPECT_EQ(rejected, 3);
}

// A particle that begins in the blade's plane may go to either side, and stays there.
TEST(Iterates, KeepAParticleOnOneSideOfTheBlade) {
  StepScene scene{setup_of(block_body(1, 1, 1, kSpacing, 0.002)), {}, {}};
  scene.setup.step.substeps = 1;
  scene.setup.step.iterations = 2;
  scene.setup.has_blade = true;
  scene.setup.blade = {0.1, 0.1, 0.004, 0};
  BladeMove move;
  move.down = true;
  move.from = move.to = {{0, 0, 0.05}, {0, 1, 0}, {0, 0, -1}};  // its normal is along x
  scene.setup.blade_moves = {move};
  scene.before = state_of(scene.setup.body, box_clusters(1, 1, 1, 1));
  scene.before.x[0].x = 0;
  const auto with_sides = [&](std::vector<int> of_iterates) {
    Faulty backend;
    backend.of_state = [of_iterates](State& state, int32_t iterations) {
      if (of_iterates[at(iterations)] < 0) {
        state.x[0].x *= -1;
        state.v[0].x *= -1;
        state.impulse.x *= -1;
      }
    };
    return judged(backend, scene);
  };
  EXPECT_TRUE(with_sides({1, 1, 1}).holds);
  EXPECT_TRUE(with_sides({-1, -1, -1}).holds);
  EXPECT_FALSE(with_sides({1, -1, -1}).holds);
  EXPECT_FALSE(with_sides({1, 1, -1}).holds);
}

// A backend may round the state that it is given, here by far more than an iteration rounds where nothing has moved
// far.
TEST(Iterates, BeginWithTheStateThatTheBackendHolds) {
  StepScene scene = pressed_block();
  for (Vec3& v : scene.before.v) v = {};
  Faulty rounding;
  rounding.arithmetic = Precision::binary32;
  rounding.of_given = [&](State& state) { round_to_single(scene.setup.body, state); };
  rounding.of_state = [&](State& state, int32_t) { round_to_single(scene.setup.body, state); };
  expect_holds(judged(rounding, scene));
  rounding.of_given = [](State& state) { state.x[0].x += 1e-6 * kSpacing; };
  const Verdict verdict = judged(rounding, scene);
  EXPECT_FALSE(verdict.holds);
  EXPECT_NE(verdict.witness.text.find("particle 0 is not loaded as it was given"), std::string::npos);
}

// Without iterations there is the prediction alone.
TEST(Iterates, AreNoneWhereTheSceneHasNone) {
  StepScene scene = pressed_block();
  scene.setup.step.iterations = 0;
  Faulty right, turned;
  turned.of_state = [](State& state, int32_t) { state.clusters.rotation[0](0, 0) = 0.5; };
  expect_holds(judged(right, scene));
  EXPECT_FALSE(judged(turned, scene).holds);
}

// Friction takes places farther apart than what would go there: by the bound that candidates are given, and by more
// than nothing.
TEST(Contact, TakesPlacesApartByNoMoreThanFrictionWidens) {
  cutproof::Setup setup = pressed_block().setup;
  setup.walls = {{2, +1, 0, 1.5}};
  const Contact contact(setup, nullptr, setup.walls);
  Noise noise(1);
  double greatest = 0;
  for (int k = 0; k < 10'000; ++k) {
    const Vec3 start = kSpacing * (noise.vector() + Vec3{0, 0, 1}), one = kSpacing * noise.vector();
    const Vec3 other = one + (1e-3 * kSpacing) * noise.vector();
    Contact::Found found;
    const Vec3 apart = contact.place(one, +1, start, found, {}) - contact.place(other, +1, start, found, {});
    greatest = std::max(greatest, norm(apart) / norm(one - other));
  }
  EXPECT_LE(greatest, contact.widened_by_friction() * (1 + 1e-9));
  EXPECT_GT(greatest, 0.6 * contact.widened_by_friction());
}

}  // namespace
}  // namespace cutproof::oracles::iterates_test
