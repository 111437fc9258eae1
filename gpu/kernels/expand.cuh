// Expand (method.md §7): clusters take in particles beyond the edges of G that leave them. Bodies expand until
// edge_cover has been done once or, under `published`, in every frame that cuts.
//
// An addition is a pair (cluster, particle). All additions are found on the initial clusters, then carried out at once.
// Enlarged lists go behind the present ones, and all memberships are laid out anew. Nothing is written until everything
// is known to fit.
#pragma once
#include <cstdint>

#include "gpu/kernels/merge.cuh"
#include "gpu/kernels/rest_frames.cuh"
#include "gpu/kernels/sorted_lists.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/state/device_view.h"
#include "gpu/state/plan.h"

namespace cutproof::gpu {

// After a fault nothing expands: the faulty stage may have left dead particles in clusters.
CUTPROOF_BOTH inline bool expands_now(const DeviceView& w, int b) {
  if (!cut_now(w, b) || w.counters->fault != 0) return false;
  const ExpandRule rule = w.body[b].expand_rule;
  return rule == ExpandRule::published || (rule == ExpandRule::edge_cover && !w.edge_covered[b]);
}

CUTPROOF_BOTH inline int cluster_of(unsigned long long addition) { return static_cast<int>(addition >> 32); }
CUTPROOF_BOTH inline int particle_of(unsigned long long addition) { return static_cast<int>(addition & 0xffffffffu); }

CUTPROOF_DEVICE inline bool cluster_holds(const DeviceView& w, int s, int p) {
  for (int h = w.membership_begin[p]; h < w.membership_begin[p + 1]; ++h) {
    if (w.memberships[h] == s) return true;
  }
  return false;
}
CUTPROOF_DEVICE inline bool share_a_cluster(const DeviceView& w, int p, int q) {
  for (int h = w.membership_begin[p]; h < w.membership_begin[p + 1]; ++h) {
    if (w.memberships[h] >= 0 && cluster_holds(w, w.memberships[h], q)) return true;
  }
  return false;
}

// Keeps counting beyond the capacity, so that check_additions sees it.
template <class Block>
CUTPROOF_DEVICE void add_addition(Block& block, const DeviceView& w, int s, int p) {
  const int place = block.atomic_add(&w.counters->additions, 1);
  if (place < w.addition_capacity) {
    w.additions[place] = static_cast<unsigned long long>(s) << 32 | static_cast<unsigned>(p);
  }
}

template <class Block>
CUTPROOF_DEVICE void begin_expand_kernel(Block& block, DeviceView w) {
  if (block.first() != 0) return;
  Counters& c = *w.counters;
  c.additions = 0;
  c.additions_before = 0;
  c.layer = 0;
  c.changed = 0;
}
CUTPROOF_KERNEL(begin_expand_kernel);

// edge_cover: for every edge of G that no cluster contains, the smallest cluster at its ends takes in the other end; of
// equally small ones the lowest number (slot).
template <class Block>
CUTPROOF_DEVICE void cover_edges_kernel(Block& block, DeviceView w) {
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i), b = w.body_of[p];
    if (!alive(w, p) || w.body[b].expand_rule != ExpandRule::edge_cover || !expands_now(w, b)) continue;
    for (int direction = 0; direction < 6; direction += 2) {
      const int q = neighbour(w, w.body[b], p, direction);
      if (q < 0 || !alive(w, q) || share_a_cluster(w, p, q)) continue;
      int smallest = -1, outside = -1;
      for (const int inside : {p, q}) {
        for (int h = w.membership_begin[inside]; h < w.membership_begin[inside + 1]; ++h) {
          const int s = w.memberships[h];
          if (s < 0) continue;
          const bool better = smallest < 0 || w.slot_size[s] < w.slot_size[smallest] ||
                              (w.slot_size[s] == w.slot_size[smallest] && s < smallest);
          if (!better) continue;
          smallest = s;
          outside = inside == p ? q : p;
        }
      }
      if (smallest >= 0) add_addition(block, w, smallest, outside);
    }
  }
}
CUTPROOF_KERNEL(cover_edges_kernel);

// published: a cluster that shares no particle takes in the outside ends of the edges that leave it.
template <class Block>
CUTPROOF_DEVICE void free_lone_clusters_kernel(Block& block, DeviceView w) {
  for (int s = block.index(); s < w.counters->slots_used; s += block.count()) {
    const int b = w.slot_body[s];
    if (w.slot_size[s] == 0 || w.body[b].expand_rule != ExpandRule::published || !expands_now(w, b)) continue;
    const int* members = w.members + w.slot_begin[s];
    // Nearly every cluster shares one of its first particles.
    bool shared = false;
    for (int tile = 0; tile < w.slot_size[s] && !shared; tile += block.size()) {
      const int k = tile + block.thread();
      shared = block.any(k < w.slot_size[s] && w.membership_count[members[k]] > 1);
    }
    if (shared) continue;
    for (int k = block.thread(); k < w.slot_size[s]; k += block.size()) {
      for (int direction = 0; direction < 6 && alive(w, members[k]); ++direction) {
        const int q = neighbour(w, w.body[b], members[k], direction);
        if (q >= 0 && alive(w, q) && !cluster_holds(w, s, q)) add_addition(block, w, s, q);
      }
    }
  }
}
CUTPROOF_KERNEL(free_lone_clusters_kernel);

// One more layer for bodies of greater depth: G-neighbours of additions that share a cluster with them. Additions of
// earlier layers already have all their neighbours, so examining them too changes nothing.
template <class Block>
CUTPROOF_DEVICE void add_layer_kernel(Block& block, DeviceView w) {
  const Counters& c = *w.counters;
  for (int64_t i = block.first(); i < c.additions_before; i += block.stride()) {
    const int s = cluster_of(w.additions[i]), p = particle_of(w.additions[i]);
    const BodyConstants& body = w.body[w.slot_body[s]];
    if (c.layer >= body.depth) continue;
    for (int direction = 0; direction < 6; ++direction) {
      const int q = neighbour(w, body, p, direction);
      if (q < 0 || !alive(w, q) || cluster_holds(w, s, q) || !share_a_cluster(w, p, q)) continue;
      const unsigned long long key = static_cast<unsigned long long>(s) << 32 | static_cast<unsigned>(q);
      const int place = lower_bound(w.additions, c.additions_before, key);
      if (place < c.additions_before && w.additions[place] == key) continue;
      add_addition(block, w, s, q);
    }
  }
}
CUTPROOF_KERNEL(add_layer_kernel);

// Too few places for all additions: none is carried out.
template <class Block>
CUTPROOF_DEVICE void check_additions_kernel(Block& block, DeviceView w) {
  Counters& c = *w.counters;
  if (block.first() != 0 || c.additions <= w.addition_capacity) return;
  c.additions = 0;
  block.atomic_or(&c.fault, kAdditionsFull);
}
CUTPROOF_KERNEL(check_additions_kernel);

// Completes a layer. Counters::changed: another may follow.
template <class Block>
CUTPROOF_DEVICE void end_layer_kernel(Block& block, DeviceView w) {
  if (block.first() != 0) return;
  Counters& c = *w.counters;
  ++c.layer;
  bool deeper = false;
  for (int b = 0; b < w.bodies; ++b) deeper = deeper || (w.body[b].depth > c.layer && expands_now(w, b));
  c.changed = deeper && c.additions > c.additions_before;
  c.additions_before = c.additions;
}
CUTPROOF_KERNEL(end_layer_kernel);

// --- Carrying out ----------------------------------------------------------------------------------------------------

// By particle: where its memberships began, and their future number, which then becomes the next place to fill. (The
// skin uses particle_scratch meanwhile.)
CUTPROOF_BOTH inline int* old_begin(const DeviceView& w) { return w.class_data; }
CUTPROOF_BOTH inline int* new_count(const DeviceView& w) { return w.class_data + w.particles; }
CUTPROOF_BOTH inline int old_count(const DeviceView& w, int64_t p) {
  return (p + 1 < w.particles ? old_begin(w)[p + 1] : w.counters->memberships_before) - old_begin(w)[p];
}

template <class Block>
CUTPROOF_DEVICE void note_rows_kernel(Block& block, DeviceView w) {
  if (block.first() == 0) {
    w.counters->growth = 0;
    w.counters->memberships_before = w.membership_begin[w.particles];
  }
  for (int64_t p = block.first(); p < w.particles; p += block.stride()) {
    old_begin(w)[p] = w.membership_begin[p];
    new_count(w)[p] = w.membership_begin[p + 1] - w.membership_begin[p];
  }
}
CUTPROOF_KERNEL(note_rows_kernel);

// The additions of one cluster are adjacent: [i, end) if they begin at i, else [i, i).
CUTPROOF_DEVICE inline int end_of_additions(const DeviceView& w, int i) {
  const int count = w.counters->additions, s = cluster_of(w.additions[i]);
  if (i > 0 && cluster_of(w.additions[i - 1]) == s) return i;
  const unsigned long long next = static_cast<unsigned long long>(s + 1) << 32;
  return i + lower_bound(w.additions + i, count - i, next);
}

template <class Block>
CUTPROOF_DEVICE void measure_growth_kernel(Block& block, DeviceView w) {
  for (int64_t k = block.first(); k < w.counters->additions; k += block.stride()) {
    const int i = static_cast<int>(k), end = end_of_additions(w, i);
    if (end > i) block.atomic_add(&w.counters->growth, w.slot_size[cluster_of(w.additions[i])] + end - i);
    block.atomic_add(&new_count(w)[particle_of(w.additions[i])], 1);
  }
}
CUTPROOF_KERNEL(measure_growth_kernel);

template <class Block>
CUTPROOF_DEVICE void check_growth_kernel(Block& block, DeviceView w) {
  Counters& c = *w.counters;
  if (block.first() != 0) return;
  const bool fits = int64_t{c.members_used} + c.growth <= w.member_capacity &&
                    int64_t{c.memberships_before} + c.additions <= w.member_capacity;
  if (fits) return;
  c.additions = 0;
  block.atomic_or(&c.fault, kMembersFull);
}
CUTPROOF_KERNEL(check_growth_kernel);

// Copied aside, because rows of memberships move.
template <class Block>
CUTPROOF_DEVICE void copy_memberships_kernel(Block& block, DeviceView w) {
  for (int64_t h = block.first(); h < w.counters->memberships_before; h += block.stride())
    w.label[h] = w.memberships[h];
}
CUTPROOF_KERNEL(copy_memberships_kernel);

template <class Block>
CUTPROOF_DEVICE void move_rows_kernel(Block& block, DeviceView w) {
  for (int64_t p = block.first(); p < w.particles; p += block.stride()) {
    const int count = old_count(w, p), begin = w.membership_begin[p];
    for (int k = 0; k < count; ++k) w.memberships[begin + k] = w.label[old_begin(w)[p] + k];
    new_count(w)[p] = begin + count;
  }
}
CUTPROOF_KERNEL(move_rows_kernel);

template <class Block>
CUTPROOF_DEVICE void add_memberships_kernel(Block& block, DeviceView w) {
  for (int64_t i = block.first(); i < w.counters->additions; i += block.stride()) {
    const int p = particle_of(w.additions[i]);
    w.memberships[block.atomic_add(&new_count(w)[p], 1)] = cluster_of(w.additions[i]);
    block.atomic_add(&w.membership_count[p], 1);
  }
}
CUTPROOF_KERNEL(add_memberships_kernel);

// Sorts the rows that grew, so that the order of execution does not show. Every cluster of a particle with new clusters
// needs a new rest frame.
template <class Block>
CUTPROOF_DEVICE void finish_rows_kernel(Block& block, DeviceView w) {
  for (int64_t p = block.first(); p < w.particles; p += block.stride()) {
    const int begin = w.membership_begin[p], end = w.membership_begin[p + 1];
    if (end - begin == old_count(w, p)) continue;
    sort_memberships(w, p);
    for (int h = begin; h < end; ++h) {
      if (w.memberships[h] < 0) continue;
      block.store(&rest_marks(w)[w.memberships[h]], 1);
      block.store(&w.regroup[w.memberships[h]], 1);
    }
  }
}
CUTPROOF_KERNEL(finish_rows_kernel);

struct AddedParticles {
  const unsigned long long* additions;
  CUTPROOF_DEVICE int operator[](int i) const { return particle_of(additions[i]); }
};

// A block for each cluster that grows.
template <class Block>
CUTPROOF_DEVICE void grow_clusters_kernel(Block& block, DeviceView w) {
  int* place = block.template shared<int>(1);
  for (int i = block.index(); i < w.counters->additions; i += block.count()) {
    const int added = end_of_additions(w, i) - i;
    if (added == 0) continue;
    const int s = cluster_of(w.additions[i]), size = w.slot_size[s];
    if (block.thread() == 0) *place = block.atomic_add(&w.counters->members_used, size + added);
    block.sync();
    const int begin = *place;
    write_union(block, w.members + w.slot_begin[s], size, AddedParticles{w.additions + i}, added, w.members + begin);
    block.sync();
    if (block.thread() != 0) continue;
    w.slot_begin[s] = begin;
    w.slot_size[s] = size + added;
  }
}
CUTPROOF_KERNEL(grow_clusters_kernel);

template <class Block>
CUTPROOF_DEVICE void note_grown_dirty_kernel(Block& block, DeviceView w) {
  for (int64_t s = block.first(); s < w.counters->slots_used; s += block.stride()) {
    if (w.slot_size[s] > 0 && rest_marks(w)[s] != 0) w.rest_dirty[s] = 1;
  }
}
CUTPROOF_KERNEL(note_grown_dirty_kernel);

template <class Block>
CUTPROOF_DEVICE void note_edge_covered_kernel(Block& block, DeviceView w) {
  for (int64_t i = block.first(); i < w.bodies; i += block.stride()) {
    const int b = static_cast<int>(i);
    if (expands_now(w, b) && w.body[b].expand_rule == ExpandRule::edge_cover) w.edge_covered[b] = 1;
  }
}
CUTPROOF_KERNEL(note_edge_covered_kernel);

template <class Launcher>
void enqueue_expand(Launcher& launcher, const DeviceView& w, const Plan& plan) {
  constexpr int kThreads = 64;
  Counters* const c = w.counters;
  const auto collect = [&](Launcher& on) {
    on.items(check_additions_kernel_object{}, 1, w);
    on.sort_unique(w.additions, &c->additions, w.addition_capacity);
    on.items(end_layer_kernel_object{}, 1, w);
  };
  launcher.items(begin_expand_kernel_object{}, 1, w);
  if (plan.edge_cover) launcher.items(cover_edges_kernel_object{}, w.particles, w);
  if (plan.published_expand) launcher.blocks(free_lone_clusters_kernel_object{}, w.slots_expected, kThreads, 0, w);
  // Most frames find no additions: sorting the whole capacity would take longest of all.
  launcher.if_nonzero(&c->additions, [&](Launcher& some) {
    collect(some);
    some.while_nonzero(&c->changed, [&](Launcher& layer) {
      layer.items(add_layer_kernel_object{}, w.addition_capacity, w);
      collect(layer);
    });
    some.if_nonzero(&c->additions, [&](Launcher& found) {
      found.items(note_rows_kernel_object{}, w.particles, w);
      found.items(measure_growth_kernel_object{}, w.addition_capacity, w);
      found.items(check_growth_kernel_object{}, 1, w);
    });
    some.if_nonzero(&c->additions, [&](Launcher& fits) {
      fits.clear(rest_marks(w), sizeof(int) * static_cast<std::size_t>(w.slot_capacity));
      fits.items(copy_memberships_kernel_object{}, w.member_capacity, w);
      fits.exclusive_scan(new_count(w), w.membership_begin, w.particles, w.membership_begin + w.particles);
      fits.items(move_rows_kernel_object{}, w.particles, w);
      fits.items(add_memberships_kernel_object{}, w.addition_capacity, w);
      fits.items(finish_rows_kernel_object{}, w.particles, w);
      fits.blocks(grow_clusters_kernel_object{}, w.addition_capacity, kThreads, 16, w);
      fits.items(note_grown_dirty_kernel_object{}, w.slots_expected, w);
      enqueue_rest_frames(fits, w);
    });
  });
  launcher.items(note_edge_covered_kernel_object{}, w.bodies, w);
}

}  // namespace cutproof::gpu
