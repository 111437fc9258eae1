// Disjoint sets that many threads join at once, as ECL-CC does (Jaiganesh and Burtscher 2018). parent[i] <= i, a root
// is its own parent, and a set is known by its smallest member.
//
// Every schedule gives the same roots. parent[i] only ever names an ancestor of i, and an i with another parent never
// becomes a root again. So any value that a thread reads, however old, leads upwards. Only compare-and-swap hooks a
// root, and it fails if that is no longer a root. Path shortening writes only to non-roots, so it never undoes a hook.
#pragma once
#include "gpu/launch/block.h"

namespace cutproof::gpu {

// Where the sets lie. In shared memory race detectors report plain reads beside another thread's writes as hazards, and
// atomics cost no more; in global memory relaxed loads and stores suffice.
enum class Memory { global, shared };

template <Memory memory, class Block>
CUTPROOF_DEVICE int peek(Block& block, int* parent) {
  if constexpr (memory == Memory::shared) return block.atomic_or(parent, 0);
  return block.load(parent);
}
template <Memory memory, class Block>
CUTPROOF_DEVICE void poke(Block& block, int* parent, int value) {
  if constexpr (memory == Memory::shared) {
    block.atomic_exchange(parent, value);
  } else {
    block.store(parent, value);
  }
}

// The root of i at some moment of the call. Halves the path on the way.
template <Memory memory = Memory::global, class Block>
CUTPROOF_DEVICE int find_root(Block& block, int* parent, int i) {
  int at = peek<memory>(block, &parent[i]);
  if (at == i) return i;
  int below = i;  // its parent was `at`, so it is no root
  for (int above = peek<memory>(block, &parent[at]); above != at; above = peek<memory>(block, &parent[at])) {
    poke<memory>(block, &parent[below], above);
    below = at;
    at = above;
  }
  return at;
}

// Unites the sets of i and j.
template <Memory memory = Memory::global, class Block>
CUTPROOF_DEVICE void unite(Block& block, int* parent, int i, int j) {
  int a = find_root<memory>(block, parent, i);
  int b = find_root<memory>(block, parent, j);
  while (a != b) {
    const int high = a < b ? b : a, low = a < b ? a : b;
    const int found = block.atomic_cas(&parent[high], high, low);
    if (found == high) return;
    a = found;  // hooked meanwhile: continue from its parent, which is smaller
    b = low;
  }
}

// The root of i after the last union. Changes nothing, so roots may be stored into `parent` meanwhile.
template <class Block>
CUTPROOF_DEVICE int final_root(Block& block, const int* parent, int i) {
  int at = i;
  for (int above = block.load(&parent[at]); above != at; above = block.load(&parent[at])) at = above;
  return at;
}

}  // namespace cutproof::gpu
