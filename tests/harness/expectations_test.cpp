// Each expectation of a scene, in one table: what it measures of a run made by hand, that it fails on each side of its
// limits, and which stages decide it. A new expectation without a row does not compile.
#include "harness/expectations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "model/fields.h"
#include "tests/oracles/states.h"

namespace cutproof::harness::expectations_test {
namespace {

using cutproof::tests::block_body;
using cutproof::tests::clusters_of;
using cutproof::tests::setup_of;
using cutproof::tests::state_of;

constexpr std::size_t kExpectations = 10;
[[maybe_unused]] void know_every_expectation(const Expectations& all) {
  [[maybe_unused]] const auto& [after_stroke, at_end, shells, removed, isolated, growth, clusters, particles, dent,
                                stretch] = all;
}

// When a run that is cut short can tell.
enum class Told { always, if_too_much, never };

struct Row {
  std::string name;
  std::function<void(Expectations&, double low, double high)> ask;
  double value;  // of the run below
  bool is_range;
  int64_t frame_above, frame_below;  // that is named where it is too much, or too little
  Told told;
  StageSet decided_by;
};

template <std::optional<Range> Expectations::*member>
void ask_range(Expectations& all, double low, double high) {
  all.*member = Range{low, high};
}
template <std::optional<int64_t> Expectations::*member>
void ask_count(Expectations& all, double, double high) {
  all.*member = static_cast<int64_t>(high);
}

std::array<Row, kExpectations> rows() {
  using enum Stage;
  using E = Expectations;
  const StageSet removal = stages(step, detect), with_skin = stages(step, detect, skin),
                 of_clusters = stages(step, detect, split, merge, expand), none = stages();
  return {
      {{"components after stroke 1",
        [](E& all, double, double high) { all.components_after_stroke = {static_cast<int64_t>(high)}; }, 2, false, 2, 2,
        Told::always, removal},
       {"components at the end", ask_count<&E::components_at_end>, 1, false, 3, 3, Told::never, removal},
       {"shells at the end", ask_count<&E::shells_at_end>, 2, false, 3, 3, Told::never, with_skin},
       {"removed particles", ask_range<&E::removed>, 2, true, 3, 3, Told::if_too_much, removal},
       {"isolated groups of clusters", ask_range<&E::isolated_clusters>, 2, true, 0, 3, Told::if_too_much, of_clusters},
       {"cluster growth", ask_range<&E::cluster_growth>, 0.5, true, 3, 3, Told::never, of_clusters},
       {"clusters", ask_range<&E::clusters>, 2, true, 0, 0, Told::always, none},
       {"particles", ask_range<&E::particles>, 4, true, 0, 0, Told::always, none},
       {"dent before the first removal", ask_range<&E::dent>, 0.3, true, 0, 3, Told::always, removal},
       {"greatest stretch", ask_range<&E::greatest_stretch>, 2, true, 2, 3, Told::if_too_much, removal}}};
}

// Two tetrahedra, which bound something each.
Skin two_shells() {
  Skin skin;
  for (const int32_t owner : {0, 1}) {
    const Vec3 at = {4.0 * owner, 0, 0};
    for (const Vec3 corner : {Vec3{}, Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
      skin.owner.push_back(owner);
      skin.direction.push_back(0);
      skin.reach.push_back(0.5);
      skin.position.push_back(at + corner);
    }
    const int32_t v = 4 * owner;
    for (const std::array<int32_t, 3>& t : {std::array{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
      skin.triangles.push_back({v + t[0], v + t[1], v + t[2]});
    }
  }
  return skin;
}

// Four particles in a row, h = 1, under a blade that stays down. Frame 0 dents it by 0.3 h, in three groups of
// clusters that nothing couples; frame 1 dents it by 0.1 h; frame 2 removes a particle and stretches an edge to 2 h;
// frame 3 removes debris, and leaves three clusters of two.
class MadeRun : public ::testing::Test {
 protected:
  MadeRun() : setup_(setup_of(block_body(4, 1, 1), 4)) {
    setup_.has_blade = true;
    setup_.stroke_end = {2};
    const BladePose pose = {{0, 0, 9}, {0, 1, 0}, {0, 0, 1}};
    setup_.blade_moves.assign(16, BladeMove{pose, pose, true, 0});
    initial_ = std::make_shared<const State>(state_of(setup_.body, {{0, 1}, {2, 3}}));
    State state = *initial_;
    const auto end_frame = [&](const cutproof::tests::Lists& clusters) {
      state.clusters = clusters_of(setup_.body, clusters);
      ++state.frame;
      ends_.push_back(std::make_shared<const State>(state));
    };
    const State rest = state;
    state.x[1].z -= 0.3;
    end_frame({{0}, {1}, {2, 3}});
    state.x = rest.x;
    state.x[1].z -= 0.1;
    end_frame({{0, 1}, {1, 2, 3}});
    state.x = rest.x;
    state.x[0].x -= 1;
    state.removed = {2};
    state.alive[2] = 0;
    end_frame({{0, 1}, {3}});
    state.x = rest.x;
    state.x[1].z -= 5;  // after a removal it is no dent
    state.x[0].z -= 5;
    state.removed = {};
    state.debris = {3};
    state.alive[3] = 0;
    state.skin = two_shells();
    end_frame({{0, 1}, {0}, {1}});
  }

  ExpectationCheck::Judged judged(const Expectations& expectations, Extent extent, const StagesRun& stages) const {
    ExpectationCheck check(setup_, expectations, initial_, extent);
    Snapshot before = initial_;
    for (const Snapshot& end : ends_) {
      check.see({0, {}, before, end});
      before = end;
    }
    return check.judged(stages);
  }
  // All stages by the backend.
  ExpectationCheck::Judged judged(const Row& row, double low, double high, Extent extent = Extent::whole) const {
    Expectations expectations;
    row.ask(expectations, low, high);
    EXPECT_FALSE(expectations == Expectations{}) << row.name;
    StagesRun stages;
    stages.by_backend.fill(4);
    return judged(expectations, extent, stages);
  }

  cutproof::Setup setup_;
  Snapshot initial_;
  std::vector<Snapshot> ends_;
};

TEST_F(MadeRun, MeetsEachExpectationAndFailsItOnEachSideOfItsLimits) {
  std::set<std::string> names;
  for (const Row& row : rows()) {
    SCOPED_TRACE(row.name);
    names.insert(row.name);
    const double near = row.is_range ? 1e-9 : 0, beyond = row.is_range ? 1e-3 : 1;
    const auto one = [&](double low, double high) {
      const ExpectationCheck::Judged found = judged(row, low, high);
      EXPECT_EQ(found.verdicts.size(), 1u);
      EXPECT_TRUE(found.not_reached.empty() && found.not_its_own.empty());
      return found.verdicts.empty() ? Verdict{} : found.verdicts.front();
    };
    const Verdict met = one(row.value - near, row.value + near);
    EXPECT_TRUE(met.holds) << met.witness.text;
    EXPECT_EQ(met.property, "expected " + row.name);
    EXPECT_NEAR(met.measured, row.value, 1e-12);
    const Verdict above = one(row.value - 2 * beyond, row.value - beyond);
    EXPECT_FALSE(above.holds);
    EXPECT_EQ(above.bound, row.value - beyond);
    EXPECT_EQ(above.frame, row.frame_above);
    EXPECT_FALSE(above.witness.text.empty());
    const Verdict below = one(row.value + beyond, row.is_range ? row.value + 2 * beyond : row.value + beyond);
    EXPECT_FALSE(below.holds);
    EXPECT_EQ(below.bound, row.value + beyond);
    EXPECT_EQ(below.frame, row.frame_below);
  }
  EXPECT_EQ(names.size(), kExpectations);
}

TEST_F(MadeRun, ThatIsCutShortTellsWhatCannotChangeAndWhatIsTooMuchAlready) {
  for (const Row& row : rows()) {
    SCOPED_TRACE(row.name);
    const double beyond = row.is_range ? 1e-3 : 1;
    const auto tells = [&](double low, double high) {
      const ExpectationCheck::Judged found = judged(row, low, high, Extent::cut_short);
      EXPECT_EQ(found.verdicts.size() + found.not_reached.size(), 1u);
      for (const std::string& name : found.not_reached) EXPECT_EQ(name, row.name);
      for (const Verdict& verdict : found.verdicts) EXPECT_FALSE(verdict.holds);
      return !found.verdicts.empty();
    };
    EXPECT_EQ(tells(row.value - 2 * beyond, row.value - beyond), row.told != Told::never) << "too much";
    EXPECT_EQ(tells(row.value + beyond, row.value + beyond), row.told == Told::always) << "too little";
  }
}

// With debris the split removes, too.
TEST_F(MadeRun, IsHeldToWhatTheStagesDecideThatTheBackendRan) {
  for (const int32_t debris : {0, 2}) {
    setup_.split.debris = debris;
    for (const Row& row : rows()) {
      const bool hangs_on_removal = row.decided_by.contains(Stage::detect) && row.name.find("dent") == row.name.npos &&
                                    row.name != "greatest stretch";
      for (const Stage own : kStages) {
        SCOPED_TRACE(row.name + " of a backend that runs " + std::string(name_of(own)));
        StagesRun stages;
        for (const Stage stage : kStages) {
          ++(stage == own ? stages.by_backend : stages.by_reference)[static_cast<std::size_t>(stage)];
        }
        Expectations expectations;
        row.ask(expectations, row.value - 1e-9, row.value + 1e-9);
        const ExpectationCheck::Judged found = judged(expectations, Extent::whole, stages);
        const bool is_its_own = row.decided_by.bits == 0 || row.decided_by.contains(own) ||
                                (debris > 0 && own == Stage::split && hangs_on_removal);
        EXPECT_EQ(found.verdicts.size(), is_its_own ? 1u : 0u);
        EXPECT_EQ(found.not_its_own, is_its_own ? std::vector<std::string>{} : std::vector<std::string>{row.name});
      }
    }
  }
}

}  // namespace
}  // namespace cutproof::harness::expectations_test
