// The backends that run the kernels: `host` on any CPU, `gpu` on a CUDA device in builds with a toolkit. Both keep the
// contract of model/backend.h.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "gpu/host/host_launcher.h"
#include "gpu/load.h"
#include "model/backend.h"

namespace cutproof::gpu {

class KernelBackend : public Backend {
 public:
  // Of all bodies together. Waits for the last span, which must have been the step alone.
  virtual StepWork step_work() const = 0;
};

// Kernels on `threads` CPU threads. `of_block`: threads of a block (HostLauncher::Threads); all give the same bits. 1
// is quick, kHostThreads checks that kernels keep the rules of block.h.
std::unique_ptr<Backend> make_host_backend(int threads = 1, KernelOptions options = {}, int of_block = 1);
// Kernels under a simulated schedule (thread_schedule.h).
std::unique_ptr<Backend> make_simulated_backend(HostLauncher::Simulated simulation, KernelOptions options = {});

#if CUTPROOF_HAS_CUDA
// Number of devices; if there is none, `why` says why.
int device_count(std::string& why);
// A device, e.g. "NVIDIA H200, compute capability 9.0, 139.8 GiB". Empty if there is none of this number; `why` then
// says why.
std::string device_description(std::string& why, int device = 0);
// State lives on the device of the options. run() does not wait for it; snapshot() and report() do. Each call makes it
// the calling thread's current device.
std::unique_ptr<Backend> make_gpu_backend(KernelOptions options = {});
#endif

}  // namespace cutproof::gpu
