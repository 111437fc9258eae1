// What one backend makes of one scene: times, then errors; and how both stand in tables and documents.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "benchmarks/contenders.h"
#include "benchmarks/scene.h"
#include "benchmarks/stages.h"
#include "benchmarks/timing.h"

namespace cutproof::benchmarks {

// Beyond this, one frame of the reference and the oracles take minutes on one core: errors are not measured.
inline constexpr int64_t kMostJudgedParticles = 12'000'000;

struct Measured {
  Timings timings;
  std::optional<FrameErrors> judged;  // absent beyond kMostJudgedParticles
  int64_t added = 0;                  // memberships, by expansion in the timed frames
  double judge_seconds = 0;
  bool holds() const { return !judged || judged->topology_holds(); }
};
Measured measure(const Contender& contender, const BenchScene& scene, int64_t frames, int64_t repeats);

// One row's error, in words and for machines.
struct ErrorColumn {
  std::string text;
  nlohmann::json value;  // null if it was not measured
};
ErrorColumn error_of(Stage stage, const Measured& measured);
ErrorColumn error_of_frame(const Measured& measured);
// Under the name of each stage and `frame`.
nlohmann::json errors_by_stage(const Measured& measured);

// A row of a suite that times whole scenes, without what belongs to that suite alone.
struct SceneRow {
  std::string scene;
  int64_t particles = 0, clusters = 0, memberships = 0;
  double spacing = 0;  // [m]
  std::string backend, precision, rotation, split;
  int32_t substeps = 0, iterations = 0;
  Measured measured;
};
SceneRow scene_row(const BenchScene& scene, const Contender& contender, Measured measured);
nlohmann::json to_json(const SceneRow& row);

// What the suites that time whole scenes are asked for.
struct TimingOptions {
  std::string backend = harness::kReferenceName;
  std::optional<int64_t> frames;  // timed; absent: by backend
  int64_t repeats = 3;
  std::string split, rotation;  // empty: the kernels' default
  const harness::BackendDescriptor& described() const { return harness::described_backend(backend); }
  int64_t frames_or_default() const { return frames.value_or(described().timed_frames); }
};

}  // namespace cutproof::benchmarks
