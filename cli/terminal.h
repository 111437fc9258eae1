// What a person sees: progress on a terminal (silent when piped) and the table of verdicts.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/scene_judge.h"

namespace cutproof::cli {

class Progress {
 public:
  // Of `total` things of this name; 0: nobody knows how many there will be.
  Progress(std::string thing, int64_t total);
  ~Progress();
  void show(int64_t done, const std::string& what);

 private:
  void clear();
  std::string thing_;
  int64_t total_;
  bool terminal_;
  std::size_t width_ = 0;
  double last_ = -1;
};

// Prints io::filled.
void print_filled(const std::string& text, const nlohmann::json& values);

// One row per property and stage: how often judged, how often it failed, the worst figure beside its bound, and the
// greatest share of a bound; then the
// first failures with their witnesses, and one line that says whether everything holds.
void print_verdicts(const harness::SceneJudge& judge);

// The same of single verdicts, of no run: one row each, then every failure with its witness.
void print_single_verdicts(const std::vector<Verdict>& verdicts);
// The last line of those, after all notes.
void print_whether_all_hold(const std::vector<Verdict>& verdicts);

}  // namespace cutproof::cli
