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
#include "harness/promises.h"
#include "harness/property_summary.h"
#include "model/backend.h"
#include "model/verdict.h"
#include "oracles/comparison/stage_comparison.h"
#include "oracles/iterates/probe.h"
#include "property_tests/cases.h"
#include "property_tests/coverage.h"
#include "property_tests/coverage_classes.h"

namespace cutproof::property_tests {

inline constexpr auto kCoverageClassNames = [] {
  std::array<const char*, kCoverageClasses.size()> names = {};
  for (std::size_t k = 0; k < names.size(); ++k) names[k] = kCoverageClasses[k].name;
  return names;
}();
inline constexpr std::size_t kCoverageClassCount = kCoverageClassNames.size();
using CaseCoverage = Coverage<kCoverageClassNames>;
// Required number of cases in a class, at least one; 0: none is required. `move`: whether the bodies move.
int64_t least_count(const CoverageClass& wanted, int64_t cases, bool move);

// Steps of moving bodies beside the reference's.
struct StepsCompared {
  int64_t steps = 0;
  int64_t particles = 0, undecidable = 0;  // of all steps; rounding carries the latter far: they are not measured
  double greatest = 0;                     // distance of positions [h]
  void add(const oracles::StageDifference& step);
  void join(const StepsCompared& other);
};

struct Judgement {
  CaseCoverage coverage;  // 1: the class occurred
  StepsCompared compared;
  harness::PropertySummaries properties;
  harness::StagesRun stages;
  int64_t verdicts = 0;            // how many were asked for
  std::optional<Verdict> failure;  // the first that does not hold
  bool refused = false;            // by the backend, so nothing was judged
  double reference_seconds = 0;    // that the reference took for its stages
};

// A backend's run of one case, and its violations of the contract.
struct CaseRun {
  harness::Trace trace;
  harness::Promises promises = harness::kPromisesOfRules;
  bool has_expanded = false;       // before the first state: an expansion has changed clusters
  std::optional<Verdict> failure;  // of the contract
  // Shown iterates of one step of a moving body, drawn at random.
  int64_t probed = -1;  // which moment of the trace; -1: none
  oracles::ShownStep iterates;
};

// Loads all cases at once and runs them to their ends, stage by stage as far as the backend can.
std::vector<CaseRun> run_cases(Backend& backend, const std::vector<Instance>& loaded);

// Judges the run of one case, with the promises of its rules, and compares every stage with the reference's answer to
// the same state (oracles/comparison/stage_comparison.h). The step is compared only for a body that moves. `thorough`:
// with CGAL's geometric check of every skin.
Judgement judge_case(const Case& c, const Instance& loaded, const CaseRun& run, const std::string& backend,
                     bool thorough);

// Both, for one case alone.
Judgement dissect(Backend& backend, const Case& c, bool thorough);

// One line for a person.
std::string describe(const Verdict& verdict);

}  // namespace cutproof::property_tests
