#include "benchmarks/memory.h"

#include <malloc.h>

#if CUTPROOF_HAS_CUDA
#include "benchmarks/device_limits.h"
#endif

namespace cutproof::benchmarks {

std::optional<int64_t> bytes_in_use([[maybe_unused]] const harness::BackendDescriptor& backend) {
#if CUTPROOF_HAS_CUDA
  if (backend.needs_device()) return gpu::device_bytes_in_use();
#endif
#ifdef __GLIBC__
  const struct mallinfo2 info = mallinfo2();
  // Zero if another allocator, such as a sanitizer's, has replaced this one.
  if (info.uordblks + info.hblkhd > 0) return static_cast<int64_t>(info.uordblks + info.hblkhd);
#endif
  return std::nullopt;
}

}  // namespace cutproof::benchmarks
