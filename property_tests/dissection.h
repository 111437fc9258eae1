// One random dissection, run stage by stage on a backend and judged after each of them.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "harness/moments.h"
#include "model/backend.h"
#include "model/verdict.h"
#include "oracles/comparison/stage_comparison.h"
#include "property_tests/cases.h"
#include "property_tests/coverage.h"

namespace cutproof::property_tests {

// What happened in a case.
inline constexpr std::array<const char*, 23> kCoverageClassNames = {
    "no particles",
    "one particle",
    "several components",  // already before the first cut
    "boxes",
    "sampled clusters",
    "foreign clusters",
    "removal",  // a cut took particles out
    "miss",     // a frame with the blade down removed nothing
    "pen up",
    "retraced stroke",
    "zero length stroke",
    "blade of thickness 0",
    "split",  // a split made more clusters
    "vanished cluster",
    "debris",
    "separation",  // G has more components than before a cut
    "merge",
    "expansion",
    "published merge",
    "published expansion",
    "uncoupled without promise",  // connected tissue is, where no rule promises otherwise
    "cavity",                     // the skin has an inner shell
    "consumed body",              // it is cut away entirely
};
inline constexpr std::size_t kCoverageClassCount = kCoverageClassNames.size();
using CaseCoverage = Coverage<kCoverageClassNames>;

// Steps of moving bodies beside the reference's.
struct StepsCompared {
  int64_t steps = 0;
  int64_t particles = 0, undecidable = 0;  // of all steps; rounding decides where the latter go: they are not measured
  double greatest = 0;                     // distance of positions [h]
  void add(const oracles::StageDifference& step);
  void join(const StepsCompared& other);
};

struct Judgement {
  CaseCoverage coverage;  // 1 for what happened
  StepsCompared compared;
  int64_t verdicts = 0;            // how many were asked for
  std::optional<Verdict> failure;  // the first that does not hold
};

// What a backend made of one case: the run, and what of the contract it broke on the way.
struct CaseRun {
  harness::Trace trace;
  bool has_expanded = false;       // before the first state: an expansion has changed clusters
  std::optional<Verdict> failure;  // of the contract
};

// Loads all cases at once and runs them to their ends, stage by stage as far as the backend can.
std::vector<CaseRun> run_cases(Backend& backend, const std::vector<Instance>& loaded);

// Has the run of one case judged, with the promises of its rules; and compares every stage with what the reference
// makes of the same state (oracles/comparison/stage_comparison.h), the step only of a body that moves.
// `thorough`: with CGAL's geometric check of every skin.
Judgement judge_case(const Case& c, const Instance& loaded, const CaseRun& run, const std::string& backend,
                     bool thorough);

// Both, for one case alone.
Judgement dissect(Backend& backend, const Case& c, bool thorough);

// One line for a person.
std::string describe(const Verdict& verdict);

}  // namespace cutproof::property_tests
