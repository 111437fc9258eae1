// Frames that begin far from where they end if they are solved exactly, and how near to that so many iterations come.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/backend.h"

namespace cutproof::benchmarks {

// A frame of one substep without a blade. Velocities are such that its free motion ends with the two ends of the
// longest axis turned against each other and the body drawn out.
struct SolverScene {
  std::string name;
  Setup setup;
  State state;  // at rest but for its velocities
};
// The twisted block of tolerances.md, Reference solution: 12³ particles, 27 clusters, 4 ms, turned by 3 radians and
// drawn out to 1.8 times its length.
SolverScene make_block_scene();
// The body of make_bench_scene, held at one end, turned by 1 radian and drawn out to 1.2 times its length in 4 ms.
// Throws InputError as that does.
SolverScene make_body_scene(int64_t particles);

// The same free motion of the frame, in so many substeps.
Setup with_substeps(const SolverScene& scene, int32_t substeps);

// Where the frame ends if every substep is solved exactly (oracles::reference_solution).
struct FrameSolution {
  std::vector<Vec3> x;           // [n]
  std::optional<double> energy;  // [J] of the substep, if there is only one
  bool converged = true;         // every substep's solution is
};
FrameSolution converged_frame(const Setup& setup, const State& state);

struct SolverError {
  double max_h = 0, rms_h = 0;       // distance from the solution [h]; infinite where a position is no number
  std::optional<double> energy_gap;  // (E − E of the solution) / E of the solution
};
// The first step from `state`, which the backend loads.
SolverError solver_error(Backend& backend, const Setup& setup, const State& state, const FrameSolution& solution);

// The least number of iterations with which the greatest distance is below `tolerance` [h], where `above` are too few
// and `below` are enough; nullopt if none of those between is.
std::optional<int32_t> least_iterations(Backend& backend, Setup setup, const State& state,
                                        const FrameSolution& solution, double tolerance, int32_t above, int32_t below);

}  // namespace cutproof::benchmarks
