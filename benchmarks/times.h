// Times that were measured several times over.
#pragma once
#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

namespace cutproof::benchmarks {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin);

struct Times {
  double median = 0, min = 0, max = 0;  // [s]
  int64_t count = 0;                    // of samples; 0: nothing was measured
};
Times times_of(std::vector<double> seconds);
// How long `work` takes, so many times over [s].
template <class Work>
std::vector<double> seconds_of(int repeats, const Work& work) {
  std::vector<double> seconds;
  for (int turn = 0; turn < repeats; ++turn) {
    const auto begin = Clock::now();
    work();
    seconds.push_back(seconds_since(begin));
  }
  return seconds;
}
// null if nothing was measured.
nlohmann::json to_json(const Times& times);

}  // namespace cutproof::benchmarks
