// `cutproof bench stages`: whole frames and each stage, a blade cutting: Table 1 of the paper, or boxes and kidneys of
// given sizes.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/machine_limits.h"
#include "benchmarks/measured_scene.h"
#include "benchmarks/provenance.h"
#include "benchmarks/step_traffic.h"
#include "model/grid.h"

namespace cutproof::benchmarks {

struct StagesOptions : TimingOptions {
  std::vector<int64_t> sizes;  // particles; if given, not the scenes
  std::vector<std::string> scenes = {"cuboid", "liver", "kidney", "irregular"};
  std::vector<std::string> cooking = {"boxes", "sampled"};
  bool full = false;  // the scenes at the paper's size
};

// The step beside what the machine can do at best.
struct StepLimit {
  StepTraffic traffic;
  double bytes_seconds = 0;                    // bytes / copy bandwidth
  std::optional<double> launch_seconds;        // launches × graph node; device only
  double seconds = 0;                          // the greater of the two
  double multiple = 0, multiple_of_bytes = 0;  // median of the step over `seconds` and over `bytes_seconds`
};

// One scene, one way of cooking, one contender.
struct StagesScene {
  SceneRow row;
  std::string cooking, body;
  decltype(Grid::nodes) nodes = {};
  double stiffness = 0, damping = 0;
  double advance = 0;  // of the blade's edge in one frame [h]
  int64_t warm_up = 0;
  double build_seconds = 0;
  std::optional<StepLimit> step_limit;  // of backends that run the kernels

  // One row of the table: a whole frame or a stage, its time and its error.
  struct Timed {
    std::string what;
    Times seconds;
    std::optional<double> paper_ms;  // what Table 1 has in its place
    ErrorColumn error;
  };
  std::vector<Timed> timed() const;
};

struct StagesResult {
  Provenance provenance;
  int64_t frames = 0, repeats = 0;
  bool is_table_1 = false;  // the scenes are the paper's
  MachineLimits machine;
  nlohmann::json launch_layer;  // null without a device
  std::vector<StagesScene> scenes;
  bool complete = false;
  bool holds() const;  // every verdict on topology does
};
nlohmann::json to_json(const StagesResult& result);

StagesResult run_stages(const StagesOptions& options, const Progress<StagesResult>& progress);

}  // namespace cutproof::benchmarks
