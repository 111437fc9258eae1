// Campaigns find what is planted, wherever it is, and the first of it; counterexamples come back from their files.
#include "property_tests/campaign.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <latch>
#include <mutex>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "gpu/backends.h"
#include "model/error.h"
#include "property_tests/campaign_report.h"
#include "property_tests/counterexample.h"
#include "reference_cpu/reference.h"

namespace cutproof::property_tests::campaign_test {
namespace {

// The reference with something planted in what it shows or does.
class Planted final : public Backend {
 public:
  using Change = std::function<void(State&)>;
  using OnLoad = std::function<void(Setup&)>;
  explicit Planted(Change change, OnLoad on_load = {}) : change_(std::move(change)), on_load_(std::move(on_load)) {}

  std::string name() const override { return "planted"; }
  bool can_run(Span span) const override { return inner_->can_run(span); }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    if (on_load_) std::for_each(setups.begin(), setups.end(), on_load_);
    inner_->load(std::move(setups), std::move(states));
  }
  void run(Span span) override { inner_->run(span); }
  std::vector<State> snapshot() const override {
    std::vector<State> states = inner_->snapshot();
    if (change_) std::for_each(states.begin(), states.end(), change_);
    return states;
  }
  SpanReport report() const override { return inner_->report(); }

 private:
  std::unique_ptr<Backend> inner_ = reference::make_backend();
  Change change_;
  OnLoad on_load_;
};

// Wrong after the second frame, if something was removed in it.
void break_second_cut(State& state) {
  if (state.frame == 2 && !state.removed.empty()) state.edge_covered = !state.edge_covered;
}

CampaignOptions small_campaign(int64_t cases) {
  CampaignOptions options;
  options.cases = cases;
  options.most_size = 40;
  options.seed = 3;
  return options;
}

const BackendSource kReference{[](int64_t, int) { return reference::make_backend(); }, false};

TEST(Campaign, JudgesEveryCaseOnceWhateverTheLoadsAndThreads) {
  const Campaign one = run_campaign(small_campaign(150), kReference, {});
  EXPECT_EQ(one.cases, 150);
  EXPECT_TRUE(one.violations.empty());
  EXPECT_GT(one.verdicts, 1000);
  CampaignOptions options = small_campaign(150);
  options.threads = 3;
  for (const auto& [batch, backends, devices] : {std::array{7, 3, 1}, {150, 1, 1}, {20, 2, 2}, {5, 3, 3}}) {
    options.batch = batch;
    options.backends = backends;
    options.devices = devices;
    // Of a device that nobody uses nothing would be known.
    std::mutex guard;
    std::set<int> used;
    const BackendSource source{[&](int64_t, int device) {
                                 const std::lock_guard lock(guard);
                                 used.insert(device);
                                 return reference::make_backend();
                               },
                               true};
    const Campaign other = run_campaign(options, source, {});
    EXPECT_EQ(other.cases, one.cases);
    EXPECT_EQ(other.verdicts, one.verdicts);
    EXPECT_EQ(other.particles, one.particles);
    EXPECT_EQ(other.coverage, one.coverage);
    for (const int device : used) EXPECT_LT(device, devices);
    EXPECT_TRUE(used.contains(0));
  }
}

// A backend that runs only once all of them do: so each device has one of the first loads.
TEST(Campaign, RunsItsFirstLoadsOnAllDevicesAtOnce) {
  constexpr int kDevices = 3;
  CampaignOptions options = small_campaign(60);
  options.batch = 10;
  options.threads = options.backends = options.devices = kDevices;
  std::latch all(kDevices);
  std::mutex guard;
  std::multiset<int> used;
  const BackendSource source{[&](int64_t, int device) {
                               {
                                 const std::lock_guard lock(guard);
                                 used.insert(device);
                               }
                               all.arrive_and_wait();
                               return reference::make_backend();
                             },
                             false};
  EXPECT_EQ(run_campaign(options, source, {}).cases, 60);
  EXPECT_EQ(used, (std::multiset<int>{0, 1, 2}));
}

TEST(Campaign, ShardsAreTheWhole) {
  const Campaign whole = run_campaign(small_campaign(100), kReference, {});
  int64_t cases = 0, verdicts = 0;
  for (int64_t shard = 0; shard < 3; ++shard) {
    CampaignOptions options = small_campaign(100);
    options.shard = shard;
    options.shards = 3;
    const Campaign part = run_campaign(options, kReference, {});
    cases += part.cases;
    verdicts += part.verdicts;
  }
  EXPECT_EQ(cases, whole.cases);
  EXPECT_EQ(verdicts, whole.verdicts);
}

TEST(Campaign, BeginsNothingAfterItsTime) {
  CampaignOptions options = small_campaign(1'000'000'000);
  options.seconds = 0.0;
  EXPECT_EQ(run_campaign(options, kReference, {}).cases, 0);
}

TEST(Campaign, FindsTheFirstViolationWhateverTheLoadsAndThreads) {
  const BackendSource planted{[](int64_t, int) { return std::make_unique<Planted>(break_second_cut); }, false};
  const Campaign one = run_campaign(small_campaign(400), planted, {});
  ASSERT_EQ(one.violations.size(), 1u);
  CampaignOptions options = small_campaign(400);
  options.batch = 5;
  options.threads = options.backends = 3;
  const Campaign other = run_campaign(options, planted, {});
  ASSERT_EQ(other.violations.size(), 1u);
  EXPECT_EQ(other.violations.front().index, one.violations.front().index);
  EXPECT_EQ(other.violations.front().failing, one.violations.front().failing);

  options.keep_going = true;
  const Campaign all = run_campaign(options, planted, {});
  EXPECT_EQ(all.cases, 400);
  EXPECT_GT(all.violations.size(), 1u);
  EXPECT_EQ(all.violations.front().index, one.violations.front().index);
}

TEST(Campaign, FindsAStepThatIsNotTheReferencesWhereNothingElseIsWrong) {
  CampaignOptions options = small_campaign(60);
  options.dynamics = true;
  const auto with = [](Planted::OnLoad on_load) {
    return BackendSource{[on_load](int64_t, int) { return std::make_unique<Planted>(Planted::Change(), on_load); },
                         false};
  };
  const Campaign right = run_campaign(options, with({}), {});
  EXPECT_TRUE(right.violations.empty());
  EXPECT_GE(right.compared.steps, 60);
  EXPECT_GT(right.compared.particles, 100);
  EXPECT_EQ(right.compared.greatest, 0);
  EXPECT_EQ(run_campaign(options, kReference, {}).compared.steps, 0) << "it is not compared with itself";

  const Campaign soft = run_campaign(options, with([](cutproof::Setup& setup) { setup.step.stiffness /= 2; }), {});
  ASSERT_EQ(soft.violations.size(), 1u);
  const Verdict& verdict = soft.violations.front().verdict;
  EXPECT_EQ(verdict.property, "step by iterates");
  EXPECT_GT(verdict.measured, verdict.bound);
  EXPECT_EQ(verdict.witness.particles.size(), 1u);

  // What nothing moves takes no step that could differ.
  options.dynamics = false;
  const Campaign still = run_campaign(options, with([](cutproof::Setup& setup) { setup.step.stiffness /= 2; }), {});
  EXPECT_TRUE(still.violations.empty());
  EXPECT_EQ(still.compared.steps, 0);
}

TEST(Campaign, NamesTheCaseWhoseBodyTheBackendThrowsOver) {
  constexpr int32_t kMost = 30;
  const BackendSource planted{[](int64_t, int) {
                                return std::make_unique<Planted>(Planted::Change(), [](const cutproof::Setup& setup) {
                                  if (setup.body.particle_count() > kMost) throw std::logic_error("too many for me");
                                });
                              },
                              false};
  const CampaignOptions options = small_campaign(400);
  const Campaign campaign = run_campaign(options, planted, {});
  ASSERT_EQ(campaign.violations.size(), 1u);
  const Violation& violation = campaign.violations.front();
  EXPECT_EQ(violation.verdict.property, "runs to its end");
  EXPECT_EQ(violation.verdict.witness.text, "too many for me");
  EXPECT_GT(violation.failing.nodes.size(), static_cast<std::size_t>(kMost));
  for (int64_t index = 0; index < violation.index; ++index) {
    EXPECT_LE(case_at(options, index).nodes.size(), static_cast<std::size_t>(kMost)) << index;
  }
}

TEST(Campaign, EndsWithWhatTheMachineThrows) {
  const BackendSource broken{[](int64_t, int) -> std::unique_ptr<Backend> { throw MachineError("no device"); }, false};
  CampaignOptions options = small_campaign(100);
  options.threads = 3;
  EXPECT_THROW(run_campaign(options, broken, {}), MachineError);
}

TEST(Simplest, KeepsOnlyWhatTheFaultNeeds) {
  const auto fails = [](const Case& c) {
    return dissect_alone([] { return std::make_unique<Planted>(break_second_cut); }, c, false).failure.has_value();
  };
  int found = 0;
  for (int64_t index = 0; index < 400 && found < 3; ++index) {
    const Case c = case_at(small_campaign(400), index);
    if (!fails(c)) continue;
    ++found;
    const Case simple = simplest(c, fails, [] { return false; });
    EXPECT_TRUE(fails(simple));
    // Something must be removed in the second of two frames.
    EXPECT_EQ(simple.nodes.size(), 1u);
    EXPECT_EQ(simple.strokes.size(), 2u);
  }
  EXPECT_EQ(found, 3);
}

// A document of a campaign in which each class occurred in `often` cases.
nlohmann::json document_with(int64_t cases, bool dynamics, int64_t often) {
  nlohmann::json coverage;
  for (const char* name : kCoverageClassNames) coverage[name] = often;
  return {{"complete", true},
          {"cases", cases},
          {"verdicts", 10 * cases},
          {"violations", nlohmann::json::array()},
          {"dynamics", dynamics},
          {"coverage", coverage},
          {"sizes", {0, 79}},
          {"properties", nlohmann::json::array()},
          {"left_to_reference", nlohmann::json::array()}};
}

TEST(ACampaign, FailsIfAClassThatItMustMeetIsEmptyOrRare) {
  constexpr int64_t kCases = 1000;
  EXPECT_TRUE(conclude(document_with(kCases, true, kCases / 10), true).holds());
  EXPECT_TRUE(conclude(document_with(kCases, false, 1), true).holds());
  int64_t of_moving = 0, often = 0;
  for (const CoverageClass& each : kCoverageClasses) {
    for (const bool dynamics : {false, true}) {
      nlohmann::json document = document_with(kCases, dynamics, kCases / 10);
      document["coverage"][each.name] = 0;
      const CampaignConclusion conclusion = conclude(document, true);
      EXPECT_EQ(conclusion.holds(), !dynamics && each.occurs != Occurs::always) << each.name;
      EXPECT_EQ(conclusion.failure.find(each.name) == std::string::npos, conclusion.holds()) << conclusion.failure;
      document["coverage"][each.name] = kCases / 10 - 1;
      EXPECT_EQ(conclude(document, true).holds(), !dynamics || each.occurs != Occurs::often_where_bodies_move)
          << each.name;
    }
    of_moving += each.occurs != Occurs::always;
    often += each.occurs == Occurs::often_where_bodies_move;
  }
  EXPECT_GE(of_moving, 15);
  EXPECT_GE(often, 10);
  // Of few cases, of small ones, or of one shard of several an empty class says nothing.
  EXPECT_TRUE(conclude(document_with(kCases - 1, true, 0), true).holds());
  EXPECT_TRUE(conclude(document_with(kCases, true, 0), false).holds());
  nlohmann::json small = document_with(kCases, true, 0);
  small["sizes"] = {0, 78};
  EXPECT_TRUE(conclude(small, true).holds());
}

TEST(ACounterexample, ComesBackFromItsFile) {
  Counterexample found;
  found.failing = draw_moving_case(5, 30);
  found.backend = "simulated";
  found.schedule = {0, 0, 3, 0, 1};
  found.found = "'coverage' fails";
  found.seed = 12;
  found.index = 345;
  const Counterexample read = counterexample_from_json(to_json(found), "f.json");
  EXPECT_EQ(read.failing, found.failing);
  EXPECT_EQ(read.backend, found.backend);
  EXPECT_EQ(read.schedule, found.schedule);
  EXPECT_EQ(read.found, found.found);
  EXPECT_EQ(read.seed, found.seed);
  EXPECT_EQ(read.index, found.index);
  EXPECT_EQ(counterexample_from_json(to_json(found.failing), "f.json").failing, found.failing);
}

TEST(ACounterexample, IsRefusedWithItsFieldIfItIsNone) {
  Counterexample good;
  good.failing = draw_case(5, 30);
  ASSERT_FALSE(good.failing.strokes.empty());
  const std::string text = to_json(good);
  const auto refused = [&](std::string from, const std::string& to, const std::string& field) {
    std::string broken = text;
    const std::size_t at = broken.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    broken.replace(at, from.size(), to);
    try {
      counterexample_from_json(broken, "f.json");
      ADD_FAILURE() << "accepted: " << to;
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), "f.json");
      EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
    }
  };
  for (const char* version : {"0", "2"}) {
    refused("\"format_version\":1", std::string("\"format_version\":") + version, "format_version");
  }
  refused("cutproof.counterexample", "cutproof.fuzz", "format");
  refused("\"schedule\":[]", "\"schedule\":[[99999999999,1]]", "schedule");
  refused("\"moves\":false", "\"moves\":false,\"tail\":1", "tail");
  refused("\"substeps\":2", "\"substeps\":0", "substeps");
  refused("\"link\":\"", "\"link\":\"not ", "strokes");
  refused("\"back\":", "\"back\":7", "");
  // Numbers that no integer holds.
  refused("\"seed\":0", "\"seed\":4.6e93", "seed");
  refused("\"index\":0", "\"index\":-0.5", "index");
  refused("\"substeps\":2", "\"substeps\":2e73", "substeps");
  refused("\"schedule\":[]", "\"schedule\":[[0,65536]]", "schedule");
  EXPECT_THROW(counterexample_from_json("[]", "f.json"), InputError);
  EXPECT_THROW(counterexample_from_json("", "f.json"), InputError);
}

// What a page reads of a campaign without asking again.
TEST(CampaignDocument, IsRefusedWithNumbersThatNoIntegerHolds) {
  harness::BackendChoice backend;
  backend.name = "host";
  CampaignOptions options;
  options.cases = 7;
  const nlohmann::json right = campaign_document(backend, options, {}, nlohmann::json::array());
  EXPECT_NO_THROW(require_campaign(right, "c.json"));
  nlohmann::json fewer_classes = right;
  fewer_classes["coverage"].erase(kCoverageClassNames.front());
  EXPECT_THROW(require_campaign(fewer_classes, "c.json"), InputError);
  for (const char* field : {"cases_asked", "shard", "shards"}) {
    for (const nlohmann::json& value : {nlohmann::json(1e300), nlohmann::json(2.5), nlohmann::json("7")}) {
      nlohmann::json wrong = right;
      wrong[field] = value;
      EXPECT_THROW(require_campaign(wrong, "c.json"), InputError) << field << " " << value;
    }
  }
  nlohmann::json merged = right;
  merged["missing_shards"] = {1e300};
  merged["merged_shards"] = 2;
  EXPECT_THROW(require_campaign(merged, "c.json"), InputError);
  merged["missing_shards"] = {1};
  EXPECT_NO_THROW(require_campaign(merged, "c.json"));
  merged["merged_shards"] = -1e300;
  EXPECT_THROW(require_campaign(merged, "c.json"), InputError);
}

}  // namespace
}  // namespace cutproof::property_tests::campaign_test
