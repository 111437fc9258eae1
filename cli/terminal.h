// What a person sees of verdicts: what fails first, then what holds, summed up.
#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/scene_judge.h"

namespace cutproof::cli {

// Says io::filled.
void say_filled(const std::string& text, const nlohmann::json& values);

// How verdicts are shown.
struct Shown {
  std::string again;  // the command that shows them again
  // A failure that the scene asks for, which counts as right.
  std::function<bool(const Verdict&)> is_expected = [](const Verdict&) { return false; };
  bool in_frames = true;  // of a run; else of no run, without stages and frames
  // Where given, which properties have a share of their bound, and how much: a verdict on a run as a whole has none.
  const harness::PropertySummaries* summaries = nullptr;
  bool in_stages = true;  // of frames that have stages
};

// What fails, by property and stage: how often, and the first of them with its frame, its figures and its witness. Then
// in words what holds, and how near to its bound the nearest came, what fails as it is expected to, what had nothing to
// look at, what is inconclusive. With --verbose a table of all rows as well: how often judged, how often it failed, the
// worst figure beside its bound, and the greatest share of a bound.
void print_verdicts(const std::vector<Verdict>& verdicts, const Shown& shown);
// The same of a run, with what was not reached, what was not promised, and the notes.
void print_verdicts(const harness::SceneJudge& judge, const std::string& again);
// "what": of what each is told, because of one reason: "Not judged (REASON): A, B".
void print_grouped(const std::string& what, const std::vector<std::pair<std::string, std::string>>& names_and_reasons);
void print_notes(const std::vector<std::string>& notes);

// Of a kernel's campaign: a row for each property, with how many of its verdicts or of the things it looked at (a
// member of PropertySummary) were judged.
void print_judged(const harness::PropertySummaries& properties, int64_t harness::PropertySummary::*judged);

// The last line. `holds`: what is said if all do.
void print_conclusion(const std::vector<Verdict>& verdicts, const Shown& shown, const char* holds);
void print_conclusion(const harness::SceneJudge& judge);

}  // namespace cutproof::cli
