#include "oracles/comparison/conservation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "oracles/comparison/measurable.h"
#include "oracles/comparison/reference_solution.h"
#include "oracles/single_substep.h"
#include "oracles/totals.h"

namespace cutproof::oracles {

Setup free_setup(const Setup& setup, int64_t frame, int64_t frames) {
  Setup free = undisturbed(setup);
  free.step.gravity = {};
  free.step.damping = 0;
  free.substep_length.assign(at(frames), setup.substep_length.at(at(frame)));
  return free;
}

namespace {

// (k/2) Σ w |x − t − R (X − T)|² with the best t and R: the energy of a substep that begins here without a velocity and
// ends where it begins. Requires free_setup and Solver::implicit.
double elastic_energy(const Setup& setup, State state) {
  state.frame = 0;
  std::fill(state.v.begin(), state.v.end(), Vec3{});
  return substep_energy(setup, state, state.x);
}

// Totals that only a free body keeps, or loses.
struct FreeTotals : Totals {
  std::array<long double, 3> spin = {};  // Σ m x × v about the body's origin
  long double kinetic = 0;               // ½ Σ m v²
  double extent = 0;                     // greatest |x| [m]

  FreeTotals(const Body& body, const State& state) : Totals(totals_of(body, state, state.alive)) {
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      if (!state.alive[i]) continue;
      const long double m = body.mass[i];
      const Vec3 j = cross(state.x[i], state.v[i]);
      for (int axis = 0; axis < 3; ++axis) spin[at(axis)] += m * j[axis];
      kinetic += m * dot(state.v[i], state.v[i]) / 2;
      extent = std::max(extent, norm(state.x[i]));
    }
  }
  // About the center of mass: J − c × p.
  Vec3 angular_momentum() const { return vector(spin, 1) - cross(center(), total_momentum()); }
};

// NaN counts as infinite.
void raise(double& greatest, double value) {
  greatest = std::max(greatest, std::isfinite(value) ? value : std::numeric_limits<double>::infinity());
}

}  // namespace

void set_in_motion(const Setup& setup, State& state) {
  const double h = setup.body.grid.spacing, dt = setup.substep_length.at(0);
  const Vec3 axis = normalized({1, 2, 3}), drift = (0.002 * h / dt) * normalized({2, -1, 1});
  const Vec3 center = totals_of(setup.body, state, state.alive).center();
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    if (!state.alive[i]) continue;
    const Vec3 arm = state.x[i] - center;
    state.v[i] = drift + (0.01 / dt) * cross(axis, arm) + (0.001 / dt) * dot(axis, arm) * axis;
  }
}

Conservation conservation(Backend& backend, const Setup& setup, const State& state) {
  State start = state;
  start.frame = 0;
  backend.load({setup}, {start});
  start = std::move(backend.snapshot().front());  // as the backend holds it
  const bool implicit = setup.step.solver == Solver::implicit;
  const auto energy_of = [&](const State& s, const FreeTotals& totals) {
    return static_cast<double>(totals.kinetic) + (implicit ? elastic_energy(setup, s) : 0);
  };

  const FreeTotals first(setup.body, start);
  const auto mass = static_cast<double>(first.mass);
  const Vec3 p = first.total_momentum(), j = first.angular_momentum();
  const double energy = energy_of(start, first);
  double lowest = energy, growth = 0, turned = 0, change = 0;
  Conservation result;
  result.extent = first.extent;
  for (int64_t frame = 0; frame < setup.frame_count(); ++frame) {
    backend.run({});
    const State now = std::move(backend.snapshot().front());
    if (!measurable(setup, now)) {
      change = turned = growth = result.mass = std::numeric_limits<double>::infinity();
      break;
    }
    const FreeTotals totals(setup.body, now);
    raise(change, norm(totals.total_momentum() - p));
    raise(turned, norm(totals.angular_momentum() - j));
    raise(result.mass, static_cast<double>(std::abs(totals.mass - first.mass)) / mass);
    result.extent = std::max(result.extent, totals.extent);
    const double present = energy_of(now, totals);
    raise(growth, present - lowest);
    lowest = std::min(lowest, present);
  }
  const double dt = setup.substep_length.at(0), speed = static_cast<double>(first.speed);
  result.substeps = setup.frame_count() * setup.step.substeps;
  result.momentum = change / mass;
  result.momentum_relative = change / speed;
  result.momentum_bound =
      0.25 * static_cast<double>(result.substeps) * unit_roundoff(backend.precision()) * result.extent / dt;
  if (implicit) result.energy = growth / energy;
  // Velocities off by δ in the mean: at most δ Σ m |v| + M δ² / 2 (docs/design/tolerances.md, Conservation).
  result.energy_bound = result.momentum_bound * (speed + mass * result.momentum_bound / 2) / energy;
  result.angular_momentum = norm(j) > 0 ? turned / norm(j) : 0;
  return result;
}

}  // namespace cutproof::oracles
