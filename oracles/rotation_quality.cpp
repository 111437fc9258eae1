// Rotations that are rotations.
#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

#include "oracles/checks.h"
#include "oracles/eigen.h"

namespace cutproof::oracles {

namespace {

// ‖RᵀR − I‖, Frobenius; each entry of it is summed from −1 or 0 on, so that little is rounded.
double orthogonality_defect(const Mat3& r) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double entry = i == j ? -1 : 0;
      for (int row = 0; row < 3; ++row) entry += r(row, i) * r(row, j);
      sum += entry * entry;
    }
  }
  return std::sqrt(sum);
}

}  // namespace

void check_rotation_quality(Judged& judged, Verdict& verdict) {
  const Clusters& clusters = judged.clusters;
  // In whatever precision a backend computes.
  constexpr double kMostDefect = 5e-6;
  verdict.bound = kMostDefect;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const Mat3& r = clusters.rotation[at(c)];
    const double defect = orthogonality_defect(r), determinant = as_eigen(r).determinant();
    ++verdict.checked;
    const bool reflects = !(determinant > 0);
    if (!(defect <= verdict.measured)) verdict.measured = defect;
    if (!verdict.holds || (defect <= kMostDefect && !reflects)) continue;
    const int32_t number = clusters.number[at(c)];
    if (reflects && defect <= kMostDefect) {
      fail(verdict, {{number}}, "the rotation of cluster {} is a reflection: its determinant is {}", number,
           determinant);
    } else {
      fail(verdict, {{number}}, "the rotation of cluster {} is off by {} from an orthogonal matrix", number, defect);
    }
  }
}

}  // namespace cutproof::oracles
