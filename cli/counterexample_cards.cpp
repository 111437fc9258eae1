#include "cli/counterexample_cards.h"

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/options.h"
#include "guests/guest.h"
#include "guests/plugin_backend.h"
#include "model/at.h"
#include "model/counted.h"
#include "model/error.h"
#include "property_tests/campaign.h"
#include "property_tests/shown_case.h"
#include "property_tests/simplify.h"

namespace cutproof::cli {

namespace {

using namespace property_tests;
using harness::BackendChoice;

std::string with_unit(double figure, const std::string& unit) {
  return unit == "1" || unit.empty() ? fmt::format("{:.4g}", figure) : fmt::format("{:.4g} {}", figure, unit);
}

report::Finding finding_of(const Verdict& verdict) {
  report::Finding finding;
  finding.property = verdict.property;
  finding.stage = verdict.stage;
  finding.frame = verdict.frame;
  finding.text = verdict.witness.text;
  finding.clusters = verdict.witness.clusters;
  finding.particles = verdict.witness.particles;
  finding.path = verdict.witness.path;
  finding.triangles = verdict.witness.triangles;
  return finding;
}

// The states of one run, as pictures.
report::Side side_of(const std::string& name, const ShownCase& shown, const std::vector<report::Finding>& findings) {
  const harness::Trace& trace = shown.trace;
  const report::Source source = {shown.loaded.setup, std::ssize(trace.moments) + 1, [&](int64_t index) {
                                   if (index == 0) return io::Snapshot{Stage::skin, *trace.initial};
                                   const harness::Moment& moment = trace.moments[at(index - 1)];
                                   return io::Snapshot{moment.span.last, *moment.after};
                                 }};
  constexpr int64_t kBytesOfOne = report::kMostSceneryBytes / static_cast<int64_t>(2 * report::kMostSceneries);
  return {name, report::pictures_of(source, findings, kBytesOfOne)};
}

}  // namespace

std::optional<bool> add_counterexample(report::Card& card, const Counterexample& counterexample,
                                       const std::string& file, const std::optional<BackendChoice>& chosen,
                                       std::vector<report::Scenery>& sceneries) {
  const Case& c = counterexample.failing;
  const bool is_history = !counterexample.commands.empty();
  const auto add = [&](const char* what, const std::string& value) { card.facts.emplace_back(what, value); };
  add("The case", in_words(c) + (is_history ? fmt::format("; a history of {}", counted(counterexample.commands.size(),
                                                                                       "command", "commands"))
                                            : ""));
  if (is_history) add("What is done with it", in_words(counterexample.commands));
  BackendChoice choice;
  if (chosen) {
    choice = *chosen;
  } else if (!counterexample.backend.empty()) {
    choice.name = counterexample.backend;
  }
  card.command = "cutproof replay " + quoted(file);
  if (chosen && chosen->name != counterexample.backend) card.command += " --backend " + quoted(chosen->name);
  if (!chosen && choice.name.starts_with(guests::kPluginPrefix)) {
    add("Run again", "not for this page: a plugin is run only if --backend names it. It was found on " + choice.name);
    return std::nullopt;
  }
  const auto make = [&] { return backend_of(counterexample, choice); };
  Judgement judgement;
  try {
    judgement = is_history ? history_alone(make, c, counterexample.commands) : dissect_alone(make, c, true);
  } catch (const InputError& error) {
    add("Run again", std::string("not for this page: ") + error.what());
    return std::nullopt;
  } catch (const guests::CannotRunHere& error) {
    add("Run again", std::string("not for this page: ") + error.what());
    return std::nullopt;
  } catch (const MachineError& error) {
    add("Run again", std::string("not for this page: ") + error.what());
    return std::nullopt;
  }
  const std::optional<Verdict>& failure = judgement.failure;
  if (failure) {
    add("Run again", fmt::format("it fails on {}: '{}' in frame {} after {}", choice.name, failure->property,
                                 failure->frame, name_of(failure->stage)));
    add("Measured / bound",
        could_be_judged(failure->witness.text)
            ? with_unit(failure->measured, failure->unit) + " / " + with_unit(failure->bound, failure->unit)
            : std::string("nothing / none"));
    if (!failure->bound_source.empty()) add("Where the bound comes from", failure->bound_source);
    if (!failure->witness.text.empty()) card.words = failure->witness.text;
  } else if (judgement.verdicts == 0) {
    add("Run again", "nothing was judged on " + choice.name);
  } else {
    add("Run again", fmt::format("it holds on {} now, in {} verdicts", choice.name, judgement.verdicts));
  }
  if (sceneries.size() >= report::kMostSceneries) {
    add("3D view",
        fmt::format("none: a page shows {} counterexamples; make one of this alone", report::kMostSceneries));
    return failure.has_value();
  }
  const auto shown_on = [&](const auto& backend) {
    return is_history ? run_to_show(backend, c, counterexample.commands) : run_to_show(backend, c);
  };
  const ShownCase shown = shown_on(make);
  if (!shown.problem.empty()) {
    add("3D view", "none: " + shown.problem);
    return failure.has_value();
  }
  report::Scenery scenery;
  const std::vector<report::Finding> findings =
      failure ? std::vector<report::Finding>{finding_of(*failure)} : std::vector<report::Finding>();
  scenery.sides.push_back(side_of("backend " + choice.name, shown, findings));
  if (failure) {
    scenery.property = failure->property;
    scenery.text = failure->witness.text;
  }
  const std::string reference(harness::reference_backend().name);
  if (choice.name != reference) {
    BackendChoice other;
    other.name = reference;
    const ShownCase beside = shown_on([&] { return harness::make_backend(other); });
    // The same particles are marked in it.
    if (beside.problem.empty()) scenery.sides.push_back(side_of("the reference", beside, findings));
  }
  const Setup& setup = shown.loaded.setup;
  scenery.body = report::body_json(setup, scenery.sides.front().pictures.particles);
  scenery.blade = report::blade_json(setup);
  card.picture = static_cast<int>(sceneries.size());
  sceneries.push_back(std::move(scenery));
  return failure.has_value();
}

report::Sheet counterexample_sheet(const std::vector<Counterexample>& counterexamples,
                                   const std::vector<std::string>& files, const std::optional<BackendChoice>& chosen,
                                   std::vector<report::Scenery>& sceneries) {
  report::Sheet sheet;
  sheet.kind = counterexamples.size() == 1 ? "counterexample" : "counterexamples";
  sheet.title =
      counterexamples.size() == 1 ? files.front() : counted(files.size(), "counterexample", "counterexamples");
  std::size_t failing = 0, run = 0;
  for (std::size_t k = 0; k < counterexamples.size(); ++k) {
    const Counterexample& one = counterexamples[k];
    report::Card card;
    card.title = files[k];
    if (!one.found.empty()) card.facts.emplace_back("Found as", one.found);
    card.facts.emplace_back("Found by", fmt::format("case {} of seed {}{}", one.index, one.seed,
                                                    one.backend.empty() ? "" : " on " + one.backend));
    const std::optional<bool> fails = add_counterexample(card, one, files[k], chosen, sceneries);
    run += fails.has_value();
    failing += fails.value_or(false);
    sheet.cards.push_back(std::move(card));
  }
  if (run > 0) sheet.holds = failing == 0 && run == counterexamples.size();
  sheet.badge = run == 0 ? "not run" : failing > 0 ? "fails" : *sheet.holds ? "holds now" : "not all run";
  sheet.summary = run == 0 ? std::string("Saved cases that failed once. None was run again for this page.")
                           : fmt::format("Saved cases that failed once, run again for this page: {} of {} {}.", failing,
                                         counterexamples.size(), failing == 1 ? "fails" : "fail");
  sheet.facts = {std::string("cutproof ") + kVersion};
  return sheet;
}

}  // namespace cutproof::cli
