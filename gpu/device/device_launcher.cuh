// gpu/device: CUDA. The Block of kernels (device_block.cuh), checked calls (cuda_check.h), and handles that free
// resources (cuda_handles.h).
//
// This file: the Launcher of launcher.h for the device. capture() records work as a CUDA graph, conditions and loops
// included, which then runs any number of times without the host. A DeviceLauncher made from a stream starts work at
// once and waits for the device at each condition (for tests and loading).
#pragma once
#include <cuda_runtime.h>
#include <thrust/iterator/counting_iterator.h>
#include <thrust/iterator/transform_iterator.h>

#include <algorithm>
#include <climits>
#include <cstddef>
#include <cstdint>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device/cuda_check.h"
#include "gpu/device/cuda_handles.h"
#include "gpu/device/device_block.cuh"
#include "gpu/launch/launcher.h"

namespace cutproof::gpu {

namespace detail {

// A launch's arguments as one parameter. (Device code may not touch members of std::tuple, and GCC finds no address of
// a kernel with a pack of parameters.)
template <class... Args>
struct Arguments {
  template <class Call, class... Before>
  __device__ void apply(Call call, const Before&... before) const {
    call(before...);
  }
};
template <class First, class... Rest>
struct Arguments<First, Rest...> {
  First first;
  Arguments<Rest...> rest;
  template <class Call, class... Before>
  __device__ void apply(Call call, const Before&... before) const {
    rest.apply(call, before..., first);
  }
};
inline Arguments<> bundle() { return {}; }
template <class First, class... Rest>
Arguments<First, Rest...> bundle(const First& first, const Rest&... rest) {
  return {first, bundle(rest...)};
}

}  // namespace detail

// Arguments stay in constant memory: kernels that take their addresses copy nothing to the stack.
template <class Kernel, class Arguments>
__global__ void __launch_bounds__(max_threads<Kernel>(), min_blocks<Kernel>())
    run_kernel(const __grid_constant__ Arguments arguments) {
  arguments.apply([](const auto&... args) {
    DeviceBlock block;
    if constexpr (!reads_ahead<Kernel>()) block.wait_for_earlier();
    Kernel{}(block, args...);
    if constexpr (reads_ahead<Kernel>()) block.wait_for_earlier();  // on every path
  });
}

namespace detail {

template <class = void>
__global__ void set_condition_kernel(cudaGraphConditionalHandle handle, const int* flag) {
  DeviceBlock().wait_for_earlier();
  cudaGraphSetConditional(handle, *flag != 0 ? 1u : 0u);
}

// One block scans and selects short arrays, tile by tile. CUB takes two launches for either, neither of which may
// overlap with earlier work. (Beyond some ten thousand elements CUB is faster.)
inline constexpr int kScanThreads = 1024;
inline constexpr std::int64_t kMostScannedInBlock = 4 * 4 * kScanThreads, kMostSelectedInBlock = 2 * 16 * kScanThreads;

// A thread's neighbouring items, read as one; those from `count` on are 0.
template <class T>
struct alignas(16) TileItems {
  static constexpr int kEach = 16 / sizeof(T);
  T item[kEach];
};
template <class T>
__device__ TileItems<T> load_items(const T* in, int begin, int count) {
  constexpr int kEach = TileItems<T>::kEach;
  TileItems<T> items;
  if (begin + kEach <= count) return *reinterpret_cast<const TileItems<T>*>(in + begin);
#pragma unroll
  for (int k = 0; k < kEach; ++k) items.item[k] = begin + k < count ? in[begin + k] : T{};
  return items;
}
// Calls place(i, value, before) for each item, where `before` is the sum of measure(value) over earlier items. Returns
// the total.
template <class T, class Block, class Measure, class Place>
__device__ int scan_tiles(Block& block, const T* in, int count, Measure measure, Place place) {
  constexpr int kEach = TileItems<T>::kEach;
  int running = 0;
  TileItems<T> next = load_items(in, block.thread() * kEach, count);
  for (int tile = 0; tile < count; tile += kScanThreads * kEach) {
    const TileItems<T> own = next;
    const int begin = tile + block.thread() * kEach;
    next = load_items(in, begin + kScanThreads * kEach, count);  // read while this one is scanned
    int sum = 0, found = 0;
#pragma unroll
    for (int k = 0; k < kEach; ++k) sum += measure(own.item[k]);
    int before = running + block.exclusive_scan(sum, found);
    running += found;
#pragma unroll
    for (int k = 0; k < kEach; ++k) {
      if (begin + k < count) place(begin + k, own.item[k], before);
      before += measure(own.item[k]);
    }
  }
  return running;
}

// used: null, or the number of valid items.
struct scan_in_block_kernel_object {
  static constexpr const char* kName = "scan_in_block_kernel";
  static constexpr int kMaxThreads = kScanThreads;
  template <class Block>
  __device__ void operator()(Block& block, const int* in, int* out, int count, const int* used, int* total) const {
    const int there = used == nullptr ? count : *used;
    const int found = scan_tiles(
        block, in, there, [](int value) { return value; }, [&](int i, int, int before) { out[i] = before; });
    if (block.thread() == 0) *total = found;
  }
};
struct select_in_block_kernel_object {
  static constexpr const char* kName = "select_in_block_kernel";
  static constexpr int kMaxThreads = kScanThreads;
  template <class Block>
  __device__ void operator()(Block& block, const unsigned char* flags, int count, const int* used, int* selected,
                             int* total) const {
    const int there = used == nullptr ? count : *used;
    const int found = scan_tiles(
        block, flags, there, [](unsigned char flag) { return flag != 0 ? 1 : 0; },
        [&](int i, unsigned char flag, int before) {
          if (flag != 0) selected[before] = i;
        });
    if (block.thread() == 0) *total = found;
  }
};

struct clear_kernel_object {
  static constexpr const char* kName = "clear_kernel";
  template <class Block>
  __device__ void operator()(Block& block, int* data, std::int64_t count) const {
    for (std::int64_t i = block.first(); i < count; i += block.stride()) data[i] = 0;
  }
};

// Keys beyond *count become the greatest number, so sorting puts them last.
template <class = void>
__global__ void pad_keys_kernel(unsigned long long* keys, const int* count, int capacity) {
  const std::int64_t stride = static_cast<std::int64_t>(gridDim.x) * blockDim.x;
  std::int64_t i = *count + static_cast<std::int64_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  for (; i < capacity; i += stride) keys[i] = ~0ull;
}
template <class = void>
__global__ void drop_padding_kernel(const unsigned long long* keys, int* count) {
  if (*count > 0 && keys[*count - 1] == ~0ull) --*count;
}

// Scanning one more item, 0, puts the total behind the last place.
struct ScanInput {
  const int* in;
  int count;
  __host__ __device__ int operator()(int i) const { return i < count ? in[i] : 0; }
};
class ScanOutput {
 public:
  using iterator_category = std::random_access_iterator_tag;
  using value_type = int;
  using difference_type = std::ptrdiff_t;
  using pointer = int*;
  using reference = int&;
  ScanOutput(int* out, int count, int* total) : out_(out), total_(total), count_(count) {}
  __host__ __device__ int& operator[](std::ptrdiff_t i) const { return i + at_ < count_ ? out_[i + at_] : *total_; }
  __host__ __device__ int& operator*() const { return (*this)[0]; }
  __host__ __device__ ScanOutput operator+(std::ptrdiff_t n) const {
    ScanOutput moved = *this;
    moved.at_ += n;
    return moved;
  }
  __host__ __device__ ScanOutput& operator+=(std::ptrdiff_t n) {
    at_ += n;
    return *this;
  }

 private:
  int* out_;
  int* total_;
  std::ptrdiff_t count_;
  std::ptrdiff_t at_ = 0;
};

// Shared by the launches of a launcher or graph, which never overlap: a graph is one chain of nodes, and parallel work
// has its own.
struct DeviceResources {
  int multiprocessors = 0;
  std::size_t required = 0;  // most bytes of temporary memory that any launch asked for
  std::size_t allocated = 0;
  DeviceMemory temporary;
  std::vector<Stream> inner;                             // for capturing bodies of conditions, by depth
  std::vector<std::shared_ptr<DeviceResources>> beside;  // of parallel work, by nesting in first pieces

  DeviceResources() {
    int device = 0;
    CUTPROOF_CUDA(cudaGetDevice(&device));
    CUTPROOF_CUDA(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  }

  // Frees the old memory, which must be unused.
  void allocate() {
    for (const auto& other : beside) other->allocate();
    if (required <= allocated) return;
    temporary.reset();
    allocated = 0;
    temporary = make_device_memory(required);
    allocated = required;
  }
  cudaStream_t stream(std::size_t depth) {
    while (inner.size() <= depth) inner.push_back(make_stream());
    return inner[depth].get();
  }
};

// CUDA 13 gave the plain names to the functions with edge data.
inline void capture_info(cudaStream_t stream, cudaGraph_t* graph, const cudaGraphNode_t** dependencies,
                         const cudaGraphEdgeData** edges, std::size_t* count) {
  cudaStreamCaptureStatus status = cudaStreamCaptureStatusNone;
#if CUDART_VERSION >= 13000
  CUTPROOF_CUDA(cudaStreamGetCaptureInfo(stream, &status, nullptr, graph, dependencies, edges, count));
#else
  CUTPROOF_CUDA(cudaStreamGetCaptureInfo_v3(stream, &status, nullptr, graph, dependencies, edges, count));
#endif
  if (status != cudaStreamCaptureStatusActive) throw MachineError("CUDA failed: a stream stopped being captured.");
}
// The dependencies of a stream's next captured node.
class Dependencies {
 public:
  static Dependencies of(cudaStream_t stream) {
    cudaGraph_t graph = nullptr;
    const cudaGraphNode_t* nodes = nullptr;
    const cudaGraphEdgeData* edges = nullptr;
    std::size_t count = 0;
    capture_info(stream, &graph, &nodes, &edges, &count);
    Dependencies found;
    found.nodes_.assign(nodes, nodes + count);
    if (edges != nullptr) found.edges_.assign(edges, edges + count);
    return found;
  }
  // Replaces the present ones.
  void give(cudaStream_t stream) const {
    auto nodes = nodes_;  // the parameter is not const
    const cudaGraphEdgeData* const edges = edges_.empty() ? nullptr : edges_.data();
    constexpr unsigned how = cudaStreamSetCaptureDependencies;
#if CUDART_VERSION >= 13000
    CUTPROOF_CUDA(cudaStreamUpdateCaptureDependencies(stream, nodes.data(), edges, nodes.size(), how));
#else
    CUTPROOF_CUDA(cudaStreamUpdateCaptureDependencies_v2(stream, nodes.data(), edges, nodes.size(), how));
#endif
  }
  // The union of both, without duplicates.
  Dependencies with(const Dependencies& other) const {
    Dependencies both = *this;
    for (std::size_t k = 0; k < other.nodes_.size(); ++k) {
      if (std::find(nodes_.begin(), nodes_.end(), other.nodes_[k]) != nodes_.end()) continue;
      both.edges_.resize(both.nodes_.size());
      both.nodes_.push_back(other.nodes_[k]);
      both.edges_.push_back(k < other.edges_.size() ? other.edges_[k] : cudaGraphEdgeData{});
    }
    return both;
  }
  bool operator==(const Dependencies& other) const { return nodes_ == other.nodes_; }

 private:
  std::vector<cudaGraphNode_t> nodes_;
  std::vector<cudaGraphEdgeData> edges_;  // empty: plain ones
};

inline cudaGraphNode_t append_node(cudaStream_t stream, cudaGraphNodeParams* parameters) {
  cudaGraph_t graph = nullptr;
  const cudaGraphNode_t* dependencies = nullptr;
  const cudaGraphEdgeData* edges = nullptr;
  std::size_t count = 0;
  capture_info(stream, &graph, &dependencies, &edges, &count);
  cudaGraphNode_t node = nullptr;
#if CUDART_VERSION >= 13000
  CUTPROOF_CUDA(cudaGraphAddNode(&node, graph, dependencies, edges, count, parameters));
  CUTPROOF_CUDA(cudaStreamUpdateCaptureDependencies(stream, &node, nullptr, 1, cudaStreamSetCaptureDependencies));
#else
  CUTPROOF_CUDA(cudaGraphAddNode_v2(&node, graph, dependencies, edges, count, parameters));
  CUTPROOF_CUDA(cudaStreamUpdateCaptureDependencies_v2(stream, &node, nullptr, 1, cudaStreamSetCaptureDependencies));
#endif
  return node;
}

}  // namespace detail

// Recorded work. Its launches must not overlap: they share temporary memory.
class DeviceGraph {
 public:
  DeviceGraph() = default;
  DeviceGraph(ExecutableGraph executable, std::shared_ptr<detail::DeviceResources> resources)
      : resources_(std::move(resources)), executable_(std::move(executable)) {}

  // Does not wait for the device.
  void launch(cudaStream_t stream) const { CUTPROOF_CUDA(cudaGraphLaunch(executable_.get(), stream)); }
  explicit operator bool() const { return executable_ != nullptr; }

 private:
  std::shared_ptr<detail::DeviceResources> resources_;
  ExecutableGraph executable_;
};

class DeviceLauncher {
 public:
  // Starts work on `stream` at once.
  explicit DeviceLauncher(cudaStream_t stream)
      : mode_(Mode::at_once), stream_(stream), resources_(std::make_shared<detail::DeviceResources>()) {}

  // Captures the launches of `work`, a callable that takes a DeviceLauncher&, as a graph. `work` is called twice, first
  // only to measure its temporary memory. Nothing is executed.
  template <class Work>
  static DeviceGraph capture(Work work) {
    auto resources = std::make_shared<detail::DeviceResources>();
    DeviceLauncher measuring(Mode::measure, nullptr, resources, 0);
    work(measuring);
    resources->allocate();

    const cudaStream_t stream = resources->stream(0);
    CUTPROOF_CUDA(cudaStreamBeginCapture(stream, cudaStreamCaptureModeRelaxed));
    DeviceLauncher writing(Mode::capture, stream, resources, 0);
    cudaGraph_t captured = nullptr;
    try {
      work(writing);
    } catch (...) {
      static_cast<void>(cudaStreamEndCapture(stream, &captured));
      const Graph dropped(captured);
      static_cast<void>(cudaGetLastError());
      throw;
    }
    CUTPROOF_CUDA(cudaStreamEndCapture(stream, &captured));
    const Graph graph(captured);
    return DeviceGraph(make_executable(graph.get()), std::move(resources));
  }

  template <class Kernel, class... Args>
  void items(Kernel, std::int64_t capacity, Args... args) {
    constexpr int kThreads = std::min(256, max_threads<Kernel>());
    launch<Kernel>((capacity + kThreads - 1) / kThreads, kThreads, 0, args...);
  }
  template <class Kernel, class... Args>
  void teams(Kernel kernel, int lanes, std::int64_t capacity, Args... args) {
    items(kernel, lanes * capacity, args...);
  }
  template <class Kernel, class... Args>
  void blocks(Kernel, std::int64_t capacity, int threads, std::size_t shared_bytes, Args... args) {
    check_threads<Kernel>(threads);
    launch<Kernel>(capacity, threads, shared_bytes, args...);
  }

  template <class Body>
  void if_nonzero(const int* flag, Body body) {
    if (mode_ == Mode::at_once) {
      if (read(flag) != 0) body(*this);
    } else {
      conditional(flag, cudaGraphCondTypeIf, body);
    }
  }
  template <class Body>
  void while_nonzero(int* flag, Body body) {
    if (mode_ == Mode::at_once) {
      while (read(flag) != 0) body(*this);
    } else {
      conditional(flag, cudaGraphCondTypeWhile, body);
    }
  }

  bool overlaps() const { return mode_ != Mode::at_once; }
  template <class First, class Second, class AfterFirst = NoWork, class AfterBoth = NoWork>
  void side_by_side(First first, Second second, AfterFirst after_first = {}, AfterBoth after_both = {}) {
    if (mode_ == Mode::at_once) {
      first(*this);
      second(*this);
      after_first(*this);
      after_both(*this);
      return;
    }
    if (resources_->beside.size() == beside_) resources_->beside.push_back(std::make_shared<detail::DeviceResources>());
    DeviceLauncher other(mode_, stream_, resources_->beside[beside_], depth_);
    ++beside_;  // parallel work within the first piece needs another one
    if (mode_ == Mode::measure) {
      first(*this);
      second(other);
      after_first(*this);
      after_both(other);
      --beside_;
      return;
    }
    // All on one stream with new dependencies. If a call failed in between, a second stream would stay in capture.
    const auto parted = detail::Dependencies::of(stream_);
    first(*this);
    const auto end_of_first = detail::Dependencies::of(stream_);
    after_first(*this);
    --beside_;
    const auto end_of_chain = detail::Dependencies::of(stream_);
    parted.give(stream_);
    second(other);
    const auto both = detail::Dependencies::of(stream_).with(end_of_first);
    both.give(stream_);
    other.after_launch_ = false;
    after_both(other);
    const auto end = detail::Dependencies::of(stream_);
    after_launch_ = other.after_launch_;
    if (end_of_chain == end_of_first && !(end == both)) return;  // the next work waits for everything
    end.with(end_of_chain).give(stream_);
    after_launch_ = false;
  }

  void exclusive_scan(const int* in, int* out, std::int64_t count, int* total, const int* used = nullptr) {
    const int n = narrow(count, "exclusive_scan");
    if (used != nullptr && !is_aligned(in)) throw std::logic_error("exclusive_scan: items that begin at no 16 bytes.");
    if ((used != nullptr || n <= detail::kMostScannedInBlock) && is_aligned(in)) {
      return launch<detail::scan_in_block_kernel_object>(1, detail::kScanThreads, 0, in, out, n, used, total);
    }
    const auto input = thrust::make_transform_iterator(thrust::counting_iterator<int>(0), detail::ScanInput{in, n});
    const detail::ScanOutput output(out, n, total);
    with_temporary("cub::DeviceScan::ExclusiveSum", [&](void* temporary, std::size_t& bytes) {
      return cub::DeviceScan::ExclusiveSum(temporary, bytes, input, output, n + 1, stream_);
    });
  }
  void select(const unsigned char* flags, std::int64_t count, int* selected, int* selected_count,
              const int* used = nullptr) {
    const int n = narrow(count, "select");
    if (used != nullptr && !is_aligned(flags)) throw std::logic_error("select: items that begin at no 16 bytes.");
    if ((used != nullptr || n <= detail::kMostSelectedInBlock) && is_aligned(flags)) {
      return launch<detail::select_in_block_kernel_object>(1, detail::kScanThreads, 0, flags, n, used, selected,
                                                           selected_count);
    }
    with_temporary("cub::DeviceSelect::Flagged", [&](void* temporary, std::size_t& bytes) {
      return cub::DeviceSelect::Flagged(temporary, bytes, thrust::counting_iterator<int>(0), flags, selected,
                                        selected_count, n, stream_);
    });
  }
  void sort_unique(unsigned long long* keys, int* count, std::int64_t capacity) {
    const int n = narrow(capacity, "sort_unique");
    if (n == 0) return;
    after_launch_ = false;
    const std::size_t sorted_bytes = (static_cast<std::size_t>(n) * sizeof(unsigned long long) + 255) / 256 * 256;
    if (mode_ != Mode::measure) {
      const int grid = static_cast<int>(std::min<std::int64_t>((n + 255) / 256, 8 * resources_->multiprocessors));
      detail::pad_keys_kernel<><<<grid, 256, 0, stream_>>>(keys, count, n);
      check_cuda(cudaGetLastError(), "pad_keys_kernel", __FILE__, __LINE__);
    }
    const auto sort = [&](void* temporary, std::size_t& bytes) {
      return cub::DeviceRadixSort::SortKeys(temporary, bytes, keys, sorted(), n, 0, 64, stream_);
    };
    const auto unique = [&](void* temporary, std::size_t& bytes) {
      return cub::DeviceSelect::Unique(temporary, bytes, sorted(), keys, count, n, stream_);
    };
    constexpr const char* kSort = "cub::DeviceRadixSort::SortKeys";
    constexpr const char* kUnique = "cub::DeviceSelect::Unique";
    require(sorted_bytes + std::max(bytes_of(kSort, sort), bytes_of(kUnique, unique)));
    with_temporary(kSort, sort, sorted_bytes);
    with_temporary(kUnique, unique, sorted_bytes);
    if (mode_ != Mode::measure) {
      detail::drop_padding_kernel<><<<1, 1, 0, stream_>>>(keys, count);
      check_cuda(cudaGetLastError(), "drop_padding_kernel", __FILE__, __LINE__);
    }
  }
  void clear(void* data, std::size_t bytes) {
    const auto ints = static_cast<std::int64_t>(bytes / sizeof(int));
    if (ints > 0) items(detail::clear_kernel_object{}, ints, static_cast<int*>(data), ints);
  }

 private:
  enum class Mode { at_once, measure, capture };

  // For reads of 16 bytes.
  static bool is_aligned(const void* at) { return reinterpret_cast<std::uintptr_t>(at) % 16 == 0; }

  DeviceLauncher(Mode mode, cudaStream_t stream, std::shared_ptr<detail::DeviceResources> resources, std::size_t depth)
      : mode_(mode), stream_(stream), resources_(std::move(resources)), depth_(depth) {}

  template <class Kernel, class... Args>
  void launch(std::int64_t wanted, int threads, std::size_t shared_bytes, const Args&... args) {
    const auto arguments = detail::bundle(args...);
    constexpr auto kernel = &run_kernel<Kernel, detail::Arguments<Args...>>;
    // A kernel must request more; collectives' use (up to 6 KB) counts as well.
    constexpr std::size_t kWithoutAsking = 40 * 1024;
    if (shared_bytes > kWithoutAsking && mode_ != Mode::capture) {
      check_cuda(
          cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(shared_bytes)),
          kernel_name<Kernel>(), __FILE__, __LINE__);
    }
    if (mode_ == Mode::measure) return;
    // As many as run side by side. Capacities are far above need, and a block without work still has to start and read
    // a counter. Ten waves of them took as long as the work (advance_kernel of 100,000 particles).
    int side_by_side = 0;
    check_cuda(cudaOccupancyMaxActiveBlocksPerMultiprocessorWithFlags(&side_by_side, kernel, threads, shared_bytes,
                                                                      cudaOccupancyDefault),
               kernel_name<Kernel>(), __FILE__, __LINE__);
    const std::int64_t most = std::int64_t{std::max(side_by_side, 1)} * resources_->multiprocessors;
    cudaLaunchConfig_t config = {};
    config.gridDim = static_cast<unsigned>(std::clamp<std::int64_t>(wanted, 1, most));
    config.blockDim = static_cast<unsigned>(threads);
    config.dynamicSmemBytes = shared_bytes;
    start<kernel>(config, kernel_name<Kernel>(), arguments);
  }
  // Begins while the previous launch's last blocks work, if both wait properly (launcher.h).
  template <auto kKernel, class... Arguments>
  void start(cudaLaunchConfig_t config, const char* name, const Arguments&... arguments) {
    cudaLaunchAttribute overlap = {};
    overlap.id = cudaLaunchAttributeProgrammaticStreamSerialization;
    overlap.val.programmaticStreamSerializationAllowed = 1;
    config.stream = stream_;
    config.attrs = &overlap;
    // Code compiled for devices before 9.0 cannot wait so, wherever it runs.
    static const bool waits = [&] {
      cudaFuncAttributes attributes = {};
      check_cuda(cudaFuncGetAttributes(&attributes, kKernel), name, __FILE__, __LINE__);
      return attributes.ptxVersion >= 90;
    }();
    config.numAttrs = mode_ == Mode::capture && waits && after_launch_ ? 1 : 0;
    check_cuda(cudaLaunchKernelEx(&config, kKernel, arguments...), name, __FILE__, __LINE__);
    after_launch_ = waits;
  }

  int read(const int* flag) {
    int value = 0;
    CUTPROOF_CUDA(cudaMemcpyAsync(&value, flag, sizeof value, cudaMemcpyDeviceToHost, stream_));
    CUTPROOF_CUDA(cudaStreamSynchronize(stream_));
    return value;
  }

  // A kernel that reads the flag, then a node that runs the body's graph or not; a loop reads the flag again at its
  // end.
  template <class Body>
  void conditional(const int* flag, cudaGraphConditionalNodeType type, Body& body) {
    if (mode_ == Mode::measure) {
      DeviceLauncher inside(mode_, nullptr, resources_, depth_ + 1);
      inside.beside_ = beside_;
      body(inside);
      resources_->stream(depth_ + 1);
      return;
    }
    cudaGraph_t graph = nullptr;
    const cudaGraphNode_t* dependencies = nullptr;
    const cudaGraphEdgeData* edges = nullptr;
    std::size_t count = 0;
    detail::capture_info(stream_, &graph, &dependencies, &edges, &count);
    cudaGraphConditionalHandle handle{};
    CUTPROOF_CUDA(cudaGraphConditionalHandleCreate(&handle, graph, 0, cudaGraphCondAssignDefault));
    set_condition(handle, flag);
    after_launch_ = false;

    cudaGraphNodeParams parameters = {};
    parameters.type = cudaGraphNodeTypeConditional;
    parameters.conditional.handle = handle;
    parameters.conditional.type = type;
    parameters.conditional.size = 1;
    detail::append_node(stream_, &parameters);

    const cudaStream_t stream = resources_->stream(depth_ + 1);
    CUTPROOF_CUDA(cudaStreamBeginCaptureToGraph(stream, parameters.conditional.phGraph_out[0], nullptr, nullptr, 0,
                                                cudaStreamCaptureModeRelaxed));
    cudaGraph_t captured = nullptr;  // owned by the node, so never destroyed here
    try {
      DeviceLauncher inside(mode_, stream, resources_, depth_ + 1);
      inside.beside_ = beside_;
      body(inside);
      if (type == cudaGraphCondTypeWhile) inside.set_condition(handle, flag);
    } catch (...) {
      static_cast<void>(cudaStreamEndCapture(stream, &captured));
      throw;
    }
    CUTPROOF_CUDA(cudaStreamEndCapture(stream, &captured));
  }
  void set_condition(cudaGraphConditionalHandle handle, const int* flag) {
    cudaLaunchConfig_t config = {};
    config.gridDim = config.blockDim = 1;
    start<&detail::set_condition_kernel<>>(config, "set_condition_kernel", handle, flag);
  }

  template <class Call>
  static std::size_t bytes_of(const char* name, Call call) {
    std::size_t bytes = 0;
    check_cuda(call(nullptr, bytes), name, __FILE__, __LINE__);
    return std::max<std::size_t>(bytes, 1);
  }
  // Ensures so much temporary memory; its contents may be lost.
  void require(std::size_t bytes) {
    resources_->required = std::max(resources_->required, bytes);
    if (mode_ == Mode::measure || resources_->required <= resources_->allocated) return;
    if (mode_ == Mode::capture) {
      throw std::logic_error("DeviceLauncher: the work that was captured is not the work that was measured.");
    }
    CUTPROOF_CUDA(cudaStreamSynchronize(stream_));
    resources_->allocate();
  }
  // Calls one of CUB's functions with its temporary memory, behind `reserved` bytes of the caller.
  template <class Call>
  void with_temporary(const char* name, Call call, std::size_t reserved = 0) {
    after_launch_ = false;
    std::size_t bytes = bytes_of(name, call);
    require(reserved + bytes);
    if (mode_ == Mode::measure) return;
    check_cuda(call(static_cast<unsigned char*>(resources_->temporary.get()) + reserved, bytes), name, __FILE__,
               __LINE__);
  }
  unsigned long long* sorted() const { return static_cast<unsigned long long*>(resources_->temporary.get()); }

  static int narrow(std::int64_t count, const char* what) {
    if (count < 0 || count >= INT_MAX) {
      throw std::logic_error(std::string(what) + ": " + std::to_string(count) +
                             " items are not between 0 and 2^31 - 2.");
    }
    return static_cast<int>(count);
  }

  Mode mode_;
  cudaStream_t stream_;
  std::shared_ptr<detail::DeviceResources> resources_;
  std::size_t depth_ = 0, beside_ = 0;  // depths of nested conditions and of first pieces
  bool after_launch_ = false;           // the last launch was a kernel that lets the next one begin
};

}  // namespace cutproof::gpu
