// The reference solution of one implicit substep (method.md §3), twice: by alternating a sparse solve with the
// rotations, and by the plain iteration. Both work on the same problem (oracles/comparison/substep_problem.h) and share
// nothing with a backend.
#include "oracles/comparison/reference_solution.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>

#include "oracles/comparison/cluster_system.h"
#include "oracles/comparison/contact_stage.h"
#include "oracles/comparison/substep_problem.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

constexpr int32_t kMostAlternations = 20000;
constexpr double kConverged = 1e-12;  // [h], method.md §3
// Rounds of the active set of one axis. Each round ends with a set that is optimal for the last t or changes it; with
// one wall per side a handful are enough, and a pair that rounding flips back and forth must not hang the search.
constexpr int kMostActiveSets = 100;
// Plain iterations from which contacts are solved for: a way round a blade is found by going there.
constexpr int kFirstIterations = 32;

// Throws std::invalid_argument if nothing can rest between the walls.
SubstepProblem problem_with_room(const Setup& setup, const State& state) {
  SubstepProblem problem(setup, state);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (problem.low[axis] > problem.high[axis]) {
      throw std::invalid_argument("the reference solution of a substep: two walls leave no room between them");
    }
  }
  return problem;
}

double greatest_change(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double change = 0;
  for (std::size_t i = 0; i < a.size(); ++i) change = std::max(change, norm(a[i] - b[i]));
  return change;
}

// --- For fixed rotations: E over x and t together --------------------------------------------------------------------

// The factor of a substep's system along one axis, made again for every substep and every set of fixed particles:
// updates of a factor save little.
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
  explicit LinearStage(const SubstepProblem& problem) : problem_(problem) {
    for (int axis = 0; axis < 3; ++axis) refactor(axis, given());
  }

  // Positions that minimise E over x and t with these offsets from t, walls held.
  std::vector<Vec3> positions(const Poses& poses) {
    const std::vector<Vec3> turned = turned_offsets(problem_, poses);
    std::vector<Vec3> x = problem_.predicted;
    for (int axis = 0; axis < 3; ++axis) minimise(axis, turned, x);
    return x;
  }

 private:
  std::vector<uint8_t> given() const {
    std::vector<uint8_t> fixed(problem_.held.size());
    for (int32_t i = 0; i < problem_.body.particle_count(); ++i) fixed[at(i)] = problem_.is_free(i) ? kFree : kGiven;
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
      const ClusterSystem system = cluster_system(problem_.body, problem_.clusters, problem_.s, fixed_[at(axis)]);
      same = factorised(matrix_of(system, cholmod_), cholmod_);
    }
    factor_[at(axis)] = std::move(same);
  }

  // One coordinate of where elasticity acts on a particle that is at x, and the other way.
  double ahead(int32_t i, int axis, double x) const {
    Vec3 place = problem_.start[at(i)];
    place[axis] = x;
    return problem_.ahead(i, place)[axis];
  }
  double back(int32_t i, int axis, double y) const {
    Vec3 place = problem_.start[at(i)];
    place[axis] = y;
    return problem_.back(i, place)[axis];
  }

  // The sum over a particle's clusters of w · (its coordinate of y, as far as it does not depend on t).
  double known_part(int32_t i, int axis, const std::vector<Vec3>& turned) const {
    switch (fixed_[at(axis)][at(i)]) {
      case kOnLowWall:
        return ahead(i, axis, problem_.low[at(axis)]);
      case kOnHighWall:
        return ahead(i, axis, problem_.high[at(axis)]);
      case kGiven:
        return problem_.predicted_ahead[at(i)][axis];
      default:
        return (1 - problem_.s) * problem_.predicted_ahead[at(i)][axis] + problem_.s * turned[at(i)][axis];
    }
  }

  // A free particle's coordinate that minimises E given t, as if there were no walls.
  double optimum(int32_t i, int axis, const std::vector<double>& t, const std::vector<Vec3>& turned) const {
    const auto clusters = problem_.memberships.of(i);
    if (clusters.empty()) return problem_.predicted[at(i)][axis];
    double sum = 0;
    for (const int32_t c : clusters) sum += t[at(c)];
    const double goal = sum / static_cast<double>(clusters.size()) + turned[at(i)][axis];
    return back(i, axis, (1 - problem_.s) * problem_.predicted_ahead[at(i)][axis] + problem_.s * goal);
  }

  // One coordinate of all particles. Particles on a wall are fixed there, and the others are solved. The new set on the
  // wall has exactly the particles whose free optimum, given t, lies beyond it (Hintermüller, Ito and Kunisch 2002,
  // primal-dual active set; it converges monotonically here, because the matrix is an M-matrix).
  void minimise(int axis, const std::vector<Vec3>& turned, std::vector<Vec3>& x) {
    for (int round = 0; round < kMostActiveSets; ++round) {
      std::vector<double> right(at(problem_.clusters.count()), 0.0);
      for (int32_t i = 0; i < problem_.body.particle_count(); ++i) {
        const double moment = problem_.rest.weight[at(i)] * known_part(i, axis, turned);
        for (const int32_t c : problem_.memberships.of(i)) right[at(c)] += moment;
      }
      const std::vector<double> t = solve(cholmod_, factor_[at(axis)]->get(), std::move(right));
      std::vector<uint8_t> next = given();
      for (int32_t i = 0; i < problem_.body.particle_count(); ++i) {
        if (!problem_.is_free(i)) continue;
        const double free = optimum(i, axis, t, turned);
        x[at(i)][axis] = problem_.clamped(free, axis);
        next[at(i)] = free < x[at(i)][axis] ? kOnLowWall : free > x[at(i)][axis] ? kOnHighWall : kFree;
      }
      if (next == fixed_[at(axis)]) return;
      refactor(axis, std::move(next));
    }
  }

  const SubstepProblem& problem_;
  Cholmod cholmod_;                            // before the factors: it outlives them
  std::array<std::vector<uint8_t>, 3> fixed_;  // [axis][n] of Fixed
  std::array<std::shared_ptr<const Factor>, 3> factor_;
};

// The fixed point of the substep, by alternating positions and rotations. `rest`: the fixed point for given rotations,
// or none.
template <class AtRest>
ReferenceSolution alternated(const SubstepProblem& problem, std::vector<Vec3> first, const std::vector<Mat3>& previous,
                             const AtRest& at_rest) {
  const double h = problem.body.grid.spacing;
  ReferenceSolution result;
  result.x = std::move(first);
  Poses poses = poses_at(problem, result.x, previous);
  result.converged = problem.clusters.count() == 0;
  // Of the way to the limit, if changes go on shrinking so [h].
  double left = std::numeric_limits<double>::infinity();
  while (problem.clusters.count() > 0 && result.alternations < kMostAlternations &&
         !(result.converged && left < kConverged / 10)) {
    std::optional<std::vector<Vec3>> x = at_rest(poses);
    if (!x) {
      result.converged = false;
      break;
    }
    const double change = greatest_change(*x, result.x) / h;
    const double shrunk = result.alternations == 0 ? 1 : change / result.last_change;
    if (result.converged && !(shrunk < 1)) break;  // nothing but rounding is left, or nothing
    left = shrunk < 1 ? change * shrunk / (1 - shrunk) : left;
    result.last_change = change;
    result.converged = change < kConverged;
    result.x = std::move(*x);
    poses = poses_at(problem, result.x, poses.rotation);
    ++result.alternations;
  }
  result.rotation = poses.rotation;
  result.energy = energy_at(problem, result.x, poses);
  return result;
}

// `previous`: [m] rotations before the substep.
ReferenceSolution solution_of(const SubstepProblem& problem, const std::vector<Mat3>& previous) {
  std::vector<Vec3> first = first_positions(problem);
  if (!problem.contacts.path_matters()) {
    LinearStage linear(problem);
    ReferenceSolution result = alternated(problem, std::move(first), previous,
                                          [&](const Poses& poses) { return std::optional(linear.positions(poses)); });
    result.is_minimum = result.converged;
    return result;
  }
  std::vector<Mat3> rotation = previous;
  for (int k = 0; k < kFirstIterations; ++k) {
    const Poses poses = poses_at(problem, first, rotation);
    first = plain_iterate(problem, first, poses);
    rotation = poses.rotation;
  }
  ContactStage contacts(problem);
  ContactStage::Rest rest;
  std::vector<Vec3> center;
  ReferenceSolution result = alternated(problem, std::move(first), rotation, [&](const Poses& poses) {
    if (center.empty()) center = poses.center;
    rest = contacts.rest(poses, center);
    return rest.found ? std::optional(rest.x) : std::nullopt;
  });
  result.is_minimum = result.converged && !rest.x.empty() && contacts.is_strict_minimum(rest);
  return result;
}

PlainLimit limit_of(const SubstepProblem& problem, const std::vector<Mat3>& previous, double tolerance, int64_t most) {
  const double h = problem.body.grid.spacing;
  const auto drift = [&](const std::vector<Vec3>& x) {
    Vec3 sum;
    double scale = 0;
    for (int32_t i = 0; i < problem.body.particle_count(); ++i) {
      if (!problem.alive[at(i)]) continue;
      sum += problem.body.mass[at(i)] * (x[at(i)] - problem.predicted[at(i)]);
      scale += problem.body.mass[at(i)] * norm(problem.predicted[at(i)] - problem.start[at(i)]);
    }
    return scale > 0 ? norm(sum) / scale : norm(sum);
  };
  PlainLimit result;
  result.x = first_positions(problem);
  Poses poses = poses_at(problem, result.x, previous);
  const auto note = [&] {
    result.energy.push_back(energy_at(problem, result.x, poses));
    result.momentum_drift.push_back(drift(result.x));
  };
  note();
  while (result.iterations < most) {
    std::vector<Vec3> x = plain_iterate(problem, result.x, poses);
    result.last_change = greatest_change(x, result.x) / h;
    result.x = std::move(x);
    poses = poses_at(problem, result.x, poses.rotation);
    note();
    ++result.iterations;
    if (result.last_change < tolerance) break;
  }
  result.rotation = std::move(poses.rotation);
  return result;
}

}  // namespace

ReferenceSolution reference_solution(const Setup& setup, const State& state) {
  return solution_of(problem_with_room(setup, state), state.clusters.rotation);
}

SubstepAnswer substep_answer(const Setup& setup, const State& state) {
  const SubstepProblem problem = problem_with_room(setup, state);
  ReferenceSolution rest = solution_of(problem, state.clusters.rotation);
  SubstepAnswer answer = {.x = std::move(rest.x),
                          .rotation = std::move(rest.rotation),
                          .energy = rest.energy,
                          .by = rest.is_minimum ? SolvedBy::minimum : SolvedBy::rest,
                          .converged = rest.converged,
                          .elsewhere = {}};
  if (!problem.contacts.path_matters()) {
    answer.by = SolvedBy::minimum;
    return answer;
  }
  PlainLimit limit = limit_of(problem, state.clusters.rotation, kMeets / 1000, kMostIterations);
  const double apart = greatest_change(answer.x, limit.x) / setup.body.grid.spacing;
  if (rest.converged && apart <= kMeets) return answer;
  answer.by = SolvedBy::iteration;
  answer.converged = limit.last_change < kMeets / 1000;
  if (rest.converged && answer.converged) {
    const double end = limit.energy.back();
    answer.elsewhere = {apart, end > 0 ? (rest.energy - end) / end : 0};
  }
  answer.x = std::move(limit.x);
  answer.rotation = std::move(limit.rotation);
  answer.energy = limit.energy.back();
  return answer;
}

PlainLimit plain_limit(const Setup& setup, const State& state, double tolerance, int64_t most) {
  return limit_of(problem_with_room(setup, state), state.clusters.rotation, tolerance, most);
}

double substep_energy(const Setup& setup, const State& state, const std::vector<Vec3>& x) {
  const SubstepProblem problem(setup, state);
  return energy_at(problem, x, poses_at(problem, x, state.clusters.rotation));
}

std::vector<Vec3> substep_gradient(const Setup& setup, const State& state, const std::vector<Vec3>& x) {
  const SubstepProblem problem(setup, state);
  const Poses poses = poses_at(problem, x, state.clusters.rotation);
  const std::vector<Vec3> y = problem.ahead(x);
  std::vector<Vec3> gradient(x.size());
  for (int32_t c = 0; c < problem.clusters.count(); ++c) {
    auto offset = problem.offset.begin() + problem.clusters.offsets[at(c)];
    for (const int32_t i : problem.clusters.of(c)) {
      const Vec3 from_center = y[at(i)] - poses.center[at(c)];
      const Vec3 d = (1 - problem.volume_share) * from_center - poses.map[at(c)] * *offset++;
      gradient[at(i)] += problem.stiffness * problem.rest.weight[at(i)] * d;
    }
  }
  for (int32_t i = 0; i < problem.body.particle_count(); ++i) {
    if (!problem.is_free(i)) continue;
    const Vec3 d = y[at(i)] - problem.predicted_ahead[at(i)];
    gradient[at(i)] += problem.body.mass[at(i)] / (problem.dt * (problem.dt + problem.retardation)) * d;
  }
  for (Vec3& of_particle : gradient) of_particle = of_particle / problem.share;  // y moves so much more than x
  return gradient;
}

}  // namespace cutproof::oracles
