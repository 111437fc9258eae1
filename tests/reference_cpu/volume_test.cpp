// The nearest matrix of determinant 1 (method.md §3, Volume), held against its definition.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <cmath>

#include "reference_cpu/reference.h"
#include "tests/random_matrices.h"

namespace cutproof::volume_test {
namespace {

using Matrix = Eigen::Matrix3d;
using reference::cluster_maps;

Mat3 to_mat3(const Matrix& m) {
  Mat3 result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) result(row, column) = m(row, column);
  }
  return result;
}
Matrix to_eigen(const Mat3& m) {
  Matrix result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) result(row, column) = m(row, column);
  }
  return result;
}

Matrix nearest(const Matrix& f, const Matrix& a0, const Matrix& r = Matrix::Identity()) {
  return to_eigen(cluster_maps(1, to_mat3(f * a0), to_mat3(a0), to_mat3(r)).carry);
}

double distance(const Matrix& v, const Matrix& f, const Matrix& a0) {
  return ((v - f) * a0 * (v - f).transpose()).trace();
}

// How far V is from det V = 1 and from (V A0 - A) Vᵀ = μ I, in units of the terms.
double off_conditions(const Matrix& v, const Matrix& f, const Matrix& a0) {
  const Matrix m = (v - f) * a0 * v.transpose();
  const double size = (v * a0 * v.transpose()).norm() + (f * a0 * v.transpose()).norm();
  return std::max(std::abs(v.determinant() - 1) / std::max(1.0, std::pow(v.norm(), 3)),
                  (m - m.trace() / 3 * Matrix::Identity()).norm() / size);
}

TEST(ClosestVolume, HasDeterminantOneAndMeetsTheLagrangeCondition) {
  MatrixDraw draw(1);
  for (int k = 0; k < 4000; ++k) {
    const Matrix a0 = draw.rest_moment(), f = std::exp(draw.normal()) * draw.matrix();  // half are inverted
    EXPECT_LT(off_conditions(nearest(f, a0), f, a0), 1e-12) << f;
  }
}

// The smallest distance to U diag(p) Zᵀ A0^(-1/2), G = U diag(σ) Zᵀ, that a search by log p finds from here.
double found_from(Eigen::Vector2d at, const Eigen::Vector3d& sigma, double side) {
  const auto distance_at = [&](const Eigen::Vector2d& p) {
    return (side * Eigen::Vector3d(p[0], p[1], -p[0] - p[1]).array().exp() - sigma.array()).square().sum();
  };
  double here = distance_at(at);
  for (double step = 0.2; step > 1e-7;) {
    const double before = here;
    for (const Eigen::Vector2d& way : {Eigen::Vector2d(1, 0), {-1, 0}, {0, 1}, {0, -1}, {1, -1}, {-1, 1}}) {
      const Eigen::Vector2d next = at + step * way;
      if (const double there = distance_at(next); there < here) {
        at = next;
        here = there;
      }
    }
    if (here == before) step /= 2;
  }
  return here;
}

TEST(ClosestVolume, IsNotFartherThanAnyOtherOfDeterminantOne) {
  MatrixDraw draw(2);
  for (int k = 0; k < 90; ++k) {
    const Matrix a0 = draw.rest_moment();
    const Eigen::SelfAdjointEigenSolver<Matrix> extents(a0);
    const Matrix inverse = extents.operatorInverseSqrt();
    const double side = std::pow(a0.determinant(), 1.0 / 6);
    // Around the dilation of the norm of A0 where the answer jumps, of the body, and anywhere.
    const Matrix near = draw.turn() * (Matrix::Identity() + (k % 3 == 0 ? 1e-4 : 0.05) * draw.matrix());
    const Matrix f = k % 3 == 0   ? Matrix((1.85 + 0.0015 * k) * side * near * inverse)
                     : k % 3 == 1 ? Matrix((1.6 + 0.01 * k) * near)
                                  : Matrix(2 * draw.matrix());
    const double best = distance(nearest(f, a0), f, a0);
    const Matrix g = f * a0 * inverse;
    Eigen::Vector3d sigma = g.jacobiSvd().singularValues();
    if (g.determinant() < 0) sigma[2] *= -1;
    for (const Eigen::Vector2d& start : {Eigen::Vector2d(0, 0), {0.5, 0.5}, {0.5, -1}, {-1, 0.5}}) {
      EXPECT_GE(found_from(start, sigma, side), best * (1 - 1e-12)) << f;
    }
    for (int other = 0; other < 8; ++other) {
      Matrix v = draw.turn() * Eigen::Vector3d(std::exp(draw.normal()), std::exp(draw.normal()), 1).asDiagonal();
      v.col(2) /= v.determinant();
      v = v * draw.turn();
      // Down along the surface, as far as 100 steps lead.
      double here = distance(v, f, a0), step = 0.5;
      for (int down = 0; down < 100; ++down) {
        Matrix next = v + step * (f - v) * a0 / a0.trace();
        if (const double volume = next.determinant(); volume > 0) next /= std::cbrt(volume);
        const double there = distance(next, f, a0);
        if (next.determinant() > 0 && there < here) {
          v = next;
          here = there;
        } else {
          step /= 2;
        }
      }
      EXPECT_GE(here, best * (1 - 1e-12)) << f;
    }
  }
}

TEST(ClosestVolume, IsTheRotationOfARigidMotionAndTurnsWithTheBody) {
  MatrixDraw draw(3);
  for (int k = 0; k < 300; ++k) {
    const Matrix a0 = draw.rest_moment(), q = draw.turn(), f = draw.matrix();
    EXPECT_LT((nearest(q, a0) - q).norm(), 1e-13);
    EXPECT_LT((nearest(q * f, a0) - q * nearest(f, a0)).norm(), 1e-9 * nearest(f, a0).norm());
  }
}

TEST(ClosestVolume, CollapsesBeyondADilationOf1Point9) {
  const Matrix a0 = Matrix::Identity();
  for (const double dilation : {0.1, 0.5, 1.5, 1.9}) {
    EXPECT_LT((nearest(dilation * Matrix::Identity(), a0) - Matrix::Identity()).norm(), 1e-7) << dilation;
  }
  for (const double dilation : {1.95, 2.1, 5.0}) {
    const Matrix v = nearest(dilation * Matrix::Identity(), a0);
    const Eigen::Vector3d p = v.jacobiSvd().singularValues();
    EXPECT_LT(p[2], dilation / 2) << dilation;
    EXPECT_NEAR(p[0], p[1], 1e-6) << dilation;
  }
}

// Of several nearest ones the one nearest to R, in the norm of A0.
TEST(ClosestVolume, IsTheOneNearestToTheRotationInATie) {
  MatrixDraw draw(4);
  for (int k = 0; k < 40; ++k) {
    const Matrix a0 = draw.rest_moment(), q = draw.turn(), r = draw.turn();
    const Eigen::SelfAdjointEigenSolver<Matrix> extents(a0);
    const Matrix half = extents.operatorSqrt(), inverse = extents.operatorInverseSqrt();
    // G = A A0^(-1/2): dilated evenly; one singular value is zero twice; inverted with two that are opposite.
    const double size = std::cbrt(half.determinant());
    for (const Eigen::Vector3d& sigma : {Eigen::Vector3d(3, 3, 3), Eigen::Vector3d(4, 2, 2), Eigen::Vector3d(1, 0, 0),
                                         Eigen::Vector3d(1, 0.5, -0.5)}) {
      const Matrix z = draw.turn(), f = size * q * z * sigma.asDiagonal() * z.transpose() * inverse;
      const Matrix v = nearest(f, a0, r);
      const double away = distance(v, r, a0), best = distance(v, f, a0);
      // A little off the tie any of them may be the nearest.
      for (int other = 0; other < 200; ++other) {
        const Matrix w = nearest(f + 1e-7 * draw.matrix(), a0, r);
        EXPECT_NEAR(distance(w, f, a0), best, 1e-5 * (1 + best));
        EXPECT_GE(distance(w, r, a0), away - 1e-5 * (1 + away)) << sigma.transpose();
      }
    }
  }
}

// F along the extent, R across it: a flat cluster at rest stays there, also one that is flat but for rounding.
TEST(ClosestVolume, OfAFlatClusterFollowsItsExtent) {
  MatrixDraw draw(5);
  for (const Eigen::Vector3d& extent :
       {Eigen::Vector3d(1, 2, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 2, 1e-9)}) {
    for (int k = 0; k < 50; ++k) {
      const Matrix axes = draw.turn(), a0 = axes * extent.asDiagonal() * axes.transpose(), r = draw.turn();
      EXPECT_LT((nearest(r, a0, r) - r).norm(), 1e-12);
      const Matrix f = draw.matrix(), v = nearest(f, a0, r);
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d arm = axes.col(axis);
        const Eigen::Vector3d expected = extent[axis] > 1e-3 * extent.maxCoeff() ? f * arm : r * arm;
        EXPECT_LT((v * arm - expected).norm(), 1e-9) << extent.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace cutproof::volume_test
