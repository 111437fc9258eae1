// `cutproof bench stages`: no time without its error, no error that goes unseen. What the times are is not tested.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>

#include "benchmarks/frame_errors.h"
#include "benchmarks/memory.h"
#include "benchmarks/phase_counter.h"
#include "benchmarks/scene.h"
#include "benchmarks/stage_limits.h"
#include "benchmarks/suites/suites.h"
#include "benchmarks/times.h"
#include "reference_cpu/reference.h"
#include "tests/program.h"

namespace stages_test {
namespace {

using cutproof::Backend;
using cutproof::Setup;
using cutproof::Span;
using cutproof::SpanReport;
using cutproof::Stage;
using cutproof::State;
using cutproof::benchmarks::FrameErrors;
using nlohmann::json;

// --- Limits ----------------------------------------------------------------------------------------------------------

int64_t phases_of(const cutproof::gpu::Plan& plan, Stage stage) {
  return cutproof::benchmarks::phases_of_stages(plan)[static_cast<std::size_t>(stage)];
}

TEST(Limits, AnIterationIsTwoPhasesAndASubstepOneMore) {
  cutproof::gpu::Plan plan;
  plan.substeps = 3;
  plan.iterations = 5;
  const int64_t before = phases_of(plan, Stage::step);
  plan.iterations = 6;
  EXPECT_EQ(phases_of(plan, Stage::step), before + 3 * 2);
  plan.iterations = 5;
  plan.substeps = 4;
  EXPECT_EQ(phases_of(plan, Stage::step), before + 1 + 5 * 2);
}

TEST(Limits, AStageThatIsNotPlannedHasOnlyTheBeginningOfItsSpan) {
  const cutproof::gpu::Plan none;
  EXPECT_EQ(phases_of(none, Stage::detect), 1);
  cutproof::gpu::Plan plan;
  plan.detection = plan.distance = true;
  EXPECT_EQ(phases_of(plan, Stage::detect), 3);  // flag, remove
  plan.merge = true;
  EXPECT_GT(phases_of(plan, Stage::merge), phases_of(none, Stage::merge));
}

// A block of 20 x 10 x 5 particles, counted by hand.
TEST(Limits, CountTheBytesOfABlock) {
  const auto scene = cutproof::benchmarks::make_bench_scene(1000, 1);
  ASSERT_EQ(scene.setup.body.particle_count(), 20 * 10 * 5);
  ASSERT_EQ(scene.setup.body.particle_at.size(), 22U * 12 * 7);
  const auto limits = cutproof::benchmarks::stage_limits(scene.setup, scene.state);
  const auto bytes = [&](Stage stage) { return limits[static_cast<std::size_t>(stage)].bytes; };
  EXPECT_EQ(bytes(Stage::detect), 26 * 1000 + 4 * 1848);
  const double vertices = 2 * (20 * 10 + 10 * 5 + 5 * 20), owners = 20 * 10 * 5 - 18 * 8 * 3;
  const auto members = static_cast<double>(scene.state.clusters.members.size());  // no cluster lies inside
  EXPECT_EQ(bytes(Stage::skin), 21 * vertices + 32 * owners + 84 * scene.state.clusters.count() + 28 * members);
  EXPECT_EQ(bytes(Stage::split), 0);
  // Boxes of 5 grown by 1: along x four of them share 2 layers each with the next, along y two, along z one. Classes of
  // 4 2 3 2 3 2 4 by 4 2 4 by 5 particles; the four of 80 make two groups each. A grip names the first two layers along
  // x: of the two classes of 80 there it takes the one group or the other, and of the 40 between them a group of its
  // own.
  ASSERT_EQ(scene.setup.grips.size(), 1U);
  ASSERT_EQ(scene.setup.grips[0].particles.size(), 2U * 10 * 5);
  const double groups = 7 * 3 + 4 + 1, pairs = 12 * 1 + (6 + 4 + 1) * 2 + 3 * 4;
  ASSERT_TRUE(scene.setup.has_blade);
  ASSERT_EQ(scene.setup.step.acceleration, cutproof::Acceleration::none);
  ASSERT_EQ(scene.setup.step.substeps * 100 + scene.setup.step.iterations, 404);
  const double match = 16 * pairs + 80 * groups + 192 * 8, advance = 16 * pairs + 296 * groups + 48 * 8;
  const double first = 416 * groups, last = 244 * groups;
  EXPECT_EQ(bytes(Stage::step), 132 * 1000 + first + 3 * 608 * groups + last + 4 * 4 * (match + advance));
}

TEST(Limits, ASlowerMachineRaisesThem) {
  cutproof::benchmarks::MachineLimits machine;
  machine.copy_bytes_per_second = 1e12;
  machine.graph_node_seconds = 1e-6;
  machine.l2_round_trip_seconds = 0.5e-6;
  const json by_phases = cutproof::benchmarks::limit_json({1e6, 10}, machine, 30e-6);
  EXPECT_DOUBLE_EQ(by_phases.at("seconds").get<double>(), 15e-6);
  EXPECT_DOUBLE_EQ(by_phases.at("multiple").get<double>(), 2.0);
  const json by_bytes = cutproof::benchmarks::limit_json({1e8, 10}, machine, 3e-4);
  EXPECT_DOUBLE_EQ(by_bytes.at("seconds").get<double>(), 1e-4);
  EXPECT_DOUBLE_EQ(by_bytes.at("multiple").get<double>(), 3.0);
}

// --- The program -----------------------------------------------------------------------------------------------------

class Bench : public Program {
 protected:
  Outcome bench(const std::string& arguments, const std::string& environment = "") const {
    return cutproof("bench " + arguments, environment);
  }
  json result(const std::string& name) const { return json::parse(read(name)); }
};

// Every row that stages.cpp owes, each with an error where it ran.
void expect_rows(const json& document, const std::string& backend, const std::string& precision,
                 const std::set<std::string>& scenes) {
  const std::set<std::string> wanted = {"frame", "frame, cutting", "step",   "detect",
                                        "split", "merge",          "expand", "skin"};
  std::set<std::array<std::string, 2>> seen, expected;
  for (const std::string& scene : scenes) {
    for (const std::string& what : wanted) expected.insert({scene, what});
  }
  for (const json& row : document.at("rows")) {
    const auto text = [&](const char* field) { return row.at(field).get<std::string>(); };
    seen.insert(std::array<std::string, 2>{text("scene"), text("what")});
    EXPECT_EQ(row.at("backend"), backend);
    EXPECT_EQ(row.at("precision"), precision);
    EXPECT_EQ(row.at("substeps"), 4);
    EXPECT_EQ(row.at("iterations"), 4);
    EXPECT_EQ(row.at("of"), 3);
    if (row.at("what") == "expand") {  // clusters that cover every edge never need it
      EXPECT_EQ(row.at("frames"), 0);
      EXPECT_TRUE(row.at("seconds").is_null());
      continue;
    }
    EXPECT_GT(row.at("frames"), 0) << row;
    EXPECT_LE(row.at("seconds").at("min"), row.at("seconds").at("median")) << row;
    EXPECT_LE(row.at("seconds").at("median"), row.at("seconds").at("max")) << row;
    EXPECT_TRUE(row.at("error").is_object() && !row.at("error").empty()) << row;
  }
  EXPECT_EQ(seen, expected);
  EXPECT_EQ(document.at("rows").size(), expected.size());
  ASSERT_EQ(document.at("scenes").size(), scenes.size());
  for (const json& scene : document.at("scenes")) {
    EXPECT_EQ(scene.at("topology").size(), 5U);
    for (const json& verdict : scene.at("topology")) EXPECT_TRUE(verdict.at("holds")) << verdict;
    EXPECT_GE(scene.at("judged_frames"), 1);
  }
  EXPECT_EQ(document.at("format"), "cutproof.bench");
  EXPECT_EQ(document.at("complete"), true);
  EXPECT_EQ(document.at("holds"), true);
  EXPECT_GT(document.at("machine_limits").at("copy_bytes_per_second"), 0);
  EXPECT_FALSE(document.at("device").get<std::string>().empty());
}

TEST_F(Bench, TellsEveryTimeOfTheReferenceWithItsError) {
  const Outcome outcome =
      bench("stages --sizes 1000,3000 --frames 3 --repeats 1 --json out.json", "CUTPROOF_COMMIT=0123456789ab-dirty");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = result("out.json");
  expect_rows(document, "reference", "double", {"box_1000", "kidney_3000"});
  EXPECT_EQ(document.at("commit"), "0123456789ab-dirty");
  for (const json& row : document.at("rows")) {
    if (row.at("what") != "step") continue;
    EXPECT_EQ(row.at("error").at("max_h"), 0) << "the reference against itself";
  }
  for (const char* words : {"box_1000", "kidney_3000", "double precision", "4 substeps × 4 iterations", "  frame ",
                            "  step ", "  detect ", "  split ", "  merge ", "  expand ", "  skin ", "topology holds"}) {
    EXPECT_NE(outcome.output.find(words), std::string::npos) << "no '" << words << "' in:\n" << outcome.output;
  }
}

TEST_F(Bench, TellsWhatRoundsOnTheHost) {
  const Outcome outcome = bench("stages --backend host --sizes 1000 --frames 3 --repeats 1 --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = result("out.json");
  expect_rows(document, "host", "single", {"box_1000"});
  EXPECT_FALSE(document.contains("commit"));
  for (const json& row : document.at("rows")) {
    if (row.at("what") != "step") continue;
    EXPECT_GT(row.at("error").at("max_h"), 0) << "single precision has its rounding";
  }
  for (const json& row : document.at("rows")) {
    const json& limit = row.at("limit");
    const bool stage = row.at("what").get<std::string>().rfind("frame", 0) != 0;
    ASSERT_EQ(limit.is_null(), !stage || row.at("seconds").is_null()) << row;
    if (limit.is_null()) continue;
    EXPECT_GT(limit.at("phases"), 0) << row;
    const double at_best = std::max(limit.at("bytes_seconds").get<double>(), limit.at("phases_seconds").get<double>());
    EXPECT_EQ(limit.at("seconds"), at_best);
    EXPECT_EQ(limit.at("multiple").is_null(), at_best == 0) << row;
  }
}

// The scenes of Table 1 with both ways of cooking: what the paper timed has its time, and an expansion that really ran.
TEST_F(Bench, ReproducesTable1WithBoxesAndSampledClusters) {
  // Plain iterations, as the paper's: accelerated ones cut the irregular path so that the first eight frames that cut
  // leave nothing to expand.
  const Outcome outcome = bench("stages --frames 8 --repeats 2 --acceleration none --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = result("out.json");
  std::set<std::array<std::string, 2>> seen;
  for (const json& scene : document.at("scenes")) {
    seen.insert({scene.at("scene").get<std::string>(), scene.at("cooking").get<std::string>()});
    // Whether coupling matches is asked where clusters cover every edge.
    EXPECT_EQ(scene.at("topology").size(), scene.at("cooking") == "boxes" ? 5U : 4U);
    EXPECT_GE(scene.at("isolated_groups"), 0);
  }
  std::set<std::array<std::string, 2>> expected;
  for (const char* scene : {"cuboid", "liver", "kidney"}) {
    for (const char* cooking : {"boxes", "sampled"}) expected.insert({scene, cooking});
  }
  expected.insert({"irregular", "sampled"});
  EXPECT_EQ(seen, expected);
  int64_t expansions = 0;
  for (const json& row : document.at("rows")) {
    const auto what = row.at("what").get<std::string>();
    EXPECT_EQ(row.at("of"), 16);
    EXPECT_EQ(row.at("paper_seconds").is_null(), what == "frame, cutting" || row.at("scene") == "irregular") << row;
    if (what == "expand" && row.at("scene") == "irregular") {
      EXPECT_GT(row.at("error").at("added"), 0) << "nothing was expanded";
    }
    if (what == "expand" && row.at("cooking") == "sampled") expansions += row.at("frames").get<int64_t>();
    if (what == "expand" && row.at("cooking") == "boxes") {
      EXPECT_EQ(row.at("frames"), 0);
    }
  }
  EXPECT_GT(expansions, 0);
  for (const char* words : {"Table 1", "paper", "31.79", "10.77", "101096"}) {
    EXPECT_NE(outcome.output.find(words), std::string::npos) << "no '" << words << "' in:\n" << outcome.output;
  }
}

// A body of a given size has the clusters that are asked for, and tells what kernels make of them and what they keep.
TEST_F(Bench, CooksBodiesOfGivenSizesAsAsked) {
  const Outcome outcome =
      bench("stages --backend host --sizes 3000 --clusters boxes,sampled --frames 2 --repeats 1 --json out.json");
  ASSERT_EQ(outcome.status, 0) << outcome.output;
  const json document = result("out.json");
  ASSERT_EQ(document.at("scenes").size(), 2U);
  const json &boxes = document.at("scenes")[0], &sampled = document.at("scenes")[1];
  EXPECT_EQ(boxes.at("cooking"), "boxes");
  EXPECT_EQ(sampled.at("cooking"), "sampled");
  EXPECT_NE(boxes.at("body").at("clusters"), sampled.at("body").at("clusters"));
  for (const json* scene : {&boxes, &sampled}) {
    const auto particles = scene->at("body").at("particles").get<double>();
    const auto groups = scene->at("body").at("groups").get<double>();
    const auto loose = scene->at("body").at("loose").get<double>();
    EXPECT_GT(groups, 0);
    EXPECT_GE(particles - loose, 4 * groups) << "a group has four particles and more";
    // A sanitizer's allocator does not count.
    if (!cutproof::benchmarks::bytes_in_use(cutproof::harness::described_backend("host"))) continue;
    EXPECT_GT(scene->at("bytes"), 24 * particles);
  }
  EXPECT_GT(sampled.at("body").at("loose"), 3 * boxes.at("body").at("loose").get<double>());
  EXPECT_EQ(document.at("rows").back().at("cooking"), "sampled");
  for (const char* words : {"(boxes)", "(sampled)", "particles in none"}) {
    EXPECT_NE(outcome.output.find(words), std::string::npos) << "no '" << words << "' in:\n" << outcome.output;
  }
}

// Judging a large body takes minutes: whoever stops it then has its times.
TEST(Stages, ShowTheirTimesBeforeTheyAreJudged) {
  cutproof::benchmarks::StagesOptions options;
  options.sizes = {1000, 1155};
  options.frames = 2;
  options.repeats = 1;
  std::vector<json> shown;
  const json document = cutproof::benchmarks::run_stages(options, [&](const json& so_far) { shown.push_back(so_far); });
  ASSERT_EQ(shown.size(), 5U);  // nothing yet; of each scene its times, and these with their errors
  std::size_t rows_before = 0;
  for (std::size_t scene = 0; scene < 2; ++scene) {
    const json &timed = shown[1 + 2 * scene], &judged = shown[2 + 2 * scene];
    EXPECT_EQ(timed.at("judging"), true);
    EXPECT_FALSE(judged.contains("judging"));
    EXPECT_EQ(timed.at("complete"), false);
    EXPECT_EQ(timed.at("scenes").size(), scene + 1);
    ASSERT_EQ(timed.at("rows").size(), judged.at("rows").size());
    ASSERT_GT(timed.at("rows").size(), rows_before);
    for (std::size_t k = 0; k < timed.at("rows").size(); ++k) {
      const json &row = timed.at("rows")[k], &later = judged.at("rows")[k];
      EXPECT_EQ(row.at("seconds"), later.at("seconds"));
      if (k < rows_before) {
        EXPECT_EQ(row, later);
        continue;
      }
      EXPECT_TRUE(row.at("error").is_null());
      EXPECT_EQ(row.at("error_text"), "not judged yet");
      EXPECT_NE(later.at("error_text"), "not judged yet");
    }
    rows_before = timed.at("rows").size();
  }
  EXPECT_EQ(document.at("rows"), shown.back().at("rows"));
  EXPECT_FALSE(document.contains("judging"));
}

TEST_F(Bench, RefusesBadUsage) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "use one of stages"},
      {"nothing", "there is no suite 'nothing'"},
      {"nothing", "use one of stages"},
      {"nothing stages --sizes 1000", "there is no suite 'nothing'"},
      {"stages --backend nobody", "nobody"},
      {"stages --sizes 5", "--sizes"},
      {"stages --sizes 1000,many", "sizes"},
      {"stages --frames 0", "frames"},
      {"stages --repeats 0", "repeats"},
      {"stages --scenes cuboid,heart", "heart"},
      {"stages --clusters spheres", "spheres"},
      {"stages --sizes 1000 --clusters boxes,spheres", "spheres"},
      {"stages --scenes cuboid --frames 1000", "--frames"},
      {"stages --sizes 1000 --json nowhere/out.json", "nowhere"},
      {"stages --sizes 200000000000", "--sizes"},
  };
  for (const auto& [arguments, word] : cases) {
    const Outcome outcome = bench(arguments);
    EXPECT_EQ(outcome.status, 2) << arguments << "\n" << outcome.output;
    EXPECT_NE(outcome.output.find(word), std::string::npos) << arguments << "\n" << outcome.output;
  }
  EXPECT_TRUE(files::is_empty(folder_));
}

// --- What judge_frames sees ------------------------------------------------------------------------------------------

// The reference with a fault: `spoil` changes the state after each span of one stage.
class Spoiled final : public Backend {
 public:
  using Spoil = void (*)(const Setup&, State&);
  Spoiled(Stage stage, Spoil spoil) : stage_(stage), spoil_(spoil) {}
  std::string name() const override { return "spoiled"; }
  bool can_run(Span) const override { return true; }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    setups_ = setups;
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override {
    inner_->run(span);
    report_ = inner_->report();
    if (span != Span{stage_, stage_} || !report_.ran[static_cast<std::size_t>(stage_)]) return;
    std::vector<State> states = inner_->snapshot();
    spoil_(setups_.front(), states.front());
    inner_->load(setups_, std::move(states));
  }
  std::vector<State> snapshot() const override { return inner_->snapshot(); }
  SpanReport report() const override { return report_; }

 private:
  Stage stage_;
  Spoil spoil_;
  std::unique_ptr<Backend> inner_ = cutproof::reference::make_backend();
  std::vector<Setup> setups_;
  SpanReport report_;
};

FrameErrors judge_spoiled(Stage stage, Spoiled::Spoil spoil) {
  const cutproof::benchmarks::BenchScene scene = cutproof::benchmarks::make_bench_scene(3000, 2);
  Spoiled backend(stage, spoil);
  backend.load({scene.setup}, {scene.state});
  for (int64_t frame = 0; frame < scene.warm_up; ++frame) backend.run({});
  return cutproof::benchmarks::judge_frames(backend, scene.setup);
}

// GoogleTest's own Setup hides the model's inside tests, so the faults stand here.
void spoil_nothing(const Setup&, State&) {}
void move_one_particle(const Setup& setup, State& state) {
  state.x.front() += cutproof::Vec3{0, 1e-3 * setup.body.grid.spacing, 0};
}
void lose_a_position(const Setup&, State& state) { state.x.front().x = NAN; }
void spare_one_particle(const Setup&, State& state) {
  if (state.removed.empty()) return;
  state.alive[static_cast<std::size_t>(state.removed.back())] = 1;
  state.removed.pop_back();
}
void change_one_number(const Setup&, State& state) { ++state.clusters.number.back(); }
void tear_the_skin(const Setup&, State& state) { state.skin.triangles.pop_back(); }
void drop_the_last_cluster(const Setup&, State& state) {
  cutproof::Clusters& c = state.clusters;
  c.offsets.pop_back();
  c.members.resize(static_cast<std::size_t>(c.offsets.back()));
  c.number.pop_back();
  c.rotation.pop_back();
  c.rest_center.pop_back();
  c.mass.pop_back();
  c.degenerate.pop_back();
}

TEST(JudgeFrames, FindsNoErrorInTheReference) {
  const FrameErrors errors = judge_spoiled(Stage::step, spoil_nothing);
  ASSERT_TRUE(errors.step && errors.detect && errors.skin);
  EXPECT_EQ(errors.step->position.max, 0);
  EXPECT_EQ(errors.detect->differing, 0);
  EXPECT_GT(errors.detect->removed, 0) << "the judged frames must cut";
  EXPECT_EQ(errors.clusters_equal[static_cast<std::size_t>(Stage::split)], true);
  EXPECT_EQ(errors.clusters_equal[static_cast<std::size_t>(Stage::merge)], true);
  EXPECT_TRUE(errors.skin->triangles_equal);
  EXPECT_EQ(errors.skin->vertices.max, 0);
  EXPECT_TRUE(errors.topology_holds());
}

TEST(JudgeFrames, SeesOneParticleMovedByTheStep) {
  const FrameErrors errors = judge_spoiled(Stage::step, move_one_particle);
  ASSERT_TRUE(errors.step);
  EXPECT_NEAR(errors.step->position.max, 1e-3, 1e-9);
  EXPECT_EQ(errors.step->position.beyond, errors.frames);
}

TEST(JudgeFrames, SeesAPositionThatIsNoNumber) {
  const FrameErrors errors = judge_spoiled(Stage::step, lose_a_position);
  ASSERT_TRUE(errors.step);
  EXPECT_TRUE(std::isinf(errors.step->position.max));
}

TEST(JudgeFrames, SeesOneRemovalTooFew) {
  const FrameErrors errors = judge_spoiled(Stage::detect, spare_one_particle);
  ASSERT_TRUE(errors.detect);
  EXPECT_GE(errors.detect->differing, 1);
  EXPECT_FALSE(errors.detect->within_rounding);
}

TEST(JudgeFrames, SeesClustersThatDifferByOneNumber) {
  for (const Stage stage : {Stage::split, Stage::merge}) {
    const FrameErrors errors = judge_spoiled(stage, change_one_number);
    EXPECT_EQ(errors.clusters_equal[static_cast<std::size_t>(stage)], false) << cutproof::name_of(stage);
  }
}

TEST(JudgeFrames, SeesAHoleInTheSkin) {
  const FrameErrors errors = judge_spoiled(Stage::skin, tear_the_skin);
  ASSERT_TRUE(errors.skin);
  EXPECT_FALSE(errors.skin->triangles_equal);
}

TEST(JudgeFrames, SeesTissueThatNoClusterHolds) {
  EXPECT_FALSE(judge_spoiled(Stage::skin, drop_the_last_cluster).topology_holds());
}

TEST(Times, AreTheMedianTheLeastAndTheMost) {
  const cutproof::benchmarks::Times odd = cutproof::benchmarks::times_of({5, 1, 3});
  EXPECT_EQ(odd.median, 3);
  EXPECT_EQ(odd.min, 1);
  EXPECT_EQ(odd.max, 5);
  EXPECT_EQ(odd.count, 3);
  EXPECT_EQ(cutproof::benchmarks::times_of({4, 1, 2, 8}).median, 3);
  EXPECT_EQ(cutproof::benchmarks::times_of({}).count, 0);
}

TEST(Times, AreTakenInTurns) {
  std::vector<std::size_t> order;
  const auto measured = cutproof::benchmarks::in_turns(3, 2, [&](std::size_t k) {
    order.push_back(k);
    return static_cast<double>(order.size());
  });
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 0, 1, 0, 1}));
  EXPECT_EQ(measured, (std::vector<std::vector<double>>{{1, 3, 5}, {2, 4, 6}}));
}

}  // namespace
}  // namespace stages_test
