// Matrices drawn for tests of rotations and volumes.
#pragma once
#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <random>

namespace cutproof {

class MatrixDraw {
 public:
  explicit MatrixDraw(uint64_t seed) : source_(seed) {}
  double normal() { return normal_(source_); }
  Eigen::Matrix3d matrix() {
    Eigen::Matrix3d m;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) m(row, column) = normal();
    }
    return m;
  }
  Eigen::Matrix3d turn() {
    return Eigen::Quaterniond(normal(), normal(), normal(), normal()).normalized().toRotationMatrix();
  }
  // A rest moment whose extents lie within a factor of e^2.8 of each other.
  Eigen::Matrix3d rest_moment() {
    const Eigen::Matrix3d axes = turn();
    Eigen::Vector3d extent;
    for (int k = 0; k < 3; ++k) extent[k] = std::exp(1.4 * std::tanh(normal()));
    return axes * extent.asDiagonal() * axes.transpose();
  }

 private:
  std::mt19937_64 source_;
  std::normal_distribution<double> normal_;
};

}  // namespace cutproof
