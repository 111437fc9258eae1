// The best value of tr(Rᵀ A) that answers are compared with.
#include "oracles/best_rotation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace cutproof::oracles::best_rotation_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Mat3 from(const Matrix3d& m) {
  Mat3 result;
  for (int k = 0; k < 9; ++k) result(k / 3, k % 3) = m(k / 3, k % 3);
  return result;
}
Matrix3d to(const Mat3& m) {
  Matrix3d result;
  for (int k = 0; k < 9; ++k) result(k / 3, k % 3) = m(k / 3, k % 3);
  return result;
}

Matrix3d random_rotation(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double w = normal(random), x = normal(random), y = normal(random);
  return Eigen::Quaterniond(w, x, y, normal(random)).normalized().toRotationMatrix();
}

TEST(BestRotation, KnowsTheBestValueOfEverySpectrumAtEveryScale) {
  std::mt19937_64 random(1);
  for (const Vector3d& sigma : {Vector3d(1, 1, 1), Vector3d(3, 2, 1), Vector3d(3, 2, -1), Vector3d(1, 1, -1),
                                Vector3d(1, 0.3, 0), Vector3d(1, 0, 0), Vector3d(1, 1e-3, -1e-6)}) {
    for (const double scale : {1.0, 0x1p-1000, 0x1p900}) {
      const Matrix3d u = random_rotation(random), v = random_rotation(random);
      const Matrix3d a = u * sigma.asDiagonal() * v.transpose();
      const BestRotation best = best_rotation(from(scale * a));
      const double sum = std::abs(sigma[0]) + std::abs(sigma[1]) + std::abs(sigma[2]);
      // A itself is rounded: three products of three factors in each entry.
      EXPECT_NEAR(static_cast<double>(best.value / best.sum), sigma.sum() / sum, 1e-15) << sigma.transpose();
      EXPECT_NEAR(best.separation, (sigma[1] + sigma[2]) / sigma[0], 4e-15) << sigma.transpose();
      EXPECT_NEAR(objective_gap(best, from(u * v.transpose())), 0, 1e-15) << sigma.transpose();
      EXPECT_LT(best.error, 1e-16) << sigma.transpose();
      EXPECT_GT(best.error, 0) << sigma.transpose();
    }
  }
}

TEST(BestRotation, IsBeatenByNoRotationByMoreThanItsError) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    Matrix3d a;
    for (int k = 0; k < 9; ++k) a(k / 3, k % 3) = normal(random);
    const BestRotation best = best_rotation(from(a));
    for (int other = 0; other < 50; ++other) {
      // A rotation in double is not quite one: it can be too long by a few units of roundoff.
      EXPECT_GE(objective_gap(best, from(random_rotation(random))), -best.error - 1e-15);
    }
  }
}

TEST(BestRotation, TellsHowFarAnAnswerIsFromIt) {
  // Turned by an angle about σ1's axis, the objective loses (1 - cos) (σ2 + σ3).
  const BestRotation best = best_rotation(from(Vector3d(3, 2, 1).asDiagonal()));
  for (const double angle : {1e-3, 0.1, 2.0}) {
    const Matrix3d turned = Eigen::AngleAxisd(angle, Vector3d::UnitX()).toRotationMatrix();
    EXPECT_NEAR(objective_gap(best, from(turned)), (1 - std::cos(angle)) * 3 / 6, 1e-15);
  }
}

TEST(BestRotation, KnowsTheNearestAnswerToAWire) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const Matrix3d p = random_rotation(random);
    const Vector3d v = random_rotation(random).col(0), u = random_rotation(random).col(0);
    const NearestRotation nearest = nearest_of_rank_one(best_rotation(from(2 * u * v.transpose())), from(p));
    EXPECT_NEAR(nearest.weight, (1 + u.dot(p * v)) / 2, 1e-14);
    if (nearest.weight < 1e-3) continue;
    const Matrix3d r = to(nearest.r);
    EXPECT_LE((r * v - u).norm(), 1e-14 / nearest.weight);
    // Any further turn about u leaves A's objective as it is and takes R away from P.
    for (const double angle : {-1.0, -0.1, -1e-3, 1e-3, 0.1, 1.0}) {
      const Matrix3d other = Eigen::AngleAxisd(angle, u).toRotationMatrix() * r;
      EXPECT_LT((other.transpose() * p).trace(), (r.transpose() * p).trace());
    }
  }
}

// However near to half a turn: u is reached, the axis is right as far as it is known.
TEST(BestRotation, KnowsTheNearestAnswerToAWireThatHasNearlyTurnedAbout) {
  for (const double left : {1e-2, 1e-5, 1e-8, 1e-12, 0.0}) {
    const Vector3d u = Vector3d::UnitX(), v(-std::cos(left), std::sin(left), 0);
    const NearestRotation nearest =
        nearest_of_rank_one(best_rotation(from(2 * u * v.transpose())), from(Matrix3d::Identity()));
    const Matrix3d r = to(nearest.r);
    EXPECT_LE((r * v - u).norm(), 5e-16) << left;
    EXPECT_LE((r.transpose() * r - Matrix3d::Identity()).norm(), 2e-15) << left;
    EXPECT_NEAR(r.determinant(), 1, 2e-15) << left;
    EXPECT_NEAR(nearest.weight, left * left / 4, 1e-3 * left * left) << left;
    if (left == 0) continue;
    const Matrix3d turn = Eigen::AngleAxisd(left - M_PI, Vector3d::UnitZ()).toRotationMatrix();
    EXPECT_LE((r - turn).norm(), 2e-15 / left) << left;
  }
}

}  // namespace
}  // namespace cutproof::oracles::best_rotation_test
