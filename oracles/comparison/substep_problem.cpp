#include "oracles/comparison/substep_problem.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "oracles/eigen.h"
#include "oracles/oracles.h"
#include "oracles/rounding.h"
#include "oracles/support.h"
#include "oracles/volume_target.h"

namespace cutproof::oracles {
namespace {

void require(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(std::string("the reference solution of a substep: ") + what);
}

// The input of the substep, checked before use.
const Setup& checked(const Setup& setup, const State& state) {
  require(setup.step.solver == Solver::implicit, "only the implicit solver has one");
  require(0 <= state.frame && state.frame < setup.frame_count(), "the state's frame is not in the schedule");
  const Verdict form = well_formed(setup, state);
  require(form.holds, form.witness.text.c_str());
  return setup;
}

// nullptr: no blade in the tissue.
const BladeMove* lowered(const Setup& setup, const State& state) {
  if (!setup.has_blade) return nullptr;
  const BladeMove& move = setup.blade_moves[at(state.frame * setup.step.substeps)];
  return move.down ? &move : nullptr;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

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

}  // namespace

SubstepProblem::SubstepProblem(const Setup& setup, const State& state)
    : body(checked(setup, state).body),
      clusters(state.clusters),
      dt(setup.substep_length[at(state.frame)]),
      retardation(setup.step.retardation),
      share(dt / (dt + retardation)),
      stiffness(setup.step.stiffness),
      volume_share(setup.step.volume_share),
      alive(state.alive),
      held(at(body.particle_count()), 0),
      start(state.x),
      predicted(state.x),
      rest(weighted_rest(body, clusters)),
      memberships(memberships_of(clusters, body.particle_count())),
      low{-kInfinity, -kInfinity, -kInfinity},
      high{kInfinity, kInfinity, kInfinity},
      contacts(setup, lowered(setup, state), setup.walls) {
  const auto index = at(state.frame * setup.step.substeps);
  const double kdt2 = stiffness * dt * (dt + retardation);
  s = kdt2 / (1 + kdt2);
  for (const Wall& wall : setup.walls) {
    const auto axis = at(wall.axis);
    if (wall.side > 0) low[axis] = std::max(low[axis], wall.offset);
    if (wall.side < 0) high[axis] = std::min(high[axis], wall.offset);
  }

  for (std::size_t i = 0; i < start.size(); ++i) {
    if (alive[i] != 0) predicted[i] = start[i] + dt * state.v[i] + (dt * dt) * setup.step.gravity;
    side.push_back(contacts.height_at_start(start[i]) < 0 ? -1 : +1);
  }
  for (const Grip& grip : setup.grips) {
    if (!grip.active[index]) continue;
    for (const int32_t i : grip.particles) {
      if (!alive[at(i)]) continue;
      held[at(i)] = 1;
      predicted[at(i)] = start[at(i)] + grip.displacement[index];
    }
  }

  predicted_ahead = ahead(predicted);

  for (int32_t c = 0; c < clusters.count(); ++c) {
    const Vec3 center = cluster_means(rest, clusters, start, c).rest;
    Eigen::Matrix3d of_cluster = Eigen::Matrix3d::Zero();
    for (const int32_t i : clusters.of(c)) {
      offset.push_back(rest.position[at(i)] - center);
      of_cluster += rest.weight[at(i)] * as_eigen(offset.back()) * as_eigen(offset.back()).transpose();
    }
    if (clusters.size(c) == 1) of_cluster.setZero();  // it was the rounding of its centre
    moments.push_back(to_mat3(of_cluster));
  }
}

std::vector<Vec3> SubstepProblem::ahead(const std::vector<Vec3>& x) const {
  std::vector<Vec3> y = x;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    if (alive[at(i)]) y[at(i)] = ahead(i, x[at(i)]);
  }
  return y;
}

Vec3 SubstepProblem::placed(int32_t i, Vec3 free, const Vec3* present) const {
  if (!contacts.any()) return free;
  Contact::Found found;
  const Vec3 x = contacts.place(free, side[at(i)], start[at(i)], found, {});
  if (present == nullptr || !found.in_turn || contacts.has_friction()) return x;
  const double margin = Contact::refusal_margin(norm(*present), free, *present, kUnitRoundoff);
  return norm(x - free) > norm(*present - free) + margin ? *present : x;
}

bool SubstepProblem::is_placed_in_turn(int32_t i, Vec3 free) const {
  Contact::Found found;
  if (contacts.any()) contacts.place(free, side[at(i)], start[at(i)], found, {});
  return found.in_turn;
}

std::vector<Vec3> first_positions(const SubstepProblem& problem) {
  std::vector<Vec3> x = problem.predicted;
  for (int32_t i = 0; i < problem.body.particle_count(); ++i) {
    if (problem.is_free(i)) x[at(i)] = problem.placed(i, x[at(i)]);
  }
  return x;
}

Poses poses_at(const SubstepProblem& problem, const std::vector<Vec3>& x, const std::vector<Mat3>& previous) {
  const Clusters& clusters = problem.clusters;
  const std::vector<Vec3> y = problem.ahead(x);
  Poses poses;
  poses.y = y;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const Vec3 center = cluster_means(problem.rest, clusters, y, c).current;
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    auto offset = problem.offset.begin() + clusters.offsets[at(c)];
    for (const int32_t i : clusters.of(c)) {
      a += as_eigen(problem.rest.weight[at(i)] * (y[at(i)] - center)) * as_eigen(*offset++).transpose();
    }
    poses.center.push_back(center);
    const Mat3 r = best_rotation(a, previous[at(c)]);
    poses.rotation.push_back(r);
    poses.from_f.emplace_back().m.fill(0);
    poses.map.push_back(r);
    if (problem.volume_share == 0) continue;
    const VolumeTarget volume =
        volume_target(to_mat3(a), problem.moments[at(c)], r, degenerate_rounds(kUnitRoundoff) * kUnitRoundoff);
    poses.from_f.back() = volume.from_f;
    poses.map.back() = volume.goal_map(problem.volume_share, r);
  }
  return poses;
}

std::vector<Vec3> turned_offsets(const SubstepProblem& problem, const Poses& poses) {
  std::vector<Vec3> mean(at(problem.body.particle_count()));
  const Clusters& clusters = problem.clusters;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    auto offset = problem.offset.begin() + clusters.offsets[at(c)];
    for (const int32_t i : clusters.of(c)) {
      mean[at(i)] += poses.map[at(c)] * *offset++ + problem.volume_share * (poses.y[at(i)] - poses.center[at(c)]);
    }
  }
  for (int32_t i = 0; i < problem.body.particle_count(); ++i) {
    const auto count = problem.memberships.of(i).size();
    if (count > 0) mean[at(i)] = mean[at(i)] / static_cast<double>(count);
  }
  return mean;
}

namespace {
// [n] g_i; of a particle in no cluster, where it wants to be anyway.
std::vector<Vec3> goals_of(const SubstepProblem& problem, const Poses& poses) {
  std::vector<Vec3> goal = turned_offsets(problem, poses);
  for (int32_t i = 0; i < problem.body.particle_count(); ++i) {
    const auto clusters = problem.memberships.of(i);
    if (clusters.empty()) {
      goal[at(i)] = problem.predicted_ahead[at(i)];
      continue;
    }
    Vec3 sum;
    for (const int32_t c : clusters) sum += poses.center[at(c)];
    goal[at(i)] += sum / static_cast<double>(clusters.size());
  }
  return goal;
}
}  // namespace

std::vector<Vec3> plain_iterate(const SubstepProblem& problem, const std::vector<Vec3>& x, const Poses& poses) {
  const std::vector<Vec3> goal = goals_of(problem, poses);
  std::vector<Vec3> next = x;
  for (int32_t i = 0; i < problem.body.particle_count(); ++i) {
    if (!problem.is_free(i)) continue;
    const Vec3 from = problem.predicted_ahead[at(i)];
    next[at(i)] = problem.placed(i, problem.back(i, from + problem.s * (goal[at(i)] - from)), &x[at(i)]);
  }
  return next;
}

double energy_at(const SubstepProblem& problem, const std::vector<Vec3>& x, const Poses& poses) {
  const std::vector<Vec3> y = problem.ahead(x);
  double inertial = 0, elastic = 0;
  for (int32_t i = 0; i < problem.body.particle_count(); ++i) {
    if (!problem.is_free(i)) continue;
    const Vec3 d = y[at(i)] - problem.predicted_ahead[at(i)];
    inertial += problem.body.mass[at(i)] * dot(d, d);
  }
  for (int32_t c = 0; c < problem.clusters.count(); ++c) {
    auto offset = problem.offset.begin() + problem.clusters.offsets[at(c)];
    for (const int32_t i : problem.clusters.of(c)) {
      const Vec3 from_center = y[at(i)] - poses.center[at(c)], arm = *offset++;
      const Vec3 d = from_center - poses.rotation[at(c)] * arm, e = poses.from_f[at(c)] * arm;
      elastic +=
          problem.rest.weight[at(i)] * ((1 - problem.volume_share) * dot(d, d) + problem.volume_share * dot(e, e));
    }
  }
  return inertial / (2 * problem.dt * (problem.dt + problem.retardation)) + problem.stiffness / 2 * elastic;
}

}  // namespace cutproof::oracles
