#include "oracles/iterates/substep_judge.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "oracles/best_rotation.h"
#include "oracles/eigen.h"
#include "oracles/memberships.h"
#include "oracles/rest_places.h"
#include "oracles/support.h"
#include "oracles/volume_target.h"

namespace cutproof::oracles {
namespace {

// Bounds are so many times the quadratic sum of single roundings: of one place or rotation, and of sums over many.
constexpr double kTimes = 4, kTimesOfSums = 8;
// Numbers that agree within so many roundings round alike: earlier roundings make them differ.
constexpr double kEqualRounds = 256;
// Entries of RᵀR - I, in units of u: R is made of a unit quaternion, whose length is off by 2 u, which is 8 u in them;
// its entries round by 4 u more, which is 2 √3 times that.
constexpr double kOrthogonalRounds = 22;
// A line's rotation is inconclusive where cos² of half its turn is not above this: nothing is left of the previous one.
constexpr double kNothingLeft = 1e-8;
constexpr int kTries = 256;
// Where the first of these are farther apart than this [h], turns of blade and walls lead anywhere, but no more than so
// many times as far again.
constexpr double kAnywhere = 1e-3, kFarther = 8;
// A smaller number may be 0 in single precision (a velocity times dt [m], also after damping).
constexpr double kLeast = 1e-37;

double square(double a) { return a * a; }

const BladeMove* move_of(const Setup& setup, int64_t frame, int32_t substep) {
  return setup.blade_moves.empty() ? nullptr : &setup.blade_moves[at(frame * setup.step.substeps + substep)];
}

}  // namespace

const char* name_of(IteratePart part) {
  constexpr const char* kNames[] = {"place",
                                    "place at a contact",
                                    "velocity",
                                    "rotation",
                                    "orthogonality of the rotation",
                                    "rotation",
                                    "flag",
                                    "impulse",
                                    "momentum",
                                    "way along the pull"};
  return kNames[static_cast<int>(part)];
}

SubstepJudge::SubstepJudge(const Setup& setup, int64_t frame, int32_t substep, const State& began,
                           const State& frame_began)
    : setup_(setup),
      began_(began),
      u_(unit_roundoff(began) + unit_roundoff(Precision::binary64)),
      places_u_(unit_of_places(began)),
      dt_(setup.substep_length[at(frame)]),
      share_(dt_ / (dt_ + setup.step.retardation)),
      first_(substep == 0),
      move_(move_of(setup, frame, substep)),
      contact_(setup, move_, setup.walls) {
  const Body& body = setup.body;
  const StepParameters& step = setup.step;
  const int32_t n = body.particle_count();
  implicit_ = step.solver == Solver::implicit;
  const double kdt2 = step.stiffness * dt_ * (dt_ + step.retardation);
  s_ = implicit_ ? kdt2 / (1 + kdt2) : step.relaxation;
  decay_ = std::exp(-step.damping * dt_);
  coupled_ = components_of_coupling(TissueGraph(body, began.alive), began.clusters);
  holders_ = membership_counts(began.clusters, n);
  arm_.resize(began.clusters.members.size());
  volume_off_.resize(arm_.size());
  lever_.resize(at(n));
  for (int32_t c = 0; c < began.clusters.count(); ++c) {
    const auto members = began.clusters.of(c);
    Cluster& cluster = clusters_.emplace_back();
    if (members.empty()) continue;  // coverage rejects it
    const Vec3 base = body.rest_position(members.front());
    Vec3 moment;
    for (const int32_t i : members) {
      cluster.mass += weight(i);
      moment += weight(i) * (body.rest_position(i) - base);
    }
    cluster.rest = base + moment / cluster.mass;
    cluster.is_line = is_on_a_line(body, members);
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (std::size_t m = 0; m < members.size(); ++m) {
      Vec3& arm = arm_[at(began.clusters.offsets[at(c)]) + m];
      arm = (body.rest_position(members[m]) - base) - moment / cluster.mass;
      cluster.radius = std::max(cluster.radius, norm(arm));
      lever_[at(members[m])] += dot(arm, arm);
      moments += weight(members[m]) * as_eigen(arm) * as_eigen(arm).transpose();
    }
    cluster.moments = to_mat3(moments);
  }
  held_.resize(at(n));
  for (const Grip& grip : setup.grips) {
    const auto now = at(frame * step.substeps + substep);
    if (grip.active[now] == 0) continue;
    for (const int32_t i : grip.particles) held_[at(i)] = began.x[at(i)] + grip.displacement[now];
  }
  std::vector<double> shared(at(n));  // the greatest place that is stored in the clusters of a particle
  for (int32_t c = 0; c < began.clusters.count(); ++c) {
    double greatest = 0;
    for (const int32_t i : began.clusters.of(c)) {
      const Vec3 x = began.x[at(i)];
      greatest = std::max(
          {greatest, norm(stored(i, x)), norm(stored(i, x - dt_ / std::max(decay_, kLeast) * began.v[at(i)]))});
      // A carried place is the frame's first one plus what the frame has added, which rounds by its own size and may
      // all but cancel it.
      greatest = std::max(greatest, norm(stored(i, frame_began.x[at(i)])));
    }
    for (const int32_t i : began.clusters.of(c)) shared[at(i)] = std::max(shared[at(i)], greatest);
  }
  for (int32_t i = 0; i < n; ++i) {
    const Vec3 x = began.x[at(i)];
    if (holders_[at(i)] > 0) lever_[at(i)] = std::sqrt(lever_[at(i)]) / holders_[at(i)];
    const Vec3 coasts = dt_ * began.v[at(i)], falls = (dt_ * dt_) * step.gravity;
    inertia_.push_back(norm(coasts) + norm(falls));
    predicted_.push_back(x + (coasts + falls));
    // A backend begins a later substep from places that are not rounded yet. Those shown are off by one rounding, and
    // dt v, the difference of two places, by two. A group sums what its particles have in common, so the rounding is
    // that of the greatest place in the particle's clusters.
    const double went_on = first_ ? 0 : 3 * u_ * std::max(norm(stored(i, x)), shared[at(i)]);
    begin_squares_.push_back(square(u_ * norm(stored(i, predicted_.back()))) + square(4 * u_ * inertia_.back()) +
                             square(2 * places_u_ * norm(predicted_.back())) + square(went_on));
    const double height = contact_.height_at_start(x);
    const double near = contact_.has_plate() ? kTimes * u_ * (8 * norm(x - move_->from.edge) + 8 * norm(x)) : 0;
    sides_.push_back(std::abs(height) <= near ? 3 : height < 0 ? 2 : 1);
  }
}

void SubstepJudge::see(IteratePart part, double measured, double bound, int32_t where) {
  Nearest nearest;
  nearest.see(measured, bound, where);
  const IterateFinding found = {part, k_, where, nearest.share, measured, bound};
  ++checked_;
  if (found.share > worst_.share) worst_ = found;
}

// Where elasticity acts (method.md §3, Retardation).
Vec3 SubstepJudge::ahead(int32_t i, Vec3 x) const {
  return share_ == 1 ? x : began_.x[at(i)] + (x - began_.x[at(i)]) / share_;
}
Vec3 SubstepJudge::back(int32_t i, Vec3 y) const {
  return share_ == 1 ? y : began_.x[at(i)] + share_ * (y - began_.x[at(i)]);
}

double SubstepJudge::place_rounding(int32_t i, Vec3 x) const {
  double rounding = u_ * norm(stored(i, x)) + 2 * places_u_ * norm(x);
  if (share_ != 1) rounding += u_ * (norm(stored(i, began_.x[at(i)])) + 3 * norm(x - began_.x[at(i)]));
  return rounding;
}

// Weights of pull and carry that lead to iterate k + 1 (method.md §11): ω = 2 T_k−1(1/ρ) / (ρ T_k(1/ρ)), the Chebyshev
// polynomials T by hyperbolic cosines.
std::pair<double, double> SubstepJudge::chebyshev(int32_t k) const {
  const double greatest = std::min(s_, 0.95), rho = greatest / (2 - greatest);
  double omega = 1;
  if (k > 1 && rho > 0) {
    const double a = std::acosh(1 / rho);
    omega = 2 / rho * std::exp(-a) * (1 + std::exp(-2 * (k - 1) * a)) / (1 + std::exp(-2 * k * a));
  }
  return {omega * 2 / (2 - greatest), omega - 1};
}

void SubstepJudge::prediction(const State& after) {
  k_ = -1;
  free_.clear();
  shared_ = 0;
  pushed_ = {};
  pushed_rounding_ = push_in_doubt_ = 0;
  for (int32_t i = 0; i < setup_.body.particle_count(); ++i) {
    if (began_.alive[at(i)] == 0) continue;
    const Vec3 x = predicted_[at(i)];
    particle(i, {x, x, begin_squares_[at(i)], x - began_.x[at(i)]}, after.x[at(i)], began_.x[at(i)]);
  }
  for (int32_t c = 0; c < began_.clusters.count(); ++c) {
    const bool kept = after.clusters.rotation[at(c)] == began_.clusters.rotation[at(c)];
    see(IteratePart::kept, kept ? 0 : 1, 0, c);
    see(IteratePart::flag, after.clusters.degenerate[at(c)] == began_.clusters.degenerate[at(c)] ? 0 : 1, 0, c);
  }
  sums();
  impulse({}, 0, after);
  velocities(after);
}

void SubstepJudge::iteration(int32_t k, const State* earlier, const State& now, const State& next) {
  k_ = k;
  const Clusters& clusters = began_.clusters;
  const std::size_t n = predicted_.size();
  const bool combined = setup_.step.acceleration == Acceleration::chebyshev && k > 0;
  std::vector<Vec3> y(n), sum(n);
  std::vector<double> goal_squares(n), place(n);
  for (int32_t i = 0; i < setup_.body.particle_count(); ++i) {
    y[at(i)] = ahead(i, now.x[at(i)]);
    place[at(i)] = place_rounding(i, now.x[at(i)]) / share_;  // of y
  }
  for (int32_t c = 0; c < clusters.count(); ++c) {
    Cluster& cluster = clusters_[at(c)];
    const auto members = clusters.of(c);
    if (members.empty()) continue;
    const Vec3* const arm = arm_.data() + clusters.offsets[at(c)];
    const Vec3 base = y[at(members.front())], base_stored = stored(members.front(), base);
    Vec3 mean;
    double spread = 0, places = 0;
    for (const int32_t i : members) {
      const double part = weight(i) / cluster.mass;
      mean += part * (y[at(i)] - base);
      spread += part * square(norm(stored(i, y[at(i)]) - base_stored));
      places += part * place[at(i)];
    }
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    double size = 0, seen = 0;
    for (std::size_t m = 0; m < members.size(); ++m) {
      const int32_t i = members[m];
      const Vec3 d = (y[at(i)] - base) - mean;
      a += weight(i) * as_eigen(d) * as_eigen(arm[m]).transpose();
      size += weight(i) * norm(d) * norm(arm[m]);
      seen += weight(i) * place[at(i)] * norm(arm[m]);
    }
    const double rounds = sum_rounds(static_cast<double>(members.size())) * u_;
    const Mat3& previous = k == 0 ? clusters.rotation[at(c)] : now.clusters.rotation[at(c)];
    const double a_off = rounds * size + seen + 4 * u_ * a.norm();
    rotation(c, a, a_off, previous, next.clusters);
    Mat3 map = next.clusters.rotation[at(c)];
    if (const double share = setup_.step.volume_share; share > 0) {
      const VolumeTarget volume = volume_target(to_mat3(a), cluster.moments, map);
      const double off = share * volume.rounding(a_off, rounds, u_);
      inconclusive_ += volume.is_open(a_off, rounds, u_);
      for (std::size_t m = 0; m < members.size(); ++m) {
        double& of_member = volume_off_[at(clusters.offsets[at(c)]) + m];
        of_member = off * volume.lever(arm[m]);
        goal_squares[at(members[m])] += square(of_member);
      }
      map = volume.goal_map(share, map);
    }
    const double of_centers = 1 - setup_.step.volume_share;
    const bool is_single = began_.precision == Precision::binary32;
    const Vec3 center = base + mean;
    const double of_mean = square(2 * u_ * norm(is_single ? center - cluster.rest : center)) +
                           3 * square(rounds) * spread + square(places);
    const double squares = square(of_centers) * of_mean + square(2 * u_ * cluster.radius) +
                           (is_single ? 0 : square(u_ * norm(cluster.rest)));
    cluster.center_off = std::sqrt(squares);
    for (std::size_t m = 0; m < members.size(); ++m) {
      sum[at(members[m])] += of_centers * center + map * arm[m];
      goal_squares[at(members[m])] += squares;
    }
  }
  // The second one is a weight ω less 1, so it rounds as ω does.
  const auto [pull, carry] = combined ? chebyshev(k) : std::pair{1.0, 0.0};
  free_.clear();
  shared_ = share_ * pull * s_;
  pushed_ = {};
  pushed_rounding_ = push_in_doubt_ = 0;
  for (int32_t i = 0; i < setup_.body.particle_count(); ++i) {
    if (began_.alive[at(i)] == 0) continue;
    const double holders = holders_[at(i)];
    const double own = setup_.step.volume_share;
    const Vec3 is = y[at(i)], goal = holders > 0 ? own * is + sum[at(i)] / holders : is;
    const Vec3 from = implicit_ ? ahead(i, predicted_[at(i)]) : is;
    const Vec3 plain = from + s_ * (goal - from);
    const double of_goal = (holders > 0 ? goal_squares[at(i)] / square(holders) : 0) + square(own * place[at(i)]) +
                           square(u_ * (6 * norm(goal - from) + own * norm(is - from) + 2 * lever_[at(i)]));
    const double of_from = implicit_ ? begin_squares_[at(i)] / square(share_) : square(place[at(i)]);
    double squares = square(pull) * (square(s_) * of_goal + square(1 - s_) * of_from);
    Vec3 free = plain;
    if (combined) {
      const Vec3 was = ahead(i, earlier->x[at(i)]);
      free = is + (pull * (plain - is) + carry * (is - was));
      squares += square((1 + carry - pull) * place[at(i)]) +
                 square(carry * place_rounding(i, earlier->x[at(i)]) / share_) +
                 square(4 * u_ * (pull * norm(plain - is) + (1 + carry) * norm(is - was)));
    }
    particle(i, {back(i, plain), back(i, free), square(share_) * squares, (share_ * pull) * (goal - from)},
             next.x[at(i)], now.x[at(i)]);
  }
  sums();
  // The recurrence of the pushes of contacts so far, from the backend's own values.
  const auto of = [&](const State& state) { return (dt_ / decay_) * state.impulse; };
  Vec3 carried = (implicit_ ? s_ : 1.0) * of(now);
  double rounding = 8 * u_ * norm(of(now)) * (1 + 2 * pull);
  if (combined) {
    carried = of(now) + (pull * (carried - of(now)) + carry * (of(now) - of(*earlier)));
    rounding += 8 * u_ * (1 + carry) * norm(of(now) - of(*earlier));
  }
  impulse(carried, rounding, next);
  velocities(next);
}

// R maximises tr(Rᵀ A), with A known to `off`. Then Rᵀ A is symmetric, and a turn about no axis is better: the two
// least eigenvalues of the symmetric part do not sum to less than 0.
void SubstepJudge::rotation(int32_t c, const Eigen::Matrix3d& a, double off, const Mat3& previous,
                            const Clusters& after) {
  const Cluster& cluster = clusters_[at(c)];
  const Mat3& r = after.rotation[at(c)];
  const double size = a.norm();
  const bool says = after.degenerate[at(c)] != 0;
  if (cluster.radius == 0) return see(IteratePart::kept, r == previous ? 0 : 1, 0, c);
  see(IteratePart::orthogonal,
      (as_eigen(r).transpose() * as_eigen(r) - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff(),
      kOrthogonalRounds * u_, c);
  if (cluster.is_line) {
    // In single precision a sum rounds by as much as the least threshold that a backend has.
    if (began_.precision == Precision::binary64) see(IteratePart::flag, says ? 0 : 1, 0, c);
  } else if (says && size > 8 * off) {
    const double moved = 3 * std::sqrt(3.0) * kTimes * off / size + degenerate_rounds(u_) * u_;
    see(IteratePart::flag, best_rotation(to_mat3(a)).separation, moved, c);
  }
  if (!(size > 8 * off)) {
    ++inconclusive_;
    return;
  }
  const Eigen::Matrix3d p = as_eigen(r).transpose() * a;
  const Eigen::Vector3d values = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>()
                                     .computeDirect(0.5 * (p + p.transpose()), Eigen::EigenvaluesOnly)
                                     .eigenvalues();
  const double sure = values[0] + values[1], bound = kTimes * off;
  // Below it many rotations are as good, for a backend.
  const double threshold = degenerate_rounds(u_) * u_ * size;
  const double within = sure > bound + threshold ? bound : bound + threshold;
  see(IteratePart::rotation, std::max((p - p.transpose()).norm() / std::sqrt(2.0), -sure), within, c);
  if (sure > bound + threshold || !cluster.is_line) return;
  // Of many the nearest to the previous one, which was shown too.
  const NearestRotation nearest = nearest_of_rank_one(best_rotation(to_mat3(a)), previous);
  if (!(nearest.weight > kNothingLeft)) {
    ++inconclusive_;
    return;
  }
  const double away = (as_eigen(nearest.r) - as_eigen(r)).norm() / std::sqrt(2.0);
  const double allowed = kTimes * (off / size + 8 * u_) / std::sqrt(nearest.weight);
  // Where A is less flat than by rounding a backend may have followed it, which was just judged.
  if (away > allowed && sure > 2 * u_ * size) return;
  see(IteratePart::kept, away, allowed, c);
}

void SubstepJudge::particle(int32_t i, const Candidate& candidate, Vec3 seen, Vec3 present) {
  const double mass = setup_.body.mass[at(i)], end = place_rounding(i, seen);
  const double own = std::sqrt(candidate.squares + square(end));
  if (held_[at(i)]) {
    const Vec3 there = *held_[at(i)];
    see(IteratePart::contact, norm(seen - there),
        kTimes * (end + place_rounding(i, began_.x[at(i)]) + u_ * norm(there - began_.x[at(i)])), i);
    pushed_ += mass * (seen - candidate.free);
    pushed_rounding_ += mass * (own + 4 * u_ * norm(seen - candidate.free));
    return;
  }
  const double at_blade = u_ * contact_.rounds(seen), bound = kTimes * own, wide = bound + kTimes * at_blade;
  double deepest = -std::numeric_limits<double>::infinity();
  for (const int side : {+1, -1}) {
    if ((sides_[at(i)] & (side > 0 ? 1 : 2)) == 0 || !contact_.any()) continue;
    for (const Vec3 x : {candidate.free, candidate.plain}) {
      deepest = std::max(deepest, contact_.depth(x, side, wide).most);
    }
  }
  const double margin = k_ > 0 ? kTouchMargin * setup_.body.grid.spacing : 0;
  if (deepest < -wide - margin) {  // nothing touches it
    see(IteratePart::place, norm(seen - candidate.free), bound, i);
    free_.push_back({i, seen - candidate.free, square(own), candidate.pull});
    return;
  }
  double after = kTimes * (end + at_blade);
  bool decided = true;
  const double off = nearest_contact(i, candidate, seen, present, wide, after, decided);
  if (decided) {
    see(IteratePart::contact, off, after, i);
  } else {
    ++inconclusive_;
  }
  // A backend adds up how far contacts have put particles from where its solver would have. Where that is no more than
  // rounding, it is not known whether the backend has counted this particle.
  const Vec3 push = seen - candidate.free;
  const bool is_clear = norm(push) > wide + after;
  pushed_ += (is_clear ? mass : mass / 2) * push;
  pushed_rounding_ += mass * (own + 4 * u_ * norm(push));
  if (!is_clear) push_in_doubt_ += mass / 2 * norm(push);
}

// How far, at least, `seen` is from where a contact may put the particle. `after`: in, what rounds after the contact;
// out, that and what candidates within `wide` make of it. `decided`: false where these spread too far.
double SubstepJudge::nearest_contact(int32_t i, const Candidate& candidate, Vec3 seen, Vec3 present, double wide,
                                     double& after, bool& decided) {
  const Vec3 start = began_.x[at(i)];
  const double spacing = setup_.body.grid.spacing;
  const bool asks = k_ > 0 && !(candidate.plain == candidate.free) && contact_.path_matters();
  // Ways to go: from a candidate of this side, to a place.
  struct Way {
    int side;
    Vec3 candidate;
  };
  std::array<Way, 4> ways;
  std::size_t count = 0;
  for (const int side : {+1, -1}) {
    if ((sides_[at(i)] & (side > 0 ? 1 : 2)) == 0) continue;
    const Contact::Depth free = contact_.depth(candidate.free, side, wide),
                         plain = contact_.depth(candidate.plain, side, wide);
    const double margin = kTouchMargin * spacing;
    if (!asks || std::max(free.least, plain.least) + margin <= wide) ways[count++] = {side, candidate.free};
    if (asks && std::max(free.most, plain.most) + margin >= -wide) ways[count++] = {side, candidate.plain};
  }
  // How far `seen` is from where one of this way is put that would go to `from`, which is noted as `placed`.
  Vec3 placed;
  const auto off_by = [&](const Way& way, Vec3 from, const Contact::Rounding& rounding) {
    Contact::Found found;
    placed = contact_.place(from, way.side, start, found, rounding);
    const double off = norm(placed - seen);
    if (!found.in_turn || contact_.has_friction() || k_ < 0) return off;
    // Refused where it is worse than the present place.
    const double there = norm(placed - from), here = norm(present - from);
    const double slack = Contact::refusal_margin(norm(stored(i, present)), from, present, u_) + 4 * wide;
    if (there < here - slack) return off;
    return there > here + slack ? norm(present - seen) : std::min(off, norm(present - seen));
  };
  double best = std::numeric_limits<double>::infinity();
  const auto bit_of = [](const Way& way) -> uint8_t { return way.side > 0 ? 1 : 2; };
  uint8_t explained = 0;
  const auto take = [&](const Way& way, double off, double within) {
    best = std::min(best, off);
    if (off <= within) explained |= bit_of(way);
  };
  const double direct = wide * contact_.widened_by_friction() + after,
               rounds = kTimes * u_ * contact_.rounds(candidate.free);
  for (int way = 0; way < Contact::kWaysOffPlate && explained == 0; ++way) {
    for (std::size_t k = 0; k < count; ++k) {
      take(ways[k], off_by(ways[k], ways[k].candidate, {way > 0 ? rounds : 0, nullptr, false, way}), direct);
    }
  }
  const uint8_t explained_directly = explained;
  const double best_directly = best;
  // Beside a border a candidate within its rounding may lead elsewhere: the candidate led by the blade alone, or one of
  // many, with the rounding between turns of blade and walls. The same holds for a side that has explained nothing so
  // far.
  best = std::numeric_limits<double>::infinity();
  double spread = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const Way& way = ways[k];
    if ((explained_directly & bit_of(way)) != 0) continue;
    const Vec3 back = contact_.origin_of(seen, way.candidate), off = back - way.candidate;
    const Vec3 from = norm(off) <= wide ? back : way.candidate + (wide / norm(off)) * off;
    take(way, off_by(way, from, {}), after);
    Noise noise(static_cast<uint64_t>(i) + 1);
    off_by(way, way.candidate, {});
    const Vec3 first = placed;
    for (int run = 0; run < kTries && (explained & bit_of(way)) == 0; ++run) {
      const Vec3 near = way.candidate + (wide * (run / 2 % 4) / 4) * noise.vector();
      const bool on_borders = run % 2 == 0;
      const double there =
          off_by(way, near, {rounds, on_borders ? nullptr : &noise, on_borders, run % Contact::kWaysOffPlate});
      if (run < kTries / 8) spread = std::max(spread, norm(placed - first));
      take(way, there, after);
    }
  }
  if (explained_directly == 0) {
    after += 2 * spread;
    decided = after <= kAnywhere * spacing || best > after + kFarther * spread;
  }
  // Where its way is not known, its side is not known.
  if (explained != 0 && decided) sides_[at(i)] = explained;
  if (explained_directly == 0) return best;
  after = direct;
  return best_directly;
}

// A place may be rounded when it is stored, after the velocity was made of it.
void SubstepJudge::velocities(const State& after) {
  for (int32_t i = 0; i < setup_.body.particle_count(); ++i) {
    if (began_.alive[at(i)] == 0) continue;
    const Vec3 was = began_.x[at(i)], is = after.x[at(i)], moved = is - was;
    const double rounding =
        u_ * (norm(stored(i, is)) + norm(stored(i, was)) + 4 * norm(moved)) + 2 * places_u_ * (norm(is) + norm(was));
    see(IteratePart::velocity, norm(dt_ * after.v[at(i)] - decay_ * moved), kTimes * decay_ * rounding + kLeast, i);
  }
}

// Of the first substep of a frame, where the impulse is that of this substep alone.
void SubstepJudge::impulse(Vec3 carried, double rounding, const State& after) {
  if (!first_ || decay_ < kLeast || (setup_.walls.empty() && !contact_.has_plate() && setup_.grips.empty())) return;
  const Vec3 expected = carried + pushed_;
  const double off = norm((dt_ / decay_) * after.impulse - expected);
  see(IteratePart::impulse, off <= push_in_doubt_ ? 0 : off - push_in_doubt_,
      kTimes * (rounding + pushed_rounding_ + 8 * u_ * norm(pushed_)), 0);
}

// Sums over the particles of a component that touch nothing. A force on the component, or a parameter, moves them all
// the same way, while the rounding of each particle is its own.
void SubstepJudge::sums() {
  struct Part {
    Vec3 off;
    double squares = 0, common = 0;                         // of momentum
    double along = 0, along_squares = 0, along_common = 0;  // of the way along the pull
    double pulls = 0;
    int32_t first = -1;
  };
  struct Term {
    int32_t part, axis;
    int exponent;
    double digits, rounding, along;
    auto key() const { return std::tie(part, axis, exponent, digits); }
  };
  std::vector<Part> parts(at(coupled_.count));
  std::vector<Term> terms;
  terms.reserve(3 * free_.size());
  std::vector<double> mass_of(predicted_.size());
  std::vector<Vec3> pull_of(predicted_.size());
  for (const Free& f : free_) {
    const int32_t label = coupled_.label[at(f.particle)];
    Part& part = parts[at(label)];
    const double mass = setup_.body.mass[at(f.particle)], pull = norm(f.pull);
    if (part.first < 0) part.first = f.particle;
    part.off += mass * f.off;
    part.along += mass * dot(f.off, f.pull);
    part.pulls += mass * square(pull);
    const Vec3 kept = stored(f.particle, began_.x[at(f.particle)] + f.off);
    // What is made of dt, of dt² g and of s is common to all. So is what a prediction rounds where all move alike:
    // places are multiples of what a place rounds, and the same is added to each of them.
    const double common = u_ * (2 * (inertia_[at(f.particle)] + pull) + (k_ < 0 ? norm(kept) : 0));
    part.common += mass * common;
    part.along_common += mass * common * pull;
    mass_of[at(f.particle)] = mass;
    pull_of[at(f.particle)] = f.pull;
    for (int axis = 0; axis < 3; ++axis) {
      int exponent = 0;
      const double digits = std::round(std::frexp(kept[axis], &exponent) / (kEqualRounds * u_));
      const double rounding = mass * std::sqrt(f.squares / 3);
      terms.push_back({label, axis, exponent, digits, rounding, rounding * pull});
    }
  }
  std::sort(terms.begin(), terms.end(), [](const Term& a, const Term& b) { return a.key() < b.key(); });
  for (std::size_t begin = 0; begin < terms.size();) {
    double rounding = 0, along = 0;
    std::size_t end = begin;
    for (; end < terms.size() && terms[end].key() == terms[begin].key(); ++end) {
      rounding += terms[end].rounding;
      along += terms[end].along;
    }
    Part& part = parts[at(terms[begin].part)];
    part.squares += square(rounding);
    part.along_squares += square(along);
    begin = end;
  }
  if (k_ >= 0) {  // common to the members of a cluster
    for (int32_t c = 0; c < began_.clusters.count(); ++c) {
      const auto members = began_.clusters.of(c);
      if (members.empty()) continue;
      double mass = 0, stretched = 0;
      Vec3 pulls;
      for (std::size_t m = 0; m < members.size(); ++m) {
        const int32_t i = members[m];
        const double own = mass_of[at(i)] / holders_[at(i)];
        mass += own;
        pulls += own * pull_of[at(i)];
        stretched += own * volume_off_[at(began_.clusters.offsets[at(c)]) + m] * norm(pull_of[at(i)]);
      }
      Part& part = parts[at(coupled_.label[at(members.front())])];
      part.along_common += shared_ * stretched;
      const double off = shared_ * clusters_[at(c)].center_off;
      part.squares += square(off * mass);
      part.along_squares += square(off * norm(pulls));
    }
  }
  for (const Part& part : parts) {
    if (part.first < 0) continue;
    see(IteratePart::sum, norm(part.off), kTimesOfSums * std::sqrt(part.squares) + part.common, part.first);
    if (part.pulls > 0) {
      see(IteratePart::pull, std::abs(part.along), kTimesOfSums * std::sqrt(part.along_squares) + part.along_common,
          part.first);
    }
  }
}

}  // namespace cutproof::oracles
