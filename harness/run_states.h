// A run of another simulator as the states of one body, frame by frame in any order, for pages.
#pragma once
#include <functional>
#include <optional>
#include <vector>

#include "harness/foreign_run.h"
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::harness {

// Spacing of particles where none is given [m]: the median edge, or the median distance to the nearest particle.
double plausible_spacing(const Body& body);

class RunStates {
 public:
  // `open`: opens the run at its start, again after a step back. `judged`: the results of the run.
  RunStates(std::function<io::RunSegments()> open, const JudgedRun& judged);

  // A bare graph of as many particles as the run ends with, which rest where the first frame has them (NaN: nowhere
  // yet), with the edges of its tissue as far as these are given.
  const Setup& setup() const { return setup_; }
  // After a frame: positions, what is there, what has gone since the frame before, coupling groups as clusters, and the
  // skin, whose vertices have no owners. Valid until the next call. Throws InputError as RunFrames does, and if the
  // run has become shorter.
  const State& after(int64_t frame);
  // What the blade has swept on the way to the frame that was asked for last, as quads of four corners; and its time.
  const std::vector<Vec3>& swept() const { return swept_; }
  std::optional<double> time() const { return time_; }

 private:
  void rewind();
  void make_body();
  void take();
  void take_coupling();

  std::function<io::RunSegments()> open_;
  int32_t particles_;
  std::optional<RunFrames> frames_;
  int64_t at_ = -1;  // frame
  Setup setup_;
  State state_;
  std::vector<Vec3> swept_;
  std::optional<double> time_;
};

// Which piece each particle is in, of all frames of a run, in little memory.
class PiecesOverTime {
 public:
  // Of the next frame: as oracles::RunJudge gives them. Particles only become more.
  void add(const std::vector<int32_t>& piece);
  // After that frame, -1 of particles that are not there yet; `particles`: how many.
  const std::vector<int32_t>& after(int64_t frame, int32_t particles);

 private:
  struct Change {
    int32_t particle, piece;
  };
  std::vector<std::vector<Change>> changes_;  // by frame
  std::vector<int32_t> now_, shown_;
  int64_t shown_frame_ = -1;
};

}  // namespace cutproof::harness
