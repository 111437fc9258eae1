// The solution from which errors of configurations are measured, by the double-precision reference, and its own error.
// With the scene's own substeps the last level does without the reference's step.
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
  limit,  // of ever shorter time steps, with enough iterations for each
  // Of ever more iterations with the scene's own substeps. The last level solves each substep without iteration
  // (tuning/solved_steps.h), so it does not depend on the reference's step.
  substeps
};

// One approximation of the solution.
struct RefinementLevel {
  int32_t substeps = 0;
  std::optional<int32_t> iterations;  // of the reference; none: each substep is solved
  std::optional<double> apart_h;      // greatest RMS distance from the previous level in any frame [h]
  EventsApart events = {};            // relative to the previous level
  SolvedSteps::Count solved = {};     // how substeps were solved
};

// The order of convergence in time of levels k - 2, k - 1 and k, each with twice the substeps of the previous one. It
// is the base-2 logarithm of the ratio of distances. None: there are not two distances, or one is infinite or rounding
// (at most 1e-9 h).
std::optional<double> observed_order(std::span<const RefinementLevel> levels, std::size_t k);

// The estimated error of the last of these levels [h]: last distance / (r - 1), the sum of a geometric series if
// distances fall by a factor r. (First order: r = 2, and the error equals the last distance.) r is the least factor
// seen, because a greater one may be chance. The estimate is at least the last distance. Distances up to 1e-9 h are
// rounding, which does not fall: they count as they are.
//
// Infinity, that is unknown: some distance did not fall, there are not two adjacent finite ones, or the last three
// levels do not remove the same particles in the same frames. Such a difference is an event with distances of its own,
// which hide the convergence.
double remaining_error(std::span<const RefinementLevel> levels);
// In words: "known to 0.04 h", or "not known" and the reason.
std::string known_to(std::span<const RefinementLevel> levels);

class ReferenceSolution {
 public:
  // Refines by factors of 2 until the solution is known to `known` [h] or no further level is allowed (kMostSubsteps;
  // kMostIterations, after which each substep is solved). The first three levels always run, because fewer show no
  // convergence. The scene must have the implicit solver. Here and in refine(): throws Stopped between two frames if
  // requested.
  ReferenceSolution(ReferenceKind kind, const Scene& scene, std::string source, std::optional<int64_t> frames,
                    double known, StopAsked stop_asked = {});

  const Trajectory& trajectory() const { return trajectory_; }
  const std::vector<RefinementLevel>& levels() const { return levels_; }
  // The solution's estimated error [h]; infinity: unknown.
  double known_to_h() const { return remaining_error(levels_); }
  bool nothing_removed() const;

  // Adds one level, at any cost, that the search has not seen. With the scene's own substeps it is the solved level;
  // none follows.
  void refine();

  static constexpr int32_t kMostSubsteps = 512;    // per frame
  static constexpr int32_t kMostIterations = 512;  // per substep

 private:
  struct Ran {
    RefinementLevel level;
    Trajectory trajectory;
  };
  // The level after `before`; null: the first.
  RefinementLevel level_after(const RefinementLevel* before) const;
  // With the scene's own substeps, each of them solved.
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
  std::future<Ran> solved_;  // the last level, with the scene's own substeps; declared last, because it uses all above
};

}  // namespace cutproof::tuning
