// Which configurations of a scene `cutproof tune` tries, and in which order. Knows nothing of backends: what a
// configuration costs and how far it is from the reference solution is asked of `Measure`.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tuning/trial.h"

namespace cutproof::tuning {

// Runs and times a configuration. `limit`: the seconds per frame beyond which it may be given up as too expensive.
using Measure = std::function<Trial(const Configuration& configuration, std::optional<double> limit)>;

// What may be changed.
struct SearchSpace {
  std::vector<int32_t> substeps;  // ascending
  int32_t most_iterations = 64;
  bool may_resize = true;        // false: the number of clusters is part of what the scene expects
  bool may_drop_skin = false;    // nobody looks at it
  bool nothing_removed = false;  // in the reference solution: a scene without a blade then needs no detection
  // Of runs that are all carried to their end: the given substeps are followed down to this error, too [h].
  std::optional<double> followed_to;
};
// 1, 2, 3, 4, 6, 8, 12, … up to `most`, and `given`.
std::vector<int32_t> substeps_to_try(int32_t given, int32_t most);

// All that was tried, in order; the first is the given configuration.
// 1. For each number of substeps, from the least, and each acceleration: the least number of iterations that is within
//    the tolerance, found by doubling and halving; more iterations are taken to be no less accurate and no cheaper.
//    Doubling ends where it no longer helps: where the error, in the first frame in which the one before was beyond the
//    tolerance, has not fallen by kHelps; and where nothing but the number of substeps decides (schedule, refused).
// 2. From the cheapest of these: stages without which the scene's trajectory is the same, sizes of clusters and debris,
//    one after the other; each is kept if it is within the tolerance and cheaper.
// 3. If one was kept: the least number of iterations once more.
// 4. With `followed_to`: the given substeps with 1, 2, 3, 4, 6, 8, … iterations of each acceleration, until the error
//    is no greater: the curve that front() is read from.
// Nothing is tried twice.
inline constexpr double kHelps = 0.05;
// A configuration counts as cheaper than another if its median is by this much less: below it is the timer's noise.
inline constexpr double kCheaper = 0.05;
std::vector<Trial> search(const Configuration& given, const SearchSpace& space, const Measure& measure);

// Indices of those within, the cheapest first; of those that cost the same but for noise (kCheaper), the one that was
// tried first, which has less changed.
std::vector<std::size_t> by_cost(const std::vector<Trial>& trials);

// Speed against error, of trials that were carried to their end: the cheapest within each tolerance.
struct FrontPoint {
  double tolerance = 0;              // [h]
  std::optional<std::size_t> trial;  // none: nothing that was tried is within it
};
inline constexpr std::array<double, 4> kFrontTolerances = {0.5, 0.2, 0.05, 0.01};  // [h]
// For `asked` and those of kFrontTolerances, the greatest first; without `all` only up to `asked`, because what goes
// beyond that is given up. `known`: by how much the reference solution may be off [h].
std::vector<FrontPoint> front(const std::vector<Trial>& trials, double asked, bool all, double known);
// Whether `trial`, which takes about so many `seconds` a frame, cannot be a point of the front: the tissue falls into
// other parts, the error is beyond every tolerance, or one of `trials` is no farther from the reference solution and
// takes less than that over kClearly, which no noise of a timer makes up for.
inline constexpr double kClearly = 1.5;
bool is_behind(const Trial& trial, double seconds, const std::vector<Trial>& trials, double asked);
// Indices of those that may be points of the front by the least of their times, and of the first.
std::vector<std::size_t> may_be_points(const std::vector<Trial>& trials, double asked);

}  // namespace cutproof::tuning
