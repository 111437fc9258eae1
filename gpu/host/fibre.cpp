#include "gpu/host/fibre.h"

#include <sys/mman.h>
#include <unistd.h>

#include <boost/context/detail/fcontext.hpp>
#include <new>

#include "gpu/host/sanitizers.h"

namespace cutproof::gpu {

namespace context = boost::context::detail;

namespace {

constexpr std::size_t kStackBytes = 256 * 1024;

// Who switched to whom. It lies on the stack that was left, so it lives until that stack is resumed.
struct Switch {
  Fibre* from;
  Fibre* to;
};

}  // namespace

struct Fibre::Entry {
  // The arrival of a switch: notes where the left fibre resumes, and returns the entered one.
  static Fibre* arrive(context::transfer_t transfer) {
    const auto& made = *static_cast<const Switch*>(transfer.data);
    made.from->at_ = transfer.fctx;
    Fibre* const entered = made.to;
#ifdef CUTPROOF_ASAN
    const void* bottom = nullptr;
    std::size_t bytes = 0;
    __sanitizer_finish_switch_fiber(entered->fake_stack_, &bottom, &bytes);
    if (made.from->mapping_ == nullptr) {
      made.from->bottom_ = bottom;
      made.from->bytes_ = bytes;
    }
#endif
    return entered;
  }
  static void begin(context::transfer_t transfer) {
    Fibre* const self = arrive(transfer);
    self->body_(self->argument_);
  }
};

Fibre::Fibre(void (*body)(void*), void* argument) : body_(body), argument_(argument) {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  void* const mapping = mmap(nullptr, kStackBytes + page, PROT_READ | PROT_WRITE,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_STACK, -1, 0);
  if (mapping == MAP_FAILED) throw std::bad_alloc();
  // Stacks grow downwards: an overflow is a segmentation fault, not silent damage.
  if (mprotect(mapping, page, PROT_NONE) != 0) {
    munmap(mapping, kStackBytes + page);
    throw std::bad_alloc();
  }
  mapping_ = mapping;
  mapped_ = kStackBytes + page;
  bottom_ = static_cast<std::byte*>(mapping) + page;
  bytes_ = kStackBytes;
  at_ = context::make_fcontext(static_cast<std::byte*>(mapping) + mapped_, bytes_, &Entry::begin);
#ifdef CUTPROOF_TSAN
  tsan_ = __tsan_create_fiber(0);
#endif
}

Fibre::~Fibre() {
  if (mapping_ == nullptr) return;
#ifdef CUTPROOF_ASAN
  ASAN_UNPOISON_MEMORY_REGION(bottom_, bytes_);
#endif
#ifdef CUTPROOF_TSAN
  __tsan_destroy_fiber(tsan_);
#endif
  munmap(mapping_, mapped_);
}

void Fibre::announce_thread() {
#ifdef CUTPROOF_TSAN
  tsan_ = __tsan_get_current_fiber();
#endif
}

void Fibre::switch_to(Fibre& to) {
  Switch made{this, &to};
#ifdef CUTPROOF_ASAN
  __sanitizer_start_switch_fiber(&fake_stack_, to.bottom_, to.bytes_);
#endif
#ifdef CUTPROOF_TSAN
  __tsan_switch_to_fiber(to.tsan_, 0);
#endif
  Entry::arrive(context::jump_fcontext(to.at_, &made));
}

}  // namespace cutproof::gpu
