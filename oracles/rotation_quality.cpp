// Rotations that are rotations.
#include <fmt/format.h>

#include <cmath>

#include "oracles/checks.h"

namespace cutproof::oracles {
namespace {

// ‖RᵀR − I‖, Frobenius.
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

double determinant(const Mat3& r) {
  return dot({r(0, 0), r(0, 1), r(0, 2)}, cross({r(1, 0), r(1, 1), r(1, 2)}, {r(2, 0), r(2, 1), r(2, 2)}));
}

}  // namespace

void check_rotation_quality(Judged& judged, Verdict& verdict) {
  const Clusters& clusters = judged.clusters;
  // In whatever precision a backend computes.
  constexpr double kMostDefect = 5e-6;
  verdict.bound = kMostDefect;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const Mat3& r = clusters.rotation[at(c)];
    const double defect = orthogonality_defect(r);
    ++verdict.checked;
    const bool reflects = !(determinant(r) > 0);
    if (!(defect <= verdict.measured)) verdict.measured = defect;
    if (!verdict.holds || (defect <= kMostDefect && !reflects)) continue;
    const int32_t number = clusters.number[at(c)];
    verdict.holds = false;
    verdict.witness.clusters = {number};
    verdict.witness.text =
        reflects && defect <= kMostDefect
            ? fmt::format("the rotation of cluster {} is a reflection: its determinant is {}", number, determinant(r))
            : fmt::format("the rotation of cluster {} is off by {} from an orthogonal matrix", number, defect);
  }
}

}  // namespace cutproof::oracles
