// `cutproof fuzz`: random dissections until one is wrong, and that one shrunk.
#include "cli/fuzz.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/commands.h"
#include "cli/document_report.h"
#include "cli/findings.h"
#include "cli/interruption.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/report_page.h"
#include "cli/screen.h"
#include "cli/table.h"
#include "cli/terminal.h"
#include "guests/plugin_backend.h"
#include "model/counted.h"
#include "model/io/atomic_file.h"
#include "model/io/columns.h"
#include "model/io/filled.h"
#include "model/io/recording.h"
#include "model/io/verdict_json.h"
#include "model/left_stages.h"
#include "model/printable.h"
#include "oracles/property_count.h"
#include "property_tests/campaign.h"
#include "property_tests/campaign_report.h"
#include "property_tests/recorded_case.h"
#include "property_tests/simplify.h"

namespace cutproof::cli {

namespace {

using namespace property_tests;
using harness::BackendChoice;
using nlohmann::json;

constexpr int64_t kMostCases = 1'000'000'000'000'000;

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

CampaignOptions campaign_options(const FuzzOptions& options, const std::vector<int>& devices) {
  const harness::BackendDescriptor& backend = harness::described_backend(options.backend.name);
  CampaignOptions campaign = options.campaign;
  campaign.cases = options.cases.value_or(campaign.seconds ? std::numeric_limits<int64_t>::max() / 2 : 1000);
  const std::string sizes_remedy =
      fmt::format("give the least and the greatest size, such as 0-79; sizes go from 0 to {}", kMostSize);
  const auto [least, most] = two_numbers(options.sizes, '-', "--sizes", sizes_remedy);
  if (least > most || most > kMostSize) refuse("--sizes", fmt::format("'{}' is no range", options.sizes), sizes_remedy);
  campaign.stop_asked = stop_asked;
  campaign.least_size = static_cast<int>(least);
  campaign.most_size = static_cast<int>(most);
  campaign.batch = options.batch > 0 ? options.batch : usual_batch(campaign, backend);
  campaign.threads = options.threads > 0 ? options.threads : harness::cpu_threads();
  set_parallel_loads(campaign, backend, static_cast<int>(devices.size()));
  if (!options.shard.empty()) {
    const std::string remedy = "give i/N with i from 1 to N, such as 2/8";
    const auto [shard, shards] = two_numbers(options.shard, '/', "--shard", remedy);
    if (shards > kMostShards) {
      refuse("--shard", fmt::format("'{}' is of too many shards", options.shard),
             fmt::format("use {} at most", kMostShards));
    }
    if (shard < 1 || shard > shards) refuse("--shard", fmt::format("'{}' is no shard", options.shard), remedy);
    campaign.shard = shard - 1;
    campaign.shards = shards;
  }
  return campaign;
}

// How often what is to occur did.
void print_coverage(const json& document) {
  Table table({"class", "cases"});
  std::vector<std::string> empty;
  std::string rarest;
  int64_t classes = 0, least = std::numeric_limits<int64_t>::max();
  for (const CoverageClass& each : kCoverageClasses) {
    if (least_count(each, 1, document.at("dynamics").get<bool>()) == 0) continue;
    const auto count = document.at("coverage").at(each.name).get<int64_t>();
    ++classes;
    table.add({each.name, fmt::format("{}", count)});
    if (count == 0) empty.emplace_back(each.name);
    if (count > 0 && count < least) {
      least = count;
      rarest = each.name;
    }
  }
  if (style().verbose) say_as_it_is(table.text());
  // A campaign that ends before its last case says nothing of what its cases lack.
  const bool ends_early =
      !document.at("complete") || (!document.at("violations").empty() && !document.at("keep_going").get<bool>());
  if (ends_early) return;
  if (empty.empty()) {
    say("all {} coverage classes were met, the rarest in {} cases: {}\n", classes, least, rarest);
  } else {
    say("{} of {} coverage classes were met; {}: {}\n", classes - static_cast<int64_t>(empty.size()), classes,
        unsettled("not met"), fmt::join(empty, ", "));
  }
}

// As of a run (terminal.h): what fails first, what holds summed up.
void print_properties(const json& properties) {
  Table table({"property", "after", "judged", "failed", "of bound", "inconclusive"});
  const json* nearest = nullptr;
  int64_t holds = 0, doubtful = 0;
  std::vector<std::string> failed;
  for (const json& each : properties) {
    const bool has_share = each.at("of_bound").is_number();
    table.add({printable(io::filled("{property}", each)), printable(io::filled("{stage}", each)),
               io::filled("{judged}", each), io::filled("{failed}", each),
               has_share ? io::share_of(each.at("of_bound").get<double>()) : "-",
               each.at("inconclusive") > 0 ? io::filled("{inconclusive} of {checked}", each) : "-"});
    if (each.at("failed") > 0) {
      failed.push_back(printable(io::filled("{property} after {stage} ({failed} of {judged} verdicts)", each)));
    } else if (each.at("judged") > 0) {
      ++holds;
      const bool tells = has_share && !oracles::asks_wider(each.at("property").get<std::string>());
      if (tells && (nearest == nullptr || each.at("of_bound") > nearest->at("of_bound"))) nearest = &each;
    }
    doubtful += each.at("inconclusive").get<int64_t>();
  }
  if (style().verbose) say_as_it_is(table.text());
  if (!failed.empty()) insist("{}: {}\n", failing("what fails"), fmt::join(failed, ", "));
  if (holds > 0) {
    say("{} pairs of a property and a stage {}", holds, holding(holds == 1 ? "holds" : "hold"));
    if (nearest != nullptr) {
      say_filled("; the nearest to its bound: {property} after {stage}", *nearest);
      say(", at {} of it", io::share_of(nearest->at("of_bound").get<double>()));
    }
    say("\n");
  }
  if (doubtful > 0) say("{}: {} things\n", unsettled("inconclusive within rounding"), io::grouped(doubtful));
}

}  // namespace

void print_campaign(const json& document) {
  print_coverage(document);
  print_properties(document.at("properties"));
  if (document.contains("steps_compared")) {
    say_filled(
        "{steps} steps beside the reference's: {particles} positions at most {greatest_h} h apart, {not_compared} that "
        "rounding may carry farther\n",
        document.at("steps_compared"));
  }
  if (const std::vector<std::string> left = document.at("left_to_reference"); !left.empty()) {
    say("{}\n", unsettled(printable(left_in_words(left))));
  }
  if (document.at("refused") > 0) {
    say("{}\n", unsettled(io::filled("{refused} cases were refused: nothing is known of them", document)));
  }
  const auto grouped = [&](const char* name) { return io::grouped(document.at(name).get<int64_t>()); };
  say("{} cases of {:.0f} particles on average, {} verdicts, {:.1f} s, {} cases/s\n", grouped("cases"),
      document.at("mean_particles").get<double>(), grouped("verdicts"), document.at("seconds").get<double>(),
      io::grouped(std::llround(document.at("cases_per_second").get<double>())));
}

namespace {

int print_conclusion(const json& document, const CampaignConclusion& conclusion) {
  print_campaign(document);
  if (conclusion.holds()) {
    insist("{}\n", holding("all hold"));
  } else {
    const bool only_stopped =
        !document.at("complete") && !document.contains("missing_shards") && document.at("violations").empty();
    insist("{}: {}\n", only_stopped ? unsettled("INCOMPLETE") : failing("FAILS"), conclusion.failure);
  }
  return conclusion.holds() ? 0 : 1;
}

// What a campaign came to goes into files first: these are kept even if standard output cannot be written.
int conclude_campaign(const FuzzOptions& options, const json& document, bool whole) {
  const CampaignConclusion conclusion = conclude(document, whole);
  const Judging judging{"cutproof fuzz", class_of("fuzz", document.at("backend").get<std::string>()), options.again};
  write_document(options.json, document);
  const bool is_plugin = options.backend.name.starts_with(guests::kPluginPrefix);
  write_document_report(options.report, document, made_by(options.again, options.backend.name),
                        is_plugin ? std::optional(options.backend) : std::nullopt);
  write_junit(options.junit, judging, document.at("seconds").get<double>(),
              cases_of_campaign(document, conclusion.failure, judging));
  const int status = print_conclusion(document, conclusion);
  print_written(options.report);
  tell_github(
      {options.again, failures_of_campaign(document, conclusion.failure, judging), document.at("left_to_reference")});
  return status;
}

int merge(const FuzzOptions& options) {
  require_writable(options.json);
  require_writable(options.junit);
  require_report(options.report);
  const json whole = merge_shards(options.merge);
  if (!whole.at("complete").get<bool>()) {
    insist("INCOMPLETE: missing {}; run each of these again with --shard i/{}\n", missing_shards(whole),
           whole.at("merged_shards").get<int64_t>());
  }
  say_filled("{merged_shards} shards, backend {backend}, seed {seed}\n", whole);
  for (const json& violation : whole.at("violations")) insist_text(io::filled("case {index}: {text}\n", violation));
  return conclude_campaign(options, whole, true);
}

// Of a plugin its file without folders.
std::string name_in_files(const std::string& backend) {
  if (!backend.starts_with(guests::kPluginPrefix)) return backend;
  return std::filesystem::path(guests::options_of_name(backend).library).stem().string();
}

json size_of(const Case& c) { return {{"particles", c.nodes.size()}, {"strokes", c.strokes.size()}}; }

// Simplifies, saves, records; returns what the document has of it. Where no time is `left` [s] the case is saved as it
// was drawn.
json keep(const Violation& violation, const FuzzOptions& options, const CampaignOptions& asked,
          const BackendChoice& choice, double left) {
  insist("case {} {}: {}\n", violation.index, failing("FAILS"), describe(violation.verdict));
  flush_output();
  const bool is_late = left <= 0;
  Simplified simplified =
      is_late ? as_drawn(violation, choice) : simplify(violation, choice, std::min(options.simplify, left), stop_asked);
  simplified.counterexample.seed = asked.seed;
  const Counterexample& found = simplified.counterexample;
  const std::string stem = (std::filesystem::path(options.save) /
                            fmt::format("{}_{}_{}", name_in_files(choice.name), options.campaign.seed, violation.index))
                               .string();
  const std::string file = stem + ".json";
  io::write_text(file, to_json(found) + "\n");
  if (is_late) {
    insist("not shrunk, its time is over; to do that: fuzz again with --seed {} --sizes {}-{} --cases 1{}\n",
           asked.seed + static_cast<uint64_t>(violation.index), size_at(asked, violation.index),
           size_at(asked, violation.index), asked.dynamics ? " --dynamics" : "");
  } else if (simplified.alone) {
    const std::string now = describe(simplified.verdict);
    insist("shrunk to {} and {}{}{}\n", counted(found.failing.strokes.size(), "stroke", "strokes"),
           counted(found.failing.nodes.size(), "particle", "particles"),
           harness::described_backend(choice.name).takes_schedule
               ? ", " + counted(gpu::preemptions(found.schedule), "preemption", "preemptions")
               : "",
           now == describe(violation.verdict) ? "" : ": " + now);
    const std::string problem = record_case(stem, backend_of(found, choice), found.failing);
    if (problem.empty()) {
      say_copy("recorded", io::recording_paths(stem).index);
    } else {
      insist("not recorded: {}\n", problem);
    }
  } else {
    insist("alone it does not fail, only with the other bodies of its load: fuzz again with --seed {} --batch {}\n",
           asked.seed, asked.batch);
  }
  insist_copy("saved; to see it again:", "cutproof replay " + quoted(file));
  json kept = violation_json(violation, file);
  if (is_late) return kept;
  kept["drawn"] = size_of(violation.failing);
  if (simplified.alone) {
    kept["shrunk"] = size_of(found.failing);
    // Another property may fail first in it than in the case as it was drawn.
    kept["shrunk"]["text"] = describe(simplified.verdict);
    kept["shrunk"]["property"] = simplified.verdict.property;
    kept["shrunk"]["stage"] = name_of(simplified.verdict.stage);
    kept["shrunk"]["witness"] = simplified.verdict.witness.text;
  }
  return kept;
}

Campaign run(const FuzzOptions& options, const CampaignOptions& asked, const BackendSource& source) {
  const int64_t of_this_shard = (asked.cases - asked.shard + asked.shards - 1) / asked.shards;
  Progress progress("case", options.cases || !asked.seconds ? of_this_shard : 0);
  return run_campaign(asked, source, [&](const Campaign& so_far) {
    std::size_t classes = 0, wanted = 0;
    for (std::size_t k = 0; k < kCoverageClassCount; ++k) {
      if (least_count(kCoverageClasses[k], 1, asked.dynamics) == 0) continue;
      ++wanted;
      classes += so_far.coverage.begin()[k] > 0;
    }
    const std::string rate =
        fmt::format("{} violations, {:.0f} cases/s, {} of {} classes met", so_far.violations.size(),
                    static_cast<double>(so_far.cases) / so_far.seconds, classes, wanted);
    // It ends with whichever is over first.
    double part = static_cast<double>(so_far.cases) / static_cast<double>(std::max<int64_t>(of_this_shard, 1));
    if (asked.seconds) part = std::max(part, *asked.seconds > 0 ? so_far.seconds / *asked.seconds : 1);
    progress.show(so_far.cases, rate, part);
  });
}

}  // namespace

nlohmann::json fuzz_campaign(const FuzzOptions& options) {
  const std::vector<int> devices =
      harness::devices_of(options.devices, harness::described_backend(options.backend.name));
  const CampaignOptions asked = campaign_options(options, devices);
  // What cannot be is said before anything is done.
  const BackendSource source = source_of(options.backend, devices);
  for (int k = 0; k < asked.devices; ++k) static_cast<void>(source.make(0, k));
  require_writable(options.json);
  require_writable(options.junit);
  require_report(options.report);
  make_folder("--save", options.save);

  say("fuzzing backend {}: {}{} from seed {}{}, {} bodies a load, {} threads{}\n", options.backend.name,
      options.campaign.seconds ? fmt::format("{:g} s of cases", *options.campaign.seconds)
                               : fmt::format("{} cases", asked.cases),
      asked.dynamics ? " with dynamics" : "", asked.seed,
      asked.shards > 1 ? fmt::format(", shard {} of {}", asked.shard + 1, asked.shards) : "", asked.batch,
      asked.threads, options.devices.empty() ? "" : fmt::format(", devices {}", fmt::join(devices, ", ")));
  flush_output();
  const auto begin = std::chrono::steady_clock::now();
  const Campaign campaign = run(options, asked, source);
  json violations = json::array();
  for (const Violation& violation : campaign.violations) {
    const int64_t load = (violation.index - asked.shard) / asked.shards / asked.batch;
    BackendChoice choice = harness::choice_for_load(options.backend, load);
    choice.device = devices.front();
    const double passed = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const double left = asked.seconds ? *asked.seconds - passed : std::numeric_limits<double>::infinity();
    violations.push_back(keep(violation, options, asked, choice, left));
  }
  json document = campaign_document(options.backend, asked, campaign, violations);
  if (!options.devices.empty()) document["devices"] = devices;
  return document;
}

namespace {

int fuzz(const FuzzOptions& options) {
  if (!options.merge.empty()) return merge(options);
  const EndsInOrder in_order;
  const json document = fuzz_campaign(options);
  return conclude_campaign(options, document, document.at("shards") == 1);
}

}  // namespace

void add_fuzz(CLI::App& program, Work& work) {
  const auto options = std::make_shared<FuzzOptions>();
  CLI::App* const command =
      program.add_subcommand("fuzz", "random dissections until one is wrong, and that one shrunk");
  add_backend(*command, options->backend, "backend under test");
  add_count(*command, "--cases", options->cases, "how many (default: 1000)", whole_number(0, kMostCases));
  command->add_option("--seconds", options->campaign.seconds, "for how long")->type_name("S")->check(number_from(0));
  add_seed(*command, options->campaign.seed, "what cases are drawn from");
  command->add_option("--sizes", options->sizes, "least and greatest size of a case, within 0-110")
      ->capture_default_str()
      ->type_name("A-B");
  command->add_flag("--dynamics", options->campaign.dynamics, "bodies move and blades push what they cut");
  add_count(*command, "--batch", options->batch, "bodies in one load (default: by backend)", whole_number(1, 100'000));
  add_count(*command, "--threads", options->threads, "that generate and judge (default: all)", whole_number(1, 4096));
  add_devices(*command, options->devices);
  command->add_option("--shard", options->shard, "only part i of N of the cases")->type_name("i/N");
  command->add_flag("--keep-going", options->campaign.keep_going, "beyond the first violation");
  command
      ->add_option("--shrink", options->simplify,
                   "how long a violation's case is shrunk, within --seconds; 0: not at all")
      ->capture_default_str()
      ->type_name("S")
      ->check(number_from(0));
  command->add_option("--save", options->save, "folder for counterexamples")->capture_default_str()->type_name("DIR");
  add_json(*command, options->json, "write counts, classes and violations");
  add_junit(*command, options->junit);
  add_report_option(*command, options->report);
  command
      ->add_option("--merge", options->merge,
                   "put the results of all shards together, and name those that are missing; runs nothing")
      ->type_name("JSON...");
  command->callback([options, command, &work] {
    options->again = as_given(*command);
    work = [options] { return fuzz(*options); };
  });
}

}  // namespace cutproof::cli
