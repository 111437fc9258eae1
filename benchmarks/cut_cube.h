// A body whose linear system a cut changes.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "benchmarks/scene.h"

namespace cutproof::benchmarks {

inline constexpr double kCutCubeSpacing = 0.01;         // [m]
inline constexpr double kCutCubeStiffness = 1e6;        // [1/s²]
inline constexpr double kCutCubeSubstepLength = 0.004;  // [s]

// A cube at rest that a geometric cut goes through, a spacing a frame, a third of a spacing off a layer of nodes.
// It has side³ particles and `boxes` clusters with cores of core³.
ReadyScene make_cut_cube(int32_t side, int32_t core);

// Three cuts of it: what lies between two states.
struct Cut {
  std::string name;  // "one frame", "quarter", "whole"
  State before, after;
};
std::vector<Cut> cuts_of(const ReadyScene& cube);

}  // namespace cutproof::benchmarks
