// Limits of input from outside. docs/reference/limits.md is made from these. Within the limits, reading takes seconds
// and some hundred megabytes at most; beyond them it is refused before that much is allocated. (Arrays and meshes take
// what they hold.)
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace cutproof::io {

inline constexpr uint64_t kMiB = uint64_t{1} << 20;
inline constexpr uint64_t kGiB = uint64_t{1} << 30;

// Limits of a JSON file. `values` counts objects, lists, texts, numbers and words; names of fields count as values do.
struct JsonLimits {
  std::string_view what;  // as a sentence begins
  uint64_t bytes;
  int64_t depth;  // of brackets within brackets
  int64_t values;
};
inline constexpr JsonLimits kSceneLimits = {"A scene", 4 * kMiB, 64, 200'000};
inline constexpr JsonLimits kCounterexampleLimits = {"A counterexample", 8 * kMiB, 64, 400'000};
inline constexpr JsonLimits kCampaignLimits = {"A result of fuzz", 64 * kMiB, 64, 2'000'000};
inline constexpr JsonLimits kResultsLimits = {"A result for a report page", 64 * kMiB, 64, 4'000'000};
inline constexpr JsonLimits kQuestionLimits = {"A question to a kernel", 32 * kMiB, 64, 2'000'000};

// Limits of a scene.
inline constexpr std::size_t kMostNameBytes = 200;
inline constexpr std::size_t kMostDescriptionBytes = 10'000;
inline constexpr std::size_t kMostPathBytes = 4096;
inline constexpr std::size_t kMostShapes = 100;  // in a body, the shapes within shapes included
inline constexpr std::size_t kMostStrokes = 1000;
inline constexpr std::size_t kMostPoints = 10'000;  // of a stroke
inline constexpr std::size_t kMostWalls = 100;
inline constexpr std::size_t kMostGrips = 100;
inline constexpr uint64_t kMostGripSubsteps = 20'000'000;  // a grip has 25 bytes for each substep

// Limits of a counterexample.
inline constexpr std::size_t kMostCaseNodes = 100'000;
inline constexpr int64_t kMostCaseCells = 10'000'000;  // of the box around them
inline constexpr std::size_t kMostCommands = 10'000;
inline constexpr std::size_t kMostDecisions = 10'000'000;  // of a schedule

// Limits of a result of fuzz.
inline constexpr std::size_t kMostProperties = 1000;

// Limits of a mesh.
inline constexpr uint64_t kMostMeshBytes = 256 * kMiB;
inline constexpr std::size_t kMostMeshElements = 2'000'000;  // faces, and vertices

// Limits of a file of arrays.
inline constexpr uint64_t kMostArrayBytes = 4 * kGiB;  // of all arrays together, as they lie in memory
inline constexpr std::size_t kMostArrays = 64;
inline constexpr std::size_t kMostArrayAxes = 8;
inline constexpr std::size_t kMostTextBytes = std::size_t{1} << 15;

// Limits of a run of another simulator.
inline constexpr std::size_t kMostSegments = 1'000'000;
inline constexpr int64_t kMostPatches = 10'000;  // of a blade's sweep in a frame

// Limits of a recording.
inline constexpr int64_t kMostSnapshots = 1'000'000;

// Compressed data become larger when read. Up to this size, any ratio is accepted; beyond it, data may be this many
// times as large as the file.
inline constexpr uint64_t kFreeInflation = 256 * kMiB;
inline constexpr uint64_t kMostInflation = 100;

// Most bytes that a compressed file of this size may hold.
constexpr uint64_t most_inflated(uint64_t file_bytes) {
  if (file_bytes > UINT64_MAX / kMostInflation) return UINT64_MAX;
  return file_bytes * kMostInflation < kFreeInflation ? kFreeInflation : file_bytes * kMostInflation;
}

// "4 MiB", "300 bytes".
std::string bytes_text(uint64_t bytes);
// docs/reference/limits.md: every limit, and refused kinds of files.
std::string limits_reference();

}  // namespace cutproof::io
