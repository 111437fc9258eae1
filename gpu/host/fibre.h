// Stackful fibres (Boost.Context), announced to AddressSanitizer and ThreadSanitizer.
#pragma once
#include <cstddef>

namespace cutproof::gpu {

class Fibre {
 public:
  // The stack of the calling operating-system thread. announce_thread() says which thread that is.
  Fibre() = default;
  // A stack of 256 KiB of address space, of which only touched pages take memory. The first switch to it calls
  // body(argument), which must not return. Throws std::bad_alloc.
  Fibre(void (*body)(void* argument), void* argument);
  ~Fibre();
  Fibre(const Fibre&) = delete;
  Fibre& operator=(const Fibre&) = delete;

  // For the fibre made without a body, each time that another thread may be on it.
  void announce_thread();
  // Resumes `to`; returns when another fibre resumes this one, on which the caller must be.
  void switch_to(Fibre& to);

 private:
  struct Entry;  // where switches arrive

  void (*body_)(void*) = nullptr;
  void* argument_ = nullptr;
  void* at_ = nullptr;  // where it resumes
  void* mapping_ = nullptr;
  std::size_t mapped_ = 0;
  const void* bottom_ = nullptr;  // of the stack proper, above the guard page
  std::size_t bytes_ = 0;
  void* fake_stack_ = nullptr;  // AddressSanitizer's
  void* tsan_ = nullptr;        // ThreadSanitizer's
};

}  // namespace cutproof::gpu
