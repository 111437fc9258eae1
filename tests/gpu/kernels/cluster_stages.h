// Running a stage that changes clusters on the kernels, and comparing what comes out with the reference.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "gpu/host/host_launcher.h"
#include "gpu/state/plan.h"
#include "gpu/state/staging.h"
#include "model/backend.h"
#include "property_tests/cases.h"
#include "property_tests/random.h"
#include "reference_cpu/reference.h"

namespace cutproof::gpu::tests {

struct Bodies {
  std::vector<Setup> setups;
  std::vector<State> states;

  void add(Setup setup, State state) {
    setups.push_back(std::move(setup));
    states.push_back(std::move(state));
  }
};

// A load whose staging buffers the kernels work on.
struct Bench {
  Bodies bodies;
  StagingBuffers staging;
  DeviceView view;
  Plan plan;
  std::vector<State> loaded;  // the states as the kernels have them: in single precision

  // `cut`: every body counts as cut in this frame, whether or not it lists removed particles.
  explicit Bench(Bodies of, bool cut = false)
      : bodies(std::move(of)), staging(make_staging_buffers(bodies.setups, bodies.states, Capacity{})) {
    if (cut) {
      for (std::size_t b = 0; b < bodies.setups.size(); ++b) staging.cut[b] = 2 * staging.frame[b];
    }
    view = staging.view();
    plan = make_plan(bodies.setups, bodies.states);
    loaded = states();
  }
  Bench(const Bench&) = delete;

  // What stages find is as a load has left it, but nowhere does a stage rely on scratch memory.
  void spoil_scratch() {
    staging.each(view, [](const auto& array, auto& vector, auto&) {
      if (array.lifetime != Lifetime::scratch || vector.empty()) return;
      std::memset(static_cast<void*>(vector.data()), 0x5a, vector.size() * sizeof vector.front());
    });
  }
  std::vector<State> states() const { return extract_states(staging, bodies.setups); }
  int fault() const { return staging.counters.front().fault; }
};

// membership_count, membership_begin and memberships say the same as the lists of members.
inline void expect_memberships_agree(const StagingBuffers& staging) {
  std::vector<std::vector<int>> expected(staging.node.size());
  for (int s = 0; s < staging.counters.front().slots_used; ++s) {
    const auto slot = static_cast<std::size_t>(s);
    for (int k = 0; k < staging.slot_size[slot]; ++k) {
      const int p = staging.members[static_cast<std::size_t>(staging.slot_begin[slot] + k)];
      expected[static_cast<std::size_t>(p)].push_back(s);
    }
  }
  for (std::size_t p = 0; p < expected.size(); ++p) {
    std::vector<int> found;
    for (int h = staging.membership_begin[p]; h < staging.membership_begin[p + 1]; ++h) {
      if (staging.memberships[static_cast<std::size_t>(h)] >= 0)
        found.push_back(staging.memberships[static_cast<std::size_t>(h)]);
    }
    std::sort(found.begin(), found.end());
    ASSERT_EQ(found, expected[p]) << "memberships of particle " << p;
    ASSERT_EQ(staging.membership_count[p], static_cast<int>(expected[p].size())) << "memberships of particle " << p;
  }
}

// Members, numbers, rotations and flags exactly; rest frames up to rounding.
inline void expect_same_clusters(const State& expected, const State& found, double spacing) {
  const Clusters &a = expected.clusters, &b = found.clusters;
  ASSERT_EQ(a.number, b.number);
  ASSERT_EQ(a.offsets, b.offsets);
  ASSERT_EQ(a.members, b.members);
  ASSERT_EQ(a.degenerate, b.degenerate);
  ASSERT_EQ(expected.edge_covered, found.edge_covered);
  for (std::size_t c = 0; c < a.number.size(); ++c) {
    for (std::size_t k = 0; k < 9; ++k) {
      ASSERT_EQ(static_cast<float>(a.rotation[c].m[k]), static_cast<float>(b.rotation[c].m[k]));
    }
    ASSERT_NEAR(a.mass[c], b.mass[c], 1e-5 * a.mass[c]) << "cluster " << a.number[c];
    ASSERT_LT(norm(a.rest_center[c] - b.rest_center[c]), 1e-4 * spacing) << "cluster " << a.number[c];
  }
}

// The middle of a frame in which something was removed: states of random dissections, cooked and foreign, as they are
// before `stage`. Calls visit(setup, state).
template <class Visit>
void for_random_states(std::uint64_t seed, int cases, int size, Stage stage, Visit visit) {
  property_tests::Random random(seed);
  for (int k = 0; k < cases; ++k) {
    const std::uint64_t case_seed = random.seed();
    SCOPED_TRACE("draw_case(" + std::to_string(case_seed) + ", " + std::to_string(size) + ')');
    auto [setup, state] = property_tests::instance_of(property_tests::draw_case(case_seed, size));
    const auto backend = reference::make_backend();
    const std::int64_t frames = setup.frame_count();
    backend->load({setup}, {state});
    for (std::int64_t f = 0; f < frames; ++f) {
      if (stage == Stage::merge) backend->run({Stage::step, Stage::split});
      if (stage == Stage::expand) backend->run({Stage::step, Stage::merge});
      const State before = backend->snapshot().front();
      if (!before.removed.empty()) visit(setup, before);
      backend->run({stage, Stage::skin});
      if (::testing::Test::HasFatalFailure()) return;
    }
  }
}

}  // namespace cutproof::gpu::tests
