// What one backend makes of one scene: times, then errors; and how both stand in documents.
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

// Beyond this, one frame of the reference and the oracles take minutes on one core: errors are not measured.
inline constexpr int64_t kMostJudgedParticles = 12'000'000;

struct Measured {
  Timings timings;
  std::optional<FrameErrors> judged;  // absent beyond kMostJudgedParticles
  int64_t added = 0;                  // memberships, by expansion in the timed frames
  std::optional<int64_t> bytes;       // that a new backend keeps after these; absent where nobody can tell
  double judge_seconds = 0;
  bool holds() const { return !judged || judged->topology_holds(); }
};
// timed: called between timing and judging, which takes minutes for a large body; not if nothing is judged.
using WhenTimed = std::function<void(const Measured& times)>;
Measured measure(const Contender& contender, const BenchScene& scene, int64_t frames, int64_t repeats,
                 const WhenTimed& timed = {});

// The error of what was timed under this name (Timings::named); null if it was not measured, or did not run.
nlohmann::json error_of(const std::string& what, const Measured& measured);
// The same for people. `nothing` if there is none.
std::string in_words(const nlohmann::json& error, const std::string& nothing);

// Which scene, on which backend, solved how.
nlohmann::json run_fields(const BenchScene& scene, const Contender& contender);
// A row of `sampling` and `scale`, without what belongs to one of them alone.
nlohmann::json scene_row(const BenchScene& scene, const Contender& contender, const Measured& measured);

// What the suites that time whole scenes are asked for.
struct TimingOptions {
  std::string backend = harness::kReferenceName;
  std::optional<int64_t> frames;  // timed; absent: by backend
  int64_t repeats = 3;
  // How the step iterates: each of these in turn. Empty, absent: as the scene says.
  std::vector<std::string> acceleration;
  std::optional<int32_t> iterations;
  std::string remove;  // which ends of an edge that is too long go; empty: as the scene says
  const harness::BackendDescriptor& described() const { return harness::described_backend(backend); }
  int64_t frames_or_default() const { return frames.value_or(described().timed_frames); }
};

// The steps that are to be timed of a scene whose own is this. Throws InputError, naming the option.
std::vector<StepParameters> steps_of(const TimingOptions& options, const StepParameters& own);

// How detection is to be timed, likewise.
DetectParameters detection_of(const TimingOptions& options, const DetectParameters& own);

}  // namespace cutproof::benchmarks
