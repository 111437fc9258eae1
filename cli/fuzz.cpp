// `cutproof fuzz` and `cutproof replay`: random dissections until one is wrong, and that one again.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/commands.h"
#include "cli/json_number.h"
#include "cli/terminal.h"
#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/recording.h"
#include "property_tests/campaign.h"
#include "property_tests/counterexample.h"

namespace cutproof::cli {

namespace {

using namespace property_tests;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr const char* kFormat = "cutproof.fuzz";
constexpr int kVersion = 2;
constexpr std::chrono::seconds kSimplifyingTime{60};
// Classes of cases are rare: below this many cases, or with small ones only, an empty class says nothing.
constexpr int64_t kCasesThatMeetEveryClass = 1000;
constexpr int kSizeThatMeetsEveryClass = 79;
// Of positions after a step, as many as rounding may decide: 0.5 to 0.8 % in campaigns of thousands. A comparison that
// grants everything compares nothing.
constexpr double kMostUndecidable = 0.05;
// A GPU is busy with so many loads at once; more only take memory.
constexpr int kLoadsOnTheDevice = 6;
constexpr int kSchedulesTried = 50;
constexpr int kBodiesOfTheReference = 16;

[[noreturn]] void refuse(const std::string& option, const std::string& problem, const std::string& remedy) {
  throw InputError("command line", option, problem, remedy);
}

// "A-B" or "A/B" as numbers.
std::pair<int64_t, int64_t> two_numbers(const std::string& text, char separator, const std::string& option,
                                        const std::string& remedy) {
  const std::size_t at = text.find(separator);
  const auto number = [&](const std::string& part) -> int64_t {
    if (part.empty() || part.size() > 9 || part.find_first_not_of("0123456789") != std::string::npos) {
      refuse(option, fmt::format("'{}' is not understood", text), remedy);
    }
    return std::stoll(part);
  };
  if (at == std::string::npos) refuse(option, fmt::format("'{}' is not understood", text), remedy);
  return {number(text.substr(0, at)), number(text.substr(at + 1))};
}

CampaignOptions campaign_options(const FuzzOptions& options) {
  CampaignOptions campaign;
  campaign.seed = options.seed;
  campaign.seconds = options.seconds;
  campaign.cases = options.cases.value_or(options.seconds ? std::numeric_limits<int64_t>::max() / 2 : 1000);
  const std::string sizes_remedy =
      fmt::format("give the least and the greatest size, such as 0-79; sizes go from 0 to {}", kMostSize);
  const auto [least, most] = two_numbers(options.sizes, '-', "--sizes", sizes_remedy);
  if (least > most || most > kMostSize) refuse("--sizes", fmt::format("'{}' is no range", options.sizes), sizes_remedy);
  campaign.least_size = static_cast<int>(least);
  campaign.most_size = static_cast<int>(most);
  campaign.dynamics = options.dynamics;
  // One kernel for many bodies keeps a GPU busy, and on the host many bodies in one load are part of what is tested.
  // The reference takes body by body, and what a few bodies need stays in the caches.
  const int by_default = options.backend.name == "reference" ? kBodiesOfTheReference : CampaignOptions{}.batch;
  campaign.batch = options.batch > 0 ? options.batch : by_default;
  campaign.threads = options.threads > 0 ? options.threads : cpu_threads();
  const bool device = options.backend.name.starts_with("gpu");
  campaign.backends = device ? std::min(campaign.threads, kLoadsOnTheDevice) : campaign.threads;
  campaign.keep_going = options.keep_going;
  if (!options.shard.empty()) {
    const std::string remedy = "give i/N with i from 1 to N, such as 2/8";
    const auto [shard, shards] = two_numbers(options.shard, '/', "--shard", remedy);
    if (shard < 1 || shard > shards) refuse("--shard", fmt::format("'{}' is no shard", options.shard), remedy);
    campaign.shard = shard - 1;
    campaign.shards = shards;
  }
  return campaign;
}

// Each load has a schedule of its own; the kinds take turns. Loads of `host` have one thread each, because there are as
// many of them as threads.
BackendChoice choice_for(BackendChoice choice, int64_t load) {
  if (choice.name == "host") choice.threads = 1;
  if (choice.name == "simulated") {
    static const std::vector<std::string> kinds = {"random", "pct", "reverse", "round_robin"};
    choice.schedule = kinds[static_cast<std::size_t>(load) % kinds.size()];
    choice.seed += static_cast<uint64_t>(load);
  }
  return choice;
}

// --- Results of campaigns --------------------------------------------------------------------------------------------

json violation_json(const Violation& violation, const std::string& file) {
  return {{"index", violation.index},
          {"property", violation.verdict.property},
          {"stage", name_of(violation.verdict.stage)},
          {"text", describe(violation.verdict)},
          {"file", file}};
}

json campaign_json(const FuzzOptions& options, const CampaignOptions& asked, const Campaign& campaign,
                   const json& violations) {
  json happened = json::object();
  for (std::size_t h = 0; h < kHappenedCount; ++h) happened[kHappenedNames[h]] = campaign.happened[h];
  json document = {
      {"format", kFormat},
      {"format_version", kVersion},
      {"version", cutproof::cli::kVersion},
      {"backend", options.backend.name},
      {"split", options.backend.split.empty() ? "blocks" : options.backend.split},
      {"seed", asked.seed},
      {"sizes", {asked.least_size, asked.most_size}},
      {"dynamics", asked.dynamics},
      {"batch", asked.batch},
      {"threads", asked.threads},
      {"shard", asked.shard + 1},
      {"shards", asked.shards},
      {"cases", campaign.cases},
      {"verdicts", campaign.verdicts},
      {"mean_particles",
       campaign.cases == 0 ? 0.0 : static_cast<double>(campaign.particles) / static_cast<double>(campaign.cases)},
      {"seconds", campaign.seconds},
      {"cases_per_second", campaign.seconds > 0 ? static_cast<double>(campaign.cases) / campaign.seconds : 0.0},
      {"thread_seconds",
       {{"generating", campaign.generating}, {"running", campaign.running}, {"judging", campaign.judging}}},
      {"happened", happened},
      {"violations", violations},
      {"holds", violations.empty()}};
  if (asked.dynamics && options.backend.name != "reference") {
    const StepsCompared& compared = campaign.compared;
    document["steps_compared"] = {{"steps", compared.steps},
                                  {"particles", compared.particles},
                                  {"undecidable", compared.undecidable},
                                  {"greatest_h", json_number(compared.greatest)}};
  }
  if (options.seconds) {
    document["seconds_asked"] = *options.seconds;
  } else {
    document["cases_asked"] = asked.cases;
  }
  if (const char* commit = std::getenv("CUTPROOF_COMMIT")) document["commit"] = commit;
  return document;
}

// Prints how often each class of cases occurred. Returns the names of those that never did.
std::vector<std::string> print_classes(const json& happened) {
  std::vector<std::string> empty;
  for (const char* name : kHappenedNames) {
    const auto count = happened.at(name).get<int64_t>();
    fmt::print("  {:<28} {:>9}\n", name, count);
    if (count == 0) empty.emplace_back(name);
  }
  return empty;
}

// Exit status of a campaign as it is written down; says why.
int conclude(const json& document, bool whole) {
  const std::vector<std::string> empty = print_classes(document.at("happened"));
  const auto cases = document.at("cases").get<int64_t>();
  fmt::print("{} cases of {:.0f} particles on average, {} verdicts, {:.1f} s, {:.0f} cases/s\n", cases,
             document.at("mean_particles").get<double>(), document.at("verdicts").get<int64_t>(),
             document.at("seconds").get<double>(), document.at("cases_per_second").get<double>());
  if (document.contains("steps_compared")) {
    const json& compared = document.at("steps_compared");
    fmt::print("{} steps beside the reference's: {} positions at most {} h apart, {} undecidable within rounding\n",
               compared.at("steps").get<int64_t>(), compared.at("particles").get<int64_t>(),
               compared.at("greatest_h").dump(), compared.at("undecidable").get<int64_t>());
  }
  const std::size_t violations = document.at("violations").size();
  if (violations > 0) {
    fmt::print("FAILS: {} of {} cases\n", violations, cases);
    return 1;
  }
  const auto most_size = document.at("sizes").at(1).get<int>();
  if (whole && cases >= kCasesThatMeetEveryClass && most_size >= kSizeThatMeetsEveryClass && !empty.empty()) {
    fmt::print("FAILS: no case had: {}, so nothing was tested there\n", fmt::join(empty, ", "));
    return 1;
  }
  if (whole && cases >= kCasesThatMeetEveryClass && document.contains("steps_compared")) {
    const json& compared = document.at("steps_compared");
    const double undecidable = compared.at("undecidable").get<double>(),
                 measured = compared.at("particles").get<double>();
    if (!(undecidable <= kMostUndecidable * (undecidable + measured)) || measured == 0) {
      fmt::print(
          "FAILS: {:.0f} positions after a step were undecidable and {:.0f} compared, so too little was tested\n",
          undecidable, measured);
      return 1;
    }
  }
  fmt::print("all hold\n");
  return 0;
}

// --- Shards ----------------------------------------------------------------------------------------------------------

int merge(const FuzzOptions& options) {
  const std::string remedy = "give the results (--json) of all shards of one campaign, each once";
  json whole;
  std::set<int64_t> shards;
  for (const std::string& file : options.merge) {
    json part;
    try {
      part = json::parse(io::read_text(file));
      if (part.at("format") != kFormat || part.at("format_version") != kVersion) {
        throw InputError(file, "format", "this is not a result of `cutproof fuzz` of this version", remedy);
      }
      if (!shards.insert(part.at("shard").get<int64_t>()).second) {
        throw InputError(file, "shard", fmt::format("shard {} was given already", part.at("shard").dump()), remedy);
      }
      if (whole.is_null()) {
        whole = part;
        continue;
      }
      for (const char* field : {"version", "backend", "split", "seed", "sizes", "dynamics", "shards", "cases_asked",
                                "seconds_asked", "commit"}) {
        if (part.value(field, json()) != whole.value(field, json())) {
          throw InputError(file, field,
                           fmt::format("{} here, {} in {}", part.value(field, json()).dump(),
                                       whole.value(field, json()).dump(), options.merge.front()),
                           remedy);
        }
      }
      const double particles =
          whole.at("mean_particles").get<double>() * static_cast<double>(whole.at("cases").get<int64_t>()) +
          part.at("mean_particles").get<double>() * static_cast<double>(part.at("cases").get<int64_t>());
      for (const char* field : {"cases", "verdicts"}) {
        whole[field] = whole.at(field).get<int64_t>() + part.at(field).get<int64_t>();
      }
      const auto cases = static_cast<double>(whole.at("cases").get<int64_t>());
      whole["mean_particles"] = cases > 0 ? particles / cases : 0.0;
      // Shards run beside each other: together they take as long as the slowest, and do what all of them do.
      whole["seconds"] = std::max(whole.at("seconds").get<double>(), part.at("seconds").get<double>());
      whole["cases_per_second"] =
          whole.at("cases_per_second").get<double>() + part.at("cases_per_second").get<double>();
      for (auto& [name, seconds] : whole.at("thread_seconds").items()) {
        seconds = seconds.get<double>() + part.at("thread_seconds").at(name).get<double>();
      }
      for (auto& [name, count] : whole.at("happened").items()) {
        count = count.get<int64_t>() + part.at("happened").at(name).get<int64_t>();
      }
      if (whole.contains("steps_compared")) {
        json& compared = whole.at("steps_compared");
        const json& more = part.at("steps_compared");
        for (const char* field : {"steps", "particles", "undecidable"}) {
          compared[field] = compared.at(field).get<int64_t>() + more.at(field).get<int64_t>();
        }
        // A number, or of what failed the string "inf".
        const json &here = compared.at("greatest_h"), &there = more.at("greatest_h");
        if (there.is_string() || (here.is_number() && there.get<double>() > here.get<double>())) {
          compared["greatest_h"] = there;
        }
      }
      for (const json& violation : part.at("violations")) whole["violations"].push_back(violation);
    } catch (const json::exception& error) {
      throw InputError(file, "", fmt::format("this is not a result of `cutproof fuzz` ({})", error.what()), remedy);
    }
  }
  const auto expected = whole.at("shards").get<int64_t>();
  std::vector<int64_t> missing;
  for (int64_t shard = 1; shard <= expected; ++shard) {
    if (!shards.contains(shard)) missing.push_back(shard);
  }
  if (!missing.empty()) {
    throw InputError("command line", "--merge",
                     fmt::format("of {} shards these are missing: {}", expected, fmt::join(missing, ", ")), remedy);
  }
  whole["holds"] = whole.at("violations").empty();
  whole["shard"] = 1;
  whole["shards"] = 1;
  whole["merged_shards"] = expected;
  if (!options.json.empty()) io::write_text(options.json, whole.dump(1) + "\n");
  fmt::print("{} shards, backend {}, seed {}\n", expected, whole.at("backend").get<std::string>(),
             whole.at("seed").get<uint64_t>());
  for (const json& violation : whole.at("violations")) {
    fmt::print("case {}: {}\n", violation.at("index").get<int64_t>(), violation.at("text").get<std::string>());
  }
  return conclude(whole, true);
}

// --- Counterexamples
// --------------------------------------------------------------------------------------------------

// Frames as a recording holds them (io::Recorder).
void record(const std::string& name, const Loaded& loaded, const harness::Trace& trace, const std::string& backend) {
  io::Recorder recorder(name, loaded.setup, "", backend);
  recorder.add(Stage::skin, *trace.initial);
  for (const harness::Moment& moment : trace.moments) recorder.add(moment.span.last, *moment.after);
  recorder.finish();
}

// Runs a case alone and records it. A state that is too broken to be written down is said to be.
void record_alone(const std::string& name, const std::unique_ptr<Backend>& backend, const Case& c) {
  try {
    std::vector<Loaded> loaded = {load(c)};
    const std::vector<CaseRun> runs = run_cases(*backend, loaded);
    record(name, loaded.front(), runs.front().trace, backend->name());
    fmt::print("recorded {}\n", io::recording_paths(name).index);
  } catch (const MachineError&) {
    throw;
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    fmt::print("not recorded: {}\n", error.what());
  }
}

struct Simplified {
  Counterexample counterexample;
  std::string text;    // what fails now
  bool alone = false;  // fails without the other bodies of its load
};

// The simplest case, and under a simulated schedule the fewest preemptions, that still fail.
Simplified simplify(const Violation& violation, const BackendChoice& choice) {
  Simplified result;
  Counterexample& found = result.counterexample;
  found.failing = violation.failing;
  found.backend = choice.name;
  found.split = choice.split;
  found.index = violation.index;
  result.text = describe(violation.verdict);

  // Another case is another run of the schedule, so several are tried.
  const bool simulated = choice.name == "simulated";
  BackendChoice failing_choice = choice;
  const auto fails = [&](const Case& c) {
    for (int k = 0; k < (simulated ? kSchedulesTried : 1); ++k) {
      BackendChoice tried = failing_choice;
      tried.seed += static_cast<uint64_t>(k);
      if (k > 0) tried.schedule = k % 2 == 0 ? "pct" : "random";
      const Judgement judgement = dissect_alone([&] { return make_backend(tried); }, c, true);
      if (!judgement.failure) continue;
      failing_choice = tried;
      result.text = describe(*judgement.failure);
      return true;
    }
    return false;
  };
  if (!fails(violation.failing)) return result;
  result.alone = true;
  const Clock::time_point until = Clock::now() + kSimplifyingTime;
  const auto is_over = [&] { return Clock::now() > until; };
  found.failing = simplest(violation.failing, fails, is_over);
  if (simulated) {
    const auto schedule = std::make_shared<gpu::ThreadSchedule>();
    static_cast<void>(
        dissect_alone([&] { return make_recorded_backend(failing_choice, schedule); }, found.failing, true));
    found.schedule = gpu::shrink(*schedule, [&](const gpu::ThreadSchedule& tried) {
      if (is_over()) return false;
      return dissect_alone([&] { return make_replaying_backend(failing_choice, tried); }, found.failing, true)
          .failure.has_value();
    });
  }
  found.found = result.text;
  return result;
}

std::unique_ptr<Backend> backend_of(const Counterexample& counterexample, const BackendChoice& choice) {
  if (choice.name == "simulated" && !counterexample.schedule.empty()) {
    return make_replaying_backend(choice, counterexample.schedule);
  }
  return make_backend(choice);
}

// Simplifies, saves, records; returns the file's name.
std::string keep(const Violation& violation, const FuzzOptions& options, const BackendChoice& choice, int batch) {
  fmt::print("case {} FAILS: {}\n", violation.index, describe(violation.verdict));
  std::fflush(stdout);
  Simplified simplified = simplify(violation, choice);
  simplified.counterexample.seed = options.seed;
  const Counterexample& found = simplified.counterexample;
  const std::string stem =
      (std::filesystem::path(options.save) / fmt::format("{}_{}_{}", choice.name, options.seed, violation.index))
          .string();
  const std::string file = stem + ".json";
  io::write_text(file, to_json(found) + "\n");
  if (simplified.alone) {
    fmt::print("simplified to {} strokes and {} particles{}: {}\n", found.failing.strokes.size(),
               found.failing.nodes.size(),
               choice.name == "simulated" ? fmt::format(", {} preemptions", gpu::preemptions(found.schedule)) : "",
               simplified.text);
    record_alone(stem, backend_of(found, choice), found.failing);
  } else {
    fmt::print("alone it does not fail, only with the other bodies of its load: fuzz again with --seed {} --batch {}\n",
               options.seed, batch);
  }
  fmt::print("saved; to see it again: cutproof replay {}\n", file);
  return file;
}

}  // namespace

int fuzz(const FuzzOptions& options) {
  if (!options.merge.empty()) return merge(options);
  const CampaignOptions asked = campaign_options(options);
  static_cast<void>(make_backend(choice_for(options.backend, 0)));  // what cannot be is said before anything is done
  if (!std::filesystem::is_directory(options.save)) {
    refuse("--save", fmt::format("'{}' is not a folder", options.save), "create it first");
  }
  std::optional<io::AtomicFile> json_file;
  if (!options.json.empty()) json_file.emplace(options.json);

  fmt::print("fuzzing backend {}: {}{} from seed {}{}, {} bodies a load, {} threads\n", options.backend.name,
             options.seconds ? fmt::format("{:g} s of cases", *options.seconds) : fmt::format("{} cases", asked.cases),
             asked.dynamics ? " with dynamics" : "", asked.seed,
             asked.shards > 1 ? fmt::format(", shard {} of {}", asked.shard + 1, asked.shards) : "", asked.batch,
             asked.threads);
  std::fflush(stdout);
  const BackendSource source{[&](int64_t load) { return make_backend(choice_for(options.backend, load)); },
                             options.backend.name == "simulated"};
  Campaign campaign;
  {
    const int64_t of_this_shard = (asked.cases - asked.shard + asked.shards - 1) / asked.shards;
    Progress progress("case", options.seconds ? 0 : of_this_shard);
    campaign = run_campaign(asked, source, [&](const Campaign& so_far) {
      const auto classes =
          std::count_if(so_far.happened.begin(), so_far.happened.end(), [](int64_t n) { return n > 0; });
      progress.show(so_far.cases, fmt::format("{:.0f} cases/s, {} of {} classes met, {} violations",
                                              static_cast<double>(so_far.cases) / so_far.seconds, classes,
                                              kHappenedCount, so_far.violations.size()));
    });
  }
  json violations = json::array();
  for (const Violation& violation : campaign.violations) {
    const int64_t load = (violation.index - asked.shard) / asked.shards / asked.batch;
    violations.push_back(
        violation_json(violation, keep(violation, options, choice_for(options.backend, load), asked.batch)));
  }
  const json document = campaign_json(options, asked, campaign, violations);
  if (json_file) {
    io::write_text(json_file->temporary(), document.dump(1) + "\n");
    json_file->commit();
  }
  return conclude(document, asked.shards == 1);
}

int replay(const ReplayOptions& options) {
  const std::string& file = options.counterexample;
  const Counterexample counterexample = counterexample_from_json(io::read_text(file), file);
  BackendChoice choice;
  if (options.backend) {
    choice = *options.backend;
  } else {
    choice.name = counterexample.backend.empty() ? "reference" : counterexample.backend;
    choice.split = counterexample.split;
  }
  const Case& c = counterexample.failing;
  const bool is_history = !counterexample.commands.empty();
  if (is_history && !options.record.empty()) {
    refuse("--record", file + " is a history of commands, which no recording holds", "leave it out");
  }
  fmt::print("{}: {} particles, {} strokes, {}backend {}\n", file, c.nodes.size(), c.strokes.size(),
             is_history ? fmt::format("{} commands, ", counterexample.commands.size()) : "", choice.name);
  if (!counterexample.found.empty()) fmt::print("found as: {}\n", counterexample.found);
  const auto make = [&] { return backend_of(counterexample, choice); };
  const Judgement judgement =
      is_history ? history_alone(make, c, counterexample.commands) : dissect_alone(make, c, true);
  if (!options.record.empty()) record_alone(options.record, backend_of(counterexample, choice), c);
  if (judgement.failure) {
    fmt::print("FAILS: {}\n", describe(*judgement.failure));
    return 1;
  }
  fmt::print("holds: {} verdicts\n", judgement.verdicts);
  return 0;
}

}  // namespace cutproof::cli
