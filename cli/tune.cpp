// `cutproof tune`: the cheapest configuration of a scene within a tolerance (measure_and_tune.md, Tuning).
#include "tuning/tune.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "cli/commands.h"
#include "cli/document_report.h"
#include "cli/interruption.h"
#include "cli/mesh_report.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/progress.h"
#include "cli/report_page.h"
#include "cli/scene_files.h"
#include "cli/scene_options.h"
#include "cli/screen.h"
#include "cli/table.h"
#include "cli/terminal.h"
#include "model/io/filled.h"
#include "model/printable.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;
using namespace tuning;

struct Asked {
  TuneOptions tune;
  SceneOptions scene;
  std::string reference = "limit";
  std::string json, report;
  std::string again;  // the command line
};

// The default name of the scene that is written. Throws InputError if two of the three files are one.
void settle_files(Asked& asked) {
  namespace fs = std::filesystem;
  TuneOptions& options = asked.tune;
  if (options.write.empty()) options.write = fs::path(options.scene).stem().string() + "_tuned.json";
  const auto same = [](const fs::path& a, const fs::path& b) {
    std::error_code error;
    return fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error);
  };
  const auto require_other = [&](const char* option, const std::string& file, const std::string& other,
                                 const char* what) {
    if (!file.empty() && same(file, other)) refuse(option, fmt::format("'{}' is {}", file, what), "give another name");
  };
  require_other("--write", options.write, options.scene, "the scene that is tuned");
  require_other("--json", asked.json, options.scene, "the scene that is tuned");
  require_other("--json", asked.json, options.write, "the scene that is written");
  require_other("--report", asked.report, options.scene, "the scene that is tuned");
  require_other("--report", asked.report, options.write, "the scene that is written");
  require_other("--report", asked.report, asked.json, "what --json writes");
  require_writable(asked.json);
  require_report(asked.report);
  require_writable(options.write);
}

void print_beginning(const TuneOptions& options, const json& document, const Scene& given,
                     const fixtures::BuildReport& built) {
  say_filled(kHead, document);
  say("scene {}: {}\n", printable(given.name), printable(given.description));
  print_build(built);
  if (options.without_skin && given.expect.shells_at_end) {
    say("--without-skin has no effect: the scene expects shells of its skin\n");
  }
}

// Of a level of the reference solution.
std::string level_text(const json& level) {
  if (!level.at("iterations").is_null()) return io::filled("reference, {substeps} × {iterations}", level);
  const json& solved = level.at("solved");
  const std::string others = solved.at("by_iteration") == 0
                                 ? ""
                                 : io::filled(
                                       " ({by_iteration} of {substeps} by iterations of their own, {unsolved} "
                                       "of these not to their end)",
                                       solved);
  return io::filled("scene's {substeps} substeps, each solved without the reference's step", level) + others;
}

// Why a distance may not have fallen: the two levels removed particles at different times, removed different particles,
// or merged differently.
std::string events_text(const json& level) {
  std::string text;
  const auto add = [&](const char* key, const char* what, const char* how) {
    const int64_t n = level.value(key, int64_t{0});
    if (n > 0) text += fmt::format("; {} {}{} {}", n, what, n == 1 ? "" : "s", how);
  };
  add("removed_in_another_frame", "particle", "removed in another frame");
  add("alive_in_one", "particle", "alive in one of both");
  add("clusters_in_one", "cluster", "of other tissue");
  return text;
}

void print_reference(const TuneOptions& options, const json& reference) {
  say("the reference solution: {}\n", options.reference == ReferenceKind::limit
                                          ? "the limit of short time steps"
                                          : "the scene's own substeps, each solved until converged");
  for (const json& level : reference.at("levels")) {
    say("  {}", level_text(level));
    if (!level.at("apart_h").is_null()) say_filled(": {apart_h:.2g} h from the one before", level);
    if (level.contains("order") && !level.at("order").is_null()) say_filled(", order {order:.2f}", level);
    say("{}", events_text(level));
    say("\n");
  }
  say_filled("  {known_text}\n", reference);
}

void print_trials(const json& trials) {
  const auto of_given = [&](const json& trial) {
    const json &seconds = trial.at("seconds_per_frame"), &given = trials.front().at("seconds_per_frame");
    if (seconds.is_null()) return std::string("-");
    return fmt::format("{:.2f}", seconds.at("median").get<double>() / given.at("median").get<double>());
  };
  const auto more = [](const json& trial) {
    const bool both = trial.at("differences") != "" && trial.at("why") != "";
    return io::filled(both ? "{differences}; {why}" : "{differences}{why}", trial);
  };
  say_as_it_is("\n" + table_of(trials,
                               {{"substeps × iterations", "{substeps} × {iterations}"},
                                {"acceleration", "{acceleration}"},
                                {"RMS h", "{rms_h:.2g}"},
                                {"max h", "{max_h:.2g}"},
                                {"removed otherwise", "{removed_otherwise}"},
                                {"ms a frame", "{1e3*seconds_per_frame/median:.3f}"},
                                {"of given", of_given},
                                {"outcome", "{outcome}"},
                                {"else", more}},
                               2));
}

// Of seconds a frame: milliseconds, and between which they lay.
std::string ms_and_range(const json& times) {
  return io::filled("{1e3*median:.3f} ({1e3*min:.3f} to {1e3*max:.3f})", times);
}

// The cheapest configuration for each tolerance, and its cost beside the scene as given.
void print_front(const json& document) {
  const json& trials = document.at("trials");
  json rows = json::array();
  for (const json& point : document.at("front")) {
    if (point.at("trial").is_null()) {
      rows.push_back({{"tolerance_h", point.at("tolerance_h")}, {"what", "nothing that was tried"}});
      continue;
    }
    json row = trials.at(point.at("trial").get<std::size_t>());
    row["tolerance_h"] = point.at("tolerance_h");
    row["what"] = io::filled("{substeps} × {iterations}, {acceleration}", row);
    if (row.at("differences") != "") row["what"] = io::filled("{what}, {differences}", row);
    const double given = trials.front().at("seconds_per_frame").at("median").get<double>();
    row["of_given"] = row.at("seconds_per_frame").at("median").get<double>() / given;
    rows.push_back(std::move(row));
  }
  const auto times = [](const json& row) {
    return row.contains("seconds_per_frame") ? ms_and_range(row.at("seconds_per_frame")) : std::string("-");
  };
  const auto figure = [](const char* name, const char* format) {
    return [=](const json& row) { return row.contains(name) ? io::filled(format, row) : std::string("-"); };
  };
  say("\nthe cheapest that was tried, by tolerance\n");
  say_as_it_is(table_of(rows,
                        {{"within h", "{tolerance_h:g}"},
                         {"configuration", "{what}"},
                         {"ms a frame", times},
                         {"of given", figure("of_given", "{of_given:.2f}")},
                         {"RMS h", figure("rms_h", "{rms_h:.2g}")},
                         {"max h", figure("max_h", "{max_h:.2g}")}},
                        2));
}

void print_not_taken(const json& document) {
  const json& left = document.at("left").back();
  say_filled("{substeps} × {iterations}, acceleration {acceleration}, is not taken",
             document.at("trials").at(left.at("trial").get<std::size_t>()));
  say_filled(": {why}\n", left);
}

void print_found(const TuneOptions& options, const json& document) {
  const json& found = document.at("found");
  const auto index = found.at("trial").get<std::size_t>();
  const json& trial = document.at("trials").at(index);
  const std::string tuned =
      io::filled("{1e3*median:.3f} ms a frame ({1e3*min:.3f} to {1e3*max:.3f})", found.at("seconds_per_frame"));
  if (index == 0) {
    say("\nfound: nothing cheaper; the scene as given is within the tolerance\n  {}\n", tuned);
  } else {
    const auto ratio = found.at("times_cheaper").get<double>();
    say_filled("\nfound: {substeps} × {iterations}, acceleration {acceleration}", trial);
    if (trial.at("differences") != "") say_filled(", {differences}", trial);
    say("\n  {}, as given {}: {}\n", tuned, ms_and_range(found.at("seconds_per_frame_as_given")),
        ratio >= 1 ? fmt::format("{:.2f} times cheaper", ratio)
                   : fmt::format("{:.2f} times as expensive, and the scene as given is not within", 1 / ratio));
  }
  say_filled("  verified: RMS {rms_h:.2g} h, max {max_h:.2g} h ", found.at("verified"));
  const json& level = document.at("reference").at("levels").back();
  say("from the {}", level_text(level));
  say_filled(", {apart_h:.2g} h from the one before; ", level);
  say_filled("{verdicts} verdicts hold\n", found);
  if (options.frames)
    say_filled("  the scene was written completely, but only {frames} frames were judged\n", document);
}

void print(const TuneOptions& options, TuneStep step, const json& document, const Scene& given,
           const fixtures::BuildReport& built) {
  switch (step) {
    case TuneStep::begun:
      return print_beginning(options, document, given, built);
    case TuneStep::reference_known:
      return print_reference(options, document.at("reference"));
    case TuneStep::trial:
    case TuneStep::tried:
      return;
    case TuneStep::searched:
      print_trials(document.at("trials"));
      return print_front(document);
    case TuneStep::not_taken:
      return print_not_taken(document);
    case TuneStep::found:
      return print_found(options, document);
    case TuneStep::reference_unknown:
      insist("the reference solution is {}, too uncertain for a tolerance of {:g} h.\n  Give a greater tolerance{}.\n",
             document.at("reference").at("known_text").get<std::string>(), options.tolerance,
             options.reference == ReferenceKind::limit
                 ? ", fewer --frames, or --reference substeps, which takes the scene's time step as given"
                 : " or fewer --frames");
      return;
    case TuneStep::none_within:
      insist("none of {} configurations is within {:g} h of the reference solution, itself {}\n",
             document.at("trials").size(), options.tolerance,
             document.at("reference").at("known_text").get<std::string>());
      return;
    case TuneStep::none_verified:
      insist("none of the configurations that seemed to be within {:g} h holds when it is verified\n",
             options.tolerance);
      return;
    case TuneStep::stopped: {
      const json& trials = document.at("trials");
      if (!trials.empty()) {
        print_trials(trials);
        print_front(document);
      }
      insist("\n{}: it was stopped {}; nothing is found yet\n", unsettled("INCOMPLETE"),
             trials.empty() ? std::string("before the first configuration was tried")
                            : fmt::format("after {} configuration{}", trials.size(), trials.size() == 1 ? "" : "s"));
    }
  }
}

int tune(Asked asked) {
  const EndsInOrder in_order;
  asked.tune.stop_asked = stop_asked;
  asked.tune.reference = asked.reference == "limit" ? ReferenceKind::limit : ReferenceKind::substeps;
  asked.tune.scene = asked.scene.file;
  asked.tune.changes = changes_of(asked.scene);
  settle_files(asked);
  Progress progress("trial", 0);
  double part = 0;
  const TuneProgress tell = [&](TuneStep step, const json& so_far, const Scene& given,
                                const fixtures::BuildReport& built) {
    json document = so_far;
    document["build"] = build_json(built);
    document["changes"] = given_changes(asked.tune.changes);
    document["again"] = asked.again;
    // After each trial, so that measurements are kept if a later one fails; and at the end.
    if (step == TuneStep::trial || step == TuneStep::searched) keep_document(asked.json, document);
    if (step == TuneStep::stopped || document.at("complete")) {
      write_document(asked.json, document);
      write_document_report(asked.report, document, made_by(asked.again, document.at("backend")));
    }
    print(asked.tune, step, document, given, built);
    if (step == TuneStep::trial) part = std::max(part, part_searched(document, given));  // restarts by parameter
    flush_output();
    if (step == TuneStep::stopped || document.at("complete")) return;
    const char* const what = step == TuneStep::begun      ? "computing the reference solution"
                             : step == TuneStep::tried    ? "timing"
                             : step == TuneStep::searched ? "verifying"
                                                          : "searching";
    progress.show(static_cast<int64_t>(document.at("trials").size()), what, part);
  };
  const bool found = with_sources(asked.tune.scene, asked.tune.changes, [&] { return run_tune(asked.tune, tell); });
  print_written(asked.json);
  print_written(asked.report);
  if (found) insist_copy("wrote", asked.tune.write);
  return found ? 0 : 1;
}

}  // namespace

void add_tune(CLI::App& program, Work& work) {
  const auto asked = std::make_shared<Asked>();
  TuneOptions& options = asked->tune;
  CLI::App* const command =
      program.add_subcommand("tune", "find the cheapest configuration of a scene within a tolerance");
  add_scene(*command, asked->scene)->required();
  command
      ->add_option("--tolerance", options.tolerance,
                   "greatest acceptable RMS distance from the reference solution in any frame [h]")
      ->required()
      ->type_name("T")
      ->check(number_above(0));
  command
      ->add_option("--reference", asked->reference,
                   "reference solution. limit: shorter and shorter time steps; substeps: the scene's own, each solved "
                   "to convergence")
      ->capture_default_str()
      ->type_name("R")
      ->check(one_of({"limit", "substeps"}));
  add_backend(*command, options.backend, "backend under test", is_timed);
  add_count(*command, "--frames", options.frames, "only this many frames of the scene", whole_number(1));
  command->add_flag("--without-skin", options.without_skin, "make no skin");
  command->add_flag("--full", options.full,
                    "run and time all configurations to the end, for a curve; otherwise those beyond the tolerance, or "
                    "dearer than the best, are given up");
  add_count(*command, "--repeats", options.repeats,
            "timed runs of each configuration; with --full only one if clearly not on the front",
            whole_number(1, 1000));
  command->add_option("--write", options.write, "file for the scene found (default: NAME_tuned.json here)")
      ->type_name("F");
  add_json(*command, asked->json, "write all tried configurations as JSON");
  add_report_option(*command, asked->report);
  command->callback([asked, command, &work] {
    asked->again = as_given(*command);
    work = [asked] {
      asked->scene.file = scene_file(asked->scene.file);
      return tune(*asked);
    };
  });
}

}  // namespace cutproof::cli
