// The reference solution of one implicit substep (method.md §3), twice: by alternating a sparse Cholesky solve with the
// rotations, and by the plain iteration. Both work on the same Substep below and share nothing with a backend.
#include "oracles/comparison/reference_solution.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

#include "oracles/comparison/cluster_system.h"
#include "oracles/eigen.h"
#include "oracles/oracles.h"
#include "oracles/shape_sums.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

constexpr int32_t kMostAlternations = 20000;
constexpr double kConverged = 1e-12;  // [h], method.md §3
// Rounds of the active set of one axis. Each round ends with a set that is optimal for the last t or changes it; with
// one wall per side a handful are enough, and a pair that rounding flips back and forth must not hang the search.
constexpr int kMostActiveSets = 100;

// --- The problem ---------------------------------------------------------------------------------------------------

// Everything of E that stays constant during the substep.
struct Substep {
  const Body& body;
  const Clusters& clusters;
  double dt = 0;
  double stiffness = 0;
  double s = 0;  // k dt² / (1 + k dt²)
  std::vector<uint8_t> alive, held;
  std::vector<Vec3> start;      // x_prev
  std::vector<Vec3> predicted;  // x~ of method.md §3, before contacts; of held particles, where the grip puts them
  WeightedRest rest;
  std::vector<Vec3> offset;  // [members] X_i − T_c
  Memberships memberships;
  std::array<double, 3> low, high;  // walls: low <= x <= high

  bool is_free(int32_t i) const { return alive[at(i)] && !held[at(i)]; }
  double clamped(double value, int axis) const { return std::clamp(value, low[at(axis)], high[at(axis)]); }
};

void require(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(std::string("the reference solution of a substep: ") + what);
}

Substep substep_of(const Setup& setup, const State& state) {
  require(setup.step.solver == Solver::implicit, "only the implicit solver has one");
  require(0 <= state.frame && state.frame < setup.frame_count(), "the state's frame is not in the schedule");
  const Verdict form = well_formed(setup, state);
  require(form.holds, form.witness.text.c_str());
  const auto index = at(state.frame * setup.step.substeps);

  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const Body& body = setup.body;
  Substep substep{.body = body,
                  .clusters = state.clusters,
                  .dt = setup.substep_length[at(state.frame)],
                  .stiffness = setup.step.stiffness,
                  .alive = state.alive,
                  .held = std::vector<uint8_t>(at(body.particle_count()), 0),
                  .start = state.x,
                  .predicted = state.x,
                  .rest = weighted_rest(body, state.clusters),
                  .offset = {},
                  .memberships = memberships_of(state.clusters, body.particle_count()),
                  .low = {-kInfinity, -kInfinity, -kInfinity},
                  .high = {kInfinity, kInfinity, kInfinity}};
  const double dt = substep.dt, kdt2 = substep.stiffness * dt * dt;
  substep.s = kdt2 / (1 + kdt2);
  for (const Wall& wall : setup.walls) {
    const auto axis = at(wall.axis);
    if (wall.side > 0) substep.low[axis] = std::max(substep.low[axis], wall.offset);
    if (wall.side < 0) substep.high[axis] = std::min(substep.high[axis], wall.offset);
  }

  for (int32_t i = 0; i < body.particle_count(); ++i) {
    if (substep.alive[at(i)]) {
      substep.predicted[at(i)] = state.x[at(i)] + dt * state.v[at(i)] + (dt * dt) * setup.step.gravity;
    }
  }
  for (const Grip& grip : setup.grips) {
    if (!grip.active[index]) continue;
    for (const int32_t i : grip.particles) {
      if (!substep.alive[at(i)]) continue;
      substep.held[at(i)] = 1;
      substep.predicted[at(i)] = state.x[at(i)] + grip.displacement[index];
    }
  }

  for (int32_t c = 0; c < state.clusters.count(); ++c) {
    const Vec3 center = cluster_means(substep.rest, state.clusters, state.x, c).rest;
    for (const int32_t i : state.clusters.of(c)) substep.offset.push_back(substep.rest.position[at(i)] - center);
  }
  return substep;
}

// E alone says where the substep goes.
void require_solvable(const Setup& setup, const State& state, const Substep& substep) {
  const auto index = at(state.frame * setup.step.substeps);
  const bool blade = setup.has_blade && setup.blade_moves[index].down && setup.detect.criterion != Criterion::geometric;
  require(!blade, "the blade is down, and the room that it leaves is not convex");
  for (const Wall& wall : setup.walls) require(wall.friction == 0, "a wall has friction, which has no energy");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    require(substep.low[axis] <= substep.high[axis], "two walls leave no room between them");
  }
}

// Where the iteration begins: x~ with the walls projected.
std::vector<Vec3> first_positions(const Substep& substep) {
  std::vector<Vec3> x = substep.predicted;
  for (int32_t i = 0; i < substep.body.particle_count(); ++i) {
    for (int axis = 0; axis < 3 && substep.is_free(i); ++axis) x[at(i)][axis] = substep.clamped(x[at(i)][axis], axis);
  }
  return x;
}

// --- Rotations -----------------------------------------------------------------------------------------------------

// argmax over rotations of tr(Rᵀ A), by SVD (Kabsch 1976, Umeyama 1991): A = U Σ Vᵀ, R = U diag(1, 1, d) Vᵀ with
// d = det(U Vᵀ). Where σ2 + d σ3 = 0 a whole circle of rotations about u1 is as good (a sphere of them if σ1 = σ2
// too); of these the one nearest to `previous`.
Mat3 best_rotation(const Eigen::Matrix3d& a, const Mat3& previous) {
  constexpr double kSame = 1e-12;  // far above the rounding of A, far below what can be told from a circle
  const double scale = a.cwiseAbs().maxCoeff();
  if (!(scale > 0) || !std::isfinite(scale)) return previous;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(a / scale, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d u = svd.matrixU(), v = svd.matrixV();
  const Eigen::Vector3d sigma = svd.singularValues();
  const double d = (u * v.transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d best = u * Eigen::Vector3d(1, 1, d).asDiagonal() * v.transpose();
  if (sigma[1] + d * sigma[2] > kSame * sigma[0]) return to_mat3(best);

  const Eigen::Matrix3d before = as_eigen(previous);
  if (d < 0 && sigma[0] - sigma[1] <= kSame * sigma[0]) {
    // A = −σ Q: all Q (2 n nᵀ − I) are best, and tr(Rᵀ R_prev) = 2 nᵀ (Qᵀ R_prev) n − tr(Qᵀ R_prev).
    const Eigen::Matrix3d q = -(u * v.transpose());
    const Eigen::Matrix3d m = q.transpose() * before;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen((m + m.transpose()) / 2);
    const Eigen::Vector3d n = eigen.eigenvectors().col(2);
    return to_mat3(q * (2 * n * n.transpose() - Eigen::Matrix3d::Identity()));
  }
  const Eigen::Matrix3d b = u.transpose() * before * v * Eigen::Vector3d(1, 1, d).asDiagonal();
  const double angle = std::atan2(b(2, 1) - b(1, 2), b(1, 1) + b(2, 2));
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn(1, 1) = turn(2, 2) = std::cos(angle);
  turn(2, 1) = std::sin(angle);
  turn(1, 2) = -turn(2, 1);
  return to_mat3(u * turn * Eigen::Vector3d(1, 1, d).asDiagonal() * v.transpose());
}

struct Poses {
  std::vector<Vec3> center;    // t_c
  std::vector<Mat3> rotation;  // R_c
};

Poses poses_at(const Substep& substep, const std::vector<Vec3>& x, const std::vector<Mat3>& previous) {
  const Clusters& clusters = substep.clusters;
  Poses poses;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const Vec3 center = cluster_means(substep.rest, clusters, x, c).current;
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    auto offset = substep.offset.begin() + clusters.offsets[at(c)];
    for (const int32_t i : clusters.of(c)) {
      a += as_eigen(substep.rest.weight[at(i)] * (x[at(i)] - center)) * as_eigen(*offset++).transpose();
    }
    poses.center.push_back(center);
    poses.rotation.push_back(best_rotation(a, previous[at(c)]));
  }
  return poses;
}

// [n] the mean over a particle's clusters of R_c (X_i − T_c), to which the mean of t_c is added to give g_i.
std::vector<Vec3> turned_offsets(const Substep& substep, const std::vector<Mat3>& rotation) {
  std::vector<Vec3> mean(at(substep.body.particle_count()));
  const Clusters& clusters = substep.clusters;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    auto offset = substep.offset.begin() + clusters.offsets[at(c)];
    for (const int32_t i : clusters.of(c)) mean[at(i)] += rotation[at(c)] * *offset++;
  }
  for (int32_t i = 0; i < substep.body.particle_count(); ++i) {
    const auto count = substep.memberships.of(i).size();
    if (count > 0) mean[at(i)] = mean[at(i)] / static_cast<double>(count);
  }
  return mean;
}

// [n] g_i; of a particle in no cluster, where it wants to be anyway.
std::vector<Vec3> goals_of(const Substep& substep, const Poses& poses) {
  std::vector<Vec3> goal = turned_offsets(substep, poses.rotation);
  for (int32_t i = 0; i < substep.body.particle_count(); ++i) {
    const auto clusters = substep.memberships.of(i);
    if (clusters.empty()) {
      goal[at(i)] = substep.predicted[at(i)];
      continue;
    }
    Vec3 sum;
    for (const int32_t c : clusters) sum += poses.center[at(c)];
    goal[at(i)] += sum / static_cast<double>(clusters.size());
  }
  return goal;
}

// --- Energy --------------------------------------------------------------------------------------------------------

// E at positions x with the best t and R there. Held particles have no inertia: their positions are given.
double energy_at(const Substep& substep, const std::vector<Vec3>& x, const Poses& poses) {
  double inertial = 0, elastic = 0;
  for (int32_t i = 0; i < substep.body.particle_count(); ++i) {
    if (!substep.is_free(i)) continue;
    const Vec3 d = x[at(i)] - substep.predicted[at(i)];
    inertial += substep.body.mass[at(i)] * dot(d, d);
  }
  for (int32_t c = 0; c < substep.clusters.count(); ++c) {
    auto offset = substep.offset.begin() + substep.clusters.offsets[at(c)];
    for (const int32_t i : substep.clusters.of(c)) {
      const Vec3 d = x[at(i)] - poses.center[at(c)] - poses.rotation[at(c)] * *offset++;
      elastic += substep.rest.weight[at(i)] * dot(d, d);
    }
  }
  return inertial / (2 * substep.dt * substep.dt) + substep.stiffness / 2 * elastic;
}

double greatest_change(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double change = 0;
  for (std::size_t i = 0; i < a.size(); ++i) change = std::max(change, norm(a[i] - b[i]));
  return change;
}

// --- For fixed rotations: E over x and t together --------------------------------------------------------------------

// The factor of a substep's system along one axis. That it is made anew for every substep and every set of fixed
// particles is what was measured to be best (docs/results/accuracy.md, The factor after a cut).
std::shared_ptr<const Factor> factorised(const Sparse& matrix, Cholmod& cholmod) {
  auto factor = std::make_shared<const Factor>(cholmod_analyze(matrix.get(), cholmod.get()), cholmod);
  cholmod_factorize(matrix.get(), factor->get(), cholmod.get());
  cholmod.check();
  return factor;
}

// Why a coordinate of a particle is not solved for.
enum Fixed : uint8_t { kFree = 0, kOnLowWall, kOnHighWall, kGiven };

class LinearStage {
 public:
  explicit LinearStage(const Substep& substep) : substep_(substep) {
    for (int axis = 0; axis < 3; ++axis) refactor(axis, given());
  }

  // Positions that minimise E over x and t with these rotations, walls held.
  std::vector<Vec3> positions(const std::vector<Mat3>& rotation) {
    const std::vector<Vec3> turned = turned_offsets(substep_, rotation);
    std::vector<Vec3> x = substep_.predicted;
    for (int axis = 0; axis < 3; ++axis) minimise(axis, turned, x);
    return x;
  }

 private:
  std::vector<uint8_t> given() const {
    std::vector<uint8_t> fixed(substep_.held.size());
    for (int32_t i = 0; i < substep_.body.particle_count(); ++i) fixed[at(i)] = substep_.is_free(i) ? kFree : kGiven;
    return fixed;
  }

  // Axes with the same fixed particles share one factorisation.
  void refactor(int axis, std::vector<uint8_t> fixed) {
    std::shared_ptr<const Factor> same;
    for (std::size_t other = 0; other < 3; ++other) {
      if (factor_[other] && fixed_[other] == fixed) same = factor_[other];
    }
    fixed_[at(axis)] = std::move(fixed);
    if (!same) {
      const ClusterSystem system = cluster_system(substep_.body, substep_.clusters, substep_.s, fixed_[at(axis)]);
      same = factorised(matrix_of(system, cholmod_), cholmod_);
    }
    factor_[at(axis)] = std::move(same);
  }

  // The sum over a particle's clusters of w · (its coordinate, as far as it does not depend on t).
  double known_part(int32_t i, int axis, const std::vector<Vec3>& turned) const {
    switch (fixed_[at(axis)][at(i)]) {
      case kOnLowWall:
        return substep_.low[at(axis)];
      case kOnHighWall:
        return substep_.high[at(axis)];
      case kGiven:
        return substep_.predicted[at(i)][axis];
      default:
        return (1 - substep_.s) * substep_.predicted[at(i)][axis] + substep_.s * turned[at(i)][axis];
    }
  }

  // A free particle's coordinate that minimises E given t, as if there were no walls.
  double optimum(int32_t i, int axis, const std::vector<double>& t, const std::vector<Vec3>& turned) const {
    const auto clusters = substep_.memberships.of(i);
    if (clusters.empty()) return substep_.predicted[at(i)][axis];
    double sum = 0;
    for (const int32_t c : clusters) sum += t[at(c)];
    const double goal = sum / static_cast<double>(clusters.size()) + turned[at(i)][axis];
    return (1 - substep_.s) * substep_.predicted[at(i)][axis] + substep_.s * goal;
  }

  // One coordinate of all particles. Particles that stand on a wall are fixed there; the rest is solved; who stands
  // on a wall is asked anew: exactly those whose free optimum, given t, lies beyond it (Hintermüller, Ito and Kunisch
  // 2002, primal-dual active set; it converges monotonically here, because the matrix is an M-matrix).
  void minimise(int axis, const std::vector<Vec3>& turned, std::vector<Vec3>& x) {
    for (int round = 0; round < kMostActiveSets; ++round) {
      std::vector<double> right(at(substep_.clusters.count()), 0.0);
      for (int32_t i = 0; i < substep_.body.particle_count(); ++i) {
        const double moment = substep_.rest.weight[at(i)] * known_part(i, axis, turned);
        for (const int32_t c : substep_.memberships.of(i)) right[at(c)] += moment;
      }
      const std::vector<double> t = solve(cholmod_, factor_[at(axis)]->get(), std::move(right));
      std::vector<uint8_t> next = given();
      for (int32_t i = 0; i < substep_.body.particle_count(); ++i) {
        if (!substep_.is_free(i)) continue;
        const double free = optimum(i, axis, t, turned);
        x[at(i)][axis] = substep_.clamped(free, axis);
        next[at(i)] = free < x[at(i)][axis] ? kOnLowWall : free > x[at(i)][axis] ? kOnHighWall : kFree;
      }
      if (next == fixed_[at(axis)]) return;
      refactor(axis, std::move(next));
    }
  }

  const Substep& substep_;
  Cholmod cholmod_;                            // before the factors: it outlives them
  std::array<std::vector<uint8_t>, 3> fixed_;  // [axis][n] of Fixed
  std::array<std::shared_ptr<const Factor>, 3> factor_;
};

}  // namespace

ReferenceSolution reference_solution(const Setup& setup, const State& state) {
  const Substep substep = substep_of(setup, state);
  require_solvable(setup, state, substep);
  const double h = setup.body.grid.spacing;
  ReferenceSolution result;
  result.x = first_positions(substep);
  Poses poses = poses_at(substep, result.x, state.clusters.rotation);
  if (state.clusters.count() > 0) {
    LinearStage linear(substep);
    // Of the way to the limit, if changes go on shrinking so [h].
    double left = std::numeric_limits<double>::infinity();
    while (result.alternations < kMostAlternations && !(result.converged && left < kConverged / 10)) {
      std::vector<Vec3> x = linear.positions(poses.rotation);
      const double change = greatest_change(x, result.x) / h;
      const double shrunk = result.alternations == 0 ? 1 : change / result.last_change;
      if (result.converged && shrunk >= 1) break;  // nothing but rounding is left
      left = shrunk < 1 ? change * shrunk / (1 - shrunk) : left;
      result.last_change = change;
      result.converged = change < kConverged;
      result.x = std::move(x);
      poses = poses_at(substep, result.x, poses.rotation);
      ++result.alternations;
    }
  } else {
    result.converged = true;
  }
  result.rotation = poses.rotation;
  result.energy = energy_at(substep, result.x, poses);
  return result;
}

double substep_energy(const Setup& setup, const State& state, const std::vector<Vec3>& x) {
  const Substep substep = substep_of(setup, state);
  return energy_at(substep, x, poses_at(substep, x, state.clusters.rotation));
}

std::vector<Vec3> substep_gradient(const Setup& setup, const State& state, const std::vector<Vec3>& x) {
  const Substep substep = substep_of(setup, state);
  const Poses poses = poses_at(substep, x, state.clusters.rotation);
  std::vector<Vec3> gradient(x.size());
  for (int32_t c = 0; c < substep.clusters.count(); ++c) {
    auto offset = substep.offset.begin() + substep.clusters.offsets[at(c)];
    for (const int32_t i : substep.clusters.of(c)) {
      const Vec3 d = x[at(i)] - poses.center[at(c)] - poses.rotation[at(c)] * *offset++;
      gradient[at(i)] += substep.stiffness * substep.rest.weight[at(i)] * d;
    }
  }
  for (int32_t i = 0; i < substep.body.particle_count(); ++i) {
    if (!substep.is_free(i)) continue;
    const Vec3 d = x[at(i)] - substep.predicted[at(i)];
    gradient[at(i)] += substep.body.mass[at(i)] / (substep.dt * substep.dt) * d;
  }
  return gradient;
}

PlainLimit plain_limit(const Setup& setup, const State& state, double tolerance, int64_t most) {
  const Substep substep = substep_of(setup, state);
  require_solvable(setup, state, substep);
  const double h = setup.body.grid.spacing;
  const auto drift = [&](const std::vector<Vec3>& x) {
    Vec3 sum;
    double scale = 0;
    for (int32_t i = 0; i < substep.body.particle_count(); ++i) {
      if (!substep.alive[at(i)]) continue;
      sum += substep.body.mass[at(i)] * (x[at(i)] - substep.predicted[at(i)]);
      scale += substep.body.mass[at(i)] * norm(substep.predicted[at(i)] - substep.start[at(i)]);
    }
    return scale > 0 ? norm(sum) / scale : norm(sum);
  };
  PlainLimit result;
  result.x = first_positions(substep);
  Poses poses = poses_at(substep, result.x, state.clusters.rotation);
  const auto note = [&] {
    result.energy.push_back(energy_at(substep, result.x, poses));
    result.momentum_drift.push_back(drift(result.x));
  };
  note();
  while (result.iterations < most) {
    const std::vector<Vec3> goal = goals_of(substep, poses);
    std::vector<Vec3> x = result.x;
    for (int32_t i = 0; i < substep.body.particle_count(); ++i) {
      if (!substep.is_free(i)) continue;
      const Vec3 from = substep.predicted[at(i)];
      x[at(i)] = from + substep.s * (goal[at(i)] - from);
      for (int axis = 0; axis < 3; ++axis) x[at(i)][axis] = substep.clamped(x[at(i)][axis], axis);
    }
    result.last_change = greatest_change(x, result.x) / h;
    result.x = std::move(x);
    poses = poses_at(substep, result.x, poses.rotation);
    note();
    ++result.iterations;
    if (result.last_change < tolerance) break;
  }
  return result;
}

}  // namespace cutproof::oracles
