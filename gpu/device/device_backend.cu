#include <cuda_runtime.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <type_traits>
#include <utility>

#include "gpu/backends.h"
#include "gpu/device/cuda_check.h"
#include "gpu/device/cuda_handles.h"
#include "gpu/device/device_launcher.cuh"
#include "gpu/launch/frame.h"
#include "gpu/state/staging.h"

namespace cutproof::gpu {

namespace {

// The arrays of a DeviceView on the device.
class DeviceWorld {
 public:
  DeviceWorld() = default;
  explicit DeviceWorld(StagingBuffers& staging) {
    view_ = staging.view();
    staging.each(view_, [this](auto& vector, auto& pointer, bool) {
      using T = typename std::decay_t<decltype(vector)>::value_type;
      const std::size_t bytes = vector.size() * sizeof(T);
      // Never empty: a null pointer would be taken for an array that is not there.
      memory_.push_back(make_device_memory(bytes == 0 ? sizeof(T) : bytes));
      pointer = static_cast<T*>(memory_.back().get());
      CUTPROOF_CUDA(cudaMemcpy(pointer, vector.data(), bytes, cudaMemcpyHostToDevice));
    });
  }

  const DeviceView& view() const { return view_; }

  // Copies what belongs to the state into the staging's vectors.
  void download(StagingBuffers& staging) const {
    DeviceView pointers = view_;
    staging.each(pointers, [](auto& vector, auto& pointer, bool keep) {
      using T = typename std::decay_t<decltype(vector)>::value_type;
      if (!keep) return;
      CUTPROOF_CUDA(cudaMemcpy(vector.data(), pointer, vector.size() * sizeof(T), cudaMemcpyDeviceToHost));
    });
  }

 private:
  DeviceView view_;
  std::vector<DeviceMemory> memory_;
};

class GpuBackend final : public Backend {
 public:
  explicit GpuBackend(KernelOptions options) : options_(options) {
    for (Event& event : end_) event = make_event();
    std::uninitialized_fill_n(counters(), kInFlight, Counters{});
  }
  // Nothing is given back that the device still uses.
  ~GpuBackend() override { static_cast<void>(cudaStreamSynchronize(stream_.get())); }
  GpuBackend(const GpuBackend&) = delete;
  GpuBackend& operator=(const GpuBackend&) = delete;

  std::string name() const override { return "gpu"; }
  Precision precision() const override { return Precision::binary32; }
  bool can_run(Span) const override { return true; }

  void load(std::vector<Setup> setups, std::vector<State> states) override {
    load_with(Capacity{options_.room}, std::move(setups), std::move(states));
  }

  // Starts the span and returns. Whether more room is wanted is read from what the counters were kInFlight calls ago:
  // by then they have nearly always arrived, and the answer does not depend on how fast the device is, so two runs make
  // room at the same places and have the same bits.
  void run(Span span) override {
    if (span.contains(Stage::skin)) skins_.assign(setups_.size(), std::nullopt);
    if (runs_ >= kInFlight) {
      CUTPROOF_CUDA(cudaEventSynchronize(end_[slot()].get()));
      const Counters& then = counters()[slot()];
      require_no_fault(then);
      if (wants_capacity(device_.view(), then)) {
        std::vector<State> states = snapshot();
        load_with(Capacity{2 * capacity_.factor}, std::move(setups_), std::move(states));
      }
    }
    if (options_.eager) {
      DeviceLauncher launcher(stream_.get());
      CUTPROOF_CUDA(cudaEventRecord(begin_.get(), stream_.get()));
      enqueue_span(launcher, device_.view(), plan_, span, [](Stage) {});
      finish(span);
      CUTPROOF_CUDA(cudaStreamSynchronize(stream_.get()));  // the launcher's temporary memory goes with it
      return;
    }
    const auto key = std::pair(static_cast<int>(span.first), static_cast<int>(span.last));
    auto found = graphs_.find(key);
    if (found == graphs_.end()) {
      DeviceGraph graph = DeviceLauncher::capture(
          [&](DeviceLauncher& launcher) { enqueue_span(launcher, device_.view(), plan_, span, [](Stage) {}); });
      found = graphs_.emplace(key, std::move(graph)).first;
    }
    CUTPROOF_CUDA(cudaEventRecord(begin_.get(), stream_.get()));
    found->second.launch(stream_.get());
    finish(span);
  }

  std::vector<State> snapshot() const override { return snapshot_of(std::vector<bool>(setups_.size(), true)); }
  std::vector<State> snapshot_of(const std::vector<bool>& wanted) const override {
    wait();
    device_.download(staging_);
    return extract_states(staging_, setups_, wanted, skins_);
  }

  SpanReport report() const override {
    SpanReport report;
    if (runs_ == 0) return report;
    wait();
    for (std::size_t s = 0; s < 6; ++s) report.ran[s] = counters()[last()].stage_ran[s] != 0;
    float milliseconds = 0;
    CUTPROOF_CUDA(cudaEventElapsedTime(&milliseconds, begin_.get(), end_[last()].get()));
    report.total_seconds = 1e-3 * milliseconds;
    if (span_.first == span_.last) report.seconds[static_cast<std::size_t>(span_.first)] = report.total_seconds;
    return report;
  }

 private:
  void load_with(Capacity room, std::vector<Setup> setups, std::vector<State> states) {
    CUTPROOF_CUDA(cudaStreamSynchronize(stream_.get()));
    StagingBuffers staging = make_staging_buffers(setups, states, options_.rotation_method, room);
    plan_ = make_plan(setups, states, options_.rotation_method, options_.split);
    graphs_.clear();
    device_ = DeviceWorld();  // gives the old memory back before the new is asked for
    device_ = DeviceWorld(staging);
    staging_ = std::move(staging);
    setups_ = std::move(setups);
    skins_.assign(setups_.size(), std::nullopt);
    runs_ = 0;
    capacity_ = room;
  }
  static constexpr std::size_t kInFlight = 4;
  std::size_t slot() const { return static_cast<std::size_t>(runs_ % kInFlight); }
  std::size_t last() const { return static_cast<std::size_t>((runs_ - 1) % kInFlight); }

  // [kInFlight] of the last runs, in turn.
  Counters* counters() const { return static_cast<Counters*>(counters_.get()); }

  // The counters come back on their own.
  void finish(Span span) {
    CUTPROOF_CUDA(cudaMemcpyAsync(&counters()[slot()], device_.view().counters, sizeof(Counters),
                                  cudaMemcpyDeviceToHost, stream_.get()));
    CUTPROOF_CUDA(cudaEventRecord(end_[slot()].get(), stream_.get()));
    ++runs_;
    span_ = span;
  }
  void wait() const {
    CUTPROOF_CUDA(cudaStreamSynchronize(stream_.get()));
    if (runs_ > 0) require_no_fault(counters()[last()]);
  }

  KernelOptions options_;
  Capacity capacity_;
  Stream stream_ = make_stream();
  Event begin_ = make_event();
  std::array<Event, kInFlight> end_;
  PinnedMemory counters_ = make_pinned_memory(kInFlight * sizeof(Counters));
  uint64_t runs_ = 0;  // since the load
  Span span_;
  std::vector<Setup> setups_;
  mutable StagingBuffers staging_;  // host side of snapshots
  mutable KnownSkins skins_;        // of the last skin stage, as far as snapshots have asked for them
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
    why = status != cudaSuccess ? std::string("cudaGetDeviceCount says: ") + cudaGetErrorString(status)
                                : "no CUDA device";
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
