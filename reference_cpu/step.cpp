// Stage step (method.md §3): position-based dynamics with shape matching constraints.
#include <algorithm>
#include <cmath>

#include "model/at.h"
#include "reference_cpu/contacts.h"
#include "reference_cpu/reference.h"

namespace cutproof::reference {

namespace {

// t_c and C_c of one cluster at positions x.
struct Pose {
  Vec3 center;
  Mat3 map;
};

// For each particle: its displacement by a grip in the substep, or that no grip holds it.
struct Held {
  std::vector<uint8_t> yes;
  std::vector<Vec3> displacement;
};

Held held_particles(const Setup& setup, int64_t substep) {
  const auto n = static_cast<std::size_t>(setup.body.particle_count());
  Held held{std::vector<uint8_t>(n, 0), std::vector<Vec3>(n)};
  for (const Grip& grip : setup.grips) {
    if (!grip.active[at(substep)]) continue;
    for (const int32_t i : grip.particles) {
      held.yes[at(i)] = 1;
      held.displacement[at(i)] = grip.displacement[at(substep)];
    }
  }
  return held;
}

// Chebyshev semi-iteration (Golub and Varga 1961; method.md §11), restarted in every substep. With g_j the result of
// the plain iteration from x_j: x_j+1 = x_j + pull (g_j - x_j) + carry (x_j - x_j-1). The first iteration is plain.
class Chebyshev {
 public:
  explicit Chebyshev(double kdt2) {
    const double greatest = std::min(kdt2 / (1 + kdt2), kGreatestEigenvalue);
    radius_ = greatest / (2 - greatest);
    stretch_ = 2 / (2 - greatest);
  }

  Vec3 combine(Vec3 plain, Vec3 now, Vec3 earlier) const {
    if (order_ == 0) return plain;
    const double pull = omega_ * stretch_, carry = omega_ - 1;
    return now + (pull * (plain - now) + carry * (now - earlier));
  }

  void next() {
    ++order_;
    omega_ = order_ == 1 ? 1 : order_ == 2 ? 2 / (2 - radius_ * radius_) : 4 / (4 - radius_ * radius_ * omega_);
  }

 private:
  // The weights suit eigenvalues in [0, b]; this is b. A greater b would overshoot rotations far from their answer
  // again and again.
  static constexpr double kGreatestEigenvalue = 0.95;
  double radius_, stretch_, omega_ = 1;
  int64_t order_ = 0;
};

// Elasticity acts on y = x + τ v (method.md §3). v is the velocity of the substep that takes a particle from x_prev to
// x, so x - x_prev = dt v. y is thus ahead of x by τ / dt times that displacement.
class Ahead {
 public:
  Ahead(double dt, double retardation) : share_(dt / (dt + retardation)) {}
  // dt / (dt + τ): the share of the way to y at which x is.
  double share() const { return share_; }
  // Without retardation y equals x in all bits.
  Vec3 of(Vec3 x, Vec3 start) const { return share_ == 1 ? x : start + (x - start) / share_; }
  Vec3 back(Vec3 y, Vec3 start) const { return share_ == 1 ? y : start + share_ * (y - start); }

 private:
  double share_;
};

// t_c = Σ w x / M, A = Σ w (x - t)(X - T)ᵀ, R_c = argmax tr(Rᵀ A).
std::vector<Pose> match_shapes(const Body& body, double volume_share, const Memberships& memberships,
                               const std::vector<Vec3>& x, Clusters& clusters) {
  std::vector<Pose> poses(at(clusters.count()));
  for (int32_t c = 0; c < clusters.count(); ++c) {
    Pose& pose = poses[at(c)];
    // Relative to one member, so that a distant cluster loses no digits.
    const Vec3 base = x[at(clusters.of(c).front())];
    for (const int32_t i : clusters.of(c)) {
      pose.center += (body.mass[at(i)] / static_cast<double>(memberships.count(i))) * (x[at(i)] - base);
    }
    pose.center = base + pose.center / clusters.mass[at(c)];

    Mat3 a, a0;  // A and A0
    a.m.fill(0);
    a0.m.fill(0);
    Vec3 moment, rest_moment;  // rounding of t_c, of T_c and of M_c
    for (const int32_t i : clusters.of(c)) {
      const double weight = body.mass[at(i)] / static_cast<double>(memberships.count(i));
      const Vec3 now = weight * (x[at(i)] - pose.center);
      const Vec3 rest = body.rest_position(i) - clusters.rest_center[at(c)];
      moment += now;
      rest_moment += weight * rest;
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          a(row, column) += now[row] * rest[column];
          a0(row, column) += weight * rest[row] * rest[column];
        }
      }
    }
    const Rotation best = closest_rotation(a, clusters.rotation[at(c)]);
    // Of one particle A0 is the rounding of T.
    pose.map = clusters.size(c) > 1 ? cluster_maps(volume_share, a, a0, best.r).goal : best.r;
    // Otherwise it would push the cluster, and change the body's momentum, in every iteration.
    pose.center += (moment - pose.map * rest_moment / (1 - volume_share)) / clusters.mass[at(c)];
    clusters.rotation[at(c)] = best.r;
    clusters.degenerate[at(c)] = best.degenerate;
  }
  return poses;
}

// g_i = β x_i + mean of (1 - β) t_c + C_c (X_i - T_c) over its clusters. A particle in no cluster has its own place.
Vec3 goal(const Body& body, double volume_share, const Memberships& memberships, const Clusters& clusters,
          const std::vector<Pose>& poses, int32_t i, Vec3 x) {
  if (memberships.count(i) == 0) return x;
  Vec3 sum;
  for (const int32_t c : memberships.of(i)) {
    const Vec3 arm = body.rest_position(i) - clusters.rest_center[at(c)];
    sum += (1 - volume_share) * poses[at(c)].center + poses[at(c)].map * arm;
  }
  return volume_share * x + sum / static_cast<double>(memberships.count(i));
}

void substep(const Setup& setup, const Memberships& memberships, int64_t index, int32_t iterations, double dt,
             State& state) {
  const StepParameters& parameters = setup.step;
  const Body& body = setup.body;
  const int32_t n = body.particle_count();
  const BladeMove* move = setup.has_blade ? &setup.blade_moves[at(index)] : nullptr;
  const Contacts contacts(setup, move != nullptr && move->down ? move : nullptr);
  const Held held = held_particles(setup, index);
  const bool implicit = parameters.solver == Solver::implicit;
  const Ahead ahead(dt, parameters.retardation);
  const double kdt2 = parameters.stiffness * dt * (dt + parameters.retardation);
  const double s = implicit ? kdt2 / (1 + kdt2) : parameters.relaxation;

  const std::vector<Vec3> start = state.x;
  std::vector<Vec3> predicted(at(n));  // x~, and where elasticity would act on it
  std::vector<Vec3> predicted_ahead(at(n));
  std::vector<Vec3> y(at(n));
  std::vector<int> side(at(n), +1);
  // Σ m times the displacement by contacts and grips, carried through the iterations as the solver carries positions.
  // Divided by dt it is their impulse.
  Vec3 pushed;
  const bool accelerated = parameters.acceleration == Acceleration::chebyshev;
  Chebyshev chebyshev(kdt2);

  for (int32_t i = 0; i < n; ++i) {
    y[at(i)] = start[at(i)];
    if (!state.alive[at(i)]) continue;
    predicted[at(i)] = start[at(i)] + dt * state.v[at(i)] + (dt * dt) * parameters.gravity;
    side[at(i)] = contacts.side(start[at(i)]);
    state.x[at(i)] = held.yes[at(i)] ? start[at(i)] + held.displacement[at(i)]
                                     : contacts.project_with_friction(predicted[at(i)], side[at(i)], start[at(i)]);
    pushed += body.mass[at(i)] * (state.x[at(i)] - predicted[at(i)]);
    predicted_ahead[at(i)] = ahead.of(predicted[at(i)], start[at(i)]);
    y[at(i)] = ahead.of(state.x[at(i)], start[at(i)]);
  }

  std::vector<Vec3> earlier = y;  // one iteration ago
  Vec3 pushed_earlier = pushed;
  for (int32_t iteration = 0; iteration < iterations; ++iteration) {
    const std::vector<Pose> poses = match_shapes(body, parameters.volume_share, memberships, y, state.clusters);
    const std::vector<Vec3> now = y;
    Vec3 pushed_now;
    for (int32_t i = 0; i < n; ++i) {
      if (!state.alive[at(i)]) continue;
      const Vec3 g = goal(body, parameters.volume_share, memberships, state.clusters, poses, i, now[at(i)]);
      const Vec3 from = implicit ? predicted_ahead[at(i)] : now[at(i)];
      const Vec3 plain_ahead = from + s * (g - from);
      const Vec3 free_ahead = accelerated ? chebyshev.combine(plain_ahead, now[at(i)], earlier[at(i)]) : plain_ahead;
      const Vec3 plain = ahead.back(plain_ahead, start[at(i)]), free = ahead.back(free_ahead, start[at(i)]);
      const Vec3 x = state.x[at(i)];
      Vec3 next = x;  // a grip holds its particles in place
      if (!held.yes[at(i)]) {
        next = contacts.next_position(free, side[at(i)], start[at(i)], x);
        // Of several fixed points the path decides; touched particles follow the plain iteration.
        if (accelerated && contacts.path_matters()) {
          const bool touched = contacts.touches(free, side[at(i)]) || contacts.touches(plain, side[at(i)]);
          if (touched) next = contacts.next_position(plain, side[at(i)], start[at(i)], x);
        }
      }
      pushed_now += body.mass[at(i)] * (next - free);
      state.x[at(i)] = next;
      y[at(i)] = ahead.of(next, start[at(i)]);
    }
    // Σ m x changes exactly so: the implicit solver draws it to x~ by 1 - s, and acceleration combines sums as it
    // combines positions.
    Vec3 carried = (implicit ? s : 1.0) * pushed;
    if (accelerated) carried = chebyshev.combine(carried, pushed, pushed_earlier);
    pushed_earlier = pushed;
    pushed = carried + pushed_now;
    earlier = now;
    chebyshev.next();
  }

  const double decay = std::exp(-parameters.damping * dt);
  for (int32_t i = 0; i < n; ++i) {
    if (state.alive[at(i)]) state.v[at(i)] = (decay / dt) * (state.x[at(i)] - start[at(i)]);
  }
  state.impulse = decay * (state.impulse + pushed / dt);
}

}  // namespace

void step(const Setup& setup, State& state) {
  state.removed.clear();
  state.debris.clear();
  state.impulse = {};
  // Only iterations need containing clusters.
  const Memberships memberships =
      setup.step.iterations > 0 ? memberships_of(state.clusters, setup.body.particle_count()) : Memberships{};
  const double dt = setup.substep_length[at(state.frame)];
  for (int32_t s = 0; s < setup.step.substeps; ++s) {
    const bool is_last = s + 1 == setup.step.substeps;
    const int32_t iterations = setup.step.iterations - (is_last ? setup.withheld_iterations : 0);
    substep(setup, memberships, state.frame * setup.step.substeps + s, iterations, dt, state);
  }
}

}  // namespace cutproof::reference
