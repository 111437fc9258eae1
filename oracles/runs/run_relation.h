// Two runs of one simulator that must correspond by a map (tolerances.md, Relations between runs; oracles.md, Two
// runs). Nothing is known of the simulator. How far apart right runs may be says its own noise, or else what rounds.
#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "model/verdict.h"
#include "oracles/runs/run.h"
#include "oracles/runs/run_judge.h"
#include "oracles/runs/run_map.h"

namespace cutproof::oracles {

// One of the runs where it is.
struct RelatedRun {
  RunFrame frame;
  const RunCoupling* coupling = nullptr;  // what holds in this frame; null: none was given
  bool is_new_coupling = false;
};

// Where a comparison saw most.
struct RelationSharpness {
  int64_t frame = -1;  // the sharpest; -1: none
  double bound = 0;    // of positions there [m]
  double moved = 0;    // how far a particle has moved by then, at most [m]
};

class RunRelation {
 public:
  // `noise_runs`: how many runs of A there are that were disturbed by a unit in the last place in each frame. `bits`:
  // whether both runs must have the same bits.
  RunRelation(const RunMap& map, RunHeader a, RunHeader b, int noise_runs, bool bits);
  ~RunRelation();

  // Of each particle of B, which particle of A it is. Without it they have the same numbers. Before the first frame for
  // which it holds.
  void permute(std::vector<int32_t> permutation);
  void weigh(std::vector<double> a, std::vector<double> b);  // masses [kg]
  // `noise`: as many as there are noise runs.
  void see(const RelatedRun& a, const RelatedRun& b, std::span<const RelatedRun> noise);
  // One of the runs has ended and another has not.
  void see_end_of_some(int64_t frame);
  void finish();

  std::vector<Verdict> verdicts() const;
  std::vector<RunJudge::NotAsked> not_asked() const;
  std::vector<std::string> notes() const;
  RelationSharpness sharpest() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> self_;
};

// Three runs or more, each with more substeps than the one before, whose frames are at the same times.
class RunRefinement {
 public:
  explicit RunRefinement(std::vector<RunHeader> headers);
  void see(std::span<const RelatedRun> runs);
  // One of the runs has ended and another has not.
  void see_end_of_some(int64_t frame);
  std::vector<Verdict> verdicts() const;
  std::vector<double> differences() const { return farthest_; }  // of each run from the next, at most [m]

 private:
  void fail(std::string text);

  std::vector<RunHeader> headers_;
  std::vector<double> farthest_;
  int64_t frames_ = 0;
  double extent_ = 0;
  std::string wrong_;  // with frames or particles; empty: nothing
};

}  // namespace cutproof::oracles
