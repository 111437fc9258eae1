// --json: the machine's interface; docs/results_schema.md describes every field.
#pragma once
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/judge.h"
#include "model/backend.h"
#include "model/scene.h"

namespace cutproof::cli {

// What one frame of the schedule did.
struct FrameResult {
  int64_t frame = 0;
  std::array<bool, 6> ran = {};
  double total_seconds = 0;
  std::array<double, 6> seconds = {};
  int64_t removed = 0, debris = 0, alive = 0, clusters = 0, triangles = 0;
};

struct RunResult {
  std::string command;  // "run" or "check"
  std::string source;   // the scene's or the recording's file name
  std::string scene;    // the scene's name
  std::string backend;
  uint64_t seed = 0;
  std::string body;
  double spacing = 0;
  int64_t particles = 0, clusters_at_start = 0;
  bool timed = false;  // seconds are measured (a recording has none)
  std::vector<FrameResult> frames;
};

nlohmann::json to_json(const Verdict& verdict, bool expected_failure);
// `gate` is null if nothing was checked.
nlohmann::json to_json(const RunResult& result, const Gate* gate);

}  // namespace cutproof::cli
