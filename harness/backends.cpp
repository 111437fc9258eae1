#include "harness/backends.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <string_view>
#include <thread>
#include <vector>

#include "gpu/backends.h"
#include "guests/plugin_backend.h"
#include "model/at.h"
#include "model/error.h"
#include "model/nearest_word.h"
#include "reference_cpu/reference.h"

namespace cutproof::harness {

namespace {

// Number of decisions over which PCT spreads preemptions: about those of a frame of a small body.
constexpr int kPctDepth = 3;
constexpr std::int64_t kPctLength = 100'000;
// Scenes of some ten thousand particles have launches with more decisions than the default budget allows.
constexpr std::int64_t kStepBudget = 5'000'000'000;

[[noreturn]] void refuse(const std::string& option, const std::string& problem, const std::string& remedy) {
  throw InputError("command line", option, problem, remedy);
}

gpu::Generator generator(const BackendChoice& choice) {
  if (choice.schedule == "random") return gpu::random_walk(choice.seed);
  if (choice.schedule == "pct") return gpu::pct(choice.seed, kPctDepth, kPctLength);
  if (choice.schedule == "forward") return gpu::forward();
  if (choice.schedule == "reverse") return gpu::reverse();
  if (choice.schedule == "round_robin") return gpu::round_robin();
  refuse("--schedule", fmt::format("there is no schedule '{}'", choice.schedule),
         fmt::format("use one of {}", fmt::join(schedule_names(), ", ")));
}

std::unique_ptr<Backend> make_simulated(gpu::Generator schedule) {
  gpu::HostLauncher::Simulated simulation;
  simulation.schedule = std::move(schedule);
  simulation.step_budget = kStepBudget;
  return gpu::make_simulated_backend(std::move(simulation));
}

#if CUTPROOF_HAS_CUDA
template <gpu::Path path>
std::unique_ptr<Backend> make_gpu(const BackendChoice& choice) {
  gpu::KernelOptions options;
  options.path = path;
  options.device = choice.device;
  return gpu::make_gpu_backend(options);
}
#else
template <gpu::Path>
constexpr std::unique_ptr<Backend> (*make_gpu)(const BackendChoice&) = nullptr;
#endif

template <int of_block = 1>
std::unique_ptr<Backend> make_host(const BackendChoice& choice) {
  return gpu::make_host_backend(choice.threads > 0 ? choice.threads : cpu_threads(), {}, of_block);
}

// Several, so that kernels see more than one body; few, so that their data stay in the caches.
constexpr int kBodiesOnTheHost = 4;
// Work before and after kernels is done once for a whole batch.
constexpr int64_t kParticlesOnADevice = 50'000;

// No strings that allocate: this table is there before main() and where there is no memory.
constexpr std::array kBackends = {
    BackendDescriptor{
        .name = kReferenceName,
        .summary = "CPU, double precision, serial: the reference of all comparisons",
        .precision = Precision::binary64,
        .is_the_reference = true,
        .runs_kernels = false,
        // Bodies run one by one, and the data of a few stay in the caches.
        .bodies_in_a_load = 16,
        .make = [](const BackendChoice&) { return reference::make_backend(); },
    },
    BackendDescriptor{
        .name = kHostName,
        .summary = "the CUDA kernels, compiled for the threads of this CPU, single precision",
        .processor = Processor::all_threads,
        .bodies_in_a_load = kBodiesOnTheHost,
        .make = make_host<>,
    },
    BackendDescriptor{
        .name = "host-blocks",
        .summary = "as host, in blocks of 32 threads: slower; finds violations of the rules of a block",
        .processor = Processor::all_threads,
        .is_timed = false,
        .is_another_path = true,
        .bodies_in_a_load = kBodiesOnTheHost,
        .make = make_host<gpu::kHostThreads>,
    },
    BackendDescriptor{
        .name = "simulated",
        .summary = "as host, on one thread, under a chosen schedule that can be replayed",
        .is_timed = false,
        .takes_schedule = true,
        .make = [](const BackendChoice& choice) { return make_simulated(generator(choice)); },
    },
    BackendDescriptor{
        .name = "gpu",
        .summary = "the CUDA kernels, single precision",
        .processor = Processor::device,
        .pipelines = true,
        .takes_full_size = true,
        .timed_frames = 20,
        .particles_in_a_load = kParticlesOnADevice,
        // This number of concurrent batches keeps the device busy; more only take memory.
        .most_parallel_loads = 6,
        .make = make_gpu<gpu::Path::graph>,
    },
    BackendDescriptor{
        .name = "gpu-eager",
        .summary = "as gpu, kernel by kernel",
        .processor = Processor::device,
        .is_timed = false,
        .is_another_path = true,
        .particles_in_a_load = kParticlesOnADevice,
        .most_parallel_loads = 6,
        .make = make_gpu<gpu::Path::eager>,
    },
};

std::string cpu_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const std::size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "CPU";
}

// Empty if there is no such device, and then `why` says why.
std::string device_name([[maybe_unused]] std::string& why, [[maybe_unused]] int device = 0) {
#if CUTPROOF_HAS_CUDA
  return gpu::device_description(why, device);
#else
  return {};
#endif
}
int device_count([[maybe_unused]] std::string& why) {
#if CUTPROOF_HAS_CUDA
  return gpu::device_count(why);
#else
  return 0;
#endif
}

constexpr const char* kToolkitWanted = "no CUDA toolkit of version 12.4 or newer was found";

void require_built(const BackendDescriptor& backend) {
  if (backend.is_built()) return;
  refuse("--backend", "this cutproof was built without CUDA",
         "build it where a CUDA toolkit of version 12.4 or newer is installed");
}

}  // namespace

std::span<const BackendDescriptor> backends() { return kBackends; }

namespace {

// Of a plugin that is named on the command line; where there is none, making it says so.
const BackendDescriptor* describe_plugin(std::string_view name) {
  static std::mutex guard;
  static std::map<std::string, BackendDescriptor, std::less<>> known;
  const std::lock_guard lock(guard);
  const auto [place, is_new] = known.try_emplace(std::string(name));
  if (is_new) {
    place->second.name = place->first;
    place->second.summary = "a plugin";
    place->second.runs_kernels = false;
    place->second.bodies_in_a_load = 16;
    place->second.make = [](const BackendChoice& choice) { return guests::make_plugin_backend(choice.name); };
  }
  return &place->second;
}

}  // namespace

const BackendDescriptor* find_backend(std::string_view name) {
  if (name.starts_with(guests::kPluginPrefix)) return describe_plugin(name);
  const auto found = std::find_if(kBackends.begin(), kBackends.end(), [&](const auto& b) { return b.name == name; });
  return found == kBackends.end() ? nullptr : &*found;
}

const BackendDescriptor& described_backend(std::string_view name) {
  const BackendDescriptor* const found = find_backend(name);
  if (found == nullptr) {
    std::vector<std::string_view> names;
    for (const BackendDescriptor& backend : kBackends) names.push_back(backend.name);
    refuse("--backend", fmt::format("there is no backend '{}'", name),
           did_you_mean(name, names) +
               fmt::format("use one of those that `cutproof info` lists: {}; or plugin:FILE.so", backend_names()));
  }
  return *found;
}

const BackendDescriptor& reference_backend() { return *find_backend(kReferenceName); }

std::string backend_names(const std::function<bool(const BackendDescriptor&)>& wanted) {
  std::vector<std::string_view> names;
  for (const BackendDescriptor& backend : kBackends) {
    if (!wanted || wanted(backend)) names.push_back(backend.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string description_of(const BackendDescriptor& backend) {
  if (!backend.is_built()) return fmt::format("not built: {}", kToolkitWanted);
  if (!backend.needs_device()) return std::string(backend.summary);
  std::string why;
  const std::string device = device_name(why);
  return fmt::format("{}; device: {}", backend.summary, device.empty() ? "none (" + why + ")" : device);
}

std::string processor_of(const BackendDescriptor& backend, int device) {
  switch (backend.processor) {
    case Processor::one_thread:
      return cpu_name() + ", 1 thread";
    case Processor::all_threads:
      return fmt::format("{}, {} threads", cpu_name(), cpu_threads());
    case Processor::device: {
      std::string why;
      return device_name(why, device);
    }
  }
  return {};
}

std::vector<int> devices_of(const std::string& text, const BackendDescriptor& backend) {
  if (text.empty()) return {0};
  if (!backend.needs_device()) {
    refuse("--devices", fmt::format("the backend {} runs on no device", backend.name),
           "leave it out, or name a backend that does: " +
               backend_names([](const BackendDescriptor& b) { return b.needs_device(); }));
  }
  require_built(backend);
  std::string why;
  const int count = device_count(why);
  if (count == 0) throw MachineError(fmt::format("the backend {} finds no device: {}", backend.name, why));
  std::vector<int> devices;
  if (text == "all") {
    for (int device = 0; device < count; ++device) devices.push_back(device);
    return devices;
  }
  const std::string remedy =
      count == 1 ? "use 0, or all" : fmt::format("use some of 0 to {}, such as 0,1, or all", count - 1);
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string number = text.substr(begin, end - begin);
    begin = end + 1;
    if (number.empty() || number.size() > 4 || number.find_first_not_of("0123456789") != std::string::npos) {
      refuse("--devices", fmt::format("'{}' is not a list of devices", text), remedy);
    }
    const int device = std::stoi(number);
    if (device >= count) refuse("--devices", fmt::format("there is no device {}", device), remedy);
    if (std::find(devices.begin(), devices.end(), device) != devices.end()) {
      refuse("--devices", fmt::format("device {} is named twice", device), remedy);
    }
    devices.push_back(device);
  }
  return devices;
}

std::unique_ptr<Backend> make_backend(const BackendChoice& choice) {
  const BackendDescriptor& backend = described_backend(choice.name);
  require_built(backend);
  return backend.make(choice);
}

std::unique_ptr<Backend> make_recorded_backend(const BackendChoice& choice,
                                               std::shared_ptr<gpu::ThreadSchedule> record) {
  return make_simulated([inner = generator(choice), record](const gpu::Candidates& candidates) {
    const int thread = inner(candidates);
    record->push_back(static_cast<std::uint16_t>(candidates.rank(thread)));
    return thread;
  });
}

std::unique_ptr<Backend> make_replaying_backend(gpu::ThreadSchedule schedule) {
  return make_simulated(gpu::replay(std::move(schedule)));
}

BackendChoice choice_for_load(BackendChoice choice, int64_t load) {
  const BackendDescriptor& backend = described_backend(choice.name);
  if (backend.processor == Processor::all_threads) choice.threads = 1;
  if (backend.takes_schedule) {
    static const std::array<const char*, 4> kinds = {"random", "pct", "reverse", "round_robin"};
    choice.schedule = kinds[static_cast<std::size_t>(load) % kinds.size()];
    choice.seed += static_cast<uint64_t>(load);
  }
  return choice;
}

const std::vector<std::string>& schedule_names() {
  static const std::vector<std::string> names = {"forward", "reverse", "round_robin", "random", "pct"};
  return names;
}

int cpu_threads() { return static_cast<int>(std::max(1u, std::thread::hardware_concurrency())); }

}  // namespace cutproof::harness
