// Compares the shape of a cut with the ideal one. Figures, not verdicts (measure_and_tune.md, Geometry). A figure of
// broken data is not a number; nothing is left out.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "model/setup.h"
#include "model/state.h"

namespace cutproof::oracles {

// The ideal cut is what the blade's mid-surface sweeps in frames before.frame .. after.frame - 1, where it is down: its
// rectangle where it is put down and lifted, and the ruled surfaces that its four sides sweep in between. A plate that
// moves in its own plane sweeps a surface; of one that turns on the spot this is the hull of what it passes through.
std::vector<std::array<Vec3, 3>> swept_surface(const Setup& setup, int64_t first_frame, int64_t end_frame);

// The cut at rest; the uncut tissue is that of `before`.
struct CutGeometry {
  // Area of the ideal cut inside the tissue, which is the union of the cubes of side h around the particles [h²].
  // Counted along lines parallel to the axes, h / kLinesPerSpacing apart, that cross it: dA = Σ_a |n_a| · |n_a| dA, and
  // |n_a| dA is what the lines along axis a count. An area that the blade passes twice counts once.
  double cut_area = 0;
  double lost_volume = 0;                // of the particles that died [h³]
  std::optional<double> lost_per_area;   // [h]; absent without a cut
  std::optional<double> least_per_area;  // [h] the ideal: the fewest particles whose removal leaves no edge of the grid
                                         // that the ideal cut crosses, per cut area
  std::optional<double> skin_to_ideal;   // [h] greatest distance of the new skin at rest from the ideal cut
  std::optional<double> skin_rms;        // [h] root mean square of the distances of the new skin's vertices from it
  std::optional<double> ideal_to_skin;   // [h] greatest distance of the ideal cut inside the tissue from the new skin
  double sampling_skin = 0, sampling_ideal = 0;  // [h] by how much these two may be too small
  std::optional<double> hausdorff() const;       // the greater of the two
};
inline constexpr int kLinesPerSpacing = 4;
// New skin: triangles all of whose vertices lie on grid edges whose other end died, and such vertices by themselves.
// Absent distances: no new skin, or no cut inside the tissue. Requires before.frame <= after.frame, and `after` with
// the skin of its alive particles; without one there are no distances.
// `ideal`: the ideal cut, body frame at rest [m]: of tissue that moves what CarriedSweep (carried_sweep.h) has made of
// these frames.
CutGeometry cut_geometry(const Setup& setup, const State& before, const State& after,
                         const std::vector<std::array<Vec3, 3>>& ideal);
// The same for tissue that lies still until it is cut: with swept_surface of these frames.
CutGeometry cut_geometry(const Setup& setup, const State& before, const State& after);

}  // namespace cutproof::oracles
