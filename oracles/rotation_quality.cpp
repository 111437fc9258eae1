// Rotations that are rotations.
#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

#include "oracles/checks.h"
#include "oracles/eigen.h"

namespace cutproof::oracles {

void check_rotation_quality(Judged& judged, Verdict& verdict) {
  const Clusters& clusters = judged.clusters;
  // In whatever precision a backend computes.
  constexpr double kMostDefect = 5e-6;
  verdict.bound = kMostDefect;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const Eigen::Matrix3d r = as_eigen(clusters.rotation[at(c)]);
    const double defect = (r.transpose() * r - Eigen::Matrix3d::Identity()).norm();
    ++verdict.checked;
    const bool reflects = !(r.determinant() > 0);
    if (!(defect <= verdict.measured)) verdict.measured = defect;
    if (!verdict.holds || (defect <= kMostDefect && !reflects)) continue;
    const int32_t number = clusters.number[at(c)];
    if (reflects && defect <= kMostDefect) {
      fail(verdict, {{number}}, "the rotation of cluster {} is a reflection: its determinant is {}", number,
           r.determinant());
    } else {
      fail(verdict, {{number}}, "the rotation of cluster {} is off by {} from an orthogonal matrix", number, defect);
    }
  }
}

}  // namespace cutproof::oracles
