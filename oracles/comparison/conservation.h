// Conservation of a body without contacts: momentum and mass are constant, and energy does not grow
// (measure_and_tune.md, Conservation).
#pragma once
#include <optional>

#include "model/backend.h"

namespace cutproof::oracles {

// The body alone: no blade, walls, grips, gravity, damping, detection or skin; `frames` frames like the one of
// state.frame.
Setup free_setup(const Setup& setup, int64_t frame, int64_t frames);
// The initial motion: the body drifts by 0.002 h a substep, spins by 0.01 radians a substep about (1, 2, 3), and
// stretches by 0.001 a substep along that axis.
void set_in_motion(const Setup& setup, State& state);

struct Conservation {
  int64_t substeps = 0;
  double momentum = 0;           // greatest |p − p0| / M [m/s]
  double momentum_relative = 0;  // greatest |p − p0| / Σ m |v0| [1]
  double momentum_bound = 0;     // 0.25 n u L / dt [m/s], with u of the states (docs/design/tolerances.md)
  double mass = 0;               // greatest |M − M0| / M0 [1]
  std::optional<double> energy;  // greatest growth above an earlier value / the first value [1]; implicit solver only
  double energy_bound = 0;       // [1] what momentum_bound allows
  double angular_momentum = 0;   // greatest |J − J0| / |J0| [1], about the center of mass; reported, not bounded
  double extent = 0;             // L: greatest distance of a particle from the body's origin [m]
};
// Runs `setup` (as free_setup makes it) to its end. Requires an alive particle that moves.
Conservation conservation(Backend& backend, const Setup& setup, const State& state);

}  // namespace cutproof::oracles
