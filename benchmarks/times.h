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
// null if nothing was measured.
nlohmann::json to_json(const Times& times);

}  // namespace cutproof::benchmarks
