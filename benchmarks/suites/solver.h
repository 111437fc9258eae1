// `cutproof bench solver`: iterations of the step against its error, plain and accelerated (method.md §11).
#pragma once
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/provenance.h"
#include "benchmarks/solver.h"
#include "benchmarks/times.h"

namespace cutproof::benchmarks {

struct SolverOptions {
  std::string backend = harness::kReferenceName;
  std::vector<double> stiffness = {1e4, 1e5, 1e6};  // [1/s²]
  std::vector<int32_t> substeps = {1, 4};
  std::vector<int32_t> iterations = {1, 2, 4, 8, 12, 16, 24, 32, 48, 64, 96};  // ascending
  std::optional<int64_t> particles;  // of the second body; 0: none; absent: by backend
  double tolerance = 1e-2;           // [h]
  int32_t samples = 9;
};

// Rows by iterations: those that were asked for, and the least that comes within the tolerance.
struct SolverCurve {
  struct Row {
    SolverError error;
    Times times;
  };
  Acceleration acceleration = Acceleration::none;
  std::map<int32_t, Row> rows;
  std::optional<int32_t> least;
};

// One body, one stiffness, one number of substeps.
struct SolverEntry {
  std::string scene;
  int64_t particles = 0, clusters = 0;
  double stiffness = 0;  // [1/s²]
  int32_t substeps = 0;
  double substep_seconds = 0;
  bool converged = false;  // a converged solution was found; else errors are from the last alternation
  std::vector<SolverCurve> curves;
};

struct SolverResult {
  Provenance provenance;
  std::string precision;
  double tolerance = 0;  // [h]
  int32_t samples = 0;
  std::vector<SolverEntry> scenes;
  bool complete = false;
};
nlohmann::json to_json(const SolverResult& result);

SolverResult run_solver(const SolverOptions& options, const Progress<SolverResult>& progress);

}  // namespace cutproof::benchmarks
