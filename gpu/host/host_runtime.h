// gpu/host: executes kernels on the host. The threads of a block are stackful fibres (fibre.h). Blocks are distributed
// over operating-system threads (worker.h) or, simulated, interleaved on one under a schedule (thread_schedule.h).
// Kernels see only HostBlock (host_block.h); HostLauncher (host_launcher.h) makes launches.
//
// Order of execution: a thread of a block runs until it waits at a barrier or collective, or ends; then the lowest
// runnable one does. A thread that never waits costs no fibre switch. Simulated: at every atomic, load and store
// another thread of any live block may continue instead. Memory is sequentially consistent, and plain accesses are no
// such points.
#pragma once
#include <memory>
#include <vector>

#include "gpu/host/thread_schedule.h"
#include "gpu/host/worker.h"

namespace cutproof::gpu {

// All workers of a launcher.
class HostRuntime {
 public:
  // Requires threads >= 1. Throws MachineError if the system refuses a thread.
  explicit HostRuntime(int threads);
  explicit HostRuntime(SimulationOptions simulation);
  ~HostRuntime();

  bool simulated() const { return simulation_ != nullptr; }
  // Executes the launch. Rethrows a kernel's exception, of several that of the lowest block.
  void run(const Job& job);
  const ThreadSchedule& recorded() const { return recorded_; }
  // A decision between launches: which of `count` continues, `current` being the last one. Requires simulated().
  int choose(int count, int current);
  // Continues under another schedule, with an empty record. Requires simulated().
  void reschedule(Generator schedule);

 private:
  struct Pool;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::unique_ptr<Pool> pool_;
  std::unique_ptr<SimulationOptions> simulation_;
  ThreadSchedule recorded_;
};

}  // namespace cutproof::gpu
