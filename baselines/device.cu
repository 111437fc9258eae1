// Operations of Device that call CUB. It compiles slowly, so no simulator includes it.
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_segmented_reduce.cuh>

#include "baselines/dissection.h"
#include "baselines/parallel.h"

namespace cutproof::baselines {

void require_device() { check(cudaFree(nullptr)); }

template <class F>
void Device::with_room(F call) {
  std::size_t bytes = 0;
  check(call(nullptr, bytes));
  if (room_.size() < bytes) room_ = Array<unsigned char>(bytes);
  check(call(room_.data(), bytes));
}

void Device::sort(Array<uint32_t>& keys, Array<int32_t>& values) {
  if (spare_keys_.size() != keys.size()) {
    spare_keys_ = Array<uint32_t>(keys.size());
    spare_values_ = Array<int32_t>(keys.size());
  }
  with_room([&](void* room, std::size_t& bytes) {
    return cub::DeviceRadixSort::SortPairs(room, bytes, keys.data(), spare_keys_.data(), values.data(),
                                           spare_values_.data(), static_cast<int>(keys.size()), 0, 32, stream_);
  });
  std::swap(keys, spare_keys_);
  std::swap(values, spare_values_);
}

void Device::scan(const Array<int32_t>& counts, Array<int32_t>& starts) {
  check(cudaMemsetAsync(starts.data(), 0, sizeof(int32_t), stream_));
  with_room([&](void* room, std::size_t& bytes) {
    return cub::DeviceScan::InclusiveSum(room, bytes, counts.data(), starts.data() + 1, static_cast<int>(counts.size()),
                                         stream_);
  });
}

void Device::sums(const Array<float>& values, const Array<int32_t>& starts, Array<float>& out) {
  with_room([&](void* room, std::size_t& bytes) {
    return cub::DeviceSegmentedReduce::Sum(room, bytes, values.data(), out.data(), static_cast<int>(starts.size() - 1),
                                           starts.data(), starts.data() + 1, stream_);
  });
}

}  // namespace cutproof::baselines
