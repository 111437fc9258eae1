// All that changes while one body is simulated. A state and its setup determine every later state.
#pragma once
#include <cstdint>
#include <vector>

#include "model/clusters.h"
#include "model/precision.h"
#include "model/skin.h"
#include "model/vec.h"

namespace cutproof {

struct State {
  int64_t frame = 0;             // index of the frame in progress: counts up when a frame ends (after skin)
  std::vector<Vec3> x;           // [n] current positions, body frame [m]; of dead particles: the last one
  std::vector<Vec3> v;           // [n] velocities [m/s]
  std::vector<uint8_t> alive;    // [n] 1: in G
  std::vector<int32_t> removed;  // taken out by this frame's detection, ascending
  std::vector<int32_t> debris;   // taken out by this frame's split as debris, ascending
  Clusters clusters;
  int32_t tau = 0;            // a cluster with fewer particles is small (method.md §6)
  int32_t cap = 0;            // most particles of a merged cluster
  bool edge_covered = false;  // I4 is known to hold, so no expansion stage is needed (method.md §7)
  Vec3 impulse;               // impulse of contacts, pins and grips in this frame, damped as v is [kg m/s]
  Skin skin;
  // The coarsest arithmetic in which any part of this was computed: a backend makes it coarser where its own is, and
  // never finer.
  Precision precision = Precision::binary64;
  // Further error of each absolute place, because it was stored as an absolute coordinate [m]. Our backends keep
  // displacements, and have 0; a state from a file has the rounding of its greatest coordinate.
  double place_rounding = 0;

  friend bool operator==(const State&, const State&) = default;
};

// u of the arithmetic that made this state.
inline double unit_roundoff(const State& state) { return unit_roundoff(state.precision); }

}  // namespace cutproof
