// A whole span as one kernel: the Launcher of launcher.h inside the device, on which frame.h writes down the same work
// as on the others. A launch becomes a call, what separates launches a barrier of the grid, and a condition a branch.
// A grid of one block needs no more than __syncthreads(), which is the fastest for small loads, whose launches take
// longer than their work.
//
// Kernels see the blocks that they ask for: of blocks(), whose sums depend on their sizes, as parts of the real ones.
// So every path gives the same bits.
#define CUTPROOF_ONE_LAUNCH
#include <cooperative_groups.h>

#include <cstddef>
#include <cstdint>

#include "gpu/device/cuda_check.h"
#include "gpu/device/device_block.cuh"
#include "gpu/device/span_kernel.h"
#include "gpu/launch/frame.h"

namespace cutproof::gpu {

// In a function that is also the device's, a call of what is not there would become nothing.
#pragma nv_diag_error 20011
#pragma nv_diag_error 20014

namespace {

constexpr int kSpanThreads = 512;
constexpr unsigned kSpanShared = 64 * 1024;  // bytes of dynamic shared memory that a block has for its parts

class SpanLauncher {
 public:
  using OneLaunch = void;  // step.cuh: what it never needs would only make the kernel larger

  // partials: kMostSpanBlocks ints.
  __device__ explicit SpanLauncher(int* partials) : partials_(partials) {}

  template <class Kernel, class... Args>
  __device__ __forceinline__ void items(Kernel kernel, std::int64_t, const Args&... args) {
    DeviceBlock block;
    kernel(block, args...);
    wait();
  }
  template <class Kernel, class... Args>
  __device__ __forceinline__ void teams(Kernel kernel, int, std::int64_t capacity, const Args&... args) {
    items(kernel, capacity, args...);
  }
  template <class Kernel, class... Args>
  __device__ __forceinline__ void blocks(Kernel kernel, std::int64_t, int threads, std::size_t shared_bytes,
                                         const Args&... args) {
    const unsigned shared = (static_cast<unsigned>(shared_bytes) + 15u) & ~15u;
    PartOfBlock block(threads, shared);
    kernel(block, args...);
    wait();
  }

  template <class Body>
  __device__ __forceinline__ void if_nonzero(const int* flag, Body body) {
    if (agreed(flag)) body(*this);
  }
  template <class Body>
  __device__ __forceinline__ void while_nonzero(int* flag, Body body) {
    while (agreed(flag)) body(*this);
  }

  __device__ static constexpr bool overlaps() { return false; }
  template <class First, class Second, class AfterFirst = NoWork, class AfterBoth = NoWork>
  __device__ __forceinline__ void side_by_side(First first, Second second, AfterFirst after_first = {},
                                               AfterBoth after_both = {}) {
    first(*this);
    second(*this);
    after_first(*this);
    after_both(*this);
  }

  __device__ void exclusive_scan(const int* in, int* out, std::int64_t count, int* total, const int* used = nullptr) {
    DeviceBlock block;
    if (used != nullptr) count = *used;
    const Share share = share_of(block, count);
    int running = before(block, share, [&](std::int64_t i) { return in[i]; });
    for (std::int64_t tile = share.begin; tile < share.end; tile += block.size()) {
      const std::int64_t i = tile + block.thread();
      int found = 0;
      const int own = block.exclusive_scan(i < share.end ? in[i] : 0, found);
      if (i < share.end) out[i] = running + own;
      running += found;
    }
    if (share.last && block.thread() == 0) *total = running;
    wait();
  }
  __device__ void select(const unsigned char* flags, std::int64_t count, int* selected, int* selected_count,
                         const int* used = nullptr) {
    DeviceBlock block;
    if (used != nullptr) count = *used;
    const Share share = share_of(block, count);
    int running = before(block, share, [&](std::int64_t i) { return flags[i] != 0 ? 1 : 0; });
    for (std::int64_t tile = share.begin; tile < share.end; tile += block.size()) {
      const std::int64_t i = tile + block.thread();
      const bool wanted = i < share.end && flags[i] != 0;
      int found = 0;
      const int own = block.exclusive_scan(wanted ? 1 : 0, found);
      if (wanted) selected[running + own] = static_cast<int>(i);
      running += found;
    }
    if (share.last && block.thread() == 0) *selected_count = running;
    wait();
  }
  // Bitonic: each merge begins with the mirror image, so all comparisons go one way, and keys beyond the last, which
  // would be greater than all, need not be there.
  __device__ void sort_unique(unsigned long long* keys, int* count, std::int64_t) {
    DeviceBlock block;
    const std::int64_t n = *count;
    const auto exchange = [&](std::int64_t i, std::int64_t j) {
      if (j >= n) return;
      const unsigned long long a = keys[i], b = keys[j];
      if (a <= b) return;
      keys[i] = b;
      keys[j] = a;
    };
    for (std::int64_t width = 2; width < 2 * n; width *= 2) {
      for (std::int64_t distance = width / 2; distance > 0; distance /= 2) {
        for (std::int64_t pair = block.first(); 2 * pair < 2 * n; pair += block.stride()) {
          const std::int64_t i = pair / distance * (2 * distance) + pair % distance;
          if (i >= n) break;
          exchange(i, distance == width / 2 ? i / width * width + (width - 1 - i % width) : i + distance);
        }
        wait();
      }
    }
    if (block.index() == 0) {
      int kept = 0;
      unsigned long long last = ~0ull;  // of the tile before
      for (std::int64_t tile = 0; tile < n; tile += block.size()) {
        const std::int64_t i = tile + block.thread();
        const unsigned long long own = i < n ? keys[i] : ~0ull;
        const unsigned long long previous = i >= n ? ~0ull : i == tile ? last : keys[i - 1];
        if (tile + block.size() <= n) last = keys[tile + block.size() - 1];
        const bool wanted = i < n && own != previous;
        int found = 0;
        const int before_it = block.exclusive_scan(wanted ? 1 : 0, found);
        block.sync();  // all have read what is overwritten now
        if (wanted) keys[kept + before_it] = own;
        kept += found;
        block.sync();
      }
      if (block.thread() == 0) *count = kept;
    }
    wait();
  }
  // In whole ints.
  __device__ void clear(void* data, std::size_t bytes) {
    DeviceBlock block;
    int* const ints = static_cast<int*>(data);
    for (std::int64_t i = block.first(); i < static_cast<std::int64_t>(bytes / sizeof(int)); i += block.stride()) {
      ints[i] = 0;
    }
    wait();
  }

 private:
  __device__ static void wait() {
    if (gridDim.x == 1) return __syncthreads();
    cooperative_groups::this_grid().sync();
  }
  // What a flag was, for everybody; nobody goes on before all have read it.
  __device__ static bool agreed(const int* flag) {
    DeviceBlock block;
    const bool value = block.load(flag) != 0;
    wait();
    return value;
  }

  // Consecutive items of a block.
  struct Share {
    std::int64_t begin, end;
    bool last;
  };
  __device__ static Share share_of(const DeviceBlock& block, std::int64_t count) {
    const std::int64_t tiles = (count + block.size() - 1) / block.size();
    const std::int64_t part = (tiles + block.count() - 1) / block.count() * block.size();
    const auto limit = [&](std::int64_t i) { return i < count ? i : count; };
    return {limit(block.index() * part), limit((block.index() + 1) * part), block.index() == block.count() - 1};
  }
  // Σ value_of(i) over the shares of blocks before this one.
  template <class ValueOf>
  __device__ int before(DeviceBlock& block, const Share& share, ValueOf value_of) {
    if (block.count() == 1) return 0;
    int sum = 0;
    for (std::int64_t i = share.begin + block.thread(); i < share.end; i += block.size()) sum += value_of(i);
    sum = block.sum(sum);
    if (block.thread() == 0) block.store(&partials_[block.index()], sum);
    wait();
    sum = 0;
    for (int k = block.thread(); k < block.index(); k += block.size()) sum += block.load(&partials_[k]);
    sum = block.sum(sum);
    wait();  // partials_ may be used again
    return sum;
  }

  int* partials_;
};

// Cooperative, if its grid has several blocks.
__global__ void __launch_bounds__(kSpanThreads, 1)
    run_span_kernel(const __grid_constant__ DeviceView view, const __grid_constant__ Plan plan, Span span,
                    int* partials) {
  SpanLauncher launcher(partials);
  enqueue_span(launcher, view, plan, span, [](Stage) {});
}

}  // namespace

bool fits_span_kernel(const DeviceView& w, const Plan& plan) {
  // The largest cluster that split.cuh labels in a block: two numbers for each of its particles.
  return w.rotation_method == kNewton && plan.largest_cluster <= kMostInSpanCluster;
}

int prepare_span_kernel() {
  CUTPROOF_CUDA(cudaFuncSetAttribute(&run_span_kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, kSpanShared));
  int device = 0, count = 0;
  CUTPROOF_CUDA(cudaGetDevice(&device));
  CUTPROOF_CUDA(cudaDeviceGetAttribute(&count, cudaDevAttrMultiProcessorCount, device));
  return count < kMostSpanBlocks ? count : kMostSpanBlocks;
}

void launch_span(const DeviceView& w, const Plan& plan, Span span, int* partials, int blocks, cudaStream_t stream) {
  const auto kernel = &run_span_kernel;
  if (blocks == 1) {
    kernel<<<1, kSpanThreads, kSpanShared, stream>>>(w, plan, span, partials);
    return check_cuda(cudaGetLastError(), "run_span_kernel", __FILE__, __LINE__);
  }
  void* arguments[] = {const_cast<DeviceView*>(&w), const_cast<Plan*>(&plan), &span, &partials};
  check_cuda(cudaLaunchCooperativeKernel(reinterpret_cast<const void*>(kernel), dim3(static_cast<unsigned>(blocks)),
                                         dim3(kSpanThreads), arguments, kSpanShared, stream),
             "run_span_kernel", __FILE__, __LINE__);
}

}  // namespace cutproof::gpu
