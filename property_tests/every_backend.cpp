#include "property_tests/every_backend.h"

#include <cstdlib>

#include "gpu/backends.h"
#include "reference_cpu/reference.h"

namespace cutproof::property_tests {

int64_t number_from_environment(const char* name, int64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::stoll(text);
}

uint64_t wanted_seed() { return static_cast<uint64_t>(number_from_environment("CUTPROOF_SEED", 1)); }

void PrintTo(const NamedBackend& backend, std::ostream* os) { *os << backend.name; }

std::vector<NamedBackend> all_backends() {
  const auto with = [](gpu::SplitMethod split) {
    gpu::KernelOptions options;
    options.split = split;
    return options;
  };
  std::vector<NamedBackend> backends = {
      {"reference", reference::make_backend},
      {"host", [=] { return gpu::make_host_backend(2, with(gpu::SplitMethod::blocks)); }},
      {"host_global_labels", [=] { return gpu::make_host_backend(1, with(gpu::SplitMethod::global_labels)); }, 4},
      {"simulated_random", [] { return gpu::make_simulated_backend({gpu::random_walk(wanted_seed())}); }, 2, 35},
      {"simulated_pct", [] { return gpu::make_simulated_backend({gpu::pct(wanted_seed(), 3, 1'000'000)}); }, 2, 35},
      {"simulated_reverse",
       [=] { return gpu::make_simulated_backend({gpu::reverse()}, with(gpu::SplitMethod::global_labels)); }, 2, 35}};
#if CUTPROOF_HAS_CUDA
  std::string why;
  if (!gpu::device_description(why).empty()) {
    backends.push_back({"gpu", [=] { return gpu::make_gpu_backend(with(gpu::SplitMethod::blocks)); }});
    backends.push_back(
        {"gpu_global_labels", [=] { return gpu::make_gpu_backend(with(gpu::SplitMethod::global_labels)); }, 4});
  }
#endif
  return backends;
}

}  // namespace cutproof::property_tests
