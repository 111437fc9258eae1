// Stage detect (method.md §4): which particles a cut removes from the tissue.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "model/at.h"
#include "reference_cpu/carrier.h"
#include "reference_cpu/lowered_blade.h"
#include "reference_cpu/reference.h"

namespace cutproof::reference {

namespace {

// d_i: greatest current distance from particle i to a neighbour in G; 0 without neighbours.
double greatest_neighbour_distance(const Body& body, const State& state, int32_t i) {
  double greatest = 0;
  for (const int32_t j : body.neighbours(i)) {
    if (state.alive[at(j)]) greatest = std::max(greatest, norm(state.x[at(i)] - state.x[at(j)]));
  }
  return greatest;
}

// An edge of G beyond ε times its rest length.
struct OpenEdge {
  int32_t low, high;
};

std::vector<OpenEdge> open_edges(const Setup& setup, const State& state) {
  std::vector<OpenEdge> open;
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (!state.alive[at(i)]) continue;
    for (const int32_t j : setup.body.neighbours(i)) {
      const double limit = setup.detect.epsilon * setup.body.rest_length(i, j);
      if (i < j && state.alive[at(j)] && norm(state.x[at(i)] - state.x[at(j)]) > limit) open.push_back({i, j});
    }
  }
  return open;
}

std::vector<uint8_t> both_ends(const std::vector<OpenEdge>& open, std::size_t particles) {
  std::vector<uint8_t> found(particles, 0);
  for (const OpenEdge edge : open) found[at(edge.low)] = found[at(edge.high)] = 1;
  return found;
}

// The removed end is, in this order of precedence:
// - the end on the blade's negative side, if the blade's plane separates the ends. RemovedEnds::nearer takes the other
//   end if the clusters carry it nearer to the plane by more than kNearerBy;
// - the end with more open edges;
// - the end with the lower number.
std::vector<uint8_t> one_end_of_each(const Setup& setup, const State& state, const std::vector<OpenEdge>& open) {
  const BladePose* blade = lowered_blade(setup, state.frame);
  const auto height = [&](Vec3 x) { return dot(x - blade->edge, cross(blade->along, blade->back)); };
  const auto is_negative = [&](int32_t i) { return height(state.x[at(i)]) < 0; };
  std::optional<Carrier> carried;
  if (blade != nullptr && setup.detect.remove == RemovedEnds::nearer) carried.emplace(setup, state);
  const auto negative_goes = [&](int32_t negative, int32_t positive) {
    const double slack = kNearerBy * setup.body.grid.spacing;
    return !carried || std::abs(height((*carried)(negative))) <= std::abs(height((*carried)(positive))) + slack;
  };
  std::vector<int> open_at(state.alive.size(), 0);
  for (const OpenEdge edge : open) {
    ++open_at[at(edge.low)];
    ++open_at[at(edge.high)];
  }
  std::vector<uint8_t> found(state.alive.size(), 0);
  for (const auto [low, high] : open) {
    bool low_goes = open_at[at(low)] >= open_at[at(high)];
    if (blade != nullptr && is_negative(low) != is_negative(high)) {
      low_goes = is_negative(low) ? negative_goes(low, high) : !negative_goes(high, low);
    }
    found[at(low_goes ? low : high)] = 1;
  }
  return found;
}

std::vector<uint8_t> too_far_apart(const Setup& setup, const State& state) {
  const std::vector<OpenEdge> open = open_edges(setup, state);
  switch (setup.detect.remove) {
    case RemovedEnds::both:
      return both_ends(open, state.alive.size());
    case RemovedEnds::one:
    case RemovedEnds::nearer:
      return one_end_of_each(setup, state, open);
  }
  return {};
}

// A part of the blade's sweep without rotation: the Minkowski sum of the mid-surface and the path of the edge's middle.
// `slack` bounds the distance to the true sweep.
struct Sweep {
  BladePose pose;  // at its beginning
  Vec3 way;
  double slack = 0;
};

// Whether a point is within reach of { edge + u·along + w·back + t·way : |u| <= L/2, 0 <= w <= D, 0 <= t <= 1 }. The
// distance is a least squares problem in a box. Its minimum lies inside one of the box's 27 faces and solves the normal
// equations of the face's free unknowns. Singular equations are skipped: a smaller face then has a minimum too. Only
// the point differs between particles, so everything else is decomposed once.
class SweepFaces {
 public:
  SweepFaces(const Blade& blade, const Sweep& sweep) : edge_(sweep.pose.edge) {
    const Vec3 direction[3] = {sweep.pose.along, sweep.pose.back, sweep.way};
    const double low[3] = {-blade.length / 2, 0, 0};
    const double high[3] = {blade.length / 2, blade.depth, 1};
    for (int face = 26; face >= 0; --face) {                   // from the inside of the box to its corners
      const int kind[3] = {face % 3, face / 3 % 3, face / 9};  // 0: at low, 1: at high, 2: free
      Face found;
      for (int k = 0; k < 3; ++k) {
        if (kind[k] == 2) {
          const Eigen::Index column = found.count++;
          found.directions.col(column) << direction[k].x, direction[k].y, direction[k].z;
          found.low[column] = low[k];
          found.high[column] = high[k];
        } else {
          found.fixed.push_back((kind[k] == 0 ? low[k] : high[k]) * direction[k]);
        }
      }
      if (found.count > 0) {
        found.qr.compute(found.directions.leftCols(found.count));
        if (found.qr.rank() < found.count) continue;
      }
      faces_.push_back(std::move(found));
    }
  }

  bool within(Vec3 x, double reach) const {
    return std::any_of(faces_.begin(), faces_.end(),
                       [&](const Face& face) { return distance(face, x - edge_) <= reach; });
  }

 private:
  struct Face {
    std::vector<Vec3> fixed;  // contributions of the fixed unknowns
    Eigen::Index count = 0;   // of free unknowns
    Eigen::Matrix3d directions;
    double low[3], high[3];
    Eigen::ColPivHouseholderQR<Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 3>> qr;
  };

  // Distance to the nearest point of the face's plane, if that point lies in the face; otherwise infinite.
  static double distance(const Face& face, Vec3 rest) {
    for (const Vec3 part : face.fixed) rest -= part;
    if (face.count == 0) return norm(rest);
    const Eigen::Vector3d target(rest.x, rest.y, rest.z);
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1> solution = face.qr.solve(target);
    for (Eigen::Index k = 0; k < face.count; ++k) {
      if (!(face.low[k] <= solution[k] && solution[k] <= face.high[k])) return std::numeric_limits<double>::infinity();
    }
    const Eigen::Vector3d left = target - face.directions.leftCols(face.count) * solution;
    return norm({left.x(), left.y(), left.z()});
  }

  Vec3 edge_;
  std::vector<Face> faces_;
};

Vec3 turned(Vec3 v, Vec3 axis, double angle) {  // Rodrigues
  return std::cos(angle) * v + std::sin(angle) * cross(axis, v) + (1 - std::cos(angle)) * dot(axis, v) * axis;
}

// Splits a rotating move into translations, each wrong by at most a twentieth of h.
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

// A node is removed if its distance from the swept mid-surface is at most half the blade's thickness or half its
// longest edge. So each edge that the blade crosses loses an end, stretched tissue included. At rest the longest edge
// is h. Ties are removed: a blade halfway between two layers of nodes removes both, and rounding must not leave it
// none.
std::vector<uint8_t> swept_over(const Setup& setup, const State& state) {
  constexpr double kTie = 1 + 1e-9;
  const double h = setup.body.grid.spacing;
  std::vector<uint8_t> found(state.alive.size(), 0);
  std::vector<double> longest(state.alive.size(), h);
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (state.alive[at(i)]) longest[at(i)] = std::max(h, greatest_neighbour_distance(setup.body, state, i));
  }
  for (int32_t s = 0; s < setup.step.substeps; ++s) {
    const BladeMove& move = setup.blade_moves[at(state.frame * setup.step.substeps + s)];
    if (!move.down) continue;
    for (const Sweep& sweep : sweeps_of(setup.blade, move, h)) {
      const SweepFaces faces(setup.blade, sweep);
      const Vec3 normal = cross(sweep.pose.along, sweep.pose.back);
      // A bounding box along the blade's axes spares most particles the exact distance.
      const Vec3 axes[3] = {sweep.pose.along, sweep.pose.back, normal};
      double low[3] = {-setup.blade.length / 2, 0, 0}, high[3] = {setup.blade.length / 2, setup.blade.depth, 0};
      for (int k = 0; k < 3; ++k) {
        const double moved = dot(sweep.way, axes[k]);
        (moved < 0 ? low : high)[k] += moved;
      }
      for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
        if (!state.alive[at(i)] || found[at(i)]) continue;
        const double reach = std::max(setup.blade.thickness, longest[at(i)]) / 2 * kTie + sweep.slack;
        bool outside = false;
        for (int k = 0; k < 3; ++k) {
          const double c = dot(state.x[at(i)] - sweep.pose.edge, axes[k]);
          outside = outside || c < low[k] - reach || c > high[k] + reach;
        }
        if (outside) continue;
        found[at(i)] = faces.within(state.x[at(i)], reach);
      }
    }
  }
  return found;
}

// The criterion that the paper rejects (§2.3 and Fig. 7): a particle is removed if the deformation gradient A A0⁻¹ of
// one of its clusters stretches some direction beyond the threshold. The pseudo-inverse leaves out directions in which
// the cluster has no extent.
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
