// Judges a run of anybody's simulator, frame by frame as it is read: what must hold of every one, whatever its method
// (tolerances.md, Runs; oracles.md, A run of any simulator).
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "model/verdict.h"
#include "oracles/runs/run.h"

namespace cutproof::oracles {

// How the tissue fell apart, by the blade's sweep alone.
struct RunPieces {
  bool of_cells = false;                                // units of tissue are cells; else particles
  int64_t units = 0, at_first = 0;                      // pieces before anything was cut
  int64_t pieces = 0, at_most = 0;                      // that surely are, and that may be
  std::vector<int64_t> sizes;                           // of the sure ones, descending
  int64_t surely_cut = 0, perhaps_cut = 0, beside = 0;  // edges of tissue; units that may be on either side
  int64_t ever_perhaps_cut = 0;                         // edges of which it was open in a frame whether they are cut
  int64_t coupled = 0;                                  // components of the coupling
  int64_t last_cut = -1;                                // the last frame that surely parted tissue; -1: none
};

class RunJudge {
 public:
  explicit RunJudge(RunHeader header);
  ~RunJudge();

  // Before the first frame for which it holds. Throws nothing: a coupling that cannot be is a verdict.
  void couple(RunCoupling coupling);
  void weigh(std::vector<double> mass);  // [n] [kg]
  void see(const RunFrame& frame);
  void finish();

  // Of each particle the piece that it surely is in by now, told by the lowest particle in it; -1 of what is gone or no
  // tissue. Empty where the run has no tissue.
  // `touched_is_cut`: the same of the most pieces that there may be.
  std::vector<int32_t> piece_of_particles(bool touched_is_cut = false) const;

  // After finish(): one of each property that was asked, its first failure or what came nearest to its bound; and why
  // the others were not.
  std::vector<Verdict> verdicts() const;
  struct NotAsked {
    std::string property, why;
  };
  std::vector<NotAsked> not_asked() const;
  std::vector<std::string> notes() const;
  RunPieces pieces() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> self_;
};

}  // namespace cutproof::oracles
