// Ascending lists of distinct numbers: making, searching and uniting them. Merge and expand use them for members of
// clusters. A list is any type whose operator[] gives numbers.
#pragma once
#include "gpu/launch/block.h"
#include "gpu/state/device_view.h"

namespace cutproof::gpu {

inline constexpr int kListThreads = 512;

// give(n, k) for each wanted k in [begin, end), where n is `before` plus the number of earlier wanted ones. Returns the
// n behind the last. Reached by all threads of one block. wanted() is asked once for each k, a tile ahead of give(), so
// it must not depend on what give() writes.
template <class Block, class Wanted, class Give>
CUTPROOF_DEVICE int count_off(Block& block, int begin, int end, int before, Wanted wanted, Give give) {
  constexpr int kEach = 8;  // neighbours of a thread
  const auto wanted_from = [&](int first) {
    unsigned bits = 0;
    for (int k = 0; k < kEach; ++k) bits |= first + k < end && wanted(first + k) ? 1u << k : 0u;
    return bits;
  };
  unsigned next = wanted_from(begin + kEach * block.thread());
  for (int tile = begin; tile < end; tile += kEach * block.size()) {
    const int first = tile + kEach * block.thread();
    const unsigned is = next;
    next = wanted_from(first + kEach * block.size());  // read while this tile is counted
    int own = 0, total = 0;
    for (int k = 0; k < kEach; ++k) own += is >> k & 1u;
    int n = before + block.exclusive_scan(own, total);
    for (int k = 0; k < kEach; ++k) {
      if (is >> k & 1u) give(n++, first + k);
    }
    before += total;
  }
  return before;
}

// The number of entries less than `value`.
template <class List, class Value>
CUTPROOF_DEVICE inline int lower_bound(const List& list, int size, Value value) {
  int low = 0;
  while (size > 0) {
    const int half = size / 2;
    if (list[low + half] < value) {
      low += half + 1;
      size -= half + 1;
    } else {
      size = half;
    }
  }
  return low;
}

template <class List>
CUTPROOF_DEVICE inline bool contains(const List& list, int size, int value) {
  const int place = lower_bound(list, size, value);
  return place < size && list[place] == value;
}

// Counts, for the whole block, the numbers of `list` missing in `other`.
template <class Block, class List, class Other>
CUTPROOF_DEVICE int count_missing(Block& block, const List& list, int size, const Other& other, int other_size) {
  int missing = 0;
  for (int k = block.thread(); k < size; k += block.size()) missing += !contains(other, other_size, list[k]);
  return block.sum(missing);
}

// Writes numbers of `list` to their places in the union of `list` and `other`: all, or only those missing in `other`.
template <class Block, class List, class Other>
CUTPROOF_DEVICE int write_part_of_union(Block& block, const List& list, int size, const Other& other, int other_size,
                                        bool common_too, int* out) {
  int common = 0;  // numbers common to both, so far
  for (int begin = 0; begin < size; begin += block.size()) {
    const int k = begin + block.thread();
    const int value = k < size ? list[k] : 0;
    const int place = k < size ? lower_bound(other, other_size, value) : 0;
    const bool in_both = k < size && place < other_size && other[place] == value;
    int found = 0;
    const int before = block.exclusive_scan(in_both ? 1 : 0, found);
    if (k < size && (common_too || !in_both)) out[k + place - common - before] = value;
    common += found;
  }
  return common;
}

// Writes the union of `a` and `b` to `out`, which overlaps neither, and returns its size. Called by all threads of the
// block, which see the result after the next sync().
template <class Block, class A, class B>
CUTPROOF_DEVICE int write_union(Block& block, const A& a, int a_size, const B& b, int b_size, int* out) {
  write_part_of_union(block, a, a_size, b, b_size, true, out);
  const int common = write_part_of_union(block, b, b_size, a, a_size, false, out);
  return a_size + b_size - common;
}

template <class Block>
CUTPROOF_DEVICE void mark_unsorted(Block& block, const DeviceView& w, int p) {
  block.store(&w.unsorted[p / kParticleTile], 1);
}

// visit(h, slot) for the places h of p's memberships; slot may be -1. Several are read before the first visit: one by
// one, each would wait for the previous one.
template <class Block, class Visit>
CUTPROOF_DEVICE void each_membership(Block& block, const DeviceView& w, int p, Visit visit) {
  constexpr int kAtOnce = 4;
  const int end = w.membership_begin[p + 1];
  CUTPROOF_ROLLED for (int first = w.membership_begin[p]; first < end; first += kAtOnce) {
    int slot[kAtOnce];
    for (int t = 0; t < kAtOnce; ++t) slot[t] = block.load(&w.memberships[first + t < end ? first + t : first]);
    for (int t = 0; t < kAtOnce; ++t) {
      if (first + t < end) visit(first + t, slot[t]);
    }
  }
}

// Puts a particle's memberships in ascending order, -1 last.
CUTPROOF_DEVICE inline void sort_memberships(const DeviceView& w, int64_t p) {
  for (int end = w.membership_begin[p] + 1; end < w.membership_begin[p + 1]; ++end) {
    const int moving = w.memberships[end];
    int h = end;
    for (; h > w.membership_begin[p] && static_cast<unsigned>(w.memberships[h - 1]) > static_cast<unsigned>(moving);
         --h) {
      w.memberships[h] = w.memberships[h - 1];
    }
    w.memberships[h] = moving;
  }
}

}  // namespace cutproof::gpu
