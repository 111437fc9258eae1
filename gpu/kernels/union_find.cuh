// Disjoint sets that many threads join at once, in the manner of ECL-CC (Jaiganesh and Burtscher 2018): parent[i] <= i,
// a root is its own parent, and a set is known by its smallest member.
//
// Why every schedule gives the same roots: parent[i] only ever names an ancestor of i, and once i has a parent other
// than itself it never becomes a root again. So whatever a thread reads, however old, leads upwards; a root is hooked
// by compare-and-swap alone, which fails if it has stopped being one; and shortening a path writes to members that are
// no roots, so it never undoes a hook.
#pragma once
#include "gpu/launch/block.h"

namespace cutproof::gpu {

// Where the sets lie. In shared memory plain reads beside another thread's writes are hazards to the tools that look
// for them, and atomics cost no more there; in global memory relaxed loads and stores do.
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
  int below = i;  // its parent was `at`: it is no root
  for (int above = peek<memory>(block, &parent[at]); above != at; above = peek<memory>(block, &parent[at])) {
    poke<memory>(block, &parent[below], above);
    below = at;
    at = above;
  }
  return at;
}

// Makes one set of those of i and j.
template <Memory memory = Memory::global, class Block>
CUTPROOF_DEVICE void unite(Block& block, int* parent, int i, int j) {
  int a = find_root<memory>(block, parent, i);
  int b = find_root<memory>(block, parent, j);
  while (a != b) {
    const int high = a < b ? b : a, low = a < b ? a : b;
    const int found = block.atomic_cas(&parent[high], high, low);
    if (found == high) return;
    a = found;  // it has been hooked meanwhile: go on from its parent, which is smaller
    b = low;
  }
}

// The root of i when nothing is united any more. Changes nothing, so roots may be stored into `parent` meanwhile.
template <class Block>
CUTPROOF_DEVICE int final_root(Block& block, const int* parent, int i) {
  int at = i;
  for (int above = block.load(&parent[at]); above != at; above = block.load(&parent[at])) at = above;
  return at;
}

}  // namespace cutproof::gpu
