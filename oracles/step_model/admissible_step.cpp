#include "oracles/step_model/admissible_step.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <future>
#include <initializer_list>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "model/at.h"
#include "oracles/best_rotation.h"
#include "oracles/blade_motion.h"
#include "oracles/memberships.h"
#include "oracles/partitions.h"
#include "oracles/shape_sums.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

// Without growth: within so much of the quadratic sum of single roundings nobody looks closer, because disturbed runs
// would allow more (tolerances.md, The step again).
constexpr double kSurely = 2;
// Of what clusters share, so much is left where they overlap when it is taken away once.
constexpr double kNotShared = 0.125;
// Disturbed runs, from fixed seeds; as many before anything is called wrong; and how much farther than the farthest of
// them a right answer may be.
constexpr uint64_t kDisturbedRuns = 8, kMostDisturbedRuns = 48;
constexpr double kBeyondRuns = 8;
// Of bodies whose runs cost more than this [evaluations] several go at the same time, where there are processors for
// them: at most as many as are always made, since each takes some hundred bytes for each particle.
constexpr int64_t kLongRun = 2'000'000;
// Beyond this the way from a rounding to what it does is no longer straight [h].
constexpr double kSmall = 1e-3;
// What is decided by more than this is decided whatever rounds [h].
constexpr double kNear = 2e-3;
// Outcomes that are tried for one coupled set, and what they may cost in all [evaluations].
constexpr int kMostOutcomes = 1024;
constexpr int64_t kMostEvaluations = 20'000'000;
// Particles whose own ways are looked through, and how many ways of each.
constexpr std::size_t kFollowed = 4, kMostWays = 128;
// So many particles at most are few enough to look for the ways that they have gone together, and so many ways of each.
constexpr std::size_t kFew = 12, kWaysOfFew = 16;
// How often a fit goes through all ties; it ends when none brings it nearer.
constexpr int kFitPasses = 32;

// Two rotations are not farther apart, but for the rounding of their entries (apart).
constexpr double kAnyRotation = 2 + 1e-4;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Farther than any bound where it is not a number.
double or_infinite(double x) { return std::isnan(x) ? kInfinite : x; }

// How far apart rotations put what is a unit away.
double apart(const Mat3& a, const Mat3& b) {
  double square = 0;
  for (std::size_t k = 0; k < 9; ++k) square += (a.m[k] - b.m[k]) * (a.m[k] - b.m[k]);
  return std::sqrt(square / 2);  // 2 sin(angle / 2)
}

// Of one outcome: bounds, or how far another is from it.
struct Bounds {
  std::vector<double> position, velocity;          // [n] [m], [m/s] times dt
  std::vector<double> own_position, own_velocity;  // the same, less what clusters share
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

// What is coupled, alone, as far as it moves: all else is dead, and has no clusters.
struct CoupledSet {
  State before, after;
  std::vector<int32_t> clusters;  // which of all they are

  CoupledSet(const State& before_all, const State& after_all, const Partition& coupled, int32_t set)
      : before(kinematics_of(before_all)), after(kinematics_of(after_all)) {
    for (std::size_t i = 0; i < before.alive.size(); ++i) {
      before.alive[i] = after.alive[i] = coupled.label[i] == set ? 1 : 0;
    }
    for (int32_t c = 0; c < before_all.clusters.count(); ++c) {
      const auto members = before_all.clusters.of(c);
      if (members.empty() || coupled.label[at(members.front())] != set) continue;
      clusters.push_back(c);
      take(before_all.clusters, c, before.clusters);
      take(after_all.clusters, c, after.clusters);
    }
  }

 private:
  static State kinematics_of(const State& state) {
    State copy;
    copy.frame = state.frame;
    copy.x = state.x;
    copy.v = state.v;
    copy.alive = state.alive;
    copy.precision = state.precision;
    return copy;
  }
  static void take(const Clusters& from, int32_t c, Clusters& to) {
    const auto members = from.of(c);
    to.members.insert(to.members.end(), members.begin(), members.end());
    to.offsets.push_back(static_cast<int64_t>(to.members.size()));
    to.rotation.push_back(from.rotation[at(c)]);
  }
};

class Search {
 public:
  // `of_all`: of the whole body; else of one coupled set, of which nobody has stated the impulse.
  // `at_once`: as nearest_admissible_step() has it.
  Search(const Setup& setup, const State& before, const State& after, std::span<const RotationKnown> known_rotations,
         int at_once, bool of_all = true)
      : setup_(setup),
        before_(before),
        after_(after),
        known_(known_rotations.begin(), known_rotations.end()),
        of_all_(of_all),
        h_(setup.body.grid.spacing),
        dt_(setup.substep_length[at(before.frame)]),
        model_(setup, before, std::max(unit_roundoff(before), unit_roundoff(after)) + kUnitRoundoff) {
    for (std::size_t i = 0; i < before.alive.size(); ++i) mass_ += before.alive[i] != 0 ? setup.body.mass[i] : 0;
    holders_ = membership_counts(before.clusters, setup.body.particle_count());
    reach_.resize(at(before.clusters.count()));
    const WeightedRest rest = weighted_rest(setup.body, before.clusters);
    for (int32_t c = 0; c < before.clusters.count(); ++c) {
      const Vec3 center = cluster_means(rest, before.clusters, rest.position, c).rest;
      for (const int32_t i : before.clusters.of(c)) {
        reach_[at(c)] = std::max(reach_[at(c)], norm(rest.position[at(i)] - center));
      }
    }
    coupled_ = components_of_coupling(TissueGraph(setup.body, before.alive), before.clusters);
    const int64_t of_an_outcome = (kDisturbedRuns + 1) * std::max<int64_t>(1, model_.evaluations());
    most_outcomes_ = static_cast<int>(std::clamp<int64_t>(kMostEvaluations / of_an_outcome, 16, kMostOutcomes));
    at_once_ = at_once > 0 ? static_cast<uint64_t>(at_once)
               : model_.evaluations() <= kLongRun
                   ? 1
                   : std::clamp<uint64_t>(std::thread::hardware_concurrency(), 1, kDisturbedRuns);
  }

  AdmissibleStep find() {
    Branch branch = looked_at({});
    if (!branch.holds() && hangs_on_unknown(branch)) return nothing_known();
    if (!branch.holds() && !branch.ties.empty() && of_all_ && coupled_.count > 1) {
      Apart apart = settled_apart(branch);
      if (!apart.settled.empty()) branch = looked_at(std::move(apart.settled));
      if (!branch.holds() && apart.is_explained && apart.is_undecided) count_undecided(branch);
    }
    if (!branch.holds() && !branch.ties.empty()) branch = explain(std::move(branch));
    return report(std::move(branch));
  }

 private:
  // One outcome, with what was found out about it.
  struct Branch {
    Settled settled;
    std::vector<const Mat3*> given;  // [m] rotations of the last iteration that the backend had to choose
    std::vector<double> direction;   // [m] how far rounding turns what all best rotations agree on; empty: not known
    StepOutcome outcome;
    Bounds bounds;
    std::vector<uint8_t> blunt;       // [n] 1: only asked bluntly
    std::vector<NearDecision> ties;   // that rounding may take the other way, known once looked at closely; settled too
    std::vector<int32_t> violations;  // particles beyond their bounds, or of clusters that are
    double worst = -1;                // of measured / bound
    double left = 0;  // how far the backend is from it: squares, by what rounding explains (off_outcome)
    StepPart part = StepPart::position;
    int32_t where = -1;
    double measured = 0, bound = 0;
    bool is_forced = false;     // settled otherwise than rounding may: no admissible outcome
    bool is_undecided = false;  // holds by what ties do that are in doubt
    bool holds() const { return worst <= 1 && !is_forced; }
  };

  // As closely as it takes.
  Branch looked_at(Settled settled) {
    Branch branch = start(std::move(settled));
    compare(branch);
    for (const uint64_t runs : {kDisturbedRuns, kMostDisturbedRuns}) {
      if (branch.holds()) break;
      look_closer(branch, runs);
      compare(branch);
    }
    return branch;
  }

  // What is not coupled goes its way whatever the rest does: what a set decides is looked for in it alone, as long as
  // that explains it.
  struct Apart {
    Settled settled;
    bool is_explained = false;  // each set that violates
    bool is_undecided = false;  // one of them by what more decisions do than can be tried together
  };
  Apart settled_apart(const Branch& branch) const {
    std::set<int32_t> sets;
    for (const int32_t i : branch.violations) sets.insert(coupled_.label[at(i)]);
    Apart apart;
    for (const int32_t set : sets) {
      const CoupledSet alone(before_, after_, coupled_, set);
      std::vector<RotationKnown> known;
      for (const int32_t c : alone.clusters) known.push_back(known_.empty() ? RotationKnown::yes : known_[at(c)]);
      Search search(setup_, alone.before, alone.after, known, static_cast<int>(at_once_), false);
      Branch found = search.looked_at({});
      if (!found.holds() && !found.ties.empty()) found = search.explain(std::move(found));
      for (const auto& [key_alone, outcome] : found.settled) {
        DecisionKey key = key_alone;
        if (key.kind == DecisionKind::kept && key.turn >= 0) key.turn = alone.clusters[at(key.turn)];
        apart.settled[key] = outcome;
      }
      apart.is_explained = found.holds();
      apart.is_undecided = apart.is_undecided || found.is_undecided;
      if (!apart.is_explained) break;
    }
    return apart;
  }

  // Whether the rotation of a cluster (by its place) was stated.
  bool is_known(std::size_t c) const { return known_.empty() || known_[c] == RotationKnown::yes; }
  // Whether where all violating particles are hangs on rotations that could be any of many, and that nobody has stated.
  bool hangs_on_unknown(const Branch& branch) const {
    std::set<int32_t> sets;
    for (int32_t c = 0; c < before_.clusters.count(); ++c) {
      const bool is_any = !is_known(at(c)) && is_open(branch, at(c)) && reach_[at(c)] > 0;
      if (is_any) sets.insert(coupled_.label[at(before_.clusters.of(c).front())]);
    }
    return !sets.empty() && std::all_of(branch.violations.begin(), branch.violations.end(),
                                        [&](int32_t i) { return sets.contains(coupled_.label[at(i)]); });
  }
  AdmissibleStep nothing_known() const {
    AdmissibleStep found;
    found.checked = found.undecided = std::count(before_.alive.begin(), before_.alive.end(), 1);
    return found;
  }

  Branch start(Settled settled) {
    Branch branch;
    branch.settled = std::move(settled);
    branch.outcome = model_.run({branch.settled, 0, kNear * h_, {}});
    follow_rotations(branch);
    const StepOutcome& o = branch.outcome;
    Bounds& b = branch.bounds;
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
      b.rotation.push_back(is_open(branch, at(c)) ? agreed_bound(branch, at(c)) : turned);
    }
    b.impulse = kSurely * std::sqrt(o.impulse_rounding);
    return branch;
  }

  // Where many rotations are the best in the last iteration, the one that the backend states is the right one, if it is
  // among them: everything else has to follow from it. True if there are new ones.
  bool follow_rotations(Branch& branch) {
    const StepOutcome& o = branch.outcome;
    branch.given.resize(reach_.size(), nullptr);
    bool any = false;
    for (std::size_t c = 0; c < reach_.size(); ++c) {
      if (!is_open(branch, c) || !is_known(c)) continue;
      if (!(off_agreed(o.shape[c], after_.clusters.rotation[c]) <= agreed_bound(branch, c))) continue;
      branch.given[c] = &after_.clusters.rotation[c];
      any = true;
    }
    if (any) branch.outcome = model_.run({branch.settled, 0, kNear * h_, branch.given});
    return any;
  }
  // Whether many rotations are the best in the last iteration, and the one that the backend states is not followed.
  static bool is_open(const Branch& branch, std::size_t c) {
    return branch.outcome.is_free[c] != 0 && branch.given[c] == nullptr;
  }
  // How far a rotation is from what all best rotations of this shape agree on: they turn v to u.
  static double off_agreed(const Mat3& shape, const Mat3& r) {
    const BestRotation best = best_rotation(shape);
    const Vec3 u = {best.u[0], best.u[1], best.u[2]}, v = {best.v[0], best.v[1], best.v[2]};
    return or_infinite(norm(r * v - u));
  }
  double agreed_bound(const Branch& branch, std::size_t c) const {
    const double rounding = std::sqrt(branch.outcome.turn_rounding[c]) + 4 * unit_roundoff(after_);
    return kBeyondRuns * std::max(rounding, branch.direction.empty() ? 0 : branch.direction[c]);
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

  // What rounding does to this outcome, by disturbed runs that take the same decisions.
  void look_closer(Branch& branch, uint64_t runs = kDisturbedRuns) {
    const std::size_t m = reach_.size();
    Settled as_taken = branch.settled;
    for (const NearDecision& d : branch.outcome.near) as_taken[d.key] = d.taken;
    Bounds grown = off_by(branch.outcome, branch.outcome);
    std::vector<double> direction(m, 0);
    std::map<std::pair<DecisionKey, int>, double> leads, spread;
    for (const NearDecision& d : branch.outcome.near) {
      const auto key = std::pair(d.key, d.other);
      leads[key] = d.lead;
      spread[key] = 0;
    }
    std::mutex of_all_runs;
    const auto look_at = [&](uint64_t run) {
      const StepOutcome off = model_.run({as_taken, run, 2 * kNear * h_, branch.given});
      const Bounds apart_now = off_by(off, branch.outcome);
      // The greatest of all is the same whichever comes first.
      const std::lock_guard<std::mutex> lock(of_all_runs);
      grown.combine(apart_now, kGreater);
      for (std::size_t c = 0; c < m; ++c) {
        if (branch.outcome.is_free[c] == 0) continue;
        direction[c] = std::max(direction[c], off_agreed(branch.outcome.shape[c], off.rotation[c]));
      }
      for (const NearDecision& d : off.near) {
        const auto known = leads.find({d.key, d.other});
        if (known == leads.end()) continue;
        double& s = spread[known->first];
        s = std::max(s, std::abs(d.lead - known->second));
      }
    };
    const auto every = [&](uint64_t first) {
      for (uint64_t run = first; run <= runs; run += at_once_) look_at(run);
    };
    std::vector<std::future<void>> others;
    for (uint64_t first = 2; first <= at_once_; ++first) others.push_back(std::async(every, first));
    every(1);
    for (std::future<void>& other : others) other.get();
    Bounds& b = branch.bounds;
    b.combine(grown, [](double, double farthest) { return kBeyondRuns * farthest; });
    branch.direction = std::move(direction);
    // Runs choose freely where the rotation is open: that bounds nothing.
    for (std::size_t c = 0; c < m; ++c) {
      if (is_open(branch, c)) b.rotation[c] = agreed_bound(branch, c);
    }
    if (follow_rotations(branch)) return look_closer(branch, runs);
    let_go(branch);
    ask_bluntly(branch);
    branch.ties.clear();
    branch.is_forced = false;
    for (const NearDecision& d : branch.outcome.near) {
      const double rounding = kBeyondRuns * spread.at({d.key, d.other}) + d.rounding;
      if (!d.is_natural && -d.lead > rounding) branch.is_forced = true;
      if (d.lead <= rounding) branch.ties.push_back(d);
    }
    std::sort(branch.ties.begin(), branch.ties.end(),
              [](const NearDecision& p, const NearDecision& q) { return p.key < q.key; });
  }

  // What a contact holds does not move at all until it slips or comes off, and the runs may just not have been that
  // far: if those beside it may be off by more than it is held by, it is asked no more sharply than they are.
  void let_go(Branch& branch) const {
    Bounds& b = branch.bounds;
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
        if (!(branch.outcome.hold[at(i)] < beside)) continue;
        b.position[at(i)] = std::max(b.position[at(i)], beside);
        b.velocity[at(i)] = std::max(b.velocity[at(i)], fast);
        b.own_position[at(i)] = std::max(b.own_position[at(i)], own_beside);
        b.own_velocity[at(i)] = std::max(b.own_velocity[at(i)], own_fast);
      }
    }
  }

  // Where rounding is carried so far that small changes are no rule any more, all that is coupled is asked one blunt
  // question: no farther than the farthest of the runs brings any of it.
  void ask_bluntly(Branch& branch) const {
    Bounds& b = branch.bounds;
    const std::size_t sets = at(coupled_.count) + 1;
    std::vector<double> far(sets, 0);
    branch.blunt.assign(before_.x.size(), 0);
    for (std::size_t i = 0; i < before_.x.size(); ++i) {
      if (before_.alive[i] == 0) continue;
      const std::size_t set = at(coupled_.label[i]);
      far[set] = std::max({far[set], b.position[i], b.velocity[i]});
      if (!(b.position[i] <= kSmall * h_)) branch.blunt[i] = 1;
    }
    double pushed = 0;
    for (std::size_t i = 0; i < before_.x.size(); ++i) {
      if (branch.blunt[i] == 0) continue;
      const std::size_t set = at(coupled_.label[i]);
      b.position[i] = far[set];
      b.velocity[i] = far[set];
      pushed += setup_.body.mass[i] * b.velocity[i];
    }
    for (std::size_t c = 0; c < reach_.size(); ++c) {
      const auto members = before_.clusters.of(static_cast<int32_t>(c));
      const bool any_wide =
          std::any_of(members.begin(), members.end(), [&](int32_t i) { return branch.blunt[at(i)] != 0; });
      if (any_wide) b.rotation[c] = kAnyRotation;
    }
    b.impulse += pushed / dt_;
  }

  // What was only asked bluntly is counted as undecided where it holds, and says nothing of how sharp the judge is.
  void see(Branch& branch, StepPart part, int32_t where, double measured, double bound, bool blunt = false) const {
    if (blunt && measured <= bound) return;
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
    branch.measured = branch.bound = 0;
    const StepOutcome& o = branch.outcome;
    const Bounds& b = branch.bounds;
    std::vector<uint8_t> violates(before_.x.size(), 0);
    branch.left = square_left(o);
    for (std::size_t i = 0; i < violates.size(); ++i) {
      if (before_.alive[i] == 0) continue;
      const double off = or_infinite(norm(after_.x[i] - o.x[i]));
      const double fast = or_infinite(norm(after_.v[i] - o.v[i]) * dt_);
      violates[i] = !(off <= b.position[i]) || !(fast <= b.velocity[i]);
      const bool blunt = !branch.blunt.empty() && branch.blunt[i] != 0;
      see(branch, StepPart::position, static_cast<int32_t>(i), off / h_, b.position[i] / h_, blunt);
      see(branch, StepPart::velocity, static_cast<int32_t>(i), fast / h_, b.velocity[i] / h_, blunt);
    }
    for (int32_t c = 0; c < before_.clusters.count(); ++c) {
      if (!is_known(at(c))) continue;
      const Mat3& r = after_.clusters.rotation[at(c)];
      const double turned =
          is_open(branch, at(c)) ? off_agreed(o.shape[at(c)], r) : or_infinite(apart(r, o.rotation[at(c)]));
      const double arm = std::max(reach_[at(c)], h_) / h_;
      see(branch, StepPart::rotation, c, turned * arm, b.rotation[at(c)] * arm, !(b.rotation[at(c)] * arm <= kSmall));
      if (turned <= b.rotation[at(c)]) continue;
      for (const int32_t i : before_.clusters.of(c)) violates[at(i)] = 1;
    }
    const double impulse = or_infinite(norm(after_.impulse - o.impulse));
    const double per_mass = mass_ > 0 ? dt_ / (mass_ * h_) : 0;
    if (of_all_) see(branch, StepPart::impulse, -1, impulse * per_mass, b.impulse * per_mass, branch.is_undecided);
    if (branch.worst <= 1) compare_own(branch, violates);
    for (std::size_t i = 0; i < violates.size(); ++i) {
      if (violates[i] != 0) branch.violations.push_back(static_cast<int32_t>(i));
    }
  }

  // Rounding that members of a cluster have in common, as of its rotation and its center, is much more than what each
  // of them has alone. So what is wrong with one of them shows in what is left without it; unless what they share is
  // that of one that is only asked bluntly.
  void compare_own(Branch& branch, std::vector<uint8_t>& violates) const {
    const StepOutcome& o = branch.outcome;
    const Bounds& b = branch.bounds;
    const Own off = own(after_.x, o.x, 1), fast = own(after_.v, o.v, dt_);
    std::vector<uint8_t> shares = branch.blunt;  // with one that is asked bluntly, or is one
    shares.resize(violates.size(), 0);
    for (int32_t c = 0; c < before_.clusters.count() && !branch.blunt.empty(); ++c) {
      const auto members = before_.clusters.of(c);
      if (std::none_of(members.begin(), members.end(), [&](int32_t i) { return branch.blunt[at(i)] != 0; })) continue;
      for (const int32_t i : members) shares[at(i)] = 1;
    }
    for (std::size_t i = 0; i < violates.size(); ++i) {
      if (before_.alive[i] == 0 || shares[i] != 0) continue;
      const double place = b.own_position[i] + off.rounding, speed = b.own_velocity[i] + fast.rounding;
      if (!(off.lengths[i] <= place) || !(fast.lengths[i] <= speed)) violates[i] = 1;
      see(branch, StepPart::own_position, static_cast<int32_t>(i), off.lengths[i] / h_, place / h_);
      see(branch, StepPart::own_velocity, static_cast<int32_t>(i), fast.lengths[i] / h_, speed / h_);
    }
  }

  Branch branch_of(Settled settled) {
    Branch branch = start(std::move(settled));
    look_closer(branch);
    compare(branch);
    return branch;
  }

  // Looks for decisions that explain what no rounding of the first outcome does.
  Branch explain(Branch first) {
    // The sides that particles tell of: of the last substep they are certain, of earlier ones only likely.
    const Settled certain = sides_of(first, setup_.step.substeps - 1), likely = sides_of(first, 0);
    Branch root = likely.empty() ? std::move(first) : branch_of(likely);
    scale_by(root);
    root.left = square_left(root.outcome);
    Branch best = root;
    // What an outcome rounds is first taken for what the root does; that may be less.
    const std::optional<Branch> open = likely == certain ? std::nullopt : std::optional(branch_of(certain));
    bool all_tried = explore(root, open, false, best);
    if (all_tried && !best.holds()) all_tried = explore(root, open, true, best);
    if (!best.holds()) {
      // Where a contact has put particles in the last iteration hides what they did before, which rotations keep. (They
      // come last: what many ties do to a rotation does not add up.)
      by_rotations_ = true;
      root.left = square_left(root.outcome);
      Branch turned = root;
      explore(root, open, false, turned);
      by_rotations_ = false;
      if (turned.holds()) return turned;
    }
    if (!best.holds()) {
      look_closer(best, kMostDisturbedRuns);
      compare(best);
    }
    if (!best.holds() && !all_tried) count_undecided(best);
    return best;
  }

  // Tries outcomes until one holds, the nearest first; `closely`: looks closely at each, not only at those that
  // seem to be as good as the best. False: there are more than are tried.
  bool explore(const Branch& root, const std::optional<Branch>& other_root, bool closely, Branch& best) {
    const auto is_nearer = [](const Branch& a, const Branch& b) {
      if (a.holds() != b.holds()) return a.holds();
      if (a.is_forced != b.is_forced) return b.is_forced;
      return a.left < b.left;
    };
    const auto comes_later = [&](const Branch& a, const Branch& b) {
      return is_nearer(b, a) || (!is_nearer(a, b) && a.settled.size() > b.settled.size());
    };
    std::vector<Branch> open = {root};
    std::set<Settled> seen = {root.settled}, seen_taken = {taken_by(root.outcome)};
    int tried = 0;
    int64_t runs_left = int64_t{kDisturbedRuns + 1} * most_outcomes_;
    const auto keep = [&](Branch next) {
      if (is_nearer(next, best)) best = next;
      open.push_back(std::move(next));
      std::push_heap(open.begin(), open.end(), comes_later);
    };
    bool is_cut_off = false;  // something that was to be tried was not
    const auto may_try = [&] { return tried < most_outcomes_ && runs_left > 0; };
    const auto try_out = [&](const Settled& settled) -> std::optional<Branch> {
      if (seen.contains(settled)) return std::nullopt;
      is_cut_off = is_cut_off || !may_try();
      if (is_cut_off) return std::nullopt;
      seen.insert(settled);
      --runs_left;
      Branch next = start(settled);
      // What is settled of a decision that never comes up, or as the numbers say, leads where another way has led.
      if (!seen_taken.insert(taken_by(next.outcome)).second) return std::nullopt;
      ++tried;
      next.bounds = root.bounds;  // until it is worth a closer look
      compare(next);
      if (closely || next.left <= best.left || next.violations.size() <= best.violations.size()) {
        look_closer(next);
        compare(next);
        if (!next.holds() && next.measured <= kBeyondRuns * next.bound) {
          look_closer(next, kMostDisturbedRuns);
          compare(next);
        }
      } else {
        next.ties = near_ties(next, root);
      }
      keep(next);
      return next;
    };
    // Many ties at once: those of a layer that one rounding of its wall tips, or of particles far from each other. From
    // there again, as long as that brings it nearer.
    const auto try_fitted = [&](Branch branch) {
      for (double before = kInfinite; !best.holds() && branch.left < before;) {
        before = branch.left;
        std::optional<Branch> next;
        if (const std::optional<Settled> together = ways_together(branch)) next = try_out(*together);
        if (!best.holds() && !(next && next->left < before)) {
          if (std::optional<Branch> other = try_out(fitted(branch))) next = std::move(other);
        }
        if (!next) return;
        branch = std::move(*next);
      }
    };
    // One rounding of the blade's plane may put all that begin in it on one side.
    const Branch& first = other_root ? *other_root : root;
    for (const int side : {1, 0}) {
      Settled settled = first.settled;
      for (const NearDecision& tie : first.ties) {
        if (tie.key.kind == DecisionKind::side) settled[tie.key] = side;
      }
      if (best.holds()) break;
      const std::optional<Branch> next = try_out(settled);
      if (next && !best.holds()) try_fitted(*next);
    }
    if (other_root && !best.holds() && seen_taken.insert(taken_by(other_root->outcome)).second) keep(*other_root);
    if (other_root && !best.holds()) try_fitted(*other_root);
    if (!best.holds()) try_fitted(Branch(best));
    for (bool any = true; any && !best.holds();) {
      const std::optional<Settled> way = way_of_farthest(best);
      any = way.has_value() && try_out(*way).has_value();
      if (any && !best.holds()) try_fitted(Branch(best));
    }
    while (!open.empty() && !best.holds() && may_try()) {
      std::pop_heap(open.begin(), open.end(), comes_later);
      const Branch present = std::move(open.back());
      open.pop_back();
      for (const NearDecision& tie : with_violating_first(present)) {
        try_out(with_other(present.settled, tie, true));
        if (!best.holds()) try_out(with_other(present.settled, tie, false));
        if (best.holds()) break;
      }
    }
    return best.holds() || (open.empty() && !is_cut_off);
  }

  // The decisions of an outcome that were near, as it has taken them: all that tells it from others.
  static Settled taken_by(const StepOutcome& outcome) {
    Settled taken;
    for (const NearDecision& d : outcome.near) taken[d.key] = d.taken;
    return taken;
  }

  // A tie the other way. `again`: and the same question in the substep's other iterations (what tips one iteration's
  // scale tips the next one's), and in turns of blade and walls.
  static Settled with_other(Settled settled, const NearDecision& tie, bool again) {
    // Of two ways, back to what the numbers say is where it was before.
    if (tie.key.kind != DecisionKind::way_out && !tie.is_natural && settled.erase(tie.key) > 0) {
      settled.erase(tie.key.all_alike());
      return settled;
    }
    settled[tie.key] = tie.other;
    if (again && tie.key.kind != DecisionKind::side) settled[tie.key.all_alike()] = tie.other;
    return settled;
  }

  // How far particles are from an outcome, where they are; positions and velocities as one list, each in what rounding
  // explains of it: else what the blade has pushed far, and so rounds much, would hide what beside it does not round.
  // Behind them, if they are asked for, the columns of rotations.
  std::vector<std::pair<std::size_t, Vec3>> off_outcome(const std::vector<Vec3>& x, const std::vector<Vec3>& v,
                                                        const std::vector<Mat3>& rotation, const StepOutcome& o) const {
    std::vector<std::pair<std::size_t, Vec3>> off;
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (before_.alive[i] == 0) continue;
      const Vec3 place = x[i] - o.x[i], way = dt_ * (v[i] - o.v[i]);
      if (!(place == Vec3{})) off.emplace_back(2 * i, scale_of(2 * i) * place);
      if (!(way == Vec3{})) off.emplace_back(2 * i + 1, scale_of(2 * i + 1) * way);
    }
    for (std::size_t c = 0; c < reach_.size() && by_rotations_; ++c) {
      for (std::size_t column = 0; column < 3; ++column) {
        const std::size_t k = 2 * x.size() + 3 * c + column;
        const Vec3 turned = column_of(rotation[c], column) - column_of(o.rotation[c], column);
        if (!(turned == Vec3{}) && scale_of(k) > 0) off.emplace_back(k, scale_of(k) * (reach_[c] * turned));
      }
    }
    return off;
  }
  static Vec3 column_of(const Mat3& r, std::size_t column) { return {r.m[column], r.m[3 + column], r.m[6 + column]}; }

  double scale_of(std::size_t k) const { return scale_.empty() ? 1 : scale_[k]; }
  // Compares outcomes from here on by what rounding does to this one; and not by rotations of which many are the best.
  void scale_by(const Branch& branch) {
    const Bounds& b = branch.bounds;
    scale_.clear();
    const auto add = [&](double bound) { scale_.push_back(h_ / std::max(bound, kUnitRoundoff * h_)); };
    for (std::size_t i = 0; i < before_.x.size(); ++i) {
      add(b.position[i]);
      add(b.velocity[i]);
    }
    for (std::size_t c = 0; c < reach_.size(); ++c) {
      for (int column = 0; column < 3; ++column) {
        add(reach_[c] * b.rotation[c]);
        if (is_open(branch, c) || !is_known(c) || b.rotation[c] >= kAnyRotation) scale_.back() = 0;
      }
    }
  }

  // What becomes of an outcome if a tie goes the other way, alone or also together with the same question asked again.
  struct Column {
    Settled settled;
    std::vector<std::pair<std::size_t, Vec3>> does;
    double square = 0;
    bool taken = false;
  };
  std::vector<Column> columns_of(const Branch& branch, std::size_t most, std::initializer_list<bool> ways) const {
    std::vector<Column> columns;
    std::set<Settled> seen;
    for (const NearDecision& tie : with_violating_first(branch)) {
      if (columns.size() >= most) break;
      for (const bool again : ways) {
        Column column = {with_other({}, tie, again), {}};
        if (!seen.insert(column.settled).second) continue;
        const StepOutcome o = model_.run({with(branch.settled, column.settled), 0, kNear * h_, branch.given});
        column.does = off_outcome(o.x, o.v, o.rotation, branch.outcome);
        for (const auto& [k, way] : column.does) column.square += dot(way, way);
        columns.push_back(std::move(column));
      }
    }
    return columns;
  }
  static Settled with(Settled settled, const Settled& more) {
    for (const auto& [key, outcome] : more) settled[key] = outcome;
    return settled;
  }
  // How far the backend is from an outcome, as columns are.
  std::vector<Vec3> left_by(const StepOutcome& outcome) const {
    std::vector<Vec3> left(2 * before_.x.size() + 3 * reach_.size());
    for (const auto& [k, way] : off_outcome(after_.x, after_.v, after_.clusters.rotation, outcome)) left[k] = way;
    return left;
  }
  double square_left(const StepOutcome& outcome) const {
    double square = 0;
    for (const Vec3& way : left_by(outcome)) square += dot(way, way);
    return or_infinite(square);
  }
  static double gain_of(const Column& column, const std::vector<Vec3>& left) {
    double gain = 0;
    for (const auto& [k, way] : column.does) gain += dot(left[k], way);
    return gain;
  }

  // Taken the other way, which of an outcome's ties bring it nearest to what the backend states, in the sense of least
  // squares, if what each of them does alone adds up.
  Settled fitted(const Branch& branch) const {
    std::vector<Column> columns = columns_of(branch, at(kDisturbedRuns + 1) * at(most_outcomes_), {true, false});
    std::vector<Vec3> left = left_by(branch.outcome);
    bool any = true;
    for (int pass = 0; any && pass < kFitPasses; ++pass) {
      any = false;
      for (Column& column : columns) {
        const double sign = column.taken ? -1 : 1;
        if (!(2 * sign * gain_of(column, left) > column.square)) continue;
        for (const auto& [k, way] : column.does) left[k] -= sign * way;
        column.taken = !column.taken;
        any = true;
      }
    }
    Settled best = branch.settled;
    for (const Column& column : columns) {
      if (column.taken) best = with(std::move(best), column.settled);
    }
    return best;
  }

  // One particle alone may take several decisions on its way, each of which only comes up because of those before, and
  // only all of them together lead where it is. Calls `visit` with what is settled, and what becomes of it, for each
  // way of particle i that is another one: all with one decision taken otherwise, all with two, … At most `most` runs.
  template <class Visit>
  void for_ways_of(int32_t i, const Branch& branch, std::size_t most, const Visit& visit) const {
    struct Way {
      Settled settled;
      std::vector<NearDecision> ties;  // that come after the last one taken otherwise
    };
    const auto ties_of = [&](const StepOutcome& outcome, const DecisionKey* last) {
      std::map<std::pair<DecisionKey, int>, NearDecision> ties;
      for (const NearDecision& d : outcome.near) {
        if (d.key.particle != i || d.key.kind == DecisionKind::kept || (last != nullptr && d.key <= *last)) continue;
        if (d.lead <= branch.bounds.position[at(i)] + d.rounding) ties.insert({{d.key, d.other}, d});
      }
      std::vector<NearDecision> listed;
      for (const auto& [key, d] : ties) listed.push_back(d);
      return listed;
    };
    std::set<Settled> seen = {branch.settled}, seen_taken = {taken_by(branch.outcome)};
    std::vector<Way> ways = {{branch.settled, ties_of(branch.outcome, nullptr)}};
    for (std::size_t k = 0; k < ways.size(); ++k) {
      const Way way = ways[k];
      for (const NearDecision& tie : way.ties) {
        for (const bool again : {true, false}) {
          const Settled settled = with_other(way.settled, tie, again);
          if (seen.size() > most || !seen.insert(settled).second) continue;
          const StepOutcome o = model_.run({settled, 0, kNear * h_, branch.given});
          if (!seen_taken.insert(taken_by(o)).second) continue;
          visit(settled, o);
          ways.push_back({settled, ties_of(o, &tie.key)});
        }
      }
    }
  }

  // The ways of that particle are looked through which is farthest from where it should be, then of the next: what
  // brings the whole nearest, if anything brings it nearer.
  std::optional<Settled> way_of_farthest(const Branch& branch) const {
    std::map<int32_t, double> off;  // of those that have decisions to take
    for (const NearDecision& d : branch.outcome.near) {
      const std::size_t i = at(d.key.particle);
      off[d.key.particle] = std::max(or_infinite(norm(after_.x[i] - branch.outcome.x[i])),
                                     or_infinite(dt_ * norm(after_.v[i] - branch.outcome.v[i])));
    }
    std::vector<int32_t> farthest;
    for (const auto& [i, distance] : off) farthest.push_back(i);
    std::stable_sort(farthest.begin(), farthest.end(), [&](int32_t a, int32_t b) { return off[a] > off[b]; });
    if (farthest.size() > kFollowed) farthest.resize(kFollowed);

    double least = branch.left;
    std::optional<Settled> best;
    for (const int32_t i : farthest) {
      for_ways_of(i, branch, kMostWays, [&](const Settled& settled, const StepOutcome& o) {
        if (const double square = square_left(o); square < least) {
          least = square;
          best = settled;
        }
      });
      if (best) return best;
    }
    return best;
  }

  // Of few particles, which may each go one of several ways, the ways that together bring an outcome nearest to what
  // the backend states, in the sense of least squares, if what they do alone adds up. Two are changed at a time: none
  // of two that have both gone round an end may come nearer without the other. Nothing: there are many, or none is
  // nearer.
  std::optional<Settled> ways_together(const Branch& branch) const {
    struct Way {
      std::size_t of = 0;  // of the particles, counted
      Settled settled;
      std::vector<std::pair<std::size_t, Vec3>> does;
    };
    std::set<int32_t> particles;
    for (const NearDecision& tie : branch.ties) {
      if (tie.key.kind != DecisionKind::kept) particles.insert(tie.key.particle);
    }
    if (particles.size() < 2 || particles.size() > kFew) return std::nullopt;
    std::vector<Way> ways;
    std::size_t counted = 0;
    for (const int32_t i : particles) {
      for_ways_of(i, branch, kWaysOfFew, [&](const Settled& settled, const StepOutcome& o) {
        ways.push_back({counted, settled, off_outcome(o.x, o.v, o.rotation, branch.outcome)});
      });
      ++counted;
    }
    // |left − Σ does|² less |left|², for the ways that are taken: gains once, products twice.
    const std::vector<Vec3> left = left_by(branch.outcome);
    std::vector<double> gain(ways.size(), 0), product(ways.size() * ways.size());
    for (std::size_t a = 0; a < ways.size(); ++a) {
      for (const auto& [k, way] : ways[a].does) gain[a] += dot(left[k], way);
      for (std::size_t b = a; b < ways.size(); ++b) {
        double sum = 0;
        auto next = ways[b].does.begin();
        for (const auto& [k, way] : ways[a].does) {
          while (next != ways[b].does.end() && next->first < k) ++next;
          if (next != ways[b].does.end() && next->first == k) sum += dot(way, next->second);
        }
        product[a * ways.size() + b] = product[b * ways.size() + a] = sum;
      }
    }
    constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
    using Taken = std::vector<std::size_t>;  // by particle
    const auto square = [&](const Taken& taken) {
      double sum = 0;
      for (const std::size_t a : taken) {
        if (a == kNone) continue;
        sum -= 2 * gain[a];
        for (const std::size_t b : taken) sum += b == kNone ? 0 : product[a * ways.size() + b];
      }
      return sum;
    };
    const auto with_way = [&](Taken taken, std::size_t particle, std::size_t way) {
      taken[particle] = way;
      return taken;
    };
    std::vector<std::pair<std::size_t, std::size_t>> changes;  // particle, way
    for (std::size_t p = 0; p < counted; ++p) changes.emplace_back(p, kNone);
    for (std::size_t w = 0; w < ways.size(); ++w) changes.emplace_back(ways[w].of, w);
    Taken best(counted, kNone);
    for (double before = kInfinite, least = 0; least < before;) {
      before = least;
      const Taken from = best;
      for (std::size_t a = 0; a < changes.size(); ++a) {
        for (std::size_t b = a; b < changes.size(); ++b) {
          const Taken next =
              with_way(with_way(from, changes[a].first, changes[a].second), changes[b].first, changes[b].second);
          if (const double now = square(next); now < least) {
            least = now;
            best = next;
          }
        }
      }
    }
    Settled settled = branch.settled;
    for (const std::size_t way : best) {
      if (way != kNone) settled = changed(std::move(settled), branch.settled, ways[way].settled);
    }
    return settled == branch.settled ? std::nullopt : std::optional(settled);
  }
  // `settled`, with what `to` has changed in `from`.
  static Settled changed(Settled settled, const Settled& from, const Settled& to) {
    for (const auto& [key, outcome] : from) {
      if (!to.contains(key)) settled.erase(key);
    }
    for (const auto& [key, outcome] : to) {
      const auto before = from.find(key);
      if (before == from.end() || before->second != outcome) settled[key] = outcome;
    }
    return settled;
  }

  // Those that are open. What was settled is open again where that has not helped.
  static std::vector<NearDecision> with_violating_first(const Branch& branch) {
    std::vector<NearDecision> ties = branch.ties;
    const std::set<int32_t> violating(branch.violations.begin(), branch.violations.end());
    std::erase_if(ties, [&](const NearDecision& d) {
      return branch.settled.contains(d.key) && !violating.contains(d.key.particle);
    });
    std::stable_sort(ties.begin(), ties.end(), [&](const NearDecision& a, const NearDecision& b) {
      return violating.contains(a.key.particle) > violating.contains(b.key.particle);
    });
    return ties;
  }

  // Ties of an outcome that was not looked at closely: by the measure of one that was.
  std::vector<NearDecision> near_ties(const Branch& branch, const Branch& measure) const {
    std::vector<NearDecision> ties;
    for (const NearDecision& d : branch.outcome.near) {
      if (d.lead <= measure.bounds.position[at(d.key.particle)] + d.rounding) ties.push_back(d);
    }
    return ties;
  }

  // A particle that ends over the plate, clear of its rim, tells on which side of the blade it began the last substep:
  // no such side is open. (One that was led round the plate ends over its border.)
  Settled sides_of(const Branch& branch, int32_t from_substep) const {
    Settled known = branch.settled;
    if (!setup_.has_blade) return known;
    const BladePose& pose = setup_.blade_moves[at((before_.frame + 1) * setup_.step.substeps - 1)].to;
    for (const NearDecision& d : branch.ties) {
      if (d.key.kind != DecisionKind::side || d.key.substep < from_substep) continue;
      const Local place = to_local(pose, after_.x[at(d.key.particle)] - pose.edge);
      const double rim = kSmall * h_;
      const bool over =
          std::abs(place.u) < setup_.blade.length / 2 - rim && place.w > rim && place.w < setup_.blade.depth - rim;
      if (over && std::abs(place.n) >= blade_clearance(setup_) / 2) known[d.key] = place.n < 0 ? 1 : 0;
    }
    return known;
  }

  // More ties than can be tried together: all that is compared must at least be within what those do one by one that
  // are in doubt, added up, and the farthest of disturbed runs that leave just them to themselves. Then what violates
  // is counted, beside these bounds. A tie is in doubt unless taking it the other way would bring the outcome farther
  // from the backend by half of what that does.
  void count_undecided(Branch& branch) {
    Branch explained = branch;
    const std::vector<Vec3> left = left_by(branch.outcome);
    Settled decided = branch.settled;
    for (const NearDecision& d : branch.outcome.near) decided[d.key] = d.taken;
    for (const Column& column : columns_of(branch, std::numeric_limits<std::size_t>::max(), {false})) {
      if (!(4 * gain_of(column, left) > column.square)) continue;
      for (const auto& [key, outcome] : column.settled) decided.erase(key);
      const StepOutcome other = model_.run({with(branch.settled, column.settled), 0, kNear * h_, branch.given});
      explained.bounds.combine(off_by(other, branch.outcome), std::plus());
    }
    Bounds farthest = off_by(branch.outcome, branch.outcome);
    for (uint64_t run = 1; run <= kMostDisturbedRuns; ++run) {
      const StepOutcome off = model_.run({decided, run, kNear * h_, branch.given});
      farthest.combine(off_by(off, branch.outcome), kGreater);
    }
    explained.bounds.combine(farthest, std::plus());
    compare(explained);
    if (!explained.holds()) return;
    // What the ties explain says nothing of how sharp the judge is.
    for (const int32_t i : branch.violations) explained.blunt[at(i)] = 1;
    explained.is_undecided = true;
    compare(explained);
    branch = std::move(explained);
  }

  AdmissibleStep report(Branch branch) const {
    AdmissibleStep found;
    found.part = branch.part;
    found.where = branch.where;
    found.measured = branch.measured;
    found.bound = branch.bound;
    found.holds = branch.holds();
    std::set<DecisionKey> against;
    for (const NearDecision& d : branch.outcome.near) {
      if (!d.is_natural) against.insert(d.key);
    }
    found.otherwise = static_cast<int64_t>(against.size()) + std::count_if(branch.given.begin(), branch.given.end(),
                                                                           [](const Mat3* r) { return r != nullptr; });
    found.checked = std::count_if(before_.alive.begin(), before_.alive.end(), [](uint8_t a) { return a != 0; }) +
                    before_.clusters.count();
    found.undecided = branch.is_undecided ? 1 : 0;
    for (std::size_t i = 0; i < before_.alive.size(); ++i) {
      found.position_bound.push_back(branch.bounds.position[i] / h_);
      found.velocity_bound.push_back(branch.bounds.velocity[i] / h_);
    }
    found.undecided += std::count(branch.blunt.begin(), branch.blunt.end(), 1);
    for (std::size_t c = 0; c < reach_.size(); ++c) {
      found.reach.push_back(std::max(reach_[c] / h_, 1.0));
      found.rotation_bound.push_back(branch.bounds.rotation[c] * found.reach.back());
      // As of positions: beyond this, nothing sharp was asked.
      const bool is_gone = !known_.empty() && known_[c] == RotationKnown::gone;
      if (is_gone) --found.checked;
      if (!is_gone && (!(found.rotation_bound.back() <= kSmall) || !is_known(c))) ++found.undecided;
    }
    found.outcome = std::move(branch.outcome);
    return found;
  }

  const Setup& setup_;
  const State &before_, &after_;
  const std::vector<RotationKnown> known_;  // [m] of the rotations that the step has left; empty: all are
  const bool of_all_;
  const double h_, dt_;
  double mass_ = 0;
  StepModel model_;
  std::vector<int32_t> holders_;  // [n] clusters of a particle
  std::vector<double> reach_;     // [m] greatest |X - T|
  bool by_rotations_ = false;     // outcomes are compared by rotations, too
  std::vector<double> scale_;     // [2 n + 3 m] of positions, velocities, rotations: see scale_by(); empty: 1
  Partition coupled_;
  int most_outcomes_ = kMostOutcomes;
  uint64_t at_once_ = 1;  // disturbed runs
};

}  // namespace

AdmissibleStep nearest_admissible_step(const Setup& setup, const State& before, const State& after,
                                       std::span<const RotationKnown> known_rotations, int at_once) {
  return Search(setup, before, after, known_rotations, at_once).find();
}

}  // namespace cutproof::oracles
