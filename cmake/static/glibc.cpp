// What a program linked on Debian 12 asks of glibc 2.35 and 2.36, in terms of 2.34.
#include <dlfcn.h>
#include <link.h>
#include <sys/random.h>

#include <cstddef>
#include <cstdint>

namespace {

struct Search {
  uintptr_t address;
  dl_find_object* found;
};

// Whether a library, or the program, has the address.
int look(dl_phdr_info* object, std::size_t, void* of) {
  const auto& [address, found] = *static_cast<const Search*>(of);
  bool is_there = false;
  *found = {};
  for (int k = 0; k < object->dlpi_phnum; ++k) {
    const ElfW(Phdr)& part = object->dlpi_phdr[k];
    const uintptr_t begin = object->dlpi_addr + part.p_vaddr;
    if (part.p_type == PT_GNU_EH_FRAME) found->dlfo_eh_frame = reinterpret_cast<void*>(begin);
    if (part.p_type != PT_LOAD || address < begin || address - begin >= part.p_memsz) continue;
    is_there = true;
    found->dlfo_map_start = reinterpret_cast<void*>(begin);
    found->dlfo_map_end = reinterpret_cast<void*>(begin + part.p_memsz);
  }
  return is_there ? 1 : 0;
}

}  // namespace

extern "C" {

// Where an exception finds how to unwind the code at an address. libgcc of GCC 12 reads dlfo_eh_frame alone.
__attribute__((visibility("hidden"))) int _dl_find_object(void* address, dl_find_object* found) noexcept {
  Search search = {reinterpret_cast<uintptr_t>(address), found};
  return dl_iterate_phdr(look, &search) == 1 && found->dlfo_eh_frame != nullptr ? 0 : -1;
}

// std::random_device asks for it.
__attribute__((visibility("hidden"))) uint32_t arc4random() noexcept {
  uint32_t number = 0;
  while (getrandom(&number, sizeof number, 0) != sizeof number) {
  }
  return number;
}

// The hypot of 2.35 is that of before, without its care for SVID. The linker calls this one (--wrap).
double hypot_of_before(double x, double y);
__asm__(".symver hypot_of_before, hypot@GLIBC_2.2.5");
double __wrap_hypot(double x, double y) { return hypot_of_before(x, y); }

}  // extern "C"
