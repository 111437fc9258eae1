// A run as observers see it: a sequence of moments. A moment is the state of one body before and after a span of
// stages, run by the backend or the reference, live or recorded.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "model/setup.h"
#include "model/stage.h"
#include "model/state.h"
#include "model/verdict.h"

namespace cutproof::harness {

// A moment begins with the last state of the previous moment; loading into single precision may have rounded it.
//
// An immutable state; the pointer keeps it alive.
using Snapshot = std::shared_ptr<const State>;

struct Moment {
  int32_t body = 0;
  Span span;
  Snapshot before, after;
  // False: the backend cannot run these stages. The reference ran them, and they are not judged.
  bool by_backend = true;
};
using Observer = std::function<void(const Moment&)>;

// One body's run: the state as loaded, and the moments.
struct Trace {
  Snapshot initial;
  std::vector<Moment> moments;
};

// The stages of a span that model/backend.h has a body run, given the states before and after it (`after` is asked only
// for what was removed in it). The skin stage ends the frame whether a skin is wanted or not.
std::array<bool, 6> due_stages(const Setup& setup, const State& before, Span span, const State& after);

// Runs of due stages: for each stage, the number of moments in which the backend ran it, and in which the reference ran
// it for the backend.
struct StagesRun {
  std::array<int64_t, 6> by_backend = {}, by_reference = {};

  void see(const Setup& setup, const Moment& moment);
  void join(const StagesRun& other);
  bool any_by_backend() const;
  // The backend could not run it, so the reference did.
  bool is_left(Stage stage) const;
  // Names of those, in order.
  std::vector<std::string> left() const;
};

// A failing verdict: something that model/backend.h promises does not hold.
Verdict broken_contract(std::string what, Stage stage, int64_t frame, int32_t body = 0);

// Stages that one frame ran, over all bodies.
struct FrameResult {
  int64_t frame = 0;
  std::array<bool, 6> ran = {};        // by stage
  double total_seconds = 0;            // 0: not timed
  std::array<double, 6> seconds = {};  // by stage; 0 where several ran as one piece
  int64_t removed = 0, debris = 0, alive = 0, clusters = 0, triangles = 0;
};
// Adds the counts of a body's state at the end of a frame.
void count(FrameResult& frame, const State& state);

}  // namespace cutproof::harness
