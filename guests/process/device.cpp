#include "guests/process/device.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "guests/wire.h"

namespace {

namespace wire = cutproof::guests::wire;

// Of cuda.h, whose functions keep their meaning.
using Result = int;
using Pointer = unsigned long long;
struct Driver {
  Result (*init)(unsigned) = nullptr;
  Result (*device_get)(int*, int) = nullptr;
  Result (*retain)(void**, int) = nullptr;
  Result (*set_current)(void*) = nullptr;
  Result (*stream_create)(void**, unsigned) = nullptr;
  Result (*synchronize)() = nullptr;
  Result (*allocate)(Pointer*, std::size_t) = nullptr;
  Result (*release)(Pointer) = nullptr;
  Result (*to_device)(Pointer, const void*, std::size_t) = nullptr;
  Result (*to_host)(void*, Pointer, std::size_t) = nullptr;
  Result (*between)(Pointer, Pointer, std::size_t) = nullptr;
  Result (*set)(Pointer, unsigned char, std::size_t) = nullptr;
  Result (*name_of)(Result, const char**) = nullptr;
} driver;
void* stream = nullptr;
std::string last_problem;

bool works(Result result, const char* what) {
  if (result == 0) return true;
  const char* name = nullptr;
  if (driver.name_of != nullptr) driver.name_of(result, &name);
  last_problem = std::string(what) + ": " + (name != nullptr ? name : "error " + std::to_string(result));
  return false;
}

template <class F>
bool find(void* library, F& function, const char* name) {
  function = reinterpret_cast<F>(dlsym(library, name));
  if (function == nullptr) last_problem = std::string("the CUDA driver has no ") + name;
  return function != nullptr;
}

}  // namespace

const std::string& device_problem() { return last_problem; }
void* device_stream() { return stream; }

bool open_device(std::string& problem) {
  void* const library = dlopen("libcuda.so.1", RTLD_NOW);
  bool fine = library != nullptr;
  if (!fine) last_problem = "it needs a CUDA device, and there is no CUDA driver here";
  fine = fine && find(library, driver.init, "cuInit") && find(library, driver.device_get, "cuDeviceGet") &&
         find(library, driver.retain, "cuDevicePrimaryCtxRetain") &&
         find(library, driver.set_current, "cuCtxSetCurrent") &&
         find(library, driver.stream_create, "cuStreamCreate") &&
         find(library, driver.synchronize, "cuCtxSynchronize") && find(library, driver.allocate, "cuMemAlloc_v2") &&
         find(library, driver.release, "cuMemFree_v2") && find(library, driver.to_device, "cuMemcpyHtoD_v2") &&
         find(library, driver.to_host, "cuMemcpyDtoH_v2") && find(library, driver.between, "cuMemcpyDtoD_v2") &&
         find(library, driver.set, "cuMemsetD8_v2") && find(library, driver.name_of, "cuGetErrorName");
  int device = 0;
  void* context = nullptr;
  fine = fine && works(driver.init(0), "it needs a CUDA device: cuInit") &&
         works(driver.device_get(&device, 0), "it needs a CUDA device: cuDeviceGet") &&
         works(driver.retain(&context, device), "cuDevicePrimaryCtxRetain") &&
         works(driver.set_current(context), "cuCtxSetCurrent") &&
         works(driver.stream_create(&stream, 1), "cuStreamCreate");
  if (!fine) problem = last_problem;
  return fine;
}

bool wait_for_device(std::string& problem) {
  if (works(driver.synchronize(), "the CUDA device failed")) return true;
  problem = last_problem;
  return false;
}

bool DeviceArray::reserve(int64_t bytes) {
  Pointer memory = 0;
  const auto whole = static_cast<std::size_t>(bytes + 2 * wire::kDeviceCanary);
  if (!works(driver.allocate(&memory, whole), "cuMemAlloc")) return false;
  memory_ = memory;
  // Canaries first; the array's own bytes 0xff, so that unwritten bytes show.
  return works(driver.set(memory_, wire::kCanary, whole), "cuMemsetD8") &&
         (bytes == 0 ||
          works(driver.set(memory_ + wire::kDeviceCanary, 0xff, static_cast<std::size_t>(bytes)), "cuMemsetD8"));
}

void* DeviceArray::data() const { return reinterpret_cast<void*>(memory_ + wire::kDeviceCanary); }

bool DeviceArray::make(const unsigned char* from, int64_t bytes) {
  return reserve(bytes) &&
         (bytes == 0 || works(driver.to_device(memory_ + wire::kDeviceCanary, from, static_cast<std::size_t>(bytes)),
                              "cuMemcpyHtoD"));
}

bool DeviceArray::grow(int64_t bytes, int64_t old_bytes) {
  DeviceArray larger;
  // Work on the old memory may still be under way.
  const auto kept = static_cast<std::size_t>(std::min(bytes, old_bytes));
  if (!works(driver.synchronize(), "the CUDA device failed") || !larger.reserve(bytes)) return false;
  if (kept > 0 && !works(driver.between(larger.memory_ + wire::kDeviceCanary, memory_ + wire::kDeviceCanary, kept),
                         "cuMemcpyDtoD")) {
    return false;
  }
  if (!works(driver.synchronize(), "the CUDA device failed")) return false;
  free();
  memory_ = larger.memory_;
  return true;
}

std::string DeviceArray::bring_back(unsigned char* to, int64_t bytes, bool given) {
  std::vector<unsigned char> all(static_cast<std::size_t>(bytes + 2 * wire::kDeviceCanary));
  if (!works(driver.to_host(all.data(), memory_, all.size()), "cuMemcpyDtoH")) return last_problem;
  const unsigned char* const own = all.data() + wire::kDeviceCanary;
  for (int64_t k = 1; k <= wire::kDeviceCanary; ++k) {
    if (own[-k] != wire::kCanary) {
      return "byte " + std::to_string(k) + " before its beginning was written to";
    }
  }
  for (int64_t k = 0; k < wire::kDeviceCanary; ++k) {
    if (own[bytes + k] != wire::kCanary) return "byte " + std::to_string(k + 1) + " behind its end was written to";
  }
  if (given) {
    if (std::memcmp(to, own, static_cast<std::size_t>(bytes)) != 0) return "it is an input, and was written to";
  } else if (bytes > 0) {
    std::memcpy(to, own, static_cast<std::size_t>(bytes));
  }
  return {};
}

void DeviceArray::free() {
  if (memory_ != 0) driver.release(memory_);
  memory_ = 0;
}
