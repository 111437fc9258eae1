#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "reference_cpu/reference.h"

namespace cutproof::reference {

// Horn's method (Horn 1987, "Closed-form solution of absolute orientation using unit quaternions"). With q the unit
// quaternion of R, tr(Rᵀ A) = qᵀ N q for the symmetric 4 × 4 matrix N below. So the best rotations are the unit vectors
// in the eigenspace of N's largest eigenvalue. Let σ1 >= σ2 >= |σ3| be the singular values of A (σ3 < 0 if det A < 0).
// The two largest eigenvalues differ by 2 (σ2 + σ3). This vanishes for rank one, for a reflection with two equal
// singular values, and without any extent. The eigenspace then has several dimensions, and the previous quaternion
// projected onto it gives the nearest answer.
Rotation closest_rotation(const Mat3& a, const Mat3& previous) {
  double scale = 0;
  for (const double entry : a.m) {
    if (!std::isfinite(entry)) return {previous, true};
    scale = std::max(scale, std::abs(entry));
  }
  if (scale == 0) return {previous, true};

  // Scaled to 1, so that neither tiny nor huge clusters underflow or overflow. The reciprocal of a denormal scale is
  // infinite, so this divides.
  Eigen::Matrix3d s;  // s(i, j) = Σ w X_i x_j, that is Aᵀ
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) s(column, row) = a(row, column) / scale;
  }
  Eigen::Matrix4d n;
  n << s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0),  //
      s(1, 2) - s(2, 1), s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2),   //
      s(2, 0) - s(0, 2), s(0, 1) + s(1, 0), -s(0, 0) + s(1, 1) - s(2, 2), s(1, 2) + s(2, 1),  //
      s(0, 1) - s(1, 0), s(2, 0) + s(0, 2), s(1, 2) + s(2, 1), -s(0, 0) - s(1, 1) + s(2, 2);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(n);
  const Eigen::Vector4d& values = eigen.eigenvalues();  // ascending

  // Rounding moves eigenvalues by a few 2^-53 of the norm (at most 6 here). 1e-12 is far above that, and far below any
  // difference that a rotation could depend on.
  constexpr double kSameEigenvalue = 1e-12;
  const double top = values[3];
  int dimension = 1;
  while (dimension < 4 && top - values[3 - dimension] <= kSameEigenvalue * std::max(std::abs(top), 1.0)) ++dimension;

  Eigen::Vector4d q = eigen.eigenvectors().col(3);
  if (dimension > 1) {
    Eigen::Matrix3d r;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) r(row, column) = previous(row, column);
    }
    const Eigen::Quaterniond before(r);
    const Eigen::Vector4d p(before.w(), before.x(), before.y(), before.z());
    const auto space = eigen.eigenvectors().rightCols(dimension);
    const Eigen::Vector4d projected = space * (space.transpose() * p);
    // A previous rotation orthogonal to all answers is equally far from each.
    if (projected.norm() > 1e-9) q = projected;
  }
  const Eigen::Matrix3d best = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  Rotation result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) result.r(row, column) = best(row, column);
  }
  result.degenerate = dimension > 1;
  return result;
}

}  // namespace cutproof::reference
