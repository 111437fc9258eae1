// --json: the machine's interface; results_schema.md describes every field.
#pragma once
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/scene_judge.h"
#include "model/backend.h"
#include "model/scene.h"

namespace cutproof::cli {

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
  std::vector<harness::FrameResult> frames;
};

// `judge` is null if nothing was checked.
nlohmann::json to_json(const RunResult& result, const harness::SceneJudge* judge);

}  // namespace cutproof::cli
