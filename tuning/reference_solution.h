// The solution that configurations of a scene are measured against, by the double-precision reference, and how well it
// is known; with the scene's own substeps at last without the reference's step.
#pragma once
#include <cstdint>
#include <future>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "model/scene.h"
#include "model/setup.h"
#include "model/stop.h"
#include "tuning/solved_steps.h"
#include "tuning/trajectory.h"

namespace cutproof::tuning {

enum class ReferenceKind {
  limit,  // of ever shorter time steps, and of iterations that are enough for them
  // Of ever more iterations, with the scene's own substeps, which are part of the scene; the last level has each of
  // them solved without iteration (tuning/solved_steps.h), and so does not hang on the reference's step.
  substeps
};

// One approximation of the solution.
struct RefinementLevel {
  int32_t substeps = 0;
  std::optional<int32_t> iterations;  // of the reference; none: each substep is solved
  std::optional<double> apart_h;      // from the level before: greatest RMS distance in any frame [h]
  EventsApart events = {};            // from the level before
  SolvedSteps::Count solved = {};     // where each substep is: how
};

// The order of convergence in time that levels k - 2, k - 1 and k show, each with twice the substeps of the one before:
// the base-2 logarithm of the factor by which distances fell. None: there are not two distances, or one is infinite or
// no more than rounding (1e-9 h).
std::optional<double> observed_order(std::span<const RefinementLevel> levels, std::size_t k);

// By how much the last of these levels may be off [h], as its distances tell. If they fall by a factor r from level to
// level, all that are still to come add up to the last one over r - 1 (a geometric series; of first order r is 2, and
// the sum as much as the last one). r is the least that was seen, because one that is greater may be luck; at least the
// last distance itself counts. Infinity: not known, because some distance did not fall, because there are not two
// finite ones side by side, or because the last three levels do not remove the same particles in the same frames: a
// removal that differs is an event, which makes distances of its own and hides how fast the others fall. Distances up
// to 1e-9 h are rounding, which does not fall: they count as they are.
double remaining_error(std::span<const RefinementLevel> levels);
// The same for people: "known to 0.04 h", or "not known", and why.
std::string known_to(std::span<const RefinementLevel> levels);

class ReferenceSolution {
 public:
  // Refines, a factor of 2 at a time, until the solution is known to `known` [h] or no further level is allowed
  // (kMostSubsteps, kMostIterations, after which each substep is solved); but the first three are run in any case,
  // because fewer tell nothing. The scene must have the implicit solver. Here and in refine(): throws Stopped between
  // two frames once it is asked to stop.
  ReferenceSolution(ReferenceKind kind, const Scene& scene, std::string source, std::optional<int64_t> frames,
                    double known, StopAsked stop_asked = {});

  const Trajectory& trajectory() const { return trajectory_; }
  const std::vector<RefinementLevel>& levels() const { return levels_; }
  // By how much the solution may be off [h]; infinity: it is not known.
  double known_to_h() const { return remaining_error(levels_); }
  bool nothing_removed() const;

  // One more level, whatever it costs: what the search has not seen. Of the scene's own substeps it is the one in which
  // each is solved; after that there is none.
  void refine();

  static constexpr int32_t kMostSubsteps = 512;    // per frame
  static constexpr int32_t kMostIterations = 512;  // per substep

 private:
  struct Ran {
    RefinementLevel level;
    Trajectory trajectory;
  };
  // That which follows `before`; null: the first.
  RefinementLevel level_after(const RefinementLevel* before) const;
  // The scene's own substeps, each of them solved.
  RefinementLevel solved_level() const;
  bool is_last() const { return !levels_.empty() && !levels_.back().iterations; }
  Ran run(RefinementLevel level) const;
  std::future<Ran> start(RefinementLevel level) const;
  void take(Ran next);

  ReferenceKind kind_;
  Scene scene_;
  std::string source_;
  std::optional<int64_t> frames_;
  StopAsked stop_asked_;
  Setup setup_;
  std::vector<RefinementLevel> levels_;
  Trajectory trajectory_;
  std::future<Ran> solved_;  // of the scene's own substeps: the last level; declared last, because it uses all above
};

}  // namespace cutproof::tuning
