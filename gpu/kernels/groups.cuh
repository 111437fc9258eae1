// Groups: particles that the same clusters hold, which the step carries together (docs/design/method.md §13). Here they
// are made, from the clusters alone: which particles are in which group, and every constant that sums over groups need.
//
// A class belongs to the first of its holders. There equal lists of holders meet in a hash table as long as the
// cluster, and one team counts them in ascending order. So a class has its particles, chunk by chunk of kMostInGroup,
// wherever it is in memory. A particle is loose if its chunk has fewer than kLeastInGroup, and if it has no holder.
// Particles that different grips hold are in different classes. All of that depends on the body's own clusters and
// particles only.
#pragma once
#include "gpu/kernels/float3.h"
#include "gpu/launch/launcher.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"

namespace cutproof::gpu {

// Lanes that measure a group, and that look through the members of a cluster.
inline constexpr int kGroupTeam = 8;
inline constexpr int kMemberTeam = 32;
// Teams that share a cluster where each of its members is looked at alone, and where they are counted.
inline constexpr int kShares = 8, kCountShares = 4;
// Where a cluster is dealt out: threads, and how many members have room in their shared memory.
inline constexpr int kDealThreads = 256;
inline constexpr int kMostDealt = 2048;

namespace groups_detail {

// DeviceView::group_at of particles that are no group's first.
enum : int { kInside = -1, kLoose = -2 };

// By place in DeviceView::members, those of a cluster being its own table: a particle of the class (from 1; 0: none),
// and how many of the class have been counted.
CUTPROOF_BOTH inline int* table(const DeviceView& w) { return w.label; }
CUTPROOF_BOTH inline int* class_size(const DeviceView& w) { return w.member_scratch; }
// Of DeviceView::slot_scratch: clusters whose groups are made anew, and those whose lists of groups are.
CUTPROOF_BOTH inline int* changed(const DeviceView& w) { return w.slot_scratch; }
CUTPROOF_BOTH inline int* remeasured(const DeviceView& w) { return w.slot_scratch + w.slot_capacity; }
inline constexpr int kRemeasured = 2;  // in DeviceView::regroup: it is listed among the latter
// Likewise by place: the entry of the member's class in that table, -1 if its class is not this cluster's.
CUTPROOF_BOTH inline int* entry_of_member(const DeviceView& w) { return w.cluster_loose; }
// By particle of a class that is dealt out, where there is no shared memory for it: how many of the class are smaller.
CUTPROOF_BOTH inline int* rank_of(const DeviceView& w) { return w.place_of; }

// A particle's holders: the gaps of its list (-1) are at its end.
struct HolderList {
  const int* begin;
  int size;
};
CUTPROOF_DEVICE inline HolderList holders_of(const DeviceView& w, int p) {
  return {w.memberships + w.membership_begin[p], w.membership_count[p]};
}
// Both take several entries at once: one by one, each would wait for the one before.
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

// X_g - T_s [h]: an exact difference of grid coordinates, and one of offsets.
CUTPROOF_DEVICE inline Offset offset_between(RestCenter group, RestCenter cluster, int index) {
  return {static_cast<float>(group.i - cluster.i) + (group.x - cluster.x),
          static_cast<float>(group.j - cluster.j) + (group.y - cluster.y),
          static_cast<float>(group.k - cluster.k) + (group.z - cluster.z), index};
}

// Sums of masses about a point, in nodes: first moments, mass, second moments (xx xy xz yy yz zz).
CUTPROOF_DEVICE inline void add_masses(float* sum, float m, Float3 r) {
  sum[0] += m * r.x;
  sum[1] += m * r.y;
  sum[2] += m * r.z;
  sum[3] += m;
  sum[4] += m * (r.x * r.x);
  sum[5] += m * (r.x * r.y);
  sum[6] += m * (r.x * r.z);
  sum[7] += m * (r.y * r.y);
  sum[8] += m * (r.y * r.z);
  sum[9] += m * (r.z * r.z);
}

}  // namespace groups_detail

// Clusters that have changed: how many particles and pairs of theirs may need places.
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

// Groups and loose particles of changed clusters are no more. By its first holder, in whose list it is: whoever's
// clusters have changed had, as all of its group, a first one that has.
template <class Block>
CUTPROOF_DEVICE void dissolve_groups_kernel(Block& block, const DeviceView& w) {
  using namespace groups_detail;
  Counters& c = *w.counters;
  // Where there is no room behind the groups that stay, none does.
  const bool whole = block.load(&c.groups_whole) != 0 ||
                     c.placed + c.placed_last + c.due_particles > w.place_capacity ||
                     c.groups + c.due_particles / kLeastInGroup > w.group_capacity ||
                     c.pairs + c.due_pairs / kLeastInGroup > w.pair_capacity;
  if (block.first() == 0) {
    c.groups_before = whole ? 0 : c.groups;
    block.store(&c.groups_whole, whole ? 1 : 0);
  }
  // Their tables.
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

// Each particle of a changed cluster finds its class in its first holder's table.
template <class Block>
CUTPROOF_DEVICE void find_classes_kernel(Block& block, const DeviceView& w) {
  using namespace groups_detail;
  const Team<Block, kMemberTeam> team(block);
  Counters& c = *w.counters;
  const bool whole = c.groups_whole != 0;
  if (whole && block.first() == 0) c.groups = c.placed = c.placed_last = c.loose = c.pairs = 0;
  // known: what DeviceView::regroup has of s.
  const auto remeasure = [&](int s, int known) {
    if (known >= kRemeasured) return;
    if ((block.atomic_or(&w.regroup[s], kRemeasured) & kRemeasured) != 0) return;
    remeasured(w)[block.atomic_add(&c.remeasured, 1)] = s;
  };
  // Several teams for each cluster: there may be few.
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

// Deals the classes of each cluster out to groups, and gives places to their particles. A block for each cluster, whose
// lists are in shared memory, unless there are more than kMostDealt members.
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
    // By member: the entry of its class in `classes`, -1 if that is not this cluster's to deal out, and how many of its
    // class come before it. By entry: how many the class has.
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

    // Ranks, tile by tile in ascending order.
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

    // Places and numbers, for as many classes at once as there are threads.
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
      block.sync();  // before the next tile has others
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
    block.sync();  // before the next cluster's lists
  }
}
CUTPROOF_KERNEL(deal_out_groups_kernel);

// X_g, the moments of the masses about it, and the offsets from the holders' rest centres.
template <class Block>
CUTPROOF_DEVICE void measure_groups_kernel(Block& block, const DeviceView& w) {
  using namespace groups_detail;
  using Lanes = Team<Block, kGroupTeam>;
  const Lanes team(block);
  // Of a lane's own particles, which are asked for once.
  constexpr int kEach = kMostInGroup / Lanes::kLanes;
  struct Own {
    Coordinates node;
    float mass;  // what each holder gets of it
  };
  for (int64_t i = w.counters->groups_before + team.first(); i < w.counters->groups; i += team.stride()) {
    const int g = static_cast<int>(i);
    GroupHead head = w.group_head[g];
    const int first = w.place_particle[head.begin];
    const BodyConstants& body = w.body[head.body];
    const float of_each = 1.0f / static_cast<float>(head.holder_count);
    Own own[kEach];
    const auto each = [&](auto visit) {  // visit(k, own)
      for (int n = 0; n < kEach; ++n) {
        const int k = n * team.kLanes + team.lane();
        if (k < head.size) visit(k, own[n]);
      }
    };
    each([&](int k, Own& of) {
      of.node = coordinates(body, w.place_node[head.begin + k]);
      of.mass = of_each * w.displacement[w.place_particle[head.begin + k]].w;
    });
    const Coordinates base = coordinates(body, w.place_node[head.begin]);
    RestCenter center = {base.i, base.j, base.k, 0, 0, 0};
    // Twice: what the first centre is off by is taken out.
    for (int round = 0; round < 2; ++round) {
      typename Lanes::template Sums<4> sums;
      each([&](int k, const Own& of) {
        const Float3 r = nodes_between(center, of.node);
        float* const sum = sums.of(k);
        sum[0] += of.mass * r.x;
        sum[1] += of.mass * r.y;
        sum[2] += of.mass * r.z;
        sum[3] += of.mass;
      });
      const auto total = team.total(sums);
      center.x += total.v[0] / total.v[3];
      center.y += total.v[1] / total.v[3];
      center.z += total.v[2] / total.v[3];
    }
    typename Lanes::template Sums<10> sums;
    float farthest = 0, nearest = -INFINITY;  // less the square of the least distance
    each([&](int k, const Own& of) {
      const Float3 r = nodes_between(center, of.node);
      add_masses(sums.of(k), of.mass, r);
      farthest = fmaxf(farthest, dot(r, r));
      nearest = fmaxf(nearest, -dot(r, r));
    });
    const auto total = team.total(sums);
    farthest = team.greatest(farthest);
    nearest = team.greatest(nearest);
    int middle = head.size;  // the first of the nearest
    each([&](int k, const Own& of) {
      const Float3 r = nodes_between(center, of.node);
      if (-dot(r, r) == nearest && k < middle) middle = k;
    });
    head.middle = -static_cast<int>(team.greatest(-static_cast<float>(middle)));
    head.radius = sqrtf(farthest) * (1.0f + 0x1p-20f);
    if (team.leads()) {
      w.group_head[g] = head;
      w.group_center[g] = center;
      w.group_mass[g] = {total.v[0], total.v[1], total.v[2], total.v[3]};
      w.group_spread[2 * i] = {total.v[4], total.v[5], total.v[6], total.v[7]};
      w.group_spread[2 * i + 1] = {total.v[8], total.v[9], 0, 0};
    }
    const HolderList list = holders_of(w, first);
    team.each(list.size, [&](int k) {
      w.holders[head.holder_begin + k] = offset_between(center, rest_center(w, list.begin[k]), list.begin[k]);
    });
  }
}
CUTPROOF_KERNEL(measure_groups_kernel);

// What each cluster is made of, and the moments of its members about its rest centre, which may have moved: so groups
// that stay hear of it too.
template <class Block>
CUTPROOF_DEVICE void measure_clusters_kernel(Block& block, const DeviceView& w) {
  using namespace groups_detail;
  const Team<Block, kMemberTeam> team(block);
  Counters& counters = *w.counters;
  const bool whole = block.load(&counters.groups_whole) != 0;
  const int clusters = whole ? counters.slots_used : counters.remeasured;
  for (int64_t i = team.first(); i < clusters; i += team.stride()) {
    const int s = whole ? static_cast<int>(i) : remeasured(w)[i], size = w.slot_size[s];
    if (team.leads()) w.regroup[s] = 0;
    if (size == 0) {
      if (team.leads()) w.cluster_head[s] = {};
      continue;
    }
    const BodyConstants& body = w.body[w.slot_body[s]];
    const RestCenter center = rest_center(w, s);
    const int* const members = w.members + w.slot_begin[s];
    // A list of groups has a quarter of the room that the members have, for each group has kLeastInGroup of them.
    const int list_begin = (w.slot_begin[s] + kLeastInGroup - 1) / kLeastInGroup;
    int groups = 0, loose = 0;
    typename Team<Block, kMemberTeam>::template Sums<10> sums;
    // Several tiles at once: each of these steps waits for what the one before has asked for.
    constexpr int kAtOnce = 6;
    for (int tile = 0; tile < size; tile += kAtOnce * team.kLanes) {
      int member[kAtOnce], at[kAtOnce], node[kAtOnce], share[kAtOnce], place[kAtOnce];
      float mass[kAtOnce];
      for (int t = 0; t < kAtOnce; ++t) {
        const int k = tile + t * team.kLanes + team.lane();
        member[t] = members[k < size ? k : 0];
      }
      for (int t = 0; t < kAtOnce; ++t) {
        const int p = member[t];
        at[t] = tile + t * team.kLanes + team.lane() < size ? w.group_at[p] : int{kInside};
        node[t] = w.node[p];
        mass[t] = w.displacement[p].w;
        share[t] = w.membership_count[p];
        place[t] = w.place_of[p];
      }
      Offset to[kAtOnce];
      for (int t = 0; t < kAtOnce; ++t) {
        if (at[t] >= 0) to[t] = offset_between(w.group_center[at[t]], center, at[t]);
      }
      for (int t = 0; t < kAtOnce; ++t) {
        const int k = tile + t * team.kLanes + team.lane();
        if (k < size) {
          const Float3 r = nodes_between(center, coordinates(body, node[t]));
          add_masses(sums.of(k), mass[t] / static_cast<float>(share[t]), r);
        }
        int found = 0;
        const int before = team.rank(at[t] == kLoose, found);
        if (at[t] == kLoose) w.cluster_loose[w.slot_begin[s] + loose + before] = place[t];
        loose += found;
        const int group = groups + team.rank(at[t] >= 0, found);
        groups += found;
        if (at[t] >= 0) w.cluster_groups[list_begin + group] = to[t];
      }
    }
    // Groups that stay; those that are new have been told.
    team.sync();  // the list
    team.each(groups, [&](int k) {
      const Offset to = w.cluster_groups[list_begin + k];
      if (to.index >= counters.groups_before) return;
      const GroupHead head = w.group_head[to.index];
      const int end = head.holder_begin + head.holder_count;
      for (int first = head.holder_begin; first < end; first += kAtOnce) {
        int index[kAtOnce];
        for (int j = 0; j < kAtOnce; ++j) index[j] = w.holders[first + j < end ? first + j : first].index;
        for (int j = 0; j < kAtOnce; ++j) {
          if (index[j] == s && first + j < end) w.holders[first + j] = {to.x, to.y, to.z, s};
        }
      }
    });
    const auto total = team.total(sums);
    if (!team.leads()) continue;
    w.cluster_head[s] = {list_begin, groups, w.slot_begin[s], loose};
    w.cluster_rest[3 * int64_t{s}] = {total.v[0], total.v[1], total.v[2], total.v[3]};
    w.cluster_rest[3 * int64_t{s} + 1] = {total.v[4], total.v[5], total.v[6], total.v[7]};
    w.cluster_rest[3 * int64_t{s} + 2] = {total.v[8], total.v[9], 0, 0};
  }
}
CUTPROOF_KERNEL(measure_clusters_kernel);

// Groups of the clusters that have changed since the last time; none, if none has. Requires memberships in order.
template <class Launcher>
void enqueue_groups(Launcher& launcher, const DeviceView& w) {
  launcher.teams(find_changed_clusters_kernel_object{}, kMemberTeam, w.slots_expected, w);
  launcher.teams(dissolve_groups_kernel_object{}, kMemberTeam, w.slots_expected, w);
  launcher.teams(find_classes_kernel_object{}, kMemberTeam, w.slots_expected, w);
  launcher.blocks(deal_out_groups_kernel_object{}, w.slots_expected, kDealThreads, (3 * kMostDealt + 4) * sizeof(int),
                  w);
  launcher.teams(measure_groups_kernel_object{}, kGroupTeam, w.group_capacity, w);
  launcher.teams(measure_clusters_kernel_object{}, kMemberTeam, w.slots_expected, w);
  launcher.clear(&w.counters->groups_stale, 6 * sizeof(int));  // and the five behind it
}
// The same at any time, where nobody knows whether any has.
template <class Launcher>
void enqueue_groups_if_stale(Launcher& launcher, const DeviceView& w) {
  Counters* const c = w.counters;  // an address only: counters lie on the device
  launcher.if_nonzero(&c->groups_stale, [&](Launcher& stale) { enqueue_groups(stale, w); });
}

}  // namespace cutproof::gpu
