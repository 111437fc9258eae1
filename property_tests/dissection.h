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

namespace cutproof::property_tests {

// In which campaigns a class of cases must occur. often: in at least one of ten cases that move, because faults of
// contacts show in one of hundreds of them only.
enum class Occurs { always, where_bodies_move, often_where_bodies_move };

struct CoverageClass {
  const char* name;
  Occurs occurs = Occurs::always;
};

// Coverage classes of a case.
inline constexpr std::array kCoverageClasses = {
    CoverageClass{"no particles"},
    CoverageClass{"one particle"},
    CoverageClass{"several components"},  // already before the first cut
    CoverageClass{"boxes"},
    CoverageClass{"sampled clusters"},
    CoverageClass{"foreign clusters"},
    CoverageClass{"removal"},  // a cut took particles out
    CoverageClass{"miss"},     // a frame with the blade down removed nothing
    CoverageClass{"pen up"},
    CoverageClass{"retraced stroke"},
    CoverageClass{"zero length stroke"},
    CoverageClass{"blade of thickness 0"},
    CoverageClass{"oblique blade"},  // down, and its back along no axis
    CoverageClass{"turning blade"},  // down
    CoverageClass{"split"},          // a split made more clusters
    CoverageClass{"vanished cluster"},
    CoverageClass{"debris"},
    CoverageClass{"separation"},  // G has more components than before a cut
    CoverageClass{"merge"},
    CoverageClass{"expansion"},
    CoverageClass{"published merge"},
    CoverageClass{"published expansion"},
    CoverageClass{"uncoupled without promise"},  // connected tissue is, where no rule promises otherwise
    CoverageClass{"alpha"},                      // a skin whose vertices are not halfway
    CoverageClass{"fitted skin"},                // a skin of which each vertex has a place of its own on its edge
    CoverageClass{"cavity"},                     // the skin has an inner shell
    CoverageClass{"consumed body"},              // it is cut away entirely
    // Of steps, in which something moved.
    CoverageClass{"published solver", Occurs::where_bodies_move},
    CoverageClass{"accelerated solver", Occurs::where_bodies_move},
    CoverageClass{"damped", Occurs::where_bodies_move},
    CoverageClass{"retarded", Occurs::where_bodies_move},
    CoverageClass{"small dt", Occurs::where_bodies_move},
    CoverageClass{"large dt", Occurs::where_bodies_move},
    // Something was removed.
    CoverageClass{"cut at another epsilon", Occurs::where_bodies_move},
    CoverageClass{"one end of each edge", Occurs::where_bodies_move},
    CoverageClass{"nearer end of each edge", Occurs::where_bodies_move},
    CoverageClass{"cut by strain", Occurs::where_bodies_move},
    CoverageClass{"geometric cut of what moves", Occurs::where_bodies_move},
    // Touches (touching.h).
    CoverageClass{"grip", Occurs::where_bodies_move},
    CoverageClass{"grip released", Occurs::where_bodies_move},
    CoverageClass{"grip taken over", Occurs::where_bodies_move},
    CoverageClass{"wall", Occurs::often_where_bodies_move},
    CoverageClass{"wall that is no floor", Occurs::often_where_bodies_move},
    CoverageClass{"blade face", Occurs::often_where_bodies_move},
    CoverageClass{"blade rim", Occurs::often_where_bodies_move},
    CoverageClass{"blade side", Occurs::often_where_bodies_move},
    CoverageClass{"cutting edge", Occurs::often_where_bodies_move},
    CoverageClass{"blade back", Occurs::often_where_bodies_move},
    CoverageClass{"on a border", Occurs::often_where_bodies_move},
    CoverageClass{"led round the blade", Occurs::where_bodies_move},
    CoverageClass{"blade and wall at once", Occurs::often_where_bodies_move},
    CoverageClass{"friction slides", Occurs::often_where_bodies_move},
    CoverageClass{"friction sticks", Occurs::often_where_bodies_move},
};
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
