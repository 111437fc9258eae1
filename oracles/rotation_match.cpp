// Rotations of clusters, held against where their particles are (tolerances.md, Rotations of a state).
#include "oracles/rotation_match.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "oracles/checks.h"
#include "oracles/rounding.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {

namespace {

// 1 − cos 45°. A rotation that is off by less takes each of the six grid directions nearer to where that neighbour is
// than to where any other is; one that is off by more makes a step exchange them.
const double kHalfARightAngle = 1 - std::numbers::sqrt2 / 2;
// Required accuracy of a rotation for its matrix, in single precision (method.md, Hard cases), in units of u.
constexpr double kGap = 1e-6 * 0x1p24;
// Below that a rotation is told from its transpose by no more than chance.
constexpr double kFarNearer = 0x1p-10;
// 5°. One step from rest turns clusters where contacts and grips reach, and not every one by as much.
constexpr double kNeverTaken = std::numbers::pi / 36;

double frobenius(const Mat3& a, const Mat3& b) {
  double squares = 0;
  for (std::size_t k = 0; k < 9; ++k) squares += (a.m[k] - b.m[k]) * (a.m[k] - b.m[k]);
  return std::sqrt(squares);
}

// Of two rotations |R − R'| = 2 √2 sin(angle / 2).
double angle_between(const Mat3& a, const Mat3& b) {
  return 2 * std::asin(std::min(1.0, frobenius(a, b) / (2 * std::numbers::sqrt2)));
}

// To the nearest best rotation, also where A has rank one and a turn about its direction changes nothing.
double angle_to_best(const BestRotation& best, const Mat3& r) {
  return std::min(angle_between(r, best.r),
                  best.separation < kFarNearer ? angle_between(r, nearest_of_rank_one(best, r).r) : std::numbers::pi);
}

double degrees(double angle) { return angle * 180 / std::numbers::pi; }

bool is_zero(const Mat3& a) {
  return std::all_of(a.m.begin(), a.m.end(), [](double entry) { return entry == 0; });
}

RotationMatch match(const BestRotation& best, const ShapeMatrix& shape, const Mat3& r, double unit_roundoff, Lag lag) {
  RotationMatch found;
  double greatest = 0;  // BestRotation scales A by a power of two
  for (const double entry : shape.a.m) greatest = std::max(greatest, std::abs(entry));
  int exponent = 0;
  static_cast<void>(std::frexp(greatest, &exponent));
  const double sum = std::ldexp(static_cast<double>(best.sum), exponent), rounding = shape.rounding / sum;
  const double two = (best.sigma[0] + best.sigma[1]) / static_cast<double>(best.sum);  // half of the greatest gap
  found.gap = std::max(0.0, objective_gap(best, r));
  found.turn = angle_to_best(best, r);
  found.bound = (lag == Lag::a_step ? kHalfARightAngle * two : 0) + kGap * unit_roundoff + best.error +
                rounding * frobenius(r, best.r);
  found.determined = kGap * unit_roundoff + best.error + 2 * std::numbers::sqrt2 * rounding < two / 2;
  return found;
}

}  // namespace

ShapeMatrix shape_matrix(const WeightedRest& rest, std::span<const int32_t> particles, const std::vector<Vec3>& x,
                         double unit_roundoff, double place_rounding) {
  ShapeMatrix shape;
  shape.a.m = {};
  if (particles.empty()) return shape;
  const std::size_t first = at(particles.front());
  double mass = 0;
  Vec3 rest_mean, mean;  // relative to the first particle, so that a body far away keeps its digits
  for (const int32_t i : particles) {
    const double w = rest.weight[at(i)];
    mass += w;
    rest_mean += w * (rest.position[at(i)] - rest.position[first]);
    mean += w * (x[at(i)] - x[first]);
  }
  if (!(mass > 0)) return shape;
  rest_mean = rest_mean / mass;
  mean = mean / mass;
  double products = 0, arms = 0;
  for (const int32_t i : particles) {
    const double w = rest.weight[at(i)];
    const Vec3 from = rest.position[at(i)] - rest.position[first] - rest_mean, to = x[at(i)] - x[first] - mean;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) shape.a(row, column) += w * to[row] * from[column];
    }
    products += w * norm(from) * norm(to);
    arms += w * (norm(from) + norm(to));
  }
  const double sums = kDeviations * sum_rounds(static_cast<double>(particles.size()));
  shape.rounding = sums * (unit_roundoff + kUnitRoundoff) * products + std::sqrt(3.0) * place_rounding * arms;
  return shape;
}

RotationMatch match_rotation(const ShapeMatrix& shape, const Mat3& r, double unit_roundoff, Lag lag) {
  if (is_zero(shape.a)) return {};
  return match(best_rotation(shape.a), shape, r, unit_roundoff, lag);
}

std::string known_confusion(const BestRotation& best, const Mat3& r) {
  if (r == Mat3{}) return "; it is the identity";
  const double turn = angle_to_best(best, r);
  if (angle_to_best(best, transposed(r)) <= kFarNearer * turn) return "; its transpose is the best one";
  return "";
}

namespace {

void check(Judged& judged, Verdict& verdict, Lag lag) {
  const Clusters& clusters = judged.clusters;
  const double u = unit_roundoff(judged.state);
  const WeightedRest rest = weighted_rest(judged.body, clusters);
  const auto shape_of = [&](int32_t c) {
    return shape_matrix(rest, clusters.of(c), judged.state.x, u, judged.state.place_rounding);
  };
  Nearest nearest;
  double greatest = 0, transposed_greatest = 0;  // turns [rad]
  int32_t farthest = -1;
  bool all_are_best = true, none_was_taken = true;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const ShapeMatrix shape = shape_of(c);
    const Mat3& r = clusters.rotation[at(c)];
    bool finite = true;
    for (std::size_t k = 0; k < 9; ++k) finite = finite && std::isfinite(r.m[k]) && std::isfinite(shape.a.m[k]);
    if (!finite || is_zero(shape.a)) continue;  // "finite" rejects the one, a single particle is the other
    const BestRotation best = best_rotation(shape.a);
    const RotationMatch found = match(best, shape, r, u, lag);
    if (!found.determined) continue;
    ++verdict.checked;
    nearest.see(found.gap, found.bound, c);
    const bool is_best = match(best, shape, r, u, Lag::none).holds();
    all_are_best = all_are_best && is_best;
    none_was_taken = none_was_taken && !is_best && r == Mat3{} && found.turn > kNeverTaken;
    if (found.turn > greatest) {
      greatest = found.turn;
      farthest = c;
    }
    transposed_greatest = std::max(transposed_greatest, angle_to_best(best, transposed(r)));
  }
  if (nearest.where < 0) return;
  verdict.measured = nearest.measured;
  verdict.bound = nearest.bound;
  // However small the turns: of all rotations the transposes are the best, and these are not.
  const bool all_transposed = !all_are_best && transposed_greatest <= kFarNearer * greatest;
  none_was_taken = none_was_taken && verdict.checked > 1;
  if (nearest.holds() && !all_transposed && !none_was_taken) return;
  const int32_t c = nearest.holds() ? farthest : nearest.where, number = judged.number(c);
  const BestRotation best = best_rotation(shape_of(c).a);
  const Mat3& r = clusters.rotation[at(c)];
  std::string instead = known_confusion(best, r);
  if (all_transposed || none_was_taken) {
    const RotationMatch sharp = match(best, shape_of(c), r, u, Lag::none);
    verdict.measured = sharp.gap;
    verdict.bound = sharp.bound;
    instead = all_transposed ? "; the transpose of each rotation is the best one: are they stored column by column?"
                             : "; every rotation is the identity: was none ever taken?";
  }
  for (int32_t other = 0; instead.empty() && other < clusters.count(); ++other) {
    const RotationMatch found = match_rotation(shape_of(other), r, u, Lag::none);
    if (other == c || !found.determined || !found.holds()) continue;
    instead = sentence("; it is the best one of cluster {}", judged.number(other));
  }
  fail(verdict, {{number}},
       "the rotation of cluster {} is turned by {:.3g} degrees from the best one for where its {} "
       "particles are{}",
       number, degrees(angle_to_best(best, r)), clusters.size(c), instead);
}

}  // namespace

void check_rotation_match(Judged& judged, Verdict& verdict) { check(judged, verdict, Lag::a_step); }

void check_best_rotation(Judged& judged, Verdict& verdict) { check(judged, verdict, Lag::none); }

}  // namespace cutproof::oracles
