#include <cuda_runtime.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <map>
#include <type_traits>
#include <utility>

#include "gpu/backends.h"
#include "gpu/cuda_check.h"
#include "gpu/device_launcher.cuh"
#include "gpu/frame.h"
#include "gpu/image.h"

namespace cutproof::gpu {

namespace {

// The arrays of a World on the device.
class DeviceWorld {
 public:
  DeviceWorld() = default;
  explicit DeviceWorld(Image& image) {
    world_ = image.world();
    image.each(world_, [this](auto& vector, auto& pointer, bool) {
      using T = typename std::decay_t<decltype(vector)>::value_type;
      const std::size_t bytes = vector.size() * sizeof(T);
      void* memory = nullptr;
      // Never empty: a null pointer would be taken for an array that is not there.
      CUTPROOF_CUDA(cudaMalloc(&memory, bytes == 0 ? sizeof(T) : bytes));
      memory_.push_back(memory);
      pointer = static_cast<T*>(memory);
      CUTPROOF_CUDA(cudaMemcpy(memory, vector.data(), bytes, cudaMemcpyHostToDevice));
    });
  }
  ~DeviceWorld() {
    for (void* memory : memory_) static_cast<void>(cudaFree(memory));
  }
  DeviceWorld(DeviceWorld&& other) noexcept
      : world_(std::exchange(other.world_, {})), memory_(std::exchange(other.memory_, {})) {}
  DeviceWorld& operator=(DeviceWorld&& other) noexcept {
    std::swap(world_, other.world_);
    std::swap(memory_, other.memory_);
    return *this;
  }

  const World& world() const { return world_; }

  // Copies what belongs to the state into the image's vectors.
  void download(Image& image) const {
    World pointers = world_;
    image.each(pointers, [](auto& vector, auto& pointer, bool keep) {
      using T = typename std::decay_t<decltype(vector)>::value_type;
      if (!keep) return;
      CUTPROOF_CUDA(cudaMemcpy(vector.data(), pointer, vector.size() * sizeof(T), cudaMemcpyDeviceToHost));
    });
  }

 private:
  World world_;
  std::vector<void*> memory_;
};

class GpuBackend final : public Backend {
 public:
  explicit GpuBackend(KernelOptions options) : options_(options) {
    CUTPROOF_CUDA(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking));
    CUTPROOF_CUDA(cudaEventCreate(&begin_));
    for (cudaEvent_t& event : end_) CUTPROOF_CUDA(cudaEventCreate(&event));
    CUTPROOF_CUDA(cudaMallocHost(&counters_, kInFlight * sizeof(Counters)));
    for (std::size_t k = 0; k < kInFlight; ++k) counters_[k] = Counters{};
  }
  ~GpuBackend() override {
    static_cast<void>(cudaStreamSynchronize(stream_));
    graphs_.clear();
    static_cast<void>(cudaFreeHost(counters_));
    static_cast<void>(cudaEventDestroy(begin_));
    for (cudaEvent_t event : end_) static_cast<void>(cudaEventDestroy(event));
    static_cast<void>(cudaStreamDestroy(stream_));
  }
  GpuBackend(const GpuBackend&) = delete;
  GpuBackend& operator=(const GpuBackend&) = delete;

  std::string name() const override { return "gpu"; }
  double unit_roundoff() const override { return 0x1p-24; }
  bool can_run(Span) const override { return true; }

  void load(std::vector<Setup> setups, std::vector<State> states) override {
    load_with(Room{}, std::move(setups), std::move(states));
  }

  // Starts the span and returns. Whether more room is wanted is read from what the counters were kInFlight calls ago:
  // by then they have nearly always arrived, and the answer does not depend on how fast the device is, so two runs make
  // room at the same places and have the same bits.
  void run(Span span) override {
    if (runs_ >= kInFlight) {
      CUTPROOF_CUDA(cudaEventSynchronize(end_[slot()]));
      const Counters& then = counters_[slot()];
      require_no_fault(then);
      if (wants_room(device_.world(), then)) {
        std::vector<State> states = snapshot();
        load_with(Room{2 * room_.factor}, std::move(setups_), std::move(states));
      }
    }
    if (options_.eager) {
      DeviceLauncher launcher(stream_);
      CUTPROOF_CUDA(cudaEventRecord(begin_, stream_));
      enqueue_span(launcher, device_.world(), plan_, span, [](Stage) {});
      finish(span);
      CUTPROOF_CUDA(cudaStreamSynchronize(stream_));  // the launcher's temporary memory goes with it
      return;
    }
    const auto key = std::pair(static_cast<int>(span.first), static_cast<int>(span.last));
    auto found = graphs_.find(key);
    if (found == graphs_.end()) {
      DeviceGraph graph = DeviceLauncher::capture(
          [&](DeviceLauncher& launcher) { enqueue_span(launcher, device_.world(), plan_, span, [](Stage) {}); });
      found = graphs_.emplace(key, std::move(graph)).first;
    }
    CUTPROOF_CUDA(cudaEventRecord(begin_, stream_));
    found->second.launch(stream_);
    finish(span);
  }

  std::vector<State> snapshot() const override {
    wait();
    device_.download(image_);
    return extract_states(image_, setups_);
  }

  SpanReport report() const override {
    SpanReport report;
    if (runs_ == 0) return report;
    wait();
    for (std::size_t s = 0; s < 6; ++s) report.ran[s] = counters_[last()].stage_ran[s] != 0;
    float milliseconds = 0;
    CUTPROOF_CUDA(cudaEventElapsedTime(&milliseconds, begin_, end_[last()]));
    report.total_seconds = 1e-3 * milliseconds;
    if (span_.first == span_.last) report.seconds[static_cast<std::size_t>(span_.first)] = report.total_seconds;
    return report;
  }

 private:
  void load_with(Room room, std::vector<Setup> setups, std::vector<State> states) {
    CUTPROOF_CUDA(cudaStreamSynchronize(stream_));
    Image image = make_image(setups, states, options_.rotation_method, room);
    plan_ = make_plan(setups, states, options_.rotation_method, options_.split);
    graphs_.clear();
    device_ = DeviceWorld();  // gives the old memory back before the new is asked for
    device_ = DeviceWorld(image);
    image_ = std::move(image);
    setups_ = std::move(setups);
    runs_ = 0;
    room_ = room;
  }
  static constexpr std::size_t kInFlight = 4;
  std::size_t slot() const { return static_cast<std::size_t>(runs_ % kInFlight); }
  std::size_t last() const { return static_cast<std::size_t>((runs_ - 1) % kInFlight); }

  // The counters come back on their own.
  void finish(Span span) {
    CUTPROOF_CUDA(cudaMemcpyAsync(&counters_[slot()], device_.world().counters, sizeof(Counters),
                                  cudaMemcpyDeviceToHost, stream_));
    CUTPROOF_CUDA(cudaEventRecord(end_[slot()], stream_));
    ++runs_;
    span_ = span;
  }
  void wait() const {
    CUTPROOF_CUDA(cudaStreamSynchronize(stream_));
    if (runs_ > 0) require_no_fault(counters_[last()]);
  }

  KernelOptions options_;
  Room room_;
  cudaStream_t stream_ = nullptr;
  cudaEvent_t begin_ = nullptr;
  std::array<cudaEvent_t, kInFlight> end_ = {};
  Counters* counters_ = nullptr;  // [kInFlight] pinned; of the last runs, in turn
  uint64_t runs_ = 0;             // since the load
  Span span_;
  std::vector<Setup> setups_;
  mutable Image image_;  // host side of snapshots
  DeviceWorld device_;
  Plan plan_;
  std::map<std::pair<int, int>, DeviceGraph> graphs_;
};

}  // namespace

std::string device_description(std::string& why) {
  int count = 0;
  const cudaError_t status = cudaGetDeviceCount(&count);
  if (status != cudaSuccess || count == 0) {
    static_cast<void>(cudaGetLastError());
    why = status != cudaSuccess ? cudaGetErrorString(status) : "no CUDA device";
    return {};
  }
  cudaDeviceProp properties;
  CUTPROOF_CUDA(cudaGetDeviceProperties(&properties, 0));
  char text[512];
  std::snprintf(text, sizeof text, "%s, compute capability %d.%d, %.1f GiB", properties.name, properties.major,
                properties.minor, static_cast<double>(properties.totalGlobalMem) / (1 << 30));
  return text;
}

std::unique_ptr<Backend> make_gpu_backend(KernelOptions options) {
  std::string why;
  if (device_description(why).empty()) throw MachineError("the backend gpu finds no device: " + why);
  return std::make_unique<GpuBackend>(options);
}

}  // namespace cutproof::gpu
