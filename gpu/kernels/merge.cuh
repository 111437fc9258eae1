// Merge (method.md §6): small clusters of bodies that were cut join clusters that they touch.
//
// A round is two launches. First every small cluster s finds the cluster t that it would join and writes it to
// proposal[s]. A proposal asks for both s and t; best[s] and best[t] decide who gets them. Under `deterministic` the
// proposer with the smallest key does, under `published` the first. Then the proposals that got both are carried out.
// Those pairs are disjoint, so each union is as legal as its proposal.
//
// Rounds end when no cluster proposes. A small cluster without a legal target will never have one, so it does not look
// again: a union u ∪ t that is legal for it contains a u or t that it touches and that was legal before.
//
// Unions are written behind the present members. When that capacity is used up, the lists are compacted and the round
// goes on. Its unions are disjoint, so they need no more than all lists together, and a merge begins only with that
// much capacity.
#pragma once
#include <cstdint>

#include "gpu/kernels/rest_frames.cuh"
#include "gpu/kernels/sorted_lists.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/state/device_view.h"

namespace cutproof::gpu {

// Threads of a block for a pair of clusters: a thousand particles, seven places each.
inline constexpr int kMergeThreads = 512;

// Scratch of merge in DeviceView::slot_scratch, by slot: the places of compacted lists.
CUTPROOF_BOTH inline int* moved_begin(const DeviceView& w) { return w.slot_scratch; }
// r + 1: in round r the cluster, or one that it touches, has changed. Until then its proposal stands.
CUTPROOF_BOTH inline int* changed_after(const DeviceView& w) { return w.slot_scratch + w.slot_capacity; }
// Not 0: the cluster has grown, or one of its particles is in fewer or more clusters than before.
CUTPROOF_BOTH inline int* rest_marks(const DeviceView& w) { return w.slot_scratch + int64_t{3} * w.slot_capacity; }
// DeviceView::best of even and odd rounds. A round writes to one and clears the previous round's other.
CUTPROOF_BOTH inline int* best_of_round(const DeviceView& w, int round) {
  return round % 2 == 0 ? w.best : w.slot_scratch + int64_t{2} * w.slot_capacity;
}

CUTPROOF_BOTH inline bool merges_now(const DeviceView& w, int b) {
  return cut_now(w, b) && w.body[b].merge_rule != MergeRule::none;
}

// --- Who may join whom -----------------------------------------------------------------------------------------------

// A hash table in shared memory of the clusters that a small cluster touches. If it overflows, which takes hundreds of
// neighbours, they are examined in windows of slots.
inline constexpr int kCandidates = 512, kProbes = 24;
struct TouchTable {
  int* slot;      // [kCandidates] -1: free
  int* shares;    // [kCandidates] particles shared with the small cluster
  int* overflow;  // [1]
};
inline constexpr std::size_t kCandidateBytes = 2 * kCandidates * sizeof(int) + 16;

template <class Block>
CUTPROOF_DEVICE TouchTable take_candidate_table(Block& block) {
  int* slot = block.template shared<int>(kCandidates);
  int* shares = block.template shared<int>(kCandidates);
  return {slot, shares, block.template shared<int>(1)};
}

template <class Block>
CUTPROOF_DEVICE void add_candidate(Block& block, const TouchTable& table, int t, bool shares) {
  unsigned place = static_cast<unsigned>(t) * 0x9E3779B9u >> 23;  // the upper 9 bits
  static_assert(kCandidates == 1 << 9);
  for (int probe = 0; probe < kProbes; ++probe) {
    const int there = block.atomic_cas(&table.slot[place], -1, t);
    if (there == -1 || there == t) {
      if (shares) block.atomic_add(&table.shares[place], 1);
      return;
    }
    place = (place + 1) % kCandidates;
  }
  block.store(table.overflow, 1);
}

// Calls visit(t, shares) for memberships t of the members of s (shares: true) and of their neighbours in G, many
// several times. The threads of the block share the work.
template <class Block, class Visit>
CUTPROOF_DEVICE void for_touching(Block& block, const DeviceView& w, int s, Visit visit) {
  const BodyConstants& body = w.body[w.slot_body[s]];
  const int* members = w.members + w.slot_begin[s];
  const int64_t looks = int64_t{7} * w.slot_size[s];
  for (int64_t i = block.thread(); i < looks; i += block.size()) {
    const int p = members[i / 7];
    const int direction = static_cast<int>(i % 7) - 1;
    int q = p;
    if (direction >= 0) {
      q = alive(w, p) ? neighbour(w, body, p, direction) : -1;
      if (q < 0 || !alive(w, q)) continue;
    }
    each_membership(block, w, q, [&](int, int t) {
      if (t >= 0 && t != s) visit(t, direction < 0);
    });
  }
}

// Preference as a number: smallest t first, then the lowest number (slot); ~0: not legal.
CUTPROOF_DEVICE inline unsigned long long preference(const DeviceView& w, int s, int t, int shares) {
  const int size = w.slot_size[s], target_size = w.slot_size[t];
  const bool contained = shares == size;
  const int64_t joined = int64_t{size} + target_size - shares;
  if (!contained && joined > w.body[w.slot_body[s]].cap) return ~0ull;
  return static_cast<unsigned long long>(target_size) << 32 | static_cast<unsigned>(t);
}

// The cluster that s, not empty, would join, or -1; the same for all threads.
template <class Block>
CUTPROOF_DEVICE int preferred_target(Block& block, const DeviceView& w, int s, const TouchTable& table) {
  for (int i = block.thread(); i < kCandidates; i += block.size()) {
    table.slot[i] = -1;
    table.shares[i] = 0;
  }
  if (block.thread() == 0) *table.overflow = 0;
  block.sync();
  for_touching(block, w, s, [&](int t, bool shares) { add_candidate(block, table, t, shares); });
  block.sync();

  unsigned long long least = ~0ull;
  if (*table.overflow == 0) {
    for (int i = block.thread(); i < kCandidates; i += block.size()) {
      if (table.slot[i] < 0) continue;
      const unsigned long long found = preference(w, s, table.slot[i], table.shares[i]);
      if (found < least) least = found;
    }
    least = block.smallest(least);
  } else {
    // Windows of slots as wide as the table need no search. One walk for each of hundreds of overlapping clusters would
    // take forever.
    constexpr int kNone = 0x7fffffff;
    for (int begin = 0;;) {
      block.sync();  // the previous window has been read
      for (int i = block.thread(); i < kCandidates; i += block.size()) {
        table.slot[i] = -1;
        table.shares[i] = 0;
      }
      int first = kNone;
      for_touching(block, w, s, [&](int t, bool) {
        if (t >= begin && t < first) first = t;
      });
      first = block.smallest(first);
      if (first == kNone) break;
      block.sync();
      for_touching(block, w, s, [&](int t, bool shares) {
        if (t < first || t - first >= kCandidates) return;
        block.store(&table.slot[t - first], t);
        if (shares) block.atomic_add(&table.shares[t - first], 1);
      });
      block.sync();
      for (int i = block.thread(); i < kCandidates; i += block.size()) {
        if (table.slot[i] < 0) continue;
        const unsigned long long found = preference(w, s, table.slot[i], table.shares[i]);
        if (found < least) least = found;
      }
      if (first > kNone - kCandidates) break;
      begin = first + kCandidates;
    }
    least = block.smallest(least);
  }
  return least == ~0ull ? -1 : static_cast<int>(least & 0xffffffffu);
}

// --- Who gets whom ---------------------------------------------------------------------------------------------------

// A bijection of 32-bit words that scatters neighbouring values (method.md §6).
CUTPROOF_BOTH inline unsigned scatter(unsigned x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

struct ProposalKey {
  unsigned word;
  int low, high, source;  // numbers
};
CUTPROOF_BOTH inline ProposalKey proposal_key(int source, int target, int round) {
  const int low = source < target ? source : target;
  const int high = source < target ? target : source;
  const unsigned word = 0x9E3779B9u * static_cast<unsigned>(low) ^ 0x85EBCA6Bu * static_cast<unsigned>(high) ^
                        0xC2B2AE35u * static_cast<unsigned>(round);
  return {scatter(word), low, high, source};
}
CUTPROOF_BOTH inline bool precedes(const ProposalKey& a, const ProposalKey& b) {
  if (a.word != b.word) return a.word < b.word;
  if (a.low != b.low) return a.low < b.low;
  if (a.high != b.high) return a.high < b.high;
  return a.source < b.source;
}

// Stores s in best[named] unless a smaller key is there. One thread; proposal[s] is visible to all.
template <class Block>
CUTPROOF_DEVICE void offer_key(Block& block, const DeviceView& w, int* best, int named, int s, int t, int round) {
  const ProposalKey own = proposal_key(w.slot_number[s], w.slot_number[t], round);
  int other = block.load(&best[named]);
  for (;;) {
    if (other >= 0) {
      block.fence();  // the proposal was written before it came here
      const int target = block.load(&w.proposal[other]);
      if (!precedes(own, proposal_key(w.slot_number[other], w.slot_number[target], round))) return;
    }
    const int seen = block.atomic_cas(&best[named], other, s);
    if (seen == other) return;
    other = seen;
  }
}

// Takes both ends or none, the lower end first. So each claim turned away in a pass waited for a higher end than the
// previous one. Hence in every schedule the last claim succeeds, and every pass merges something.
template <class Block>
CUTPROOF_DEVICE void claim_both(Block& block, int* best, int s, int t) {
  const int low = s < t ? s : t, high = s < t ? t : s;
  if (block.atomic_cas(&best[low], -1, s) != -1) return;
  if (block.atomic_cas(&best[high], -1, s) != -1) block.store(&best[low], -1);
}

// Small clusters propose in round Counters::round.
template <class Block>
CUTPROOF_DEVICE void propose_merges_kernel(Block& block, DeviceView w) {
  const TouchTable table = take_candidate_table(block);
  Counters& c = *w.counters;
  if (block.first() == 0) c.merging = c.moving = 0;
  const int round = c.round;
  int* best = best_of_round(w, round);
  int* best_before = best_of_round(w, round + 1);
  if (block.first() == 0) c.merging_round = round;
  for (int job = block.index(); job < c.small; job += block.count()) {
    const int s = w.small_clusters[job];
    const BodyConstants& body = w.body[w.slot_body[s]];
    const int before = w.proposal[s];
    if (round > 0 && before < 0) continue;  // never proposes again
    // Many clusters may wait for the same target, round after round. Only changed neighbourhoods are searched again.
    int t = before;
    const bool stands = round > 0 && block.load(&changed_after(w)[s]) != round;
    if (!stands) {
      t = -1;
      if (w.slot_size[s] > 0 && w.slot_size[s] < body.tau) t = preferred_target(block, w, s, table);
      block.sync();  // all threads have read proposal[s]
    }
    if (block.thread() != 0) continue;
    if (before >= 0) {
      block.store(&best_before[s], -1);
      block.store(&best_before[before], -1);
    }
    block.store(&w.proposal[s], t);
    if (t < 0) continue;
    if (body.merge_rule == MergeRule::deterministic) {
      block.fence();
      offer_key(block, w, best, s, s, t, round);
      offer_key(block, w, best, t, s, t, round);
    } else {
      claim_both(block, best, s, t);
    }
  }
}
CUTPROOF_KERNEL_THREADS(propose_merges_kernel, kMergeThreads);

// --- Merging ---------------------------------------------------------------------------------------------------------

// The first of `count` free places for members; -1: too few, the lists must be compacted. One thread.
template <class Block>
CUTPROOF_DEVICE int reserve_members(Block& block, const DeviceView& w, int count) {
  Counters& c = *w.counters;
  const int begin = block.atomic_add(&c.members_used, count);
  if (begin <= w.member_capacity - count) return begin;
  block.atomic_add(&c.members_used, -count);
  block.store(&c.moving, c.slots_used);
  return -1;
}

// Members of s become members of t instead, or lose a membership if they are in `list`, the members of t. Other blocks
// do so for other pairs, in other places of the same rows of memberships.
template <class Block>
CUTPROOF_DEVICE void hand_over(Block& block, const DeviceView& w, int s, int t, const int* list, int size) {
  int* marks = rest_marks(w);
  const int* members = w.members + w.slot_begin[s];
  if (block.thread() == 0) {
    block.store(&w.regroup[s], 1);
    block.store(&w.regroup[t], 1);
  }
  for (int k = block.thread(); k < w.slot_size[s]; k += block.size()) {
    const int p = members[k];
    const bool twice = contains(list, size, p);
    mark_unsorted(block, w, p);
    if (twice) block.atomic_add(&w.membership_count[p], -1);
    each_membership(block, w, p, [&](int h, int slot) {
      if (slot == s) return block.store(&w.memberships[h], twice ? -1 : t);
      if (slot < 0) return;
      block.store(&w.regroup[slot], 1);
      if (twice) block.store(&marks[slot], 1);
    });
  }
}

// Carries out the proposals that got both ends. again: those that found no places before compaction. Another round
// follows if a proposal did not get both; no other cluster could propose in it. (A small cluster that another one took
// has itself proposed and lost, or never proposes again.)
template <class Block>
CUTPROOF_DEVICE void merge_pairs_kernel(Block& block, DeviceView w, bool again) {
  int* place = block.template shared<int>(1);
  Counters& c = *w.counters;
  const int* best = best_of_round(w, c.merging_round);
  const bool moving = block.any(block.thread() == 0 && block.load(&c.moving) != 0);
  for (int job = block.index(); job < c.small && moving == again; job += block.count()) {
    const int s = w.small_clusters[job];
    const int t = w.proposal[s];
    if (t < 0) continue;
    if (best[s] != s || best[t] != s) {
      if (block.thread() == 0) block.store(&c.merging, 1);
      continue;
    }
    if (w.slot_size[s] == 0) continue;  // done before
    const int size = w.slot_size[s], target_size = w.slot_size[t];
    const int* members = w.members + w.slot_begin[s];
    const int* target = w.members + w.slot_begin[t];
    const int missing = count_missing(block, members, size, target, target_size);
    if (missing > 0) {
      if (block.thread() == 0) *place = reserve_members(block, w, target_size + missing);
      block.sync();
      if (*place >= 0) write_union(block, target, target_size, members, size, w.members + *place);
    }
    const bool fits = missing == 0 || *place >= 0;
    if (fits) {
      // Others change at the same time: a cluster read here may be gone, but the one that took it in then marks itself.
      int* changed = changed_after(w);
      const auto note = [&](int touched, bool) { block.store(&changed[touched], c.merging_round + 1); };
      for_touching(block, w, s, note);
      for_touching(block, w, t, note);
      if (block.thread() == 0) {
        note(s, true);
        note(t, true);
      }
      hand_over(block, w, s, t, target, target_size);
    }
    block.sync();
    if (block.thread() == 0 && fits) {
      if (missing > 0) w.slot_begin[t] = *place;
      w.slot_size[t] = target_size + missing;
      w.slot_size[s] = 0;
      block.store(&rest_marks(w)[t], 1);
    }
  }
  if (block.first() == 0) c.round = c.merging_round + 1;
}
CUTPROOF_KERNEL_THREADS(merge_pairs_kernel, kMergeThreads);

// --- Beginning and end -----------------------------------------------------------------------------------------------

// No merge after a fault: the faulty stage may have left dead particles in clusters.
template <class Block>
CUTPROOF_DEVICE void begin_merge_kernel(Block& block, DeviceView w) {
  const Counters& c = *w.counters;
  for (int64_t s = block.first(); s < c.slots_used; s += block.stride()) {
    w.slot_flag[s] = 0;
    if (c.fault != 0 || !merges_now(w, w.slot_body[s])) continue;
    w.proposal[s] = -1;
    best_of_round(w, 0)[s] = -1;
    best_of_round(w, 1)[s] = -1;
    rest_marks(w)[s] = 0;
    changed_after(w)[s] = 0;
    w.slot_flag[s] = w.slot_size[s] > 0 && w.slot_size[s] < w.body[w.slot_body[s]].tau;
  }
}
CUTPROOF_KERNEL(begin_merge_kernel);

// Lists the small clusters and asks whether capacity surely suffices for a round. A round unites each list at most
// once, and each small cluster with one other to at most cap members. One block.
template <class Block>
CUTPROOF_DEVICE void begin_rounds_kernel(Block& block, const DeviceView& w) {
  if (block.index() != 0) return;
  Counters& c = *w.counters;
  int live = 0;
  const int small = count_off(
      block, 0, c.slots_used, 0,
      [&](int s) {
        live += w.slot_size[s];
        return w.slot_flag[s] != 0;
      },
      [&](int n, int s) { w.small_clusters[n] = s; });
  live = block.sum(live);
  if (block.thread() != 0) return;
  c.small = small;
  c.live_members = live;
  int cap = 0;
  for (int b = 0; b < w.bodies; ++b) {
    if (merges_now(w, b) && w.body[b].cap > cap) cap = w.body[b].cap;
  }
  int64_t most = int64_t{c.small} * cap;
  if (most > c.live_members) most = c.live_members;
  if (c.live_members + most > w.member_capacity) {
    c.small = 0;
    block.atomic_or(&c.fault, kMembersFull);
  }
  c.merging = c.small > 0;
  c.round = 0;
  c.moving = 0;
}
CUTPROOF_KERNEL_THREADS(begin_rounds_kernel, kListThreads);

// Of clusters that have grown, and of clusters whose particles are in fewer clusters.
template <class Block>
CUTPROOF_DEVICE void rest_frames_after_merge_kernel(Block& block, DeviceView w) {
  if (w.counters->small == 0) return;
  const Team<Block, kRestTeam> team(block);
  team.each_wanted(
      w.counters->slots_used,
      [&](int s) { return merges_now(w, w.slot_body[s]) && w.slot_size[s] > 0 && rest_marks(w)[s] != 0; },
      [&](int s) { recompute_rest_frame(team, w, s); });
}
CUTPROOF_KERNEL(rest_frames_after_merge_kernel);

// --- Compacting lists ------------------------------------------------------------------------------------------------

// Copies to DeviceView::label in the order of slots.
template <class Block>
CUTPROOF_DEVICE void gather_members_kernel(Block& block, DeviceView w) {
  for (int s = block.index(); s < w.counters->moving; s += block.count()) {
    const int from = w.slot_begin[s], to = moved_begin(w)[s];
    for (int k = block.thread(); k < w.slot_size[s]; k += block.size()) w.label[to + k] = w.members[from + k];
  }
}
CUTPROOF_KERNEL(gather_members_kernel);

// Copies back.
template <class Block>
CUTPROOF_DEVICE void place_members_kernel(Block& block, DeviceView w) {
  Counters& c = *w.counters;
  if (c.moving == 0) return;
  for (int64_t q = block.first(); q < c.moved_members; q += block.stride()) w.members[q] = w.label[q];
  for (int64_t s = block.first(); s < c.moving; s += block.stride()) w.slot_begin[s] = moved_begin(w)[s];
  if (block.first() != 0) return;
  c.members_used = c.moved_members;
  c.groups_whole = 1;  // groups refer to the members' former places
}
CUTPROOF_KERNEL(place_members_kernel);

// Launched only if Counters::moving says so.
template <class Launcher>
void enqueue_move_together(Launcher& launcher, const DeviceView& w) {
  launcher.exclusive_scan(w.slot_size, moved_begin(w), w.slot_capacity, &w.counters->moved_members,
                          &w.counters->moving);
  // Lists are hardly ever compacted, so idle launches are kept small.
  constexpr int64_t kBlocks = 128, kThreads = 256;
  launcher.blocks(gather_members_kernel_object{}, kBlocks, kThreads, 0, w);
  launcher.items(place_members_kernel_object{}, kBlocks * kThreads, w);
}

// Little work follows a cut, so grids are small; a block may take several clusters.
inline constexpr int kMergeBlocks = 2048, kBlocksAgain = 128;

template <class Launcher>
void enqueue_merge_rounds(Launcher& launcher, const DeviceView& w) {
  const int64_t most = w.slots_expected < kMergeBlocks ? w.slots_expected : kMergeBlocks;
  // One condition: it costs as much as ten launches of kernels without work.
  launcher.while_nonzero(&w.counters->merging, [&](Launcher& round) {
    round.blocks(propose_merges_kernel_object{}, most, kMergeThreads, kCandidateBytes, w);
    round.blocks(merge_pairs_kernel_object{}, most, kMergeThreads, 16, w, false);
    enqueue_move_together(round, w);
    round.blocks(merge_pairs_kernel_object{}, kBlocksAgain, kMergeThreads, 16, w, true);
  });
  launcher.teams(rest_frames_after_merge_kernel_object{}, kRestTeam, w.slots_expected, w);
}

// rest_frames: launches those of the present clusters, while small ones are listed.
template <class Launcher, class RestFrames = NoWork>
void enqueue_merge(Launcher& launcher, const DeviceView& w, RestFrames rest_frames = {}) {
  launcher.side_by_side(
      rest_frames,
      [&](Launcher& on) {
        on.items(begin_merge_kernel_object{}, w.slots_expected, w);
        on.blocks(begin_rounds_kernel_object{}, 1, kListThreads, 0, w);
      },
      NoWork{}, [&](Launcher& on) { enqueue_merge_rounds(on, w); });
}

}  // namespace cutproof::gpu
