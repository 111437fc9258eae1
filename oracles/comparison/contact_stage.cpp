#include "oracles/comparison/contact_stage.h"

#include <Eigen/Dense>
#include <Eigen/SparseLU>
#include <array>
#include <cmath>
#include <optional>

#include "oracles/comparison/cluster_system.h"
#include "oracles/eigen.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

// Newton's steps for one set of rotations, and halvings of one that leads away.
constexpr int kMostSteps = 100, kMostHalvings = 12;
// A factor is kept as long as each step with it leaves no more than this share.
constexpr double kGoodShare = 0.1;
// Where t moves by no more, nothing but rounding is left: [h], and in roundings of the greatest position.
constexpr double kAtRest = 1e-14, kRestRounds = 16;
// Over which Π' is taken, to both sides [h].
constexpr double kAside = 1e-5;

}  // namespace

// The derivative at one t, factorised.
class ContactStage::Linear {
 public:
  // `free`: where particles would go; `x`: where contacts let them be. nullptr: it is singular.
  static std::unique_ptr<Linear> of(const SubstepProblem& problem, const std::vector<Vec3>& free,
                                    const std::vector<Vec3>& x) {
    auto linear = std::make_unique<Linear>(problem);
    return linear->factorise(free, x) ? std::move(linear) : nullptr;
  }
  explicit Linear(const SubstepProblem& problem) : problem_(problem) {
    cholmod_.get()->final_ll = 1;  // L D Lᵀ, which small systems are given else, exists where D is negative too
  }

  // Whether it is the derivative itself, and positive definite.
  bool is_exact() const { return is_exact_; }

  // The correction of t [m], where it is off its clusters' means by `left` [m].
  std::vector<Vec3> step(const std::vector<double>& mass, const std::vector<Vec3>& left) {
    Eigen::VectorXd right(static_cast<Eigen::Index>(3 * left.size()));
    for (std::size_t c = 0; c < left.size(); ++c) {
      right.segment<3>(static_cast<Eigen::Index>(3 * c)) = as_eigen(mass[c] * left[c]);
    }
    if (cholesky_) {
      const std::vector<double> solved = solve(cholmod_, cholesky_->get(), {right.begin(), right.end()});
      std::copy(solved.begin(), solved.end(), right.begin());
    } else {
      right = lu_.solve(right).eval();
    }
    std::vector<Vec3> way(left.size());
    for (std::size_t c = 0; c < left.size(); ++c) {
      const auto k = static_cast<Eigen::Index>(3 * c);
      way[c] = {right[k], right[k + 1], right[k + 2]};
    }
    return way;
  }

 private:
  bool factorise(const std::vector<Vec3>& free, const std::vector<Vec3>& x) {
    std::vector<Eigen::Matrix3d> slope(free.size(), Eigen::Matrix3d::Zero());
    std::vector<uint8_t> apart(free.size(), 1);  // not simply where it would go
    const bool is_symmetric = !problem_.contacts.has_friction();
    for (int32_t i = 0; i < problem_.body.particle_count(); ++i) {
      if (!problem_.is_free(i) || problem_.memberships.of(i).empty()) continue;
      if (x[at(i)] == free[at(i)]) {
        apart[at(i)] = 0;
        continue;
      }
      slope[at(i)] = slope_of(i, free[at(i)]);
      if (is_symmetric) slope[at(i)] = ((slope[at(i)] + slope[at(i)].transpose()) / 2).eval();
    }
    if (!is_symmetric) return factorise_lu(slope, apart);
    is_exact_ = factorise_cholesky(slope, apart);
    if (is_exact_) return true;
    // Far from rest a rim, which is round, may bend more than E does. Flat as its tangent planes it never does.
    for (Eigen::Matrix3d& m : slope) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(m);
      m = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseMin(1).asDiagonal() *
          eigen.eigenvectors().transpose();
    }
    return factorise_cholesky(slope, apart);
  }

  Eigen::Matrix3d slope_of(int32_t i, Vec3 free) const {
    const double aside = kAside * problem_.body.grid.spacing;
    Eigen::Matrix3d slope;
    for (int k = 0; k < 3; ++k) {
      Vec3 more = free, less = free;
      more[k] += aside;
      less[k] -= aside;
      slope.col(k) = as_eigen((problem_.placed(i, more) - problem_.placed(i, less)) / (more[k] - less[k]));
    }
    return slope;
  }

  // diag(M) − s Σ w_i / n_i u_i u_iᵀ ⊗ Π'_i; `whole`: not only its lower triangle.
  std::vector<Entry> entries(const std::vector<Eigen::Matrix3d>& slope, const std::vector<uint8_t>& apart,
                             bool whole) const {
    const ClusterSystem system = cluster_system(problem_.body, problem_.clusters, problem_.s, apart);
    std::vector<Entry> result;
    const auto add = [&](int32_t c, int32_t d, double weight, const Eigen::Matrix3d& m) {
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          const int r = 3 * c + row, k = 3 * d + column;
          if (m(row, column) != 0 && (whole || r >= k)) result.push_back({r, k, -weight * m(row, column)});
        }
      }
    };
    const auto add_pairs = [&](std::span<const int32_t> clusters, double weight, const Eigen::Matrix3d& m) {
      for (const int32_t c : clusters) {
        for (const int32_t d : clusters) {
          if (whole || c >= d) add(c, d, weight, m);
        }
      }
    };
    for (std::size_t c = 0; c < system.mass.size(); ++c) {
      add(static_cast<int32_t>(c), static_cast<int32_t>(c), -system.mass[c], Eigen::Matrix3d::Identity());
    }
    for (const auto& [clusters, weight] : system.shared) add_pairs(clusters, weight, Eigen::Matrix3d::Identity());
    for (int32_t i = 0; i < problem_.body.particle_count(); ++i) {
      const auto clusters = problem_.memberships.of(i);
      if (apart[at(i)] == 0 || clusters.empty() || !problem_.is_free(i)) continue;
      add_pairs(clusters, problem_.s * problem_.rest.weight[at(i)] / static_cast<double>(clusters.size()),
                slope[at(i)]);
    }
    return result;
  }

  bool factorise_cholesky(const std::vector<Eigen::Matrix3d>& slope, const std::vector<uint8_t>& apart) {
    cholesky_.reset();
    const Sparse matrix = sparse_of(3 * at(problem_.clusters.count()), entries(slope, apart, false), cholmod_);
    cholesky_.emplace(cholmod_analyze(matrix.get(), cholmod_.get()), cholmod_);
    cholmod_factorize(matrix.get(), cholesky_->get(), cholmod_.get());
    if (cholmod_.get()->status == CHOLMOD_NOT_POSDEF) {
      cholesky_.reset();
      return false;
    }
    cholmod_.check();
    return true;
  }

  bool factorise_lu(const std::vector<Eigen::Matrix3d>& slope, const std::vector<uint8_t>& apart) {
    const auto size = static_cast<Eigen::Index>(3 * problem_.clusters.count());
    const std::vector<Entry> filled = entries(slope, apart, true);
    Eigen::SparseMatrix<double> matrix(size, size);
    matrix.setFromTriplets(filled.begin(), filled.end());
    lu_.compute(matrix);
    return lu_.info() == Eigen::Success;
  }

  const SubstepProblem& problem_;
  Cholmod cholmod_;  // before the factor, which it outlives
  std::optional<Factor> cholesky_;
  Eigen::SparseLU<Eigen::SparseMatrix<double>> lu_;
  bool is_exact_ = false;
};

ContactStage::ContactStage(const SubstepProblem& problem)
    : problem_(problem), mass_(at(problem.clusters.count()), 0.0) {
  double extent = 0;
  for (const Vec3& x : problem.predicted) extent = std::max(extent, norm(x));
  // Rounding of x is amplified in y by the ratio of both distances.
  at_rest_ = std::max(kAtRest * problem.body.grid.spacing, kRestRounds * kUnitRoundoff * extent) / problem.share;
  for (int32_t c = 0; c < problem.clusters.count(); ++c) {
    for (const int32_t i : problem.clusters.of(c)) mass_[at(c)] += problem.rest.weight[at(i)];
  }
}

ContactStage::~ContactStage() = default;

ContactStage::Places ContactStage::places(const std::vector<Vec3>& turned, const std::vector<Vec3>& center) const {
  Places result;
  result.free = result.x = problem_.predicted;
  for (int32_t i = 0; i < problem_.body.particle_count(); ++i) {
    if (!problem_.is_free(i)) continue;
    const auto clusters = problem_.memberships.of(i);
    Vec3 sum;
    for (const int32_t c : clusters) sum += center[at(c)];
    if (!clusters.empty()) {
      const Vec3 goal = sum / static_cast<double>(clusters.size()) + turned[at(i)];
      const Vec3 from = problem_.predicted_ahead[at(i)];
      result.free[at(i)] = problem_.back(i, from + problem_.s * (goal - from));
    }
    result.x[at(i)] = problem_.placed(i, result.free[at(i)]);
  }
  for (int32_t c = 0; c < problem_.clusters.count(); ++c) {
    Vec3 sum;
    for (const int32_t i : problem_.clusters.of(c)) {
      sum += problem_.rest.weight[at(i)] * (problem_.ahead(i, result.x[at(i)]) - center[at(c)]);
    }
    result.left.push_back(sum / mass_[at(c)]);
    result.most = std::max(result.most, norm(result.left.back()));
  }
  return result;
}

ContactStage::Rest ContactStage::rest(const Poses& poses, std::vector<Vec3>& center) {
  const std::vector<Vec3> turned = turned_offsets(problem_, poses);
  Rest rest;
  Places now = places(turned, center);
  for (int step = 0; step < kMostSteps && !rest.found; ++step) {
    const bool is_fresh = !linear_;
    if (is_fresh) linear_ = Linear::of(problem_, now.free, now.x);
    if (!linear_) break;
    const std::vector<Vec3> way = linear_->step(mass_, now.left);
    double longest = 0;
    for (const Vec3& v : way) longest = std::max(longest, norm(v));
    rest.found = longest <= at_rest_;
    if (rest.found) break;
    // With an old factor no other length helps.
    std::vector<Vec3> next_center;
    Places next;
    bool is_nearer = false;
    double share = 1;
    for (int trial = 0; trial <= (is_fresh ? kMostHalvings : 0) && !is_nearer; ++trial, share /= 2) {
      next_center = center;
      for (std::size_t c = 0; c < way.size(); ++c) next_center[c] += share * way[c];
      next = places(turned, next_center);
      is_nearer = next.most < now.most;
    }
    if (!is_nearer && is_fresh) {
      rest.found = now.most <= at_rest_;
      break;
    }
    if (!is_nearer || next.most > kGoodShare * now.most) linear_.reset();
    if (!is_nearer) continue;
    center = std::move(next_center);
    now = std::move(next);
  }
  rest.x = std::move(now.x);
  rest.free = std::move(now.free);
  return rest;
}

bool ContactStage::is_strict_minimum(const Rest& rest) {
  if (problem_.contacts.has_friction()) return false;
  for (int32_t i = 0; i < problem_.body.particle_count(); ++i) {
    if (problem_.is_free(i) && problem_.is_placed_in_turn(i, rest.free[at(i)])) return false;
  }
  linear_ = Linear::of(problem_, rest.free, rest.x);
  return linear_ && linear_->is_exact();
}

}  // namespace cutproof::oracles
