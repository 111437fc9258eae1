// `cutproof judge`: the user's kernels, from a shared library.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/commands.h"
#include "cli/document_report.h"
#include "cli/findings.h"
#include "cli/fuzz.h"
#include "cli/interruption.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/report_page.h"
#include "cli/screen.h"
#include "cli/table.h"
#include "cli/terminal.h"
#include "guests/plugin_backend.h"
#include "guests/questions/campaign.h"
#include "model/counted.h"
#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/columns.h"
#include "model/nearest_word.h"
#include "model/printable.h"

namespace cutproof::cli {

namespace {

using namespace guests;
using nlohmann::json;

struct JudgeOptions {
  GuestOptions guest;
  std::vector<std::string> operations;  // empty: all that the plugin has
  KernelCampaignOptions campaign;
  int64_t cases = 0;                          // 0: for each operation a number that takes a few seconds
  std::optional<std::vector<int64_t>> sizes;  // of large questions; 0: none; nothing: those of each operation
  bool keep_going = false;                    // beyond ten questions that were not answered
  std::string save = ".";
  std::string json, junit, report, replay;
  std::string again;          // the command line
  std::vector<int> attached;  // open files of a guest that runs already: its channel, its memory
};

// Not one of operations(): random dissections, with the stages that the plugin can run.
constexpr const char* kOnStages = "stages";

bool has_stages(const PluginInfo& plugin) { return plugin.offers(wire::load) && plugin.offers(wire::run); }

constexpr int64_t kUsualDissections = 500;

// Operations by the cost of one case.
int64_t usual_cases(const OperationDescription& operation) {
  return operation.number == wire::rotations ? 100'000 : operation.is_simulator() ? 200 : 2'000;
}

std::vector<int64_t> sizes_of(const JudgeOptions& options, const OperationDescription& operation) {
  if (!options.sizes) return {operation.sizes.begin(), operation.sizes.end()};
  std::vector<int64_t> sizes = *options.sizes;
  std::sort(sizes.begin(), sizes.end());
  sizes.erase(std::unique(sizes.begin(), sizes.end()), sizes.end());
  std::erase(sizes, 0);
  return sizes;
}

std::vector<const OperationDescription*> asked_operations(const JudgeOptions& options, const PluginInfo& plugin) {
  std::string known, offered;
  std::vector<const OperationDescription*> all;
  for (const OperationDescription& each : operations()) {
    known += (known.empty() ? "" : ", ") + std::string(each.name);
    if (!plugin.offers(each.number)) continue;
    offered += (offered.empty() ? "" : ", ") + std::string(each.name);
    all.push_back(&each);
  }
  if (options.operations.empty()) {
    if (all.empty() && !has_stages(plugin)) {
      throw InputError(options.guest.library, "", "it has no operation that can be judged by itself",
                       "set one of its members: " + known + ", or load and run");
    }
    return all;
  }
  std::vector<const OperationDescription*> asked;
  for (const std::string& name : options.operations) {
    if (name == kOnStages && has_stages(plugin)) continue;
    const OperationDescription* const found = find_operation(name);
    if (found == nullptr)
      refuse("OPS", fmt::format("there is no operation '{}'", name),
             did_you_mean(name, listed(known + ", stages")) + "use some of " + known + ", stages");
    if (!plugin.offers(found->number)) {
      if (has_stages(plugin)) offered += (offered.empty() ? "" : ", ") + std::string(kOnStages);
      throw InputError(options.guest.library, name, "the plugin does not have this operation",
                       offered.empty() ? "it has none" : "it has " + offered);
    }
    asked.push_back(found);
  }
  return asked;
}

std::string title(const PluginInfo& plugin, const std::string& library) {
  return fmt::format("{}{}{} ({}), {} precision, on the {}", plugin.name.empty() ? "a plugin" : plugin.name,
                     plugin.version.empty() ? "" : " ", plugin.version, library,
                     plugin.precision == Precision::binary32 ? "single" : "double",
                     plugin.on_device ? "CUDA device" : "host");
}

constexpr std::size_t kMostWitnessBytes = 2000;

void print_head(const KernelCampaign& campaign) {
  say("{}: {} {} in {} questions, {} wrong, {:.1f} s\n", campaign.operation->name, io::grouped(campaign.cases),
      campaign.operation->cases, io::grouped(campaign.questions), io::grouped(campaign.failed_cases), campaign.seconds);
}

// The kinds in which something is wrong, with the worst of each.
void print_kinds(const KernelCampaign& campaign) {
  if (campaign.failed == 0) return;
  Table table({"kind", std::string(campaign.operation->cases), "wrong", "worst in", "measured", "bound", "question"});
  std::size_t right = 0;
  for (const KindSummary& kind : campaign.kinds) {
    if (!kind.first_failure) {
      ++right;
      continue;
    }
    const KindSummary::Case& worst = *kind.worst;
    table.add({printable(kind.kind.substr(0, kind.kind.find(':'))), io::grouped(kind.cases),
               failing(io::grouped(kind.failed)), worst.verdict.property, fmt::format("{:.2g}", worst.verdict.measured),
               fmt::format("{:.2g}", worst.verdict.bound),
               worst.size > 0 ? fmt::format("of size {}", worst.size) : fmt::format("{}", worst.index)});
  }
  say_as_it_is(table.text());
  if (right > 0) say("  nothing is wrong in {}\n", counted(right, "other kind", "other kinds"));
}

// Of a simulator: the tested promises.
void print_scenes(const KernelCampaign& campaign) {
  Table table({"kind", "scenes", "refused", "cut as drawn"});
  for (const KindSummary& kind : campaign.kinds) {
    table.add(
        {printable(kind.kind), io::grouped(kind.questions), io::grouped(kind.refused), io::grouped(kind.as_drawn)});
  }
  say_as_it_is(table.text());
}

void print_properties(const KernelCampaign& campaign) {
  print_judged(campaign.properties, &harness::PropertySummary::judged);
  if (campaign.operation->is_simulator()) print_scenes(campaign);
  print_kinds(campaign);
  for (const Unpromised& u : campaign.unpromised) {
    say("  {}: {}{}\n", unsettled("not promised, not judged"), u.property,
        u.failing > 0 ? fmt::format(" (would fail in {} questions)", u.failing) : "");
  }
  for (const NotAsked& each : campaign.not_asked) {
    say("  {}: {} of size {}: that of size {} took {:.2g} s, and --time-limit may be reached\n", unsettled("not asked"),
        each.kind, each.size, each.size_before, each.seconds);
  }
  if (campaign.refused > 0) {
    say("  {}: {} questions, without a verdict\n", unsettled("refused"), campaign.refused);
  }
  if (const std::string why = campaign.untested(); !why.empty()) {
    insist("{}: too little was judged: {}\n", failing("FAILS"), why);
  }
}

constexpr const char* kClass = "cutproof.judge";

std::string replay_command(const JudgeOptions& options, const std::string& file, const std::string& operation) {
  if (!options.attached.empty()) return fmt::format("cutproof.replay(\"{}\", {}=...)", file, operation);
  return fmt::format("cutproof judge {}{} --case {}", quoted(options.guest.library),
                     options.guest.parameters.empty() ? "" : " --parameters " + quoted(options.guest.parameters),
                     quoted(file));
}

// A simulator's answer, for `cutproof check`.
void keep_run(const std::string& file, Guest& guest, const OperationDescription& operation,
              const KernelFailure& failure) {
  if (guest.has_ended()) return;
  const Answer answer = ask(guest, operation, failure.simplest, failure.at_end);
  if (answer.kind != Answer::Kind::answered) return;
  const std::filesystem::path folder = std::filesystem::path(file).replace_extension() += "_run";
  const auto frames = operation.files(failure.simplest, answer.arrays, guest.plugin().precision);
  if (frames.empty()) return;
  make_folder("--save", folder.string());
  const auto path = [&](std::size_t frame) { return folder / fmt::format("run_{:06}.npz", frame); };
  for (std::size_t f = 0; f < frames.size(); ++f) io::write_array_file(path(f).string(), frames[f]);
  // Frames of an older run do not go on behind these.
  for (std::size_t f = frames.size(); std::filesystem::remove(path(f)); ++f) {
  }
  insist_copy("  its run:", "cutproof check " + quoted(folder.string()));
}

// Saves the failure and prints the command that repeats it.
std::string keep(const JudgeOptions& options, Guest& guest, const KernelCampaign& campaign,
                 const KernelFailure& failure) {
  SavedQuestion saved;
  saved.operation = campaign.operation->name;
  saved.question = failure.simplest;
  saved.precision = guest.plugin().precision;
  saved.at_end = failure.at_end;
  saved.plugin = guest.plugin().name + " " + guest.plugin().version;
  saved.found = failure.of_simplest.property + ": " + failure.of_simplest.witness.text;
  saved.seed = options.campaign.seed;
  saved.index = failure.index;
  std::string property = failure.verdict.property;
  std::replace(property.begin(), property.end(), ' ', '_');
  const std::string file =
      (std::filesystem::path(options.save) /
       fmt::format("{}_{}_{}_{}.json", saved.operation, property, options.campaign.seed, failure.index))
          .string();
  io::write_text(file, guests::to_json(saved) + "\n");
  insist("{}: {}, '{}', {}:\n  {}\n", failing("FAILS"), saved.operation, failure.verdict.property,
         name_of_question(failure.index, failure.size, failure.simplest.kind),
         shortened(failure.verdict.witness.text, kMostWitnessBytes));
  const std::string& now = failure.of_simplest.witness.text;
  insist("  shrunk to {}{}\n", campaign.operation->size_of(failure.simplest),
         now == failure.verdict.witness.text ? "" : ": " + shortened(now, kMostWitnessBytes));
  insist_copy("  saved; to see it again:", replay_command(options, file, saved.operation));
  if (campaign.operation->files != nullptr) keep_run(file, guest, *campaign.operation, failure);
  return file;
}

// A case for each property of an operation that was judged, and for each that was not promised.
void add_cases(const json& result, const JudgeOptions& options, std::vector<io::JunitCase>& cases,
               std::vector<Failure>& failures) {
  const std::string operation = result.at("operation");
  const auto add = [&](const std::string& property) -> io::JunitCase& {
    return cases.emplace_back(io::JunitCase{property, std::string(kClass) + "." + operation});
  };
  for (const json& property : result.at("properties")) {
    io::JunitCase& each = add(property.at("property"));
    if (property.at("property") == kAnswersProperty) each.seconds = result.at("seconds");
    if (property.at("judged") == 0) {
      each.outcome = io::JunitOutcome::skipped;
      each.message = "there was nothing to judge";
    }
    for (const json& failure : result.at("failures")) {
      if (failure.at("property") != property.at("property")) continue;
      const std::string again = failure.at("again");
      each.outcome = io::JunitOutcome::failed;
      each.message = failure.at("text");
      const std::string now = failure.at("shrunk");
      each.text = fmt::format(
          "{}: {}\n{}to see it again: {}",
          name_of_question(failure.at("index"), failure.value("drawn_size", int64_t{0}), failure.at("kind")),
          each.message, now == each.message ? "" : "shrunk: " + now + "\n", again);
      failures.push_back({operation + ": " + each.name, each.message, again});
    }
  }
  for (const json& property : result.at("unpromised")) {
    io::JunitCase& each = add(property.at("property"));
    each.outcome = io::JunitOutcome::skipped;
    each.message = "not promised, not judged";
  }
  if (const std::string untested = result.at("untested"); !untested.empty()) {
    io::JunitCase& each = add("something was judged");
    each.outcome = io::JunitOutcome::failed;
    each.message = untested;
    failures.push_back({operation, each.message, options.again});
  }
}

bool steps(const PluginInfo& plugin) {
  for (const Stage last : kStages) {
    if (plugin.can_run({Stage::step, last})) return true;
  }
  return false;
}

// The plugin as a backend.
std::string plugin_backend(const JudgeOptions& options) {
  return std::string(kPluginPrefix) + options.guest.library +
         (options.guest.parameters.empty() ? "" : "," + options.guest.parameters);
}

// Random dissections by the stages that the plugin has.
bool judge_stages(const JudgeOptions& options, bool dynamics, json& document, std::vector<io::JunitCase>& cases,
                  std::vector<Failure>& failures) {
  FuzzOptions fuzz;
  fuzz.backend.name = plugin_backend(options);
  fuzz.campaign.seed = options.campaign.seed;
  fuzz.campaign.seconds = options.campaign.seconds;
  fuzz.campaign.dynamics = dynamics;
  fuzz.campaign.keep_going = options.keep_going;
  fuzz.cases = options.cases > 0 ? options.cases : kUsualDissections;
  fuzz.simplify = options.campaign.simplify;
  fuzz.save = options.save;
  fuzz.again = options.again;
  const json result = fuzz_campaign(fuzz);
  const property_tests::CampaignConclusion conclusion = property_tests::conclude(result, true);
  const Judging judging{"cutproof judge", std::string(kClass) + "." + kOnStages, options.again};
  for (io::JunitCase& each : cases_of_campaign(result, conclusion.failure, judging)) cases.push_back(std::move(each));
  for (Failure& each : failures_of_campaign(result, conclusion.failure, judging)) failures.push_back(std::move(each));
  document[dynamics ? "moving_dissections" : "dissections"] = result;
  print_campaign(result);
  // That cases fail has been said of each.
  if (!conclusion.holds() && result.at("violations").empty()) insist("{}: {}\n", failing("FAILS"), conclusion.failure);
  return conclusion.holds();
}

int replay(const JudgeOptions& options, Guest& guest) {
  const SavedQuestion saved = read_question(options.replay);
  const OperationDescription& operation = *find_operation(saved.operation);
  if (!guest.plugin().offers(operation.number)) {
    throw InputError(options.guest.library, saved.operation, "the plugin does not have this operation",
                     "replay the case with a plugin that does");
  }
  const harness::Promises promises = promises_of(guest.plugin(), operation, options.guest.library);
  say("{}: {}, {}\nfound as: {}\n", options.replay, saved.operation, printable(saved.question.kind),
      printable(saved.found));
  const bool again = guest.plugin().promises && promises.cover("determinism");
  const std::vector<Verdict> verdicts = judge_answer(guest, operation, question_of(saved), saved.at_end, again);
  int64_t judged = 0, failed = 0;
  for (const Verdict& verdict : verdicts) {
    if (!promises.cover(verdict.property)) continue;
    judged += verdict.checked > 0 ? 1 : 0;
    if (verdict.holds) continue;
    ++failed;
    insist("{}: '{}': {}\n", failing("FAILS"), verdict.property, shortened(verdict.witness.text, kMostWitnessBytes));
  }
  if (verdicts.empty()) insist("it refuses this question: nothing was judged\n");
  if (failed == 0 && judged > 0) insist("{}: {} verdicts\n", holding("holds"), judged);
  return failed > 0 || judged == 0 ? 1 : 0;
}

int judge(JudgeOptions options) {
  const EndsInOrder in_order;
  require_writable(options.json);
  require_writable(options.junit);
  require_report(options.report);
  if (!options.report.empty() && !options.replay.empty())
    refuse("--report", "one saved question makes no page", "leave out --report, or --case");
  if (!options.attached.empty()) {
    if (options.attached.size() != 2) {
      refuse("--attached", fmt::format("{} numbers", options.attached.size()), "give those of a socket and of memory");
    }
    // There is no library then: the first word is an operation too.
    if (!options.guest.library.empty()) options.operations.insert(options.operations.begin(), options.guest.library);
    options.guest.library = "the attached guest";
  } else if (options.guest.library.empty()) {
    refuse("FILE.so", "no plugin is given", "name the shared library of one");
  }
  const auto started = options.attached.empty() ? std::make_unique<Guest>(options.guest)
                                                : std::make_unique<Guest>(options.attached[0], options.attached[1],
                                                                          options.guest.time_limit);
  Guest& guest = *started;
  const std::vector<const OperationDescription*> asked = asked_operations(options, guest.plugin());
  if (!options.replay.empty()) return replay(options, guest);
  make_folder("--save", options.save);
  say("{}, seed {}\n", title(guest.plugin(), options.guest.library), options.campaign.seed);
  flush_output();
  bool holds = true;
  std::vector<std::string> failed;  // operations
  std::vector<io::JunitCase> junit;
  std::vector<Failure> failures;
  json document = {{"format", "cutproof.judge"},
                   {"format_version", 1},
                   {"cutproof", kVersion},
                   {"plugin",
                    {{"library", options.attached.empty() ? json(options.guest.library) : json()},
                     {"name", guest.plugin().name},
                     {"version", guest.plugin().version},
                     {"precision", guest.plugin().precision == Precision::binary32 ? "single" : "double"},
                     {"device", guest.plugin().on_device ? "cuda" : "host"}}},
                   {"seed", options.campaign.seed},
                   {"operations", json::array()}};
  for (const OperationDescription* const operation : asked) {
    const harness::Promises promises = promises_of(guest.plugin(), *operation, options.guest.library);
    KernelCampaignOptions campaign_options = options.campaign;
    campaign_options.stop_asked = stop_asked;
    campaign_options.cases = options.cases > 0 ? options.cases : usual_cases(*operation);
    campaign_options.sizes = sizes_of(options, *operation);
    campaign_options.time_limit = options.guest.time_limit;
    if (options.keep_going) campaign_options.most_lost = 0;
    KernelCampaign campaign;
    {
      Progress progress(std::string(operation->name), campaign_options.cases);
      campaign = judge_kernel(guest, *operation, promises, campaign_options, [&](const KernelCampaign& so_far) {
        const double cases =
            std::min(1.0, static_cast<double>(so_far.cases) / static_cast<double>(campaign_options.cases));
        const std::optional<double>& most = campaign_options.seconds;
        progress.show(so_far.cases, fmt::format("{} failed", so_far.failed),
                      most && *most > 0 ? std::max(cases, so_far.seconds / *most) : cases);
      });
    }
    print_head(campaign);
    json result = guests::to_json(campaign);
    for (std::size_t k = 0; k < campaign.failures.size(); ++k) {
      result["failures"][k]["file"] = keep(options, guest, campaign, campaign.failures[k]);
      result["failures"][k]["again"] = replay_command(options, result["failures"][k]["file"], result["operation"]);
    }
    print_properties(campaign);
    add_cases(result, options, junit, failures);
    if (campaign.ended) {
      insist("  no further question was asked: the guest has ended\n");
    } else if (campaign.gave_up) {
      insist("  given up after {} questions that were not answered; --keep-going goes on\n", campaign.lost);
    }
    document["operations"].push_back(std::move(result));
    holds = holds && campaign.holds();
    if (!campaign.holds()) failed.emplace_back(operation->name);
    flush_output();
    if (campaign.ended || stop_asked()) break;
  }
  const auto& names = options.operations;
  const bool on_stages =
      has_stages(guest.plugin()) && (names.empty() || std::find(names.begin(), names.end(), kOnStages) != names.end());
  if (on_stages) {
    bool all_hold = true;
    for (const bool dynamics : {false, true}) {
      if (stop_asked() || (dynamics && !steps(guest.plugin()))) continue;
      all_hold = judge_stages(options, dynamics, document, junit, failures) && all_hold;
    }
    holds = holds && all_hold;
    if (!all_hold) failed.emplace_back(kOnStages);
  }
  const bool complete = !stop_asked();
  if (!complete) {
    const std::size_t begun = document["operations"].size() + (document.contains("dissections") ? 1 : 0);
    const std::size_t all = asked.size() + (on_stages ? 1 : 0);
    const std::string how_far =
        fmt::format("it was stopped after {} of {} begun", begun, counted(all, "operation was", "operations were"));
    insist("{}: {}\n", unsettled("INCOMPLETE"), how_far);
    io::JunitCase& stopped = junit.emplace_back(io::JunitCase{kEnoughJudged, kClass});
    stopped.outcome = io::JunitOutcome::error;
    stopped.message = how_far;
    failures.push_back({stopped.name, how_far, options.again});
  }
  holds = holds && complete;
  document["complete"] = complete;
  document["holds"] = holds;
  document["again"] = options.again;
  write_document(options.json, document);
  if (options.attached.empty()) {
    harness::BackendChoice plugin;
    plugin.name = plugin_backend(options);
    write_document_report(options.report, document, made_by(options.again), plugin);
  } else {
    write_document_report(options.report, document, made_by(options.again));
  }
  double seconds = 0;
  for (const io::JunitCase& each : junit) seconds += each.seconds;
  write_junit(options.junit, {"cutproof judge", kClass, options.again}, seconds, std::move(junit));
  print_written(options.report);
  if (complete && holds) insist("{}\n", holding("all hold"));
  if (complete && !holds) insist("{}{}{}\n", failing("FAILS"), failed.empty() ? "" : ": ", fmt::join(failed, ", "));
  tell_github({options.again, failures});
  return holds ? 0 : 1;
}

}  // namespace

void add_judge(CLI::App& program, Work& work) {
  const auto options = std::make_shared<JudgeOptions>();
  CLI::App* const command = program.add_subcommand("judge", "judge your own kernels, from a shared library");
  command->add_option("plugin", options->guest.library, "a shared library that includes cutproof/plugin.h")
      ->type_name("FILE.so");
  command
      ->add_option("operations", options->operations,
                   "operations of the plugin: rotations, components, surface, clusters, dissect, stages (default: all)")
      ->type_name("OPS");
  add_count(*command, "--cases", options->cases,
            "matrices, bodies or scenes for each operation (default: 100000, 2000 or 200)", whole_number(1));
  command
      ->add_option("--sizes", options->sizes,
                   "sizes of large questions in matrices or particles; 0: none (default: about 65536 and more)")
      ->delimiter(',')
      ->allow_extra_args(false)  // what follows are operations
      ->type_name("N,...")
      ->check(whole_number(0, static_cast<int>(guests::kMostSize)));
  command->add_option("--seconds", options->campaign.seconds, "time for each operation")
      ->type_name("S")
      ->check(number_from(0));
  add_seed(*command, options->campaign.seed, "seed of the cases");
  command->add_option("--parameters", options->guest.parameters, "text for the plugin's create()")->type_name("TEXT");
  command->add_option("--time-limit", options->guest.time_limit, "time for each answer")
      ->capture_default_str()
      ->type_name("S")
      ->check(number_between(0.01, 1e6));
  command->add_flag("--keep-going", options->keep_going, "go on after ten unanswered questions");
  command->add_option("--shrink", options->campaign.simplify, "time for shrinking each failure; 0: none")
      ->capture_default_str()
      ->type_name("S")
      ->check(number_from(0));
  command->add_option("--save", options->save, "folder for counterexamples")->capture_default_str()->type_name("DIR");
  command
      ->add_option("--attached", options->attached,
                   "instead of FILE.so: a running guest, such as cutproof.py, by the numbers of two open files")
      ->delimiter(',')
      ->allow_extra_args(false)  // what follows are operations
      ->type_name("SOCKET,MEMORY")
      ->check(whole_number(0, std::numeric_limits<int>::max()));
  add_json(*command, options->json, "write counts and failures as JSON");
  add_junit(*command, options->junit);
  add_report_option(*command, options->report);
  command->add_option("--case", options->replay, "ask only this saved question")->type_name("CASE");
  command->callback([options, command, &work] {
    options->again = as_given(*command);
    work = [options] { return judge(*options); };
  });
}

}  // namespace cutproof::cli
