// The configurations of a scene that `cutproof tune` tries, and their order. Independent of backends: `Measure` gives
// costs and distances from the reference solution.
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

// Possible changes.
struct SearchSpace {
  std::vector<int32_t> substeps;  // ascending
  int32_t most_iterations = 64;
  bool may_resize = true;        // false: the number of clusters is part of what the scene expects
  bool may_drop_skin = false;    // it is not needed
  bool nothing_removed = false;  // by the reference solution; a scene without a blade then needs no detection
  // With completed runs: the given substeps are also tried down to this error [h].
  std::optional<double> followed_to;
};
// 1, 2, 3, 4, 6, 8, 12, … up to `most`, and `given`.
std::vector<int32_t> substeps_to_try(int32_t given, int32_t most);

// All trials, in order; the first is the given configuration. No configuration is tried twice.
// 1. For each number of substeps, from the least, and each acceleration: the least number of iterations within the
//   tolerance, by doubling and bisection. More iterations are assumed to be no less accurate and no cheaper. Doubling
//   ends where it no longer helps: where the error, in the previous trial's first frame beyond the tolerance, has not
//   fallen by kHelps, or where only the number of substeps decides (schedule, refused).
// 2. From the cheapest of these, one change at a time: leaving out stages that do not affect the trajectory, then
//   sizes of clusters and debris. A change is kept if it is within the tolerance and cheaper.
// 3. After a kept change: the least number of iterations again.
// 4. With `followed_to`: the given substeps with 1, 2, 3, 4, 6, 8, … iterations of each acceleration, until the error
//   is no greater. front() uses this curve.
inline constexpr double kHelps = 0.05;
// A configuration is cheaper than another if its median is lower by this part; less is the timer's noise.
inline constexpr double kCheaper = 0.05;
std::vector<Trial> search(const Configuration& given, const SearchSpace& space, const Measure& measure);

// Indices of trials within the tolerance, the cheapest first. Of equal costs but for noise (kCheaper), the earlier one
// comes first, which has fewer changes.
std::vector<std::size_t> by_cost(const std::vector<Trial>& trials);

// Speed against error, of completed trials: the cheapest within each tolerance.
struct FrontPoint {
  double tolerance = 0;              // [h]
  std::optional<std::size_t> trial;  // none: no trial is within it
};
inline constexpr std::array<double, 4> kFrontTolerances = {0.5, 0.2, 0.05, 0.01};  // [h]
// For `asked` and kFrontTolerances, the greatest first; without `all` only up to `asked`, because worse trials are
// given up. `known`: the reference solution's estimated error [h].
std::vector<FrontPoint> front(const std::vector<Trial>& trials, double asked, bool all, double known);
// Whether `trial`, with about so many `seconds` a frame, cannot be a point of the front. Then its tissue falls into
// other parts, or its error is beyond every tolerance, or another trial is no less accurate and clearly faster: by a
// factor of more than kClearly, which exceeds a timer's noise.
inline constexpr double kClearly = 1.5;
bool is_behind(const Trial& trial, double seconds, const std::vector<Trial>& trials, double asked);
// Indices of possible points of the front by the least of their times, and of the first.
std::vector<std::size_t> may_be_points(const std::vector<Trial>& trials, double asked);

}  // namespace cutproof::tuning
