// The second target of a cluster that keeps its volume (method.md §3, Volume), and how rounding moves it. In extended
// precision; the answer is held against its own conditions. Internal to oracles/.
#pragma once
#include "model/vec.h"

namespace cutproof::oracles {

struct VolumeTarget {
  Mat3 v;
  Mat3 from_f;        // V - F, with F = A A0⁻¹; of a flat cluster 0
  Mat3 inverse_root;  // A0^(-1/2), without the directions in which a flat cluster has no extent
  bool is_flat = false;
  // Flat but for extents that rounding cannot make: then R across them is not the minimum of an energy.
  bool is_nearly_flat = false;
  // ‖V A0^(1/2)‖ + ‖A A0^(-1/2)‖: what rounds.
  double size = 0;
  // Growth of an error of A A0^(-1/2) in V A0^(1/2); infinite where several V are as near, or a threshold decides.
  double growth = 1;
  double gap = 1;       // least of σ2 + σ3, and of σ2 - σ3 where they differ in branch, in units of σ1
  double lead = 0;      // by how much the next answer of another branch is farther, in the norm of A0
  double stretch = 0;   // ‖F‖ · tr A0
  double thinness = 0;  // greatest entry of A0^(-1/2) along its axes

  // How far at most rounding puts V A0^(1/2), and (V - F) A0^(1/2), if A is off by `off`, sums round by `sums`, and
  // numbers by `u`. An open answer may be anywhere.
  double rounding(double off, double sums, double u) const;
  bool is_open(double off, double sums, double u) const { return size > 0 && !(rounding(off, sums, u) < size / 8); }
  Mat3 goal_map(double volume_share, const Mat3& r) const;   // C = (1 - β) R + β (V - F)
  Mat3 carry_map(double volume_share, const Mat3& r) const;  // B = (1 - β) R + β V
  // By so much a change of one of them times A0^(1/2) moves a member at `arm` at most.
  double lever(Vec3 arm) const { return norm(inverse_root * arm); }
};

// Requires A0 symmetric and not negative. Of an A that is not finite, R. Of several answers, which a gap up to `tie`
// leaves, the one nearest to `towards`; without, any.
VolumeTarget volume_target(const Mat3& a, const Mat3& rest_moment, const Mat3& rotation, double tie = 0,
                           const Mat3* towards = nullptr);

}  // namespace cutproof::oracles
