// Repeated measurements of times.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <vector>

namespace cutproof::benchmarks {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin);

struct Times {
  double median = 0, min = 0, max = 0;  // [s]
  int64_t count = 0;                    // of samples; 0: not measured
};
Times times_of(std::vector<double> seconds);
// Times of `work`, so many repetitions [s].
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
// Results of `measure` for each of `count` items, in turns, so many repetitions. So a disturbance, such as a slow phase
// of the machine, affects all items. [count][repeats]
template <class Measure>
std::vector<std::vector<double>> in_turns(int repeats, std::size_t count, const Measure& measure) {
  std::vector<std::vector<double>> measured(count);
  for (int turn = 0; turn < repeats; ++turn) {
    for (std::size_t k = 0; k < count; ++k) measured[k].push_back(measure(k));
  }
  return measured;
}
// null if nothing was measured.
nlohmann::json to_json(const Times& times);

}  // namespace cutproof::benchmarks
