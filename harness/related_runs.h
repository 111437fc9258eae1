// Runs that must correspond, read side by side (docs/reference/relate.md).
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "harness/foreign_judge.h"
#include "model/io/run_segments.h"
#include "model/verdict.h"
#include "oracles/runs/run_relation.h"

namespace cutproof::harness {

struct RelatedFiles {
  std::string first;
  std::vector<std::string> others;  // one; of `split` each body alone; of `refine` two or more
  std::vector<std::string> noise;   // runs of the first that were disturbed in each frame
  bool bits = false;                // the bits must be the same, too
};

struct JudgedRelation {
  std::vector<Verdict> verdicts;
  std::vector<NotJudged> not_judged;
  std::vector<std::string> notes;
  int64_t frames = 0, particles = 0;
  std::vector<int32_t> permutation;  // of each particle of the second run, which of the first it is; empty: the same
  oracles::RelationSharpness sharpest;
  std::vector<double> differences;  // of `refine`: of each run from the next [m]
  bool holds() const;
};

// Throws InputError if a file cannot be read, or lacks an array that a map needs.
JudgedRelation judge_relation(const oracles::RunMap& map, const RelatedFiles& files,
                              const std::function<void(int64_t frame)>& frame_done = {});
// Relates two runs in memory, by any map but `split` and `refine`. `noise`: runs of the first that were disturbed.
JudgedRelation judge_relation(const oracles::RunMap& map, io::RunSegments first, io::RunSegments second,
                              std::vector<io::RunSegments> noise = {});

}  // namespace cutproof::harness
