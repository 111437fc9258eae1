// Ways to solve many rotation problems at once, with times; on the CPU and, in builds with CUDA, on a device.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "fixtures/rotation_answers.h"
#include "harness/backends.h"

namespace cutproof::benchmarks {

struct TimedAnswers {
  fixtures::Answers answers;
  std::vector<double> seconds;  // [repeats] for all matrices together, after an untimed run
};

struct RotationMethod {
  std::string name;
  Precision precision = Precision::binary32;
  bool is_default = false;  // the method of the kernels' step
  int64_t bytes = 0;        // read and written for each matrix
  // Matrix i starts from previous[i], every time.
  std::function<TimedAnswers(const std::vector<Mat3>& a, const std::vector<Mat3>& previous, int repeats)> solve;
};

// On one thread: sequentially. On all threads: as a kernel. On a device: as a kernel, timed by CUDA events around the
// launch. The kernels' methods in both precisions, Müller's from a cold start, McAdams', and on the CPU Eigen's
// JacobiSVD and, in double, the reference's (horn).
std::vector<RotationMethod> rotation_methods(const harness::BackendDescriptor& backend);

#if CUTPROOF_HAS_CUDA
std::vector<RotationMethod> device_rotation_methods();
#endif

// Layout of matrices in memory: entry k of matrix i at [k · n + i] (rotation_kernel.cuh).
template <class Real>
std::vector<Real> interleaved(const std::vector<Mat3>& matrices) {
  std::vector<Real> values(9 * matrices.size());
  for (std::size_t i = 0; i < matrices.size(); ++i) {
    for (std::size_t k = 0; k < 9; ++k) values[k * matrices.size() + i] = static_cast<Real>(matrices[i].m[k]);
  }
  return values;
}
template <class Real>
std::vector<Mat3> separated(const std::vector<Real>& values) {
  std::vector<Mat3> matrices(values.size() / 9);
  for (std::size_t i = 0; i < matrices.size(); ++i) {
    for (std::size_t k = 0; k < 9; ++k) matrices[i].m[k] = static_cast<double>(values[k * matrices.size() + i]);
  }
  return matrices;
}

}  // namespace cutproof::benchmarks
