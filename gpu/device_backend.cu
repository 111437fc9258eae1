#include <cuda_runtime.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <map>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "gpu/backends.h"
#include "gpu/device/cuda_check.h"
#include "gpu/device/cuda_handles.h"
#include "gpu/device/device_launcher.cuh"
#include "gpu/frame.h"

namespace cutproof::gpu {

namespace {

// Host memory to which the device copies on its own. It grows and never shrinks, because allocating it takes long.
class LandingPlace {
 public:
  // Copies of large arrays are fast without it.
  static constexpr std::size_t kMost = std::size_t{64} << 20;
  std::byte* at_least(std::size_t bytes) {
    if (bytes > bytes_) {
      memory_.reset();
      bytes_ = 0;
      memory_ = make_pinned_memory(bytes + bytes / 2);
      bytes_ = bytes + bytes / 2;
    }
    return static_cast<std::byte*>(memory_.get());
  }

 private:
  PinnedMemory memory_;
  std::size_t bytes_ = 0;
};

// The arrays of a DeviceView on the device.
class DeviceArrays {
 public:
  DeviceArrays() = default;
  // contents: arrays as long as a load fills them.
  DeviceArrays(StagingBuffers& contents, const KernelOptions& options) {
    const OnDemand& where = options.on_demand;
    const bool on_demand = has_memory_on_demand() && empty_bytes(contents, where.array) >= where.room;
    view_ = contents.view();
    contents.each(view_, [&](const auto& array, auto& vector, auto& pointer) {
      using Element = std::remove_reference_t<decltype(*pointer)>;
      const auto extent = static_cast<std::size_t>(array.extent);
      if (array.unset) vector.resize(extent, *array.unset);
      const std::size_t bytes = extent * sizeof(Element);
      const std::size_t loaded = std::min(extent, vector.size()) * sizeof(Element);
      if (on_demand && bytes >= where.array && loaded < bytes) {
        memory_.push_back(make_device_memory_on_demand(bytes, loaded));
      } else {
        // Never empty: a null pointer means an absent array.
        memory_.push_back(make_device_memory(std::max(bytes, sizeof(Element))));
      }
      pointer = static_cast<Element*>(memory_.back().get());
      if (options.fill) CUTPROOF_CUDA(cudaMemset(pointer, *options.fill, bytes));
      CUTPROOF_CUDA(cudaMemcpy(pointer, vector.data(), loaded, cudaMemcpyHostToDevice));
    });
    wait_for_copies();
  }

  const DeviceView& view() const { return view_; }

  // Copies the used part of the state into the staging's vectors. `counters`: those of the device. Copies follow the
  // stream's work, and the call waits once for all of them.
  void download(StagingBuffers& staging, const Counters& counters, cudaStream_t stream, LandingPlace& landing) const {
    static_cast<Extents&>(staging) = in_use(view_, counters);
    DeviceView pointers = view_;
    const auto each_array = [&](const auto& use) {
      std::size_t begin = 0;
      staging.each(pointers, [&](const auto& array, auto& vector, auto& pointer) {
        if (array.lifetime != Lifetime::state) return;
        const std::size_t bytes = static_cast<std::size_t>(array.extent) * sizeof(*pointer);
        use(vector, pointer, begin, bytes);
        begin += (bytes + 15) / 16 * 16;
      });
      return begin;
    };
    const std::size_t all = each_array(
        [](auto& vector, auto& pointer, std::size_t, std::size_t bytes) { vector.resize(bytes / sizeof(*pointer)); });
    std::byte* const landed = all <= LandingPlace::kMost ? landing.at_least(all) : nullptr;
    each_array([&](auto& vector, auto& pointer, std::size_t begin, std::size_t bytes) {
      void* const to = landed != nullptr ? static_cast<void*>(landed + begin) : vector.data();
      if (bytes > 0) CUTPROOF_CUDA(cudaMemcpyAsync(to, pointer, bytes, cudaMemcpyDeviceToHost, stream));
    });
    CUTPROOF_CUDA(cudaStreamSynchronize(stream));
    if (landed == nullptr) return;
    each_array([&](auto& vector, auto&, std::size_t begin, std::size_t bytes) {
      if (bytes > 0) std::memcpy(vector.data(), landed + begin, bytes);
    });
  }

 private:
  DeviceView view_;
  std::vector<DeviceMemory> memory_;
};

class GpuBackend final : public KernelBackend {
 public:
  explicit GpuBackend(KernelOptions options) : options_(in_use(options)) {
    for (Event& event : end_) event = make_event();
    std::uninitialized_fill_n(counters(), kInFlight, Counters{});
  }
  // Nothing is freed while the device uses it.
  ~GpuBackend() override {
    static_cast<void>(cudaSetDevice(options_.device));
    static_cast<void>(cudaStreamSynchronize(stream_.get()));
  }
  GpuBackend(const GpuBackend&) = delete;
  GpuBackend& operator=(const GpuBackend&) = delete;

  std::string name() const override { return "gpu"; }
  Precision precision() const override { return Precision::binary32; }
  bool shows_iterates() const override { return true; }
  bool can_run(Span) const override { return true; }

  void load(std::vector<Setup> setups, std::vector<State> states) override {
    Load load(std::move(setups), states, options_, options_.capacity);
    use_device();
    take(std::move(load));
  }

  // Starts the span and returns. The counters of kInFlight calls ago decide whether capacity must grow. They have
  // nearly always arrived, and the answer does not depend on the device's speed. So two runs enlarge their arrays at
  // the same places and have the same bits.
  void run(Span span) override {
    use_device();
    if (span.contains(Stage::skin)) load_.forget_skins();
    if (runs_ >= kInFlight) {
      CUTPROOF_CUDA(cudaEventSynchronize(end_[slot()].get()));
      const Counters& then = counters()[slot()];
      require_no_fault(then);
      if (wants_capacity(device_.view(), then)) take(load_.enlarged(snapshot(), options_));
    }
    if (load_.needs_groups(span)) {
      DeviceLauncher launcher(stream_.get());
      enqueue_groups_if_stale(launcher, device_.view());
    }
    if (options_.path == Path::eager) {
      DeviceLauncher launcher(stream_.get());
      CUTPROOF_CUDA(cudaEventRecord(begin_.get(), stream_.get()));
      enqueue_span(launcher, device_.view(), load_.plan, span, [](Stage) {});
      finish(span);
      CUTPROOF_CUDA(cudaStreamSynchronize(stream_.get()));  // the launcher's temporary memory is freed with it
      return;
    }
    const auto key = std::pair(static_cast<int>(span.first), static_cast<int>(span.last));
    auto found = graphs_.find(key);
    if (found == graphs_.end()) {
      DeviceGraph graph = DeviceLauncher::capture(
          [&](DeviceLauncher& launcher) { enqueue_span(launcher, device_.view(), load_.plan, span, [](Stage) {}); });
      found = graphs_.emplace(key, std::move(graph)).first;
    }
    CUTPROOF_CUDA(cudaEventRecord(begin_.get(), stream_.get()));
    found->second.launch(stream_.get());
    finish(span);
  }

  std::vector<State> snapshot() const override { return snapshot_of(std::vector<bool>(load_.setups.size(), true)); }
  std::vector<State> snapshot_of(const std::vector<bool>& wanted) const override {
    use_device();
    wait();
    device_.download(load_.staging, runs_ > 0 ? counters()[last()] : load_.staging.counters.front(), stream_.get(),
                     landing_);
    return load_.states_of(wanted);
  }

  SpanReport report() const override {
    SpanReport report;
    if (runs_ == 0) return report;
    use_device();
    wait();
    for (std::size_t s = 0; s < 6; ++s) report.ran[s] = counters()[last()].stage_ran[s] != 0;
    float milliseconds = 0;
    CUTPROOF_CUDA(cudaEventElapsedTime(&milliseconds, begin_.get(), end_[last()].get()));
    report.total_seconds = 1e-3 * milliseconds;
    if (span_.first == span_.last) report.seconds[static_cast<std::size_t>(span_.first)] = report.total_seconds;
    return report;
  }

  StepWork step_work() const override {
    use_device();
    wait();
    const DeviceView& view = device_.view();
    const auto copy_of = [](const auto* from, int64_t count) {
      std::vector<std::remove_const_t<std::remove_pointer_t<decltype(from)>>> copy(static_cast<std::size_t>(count));
      CUTPROOF_CUDA(cudaMemcpy(copy.data(), from, copy.size() * sizeof(*from), cudaMemcpyDeviceToHost));
      return copy;
    };
    const Counters counters = copy_of(view.counters, 1).front();
    const auto heads = copy_of(view.group_head, counters.groups);
    const bool contacts = load_.plan.contacts;
    const auto resolved = copy_of(view.group_resolved, contacts ? counters.groups : 0);
    const auto loose = copy_of(view.loose_places, counters.loose);
    return step_work_of(counters, heads.data(), contacts ? resolved.data() : nullptr, loose.data());
  }

 private:
  // Each thread has a current device of its own.
  void use_device() const { in_use(options_); }
  static const KernelOptions& in_use(const KernelOptions& options) {
    CUTPROOF_CUDA(cudaSetDevice(options.device));
    return options;
  }
  void take(Load load) {
    CUTPROOF_CUDA(cudaStreamSynchronize(stream_.get()));
    graphs_.clear();
    device_ = DeviceArrays();  // frees the old memory before the new is allocated
    device_ = DeviceArrays(load.staging, options_);
    load_ = std::move(load);
    runs_ = 0;
  }
  static constexpr std::size_t kInFlight = 4;
  std::size_t slot() const { return static_cast<std::size_t>(runs_ % kInFlight); }
  std::size_t last() const { return static_cast<std::size_t>((runs_ - 1) % kInFlight); }

  // [kInFlight] of the last runs, cyclically.
  Counters* counters() const { return static_cast<Counters*>(counters_.get()); }

  // The counters arrive asynchronously.
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
  Stream stream_ = make_stream();
  Event begin_ = make_event();
  std::array<Event, kInFlight> end_;
  PinnedMemory counters_ = make_pinned_memory(kInFlight * sizeof(Counters));
  uint64_t runs_ = 0;  // since the load
  Span span_;
  mutable Load load_;  // snapshots download to its staging buffers, by way of landing_
  mutable LandingPlace landing_;
  DeviceArrays device_;
  std::map<std::pair<int, int>, DeviceGraph> graphs_;
};

}  // namespace

int device_count(std::string& why) {
  int count = 0;
  const cudaError_t status = cudaGetDeviceCount(&count);
  if (status == cudaSuccess && count > 0) return count;
  static_cast<void>(cudaGetLastError());
  why =
      status != cudaSuccess ? std::string("cudaGetDeviceCount says: ") + cudaGetErrorString(status) : "no CUDA device";
  return 0;
}

std::string device_description(std::string& why, int device) {
  const int count = device_count(why);
  if (device >= count) {
    if (count > 0) why = "there are " + std::to_string(count);
    return {};
  }
  cudaDeviceProp properties;
  CUTPROOF_CUDA(cudaGetDeviceProperties(&properties, device));
  char text[512];
  std::snprintf(text, sizeof text, "%s, compute capability %d.%d, %.1f GiB", properties.name, properties.major,
                properties.minor, static_cast<double>(properties.totalGlobalMem) / (1 << 30));
  return text;
}

std::unique_ptr<Backend> make_gpu_backend(KernelOptions options) {
  std::string why;
  if (device_description(why, options.device).empty()) throw MachineError("the backend gpu finds no device: " + why);
  return std::make_unique<GpuBackend>(options);
}

}  // namespace cutproof::gpu
