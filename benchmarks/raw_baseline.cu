#include <cuda_runtime.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <sstream>

#include "benchmarks/raw_baseline.h"
#include "gpu/device/cuda_check.h"
#include "gpu/device/cuda_handles.h"
#include "gpu/device/device_launcher.cuh"
#include "gpu/launch/team.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu {
namespace {

// The update of step/particle.cuh, with the goal already averaged: x = x~ + s (g - x~), and v from the motion.
struct Particles {
  const Float4* predicted;
  const Float4* goal;
  const Float4* start;
  Float4* position;
  Float4* velocity;
  float relaxation, damping, per_dt;
  int count;
};

CUTPROOF_DEVICE inline void update_particle(const Particles& p, std::int64_t i) {
  const Float4 predicted = p.predicted[i];
  const Float3 position = xyz(predicted) + p.relaxation * (xyz(p.goal[i]) - xyz(predicted));
  p.position[i] = with_w(position, predicted.w);
  p.velocity[i] = with_w(p.damping * p.per_dt * (position - xyz(p.start[i])), 0.0f);
}

template <class Block>
CUTPROOF_DEVICE void update_particles_kernel(Block& block, Particles p) {
  for (std::int64_t i = block.first(); i < p.count; i += block.stride()) update_particle(p, i);
}
CUTPROOF_KERNEL(update_particles_kernel);

__global__ void __launch_bounds__(256) raw_update_particles_kernel(const __grid_constant__ Particles p) {
  const std::int64_t stride = static_cast<std::int64_t>(gridDim.x) * blockDim.x;
  for (std::int64_t i = static_cast<std::int64_t>(blockIdx.x) * blockDim.x + threadIdx.x; i < p.count; i += stride) {
    update_particle(p, i);
  }
}

// A warp for each cluster of kClusterSize particles, as in the kernels' sums over members: t = Σ w x / n, which every
// lane needs, and each member's w (x - t).
constexpr int kClusterSize = 125;
struct Clusters {
  const Float4* position;
  const int* members;
  Float4* offset;
  int count;
};

template <class Block>
CUTPROOF_DEVICE void sum_clusters_kernel(Block& block, const Clusters& c) {
  using WholeWarp = Team<Block, 32>;
  const WholeWarp team(block);
  for (std::int64_t s = team.first(); s < c.count; s += team.stride()) {
    const int* const members = c.members + s * kClusterSize;
    typename WholeWarp::template Sums<3> sums;
    team.each(kClusterSize, [&](int k) {
      const Float4 x = c.position[members[k]];
      float* const sum = sums.of(k);
      sum[0] += x.w * x.x;
      sum[1] += x.w * x.y;
      sum[2] += x.w * x.z;
    });
    const auto total = team.total(sums);
    const Float3 center = (1.0f / kClusterSize) * Float3{total.v[0], total.v[1], total.v[2]};
    team.each(kClusterSize, [&](int k) {
      const Float4 x = c.position[members[k]];
      c.offset[s * kClusterSize + k] = with_w(x.w * (xyz(x) - center), x.w);
    });
  }
}
CUTPROOF_KERNEL(sum_clusters_kernel);

__device__ inline float raw_warp_sum(float value) {
#pragma unroll
  for (int distance = 16; distance > 0; distance /= 2) value += __shfl_xor_sync(0xffffffffu, value, distance);
  return value;
}

__global__ void __launch_bounds__(256) raw_sum_clusters_kernel(const __grid_constant__ Clusters c) {
  const int lane = static_cast<int>(threadIdx.x % 32), warps = static_cast<int>(gridDim.x * blockDim.x / 32);
  for (int s = static_cast<int>((blockIdx.x * blockDim.x + threadIdx.x) / 32); s < c.count; s += warps) {
    const int* const members = c.members + static_cast<std::int64_t>(s) * kClusterSize;
    float4* const offset = reinterpret_cast<float4*>(c.offset) + static_cast<std::int64_t>(s) * kClusterSize;
    float x = 0, y = 0, z = 0;
    for (int i = lane; i < kClusterSize; i += 32) {
      const float4 at = reinterpret_cast<const float4*>(c.position)[members[i]];
      x += at.w * at.x;
      y += at.w * at.y;
      z += at.w * at.z;
    }
    x = raw_warp_sum(x) * (1.0f / kClusterSize);
    y = raw_warp_sum(y) * (1.0f / kClusterSize);
    z = raw_warp_sum(z) * (1.0f / kClusterSize);
    for (int i = lane; i < kClusterSize; i += 32) {
      const float4 at = reinterpret_cast<const float4*>(c.position)[members[i]];
      offset[i] = make_float4(at.w * (at.x - x), at.w * (at.y - y), at.w * (at.z - z), at.w);
    }
  }
}

class Buffer {
 public:
  explicit Buffer(std::size_t bytes) : data_(make_device_memory(bytes)), bytes_(bytes) {
    CUTPROOF_CUDA(cudaMemset(data_.get(), 0, bytes));
    wait_for_copies();
  }
  template <class T>
  T* as() const {
    return static_cast<T*>(data_.get());
  }
  template <class T>
  void fill(const std::vector<T>& values) {
    CUTPROOF_CUDA(cudaMemcpy(data_.get(), values.data(), values.size() * sizeof(T), cudaMemcpyHostToDevice));
    wait_for_copies();
  }
  std::vector<unsigned char> read() const {
    std::vector<unsigned char> bytes(bytes_);
    CUTPROOF_CUDA(cudaMemcpy(bytes.data(), data_.get(), bytes_, cudaMemcpyDeviceToHost));
    return bytes;
  }

 private:
  DeviceMemory data_;
  std::size_t bytes_;
};

void record(const Event& event) { CUTPROOF_CUDA(cudaEventRecord(event.get(), nullptr)); }
double microseconds_between(const Event& start, const Event& end) {
  float milliseconds = 0;
  CUTPROOF_CUDA(cudaEventSynchronize(end.get()));
  CUTPROOF_CUDA(cudaEventElapsedTime(&milliseconds, start.get(), end.get()));
  return 1e3 * static_cast<double>(milliseconds);
}

template <class Function>
KernelCost resources_of(Function* function) {
  cudaFuncAttributes attributes{};
  CUTPROOF_CUDA(cudaFuncGetAttributes(&attributes, function));
  KernelCost cost;
  cost.registers = attributes.numRegs;
  cost.stack = attributes.localSizeBytes;
  cost.shared = attributes.sharedSizeBytes;
  return cost;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

// Both in turns, so that clocks and caches treat them alike; the first turns do not count. A turn is a queue of
// launches, because a single one would include the host's launch time.
constexpr int kLaunchesInATurn = 16;
template <class Layer, class Raw>
void time_both(Layer layer, Raw raw, int launches, KernelComparison& result) {
  const Event before = make_event(), between = make_event(), after = make_event();
  std::vector<double> layer_times, raw_times;
  constexpr int kWarmUp = 5;
  const auto turn = [](const auto& launch) {
    for (int k = 0; k < kLaunchesInATurn; ++k) launch();
  };
  for (int i = 0; i < launches + kWarmUp; ++i) {
    record(before);
    if (i % 2 == 0)
      turn(layer);
    else
      turn(raw);
    record(between);
    if (i % 2 == 0)
      turn(raw);
    else
      turn(layer);
    record(after);
    const double first = microseconds_between(before, between) / kLaunchesInATurn;
    const double second = microseconds_between(between, after) / kLaunchesInATurn;
    if (i < kWarmUp) continue;
    layer_times.push_back(i % 2 == 0 ? first : second);
    raw_times.push_back(i % 2 == 0 ? second : first);
  }
  result.layer.microseconds = median(std::move(layer_times));
  result.raw.microseconds = median(std::move(raw_times));
}

std::vector<Float4> some_positions(std::size_t count, unsigned seed) {
  std::vector<Float4> values(count);
  unsigned x = seed;
  const auto next = [&] {
    x = x * 1664525u + 1013904223u;
    return static_cast<float>(x >> 8) * 0x1p-24f;
  };
  for (Float4& value : values) value = {next(), next(), next(), 0.5f + next()};
  return values;
}

}  // namespace

std::vector<KernelComparison> compare_with_raw(long long particles, int launches) {
  std::vector<KernelComparison> results;
  int device = 0, multiprocessors = 0;
  CUTPROOF_CUDA(cudaGetDevice(&device));
  CUTPROOF_CUDA(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  const auto count = static_cast<std::size_t>(particles);
  const std::size_t bytes = count * sizeof(Float4);
  {
    Buffer predicted(bytes), goal(bytes), start(bytes), position(bytes), velocity(bytes);
    Buffer raw_position(bytes), raw_velocity(bytes);
    predicted.fill(some_positions(count, 1));
    goal.fill(some_positions(count, 2));
    start.fill(some_positions(count, 3));
    const Particles layer{predicted.as<Float4>(),
                          goal.as<Float4>(),
                          start.as<Float4>(),
                          position.as<Float4>(),
                          velocity.as<Float4>(),
                          0.6f,
                          0.99f,
                          250.0f,
                          static_cast<int>(count)};
    Particles raw = layer;
    raw.position = raw_position.as<Float4>();
    raw.velocity = raw_velocity.as<Float4>();

    KernelComparison result;
    result.kernel = "update_particles";
    result.items = particles;
    result.layer = resources_of(&run_kernel<update_particles_kernel_object, detail::Arguments<Particles>>);
    result.raw = resources_of(&raw_update_particles_kernel);
    DeviceLauncher launcher(nullptr);
    const auto grid = static_cast<unsigned>(
        std::min<std::int64_t>((particles + 255) / 256, static_cast<std::int64_t>(8) * multiprocessors));
    time_both([&] { launcher.items(update_particles_kernel_object{}, particles, layer); },
              [&] {
                raw_update_particles_kernel<<<grid, 256>>>(raw);
                CUTPROOF_CUDA(cudaGetLastError());
              },
              launches, result);
    result.same_bits = position.read() == raw_position.read() && velocity.read() == raw_velocity.read();
    results.push_back(result);
  }
  {
    const auto clusters = static_cast<int>(std::max<long long>(1, particles / kClusterSize));
    Buffer position(bytes), members(static_cast<std::size_t>(clusters) * kClusterSize * sizeof(int));
    const std::size_t offset_bytes = static_cast<std::size_t>(clusters) * kClusterSize * sizeof(Float4);
    Buffer offset(offset_bytes), raw_offset(offset_bytes);
    position.fill(some_positions(count, 4));
    std::vector<int> member(static_cast<std::size_t>(clusters) * kClusterSize);
    for (std::size_t i = 0; i < member.size(); ++i) member[i] = static_cast<int>((i * 7) % count);
    members.fill(member);
    const Clusters layer{position.as<Float4>(), members.as<int>(), offset.as<Float4>(), clusters};
    Clusters raw = layer;
    raw.offset = raw_offset.as<Float4>();

    KernelComparison result;
    result.kernel = "sum_clusters";
    result.items = clusters;
    result.layer = resources_of(&run_kernel<sum_clusters_kernel_object, detail::Arguments<Clusters>>);
    result.raw = resources_of(&raw_sum_clusters_kernel);
    DeviceLauncher launcher(nullptr);
    const auto grid = static_cast<unsigned>(std::min((clusters + 7) / 8, 8 * multiprocessors));
    time_both([&] { launcher.teams(sum_clusters_kernel_object{}, 32, clusters, layer); },
              [&] {
                raw_sum_clusters_kernel<<<grid, 256>>>(raw);
                CUTPROOF_CUDA(cudaGetLastError());
              },
              launches, result);
    result.same_bits = offset.read() == raw_offset.read();
    results.push_back(result);
  }
  return results;
}

std::string raw_baseline_json(const std::vector<KernelComparison>& results) {
  int device = 0;
  cudaDeviceProp properties{};
  CUTPROOF_CUDA(cudaGetDevice(&device));
  CUTPROOF_CUDA(cudaGetDeviceProperties(&properties, device));
  std::ostringstream json;
  const auto cost = [&](const char* name, const KernelCost& c) {
    json << "\"" << name << "\": {\"registers\": " << c.registers << ", \"stack_bytes\": " << c.stack
         << ", \"shared_bytes\": " << c.shared << ", \"microseconds\": " << c.microseconds << "}";
  };
  json << "{\"device\": \"" << properties.name << "\", \"kernels\": [";
  for (std::size_t i = 0; i < results.size(); ++i) {
    json << (i == 0 ? "\n  {" : ",\n  {") << "\"kernel\": \"" << results[i].kernel
         << "\", \"items\": " << results[i].items << ", ";
    cost("layer", results[i].layer);
    json << ", ";
    cost("raw", results[i].raw);
    json << ", \"time_ratio\": " << results[i].layer.microseconds / results[i].raw.microseconds
         << ", \"same_bits\": " << (results[i].same_bits ? "true" : "false") << "}";
  }
  json << "\n]}";
  return json.str();
}

}  // namespace cutproof::gpu
