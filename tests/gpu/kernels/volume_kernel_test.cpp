// The nearest matrix of determinant 1 in single precision (docs/design/method.md §3, Volume), held against its
// definition and against the reference.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <cmath>

#include "gpu/kernels/volume.cuh"
#include "reference_cpu/reference.h"
#include "tests/random_matrices.h"

namespace cutproof::volume_kernel_test {
namespace {

using Matrix = Eigen::Matrix3d;

struct Problem {
  float a0[3][3];
  gpu::Matrix3 change, r;
  Matrix rest, f, rotation;  // as rounded
};

Problem problem_of(const Matrix& f, const Eigen::Vector3d& extent, const Matrix& axes, const Matrix& r) {
  Problem problem;
  const Matrix rest = axes * extent.asDiagonal() * axes.transpose();
  const Matrix change = (f - Matrix::Identity()) * rest;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      problem.a0[row][column] = static_cast<float>(0.5 * (rest(row, column) + rest(column, row)));
      problem.change(row, column) = static_cast<float>(change(row, column));
      problem.r(row, column) = static_cast<float>(r(row, column));
      problem.rest(row, column) = problem.a0[row][column];
      problem.rotation(row, column) = problem.r(row, column);
    }
  }
  Matrix rounded;
  for (int k = 0; k < 9; ++k) rounded(k / 3, k % 3) = problem.change.m[k];
  problem.f = Matrix::Identity() + rounded * problem.rest.inverse();
  return problem;
}

Matrix answer(const Problem& problem) {
  const gpu::Matrix3 v = gpu::volume_maps(problem.a0, problem.change, problem.r).target;
  Matrix result;
  for (int k = 0; k < 9; ++k) result(k / 3, k % 3) = static_cast<double>(v.m[k]) + (k % 4 == 0 ? 1 : 0);
  return result;
}
// V - F
Matrix pull(const Problem& problem) {
  const gpu::VolumeMaps maps = gpu::volume_maps(problem.a0, problem.change, problem.r);
  Matrix result;
  for (int k = 0; k < 9; ++k) result(k / 3, k % 3) = static_cast<double>(maps.pull.m[k]);
  return result;
}

Matrix expected(const Problem& problem) {
  Mat3 a, a0, r;
  for (int k = 0; k < 9; ++k) {
    a.m[static_cast<std::size_t>(k)] = (problem.f * problem.rest)(k / 3, k % 3);
    a0.m[static_cast<std::size_t>(k)] = problem.rest(k / 3, k % 3);
    r.m[static_cast<std::size_t>(k)] = problem.rotation(k / 3, k % 3);
  }
  const Mat3 v = reference::cluster_maps(1, a, a0, r).carry;
  Matrix result;
  for (int k = 0; k < 9; ++k) result(k / 3, k % 3) = v.m[static_cast<std::size_t>(k)];
  return result;
}

double distance(const Matrix& v, const Problem& problem) {
  return std::sqrt(std::max(0.0, ((v - problem.f) * problem.rest * (v - problem.f).transpose()).trace()));
}
double size_of(const Matrix& v, const Problem& problem) {
  return std::sqrt((v * problem.rest * v.transpose()).trace()) + std::sqrt(problem.rest.trace());
}

// Rounding of a place, in units of the cluster's extent: V rounds along an axis by one part in 2²² of its own size.
constexpr double kRounding = 64 * 0x1p-24;

TEST(VolumeKernel, IsAsNearAsTheReferencesAndHasDeterminantOne) {
  MatrixDraw draw(1);
  for (int k = 0; k < 200'000; ++k) {
    const Eigen::Vector3d extent(1, std::exp(std::tanh(draw.normal())), std::exp(2 * std::tanh(draw.normal())));
    const double wide = std::exp(2 * draw.normal());  // small strains, dilated, inverted
    const Matrix f = k % 2 == 0 ? Matrix(draw.turn() * (Matrix::Identity() + 0.1 * wide * draw.matrix()))
                                : Matrix(wide * draw.turn() * (Matrix::Identity() + 0.02 * draw.matrix()));
    const Problem problem = problem_of(f, std::exp(draw.normal()) * extent, draw.turn(), draw.turn());
    const Matrix v = answer(problem), w = expected(problem);
    const double size = size_of(w, problem) + size_of(problem.f, problem);
    ASSERT_LT(distance(v, problem) - distance(w, problem), kRounding * size) << k << "\n" << problem.f;
    // The derivative of the determinant is the cofactor's.
    const double round = kRounding * size / std::sqrt(problem.rest.trace()) *
                         std::sqrt(problem.rest.trace() / extent.minCoeff()) * (1 + w.inverse().norm());
    ASSERT_NEAR(v.determinant(), 1, 4 * round) << k << "\n" << problem.f;
  }
}

TEST(VolumeKernel, FollowsTheReferenceWhereTheAnswerIsSure) {
  MatrixDraw draw(2);
  for (int k = 0; k < 100'000; ++k) {
    const Eigen::Vector3d extent(1, std::exp(std::tanh(draw.normal())), std::exp(2 * std::tanh(draw.normal())));
    const Matrix f = draw.turn() * (Matrix::Identity() + 0.1 * draw.matrix());
    const Problem problem = problem_of(f, extent, draw.turn(), draw.turn());
    for (const Matrix& off :
         {Matrix(answer(problem) - expected(problem)), Matrix(pull(problem) - (expected(problem) - problem.f))}) {
      ASSERT_LT(std::sqrt((off * problem.rest * off.transpose()).trace()), kRounding * size_of(f, problem)) << f;
    }
  }
}

// A body at rest, or moved as a whole, has no change of its moments: it stays to the last bit.
TEST(VolumeKernel, IsTheIdentityToTheBitAtRest) {
  MatrixDraw draw(3);
  for (int k = 0; k < 100; ++k) {
    const Problem problem = problem_of(Matrix::Identity(), {1, 2, 3}, draw.turn(), Matrix::Identity());
    const gpu::VolumeMaps maps = gpu::volume_maps(problem.a0, {{0, 0, 0, 0, 0, 0, 0, 0, 0}}, problem.r);
    for (const gpu::Matrix3& v : {maps.pull, maps.target}) {
      for (const float entry : gpu::map_towards(0.9f, v, problem.r).m) EXPECT_EQ(entry, 0.0f);
    }
  }
}

// Collapsed to a plane, a line, a point; inverted; and what a float can hardly hold.
TEST(VolumeKernel, IsFiniteAndNearestWhereverTheClusterIs) {
  MatrixDraw draw(4);
  for (int k = 0; k < 20'000; ++k) {
    Eigen::Vector3d sigma(1, 1, 1);
    const int kind = k % 7;
    if (kind == 0) sigma[2] = 0;
    if (kind == 1) sigma = {1, 0, 0};
    if (kind == 2) sigma = {0, 0, 0};
    if (kind == 3) sigma = {1, 0.5, -0.5};
    if (kind == 4) sigma = {-1, -1, -1};
    if (kind == 5) sigma *= 3;
    if (kind == 6) sigma *= 1.97;  // both roots exist, and the lesser is nearer
    const Matrix f = draw.turn() * sigma.asDiagonal() * draw.turn();
    const Eigen::Vector3d extent = kind == 6 ? Eigen::Vector3d(1, 1, 1) : Eigen::Vector3d(1, 1.5, 2);
    const Problem problem = problem_of(f, extent, draw.turn(), draw.turn());
    const Matrix v = answer(problem), w = expected(problem);
    ASSERT_TRUE(v.allFinite());
    const double size = size_of(w, problem) + size_of(problem.f, problem);
    ASSERT_LT(distance(v, problem) - distance(w, problem), kRounding * size) << kind << "\n" << problem.f;
    ASSERT_NEAR(v.determinant(), 1, 1e-3) << kind << "\n" << v;
  }
  for (const double size : {1e-30, 1e-12, 1e6, 1e15, 1e30}) {
    const Problem problem = problem_of(size * draw.matrix(), {1, 1.5, 2}, draw.turn(), draw.turn());
    EXPECT_TRUE(answer(problem).allFinite()) << size;
  }
}

TEST(VolumeKernel, OfAFlatClusterFollowsItsExtent) {
  MatrixDraw draw(5);
  for (const Eigen::Vector3d& extent : {Eigen::Vector3d(1, 2, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 0, 0)}) {
    for (int k = 0; k < 100; ++k) {
      // Flat along the grid's axes, so that A0 has exact zeros.
      Problem problem = problem_of(draw.matrix(), extent, Matrix::Identity(), draw.turn());
      const Matrix v = answer(problem);
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d change(problem.change(0, axis), problem.change(1, axis), problem.change(2, axis));
        const Eigen::Vector3d along = extent[axis] > 0
                                          ? Eigen::Vector3d(Matrix::Identity().col(axis) + change / extent[axis])
                                          : Eigen::Vector3d(problem.rotation.col(axis));
        EXPECT_LT((v.col(axis) - along).norm(), kRounding * (1 + along.norm())) << extent.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace cutproof::volume_kernel_test
