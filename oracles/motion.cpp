// How far a step moved the body, held against the velocities and impulses that the states name (method.md §3; bounds:
// tolerances.md, Motion).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "oracles/checks.h"
#include "oracles/pushes.h"
#include "oracles/rounding.h"
#include "oracles/totals.h"

namespace cutproof::oracles {
namespace {

class Motion {
 public:
  Motion(const StageRun& run, Verdict& verdict)
      : run_(run),
        setup_(run.setup),
        before_(run.before),
        after_(run.after),
        verdict_(verdict),
        h_(setup_.body.grid.spacing),
        dt_(setup_.substep_length[at(before_.frame)]),
        decay_(std::exp(-setup_.step.damping * dt_)),
        u_(std::max(unit_roundoff(before_), unit_roundoff(after_))),
        stored_(std::max(unit_of_places(before_), unit_of_places(after_))) {}

  void judge() {
    if (setup_.step.substeps == 1) judge_single_substep();
    judge_held();
    judge_centre();
  }

 private:
  Vec3 displacement(const State& state, std::size_t i) const {
    return state.x[i] - setup_.body.rest_position(static_cast<int32_t>(i));
  }
  double stored(std::size_t i) const { return 4 * stored_ * (norm(before_.x[i]) + norm(after_.x[i])); }

  // [m] off by `distance`, of which rounding explains `bound`.
  template <class Text>
  void compare(double distance, double bound, std::vector<int32_t> particles, Text text) {
    ++verdict_.checked;
    const bool holds = distance <= bound && std::isfinite(bound);
    const double ratio = holds ? (bound > 0 ? distance / bound : 0) : std::numeric_limits<double>::infinity();
    if (verdict_.holds && (ratio > worst_ || verdict_.checked == 1)) {
      worst_ = ratio;
      verdict_.measured = distance / h_;
      verdict_.bound = bound / h_;
      if (!holds) verdict_.witness = {{}, std::move(particles), {}, text()};
    }
    verdict_.holds = verdict_.holds && holds;
  }

  void judge_single_substep() {
    for (std::size_t i = 0; i < before_.alive.size(); ++i) {
      if (before_.alive[i] == 0) continue;
      const Vec3 moved = after_.x[i] - before_.x[i], expected = (dt_ / decay_) * after_.v[i];
      const double rounding = 8 * u_ * norm(moved) + stored(i);
      compare(norm(moved - expected), rounding, {static_cast<int32_t>(i)}, [&] {
        return fmt::format("particle {} moved by {:.6g} h in one substep, its velocity says {:.6g} h", i,
                           norm(moved) / h_, norm(expected) / h_);
      });
    }
  }

  void judge_held() {
    const int64_t substeps = setup_.step.substeps, first = before_.frame * substeps, last = first + substeps - 1;
    for (const Grip& grip : setup_.grips) {
      Vec3 path;
      double length = 0;
      bool throughout = true;
      for (int64_t s = first; s <= last; ++s) {
        throughout = throughout && grip.active[at(s)] != 0;
        path += grip.displacement[at(s)];
        length += norm(grip.displacement[at(s)]);
      }
      const Vec3 pull = grip.displacement[at(last)];
      for (const int32_t particle : grip.particles) {
        const std::size_t i = at(particle);
        if (before_.alive[i] == 0) continue;
        const double reach = norm(displacement(before_, i)) + norm(displacement(after_, i)) + length;
        const double rounding = 2 * u_ * static_cast<double>(substeps + 1) * reach +
                                static_cast<double>(substeps) * (stored(i) + 4 * stored_ * length);
        if (throughout) {
          compare(norm(after_.x[i] - before_.x[i] - path), rounding, {particle}, [&] {
            return fmt::format("particle {} is held and should have moved by {:.6g} h, it moved by {:.6g} h", particle,
                               norm(path) / h_, norm(after_.x[i] - before_.x[i]) / h_);
          });
        }
        if (grip.active[at(last)] != 0) {
          compare(norm((dt_ / decay_) * after_.v[i] - pull), rounding + 8 * u_ * norm(pull), {particle}, [&] {
            return fmt::format(
                "particle {} is held and moved by {:.6g} h in the last substep, its velocity says {:.6g}", particle,
                norm(pull) / h_, norm((dt_ / decay_) * after_.v[i]) / h_);
          });
        }
      }
    }
  }

  // With x_s = x_(s−1) + dt (V_(s−1) + dt g + J_s / M) and V_s = D (V_(s−1) + dt g + J_s / M), an impulse that counts
  // as I_s in the state has moved the centre by a_s I_s, a_s = dt / M · (1 + D + … + D^(S−s)) / D^(S−s+1), which is
  // greatest for the first substep and least for the last.
  void judge_centre() {
    const Totals totals = totals_of(setup_.body, before_, before_.alive);
    const auto mass = static_cast<double>(totals.mass);
    if (!(mass > 0)) return;
    const Vec3 start = totals.center(), end = totals_of(setup_.body, after_, before_.alive).center();
    const int32_t substeps = setup_.step.substeps;
    Vec3 moved, velocity = totals.total_momentum() / mass;
    double powers = 0, decay = 1;  // 1 + D + … and D^k
    for (int32_t s = 0; s < substeps; ++s) {
      moved += dt_ * (velocity + dt_ * setup_.step.gravity);
      velocity = decay_ * (velocity + dt_ * setup_.step.gravity);
      powers += decay;
      decay *= decay_;
    }
    const double earliest = dt_ * powers / (decay * mass);
    const double latest = dt_ / (decay_ * mass);
    // Each substep's mean velocity is off by as much as the momentum of the frame may be (Linear momentum).
    Verdict linear;
    check_momentum(run_, linear);
    const double rounding =
        2 * substeps * dt_ / decay * linear.bound / mass +
        8 * unit_roundoff(Precision::binary64) * (norm(start) + norm(end)) +
        2 * substeps * std::max(before_.place_rounding, after_.place_rounding);  // of each place that is stored
    const std::array<Pushes, 3> pushes = pushes_of(setup_, before_);
    for (int axis = 0; axis < 3; ++axis) {
      const double impulse = after_.impulse[axis];
      const Pushes from = pushes[at(axis)];
      if (from == Pushes::any) continue;
      const double least = std::min(latest * impulse, earliest * impulse);
      const double most = std::max(latest * impulse, earliest * impulse);
      const double beyond = end[axis] - start[axis] - moved[axis];
      const double off = std::isnan(beyond) ? beyond : std::max({least - beyond, beyond - most, 0.0});
      compare(off, rounding, {}, [&] {
        return fmt::format(
            "the centre of mass moved by {:.6g} h along axis {}; momentum and gravity account for {:.6g} h, and {} for "
            "{:.6g} to {:.6g} h",
            (end[axis] - start[axis]) / h_, axis, moved[axis] / h_,
            from == Pushes::none ? "an impulse that nothing can have given" : "contacts", least / h_, most / h_);
      });
    }
    if (setup_.walls.empty() && pushes[0] == Pushes::none) {
      compare(h_ * norm(after_.impulse), 0, {}, [&] {
        return fmt::format("the state names an impulse of {:.6g} kg m/s, but nothing touches the body",
                           norm(after_.impulse));
      });
    }
  }

  const StageRun& run_;
  const Setup& setup_;
  const State &before_, &after_;
  Verdict& verdict_;
  const double h_, dt_, decay_, u_;
  const double stored_;  // u of a place that is stored
  double worst_ = -1;
};

}  // namespace

void check_motion(const StageRun& run, Verdict& verdict) {
  if (run.before.frame < run.setup.frame_count()) return Motion(run, verdict).judge();
  verdict.vacuous = "the schedule is over";
}

}  // namespace cutproof::oracles
