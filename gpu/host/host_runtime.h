// gpu/host: how the host executes kernels. The threads of a block are stackful fibres (fibre.h), blocks are spread over
// operating-system threads (worker.h) or, simulated, interleaved on one under a schedule (thread_schedule.h). Nothing
// here is seen by kernels; they see HostBlock (host_block.h). Launches are made by HostLauncher (host_launcher.h).
//
// Order of execution, threads: a thread of a block runs until it waits at a barrier or collective, or ends; then the
// lowest that can run does. A thread that never waits costs no fibre switch. Simulated: every atomic, load and store is
// a point at which another thread of any live block may go on instead; memory is sequentially consistent, and plain
// accesses are not such points.
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
  // Carries out the launch. Rethrows what a kernel threw; of several failures that of the lowest block.
  void run(const Job& job);
  const ThreadSchedule& recorded() const { return recorded_; }
  // A decision between launches: which of `count` goes on, `current` being what went last. Requires simulated().
  int choose(int count, int current);
  // Goes on under another schedule, with nothing recorded. Requires simulated().
  void reschedule(Generator schedule);

 private:
  struct Pool;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::unique_ptr<Pool> pool_;
  std::unique_ptr<SimulationOptions> simulation_;
  ThreadSchedule recorded_;
};

}  // namespace cutproof::gpu
