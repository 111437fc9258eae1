// `cutproof bench baselines`: deletion by hand, and what each row must show. What the times are is not tested.
#include "benchmarks/baselines.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "harness/errors.h"
#include "oracles/oracles.h"
#include "tests/oracles/states.h"
#include "tests/program.h"

namespace cutproof::benchmarks::baselines_test {
namespace {

using cutproof::tests::Lists;
using cutproof::tests::lists_of;
using nlohmann::json;

// Seven particles in a row in three clusters; the middle one, which only the second cluster holds, has been cut.
struct Row {
  Setup setup = cutproof::tests::setup_of(cutproof::tests::block_body(7, 1, 1));
  State state = cutproof::tests::state_of(setup.body, {{0, 1, 2}, {1, 2, 3, 4}, {4, 5, 6}});
  Row() {
    cutproof::tests::remove_particles(state, {3});
    state.clusters.rotation[2] = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};
  }
};

TEST(Deletion, OfParticlesLeavesClustersWhole) {
  Row row;
  delete_from_clusters(row.setup, Deletion::particles, row.state);
  EXPECT_EQ(lists_of(row.state.clusters), (Lists{{0, 1, 2}, {1, 2, 4}, {4, 5, 6}}));
  EXPECT_EQ(row.state.removed, (std::vector<int32_t>{3}));
  EXPECT_TRUE(oracles::rest_frames(row.setup, row.state).holds);
  EXPECT_EQ(row.state.clusters.rotation[2](0, 1), -1);
  const Verdict connected = oracles::cluster_connectivity(row.setup, row.state);
  EXPECT_FALSE(connected.holds) << "it couples what is cut apart";
  const harness::TopologyFigures figures = harness::topology_of(row.setup, row.state);
  EXPECT_EQ(figures.components, 2);
  EXPECT_EQ(figures.couplings, 1);
  EXPECT_FALSE(figures.equal);
}

TEST(Deletion, OfClustersTakesParticlesThatNoOtherHolds) {
  Row row;
  row.state.clusters = cutproof::tests::clusters_of(row.setup.body, {{0, 1}, {1, 2, 3, 4}, {4, 5, 6}});
  delete_from_clusters(row.setup, Deletion::clusters, row.state);
  EXPECT_EQ(lists_of(row.state.clusters), (Lists{{0, 1}, {4, 5, 6}}));
  EXPECT_EQ(row.state.clusters.number, (std::vector<int32_t>{0, 2}));
  EXPECT_EQ(row.state.removed, (std::vector<int32_t>{2, 3}));
  EXPECT_EQ(row.state.alive, (std::vector<uint8_t>{1, 1, 0, 0, 1, 1, 1}));
  EXPECT_TRUE(oracles::rest_frames(row.setup, row.state).holds);
  EXPECT_TRUE(oracles::coverage(row.setup, row.state).holds);
}

TEST(Deletion, OfAClusterOfWhichNothingIsLeftLeavesNone) {
  Row row;
  row.state.clusters = cutproof::tests::clusters_of(row.setup.body, {{0, 1, 2}, {3}, {4, 5, 6}});
  delete_from_clusters(row.setup, Deletion::particles, row.state);
  EXPECT_EQ(lists_of(row.state.clusters), (Lists{{0, 1, 2}, {4, 5, 6}}));
}

TEST(Baselines, DifferInOneSettingFromThisMethod) {
  const Baseline& ours = baselines().front();
  for (std::size_t b = 1; b < baselines().size(); ++b) {
    const Baseline& other = baselines()[b];
    EXPECT_EQ((other.expand != ours.expand) + (other.merge != ours.merge) + (other.criterion != ours.criterion) +
                  (other.remove != ours.remove) + (other.deletion != ours.deletion),
              1)
        << other.name;
  }
}

class BenchBaselines : public Program {};

// Table 3: rows, runs that are kept, a document that follows its schema, and a page.
TEST_F(BenchBaselines, AsksOtherSimulators) {
  const std::string springs = CUTPROOF_PLUGIN_OF_SPRINGS;
  const Outcome outcome = cutproof(
      "bench baselines --backend host --particles 300 --sizes 600 --iterations 8 --no-kicks --save runs --with " +
      springs + " --truth " + springs + " --truth-particles 700 --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  expect_schema(path("out.json"));
  const json document = json::parse(read("out.json"));
  const json& methods = document.at("methods");
  ASSERT_EQ(methods.size(), 6U);  // this method, four of its rules, the plugin
  EXPECT_EQ(methods.back().at("name"), "springs");
  EXPECT_EQ(document.at("truth").at("name"), "springs");
  // It is compared with itself on another grid, and this method is not.
  EXPECT_LT(methods.back().at("error").at("rms"), methods.front().at("error").at("rms"));
  EXPECT_TRUE(methods.front().at("felt").at("withdrawn").is_null());
  EXPECT_NE(outcome.output.find("springs"), std::string::npos) << outcome.output;
  EXPECT_EQ(cutproof("check runs/5_springs_600").status, 1) << "the judge of saved runs says the same: it is not cut";
  EXPECT_EQ(cutproof("report out.json -o page.html").status, 0);
  EXPECT_NE(read("page.html").find("Table 3"), std::string::npos);
  EXPECT_EQ(cutproof("bench baselines --backend host --truth " + springs).status, 2) << "there is nobody to compare";
  const Outcome none = cutproof("bench baselines --backend host --with nothing.so");
  EXPECT_EQ(none.status, 2) << none.output;
}

TEST_F(BenchBaselines, TellsOfEveryMethodWhatItCosts) {
  for (const std::string backend : {"reference", "host"}) {
    const Outcome outcome = cutproof("bench baselines --particles 400 --seed 3 --json out.json --backend " + backend);
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    const json document = json::parse(read("out.json"));
    EXPECT_EQ(document.at("suite"), "baselines");
    EXPECT_EQ(document.at("seed"), 3);
    EXPECT_NE(outcome.output.find("seed 3"), std::string::npos);
    EXPECT_TRUE(document.at("complete") && document.at("holds"));
    std::map<std::string, json> rows;
    for (const json& row : document.at("rows")) {
      const auto name = row.at("name").get<std::string>();
      rows[name] = row;
      EXPECT_NE(outcome.output.find(name), std::string::npos);
      EXPECT_GT(row.at("seconds").at("median"), 0);
      EXPECT_GT(row.at("removed"), 0) << name;
      const json& geometry = row.at("geometry");
      EXPECT_NEAR(geometry.at("lost_per_area").get<double>(),
                  geometry.at("lost_volume").get<double>() / geometry.at("cut_area").get<double>(), 1e-12);
      // The ideal cut is that of the tissue that the blade passed, and tissue that is cut otherwise moves otherwise. A
      // plane of normal n is crossed by max |n_a| edges of that axis to an area of h², no two of which share an end,
      // and the ends on one side, of which there are as many, touch all others: 1/√3 to 1. Within h/2 of the outline
      // there is tissue, but no edge whose ends are both particles; so of a cut D h across (1 - 1/D)² is left, half of
      // it at D = 3.4: 0.5/√3 = 0.289 at least. The kidney is seven particles thick.
      const double least = geometry.at("least_per_area").get<double>();
      EXPECT_GT(least, 0.3) << name;
      EXPECT_LE(least, 1) << name;
      EXPECT_EQ(row.at("equal"),
                row.at("components") == row.at("couplings") && row.at("components") == row.at("shells"))
          << row;
      EXPECT_EQ(geometry.at("lost_volume"), row.at("removed"));
    }
    EXPECT_EQ(rows.size(), baselines().size());
    const json &ours = rows.at("this method"), &unsplit = rows.at("particles deleted, no split"),
               &deleted = rows.at("clusters deleted, no split");
    EXPECT_EQ(ours.at("isolated"), 0);
    EXPECT_EQ(ours.at("unequal_frames"), 0);
    EXPECT_GE(ours.at("components"), 2) << "the second stroke goes through";
    EXPECT_GT(ours.at("interpenetration").at("volume"), 0) << "the pieces are pushed into each other";
    EXPECT_GT(unsplit.at("unequal_frames"), 0) << "pieces stay coupled";
    EXPECT_LT(unsplit.at("couplings"), unsplit.at("components"));
    for (const auto& [name, rule] : {std::pair("one end of each edge", "one"), {"nearer end of each edge", "nearer"}}) {
      const json& one_end = rows.at(name);
      EXPECT_EQ(one_end.at("settings").at("remove"), rule);
      EXPECT_EQ(one_end.at("unequal_frames"), 0) << name;
      EXPECT_LT(one_end.at("geometry").at("lost_per_area"), ours.at("geometry").at("lost_per_area")) << name;
    }
    EXPECT_GT(deleted.at("geometry").at("lost_per_area"), ours.at("geometry").at("lost_per_area"))
        << "what the paper calls burning";
    EXPECT_GT(deleted.at("geometry").at("hausdorff"), ours.at("geometry").at("hausdorff"));
  }
}

TEST_F(BenchBaselines, RefusesBadUsage) {
  expect_refused("bench baselines --backend nobody", {"nobody"});
  expect_refused("bench baselines --particles 10", {"particles"});
  expect_refused("bench baselines --json nowhere/out.json", {"nowhere"});
}

}  // namespace
}  // namespace cutproof::benchmarks::baselines_test
