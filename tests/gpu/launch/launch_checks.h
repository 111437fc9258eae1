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
#include <set>
#include <vector>

#include "gpu/kernels/float3.h"
#include "gpu/launch/launcher.h"

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
                     block.lane() == block.thread() % 32 && block.size() % 32 == 0 &&
                     block.first() == static_cast<std::int64_t>(block.index()) * block.size() + block.thread() &&
                     block.stride() == static_cast<std::int64_t>(block.count()) * block.size();
  if (!right) block.atomic_add(wrong, 1);
}
CUTPROOF_KERNEL(visit_jobs_kernel);

// What every thread of a job got. [job · 1024 + thread]
struct Collected {
  int* size;
  int* sum;
  float* float_sum;
  Float3* vector_sum;
  int* smallest;
  float* smallest_float;
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
    out.float_sum[at] = block.sum(any_float(job, t));
    out.vector_sum[at] = block.sum(Float3{any_float(job, t), 1.0f, static_cast<float>(t)});
    out.smallest[at] = block.smallest(value);
    out.smallest_float[at] = block.smallest(any_float(job, t));
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
  Float3* vector_sum;
  float* sums;      // sixteen at once
  float* own_sums;  // each by itself
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
  out.vector_sum[at] = block.warp_sum(Float3{static_cast<float>(at), 1.0f, -static_cast<float>(lane)});
  float values[16];
  for (int k = 0; k < 16; ++k) values[k] = any_float(k, static_cast<int>(at));
  out.sums[at] = block.warp_sums(values);
  for (int k = 0; k < 16; ++k) {
    const float sum = block.warp_sum(values[k]);
    if (k == lane / 2) out.own_sums[at] = sum;
  }
  if (lane % 2 == 0) {
    out.half[at] = block.ballot(0x55555555u, lane < 16);
    out.from_leader[at] = block.shuffle(0x55555555u, static_cast<int>(at), 0);
  } else {
    out.half[at] = block.ballot(0xaaaaaaaau, lane >= 16);
    out.from_leader[at] = block.shuffle(0xaaaaaaaau, static_cast<int>(at), 1);
  }
}
CUTPROOF_KERNEL(warp_kernel);

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
  static const std::vector<int> counts = {0, 1, 31, 32, 33, 255, 256, 257, 1023, 1024, 1025, 70001};
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
    auto floats = machine.array(std::vector<float>(2 * places));
    auto vectors = machine.array(std::vector<Float3>(places));
    int* const i = ints.at();
    float* const f = floats.at();
    const Collected out{i,
                        i + places,
                        f,
                        vectors.at(),
                        i + 2 * places,
                        f + places,
                        i + 3 * places,
                        i + 4 * places,
                        i + 5 * places,
                        i + 6 * places,
                        i + 7 * places};
    const auto work = [&](auto& launcher) { launcher.blocks(collect_kernel_object{}, kJobs, wanted, 0, out, kJobs); };
    machine.run(work);
    const std::vector<int> got = ints.get();
    const std::vector<float> got_floats = floats.get();
    const std::vector<Float3> got_vectors = vectors.get();
    const auto entry = [&](int row, int at) { return got[static_cast<std::size_t>(row) * places + at]; };
    for (int job = 0; job < kJobs; ++job) {
      const int size = entry(0, job * 1024);
      int sum = 0, smallest = 1 << 20;
      double float_sum = 0, magnitude = 0;
      float smallest_float = 1e9f;
      for (int t = 0; t < size; ++t) {
        sum += small_value(job, t);
        smallest = std::min(smallest, small_value(job, t));
        float_sum += any_float(job, t);
        magnitude += std::abs(any_float(job, t));
        smallest_float = std::min(smallest_float, any_float(job, t));
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
        // A tree of additions: at most ten roundings on the way of any term.
        ASSERT_NEAR(got_floats[at], float_sum, 10 * std::ldexp(1.0, -24) * magnitude);
        ASSERT_EQ(got_floats[at], got_floats[job * 1024]) << "threads got different sums";
        ASSERT_EQ(got_floats[places + at], smallest_float);
        ASSERT_EQ(got_vectors[at].x, got_floats[at]);
        ASSERT_EQ(got_vectors[at].y, static_cast<float>(size));
        ASSERT_EQ(got_vectors[at].z, static_cast<float>(size * (size - 1) / 2));
        before += small_value(job, t);
      }
    }
    machine.run(work);
    EXPECT_EQ(floats.get(), got_floats) << "sums of two runs differ";
  }
}

template <class Machine>
void check_warp_operations(Machine& machine) {
  constexpr int kThreads = 256;
  auto unsigneds = machine.array(std::vector<unsigned>(2 * kThreads));
  auto ints = machine.array(std::vector<int>(2 * kThreads));
  auto wides = machine.array(std::vector<unsigned long long>(kThreads));
  auto vectors = machine.array(std::vector<Float3>(2 * kThreads));
  auto floats = machine.array(std::vector<float>(2 * kThreads));
  const Warped out{unsigneds.at(), unsigneds.at() + kThreads, ints.at(),   ints.at() + kThreads,  wides.at(),
                   vectors.at(),   vectors.at() + kThreads,   floats.at(), floats.at() + kThreads};
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
    EXPECT_EQ(vectors.get()[kThreads + at].x, static_cast<float>(32 * warp + 496));
    EXPECT_EQ(vectors.get()[kThreads + at].y, 32.0f);
    EXPECT_EQ(vectors.get()[kThreads + at].z, -496.0f);
    EXPECT_EQ(floats.get()[at], floats.get()[kThreads + at]);  // bit by bit: terms cancel, so any other order shows
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
