// A tried configuration, and its result.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/times.h"
#include "model/scene.h"

namespace cutproof::tuning {

struct Configuration {
  Scene scene;
  friend bool operator==(const Configuration&, const Configuration&) = default;
};
// Differences from `given` other than substeps, iterations and acceleration, in words; empty: none.
std::string differences(const Configuration& configuration, const Configuration& given);

enum class Outcome {
  within,          // the error is within the tolerance, and the tissue falls into the same parts
  over,            // the error is beyond it
  topology,        // at the end of a stroke or of the scene the tissue is in a different number of parts
  schedule,        // the scene has another number of frames: a blade takes whole substeps for each piece of its path
  refused,         // the scene cannot be built like this
  more_expensive,  // given up: before its end it had cost more than the cheapest that is within
};
inline constexpr const char* kOutcomeNames[] = {"within", "over", "topology", "schedule", "refused", "more_expensive"};
constexpr const char* name_of(Outcome outcome) { return kOutcomeNames[static_cast<std::size_t>(outcome)]; }

// A tried configuration.
struct Trial {
  Configuration configuration;
  Outcome outcome = Outcome::over;
  // RMS distance from the reference solution at the end of each frame of the scene [h], until it was given up; NaN is
  // infinite here.
  std::vector<double> rms_h;
  double greatest_rms_h = 0, greatest_h = 0;  // over these frames [h]
  std::optional<std::size_t> first_beyond;    // the first of them beyond the tolerance
  int64_t removed_otherwise = 0;  // particles that only this or only the reference solution has, in the last frame
  std::string why;                // remark in a table about a trial that is not within
  benchmarks::Times frame;        // seconds per frame of the scene; no samples if it was given up
};
// The fields of docs/reference/schemas/tune.json.
nlohmann::json to_json(const Trial& trial, const Configuration& given);

}  // namespace cutproof::tuning
