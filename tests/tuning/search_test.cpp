// The search against costs and errors that are known in closed form, and against trying everything.
#include "tuning/search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cutproof::tuning::search_test {
namespace {

// A body of one frame: a time step error 1 / substeps, and a solver error that each iteration shrinks, accelerated ones
// more. An accelerated iteration is a little more expensive.
struct Model {
  double tolerance = 0.2;
  double weight = 0.4;  // of the solver error

  static double error(const Scene& scene, double weight) {
    const StepParameters& step = scene.step;
    const double shrink = step.acceleration == Acceleration::none ? 0.7 : 0.4;
    return 1.0 / step.substeps + weight * std::pow(shrink, step.iterations);
  }
  static double cost(const Scene& scene) {
    const StepParameters& step = scene.step;
    return step.substeps * (0.5 + step.iterations * (step.acceleration == Acceleration::none ? 1 : 1.15));
  }
  Trial operator()(const Configuration& configuration, std::optional<double> limit) const {
    Trial trial;
    trial.configuration = configuration;
    trial.greatest_rms_h = error(configuration.scene, weight);
    trial.rms_h = {trial.greatest_rms_h};
    const double seconds = cost(configuration.scene);
    if (trial.greatest_rms_h > tolerance) trial.first_beyond = 0;
    trial.outcome = trial.first_beyond                ? Outcome::over
                    : limit && seconds > 1.5 * *limit ? Outcome::more_expensive
                                                      : Outcome::within;
    if (trial.outcome == Outcome::within) trial.frame = {seconds, seconds, seconds, 1};
    return trial;
  }
};

Configuration given() {
  Configuration configuration;
  configuration.scene.step.substeps = 8;
  configuration.scene.step.iterations = 8;
  return configuration;
}

SearchSpace space_of_steps() {
  SearchSpace space;
  space.substeps = substeps_to_try(8, 64);
  space.may_resize = false;
  return space;
}

TEST(SubstepsToTry, AreAscendingAndHoldTheGivenOne) {
  EXPECT_EQ(substeps_to_try(4, 16), (std::vector<int32_t>{1, 2, 3, 4, 6, 8, 12, 16}));
  EXPECT_EQ(substeps_to_try(5, 8), (std::vector<int32_t>{1, 2, 3, 4, 5, 6, 8}));
  EXPECT_EQ(substeps_to_try(1, 1), (std::vector<int32_t>{1}));
}

TEST(Search, FindsWhatTryingEverythingFinds) {
  for (const double tolerance : {0.04, 0.1, 0.2, 0.35, 0.6, 2.0}) {
    for (const double weight : {0.01, 0.4, 3.0}) {
      const Model model{tolerance, weight};
      const SearchSpace space = space_of_steps();
      double least = std::numeric_limits<double>::infinity();
      for (const int32_t substeps : space.substeps) {
        for (int32_t iterations = 1; iterations <= space.most_iterations; ++iterations) {
          for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
            if (acceleration == Acceleration::chebyshev && iterations < 2) continue;
            Scene scene;
            scene.step = {Solver::implicit, substeps, iterations, 1e5, 0, 0.5, acceleration, 0, {}};
            if (Model::error(scene, weight) <= tolerance) least = std::min(least, Model::cost(scene));
          }
        }
      }
      const std::vector<Trial> trials = search(given(), space, model);
      const std::vector<std::size_t> order = by_cost(trials);
      ASSERT_EQ(order.empty(), std::isinf(least)) << tolerance << " " << weight;
      if (order.empty()) continue;
      double found = std::numeric_limits<double>::infinity();
      for (const Trial& trial : trials) {
        if (trial.outcome == Outcome::within) found = std::min(found, trial.frame.median);
      }
      EXPECT_EQ(found, least) << tolerance << " " << weight;
      EXPECT_LE((1 - kCheaper) * trials[order.front()].frame.median, least);
    }
  }
}

TEST(ByCost, TakesTheFirstOfThoseThatCostTheSameButForNoise) {
  const auto trial = [](double seconds, Outcome outcome = Outcome::within) {
    Trial made;
    made.outcome = outcome;
    made.frame = {seconds, seconds, seconds, 1};
    return made;
  };
  EXPECT_EQ(by_cost({trial(1.0), trial(0.96), trial(0.1, Outcome::over), trial(2.0)}),
            (std::vector<std::size_t>{0, 1, 3}));
  EXPECT_EQ(by_cost({trial(1.0), trial(0.94), trial(0.93), trial(0.5)}), (std::vector<std::size_t>{3, 1, 2, 0}));
  EXPECT_TRUE(by_cost({trial(1, Outcome::more_expensive)}).empty());
}

TEST(Front, HasTheCheapestOfThoseThatWereCarriedThroughForEachTolerance) {
  const auto trial = [](double error, double seconds, Outcome outcome) {
    Trial made;
    made.outcome = outcome;
    made.greatest_rms_h = error;
    if (seconds > 0) made.frame = {seconds, seconds, seconds, 1};
    return made;
  };
  const std::vector<Trial> trials = {trial(0.004, 9, Outcome::within),       trial(0.04, 5, Outcome::within),
                                     trial(0.3, 2, Outcome::over),           trial(0.1, 1, Outcome::topology),
                                     trial(0.1, 0, Outcome::more_expensive), trial(0.15, 3, Outcome::over),
                                     trial(0.0495, 4, Outcome::within)};
  const auto told = [&](double asked, bool all, double known) {
    std::vector<std::pair<double, int>> result;
    for (const FrontPoint& point : front(trials, asked, all, known)) {
      result.emplace_back(point.tolerance, point.trial ? static_cast<int>(*point.trial) : -1);
    }
    return result;
  };
  using Told = std::vector<std::pair<double, int>>;
  EXPECT_EQ(told(0.05, true, 0), (Told{{0.5, 2}, {0.2, 5}, {0.05, 6}, {0.01, 0}}));
  EXPECT_EQ(told(0.05, true, 0.001), (Told{{0.5, 2}, {0.2, 5}, {0.05, 1}, {0.01, 0}})) << "what is not known counts";
  EXPECT_EQ(told(0.05, true, 0.008), (Told{{0.5, 2}, {0.2, 5}, {0.05, 1}, {0.01, -1}}));
  EXPECT_EQ(told(0.1, false, 0), (Told{{0.1, 6}, {0.05, 6}, {0.01, 0}})) << "beyond what was asked runs are given up";
}

TEST(Front, IsNotWhatSomethingNearerClearlyUndercuts) {
  const auto trial = [](double error, double seconds, Outcome outcome = Outcome::over) {
    Trial made;
    made.outcome = outcome;
    made.greatest_rms_h = error;
    if (seconds > 0) made.frame = {seconds, seconds, seconds, 1};
    return made;
  };
  const auto behind = [&](double error, double seconds, const std::vector<Trial>& before, double asked = 0.05) {
    return is_behind(trial(error, 0), seconds, before, asked);
  };
  EXPECT_FALSE(behind(0.1, 9, {}));
  EXPECT_TRUE(behind(0.1, 9, {trial(0.1, 5.99)}));
  EXPECT_FALSE(behind(0.1, 9, {trial(0.1, 6.01)})) << "a timer's noise may make up for that";
  EXPECT_FALSE(behind(0.1, 9, {trial(0.101, 1)})) << "that is farther off";
  EXPECT_TRUE(behind(0.1, 9, {trial(0.2, 1), trial(0.01, 5, Outcome::within)}));
  EXPECT_FALSE(behind(
      0.1, 9, {trial(0.01, 1, Outcome::topology), trial(0.01, 1, Outcome::schedule), trial(0.01, 0, Outcome::within)}))
      << "what falls into other parts, or was given up, is no point of the front";
  EXPECT_TRUE(behind(0.51, 1, {})) << "no tolerance is as wide";
  EXPECT_FALSE(behind(0.51, 1, {}, 0.6));
  EXPECT_TRUE(behind(INFINITY, 1, {}));
  EXPECT_TRUE(is_behind(trial(0.001, 0, Outcome::topology), 1, {}, 0.05));
}

// Those that are timed again: by the least of their times, because a machine may have been slow for a while.
TEST(Front, HasItsPointsAmongThoseThatNothingNearerClearlyUndercuts) {
  const auto trial = [](double error, double least, double median, Outcome outcome = Outcome::over) {
    Trial made;
    made.outcome = outcome;
    made.greatest_rms_h = error;
    if (least > 0) made.frame = {median, least, 2 * median, 3};
    return made;
  };
  const std::vector<Trial> trials = {
      trial(0.7, 9, 9),      // the given one is always among them
      trial(0.1, 2, 2),      //
      trial(0.2, 2.9, 5),    // slow for a while
      trial(0.2, 3.1, 3.1),  // 1 is nearer and takes less than two thirds
      trial(0.04, 9, 9, Outcome::within),
      trial(0.04, 0, 0, Outcome::within),  // given up
      trial(0.01, 1, 1, Outcome::topology),
      trial(0.6, 0.1, 0.1),  // beyond every tolerance
  };
  EXPECT_EQ(may_be_points(trials, 0.05), (std::vector<std::size_t>{0, 1, 2, 4}));
  EXPECT_EQ(may_be_points(trials, 0.65), (std::vector<std::size_t>{0, 1, 2, 4, 7}));
}

TEST(Search, TriesTheGivenFirstAndNothingTwice) {
  const std::vector<Trial> trials = search(given(), space_of_steps(), Model{});
  EXPECT_EQ(trials.front().configuration, given());
  for (std::size_t a = 0; a < trials.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) EXPECT_FALSE(trials[a].configuration == trials[b].configuration);
  }
}

// 1 / substeps is beyond the tolerance for all of them: iterations cannot help, and that is seen after a few.
TEST(Search, EndsDoublingWhereItDoesNotHelp) {
  SearchSpace space = space_of_steps();
  space.substeps = {4};
  space.most_iterations = 1 << 20;
  const std::vector<Trial> trials = search(given(), space, Model{0.1, 0.4});
  EXPECT_TRUE(std::all_of(trials.begin() + 1, trials.end(), [](const Trial& t) { return t.outcome == Outcome::over; }));
  for (const Trial& trial : trials) EXPECT_LE(trial.configuration.scene.step.iterations, 32);
}

// Of several frames, in which errors grow. The given configuration is run to its end and the others are given up, so
// that what helps has to be seen where the given one was first beyond.
TEST(Search, GoesOnFromAGivenOneThatWasRunToItsEnd) {
  const double tolerance = 0.1;
  Configuration start = given();
  start.scene.step.iterations = 4;
  const auto measure = [&](const Configuration& configuration, std::optional<double>) {
    Trial trial;
    trial.configuration = configuration;
    const int32_t iterations = configuration.scene.step.iterations;
    for (int frame = 1; frame <= 20 && (!trial.first_beyond || configuration == start); ++frame) {
      trial.rms_h.push_back(0.02 * frame * std::pow(0.8, iterations));
      if (trial.rms_h.back() > tolerance && !trial.first_beyond) trial.first_beyond = trial.rms_h.size() - 1;
    }
    trial.greatest_rms_h = trial.rms_h.back();
    trial.outcome = trial.first_beyond ? Outcome::over : Outcome::within;
    trial.frame = {1.0 * iterations, 1.0 * iterations, 1.0 * iterations, 1};
    return trial;
  };
  // 0.4 · 0.8^K at the end: 7 iterations are enough.
  SearchSpace space = space_of_steps();
  space.substeps = {8};
  const std::vector<Trial> trials = search(start, space, measure);
  const std::vector<std::size_t> order = by_cost(trials);
  ASSERT_FALSE(order.empty());
  EXPECT_EQ(trials[order.front()].configuration.scene.step.iterations, 7);
}

// For a curve: the given substeps with ever more iterations, until they are near enough for any tolerance that is told.
TEST(Search, FollowsTheGivenSubstepsDown) {
  const Model model{0.3, 0.4};
  SearchSpace space = space_of_steps();
  const auto iterations_of = [&](Acceleration acceleration) {
    std::vector<int32_t> found;
    for (const Trial& trial : search(given(), space, model)) {
      const StepParameters& step = trial.configuration.scene.step;
      if (step.substeps == 8 && step.acceleration == acceleration) found.push_back(step.iterations);
    }
    std::sort(found.begin(), found.end());
    return found;
  };
  EXPECT_LT(iterations_of(Acceleration::chebyshev).size(), 4u) << "what is enough for 0.3 h";
  space.followed_to = 0.126;  // 1 / 8, and 0.001 of its solver
  EXPECT_EQ(iterations_of(Acceleration::none), (std::vector<int32_t>{1, 2, 3, 4, 6, 8, 12, 16, 24}));
  EXPECT_EQ(iterations_of(Acceleration::chebyshev), (std::vector<int32_t>{2, 3, 4, 6, 8}));
}

TEST(Search, LeavesANumberOfSubstepsThatCannotBe) {
  const Model model{2.0, 0.4};
  const auto measure = [&](const Configuration& configuration, std::optional<double> limit) {
    Trial trial = model(configuration, limit);
    const int32_t substeps = configuration.scene.step.substeps;
    if (substeps == 1) trial.outcome = Outcome::refused;
    if (substeps == 2) trial.outcome = Outcome::schedule;
    return trial;
  };
  const std::vector<Trial> trials = search(given(), space_of_steps(), measure);
  EXPECT_EQ(std::count_if(trials.begin(), trials.end(), [](const Trial& t) { return t.outcome == Outcome::refused; }),
            2)
      << "once for each acceleration";
  EXPECT_EQ(trials[by_cost(trials).front()].configuration.scene.step.substeps, 3);
}

// Another number of parts is not within, however near the rest is.
TEST(Search, GoesOnFromOtherParts) {
  const Model model{2.0, 0.4};
  const auto measure = [&](const Configuration& configuration, std::optional<double> limit) {
    Trial trial = model(configuration, limit);
    if (configuration.scene.step.substeps < 3) {
      trial.outcome = Outcome::topology;
      trial.frame = {};
    }
    return trial;
  };
  const std::vector<Trial> trials = search(given(), space_of_steps(), measure);
  const std::vector<std::size_t> order = by_cost(trials);
  ASSERT_FALSE(order.empty());
  EXPECT_EQ(trials[order.front()].configuration.scene.step.substeps, 3);
  EXPECT_EQ(trials[order.front()].configuration.scene.step.iterations, 1);
}

TEST(Search, DropsStagesThatNobodyNeeds) {
  const Model model{};
  // Each stage and each particle less to a cluster costs; larger clusters than 6 are too inaccurate.
  const auto measure = [&](const Configuration& configuration, std::optional<double> limit) {
    const Scene& scene = configuration.scene;
    Trial trial = model(configuration, limit);
    if (trial.outcome != Outcome::within) return trial;
    double seconds = trial.frame.median;
    seconds += 6.0 * scene.skin.wanted;
    seconds += 6.0 * (scene.detect.criterion != Criterion::none) + 120.0 / scene.clusters.side;
    seconds += scene.split.debris == 8 ? 0.0 : 6.0;
    trial.frame = {seconds, seconds, seconds, 1};
    if (scene.clusters.side > 6) {
      trial.outcome = Outcome::over;
      trial.frame = {};
    }
    return trial;
  };
  Configuration start = given();
  start.scene.detect.without_blade = true;
  start.scene.detect.remove = RemovedEnds::one;
  SearchSpace space = space_of_steps();
  const auto cheapest = [&] {
    const std::vector<Trial> trials = search(start, space, measure);
    return trials[by_cost(trials).front()].configuration;
  };

  Configuration found = cheapest();
  EXPECT_EQ(differences(found, start), "debris 8");

  space.may_resize = true;
  space.may_drop_skin = true;
  space.nothing_removed = true;
  found = cheapest();
  EXPECT_EQ(differences(found, start), "clusters.side 6, no detection, debris 8, no skin");

  EXPECT_EQ(found.scene.detect.remove, RemovedEnds::both) << "of no criterion, or the scene could not be read";

  // With a blade there is something to detect, whatever this run removed.
  start.scene.blade.emplace();
  found = cheapest();
  EXPECT_EQ(found.scene.detect.criterion, Criterion::distance);
}

TEST(Search, SizesSampledClustersByBothTheirLengths) {
  const Model model{};
  const auto measure = [&](const Configuration& configuration, std::optional<double> limit) {
    Trial trial = model(configuration, limit);
    trial.frame.median += 10 * std::abs(configuration.scene.clusters.radius - 2.56);
    return trial;
  };
  Configuration start = given();
  start.scene.clusters.method = Cooking::sampled;
  SearchSpace space = space_of_steps();
  space.may_resize = true;
  const std::vector<Trial> trials = search(start, space, measure);
  const ClusterSpec& found = trials[by_cost(trials).front()].configuration.scene.clusters;
  EXPECT_NEAR(found.radius, 2.56, 1e-12);
  EXPECT_NEAR(found.spacing, 1.92, 1e-12);
}

}  // namespace
}  // namespace cutproof::tuning::search_test
