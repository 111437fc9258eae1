#include <cuda_runtime.h>

#include "benchmarks/rotation_kernel.cuh"
#include "benchmarks/rotation_methods.h"
#include "gpu/device/cuda_check.h"
#include "gpu/device/cuda_handles.h"
#include "gpu/device/device_launcher.cuh"
#include "harness/backends.h"

namespace cutproof::benchmarks {

namespace {

template <class T>
gpu::DeviceMemory uploaded(const std::vector<T>& values) {
  gpu::DeviceMemory memory = gpu::make_device_memory(std::max<std::size_t>(values.size(), 1) * sizeof(T));
  CUTPROOF_CUDA(cudaMemcpy(memory.get(), values.data(), values.size() * sizeof(T), cudaMemcpyHostToDevice));
  gpu::wait_for_copies();
  return memory;
}
template <class T>
void download(const gpu::DeviceMemory& memory, std::vector<T>& values) {
  CUTPROOF_CUDA(cudaMemcpy(values.data(), memory.get(), values.size() * sizeof(T), cudaMemcpyDeviceToHost));
}

template <class Method, class Real>
TimedAnswers solve_on_device(const std::vector<Mat3>& a, const std::vector<Mat3>& previous, int repeats) {
  TimedAnswers timed;
  timed.answers.flagged.resize(a.size());
  std::vector<Real> r(9 * a.size());
  const gpu::DeviceMemory matrices = uploaded(interleaved<Real>(a)), before = uploaded(interleaved<Real>(previous)),
                          out = uploaded(r), flagged = uploaded(timed.answers.flagged);
  const RotationBatch<Real> batch = {static_cast<const Real*>(matrices.get()), static_cast<const Real*>(before.get()),
                                     static_cast<Real*>(out.get()), static_cast<unsigned char*>(flagged.get()),
                                     static_cast<std::int64_t>(a.size())};
  const gpu::Stream stream = gpu::make_stream();
  const gpu::Event begin = gpu::make_event(), end = gpu::make_event();
  gpu::DeviceLauncher launcher(stream.get());
  CUTPROOF_CUDA(cudaDeviceSynchronize());  // completes the copies above
  for (int turn = -1; turn < repeats; ++turn) {
    CUTPROOF_CUDA(cudaEventRecord(begin.get(), stream.get()));
    launcher.items(rotate_matrices_kernel_object<Method, Real>{}, batch.count, batch);
    CUTPROOF_CUDA(cudaEventRecord(end.get(), stream.get()));
    CUTPROOF_CUDA(cudaEventSynchronize(end.get()));
    float milliseconds = 0;
    CUTPROOF_CUDA(cudaEventElapsedTime(&milliseconds, begin.get(), end.get()));
    if (turn >= 0) timed.seconds.push_back(1e-3 * static_cast<double>(milliseconds));
  }
  download(out, r);
  download(flagged, timed.answers.flagged);
  timed.answers.r = separated(r);
  return timed;
}

}  // namespace

std::vector<RotationMethod> device_rotation_methods() {
  std::vector<RotationMethod> methods;
  each_kernel_method([&]<class Method>(Method) {
    methods.push_back({Method::kName, Precision::binary32, kIsDefault<Method, float>, kRotationBytes<float>,
                       solve_on_device<Method, float>});
    methods.push_back({Method::kName, Precision::binary64, kIsDefault<Method, double>, kRotationBytes<double>,
                       solve_on_device<Method, double>});
  });
  return methods;
}

}  // namespace cutproof::benchmarks
