// The list of all backends: name, abilities and factory. Subcommands, benchmarks, property tests and help texts use
// these descriptions and compare no names.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gpu/host/thread_schedule.h"
#include "model/backend.h"

namespace cutproof::harness {

// The default backend of a subcommand: the reference, or the kernels on this machine's CPU.
inline constexpr const char* kReferenceName = "reference";
inline constexpr const char* kHostName = "host";

struct BackendChoice {
  std::string name = kReferenceName;
  std::string schedule = "random";  // of backends that take one: one of schedule_names()
  uint64_t seed = 1;                // of the schedule
  int threads = 0;                  // of backends that use all threads; 0: as many as the machine has
  int device = 0;                   // of backends that need one
};

enum class Processor { one_thread, all_threads, device };

struct BackendDescriptor {
  std::string_view name;
  std::string_view summary;  // one line for people
  Precision precision = Precision::binary32;
  // All others are compared with it; it is not compared with itself.
  bool is_the_reference = false;
  Processor processor = Processor::one_thread;
  bool is_timed = true;          // else the backend only finds faults: its times mean nothing
  bool is_another_path = false;  // another backend that starts these kernels in another way, with the same bits
  bool pipelines = false;        // run() does not wait: frames can be handed over back to back
  bool runs_kernels = true;
  bool takes_schedule = false;  // --schedule, --schedule-seed: its interleaving is chosen and can be replayed

  // Benchmarks: whether bodies have the paper's sizes by default, and the number of timed frames.
  bool takes_full_size = false;
  int64_t timed_frames = 10;
  // Campaigns: least number of bodies in a batch, and of particles, if that takes more bodies (0: no limit); number of
  // concurrent batches that keep the backend, or one of its devices, busy (0: one for each thread).
  int bodies_in_a_load = 64;
  int64_t particles_in_a_load = 0;
  int most_parallel_loads = 0;

  // Null where this build does not have it.
  std::unique_ptr<Backend> (*make)(const BackendChoice& choice) = nullptr;

  bool needs_device() const { return processor == Processor::device; }
  bool is_built() const { return make != nullptr; }
};

// In the order in which people read about them; also those that this build does not have.
std::span<const BackendDescriptor> backends();
// Null if there is none of that name. A plugin's is "plugin:FILE.so" (guests/plugin_backend.h); whether there is such a
// file shows when it is made.
const BackendDescriptor* find_backend(std::string_view name);
// Throws InputError, naming --backend, if there is none of that name.
const BackendDescriptor& described_backend(std::string_view name);
const BackendDescriptor& reference_backend();

// "reference, host, …": those of which `wanted` holds.
std::string backend_names(const std::function<bool(const BackendDescriptor&)>& wanted = {});
// Summary, device, or why it is not there: for `cutproof info`. Does not throw.
std::string description_of(const BackendDescriptor& backend);
// The processor and how many of its threads work, or the CUDA device; empty if that is not there.
std::string processor_of(const BackendDescriptor& backend, int device = 0);
// Devices named by --devices, "0,2" or "all"; empty: the first. A backend without devices has a list of one
// placeholder. Throws InputError, naming --devices, for a malformed list, for a device that does not exist or is named
// twice, and for devices of a backend that has none.
std::vector<int> devices_of(const std::string& text, const BackendDescriptor& backend);

// Throws InputError, naming the option, for a backend that does not exist or is not in this build; MachineError if
// there is no device.
std::unique_ptr<Backend> make_backend(const BackendChoice& choice);
// The same, with a record of the schedule's decisions (architecture.md, Schedules). Requires a backend that takes a
// schedule.
std::unique_ptr<Backend> make_recorded_backend(const BackendChoice& choice,
                                               std::shared_ptr<gpu::ThreadSchedule> record);
std::unique_ptr<Backend> make_replaying_backend(gpu::ThreadSchedule schedule);

// For one of many concurrent batches. Each batch has its own schedule, whose kinds alternate, and one thread, because
// there are as many batches as threads.
BackendChoice choice_for_load(BackendChoice choice, int64_t load);

const std::vector<std::string>& schedule_names();
int cpu_threads();

}  // namespace cutproof::harness
