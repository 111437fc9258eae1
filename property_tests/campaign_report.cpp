#include "property_tests/campaign_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

#include "model/error.h"
#include "model/io/json_number.h"
#include "model/io/json_reader.h"
#include "oracles/iterates/probe.h"

namespace cutproof::property_tests {

namespace {

using nlohmann::json;

constexpr const char* kResultFormat = "cutproof.fuzz";
constexpr int kFormatVersion = 4;
// Classes of cases are rare: below this many cases, or with small ones only, an empty class says nothing.
constexpr int64_t kCasesThatMeetEveryClass = 1000;
constexpr int kSizeThatMeetsEveryClass = 79;
// Greatest share of inconclusive comparisons of iterates (tolerances.md, Iterate by iterate). A judge that grants
// everything judges nothing. (Merges of whole frames cannot be decided at all; they are counted.)
constexpr double kMostUndecided = 0.001;

constexpr double kMostCounted = 1e12;  // by one shard, of anything

// Counts and measurements of a result, and those that are summed over shards.
constexpr const char* kCounts[] = {"cases", "refused", "verdicts", "particles"};
constexpr const char* kCountsOfSteps[] = {"steps", "particles", "not_compared"};  // within steps_compared
constexpr const char* kOfThreads[] = {"generating", "running", "judging"};        // within thread_seconds

constexpr const char* kRemedy = "give the results (--json) of all shards of one campaign, each once";

// Fields that two shards of one campaign share: those that determine cases, backend and judge. No case depends on the
// number of threads.
constexpr const char* kOfTheCampaign[] = {"cutproof",    "commit",        "backend",  "schedule", "schedule_seed",
                                          "seed",        "sizes",         "dynamics", "batch",    "keep_going",
                                          "cases_asked", "seconds_asked", "shards"};

// By stage and name: the order in which threads, or shards, come upon them says nothing.
void sort_properties(json& properties) {
  const auto key = [](const json& one) {
    const auto stage = std::find(std::begin(kStageNames), std::end(kStageNames), one.at("stage").get<std::string>());
    return std::pair(stage - std::begin(kStageNames), one.at("property").get<std::string>());
  };
  std::sort(properties.begin(), properties.end(), [&](const json& a, const json& b) { return key(a) < key(b); });
}

double mean(int64_t sum, int64_t count) {
  return count > 0 ? static_cast<double>(sum) / static_cast<double>(count) : 0.0;
}

// Counts are whole, and so few (kMostCounted) that those of all shards fit.
static_assert(kMostCounted * kMostShards < 9e18);
void add_count(json& sum, const json& more) { sum = sum.get<int64_t>() + more.get<int64_t>(); }
void add_figure(json& sum, const json& more) { sum = sum.get<double>() + more.get<double>(); }

// `first`: the file that `whole` began with.
void require_same_campaign(const json& whole, const json& part, const std::string& file, const std::string& first) {
  for (const char* field : kOfTheCampaign) {
    if (part.value(field, json()) == whole.value(field, json())) continue;
    throw InputError(
        file, field,
        fmt::format("{} here, {} in {}", part.value(field, json()).dump(), whole.value(field, json()).dump(), first),
        kRemedy);
  }
}

// Stages that the reference ran for the backend, in order.
std::vector<std::string> left_stages(const json& document) {
  const auto stages = document.at("left_to_reference").get<std::vector<std::string>>();
  for (const std::string& stage : stages) {
    if (std::find(kStageNames.begin(), kStageNames.end(), stage) == kStageNames.end()) {
      throw std::invalid_argument("left_to_reference: there is no stage \"" + stage + "\"");
    }
  }
  return stages;
}
json left_in_either(const json& one, const json& other) {
  const std::vector<std::string> here = left_stages(one), there = left_stages(other);
  json both = json::array();
  for (const std::string_view stage : kStageNames) {
    const auto has = [&](const auto& list) { return std::find(list.begin(), list.end(), stage) != list.end(); };
    if (has(here) || has(there)) both.push_back(stage);
  }
  return both;
}

// `part` is added to `whole`.
void add_shard(json& whole, const json& part) {
  for (const char* count : kCounts) add_count(whole.at(count), part.at(count));
  for (const CoverageClass& each : kCoverageClasses) {
    add_count(whole.at("coverage").at(each.name), part.at("coverage").at(each.name));
  }
  add_figure(whole.at("cases_per_second"), part.at("cases_per_second"));
  for (const char* each : kOfThreads)
    add_figure(whole.at("thread_seconds").at(each), part.at("thread_seconds").at(each));
  whole["mean_particles"] = mean(whole.at("particles").get<int64_t>(), whole.at("cases").get<int64_t>());
  // Shards run concurrently: together they take as long as the slowest, and do the work of all.
  whole["seconds"] = std::max(whole.at("seconds").get<double>(), part.at("seconds").get<double>());
  if (whole.contains("steps_compared")) {
    json& compared = whole.at("steps_compared");
    const json& more = part.at("steps_compared");
    for (const char* count : kCountsOfSteps) add_count(compared.at(count), more.at(count));
    // A number, or the string "inf" for a failure.
    const json &here = compared.at("greatest_h"), &there = more.at("greatest_h");
    if (there.is_string() || (here.is_number() && there.get<double>() > here.get<double>())) {
      compared["greatest_h"] = there;
    }
  }
  for (const json& theirs : part.at("properties")) {
    json& ours = whole.at("properties");
    const auto known = std::find_if(ours.begin(), ours.end(), [&](const json& one) {
      return one.at("property") == theirs.at("property") && one.at("stage") == theirs.at("stage");
    });
    if (known == ours.end()) {
      ours.push_back(theirs);
    } else {
      harness::add_summary(*known, theirs);
    }
  }
  whole["left_to_reference"] = left_in_either(whole, part);
  for (const json& violation : part.at("violations")) whole["violations"].push_back(violation);
}

}  // namespace

json violation_json(const Violation& violation, const std::string& file) {
  return {{"index", violation.index},
          {"property", violation.verdict.property},
          {"stage", name_of(violation.verdict.stage)},
          {"text", describe(violation.verdict)},
          {"witness", violation.verdict.witness.text},
          {"file", file}};
}

json campaign_document(const harness::BackendChoice& backend, const CampaignOptions& options, const Campaign& campaign,
                       const json& violations) {
  const harness::BackendDescriptor& described = harness::described_backend(backend.name);
  json coverage = json::object();
  for (std::size_t h = 0; h < kCoverageClassCount; ++h) coverage[kCoverageClassNames[h]] = campaign.coverage.begin()[h];
  json document = {
      {"format", kResultFormat},
      {"format_version", kFormatVersion},
      {"cutproof", CUTPROOF_VERSION},
      {"complete", !campaign.stopped},
      {"backend", backend.name},
      {"seed", options.seed},
      {"sizes", {options.least_size, options.most_size}},
      {"dynamics", options.dynamics},
      {"batch", options.batch},
      {"threads", options.threads},
      {"keep_going", options.keep_going},
      {"shard", options.shard + 1},
      {"shards", options.shards},
      {"cases", campaign.cases},
      {"refused", campaign.refused},
      {"verdicts", campaign.verdicts},
      {"particles", campaign.particles},
      {"mean_particles", mean(campaign.particles, campaign.cases)},
      {"seconds", campaign.seconds},
      {"cases_per_second", campaign.seconds > 0 ? static_cast<double>(campaign.cases) / campaign.seconds : 0.0},
      {"thread_seconds",
       {{"generating", campaign.generating},
        {"running", campaign.running},
        {"judging", campaign.reference + campaign.judging}}},
      {"coverage", coverage},
      {"properties", campaign.properties.to_json()},
      {"left_to_reference", campaign.stages.left()},
      {"violations", violations},
      {"holds", violations.empty() && campaign.verdicts > 0 && !campaign.stopped}};
  sort_properties(document["properties"]);
  if (described.takes_schedule) {
    document["schedule"] = backend.schedule;
    document["schedule_seed"] = backend.seed;
  }
  if (options.dynamics && !described.is_the_reference) {
    const StepsCompared& compared = campaign.compared;
    document["steps_compared"] = {{"steps", compared.steps},
                                  {"particles", compared.particles},
                                  {"not_compared", compared.undecidable},
                                  {"greatest_h", json_number(compared.greatest)}};
  }
  if (options.seconds) {
    document["seconds_asked"] = *options.seconds;
  } else {
    document["cases_asked"] = options.cases;
  }
  if (const char* commit = std::getenv("CUTPROOF_COMMIT")) document["commit"] = commit;
  return document;
}

namespace {

// Throws json::exception or std::invalid_argument if something is missing, or of another kind, that merging or a
// conclusion reads; InputError if there is too much.
void require_fields(const json& part, const std::string& file) {
  // Counts are added up: those of a million shards must fit.
  const auto require_count = [&](const json& within, const char* name) {
    const double count = within.at(name).get<double>();
    if (count >= 0 && count <= kMostCounted) return;
    throw InputError(file, name, fmt::format("{} is not a count of a campaign", count), kRemedy);
  };
  for (const char* count : kCounts) require_count(part, count);
  for (const char* figure : {"seconds", "cases_per_second"}) static_cast<void>(part.at(figure).get<double>());
  for (const char* of_threads : kOfThreads) {
    static_cast<void>(part.at("thread_seconds").at(of_threads).get<double>());
  }
  for (const char* flag : {"dynamics", "complete"}) static_cast<void>(part.at(flag).get<bool>());
  static_cast<void>(part.at("backend").get<std::string>());
  static_cast<void>(integer_from<int>(part.at("sizes").at(1)));
  for (const CoverageClass& each : kCoverageClasses) require_count(part.at("coverage"), each.name);
  if (part.at("properties").size() > io::kMostProperties) {
    throw InputError(
        file, "properties",
        fmt::format("there are {} properties, more than {}", part.at("properties").size(), io::kMostProperties),
        kRemedy);
  }
  for (const json& property : part.at("properties").get<std::vector<json>>()) {
    for (const char* word : {"property", "stage"}) static_cast<void>(property.at(word).get<std::string>());
    for (const char* count : {"judged", "checked", "failed", "inconclusive"}) require_count(property, count);
    for (const char* figure : {"measured", "of_bound"}) static_cast<void>(property.at(figure));
    static_cast<void>(property.at("seconds").get<double>());
  }
  static_cast<void>(left_stages(part));
  for (const json& violation : part.at("violations").get<std::vector<json>>()) {
    static_cast<void>(integer_from<int64_t>(violation.at("index")));
    for (const char* word : {"text", "file"}) static_cast<void>(violation.at(word).get<std::string>());
  }
  if (!part.contains("steps_compared")) return;
  for (const char* count : kCountsOfSteps) require_count(part.at("steps_compared"), count);
  static_cast<void>(part.at("steps_compared").at("greatest_h"));
}

InputError no_result(const std::string& file, const std::exception& why) {
  return {file, "", fmt::format("this is not a result of `cutproof fuzz` ({})", why.what()), kRemedy};
}

// One result as it stands in its file.
json read_shard(const std::string& file) {
  const json part = io::read_json(file, io::kCampaignLimits,
                                  "Copy it again, or leave it out: --merge then names the shard as missing.");
  if (!part.is_object() || part.value("format", json()) != kResultFormat) {
    throw InputError(file, "format", "this is not a result of `cutproof fuzz`", kRemedy);
  }
  if (const json& version = part.at("format_version"); version != kFormatVersion) {
    throw InputError(file, "format_version",
                     fmt::format("this is version {}, and only {} is read", version.dump(), kFormatVersion),
                     "run the campaign again with this version of cutproof");
  }
  if (part.contains("merged_shards")) {
    throw InputError(file, "merged_shards", "this result is merged already", kRemedy);
  }
  const auto shard = integer_from<int64_t>(part.at("shard")), shards = integer_from<int64_t>(part.at("shards"));
  if (shards < 1 || shards > kMostShards || shard < 1 || shard > shards) {
    throw InputError(file, "shard", fmt::format("there is no shard {} of {}", shard, shards), kRemedy);
  }
  require_fields(part, file);
  return part;
}

}  // namespace

void require_campaign(const json& document, const std::string& file) {
  try {
    require_fields(document, file);
    if (document.contains("seconds_asked")) {
      static_cast<void>(document.at("seconds_asked").get<double>());
    } else {
      static_cast<void>(integer_from<int64_t>(document.at("cases_asked")));
    }
    for (const char* const count : {"shard", "shards"}) {
      const auto number = integer_from<int64_t>(document.at(count));
      if (number < 1 || number > kMostShards) throw InputError(file, count, "there is no such shard", kRemedy);
    }
    if (document.contains("missing_shards")) {
      for (const json& missing : document.at("missing_shards").get<std::vector<json>>())
        static_cast<void>(integer_from<int64_t>(missing));
      static_cast<void>(integer_from<int64_t>(document.at("merged_shards")));
    }
  } catch (const json::exception& error) {
    throw no_result(file, error);
  } catch (const std::invalid_argument& error) {
    throw no_result(file, error);
  }
}

json merge_shards(const std::vector<std::string>& files) {
  json whole;
  std::map<int64_t, std::string> file_of;  // shard -> its file
  std::set<int64_t> stopped;               // shards that have not judged all of their cases
  for (const std::string& file : files) {
    try {
      const json part = read_shard(file);
      // A shard of another campaign is reported as such, and not as given twice.
      if (whole.is_null()) {
        whole = part;
      } else {
        require_same_campaign(whole, part, file, files.front());
      }
      const auto shard = part.at("shard").get<int64_t>();
      const auto [known, is_new] = file_of.try_emplace(shard, file);
      if (!is_new) {
        throw InputError(file, "shard", fmt::format("shard {} was given already, by {}", shard, known->second),
                         kRemedy);
      }
      if (file_of.size() > 1) add_shard(whole, part);
      if (!part.at("complete").get<bool>()) stopped.insert(shard);
    } catch (const json::exception& error) {
      throw no_result(file, error);
    } catch (const std::invalid_argument& error) {
      throw no_result(file, error);
    }
  }
  const auto expected = whole.at("shards").get<int64_t>();
  json missing = json::array();
  for (int64_t shard = 1; shard <= expected; ++shard) {
    if (!file_of.contains(shard) || stopped.contains(shard)) missing.push_back(shard);
  }
  sort_properties(whole.at("properties"));
  json& violations = whole.at("violations");
  std::stable_sort(violations.begin(), violations.end(), [](const json& a, const json& b) {
    return a.at("index").get<int64_t>() < b.at("index").get<int64_t>();
  });
  whole["complete"] = missing.empty();
  whole["holds"] = violations.empty() && whole.at("verdicts").get<int64_t>() > 0 && missing.empty();
  whole["missing_shards"] = std::move(missing);
  whole["shard"] = 1;
  whole["shards"] = 1;
  whole["merged_shards"] = expected;
  return whole;
}

std::string missing_shards(const json& document) {
  std::vector<std::string> ranges;
  const auto missing = document.value("missing_shards", std::vector<int64_t>());
  for (std::size_t first = 0; first < missing.size();) {
    std::size_t last = first;
    while (last + 1 < missing.size() && missing[last + 1] == missing[last] + 1) ++last;
    ranges.push_back(first == last ? fmt::format("{}", missing[first])
                                   : fmt::format("{}-{}", missing[first], missing[last]));
    first = last + 1;
  }
  return fmt::format("{}", fmt::join(ranges, ","));
}

namespace {

// How far a campaign came that was stopped.
std::string how_far(const json& document) {
  if (document.contains("seconds_asked")) {
    return fmt::format("it was stopped after {:.1f} of {:g} s", document.at("seconds").get<double>(),
                       document.at("seconds_asked").get<double>());
  }
  const auto shard = document.at("shard").get<int64_t>(), shards = document.at("shards").get<int64_t>();
  return fmt::format("it was stopped after {} of {} cases", document.at("cases").get<int64_t>(),
                     (document.at("cases_asked").get<int64_t>() - shard + shards) / shards);
}

}  // namespace

CampaignConclusion conclude(const json& document, bool whole) {
  const auto cases = document.at("cases").get<int64_t>();
  const std::size_t violations = document.at("violations").size();
  const std::string missing = missing_shards(document);
  std::string lost;
  if (!missing.empty()) {
    lost = fmt::format("of {} shards these are missing or were stopped, and not all of their cases were judged: {}",
                       document.at("merged_shards").get<int64_t>(), missing);
  } else if (!document.at("complete").get<bool>()) {
    lost = how_far(document);
  }
  if (violations > 0) {
    return {fmt::format("{} of {} cases{}", violations, cases, lost.empty() ? "" : "; " + lost)};
  }
  if (!lost.empty()) return {lost};
  const std::vector<std::string> left = left_stages(document);
  if (cases == 0 || document.at("verdicts").get<int64_t>() == 0) {
    return {left.empty() ? "nothing was judged"
                         : "nothing was judged: the backend ran no stage, the reference ran all of them for it"};
  }
  if (!whole || cases < kCasesThatMeetEveryClass) return {};
  std::vector<std::string> empty, rare;
  for (const CoverageClass& wanted : kCoverageClasses) {
    const auto count = document.at("coverage").at(wanted.name).get<int64_t>();
    if (count >= least_count(wanted, cases, document.at("dynamics").get<bool>())) continue;
    (count == 0 ? empty : rare).emplace_back(count == 0 ? wanted.name : fmt::format("{} ({})", wanted.name, count));
  }
  const bool meets_every_class = document.at("sizes").at(1).get<int>() >= kSizeThatMeetsEveryClass;
  if (meets_every_class && !empty.empty()) {
    return {fmt::format("no case had: {}, so nothing was tested there", fmt::join(empty, ", "))};
  }
  if (meets_every_class && !rare.empty()) {
    return {fmt::format("fewer than one in ten of {} cases had: {}, so too little was tested there", cases,
                        fmt::join(rare, ", "))};
  }
  const bool steps = std::find(left.begin(), left.end(), name_of(Stage::step)) == left.end();
  if (steps && document.contains("steps_compared") &&
      document.at("steps_compared").at("particles").get<int64_t>() == 0) {
    return {"no position after a step was compared with the reference's"};
  }
  for (const json& property : document.at("properties")) {
    if (property.at("property") != oracles::kStepByIterates) continue;
    const double inconclusive = property.at("inconclusive").get<double>(),
                 checked = property.at("checked").get<double>();
    if (inconclusive <= kMostUndecided * checked) continue;
    return {fmt::format("of {:.0f} comparisons of '{}' after {} {:.0f} were inconclusive, so too little was tested",
                        checked, property.at("property").get<std::string>(), property.at("stage").get<std::string>(),
                        inconclusive)};
  }
  return {};
}

}  // namespace cutproof::property_tests
