#include "oracles/volume_target.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "model/setup.h"
#include "oracles/eigen.h"
#include "oracles/rounding.h"

namespace cutproof::oracles {
namespace {

using Real = long double;
using Matrix = Eigen::Matrix<Real, 3, 3>;
using Vector = Eigen::Matrix<Real, 3, 1>;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
// A decomposition and its products, in units of u times their size (tolerances.md, Volume).
constexpr double kRounds = 32;
// Within this part of a threshold a backend may be on either side of it.
constexpr Real kNear = 0.01L;
// Conditions of the answer itself; extended precision leaves far less.
constexpr Real kMeets = 1e-13L;
// Of several answers the one nearest to another matrix is that of a problem that is pulled there by so much.
constexpr Real kPull = 1e-9L;
constexpr int kSamples = 400, kHalvings = 110;

// p1 and p2 for a given p3: all p (p - σ) are equal, and p1 and p2 are the greater roots.
Vector values_at(const Vector& sigma, Real p3) {
  const Real mu = p3 * (p3 - sigma[2]);
  Vector p(0, 0, p3);
  for (int k = 0; k < 2; ++k) p[k] = sigma[k] / 2 + std::sqrt(std::max(Real(0), sigma[k] * sigma[k] / 4 + mu));
  return p;
}

// All p3 in (low, high) where the product passes `product`, found by sampling and halving.
std::vector<Real> passes(const Vector& sigma, Real product, Real low, Real high, int samples) {
  const auto is_below = [&](Real p3) { return values_at(sigma, p3).prod() < product; };
  std::vector<Real> found;
  Real left = low;
  for (int k = 1; k <= samples; ++k) {
    const Real right = k == samples ? high : low + (high - low) * k / samples;
    if (is_below(left) != is_below(right)) {
      Real a = left, b = right;
      for (int halving = 0; halving < kHalvings; ++halving) {
        const Real middle = (a + b) / 2;
        (is_below(middle) == is_below(left) ? a : b) = middle;
      }
      found.push_back((a + b) / 2);
    }
    left = right;
  }
  return found;
}

// Growth of errors at a nearest point: of turns, of shears, and of p along the surface of equal products.
double growth_at(const Vector& sigma, const Vector& p) {
  Real greatest = 1;
  for (const auto& [i, j] : {std::array{0, 1}, {0, 2}, {1, 2}}) {
    const Real sum = sigma[i] + sigma[j], difference = sigma[i] - sigma[j];
    greatest = std::max(greatest, (p[i] + p[j]) / sum);
    // Equal σ on one branch: the limit of the quotient.
    greatest = std::max(greatest, difference > 1e-6L * p[i]              ? std::abs(p[i] - p[j]) / difference
                                  : std::abs(p[i] - p[j]) > 1e-3L * p[i] ? Real(kInfinite)
                                                                         : p[i] / std::abs(2 * p[i] - sigma[i]));
    if (!(sum > 0)) return kInfinite;
  }
  const Vector normal = p.cwiseInverse().normalized();
  const Matrix along = Matrix::Identity() - normal * normal.transpose();
  const Vector curvature = (2 * p - sigma).cwiseQuotient(p);
  // On the surface, and far above on its normal.
  const Matrix form = along * curvature.asDiagonal() * along + 1e6L * normal * normal.transpose();
  const Real least = Eigen::SelfAdjointEigenSolver<Matrix>(form, Eigen::EigenvaluesOnly).eigenvalues()[0];
  return least > 0 ? static_cast<double>(std::max(greatest, 1 / least)) : kInfinite;
}

// G = U diag(σ) Zᵀ, U and Z rotations.
struct Decomposition {
  explicit Decomposition(const Matrix& g) {
    const Eigen::JacobiSVD<Matrix> svd(g, Eigen::ComputeFullU | Eigen::ComputeFullV);
    u = svd.matrixU();
    z = svd.matrixV();
    sigma = svd.singularValues();
    if (u.determinant() * z.determinant() < 0) sigma[2] = -sigma[2];
    if (u.determinant() < 0) u.col(2) *= -1;
    if (z.determinant() < 0) z.col(2) *= -1;
  }
  Matrix u, z;
  Vector sigma;
};

// W = U diag(p) Zᵀ nearest to G among matrices of this determinant. `towards`: towards this one of several.
Matrix nearest_product(const Matrix& g, Real product, const Matrix& towards, double tie, VolumeTarget& target) {
  const Decomposition of(g);
  const Vector& sigma = of.sigma;
  const Real middle = std::max(sigma[2] / 2, Real(0)), greatest = std::max(std::cbrt(product), middle) * (1 + kMeets);
  std::vector<Real> candidates = passes(sigma, product, middle, greatest, 1);
  // p1 < σ1 and p2 < σ2 below σ3 / 2, so that no product is great enough below this.
  const Real least = product / (sigma[0] * sigma[1]);
  if (least < middle) {
    for (const Real p3 : passes(sigma, product, least * (1 - kMeets), middle, kSamples)) candidates.push_back(p3);
  }
  const auto distance = [&](Real p3) { return (values_at(sigma, p3) - sigma).norm(); };
  std::sort(candidates.begin(), candidates.end(), [&](Real a, Real b) { return distance(a) < distance(b); });
  if (candidates.empty()) {
    target.growth = kInfinite;
    return g;
  }
  const Vector p = values_at(sigma, candidates.front());
  target.growth = growth_at(sigma, p);
  target.gap = sigma[0] > 0 ? static_cast<double>((sigma[1] + sigma[2]) / sigma[0]) : 0;
  if (p[2] < sigma[2] / 2) target.gap = std::min(target.gap, static_cast<double>((sigma[1] - sigma[2]) / sigma[0]));
  target.lead = kInfinite;
  if (candidates.size() > 1) target.lead = static_cast<double>(distance(candidates[1]) - distance(candidates[0]));
  if (target.gap <= tie) {
    const Decomposition pulled(g + kPull * std::max(sigma[0] / towards.norm(), kMeets) * towards);
    return pulled.u * p.asDiagonal() * pulled.z.transpose();
  }
  return of.u * p.asDiagonal() * of.z.transpose();
}

}  // namespace

VolumeTarget volume_target(const Mat3& a, const Mat3& rest_moment, const Mat3& rotation, double tie,
                           const Mat3* towards) {
  VolumeTarget target;
  target.v = rotation;
  target.from_f.m.fill(0);
  target.inverse_root.m.fill(0);
  const Matrix moved = as_eigen(a).cast<Real>(), r = as_eigen(rotation).cast<Real>();
  const Eigen::SelfAdjointEigenSolver<Matrix> rest(as_eigen(rest_moment).cast<Real>());
  const Vector extent = rest.eigenvalues().cwiseMax(Real(0));  // ascending
  const Matrix axes = rest.eigenvectors();
  if (!moved.allFinite() || !(extent[2] > 0)) return target;
  const Real volume = extent.prod() / (kFlatVolume * std::pow(extent.sum(), Real(3)));
  const auto along = [&](int k) { return extent[k] / (kFlatExtent * extent[2]); };
  target.is_flat = volume <= 1;
  Vector inverse = Vector::Zero();  // of roots of extents
  for (int k = 0; k < 3; ++k) {
    if (!target.is_flat || along(k) > 1) inverse[k] = 1 / std::sqrt(extent[k]);
    if (target.is_flat && along(k) <= 1 && extent[k] > 1e-12L * extent[2]) target.is_nearly_flat = true;
  }
  const Matrix inverse_root = axes * inverse.asDiagonal() * axes.transpose();
  const Matrix g = moved * inverse_root;
  Matrix v, w;
  if (target.is_flat) {
    w = g;
    v = g * inverse_root + r * (Matrix::Identity() - axes * inverse.cwiseSign().asDiagonal() * axes.transpose());
  } else {
    const Matrix root = axes * extent.cwiseSqrt().asDiagonal() * axes.transpose();
    w = nearest_product(g, std::sqrt(extent.prod()),
                        as_eigen(towards != nullptr ? *towards : rotation).cast<Real>() * root, tie, target);
    v = w * inverse_root;
    target.from_f = to_mat3(((w - g) * inverse_root).cast<double>());
    // The conditions of the answer: its determinant, and (V A0 - A) Vᵀ = μ I.
    const Matrix condition = (w - g) * w.transpose();
    const Real size = w.norm() + g.norm();
    const bool meets = std::abs(v.determinant() - 1) <= kMeets * (1 + std::pow(v.norm(), Real(3))) &&
                       (condition - condition.trace() / 3 * Matrix::Identity()).norm() <= kMeets * size * size;
    if (!meets && target.gap > tie) target.growth = kInfinite;
  }
  if (std::abs(volume - 1) < kNear) target.growth = kInfinite;
  for (int k = 0; target.is_flat && k < 3; ++k) {
    if (std::abs(along(k) - 1) < kNear) target.growth = kInfinite;
  }
  target.size = static_cast<double>(w.norm() + g.norm());
  target.stretch = static_cast<double>((g * inverse_root).norm() * extent.sum());
  target.v = to_mat3(v.cast<double>());
  target.thinness = static_cast<double>(inverse.maxCoeff());
  target.inverse_root = to_mat3(inverse_root.cast<double>());
  if (!v.allFinite()) target.growth = kInfinite;
  return target;
}

double VolumeTarget::rounding(double off, double sums, double u) const {
  const double of_moments = (off + sums * stretch) * thinness;
  // V - F errs by the error of V, and by that of F itself.
  const double found = (growth + 1) * (of_moments + kRounds * u * size);
  // Nearer to a tie a backend chooses.
  const bool is_sure = is_flat || (gap > degenerate_rounds(u) * u && lead > 4 * (of_moments + kRounds * u * size));
  const bool is_decided = found < size / 8 && is_sure;
  return is_decided ? found : 2 * size;
}

namespace {
Mat3 mean_of(double share, const Mat3& r, const Mat3& towards) {
  Mat3 mean;
  for (std::size_t k = 0; k < 9; ++k) mean.m[k] = (1 - share) * r.m[k] + share * towards.m[k];
  return mean;
}
}  // namespace

Mat3 VolumeTarget::goal_map(double volume_share, const Mat3& r) const { return mean_of(volume_share, r, from_f); }
Mat3 VolumeTarget::carry_map(double volume_share, const Mat3& r) const { return mean_of(volume_share, r, v); }

}  // namespace cutproof::oracles
