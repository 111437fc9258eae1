#include "benchmarks/rotation_methods.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <memory>

#include "benchmarks/rotation_kernel.cuh"
#include "benchmarks/times.h"
#include "gpu/host/host_launcher.h"
#include "reference_cpu/reference.h"

namespace cutproof::benchmarks {

namespace {

// Scaled and guarded like the kernels' methods, so that only the decomposition is compared.
struct EigenSvd {
  static constexpr const char* kName = "eigen_svd";
  template <class Real>
  static gpu::Rotation<Real> rotate(gpu::Matrix3x3<Real> a, const gpu::Matrix3x3<Real>& previous) {
    using Matrix = Eigen::Matrix<Real, 3, 3, Eigen::RowMajor>;
    if (!gpu::rotation_detail::scale_to_one(a)) return {previous, true};
    const Eigen::JacobiSVD<Matrix> svd(Eigen::Map<const Matrix>(a.m), Eigen::ComputeFullU | Eigen::ComputeFullV);
    Matrix u = svd.matrixU();
    if (u.determinant() * svd.matrixV().determinant() < 0) u.col(2) *= -1;
    gpu::Rotation<Real> result;
    Eigen::Map<Matrix>(result.r.m) = u * svd.matrixV().transpose();
    return result;
  }
};

// The CPU reference's method.
struct Horn {
  static constexpr const char* kName = "horn";
  static gpu::Rotation<double> rotate(const gpu::Matrix3x3<double>& a, const gpu::Matrix3x3<double>& previous) {
    Mat3 from, before;
    std::copy(a.m, a.m + 9, from.m.begin());
    std::copy(previous.m, previous.m + 9, before.m.begin());
    const reference::Rotation best = reference::closest_rotation(from, before);
    gpu::Rotation<double> result;
    std::copy(best.r.m.begin(), best.r.m.end(), result.r.m);
    result.degenerate = best.degenerate;
    return result;
  }
};

template <class Method, class Real>
RotationMethod on_cpu(const std::shared_ptr<gpu::HostLauncher>& launcher) {
  RotationMethod method;
  method.name = Method::kName;
  method.precision = sizeof(Real) == sizeof(float) ? Precision::binary32 : Precision::binary64;
  method.is_default = kIsDefault<Method, Real>;
  method.bytes = kRotationBytes<Real>;
  method.solve = [launcher](const std::vector<Mat3>& a, const std::vector<Mat3>& previous, int repeats) {
    const std::vector<Real> matrices = interleaved<Real>(a), before = interleaved<Real>(previous);
    std::vector<Real> r(matrices.size());
    TimedAnswers timed;
    timed.answers.flagged.resize(a.size());
    const RotationBatch<Real> batch = {matrices.data(), before.data(), r.data(), timed.answers.flagged.data(),
                                       static_cast<std::int64_t>(a.size())};
    const auto run = [&] {
      if (launcher) {
        launcher->items(rotate_matrices_kernel_object<Method, Real>{}, batch.count, batch);
      } else {
        for (std::int64_t i = 0; i < batch.count; ++i) rotate_one<Method>(batch, i);
      }
    };
    run();
    timed.seconds = seconds_of(repeats, run);
    timed.answers.r = separated(r);
    return timed;
  };
  return method;
}

}  // namespace

std::vector<RotationMethod> rotation_methods(const harness::BackendDescriptor& backend) {
  using harness::Processor;
#if CUTPROOF_HAS_CUDA
  if (backend.processor == Processor::device) return device_rotation_methods();
#endif
  std::shared_ptr<gpu::HostLauncher> launcher;
  if (backend.processor == Processor::all_threads) {
    launcher = std::make_shared<gpu::HostLauncher>(gpu::HostLauncher::Threads{harness::cpu_threads()});
  }
  std::vector<RotationMethod> methods;
  each_kernel_method([&]<class Method>(Method) {
    methods.push_back(on_cpu<Method, float>(launcher));
    methods.push_back(on_cpu<Method, double>(launcher));
  });
  methods.push_back(on_cpu<EigenSvd, float>(launcher));
  methods.push_back(on_cpu<EigenSvd, double>(launcher));
  methods.push_back(on_cpu<Horn, double>(launcher));
  return methods;
}

}  // namespace cutproof::benchmarks
