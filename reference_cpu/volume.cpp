// The second target of a cluster that keeps its volume (method.md §3, Volume).
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "reference_cpu/reference.h"

namespace cutproof::reference {
namespace {

using Matrix = Eigen::Matrix3d;
using Vector = Eigen::Vector3d;

Matrix as_matrix(const Mat3& given) {
  Matrix m;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) m(row, column) = given(row, column);
  }
  return m;
}

// G = U diag(σ) Zᵀ with rotations U and Z, σ1 >= σ2 >= |σ3|.
struct Decomposed {
  Matrix u, z;
  Vector sigma;
};
Decomposed decompose(const Matrix& g) {
  const Eigen::JacobiSVD<Matrix> svd(g, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Decomposed found = {svd.matrixU(), svd.matrixV(), svd.singularValues()};
  for (Matrix* const m : {&found.u, &found.z}) {
    if (m->determinant() > 0) continue;
    m->col(2) *= -1;
    found.sigma[2] *= -1;
  }
  return found;
}

// The positive p of least Σ (p - σ)² with p1 p2 p3 = D solve p_i (p_i - σ_i) = μ. p1 and p2 are the greater roots, so
// all follow from p3: one equation remains, log(p1 p2 p3 / D) = 0. Its greatest zero above σ3 / 2 continues the answer
// of small strains. Beyond a dilation of 1.9 the least zero below σ3 / 2 may be nearer: p3 collapses.
class NearestProduct {
 public:
  NearestProduct(const Vector& sigma, double product) : sigma_(sigma), product_(product) {}

  Vector values() const {
    const double middle = sigma_[2] / 2, least = product_ / (sigma_[0] * sigma_[1]);
    const bool has_regular = !(middle > 0) || excess(middle) <= 0;
    const double regular = has_regular ? zero(std::max(middle, 0.0), std::cbrt(product_)) : 0;
    // There are no zeros below `least`: p1 < σ1 and p2 < σ2 where p3 < σ3.
    if (!(least < middle)) return all(regular);
    const double collapsed = has_regular ? zero_from(least, middle) : zero(least, middle);
    if (!has_regular) return all(collapsed);
    return collapsed > 0 && distance(collapsed) < distance(regular) ? all(collapsed) : all(regular);
  }

 private:
  Vector all(double p3) const {
    const double mu = p3 * (p3 - sigma_[2]);
    const auto root = [&](double sigma) { return (sigma + std::sqrt(std::max(0.0, sigma * sigma + 4 * mu))) / 2; };
    return {root(sigma_[0]), root(sigma_[1]), p3};
  }
  double distance(double p3) const { return (all(p3) - sigma_).squaredNorm(); }
  double excess(double p3) const { return std::log(all(p3).prod() / product_); }
  // Of excess() by log p3.
  double slope(double p3) const {
    const Vector p = all(p3);
    return 1 + p3 * (2 * p3 - sigma_[2]) * (1 / (p[0] * (2 * p[0] - sigma_[0])) + 1 / (p[1] * (2 * p[1] - sigma_[1])));
  }
  static constexpr int kMostSteps = 200;
  static constexpr double kSmall = 1e-15;

  // The zero between `low`, where excess() is not above 0, and `high`: by Newton's method from `low`, else by halves.
  double zero(double low, double high) const {
    double p = low > 0 ? low : high;
    for (int step = 0; step < kMostSteps; ++step) {
      const double here = excess(p);
      if (std::abs(here) <= kSmall) break;
      (here > 0 ? high : low) = p;
      const double next = p * std::exp(-here / slope(p));
      p = low < next && next < high ? next : (low + high) / 2;
    }
    return p;
  }
  // The first zero above `low` if Newton's method finds one below `high`, else 0.
  double zero_from(double low, double high) const {
    double p = low;
    for (int step = 0; step < kMostSteps && p < high; ++step) {
      const double here = excess(p), rise = slope(p);
      if (!(rise > 0)) return 0;
      if (std::abs(here) <= kSmall) return p;
      p *= std::exp(-here / rise);
    }
    return 0;
  }

  const Vector sigma_;
  const double product_;
};

// V, and its distance from F.
struct Kept {
  Matrix v, from_f;
};
Kept keep_volume(const Mat3& a, const Mat3& rest_moment, const Mat3& rotation) {
  const Eigen::SelfAdjointEigenSolver<Matrix> rest(as_matrix(rest_moment));
  const Vector& extent = rest.eigenvalues();  // ascending
  const Matrix axes = rest.eigenvectors(), moved = as_matrix(a), r = as_matrix(rotation);
  Kept kept = {r, Matrix::Zero()};
  if (!moved.allFinite()) return kept;
  if (extent.prod() > kFlatVolume * std::pow(extent.sum(), 3)) {
    const Matrix root = axes * extent.cwiseSqrt().asDiagonal() * axes.transpose();
    const Matrix inverse = axes * extent.cwiseSqrt().cwiseInverse().asDiagonal() * axes.transpose();
    const Matrix g = moved * inverse;
    const double product = std::sqrt(extent.prod());
    Decomposed d = decompose(g);
    const Vector p = NearestProduct(d.sigma, product).values();
    // Equal singular values with different p, or opposite ones: a circle of answers is as near. A pull towards R too
    // small to matter otherwise finds the one nearest to R.
    constexpr double kSame = 1e-12, kPull = 1e-9;
    const double same = kSame * d.sigma[0];
    const bool is_collapsed = p[2] < d.sigma[2] / 2;
    if (d.sigma[1] + d.sigma[2] <= same || (is_collapsed && d.sigma[1] - d.sigma[2] <= same)) {
      d = decompose(g + kPull * std::max(d.sigma[0] / root.norm(), kSame) * r * root);
    }
    kept.v = d.u * p.asDiagonal() * d.z.transpose() * inverse;
    kept.from_f = kept.v - g * inverse;
  } else {
    Vector inverse = Vector::Zero();
    for (int k = 0; k < 3; ++k) {
      if (extent[k] > kFlatExtent * extent[2]) inverse[k] = 1 / extent[k];
    }
    const Matrix along = axes * inverse.cwiseSign().asDiagonal() * axes.transpose();
    kept.v = moved * (axes * inverse.asDiagonal() * axes.transpose()) + r * (Matrix::Identity() - along);
  }
  return kept;
}

Mat3 from_matrix(const Matrix& m) {
  Mat3 result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) result(row, column) = m(row, column);
  }
  return result;
}

}  // namespace

ClusterMaps cluster_maps(double volume_share, const Mat3& a, const Mat3& rest_moment, const Mat3& rotation) {
  if (volume_share == 0) return {rotation, rotation};
  const Kept kept = keep_volume(a, rest_moment, rotation);
  const Matrix turned = (1 - volume_share) * as_matrix(rotation);
  return {from_matrix(turned + volume_share * kept.from_f), from_matrix(turned + volume_share * kept.v)};
}

}  // namespace cutproof::reference
