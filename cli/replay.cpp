// `cutproof replay`: runs a counterexample again.
#include <fmt/format.h>

#include <memory>

#include "cli/commands.h"
#include "cli/findings.h"
#include "cli/options.h"
#include "cli/screen.h"
#include "model/counted.h"
#include "model/io/recording.h"
#include "model/printable.h"
#include "property_tests/campaign.h"
#include "property_tests/counterexample.h"
#include "property_tests/recorded_case.h"
#include "property_tests/simplify.h"

namespace cutproof::cli {

namespace {

using namespace property_tests;
using harness::BackendChoice;

struct ReplayOptions {
  std::string counterexample;
  BackendChoice backend;  // without a name: the one on which it was found
  std::string record;
  std::string again;  // the command line
};

BackendChoice choice_of(const ReplayOptions& options, const Counterexample& counterexample) {
  if (!options.backend.name.empty()) return options.backend;
  BackendChoice choice;
  if (!counterexample.backend.empty()) choice.name = counterexample.backend;
  return choice;
}

int replay(const ReplayOptions& options) {
  const std::string& file = options.counterexample;
  const Counterexample counterexample = read_counterexample(file);
  const BackendChoice choice = choice_of(options, counterexample);
  const Case& c = counterexample.failing;
  const bool is_history = !counterexample.commands.empty();
  if (is_history && !options.record.empty()) {
    refuse("--record", file + " is a history of commands, which cannot be recorded", "leave it out");
  }
  say("{}: {}, {}, {}backend {}\n", file, counted(c.nodes.size(), "particle", "particles"),
      counted(c.strokes.size(), "stroke", "strokes"),
      is_history ? counted(counterexample.commands.size(), "command", "commands") + ", " : "", printable(choice.name));
  if (!counterexample.found.empty()) say("found as: {}\n", printable(counterexample.found));
  const auto make = [&] { return backend_of(counterexample, choice); };
  const Judgement judgement =
      is_history ? history_alone(make, c, counterexample.commands) : dissect_alone(make, c, true);
  if (!options.record.empty()) {
    const std::string problem = record_case(options.record, make(), c);
    if (problem.empty()) {
      say_copy("recorded", io::recording_paths(options.record).index);
    } else {
      insist("not recorded: {}\n", problem);
    }
  }
  if (judgement.failure) {
    insist("{}: {}\n", failing("FAILS"), describe(*judgement.failure));
    tell_github(
        {options.again, failures_of({*judgement.failure}, {.suite = {}, .class_name = {}, .again = options.again})});
    return 1;
  }
  if (judgement.verdicts == 0) {
    insist("{}: nothing was judged\n", failing("FAILS"));
    tell_github({options.again, {{kEnoughJudged, "nothing was judged", options.again}}});
    return 1;
  }
  insist("{}: {} verdicts\n", holding("holds"), judgement.verdicts);
  tell_github({options.again});
  return 0;
}

}  // namespace

void add_replay(CLI::App& program, Work& work) {
  const auto options = std::make_shared<ReplayOptions>();
  options->backend.name.clear();
  CLI::App* const command = program.add_subcommand("replay", "run a counterexample again");
  command->add_option("counterexample", options->counterexample, "file that `cutproof fuzz` saved")
      ->required()
      ->type_name("CASE");
  add_backend(*command, options->backend, "backend under test (default: the one that failed)");
  command->add_option("--record", options->record, "record every frame, for `cutproof check` and ParaView")
      ->type_name("F");
  command->callback([options, command, &work] {
    options->again = as_given(*command);
    work = [options] { return replay(*options); };
  });
}

}  // namespace cutproof::cli
