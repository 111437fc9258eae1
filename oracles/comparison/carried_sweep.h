// The sweep of a blade, carried to the rest positions of the tissue that it passes: the ideal cut of moving tissue.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "model/setup.h"
#include "model/state.h"

namespace cutproof::oracles {

// Frame by frame, the leading sides of the plate (those of its four sides that move outwards; its other sides follow in
// what these have opened), and the plate as a whole where a stroke begins. Each point is carried from the deformed
// tissue at that time to the tissue at rest, by the affine map that fits the particles within kReach best, near ones
// more (moving least squares, P. Lancaster and K. Salkauskas, Math. Comp. 37(155), 1981). Where these particles do not
// determine the map, it tends to the best rotation. Positions within a frame are taken to go straight from its first
// state to its last. Where no living particle is near there is no surface. A particle without a finite place, or beyond
// 2⁵⁰ h, is near nothing.
class CarriedSweep {
 public:
  static constexpr double kReach = 2.5;   // [h]
  static constexpr double kPiece = 0.25;  // no edge of the surface is longer in the blade's frame [h]

  // `setup` must outlive this.
  explicit CarriedSweep(const Setup& setup) : setup_(setup) {}

  // Whether the blade is down at any time in a frame; others need not be added. Not in frames that the setup has not.
  bool wants(int64_t frame) const;
  // The frame `before`.frame, of which these are the first and the last state. If either is not well formed, the frame
  // has no surface, and well_formed fails.
  void add(const State& before, const State& after);

  // The surface of the added frames; body frame at rest [m].
  const std::vector<std::array<Vec3, 3>>& surface() const { return surface_; }

 private:
  using Row = std::vector<std::optional<Vec3>>;  // points along a side, carried to rest; none where there is no tissue
  void add_strip(const Row& from, const Row& to);

  const Setup& setup_;
  std::array<Row, 4> reached_;  // how far each side has come that leads; empty: it does not
  std::vector<std::array<Vec3, 3>> surface_;
};

}  // namespace cutproof::oracles
