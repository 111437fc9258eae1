// Times and errors of one backend on one scene, and their fields in documents.
#pragma once
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "benchmarks/contenders.h"
#include "benchmarks/frame_errors.h"
#include "benchmarks/scene.h"
#include "benchmarks/timing.h"

namespace cutproof::benchmarks {

// Larger bodies have no errors: a frame of the reference and the oracles would take minutes on one core.
inline constexpr int64_t kMostJudgedParticles = 12'000'000;

struct Measured {
  Timings timings;
  std::optional<FrameErrors> judged;  // absent beyond kMostJudgedParticles
  int64_t added = 0;                  // memberships, by expansion in the timed frames
  std::optional<int64_t> bytes;       // kept by a new backend after these frames; absent if unknown
  double judge_seconds = 0;
  bool holds() const { return !judged || judged->topology_holds(); }
};
// timed: called between timing and judging, which takes minutes for a large body; not called if nothing is judged.
using WhenTimed = std::function<void(const Measured& times)>;
Measured measure(const Contender& contender, const BenchScene& scene, int64_t frames, int64_t repeats,
                 const WhenTimed& timed = {});

// The error of the timed entry of this name (Timings::named); null if it was not measured, or did not run.
nlohmann::json error_of(const std::string& what, const Measured& measured);
// The error in words, or `nothing`.
std::string in_words(const nlohmann::json& error, const std::string& nothing);

// The scene, the backend and the solver.
nlohmann::json run_fields(const BenchScene& scene, const Contender& contender);
// A row common to `sampling` and `scale`, without their own fields.
nlohmann::json scene_row(const BenchScene& scene, const Contender& contender, const Measured& measured);

// Options of all suites that time whole scenes.
struct TimingOptions {
  std::string backend = harness::kReferenceName;
  std::optional<int64_t> frames;  // timed; absent: by backend
  int64_t repeats = 3;
  // Accelerations, timed in turn. Empty, absent: the scene's.
  std::vector<std::string> acceleration;
  std::optional<int32_t> iterations;
  std::string remove;  // which ends of open edges are removed; empty: as in the scene
  const harness::BackendDescriptor& described() const { return harness::described_backend(backend); }
  int64_t frames_or_default() const { return frames.value_or(described().timed_frames); }
};

// The timed variants of a scene's step. Throws InputError, naming the option.
std::vector<StepParameters> steps_of(const TimingOptions& options, const StepParameters& own);

// The timed variant of its detection, likewise.
DetectParameters detection_of(const TimingOptions& options, const DetectParameters& own);

}  // namespace cutproof::benchmarks
