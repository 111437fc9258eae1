// The judgement of an oracle on a state (docs/reference/oracles.md). A wrong simulation is a failing verdict, never an
// exception.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "model/stage.h"

namespace cutproof {

// A torn skin has a defect at every second triangle; a few of them suffice.
inline constexpr int32_t kMostWitnessTriangles = 100;

// The smallest thing that shows the failure.
struct Witness {
  std::vector<int32_t> clusters;   // numbers of the clusters concerned
  std::vector<int32_t> particles;  // the particles concerned
  std::vector<int32_t> path;       // particles along a path of G that shows it, where there is one
  std::string text;                // one sentence for a person
  // Triangles of the skin that show it, by their place in it, at most kMostWitnessTriangles.
  std::vector<int32_t> triangles = {};
  // Of a run: the first and the last frame of each range in which the property fails, ascending.
  std::vector<int64_t> frames = {};

  friend bool operator==(const Witness&, const Witness&) = default;
};

// Wall time [s] of judging. Times do not count in comparisons of verdicts: any two are equal.
struct JudgingTime {
  double seconds = 0;
  friend bool operator==(JudgingTime, JudgingTime) { return true; }
};

struct Verdict {
  std::string property;       // "cluster connectivity", "coverage", …: the names of docs/reference/oracles.md
  Stage stage = Stage::skin;  // after which stage the state was judged
  std::string backend;
  int64_t frame = 0;
  int32_t body = 0;
  bool holds = true;
  double measured = 0;       // in `unit`
  double bound = 0;          // in `unit`; holds means measured <= bound unless the property says otherwise
  std::string unit;          // "1" for counts and ratios
  std::string bound_source;  // where the bound comes from, e.g. "method.md §2, I1"
  int64_t checked = 0;       // how many things were looked at; 0 means the property was vacuous here
  std::string vacuous = {};  // why there was nothing to look at, e.g. "no blade"; empty if there was
  int64_t inconclusive = 0;  // how many things may be wrong and were not found to be: they count as right, and here
  Witness witness;           // empty if it holds
  JudgingTime took = {};     // 0 where it was not measured, or where an earlier verdict is repeated

  friend bool operator==(const Verdict&, const Verdict&) = default;
};

// Beginning of the witness of a verdict that could not be made because its input is broken. Such a verdict fails; its
// measured value and bound mean nothing.
inline constexpr std::string_view kNotJudged = "could not be judged";
inline bool could_be_judged(std::string_view witness) { return !witness.starts_with(kNotJudged); }
inline bool was_judged(const Verdict& verdict) { return verdict.holds || could_be_judged(verdict.witness.text); }

}  // namespace cutproof
