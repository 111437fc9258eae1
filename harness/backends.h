// Every backend described once: what it is called, what it can do, how it is made. Verbs, benchmarks, property tests
// and help texts follow from these descriptions and compare no names.
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

// What a verb takes if no backend is named: the reference, or the kernels on this machine's CPU.
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
  bool is_timed = true;          // else it only finds faults: what it takes says nothing
  bool is_another_path = false;  // another backend, whose kernels are started in another way, with the same bits
  bool pipelines = false;        // run() does not wait: frames can be handed over back to back
  bool runs_kernels = true;
  bool takes_schedule = false;  // --schedule, --schedule-seed: its interleaving is chosen and can be replayed

  // Benchmarks: whether bodies are as large as the paper's unless somebody asks for others, and how many frames are
  // timed.
  bool takes_full_size = false;
  int64_t timed_frames = 10;
  // Campaigns: how many bodies one load has at least, and particles, if that takes more bodies (0: that is the same);
  // how many loads at once keep it, or one of its devices, busy (0: as many as there are threads).
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
// What --devices says, "0,2" or "all"; empty: the first. Of a backend that needs none a list of one, which is nobody's
// device. Throws InputError, naming --devices, for what is no list, for a device that is not there or is named twice,
// and if a backend that needs none is given any.
std::vector<int> devices_of(const std::string& text, const BackendDescriptor& backend);

// Throws InputError, naming the option, for what does not exist or is not in this build; MachineError if there is no
// device.
std::unique_ptr<Backend> make_backend(const BackendChoice& choice);
// The same, whose schedule is written down as it is made (architecture.md, Schedules). Requires a backend that takes
// a schedule.
std::unique_ptr<Backend> make_recorded_backend(const BackendChoice& choice,
                                               std::shared_ptr<gpu::ThreadSchedule> record);
std::unique_ptr<Backend> make_replaying_backend(gpu::ThreadSchedule schedule);

// For one of many loads that run beside each other: each has a schedule of its own, whose kinds take turns; and one
// thread, because there are as many loads as threads.
BackendChoice choice_for_load(BackendChoice choice, int64_t load);

const std::vector<std::string>& schedule_names();
int cpu_threads();

}  // namespace cutproof::harness
