#include "report/results.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "model/error.h"
#include "model/io/columns.h"
#include "model/io/json_reader.h"
#include "model/io/limits.h"
#include "model/left_stages.h"
#include "oracles/property_count.h"
#include "oracles/registry.h"
#include "report/field.h"

namespace cutproof::report {

namespace {

using nlohmann::json;

constexpr const char* kRemedy = "give what `cutproof run --json F` or `cutproof check --json F` has written";

std::string figure(double value) { return fmt::format("{:.4g}", value); }

// Properties of which measured / bound says how much room there is: those of the summary. What a scene expects and
// what is held against the run as a whole has a bound that is to be met, or exceeded.
using Measured = std::set<std::pair<std::string, Stage>>;
Measured measured_properties(const Field& document) {
  Measured found;
  const Field properties = document["properties"];
  for (std::size_t k = 0; properties.value != nullptr && k < properties.length(); ++k)
    found.emplace(properties.at(k)["property"].text(), properties.at(k)["stage"].stage());
  return found;
}

struct Row {
  PropertyRow shown;
  double worst = -1;  // measured / bound of the verdict shown
};

void add_verdict(const Field& verdict, const Measured* known, std::vector<Row>& rows,
                 std::map<std::pair<std::string, Stage>, std::size_t>& at, Results& results) {
  const std::string property = verdict["property"].text();
  const Stage stage = results.is_foreign() ? Stage::skin : verdict["stage"].stage();
  const auto [place, is_new] = at.try_emplace({property, stage}, rows.size());
  if (is_new) {
    rows.emplace_back();
    rows.back().shown.property = property;
    rows.back().shown.stage = stage;
  }
  Row& row = rows[place->second];
  PropertyRow& shown = row.shown;
  const bool holds = verdict["holds"].flag(), is_expected = !holds && verdict["expected_failure"].flag_or(false);
  const int64_t checked = verdict["checked"].count(), frame = verdict["frame"].count();
  const double measured = verdict["measured"].number(), bound = verdict["bound"].number();
  const std::string given_unit = verdict["unit"].text();
  const bool was_judged =
      holds || !verdict["witness"].is_there() || could_be_judged(verdict["witness"]["text"].text_or(""));
  const std::string measured_text = was_judged ? figure(measured) : "nothing",
                    bound_text = was_judged ? figure(bound) : "none";
  const std::string unit = given_unit == "1" || !was_judged ? "" : given_unit, source = verdict["bound_source"].text();
  const bool has_ratio = was_judged && (known == nullptr || known->count({property, stage}) != 0) &&
                         std::isfinite(measured) && std::isfinite(bound) && bound > 0 &&
                         // What demands at least its bound has no room to lose.
                         (!holds || measured < bound) && !oracles::is_of_the_judging(property);
  const std::optional<double> of_bound = has_ratio ? std::optional(measured / bound) : std::nullopt;
  ++results.verdicts;
  if (shown.bound_source.empty()) shown.bound_source = source;
  shown.checked += checked;
  shown.inconclusive += verdict["inconclusive"].count_or(0);
  if (holds && checked == 0) {
    if (shown.judged == 0 && shown.vacuous.empty()) shown.vacuous = verdict["nothing_judged"].text_or("");
    return;
  }
  const bool is_first_failure = !holds && shown.failed + shown.expected == 0;
  if (is_first_failure || (shown.failed + shown.expected == 0 && of_bound.value_or(0) > row.worst)) {
    row.worst = of_bound.value_or(0);
    shown.frame = frame;
    shown.measured = measured_text;
    shown.bound = bound_text;
    shown.unit = unit;
    shown.of_bound = of_bound;
  }
  ++shown.judged;
  if (holds) return;
  ++(is_expected ? shown.expected : shown.failed);
  if (shown.failed + shown.expected > kMostFindingsOfOne) {
    ++results.findings_left_out;
    return;
  }
  const Field witness = verdict["witness"];
  results.findings.push_back({property, stage, frame, measured_text, bound_text, unit, of_bound, source,
                              witness["text"].text(), witness["clusters"].numbers(kMostWitnesses),
                              witness["particles"].numbers(kMostWitnesses), witness["path"].numbers(kMostWitnesses),
                              witness["triangles"].numbers(kMostWitnesses), witness["frames"].numbers(kMostWitnesses),
                              is_expected});
}

void add_verdicts(const Field& document, Results& results) {
  std::vector<Row> rows;
  std::map<std::pair<std::string, Stage>, std::size_t> at;
  const Measured known = measured_properties(document);
  const Measured* const of_summary = results.is_foreign() ? nullptr : &known;
  const auto add_list = [&](const Field& list, const Measured* measured) {
    const std::size_t count = list.length();
    for (std::size_t k = 0; k < count; ++k) add_verdict(list.at(k), measured, rows, at, results);
  };
  if (results.checked) add_list(document["verdicts"], of_summary);
  if (const Field against = document["against"]; against.value != nullptr) {
    results.checked = true;
    add_list(against["verdicts"], nullptr);
  }
  for (Row& row : rows) {
    if (row.shown.judged > 0) row.shown.vacuous.clear();
    results.rows.push_back(std::move(row.shown));
  }
  std::stable_sort(results.rows.begin(), results.rows.end(), [](const PropertyRow& a, const PropertyRow& b) {
    const auto rank = [](const PropertyRow& row) {
      return row.failed > 0 ? 0 : row.expected > 0 ? 1 : row.judged > 0 ? 2 : 3;
    };
    // Of those that fail what fails first, of those that hold the nearest to its bound.
    const int of_a = rank(a), of_b = rank(b);
    if (of_a == of_b && of_a < 2) return std::pair(a.frame, a.stage) < std::pair(b.frame, b.stage);
    return of_a != of_b ? of_a < of_b : of_a == 2 && a.of_bound.value_or(-1) > b.of_bound.value_or(-1);
  });
  std::stable_sort(results.findings.begin(), results.findings.end(), [](const Finding& a, const Finding& b) {
    // Of one moment first what names a place.
    const auto has_none = [](const Finding& one) {
      return one.clusters.empty() && one.particles.empty() && one.path.empty() && one.triangles.empty();
    };
    // Of what else fails with it, a ghost force says most.
    const auto is_other = [](const Finding& one) { return one.property != "no ghost force"; };
    return std::tuple(a.is_expected, a.frame, a.stage, is_other(a), has_none(a)) <
           std::tuple(b.is_expected, b.frame, b.stage, is_other(b), has_none(b));
  });
  if (results.findings.size() > kMostFindings) {
    results.findings_left_out += static_cast<int64_t>(results.findings.size() - kMostFindings);
    results.findings.resize(kMostFindings);
  }
}

void set_value(std::vector<Series>& all, const std::string& name, std::size_t frames, std::size_t frame,
               std::optional<double> value) {
  auto series = std::find_if(all.begin(), all.end(), [&](const Series& one) { return one.name == name; });
  if (series == all.end()) series = all.insert(all.end(), {name, std::vector<std::optional<double>>(frames)});
  if (frame < frames) series->values[frame] = value;
}

// Arrays of equal length: in which frame, and what.
void add_columns(const Field& frames, const char* column, const std::string& name, std::size_t count,
                 std::vector<Series>& errors) {
  const Field frame = frames["frame"], values = frames[column];
  if (values.value == nullptr) return;
  if (frame.length() != values.length()) values.refuse("this has not as many entries as 'frame'");
  for (std::size_t k = 0; k < values.length(); ++k)
    set_value(errors, name, count, static_cast<std::size_t>(frame.at(k).count()), values.at(k).number_or_null());
}

void add_series(const Field& document, Results& results) {
  const Field frames = document["frames"];
  const std::size_t count = frames.length();
  for (std::size_t k = 0; k < count; ++k) {
    const Field seconds = frames.at(k)["seconds"];
    for (const Stage stage : kStages) {
      if (seconds.value == nullptr) continue;
      const Field one = seconds[std::string(name_of(stage)).c_str()];
      if (one.value != nullptr) set_value(results.seconds, std::string(name_of(stage)), count, k, one.number_or_null());
    }
  }
  // In the order of stages, whichever came first.
  std::vector<Series> ordered;
  for (const Stage stage : kStages) {
    for (Series& one : results.seconds) {
      if (one.name == name_of(stage)) ordered.push_back(std::move(one));
    }
  }
  results.seconds = std::move(ordered);
  if (const Field against = document["against"]; against.value != nullptr) {
    if (const Field lockstep = against["lockstep"]; lockstep.value != nullptr && !lockstep.value->is_null())
      add_columns(lockstep["frames"], "position_max", "greatest, from the same state", count, results.errors);
    if (const Field free = against["free_running"]; free.value != nullptr && !free.value->is_null()) {
      add_columns(free["frames"], "position_max", "greatest, running freely", count, results.errors);
      add_columns(free["frames"], "position_rms", "RMS, running freely", count, results.errors);
    }
  }
  if (const Field errors = document["errors"]; errors.value != nullptr) {
    if (const Field solver = errors["solver"]; solver.value != nullptr && !solver.value->is_null()) {
      const Field rows = solver["frames"];
      for (std::size_t k = 0; k < rows.length(); ++k) {
        const Field row = rows.at(k);
        set_value(results.errors, "greatest, of the solver", count, static_cast<std::size_t>(row["frame"].count()),
                  row["max"].number_or_null());
      }
    }
    if (const Field step = errors["time_step"]; step.value != nullptr && !step.value->is_null()) {
      const Field rms = step["rms"];
      for (std::size_t k = 0; k < rms.length(); ++k)
        set_value(results.errors, "RMS, of the time step", count, k, rms.at(k).number_or_null());
    }
  }
}

std::string pieces_in_words(int64_t pieces) {
  return fmt::format("Its tissue is {} {}.", pieces, pieces == 1 ? "piece" : "pieces");
}

int64_t frame_or_none(const Field& frame) { return frame.is_nothing() ? -1 : frame.count(); }

// What only one of the commands says.
void add_subject(const Field& document, Results& results) {
  if (results.command == "check_run") {
    results.scene = document["source"].text();
    results.particles = document["run"]["particles_at_end"].count();
    if (document["pieces"]["units"].count() > 0) results.pieces = document["pieces"]["in_words"].text();
    results.opens = frame_or_none(document["pieces"]["last_cut"]);
  } else if (results.command == "check_state") {
    results.scene = document["source"].text();
    results.particles = document["body"]["particles"].count();
    if (const Field pieces = document["body"]["pieces"]; !pieces.is_nothing())
      results.pieces = pieces_in_words(pieces.count());
  } else if (results.command == "kick") {
    results.scene = document["source"].text();
    results.particles = document["particles"].count();
    if (const Field kicks = document["kicks"]; kicks.length() > 0) {
      results.opens = frame_or_none(kicks.at(0)["kick_frame"]);
      results.pieces = pieces_in_words(static_cast<int64_t>(kicks.at(0)["pieces"].length()));
    }
  } else {
    const std::vector<std::string> sources = document["sources"].texts();
    results.scene = fmt::format("{} ({})", fmt::join(sources, " and "), document["map"].text());
    results.particles = document["particles"].count();
    if (const Field sharpest = document["sharpest"]; !sharpest.is_nothing()) results.opens = sharpest["frame"].count();
  }
}

// What was not judged stands among the rows of what was.
Results foreign_results(const Field& document, const std::string& command) {
  Results results;
  results.command = command;
  results.version = document["cutproof"].text();
  add_subject(document, results);
  results.checked = true;
  results.holds = document["summary"]["holds"].flag();
  add_verdicts(document, results);
  if (const Field not_judged = document["not_judged"]; not_judged.is_there()) {
    not_judged.each([&](const Field& one) {
      PropertyRow& row = results.rows.emplace_back();
      row.property = one["property"].text();
      row.vacuous = one["why"].text();
    });
  }
  results.notes = document["notes"].texts();
  return results;
}

}  // namespace

Results results_of(const json& given, const std::string& file) {
  const Field document = {&given, file, "", kRemedy};
  if (!given.is_object()) document.refuse("this is no result of cutproof");
  const std::string format = document["format"].text();
  for (const char* const command : {"check_run", "check_state", "kick", "relate"}) {
    if (format == std::string("cutproof.") + command) return foreign_results(document, command);
  }
  Results results;
  if (format != "cutproof.run" && format != "cutproof.check")
    document["format"].refuse("'" + format + "' is no result of a run or of a check, of which alone a page is made");
  results.command = format.substr(format.find('.') + 1);
  if (const int64_t version = document["format_version"].count(); version != 2)
    document["format_version"].refuse(fmt::format("this is version {}, and only 2 is read", version));
  results.version = document["cutproof"].text();
  results.scene = document["scene"].text();
  results.backend = document["backend"].text();
  results.particles = document["body"]["particles"].count();
  results.checked = document["checked"].flag();
  add_verdicts(document, results);
  int64_t looked = 0, failed = 0;
  for (const PropertyRow& row : results.rows) {
    looked += row.judged;
    failed += row.failed;
  }
  // What nobody looked at does not hold, though nothing fails.
  results.holds = looked > 0 && failed == 0;
  if (document["checked"].flag()) results.holds = document["summary"]["holds"].flag() && results.holds;
  results.notes = document["notes"].texts();
  results.not_reached = document["not_reached"].texts();
  if (const Field left = document["left_to_reference"]; left.is_there()) {
    results.left_stages = left["stages"].texts();
    // The stages are among the notes already.
    for (const std::string& one : left["expected"].texts())
      results.notes.push_back("Not judged, because only such stages decide it: " + one + ".");
  }
  add_series(document, results);
  return results;
}

Results read_results(const std::string& file) {
  return results_of(io::read_json(file, io::kResultsLimits,
                                  "Give what `cutproof run --json F` or `cutproof check --json F` has written."),
                    file);
}

namespace {

// "27 properties hold, and …": those that a terminal counts, too (cli/terminal.cpp).
std::string count_in_words(const std::vector<PropertyRow>& rows) {
  std::vector<oracles::AfterStage> all;
  for (const PropertyRow& row : rows) all.push_back({row.property, row.judged > 0, row.failed > 0, row.expected > 0});
  const oracles::PropertyCount count = oracles::count_properties(all);
  const int64_t properties = count.properties(), expectations = count.met + count.unmet;
  std::string words;
  const auto add = [&](const std::string& more) { words += (words.empty() ? "" : ", and ") + more; };
  if (properties == 1 && count.hold == 1) {
    add("the one property that was judged holds");
  } else if (properties > 0 && properties == count.hold) {
    add(fmt::format("all {} properties that were judged hold", properties));
  } else if (properties > 0) {
    add(fmt::format("{} of {} properties {}", count.hold, properties, count.hold == 1 ? "holds" : "hold"));
  }
  if (count.fail_as_expected > 0)
    add(fmt::format("{} {} as the scene expects", count.fail_as_expected,
                    count.fail_as_expected == 1 ? "fails" : "fail"));
  if (expectations == 1) {
    add(fmt::format("the one expectation of the scene is {}", count.met == 1 ? "met" : "not met"));
  } else if (expectations > 1) {
    add(count.unmet == 0 ? fmt::format("all {} expectations of the scene are met", expectations)
                         : fmt::format("{} of {} expectations of the scene {} met", count.met, expectations,
                                       count.met == 1 ? "is" : "are"));
  }
  return words;
}

// Of somebody else's.
std::string subject_of(const Results& results) {
  if (results.command == "check_state") return "cutproof judged the state " + results.scene;
  if (results.command == "kick") return "cutproof judged the kicks of " + results.scene;
  if (results.command == "relate") return "cutproof judged whether these correspond: " + results.scene;
  return "cutproof judged the run " + results.scene;
}

std::string of_what_was_judged(const Results& results) {
  const std::string scene = results.scene.empty() ? "a scene without a name" : "scene " + results.scene;
  if (results.command == "preview") return "This is " + scene + " before it runs: the body, and the way of the blade.";
  const std::string subject =
      results.is_foreign()       ? subject_of(results)
      : results.command == "run" ? fmt::format("cutproof ran {} on backend {}", scene, results.backend)
      : results.command == "check"
          ? fmt::format("cutproof judged a recording of {}, simulated by backend {}", scene, results.backend)
          : fmt::format("This is a recording of {}, simulated by backend {}", scene, results.backend);
  if (!results.checked) return subject + ". Nothing was judged.";
  const auto failing =
      std::count_if(results.rows.begin(), results.rows.end(), [](const PropertyRow& row) { return row.failed > 0; });
  const auto first = std::find_if(results.findings.begin(), results.findings.end(),
                                  [](const Finding& finding) { return !finding.is_expected; });
  if (failing == 0 && !results.holds) return subject + ". It does not hold: nothing was judged, or not all of it.";
  std::string sentence = subject + ": " + count_in_words(results.rows);
  if (failing == 0)
    return sentence +
           fmt::format(", in {} {}.", io::grouped(results.verdicts), results.verdicts == 1 ? "verdict" : "verdicts");
  if (first == results.findings.end()) return sentence + ".";
  const std::string stage = results.is_foreign() ? "" : fmt::format(" after {}", name_of(first->stage));
  if (results.command == "check_state") return sentence + fmt::format("; '{}' fails.", first->property);
  return sentence + fmt::format("; '{}' fails{} in frame {}{}.", first->property, failing > 1 ? " first," : "",
                                first->frame, stage);
}

}  // namespace

std::string summary_sentence(const Results& results) {
  std::string sentence = of_what_was_judged(results);
  if (!results.pieces.empty()) sentence += " " + results.pieces;
  return results.left_stages.empty() ? sentence : sentence + " " + left_in_words(results.left_stages);
}

}  // namespace cutproof::report
