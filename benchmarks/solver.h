// Frames that begin far from their exact solution, and how near a number of iterations comes to it.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/scene.h"
#include "model/backend.h"
#include "oracles/comparison/error_norm.h"

namespace cutproof::benchmarks {

inline constexpr Span kStep = {Stage::step, Stage::step};

// Both scenes have a frame of one substep without a blade, and rest but for their velocities. These make the frame's
// free motion twist the longest axis and stretch the body.

// The twisted block of tolerances.md, Reference solution: 12³ particles, 27 clusters, 4 ms, twisted by 3 radians and
// stretched to 1.8 times its length.
ReadyScene make_block_scene();
// The body of make_bench_scene, held at one end, twisted by 1 radian and stretched to 1.2 times its length in 4 ms.
// Throws InputError as that does.
ReadyScene make_body_scene(int64_t particles);

// The same free motion of the frame, in so many substeps.
Setup with_substeps(const ReadyScene& scene, int32_t substeps);

// The end of the frame if every substep is solved exactly (oracles::reference_solution).
struct FrameSolution {
  std::vector<Vec3> x;           // [n]
  std::optional<double> energy;  // [J] of the only substep; empty if there are several
  bool converged = true;         // in every substep
};
FrameSolution converged_frame(const Setup& setup, const State& state);

struct SolverError {
  oracles::ErrorNorm position;       // distance from the solution [h]; infinite where a position is not finite
  std::optional<double> energy_gap;  // (E − E of the solution) / E of the solution
};
// Error of the first step from `state`, which the backend loads.
SolverError solver_error(Backend& backend, const Setup& setup, const State& state, const FrameSolution& solution);

// The least number of iterations whose greatest distance is below `tolerance` [h]; nullopt if there is none. `above`
// are too few, `below` are enough.
std::optional<int32_t> least_iterations(Backend& backend, Setup setup, const State& state,
                                        const FrameSolution& solution, double tolerance, int32_t above, int32_t below);

}  // namespace cutproof::benchmarks
