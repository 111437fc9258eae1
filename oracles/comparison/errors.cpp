// Errors of positions and of conserved quantities: solver, time step, conservation.
#include "oracles/comparison/errors.h"

#include <algorithm>
#include <cmath>

#include "oracles/blade_motion.h"
#include "oracles/comparison/converged.h"
#include "oracles/oracles.h"
#include "oracles/single_substep.h"
#include "oracles/support.h"

namespace cutproof::oracles {

namespace {

constexpr Span kFrame{Stage::step, Stage::skin};
constexpr Span kStep{Stage::step, Stage::step};

State after_frame(Backend& backend, const Setup& setup, const State& state) {
  backend.load({setup}, {state});
  backend.run(backend.can_run(kStep) ? kStep : kFrame);
  return std::move(backend.snapshot().front());
}

// Whether converged_substep takes the first substep of the state's frame.
bool has_energy(const Setup& setup, const State& state) {
  if (setup.step.solver != Solver::implicit) return false;
  if (std::any_of(setup.walls.begin(), setup.walls.end(), [](const Wall& wall) { return wall.friction > 0; })) {
    return false;
  }
  return !setup.has_blade || setup.detect.criterion == Criterion::geometric ||
         !setup.blade_moves[at(state.frame * setup.step.substeps)].down;
}

// What nothing can be measured of, because it is broken or not a number: infinitely wrong.
Spread infinite() {
  Spread spread;
  spread.add(std::numeric_limits<double>::infinity(), -1);
  return spread;
}

bool measurable(const Setup& setup, const State& state) {
  return well_formed(setup, state).holds && std::all_of(state.x.begin(), state.x.end(), is_finite) &&
         std::all_of(state.v.begin(), state.v.end(), is_finite);
}

struct Answer {
  std::vector<Vec3> x;
  bool converged = false;
};

Answer fixed_point(Backend& exact, Setup setup, const State& state) {
  Answer answer;
  for (setup.step.iterations = 64; setup.step.iterations <= kMostIterations; setup.step.iterations *= 2) {
    std::vector<Vec3> x = after_frame(exact, setup, state).x;
    answer.converged = !answer.x.empty() && positions_apart(setup, answer.x, x, state.alive).greatest <= kFixedPoint;
    answer.x = std::move(x);
    if (answer.converged) break;
  }
  return answer;
}

}  // namespace

void Spread::add(double deviation, int32_t index) {
  if (!std::isfinite(deviation)) deviation = std::numeric_limits<double>::infinity();
  ++count;
  sum_of_squares += deviation * deviation;
  if (deviation > greatest || where < 0) {
    greatest = deviation;
    where = index;
  }
}

void Spread::join(const Spread& other) {
  if (other.count == 0) return;
  if (other.greatest > greatest || where < 0) {
    greatest = other.greatest;
    where = other.where;
  }
  sum_of_squares += other.sum_of_squares;
  count += other.count;
}

double Spread::rms() const { return count == 0 ? 0 : std::sqrt(sum_of_squares / static_cast<double>(count)); }

Spread positions_apart(const Setup& setup, const std::vector<Vec3>& expected, const std::vector<Vec3>& actual,
                       const std::vector<uint8_t>& mask) {
  Spread spread;
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (mask[at(i)]) spread.add(norm(actual[at(i)] - expected[at(i)]) / setup.body.grid.spacing, i);
  }
  return spread;
}

// --- Solver ----------------------------------------------------------------------------------------------------------

std::optional<SolverError> solver_error(Backend& judged, Backend& exact, const Setup& setup, const State& state) {
  if (state.frame >= setup.frame_count() || setup.step.solver != Solver::implicit) return std::nullopt;
  Setup one = single_substep_setup(setup, state.frame);
  one.detect.without_blade = false;
  State start = state;
  start.frame = 0;

  SolverError error;
  if (!measurable(setup, state)) {
    error.position = infinite();
    return error;
  }
  error.by_energy = has_energy(one, start);
  Answer answer;
  double least = 0;
  if (error.by_energy) {
    Converged converged = converged_substep(one, start);
    answer = {std::move(converged.x), converged.converged};
    least = converged.energy;
  } else {
    answer = fixed_point(exact, one, start);
  }
  error.converged = answer.converged;

  // What is judged begins where the answer does: at the state as the backend holds it, which may be rounded.
  const State end = after_frame(judged, one, start);
  error.position = measurable(one, end) ? positions_apart(one, answer.x, end.x, start.alive) : infinite();
  if (error.by_energy && least > 0 && std::isfinite(error.position.greatest)) {
    error.energy = (substep_energy(one, start, end.x) - least) / least;
  }
  return error;
}

// --- Time step -------------------------------------------------------------------------------------------------------

Setup with_more_substeps(const Setup& setup, int32_t factor) {
  Setup finer = setup;
  finer.step.substeps *= factor;
  for (double& dt : finer.substep_length) dt /= factor;
  finer.blade_moves.clear();
  for (const BladeMove& move : setup.blade_moves) {
    for (int32_t part = 0; part < factor; ++part) {
      const auto pose = [&](int32_t k) { return pose_between(move.from, move.to, static_cast<double>(k) / factor); };
      finer.blade_moves.push_back({pose(part), pose(part + 1), move.down, move.stroke});
    }
  }
  for (Grip& grip : finer.grips) {
    const Grip whole = std::move(grip);
    grip = Grip{whole.particles, {}, {}};
    for (std::size_t k = 0; k < whole.active.size(); ++k) {
      grip.active.insert(grip.active.end(), at(factor), whole.active[k]);
      grip.displacement.insert(grip.displacement.end(), at(factor), whole.displacement[k] / factor);
    }
  }
  return finer;
}

double TimeStepError::greatest_rms() const {
  double greatest = 0;
  for (const Spread& spread : position) greatest = std::max(greatest, spread.rms());
  return greatest;
}

TimeStepError time_step_error(const MakeBackend& make, const Setup& setup, const State& state, int64_t frames,
                              int32_t factor) {
  const std::unique_ptr<Backend> coarse = make(), fine = make();
  coarse->load({setup}, {state});
  fine->load({with_more_substeps(setup, factor)}, {state});
  TimeStepError error;
  for (int64_t frame = state.frame; frame < std::min(state.frame + frames, setup.frame_count()); ++frame) {
    coarse->run(kFrame);
    fine->run(kFrame);
    const State a = std::move(fine->snapshot().front()), b = std::move(coarse->snapshot().front());
    if (!measurable(setup, a) || !measurable(setup, b)) {
      error.position.push_back(infinite());
      break;
    }
    for (std::size_t i = 0; i < a.alive.size() && !error.first_difference; ++i) {
      if (a.alive[i] == b.alive[i]) continue;
      error.first_difference = frame;
      error.removed_otherwise = static_cast<int32_t>(i);
    }
    if (error.first_difference) break;
    error.position.push_back(positions_apart(setup, a.x, b.x, a.alive));
  }
  return error;
}

// --- Conservation ----------------------------------------------------------------------------------------------------

Setup free_setup(const Setup& setup, int64_t frame, int64_t frames) {
  Setup free = setup;
  free.has_blade = false;
  free.blade_moves.clear();
  free.stroke_end.clear();
  free.walls.clear();
  free.grips.clear();
  free.step.gravity = {};
  free.step.damping = 0;
  free.detect.criterion = Criterion::none;
  free.skin.wanted = false;
  free.substep_length.assign(at(frames), setup.substep_length.at(at(frame)));
  return free;
}

namespace {

// Of the alive particles, summed in extended precision, so that only what the backend rounds is left.
struct Totals {
  long double mass = 0;
  std::array<long double, 3> momentum = {}, moment = {}, spin = {};  // Σ m v, Σ m x, Σ m x × v about the body's origin
  long double kinetic = 0, speed = 0;                                // ½ Σ m v², Σ m |v|
  double extent = 0;

  Vec3 total_momentum() const { return vector(momentum); }
  Vec3 center() const { return vector(moment) / static_cast<double>(mass); }
  // About the center of mass: J − c × p.
  Vec3 angular_momentum() const { return vector(spin) - cross(center(), vector(momentum)); }
  static Vec3 vector(const std::array<long double, 3>& v) {
    return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
  }
};

Totals totals_of(const Body& body, const State& state) {
  Totals totals;
  for (std::size_t i = 0; i < state.alive.size(); ++i) {
    if (!state.alive[i]) continue;
    const long double m = body.mass[i];
    const Vec3 x = state.x[i], v = state.v[i], j = cross(x, v);
    totals.mass += m;
    for (int axis = 0; axis < 3; ++axis) {
      totals.momentum[at(axis)] += m * v[axis];
      totals.moment[at(axis)] += m * x[axis];
      totals.spin[at(axis)] += m * j[axis];
    }
    totals.kinetic += m * dot(v, v) / 2;
    totals.speed += m * norm(v);
    totals.extent = std::max(totals.extent, norm(x));
  }
  return totals;
}

// (k/2) Σ w |x − t − R (X − T)|² with the best t and R: the energy of a substep that begins here without a velocity and
// ends where it begins. Requires free_setup and Solver::implicit.
double elastic_energy(const Setup& setup, State state) {
  state.frame = 0;
  std::fill(state.v.begin(), state.v.end(), Vec3{});
  return substep_energy(setup, state, state.x);
}

// What is not a number is infinitely much.
void raise(double& greatest, double value) {
  greatest = std::max(greatest, std::isfinite(value) ? value : std::numeric_limits<double>::infinity());
}

}  // namespace

void set_in_motion(const Setup& setup, State& state) {
  const double h = setup.body.grid.spacing, dt = setup.substep_length.at(0);
  const Vec3 axis = normalized({1, 2, 3}), drift = (0.002 * h / dt) * normalized({2, -1, 1});
  const Vec3 center = totals_of(setup.body, state).center();
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
  const auto energy_of = [&](const State& s, const Totals& totals) {
    return static_cast<double>(totals.kinetic) + (implicit ? elastic_energy(setup, s) : 0);
  };

  const Totals first = totals_of(setup.body, start);
  const auto mass = static_cast<double>(first.mass);
  const Vec3 p = first.total_momentum(), j = first.angular_momentum();
  const double energy = energy_of(start, first);
  double lowest = energy, growth = 0, turned = 0, change = 0;
  Conservation result;
  result.extent = first.extent;
  for (int64_t frame = 0; frame < setup.frame_count(); ++frame) {
    backend.run(kFrame);
    const State now = std::move(backend.snapshot().front());
    if (!measurable(setup, now)) {
      for (double* figure : {&change, &turned, &growth, &result.mass}) {
        *figure = std::numeric_limits<double>::infinity();
      }
      break;
    }
    const Totals totals = totals_of(setup.body, now);
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
  result.momentum_bound = 0.25 * static_cast<double>(result.substeps) * unit_roundoff(backend.precision()) * result.extent / dt;
  if (implicit) result.energy = growth / energy;
  // Velocities off by δ in the mean: at most δ Σ m |v| + M δ² / 2 (docs/tolerances.md, Conservation).
  result.energy_bound = result.momentum_bound * (speed + mass * result.momentum_bound / 2) / energy;
  result.angular_momentum = norm(j) > 0 ? turned / norm(j) : 0;
  return result;
}

}  // namespace cutproof::oracles
