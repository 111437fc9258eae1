// Runs the frames of a backend with any set of spans, and shows every state to observers.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "harness/moments.h"
#include "model/backend.h"

namespace cutproof::harness {

// A span of a frame, and whether the backend or the reference runs it.
struct PlannedSpan {
  Span span;
  bool by_backend = true;
  friend bool operator==(const PlannedSpan&, const PlannedSpan&) = default;
};
// Divides `span` into spans that the backend can run; the reference runs the other stages. Of all divisions, the one in
// which the backend runs the most stages; of these, the one with the most pieces (`finest`), or the fewest.
std::vector<PlannedSpan> plan_spans(const Backend& backend, Span span, bool finest);
// By stage: whether the reference will run it in the frames of this backend.
std::array<bool, 6> left_to_reference(const Backend& backend);

// One batch of one or more bodies.
class FrameRunner {
 public:
  // Loads. Keeps the reference: the backend must outlive this, and has no other user meanwhile. Throws the exceptions
  // of loading.
  FrameRunner(Backend& backend, std::vector<Setup> setups, const std::vector<State>& states);
  ~FrameRunner();

  // The present state of each body, as the backend holds it; a backend in single precision has rounded it.
  const std::vector<Snapshot>& states() const { return present_; }
  bool is_over() const;  // every body's schedule is

  // Runs the stages of `span`, which must be the next ones. With an observer, the span is divided into as many pieces
  // as possible. The observer sees a moment of each body after each piece with a due stage, and at the end of a frame.
  // Without an observer, the span has as few pieces as possible, and states() is updated at the end.
  void run(Span span, const Observer& observe);
  // By stage: whether any body launched it in the last call of run() or run_frame().
  const std::array<bool, 6>& ran() const { return frame_.ran; }
  // The same for a frame.
  FrameResult run_frame(const Observer& observe);

  // Reads the states from the backend again.
  std::vector<State> snapshot() const { return snapshot_of(std::vector<bool>(setups_.size(), true)); }
  // Checks again the bodies whose schedule may have ended before others'.
  void look_again();
  // Violations of the backend's contract so far: stages that ran undue or did not run; a body that changed after the
  // end of its schedule. Empties the list.
  std::vector<Verdict> take_broken_contracts();

 private:
  SpanReport run_piece(const PlannedSpan& piece);
  void hand_over(bool to_backend);
  std::vector<State> snapshot_of(const std::vector<bool>& wanted) const;

  Backend& backend_;
  std::unique_ptr<Backend> reference_;  // made when the first stage is left to it
  bool at_backend_ = true;              // owner of the present state
  std::vector<Setup> setups_;
  std::vector<Snapshot> present_;
  FrameResult frame_;
  std::vector<Verdict> broken_;
};

// Runs all frames to their end and keeps all moments.
struct Traces {
  std::vector<Trace> of_body;
  std::vector<Verdict> broken_contracts;
};
Traces run_to_the_end(Backend& backend, std::vector<Setup> setups, const std::vector<State>& states);

}  // namespace cutproof::harness
