// Times that were measured several times over.
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
// What `measure` gives for each of `count`, all of them in turns, so many times over: what the machine does meanwhile,
// such as being half as fast for a while, falls on all. [count][repeats]
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
