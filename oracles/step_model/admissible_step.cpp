#include "oracles/step_model/admissible_step.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <set>

#include "model/at.h"
#include "oracles/best_rotation.h"
#include "oracles/partitions.h"
#include "oracles/shape_sums.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

// Without growth: so many times the quadratic sum of single roundings is beyond what chance does, and below what
// disturbed runs would allow (tolerances.md, The step again).
constexpr double kSigmas = 4;
// Within so much of that nobody looks closer.
constexpr double kSurely = 0.5;
// Disturbed runs, from fixed seeds, and how much farther than the farthest of them a right answer may be.
constexpr uint64_t kDisturbedRuns = 8;
constexpr double kBeyondRuns = 4;
// Beyond this the way from a rounding to what it does is no longer straight [h].
constexpr double kSmall = 1e-3;
// What is decided by more than this is decided whatever rounds [h].
constexpr double kNear = 2e-3;
// Outcomes that are tried for one coupled set, and what they may cost in all [evaluations].
constexpr int kMostOutcomes = 1024;
constexpr int64_t kMostEvaluations = 2'000'000'000;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Farther than any bound where it is not a number.
double or_infinite(double x) { return std::isnan(x) ? kInfinite : x; }

// How far apart rotations put what is a unit away.
double apart(const Mat3& a, const Mat3& b) {
  double square = 0;
  for (std::size_t k = 0; k < 9; ++k) square += (a.m[k] - b.m[k]) * (a.m[k] - b.m[k]);
  return std::sqrt(square / 2);  // 2 sin(angle / 2)
}

// Bounds of one outcome.
struct Bounds {
  std::vector<double> position, velocity;  // [n] [m], [m/s] times dt
  std::vector<double> rotation;            // [m] [rad]
  double impulse = 0;                      // [kg m/s]
};

class Search {
 public:
  Search(const Setup& setup, const State& before, const State& after)
      : setup_(setup),
        before_(before),
        after_(after),
        h_(setup.body.grid.spacing),
        dt_(setup.substep_length[at(before.frame)]),
        model_(setup, before, std::max(unit_roundoff(before), unit_roundoff(after)) + kUnitRoundoff) {
    for (std::size_t i = 0; i < before.alive.size(); ++i) mass_ += before.alive[i] != 0 ? setup.body.mass[i] : 0;
    reach_.resize(at(before.clusters.count()));
    const WeightedRest rest = weighted_rest(setup.body, before.clusters);
    for (int32_t c = 0; c < before.clusters.count(); ++c) {
      const Vec3 center = cluster_means(rest, before.clusters, rest.position, c).rest;
      for (const int32_t i : before.clusters.of(c)) {
        reach_[at(c)] = std::max(reach_[at(c)], norm(rest.position[at(i)] - center));
      }
    }
    most_outcomes_ = static_cast<int>(
        std::clamp<int64_t>(kMostEvaluations / std::max<int64_t>(1, model_.evaluations()), 16, kMostOutcomes));
  }

  AdmissibleStep find() {
    Branch branch = start({});
    compare(branch);
    if (!(branch.worst <= kSurely)) {
      look_closer(branch);
      compare(branch);
    }
    if (!branch.holds() && !branch.ties.empty()) branch = explain(std::move(branch));
    return report(std::move(branch));
  }

 private:
  // One outcome, with what was found out about it.
  struct Branch {
    Settled settled;
    StepOutcome outcome;
    Bounds bounds;
    bool close = false;               // bounds are those of disturbed runs
    std::vector<NearDecision> ties;   // that rounding may take the other way; known once looked at closely
    std::vector<int32_t> violations;  // particles beyond their bounds, or of clusters that are
    double worst = -1;                // of measured / bound
    StepPart part = StepPart::position;
    int32_t where = -1;
    double measured = 0, bound = 0;
    bool holds() const { return worst <= 1; }
  };

  Branch start(Settled settled) {
    Branch branch;
    branch.settled = std::move(settled);
    branch.outcome = model_.run({branch.settled, 0, kNear * h_, {}});
    const StepOutcome& o = branch.outcome;
    Bounds& b = branch.bounds;
    for (const double square : o.rounding) {
      b.position.push_back(kSigmas * std::sqrt(square));
      b.velocity.push_back(2 * b.position.back());
    }
    for (int32_t c = 0; c < before_.clusters.count(); ++c) {
      double members = 0;
      for (const int32_t i : before_.clusters.of(c)) members = std::max(members, o.rounding[at(i)]);
      const double arm = std::max(reach_[at(c)], h_);
      b.rotation.push_back(kSigmas * std::sqrt(o.turn_rounding[at(c)] + members / (arm * arm)));
    }
    b.impulse = kSigmas * std::sqrt(o.impulse_rounding);
    return branch;
  }

  // What rounding does to this outcome, by disturbed runs that take the same decisions.
  void look_closer(Branch& branch) {
    const std::size_t n = before_.x.size(), m = reach_.size();
    Settled as_taken;
    for (const NearDecision& d : branch.outcome.near) as_taken[d.key] = d.taken;
    Bounds grown{std::vector<double>(n), std::vector<double>(n), std::vector<double>(m), 0};
    std::map<std::pair<DecisionKey, int>, double> leads, spread;
    for (const NearDecision& d : branch.outcome.near) {
      const auto key = std::pair(d.key, d.other);
      leads[key] = d.lead;
      spread[key] = 0;
    }
    for (uint64_t run = 1; run <= kDisturbedRuns; ++run) {
      const StepOutcome off = model_.run({as_taken, run, 2 * kNear * h_, {}});
      for (std::size_t i = 0; i < n; ++i) {
        grown.position[i] = std::max(grown.position[i], or_infinite(norm(off.x[i] - branch.outcome.x[i])));
        grown.velocity[i] = std::max(grown.velocity[i], or_infinite(norm(off.v[i] - branch.outcome.v[i])));
      }
      for (std::size_t c = 0; c < m; ++c) {
        grown.rotation[c] =
            std::max(grown.rotation[c], or_infinite(apart(off.rotation[c], branch.outcome.rotation[c])));
      }
      grown.impulse = std::max(grown.impulse, or_infinite(norm(off.impulse - branch.outcome.impulse)));
      for (const NearDecision& d : off.near) {
        const auto known = leads.find({d.key, d.other});
        if (known == leads.end()) continue;
        double& s = spread[known->first];
        s = std::max(s, std::abs(d.lead - known->second));
      }
    }
    Bounds& b = branch.bounds;
    for (std::size_t i = 0; i < n; ++i) {
      b.position[i] = std::max(b.position[i], kBeyondRuns * grown.position[i]);
      b.velocity[i] = std::max(b.velocity[i], kBeyondRuns * grown.velocity[i] * dt_);
    }
    for (std::size_t c = 0; c < m; ++c) b.rotation[c] = std::max(b.rotation[c], kBeyondRuns * grown.rotation[c]);
    b.impulse = std::max(b.impulse, kBeyondRuns * grown.impulse);
    branch.close = true;
    branch.ties.clear();
    for (const NearDecision& d : branch.outcome.near) {
      if (branch.settled.contains(d.key)) continue;
      if (d.lead <= kBeyondRuns * spread.at({d.key, d.other})) branch.ties.push_back(d);
    }
    std::sort(branch.ties.begin(), branch.ties.end(),
              [](const NearDecision& p, const NearDecision& q) { return p.key < q.key; });
  }

  void see(Branch& branch, StepPart part, int32_t where, double measured, double bound) const {
    const double ratio = measured <= bound ? (bound > 0 ? measured / bound : 0) : kInfinite;
    const bool farther =
        ratio == kInfinite && branch.worst == kInfinite && measured * branch.bound > branch.measured * bound;
    if (!(ratio > branch.worst) && !farther) return;
    branch.worst = ratio;
    branch.part = part;
    branch.where = where;
    branch.measured = measured;
    branch.bound = bound;
  }

  void compare(Branch& branch) const {
    branch.violations.clear();
    branch.worst = -1;
    const StepOutcome& o = branch.outcome;
    const Bounds& b = branch.bounds;
    std::vector<uint8_t> violates(before_.x.size(), 0);
    for (std::size_t i = 0; i < violates.size(); ++i) {
      if (before_.alive[i] == 0) continue;
      const double off = or_infinite(norm(after_.x[i] - o.x[i]));
      const double fast = or_infinite(norm(after_.v[i] - o.v[i]) * dt_);
      violates[i] = !(off <= b.position[i]) || !(fast <= b.velocity[i]);
      see(branch, StepPart::position, static_cast<int32_t>(i), off / h_, b.position[i] / h_);
      see(branch, StepPart::velocity, static_cast<int32_t>(i), fast / h_, b.velocity[i] / h_);
    }
    for (int32_t c = 0; c < before_.clusters.count(); ++c) {
      const double turned = or_infinite(apart(after_.clusters.rotation[at(c)], o.rotation[at(c)]));
      const double arm = std::max(reach_[at(c)], h_) / h_;
      see(branch, StepPart::rotation, c, turned * arm, b.rotation[at(c)] * arm);
      if (turned <= b.rotation[at(c)]) continue;
      for (const int32_t i : before_.clusters.of(c)) violates[at(i)] = 1;
    }
    const double impulse = or_infinite(norm(after_.impulse - o.impulse));
    const double per_mass = mass_ > 0 ? dt_ / (mass_ * h_) : 0;
    see(branch, StepPart::impulse, -1, impulse * per_mass, b.impulse * per_mass);
    for (std::size_t i = 0; i < violates.size(); ++i) {
      if (violates[i] != 0) branch.violations.push_back(static_cast<int32_t>(i));
    }
  }

  // Looks for decisions that explain what no rounding of the first outcome does: fewest violations first.
  Branch explain(Branch first) {
    const auto better = [](const Branch& a, const Branch& b) {
      if (a.holds() != b.holds()) return b.holds();
      if (a.violations.size() != b.violations.size()) return a.violations.size() > b.violations.size();
      return a.settled.size() > b.settled.size();
    };
    std::vector<Branch> open;
    std::set<Settled> seen = {first.settled};
    Branch best = first;
    int tried = 0;
    const auto try_out = [&](Settled settled) {
      if (tried >= most_outcomes_ || !seen.insert(settled).second) return;
      ++tried;
      Branch next = start(std::move(settled));
      next.bounds = first.bounds;  // until it is worth a closer look
      next.close = false;
      compare(next);
      if (next.holds() || next.violations.size() < best.violations.size()) {
        look_closer(next);
        compare(next);
      } else {
        next.ties = near_ties(next, first);
      }
      if (better(best, next)) best = next;
      open.push_back(std::move(next));
      std::push_heap(open.begin(), open.end(), better);
    };
    // Where particles ended tells on which side of the blade they were.
    if (const Settled led = sides_of(first); !led.empty()) try_out(led);
    open.push_back(first);
    std::push_heap(open.begin(), open.end(), better);
    while (!open.empty() && !best.holds() && tried < most_outcomes_) {
      std::pop_heap(open.begin(), open.end(), better);
      const Branch present = std::move(open.back());
      open.pop_back();
      std::vector<NearDecision> ties = present.ties;
      const std::set<int32_t> violating(present.violations.begin(), present.violations.end());
      std::stable_sort(ties.begin(), ties.end(), [&](const NearDecision& a, const NearDecision& b) {
        return violating.contains(a.key.particle) > violating.contains(b.key.particle);
      });
      for (const NearDecision& tie : ties) {
        Settled settled = present.settled;
        settled[tie.key] = tie.other;
        try_out(std::move(settled));
        if (best.holds()) break;
      }
    }
    const bool exhausted = best.holds() || open.empty();
    if (!best.close) {
      look_closer(best);
      compare(best);
    }
    if (!best.holds() && !exhausted) count_undecided(best);
    return best;
  }

  // Ties of an outcome that was not looked at closely: by the measure of one that was.
  std::vector<NearDecision> near_ties(const Branch& branch, const Branch& measure) const {
    std::vector<NearDecision> ties;
    for (const NearDecision& d : branch.outcome.near) {
      if (branch.settled.contains(d.key)) continue;
      if (d.lead <= 4 * measure.bounds.position[at(d.key.particle)]) ties.push_back(d);
    }
    return ties;
  }

  Settled sides_of(const Branch& branch) const {
    Settled led = branch.settled;
    const BladePose* pose = nullptr;
    if (setup_.has_blade) pose = &setup_.blade_moves[at((before_.frame + 1) * setup_.step.substeps - 1)].to;
    for (const NearDecision& d : branch.ties) {
      if (d.key.kind != DecisionKind::side || pose == nullptr) continue;
      const double height = dot(after_.x[at(d.key.particle)] - pose->edge, cross(pose->along, pose->back));
      led[d.key] = height < 0 ? 1 : 0;
    }
    return led;
  }

  // More ties than can be tried together: what violates must at least be within what they do one by one, added up.
  void count_undecided(Branch& branch) {
    std::vector<double> explained = branch.bounds.position;
    for (const NearDecision& tie : branch.ties) {
      Settled settled = branch.settled;
      settled[tie.key] = tie.other;
      const StepOutcome other = model_.run({settled, 0, kNear * h_, {}});
      for (std::size_t i = 0; i < explained.size(); ++i) explained[i] += norm(other.x[i] - branch.outcome.x[i]);
    }
    const auto is_explained = [&](int32_t i) {
      return or_infinite(norm(after_.x[at(i)] - branch.outcome.x[at(i)])) <= explained[at(i)];
    };
    if (!std::all_of(branch.violations.begin(), branch.violations.end(), is_explained)) return;
    undecided_ = static_cast<int64_t>(branch.violations.size());
  }

  AdmissibleStep report(Branch branch) const {
    AdmissibleStep found;
    found.part = branch.part;
    found.where = branch.where;
    found.measured = branch.measured;
    found.bound = branch.bound;
    found.holds = branch.holds() || undecided_ > 0;
    found.otherwise = static_cast<int64_t>(branch.settled.size());
    found.checked = std::count_if(before_.alive.begin(), before_.alive.end(), [](uint8_t a) { return a != 0; }) +
                    before_.clusters.count();
    found.undecided = undecided_;
    for (std::size_t i = 0; i < before_.alive.size(); ++i) {
      found.position_bound.push_back(branch.bounds.position[i] / h_);
      if (before_.alive[i] != 0 && found.position_bound.back() > kSmall && undecided_ == 0) ++found.undecided;
    }
    for (std::size_t c = 0; c < reach_.size(); ++c) {
      found.reach.push_back(std::max(reach_[c] / h_, 1.0));
      found.rotation_bound.push_back(branch.bounds.rotation[c] * found.reach.back());
    }
    found.outcome = std::move(branch.outcome);
    return found;
  }

  const Setup& setup_;
  const State &before_, &after_;
  const double h_, dt_;
  double mass_ = 0;
  StepModel model_;
  std::vector<double> reach_;  // [m] greatest |X - T|
  int most_outcomes_ = kMostOutcomes;
  int64_t undecided_ = 0;
};

}  // namespace

AdmissibleStep nearest_admissible_step(const Setup& setup, const State& before, const State& after) {
  return Search(setup, before, after).find();
}

}  // namespace cutproof::oracles
