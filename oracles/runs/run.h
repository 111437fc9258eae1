// A run of anybody's simulator, as its judge sees it: what is given once, and one frame after the other
// (docs/reference/run.md). Needs no body, scene or backend.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "model/vec.h"

namespace cutproof::oracles {

// A place where nothing is.
inline bool is_blank(Vec3 x) { return std::isnan(x.x) && std::isnan(x.y) && std::isnan(x.z); }

// What an author vouches for beyond what every run is asked.
enum class RunPromise : uint8_t {
  free,              // nothing outside pushes, but gravity and what `contact_impulse` says
  angular_momentum,  // kept while nothing pushes
  energy,            // `energy` never grows while nothing pushes
  skin,              // the skin goes around each piece by itself
  deterministic,     // a second run has the same bits, which one run does not show
};
// Their words, in that order.
inline constexpr std::array<std::string_view, 5> kRunPromises = {"free", "angular_momentum", "energy", "skin",
                                                                 "deterministic"};

// Lists are empty where they are not given. Particles are numbered from 0; n is their number in the first frame.
struct RunHeader {
  std::vector<Vec3> rest;                     // [n] [m]
  std::optional<Vec3> gravity;                // [m/s²]
  double spacing = 0;                         // h [m]; 0: not given
  int64_t steps = 1;                          // substeps in a frame
  double damping = 0;                         // c [1/s]
  std::vector<std::array<int32_t, 2>> edges;  // tissue
  double cut_resolution = 0;                  // [m]
  double u = 0x1p-53;                         // unit roundoff of the simulator
  uint32_t promises = 0;                      // bits of RunPromise
  bool promised(RunPromise promise) const { return (promises >> static_cast<int>(promise) & 1u) != 0; }
};

// Whatever makes particles feel each other, until it is given anew.
struct RunCoupling {
  std::vector<int64_t> offsets;  // [groups + 1]; empty: not given
  std::vector<int32_t> members;
  std::vector<double> weights;  // [members]; empty: all 1
  std::vector<int32_t> cells;   // [cells][corners], each a group too
  int corners = 0;              // 4 or 8; 0: no cells
};

// One frame; spans are empty where it has none of it.
struct RunFrame {
  int64_t index = 0;                              // in the run
  std::optional<double> time;                     // [s]
  std::span<const Vec3> positions;                // [n] NaN: not there
  std::span<const Vec3> velocities;               // [n]
  std::span<const uint8_t> alive, held, removed;  // [n]
  std::span<const Vec3> spin;                     // [n]
  std::span<const Vec3> blade;                    // [quads][4], swept since the frame before; NaN: none
  std::span<const int32_t> parent;                // [n] of the frames in which vertices are new
  std::span<const int32_t> piece;                 // [n] the simulator's own word
  std::optional<Vec3> contact_impulse;            // [kg m/s]
  std::optional<double> energy;                   // [J]
};

// Whether particle i exists in the frame.
inline bool exists(const RunFrame& frame, std::size_t i) {
  return i < frame.positions.size() && !is_blank(frame.positions[i]) && (frame.alive.empty() || frame.alive[i] != 0) &&
         (frame.removed.empty() || frame.removed[i] == 0);
}

}  // namespace cutproof::oracles
