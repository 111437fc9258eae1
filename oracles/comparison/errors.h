// The errors of a simulation (accuracy_and_speed.md §1): figures, not verdicts. docs/errors.md says what each of them
// means and what it does not. Implementation and topology are compared with the reference, which no oracle knows: these
// two stand in harness/against.h; their distances are here.
//
// Lengths are told in h, the spacing of the grid. What is broken or not a number is infinitely wrong, or, where a
// volume would have no meaning, not a number; nothing of it is left out.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "model/backend.h"

namespace cutproof::oracles {

// Deviations of many things of one kind.
struct Spread {
  double greatest = 0;  // infinite if something was not a number
  int32_t where = -1;   // index of the greatest
  double sum_of_squares = 0;
  int64_t count = 0;

  void add(double deviation, int32_t index);
  void join(const Spread& other);
  double rms() const;
};

// Distances of positions of the particles in `mask` [h]. Both need one position per particle.
Spread positions_apart(const Setup& setup, const std::vector<Vec3>& expected, const std::vector<Vec3>& actual,
                       const std::vector<uint8_t>& mask);

// --- Solver ----------------------------------------------------------------------------------------------------------

// One substep of a backend against the converged answer of the same substep, which is
// - where the substep minimises an energy (Solver::implicit, no blade in the tissue, no friction): the minimiser, by
//   sparse Cholesky factorisation (oracles/comparison/converged.h);
// - otherwise the fixed point of the same iteration: that of `exact`, with 64, 128, … kMostIterations iterations, until
//   twice as many change no position by more than kFixedPoint.
inline constexpr int32_t kMostIterations = 4096;
inline constexpr double kFixedPoint = 1e-9;  // [h]
struct SolverError {
  Spread position;               // of the alive particles [h]
  std::optional<double> energy;  // (E − E*) / E* [1]; absent where there is no energy, or E* is 0
  bool by_energy = false;        // the answer is the minimiser
  bool converged = false;        // the answer was found within its tolerance
};
// The first substep of frame state.frame; nothing after the end of the schedule, nor with Solver::published, whose
// iteration has no limit but a rigid body (method.md §3). Loads both backends.
std::optional<SolverError> solver_error(Backend& judged, Backend& exact, const Setup& setup, const State& state);

// --- Time step -------------------------------------------------------------------------------------------------------

// The same scene with `factor` times the substeps: frames, iterations per substep and paths stay as they are, each move
// of the blade and of a grip is divided into equal parts. Requires factor >= 1.
Setup with_more_substeps(const Setup& setup, int32_t factor);

using MakeBackend = std::function<std::unique_ptr<Backend>()>;

// Two free runs at equal times, up to the first removal that differs.
struct TimeStepError {
  std::vector<Spread> position;              // [compared frames] of alive particles at the end of the frame [h]
  std::optional<int64_t> first_difference;   // the frame whose removals differ; the last one that was run
  std::optional<int32_t> removed_otherwise;  // a particle that only one of the two removed in it
  double greatest_rms() const;
};
TimeStepError time_step_error(const MakeBackend& make, const Setup& setup, const State& state, int64_t frames,
                              int32_t factor = 8);

// --- Geometry --------------------------------------------------------------------------------------------------------

// The ideal cut is what the blade's mid-surface sweeps in frames before.frame .. after.frame - 1, where it is down: its
// rectangle where it is put down and lifted, and the ruled surfaces that its four sides sweep in between. A plate that
// moves in its own plane sweeps a surface; of one that turns on the spot this is the hull of what it passes through.
std::vector<std::array<Vec3, 3>> swept_surface(const Setup& setup, int64_t first_frame, int64_t end_frame);

// The cut at rest: before it is what was alive in `before`. Tissue that has moved by the time the blade comes by is cut
// elsewhere, and that counts as an error.
struct CutGeometry {
  // Area of the ideal cut inside the tissue, which is the union of the cubes of side h around the particles [h²].
  // Counted along lines parallel to the axes, h / kLinesPerSpacing apart, that cross it: dA = Σ_a |n_a| · |n_a| dA, and
  // |n_a| dA is what the lines along axis a count. What the blade passes twice counts once.
  double cut_area = 0;
  double lost_volume = 0;                // of the particles that died [h³]
  std::optional<double> lost_per_area;   // [h]; absent without a cut
  std::optional<double> least_per_area;  // [h] the ideal: the fewest particles whose removal leaves no edge of the grid
                                         // that the ideal cut crosses (of those along one axis), per cut area
  std::optional<double> skin_to_ideal;   // [h] greatest distance of the new skin at rest from the ideal cut
  std::optional<double> ideal_to_skin;   // [h] greatest distance of the ideal cut inside the tissue from the new skin
  double sampling_skin = 0, sampling_ideal = 0;  // [h] by how much these two may be too small
  std::optional<double> hausdorff() const;       // the greater of the two
};
inline constexpr int kLinesPerSpacing = 4;
// New skin: triangles all of whose vertices lie on grid edges whose other end died, and such vertices by themselves.
// Absent distances: no new skin, or no cut inside the tissue. Requires before.frame <= after.frame, and `after` with
// the skin of its alive particles; without one there are no distances.
CutGeometry cut_geometry(const Setup& setup, const State& before, const State& after);

// Space that is inside the skins of two or more components of G [h³]: every line of a lattice parallel to an axis, at
// most h / kColumnsPerSpacing apart, knows exactly how much of it is. `bound`: how far the volume may be from the
// truth, for the axis where this is least (docs/tolerances.md, Interpenetration).
inline constexpr int kColumnsPerSpacing = 8;
struct Interpenetration {
  double volume = 0, bound = 0;
};
Interpenetration interpenetration(const Setup& setup, const State& state);

// --- Conservation ----------------------------------------------------------------------------------------------------

// The body alone: no blade, walls, grips, gravity, damping, detection or skin; `frames` frames like the one of
// state.frame.
Setup free_setup(const Setup& setup, int64_t frame, int64_t frames);
// What it does in the beginning, so that there is something to conserve: it drifts by 0.002 h a substep, spins by 0.01
// radians a substep about (1, 2, 3), and stretches by 0.001 a substep along that axis.
void set_in_motion(const Setup& setup, State& state);

struct Conservation {
  int64_t substeps = 0;
  double momentum = 0;           // greatest |p − p0| / M [m/s]
  double momentum_relative = 0;  // greatest |p − p0| / Σ m |v0| [1]
  double momentum_bound = 0;     // 0.25 n u L / dt [m/s], with u of the states (docs/tolerances.md)
  double mass = 0;               // greatest |M − M0| / M0 [1]
  std::optional<double> energy;  // greatest growth above an earlier value / the first value [1]; implicit solver only
  double energy_bound = 0;       // [1] what momentum_bound allows
  double angular_momentum = 0;   // greatest |J − J0| / |J0| [1], about the center of mass; reported, not bounded
  double extent = 0;             // L: greatest distance of a particle from the body's origin [m]
};
// Runs `setup` (as free_setup makes it) to its end. Requires an alive particle that moves.
Conservation conservation(Backend& backend, const Setup& setup, const State& state);

}  // namespace cutproof::oracles
