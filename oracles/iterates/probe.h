// The choice of iterates that a backend shows of a frame, and their judge (tolerances.md, Iterate by iterate).
#pragma once
#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "model/backend.h"
#include "model/verdict.h"

namespace cutproof::oracles {

// Of a frame of S substeps with K iterations: all its iterates, or, by a seed, the prediction of one substep, one
// iteration of it, and the last one of the frame.
enum class Iterates : uint8_t { all, sampled };

inline constexpr const char *kStepByIterates = "step by iterates", *kIteratesUnit = "1",
                            *kIteratesSource = "tolerances.md, Iterate by iterate", *kNoIterates = "nothing is alive";

struct IterateFinding;  // oracles/iterates/substep_judge.h

// The shown iterates of one step.
struct ShownStep {
  State before;                 // as the backend holds it: loading rounds in single precision
  std::vector<State> iterates;  // those that were wanted; the last one ends the step
  std::optional<State> whole;   // where substeps were run one by one: after the step of the whole frame
};

// For one body and the state in which a frame begins: well formed and finite, its schedule not over. Both must live as
// long as this.
class IterateProbe {
 public:
  IterateProbe(const Setup& setup, const State& before, Iterates wanted, uint64_t seed);

  // Judges what shown_iterates() gives for it, in a verdict that holds so far. `measured` is the greatest part of its
  // bound of all that is compared, `bound` 1.
  void judge(const ShownStep& shown, Verdict& verdict) const;
  // The same in a verdict of its own.
  Verdict judged(const ShownStep& shown) const;

 private:
  friend std::vector<ShownStep> shown_iterates(Backend& backend, std::span<const IterateProbe> probes);
  struct Wanted {
    int32_t substep;
    std::vector<int32_t> iterations;  // ascending: of runs that end with so many
  };
  struct Shown {
    int32_t substep, iterations;
    friend auto operator<=>(const Shown&, const Shown&) = default;
  };
  // The last iterate of the last substep, which ends the frame: all probes want it.
  bool is_end(Shown wanted) const { return wanted == Shown{setup_.step.substeps - 1, setup_.step.iterations}; }
  Setup from_the_frame(Shown wanted) const;
  Setup from_the_substep(Shown wanted) const;
  void compare_loaded(const State& held, Verdict& verdict) const;
  void compare_ends(const State& shown, const State& whole, Verdict& verdict) const;
  Witness witness(const State& began, int32_t substep, const IterateFinding& found) const;
  std::size_t place_of(Shown wanted) const;

  const Setup& setup_;
  const State& before_;
  std::vector<Wanted> wanted_;
  std::vector<Shown> shown_;  // ascending
};

// The iterates that each probe needs. A backend that knows Setup::withheld_iterations runs all of them from the
// beginning of the frame, in one batch. Another backend runs each substep from the end of the one before; of its whole
// frame the state is shown in double precision only.
std::vector<ShownStep> shown_iterates(Backend& backend, std::span<const IterateProbe> probes);

}  // namespace cutproof::oracles
