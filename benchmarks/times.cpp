#include "benchmarks/times.h"

#include <algorithm>

namespace cutproof::benchmarks {

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

Times times_of(std::vector<double> seconds) {
  if (seconds.empty()) return {};
  std::sort(seconds.begin(), seconds.end());
  const std::size_t n = seconds.size();
  return {(seconds[(n - 1) / 2] + seconds[n / 2]) / 2, seconds.front(), seconds.back(), static_cast<int64_t>(n)};
}

nlohmann::json to_json(const Times& times) {
  if (times.count == 0) return nullptr;
  return {{"median", times.median}, {"min", times.min}, {"max", times.max}};
}

}  // namespace cutproof::benchmarks
