// The rotation of one cluster, on the hard cases of method.md, Hard cases, judged by a singular value decomposition,
// which the reference does not use.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "reference_cpu/reference.h"

namespace cutproof::reference::rotation_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Mat3 from(const Matrix3d& m) {
  Mat3 result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) result(row, column) = m(row, column);
  }
  return result;
}

Matrix3d to(const Mat3& m) {
  Matrix3d result;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) result(row, column) = m(row, column);
  }
  return result;
}

Matrix3d turn(double angle, const Vector3d& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

// (best - reached) / Σ|σ|, with the best value σ1 + σ2 + sign(det A) σ3 from the decomposition of A / max|a_ij|.
double objective_gap(const Matrix3d& a, const Matrix3d& r) {
  const Matrix3d scaled = a / a.cwiseAbs().maxCoeff();
  const Eigen::JacobiSVD<Matrix3d> svd(scaled, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vector3d sigma = svd.singularValues();
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return (sigma[0] + sigma[1] + sign * sigma[2] - (r.transpose() * scaled).trace()) / sigma.sum();
}

// Horn's eigenvalue is exact to a few units in the last place of the norm: 4 eigenvector entries enter squared, each
// off by at most 16 u in a backward stable 4 × 4 solve; 64 × 2^-53 covers objective and orthogonality.
constexpr double kBound = 64 * 0x1p-53;

void expect_best(const Matrix3d& a, const Matrix3d& previous = Matrix3d::Identity()) {
  const Rotation rotation = closest_rotation(from(a), from(previous));
  const Matrix3d r = to(rotation.r);
  EXPECT_LE((r.transpose() * r - Matrix3d::Identity()).norm(), kBound) << a;
  EXPECT_GT(r.determinant(), 0) << a;
  EXPECT_LE(objective_gap(a, r), kBound) << a;
}

TEST(ClosestRotation, ReturnsAPureRotationItself) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 1000; ++trial) {
    const Matrix3d q = turn(normal(random) * 3, Vector3d(normal(random), normal(random), normal(random)));
    for (const double scale : {1.0, 1 - 1e-6, 1 + 1e-6}) {
      EXPECT_LE((to(closest_rotation(from(scale * q), {}).r) - q).norm(), 1e-14);
    }
  }
}

TEST(ClosestRotation, FindsHalfTurnsFromAColdStart) {
  const double pi = std::numbers::pi;
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1), Vector3d(1, 2, -3)}) {
    for (const double angle : {pi, pi - 1e-9, 2 * pi / 3}) {
      const Matrix3d q = turn(angle, axis);
      EXPECT_LE((to(closest_rotation(from(q), {}).r) - q).norm(), 1e-14) << axis.transpose() << ", " << angle;
    }
  }
}

TEST(ClosestRotation, ReachesTheBestObjectiveOnRandomMatricesOfEverySign) {
  std::mt19937_64 random(12);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 5000; ++trial) {
    Matrix3d a;
    for (int k = 0; k < 9; ++k) a(k / 3, k % 3) = normal(random);
    expect_best(a);
    expect_best(-a);
  }
}

TEST(ClosestRotation, ReachesTheBestObjectiveOnReflectionsAndDegenerateSpectra) {
  std::mt19937_64 random(13);
  std::normal_distribution<double> normal;
  for (const Vector3d& sigma :
       {Vector3d(1, 1, -1), Vector3d(-1, -1, -1), Vector3d(1, 0.5, -0.5), Vector3d(1, 0.5, -0.5 + 1e-9),
        Vector3d(1, 0.3, 0), Vector3d(1, 0, 0), Vector3d(1, 1e-3, 1e-6), Vector3d(1, 1e-12, -1e-12),
        Vector3d(1, 1e-8, 1e-9), Vector3d(1, 1, 1)}) {
    for (int trial = 0; trial < 200; ++trial) {
      const Matrix3d u = turn(normal(random) * 3, Vector3d(normal(random), normal(random), normal(random)));
      const Matrix3d v = turn(normal(random) * 3, Vector3d(normal(random), normal(random), normal(random)));
      expect_best(u * sigma.asDiagonal() * v.transpose(), u);
    }
  }
}

TEST(ClosestRotation, IsUniqueForAPlanarCluster) {
  const Matrix3d q = turn(0.7, Vector3d(1, -2, 0.5));
  const Rotation rotation = closest_rotation(from(q * Vector3d(2, 1, 0).asDiagonal()), {});
  EXPECT_FALSE(rotation.degenerate);
  EXPECT_LE((to(rotation.r) - q).norm(), 1e-14);
}

TEST(ClosestRotation, TakesTheNearestToThePreviousOneForACollinearCluster) {
  // A = u vᵀ fixes R v = u only; of those rotations the one nearest to P is the shortest turn from P v to u, after P.
  const Matrix3d previous = turn(1.1, Vector3d(0.2, 1, -0.4));
  const Vector3d v = Vector3d(1, 2, 2) / 3, u = turn(0.4, Vector3d(3, -1, 2)) * (previous * v);
  const Matrix3d nearest = Eigen::Quaterniond::FromTwoVectors(previous * v, u).toRotationMatrix() * previous;
  const Rotation rotation = closest_rotation(from(u * v.transpose()), from(previous));
  EXPECT_TRUE(rotation.degenerate);
  EXPECT_LE((to(rotation.r) - nearest).norm(), 1e-13);
}

TEST(ClosestRotation, KeepsThePreviousOneAndFlagsItWhereNothingIsKnown) {
  const Mat3 previous = from(turn(2.0, Vector3d(1, 1, 0)));
  Mat3 zero, nan, infinite;
  zero.m.fill(0);
  nan.m[4] = std::numeric_limits<double>::quiet_NaN();
  infinite.m[2] = std::numeric_limits<double>::infinity();
  for (const Mat3& a : {zero, nan, infinite}) {
    const Rotation rotation = closest_rotation(a, previous);
    EXPECT_TRUE(rotation.degenerate);
    EXPECT_EQ(rotation.r, previous);
  }
}

TEST(ClosestRotation, DoesNotDependOnScale) {
  Matrix3d a;
  a << 0.3, -1.2, 0.5, 2.0, 0.1, -0.7, 0.4, 0.9, 1.5;
  const Mat3 expected = closest_rotation(from(a), {}).r;
  for (const int exponent : {-1000, -100, 100, 1000}) {
    EXPECT_EQ(closest_rotation(from(std::ldexp(1.0, exponent) * a), {}).r, expected) << exponent;
  }
  for (const double scale : {1e-30, 1e30, 1e-300, 1e300}) {
    EXPECT_LE((to(closest_rotation(from(scale * a), {}).r) - to(expected)).norm(), 1e-14) << scale;
  }
  // Denormals: few digits are left in A itself, the answer is the best one for what is left.
  expect_best(4e-323 * a);
}

TEST(ClosestRotation, CarriesRotationsAndTransposition) {
  std::mt19937_64 random(14);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 500; ++trial) {
    Matrix3d a;
    for (int k = 0; k < 9; ++k) a(k / 3, k % 3) = normal(random);
    const Eigen::JacobiSVD<Matrix3d> svd(a);
    const double sign = a.determinant() < 0 ? -1 : 1;
    const double gap = (svd.singularValues()[1] + sign * svd.singularValues()[2]) / svd.singularValues()[0];
    if (gap < 1e-3) continue;  // the angle is not well determined there
    const Matrix3d q = turn(normal(random), Vector3d(1, normal(random), normal(random)));
    const Matrix3d r = to(closest_rotation(from(a), {}).r);
    EXPECT_LE((to(closest_rotation(from(q * a), {}).r) - q * r).norm(), 1e-14 / gap);
    EXPECT_LE((to(closest_rotation(from(a.transpose()), {}).r) - r.transpose()).norm(), 1e-14 / gap);
  }
}

}  // namespace
}  // namespace cutproof::reference::rotation_test
