// The rotation of one cluster: Newton's method and what it falls back on, in both precisions, on every hard case of
// method.md, Hard cases (fixtures/hard_matrices.h). Methods beside it: tests/benchmarks/rotations_test.cpp. `cutproof
// bench rotations` prints what each reaches.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "fixtures/rotation_answers.h"
#include "gpu/kernels/rotation.cuh"

namespace cutproof::gpu::rotation_kernel_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr int kTrials = 2000;

Matrix3 from(const Matrix3d& m) {
  Matrix3 result;
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) result(row, k) = static_cast<float>(m(row, k));
  }
  return result;
}

Matrix3d to(const Matrix3& m) {
  Matrix3d result;
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) result(row, k) = m(row, k);
  }
  return result;
}

Matrix3d turn(double angle, const Vector3d& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}
  double normal() { return normal_(engine_); }
  double uniform(double low, double high) { return low + (high - low) * uniform_(engine_); }
  Vector3d vector() { return {normal(), normal(), normal()}; }
  Matrix3d rotation() {
    return Eigen::Quaterniond(normal(), normal(), normal(), normal()).normalized().toRotationMatrix();
  }
  Matrix3d matrix() {
    Matrix3d a;
    for (int k = 0; k < 9; ++k) a(k / 3, k % 3) = normal();
    return a;
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

// What Newton's method falls back on, by itself.
template <class Real>
Rotation<Real> by_jacobi4(Matrix3x3<Real> a, const Matrix3x3<Real>& previous) {
  if (!rotation_detail::scale_to_one(a)) return {previous, true};
  return rotation_detail::by_jacobi4(a, previous);
}

// What a method answers, as fixtures::judge asks for it.
template <bool newton, class Real>
fixtures::Answers solve(const std::vector<Mat3>& a, const std::vector<Mat3>& previous) {
  fixtures::Answers answers;
  for (std::size_t i = 0; i < a.size(); ++i) {
    Matrix3x3<Real> matrix, before;
    for (std::size_t k = 0; k < 9; ++k) {
      matrix.m[k] = static_cast<Real>(a[i].m[k]);
      before.m[k] = static_cast<Real>(previous[i].m[k]);
    }
    const auto rotation = newton ? rotate(matrix, before) : by_jacobi4(matrix, before);
    Mat3& r = answers.r.emplace_back();
    for (std::size_t k = 0; k < 9; ++k) r.m[k] = static_cast<double>(rotation.r.m[k]);
    answers.flagged.push_back(rotation.degenerate);
  }
  return answers;
}

struct Method {
  const char* name;
  Precision precision;
  fixtures::Solve solve;
};
template <class Real>
std::vector<Method> methods_in(Precision precision) {
  return {{"jacobi4", precision, solve<false, Real>}, {"newton", precision, solve<true, Real>}};
}
std::vector<Method> methods() {
  std::vector<Method> all = methods_in<float>(Precision::binary32);
  for (const Method& method : methods_in<double>(Precision::binary64)) all.push_back(method);
  return all;
}

fixtures::Judged judged(const std::string& name, const Method& method) {
  return fixtures::judge(fixtures::pose(fixtures::hard_case(name), kTrials, method.precision), method.solve);
}

TEST(GpuRotation, ReachesTheGoalOnEveryHardCase) {
  for (const fixtures::HardCase& hard : fixtures::hard_cases()) {
    for (const Precision precision : {Precision::binary32, Precision::binary64}) {
      const fixtures::Problems problems = fixtures::pose(hard, kTrials, precision);
      for (const Method& method : methods()) {
        if (method.precision != precision) continue;
        const fixtures::Judged result = fixtures::judge(problems, method.solve);
        const std::string where = hard.name + ", " + method.name +
                                  (precision == Precision::binary32 ? ", single" : ", double") + ", seed " +
                                  std::to_string(hard.seed) + ": " + result.first_wrong;
        EXPECT_EQ(result.not_finite, 0) << where;
        EXPECT_EQ(result.reflections, 0) << where;
        EXPECT_EQ(result.wrong, 0) << where;
      }
    }
  }
}

TEST(GpuRotation, KeepsWhatItHadAndSaysSoWhereNothingIsKnown) {
  for (const Method& method : methods()) {
    for (const char* nothing : {"zero", "one_particle", "coincident_particles", "nan_and_inf"}) {
      const fixtures::Judged result = judged(nothing, method);
      EXPECT_EQ(result.wrong, 0) << method.name << ", " << nothing << ": " << result.first_wrong;
    }
  }
}

TEST(GpuRotation, OfASymmetricMatrixIsTheIdentityToTheBit) {
  // So that a body at rest stays where it is.
  Random random(6);
  for (int trial = 0; trial < 200; ++trial) {
    const Matrix3d b = random.matrix();
    Matrix3 a = from(b * b.transpose());
    for (int row = 0; row < 3; ++row) {
      for (int k = 0; k < row; ++k) a(row, k) = a(k, row);
    }
    for (const Matrix3& r : {rotate(a, Matrix3{}).r, by_jacobi4(a, Matrix3{}).r}) {
      for (int k = 0; k < 9; ++k) EXPECT_EQ(r.m[k], Matrix3{}.m[k]);
    }
  }
}

TEST(GpuRotation, TakesTheNearestToThePreviousOneForACollinearCluster) {
  Random random(7);
  for (int trial = 0; trial < kTrials; ++trial) {
    const Matrix3d previous = to(from(random.rotation()));
    const Vector3d v = random.vector().normalized(), u = random.vector().normalized();
    if ((previous * v).dot(u) < -0.99) continue;  // nearly opposite: any turn is as near as another
    const Matrix3d nearest = Eigen::Quaterniond::FromTwoVectors(previous * v, u).toRotationMatrix() * previous;
    const Matrix3 a = from(u * v.transpose());
    const Rotation jacobi = by_jacobi4(a, from(previous));
    EXPECT_TRUE(jacobi.degenerate);
    // The projection onto the eigenspace has a length of at least cos(86°), so rounding grows at most 15-fold.
    EXPECT_LE((to(jacobi.r) - nearest).norm(), 15 * 30 * 0x1p-24);
  }
}

TEST(GpuRotation, TakesTheNearestToThePreviousOneForAReflectionWithEqualSingularValues) {
  Random random(8);
  for (int trial = 0; trial < 200; ++trial) {
    const Matrix3 previous = from(random.rotation());
    Matrix3 a;
    for (int k = 0; k < 9; ++k) a.m[k] = -Matrix3{}.m[k];
    // -I: every half turn is an answer. The nearest to P turns about P's own axis.
    const Rotation rotation = by_jacobi4(a, previous);
    EXPECT_TRUE(rotation.degenerate);
    const Eigen::AngleAxisd axis(to(previous));
    if (axis.angle() < 0.1) continue;
    EXPECT_LE((to(rotation.r) - turn(kPi, axis.axis())).norm(), 20 * 30 * 0x1p-24);
  }
}

TEST(GpuRotation, IsUniqueForASheetAndSaysSo) {
  Random random(9);
  for (int trial = 0; trial < kTrials; ++trial) {
    const Matrix3d q = random.rotation();
    const Matrix3 a = from(q * Vector3d(2, random.uniform(0.1, 1), 0).asDiagonal());
    const Rotation rotation = by_jacobi4(a, Matrix3{});
    EXPECT_FALSE(rotation.degenerate);
    // A's own rounding turns it by up to u σ1 / (σ2 + σ3), and so does that of the solve.
    EXPECT_LE((to(rotation.r) - q).norm(), 20 * 30 * 0x1p-24);
  }
}

TEST(GpuRotation, CarriesRotationsTranspositionAndScale) {
  Random random(10);
  for (int trial = 0; trial < kTrials; ++trial) {
    const Matrix3 a = from(random.matrix());
    const Vector3d sigma = Eigen::JacobiSVD<Matrix3d>(to(a)).singularValues();
    const double sign = to(a).determinant() < 0 ? -1 : 1;
    const double separation = (sigma[1] + sign * sigma[2]) / sigma[0];
    const Matrix3d r = to(by_jacobi4(a, Matrix3{}).r);
    // An error of e σ1 in A or in the solve turns the answer by e σ1 / (σ2 + σ3).
    const double bound = 60 * 0x1p-24 / separation;
    const Matrix3d q = random.rotation();
    EXPECT_LE((to(by_jacobi4(from(q * to(a)), Matrix3{}).r) - q * r).norm(), bound);
    EXPECT_LE((to(by_jacobi4(from(to(a).transpose()), Matrix3{}).r) - r.transpose()).norm(), bound);
    EXPECT_LE((to(by_jacobi4(from(1e-20 * to(a)), Matrix3{}).r) - r).norm(), bound);
    // Powers of two change nothing at all.
    for (const int exponent : {-80, -3, 5, 90}) {
      Matrix3 scaled = a;
      for (float& entry : scaled.m) entry = std::ldexp(entry, exponent);
      EXPECT_EQ(to(by_jacobi4(scaled, Matrix3{}).r), r);
    }
  }
}

}  // namespace
}  // namespace cutproof::gpu::rotation_kernel_test
