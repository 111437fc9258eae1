#include "oracles/best_rotation.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <limits>

#include "oracles/eigen.h"

namespace cutproof::oracles {

namespace {

using Real = long double;
using Matrix = Eigen::Matrix<Real, 3, 3>;
using Vector = Eigen::Matrix<Real, 3, 1>;

}  // namespace

BestRotation best_rotation(const Mat3& given) {
  Matrix a = as_eigen(given).cast<Real>();
  int exponent = 0;
  static_cast<void>(std::frexp(a.cwiseAbs().maxCoeff(), &exponent));
  a *= std::ldexp(Real(1), -exponent);
  const Eigen::JacobiSVD<Matrix> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Matrix &u = svd.matrixU(), &v = svd.matrixV();
  const Vector& sigma = svd.singularValues();
  const Real sign = u.determinant() * v.determinant() < 0 ? -1 : 1;

  BestRotation best;
  for (int k = 0; k < 9; ++k) best.a[static_cast<std::size_t>(k)] = a(k / 3, k % 3);
  best.sum = sigma.sum();
  best.value = sigma[0] + sigma[1] + sign * sigma[2];
  best.separation = static_cast<double>((sigma[1] + sign * sigma[2]) / sigma[0]);
  for (int k = 0; k < 3; ++k) {
    best.sigma[static_cast<std::size_t>(k)] = static_cast<double>(sigma[k]);
    best.u[static_cast<std::size_t>(k)] = static_cast<double>(u(k, 0));
    best.v[static_cast<std::size_t>(k)] = static_cast<double>(v(k, 0));
  }
  best.r = to_mat3((u * Vector(1, 1, sign).asDiagonal() * v.transpose()).cast<double>());
  // With U' and V' the orthogonal matrices nearest to U and V (at a distance of at most ‖UᵀU - I‖), A differs from U' Σ
  // V'ᵀ, whose value is the one above, by no more than the residual and the products of U - U' and V - V' with Σ. A
  // value changes by at most √3 times the Frobenius norm of a change of A. Each product of two 3 × 3 matrices here is
  // off by 6 units of its entries, which are below 3.
  const Real loss = (u.transpose() * u - Matrix::Identity()).norm() + (v.transpose() * v - Matrix::Identity()).norm();
  const Real residual = (a - u * sigma.asDiagonal() * v.transpose()).norm();
  const Real unit = std::numeric_limits<Real>::epsilon() / 2;
  best.error =
      static_cast<double>(std::sqrt(Real(3)) * (residual + loss * sigma[0] + 100 * unit * best.sum) / best.sum);
  return best;
}

double objective_gap(const BestRotation& best, const Mat3& r) {
  Real reached = 0;
  for (std::size_t k = 0; k < 9; ++k) reached += best.a[k] * r.m[k];
  return static_cast<double>((best.value - reached) / best.sum);
}

NearestRotation nearest_of_rank_one(const BestRotation& best, const Mat3& p) {
  const Matrix previous = as_eigen(p).cast<Real>();
  const Vector u = Vector(best.u[0], best.u[1], best.u[2]).normalized();
  const Vector from = (previous * Vector(best.v[0], best.v[1], best.v[2])).normalized();
  Matrix shortest;
  if (from.dot(u) > 0) {
    shortest = Eigen::Quaternion<Real>::FromTwoVectors(from, u).toRotationMatrix();
  } else {
    // Where the turn is nearly half a one its axis is all that is left of the cross product. Two reflections keep the
    // direction u however little that is: one takes `from` to u, the other is in the same plane and keeps u.
    Vector beside = from - from.dot(u) * u;
    if (!(beside.norm() > 0)) beside = u.unitOrthogonal();
    beside.normalize();
    beside = (beside - beside.dot(u) * u).normalized();
    const Vector across = (from - u).normalized();
    const Matrix one = Matrix::Identity();
    shortest = (one - 2 * beside * beside.transpose()) * (one - 2 * across * across.transpose());
  }
  return {to_mat3((shortest * previous).cast<double>()), static_cast<double>((from + u).squaredNorm() / 4)};
}

}  // namespace cutproof::oracles
