#include "tests/cli/failing_allocations.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <link.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>

// The C library's own, under the names that do not lead back here.
extern "C" {
void* __libc_malloc(size_t);
void* __libc_calloc(size_t, size_t);
void* __libc_realloc(void*, size_t);
void* __libc_memalign(size_t, size_t);
void __libc_free(void*);
}

namespace cutproof::tests {
namespace {

std::atomic<AllocationControl*> current{nullptr};
std::atomic<int64_t> bytes_in_use{0};
std::atomic<int64_t> blocks_in_use{0};

// The code of libraries whose allocations have no number.
struct Code {
  uintptr_t begin, end;
};
constexpr int kMostSpared = 16;
Code spared[kMostSpared];
std::atomic<int> spared_count{0};

int find_spared(dl_phdr_info* info, size_t, void*) {
  static constexpr const char* kNames[] = {"/libhdf5", "/libz.", "/libsz.", "/libaec."};
  for (const char* name : kNames) {
    if (std::strstr(info->dlpi_name, name) == nullptr) continue;
    for (int k = 0; k < info->dlpi_phnum; ++k) {
      const ElfW(Phdr)& part = info->dlpi_phdr[k];
      if (part.p_type != PT_LOAD || (part.p_flags & PF_X) == 0 || spared_count == kMostSpared) continue;
      const uintptr_t begin = info->dlpi_addr + part.p_vaddr;
      spared[spared_count++] = {begin, begin + part.p_memsz};
    }
  }
  return 0;
}

bool is_spared(const void* caller) {
  const auto at = reinterpret_cast<uintptr_t>(caller);
  for (int k = 0; k < spared_count; ++k) {
    if (at >= spared[k].begin && at < spared[k].end) return true;
  }
  return false;
}

void raise_to(std::atomic<int64_t>& most, int64_t value) {
  int64_t known = most.load(std::memory_order_relaxed);
  while (known < value && !most.compare_exchange_weak(known, value, std::memory_order_relaxed)) {
  }
}

// Whether the allocation of so many bytes more for `caller` is to fail.
bool fails(size_t bytes, const void* caller) {
  AllocationControl* const control = current.load(std::memory_order_acquire);
  if (control == nullptr) return false;
  bool failing = false;
  const int64_t wanted = bytes_in_use.load(std::memory_order_relaxed) + static_cast<int64_t>(bytes);
  const int64_t limit = control->limit.load(std::memory_order_relaxed);
  if (limit != 0 && wanted > limit) {
    int64_t none = 0;
    control->wanted.compare_exchange_strong(none, wanted, std::memory_order_relaxed);
    failing = true;
  } else {
    raise_to(control->most, wanted);
  }
  if (!is_spared(caller)) {
    const uint64_t number = control->made.fetch_add(1, std::memory_order_relaxed) + 1;
    const uint64_t from = control->fail_at.load(std::memory_order_relaxed);
    failing =
        failing || (from != 0 && number >= from && number - from < control->fail_count.load(std::memory_order_relaxed));
  }
  if (!failing) return false;
  control->failed.fetch_add(1, std::memory_order_relaxed);
  errno = ENOMEM;
  return true;
}

void* taken(void* block) {
  if (block == nullptr) return nullptr;
  bytes_in_use.fetch_add(static_cast<int64_t>(malloc_usable_size(block)), std::memory_order_relaxed);
  blocks_in_use.fetch_add(1, std::memory_order_relaxed);
  return block;
}

void given_back(void* block) {
  bytes_in_use.fetch_sub(static_cast<int64_t>(malloc_usable_size(block)), std::memory_order_relaxed);
  blocks_in_use.fetch_sub(1, std::memory_order_relaxed);
}

void* allocate(size_t bytes, const void* caller) {
  return fails(bytes, caller) ? nullptr : taken(__libc_malloc(bytes));
}
void* allocate_aligned(size_t alignment, size_t bytes, const void* caller) {
  return fails(bytes, caller) ? nullptr : taken(__libc_memalign(alignment, bytes));
}

using Main = int (*)(int, char**, char**);
Main real_main = nullptr;

// The control is mapped from the file that the environment names.
int main_with_control(int argc, char** argv, char** environment) {
  const char* const file = std::getenv(kControlVariable);
  if (file == nullptr) return real_main(argc, argv, environment);
  const int descriptor = open(file, O_RDWR | O_CLOEXEC);
  void* const memory =
      descriptor < 0 ? MAP_FAILED
                     : ::mmap(nullptr, sizeof(AllocationControl), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  if (memory == MAP_FAILED) {
    std::perror(file);
    std::_Exit(125);
  }
  close(descriptor);
  control_allocations(static_cast<AllocationControl*>(memory));
  return real_main(argc, argv, environment);
}

}  // namespace

void control_allocations(AllocationControl* control) {
  if (spared_count == 0) dl_iterate_phdr(find_spared, nullptr);
  current.store(control, std::memory_order_release);
}

int64_t live_blocks() { return blocks_in_use.load(std::memory_order_relaxed); }

}  // namespace cutproof::tests

// Sanitizers bring their own allocator; then nothing is taken over, and the tests say that they do not run.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

using namespace cutproof::tests;

extern "C" {

void* malloc(size_t bytes) { return allocate(bytes, __builtin_return_address(0)); }
void* calloc(size_t count, size_t bytes) {
  return fails(count * bytes, __builtin_return_address(0)) ? nullptr : taken(__libc_calloc(count, bytes));
}
void* realloc(void* block, size_t bytes) {
  if (block == nullptr) return allocate(bytes, __builtin_return_address(0));
  if (bytes == 0) {
    free(block);
    return nullptr;
  }
  if (fails(bytes, __builtin_return_address(0))) return nullptr;
  given_back(block);
  void* const moved = __libc_realloc(block, bytes);
  taken(moved != nullptr ? moved : block);
  return moved;
}
void* memalign(size_t alignment, size_t bytes) {
  return allocate_aligned(alignment, bytes, __builtin_return_address(0));
}
void* aligned_alloc(size_t alignment, size_t bytes) {
  return allocate_aligned(alignment, bytes, __builtin_return_address(0));
}
int posix_memalign(void** block, size_t alignment, size_t bytes) {
  void* const made = allocate_aligned(alignment, bytes, __builtin_return_address(0));
  if (made == nullptr) return ENOMEM;
  *block = made;
  return 0;
}
void free(void* block) {
  if (block == nullptr) return;
  given_back(block);
  __libc_free(block);
}
// The C library's calls malloc, which would then not know on whose behalf.
char* strdup(const char* text) {
  const size_t bytes = std::strlen(text) + 1;
  void* const copy = allocate(bytes, __builtin_return_address(0));
  return copy == nullptr ? nullptr : static_cast<char*>(std::memcpy(copy, text, bytes));
}

// Stacks of fibres. (The C library's own mappings, such as stacks of threads, do not come by here.)
void* mmap(void* at, size_t bytes, int protection, int flags, int descriptor, off_t offset) {
  if (fails(bytes, __builtin_return_address(0))) return MAP_FAILED;
  auto* const mapped = reinterpret_cast<void*>(syscall(SYS_mmap, at, bytes, protection, flags, descriptor, offset));
  if (mapped == MAP_FAILED) return mapped;
  bytes_in_use.fetch_add(static_cast<int64_t>(bytes), std::memory_order_relaxed);
  blocks_in_use.fetch_add(1, std::memory_order_relaxed);
  return mapped;
}
int munmap(void* at, size_t bytes) {
  bytes_in_use.fetch_sub(static_cast<int64_t>(bytes), std::memory_order_relaxed);
  blocks_in_use.fetch_sub(1, std::memory_order_relaxed);
  return static_cast<int>(syscall(SYS_munmap, at, bytes));
}

// What every program begins with: after it nothing but main is left to do.
int __libc_start_main(int (*main)(int, char**, char**), int argc, char** argv, void (*init)(), void (*fini)(),
                      void (*rtld_fini)(), void* stack_end) {
  using Start = int (*)(int (*)(int, char**, char**), int, char**, void (*)(), void (*)(), void (*)(), void*);
  real_main = main;
  const auto start = reinterpret_cast<Start>(dlsym(RTLD_NEXT, "__libc_start_main"));
  return start(&main_with_control, argc, argv, init, fini, rtld_fini, stack_end);
}
}

#endif
