// Pieces of `cutproof bench stages`: what is timed, how errors are found, and the bytes that the step must move.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/report.h"
#include "model/backend.h"
#include "model/verdict.h"
#include "oracles/comparison/error_norm.h"

namespace CLI {
class App;
}

namespace cutproof::cli {

// A body that a blade is cutting. From frame `warm_up` on, for as many frames as were asked for and kJudgedFrames
// more, the blade's edge is inside the tissue and moves on.
struct BenchScene {
  std::string name;  // shape and particles
  Setup setup;
  State state;                    // at rest, before frame 0
  int64_t warm_up = 0;            // frames until the cut is well under way
  double advance = 0;             // of the blade's edge in one frame [h]
  double build_seconds = 0;       // sampling and cooking
  std::string cooking = "boxes";  // how its clusters were made
};

// The most frames that are judged after the timed ones: until one of them has removed something.
inline constexpr int64_t kJudgedFrames = 4;

// A box up to kLargestBox particles, a kidney beyond; `boxes` clusters; 4 substeps × 4 iterations; k = 1e5; the blade
// enters at the upper end of the longest axis and follows it, halfway between two layers of nodes. The other end is
// held. Throws InputError if no body has so many particles, within 2 %.
inline constexpr int64_t kLargestBox = 2000;
BenchScene make_bench_scene(int64_t particles, int64_t frames);

// What timing one backend on one scene gives. All three passes start from the same state, so they see the same frames.
struct Timings {
  Times frame;                 // whole frames, each waited for
  Times cutting;               // those of them that removed something
  Times back_to_back;          // per frame, when the frames are handed over without waiting for any; one per repeat
  std::array<Times, 6> stage;  // spans of one stage; only frames in which the stage ran
};
// Every pass `repeats` times, each after a warm-up of its own. back_to_back only if `pipelined`, for backends whose
// run() does not wait.
Timings time_stages(Backend& backend, const BenchScene& scene, int64_t frames, bool pipelined, int64_t repeats = 1);

// Frames in lockstep (oracles/comparison/stage_comparison.h). Where no frame of those judged had a stage due, its entry
// is empty.
struct FrameErrors {
  int64_t frames = 0;  // that were judged
  struct Step {
    oracles::ErrorNorm position;  // [h]
    int64_t undecidable = 0;      // particles that are not measured, because rounding decides where they go
  };
  std::optional<Step> step;
  struct Detection {
    int64_t removed = 0, differing = 0;  // particles; differing: removed by one of the two only
    bool within_rounding = true;         // oracle `detection`: every decision outside the rounding band is right
  };
  std::optional<Detection> detect;
  // split, merge, expand: same clusters, same numbers. Empty too where a rule leaves several answers.
  std::array<std::optional<bool>, 6> clusters_equal;
  int64_t added = 0;  // memberships, by expansion in the timed frames (measure)
  struct Surface {
    oracles::ErrorNorm vertices;  // [h]
    bool triangles_equal = true;  // as sets; vertices named by owner and direction
  };
  std::optional<Surface> skin;
  std::vector<Verdict> topology;  // of the state after the last judged frame, by the oracles that cost little
  // Coupled groups of clusters beyond the components of the tissue. Where clusters do not cover every edge nothing
  // promises that there is none (method.md §2), so there it is told, and `component match` is not asked for.
  double isolated_groups = 0;
  bool topology_holds() const;
};
// Runs and judges frames of what `backend` has loaded until one of them has removed something, at most kJudgedFrames.
FrameErrors judge_frames(Backend& backend, const Setup& setup);

// Bytes that the kernels of one frame's step read and write, with each array counted once for each kernel that uses
// it, and what the caches keep of a gathered array counted as if it were all of it (docs/results_schema.md, The floor
// of step). `launches`: kernels one after the other.
struct StepFloor {
  double bytes = 0;
  int64_t launches = 0;
};
StepFloor step_floor(const Setup& setup, const State& state);

// --- What the suites that time stages share -------------------------------------------------------------------------

// Who is timed.
struct Contender {
  std::string backend, precision, rotation, split;
  bool pipelined = false;     // run() does not wait
  bool kernel_bytes = false;  // its step moves what step_floor counts
  std::unique_ptr<Backend> instance;
};
// One for each way of splitting: `split` is blocks, global, both, or empty for the default. Throws InputError, or
// MachineError if there is no device.
std::vector<Contender> make_contenders(const std::string& backend, const std::string& split,
                                       const std::string& rotation);

// Throws InputError, naming --sizes, for a number of particles that cannot be timed.
void require_timed_sizes(const std::vector<int64_t>& sizes);

// Beyond this, one frame of the reference and the oracles take minutes on one core: errors are not measured.
inline constexpr int64_t kMostJudgedParticles = 12'000'000;

// One row's error, for people and for machines. `judged` is null if it was not measured.
struct ErrorColumn {
  std::string text;
  nlohmann::json value;
};
ErrorColumn error_of(Stage stage, const FrameErrors* judged);
ErrorColumn error_of_frame(const FrameErrors* judged);
// Both times and errors under the name of each stage and `frame`, and of `back to back` where it was timed.
nlohmann::json seconds_by_stage(const Timings& timings);
nlohmann::json errors_by_stage(const FrameErrors* judged);
// Says which verdicts fail.
void print_failures(const FrameErrors& judged);

// What one backend makes of one scene: times, then errors, then what it keeps in memory.
struct Measured {
  Timings timings;
  std::optional<FrameErrors> judged;  // absent beyond kMostJudgedParticles
  double judge_seconds = 0;
  const FrameErrors* errors() const { return judged ? &*judged : nullptr; }
  bool holds() const { return !judged || judged->topology_holds(); }
};
Measured measure(const Contender& contender, BenchScene& scene, int64_t frames, int64_t repeats);

// Milliseconds for a table; "-" if nothing was measured.
std::string ms(const Times& times);

// A row of a suite that times whole scenes, without what only that suite tells.
struct SceneRow {
  std::vector<std::string> counts;  // of the table: scene, particles, clusters
  std::vector<std::string> times;   // as scene_row_times() names them
  std::vector<std::string> errors;  // as scene_row_errors() names them
  nlohmann::json json;
};
SceneRow scene_row(const BenchScene& scene, const Contender& contender, const Measured& measured);
std::vector<std::string> scene_row_times();
std::vector<std::string> scene_row_errors();
// One line for who waits, and the verdicts that fail.
void print_measured(const BenchScene& scene, const Contender& contender, const Measured& measured);

// The options that these suites have in common.
struct TimingOptions {
  std::string backend = "reference";
  std::optional<int64_t> frames;  // timed; absent: by backend
  int64_t repeats = 3;
  std::string split, rotation;  // empty: the kernels' default
  std::string json;
  int64_t frames_or_default() const { return frames.value_or(backend == "gpu" ? 20 : 10); }
};
void declare(TimingOptions& options, CLI::App& command);

}  // namespace cutproof::cli
