// --json: the machine's interface; docs/reference/schemas/ describes every field.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/scene_judge.h"
#include "model/backend.h"
#include "model/scene.h"

namespace cutproof::cli {

// Refers to the scene and the body, which must outlive it.
struct RunResult {
  std::string command;  // "run", whose frames were timed, or "check"
  std::string source;   // the scene's or the recording's file name
  std::string backend;
  const Scene& scene;
  const Body& body;
  int64_t clusters_at_start = 0;
  std::vector<harness::FrameResult> frames = {};
};

// `judge` is null if nothing was checked.
nlohmann::json to_json(const RunResult& result, const harness::SceneJudge* judge);

}  // namespace cutproof::cli
