// What gpu/state/arrays.inc says of each array holds: constant ones are not written, a snapshot needs no others than
// those of the state, and no stage relies on what it finds in scratch memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gpu/frame.h"
#include "gpu/host/host_launcher.h"
#include "gpu/load.h"
#include "gpu/state/staging.h"
#include "model/stage.h"
#include "property_tests/cases.h"
#include "property_tests/random.h"

namespace cutproof::gpu::arrays_test {
namespace {

struct Bodies {
  std::vector<Setup> setups;
  std::vector<State> states;
};

Bodies some_bodies(std::uint64_t seed, int count) {
  property_tests::Random random(seed);
  Bodies bodies;
  for (int k = 0; k < count; ++k) {
    auto [setup, state] = property_tests::instance_of(property_tests::draw_case(random.seed(), 40));
    bodies.setups.push_back(std::move(setup));
    bodies.states.push_back(std::move(state));
  }
  return bodies;
}

template <class Which>
void spoil(StagingBuffers& staging, Which which) {
  DeviceView unused;
  staging.each(unused, [&](const auto& array, auto& vector, auto&) {
    if (!which(array.lifetime) || vector.empty()) return;
    std::memset(static_cast<void*>(vector.data()), 0x5a, vector.size() * sizeof vector.front());
  });
}

std::map<std::string, std::string> bytes_of(StagingBuffers& staging, Lifetime lifetime) {
  std::map<std::string, std::string> bytes;
  DeviceView unused;
  staging.each(unused, [&](const auto& array, const auto& vector, auto&) {
    if (array.lifetime != lifetime) return;
    bytes[array.name].assign(reinterpret_cast<const char*>(vector.data()), vector.size() * sizeof(*vector.data()));
  });
  return bytes;
}

struct Trace {
  std::vector<std::vector<State>> states;  // after each stage of each frame
  std::array<int, 6> ran{};                // how many times, by stage
};

// Runs all frames of these arrays, stage by stage; calls before(staging) before each of them.
template <class Before>
Trace run_all(const Bodies& bodies, StagingBuffers staging, Before before) {
  const Plan plan = make_plan(bodies.setups, bodies.states);
  const DeviceView view = staging.view();
  HostLauncher launcher;
  std::int64_t frames = 0;
  for (const Setup& setup : bodies.setups) frames = std::max(frames, setup.frame_count());
  Trace run;
  for (std::int64_t frame = 0; frame < frames; ++frame) {
    for (const Stage stage : kStages) {
      before(staging);
      enqueue_span(launcher, view, plan, Span{stage, stage}, [](Stage) {});
      require_no_fault(staging.counters.front());
      run.states.push_back(extract_states(staging, bodies.setups));
      const auto s = static_cast<std::size_t>(stage);
      run.ran[s] += staging.counters.front().stage_ran[s];
    }
  }
  return run;
}

template <class Before>
Trace run_all(const Bodies& bodies, Before before) {
  return run_all(bodies, make_staging_buffers(bodies.setups, bodies.states, Capacity{}), before);
}

TEST(Arrays, AreAsLongAsTheirExtentsSay) {
  const Bodies bodies = some_bodies(1, 5);
  StagingBuffers staging = make_staging_buffers(bodies.setups, bodies.states, Capacity{});
  DeviceView view = staging.view();
  int arrays = 0;
  staging.each(view, [&](const auto& array, const auto& vector, auto& pointer) {
    EXPECT_EQ(static_cast<std::int64_t>(vector.size()), array.extent) << array.name;
    EXPECT_EQ(pointer, vector.data()) << array.name;
    ++arrays;
  });
  EXPECT_GT(arrays, 50);
  EXPECT_EQ(view.bodies, 5);
  EXPECT_EQ(view.slot_capacity, staging.slot_capacity);
}

// Room for six vertices for each particle, and 64, of 16 bytes. A load makes none.
TEST(Arrays, TellHowMuchOfThemALoadLeavesEmpty) {
  const Bodies bodies = some_bodies(1, 5);
  StagingBuffers contents = make_contents(bodies.setups, bodies.states, Capacity{});
  std::size_t particles = 0;
  for (const cutproof::Setup& setup : bodies.setups) particles += static_cast<std::size_t>(setup.body.particle_count());
  const std::size_t vertices = 16 * (6 * particles + 64);
  EXPECT_EQ(empty_bytes(contents, vertices) - empty_bytes(contents, vertices + 1), vertices);
  EXPECT_GT(empty_bytes(contents, 0), empty_bytes(contents, vertices));
  contents.allocate();
  EXPECT_EQ(empty_bytes(contents, 0), 0U);
}

// A backend that enlarges its arrays between two stages changes nothing: not even the last bit of an impulse, of which
// a state has the sum alone.
TEST(Arrays, ThatAreEnlargedHoldWhatTheyHeld) {
  property_tests::Random random(3);
  int pushed = 0;
  for (int k = 0; k < 40; ++k) {
    auto [setup, state] = property_tests::instance_of(property_tests::draw_moving_case(random.seed(), 40));
    Load load({setup}, {state}, KernelOptions{}, Capacity{});
    load.staging.allocate();
    HostLauncher launcher;
    for (int64_t frame = 0; frame < std::min<int64_t>(setup.frame_count(), 6); ++frame) {
      enqueue_span(launcher, load.staging.view(), load.plan, Span{Stage::step, Stage::split}, [](Stage) {});
      const std::vector<State> before = load.states_of({true});
      Load larger = load.enlarged(before, KernelOptions{});
      const std::vector<State> after = larger.states_of({true});
      ASSERT_EQ(after.front().impulse, before.front().impulse);
      ASSERT_TRUE(after == before);
      pushed += !(before.front().impulse == Vec3{});
      load = std::move(larger);
      load.staging.allocate();
      enqueue_span(launcher, load.staging.view(), load.plan, Span{Stage::merge, Stage::skin}, [](Stage) {});
    }
  }
  EXPECT_GT(pushed, 20);
}

TEST(Arrays, OfScratchMemoryAreNothingThatAStageReliesOn) {
  std::array<int, 6> ran{};
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Bodies bodies = some_bodies(seed, 8);
    const Trace expected = run_all(bodies, [](StagingBuffers&) {});
    const Trace found = run_all(bodies, [](StagingBuffers& staging) {
      spoil(staging, [](Lifetime lifetime) { return lifetime == Lifetime::scratch; });
    });
    ASSERT_EQ(found.states.size(), expected.states.size());
    for (std::size_t k = 0; k < found.states.size(); ++k) {
      ASSERT_TRUE(found.states[k] == expected.states[k])
          << "after stage " << name_of(kStages[k % 6]) << " of frame " << k / 6;
    }
    for (std::size_t s = 0; s < 6; ++s) ran[s] += found.ran[s];
  }
  for (const Stage stage : kStages) EXPECT_GT(ran[static_cast<std::size_t>(stage)], 10) << name_of(stage);
}

// What a load puts nothing into is left as memory comes, but where arrays.inc gives it a value.
TEST(Arrays, HoldNothingToRelyOnBeyondWhatHasBeenPutIntoThem) {
  int64_t spoiled = 0;
  for (std::uint64_t seed = 1; seed <= 21; ++seed) {
    const int byte = std::array{0x5a, 0x00, 0xff}[seed % 3];
    SCOPED_TRACE(seed);
    const Bodies bodies = some_bodies(seed, 8);
    const Trace expected = run_all(bodies, [](StagingBuffers&) {});
    StagingBuffers staging = make_contents(bodies.setups, bodies.states, Capacity{});
    DeviceView unused;
    std::map<std::string, std::size_t> loaded;
    staging.each(unused, [&](const auto& array, const auto& vector, auto&) { loaded[array.name] = vector.size(); });
    staging.allocate(true);
    staging.each(unused, [&](const auto& array, auto& vector, auto&) {
      const std::size_t begin = loaded[array.name];
      if (array.unset || begin >= vector.size()) return;
      std::memset(static_cast<void*>(vector.data() + begin), byte, (vector.size() - begin) * sizeof vector.front());
      ++spoiled;
    });
    const Trace found = run_all(bodies, std::move(staging), [](StagingBuffers&) {});
    ASSERT_EQ(found.states.size(), expected.states.size());
    for (std::size_t k = 0; k < found.states.size(); ++k) {
      ASSERT_TRUE(found.states[k] == expected.states[k])
          << "after stage " << name_of(kStages[k % 6]) << " of frame " << k / 6;
    }
  }
  EXPECT_GT(spoiled, 20 * 40);
}

TEST(Arrays, OfTheStateAreAllThatASnapshotNeedsBesideTheConstantOnes) {
  int skins = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    const Bodies bodies = some_bodies(seed, 8);
    run_all(bodies, [&](StagingBuffers& staging) {
      const std::vector<State> expected = extract_states(staging, bodies.setups);
      for (const State& state : expected) skins += !state.skin.triangles.empty();
      StagingBuffers spoiled = staging;
      spoil(spoiled, [](Lifetime lifetime) { return lifetime == Lifetime::scratch || lifetime == Lifetime::derived; });
      ASSERT_TRUE(extract_states(spoiled, bodies.setups) == expected);
      // And of these no more than what has been given out.
      static_cast<Extents&>(spoiled) = in_use(spoiled, spoiled.counters.front());
      DeviceView unused;
      spoiled.each(unused, [](const auto& array, auto& vector, auto&) {
        if (array.lifetime != Lifetime::state) return;
        vector.resize(static_cast<std::size_t>(array.extent));
        vector.shrink_to_fit();
      });
      ASSERT_TRUE(extract_states(spoiled, bodies.setups) == expected);
    });
  }
  EXPECT_GT(skins, 10);
}

TEST(Arrays, ThatAreConstantAreNotWritten) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::map<std::string, std::string> first;
    run_all(some_bodies(seed, 8), [&](StagingBuffers& staging) {
      const auto now = bytes_of(staging, Lifetime::constant);
      if (first.empty()) first = now;
      for (const auto& [name, bytes] : now) ASSERT_TRUE(bytes == first.at(name)) << name;
    });
    ASSERT_GT(first.size(), 10u);
  }
}

}  // namespace
}  // namespace cutproof::gpu::arrays_test
