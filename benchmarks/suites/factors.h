// `cutproof bench factors`: after a cut, is a factor of the substep's system updated or made anew?
// (accuracy.md, The factor after a cut)
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "benchmarks/factorise.h"
#include "benchmarks/provenance.h"
#include "benchmarks/times.h"

namespace cutproof::benchmarks {

struct FactorsOptions {
  std::vector<int32_t> sides = {10, 20, 30, 40, 50}, fine_sides = {20, 54};  // particles along a cube
  int64_t repeats = 5;
  uint64_t seed = 1;  // of right-hand sides and velocities
};

// One cut, one way.
struct FactorsRow {
  std::string cut;  // how much of it
  int64_t removed = 0, rows = 0, changed_rows = 0, new_rows = 0;
  Way way = Way::analyse;
  Times seconds, solve_seconds;
  int64_t entries = 0;  // of the factor
  double residual = 0, residual_bound = 0;
  bool within() const { return residual <= residual_bound; }
};

struct FactorsScene {
  std::string scene;
  int64_t particles = 0, clusters = 0, memberships = 0;
  std::vector<FactorsRow> rows;
  // A whole converged substep of the cut body, when everything in it moves.
  double substep_seconds = 0;
  int alternations = 0;
  bool converged = false;
};

struct FactorsResult {
  Provenance provenance;
  int64_t repeats = 0;
  uint64_t seed = 0;
  std::vector<FactorsScene> scenes;
  bool complete = false;
  bool holds() const;  // every residual is within its bound
};
nlohmann::json to_json(const FactorsResult& result);

FactorsResult run_factors(const FactorsOptions& options, const Progress<FactorsResult>& progress);

}  // namespace cutproof::benchmarks
