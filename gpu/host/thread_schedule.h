// The next thread when kernels are executed under a simulated schedule (docs/design/kernels.md, Blocks;
// architecture.md, Schedules). Threads of a launch are numbered place · 32 + thread, where place is that of a block
// among the live blocks.
//
// A schedule is a vector of choices, one for each decision between several runnable threads. Choice k is the k-th of
// those threads, in cyclic order from the thread that ran last (itself included if it can continue). So 0 means "no
// preemption", a schedule may be cut off anywhere (zeros follow), and any vector of numbers is a schedule. This makes
// schedules replayable and shrinkable.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace cutproof::gpu {

using ThreadSchedule = std::vector<std::uint16_t>;

// The runnable threads at a decision: bit t of masks[place] is thread place · 32 + t. Never empty.
struct Candidates {
  std::span<const std::uint32_t> masks;
  int current = 0;  // the thread that ran last

  int count() const;
  bool contains(int thread) const { return (masks[thread / 32] >> (thread % 32) & 1u) != 0; }
  int lowest() const;
  int highest() const;
  int nth(int k) const;        // k in [0, count()): in cyclic order from `current`, which comes first
  int rank(int thread) const;  // inverse of nth
};

// Returns one of the candidates. Stateful: one generator drives one run.
using Generator = std::function<int(const Candidates&)>;

Generator forward();      // always the lowest number
Generator reverse();      // always the highest number
Generator round_robin();  // the next number after the current one
Generator random_walk(std::uint64_t seed);
// Probabilistic concurrency testing (Burckhardt et al. 2010): random priorities, and depth - 1 places among the first
// `length` decisions where the running thread falls behind all others. Finds a bug of depth d in a run of k decisions
// with n threads with probability at least 1 / (n k^(d-1)). Requires 1 <= depth <= 4, length >= 1.
Generator pct(std::uint64_t seed, int depth, std::int64_t length);
Generator replay(ThreadSchedule schedule);

// A schedule that still `fails`, with few preemptions, by removing ever smaller pieces. Requires fails(schedule); calls
// it at most `budget` times.
ThreadSchedule shrink(ThreadSchedule schedule, const std::function<bool(const ThreadSchedule&)>& fails,
                      int budget = 2000);
// Choices that are not 0.
int preemptions(const ThreadSchedule& schedule);

}  // namespace cutproof::gpu
