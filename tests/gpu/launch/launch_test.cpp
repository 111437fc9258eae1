// The launch layer on the host: the checks of launch_checks.h with one thread, several threads and simulated
// schedules; what happens when a kernel breaks the rules; and that schedules find what threads do not.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "gpu/host/host_launcher.h"
#include "tests/gpu/launch/launch_checks.h"

namespace cutproof::gpu::launch_test {
namespace {

template <class T>
class HostArray {
 public:
  explicit HostArray(const std::vector<T>& values) : values_(values) {}
  T* at() { return values_.data(); }
  const std::vector<T>& get() const { return values_; }

 private:
  std::vector<T> values_;
};

struct HostMachine {
  HostLauncher launcher;

  template <class T>
  HostArray<T> array(const std::vector<T>& values) {
    return HostArray<T>(values);
  }
  template <class Work>
  void run(Work work) {
    work(launcher);
  }
  std::vector<int> block_sizes() const { return {32}; }
};

struct ModeCase {
  const char* name;
  std::function<HostLauncher()> make;
};

HostLauncher simulated(Generator generator, std::int64_t budget = 50'000'000) {
  return HostLauncher(HostLauncher::Simulated{.schedule = std::move(generator), .step_budget = budget});
}

class LaunchOnHost : public testing::TestWithParam<ModeCase> {
 protected:
  HostMachine machine{GetParam().make()};
};

TEST_P(LaunchOnHost, VisitsEveryItemOnce) { check_every_item_is_visited_once(machine); }
TEST_P(LaunchOnHost, GivesEveryJobOneBlock) { check_every_job_gets_one_block(machine); }
TEST_P(LaunchOnHost, CollectivesAreWhatTheySay) { check_collectives(machine); }
TEST_P(LaunchOnHost, WarpOperationsAreWhatTheySay) { check_warp_operations(machine); }
TEST_P(LaunchOnHost, TeamsAreWhatTheySay) { check_teams(machine); }
TEST_P(LaunchOnHost, AtomicsLoseNothing) { check_atomics(machine); }
TEST_P(LaunchOnHost, SharedMemoryIsAlignedAndDisjoint) { check_shared_memory(machine); }
TEST_P(LaunchOnHost, ConditionsAreReadWhenTheWorkBeforeIsDone) { check_conditions(machine); }
TEST_P(LaunchOnHost, ScansAnyNumberOfItems) { check_scan(machine); }
TEST_P(LaunchOnHost, SelectsFlaggedIndicesInOrder) { check_select(machine); }
TEST_P(LaunchOnHost, SortsAndDropsDuplicates) { check_sort_unique(machine); }
TEST_P(LaunchOnHost, ClearsWhatItIsGiven) { check_clear(machine); }
TEST_P(LaunchOnHost, RunsPiecesSideBySide) { check_side_by_side(machine); }
TEST_P(LaunchOnHost, RunsPiecesBehindOthers) { check_pieces_behind(machine); }

// Kernels that break the rules. `how` chooses what the last thread does.

enum : int { kLeaves, kOtherOperation, kOtherPlace };

template <class Block>
CUTPROOF_DEVICE void diverging_barrier_kernel(Block& block, int how) {
  if (block.thread() == 31) {
    if (how == kLeaves) return;
    if (how == kOtherOperation) {
      block.any(true);
    } else {
      block.sync();
    }
    return;
  }
  block.sync();
}
CUTPROOF_KERNEL(diverging_barrier_kernel);

template <class Block>
CUTPROOF_DEVICE void warp_mask_kernel(Block& block, unsigned mask, unsigned last_mask, bool last_leaves) {
  if (block.thread() == 31 && last_leaves) return;
  block.ballot(block.thread() == 31 ? last_mask : mask, true);
}
CUTPROOF_KERNEL(warp_mask_kernel);

template <class Block>
CUTPROOF_DEVICE void shuffle_from_kernel(Block& block, int lane) {
  if (block.thread() < 16) block.shuffle(0x0000ffffu, 1, lane);
}
CUTPROOF_KERNEL(shuffle_from_kernel);

// The message of the KernelFault that `work` throws.
template <class Work>
std::string fault_of(Work work) {
  try {
    work();
  } catch (const KernelFault& fault) {
    return fault.what();
  }
  return "nothing was thrown";
}

void expect_mentions(const std::string& text, std::initializer_list<const char*> parts) {
  for (const char* part : parts) EXPECT_NE(text.find(part), std::string::npos) << "no \"" << part << "\" in: " << text;
}

TEST_P(LaunchOnHost, ABarrierThatAThreadDoesNotReachIsAFault) {
  HostLauncher& launcher = machine.launcher;
  expect_mentions(
      fault_of([&] { launcher.items(diverging_barrier_kernel_object{}, 1, int{kLeaves}); }),
      {"diverging_barrier_kernel, block 0 of 1", "threads 0-30 at sync (launch_test.cpp:", "thread 31 ended"});
  expect_mentions(fault_of([&] { launcher.items(diverging_barrier_kernel_object{}, 1, int{kOtherOperation}); }),
                  {"threads 0-30 at sync", "thread 31 at any"});
  expect_mentions(fault_of([&] { launcher.items(diverging_barrier_kernel_object{}, 1, int{kOtherPlace}); }),
                  {"threads 0-30 at sync", "thread 31 at sync"});
  // And the launcher still works.
  check_collectives(machine);
}

TEST_P(LaunchOnHost, AWarpOperationWhoseLanesDoNotComeIsAFault) {
  HostLauncher& launcher = machine.launcher;
  const warp_mask_kernel_object kernel;
  expect_mentions(fault_of([&] { launcher.items(kernel, 1, ~0u, ~0u, true); }),
                  {"threads 0-30 at ballot with mask 0xffffffff", "thread 31 ended"});
  expect_mentions(fault_of([&] { launcher.items(kernel, 1, ~0u, 0xfffffffeu, false); }),
                  {"threads 0-30 at ballot with mask 0xffffffff", "thread 31 at ballot with mask 0xfffffffe"});
  expect_mentions(fault_of([&] { launcher.items(kernel, 1, 0x7fffffffu, 0x7fffffffu, false); }),
                  {"thread 31 calls ballot with mask 0x7fffffff", "leaves it out"});
  EXPECT_NO_THROW(launcher.items(kernel, 1, 0x7fffffffu, 0x80000000u, false));
  EXPECT_NO_THROW(launcher.items(kernel, 1, 0x7fffffffu, 0u, true));
}

TEST_P(LaunchOnHost, AShuffleFromALaneOutsideItsMaskIsAFault) {
  HostLauncher& launcher = machine.launcher;
  EXPECT_NO_THROW(launcher.items(shuffle_from_kernel_object{}, 1, 15));
  for (const int lane : {16, 31, 32, -1}) {
    expect_mentions(fault_of([&] { launcher.items(shuffle_from_kernel_object{}, 1, lane); }),
                    {"shuffles from lane", "not in its mask"});
  }
}

template <class Block>
CUTPROOF_DEVICE void read_unwritten_kernel(Block& block, int* ints, float* floats, bool dirty) {
  int* a = block.template shared<int>(4);
  float* b = block.template shared<float>(4);
  if (block.thread() == 0) {
    ints[block.index()] = a[3];
    floats[block.index()] = b[3];
  }
  if (dirty && block.thread() == 0) a[3] = 7, b[3] = 7;
}
CUTPROOF_KERNEL(read_unwritten_kernel);

TEST_P(LaunchOnHost, SharedMemoryIsPoisonedInEveryBlock) {
  // Precondition: the blocks of one launch use the same memory again, so a value left over would be seen.
  std::vector<int> ints(100, 1);
  std::vector<float> floats(100, 1);
  for (const bool dirty : {true, false}) {
    machine.launcher.blocks(read_unwritten_kernel_object{}, 100, 32, 32, ints.data(), floats.data(), dirty);
    EXPECT_EQ(ints[0], -1);
    EXPECT_TRUE(std::isnan(floats[0]));
    for (std::size_t i = 0; i < 100; ++i) {
      EXPECT_TRUE(ints[i] == -1 || ints[i] == 1) << ints[i];  // 1: fewer than 100 blocks ran
      EXPECT_FALSE(floats[i] == 7.0f);
    }
  }
}

template <class Block>
CUTPROOF_DEVICE void take_shared_kernel(Block& block, int count, bool differently) {
  block.template shared<int>(differently && block.thread() == 20 ? count + 1 : count);
}
CUTPROOF_KERNEL(take_shared_kernel);

TEST_P(LaunchOnHost, SharedMemoryBeyondTheGrantOrTakenDifferentlyIsAFault) {
  HostLauncher& launcher = machine.launcher;
  const take_shared_kernel_object take;
  EXPECT_NO_THROW(launcher.blocks(take, 1, 32, 400, 100, false));
  expect_mentions(fault_of([&] { launcher.blocks(take, 1, 32, 399, 100, false); }),
                  {"take_shared_kernel, block 0", "byte 400 of the 399"});
  expect_mentions(fault_of([&] { launcher.items(take, 1, 1, false); }), {"byte 4 of the 0"});
  expect_mentions(fault_of([&] { launcher.blocks(take, 1, 32, 500, 100, true); }),
                  {"404 bytes", "another thread took 400"});
}

TEST_P(LaunchOnHost, BlockSizesThatTheDeviceWouldRefuseAreRefused) {
  EXPECT_THROW(machine.launcher.blocks(take_shared_kernel_object{}, 1, 48, 0, 0, false), std::logic_error);
  EXPECT_THROW(machine.launcher.blocks(take_shared_kernel_object{}, 1, 200, 0, 0, false), std::logic_error);
  EXPECT_THROW(machine.launcher.blocks(take_shared_kernel_object{}, 1, 512, 0, 0, false), std::logic_error);
  EXPECT_NO_THROW(machine.launcher.blocks(take_shared_kernel_object{}, 1, 256, 0, 0, false));
}

// Counts how many are alive, to see that stacks are unwound.
struct Counted {
  explicit Counted(std::atomic<int>* count) : alive(count) { ++*alive; }
  ~Counted() { --*alive; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;
  std::atomic<int>* alive;
};

template <class Block>
CUTPROOF_DEVICE void throwing_kernel(Block& block, std::atomic<int>* alive, int from_block) {
  const Counted counted(alive);
  block.sync();
  if (block.thread() == 5 && block.index() >= from_block) throw std::runtime_error(std::to_string(block.index()));
  block.sync();
}
CUTPROOF_KERNEL(throwing_kernel);

TEST_P(LaunchOnHost, AnExceptionReachesTheCallerAndUnwindsEveryThread) {
  std::atomic<int> alive{0};
  for (int round = 0; round < 20; ++round) {
    const int from = round % 3;
    try {
      machine.launcher.blocks(throwing_kernel_object{}, 64, 32, 0, &alive, from);
      FAIL() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_GE(std::stoi(error.what()), from);
    }
    EXPECT_EQ(alive, 0);
  }
  check_shared_memory(machine);
}

INSTANTIATE_TEST_SUITE_P(Modes, LaunchOnHost,
                         testing::Values(ModeCase{"OneThread", [] { return HostLauncher(HostLauncher::Threads{1}); }},
                                         ModeCase{"ThreeThreads",
                                                  [] { return HostLauncher(HostLauncher::Threads{3}); }},
                                         ModeCase{"Forward", [] { return simulated(forward()); }},
                                         ModeCase{"Reverse", [] { return simulated(reverse()); }},
                                         ModeCase{"RoundRobin", [] { return simulated(round_robin()); }},
                                         ModeCase{"RandomWalk", [] { return simulated(random_walk(1)); }},
                                         ModeCase{"Pct", [] { return simulated(pct(1, 3, 1000)); }}),
                         [](const auto& mode) { return mode.param.name; });

// Blocks of one thread.

class LoneThreads : public testing::TestWithParam<int> {
 protected:
  HostMachine machine{HostLauncher(HostLauncher::Threads{.count = GetParam(), .of_block = 1})};
};

TEST_P(LoneThreads, DoWhatBlocksDo) {
  check_every_item_is_visited_once(machine);
  check_every_job_gets_one_block(machine);
  check_collectives(machine);
  check_teams(machine);
  check_atomics(machine);
  check_shared_memory(machine);
  check_conditions(machine);
}

TEST_P(LoneThreads, KeepTheRulesOfSharedMemory) {
  HostLauncher& launcher = machine.launcher;
  const take_shared_kernel_object take;
  EXPECT_NO_THROW(launcher.blocks(take, 1, 32, 400, 100, false));
  expect_mentions(fault_of([&] { launcher.blocks(take, 1, 32, 399, 100, false); }),
                  {"take_shared_kernel, block 0", "byte 400 of the 399"});
  std::vector<int> ints(100, 1);
  std::vector<float> floats(100, 1);
  for (const bool dirty : {true, false}) {
    launcher.blocks(read_unwritten_kernel_object{}, 100, 32, 32, ints.data(), floats.data(), dirty);
    EXPECT_EQ(ints[0], -1);
    EXPECT_TRUE(std::isnan(floats[0]));
  }
}

template <class Block>
CUTPROOF_DEVICE void ask_a_warp_kernel(Block& block, int which) {
  if (which == 0) block.ballot(1u, true);
  if (which == 1) block.shuffle(1u, 1, 0);
  if (which == 2) block.sync_warp(1u);
  if (block.index() == 3) throw std::runtime_error("block 3");
}
CUTPROOF_KERNEL(ask_a_warp_kernel);

TEST_P(LoneThreads, AreNoWarps) {
  HostLauncher& launcher = machine.launcher;
  for (int which = 0; which < 3; ++which) {
    expect_mentions(fault_of([&] { launcher.blocks(ask_a_warp_kernel_object{}, 1, 32, 0, which); }),
                    {"ask_a_warp_kernel, block 0", "runs alone", "32 threads"});
  }
}

TEST_P(LoneThreads, AnExceptionReachesTheCaller) {
  if (GetParam() == 1) {
    EXPECT_NO_THROW(machine.launcher.blocks(ask_a_warp_kernel_object{}, 64, 32, 0, 3)) << "one block does all";
  } else {
    EXPECT_THROW(machine.launcher.blocks(ask_a_warp_kernel_object{}, 64, 32, 0, 3), std::runtime_error);
  }
  check_collectives(machine);
}

INSTANTIATE_TEST_SUITE_P(Of, LoneThreads, testing::Values(1, 3), testing::PrintToStringParamName());

TEST(LoneThreads, AreOneOrAsManyAsAWarpHas) {
  EXPECT_THROW(HostLauncher(HostLauncher::Threads{.of_block = 0}), std::invalid_argument);
  EXPECT_THROW(HostLauncher(HostLauncher::Threads{.of_block = 16}), std::invalid_argument);
}

// Schedules.

TEST(Schedules, RankAndNthAreInverse) {
  const std::vector<std::uint32_t> masks = {0x80000001u, 0, 0xffffffffu, 0x00100400u};
  for (int current = 0; current < 128; ++current) {
    const Candidates candidates{masks, current};
    ASSERT_EQ(candidates.count(), 36);
    for (int k = 0; k < 36; ++k) {
      ASSERT_TRUE(candidates.contains(candidates.nth(k)));
      ASSERT_EQ(candidates.rank(candidates.nth(k)), k) << "from " << current;
    }
    if (candidates.contains(current)) {
      ASSERT_EQ(candidates.nth(0), current);
    }
  }
  EXPECT_EQ((Candidates{masks, 0}.lowest()), 0);
  EXPECT_EQ((Candidates{masks, 0}.highest()), 116);
}

// Writes down who took which ticket: the interleaving of the launch.
template <class Block>
CUTPROOF_DEVICE void ticket_kernel(Block& block, int* next, int* order, int rounds) {
  for (int i = 0; i < rounds; ++i) {
    const int mine = block.atomic_add(next, 1);
    order[mine] = static_cast<int>(block.first());
    if (i == rounds / 2) block.sync();
  }
}
CUTPROOF_KERNEL(ticket_kernel);

std::vector<int> interleaving(HostLauncher& launcher) {
  constexpr int kBlocks = 20, kRounds = 3;
  int next = 0;
  std::vector<int> order(kBlocks * 32 * kRounds, -1);
  launcher.blocks(ticket_kernel_object{}, kBlocks, 32, 0, &next, order.data(), kRounds);
  return order;
}

HostLauncher recording(Generator generator) {
  return HostLauncher(HostLauncher::Simulated{.schedule = std::move(generator), .live_blocks = 5, .record = true});
}

TEST(Schedules, ARecordedScheduleReplaysTheSameInterleaving) {
  const std::map<std::string, std::function<Generator()>> generators = {
      {"forward", forward},
      {"reverse", reverse},
      {"round_robin", round_robin},
      {"random 1", [] { return random_walk(1); }},
      {"random 2", [] { return random_walk(2); }},
      {"pct 1", [] { return pct(1, 4, 500); }},
      {"pct 2", [] { return pct(2, 4, 500); }},
  };
  std::set<std::vector<int>> seen;
  for (const auto& [name, make] : generators) {
    HostLauncher first = recording(make());
    const std::vector<int> order = interleaving(first);
    HostLauncher again = recording(make());
    EXPECT_EQ(interleaving(again), order) << name << " twice";
    HostLauncher replayed = recording(replay(first.recorded()));
    EXPECT_EQ(interleaving(replayed), order) << name << " replayed";
    EXPECT_EQ(replayed.recorded(), first.recorded()) << name;
    seen.insert(order);
  }
  EXPECT_EQ(seen.size(), generators.size()) << "two schedules were the same";
}

TEST(Schedules, ForwardAndReverseAreWhatTheySay) {
  HostLauncher launcher = recording(forward());
  std::vector<int> order = interleaving(launcher);
  for (int i = 0; i < 64; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], i / 2);  // two tickets before the barrier
  HostLauncher backward = recording(reverse());
  order = interleaving(backward);
  for (int i = 0; i < 64; ++i) EXPECT_EQ(order[static_cast<std::size_t>(i)], 5 * 32 - 1 - i / 2);
}

TEST(Schedules, AnEmptyScheduleNeverPreempts) {
  HostLauncher launcher = recording(replay({}));
  const std::vector<int> order = interleaving(launcher);
  EXPECT_EQ(preemptions(launcher.recorded()), 0);
  for (std::size_t i = 0; i + 1 < 64; i += 2) EXPECT_EQ(order[i], order[i + 1]);
}

template <class Block>
CUTPROOF_DEVICE void wait_for_ever_kernel(Block& block, int* flag) {
  while (block.load(flag) == 0) {
  }
}
CUTPROOF_KERNEL(wait_for_ever_kernel);

TEST(Schedules, AStepBudgetEndsALivelock) {
  int never = 0;
  HostLauncher launcher = simulated(random_walk(3), 10'000);
  expect_mentions(fault_of([&] { launcher.items(wait_for_ever_kernel_object{}, 64, &never); }),
                  {"wait_for_ever_kernel", "livelock", "10000 steps"});
  EXPECT_NO_THROW(interleaving(launcher));
}

TEST(Schedules, ALoopThatNeverEndsIsALivelock) {
  int always = 1;
  HostLauncher launcher;
  expect_mentions(fault_of([&] { launcher.while_nonzero(&always, [](HostLauncher&) {}); }), {"livelock"});
}

HostLauncher exploring(Generator generator) {
  return HostLauncher(HostLauncher::Simulated{
      .schedule = std::move(generator), .live_blocks = 2, .step_budget = 20'000, .record = true});
}

// What two pieces that each multiply and add leave of a number, launch by launch: different for every order.
template <class Block>
CUTPROOF_DEVICE void append_digit_kernel(Block& block, int* number, int digit) {
  if (block.first() == 0) *number = 10 * *number + digit;
}
CUTPROOF_KERNEL(append_digit_kernel);

int digits_of_two_pieces(HostLauncher& launcher) {
  int number = 0;
  const append_digit_kernel_object append;
  launcher.side_by_side(
      [&](HostLauncher& on) {
        on.items(append, 1, &number, 1);
        on.items(append, 1, &number, 2);
      },
      [&](HostLauncher& on) {
        on.items(append, 1, &number, 3);
        on.items(append, 1, &number, 4);
      });
  return number;
}

// What run(launcher) gives under schedules, each of which gives it again; and 1234 without one.
template <class Run>
void expect_orders(Run run, const std::set<int>& expected) {
  std::set<int> seen;
  HostLauncher launcher = exploring(forward());
  for (int seed = 0; seed < 400; ++seed) {
    launcher.reschedule(random_walk(static_cast<std::uint64_t>(seed)));
    const int number = run(launcher);
    seen.insert(number);
    const ThreadSchedule schedule = launcher.recorded();
    launcher.reschedule(replay(schedule));
    EXPECT_EQ(run(launcher), number) << testing::PrintToString(schedule);
  }
  EXPECT_EQ(seen, expected);
  HostLauncher in_order;
  EXPECT_EQ(run(in_order), 1234);
}

TEST(Schedules, PiecesSideBySideTakeTurnsInEveryOrder) {
  expect_orders(digits_of_two_pieces, {1234, 1324, 1342, 3124, 3142, 3412});
}

// What comes after the first piece may be before any of the second; what comes after both is behind both.
TEST(Schedules, WhatComesAfterPiecesTakesTurnsInEveryOrder) {
  expect_orders(
      [](HostLauncher& launcher) {
        int number = 0;
        const auto digit = [&](int d) {
          return [&number, d](HostLauncher& on) { on.items(append_digit_kernel_object{}, 1, &number, d); };
        };
        launcher.side_by_side(digit(1), digit(2), digit(3), digit(4));
        return number;
      },
      {1234, 1243, 1324, 2134, 2143});
}

TEST(Schedules, APieceThatFailsEndsTheOtherOne) {
  for (int seed = 0; seed < 40; ++seed) {
    HostLauncher launcher = exploring(random_walk(static_cast<std::uint64_t>(seed)));
    const bool first_fails = seed % 2 == 0;
    int launches = 0, number = 0;
    const auto fails = [](HostLauncher& on) { on.items(diverging_barrier_kernel_object{}, 1, int{kLeaves}); };
    const auto goes_on = [&](HostLauncher& on) {
      for (; launches < 1000; ++launches) on.items(append_digit_kernel_object{}, 1, &number, 0);
    };
    expect_mentions(
        fault_of([&] { first_fails ? launcher.side_by_side(fails, goes_on) : launcher.side_by_side(goes_on, fails); }),
        {"diverging_barrier_kernel"});
    EXPECT_NO_THROW(digits_of_two_pieces(launcher));
    // And one that waits for it, or goes on behind it.
    expect_mentions(fault_of([&] { launcher.side_by_side(fails, NoWork{}, goes_on, goes_on); }),
                    {"diverging_barrier_kernel"});
    expect_mentions(fault_of([&] { launcher.side_by_side(NoWork{}, fails, goes_on, goes_on); }),
                    {"diverging_barrier_kernel"});
    EXPECT_NO_THROW(digits_of_two_pieces(launcher));
  }
}

// Union-find as GPUs do it (ECL-CC, Jaiganesh and Burtscher 2018): roots are hooked under smaller ones by
// compare-and-swap, paths are halved by plain stores of ancestors. And with faults planted.

enum : int { kCorrect, kCheckThenStore, kHookNotRetried, kHookWithoutOrder, kHalvingOverwritesHook };

template <class Block>
CUTPROOF_DEVICE int find_root(Block& block, int* parent, int v, int fault) {
  for (;;) {
    const int up = block.load(&parent[v]);
    if (up == v) return v;
    const int upper = block.load(&parent[up]);
    // Halving: v's parent may only be replaced by an ancestor, and only if v is not a root. Correct because v has
    // stopped being a root for ever. The fault writes to `up`, which another thread may just have hooked elsewhere.
    if (fault == kHalvingOverwritesHook) {
      block.store(&parent[up], upper);
    } else if (upper != up) {
      block.atomic_cas(&parent[v], up, upper);
    }
    v = upper;
  }
}

template <class Block>
CUTPROOF_DEVICE void join_kernel(Block& block, int* parent, const int* edges, int count, int fault) {
  for (std::int64_t e = block.first(); e < count; e += block.stride()) {
    int a = find_root(block, parent, edges[2 * e], fault), b = find_root(block, parent, edges[2 * e + 1], fault);
    while (a != b) {
      if (a < b && fault != kHookWithoutOrder) {
        const int c = a;
        a = b;
        b = c;
      }
      // a is hooked under b.
      if (fault == kCheckThenStore) {
        if (block.load(&parent[a]) == a) {
          block.store(&parent[a], b);
          break;
        }
      } else if (block.atomic_cas(&parent[a], a, b) == a || fault == kHookNotRetried) {
        break;
      }
      a = find_root(block, parent, a, fault);
      b = find_root(block, parent, b, fault);
    }
  }
}
CUTPROOF_KERNEL(join_kernel);

// Whether the kernel finds the components of a small random graph under this schedule. Cycles, which only hooks without
// order make, end as livelocks.
bool joins_rightly(int fault, int graph, HostLauncher& launcher) {
  constexpr int kVertices = 24, kEdges = 40;
  std::vector<int> parent(kVertices), edges(2 * kEdges), label(kVertices);
  for (int v = 0; v < kVertices; ++v) parent[static_cast<std::size_t>(v)] = label[static_cast<std::size_t>(v)] = v;
  for (unsigned i = 0; i < 2 * kEdges; ++i) {
    // Around the first, so that hooks of one root collide; in two halves, so that there is more than one component.
    const unsigned half = i / 2 % 2 * (kVertices / 2);
    edges[i] = static_cast<int>(half + scramble(static_cast<unsigned>(graph), i) % (kVertices / 2));
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t e = 0; e < kEdges; ++e) {
      int &a = label[static_cast<std::size_t>(edges[2 * e])], &b = label[static_cast<std::size_t>(edges[2 * e + 1])];
      if (a != b) a = b = std::min(a, b), changed = true;
    }
  }
  try {
    launcher.items(join_kernel_object{}, kEdges, parent.data(), edges.data(), int{kEdges}, fault);
  } catch (const KernelFault&) {
    return false;
  }
  for (int v = 0; v < kVertices; ++v) {
    int root = v;
    for (int steps = 0; parent[static_cast<std::size_t>(root)] != root; ++steps) {
      if (steps > kVertices) return false;
      root = parent[static_cast<std::size_t>(root)];
    }
    if (root != label[static_cast<std::size_t>(v)]) return false;
  }
  return true;
}

Generator exploration(int seed) {
  const auto number = static_cast<std::uint64_t>(seed);
  return seed % 2 == 0 ? random_walk(number) : pct(number, 4, 600);
}

// The number of the schedule that shows the fault; -1: none of `most` does.
int first_found(int fault, int most) {
  HostLauncher launcher = exploring(forward());
  for (int seed = 0; seed < most; ++seed) {
    launcher.reschedule(exploration(seed));
    if (!joins_rightly(fault, seed, launcher)) return seed;
  }
  return -1;
}

TEST(PlantedUnionFindFaults, TheCorrectKernelPassesEverySchedule) {
  EXPECT_EQ(first_found(kCorrect, 200), -1);
  HostLauncher launcher = exploring(forward());
  for (int graph = 0; graph < 20; ++graph) {
    for (const auto& make : {forward, reverse, round_robin}) {
      launcher.reschedule(make());
      EXPECT_TRUE(joins_rightly(kCorrect, graph, launcher)) << graph;
    }
  }
}

// What schedules are for: an execution without preemption, one thread after the other, hides the race.
TEST(PlantedUnionFindFaults, CheckThenStoreIsNotFoundWithoutASchedule) {
  HostLauncher launcher;
  for (int graph = 0; graph < 1000; ++graph) ASSERT_TRUE(joins_rightly(kCheckThenStore, graph, launcher));
}

TEST(PlantedUnionFindFaults, CheckThenStoreIsFound) { EXPECT_GE(first_found(kCheckThenStore, 1000), 0); }
TEST(PlantedUnionFindFaults, AHookThatIsNotRetriedIsFound) { EXPECT_GE(first_found(kHookNotRetried, 1000), 0); }
TEST(PlantedUnionFindFaults, HooksWithoutOrderAreFound) { EXPECT_GE(first_found(kHookWithoutOrder, 1000), 0); }
TEST(PlantedUnionFindFaults, HalvingThatOverwritesAHookIsFound) {
  EXPECT_GE(first_found(kHalvingOverwritesHook, 1000), 0);
}

TEST(PlantedUnionFindFaults, AScheduleThatShowsOneShrinksToFewPreemptions) {
  const int seed = first_found(kCheckThenStore, 1000);
  ASSERT_GE(seed, 0);
  HostLauncher launcher = exploring(exploration(seed));
  joins_rightly(kCheckThenStore, seed, launcher);
  const ThreadSchedule found = launcher.recorded();
  const auto fails = [&](const ThreadSchedule& schedule) {
    launcher.reschedule(replay(schedule));
    return !joins_rightly(kCheckThenStore, seed, launcher);
  };
  ASSERT_TRUE(fails(found));
  const ThreadSchedule small = shrink(found, fails);
  EXPECT_TRUE(fails(small));
  // One thread must be stopped between its check and its store, and another let through in between.
  EXPECT_LE(preemptions(small), 4) << "of " << preemptions(found) << ": " << testing::PrintToString(small);
}

}  // namespace
}  // namespace cutproof::gpu::launch_test
