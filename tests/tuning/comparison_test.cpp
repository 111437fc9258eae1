// What is said of a trial's accuracy, against errors that are known in closed form: a body that is pushed aside by so
// many spacings in each frame.
#include "tuning/comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"

namespace cutproof::tuning::comparison_test {
namespace {

// Four particles in a row. Their neighbours stay neighbours, so there is always one part.
struct Row {
  Row() {
    setup.body = fixtures::block(4, 1, 1, 0.01);
    start = fixtures::cook(setup.body, {}, {}, {}, 1);
  }
  State pushed(std::initializer_list<double> spacings) const {
    State state = start;
    std::size_t i = 0;
    for (const double by : spacings) state.x[i++].y += by * setup.body.grid.spacing;
    return state;
  }
  State pushed(double spacings) const { return pushed({spacings, spacings, spacings, spacings}); }
  // Where everything stays at rest.
  Trajectory still(std::size_t frames) const {
    return {std::vector<oracles::Pose>(frames, oracles::pose_of(setup, start, nullptr)), {}};
  }

  Setup setup;
  State start;
};

TEST(Comparison, SaysTheGreatestErrorOfAllFramesWhereverItIs) {
  const Row row;
  const std::vector<double> errors = {0.01, 0.02, 0.05, 0.4, 0.3, 0.1, 0.02, 0};
  // The greatest first, in the middle, and last.
  for (std::size_t turn = 0; turn < errors.size(); ++turn) {
    Trial trial;
    const Trajectory reference = row.still(errors.size());
    Comparison comparison(row.setup, reference, 0.25, trial);
    std::size_t first_beyond = errors.size();
    for (std::size_t f = 0; f < errors.size(); ++f) {
      const double error = errors[(f + turn) % errors.size()];
      if (error > 0.25) first_beyond = std::min(first_beyond, f);
      comparison.add(row.pushed(error));
      EXPECT_EQ(comparison.beyond(), first_beyond <= f) << "turn " << turn << ", frame " << f;
      EXPECT_NEAR(trial.rms_h.at(f), error, 1e-12);
    }
    EXPECT_NEAR(trial.greatest_rms_h, 0.4, 1e-12) << "turn " << turn;
    EXPECT_NEAR(trial.greatest_h, 0.4, 1e-12) << "turn " << turn;
    EXPECT_EQ(trial.first_beyond, first_beyond) << "turn " << turn;
    const nlohmann::json written = to_json(trial, trial.configuration);
    EXPECT_EQ(written.at("rms_h"), trial.greatest_rms_h);
    EXPECT_EQ(written.at("max_h"), trial.greatest_h);
    EXPECT_EQ(written.at("rms_h_by_frame").get<std::vector<double>>(), trial.rms_h);
  }
}

// RMS over particles, and the greatest of one particle in any frame, which need not be the frame of the greatest RMS.
TEST(Comparison, TellsTheMeanFromTheGreatest) {
  const Row row;
  Trial trial;
  const Trajectory reference = row.still(3);
  Comparison comparison(row.setup, reference, 1, trial);
  comparison.add(row.pushed({0, 0, 0, 0.6}));
  comparison.add(row.pushed(0.5));
  comparison.add(row.pushed(0));
  EXPECT_NEAR(trial.rms_h.at(0), 0.3, 1e-12);
  EXPECT_NEAR(trial.greatest_rms_h, 0.5, 1e-12);
  EXPECT_NEAR(trial.greatest_h, 0.6, 1e-12);
}

TEST(Comparison, LeavesOutWhatOnlyOneOfThemStillHas) {
  const Row row;
  Trial trial;
  const Trajectory reference = row.still(2);
  Comparison comparison(row.setup, reference, 0.25, trial);
  comparison.add(row.start);
  EXPECT_EQ(trial.removed_otherwise, 0);
  State cut = row.pushed({0.1, 0.1, 0.1, 9});
  cut.alive[3] = 0;
  comparison.add(cut);
  EXPECT_EQ(trial.removed_otherwise, 1);
  EXPECT_NEAR(trial.greatest_h, 0.1, 1e-12);
  EXPECT_FALSE(comparison.beyond());
}

// What is not a number is beyond any tolerance, and stays what is said of the run.
TEST(Comparison, TakesWhatIsNoNumberForInfinitelyFar) {
  const Row row;
  Trial trial;
  const Trajectory reference = row.still(3);
  Comparison comparison(row.setup, reference, 1e9, trial);
  comparison.add(row.start);
  comparison.add(row.pushed(std::numeric_limits<double>::quiet_NaN()));
  comparison.add(row.start);
  EXPECT_EQ(trial.first_beyond, 1u);
  EXPECT_TRUE(std::isinf(trial.greatest_rms_h));
  EXPECT_TRUE(std::isinf(trial.greatest_h));
}

// Frames that the reference solution does not have are not compared, and no error of theirs is said.
TEST(Comparison, EndsWithTheReferenceSolution) {
  const Row row;
  Trial trial;
  const Trajectory reference = row.still(1);
  Comparison comparison(row.setup, reference, 0.25, trial);
  comparison.add(row.pushed(0.1));
  comparison.add(row.pushed(7));
  EXPECT_EQ(trial.rms_h.size(), 1u);
  EXPECT_FALSE(comparison.beyond());
  EXPECT_EQ(comparison.trajectory().frames.size(), 2u);
}

}  // namespace
}  // namespace cutproof::tuning::comparison_test
