// The run of a scene as a run of any simulator: the same judge, the same properties (oracles.md, A run of any
// simulator).
#pragma once
#include <optional>
#include <vector>

#include "model/io/state_segments.h"
#include "oracles/runs/run_judge.h"

namespace cutproof::harness {

class SceneAsRun {
 public:
  // `setup` must outlive this. `initial`: the state as loaded.
  SceneAsRun(const Setup& setup, const State& initial);

  // The end of each frame, in order; well formed.
  void see(const State& state);
  // Of every property that was asked; once, after the last state.
  std::vector<Verdict> verdicts();

 private:
  io::StateSegments segments_;
  std::optional<oracles::RunJudge> judge_;
  int64_t frame_ = -1;  // of the scene; the state as loaded comes before its frame 0
};

}  // namespace cutproof::harness
