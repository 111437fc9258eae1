// Every primitive of block.h and launcher.h against its definition, over any machine: the host (launch_test.cpp) and
// the device (launch_device_test.cu) compile the same kernels and the same checks.
//
// A Machine has
//   template <class T> Array<T> array(const std::vector<T>&);   T* Array::at(); std::vector<T> Array::get()
//   template <class Work> void run(Work);                       work(launcher), and all of it is done afterwards
//   std::vector<int> block_sizes();                             to ask blocks() for
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <set>
#include <vector>

#include "gpu/launch/launcher.h"
#include "gpu/launch/team.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu {

// Any 32 bits for any pair.
CUTPROOF_BOTH inline unsigned scramble(unsigned a, unsigned b) {
  unsigned x = a * 0x9E3779B9u ^ (b + 0x85EBCA6Bu);
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}
CUTPROOF_BOTH inline int small_value(int job, int thread) {
  return static_cast<int>(scramble(static_cast<unsigned>(job), static_cast<unsigned>(thread)) % 2001u) - 1000;
}
CUTPROOF_BOTH inline unsigned long long wide_value(int job, int thread) {
  const unsigned upper = scramble(static_cast<unsigned>(job), static_cast<unsigned>(thread));
  return static_cast<unsigned long long>(upper) << 32 | scramble(upper, static_cast<unsigned>(thread));
}
CUTPROOF_BOTH inline float any_float(int job, int thread) {
  return static_cast<float>(small_value(job, thread)) * 0.001f + 1e-4f * static_cast<float>(thread);
}

template <class Block>
CUTPROOF_DEVICE void visit_items_kernel(Block& block, int* visits, int count) {
  for (std::int64_t i = block.first(); i < count; i += block.stride()) visits[i] += 1;
}
CUTPROOF_KERNEL(visit_items_kernel);

template <class Block>
CUTPROOF_DEVICE void visit_jobs_kernel(Block& block, int* visits, int* wrong, int count) {
  for (int job = block.index(); job < count; job += block.count()) {
    if (block.thread() == 0) visits[job] += 1;
  }
  const bool right = block.thread() >= 0 && block.thread() < block.size() && block.index() < block.count() &&
                     block.lane() == block.thread() % 32 && (block.size() % 32 == 0 || block.size() == 1) &&
                     block.first() == static_cast<std::int64_t>(block.index()) * block.size() + block.thread() &&
                     block.stride() == static_cast<std::int64_t>(block.count()) * block.size();
  if (!right) block.atomic_add(wrong, 1);
}
CUTPROOF_KERNEL(visit_jobs_kernel);

// What every thread of a job got. [job · 1024 + thread]
struct Collected {
  int* size;
  int* sum;
  int* smallest;
  unsigned long long* smallest_wide;
  int* any;
  int* none;
  int* scan;
  int* total;
  int* sum_after;
};

template <class Block>
CUTPROOF_DEVICE void collect_kernel(Block& block, Collected out, int jobs) {
  for (int job = block.index(); job < jobs; job += block.count()) {
    const int t = block.thread(), at = job * 1024 + t;
    const int value = small_value(job, t);
    out.size[at] = block.size();
    out.sum[at] = block.sum(value);
    out.smallest[at] = block.smallest(value);
    out.smallest_wide[at] = block.smallest(wide_value(job, t));
    out.any[at] = block.any(t == job % block.size());
    out.none[at] = block.any(false);
    int total = -1;
    out.scan[at] = block.exclusive_scan(value, total);
    out.total[at] = total;
    // One after the other without a barrier between them: scratch memory must not be reused too early.
    int sum = 0;
    for (int round = 0; round < 5; ++round) sum += block.sum(value + round);
    out.sum_after[at] = sum;
  }
}
CUTPROOF_KERNEL_THREADS(collect_kernel, 1024);

struct Warped {
  unsigned* all;
  unsigned* half;    // ballot among lanes of the same parity
  int* rotated;      // shuffle from the next lane
  int* from_leader;  // within the parity
  unsigned long long* wide;
  Float3* vector;
};

template <class Block>
CUTPROOF_DEVICE void warp_kernel(Block& block, Warped out) {
  const std::int64_t at = block.first();
  const int lane = block.lane();
  const unsigned everyone = 0xffffffffu;
  out.all[at] = block.ballot(everyone, lane % 3 == 0);
  out.rotated[at] = block.shuffle(everyone, static_cast<int>(at), (lane + 1) % 32);
  out.wide[at] = block.shuffle(everyone, (1ull << 40) + static_cast<unsigned long long>(at), 31 - lane);
  out.vector[at] = block.shuffle(everyone, Float3{static_cast<float>(lane), 2.0f, -static_cast<float>(lane)}, lane ^ 5);
  if (lane % 2 == 0) {
    out.half[at] = block.ballot(0x55555555u, lane < 16);
    out.from_leader[at] = block.shuffle(0x55555555u, static_cast<int>(at), 0);
  } else {
    out.half[at] = block.ballot(0xaaaaaaaau, lane >= 16);
    out.from_leader[at] = block.shuffle(0xaaaaaaaau, static_cast<int>(at), 1);
  }
}
CUTPROOF_KERNEL(warp_kernel);

inline constexpr int kTeamSums = 10, kTeamClasses = 8;

// What teams make of jobs; job j has the items from begin[j] to begin[j + 1], with the values small_value(j, k).
struct Teamed {
  enum : int { kOdd, kTotal, kAny, kWrong, kCounts };
  const int* begin;
  float* sums;      // of any_float(j + n, k) over k [j · kTeamSums + n]
  float* parts;     // the same, by parted()
  float* half;      // the same, by half of the lanes that the order of adding is of
  int* counts;      // [j · kCounts + which]
  float* greatest;  // of any_float(j, k)
  int* kept;        // from begin[j] on: the items with odd values, in order
  int* place;       // of each item: the sum of the values before it
  int* taken;       // 1: the team was given this item as a job of its own; of values that 3 divides
  int* classes;     // items by the lowest bits of their values [j · kTeamClasses + class]
};

template <class Block, int kWidth>
CUTPROOF_DEVICE void team_kernel(Block& block, const Teamed& out, int jobs) {
  const Team<Block, kWidth> team(block);
  for (std::int64_t i = team.first(); i < jobs; i += team.stride()) {
    const int job = static_cast<int>(i);
    const int first = out.begin[job], size = out.begin[job + 1] - first;
    typename Team<Block, kWidth>::template Sums<kTeamSums> sums, again;
    typename Team<Block, kWidth>::template Sums<kTeamSums, 2 * kWidth> of_twice, of_twice_again;
    int wrong = 0;
    team.each(of_twice, size, [&](int k, int bank, float* sum) {
      if (bank != k % (2 * kWidth) / team.kLanes) ++wrong;
      for (int n = 0; n < kTeamSums; ++n) sum[n] += any_float(job + n, k);
    });
    of_twice_again = of_twice;
    team.each(size, [&](int k) {
      for (int n = 0; n < kTeamSums; ++n) {
        sums.of(k)[n] += any_float(job + n, k);
        again.of(k)[n] += any_float(job + n, k);
      }
    });
    const auto total = team.total(sums);
    if (team.leads()) {
      for (int n = 0; n < kTeamSums; ++n) out.sums[job * kTeamSums + n] = total.v[n];
    }
    const auto half = team.total(of_twice);
    if (team.leads()) {
      for (int n = 0; n < kTeamSums; ++n) out.half[job * kTeamSums + n] = half.v[n];
    }
    const auto half_parts = team.parted(of_twice_again);
    for (int n = 0; n < kTeamSums; ++n) {
      if (half_parts.get(team, n) != half.v[n]) ++wrong;
    }
    const auto parts = team.parted(again);
    for (int n = 0; n < kTeamSums; ++n) {
      if (parts.get(team, n) != total.v[n]) ++wrong;
    }
    parts.each(team, [&](int n, float sum) { out.parts[job * kTeamSums + n] = sum; });
    float most = -1e9f;
    int values = 0, odd = 0, before = 0;
    bool any_odd = false;
    for (int tile = 0; tile < size; tile += team.kLanes) {
      const int k = tile + team.lane();
      const bool inside = k < size;
      const int value = inside ? small_value(job, k) : 0;
      if (inside) most = most > any_float(job, k) ? most : any_float(job, k);
      values += value;
      any_odd = any_odd || value % 2 != 0;
      int found = 0;
      const int rank = team.rank(value % 2 != 0, found);
      if (value % 2 != 0) out.kept[first + odd + rank] = k;
      odd += found;
      const int lower = team.total_before(value);
      if (inside) out.place[first + k] = before + lower;
      before += team.total(value);
      const auto equals = team.equals(inside ? value & (kTeamClasses - 1) : -1);
      if (equals.before == 0 && equals.first != team.lane()) ++wrong;
      if (inside && equals.before == 0)
        block.atomic_add(&out.classes[job * kTeamClasses + (value & (kTeamClasses - 1))], equals.count);
      unsigned lanes = team.found(inside && value % 3 == 0);
      while (lanes != 0) {
        const int mine = team.take(lanes, k);  // to all of them
        if (team.has(mine - tile)) out.taken[first + mine] += 1;
      }
      const int last = size - 1 < tile + team.kLanes - 1 ? size - 1 : tile + team.kLanes - 1;
      if (team.from(last - tile, value) != small_value(job, last)) ++wrong;
    }
    const float of_all = team.greatest(most);
    const int all = team.total(values), all_wrong = team.total(wrong);
    const bool any = team.any(any_odd);
    if (!team.leads()) continue;
    out.greatest[job] = of_all;
    out.counts[job * Teamed::kCounts + Teamed::kOdd] = odd;
    out.counts[job * Teamed::kCounts + Teamed::kTotal] = all;
    out.counts[job * Teamed::kCounts + Teamed::kAny] = any ? 1 : 0;
    out.counts[job * Teamed::kCounts + Teamed::kWrong] = all_wrong;
  }
}
template <int kWidth>
struct team_kernel_object {
  static constexpr const char* kName = "team_kernel";
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const Teamed& out, int jobs) const {
    team_kernel<Block, kWidth>(block, out, jobs);
  }
};

struct Tallies {
  int add, least, greatest, bits, cas, last;
  unsigned long long wide;
};

template <class Block>
CUTPROOF_DEVICE void atomics_kernel(Block& block, Tallies* tallies, int* ticket, int* exchanged, int count) {
  for (std::int64_t item = block.first(); item < count; item += block.stride()) {
    const int i = static_cast<int>(item);
    ticket[i] = block.atomic_add(&tallies->add, 1);
    block.atomic_min(&tallies->least, small_value(i, 0));
    block.atomic_max(&tallies->greatest, small_value(i, 0));
    block.atomic_or(&tallies->bits, 1 << (i % 20));
    exchanged[i] = block.atomic_exchange(&tallies->last, i);
    block.atomic_add(&tallies->wide, (1ull << 33) + 1);
    for (int seen = block.load(&tallies->cas);;) {
      const int old = block.atomic_cas(&tallies->cas, seen, seen + 3);
      if (old == seen) break;
      seen = old;
    }
  }
}
CUTPROOF_KERNEL(atomics_kernel);

// Turns each row of 64 numbers around, through shared memory.
template <class Block>
CUTPROOF_DEVICE void reverse_rows_kernel(Block& block, const int* in, int* out, int* misplaced, int rows) {
  unsigned char* first = block.template shared<unsigned char>(3);
  int* row = block.template shared<int>(64);
  Float4* last = block.template shared<Float4>(2);
  const auto place = [](const void* p) { return reinterpret_cast<std::uintptr_t>(p); };
  if (place(row) % 16 != 0 || place(last) % 16 != 0 || place(first) + 3 > place(row) ||
      place(row) + 64 * sizeof(int) > place(last)) {
    block.atomic_add(misplaced, 1);
  }
  for (int job = block.index(); job < rows; job += block.count()) {
    for (int i = block.thread(); i < 64; i += block.size()) row[i] = in[job * 64 + i];
    block.sync();
    for (int i = block.thread(); i < 64; i += block.size()) out[job * 64 + i] = row[63 - i];
    block.sync();
  }
}
CUTPROOF_KERNEL(reverse_rows_kernel);

template <class Block>
CUTPROOF_DEVICE void set_kernel(Block& block, int* at, int value) {
  if (block.first() == 0) block.store(at, value);
}
CUTPROOF_KERNEL(set_kernel);

template <class Block>
CUTPROOF_DEVICE void add_kernel(Block& block, int* at, int value) {
  if (block.first() == 0) block.store(at, block.load(at) + value);
}
CUTPROOF_KERNEL(add_kernel);

template <class Block>
CUTPROOF_DEVICE void make_keys_kernel(Block& block, unsigned long long* keys, int* count, int wanted, int different) {
  for (std::int64_t i = block.first(); i < wanted; i += block.stride()) {
    keys[i] = static_cast<unsigned long long>(scramble(static_cast<unsigned>(i) % static_cast<unsigned>(different), 7u))
              << 17;
  }
  if (block.first() == 0) *count = wanted;
}
CUTPROOF_KERNEL(make_keys_kernel);

inline const std::vector<int>& hard_counts() {
  static const std::vector<int> counts = {0, 1, 31, 32, 33, 255, 256, 257, 1023, 1024, 1025, 16385, 32769, 70001};
  return counts;
}

template <class Machine>
void check_every_item_is_visited_once(Machine& machine) {
  for (const int count : hard_counts()) {
    auto visits = machine.array(std::vector<int>(static_cast<std::size_t>(count) + 1));
    machine.run([&](auto& launcher) { launcher.items(visit_items_kernel_object{}, count, visits.at(), count); });
    std::vector<int> expected(static_cast<std::size_t>(count) + 1, 1);
    expected.back() = 0;
    EXPECT_EQ(visits.get(), expected) << count << " items";
  }
}

template <class Machine>
void check_every_job_gets_one_block(Machine& machine) {
  for (const int size : machine.block_sizes()) {
    if (size > 256) continue;
    for (const int count : {0, 1, 63, 64, 65, 5000}) {
      auto visits = machine.array(std::vector<int>(static_cast<std::size_t>(count) + 1));
      auto wrong = machine.array(std::vector<int>(1));
      machine.run([&](auto& launcher) {
        launcher.blocks(visit_jobs_kernel_object{}, count, size, 0, visits.at(), wrong.at(), count);
      });
      std::vector<int> expected(static_cast<std::size_t>(count) + 1, 1);
      expected.back() = 0;
      EXPECT_EQ(visits.get(), expected) << count << " jobs";
      EXPECT_EQ(wrong.get()[0], 0);
    }
  }
}

template <class Machine>
void check_collectives(Machine& machine) {
  constexpr int kJobs = 70;
  const std::size_t places = kJobs * 1024;
  for (const int wanted : machine.block_sizes()) {
    auto ints = machine.array(std::vector<int>(8 * places));
    auto wides = machine.array(std::vector<unsigned long long>(places));
    int* const i = ints.at();
    const Collected out{i,
                        i + places,
                        i + 2 * places,
                        wides.at(),
                        i + 3 * places,
                        i + 4 * places,
                        i + 5 * places,
                        i + 6 * places,
                        i + 7 * places};
    const auto work = [&](auto& launcher) { launcher.blocks(collect_kernel_object{}, kJobs, wanted, 0, out, kJobs); };
    machine.run(work);
    const std::vector<int> got = ints.get();
    const std::vector<unsigned long long> got_wides = wides.get();
    const auto entry = [&](int row, int at) { return got[static_cast<std::size_t>(row) * places + at]; };
    for (int job = 0; job < kJobs; ++job) {
      const int size = entry(0, job * 1024);
      int sum = 0, smallest = 1 << 20;
      unsigned long long smallest_wide = ~0ull;
      for (int t = 0; t < size; ++t) {
        sum += small_value(job, t);
        smallest = std::min(smallest, small_value(job, t));
        smallest_wide = std::min(smallest_wide, wide_value(job, t));
      }
      int before = 0;
      for (int t = 0; t < size; ++t) {
        const int at = job * 1024 + t;
        ASSERT_EQ(entry(0, at), size);
        ASSERT_EQ(entry(1, at), sum);
        ASSERT_EQ(entry(2, at), smallest);
        ASSERT_EQ(entry(3, at), 1);
        ASSERT_EQ(entry(4, at), 0);
        ASSERT_EQ(entry(5, at), before) << "scan, thread " << t << " of " << size;
        ASSERT_EQ(entry(6, at), sum);
        ASSERT_EQ(entry(7, at), 5 * sum + 10 * size);
        ASSERT_EQ(got_wides[static_cast<std::size_t>(at)], smallest_wide);
        before += small_value(job, t);
      }
    }
  }
}

template <int kWidth, class Machine>
void check_teams_of(Machine& machine) {
  const std::vector<int> sizes = {0, 1, 2, 7, 8, 9, 31, 32, 33, 63, 64, 65, 150};
  const int jobs = 400;
  std::vector<int> begin = {0};
  for (int job = 0; job < jobs; ++job) {
    begin.push_back(begin.back() + sizes[static_cast<std::size_t>(job) % sizes.size()]);
  }
  const std::size_t items = static_cast<std::size_t>(begin.back());
  auto begins = machine.array(begin);
  auto sums = machine.array(std::vector<float>(static_cast<std::size_t>(jobs) * kTeamSums, -1.0f));
  auto parts = machine.array(std::vector<float>(static_cast<std::size_t>(jobs) * kTeamSums, -1.0f));
  auto counts = machine.array(std::vector<int>(static_cast<std::size_t>(jobs) * Teamed::kCounts));
  auto greatest = machine.array(std::vector<float>(static_cast<std::size_t>(jobs)));
  auto kept = machine.array(std::vector<int>(items, -1));
  auto place = machine.array(std::vector<int>(items, -1));
  auto taken = machine.array(std::vector<int>(items));
  auto classes = machine.array(std::vector<int>(static_cast<std::size_t>(jobs) * kTeamClasses));
  auto half = machine.array(std::vector<float>(static_cast<std::size_t>(jobs) * kTeamSums, -1.0f));
  const Teamed out{begins.at(),   sums.at(), parts.at(), half.at(),  counts.at(),
                   greatest.at(), kept.at(), place.at(), taken.at(), classes.at()};
  machine.run([&](auto& launcher) { launcher.teams(team_kernel_object<kWidth>{}, kWidth, jobs, out, jobs); });

  const auto got_sums = sums.get(), got_parts = parts.get(), got_half = half.get(), got_greatest = greatest.get();
  const auto got_counts = counts.get(), got_kept = kept.get(), got_place = place.get(), got_taken = taken.get(),
             got_classes = classes.get();
  for (int job = 0; job < jobs; ++job) {
    SCOPED_TRACE("teams of " + std::to_string(kWidth) + ", job " + std::to_string(job));
    const int first = begin[static_cast<std::size_t>(job)], size = begin[static_cast<std::size_t>(job) + 1] - first;
    // Sums: one bank for each lane of the device, combined as a butterfly does.
    for (int n = 0; n < kTeamSums; ++n) {
      const auto by_lanes = [&](int lanes) {
        std::vector<float> bank(static_cast<std::size_t>(lanes));
        for (int k = 0; k < size; ++k) bank[static_cast<std::size_t>(k % lanes)] += any_float(job + n, k);
        for (std::size_t distance = bank.size() / 2; distance > 0; distance /= 2) {
          for (std::size_t lane = 0; lane < distance; ++lane) bank[lane] += bank[lane + distance];
        }
        return bank[0];
      };
      const auto at = static_cast<std::size_t>(job * kTeamSums + n);
      ASSERT_EQ(got_sums[at], by_lanes(kWidth)) << "sum " << n;
      ASSERT_EQ(got_parts[at], by_lanes(kWidth)) << "sum " << n << ", parted";
      ASSERT_EQ(got_half[at], by_lanes(2 * kWidth)) << "sum " << n << ", by half of the lanes";
    }
    int odd = 0, total = 0, before = 0;
    float most = -1e9f;
    std::vector<int> of_class(kTeamClasses);
    for (int k = 0; k < size; ++k) {
      const int value = small_value(job, k);
      ASSERT_EQ(got_place[static_cast<std::size_t>(first + k)], before) << "item " << k;
      ASSERT_EQ(got_taken[static_cast<std::size_t>(first + k)], value % 3 == 0 ? 1 : 0) << "item " << k;
      if (value % 2 != 0) {
        ASSERT_EQ(got_kept[static_cast<std::size_t>(first + odd)], k);
        ++odd;
      }
      most = std::max(most, any_float(job, k));
      total += value;
      before += value;
      ++of_class[static_cast<std::size_t>(value & (kTeamClasses - 1))];
    }
    const int* const count = got_counts.data() + static_cast<std::size_t>(job) * Teamed::kCounts;
    EXPECT_EQ(count[Teamed::kOdd], odd);
    EXPECT_EQ(count[Teamed::kTotal], total);
    EXPECT_EQ(count[Teamed::kAny], odd > 0 ? 1 : 0);
    EXPECT_EQ(count[Teamed::kWrong], 0) << "lanes with equal values were numbered wrongly, or from() gave another's";
    EXPECT_EQ(got_greatest[static_cast<std::size_t>(job)], most);
    const int* const found = got_classes.data() + static_cast<std::size_t>(job) * kTeamClasses;
    EXPECT_EQ(std::vector<int>(found, found + kTeamClasses), of_class);
  }
}

template <class Machine>
void check_teams(Machine& machine) {
  check_teams_of<8>(machine);
  check_teams_of<16>(machine);
  check_teams_of<32>(machine);
}

template <class Machine>
void check_warp_operations(Machine& machine) {
  constexpr int kThreads = 256;
  auto unsigneds = machine.array(std::vector<unsigned>(2 * kThreads));
  auto ints = machine.array(std::vector<int>(2 * kThreads));
  auto wides = machine.array(std::vector<unsigned long long>(kThreads));
  auto vectors = machine.array(std::vector<Float3>(kThreads));
  const Warped out{unsigneds.at(), unsigneds.at() + kThreads, ints.at(), ints.at() + kThreads, wides.at(),
                   vectors.at()};
  machine.run([&](auto& launcher) { launcher.items(warp_kernel_object{}, kThreads, out); });
  for (int at = 0; at < kThreads; ++at) {
    const int lane = at % 32, warp = at - lane;
    EXPECT_EQ(unsigneds.get()[at], 0x49249249u);
    EXPECT_EQ(unsigneds.get()[kThreads + at], lane % 2 == 0 ? 0x00005555u : 0xaaaa0000u);
    EXPECT_EQ(ints.get()[at], warp + (lane + 1) % 32);
    EXPECT_EQ(ints.get()[kThreads + at], warp + lane % 2);
    EXPECT_EQ(wides.get()[at], (1ull << 40) + static_cast<unsigned long long>(warp + 31 - lane));
    EXPECT_EQ(vectors.get()[at].x, static_cast<float>(lane ^ 5));
    EXPECT_EQ(vectors.get()[at].y, 2.0f);
    EXPECT_EQ(vectors.get()[at].z, -static_cast<float>(lane ^ 5));
  }
}

template <class Machine>
void check_atomics(Machine& machine) {
  for (const int count : {1, 33, 3000}) {
    auto tallies = machine.array(std::vector<Tallies>{{0, 1 << 20, -(1 << 20), 0, 100, -1, 0}});
    auto ticket = machine.array(std::vector<int>(static_cast<std::size_t>(count), -1));
    auto exchanged = machine.array(std::vector<int>(static_cast<std::size_t>(count), -2));
    machine.run([&](auto& launcher) {
      launcher.items(atomics_kernel_object{}, count, tallies.at(), ticket.at(), exchanged.at(), count);
    });
    const Tallies got = tallies.get()[0];
    int least = 1 << 20, greatest = -(1 << 20), bits = 0;
    std::set<int> numbers, handed_on = {got.last};
    for (int i = 0; i < count; ++i) {
      least = std::min(least, small_value(i, 0));
      greatest = std::max(greatest, small_value(i, 0));
      bits |= 1 << (i % 20);
      numbers.insert(ticket.get()[static_cast<std::size_t>(i)]);
      handed_on.insert(exchanged.get()[static_cast<std::size_t>(i)]);
    }
    EXPECT_EQ(got.add, count);
    EXPECT_EQ(got.least, least);
    EXPECT_EQ(got.greatest, greatest);
    EXPECT_EQ(got.bits, bits);
    EXPECT_EQ(got.cas, 100 + 3 * count);
    EXPECT_EQ(got.wide, ((1ull << 33) + 1) * static_cast<unsigned long long>(count));
    EXPECT_EQ(static_cast<int>(numbers.size()), count) << "two threads got the same ticket";
    EXPECT_EQ(*numbers.begin(), 0);
    EXPECT_EQ(*numbers.rbegin(), count - 1);
    // Everything that was put in came out once, or is still there.
    EXPECT_EQ(static_cast<int>(handed_on.size()), count + 1);
    EXPECT_EQ(*handed_on.begin(), -1);
  }
}

template <class Machine>
void check_shared_memory(Machine& machine) {
  constexpr int kRows = 500;
  std::vector<int> rows(kRows * 64), expected(kRows * 64);
  for (int i = 0; i < kRows * 64; ++i) rows[i] = small_value(i, 3);
  for (int i = 0; i < kRows * 64; ++i) expected[i] = rows[i / 64 * 64 + 63 - i % 64];
  for (const int size : machine.block_sizes()) {
    if (size > 256) continue;
    auto in = machine.array(rows);
    auto out = machine.array(std::vector<int>(kRows * 64));
    auto misplaced = machine.array(std::vector<int>(1));
    machine.run([&](auto& launcher) {
      launcher.blocks(reverse_rows_kernel_object{}, kRows, size, 16 + 64 * sizeof(int) + 2 * sizeof(Float4), in.at(),
                      out.at(), misplaced.at(), kRows);
    });
    EXPECT_EQ(out.get(), expected);
    EXPECT_EQ(misplaced.get()[0], 0);
  }
}

template <class Machine>
void check_conditions(Machine& machine) {
  // flags[0]: outer loop, [1]: inner loop, [2]: never, [3]: set by the work itself; counts[...] what ran how often.
  auto flags = machine.array(std::vector<int>{3, 0, 0, 0});
  auto counts = machine.array(std::vector<int>(6));
  int* const flag = flags.at();
  int* const count = counts.at();
  const add_kernel_object add;
  const set_kernel_object set;
  machine.run([&](auto& launcher) {
    launcher.if_nonzero(flag + 2, [&](auto& inside) { inside.items(add, 1, count, 1); });
    launcher.items(set, 1, flag + 3, 1);
    launcher.if_nonzero(flag + 3, [&](auto& inside) {
      inside.items(add, 1, count + 1, 1);
      inside.items(set, 1, flag + 3, 0);
      inside.items(add, 1, count + 1, 10);  // the condition was decided before
    });
    launcher.if_nonzero(flag + 3, [&](auto& inside) { inside.items(add, 1, count + 2, 1); });
    launcher.while_nonzero(flag + 1, [&](auto& inside) { inside.items(add, 1, count + 3, 1); });
    launcher.while_nonzero(flag, [&](auto& outer) {
      outer.items(set, 1, flag + 1, 5);
      outer.while_nonzero(flag + 1, [&](auto& inner) {
        inner.items(add, 1, count + 4, 1);
        inner.items(add, 1, flag + 1, -1);
      });
      outer.if_nonzero(flag + 1, [&](auto& inner) { inner.items(add, 1, count, 100); });
      outer.if_nonzero(flag, [&](auto& inner) { inner.items(add, 1, count + 5, 1); });
      outer.items(add, 1, flag, -1);
    });
  });
  EXPECT_EQ(counts.get(), (std::vector<int>{0, 11, 0, 0, 15, 3}));
  EXPECT_EQ(flags.get(), (std::vector<int>{0, 0, 0, 0}));
}

template <class Machine>
void check_scan(Machine& machine) {
  for (const int count : hard_counts()) {
    std::vector<int> values(static_cast<std::size_t>(count)), expected(values.size());
    int sum = 0;
    for (int i = 0; i < count; ++i) {
      values[static_cast<std::size_t>(i)] = small_value(i, 1);
      expected[static_cast<std::size_t>(i)] = sum;
      sum += small_value(i, 1);
    }
    auto in = machine.array(values);
    auto out = machine.array(std::vector<int>(values.size() + 1, 77));
    auto totals = machine.array(std::vector<int>(2, 99));
    machine.run([&](auto& launcher) {
      launcher.exclusive_scan(in.at(), out.at(), count, totals.at());
      launcher.exclusive_scan(in.at(), in.at(), count, totals.at() + 1);
    });
    EXPECT_EQ(in.get(), expected) << "in place, " << count;
    expected.push_back(77);  // nothing is written beyond the end
    EXPECT_EQ(out.get(), expected) << count;
    EXPECT_EQ(totals.get(), (std::vector<int>{sum, sum}));
    // Only the first of them, how many only the device knows; and from a place that no four items begin at.
    for (const int used : {0, 1, count / 2, count}) {
      if (used > count) continue;
      auto there = machine.array(std::vector<int>(1, used));
      auto values_again = machine.array(values), some = machine.array(std::vector<int>(values.size(), 77));
      machine.run([&](auto& launcher) {
        launcher.exclusive_scan(values_again.at(), some.at(), count, totals.at(), there.at());
        if (count > 0) {
          launcher.exclusive_scan(values_again.at() + 1, values_again.at() + 1, count - 1, totals.at() + 1);
        }
      });
      std::vector<int> wanted(values.size(), 77);
      std::copy_n(expected.begin(), used, wanted.begin());
      EXPECT_EQ(some.get(), wanted) << used << " of " << count;
      const auto first = static_cast<std::ptrdiff_t>(used);
      EXPECT_EQ(totals.get()[0], std::accumulate(values.begin(), values.begin() + first, 0)) << used << " of " << count;
      if (count > 0) {
        EXPECT_EQ(totals.get()[1], sum - values[0]) << count;
      }
    }
  }
}

template <class Machine>
void check_select(Machine& machine) {
  for (const int count : hard_counts()) {
    for (const unsigned one_in : {1u, 3u, 100000u}) {
      std::vector<unsigned char> values(static_cast<std::size_t>(count));
      std::vector<int> expected;
      for (int i = 0; i < count; ++i) {
        if (scramble(static_cast<unsigned>(i), 5u) % one_in != 0) continue;
        values[static_cast<std::size_t>(i)] = static_cast<unsigned char>(1 + i % 200);
        expected.push_back(i);
      }
      auto flags = machine.array(values);
      auto selected = machine.array(std::vector<int>(static_cast<std::size_t>(count)));
      auto number = machine.array(std::vector<int>(1, -1));
      machine.run([&](auto& launcher) { launcher.select(flags.at(), count, selected.at(), number.at()); });
      ASSERT_EQ(number.get()[0], static_cast<int>(expected.size()));
      std::vector<int> got = selected.get();
      got.resize(expected.size());
      EXPECT_EQ(got, expected);
      for (const int used : {0, 1, count / 2, count}) {
        if (used > count) continue;
        auto there = machine.array(std::vector<int>(1, used));
        machine.run(
            [&](auto& launcher) { launcher.select(flags.at(), count, selected.at(), number.at(), there.at()); });
        const auto below = std::lower_bound(expected.begin(), expected.end(), used);
        ASSERT_EQ(number.get()[0], static_cast<int>(below - expected.begin())) << used << " of " << count;
        got = selected.get();
        got.resize(static_cast<std::size_t>(below - expected.begin()));
        EXPECT_EQ(got, std::vector<int>(expected.begin(), below)) << used << " of " << count;
      }
    }
  }
}

template <class Machine>
void check_sort_unique(Machine& machine) {
  for (const int wanted : hard_counts()) {
    for (const int spare : {0, 1, 5000}) {
      const int different = std::max(1, wanted / 3);
      std::set<unsigned long long> expected;
      for (int i = 0; i < std::min(wanted, different); ++i) {
        expected.insert(static_cast<unsigned long long>(scramble(static_cast<unsigned>(i), 7u)) << 17);
      }
      auto keys = machine.array(std::vector<unsigned long long>(static_cast<std::size_t>(wanted + spare), 42));
      auto number = machine.array(std::vector<int>(1, -1));
      machine.run([&](auto& launcher) {
        launcher.items(make_keys_kernel_object{}, wanted, keys.at(), number.at(), wanted, different);
        launcher.sort_unique(keys.at(), number.at(), wanted + spare);
      });
      ASSERT_EQ(number.get()[0], static_cast<int>(expected.size())) << wanted << " keys of " << wanted + spare;
      std::vector<unsigned long long> got = keys.get();
      got.resize(expected.size());
      EXPECT_EQ(got, std::vector<unsigned long long>(expected.begin(), expected.end()));
    }
  }
}

// Pieces of work that need temporary memory and have conditions: piece k makes keys and sorts them, counts to k + 3,
// and adds 10 and then, because it has counted to something, 100 + k to its number, which was k + 1.
template <class Machine>
class SortingPieces {
 public:
  static constexpr int kMost = 8;

  explicit SortingPieces(Machine& machine)
      : values_(machine.array(std::vector<int>(3 * kMost))),
        keys_(machine.array(std::vector<unsigned long long>(kMost * kRoom, 42))),
        numbers_(machine.array(std::vector<int>(kMost, -1))) {}

  int* value(int which) { return values_.at() + 3 * which; }
  int* counted(int which) { return value(which) + 2; }
  template <class Launcher>
  void begin(Launcher& on, int which) {
    on.items(set_kernel_object{}, 1, value(which), 1 + which);
    on.items(set_kernel_object{}, 1, value(which) + 1, 3 + which);
  }
  template <class Launcher>
  void run(Launcher& on, int which) {
    int* const own = value(which);
    unsigned long long* const own_keys = keys_.at() + which * kRoom;
    const add_kernel_object add;
    on.items(make_keys_kernel_object{}, kKeys, own_keys, numbers_.at() + which, int{kKeys}, different(which));
    on.items(add, 1, own, 10);
    on.sort_unique(own_keys, numbers_.at() + which, kKeys);
    on.while_nonzero(own + 1, [&](auto& inside) {
      inside.items(add, 1, own + 2, 1);
      inside.items(add, 1, own + 1, -1);
    });
    on.if_nonzero(own + 2, [&](auto& inside) { inside.items(add, 1, own, 100 + which); });
  }
  // Of each piece that has run: its number, what is left to count, and what it has counted to.
  static std::vector<int> expected(int which) { return {111 + 2 * which, 0, 3 + which}; }
  std::vector<int> values(int which) const {
    const std::vector<int> all = values_.get();
    return {all.begin() + 3 * which, all.begin() + 3 * which + 3};
  }
  void expect_keys(int which) const {
    std::set<unsigned long long> expected;
    for (int i = 0; i < different(which); ++i) {
      expected.insert(static_cast<unsigned long long>(scramble(static_cast<unsigned>(i), 7u)) << 17);
    }
    ASSERT_EQ(numbers_.get()[static_cast<std::size_t>(which)], static_cast<int>(expected.size())) << which;
    const std::vector<unsigned long long> all = keys_.get();
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), all.begin() + which * kRoom)) << which;
  }

 private:
  static constexpr int kKeys = 70'001, kRoom = 70'016;
  static int different(int which) { return 20'011 + 5'003 * which; }

  decltype(std::declval<Machine&>().array(std::vector<int>())) values_;
  decltype(std::declval<Machine&>().array(std::vector<unsigned long long>())) keys_;
  decltype(std::declval<Machine&>().array(std::vector<int>())) numbers_;
};

template <class Block>
CUTPROOF_DEVICE void add_up_kernel(Block& block, const int* a, const int* b, int* sum) {
  if (block.first() == 0) *sum = *a + *b;
}
CUTPROOF_KERNEL(add_up_kernel);

// Both pieces begin when what is before them is done, what follows them when both are, and neither is in the way of the
// other where both need temporary memory, have conditions, or are side by side themselves.
template <class Machine>
void check_side_by_side(Machine& machine) {
  SortingPieces<Machine> pieces(machine);  // two in the open, two within a condition
  auto sum = machine.array(std::vector<int>(2, -1));
  const add_kernel_object add;
  const add_up_kernel_object add_up;
  const auto piece = [&](int which) { return [&, which](auto& on) { pieces.run(on, which); }; };
  machine.run([&](auto& launcher) {
    for (int which = 0; which < 4; ++which) pieces.begin(launcher, which);
    launcher.side_by_side(piece(0), piece(1));
    launcher.items(add_up, 1, pieces.value(0), pieces.value(1), sum.at());
    // Within a condition, and again.
    launcher.if_nonzero(sum.at(), [&](auto& inside) {
      inside.side_by_side(
          [&](auto& on) {
            on.items(add, 1, pieces.value(0), 1000);
            on.side_by_side([&](auto& one) { one.items(add, 1, pieces.value(0), 1000); },
                            [&](auto& other) { other.items(add, 1, pieces.value(1), 2000); });
            on.items(add_up, 1, pieces.value(0), pieces.value(1), sum.at() + 1);
          },
          [&](auto& on) { on.items(add, 1, pieces.counted(1), 50); });
      inside.items(add_up, 1, sum.at() + 1, pieces.counted(1), sum.at() + 1);
      inside.side_by_side(piece(2), piece(3));
      inside.items(add_up, 1, sum.at() + 1, pieces.value(2), sum.at() + 1);
      inside.items(add_up, 1, sum.at() + 1, pieces.value(3), sum.at() + 1);
    });
  });
  EXPECT_EQ(sum.get(), (std::vector<int>{224, 224 + 4000 + 54 + 115 + 117}));
  EXPECT_EQ(pieces.values(0), (std::vector<int>{2111, 0, 3}));
  EXPECT_EQ(pieces.values(1), (std::vector<int>{2113, 0, 54}));
  for (int which = 2; which < 4; ++which) EXPECT_EQ(pieces.values(which), pieces.expected(which)) << which;
  for (int which = 0; which < 4; ++which) pieces.expect_keys(which);
}

// What comes after the first piece, and what comes after both, begins when that is done, and what follows all of them
// when all are; whichever of them are empty, and where the first piece has two side by side itself, of which each needs
// temporary memory of its own.
template <class Machine>
void check_pieces_behind(Machine& machine) {
  for (int present = 0; present < 16; ++present) {
    SortingPieces<Machine> pieces(machine);
    auto sum = machine.array(std::vector<int>(4, 0));
    const add_up_kernel_object add_up;
    machine.run([&](auto& launcher) {
      for (int which = 0; which < 6; ++which) pieces.begin(launcher, which);
      const auto if_present = [&](int bit, auto run) {
        return [=](auto& on) {
          if (present >> bit & 1) run(on);
        };
      };
      launcher.side_by_side(if_present(0,
                                       [&](auto& on) {
                                         on.side_by_side([&](auto& own) { pieces.run(own, 0); },
                                                         [&](auto& own) { pieces.run(own, 1); }, NoWork{},
                                                         [&](auto& own) { pieces.run(own, 2); });
                                         on.items(add_up, 1, pieces.value(0), pieces.value(1), sum.at());
                                       }),
                            if_present(1, [&](auto& on) { pieces.run(on, 3); }),
                            if_present(2,
                                       [&](auto& on) {
                                         pieces.run(on, 4);
                                         on.items(add_up, 1, sum.at(), pieces.value(4), sum.at() + 1);
                                       }),
                            if_present(3, [&](auto& on) {
                              pieces.run(on, 5);
                              on.items(add_up, 1, sum.at(), pieces.value(3), sum.at() + 2);
                            }));
      launcher.items(add_up, 1, sum.at() + 1, sum.at() + 2, sum.at() + 3);
    });
    const bool is[] = {(present & 1) != 0, (present & 2) != 0, (present & 4) != 0, (present & 8) != 0};
    const int first = is[0] ? 111 + 113 : 0, second = is[1] ? 117 : 4;
    const int after_first = is[2] ? first + 119 : 0, after_both = is[3] ? first + second : 0;
    EXPECT_EQ(sum.get(), (std::vector<int>{first, after_first, after_both, after_first + after_both})) << present;
    for (int which = 0; which < 6; ++which) {
      if (is[which < 3 ? 0 : which - 2]) {
        EXPECT_EQ(pieces.values(which), pieces.expected(which)) << present << ' ' << which;
        pieces.expect_keys(which);
      }
    }
  }
}

template <class Machine>
void check_clear(Machine& machine) {
  auto data = machine.array(std::vector<int>(1001, 5));
  machine.run([&](auto& launcher) {
    launcher.clear(data.at(), 1000 * sizeof(int));
    launcher.clear(nullptr, 0);
  });
  std::vector<int> expected(1001, 0);
  expected.back() = 5;
  EXPECT_EQ(data.get(), expected);
}

}  // namespace cutproof::gpu
