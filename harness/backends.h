// Backends by name, for every command.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gpu/host/thread_schedule.h"
#include "model/backend.h"

namespace cutproof::cli {

struct BackendChoice {
  std::string name = "reference";   // `cutproof info` lists them
  std::string split;                // kernels: blocks or global; empty: blocks
  std::string rotation;             // kernels: how rotations are found; empty: KernelOptions' default
  std::string schedule = "random";  // simulated: one of schedule_names()
  uint64_t seed = 1;                // of the schedule
  int threads = 0;                  // host; 0: as many as the machine has
};

// Throws InputError, naming the option, for what does not exist, is not in this build, or says something about kernels
// to the reference; MachineError if there is no device.
std::unique_ptr<Backend> make_backend(const BackendChoice& choice);
// The same, whose schedule is written down as it is made (docs/oracles_and_tests.md §3); `simulated` only.
std::unique_ptr<Backend> make_recorded_backend(const BackendChoice& choice, std::shared_ptr<gpu::ThreadSchedule> record);
std::unique_ptr<Backend> make_replaying_backend(const BackendChoice& choice, gpu::ThreadSchedule schedule);

// By the number in gpu/state/device_view.h.
const std::vector<std::string>& rotation_names();
// The name of the rotation method that kernels will use.
std::string rotation_of(const BackendChoice& choice);
const std::vector<std::string>& schedule_names();
int cpu_threads();

}  // namespace cutproof::cli
