// The contract of a dissection backend: the one interface in this project (architecture.md, Backends).
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "model/setup.h"
#include "model/stage.h"
#include "model/state.h"

namespace cutproof {

// Results of the last call of run().
struct SpanReport {
  std::array<bool, 6> ran = {};        // by stage: did any body launch it?
  double total_seconds = 0;            // wall time of the whole span [s]
  std::array<double, 6> seconds = {};  // by stage: wall time [s]; 0 where the span ran as one piece
};

// A backend refuses its input and gives a reason. Nothing is judged, and nothing has passed.
class Refused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A member may throw MachineError or std::bad_alloc when the machine fails. After an exception a backend can only be
// destroyed or loaded again.
class Backend {
 public:
  virtual ~Backend() = default;

  // "reference", "host", "gpu", or the name of a plugin.
  virtual std::string name() const = 0;

  // Precision of the backend's arithmetic, also that of its states (State::precision).
  virtual Precision precision() const { return Precision::binary64; }

  // Which contiguous runs of stages the backend can execute: every one, whole frames only, or a single stage. The
  // reference runs the other stages, for which the backend is not judged (harness/frame_runner.h).
  virtual bool can_run(Span span) const = 0;

  // Whether it knows Setup::withheld_iterations. Any other backend shows iterates substep by substep, each one loaded.
  virtual bool shows_iterates() const { return false; }

  // Promises of the backend, as words of harness/promises.h; "*": all promises of the rules of a setup.
  virtual std::string promises() const { return "*"; }

  // Takes one or more bodies, each with its own parameters. Changes nothing in them: a state in the middle of a frame
  // may be loaded. Requires setups.size() == states.size(). Throws std::invalid_argument if a state does not fit its
  // setup. Throws Refused for unsupported inputs, such as bodies without a grid.
  virtual void load(std::vector<Setup> setups, std::vector<State> states) = 0;

  // Executes the stages of `span` on every body whose schedule is not over. A stage that a scene does not need is not
  // launched: without a blade or another cause, no detect; without removals, no split, merge, expand or new cells of
  // skin. A span that ends with skin ends the frame: numbers are compacted and state.frame counts up. A frame run whole
  // and a frame run span by span give the same state, bit for bit.
  virtual void run(Span span) = 0;

  // A copy of every body's present state.
  virtual std::vector<State> snapshot() const = 0;
  // The same, but only of the bodies that are wanted, which can cost less; the others' states are empty. Requires one
  // entry per body.
  virtual std::vector<State> snapshot_of(const std::vector<bool>& wanted) const;

  virtual SpanReport report() const = 0;
};

inline std::vector<State> Backend::snapshot_of(const std::vector<bool>& wanted) const {
  std::vector<State> states = snapshot();
  for (std::size_t b = 0; b < states.size(); ++b) {
    if (!wanted.at(b)) states[b] = State{};
  }
  return states;
}

// A state as this backend will know it once it is loaded.
inline State in_arithmetic_of(const Backend& backend, State state) {
  state.precision = std::max(state.precision, backend.precision());
  return state;
}

}  // namespace cutproof
