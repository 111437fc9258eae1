// Stage detect (method.md §4): which particles a cut has taken out of the tissue.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "reference_cpu/reference.h"

namespace cutproof::reference {

namespace {

std::size_t at(int64_t index) { return static_cast<std::size_t>(index); }

// d_i: greatest current distance from particle i to a neighbour in G; 0 without neighbours.
double greatest_neighbour_distance(const Body& body, const State& state, int32_t i) {
  double greatest = 0;
  for (int direction = 0; direction < 6; ++direction) {
    const int32_t j = body.neighbour(i, direction);
    if (j >= 0 && state.alive[at(j)]) greatest = std::max(greatest, norm(state.x[at(i)] - state.x[at(j)]));
  }
  return greatest;
}

std::vector<uint8_t> too_far_apart(const Setup& setup, const State& state) {
  const double limit = setup.detect.epsilon * setup.body.grid.spacing;
  std::vector<uint8_t> found(state.alive.size(), 0);
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (state.alive[at(i)]) found[at(i)] = greatest_neighbour_distance(setup.body, state, i) > limit;
  }
  return found;
}

// The part of the blade's sweep in which its orientation stays the same: the Minkowski sum of the mid-surface and the
// way that the edge's middle goes. `slack` bounds how far the true sweep is from this.
struct Sweep {
  BladePose pose;  // where it begins
  Vec3 way;
  double slack = 0;
};

// Distance from x to { edge + u·along + w·back + t·way : |u| <= L/2, 0 <= w <= D, 0 <= t <= 1 }: a least squares
// problem in a box. The minimum lies inside one of the box's 27 faces, where it solves the normal equations of the
// free unknowns; those that are singular have a minimum on a smaller face as well.
double distance_to_sweep(const Blade& blade, const Sweep& sweep, Vec3 x) {
  const Vec3 direction[3] = {sweep.pose.along, sweep.pose.back, sweep.way};
  const double low[3] = {-blade.length / 2, 0, 0};
  const double high[3] = {blade.length / 2, blade.depth, 1};
  double best = std::numeric_limits<double>::infinity();
  for (int face = 0; face < 27; ++face) {
    const int kind[3] = {face % 3, face / 3 % 3, face / 9};  // 0: at low, 1: at high, 2: free
    Vec3 rest = x - sweep.pose.edge;
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3> free_directions(3, 0);
    std::vector<int> unknown;
    for (int k = 0; k < 3; ++k) {
      if (kind[k] == 2) {
        unknown.push_back(k);
      } else {
        rest -= (kind[k] == 0 ? low[k] : high[k]) * direction[k];
      }
    }
    const auto count = static_cast<Eigen::Index>(unknown.size());
    free_directions.resize(3, count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const Vec3 d = direction[unknown[at(k)]];
      free_directions.col(k) << d.x, d.y, d.z;
    }
    if (count > 0) {
      const Eigen::Vector3d target(rest.x, rest.y, rest.z);
      const auto qr = free_directions.colPivHouseholderQr();
      if (qr.rank() < count) continue;
      const Eigen::VectorXd solution = qr.solve(target);
      bool inside = true;
      for (Eigen::Index k = 0; k < count; ++k) {
        const int which = unknown[at(k)];
        inside = inside && low[which] <= solution[k] && solution[k] <= high[which];
      }
      if (!inside) continue;
      const Eigen::Vector3d left = target - free_directions * solution;
      rest = {left.x(), left.y(), left.z()};
    }
    best = std::min(best, norm(rest));
  }
  return best;
}

Vec3 turned(Vec3 v, Vec3 axis, double angle) {  // Rodrigues
  return std::cos(angle) * v + std::sin(angle) * cross(axis, v) + (1 - std::cos(angle)) * dot(axis, v) * axis;
}

// A turning move is cut into so many translations that each is off by at most a twentieth of a spacing.
std::vector<Sweep> sweeps_of(const Blade& blade, const BladeMove& move, double spacing) {
  const BladePose &from = move.from, &to = move.to;
  const Vec3 way = to.edge - from.edge;
  Eigen::Matrix3d a, b;
  const auto fill = [](const BladePose& pose, Eigen::Matrix3d& m) {
    const Vec3 normal = cross(pose.along, pose.back);
    m << pose.along.x, pose.back.x, normal.x, pose.along.y, pose.back.y, normal.y, pose.along.z, pose.back.z, normal.z;
  };
  fill(from, a);
  fill(to, b);
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(b * a.transpose()));
  if (from.along == to.along && from.back == to.back) return {{from, way, 0}};
  const double radius = std::hypot(blade.length / 2, blade.depth);
  const double arc = radius * turn.angle();
  const int pieces = std::max(1, static_cast<int>(std::ceil(arc / (0.05 * spacing))));
  const Vec3 axis = {turn.axis().x(), turn.axis().y(), turn.axis().z()};
  std::vector<Sweep> sweeps;
  for (int k = 0; k < pieces; ++k) {
    const double fraction = static_cast<double>(k) / pieces;
    const double angle = fraction * turn.angle();
    sweeps.push_back({{from.edge + fraction * way, turned(from.along, axis, angle), turned(from.back, axis, angle)},
                      way / pieces,
                      arc / pieces});
  }
  return sweeps;
}

// A node goes if it is within half the blade's thickness of the swept mid-surface, or within half of its longest edge:
// whichever edge the blade crosses then loses an end, also where tissue is stretched. At rest the longest edge is h.
// Ties go to removal: a blade halfway between two layers of nodes takes both, and rounding must not leave it none.
std::vector<uint8_t> swept_over(const Setup& setup, const State& state) {
  constexpr double kTie = 1 + 1e-9;
  const double h = setup.body.grid.spacing;
  std::vector<uint8_t> found(state.alive.size(), 0);
  for (int32_t s = 0; s < setup.step.substeps; ++s) {
    const BladeMove& move = setup.blade_moves[at(state.frame * setup.step.substeps + s)];
    if (!move.down) continue;
    for (const Sweep& sweep : sweeps_of(setup.blade, move, h)) {
      const Vec3 normal = cross(sweep.pose.along, sweep.pose.back);
      // The sweep's bounding box in the blade's own directions spares most particles the exact distance.
      const Vec3 axes[3] = {sweep.pose.along, sweep.pose.back, normal};
      double low[3] = {-setup.blade.length / 2, 0, 0}, high[3] = {setup.blade.length / 2, setup.blade.depth, 0};
      for (int k = 0; k < 3; ++k) {
        const double moved = dot(sweep.way, axes[k]);
        (moved < 0 ? low : high)[k] += moved;
      }
      for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
        if (!state.alive[at(i)] || found[at(i)]) continue;
        const double longest = std::max(h, greatest_neighbour_distance(setup.body, state, i));
        const double reach = std::max(setup.blade.thickness, longest) / 2 * kTie + sweep.slack;
        bool outside = false;
        for (int k = 0; k < 3; ++k) {
          const double c = dot(state.x[at(i)] - sweep.pose.edge, axes[k]);
          outside = outside || c < low[k] - reach || c > high[k] + reach;
        }
        if (outside) continue;
        found[at(i)] = distance_to_sweep(setup.blade, sweep, state.x[at(i)]) <= reach;
      }
    }
  }
  return found;
}

// The criterion that the paper rejects (its §2.3 and Fig. 7): a particle goes if the deformation gradient A A0⁻¹ of one
// of its clusters stretches some direction by more than the threshold. A cluster without extent in some direction
// says nothing about it; the pseudo-inverse leaves it out.
std::vector<uint8_t> too_much_strain(const Setup& setup, const State& state) {
  const Body& body = setup.body;
  const Clusters& clusters = state.clusters;
  const Memberships memberships = memberships_of(clusters, body.particle_count());
  std::vector<uint8_t> found(state.alive.size(), 0);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    Vec3 center;
    for (const int32_t i : clusters.of(c)) {
      center += (body.mass[at(i)] / static_cast<double>(memberships.count(i))) * state.x[at(i)];
    }
    center = center / clusters.mass[at(c)];
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero(), a0 = Eigen::Matrix3d::Zero();
    for (const int32_t i : clusters.of(c)) {
      const double weight = body.mass[at(i)] / static_cast<double>(memberships.count(i));
      const Vec3 now = state.x[at(i)] - center;
      const Vec3 rest = body.rest_position(i) - clusters.rest_center[at(c)];
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          a(row, column) += weight * now[row] * rest[column];
          a0(row, column) += weight * rest[row] * rest[column];
        }
      }
    }
    if (!a.allFinite()) continue;
    const Eigen::Matrix3d gradient = a * a0.completeOrthogonalDecomposition().pseudoInverse();
    if (gradient.jacobiSvd().singularValues()[0] <= setup.detect.strain) continue;
    for (const int32_t i : clusters.of(c)) found[at(i)] = state.alive[at(i)];
  }
  return found;
}

}  // namespace

void detect(const Setup& setup, State& state) {
  std::vector<uint8_t> found(state.alive.size(), 0);
  switch (setup.detect.criterion) {
    case Criterion::none:
      break;
    case Criterion::distance:
      found = too_far_apart(setup, state);
      break;
    case Criterion::geometric:
      if (setup.has_blade) found = swept_over(setup, state);
      break;
    case Criterion::strain:
      found = too_much_strain(setup, state);
      break;
  }
  state.removed.clear();
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (!found[at(i)]) continue;
    state.alive[at(i)] = 0;
    state.removed.push_back(i);
  }
}

}  // namespace cutproof::reference
