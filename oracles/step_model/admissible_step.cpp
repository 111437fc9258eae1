#include "oracles/step_model/admissible_step.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>
#include <mutex>
#include <set>
#include <thread>

#include "model/at.h"
#include "oracles/best_rotation.h"
#include "oracles/contact.h"
#include "oracles/memberships.h"
#include "oracles/partitions.h"
#include "oracles/shape_sums.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

// Without growth: within this multiple of the quadratic sum of single roundings, a particle is accepted, because
// disturbed runs would allow more (tolerances.md, The step again).
constexpr double kSurely = 2;
// Part of the shared motion of clusters that remains where they overlap after it is subtracted once.
constexpr double kNotShared = 0.125;
// Disturbed runs, from fixed seeds; as many before anything is called wrong; and how much farther than the farthest of
// them a right answer may be.
constexpr uint64_t kDisturbedRuns = 8, kMostDisturbedRuns = 48;
constexpr double kBeyondRuns = 8;
// Bodies whose runs cost more than this [evaluations] have several concurrent runs, if there are processors. There are
// at most as many concurrent runs as are always made, because each takes some hundred bytes for each particle.
constexpr int64_t kLongRun = 2'000'000;
// Beyond this, the effect of a rounding is not linear [h].
constexpr double kSmall = 1e-3;
// Two rotations are not farther apart, but for the rounding of their entries (apart).
constexpr double kAnyRotation = 2 + 1e-4;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Farther than any bound where it is not a number.
double or_infinite(double x) { return std::isnan(x) ? kInfinite : x; }

// Distance of the images of a point at unit distance under both rotations.
double apart(const Mat3& a, const Mat3& b) {
  double square = 0;
  for (std::size_t k = 0; k < 9; ++k) square += (a.m[k] - b.m[k]) * (a.m[k] - b.m[k]);
  return std::sqrt(square / 2);  // 2 sin(angle / 2)
}

// Of one outcome: bounds, or how far another is from it.
struct Bounds {
  std::vector<double> position, velocity;          // [n] [m], [m/s] times dt
  std::vector<double> own_position, own_velocity;  // the same, less the shared motion of clusters
  std::vector<double> rotation;                    // [m] [rad]
  double impulse = 0;                              // [kg m/s]

  // Entry by entry: this = f(this, other).
  template <class F>
  void combine(const Bounds& other, F f) {
    const auto each = [&](std::vector<double>& mine, const std::vector<double>& theirs) {
      for (std::size_t k = 0; k < mine.size(); ++k) mine[k] = f(mine[k], theirs[k]);
    };
    each(position, other.position);
    each(velocity, other.velocity);
    each(own_position, other.own_position);
    each(own_velocity, other.own_velocity);
    each(rotation, other.rotation);
    impulse = f(impulse, other.impulse);
  }
};

class Judge {
 public:
  Judge(const Setup& setup, const State& before, const State& after, std::span<const RotationKnown> known_rotations,
        int at_once)
      : setup_(setup),
        before_(before),
        after_(after),
        known_(known_rotations.begin(), known_rotations.end()),
        h_(setup.body.grid.spacing),
        dt_(setup.substep_length[at(before.frame)]),
        model_(setup, before, std::max(unit_roundoff(before), unit_roundoff(after)) + kUnitRoundoff),
        coupled_(components_of_coupling(TissueGraph(setup.body, before.alive), before.clusters)),
        holders_(membership_counts(before.clusters, setup.body.particle_count())),
        reach_(at(before.clusters.count())),
        blunt_(before.x.size(), 0) {
    for (std::size_t i = 0; i < before.alive.size(); ++i) mass_ += before.alive[i] != 0 ? setup.body.mass[i] : 0;
    const WeightedRest rest = weighted_rest(setup.body, before.clusters);
    for (int32_t c = 0; c < before.clusters.count(); ++c) {
      const Vec3 center = cluster_means(rest, before.clusters, rest.position, c).rest;
      for (const int32_t i : before.clusters.of(c)) {
        reach_[at(c)] = std::max(reach_[at(c)], norm(rest.position[at(i)] - center));
      }
    }
    if (setup.has_blade) {
      const BladeMove& last = setup.blade_moves[at((before.frame + 1) * setup.step.substeps - 1)];
      const Contact contact(setup, &last, setup.walls);
      for (const Vec3 x : after.x) side_of_end_.push_back(contact.side_of_end(x, kSmall * h_));
    }
    at_once_ = at_once > 0 ? static_cast<uint64_t>(at_once)
               : model_.evaluations() <= kLongRun
                   ? 1
                   : std::clamp<uint64_t>(std::thread::hardware_concurrency(), 1, kDisturbedRuns);
  }

  // As closely as it takes.
  AdmissibleStep judge() {
    begin();
    compare();
    for (const uint64_t runs : {kDisturbedRuns, kMostDisturbedRuns}) {
      if (holds()) break;
      look_closer(runs);
      compare();
    }
    if (!holds() && hangs_on_unknown()) return nothing_known();
    if (!holds()) leave_open();
    return report();
  }

 private:
  bool holds() const { return worst_ <= 1; }

  // Whether the rotation of a cluster (by its place) was stated.
  bool is_known(std::size_t c) const { return known_.empty() || known_[c] == RotationKnown::yes; }
  // Whether the places of all violating particles depend on rotations that are not unique and not given.
  bool hangs_on_unknown() const {
    std::set<int32_t> sets;
    for (int32_t c = 0; c < before_.clusters.count(); ++c) {
      const bool is_any = !is_known(at(c)) && is_open(at(c)) && reach_[at(c)] > 0;
      if (is_any) sets.insert(coupled_.label[at(before_.clusters.of(c).front())]);
    }
    return !violations_.empty() && std::all_of(violations_.begin(), violations_.end(),
                                               [&](int32_t i) { return sets.contains(coupled_.label[at(i)]); });
  }
  AdmissibleStep nothing_known() const {
    AdmissibleStep found;
    found.checked = found.inconclusive = std::count(before_.alive.begin(), before_.alive.end(), 1);
    return found;
  }

  StepOutcome run(uint64_t disturbance, const std::vector<double>& open = {}) const {
    return model_.run({disturbance, open, side_of_end_, given_});
  }

  // The undisturbed run, and the sum of its single roundings as if none of them grew.
  void begin() {
    outcome_ = run(0);
    follow_rotations();
    const StepOutcome& o = outcome_;
    Bounds& b = bounds_;
    for (const double square : o.rounding) {
      b.position.push_back(kSurely * std::sqrt(square));
      b.velocity.push_back(2 * b.position.back());
    }
    std::vector<double> own = o.own_rounding;
    for (int32_t c = 0; c < before_.clusters.count(); ++c) {
      const auto members = before_.clusters.of(c);
      double sum = 0;
      for (const int32_t i : members) sum += o.rounding[at(i)];
      for (const int32_t i : members) {
        own[at(i)] += kNotShared * kNotShared * sum / static_cast<double>(members.size()) / holders_[at(i)];
      }
    }
    for (const double square : own) {
      b.own_position.push_back(kSurely * std::sqrt(square));
      b.own_velocity.push_back(2 * b.own_position.back());
    }
    for (int32_t c = 0; c < before_.clusters.count(); ++c) {
      double members = 0;
      for (const int32_t i : before_.clusters.of(c)) members = std::max(members, o.rounding[at(i)]);
      const double arm = std::max(reach_[at(c)], h_);
      const double turned = kSurely * std::sqrt(o.turn_rounding[at(c)] + members / (arm * arm));
      b.rotation.push_back(is_open(at(c)) ? agreed_bound(at(c)) : turned);
    }
    b.impulse = kSurely * std::sqrt(o.impulse_rounding);
  }

  // Where many rotations are the best in the last iteration, the one that the backend states is the right one, if it is
  // among them: everything else has to follow from it. True if there are new ones.
  bool follow_rotations() {
    const StepOutcome& o = outcome_;
    given_.resize(reach_.size(), nullptr);
    bool any = false;
    for (std::size_t c = 0; c < reach_.size(); ++c) {
      if (!is_open(c) || !is_known(c)) continue;
      if (!(off_agreed(o.shape[c], after_.clusters.rotation[c]) <= agreed_bound(c))) continue;
      given_[c] = &after_.clusters.rotation[c];
      any = true;
    }
    if (any) outcome_ = run(0);
    return any;
  }
  // Whether many rotations are the best in the last iteration, and the one that the backend states is not followed.
  bool is_open(std::size_t c) const { return outcome_.is_free[c] != 0 && given_[c] == nullptr; }
  // Deviation of a rotation from the common property of all best rotations of this shape: they turn v to u.
  static double off_agreed(const Mat3& shape, const Mat3& r) {
    const BestRotation best = best_rotation(shape);
    const Vec3 u = {best.u[0], best.u[1], best.u[2]}, v = {best.v[0], best.v[1], best.v[2]};
    return or_infinite(norm(r * v - u));
  }
  double agreed_bound(std::size_t c) const {
    const double rounding = std::sqrt(outcome_.turn_rounding[c]) + 4 * unit_roundoff(after_);
    return kBeyondRuns * std::max(rounding, direction_.empty() ? 0 : direction_[c]);
  }

  static constexpr auto kGreater = [](double a, double b) { return std::max(a, b); };

  // [n] How far apart particles are, less what their clusters share of it; and what taking that away rounds.
  struct Own {
    std::vector<double> lengths;
    double rounding = 0;
  };
  Own own(const std::vector<Vec3>& one, const std::vector<Vec3>& other, double unit) const {
    std::vector<Vec3> field(one.size());
    double greatest = 0;
    for (std::size_t i = 0; i < one.size(); ++i) {
      if (before_.alive[i] != 0) field[i] = unit * (one[i] - other[i]);
      greatest = std::max(greatest, or_infinite(norm(field[i])));
    }
    Own own;
    own.rounding = 64 * kUnitRoundoff * greatest;
    for (const Vec3& rest : model_.without_shared(field)) own.lengths.push_back(or_infinite(norm(rest)));
    return own;
  }

  Bounds off_by(const StepOutcome& one, const StepOutcome& other) const {
    Bounds off;
    for (std::size_t i = 0; i < one.x.size(); ++i) {
      off.position.push_back(or_infinite(norm(one.x[i] - other.x[i])));
      off.velocity.push_back(or_infinite(norm(one.v[i] - other.v[i]) * dt_));
    }
    for (std::size_t c = 0; c < reach_.size(); ++c) {
      off.rotation.push_back(or_infinite(apart(one.rotation[c], other.rotation[c])));
    }
    off.own_position = own(one.x, other.x, 1).lengths;
    off.own_velocity = own(one.v, other.v, dt_).lengths;
    off.impulse = or_infinite(norm(one.impulse - other.impulse));
    return off;
  }

  // The farthest that disturbed runs bring anything from the undisturbed one; of rotations that are free, from what all
  // best ones agree on too [rad].
  struct Spread {
    Bounds off;
    std::vector<double> direction;  // [m]
  };
  Spread spread_of(uint64_t runs, const std::vector<double>& open) const {
    Spread spread = {off_by(outcome_, outcome_), std::vector<double>(reach_.size(), 0)};
    std::mutex of_all_runs;
    const auto every = [&](uint64_t first) {
      for (uint64_t number = first; number <= runs; number += at_once_) {
        const StepOutcome off = run(number, open);
        const Bounds apart_now = off_by(off, outcome_);
        // The greatest of all is the same whichever comes first.
        const std::lock_guard<std::mutex> lock(of_all_runs);
        spread.off.combine(apart_now, kGreater);
        for (std::size_t c = 0; c < reach_.size(); ++c) {
          if (outcome_.is_free[c] == 0) continue;
          spread.direction[c] = std::max(spread.direction[c], off_agreed(outcome_.shape[c], off.rotation[c]));
        }
      }
    };
    std::vector<std::future<void>> others;
    for (uint64_t first = 2; first <= at_once_; ++first) others.push_back(std::async(every, first));
    every(1);
    for (std::future<void>& other : others) other.get();
    return spread;
  }

  // The effect of rounding on this outcome.
  void look_closer(uint64_t runs) {
    Spread spread = spread_of(runs, {});
    bounds_.combine(spread.off, [](double, double farthest) { return kBeyondRuns * farthest; });
    direction_ = std::move(spread.direction);
    // Runs choose freely where the rotation is open: that bounds nothing.
    for (std::size_t c = 0; c < reach_.size(); ++c) {
      if (is_open(c)) bounds_.rotation[c] = agreed_bound(c);
    }
    if (follow_rotations()) return look_closer(runs);
    let_go();
    ask_bluntly();
  }

  // A decision that rounding may have taken the other way changes where all that is coupled with the particle ends.
  // What is wrong there is what runs that draw such decisions do not explain; all else of these sets is inconclusive.
  void leave_open() {
    std::set<int32_t> open_sets;
    std::vector<double> open(before_.x.size(), -1);
    for (std::size_t i = 0; i < open.size(); ++i) {
      if (before_.alive[i] == 0 || !(outcome_.lead[i] <= bounds_.position[i])) continue;
      open[i] = bounds_.position[i];
      open_sets.insert(coupled_.label[i]);
    }
    if (open_sets.empty()) return;
    const Bounds drawn = spread_of(kMostDisturbedRuns, open).off;
    const auto widen = [](double& bound, double farthest) { bound = std::max(bound, kBeyondRuns * farthest); };
    widen(bounds_.impulse, drawn.impulse);
    for (std::size_t i = 0; i < open.size(); ++i) {
      if (before_.alive[i] == 0 || !open_sets.contains(coupled_.label[i])) continue;
      widen(bounds_.position[i], drawn.position[i]);
      widen(bounds_.velocity[i], drawn.velocity[i]);
      widen(bounds_.own_position[i], drawn.own_position[i]);
      widen(bounds_.own_velocity[i], drawn.own_velocity[i]);
    }
    for (int32_t c = 0; c < before_.clusters.count(); ++c) {
      const auto members = before_.clusters.of(c);
      if (!members.empty() && open_sets.contains(coupled_.label[at(members.front())]) && !is_open(at(c)))
        widen(bounds_.rotation[at(c)], drawn.rotation[at(c)]);
    }
    ask_bluntly();
    for (const int32_t i : violations_) {
      if (open_sets.contains(coupled_.label[at(i)])) blunt_[at(i)] = 1;
    }
    is_undecided_ = true;
    compare();
  }

  // A particle held by a contact does not move until it slips or comes off, and the disturbed runs may not have reached
  // that point. If the bounds of its neighbours exceed its hold, it gets their bound.
  void let_go() {
    Bounds& b = bounds_;
    const auto widest = [&](const std::vector<double>& bound, int32_t c) {
      double most = 0;
      for (const int32_t i : before_.clusters.of(c)) most = std::max(most, bound[at(i)]);
      return most;
    };
    const Bounds known = b;
    for (int32_t c = 0; c < before_.clusters.count(); ++c) {
      const double beside = widest(known.position, c), fast = widest(known.velocity, c);
      const double own_beside = widest(known.own_position, c), own_fast = widest(known.own_velocity, c);
      for (const int32_t i : before_.clusters.of(c)) {
        if (!(outcome_.hold[at(i)] < beside)) continue;
        b.position[at(i)] = std::max(b.position[at(i)], beside);
        b.velocity[at(i)] = std::max(b.velocity[at(i)], fast);
        b.own_position[at(i)] = std::max(b.own_position[at(i)], own_beside);
        b.own_velocity[at(i)] = std::max(b.own_velocity[at(i)], own_fast);
      }
    }
  }

  // Where rounding grows so far that small changes are no rule any more, all that is coupled gets one coarse bound: the
  // widest of any of it. Rotations there are not asked for.
  void ask_bluntly() {
    Bounds& b = bounds_;
    const std::size_t sets = at(coupled_.count) + 1;
    std::vector<double> far(sets, 0);
    for (std::size_t i = 0; i < before_.x.size(); ++i) {
      if (before_.alive[i] == 0) continue;
      const std::size_t set = at(coupled_.label[i]);
      far[set] = std::max({far[set], b.position[i], b.velocity[i]});
      if (!(b.position[i] <= kSmall * h_)) blunt_[i] = 1;
    }
    double pushed = 0;
    for (std::size_t i = 0; i < before_.x.size(); ++i) {
      if (blunt_[i] == 0) continue;
      const std::size_t set = at(coupled_.label[i]);
      b.position[i] = far[set];
      b.velocity[i] = far[set];
      pushed += setup_.body.mass[i] * b.velocity[i];
    }
    for (std::size_t c = 0; c < reach_.size(); ++c) {
      const auto members = before_.clusters.of(static_cast<int32_t>(c));
      const bool any_wide = std::any_of(members.begin(), members.end(), [&](int32_t i) { return blunt_[at(i)] != 0; });
      if (any_wide) b.rotation[c] = kAnyRotation;
    }
    b.impulse += pushed / dt_;
  }

  // Of a particle's velocity nothing sharp is asked, or of its place neither.
  bool is_blunt(std::size_t i) const { return blunt_[i] != 0 || !(bounds_.velocity[i] <= kSmall * h_); }

  // A quantity with a coarse bound counts as inconclusive where it holds, and does not count in the sharpness of the
  // judge.
  void see(StepPart part, int32_t where, double measured, double bound, bool blunt = false) {
    if (blunt && measured <= bound) return;
    const double ratio = measured <= bound ? (bound > 0 ? measured / bound : 0) : kInfinite;
    const bool farther = ratio == kInfinite && worst_ == kInfinite && measured * bound_ > measured_ * bound;
    if (!(ratio > worst_) && !farther) return;
    worst_ = ratio;
    part_ = part;
    where_ = where;
    measured_ = measured;
    bound_ = bound;
  }

  void compare() {
    violations_.clear();
    worst_ = -1;
    measured_ = bound_ = 0;
    const StepOutcome& o = outcome_;
    const Bounds& b = bounds_;
    std::vector<uint8_t> violates(before_.x.size(), 0);
    for (std::size_t i = 0; i < violates.size(); ++i) {
      if (before_.alive[i] == 0) continue;
      const double off = or_infinite(norm(after_.x[i] - o.x[i]));
      const double fast = or_infinite(norm(after_.v[i] - o.v[i]) * dt_);
      violates[i] = !(off <= b.position[i]) || !(fast <= b.velocity[i]);
      see(StepPart::position, static_cast<int32_t>(i), off / h_, b.position[i] / h_, blunt_[i] != 0);
      see(StepPart::velocity, static_cast<int32_t>(i), fast / h_, b.velocity[i] / h_, is_blunt(i));
    }
    for (int32_t c = 0; c < before_.clusters.count(); ++c) {
      if (!is_known(at(c))) continue;
      const Mat3& r = after_.clusters.rotation[at(c)];
      const double turned = is_open(at(c)) ? off_agreed(o.shape[at(c)], r) : or_infinite(apart(r, o.rotation[at(c)]));
      const double arm = std::max(reach_[at(c)], h_) / h_;
      see(StepPart::rotation, c, turned * arm, b.rotation[at(c)] * arm, !(b.rotation[at(c)] * arm <= kSmall));
      if (turned <= b.rotation[at(c)]) continue;
      for (const int32_t i : before_.clusters.of(c)) violates[at(i)] = 1;
    }
    const double impulse = or_infinite(norm(after_.impulse - o.impulse));
    const double per_mass = mass_ > 0 ? dt_ / (mass_ * h_) : 0;
    see(StepPart::impulse, -1, impulse * per_mass, b.impulse * per_mass, !(b.impulse * per_mass <= kSmall));
    if (worst_ <= 1) compare_own(violates);
    for (std::size_t i = 0; i < violates.size(); ++i) {
      if (violates[i] != 0) violations_.push_back(static_cast<int32_t>(i));
    }
  }

  // Rounding that members of a cluster have in common, as of its rotation and its center, is much more than what each
  // of them has alone. So what is wrong with one of them shows in what is left without it; unless what they share is
  // that of one that is only asked bluntly.
  void compare_own(std::vector<uint8_t>& violates) {
    const StepOutcome& o = outcome_;
    const Bounds& b = bounds_;
    const Own off = own(after_.x, o.x, 1), fast = own(after_.v, o.v, dt_);
    std::vector<uint8_t> shares = blunt_;  // with one that is asked bluntly, or is one
    for (int32_t c = 0; c < before_.clusters.count(); ++c) {
      const auto members = before_.clusters.of(c);
      if (std::none_of(members.begin(), members.end(), [&](int32_t i) { return blunt_[at(i)] != 0; })) continue;
      for (const int32_t i : members) shares[at(i)] = 1;
    }
    for (std::size_t i = 0; i < violates.size(); ++i) {
      if (before_.alive[i] == 0 || shares[i] != 0) continue;
      const double place = b.own_position[i] + off.rounding, speed = b.own_velocity[i] + fast.rounding;
      if (!(off.lengths[i] <= place) || !(fast.lengths[i] <= speed)) violates[i] = 1;
      see(StepPart::own_position, static_cast<int32_t>(i), off.lengths[i] / h_, place / h_);
      see(StepPart::own_velocity, static_cast<int32_t>(i), fast.lengths[i] / h_, speed / h_);
    }
  }

  AdmissibleStep report() {
    AdmissibleStep found;
    found.part = part_;
    found.where = where_;
    found.measured = measured_;
    found.bound = bound_;
    found.holds = holds();
    found.otherwise = std::count_if(given_.begin(), given_.end(), [](const Mat3* r) { return r != nullptr; });
    found.checked = std::count_if(before_.alive.begin(), before_.alive.end(), [](uint8_t a) { return a != 0; }) +
                    before_.clusters.count();
    found.inconclusive = is_undecided_ ? 1 : 0;
    for (std::size_t i = 0; i < before_.alive.size(); ++i) {
      found.position_bound.push_back(bounds_.position[i] / h_);
      found.velocity_bound.push_back(bounds_.velocity[i] / h_);
      if (before_.alive[i] != 0 && is_blunt(i)) ++found.inconclusive;
    }
    for (std::size_t c = 0; c < reach_.size(); ++c) {
      found.reach.push_back(std::max(reach_[c] / h_, 1.0));
      found.rotation_bound.push_back(bounds_.rotation[c] * found.reach.back());
      // As of positions: beyond this, nothing sharp was asked.
      const bool is_gone = !known_.empty() && known_[c] == RotationKnown::gone;
      if (is_gone) --found.checked;
      if (!is_gone && (!(found.rotation_bound.back() <= kSmall) || !is_known(c))) ++found.inconclusive;
    }
    found.outcome = std::move(outcome_);
    return found;
  }

  const Setup& setup_;
  const State &before_, &after_;
  const std::vector<RotationKnown> known_;  // [m] of the rotations that the step has left; empty: all are
  const double h_, dt_;
  double mass_ = 0;
  const StepModel model_;
  const Partition coupled_;
  const std::vector<int32_t> holders_;  // [n] clusters of a particle
  std::vector<double> reach_;           // [m] greatest |X - T|
  std::vector<int> side_of_end_;        // [n] of the blade; empty: there is none
  uint64_t at_once_ = 1;                // disturbed runs
  StepOutcome outcome_;
  Bounds bounds_;
  std::vector<const Mat3*> given_;   // [m] rotations of the last iteration that the backend had to choose
  std::vector<double> direction_;    // [m] how far rounding turns what all best rotations agree on; empty: not known
  std::vector<uint8_t> blunt_;       // [n] 1: only asked bluntly
  std::vector<int32_t> violations_;  // particles beyond their bounds, or of clusters that are
  bool is_undecided_ = false;        // by the effect of drawn decisions
  double worst_ = -1;                // of measured / bound
  StepPart part_ = StepPart::position;
  int32_t where_ = -1;
  double measured_ = 0, bound_ = 0;
};

}  // namespace

AdmissibleStep nearest_admissible_step(const Setup& setup, const State& before, const State& after,
                                       std::span<const RotationKnown> known_rotations, int at_once) {
  return Judge(setup, before, after, known_rotations, at_once).judge();
}

}  // namespace cutproof::oracles
