// Assigns particles to groups. A class is all particles with the same list of holders and the same grips. Its first
// holder divides it into groups of kMostInGroup particles, in ascending order. A rest of fewer than kLeastInGroup
// particles is loose, as are particles without a holder. Equal lists meet in a hash table with an entry for each member
// of the first holder.
//
// So a class has its particles in the same chunks wherever it lies in memory, and classes depend on their own body
// only.
#pragma once
#include "gpu/launch/launcher.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"

namespace cutproof::gpu {

// Lanes that go through the members of a cluster.
inline constexpr int kMemberTeam = 32;
// Teams that share a cluster to find the classes of its members, and to count them.
inline constexpr int kShares = 8, kCountShares = 4;
// Threads that divide a cluster into groups, and most members in their shared memory.
inline constexpr int kDealThreads = 256;
inline constexpr int kMostDealt = 2048;

namespace groups_detail {

// DeviceView::group_at of particles that are not a group's first.
enum : int { kInside = -1, kLoose = -2 };

// The table of a cluster has the places of its members in DeviceView::members. An entry has a particle of its class
// (from 1; 0: none) and the number of the class's particles counted so far.
CUTPROOF_BOTH inline int* table(const DeviceView& w) { return w.label; }
CUTPROOF_BOTH inline int* class_size(const DeviceView& w) { return w.member_scratch; }
// Parts of DeviceView::slot_scratch: clusters with new groups, and clusters with new lists of groups.
CUTPROOF_BOTH inline int* changed(const DeviceView& w) { return w.slot_scratch; }
CUTPROOF_BOTH inline int* remeasured(const DeviceView& w) { return w.slot_scratch + w.slot_capacity; }
inline constexpr int kRemeasured = 2;  // in DeviceView::regroup: the cluster is in the list remeasured()
// At the place of a member: the entry of its class in this table, or -1 if another cluster divides its class.
CUTPROOF_BOTH inline int* entry_of_member(const DeviceView& w) { return w.cluster_loose; }
// By particle of a class divided without shared memory: how many particles of the class have smaller numbers.
CUTPROOF_BOTH inline int* rank_of(const DeviceView& w) { return w.place_of; }

// A particle's holders. Gaps of the list (-1) are at its end.
struct HolderList {
  const int* begin;
  int size;
};
CUTPROOF_DEVICE inline HolderList holders_of(const DeviceView& w, int p) {
  return {w.memberships + w.membership_begin[p], w.membership_count[p]};
}
// Entries are read at once: one by one, each would wait for the previous one.
inline constexpr int kAtOnce = 4;

CUTPROOF_DEVICE inline int hold_set(const DeviceView& w, int p) { return w.grip_count > 0 ? w.hold_set[p] : 0; }
CUTPROOF_DEVICE inline bool same_class(const DeviceView& w, int p, int q) {
  const HolderList a = holders_of(w, p), b = holders_of(w, q);
  if (a.size != b.size || hold_set(w, p) != hold_set(w, q)) return false;
  for (int k = 0; k < a.size; k += kAtOnce) {
    bool same = true;
    for (int j = k; j < k + kAtOnce; ++j) same = same && (j >= a.size || a.begin[j] == b.begin[j]);
    if (!same) return false;
  }
  return true;
}
CUTPROOF_DEVICE inline unsigned hash_of(HolderList list, int set) {
  unsigned hash = 2166136261u ^ static_cast<unsigned>(set);
  for (int k = 0; k < list.size; k += kAtOnce) {
    int entry[kAtOnce];
    for (int j = 0; j < kAtOnce; ++j) entry[j] = k + j < list.size ? list.begin[k + j] : 0;
    for (int j = 0; j < kAtOnce; ++j) {
      hash ^= static_cast<unsigned>(entry[j]);
      hash ^= hash >> 16;
      hash *= 0x7feb352du;
      hash ^= hash >> 15;
      hash *= 0x846ca68bu;
    }
  }
  return hash ^ (hash >> 16);
}

// How many groups a class of so many particles has.
CUTPROOF_DEVICE inline int groups_of(int particles) {
  return particles / kMostInGroup + (particles % kMostInGroup >= kLeastInGroup ? 1 : 0);
}
// Particles of a class from this rank on are loose.
CUTPROOF_DEVICE inline int grouped_of(int particles) {
  const int left = particles % kMostInGroup;
  return left >= kLeastInGroup ? particles : particles - left;
}

CUTPROOF_DEVICE inline void place(const DeviceView& w, int p, int o) {
  w.place_particle[o] = p;
  w.place_node[o] = w.node[p];
  w.place_of[p] = o;
}

}  // namespace groups_detail

// Lists the changed clusters, and counts their particles and pairs that may need places.
template <class Block>
CUTPROOF_DEVICE void find_changed_clusters_kernel(Block& block, const DeviceView& w) {
  using namespace groups_detail;
  const Team<Block, kMemberTeam> team(block);
  Counters& c = *w.counters;
  if (c.groups_whole) return;
  const auto count_members = [&](int s, int share) {
    const int begin = w.slot_begin[s], size = w.slot_size[s];
    int particles = 0, pairs = 0;
    for (int tile = share * kAtOnce * team.kLanes; tile < size; tile += kCountShares * kAtOnce * team.kLanes) {
      int member[kAtOnce], count[kAtOnce], first[kAtOnce];
      for (int t = 0; t < kAtOnce; ++t) {
        const int k = tile + t * team.kLanes + team.lane();
        member[t] = w.members[begin + (k < size ? k : 0)];
        if (k >= size) member[t] = -1;
      }
      for (int t = 0; t < kAtOnce; ++t) {
        const HolderList list = holders_of(w, member[t] < 0 ? 0 : member[t]);
        count[t] = list.size;
        first[t] = member[t] < 0 ? -1 : list.begin[0];
      }
      for (int t = 0; t < kAtOnce; ++t) {
        if (first[t] != s) continue;
        ++particles;
        pairs += count[t];
      }
    }
    particles = team.total(particles);
    pairs = team.total(pairs);
    if (!team.leads()) return;
    if (share == 0) changed(w)[block.atomic_add(&c.regrouped, 1)] = s;
    if (particles > 0) block.atomic_add(&c.due_particles, particles);
    if (pairs > 0) block.atomic_add(&c.due_pairs, pairs);
  };
  team.each_wanted(
      int64_t{kCountShares} * c.slots_used, [&](int job) { return w.regroup[job / kCountShares] != 0; },
      [&](int job) { count_members(job / kCountShares, job % kCountShares); });
}
CUTPROOF_KERNEL(find_changed_clusters_kernel);

// Dissolves the groups and loose particles of changed clusters. The first holder of a group dissolves it: if one holder
// of a group has changed, so has the first.
template <class Block>
CUTPROOF_DEVICE void dissolve_groups_kernel(Block& block, const DeviceView& w) {
  using namespace groups_detail;
  Counters& c = *w.counters;
  // If new groups do not fit behind the present ones, all are made anew.
  const bool whole = block.load(&c.groups_whole) != 0 ||
                     c.placed + c.placed_last + c.due_particles > w.place_capacity ||
                     c.groups + c.due_particles / kLeastInGroup > w.group_capacity ||
                     c.pairs + c.due_pairs / kLeastInGroup > w.pair_capacity;
  if (block.first() == 0) {
    c.groups_before = whole ? 0 : c.groups;
    block.store(&c.groups_whole, whole ? 1 : 0);
  }
  const Team<Block, kMemberTeam> team(block);
  const int clusters = whole ? c.slots_used : c.regrouped;
  for (int64_t i = team.first(); i < clusters; i += team.stride()) {
    const int s = whole ? static_cast<int>(i) : changed(w)[i], begin = w.slot_begin[s];
    team.each(w.slot_size[s], [&](int k) {
      table(w)[begin + k] = 0;
      class_size(w)[begin + k] = 0;
    });
    if (whole) continue;
    const ClusterHead head = w.cluster_head[s];  // as it was when groups were made
    team.each(head.group_count, [&](int k) {
      const int g = w.cluster_groups[head.group_begin + k].index;
      if (w.holders[w.group_head[g].holder_begin].index == s) w.group_head[g].size = 0;
    });
  }
  if (whole) return;
  for (int64_t k = block.first(); k < c.loose; k += block.stride()) {
    const int o = w.loose_places[k];
    if (o < 0) continue;
    const int p = w.place_particle[o];
    if (!alive(w, p) || (w.membership_count[p] > 0 && w.regroup[holders_of(w, p).begin[0]] != 0))
      w.loose_places[k] = -1;
  }
}
CUTPROOF_KERNEL(dissolve_groups_kernel);

// Puts each particle of a changed cluster into its class, in the table of its first holder.
template <class Block>
CUTPROOF_DEVICE void find_classes_kernel(Block& block, const DeviceView& w) {
  using namespace groups_detail;
  const Team<Block, kMemberTeam> team(block);
  Counters& c = *w.counters;
  const bool whole = c.groups_whole != 0;
  if (whole && block.first() == 0) c.groups = c.placed = c.placed_last = c.loose = c.pairs = 0;
  // known: DeviceView::regroup of s, possibly outdated.
  const auto remeasure = [&](int s, int known) {
    if (known >= kRemeasured) return;
    if ((block.atomic_or(&w.regroup[s], kRemeasured) & kRemeasured) != 0) return;
    remeasured(w)[block.atomic_add(&c.remeasured, 1)] = s;
  };
  // Several teams for each cluster, because there may be few.
  const int64_t jobs = int64_t{kShares} * (whole ? c.slots_used : c.regrouped);
  for (int64_t i = team.first(); i < jobs; i += team.stride()) {
    const int share = static_cast<int>(i % kShares),
              s = whole ? static_cast<int>(i / kShares) : changed(w)[i / kShares];
    const int begin = w.slot_begin[s], size = w.slot_size[s];
    if (!whole && team.leads() && share == 0) remeasure(s, block.load(&w.regroup[s]));
    int* const classes = table(w) + begin;
    for (int k = share * team.kLanes + team.lane(); k < size; k += kShares * team.kLanes) {
      const int p = w.members[begin + k];
      const HolderList list = holders_of(w, p);
      if (list.begin[0] != s) {
        entry_of_member(w)[begin + k] = -1;
        continue;
      }
      int entry = static_cast<int>(
          static_cast<unsigned long long>(hash_of(list, hold_set(w, p))) * static_cast<unsigned>(size) >> 32);
      bool first = false;
      while (true) {
        int found = block.load(&classes[entry]);
        if (found == 0) {
          found = block.atomic_cas(&classes[entry], 0, p + 1);
          first = found == 0;
        }
        if (first || same_class(w, p, found - 1)) break;
        entry = entry + 1 == size ? 0 : entry + 1;
      }
      entry_of_member(w)[begin + k] = entry;
      for (int h = 0; h < list.size && first && !whole; h += kAtOnce) {
        int holder[kAtOnce], known[kAtOnce];
        for (int j = 0; j < kAtOnce; ++j) holder[j] = list.begin[h + j < list.size ? h + j : h];
        for (int j = 0; j < kAtOnce; ++j) known[j] = block.load(&w.regroup[holder[j]]);
        for (int j = 0; j < kAtOnce && h + j < list.size; ++j) remeasure(holder[j], known[j]);
      }
    }
  }
}
CUTPROOF_KERNEL(find_classes_kernel);

// Divides the classes of each cluster into groups, and gives places to their particles. A block for each cluster. Its
// lists are in shared memory, unless the cluster has more than kMostDealt members.
template <class Block>
CUTPROOF_DEVICE void deal_out_groups_kernel(Block& block, const DeviceView& w) {
  using namespace groups_detail;
  Counters& counters = *w.counters;
  int* const next = block.template shared<int>(3);  // place, group and pair of a tile's first class
  int* const shared = block.template shared<int>(3 * kMostDealt);
  const bool whole = counters.groups_whole != 0;
  if (whole) {
    for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
      const int p = static_cast<int>(i);
      if (!alive(w, p) || w.membership_count[p] > 0) continue;
      const int o = w.place_capacity - 1 - block.atomic_add(&counters.placed_last, 1);
      place(w, p, o);
      w.group_at[p] = kLoose;
      w.loose_places[block.atomic_add(&counters.loose, 1)] = o;
    }
  }
  const int clusters = whole ? counters.slots_used : counters.regrouped;
  for (int i = block.index(); i < clusters; i += block.count()) {
    const int s = whole ? i : changed(w)[i], size = w.slot_size[s], begin = w.slot_begin[s];
    if (size == 0) continue;
    const int* const members = w.members + begin;
    const int* const classes = table(w) + begin;
    const bool fits = size <= kMostDealt;
    // By member: the entry of its class in `classes`, or -1 if another cluster divides the class, and its rank in the
    // class. By entry: the size of the class.
    const int* const entries = entry_of_member(w) + begin;
    const auto entry_at = [&](int k) { return fits ? shared[k] : entries[k]; };
    const auto rank_at = [&](int k) -> int& { return fits ? shared[kMostDealt + k] : rank_of(w)[members[k]]; };
    int* const sizes = fits ? shared + 2 * kMostDealt : class_size(w) + begin;
    if (fits) {
      for (int k = block.thread(); k < size; k += block.size()) {
        shared[k] = entries[k];
        sizes[k] = 0;
      }
      block.sync();
    }

    // Ranks are given tile by tile, in ascending order.
    const Team<Block, kMemberTeam> team(block);
    if (block.thread() < team.kLanes) {
      for (int tile = 0; tile < size; tile += team.kLanes) {
        const int k = tile + team.lane(), entry = k < size ? entry_at(k) : -1;
        const auto equals = team.equals(entry);
        int before = 0;
        if (entry >= 0 && equals.before == 0) before = block.atomic_add(&sizes[entry], equals.count);
        before = team.from(equals.first, before);
        if (entry >= 0) rank_at(k) = before + equals.before;
      }
    }
    block.sync();

    // Each thread gives a class its places and numbers.
    for (int tile = 0; tile < size; tile += block.size()) {
      const int entry = tile + block.thread();
      const int first = entry < size ? block.load(&classes[entry]) - 1 : -1;  // a particle of the class
      const int count = first >= 0 ? block.load(&sizes[entry]) : 0;
      const int own = groups_of(count), holder_count = count > 0 ? holders_of(w, first).size : 0;
      int places = 0, groups = 0, pairs = 0;
      int place_begin = block.exclusive_scan(count, places);
      int group_begin = block.exclusive_scan(own, groups);
      int pair_begin = block.exclusive_scan(own * holder_count, pairs);
      if (block.thread() == 0) {
        next[0] = block.atomic_add(&counters.placed, places);
        next[1] = block.atomic_add(&counters.groups, groups);
        next[2] = block.atomic_add(&counters.pairs, pairs);
      }
      block.sync();
      place_begin += next[0];
      group_begin += next[1];
      pair_begin += next[2];
      block.sync();  // all have read these before the next tile
      if (count == 0) continue;
      w.class_data[2 * int64_t{first}] = group_begin;
      w.class_data[2 * int64_t{first} + 1] = place_begin;
      for (int chunk = 0; chunk < own; ++chunk) {
        const int left = count - chunk * kMostInGroup;
        GroupHead head = {};
        head.begin = place_begin + chunk * kMostInGroup;
        head.size = left < kMostInGroup ? left : kMostInGroup;
        head.body = w.slot_body[s];
        head.holder_begin = pair_begin + chunk * holder_count;
        head.holder_count = holder_count;
        head.hold_set = hold_set(w, first);
        w.group_head[group_begin + chunk] = head;
      }
    }
    block.sync();

    for (int k = block.thread(); k < size; k += block.size()) {
      const int entry = entry_at(k);
      if (entry < 0) continue;
      const int p = members[k], rank = rank_at(k);
      const int* const data = w.class_data + 2 * int64_t{block.load(&classes[entry]) - 1};
      const int o = data[1] + rank;
      const bool loose = rank >= grouped_of(block.load(&sizes[entry]));
      w.group_at[p] = loose ? int{kLoose} : rank % kMostInGroup == 0 ? data[0] + rank / kMostInGroup : int{kInside};
      place(w, p, o);
      if (loose) w.loose_places[block.atomic_add(&counters.loose, 1)] = o;
    }
    block.sync();  // all have read these lists before the next cluster's
  }
}
CUTPROOF_KERNEL(deal_out_groups_kernel);

}  // namespace cutproof::gpu
