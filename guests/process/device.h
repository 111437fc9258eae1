// Arrays in the memory of a CUDA device, through the driver that is there when the guest runs: nothing of CUDA is
// linked.
#pragma once
#include <cstdint>
#include <string>

// The primary context of device 0, which the plugin's runtime shares. False: there is none, and why.
bool open_device(std::string& problem);
void* device_stream();
// Until all that was enqueued has ended. False: something failed.
bool wait_for_device(std::string& problem);
// The last failure.
const std::string& device_problem();

class DeviceArray {
 public:
  // A copy of `bytes` bytes, with canaries before and behind.
  bool make(const unsigned char* from, int64_t bytes);
  // Reallocates and keeps the contents that fit. New bytes are filled with 0xff.
  bool grow(int64_t bytes, int64_t old_bytes);
  // Copies the contents; `given`: they must equal those at `to`. Returns the defect, or "".
  std::string bring_back(unsigned char* to, int64_t bytes, bool given);
  void free();
  void* data() const;

 private:
  bool reserve(int64_t bytes);
  uint64_t memory_ = 0;
};
