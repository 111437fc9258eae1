// Relations between runs of one backend (oracles/relations/), asked in a sample of the frames of a run. A second
// instance of the backend runs them, from the states in which those frames began.
#pragma once
#include <cstdint>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include "harness/moments.h"
#include "model/backend.h"
#include "model/verdict.h"

namespace cutproof::harness {

// Each relation costs further runs, so only some frames are judged. The rule is fixed, so that a run can be judged
// again:
// - frames 0, 8, 16, …;
// - the first frame after a cut, that is one that removes nothing after one that did;
// - a frame that begins with more components of tissue than the one before it: pieces that are new.
inline constexpr int64_t kFramesBetweenSamples = 8;

class RelationSample {
 public:
  // `second`: another instance of the backend that is judged. `setup` must outlive this.
  RelationSample(const Setup& setup, std::unique_ptr<Backend> second);
  ~RelationSample();

  // Every moment of one body in order, whoever ran it. At the end of such a frame, its relations begin to run in a
  // thread of their own. The next call throws the exceptions of that thread.
  void see(const Moment& moment);
  // Until what was asked last is answered.
  void wait();
  // Verdicts of all judged frames but the last, and of the last one after wait().
  std::vector<Verdict> take_verdicts();

  // Number of judged frames, and relations that this backend cannot run: one sentence each.
  std::vector<std::string> notes() const;

 private:
  std::vector<Verdict> ask(const State& begin, int64_t turn);

  const Setup& setup_;
  const Setup frictionless_;  // friction has no energy, so it is left out where energy is asked about
  std::unique_ptr<Backend> second_;
  Snapshot begin_;               // of the frame in progress; null before its step has been seen
  int32_t components_ = 0;       // as it began; 0: not counted
  bool is_separated_ = false;    // it began with more of them than the frame before
  bool removed_before_ = false;  // the frame before it removed something
  int64_t frames_ = 0, asked_ = 0;
  std::vector<Verdict> verdicts_;
  std::future<std::vector<Verdict>> asking_;  // the frame that was asked last; before all that it needs is gone
};

}  // namespace cutproof::harness
