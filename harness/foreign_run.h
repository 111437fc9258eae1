// A run of another simulator, from named arrays, segment by segment (docs/reference/run.md).
#pragma once
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "harness/foreign_judge.h"
#include "harness/run_frames.h"
#include "model/io/run_segments.h"
#include "oracles/runs/run_judge.h"

namespace cutproof::harness {

struct JudgedRun {
  std::vector<Verdict> verdicts;
  std::vector<NotJudged> not_judged;
  std::vector<std::string> notes;
  oracles::RunPieces pieces;
  int64_t frames = 0, segments = 0;
  int64_t particles_at_start = 0, particles_at_end = 0;
  std::set<std::string, std::less<>> given;  // names of the arrays that are there
  bool single_precision = false;
  // Also false if nothing but the form of the run was judged.
  bool holds() const;
};

// Reads and judges one segment after the other; `frame_done` is called after each frame. Shapes, types and names are
// the file's: where one is wrong an InputError says so. Values are the run's: where one is wrong it does not hold.
JudgedRun judge_run(io::RunSegments segments,
                    const std::function<void(int64_t frame, const oracles::RunJudge&)>& frame_done = {});

}  // namespace cutproof::harness
