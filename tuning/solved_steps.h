// A simulator that solves substeps without iteration: each ends at its fixed point
// (oracles/comparison/reference_solution.h). All other stages are the reference's.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "model/backend.h"

namespace cutproof::tuning {

class SolvedSteps final : public Backend {
 public:
  SolvedSteps();
  std::string name() const override { return "reference, each substep solved"; }
  // Whole frames; the implicit solver only (std::invalid_argument).
  bool can_run(Span span) const override;
  void load(std::vector<Setup> setups, std::vector<State> states) override;
  void run(Span span) override;
  std::vector<State> snapshot() const override { return states_; }
  SpanReport report() const override { return {}; }

  struct Count {
    int64_t substeps = 0;
    int64_t by_iteration = 0;  // by plain iterations, because every other method failed
    int64_t unsolved = 0;      // not even by these
  };
  const Count& count() const { return count_; }  // since construction

 private:
  void step(const Setup& setup, State& state);

  std::unique_ptr<Backend> reference_;
  std::vector<Setup> setups_;
  std::vector<State> states_;
  Count count_;
};

}  // namespace cutproof::tuning
