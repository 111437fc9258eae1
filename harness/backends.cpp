#include "harness/backends.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <thread>

#include "gpu/backends.h"
#include "model/error.h"
#include "reference_cpu/reference.h"

namespace cutproof::cli {

namespace {

// Preemptions that PCT spreads over so many decisions: about what a frame of a small body has.
constexpr int kPctDepth = 3;
constexpr std::int64_t kPctLength = 100'000;
// Scenes of some ten thousand particles have launches with more decisions than the default budget allows.
constexpr std::int64_t kStepBudget = 5'000'000'000;

[[noreturn]] void refuse(const std::string& option, const std::string& problem, const std::string& remedy) {
  throw InputError("command line", option, problem, remedy);
}

gpu::KernelOptions kernel_options(const BackendChoice& choice) {
  gpu::KernelOptions options;
  if (choice.split == "global") {
    options.split = gpu::SplitMethod::global_labels;
  } else if (!choice.split.empty() && choice.split != "blocks") {
    refuse("--split", fmt::format("there is no split method '{}'", choice.split), "use blocks or global");
  }
  if (!choice.rotation.empty()) {
    const auto found = std::find(rotation_names().begin(), rotation_names().end(), choice.rotation);
    if (found == rotation_names().end()) {
      refuse("--rotation", fmt::format("there is no rotation method '{}'", choice.rotation),
             fmt::format("use one of {}", fmt::join(rotation_names(), ", ")));
    }
    options.rotation_method = static_cast<int>(found - rotation_names().begin());
  }
  return options;
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

std::unique_ptr<Backend> make_simulated(gpu::Generator schedule, const BackendChoice& choice) {
  gpu::HostLauncher::Simulated simulation;
  simulation.schedule = std::move(schedule);
  simulation.step_budget = kStepBudget;
  return gpu::make_simulated_backend(std::move(simulation), kernel_options(choice));
}

}  // namespace

const std::vector<std::string>& rotation_names() {
  static const std::vector<std::string> names = {"jacobi4", "mueller", "apd", "svd", "quest", "newton"};
  return names;
}

const std::vector<std::string>& schedule_names() {
  static const std::vector<std::string> names = {"forward", "reverse", "round_robin", "random", "pct"};
  return names;
}

int cpu_threads() { return static_cast<int>(std::max(1u, std::thread::hardware_concurrency())); }

std::string rotation_of(const BackendChoice& choice) {
  return rotation_names()[static_cast<std::size_t>(kernel_options(choice).rotation_method)];
}

std::unique_ptr<Backend> make_backend(const BackendChoice& choice) {
  if (choice.name == "reference") {
    if (!choice.split.empty() || !choice.rotation.empty()) {
      refuse(choice.split.empty() ? "--rotation" : "--split", "the reference has one way only",
             "leave it out, or choose --backend host or gpu");
    }
    return reference::make_backend();
  }
  if (choice.name == "host") {
    return gpu::make_host_backend(choice.threads > 0 ? choice.threads : cpu_threads(), kernel_options(choice));
  }
  if (choice.name == "simulated") return make_simulated(generator(choice), choice);
  if (choice.name == "gpu" || choice.name == "gpu-eager") {
#if CUTPROOF_HAS_CUDA
    gpu::KernelOptions options = kernel_options(choice);
    options.eager = choice.name == "gpu-eager";
    return gpu::make_gpu_backend(options);
#else
    refuse("--backend", "this cutproof was built without CUDA",
           "build it where a CUDA toolkit of version 12.4 or newer is installed");
#endif
  }
  refuse("--backend", fmt::format("there is no backend '{}'", choice.name),
         "use one of those that `cutproof info` lists: reference, host, simulated, gpu, gpu-eager");
}

std::unique_ptr<Backend> make_recorded_backend(const BackendChoice& choice, std::shared_ptr<gpu::ThreadSchedule> record) {
  return make_simulated(
      [inner = generator(choice), record](const gpu::Candidates& candidates) {
        const int thread = inner(candidates);
        record->push_back(static_cast<std::uint16_t>(candidates.rank(thread)));
        return thread;
      },
      choice);
}

std::unique_ptr<Backend> make_replaying_backend(const BackendChoice& choice, gpu::ThreadSchedule schedule) {
  return make_simulated(gpu::replay(std::move(schedule)), choice);
}

}  // namespace cutproof::cli
