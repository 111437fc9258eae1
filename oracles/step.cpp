// Conservation of linear momentum in one frame of the step stage, of all tissue and of each component.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "oracles/checks.h"
#include "oracles/pushes.h"
#include "oracles/rounding.h"
#include "oracles/shape_sums.h"
#include "oracles/totals.h"

namespace cutproof::oracles {
namespace {

// A part of the tissue over one frame, but for what contacts, pins and grips give it.
struct Balance {
  Totals before, after;
  Vec3 expected;      // momentum at the end: p is damped with v and gains M g dt in each substep
  double gained = 0;  // gravity's part of the magnitudes
  double squared_clusters = 0, squared_particles = 0;  // sums of squares of masses
  int64_t particles = 0;
  int32_t first = -1;  // particle
};

// The parts are those of `parts` (label -1: in none); every cluster lies within one of them.
std::vector<Balance> balances_of(const StageRun& run, const Partition& parts) {
  const Body& body = run.setup.body;
  const StepParameters& step = run.setup.step;
  const double dt = run.setup.substep_length[at(run.before.frame)], decay = std::exp(-step.damping * dt);
  std::vector<Balance> balances(at(parts.count));
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    if (parts.label[at(i)] < 0) continue;
    Balance& balance = balances[at(parts.label[at(i)])];
    const double m = body.mass[at(i)];
    balance.before.add(m, run.before.x[at(i)], run.before.v[at(i)]);
    balance.after.add(m, run.after.x[at(i)], run.after.v[at(i)]);
    balance.squared_particles += m * m;
    ++balance.particles;
    if (balance.first < 0) balance.first = i;
  }
  const WeightedRest rest = weighted_rest(body, run.before.clusters);
  for (int32_t c = 0; c < run.before.clusters.count(); ++c) {
    const auto members = run.before.clusters.of(c);
    if (members.empty() || parts.label[at(members.front())] < 0) continue;
    double mass = 0;
    for (const int32_t i : members) mass += rest.weight[at(i)];
    balances[at(parts.label[at(members.front())])].squared_clusters += mass * mass;
  }
  for (Balance& balance : balances) {
    const auto mass = static_cast<double>(balance.before.mass);
    balance.expected = balance.before.total_momentum();
    for (int32_t s = 0; s < step.substeps; ++s) {
      balance.expected = decay * (balance.expected + (mass * dt) * step.gravity);
      balance.gained += mass * dt * norm(step.gravity);
    }
  }
  return balances;
}

// The greatest operand in computing a goal: a stored place, or an arm of a cluster [m].
double stored_extent(const Setup& setup, const State& state) {
  double farthest = 0, arm = 0;
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (state.alive[at(i)] != 0) {
      farthest = std::max(farthest, norm(stored_place(setup.body, state.precision, i, state.x[at(i)])));
    }
  }
  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    for (const int32_t i : state.clusters.of(c)) {
      arm = std::max(arm, norm(setup.body.rest_position(i) - state.clusters.rest_center[at(c)]));
    }
  }
  return farthest + arm;
}

// How far rounding may put the momentum off (tolerances.md, Linear momentum). Rounding errors of one sum are taken as
// independent (Higham and Mary 2019): λ √n instead of n, wrong with probability 2 exp(−λ² / 2) < 3e-14. Errors that
// stay the same from one iteration to the next (of T_c and M_c) are not: they count linearly.
class MomentumRounding {
 public:
  explicit MomentumRounding(const StageRun& run)
      : step_(run.setup.step),
        scale_(rounding_scale(run.setup, run.before)),
        u_(unit_roundoff(run.after)),
        // With retardation evaluations are of y, and enter x times σ: of σ |y| <= |x| + |x_prev|.
        length_((step_.retardation > 0 ? 2 : 1) * u_ *
                    std::max(stored_extent(run.setup, run.before), stored_extent(run.setup, run.after)) +
                std::max(unit_of_places(run.before), unit_of_places(run.after)) *
                    std::max(scale_.extent, rounding_scale(run.setup, run.after).extent)),
        dt_(run.setup.substep_length[at(run.before.frame)]) {}

  // `impulse`: the total of contacts, pins and grips.
  double bound(const Balance& balance, double impulse) const {
    const double magnitude =
        static_cast<double>(balance.before.speed) + static_cast<double>(balance.after.speed) + balance.gained + impulse;
    const double goal =
        std::sqrt(2.0 * static_cast<double>(scale_.largest_cluster) + 16) * std::sqrt(balance.squared_clusters) +
        std::sqrt(scale_.most_memberships + 16.0) * std::sqrt(balance.squared_particles);
    const double evaluations = step_.substeps * (step_.iterations + 1.0) * error_growth(step_);
    const double sums = std::sqrt(static_cast<double>(balance.particles) * evaluations) + 16 * step_.substeps;
    return kDeviations * (evaluations * goal * length_ / dt_ + sums * u_ * magnitude);
  }

 private:
  const StepParameters& step_;
  RoundingScale scale_;
  double u_, length_, dt_;
};

bool schedule_is_over(const StageRun& run, Verdict& verdict) {
  const bool over = run.before.frame < 0 || run.before.frame >= run.setup.frame_count();
  if (over) verdict.vacuous = "the schedule is over";
  return over;
}

}  // namespace

// Contacts, pins and grips give J, which the state adds up with the same damping. So p after S substeps is
// D^S p + M g dt (D + … + D^S) + I, with D = e^(−c dt).
void check_momentum(const StageRun& run, Verdict& verdict) {
  if (schedule_is_over(run, verdict)) return;
  Partition whole{std::vector<int32_t>(run.before.alive.size(), -1), 1};
  for (std::size_t i = 0; i < whole.label.size(); ++i) {
    if (run.before.alive[i] != 0) whole.label[i] = 0;
  }
  const Balance balance = balances_of(run, whole).front();
  const Vec3 expected = balance.expected + run.after.impulse;
  verdict.measured = norm(balance.after.total_momentum() - expected);
  verdict.checked = balance.particles;
  verdict.bound = MomentumRounding(run).bound(balance, norm(run.after.impulse));
  if (verdict.measured <= verdict.bound) return;
  const Vec3 p = balance.before.total_momentum(), q = balance.after.total_momentum();
  fail(
      verdict, {},
      "the frame began with momentum ({}, {}, {}), gravity and contacts account for ({}, {}, {}) at its end, and it is "
      "({}, {}, {}) kg m/s",
      p.x, p.y, p.z, figure_beside(expected.x, q.x), figure_beside(expected.y, q.y), figure_beside(expected.z, q.z),
      figure_beside(q.x, expected.x), figure_beside(q.y, expected.y), figure_beside(q.z, expected.z));
}

// No force joins separate components, and the clusters of a component pull at that component alone, so the momentum of
// each component balances. Only the whole body's impulse is known, so this is asked of components that no grip holds,
// along each axis on which nothing has pushed: nothing can, or all that can pushes to one side and the impulse is 0.
void check_component_momentum(const StageRun& run, Verdict& verdict) {
  if (schedule_is_over(run, verdict)) return;
  const Partition components = components_of_graph(TissueGraph(run.setup.body, run.before.alive));
  if (components.count < 2) return;
  const std::array<Pushes, 3> pushes = pushes_on_free(run.setup, run.before);
  std::vector<uint8_t> held(at(components.count), 0);
  for (const Grip& grip : run.setup.grips) {
    if (!holds_in(run.setup, grip, run.before.frame)) continue;
    for (const int32_t i : grip.particles) {
      if (components.label[at(i)] >= 0) held[at(components.label[at(i)])] = 1;
    }
  }
  const MomentumRounding rounding(run);
  double worst = -1;
  for (const Balance& balance : balances_of(run, components)) {
    if (held[at(components.label[at(balance.first)])] != 0) continue;
    const double bound = rounding.bound(balance, 0);
    const Vec3 off = balance.after.total_momentum() - balance.expected;
    for (int axis = 0; axis < 3; ++axis) {
      if (pushes[at(axis)] == Pushes::any || (pushes[at(axis)] != Pushes::none && run.after.impulse[axis] != 0))
        continue;
      ++verdict.checked;
      const double measured = std::abs(off[axis]);
      const double ratio = measured <= bound ? measured / bound : std::numeric_limits<double>::infinity();
      if (ratio <= worst) continue;
      worst = ratio;
      verdict.measured = measured;
      verdict.bound = bound;
      if (measured <= bound) continue;
      fail(verdict, {{}, {balance.first}},
           "the component of particle {} ({} particles, one of {} components) ends the frame with momentum {} kg m/s "
           "along axis {}; without a force from outside it would be {}",
           balance.first, balance.particles, components.count,
           figure_beside(balance.after.total_momentum()[axis], balance.expected[axis]), axis,
           figure_beside(balance.expected[axis], balance.after.total_momentum()[axis]));
    }
  }
}

}  // namespace cutproof::oracles
