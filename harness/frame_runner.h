// Runs the frames of a backend, whatever spans it can run, and shows every state to those who look on.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "harness/moments.h"
#include "model/backend.h"

namespace cutproof::harness {

// A span of a frame and who runs it.
struct PlannedSpan {
  Span span;
  bool by_backend = true;
  friend bool operator==(const PlannedSpan&, const PlannedSpan&) = default;
};
// Divides `span` into what the backend says it can run; stages that it cannot run are left to the reference. Of all
// ways the one in which the backend runs the most stages, and of these the one with the most pieces (`finest`), or the
// fewest.
std::vector<PlannedSpan> plan_spans(const Backend& backend, Span span, bool finest);
// By stage: whether the reference will run it in the frames of this backend.
std::array<bool, 6> left_to_reference(const Backend& backend);

// One load of one or more bodies.
class FrameRunner {
 public:
  // Loads. Keeps the reference: the backend must outlive this, and nobody else may use it meanwhile. Throws what
  // loading throws.
  FrameRunner(Backend& backend, std::vector<Setup> setups, const std::vector<State>& states);
  ~FrameRunner();

  // The present state of each body: what the backend has made of it; one in single precision has rounded it.
  const std::vector<Snapshot>& states() const { return present_; }
  bool is_over() const;  // every body's schedule is

  // The stages of `span`, which must be those that come next. With an observer in as many pieces as can be, and it sees
  // a moment of each body after each piece in which a stage was due for any, and at the end of a frame. Without one in
  // as few as can be, and states() is brought up to date at their end.
  void run(Span span, const Observer& observe);
  // By stage: whether any body launched it in the last call of run() or run_frame().
  const std::array<bool, 6>& ran() const { return frame_.ran; }
  // The same for a frame.
  FrameResult run_frame(const Observer& observe);

  // The same from the backend once more.
  std::vector<State> snapshot() const { return snapshot_of(std::vector<bool>(setups_.size(), true)); }
  // Looks once more at bodies whose schedule may have been over before others'.
  void look_again();
  // What the backend did that its contract does not allow, seen on the way: stages that ran undue, or did not run; a
  // body that changed after its schedule was over. Empties the list.
  std::vector<Verdict> take_broken_contracts();

 private:
  SpanReport run_piece(const PlannedSpan& piece);
  void hand_over(bool to_backend);
  std::vector<State> snapshot_of(const std::vector<bool>& wanted) const;

  Backend& backend_;
  std::unique_ptr<Backend> reference_;  // made when the first stage is left to it
  bool at_backend_ = true;              // who has the present state
  std::vector<Setup> setups_;
  std::vector<Snapshot> present_;
  FrameResult frame_;
  std::vector<Verdict> broken_;
};

// Runs all frames to their end and keeps what was seen.
struct Traces {
  std::vector<Trace> of_body;
  std::vector<Verdict> broken_contracts;
};
Traces run_to_the_end(Backend& backend, std::vector<Setup> setups, const std::vector<State>& states);

}  // namespace cutproof::harness
