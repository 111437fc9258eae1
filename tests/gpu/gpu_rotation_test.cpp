// The rotation of one cluster in single precision: every method on every set of hard cases of accuracy_and_speed.md §3,
// judged by a singular value decomposition in double precision of the same single-precision matrix. The table that the
// first test prints is the one in docs/rotations.md.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "gpu/rotation.cuh"

namespace cutproof::gpu {
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

// A with the given signed singular values: U diag(σ) Vᵀ, U and V rotations.
Matrix3d with_spectrum(Random& random, const Vector3d& sigma) {
  return random.rotation() * sigma.asDiagonal() * random.rotation().transpose();
}

// A from a cloud of particles as a cluster makes it: Σ (x - t)(X - T)ᵀ.
Matrix3d cloud(const std::vector<Vector3d>& now, const std::vector<Vector3d>& rest, const std::vector<double>& mass) {
  double total = 0;
  Vector3d t = Vector3d::Zero(), rest_center = Vector3d::Zero();
  for (std::size_t i = 0; i < now.size(); ++i) {
    total += mass[i];
    t += mass[i] * now[i];
    rest_center += mass[i] * rest[i];
  }
  Matrix3d a = Matrix3d::Zero();
  for (std::size_t i = 0; i < now.size(); ++i) {
    a += mass[i] * (now[i] - t / total) * (rest[i] - rest_center / total).transpose();
  }
  return a;
}

struct Problem {
  Matrix3 a;
  Matrix3 previous;
};

struct Set {
  std::string name;
  std::function<Problem(Random&)> make;
};

std::vector<Set> hard_cases() {
  const auto cold = [](Matrix3d a) { return Problem{from(a), Matrix3{}}; };
  const auto warm = [](Random& random, const Matrix3d& a, const Matrix3d& r) {
    return Problem{from(a), from(turn(random.uniform(0, 0.1), random.vector()) * r)};
  };
  const auto spectrum = [cold](Vector3d sigma) {
    return [cold, sigma](Random& random) { return cold(with_spectrum(random, sigma)); };
  };
  return {
      {"pure rotation", [cold](Random& random) { return cold(random.rotation()); }},
      {"rotation x (1 ± 1e-6)",
       [cold](Random& random) { return cold((1 + random.uniform(-1e-6, 1e-6)) * random.rotation()); }},
      {"stretched, turned ≤ 0.1 since",
       [warm](Random& random) {
         const Matrix3d r = random.rotation(), v = random.rotation();
         const Vector3d sigma(random.uniform(0.5, 2), random.uniform(0.5, 2), random.uniform(0.5, 2));
         return warm(random, r * v * sigma.asDiagonal() * v.transpose(), r);
       }},
      {"half turn about an axis",
       [cold](Random& random) {
         const int axis = static_cast<int>(random.uniform(0, 3));
         return cold(random.uniform(0.5, 2) * turn(kPi, Vector3d::Unit(axis)));
       }},
      {"half turn, any axis", [cold](Random& random) { return cold(turn(kPi, random.vector())); }},
      {"120° from cold", [cold](Random& random) { return cold(turn(2 * kPi / 3, random.vector())); }},
      {"any matrix", [cold](Random& random) { return cold(random.matrix()); }},
      {"reflection, separated",
       [cold](Random& random) {
         return cold(
             with_spectrum(random, {random.uniform(1.5, 2), random.uniform(0.8, 1.2), -random.uniform(0.1, 0.5)}));
       }},
      {"reflection, σ2 ≈ |σ3|",
       [cold](Random& random) {
         const double s = random.uniform(0.2, 0.9);
         return cold(with_spectrum(random, {1, s, -s * (1 - std::pow(10, random.uniform(-8, -2)))}));
       }},
      {"(1, 1, -1)", spectrum({1, 1, -1})},
      {"-I and -R",
       [cold](Random& random) {
         return cold(random.uniform(0, 1) < 0.5 ? Matrix3d(-Matrix3d::Identity()) : Matrix3d(-random.rotation()));
       }},
      {"rank 2 (a sheet)",
       [cold](Random& random) {
         return cold(with_spectrum(random, {1, random.uniform(0.1, 1), 0}));
       }},
      {"rank 1 (a wire)",
       [warm](Random& random) {
         return warm(random, random.vector() * random.vector().transpose(), random.rotation());
       }},
      {"nearly rank 1",
       [cold](Random& random) {
         const double s = std::pow(10, random.uniform(-8, -4));
         return cold(with_spectrum(random, {1, s, random.uniform(-1, 1) * s}));
       }},
      {"(1, 1e-3, 1e-6)", spectrum({1, 1e-3, 1e-6})},
      {"(1, 1e-3, -1e-6)", spectrum({1, 1e-3, -1e-6})},
      {"scale 1e-30", [cold](Random& random) { return cold(1e-30 * random.matrix()); }},
      {"scale 1e30", [cold](Random& random) { return cold(1e30 * random.matrix()); }},
      {"denormals", [cold](Random& random) { return cold(std::pow(10, random.uniform(-44, -38)) * random.matrix()); }},
      {"through σ2 + σ3 = 0",
       [warm](Random& random) {
         const Matrix3d u = random.rotation(), v = random.rotation();
         const Vector3d sigma(1, 0.4, -0.4 + random.uniform(-1e-5, 1e-5));
         return warm(random, u * sigma.asDiagonal() * v.transpose(), u * v.transpose());
       }},
      {"mass ratio 1e6",
       [cold](Random& random) {
         const Matrix3d r = random.rotation();
         std::vector<Vector3d> now, rest;
         std::vector<double> mass;
         for (int i = 0; i < 20; ++i) {
           rest.push_back(random.vector());
           now.push_back(r * rest.back() + 0.2 * random.vector());
           mass.push_back(std::pow(10, random.uniform(-6, 0)));
         }
         return cold(cloud(now, rest, mass));
       }},
      {"far from the origin",
       [cold](Random& random) {
         const Matrix3d r = random.rotation();
         const Vector3d place = 1e6 * random.vector();
         std::vector<Vector3d> now, rest;
         for (int i = 0; i < 20; ++i) {
           rest.push_back(random.vector());
           now.push_back(r * rest.back() + 0.2 * random.vector() + place);
         }
         return cold(cloud(now, rest, std::vector<double>(20, 1.0)));
       }},
  };
}

// (best - reached) / Σ|σ|, with the best value σ1 + σ2 + sign(det A) σ3.
double objective_gap(const Matrix3& a, const Matrix3& r) {
  Matrix3d scaled = to(a);
  scaled /= scaled.cwiseAbs().maxCoeff();
  const Eigen::JacobiSVD<Matrix3d> svd(scaled, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vector3d sigma = svd.singularValues();
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return (sigma[0] + sigma[1] + sign * sigma[2] - (to(r).transpose() * scaled).trace()) / sigma.sum();
}

struct Worst {
  double gap = 0, orthogonality = 0;
  int wrong = 0;       // gap above 1e-6, orthogonality above 5e-6, a reflection, or not finite
  int not_finite = 0;  // among them
};

template <int Method>
Worst worst_of(const Set& set, uint64_t seed) {
  Random random(seed);
  Worst worst;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Problem problem = set.make(random);
    double greatest = 0;
    for (const float entry : problem.a.m) greatest = std::max(greatest, std::abs(double{entry}));
    if (greatest == 0) continue;  // a denormal that became zero
    const Matrix3 r = rotate<Method>(problem.a, problem.previous).r;
    const Matrix3d rd = to(r);
    if (!rd.allFinite()) {
      ++worst.not_finite;
      ++worst.wrong;
      continue;
    }
    const double gap = objective_gap(problem.a, r);
    const double orthogonality = (rd.transpose() * rd - Matrix3d::Identity()).norm();
    worst.gap = std::max(worst.gap, gap);
    worst.orthogonality = std::max(worst.orthogonality, orthogonality);
    worst.wrong += !(gap <= 1e-6 && orthogonality <= 5e-6 && rd.determinant() > 0);
  }
  return worst;
}

TEST(GpuRotation, TheDefaultReachesTheGoalOnEveryHardCaseAndNoMethodGivesNaN) {
  std::printf("%-32s", "worst gap (wrong of 2,000)");
  for (const char* name : {"jacobi4", "mueller2016", "apd", "svd", "quest", "newton"}) std::printf("%20s", name);
  std::printf("\n");
  std::array<double, 6> orthogonality = {};
  uint64_t seed = 100;
  for (const Set& set : hard_cases()) {
    ++seed;
    const std::array<Worst, 6> worst = {worst_of<kJacobi4>(set, seed), worst_of<kMueller2016>(set, seed),
                                        worst_of<kApd>(set, seed),     worst_of<kSvd>(set, seed),
                                        worst_of<kQuest>(set, seed),   worst_of<kNewton>(set, seed)};
    std::printf("%-32s", set.name.c_str());
    for (std::size_t method = 0; method < 6; ++method) {
      const Worst& w = worst[method];
      std::printf("%12.1e (%5d)", w.gap, w.wrong);
      orthogonality[method] = std::max(orthogonality[method], w.orthogonality);
      EXPECT_EQ(w.not_finite, 0) << set.name << ", method " << method;
    }
    std::printf("\n");
    EXPECT_EQ(worst[kJacobi4].wrong, 0) << set.name << ", gap " << worst[kJacobi4].gap << ", orthogonality "
                                        << worst[kJacobi4].orthogonality << ", seed " << seed;
    EXPECT_EQ(worst[kNewton].wrong, 0) << set.name << ", gap " << worst[kNewton].gap << ", seed " << seed;
    EXPECT_EQ(worst[kSvd].wrong, 0) << set.name << ", gap " << worst[kSvd].gap << ", seed " << seed;
  }
  std::printf("%-32s", "worst |RᵀR - I|");
  for (const double value : orthogonality) std::printf("%12.1e        ", value);
  std::printf("\n");
}

TEST(GpuRotation, TheOthersAreRightWhereTheyAreSaidToBe) {
  // What docs/rotations.md says of them; a method that stops being right there has a fault.
  for (const Set& set : hard_cases()) {
    if (set.name == "stretched, turned ≤ 0.1 since") {
      EXPECT_EQ(worst_of<kMueller2016>(set, 1).wrong, 0);
      EXPECT_EQ(worst_of<kApd>(set, 1).wrong, 0);
    }
    if (set.name == "pure rotation") {
      EXPECT_EQ(worst_of<kQuest>(set, 1).wrong, 0);
    }
  }
}

template <int Method>
void expect_previous_kept() {
  const Matrix3 previous = from(turn(2.0, Vector3d(1, 1, 0)));
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  Random random(5);
  for (int place = 0; place < 9; ++place) {
    for (const float poison : {kNaN, kInf, -kInf}) {
      Matrix3 a = from(random.matrix());
      a.m[place] = poison;
      const Rotation rotation = rotate<Method>(a, previous);
      EXPECT_TRUE(rotation.degenerate);
      for (int k = 0; k < 9; ++k) EXPECT_EQ(rotation.r.m[k], previous.m[k]);
    }
  }
  Matrix3 zero;
  for (float& entry : zero.m) entry = 0;
  const Rotation rotation = rotate<Method>(zero, previous);
  EXPECT_TRUE(rotation.degenerate);
  for (int k = 0; k < 9; ++k) EXPECT_EQ(rotation.r.m[k], previous.m[k]);
}

TEST(GpuRotation, KeepsThePreviousOneAndFlagsItWhereNothingIsKnown) {
  expect_previous_kept<kJacobi4>();
  expect_previous_kept<kMueller2016>();
  expect_previous_kept<kApd>();
  expect_previous_kept<kSvd>();
  expect_previous_kept<kQuest>();
  expect_previous_kept<kNewton>();
}

template <int Method>
void expect_identity_kept() {
  Random random(6);
  for (int trial = 0; trial < 200; ++trial) {
    const Matrix3d b = random.matrix();
    Matrix3 a = from(b * b.transpose());
    for (int row = 0; row < 3; ++row) {
      for (int k = 0; k < row; ++k) a(row, k) = a(k, row);
    }
    const Matrix3 r = rotate<Method>(a, Matrix3{}).r;
    for (int k = 0; k < 9; ++k) EXPECT_EQ(r.m[k], Matrix3{}.m[k]);
  }
}

TEST(GpuRotation, OfASymmetricMatrixIsTheIdentityToTheBit) {
  // So that a body at rest stays where it is.
  expect_identity_kept<kJacobi4>();
  expect_identity_kept<kMueller2016>();
  expect_identity_kept<kApd>();
  expect_identity_kept<kNewton>();
}

TEST(GpuRotation, TakesTheNearestToThePreviousOneForACollinearCluster) {
  Random random(7);
  for (int trial = 0; trial < kTrials; ++trial) {
    const Matrix3d previous = to(from(random.rotation()));
    const Vector3d v = random.vector().normalized(), u = random.vector().normalized();
    if ((previous * v).dot(u) < -0.99) continue;  // nearly opposite: any turn is as near as another
    const Matrix3d nearest = Eigen::Quaterniond::FromTwoVectors(previous * v, u).toRotationMatrix() * previous;
    const Matrix3 a = from(u * v.transpose());
    const Rotation jacobi = rotate<kJacobi4>(a, from(previous)), svd = rotate<kSvd>(a, from(previous));
    EXPECT_TRUE(jacobi.degenerate);
    EXPECT_TRUE(svd.degenerate);
    // The projection onto the eigenspace has a length of at least cos(86°), so rounding grows at most 15-fold.
    EXPECT_LE((to(jacobi.r) - nearest).norm(), 15 * 30 * 0x1p-24);
    EXPECT_LE((to(svd.r) - nearest).norm(), 200 * 30 * 0x1p-24);
  }
}

TEST(GpuRotation, TakesTheNearestToThePreviousOneForAReflectionWithEqualSingularValues) {
  Random random(8);
  for (int trial = 0; trial < 200; ++trial) {
    const Matrix3 previous = from(random.rotation());
    Matrix3 a;
    for (int k = 0; k < 9; ++k) a.m[k] = -Matrix3{}.m[k];
    // -I: every half turn is an answer. The nearest to P turns about P's own axis.
    const Rotation rotation = rotate<kJacobi4>(a, previous);
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
    const Rotation rotation = rotate<kJacobi4>(a, Matrix3{});
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
    const Matrix3d r = to(rotate<kJacobi4>(a, Matrix3{}).r);
    // An error of e σ1 in A or in the solve turns the answer by e σ1 / (σ2 + σ3).
    const double bound = 60 * 0x1p-24 / separation;
    const Matrix3d q = random.rotation();
    EXPECT_LE((to(rotate<kJacobi4>(from(q * to(a)), Matrix3{}).r) - q * r).norm(), bound);
    EXPECT_LE((to(rotate<kJacobi4>(from(to(a).transpose()), Matrix3{}).r) - r.transpose()).norm(), bound);
    EXPECT_LE((to(rotate<kJacobi4>(from(1e-20 * to(a)), Matrix3{}).r) - r).norm(), bound);
    // Powers of two change nothing at all.
    for (const int exponent : {-80, -3, 5, 90}) {
      Matrix3 scaled = a;
      for (float& entry : scaled.m) entry = std::ldexp(entry, exponent);
      EXPECT_EQ(to(rotate<kJacobi4>(scaled, Matrix3{}).r), r);
    }
  }
}

}  // namespace
}  // namespace cutproof::gpu
