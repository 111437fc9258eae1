// The oracle's nearest matrix of determinant 1, its bound for rounding, and states that are wrong in nothing else.
#include "oracles/volume_target.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include "oracles/eigen.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/expectations.h"
#include "tests/random_matrices.h"

namespace cutproof::volume_target_test {
namespace {

using oracles::as_eigen;
using oracles::to_mat3;
using oracles::volume_target;
using oracles::VolumeTarget;
using Matrix = Eigen::Matrix3d;

double apart(const VolumeTarget& target, const Mat3& v, const Matrix& a0) {
  const Matrix off = as_eigen(v) - as_eigen(target.v);
  return std::sqrt((off * a0 * off.transpose()).trace());
}

// Two algorithms that share nothing agree within the bound, wherever the answer is sure; that is nearly everywhere.
TEST(VolumeTarget, OfTheReferenceLiesWithinItsRounding) {
  constexpr double u = 0x1p-52;
  MatrixDraw draw(1);
  int open = 0;
  constexpr int kDraws = 20'000;
  for (int k = 0; k < kDraws; ++k) {
    const Matrix a0 = draw.rest_moment(), r = draw.turn();
    const Matrix f = k % 2 == 0 ? Matrix(draw.turn() * (Matrix::Identity() + 0.2 * draw.matrix()))
                                : Matrix(std::exp(draw.normal()) * draw.matrix());
    const Matrix a = f * a0;
    const VolumeTarget target = volume_target(to_mat3(a), to_mat3(a0), to_mat3(r));
    if (target.is_open(4 * u * a.norm(), 4 * u, u)) {
      ++open;
      continue;
    }
    const Mat3 v = reference::cluster_maps(1, to_mat3(a), to_mat3(a0), to_mat3(r)).carry;
    ASSERT_LE(apart(target, v, a0), target.rounding(4 * u * a.norm(), 4 * u, u)) << f;
    // An error of A shows as such, and its effect is bounded.
    const Matrix off = 1e-9 * draw.matrix();
    const Mat3 other = reference::cluster_maps(1, to_mat3(Matrix(a + off)), to_mat3(a0), to_mat3(r)).carry;
    if (target.is_open(off.norm(), 4 * u, u)) continue;
    ASSERT_LE(apart(target, other, a0), 1.01 * target.rounding(off.norm(), 4 * u, u)) << f;
  }
  EXPECT_LT(open, kDraws / 1000);
}

// The least wrong maps that the bound rejects: V of F / J^(1/3), V in the norm of the unit matrix, V of the other
// branch, and R.
TEST(VolumeTarget, TellsApartWhatIsNearlyIt) {
  constexpr double u = 0x1p-52;
  MatrixDraw draw(2);
  for (int k = 0; k < 200; ++k) {
    const Matrix a0 = draw.rest_moment(), r = draw.turn();
    const Matrix f = r * (Matrix::Identity() + 0.05 * draw.matrix()), a = f * a0;
    const VolumeTarget target = volume_target(to_mat3(a), to_mat3(a0), to_mat3(r));
    const double bound = target.rounding(4 * u * a.norm(), 4 * u, u);
    EXPECT_LT(bound, 1e-11);
    const Matrix mueller = f / std::cbrt(f.determinant());
    EXPECT_GT(apart(target, to_mat3(mueller), a0), 1e3 * bound);
    const Mat3 even = reference::cluster_maps(1, to_mat3(f), Mat3{}, to_mat3(r)).carry;
    EXPECT_GT(apart(target, even, a0), 1e3 * bound);
    EXPECT_GT(apart(target, to_mat3(r), a0), 1e3 * bound);
  }
}

// Where several answers are as near, or a threshold decides, nothing sharp is asked.
TEST(VolumeTarget, IsOpenWhereTheAnswerJumps) {
  constexpr double u = 0x1p-52;
  const Mat3 one{};
  for (const Eigen::Vector3d& sigma : {Eigen::Vector3d(3, 3, 3), Eigen::Vector3d(4, 2, 2), Eigen::Vector3d(1, 0, 0),
                                       Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0.5, -0.5)}) {
    const VolumeTarget target = volume_target(to_mat3(Matrix(sigma.asDiagonal())), one, one);
    EXPECT_TRUE(target.is_open(u, u, u)) << sigma.transpose();
  }
  for (const Eigen::Vector3d& sigma : {Eigen::Vector3d(1.5, 1.5, 1.5), Eigen::Vector3d(1, 0.5, 0),
                                       Eigen::Vector3d(3, 3, 1), Eigen::Vector3d(1, 0.5, -0.25)}) {
    const VolumeTarget target = volume_target(to_mat3(Matrix(sigma.asDiagonal())), one, one);
    EXPECT_FALSE(target.is_open(u, u, u)) << sigma.transpose();
  }
  // Where the nearest one jumps, both branches are as near: an error of A may decide.
  const auto dilated = [&](double by) { return volume_target(to_mat3(Matrix(by * Matrix::Identity())), one, one); };
  double jump = 1.89;
  for (double by = jump; by < 1.95; by += 1e-4) {
    if (dilated(by).lead < dilated(jump).lead) jump = by;
  }
  EXPECT_TRUE(dilated(jump).is_open(2e-4, u, u)) << jump;
  EXPECT_FALSE(dilated(1.8).is_open(2e-4, u, u));
  // Nearly flat: the threshold of det A0, and a moment at that of the greatest.
  const double flat = kFlatVolume * std::pow(2, 3);
  for (const double least : {flat, 1e-3}) {
    const Matrix a0 = Eigen::Vector3d(1, 1, least).asDiagonal();
    EXPECT_TRUE(volume_target(to_mat3(a0), to_mat3(a0), one).is_open(u, u, u)) << least;
  }
}

TEST(VolumeTarget, KnowsFlatClusters) {
  const auto flat = [](double x, double y, double z) {
    const Matrix a0 = Eigen::Vector3d(x, y, z).asDiagonal();
    return volume_target(to_mat3(a0), to_mat3(a0), Mat3{});
  };
  EXPECT_FALSE(flat(1, 1, 0.1).is_flat);
  EXPECT_TRUE(flat(1, 1, 0).is_flat);
  EXPECT_FALSE(flat(1, 1, 0).is_nearly_flat);
  EXPECT_TRUE(flat(1, 1, 1e-5).is_nearly_flat);
  EXPECT_EQ(flat(0, 0, 0).v, Mat3{});
  EXPECT_FALSE(flat(0, 0, 0).is_open(0, 0, 0x1p-24)) << "one particle";
}

}  // namespace
}  // namespace cutproof::volume_target_test
