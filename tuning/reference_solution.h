// The solution that configurations of a scene are measured against, by the double-precision reference, and how well it
// is known.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "model/scene.h"
#include "model/setup.h"
#include "tuning/trajectory.h"

namespace cutproof::tuning {

enum class ReferenceKind {
  limit,    // of ever shorter time steps, and of iterations that are enough for them
  substeps  // of ever more iterations, with the scene's own substeps: the time step is part of the scene
};

// One approximation of the solution.
struct RefinementLevel {
  int32_t substeps = 0, iterations = 0;
  std::optional<double> apart_h;  // from the level before: greatest RMS distance in any frame [h]
};

// By how much the last of these levels may be off [h]. If distances fall by a factor r from level to level, all that
// are still to come add up to the last one over r - 1 (a geometric series; first order: r = 2, and as much as the last
// one). One that falls more slowly knows less, and one that does not fall knows nothing: infinity, as with less than
// two finite distances. Never less than the last distance; below 1e-9 h that, because there rounding is seen.
double left_to_go(std::span<const RefinementLevel> levels);

class ReferenceSolution {
 public:
  // Refines, a factor of 2 at a time, until the solution is known to `known` [h], by three levels at least, or no
  // further level is allowed (kMostSubsteps, kMostIterations). The scene must have the implicit solver.
  ReferenceSolution(ReferenceKind kind, const Scene& scene, std::string source, std::optional<int64_t> frames,
                    double known);

  const Trajectory& trajectory() const { return trajectory_; }
  const std::vector<RefinementLevel>& levels() const { return levels_; }
  // By how much the solution may be off [h]; infinity: it is not known.
  double known_to_h() const { return left_to_go(levels_); }
  bool nothing_removed() const;

  // One more level, whatever it costs: what the search has not seen.
  void refine();

  static constexpr int32_t kMostSubsteps = 256;    // per frame
  static constexpr int32_t kMostIterations = 512;  // per substep

 private:
  RefinementLevel next_level() const;
  Trajectory run(const RefinementLevel& level) const;
  void take(RefinementLevel level, Trajectory trajectory);

  ReferenceKind kind_;
  Scene scene_;
  std::string source_;
  std::optional<int64_t> frames_;
  Setup setup_;
  std::vector<RefinementLevel> levels_;
  Trajectory trajectory_;
};

}  // namespace cutproof::tuning
