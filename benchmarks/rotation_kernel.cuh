// The kernel that `cutproof bench rotations` times: it reads A and the previous R, rotates, writes R. On host and
// device, in both precisions, for the step's method and others.
#pragma once
#include <cstdint>

#include "benchmarks/rotation_algorithms.cuh"
#include "gpu/launch/launcher.h"

namespace cutproof::benchmarks {

// Entry k of matrix i at [k · count + i], so that neighbouring threads read neighbouring numbers.
template <class Real>
struct RotationBatch {
  const Real* a = nullptr;
  const Real* previous = nullptr;
  Real* r = nullptr;
  unsigned char* flagged = nullptr;
  std::int64_t count = 0;
};
// Input and output of each matrix.
template <class Real>
inline constexpr std::int64_t kRotationBytes = 27 * sizeof(Real) + 1;

template <class Method, class Real>
CUTPROOF_BOTH inline void rotate_one(const RotationBatch<Real>& batch, std::int64_t i) {
  gpu::Matrix3x3<Real> a, previous;
  for (int k = 0; k < 9; ++k) {
    a.m[k] = batch.a[k * batch.count + i];
    previous.m[k] = batch.previous[k * batch.count + i];
  }
  const gpu::Rotation<Real> best = Method::rotate(a, previous);
  for (int k = 0; k < 9; ++k) batch.r[k * batch.count + i] = best.r.m[k];
  batch.flagged[i] = best.degenerate;
}

// CUTPROOF_KERNEL (launcher.h) by hand, because the macro takes no template arguments.
template <class Method, class Real>
struct rotate_matrices_kernel_object {
  static constexpr const char* kName = "rotate_matrices_kernel";
  static constexpr int kMaxThreads = 256;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const RotationBatch<Real>& batch) const {
    for (std::int64_t i = block.first(); i < batch.count; i += block.stride()) rotate_one<Method>(batch, i);
  }
};

// Calls visit(method) for each method that runs on a device.
template <class Visit>
void each_kernel_method(Visit visit) {
  visit(Jacobi4{});
  visit(Newton{});
  visit(Svd{});
  visit(Quest{});
  visit(Apd{});
  visit(Mueller{});
  visit(MuellerCold{});
  visit(McAdams{});
}

}  // namespace cutproof::benchmarks
