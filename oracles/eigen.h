// The data model's vectors and matrices as Eigen's. Internal to oracles/.
#pragma once
#include <Eigen/Core>

#include "model/vec.h"

namespace cutproof::oracles {

inline Eigen::Vector3d as_eigen(Vec3 v) { return {v.x, v.y, v.z}; }
inline Eigen::Matrix3d as_eigen(const Mat3& m) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(m.m.data());
}
inline Mat3 to_mat3(const Eigen::Matrix3d& m) {
  Mat3 result;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(result.m.data()) = m;
  return result;
}

}  // namespace cutproof::oracles
