// What a run or a check came to, from its document (json.md), as a page shows it.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/stage.h"

namespace cutproof::report {

// A verdict that fails.
struct Finding {
  std::string property;
  Stage stage = Stage::skin;
  int64_t frame = 0;
  std::string measured, bound, unit;  // figures as text; the unit is empty for counts and ratios
  std::optional<double> of_bound;     // measured / bound; nothing where the bound is 0 or one of them is not finite
  std::string bound_source;
  std::string text;  // the witness in words
  std::vector<int32_t> clusters, particles, path, triangles;
  std::vector<int32_t> frames;  // of a run: first and last of each range in which it fails
  bool is_expected = false;
};

// All verdicts of one property after one stage.
struct PropertyRow {
  std::string property;
  Stage stage = Stage::skin;
  std::string unit, bound_source;
  int64_t judged = 0;  // verdicts that looked at something, or fail
  int64_t checked = 0, failed = 0, expected = 0, inconclusive = 0;
  std::string vacuous;  // why nothing was looked at; only where judged is 0
  // Of the verdict that comes nearest to its bound, or of the first that fails.
  int64_t frame = 0;
  std::string measured, bound;
  std::optional<double> of_bound;
};

// Values by frame, for a plot. What is not there in a frame is nothing.
struct Series {
  std::string name;
  std::vector<std::optional<double>> values;
};

struct Results {
  // "run", "check"; "recording": there are no results; of somebody else's simulator "check_run", "check_state", "kick",
  // "relate"; "preview": nothing has run
  std::string command;
  std::string version;  // of the program that judged
  std::string scene, backend;
  std::optional<int64_t> particles;
  bool checked = false;  // whether anything was judged
  bool holds = false;
  int64_t verdicts = 0;
  std::vector<PropertyRow> rows;  // those that fail first, then those that fail as expected, then by how near to the
                                  // bound, then those that had nothing to look at
  std::vector<Finding> findings;  // by frame and stage, those that were expected at the end; at most kMostFindings
  int64_t findings_left_out = 0;
  // Of somebody else's: pieces in words; and the frame in which most is seen if all holds, or -1: the last that parted
  // tissue, the kick, the sharpest comparison.
  std::string pieces;
  int64_t opens = -1;
  bool is_foreign() const { return command != "run" && command != "check" && command != "recording"; }
  std::vector<std::string> notes, not_reached;
  std::vector<std::string> left_stages;  // that the reference ran for the backend: not judged
  std::vector<Series> seconds;           // of each stage that was timed [s]
  std::vector<Series> errors;            // [h]
};
inline constexpr std::size_t kMostFindings = 300;      // of all properties, and
inline constexpr int64_t kMostFindingsOfOne = 30;      // of one property after one stage
inline constexpr std::size_t kMostWitnesses = 20'000;  // particles, or clusters, of one finding

// `file` names the document in errors. Throws InputError for what is no document of `run` or `check`, naming the field.
// Of somebody else's the scene is the file.
Results results_of(const nlohmann::json& document, const std::string& file);
Results read_results(const std::string& file);

// What happened, in a sentence or two for a person.
std::string summary_sentence(const Results& results);

}  // namespace cutproof::report
