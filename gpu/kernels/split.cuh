// Stage split (method.md §5): every cluster with a dead particle becomes the connected components of its rest, all
// clusters at once.
//
// The labelled graph has a node for each (cluster, particle) pair, known by its place in DeviceView::members. It has an
// edge where two particles of one cluster are neighbours in G. Members ascend within a cluster, so a component's
// smallest particle has its smallest place. That place is the component's label, with both methods:
// - SplitMethod::global_labels: hooking over all pairs at once in global memory, as ECL-CC does;
// - SplitMethod::blocks: the same in shared memory, a block for each cluster.
//
// Then components are counted, which gives each its slot and number. A cluster's members are regrouped within their
// places: a split needs new slots, but no new places.
#pragma once
#include <cstdint>

#include "gpu/kernels/rest_frames.cuh"
#include "gpu/kernels/sorted_lists.cuh"
#include "gpu/kernels/union_find.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/state/device_view.h"
#include "gpu/state/plan.h"

namespace cutproof::gpu {

// A larger cluster is labelled in global memory whatever the plan says.
inline constexpr int kMostInBlock = 4096;

namespace split_detail {

// As large as most clusters: a block waits for memory as long for all its particles as for one.
inline constexpr int kLabelThreads = 512, kRegroupThreads = 512;
// Most components of a cluster that regrouping scans one by one.
inline constexpr int kMostScanned = 4;
// Pairs of a cluster for each block of global_labels.
inline constexpr int kPairsPerBlock = 1024;
inline constexpr int kMostShares = 64;

// Directions of a particle's lower neighbours, smallest first, d = 0, 1, 2: -z, -y, -x. Particles are numbered like
// their nodes.
CUTPROOF_BOTH inline constexpr int lower_direction(int d) { return 5 - 2 * d; }

CUTPROOF_DEVICE inline int body_index(const DeviceView& w, int p) { return w.bodies == 1 ? 0 : w.body_of[p]; }

// Use of Counters::scratch until there are new lists; then the skin uses it.
enum : int { kNewClusters = 0, kFirstNewNumber = 1, kTooLarge = 2 };

// The quarters of DeviceView::slot_scratch. By place in DeviceView::affected: the number of components that need a new
// slot; the same number over all earlier places; with several bodies, the number of the first such component. By slot:
// marks, then the next places to fill.
CUTPROOF_BOTH inline int* extra_components(const DeviceView& w) { return w.slot_scratch; }
CUTPROOF_BOTH inline int* extra_before(const DeviceView& w) { return w.slot_scratch + int64_t{1} * w.slot_capacity; }
CUTPROOF_BOTH inline int* first_number(const DeviceView& w) { return w.slot_scratch + int64_t{2} * w.slot_capacity; }
CUTPROOF_BOTH inline int* by_slot(const DeviceView& w) { return w.slot_scratch + int64_t{3} * w.slot_capacity; }

// The position of member k's lower neighbour among the k smallest members of a cluster; -1: none.
template <class Members>
CUTPROOF_DEVICE int place_of_lower(const Members& members, int k, int neighbour, int direction) {
  if (direction == 1) {  // a neighbour at -x is the previous particle
    return k > 0 && members[k - 1] == neighbour ? k - 1 : -1;
  }
  const int place = lower_bound(members, k, neighbour);
  return place < k && members[place] == neighbour ? place : -1;
}

// ---- debris

// Bodies that remove small components now. After the first search a component can become too small only where particles
// die. So it is searched from there, unless it may have too many particles for that.
inline constexpr int kMostSearched = 32;
CUTPROOF_DEVICE inline bool drops_debris(const DeviceView& w, int b) { return w.body[b].debris > 0 && cut_now(w, b); }
CUTPROOF_DEVICE inline bool labels_tissue(const DeviceView& w, int b) {
  return drops_debris(w, b) && (w.debris_anywhere[b] != 0 || w.body[b].debris > kMostSearched);
}

// DeviceView::particle_scratch: parents of particles, then sizes of components.
CUTPROOF_BOTH inline int* component_size(const DeviceView& w) { return w.particle_scratch + w.particles; }

// Lists p as debris.
template <class Block>
CUTPROOF_DEVICE void add_debris(Block& block, const DeviceView& w, int p) {
  w.fallen[w.counters->fallen + block.atomic_add(&w.counters->debris, 1)] = p;
}

}  // namespace split_detail

// Clears the counters of list_fallen. One thread.
template <class Block>
CUTPROOF_DEVICE void begin_split_kernel(Block& block, DeviceView w) {
  if (block.first() != 0) return;
  Counters& c = *w.counters;
  c.debris = 0;
  c.fallen = 0;
  c.failed = 0;
  c.scratch[split_detail::kTooLarge] = 0;
  c.whole_tissue = 0;
  for (int b = 0; b < w.bodies; ++b) {
    if (split_detail::labels_tissue(w, b)) c.whole_tissue = 1;
  }
}
CUTPROOF_KERNEL(begin_split_kernel);

// Lists the dead of this frame and all others still in clusters. An earlier split's debris leaves the list, which this
// split writes anew.
template <class Block>
CUTPROOF_DEVICE void list_fallen_kernel(Block& block, DeviceView w) {
  using namespace split_detail;
  for (int64_t s = block.first(); s < w.counters->slots_used; s += block.stride()) {
    by_slot(w)[s] = 0;
    extra_components(w)[s] = 0;
  }
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i);
    if (alive(w, p)) continue;
    const int b = body_index(w, p);
    if (!cut_now(w, b)) continue;
    if (drops_debris(w, b) && w.death[p] == w.cut[b] + 1) w.death[p] = kDeadBefore;
    if (w.death[p] == w.cut[b] || w.membership_count[p] > 0) w.fallen[block.atomic_add(&w.counters->fallen, 1)] = p;
  }
}
CUTPROOF_KERNEL(list_fallen_kernel);

template <class Block>
CUTPROOF_DEVICE void link_tissue_kernel(Block& block, DeviceView w) {
  using namespace split_detail;
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i), b = body_index(w, p);
    if (!labels_tissue(w, b)) continue;
    int parent = p;
    for (int d = 0; d < 3 && parent == p && alive(w, p); ++d) {
      const int q = neighbour(w, w.body[b], p, lower_direction(d));
      if (q >= 0 && alive(w, q)) parent = q;
    }
    w.particle_scratch[p] = parent;
    component_size(w)[p] = 0;
  }
}
CUTPROOF_KERNEL(link_tissue_kernel);

// link_tissue does the direction -z.
template <class Block>
CUTPROOF_DEVICE void hook_tissue_kernel(Block& block, DeviceView w) {
  using namespace split_detail;
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i), b = body_index(w, p);
    if (!labels_tissue(w, b) || !alive(w, p)) continue;
    for (int d = 1; d < 3; ++d) {
      const int q = neighbour(w, w.body[b], p, lower_direction(d));
      if (q >= 0 && alive(w, q)) unite(block, w.particle_scratch, p, q);
    }
  }
}
CUTPROOF_KERNEL(hook_tissue_kernel);

// Counts sizes up to where they no longer matter.
template <class Block>
CUTPROOF_DEVICE void measure_tissue_kernel(Block& block, DeviceView w) {
  using namespace split_detail;
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i), b = body_index(w, p);
    if (!labels_tissue(w, b) || !alive(w, p)) continue;
    const int root = final_root(block, w.particle_scratch, p);
    block.store(&w.particle_scratch[p], root);
    int* const size = &component_size(w)[root];
    if (block.load(size) < w.body[b].debris) block.atomic_add(size, 1);
  }
}
CUTPROOF_KERNEL(measure_tissue_kernel);

template <class Block>
CUTPROOF_DEVICE void remove_debris_kernel(Block& block, DeviceView w) {
  using namespace split_detail;
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i), b = body_index(w, p);
    if (!labels_tissue(w, b) || !alive(w, p)) continue;
    if (component_size(w)[w.particle_scratch[p]] >= w.body[b].debris) continue;
    w.death[p] = w.cut[b] + 1;
    add_debris(block, w, p);
  }
}
CUTPROOF_KERNEL(remove_debris_kernel);

// The component of each living neighbour of a fallen particle, as far as it matters. Several threads may find the same
// one: particles that another thread removes meanwhile still count as tissue.
template <class Block>
CUTPROOF_DEVICE void search_debris_kernel(Block& block, DeviceView w) {
  using namespace split_detail;
  for (int64_t i = block.first(); i < int64_t{6} * w.counters->fallen; i += block.stride()) {
    const int p = w.fallen[i / 6], b = body_index(w, p);
    if (!drops_debris(w, b) || labels_tissue(w, b)) continue;
    const BodyConstants& body = w.body[b];
    const int debris = w.cut[b] + 1;
    const auto is_tissue = [&](int q) {
      if (q < 0) return false;
      const int death = block.load(&w.death[q]);
      return death < 0 || death == debris;
    };
    const int start = neighbour(w, body, p, static_cast<int>(i % 6));
    if (!is_tissue(start)) continue;
    int found[kMostSearched], count = 1;
    found[0] = start;
    for (int k = 0; k < count && count < body.debris; ++k) {
      for (int d = 0; d < 6 && count < body.debris; ++d) {
        const int q = neighbour(w, body, found[k], d);
        bool known = !is_tissue(q);
        for (int j = 0; j < count && !known; ++j) known = found[j] == q;
        if (!known) found[count++] = q;
      }
    }
    if (count >= body.debris) continue;
    for (int k = 0; k < count; ++k) {
      if (block.atomic_cas(&w.death[found[k]], -1, debris) == -1) add_debris(block, w, found[k]);
    }
  }
}
CUTPROOF_KERNEL(search_debris_kernel);

// ---- which clusters

// By I2 no cluster contained a dead particle when the frame began, so a dead member was lost in this frame.
template <class Block>
CUTPROOF_DEVICE void mark_affected_kernel(Block& block, DeviceView w) {
  using namespace split_detail;
  for (int64_t i = block.first(); i < w.counters->fallen + w.counters->debris; i += block.stride()) {
    const int p = w.fallen[i];
    each_membership(block, w, p, [&](int, int slot) {
      if (slot >= 0) block.store(&by_slot(w)[slot], 1);
    });
  }
}
CUTPROOF_KERNEL(mark_affected_kernel);

// One block.
template <class Block>
CUTPROOF_DEVICE void list_affected_kernel(Block& block, const DeviceView& w) {
  using namespace split_detail;
  if (block.index() != 0) return;
  for (int b = block.thread(); b < w.bodies; b += block.size()) {
    if (drops_debris(w, b)) w.debris_anywhere[b] = 0;
  }
  const int affected = count_off(
      block, 0, w.counters->slots_used, 0, [&](int s) { return by_slot(w)[s] != 0; },
      [&](int n, int s) { w.affected[n] = s; });
  if (block.thread() == 0) w.counters->affected = affected;
}
CUTPROOF_KERNEL_THREADS(list_affected_kernel, kListThreads);

// ---- labels

// A block for each affected cluster of at most `most` members; shared memory has them and their parents.
template <class Block>
CUTPROOF_DEVICE void label_in_blocks_kernel(Block& block, DeviceView w, int most) {
  using namespace split_detail;
  int* const members = block.template shared<int>(most);
  int* const parent = block.template shared<int>(most);
  for (int a = block.index(); a < w.counters->affected; a += block.count()) {
    const int s = w.affected[a], begin = w.slot_begin[s], size = w.slot_size[s];
    const BodyConstants& body = w.body[w.slot_body[s]];
    if (size > most) {
      if (block.thread() == 0) block.store(&w.counters->scratch[kTooLarge], 1);
      continue;
    }
    struct Member {
      int particle, lower[3];
      bool is_alive;
    };
    const auto ask = [&](int k) {
      Member member;
      member.particle = w.members[begin + k];
      member.is_alive = alive(w, member.particle);
      for (int d = 0; d < 3; ++d) member.lower[d] = neighbour(w, body, member.particle, lower_direction(d));
      return member;
    };
    // A thread hardly ever has more than one.
    const int own = block.thread();
    Member first_own;
    if (own < size) first_own = ask(own);
    const auto member_at = [&](int k) { return k == own ? first_own : ask(k); };
    for (int k = own; k < size; k += block.size()) {
      const Member member = member_at(k);
      members[k] = member.particle;
      parent[k] = member.is_alive ? k : -1;
    }
    block.sync();
    for (int k = own; k < size; k += block.size()) {
      if (peek<Memory::shared>(block, &parent[k]) < 0) continue;
      bool first = true;
      const Member member = member_at(k);
      for (int d = 0; d < 3; ++d) {
        const int q = member.lower[d];
        if (q < 0) continue;
        const int place = place_of_lower(members, k, q, lower_direction(d));
        if (place < 0 || peek<Memory::shared>(block, &parent[place]) < 0) continue;
        // The first needs no search for roots, unless another thread has hooked k before.
        const bool hooked = first && block.atomic_cas(&parent[k], k, place) == k;
        if (!hooked) unite<Memory::shared>(block, parent, k, place);
        first = false;
      }
    }
    block.sync();
    int roots = 0;
    for (int k = block.thread(); k < size; k += block.size()) {
      int root = parent[k];
      while (root >= 0 && parent[root] != root) root = parent[root];
      w.label[begin + k] = root < 0 ? -1 : begin + root;
      roots += root == k;
    }
    roots = block.sum(roots);
    if (block.thread() == 0) extra_components(w)[a] = roots > 1 ? roots - 1 : 0;
    block.sync();
  }
}
CUTPROOF_KERNEL_THREADS(label_in_blocks_kernel, split_detail::kLabelThreads);

// Calls visit(slot, k), k in [0, slot_size), for the pairs of each affected cluster with more than `most` members,
// distributed over `shares` blocks.
namespace split_detail {
template <class Block, class Visit>
CUTPROOF_DEVICE void for_large_clusters(Block& block, const DeviceView& w, int most, int shares, Visit visit) {
  const int64_t jobs = int64_t{shares} * w.counters->affected;
  for (int64_t job = block.index(); job < jobs; job += block.count()) {
    const int s = w.affected[job / shares], size = w.slot_size[s];
    if (size <= most) continue;
    const int64_t first = job % shares * block.size() + block.thread();
    for (int64_t k = first; k < size; k += int64_t{shares} * block.size()) visit(s, static_cast<int>(k));
  }
}
}  // namespace split_detail

template <class Block>
CUTPROOF_DEVICE void link_pairs_kernel(Block& block, DeviceView w, int most, int shares) {
  using namespace split_detail;
  for_large_clusters(block, w, most, shares, [&](int s, int k) {
    const int begin = w.slot_begin[s];
    const int* const members = w.members + begin;
    int parent = -1;
    if (alive(w, members[k])) {
      parent = k;
      for (int d = 0; d < 3 && parent == k; ++d) {
        const int q = neighbour(w, w.body[w.slot_body[s]], members[k], lower_direction(d));
        if (q < 0 || !alive(w, q)) continue;
        const int place = place_of_lower(members, k, q, lower_direction(d));
        if (place >= 0) parent = place;
      }
    }
    w.label[begin + k] = parent < 0 ? -1 : begin + parent;
  });
}
CUTPROOF_KERNEL(link_pairs_kernel);

// link_pairs does the direction -z.
template <class Block>
CUTPROOF_DEVICE void hook_pairs_kernel(Block& block, DeviceView w, int most, int shares) {
  using namespace split_detail;
  for_large_clusters(block, w, most, shares, [&](int s, int k) {
    const int begin = w.slot_begin[s];
    const int* const members = w.members + begin;
    if (!alive(w, members[k])) return;
    for (int d = 1; d < 3; ++d) {
      const int q = neighbour(w, w.body[w.slot_body[s]], members[k], lower_direction(d));
      if (q < 0 || !alive(w, q)) continue;
      const int place = place_of_lower(members, k, q, lower_direction(d));
      if (place >= 0) unite(block, w.label, begin + k, begin + place);
    }
  });
}
CUTPROOF_KERNEL(hook_pairs_kernel);

// A block for each of these clusters, because components are counted.
template <class Block>
CUTPROOF_DEVICE void flatten_pairs_kernel(Block& block, DeviceView w, int most) {
  using namespace split_detail;
  for (int a = block.index(); a < w.counters->affected; a += block.count()) {
    const int s = w.affected[a], begin = w.slot_begin[s], size = w.slot_size[s];
    if (size <= most) continue;
    int roots = 0;
    for (int q = begin + block.thread(); q < begin + size; q += block.size()) {
      if (block.load(&w.label[q]) < 0) continue;
      const int root = final_root(block, w.label, q);
      block.store(&w.label[q], root);
      roots += root == q;
    }
    roots = block.sum(roots);
    if (block.thread() == 0) extra_components(w)[a] = roots > 1 ? roots - 1 : 0;
  }
}
CUTPROOF_KERNEL(flatten_pairs_kernel);

// ---- slots and numbers

// New numbers follow the body's highest, in the order (cluster, smallest particle). A block for each body. Also checks
// the capacity.
template <class Block>
CUTPROOF_DEVICE void number_components_kernel(Block& block, DeviceView w) {
  using namespace split_detail;
  Counters& counters = *w.counters;
  if (block.first() == 0) {
    counters.slots_before = counters.slots_used;
    if (counters.slots_used + int64_t{counters.scratch[kNewClusters]} > w.slot_capacity) {
      counters.failed = 1;
      block.atomic_or(&counters.fault, kSlotsFull);
    }
  }
  for (int b = block.index(); b < w.bodies; b += block.count()) {
    if (!cut_now(w, b)) continue;
    // In a body numbers ascend with slots, so its last cluster has the highest.
    int highest = -1;
    for (int end = counters.slots_used; end > 0 && highest < 0; end -= block.size()) {
      const int s = end - 1 - block.thread();
      const bool mine = s >= 0 && w.slot_size[s] > 0 && w.slot_body[s] == b;
      highest = -block.smallest(mine ? -w.slot_number[s] : 1);
    }
    if (w.bodies == 1) {
      if (block.thread() == 0) counters.scratch[kFirstNewNumber] = highest + 1;
      continue;
    }
    int next = highest + 1;
    for (int begin = 0; begin < counters.affected; begin += block.size()) {
      const int a = begin + block.thread();
      const bool mine = a < counters.affected && w.slot_body[w.affected[a]] == b;
      int total = 0;
      const int before = block.exclusive_scan(mine ? extra_components(w)[a] : 0, total);
      if (mine) first_number(w)[a] = next + before;
      next += total;
    }
  }
}
CUTPROOF_KERNEL(number_components_kernel);

// ---- regrouping

namespace split_detail {

// For a stage that lacks slots.
template <class Block>
CUTPROOF_DEVICE void put_back_debris(Block& block, const DeviceView& w) {
  if (block.index() != 0) return;
  Counters& counters = *w.counters;
  for (int k = block.thread(); k < counters.debris; k += block.size()) {
    const int p = w.fallen[counters.fallen + k];
    w.death[p] = -1;
    block.store(&w.debris_anywhere[body_index(w, p)], 1);
  }
  block.sync();
  if (block.thread() == 0) counters.debris = 0;
}

// In p's list of clusters `to` replaces `from`. Each block renames a slot of its own.
template <class Block>
CUTPROOF_DEVICE void rename_holder(Block& block, const DeviceView& w, int p, int from, int to) {
  mark_unsorted(block, w, p);
  each_membership(block, w, p, [&](int h, int slot) {
    if (slot == from) block.store(&w.memberships[h], to);
    if (slot >= 0 && to >= 0) block.store(&w.regroup[slot], 1);
  });
}

}  // namespace split_detail

// A block for each affected cluster. Its first component keeps slot and number. Component c > 0, ordered by smallest
// particle, gets the c-th of the cluster's new slots, which count as used from now on. Members stay within the
// cluster's places: component after component, each ascending; the places of the dead remain at the end.
template <class Block>
CUTPROOF_DEVICE void regroup_members_kernel(Block& block, DeviceView w) {
  using namespace split_detail;
  Counters& counters = *w.counters;
  int* const chunk = block.template shared<int>(block.size());
  if (counters.failed) {
    put_back_debris(block, w);
    return;
  }
  if (block.first() == 0) counters.slots_used = counters.slots_before + counters.scratch[kNewClusters];
  for (int a = block.index(); a < counters.affected; a += block.count()) {
    const int s = w.affected[a], begin = w.slot_begin[s], size = w.slot_size[s];
    const int first_new = counters.slots_before + extra_before(w)[a];
    const int number = w.bodies == 1 ? counters.scratch[kFirstNewNumber] + extra_before(w)[a] : first_number(w)[a];
    int* const fill = by_slot(w);  // first a component's size, then its next place to fill
    int* const slot_of_root = w.member_scratch + begin;
    int* const regrouped = w.member_scratch;

    if (block.thread() == 0) block.store(&w.regroup[s], 1);
    int components = 0;
    for (int from = 0; from < size; from += block.size()) {
      const int k = from + block.thread();
      const bool root = k < size && w.label[begin + k] == begin + k;
      int total = 0;
      const int c = components + block.exclusive_scan(root ? 1 : 0, total);
      components += total;
      if (!root) continue;
      const int t = c == 0 ? s : first_new + c - 1;
      slot_of_root[k] = t;
      fill[t] = 0;
      block.store(&w.regroup[t], 1);
      if (c == 0) continue;
      w.slot_number[t] = number + c - 1;
      w.slot_body[t] = w.slot_body[s];
      w.rotation[t] = w.rotation[s];
      w.degenerate[t] = w.degenerate[s];
    }
    block.sync();

    // Labels become slots.
    for (int k = block.thread(); k < size; k += block.size()) {
      const int root = w.label[begin + k];
      if (root < 0) continue;
      const int t = slot_of_root[root - begin];
      w.label[begin + k] = t;
      block.atomic_add(&fill[t], 1);
    }
    block.sync();

    int left = 0;  // places of earlier components
    for (int from = 0; from < components; from += block.size()) {
      const int c = from + block.thread();
      const int t = c == 0 ? s : first_new + c - 1;
      const int members = c < components ? fill[t] : 0;
      int total = 0;
      const int before = left + block.exclusive_scan(members, total);
      left += total;
      if (c >= components) continue;
      w.slot_begin[t] = begin + before;
      w.slot_size[t] = members;
      w.rest_dirty[t] = 1;
      fill[t] = begin + before;
    }
    if (components == 0 && block.thread() == 0) w.slot_size[s] = 0;
    block.sync();

    // Members in ascending order, a chunk at a time: each goes behind the earlier ones of its component.
    int done[kMostScanned] = {};  // members of each component in earlier chunks, if there are few components
    for (int from = 0; from < size; from += block.size()) {
      const int k = from + block.thread();
      const int t = k < size ? w.label[begin + k] : -1;
      const int p = k < size ? w.members[begin + k] : -1;
      if (p >= 0 && t != s) rename_holder(block, w, p, s, t);
      if (p >= 0 && t < 0) block.store(&w.membership_count[p], 0);
      if (components <= kMostScanned) {
        for (int c = 0; c < components; ++c) {
          const int target = c == 0 ? s : first_new + c - 1;
          int total = 0;
          const int before = done[c] + block.exclusive_scan(t == target ? 1 : 0, total);
          if (t == target) regrouped[w.slot_begin[t] + before] = p;
          done[c] += total;
        }
        continue;
      }
      chunk[block.thread()] = t;
      block.sync();
      int before = 0;
      bool last = true;
      if (t >= 0) {
        for (int j = 0; j < block.size(); ++j) {
          before += j < block.thread() && chunk[j] == t;
          last = last && (j <= block.thread() || chunk[j] != t);
        }
        before += fill[t];
        regrouped[before] = p;
      }
      block.sync();
      if (t >= 0 && last) fill[t] = before + 1;
    }
    block.sync();
    for (int k = block.thread(); k < left; k += block.size()) w.members[begin + k] = regrouped[begin + k];
    block.sync();
  }
}
CUTPROOF_KERNEL_THREADS(regroup_members_kernel, split_detail::kRegroupThreads);

// Of the rests of affected clusters, and of the new clusters.
template <class Block>
CUTPROOF_DEVICE void rest_frames_of_components_kernel(Block& block, DeviceView w) {
  using namespace split_detail;
  const Counters& counters = *w.counters;
  if (counters.failed) return;
  const int first_new = counters.slots_before, added = counters.slots_used - first_new;
  const Team<Block, kRestTeam> team(block);
  for (int64_t i = team.first(); i < counters.affected + added; i += team.stride()) {
    const int job = static_cast<int>(i);
    const int s = job < counters.affected ? w.affected[job] : first_new + job - counters.affected;
    if (w.slot_size[s] > 0) recompute_rest_frame(team, w, s);
  }
}
CUTPROOF_KERNEL(rest_frames_of_components_kernel);

// Without rest frames, which are needed only when clusters are united.
template <class Launcher>
void enqueue_components(Launcher& launcher, const DeviceView& w, const Plan& plan) {
  using namespace split_detail;
  Counters* const counters = w.counters;
  launcher.items(begin_split_kernel_object{}, 1, w);
  launcher.items(list_fallen_kernel_object{}, w.particles, w);
  if (plan.debris) {
    launcher.if_nonzero(&counters->whole_tissue, [&](Launcher& whole) {
      whole.items(link_tissue_kernel_object{}, w.particles, w);
      whole.items(hook_tissue_kernel_object{}, w.particles, w);
      whole.items(measure_tissue_kernel_object{}, w.particles, w);
      whole.items(remove_debris_kernel_object{}, w.particles, w);
    });
    launcher.items(search_debris_kernel_object{}, w.particles, w);
  }
  launcher.items(mark_affected_kernel_object{}, w.particles, w);
  launcher.blocks(list_affected_kernel_object{}, 1, kListThreads, 0, w);

  // Merging keeps to the cap, which plan.largest_cluster includes; expansion has no limit.
  const int largest = plan.largest_cluster < 1 ? 1 : plan.largest_cluster;
  const bool in_blocks = plan.split == SplitMethod::blocks;
  const int most = !in_blocks ? 0 : largest < kMostInBlock ? (largest + 31) / 32 * 32 : kMostInBlock;
  const auto label_large = [&](Launcher& inner) {
    const int wanted = (largest + kPairsPerBlock - 1) / kPairsPerBlock;
    const int shares = wanted < kMostShares ? wanted : kMostShares;
    inner.blocks(link_pairs_kernel_object{}, int64_t{shares} * w.slots_expected, 128, 0, w, most, shares);
    inner.blocks(hook_pairs_kernel_object{}, int64_t{shares} * w.slots_expected, 128, 0, w, most, shares);
    inner.blocks(flatten_pairs_kernel_object{}, w.slots_expected, 128, 0, w, most);
  };
  if (in_blocks) {
    launcher.blocks(label_in_blocks_kernel_object{}, w.slots_expected, kLabelThreads,
                    2 * sizeof(int) * static_cast<std::size_t>(most), w, most);
    if (plan.expand || largest > most) launcher.if_nonzero(&counters->scratch[kTooLarge], label_large);
  } else {
    label_large(launcher);
  }

  launcher.exclusive_scan(extra_components(w), extra_before(w), w.slot_capacity, &counters->scratch[kNewClusters],
                          &counters->affected);
  launcher.blocks(number_components_kernel_object{}, w.bodies, 256, 0, w);
  launcher.blocks(regroup_members_kernel_object{}, w.slots_expected, kRegroupThreads, sizeof(int) * kRegroupThreads, w);
}
template <class Launcher>
void enqueue_rest_frames_of_components(Launcher& launcher, const DeviceView& w) {
  launcher.teams(rest_frames_of_components_kernel_object{}, kRestTeam, 2 * int64_t{w.slots_expected}, w);
}
// The whole stage, for callers without parallel work.
template <class Launcher>
void enqueue_split(Launcher& launcher, const DeviceView& w, const Plan& plan) {
  enqueue_components(launcher, w, plan);
  enqueue_rest_frames_of_components(launcher, w);
}

}  // namespace cutproof::gpu
