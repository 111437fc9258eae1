// Split on the kernels (gpu/kernels/split.cuh) against the reference: the same clusters, numbers and flags, by either
// way of labelling, under any schedule.
#include <gtest/gtest.h>

#include <cstring>
#include <numeric>
#include <random>

#include "gpu/host/host_launcher.h"
#include "gpu/kernels/detect.cuh"
#include "gpu/kernels/split.cuh"
#include "gpu/state/staging.h"
#include "model/at.h"
#include "property_tests/cases.h"
#include "reference_cpu/reference.h"
#include "tests/reference_cpu/random_covers.h"

namespace cutproof::gpu::split_kernel_test {
namespace {

using namespace cutproof::tests;
using Random = std::mt19937;

// One DeviceView of bodies in the middle of a frame, after their detection.
struct Scene {
  std::vector<Setup> setups;
  std::vector<State> states;

  void add(Setup setup, State state) {
    setups.push_back(std::move(setup));
    states.push_back(std::move(state));
  }
  StagingBuffers staging() const { return make_staging_buffers(setups, states, Capacity{}); }
  Plan plan(SplitMethod method) const { return make_plan(setups, states, method); }
  std::vector<State> expected() const {
    std::vector<State> result = states;
    for (std::size_t b = 0; b < result.size(); ++b) {
      const bool cut = result[b].frame < setups[b].frame_count() && !result[b].removed.empty();
      if (cut) reference::split(setups[b], result[b]);
    }
    return result;
  }
};

constexpr SplitMethod kMethods[] = {SplitMethod::blocks, SplitMethod::global_labels};

// Numbers with gaps, and rotations that single precision holds, so that what is inherited can be recognised.
void mark_clusters(Random& random, Clusters& clusters) {
  int32_t number = draw(random, 0, 3);
  for (std::size_t c = 0; c < clusters.number.size(); ++c) {
    clusters.number[c] = number;
    number += draw(random, 1, 3);
    for (double& entry : clusters.rotation[c].m) entry = draw(random, -64, 64) / 64.0;
    clusters.degenerate[c] = random() % 2 == 0;
  }
}

State marked_state(Random& random, const Body& body, const Lists& lists) {
  State state = state_of(body, lists);
  mark_clusters(random, state.clusters);
  state.frame = draw(random, 0, 2);
  return state;
}

void remove_at_random(Random& random, State& state, double chance) {
  std::vector<int32_t> removed;
  for (int32_t p = 0; p < static_cast<int32_t>(state.alive.size()); ++p) {
    if (static_cast<double>(random()) < chance * 4294967296.0) removed.push_back(p);
  }
  remove_particles(state, removed);
}

// A body of exactly n particles in a random order of a box's nodes, so with holes.
Body body_with(Random& random, int32_t n) {
  const int32_t side = 1 + static_cast<int32_t>(std::cbrt(1.5 * n));
  std::vector<Node> nodes;
  for (int32_t k = 0; k <= side; ++k) {
    for (int32_t j = 0; j < side; ++j) {
      for (int32_t i = 0; i < side; ++i) nodes.push_back({i, j, k});
    }
  }
  std::shuffle(nodes.begin(), nodes.end(), random);
  nodes.resize(at(n));
  return body_of(nodes, 0.01);
}

void add_random_body(Random& random, Scene& scene, int32_t n, int32_t most, double chance, int32_t debris) {
  const Body body = body_with(random, n);
  cutproof::Setup setup = setup_of(body, 3);
  setup.split.debris = debris;
  State state = marked_state(random, body, n == 0 ? Lists{} : random_cover(random, body, most));
  remove_at_random(random, state, chance);
  scene.add(std::move(setup), std::move(state));
}

// What every stage relies on: memberships and their counts say what the clusters say, and no rest frame is left dirty.
void expect_consistent(const StagingBuffers& staging) {
  const Counters& counters = staging.counters.front();
  std::vector<std::multiset<int>> held(staging.node.size()), listed(staging.node.size());
  for (int s = 0; s < counters.slots_used; ++s) {
    EXPECT_EQ(staging.rest_dirty[at(s)], 0) << "slot " << s;
    for (int k = 0; k < staging.slot_size[at(s)]; ++k)
      held[at(staging.members[at(staging.slot_begin[at(s)] + k)])].insert(s);
  }
  for (std::size_t p = 0; p < held.size(); ++p) {
    for (int k = staging.membership_begin[p]; k < staging.membership_begin[p + 1]; ++k) {
      if (staging.memberships[at(k)] >= 0) listed[p].insert(staging.memberships[at(k)]);
    }
    EXPECT_EQ(held[p], listed[p]) << "particle " << p;
    EXPECT_EQ(staging.membership_count[p], static_cast<int>(held[p].size())) << "particle " << p;
  }
}

void expect_equal(const Scene& scene, const std::vector<State>& actual) {
  const std::vector<State> expected = scene.expected();
  for (std::size_t b = 0; b < expected.size(); ++b) {
    SCOPED_TRACE("body " + std::to_string(b));
    EXPECT_EQ(actual[b].alive, expected[b].alive);
    EXPECT_EQ(actual[b].removed, expected[b].removed);
    EXPECT_EQ(actual[b].debris, expected[b].debris);
    const Clusters &mine = actual[b].clusters, &theirs = expected[b].clusters;
    ASSERT_EQ(lists_of(mine), lists_of(theirs));
    EXPECT_EQ(mine.number, theirs.number);
    std::vector<Mat3> rotation = theirs.rotation;
    for (Mat3& r : rotation) {
      for (double& entry : r.m) entry = static_cast<float>(entry);
    }
    EXPECT_EQ(mine.rotation, rotation);
    EXPECT_EQ(mine.degenerate, theirs.degenerate);
    const double h = scene.setups[b].body.grid.spacing;
    for (std::size_t c = 0; c < mine.number.size(); ++c) {
      // One rounding of T_c - base, which is at most the cluster's extent.
      const double size = std::cbrt(static_cast<double>(mine.size(static_cast<int32_t>(c)))) + 40;
      ASSERT_LT(norm(mine.rest_center[c] - theirs.rest_center[c]), 0x1p-23 * size * h) << "cluster " << c;
      ASSERT_NEAR(mine.mass[c], theirs.mass[c], 1e-5 * theirs.mass[c]) << "cluster " << c;
    }
  }
}

StagingBuffers run(const Scene& scene, HostLauncher& launcher, const Plan& plan) {
  StagingBuffers staging = scene.staging();
  enqueue_split(launcher, staging.view(), plan);
  return staging;
}

void expect_split(const Scene& scene, HostLauncher& launcher, const Plan& plan) {
  const StagingBuffers staging = run(scene, launcher, plan);
  EXPECT_EQ(staging.counters.front().fault, 0);
  expect_consistent(staging);
  expect_equal(scene, extract_states(staging, scene.setups));
}

void expect_split(const Scene& scene) {
  for (const SplitMethod method : kMethods) {
    SCOPED_TRACE(method == SplitMethod::blocks ? "blocks" : "global labels");
    HostLauncher launcher;
    expect_split(scene, launcher, scene.plan(method));
  }
}

// All that a later stage can see of what split has written.
std::string bits(const StagingBuffers& staging) {
  std::string all;
  const auto add = [&](const auto& vector) {
    all.append(reinterpret_cast<const char*>(vector.data()), vector.size() * sizeof(vector[0]));
  };
  add(staging.death), add(staging.membership_count), add(staging.memberships), add(staging.slot_begin),
      add(staging.slot_size);
  add(staging.slot_number), add(staging.slot_body), add(staging.rotation), add(staging.degenerate), add(staging.mass);
  add(staging.rest_base), add(staging.rest_offset), add(staging.members), add(staging.affected),
      add(staging.rest_dirty);
  const Counters& c = staging.counters.front();
  for (const int value : {c.fault, c.slots_used, c.members_used, c.debris, c.affected})
    all += std::to_string(value) + ' ';
  return all;
}

TEST(GpuSplit, EqualsTheReferenceOnRandomBodiesCoversAndRemovals) {
  constexpr uint32_t kSeed = 71;
  Random random(kSeed);
  int64_t pieces = 0, vanished = 0;
  for (int round = 0; round < 120; ++round) {
    Scene scene;
    add_random_body(random, scene, draw(random, 1, 250), draw(random, 1, 60), 0.05 * draw(random, 1, 12), 0);
    SCOPED_TRACE("seed " + std::to_string(kSeed) + ", round " + std::to_string(round));
    expect_split(scene);
    if (HasFailure()) return;
    const Clusters &before = scene.states[0].clusters, after = scene.expected()[0].clusters;
    pieces += after.count() > before.count();
    vanished += !std::includes(after.number.begin(), after.number.end(), before.number.begin(), before.number.end());
  }
  EXPECT_GT(pieces, 20);
  EXPECT_GT(vanished, 20);
}

TEST(GpuSplit, EqualsTheReferenceForManyBodiesWithDifferentRulesInOneLoad) {
  constexpr uint32_t kSeed = 72;
  Random random(kSeed);
  int64_t debris = 0;
  for (int round = 0; round < 12; ++round) {
    Scene scene;
    const int bodies = draw(random, 2, 9);
    for (int b = 0; b < bodies; ++b) {
      add_random_body(random, scene, draw(random, 0, 3) == 0 ? draw(random, 0, 2) : draw(random, 3, 120),
                      draw(random, 1, 40), draw(random, 0, 3) == 0 ? 0.0 : 0.25,
                      draw(random, 0, 1) * draw(random, 1, 9));
      if (random() % 5 == 0) scene.states.back().frame = 3;  // its schedule is over
    }
    SCOPED_TRACE("seed " + std::to_string(kSeed) + ", round " + std::to_string(round));
    expect_split(scene);
    if (HasFailure()) return;
    for (const State& state : scene.expected()) debris += static_cast<int64_t>(state.debris.size());
  }
  EXPECT_GT(debris, 100);
}

TEST(GpuSplit, EqualsTheReferenceAroundTheSizesOfWarpsAndBlocks) {
  Random random(73);
  for (const int32_t n : {1, 2, 31, 32, 33, 255, 256, 257, 1023, 1024, 1025}) {
    // One cluster of everything (connected: a snake through a box), and random ones.
    SCOPED_TRACE(std::to_string(n) + " particles");
    std::vector<Node> snake;
    for (int32_t i = 0; i < n; ++i) snake.push_back({i % 32, i / 32, 0});
    const Body body = body_of(snake);
    Scene scene;
    State state = marked_state(random, body, {range(0, n)});
    remove_at_random(random, state, n < 31 ? 0.5 : 0.3);
    scene.add(setup_of(body, 3), state);
    add_random_body(random, scene, n, 50, 0.2, 3);
    expect_split(scene);
  }
}

TEST(GpuSplit, KeepsOneParticleClustersApartAndDropsThoseThatLoseTheirOne) {
  Random random(74);
  Lists lists;
  for (int32_t p = 0; p < 60; ++p) lists.push_back({p});
  const Body body = block_body(5, 4, 3);
  Scene scene;
  State state = marked_state(random, body, lists);
  remove_at_random(random, state, 0.4);
  scene.add(setup_of(body, 3), state);
  expect_split(scene);
}

TEST(GpuSplit, LeavesNothingOfABodyThatIsRemovedEntirely) {
  Random random(75);
  const Body body = block_body(6, 5, 4);
  Scene scene;
  for (const int32_t debris : {0, 4}) {
    cutproof::Setup setup = setup_of(body, 3);
    setup.split.debris = debris;
    State state = marked_state(random, body, box_clusters(6, 5, 4, 2));
    remove_particles(state, range(0, body.particle_count()));
    scene.add(setup, state);
    state = marked_state(random, body, box_clusters(6, 5, 4, 2));
    remove_at_random(random, state, 0.3);
    scene.add(setup, state);
  }
  expect_split(scene);
}

TEST(GpuSplit, TakesClustersTooLargeForABlockByGlobalLabelsInTheSameFrame) {
  Random random(76);
  const Body body = block_body(17, 17, 17);
  ASSERT_GT(body.particle_count(), kMostInBlock);
  Lists lists = box_clusters(17, 17, 17, 6);
  lists.insert(lists.begin() + 3, range(0, body.particle_count()));
  Scene scene;
  State state = marked_state(random, body, lists);
  // Two planes that do not meet, one with a hole, and holes everywhere.
  std::vector<int32_t> removed;
  for (int32_t p = 0; p < body.particle_count(); ++p) {
    const int32_t i = p % 17, j = p / 17 % 17;
    if (i == 5 || (j == 11 && i != 2) || random() % 7 == 0) removed.push_back(p);
  }
  remove_particles(state, removed);
  scene.add(setup_of(body, 3), state);
  expect_split(scene);
}

TEST(GpuSplit, MixesBothMethodsWhereExpansionHasPassedTheLargestClusterOfTheLoad) {
  Random random(77);
  for (int round = 0; round < 10; ++round) {
    Scene scene;
    add_random_body(random, scene, 200, 90, 0.2, 0);
    Plan plan = scene.plan(SplitMethod::blocks);
    plan.largest_cluster = 20;  // so blocks take up to 32 members
    plan.expand = true;
    HostLauncher launcher;
    SCOPED_TRACE("round " + std::to_string(round));
    expect_split(scene, launcher, plan);
  }
}

TEST(GpuSplit, DoesNothingToBodiesWithoutRemovalsAndClustersWithoutLosses) {
  Random random(78);
  const Body body = block_body(8, 3, 3);
  Scene scene;
  State state = marked_state(random, body, box_clusters(8, 3, 3, 3));
  scene.add(setup_of(body, 3), state);
  remove_particles(state, {0});
  scene.add(setup_of(body, 3), state);
  const StagingBuffers before = scene.staging();
  HostLauncher launcher;
  const StagingBuffers after = run(scene, launcher, scene.plan(SplitMethod::blocks));
  ASSERT_EQ(after.counters[0].affected, 1);
  const int affected = after.affected[0];
  EXPECT_EQ(affected, scene.states[0].clusters.count());
  for (int s = 0; s < before.counters[0].slots_used; ++s) {
    if (s == affected) continue;
    EXPECT_EQ(after.slot_begin[at(s)], before.slot_begin[at(s)]);
    EXPECT_EQ(after.slot_size[at(s)], before.slot_size[at(s)]);
    EXPECT_EQ(std::memcmp(&after.rest_offset[at(s)], &before.rest_offset[at(s)], sizeof(Float3)), 0);
    EXPECT_EQ(std::memcmp(&after.mass[at(s)], &before.mass[at(s)], sizeof(float)), 0);
  }
}

TEST(GpuSplit, ReplacesTheListOfDebrisWhenItRunsTwiceInAFrame) {
  Random random(79);
  Scene scene;
  add_random_body(random, scene, 120, 20, 0.4, 5);
  add_random_body(random, scene, 120, 20, 0.4, 0);
  ASSERT_FALSE(scene.expected()[0].debris.empty());
  HostLauncher launcher;
  StagingBuffers staging = run(scene, launcher, scene.plan(SplitMethod::blocks));
  EXPECT_EQ(staging.counters[0].debris, static_cast<int>(scene.expected()[0].debris.size()));
  enqueue_split(launcher, staging.view(), scene.plan(SplitMethod::blocks));
  EXPECT_EQ(staging.counters[0].debris, 0);
  EXPECT_EQ(staging.counters[0].affected, 0);
  scene.states = scene.expected();
  expect_equal(scene, extract_states(staging, scene.setups));
}

TEST(GpuSplit, GoesOnWhereAnEarlierSplitHasLeftTheSlotsOfSeveralBodiesInterleaved) {
  Random random(85);
  for (const SplitMethod method : kMethods) {
    Scene scene;
    for (int b = 0; b < 4; ++b) add_random_body(random, scene, 90, 30, 0.15, 0);
    HostLauncher launcher;
    const Plan plan = scene.plan(method);
    StagingBuffers staging = run(scene, launcher, plan);
    for (int again = 0; again < 3; ++again) {
      scene.states = scene.expected();
      for (std::size_t b = 0; b < scene.states.size(); ++b) {
        for (int32_t i = 0; i < 90; ++i) {
          if (!scene.states[b].alive[at(i)] || random() % 8 != 0) continue;
          scene.states[b].alive[at(i)] = 0;
          scene.states[b].removed.push_back(i);
          staging.death[at(staging.body[b].particle_begin + i)] = staging.cut[b];
        }
        std::sort(scene.states[b].removed.begin(), scene.states[b].removed.end());
      }
      enqueue_split(launcher, staging.view(), plan);
      expect_consistent(staging);
      expect_equal(scene, extract_states(staging, scene.setups));
    }
  }
}

TEST(GpuSplit, WritesNothingAndSaysSoWhenSlotsRunOut) {
  Random random(80);
  for (const int bodies : {1, 3}) {
    Scene scene;
    for (int b = 0; b < bodies; ++b) add_random_body(random, scene, 200, 60, 0.3, b == 1 ? 0 : 2);
    const StagingBuffers before = scene.staging();
    int64_t added = 0;
    for (std::size_t b = 0; b < scene.states.size(); ++b) {
      const Clusters &old = scene.states[b].clusters, now = scene.expected()[b].clusters;
      added += std::count_if(now.number.begin(), now.number.end(), [&](int32_t n) { return n > old.number.back(); });
    }
    ASSERT_GT(added, 0);
    for (const bool enough : {false, true}) {
      StagingBuffers staging = scene.staging();
      DeviceView view = staging.view();
      view.slot_capacity = static_cast<int>(staging.counters[0].slots_used + added - (enough ? 0 : 1));
      HostLauncher launcher;
      enqueue_split(launcher, view, scene.plan(SplitMethod::blocks));
      if (enough) {
        EXPECT_EQ(staging.counters[0].fault, 0);
        expect_equal(scene, extract_states(staging, scene.setups));
        continue;
      }
      EXPECT_EQ(staging.counters[0].fault, kSlotsFull);
      EXPECT_EQ(staging.counters[0].slots_used, before.counters[0].slots_used);
      EXPECT_EQ(staging.counters[0].debris, 0);
      EXPECT_EQ(staging.death, before.death);
      EXPECT_EQ(staging.members, before.members);
      EXPECT_EQ(staging.memberships, before.memberships);
      EXPECT_EQ(staging.membership_count, before.membership_count);
      EXPECT_EQ(staging.slot_size, before.slot_size);
      EXPECT_EQ(staging.slot_number, before.slot_number);
    }
  }
}

TEST(GpuSplit, GivesTheSameBitsWhateverTheThreadsAndTheSchedule) {
  Random random(81);
  for (int round = 0; round < 3; ++round) {
    Scene scene;
    add_random_body(random, scene, 150, 40, 0.25, 3);
    add_random_body(random, scene, 60, 20, 0.25, 0);
    for (const SplitMethod method : kMethods) {
      const Plan plan = scene.plan(method);
      HostLauncher alone;
      const std::string expected = bits(run(scene, alone, plan));
      for (const int threads : {2, 5}) {
        HostLauncher launcher(HostLauncher::Threads{threads});
        EXPECT_EQ(bits(run(scene, launcher, plan)) == expected, true) << threads << " threads";
      }
      for (int seed = 0; seed < 4; ++seed) {
        HostLauncher walk(HostLauncher::Simulated{.schedule = random_walk(100 + seed)});
        EXPECT_EQ(bits(run(scene, walk, plan)) == expected, true) << "random walk " << 100 + seed;
        HostLauncher depth(HostLauncher::Simulated{.schedule = pct(seed, 1 + seed % 4, 20000)});
        EXPECT_EQ(bits(run(scene, depth, plan)) == expected, true) << "pct " << seed;
      }
    }
  }
}

TEST(GpuSplit, HoldsUnderHundredsOfSchedules) {
  Random random(82);
  for (const SplitMethod method : kMethods) {
    for (int k = 0; k < 160; ++k) {
      Scene scene;
      add_random_body(random, scene, 24, 24, 0.2, k % 4 == 0 ? 2 : 0);
      const bool walk = k % 2 == 0;
      HostLauncher launcher(HostLauncher::Simulated{
          .schedule = walk ? random_walk(static_cast<uint64_t>(k)) : pct(static_cast<uint64_t>(k), 1 + k / 2 % 4, 2000),
          .live_blocks = 3});
      SCOPED_TRACE((method == SplitMethod::blocks ? "blocks, " : "global labels, ") +
                   std::string(walk ? "random walk " : "pct ") + std::to_string(k));
      expect_split(scene, launcher, scene.plan(method));
      if (HasFailure()) return;
    }
  }
}

// Lattice cuts meet every tie there is: through nodes, along edges, halfway between layers.
TEST(GpuDetectAndSplit, EqualTheReferenceInEveryFrameOfRandomDissections) {
  HostLauncher launcher;
  int64_t cuts = 0, frames = 0;
  for (int seed = 0; seed < 800; ++seed) {
    const property_tests::Case drawn = property_tests::draw_case(at(seed), seed % 60);
    // What a turning sweep takes may differ by a tenth of a spacing (tolerances.md, Detection and rest frames).
    if (std::any_of(drawn.strokes.begin(), drawn.strokes.end(),
                    [](const auto& stroke) { return stroke.turn != property_tests::Quarters{}; })) {
      continue;
    }
    const property_tests::Instance loaded = property_tests::instance_of(drawn);
    const auto backend = reference::make_backend();
    backend->load({loaded.setup}, {loaded.state});
    for (int64_t f = 0; f < loaded.setup.frame_count(); ++f) {
      SCOPED_TRACE("case " + std::to_string(seed) + ", frame " + std::to_string(f));
      backend->run({Stage::step, Stage::step});
      Scene scene;
      scene.add(loaded.setup, backend->snapshot().front());
      StagingBuffers staging = scene.staging();
      const Plan plan = scene.plan(kMethods[at(seed % 2)]);
      if (plan.detection) enqueue_detect(launcher, staging.view(), plan);
      backend->run({Stage::detect, Stage::detect});
      scene.states = backend->snapshot();
      ASSERT_EQ(extract_states(staging, scene.setups)[0].removed, scene.states[0].removed);
      if (staging.cut[0] >= 0) enqueue_split(launcher, staging.view(), plan);
      expect_consistent(staging);
      expect_equal(scene, extract_states(staging, scene.setups));
      if (HasFailure()) return;
      ++frames;
      cuts += staging.cut[0] >= 0;
      backend->run({Stage::split, Stage::skin});
    }
  }
  EXPECT_GT(frames, 500);
  EXPECT_GT(cuts, 200);
}

// A split that has looked for debris everywhere leaves the next ones to search from what has been removed since. What
// an earlier detection of the frame has taken is no longer listed when the split runs, and may have left debris too.
// (Where clusters hold it, it is found by them; here they do not.)
TEST(GpuDetectAndSplit, DropDebrisBesideWhatAnEarlierDetectionOfTheFrameHasRemoved) {
  for (const int32_t earlier : {1, 9}) {
    Scene scene;
    const Body body = block_body(12, 1, 1);
    cutproof::Setup setup = setup_of(body, 3);
    setup.detect.without_blade = true;
    setup.split.debris = 3;
    scene.add(setup, state_of(body, {{0}, {3, 4, 5, 6, 7, 8}, {11}}));
    StagingBuffers staging = scene.staging();
    const Plan plan = scene.plan(SplitMethod::blocks);
    HostLauncher launcher;
    staging.cut[0] = 2 * staging.frame[0];
    enqueue_split(launcher, staging.view(), plan);
    staging.cut[0] = -1;
    State& state = scene.states[0];
    ASSERT_EQ(extract_states(staging, scene.setups)[0].alive, state.alive);

    for (const int32_t torn : {earlier, 10 - earlier}) {  // the edge of `torn` and the particle after it
      for (int32_t p = torn + 1; p < 12; ++p) {
        state.x[at(p)].x += body.grid.spacing;
        staging.displacement[at(p)].x += static_cast<float>(body.grid.spacing);
      }
      enqueue_detect(launcher, staging.view(), plan);
      reference::detect(setup, state);
      ASSERT_EQ(state.removed, (std::vector<int32_t>{torn, torn + 1}));
      ASSERT_EQ(extract_states(staging, scene.setups)[0].removed, state.removed);
    }
    enqueue_split(launcher, staging.view(), plan);
    expect_equal(scene, extract_states(staging, scene.setups));
    EXPECT_EQ(scene.expected()[0].debris, (std::vector<int32_t>{0, 11}));
  }
}

// ---- Disjoint sets alone

template <Memory memory>
struct unite_pairs_kernel_object {
  static constexpr const char* kName = "unite_pairs_kernel";
  static constexpr int kMaxThreads = 256;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, int* parent, const int* pairs, int count) const {
    for (int64_t k = block.first(); k < count; k += block.stride()) {
      unite<memory>(block, parent, pairs[2 * k], pairs[2 * k + 1]);
    }
  }
};

// A fault that schedules must find: a root is looked at, then overwritten.
template <class Block>
CUTPROOF_DEVICE void unite_carelessly_kernel(Block& block, int* parent, const int* pairs, int count) {
  for (int64_t k = block.first(); k < count; k += block.stride()) {
    const int a = find_root(block, parent, pairs[2 * k]), b = find_root(block, parent, pairs[2 * k + 1]);
    if (a != b) block.store(&parent[a < b ? b : a], a < b ? a : b);
  }
}
CUTPROOF_KERNEL(unite_carelessly_kernel);

template <class Block>
CUTPROOF_DEVICE void flatten_kernel(Block& block, int* parent, int count) {
  for (int64_t i = block.first(); i < count; i += block.stride()) {
    const int root = final_root(block, parent, static_cast<int>(i));
    block.store(&parent[i], root);
  }
}
CUTPROOF_KERNEL(flatten_kernel);

// Which of `schedules` runs is the first to give wrong roots, or not to end, which is what cycles of parents do;
// counted from 1. 0: none.
template <class Kernel>
int first_wrong_run(Kernel kernel, int schedules) {
  Random random(83);
  HostLauncher launcher(HostLauncher::Simulated{.schedule = random_walk(0), .live_blocks = 2, .step_budget = 100'000});
  for (int k = 0; k < schedules; ++k) {
    const int nodes = draw(random, 2, 24), count = draw(random, 1, 64);
    std::vector<int> pairs;
    for (int i = 0; i < 2 * count; ++i) pairs.push_back(draw(random, 0, nodes - 1));
    Classes expected(nodes);
    for (int i = 0; i < count; ++i) expected.join(pairs[at(2 * i)], pairs[at(2 * i + 1)]);
    std::vector<int> parent(at(nodes));
    std::iota(parent.begin(), parent.end(), 0);
    const auto seed = static_cast<uint64_t>(k);
    launcher.reschedule(k % 2 == 0 ? random_walk(seed) : pct(seed, 1 + k / 2 % 4, 500));
    try {
      launcher.items(kernel, count, parent.data(), static_cast<const int*>(pairs.data()), count);
      launcher.items(flatten_kernel_object{}, nodes, parent.data(), nodes);
    } catch (const KernelFault&) {
      return k + 1;
    }
    if (std::vector<int32_t>(parent.begin(), parent.end()) != expected.labels()) return k + 1;
  }
  return 0;
}

TEST(UnionFind, GivesTheSmallestMemberAsRootUnderEverySchedule) {
  const int global = first_wrong_run(unite_pairs_kernel_object<Memory::global>{}, 1000);
  EXPECT_EQ(global, 0) << "wrong after " << global << " schedules";
  const int shared = first_wrong_run(unite_pairs_kernel_object<Memory::shared>{}, 1000);
  EXPECT_EQ(shared, 0) << "wrong after " << shared << " schedules, with atomics alone";
}

TEST(UnionFind, SchedulesFindAStoreInThePlaceOfACompareAndSwap) {
  EXPECT_GT(first_wrong_run(unite_carelessly_kernel_object{}, 300), 0);
}

// ---- Rest frames alone

TEST(GpuRestFrames, RecomputesThoseThatAreMarkedToSinglePrecisionAndNoOthers) {
  Random random(84);
  Scene scene;
  add_random_body(random, scene, 300, 80, 0.0, 0);
  for (double& mass : scene.setups[0].body.mass) mass = std::ldexp(1.0, draw(random, -6, 6));
  Clusters exact = scene.states[0].clusters;
  set_rest_frames(scene.setups[0].body, exact);
  StagingBuffers staging = scene.staging();
  for (std::size_t s = 0; s < exact.mass.size(); ++s) {
    staging.mass[s] = -1;
    staging.rest_dirty[s] = s % 3 != 0;
  }
  HostLauncher launcher;
  enqueue_rest_frames(launcher, staging.view());
  const Clusters actual = extract_states(staging, scene.setups)[0].clusters;
  for (std::size_t s = 0; s < exact.mass.size(); ++s) {
    EXPECT_EQ(staging.rest_dirty[s], 0);
    if (s % 3 == 0) {
      EXPECT_EQ(actual.mass[s], -1);
      continue;
    }
    EXPECT_NEAR(actual.mass[s], exact.mass[s], 1e-6 * exact.mass[s]);
    // Offsets from the first member are below 8 spacings here: one rounding is 2^-22 h at most, and the base is exact.
    EXPECT_LT(norm(actual.rest_center[s] - exact.rest_center[s]), 1.01 * 0x1p-22 * 0.01);
  }
}

}  // namespace
}  // namespace cutproof::gpu::split_kernel_test
