// Methods for the rotation of a cluster, each with its errors on every hard case and its times (method.md, Rotations).
#pragma once
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "benchmarks/rotation_methods.h"
#include "benchmarks/times.h"

namespace cutproof::benchmarks {

struct RotationCaseResult {
  std::string name;  // of the case
  fixtures::Judged judged;
};

// One method in one precision.
struct RotationResult {
  std::string method;
  Precision precision = Precision::binary32;
  bool is_default = false;
  std::vector<RotationCaseResult> cases;
  Times near, cold;        // [s] per million matrices
  double limit = 0;        // [s] per million matrices: bytes / copy bandwidth
  bool on_front = false;   // no other of its precision is at least as exact and as fast, and better in one
  fixtures::Judged all;    // sums over all cases, and the worst
  std::string worst_case;  // of its worst gap
};

struct RotationCounts {
  int64_t matrices = 2000;  // of each case
  int64_t timed = 20'000;
  int repeats = 9;
  uint64_t seed = 0;
};

struct RotationReport {
  std::vector<RotationResult> results;
  // The greatest error of the best values for comparison.
  double reference_error_single = 0, reference_error_double = 0;
  // Whether the default was measured and gave no wrong answer.
  bool default_holds() const;
};

// Called before each method of each case and before each timing: the number of cases begun, and the present work. An
// exception that it throws ends the measurement (model/stop.h).
using RotationProgress = std::function<void(int64_t cases_begun, const std::string& what)>;

// `copy_bytes_per_second`: for the limits.
RotationReport measure_rotations(const std::vector<RotationMethod>& methods, const RotationCounts& counts,
                                 double copy_bytes_per_second, const RotationProgress& progress = {});

// Marks on_front: the worst gap against the median time near the answer.
void mark_front(std::vector<RotationResult>& results);

// Greatest rotation near the answer [rad]: an ordinary substep rotates a cluster by less.
inline constexpr double kNearTurn = 0.02;

// The fields `bounds`, `cases`, `methods`, `rows` and `holds` of the document.
nlohmann::json to_json(const RotationReport& report);

}  // namespace cutproof::benchmarks
