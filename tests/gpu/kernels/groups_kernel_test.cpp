// Groups of the kernels: which particles are in which, the constants that sums over them need, when they are made
// again, and that carrying particles in them gives what carrying each by itself gives.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <set>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "gpu/frame.h"
#include "gpu/host/host_launcher.h"
#include "gpu/kernels/step/groups.cuh"
#include "gpu/load.h"
#include "gpu/state/staging.h"
#include "model/at.h"
#include "property_tests/cases.h"
#include "property_tests/random.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/states.h"

namespace cutproof::gpu::groups_kernel_test {
namespace {

using Random = std::mt19937_64;
double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
double normal(Random& random) { return std::normal_distribution<double>()(random); }

struct Bodies {
  std::vector<cutproof::Setup> setups;
  std::vector<State> states;
};

// Names particles, and never holds them.
template <class Names>
Grip idle_grip(const cutproof::Setup& setup, Names names) {
  Grip grip;
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (names(i)) grip.particles.push_back(i);
  }
  const std::size_t substeps = setup.substep_length.size() * at(setup.step.substeps);
  grip.active.assign(substeps, false);
  grip.displacement.assign(substeps, Vec3{});
  return grip;
}

Bodies random_bodies(std::uint64_t seed, int count, int size) {
  property_tests::Random random(seed);
  Bodies bodies;
  for (int k = 0; k < count; ++k) {
    auto [setup, state] = property_tests::instance_of(property_tests::draw_case(random.seed(), size));
    for (int g = 0; g < k % 3; ++g)
      setup.grips.push_back(idle_grip(setup, [&](int32_t) { return random.chance(0.3); }));
    bodies.setups.push_back(std::move(setup));
    bodies.states.push_back(std::move(state));
  }
  return bodies;
}

// A load with its groups made.
struct Grouped {
  Bodies bodies;
  StagingBuffers staging;
  DeviceView view;
  explicit Grouped(Bodies of) : Grouped(std::move(of), HostLauncher()) {}
  // `like`: loaded before, with these states since; its rest frames are taken over, for a state gives them in double
  // precision, rounded to the last bit but one.
  Grouped(Bodies of, HostLauncher launcher, const StagingBuffers* like = nullptr)
      : bodies(std::move(of)), staging(make_staging_buffers(bodies.setups, bodies.states, Capacity{})) {
    if (like != nullptr) take_over_rest_frames(*like);
    view = staging.view();
    enqueue_groups_if_stale(launcher, view);
  }
  Grouped(const Grouped&) = delete;
  const Counters& counters() const { return staging.counters.front(); }

 private:
  // The load has the clusters of each body in turn; those of `like` come in any order.
  void take_over_rest_frames(const StagingBuffers& like) {
    int to = 0;
    for (int b = 0; b < staging.bodies; ++b) {
      for (int slot = 0; slot < like.counters.front().slots_used; ++slot) {
        if (like.slot_size[at(slot)] == 0 || like.slot_body[at(slot)] != b) continue;
        ASSERT_EQ(staging.members[at(staging.slot_begin[at(to)])], like.members[at(like.slot_begin[at(slot)])]);
        for (int axis = 0; axis < 3; ++axis) {
          ASSERT_EQ(staging.rest_base[at(3 * to + axis)], like.rest_base[at(3 * slot + axis)]);
        }
        staging.rest_offset[at(to++)] = like.rest_offset[at(slot)];
      }
    }
  }
};

std::vector<int> holders_of(const StagingBuffers& staging, int p) {
  std::vector<int> found;
  for (int k = staging.membership_begin[at(p)]; k < staging.membership_begin[at(p) + 1]; ++k) {
    if (staging.memberships[at(k)] >= 0) found.push_back(staging.memberships[at(k)]);
  }
  std::sort(found.begin(), found.end());
  return found;
}

// The chunks of each class of a plain map, and what is left over.
struct Expected {
  std::vector<std::vector<int>> groups;  // ascending by the class's first particle, then by their own
  std::set<int> loose;
};
Expected expected_of(const StagingBuffers& staging, const std::vector<cutproof::Setup>& setups) {
  std::vector<std::set<int>> grips(staging.node.size());  // that name a particle, each by its number in its body
  for (std::size_t b = 0; b < setups.size(); ++b) {
    for (std::size_t g = 0; g < setups[b].grips.size(); ++g) {
      for (const int32_t i : setups[b].grips[g].particles) {
        grips[at(staging.body[b].particle_begin + i)].insert(static_cast<int>(g));
      }
    }
  }
  std::map<std::pair<std::vector<int>, std::set<int>>, std::vector<int>> classes;
  Expected expected;
  for (int p = 0; p < static_cast<int>(staging.node.size()); ++p) {
    if (staging.death[at(p)] >= 0) continue;
    const std::vector<int> holders = holders_of(staging, p);
    if (holders.empty()) {
      expected.loose.insert(p);
    } else {
      classes[{holders, grips[at(p)]}].push_back(p);
    }
  }
  std::vector<std::vector<int>> ordered;
  for (auto& [key, members] : classes) ordered.push_back(std::move(members));
  std::sort(ordered.begin(), ordered.end());
  for (const std::vector<int>& members : ordered) {
    for (std::size_t begin = 0; begin < members.size(); begin += kMostInGroup) {
      const std::size_t end = std::min(members.size(), begin + kMostInGroup);
      if (end - begin < at(kLeastInGroup)) {
        expected.loose.insert(members.begin() + static_cast<std::ptrdiff_t>(begin), members.end());
      } else {
        expected.groups.emplace_back(members.begin() + static_cast<std::ptrdiff_t>(begin),
                                     members.begin() + static_cast<std::ptrdiff_t>(end));
      }
    }
  }
  return expected;
}

std::vector<int> particles_of(const StagingBuffers& staging, const GroupHead& head) {
  return {staging.place_particle.begin() + head.begin, staging.place_particle.begin() + head.begin + head.size};
}

// Groups and places are those of the plain map.
void expect_classes(const Grouped& grouped) {
  const StagingBuffers& staging = grouped.staging;
  const Expected expected = expected_of(staging, grouped.bodies.setups);
  ASSERT_EQ(grouped.counters().groups, static_cast<int>(expected.groups.size()));
  ASSERT_EQ(grouped.counters().loose, static_cast<int>(expected.loose.size()));
  EXPECT_EQ(grouped.counters().groups_stale, 0);
  std::set<std::vector<int>> made;
  for (int g = 0; g < grouped.counters().groups; ++g) {
    const GroupHead& head = staging.group_head[at(g)];
    const std::vector<int> particles = particles_of(staging, head);
    made.insert(particles);
    ASSERT_EQ(head.body, staging.body_of[at(particles.front())]);
    ASSERT_EQ(staging.group_at[at(particles.front())], g);
  }
  ASSERT_EQ(made, std::set<std::vector<int>>(expected.groups.begin(), expected.groups.end()));
  std::set<int> found;
  for (int k = 0; k < grouped.counters().loose; ++k) {
    found.insert(staging.place_particle[at(staging.loose_places[at(k)])]);
  }
  ASSERT_EQ(found, expected.loose);
  for (int p = 0; p < static_cast<int>(staging.node.size()); ++p) {
    if (staging.death[at(p)] >= 0) continue;
    ASSERT_EQ(staging.place_particle[at(staging.place_of[at(p)])], p);
    ASSERT_EQ(staging.place_node[at(staging.place_of[at(p)])], staging.node[at(p)]);
  }
}

TEST(Groups, AreTheClassesOfEqualHoldersInChunks) {
  int groups = 0, loose = 0, chunked = 0, gripped = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    const Grouped grouped(random_bodies(seed, 6, 120));
    ASSERT_NO_FATAL_FAILURE(expect_classes(grouped));
    for (int g = 0; g < grouped.counters().groups; ++g) {
      const GroupHead& head = grouped.staging.group_head[at(g)];
      gripped += head.hold_set > 0;
      chunked += head.size == kMostInGroup;
    }
    groups += grouped.counters().groups;
    loose += grouped.counters().loose;
  }
  EXPECT_GT(groups, 1000);
  EXPECT_GT(loose, 1000);
  EXPECT_GT(chunked, 3);
  EXPECT_GT(gripped, 30);
}

// Clusters whose lists a block has no room for in its shared memory.
TEST(Groups, OfVeryLargeClustersAreNoOthers) {
  cutproof::Setup setup;
  setup.body = fixtures::block(26, 14, 14, 0.01);
  ClusterSpec spec;
  spec.side = 13;
  const State state = fixtures::cook(setup.body, spec, setup.expand, setup.merge, 1);
  ASSERT_EQ(state.clusters.count(), 2);
  for (int32_t c = 0; c < 2; ++c) ASSERT_GT(state.clusters.size(c), kMostDealt);
  expect_classes(Grouped(Bodies{{setup}, {state}}));
}

// Against sums in double precision over the particles, with rest centers as they are stored.
TEST(Groups, HaveTheMomentsOfTheirParticles) {
  Grouped grouped(random_bodies(77, 40, 120));
  const StagingBuffers& s = grouped.staging;
  const auto node = [&](int p) {
    const BodyConstants& body = s.body[at(s.body_of[at(p)])];
    const Coordinates c = coordinates(body, s.node[at(p)]);
    return Vec3{double(c.i), double(c.j), double(c.k)};
  };
  const auto share = [&](int p) { return double{s.displacement[at(p)].w} / s.membership_count[at(p)]; };
  const auto rest_center = [&](int slot) {
    const Float3 o = s.rest_offset[at(slot)];
    return Vec3{s.rest_base[at(3 * slot)] + double{o.x}, s.rest_base[at(3 * slot + 1)] + double{o.y},
                s.rest_base[at(3 * slot + 2)] + double{o.z}};
  };
  constexpr double kClose = 1e-5;  // 64 terms of two roundings each, and the rounding of arms of up to some 10 h
  const auto expect_moments = [&](const std::vector<int>& particles, Vec3 center, Float4 mass, Float4 upper,
                                  Float4 lower) {
    double m = 0, size = 0;
    Vec3 first;
    double second[6] = {};
    for (const int p : particles) {
      const Vec3 r = node(p) - center;
      m += share(p);
      first += share(p) * r;
      size += share(p) * (1 + dot(r, r));
      const double product[6] = {r.x * r.x, r.x * r.y, r.x * r.z, r.y * r.y, r.y * r.z, r.z * r.z};
      for (std::size_t k = 0; k < 6; ++k) second[k] += share(p) * product[k];
    }
    EXPECT_NEAR(mass.w, m, kClose * m);
    EXPECT_NEAR(mass.x, first.x, kClose * size);
    EXPECT_NEAR(mass.y, first.y, kClose * size);
    EXPECT_NEAR(mass.z, first.z, kClose * size);
    const float found[6] = {upper.x, upper.y, upper.z, upper.w, lower.x, lower.y};
    for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(found[k], second[k], kClose * size) << k;
  };
  std::map<int, std::vector<std::pair<int, Offset>>> of_cluster;  // by slot: group and what it says
  for (int g = 0; g < grouped.counters().groups; ++g) {
    SCOPED_TRACE("group " + std::to_string(g));
    const GroupHead& head = s.group_head[at(g)];
    const RestCenter& c = s.group_center[at(g)];
    const Vec3 center = {c.i + double{c.x}, c.j + double{c.y}, c.k + double{c.z}};
    const std::vector<int> particles = particles_of(s, head);
    expect_moments(particles, center, s.group_mass[at(g)], s.group_spread[at(2 * g)], s.group_spread[at(2 * g + 1)]);
    // The mean of all, to the rounding of one number.
    const double scale = double{s.group_mass[at(g)].w} * head.radius;
    EXPECT_LE(std::abs(s.group_mass[at(g)].x), 1e-6 * scale + 1e-12);
    double farthest = 0, nearest = 1e9;
    for (const int p : particles) {
      farthest = std::max(farthest, norm(node(p) - center));
      nearest = std::min(nearest, norm(node(p) - center));
    }
    EXPECT_GE(head.radius, farthest);
    EXPECT_LE(head.radius, farthest * 1.0001);
    EXPECT_NEAR(norm(node(particles[at(head.middle)]) - center), nearest, 1e-5);
    const std::vector<int> holders = holders_of(s, particles.front());
    ASSERT_EQ(head.holder_count, static_cast<int>(holders.size()));
    for (int k = 0; k < head.holder_count; ++k) {
      const Offset& to = s.holders[at(head.holder_begin + k)];
      ASSERT_EQ(to.index, holders[at(k)]);
      const Vec3 apart = center - rest_center(to.index);
      EXPECT_LE(norm(Vec3{to.x, to.y, to.z} - apart), 1e-6 * (1 + norm(apart)));
      of_cluster[to.index].emplace_back(g, to);
    }
  }
  int with_loose = 0;
  for (int slot = 0; slot < grouped.counters().slots_used; ++slot) {
    SCOPED_TRACE("slot " + std::to_string(slot));
    std::vector<int> members(s.members.begin() + s.slot_begin[at(slot)],
                             s.members.begin() + s.slot_begin[at(slot)] + s.slot_size[at(slot)]);
    expect_moments(members, rest_center(slot), s.cluster_rest[at(3 * slot)], s.cluster_rest[at(3 * slot + 1)],
                   s.cluster_rest[at(3 * slot + 2)]);
    // Both lists say the same, to the bit; the cluster's is ascending by first particle.
    const int begin = s.cluster_head[at(slot)].group_begin, end = begin + s.cluster_head[at(slot)].group_count;
    auto& listed = of_cluster[slot];
    ASSERT_EQ(end - begin, static_cast<int>(listed.size()));
    int last = -1;
    for (int k = begin; k < end; ++k) {
      const Offset& to = s.cluster_groups[at(k)];
      const int first = s.place_particle[at(s.group_head[at(to.index)].begin)];
      EXPECT_GT(first, last);
      last = first;
      const auto same = std::find_if(listed.begin(), listed.end(), [&](const auto& l) { return l.first == to.index; });
      ASSERT_NE(same, listed.end());
      EXPECT_EQ(std::memcmp(&same->second, &to, 3 * sizeof(float)), 0);
    }
    std::vector<int> loose, expected;
    for (int k = 0; k < s.cluster_head[at(slot)].loose_count; ++k) {
      loose.push_back(s.place_particle[at(s.cluster_loose[at(s.cluster_head[at(slot)].loose_begin + k)])]);
    }
    for (const int p : members) {
      if (s.group_at[at(p)] == groups_detail::kLoose) expected.push_back(p);
    }
    EXPECT_EQ(loose, expected);
    with_loose += !loose.empty();
  }
  EXPECT_GT(with_loose, 10);
}

// Everything that the tables say, but for the numbers of groups and the places of particles: clusters in the order in
// which a load has them, groups as their clusters list them.
std::string tables_of(const StagingBuffers& s) {
  const Counters& c = s.counters.front();
  std::vector<int> slots, rank(at(c.slots_used));
  for (int b = 0; b < s.bodies; ++b) {
    for (int slot = 0; slot < c.slots_used; ++slot) {
      if (s.slot_size[at(slot)] == 0 || s.slot_body[at(slot)] != b) continue;
      rank[at(slot)] = static_cast<int>(slots.size());
      slots.push_back(slot);
    }
  }
  std::string text;
  const auto add = [&](const auto& value) { text.append(reinterpret_cast<const char*>(&value), sizeof value); };
  const auto add_offset = [&](const Offset& o) { add(o.x), add(o.y), add(o.z); };
  int groups = 0;
  for (int g = 0; g < c.groups; ++g) groups += s.group_head[at(g)].size > 0;
  add(groups);
  std::multiset<int> loose;
  for (int k = 0; k < c.loose; ++k) {
    if (s.loose_places[at(k)] >= 0) loose.insert(s.place_particle[at(s.loose_places[at(k)])]);
  }
  for (const int p : loose) add(p);
  for (const int slot : slots) {
    for (int k = 0; k < 3; ++k) add(s.cluster_rest[at(3 * slot + k)]);
    for (int k = 0; k < s.cluster_head[at(slot)].loose_count; ++k) {
      add(s.place_particle[at(s.cluster_loose[at(s.cluster_head[at(slot)].loose_begin + k)])]);
    }
    for (int k = 0; k < s.cluster_head[at(slot)].group_count; ++k) {
      const Offset& to = s.cluster_groups[at(s.cluster_head[at(slot)].group_begin + k)];
      add_offset(to);
      const GroupHead& head = s.group_head[at(to.index)];
      add(head.size), add(head.body), add(head.middle), add(head.radius), add(head.hold_set);
      for (const int p : particles_of(s, head)) add(p);
      add(s.group_center[at(to.index)]), add(s.group_mass[at(to.index)]);
      add(s.group_spread[at(2 * to.index)]), add(s.group_spread[at(2 * to.index + 1)]);
      for (int h = 0; h < head.holder_count; ++h) {
        const Offset& holder = s.holders[at(head.holder_begin + h)];
        add_offset(holder);
        add(rank[at(holder.index)]);
      }
    }
  }
  return text;
}

// How frames are run: in parts, which make groups in front of the step, as wholes, which leave them to the next one, or
// now so and now so.
enum class Frames { in_parts, whole, either };
struct Followed {
  int in_part = 0, anew = 0, kept = 0;
  int moved = 0;  // frames in which lists were moved together
};
// After every frame of dissections that split, merge and expand, up to one that finds no room: the step finds what a
// load of that state would make. room: for lists of members, of what is loaded; 0: as a load has it.
void follow_clusters(Frames frames, double room, Followed& followed) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    const Bodies bodies = random_bodies(seed, 5, 60);
    StagingBuffers staging = make_staging_buffers(bodies.setups, bodies.states, Capacity{});
    Counters& counters = staging.counters.front();
    if (room > 0) {
      staging.member_capacity = static_cast<int>(room * counters.members_used);
      staging.allocate();
    }
    const DeviceView view = staging.view();
    const Plan plan = make_plan(bodies.setups, bodies.states);
    HostLauncher launcher;
    Load load;  // only to be asked
    const auto begin = [&](Span span) {
      if (load.needs_groups(span)) enqueue_groups_if_stale(launcher, view);
    };
    const auto run = [&](Span span) { enqueue_span(launcher, view, plan, span, [](Stage) {}); };
    Random random(seed);
    std::int64_t count = 0;
    for (const cutproof::Setup& setup : bodies.setups) count = std::max(count, setup.frame_count());
    for (std::int64_t f = 0; f < count && counters.fault == 0; ++f) {
      const bool whole = frames == Frames::whole || (frames == Frames::either && uniform(random, 0, 1) < 0.5);
      const Grouped fresh(Bodies{bodies.setups, extract_states(staging, bodies.setups)}, HostLauncher(), &staging);
      if (::testing::Test::HasFatalFailure()) return;
      const bool stale = counters.groups_stale != 0;
      ASSERT_TRUE(f == 0 || frames != Frames::whole || !stale) << "frame " << f;
      constexpr int kUntouched = -1;
      counters.groups_before = kUntouched;
      const Span span = whole ? Span{} : Span{Stage::step, Stage::step};
      begin(span);
      if (!whole) run(span);
      ASSERT_TRUE(tables_of(staging) == tables_of(fresh.staging)) << "frame " << f;
      const int members = counters.members_used;
      if (whole) {
        run(span);
      } else {
        const Span rest{Stage::detect, Stage::skin};
        begin(rest);
        run(rest);
      }
      followed.moved += counters.members_used < members;  // nothing else takes places back
      if (f == 0 || counters.groups_before == kUntouched) continue;
      ++(counters.groups_before > 0 ? followed.in_part : followed.anew);
      followed.kept += counters.groups_before > 0 && staging.group_head.front().size > 0;
    }
  }
}

TEST(Groups, FollowTheClusters) {
  for (const Frames frames : {Frames::in_parts, Frames::whole, Frames::either}) {
    Followed followed;
    ASSERT_NO_FATAL_FAILURE(follow_clusters(frames, 0, followed));
    std::printf("made in part %d times, as a whole %d times\n", followed.in_part, followed.anew);
    EXPECT_GT(followed.in_part, 25);
    EXPECT_GT(followed.kept, 10);
    EXPECT_GT(followed.anew, 5);
  }
}

// Where a merge finds no place for a union, the lists of all clusters are moved together, and what groups say of them
// lies elsewhere.
TEST(Groups, FollowListsThatAreMovedTogether) {
  for (const Frames frames : {Frames::in_parts, Frames::whole}) {
    Followed followed;
    for (const double room : {1.03, 1.05, 1.1, 1.2, 1.5}) {
      SCOPED_TRACE(room);
      ASSERT_NO_FATAL_FAILURE(follow_clusters(frames, room, followed));
    }
    std::printf("lists were moved together %d times; made in part %d times, as a whole %d times\n", followed.moved,
                followed.in_part, followed.anew);
    EXPECT_GT(followed.moved, 10);
  }
}

// Three boxes in a row, of which the one in the middle is small and shares a layer with either end, merged into one of
// these. What it shared with the other one are groups of that one, which else nothing changes. (A fourth is there so
// that there is room for new groups behind those that stay.)
TEST(Groups, FollowParticlesThatPassFromOneClusterToAnother) {
  const Body body = fixtures::block(120, 3, 3, 0.01);
  const auto layers = [&](int from, int to) {
    std::vector<int32_t> members;
    for (int32_t p = 0; p < body.particle_count(); ++p) {
      if (p % 120 >= from && p % 120 <= to) members.push_back(p);
    }
    return members;
  };
  const std::vector<int32_t> ends[2] = {layers(0, 3), layers(4, 8)}, middle = layers(3, 4), rest = layers(9, 119);
  int passed = 0;
  for (const auto& lists : {std::vector{ends[0], middle, ends[1], rest}, std::vector{ends[1], middle, ends[0], rest}}) {
    cutproof::Setup setup = cutproof::tests::setup_of(body);
    setup.merge.rule = MergeRule::deterministic;
    const Bodies bodies{{setup}, {cutproof::tests::state_of(body, lists, 20)}};
    StagingBuffers staging = make_staging_buffers(bodies.setups, bodies.states, Capacity{});
    const DeviceView view = staging.view();
    HostLauncher launcher;
    enqueue_groups_if_stale(launcher, view);
    staging.cut[0] = 2 * staging.frame[0];
    enqueue_merge(launcher, view);
    launcher.teams(sort_memberships_kernel_object{}, kParticleTile, particle_tiles(view.particles), view);
    ASSERT_EQ(staging.slot_size[1], 0);
    passed += staging.slot_size[2] > static_cast<int>(lists[2].size());
    enqueue_groups(launcher, view);
    ASSERT_GT(staging.counters.front().groups_before, 0) << "all were made anew";
    const Grouped fresh(Bodies{bodies.setups, extract_states(staging, bodies.setups)}, HostLauncher(), &staging);
    ASSERT_FALSE(HasFatalFailure());
    EXPECT_TRUE(tables_of(staging) == tables_of(fresh.staging));
  }
  EXPECT_EQ(passed, 1) << "once, groups are listed with a cluster that neither is the small one nor gets its particles";
}

TEST(Groups, AreTheSameUnderEverySchedule) {
  const Bodies bodies = random_bodies(5, 3, 80);
  const std::string expected = tables_of(Grouped(bodies).staging);
  const auto simulated = [&](Generator schedule) {
    SimulationOptions options;
    options.schedule = std::move(schedule);
    return tables_of(Grouped(bodies, HostLauncher(options)).staging);
  };
  EXPECT_TRUE(simulated(forward()) == expected);
  EXPECT_TRUE(simulated(reverse()) == expected);
  EXPECT_TRUE(simulated(round_robin()) == expected);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) EXPECT_TRUE(simulated(random_walk(seed)) == expected) << seed;
  EXPECT_TRUE(tables_of(Grouped(bodies, HostLauncher(HostLauncher::Threads{4})).staging) == expected);
}

// No point of a clear ball is projected or touches, whatever its side; and balls are called clear often enough to be of
// use.
TEST(Groups, AreClearOnlyIfNoPointOfTheirBallTouches) {
  Random random(91);
  int clear = 0, near_blade = 0, over = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const float h = 0.01f;
    WallF walls[2] = {{2, 1, static_cast<float>(uniform(random, -0.05, 0.02)), 0},
                      {0, -1, static_cast<float>(uniform(random, 0.05, 0.2)), 0.3f}};
    const auto pose = [&] {
      const double a = uniform(random, 0, 6.28), b = uniform(random, -1.5, 1.5);
      const Vec3 along = {std::cos(a), std::sin(a), 0};
      const Vec3 back = {-std::sin(b) * std::sin(a), std::sin(b) * std::cos(a), std::cos(b)};
      const auto single = [](Vec3 v) {
        return Float3{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
      };
      return make_pose(single({uniform(random, 0, 0.1), uniform(random, 0, 0.1), uniform(random, 0, 0.1)}),
                       single(along), single(back));
    };
    const MoveF move = {pose(), pose(), 1};
    Contacts contacts = {};
    contacts.walls = walls;
    contacts.wall_count = trial % 3 == 0 ? 0 : 2;
    contacts.move = trial % 5 == 0 ? nullptr : &move;
    contacts.half_length = 0.03f;
    contacts.depth = 0.04f;
    contacts.clearance = 0.0075f;
    contacts.frictionless = contacts.wall_count == 0;
    const Ball ball = {{h,
                        {static_cast<float>(uniform(random, 0, 10)), static_cast<float>(uniform(random, 0, 10)),
                         static_cast<float>(uniform(random, 0, 10))}},
                       {static_cast<float>(0.02 * normal(random)), static_cast<float>(0.02 * normal(random)),
                        static_cast<float>(0.02 * normal(random))},
                       static_cast<float>(h * uniform(random, 0, 3))};
    const int side = static_cast<int>(uniform(random, -1.99, 1.99));
    if (!is_clear(contacts, ball, side)) continue;
    ++clear;
    if (contacts.move != nullptr) {
      const Float3 c = contacts_detail::into_frame(move.to, ball.rest.from(move.to.edge) + ball.d);
      near_blade += std::abs(c.z) < ball.radius + 2 * contacts.clearance;
      over += contacts_detail::is_over_blade(contacts, c);
    }
    for (int k = 0; k < 40; ++k) {
      // Half of them on its surface.
      Vec3 way = {normal(random), normal(random), normal(random)};
      way = ((k % 2 == 0 ? 1.0 : uniform(random, 0, 1)) * double{ball.radius} / norm(way)) * way;
      const Float3 d = ball.d + Float3{static_cast<float>(way.x), static_cast<float>(way.y), static_cast<float>(way.z)};
      for (const float own : {-1.0f, 1.0f}) {
        if (side != 0 && own != static_cast<float>(side)) continue;
        bool in_turn = false;
        const Float3 reached = project(contacts, ball.rest, d, own, ball.d, in_turn);
        ASSERT_TRUE(contacts_detail::same(reached, d)) << "trial " << trial;
        ASSERT_FALSE(contacts_detail::touches(contacts, ball.rest, d, own)) << "trial " << trial;
      }
    }
  }
  EXPECT_GT(clear, 3000);
  EXPECT_GT(near_blade, 100);
  EXPECT_GT(over, 300);
}

// Touching begins a margin before what is projected, and the nearest point of a ball may be there: over a floor, beside
// a plate, before its edge and beyond its end.
TEST(Groups, AreNotClearWhereTheirNearestPointTouches) {
  Random random(93);
  int clear = 0, touching = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const float h = 0.01f;
    const double margin = kTouchMargin * double{h};
    const double gap = margin * uniform(random, -0.5, 2);
    const float radius = static_cast<float>(h * uniform(random, 0, 3));
    const int which = trial % 4;
    const PoseF pose = make_pose({0.05f, 0.05f, 0.05f}, {1, 0, 0}, {0, 0, 1});
    const MoveF move = {pose, pose, 1};
    Contacts contacts = {};
    contacts.half_length = 0.03f;
    contacts.depth = 0.04f;
    contacts.clearance = 0.0075f;
    contacts.frictionless = true;
    // Coordinates of the frame of the blade: along, back, across, from the middle of its edge.
    Vec3 center = {uniform(random, -0.02, 0.02), uniform(random, 0.01, 0.03), 0}, way;
    const double away = double{radius} + gap;
    if (which == 1) center.z = contacts.clearance + away, way = {0, 0, -1};
    if (which == 2) center.y = -(contacts.clearance + away), way = {0, 1, 0};
    if (which == 3) center.x = contacts.half_length + contacts.clearance + away, way = {-1, 0, 0};
    const Vec3 along = {1, 0, 0}, back = {0, 0, 1}, across = cross(along, back);
    const auto in_world = [&](Vec3 c) { return c.x * along + c.y * back + c.z * across; };
    Vec3 place = Vec3{0.05, 0.05, 0.05} + in_world(center);
    way = in_world(way);
    WallF floor = {2, 1, 0.02f, 0};
    if (which == 0) {
      contacts.walls = &floor;
      contacts.wall_count = 1;
      place.z = double{floor.offset} + away;
      way = {0, 0, -1};
    } else {
      contacts.move = &move;
    }
    const Vec3 d = place - double{h} * Vec3{4, 5, 6};
    const Ball ball = {
        {h, {4, 5, 6}}, {static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)}, radius};
    const Float3 nearest = ball.d + Float3{static_cast<float>(radius * way.x), static_cast<float>(radius * way.y),
                                           static_cast<float>(radius * way.z)};
    const bool touches = contacts_detail::touches(contacts, ball.rest, nearest, 1);
    EXPECT_EQ(touches, gap < margin) << "case " << which << ", gap of " << gap / margin << " margins";
    touching += touches;
    if (!is_clear(contacts, ball, 0)) continue;
    ++clear;
    ASSERT_FALSE(touches) << "case " << which << ", gap of " << gap / margin << " margins";
  }
  EXPECT_GT(touching, 10000);
  EXPECT_GT(clear, 5000);
}

// Points at d~ + M(r) - l e, each e and r at random, on the edge of what is allowed too; maps of up to twice the size.
TEST(Groups, AllPointsAreInTheirBall) {
  Random random(92);
  double fullest = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const auto single = [&](double scale) { return static_cast<float>(scale * uniform(random, -1, 1)); };
    Pace pace = {};
    pace.h = 0.01f;
    step_detail::Group group = {};
    group.head.radius = static_cast<float>(uniform(random, 0.5, 6));
    group.center.i = 3, group.center.j = 4, group.center.k = 5;
    group.center.x = single(0.5), group.center.y = single(0.5), group.center.z = single(0.5);
    const Float4 base = {single(0.05), single(0.05), single(0.05), static_cast<float>(uniform(random, 0, 0.03))};
    const float kept = static_cast<float>(uniform(random, 0, 1));
    step_detail::Map map = {};
    for (Float4& row : map.row) row = {single(0.02), single(0.02), single(0.02), single(0.02)};
    const Ball ball = step_detail::ball_around(pace, group, base, kept, map);
    const Vec3 center = Vec3{3.0 + group.center.x, 4.0 + group.center.y, 5.0 + group.center.z};
    for (int k = 0; k < 20; ++k) {
      const auto within = [&](double reach) {
        const Vec3 way = {normal(random), normal(random), normal(random)};
        return (reach * (k % 2 == 0 ? 1.0 : uniform(random, 0, 1)) / norm(way)) * way;
      };
      const Vec3 r = within(double{group.head.radius}), e = within(double{base.w});
      Vec3 x = double{pace.h} * (center + r) + Vec3{base.x, base.y, base.z} + double{kept} * e;
      for (int axis = 0; axis < 3; ++axis) {
        const Float4& row = map.row[axis];
        x[axis] += row.x * r.x + row.y * r.y + row.z * r.z + row.w;
      }
      Vec3 from_ball = x - Vec3{ball.d.x, ball.d.y, ball.d.z};
      from_ball -= double{pace.h} * center;
      const double part = norm(from_ball) / double{ball.radius};
      ASSERT_LE(part, 1 + 1e-5) << "trial " << trial;
      fullest = std::max(fullest, part);
    }
  }
  EXPECT_GT(fullest, 0.9) << "and balls are no larger than they have to be";
}

// One frame of the kernels, and which groups were resolved in it.
struct Stepped {
  State state;
  Elements<int> touched;
  StagingBuffers staging;
};
Stepped step(const cutproof::Setup& setup, const State& state) {
  Stepped stepped;
  const std::vector<cutproof::Setup> setups = {setup};
  const std::vector<State> states = {state};
  stepped.staging = make_staging_buffers(setups, states, Capacity{});
  HostLauncher launcher;
  enqueue_step(launcher, stepped.staging.view(), make_plan(setups, states), Span{Stage::step, Stage::step});
  stepped.state = extract_states(stepped.staging, setups).front();
  stepped.touched = stepped.staging.group_tracked;
  stepped.touched.resize(at(stepped.staging.counters.front().groups));
  return stepped;
}

// The step's kernels up to where a frame's first substep has begun, and what begins each that follows.
void begin_frame(HostLauncher& launcher, const DeviceView& w) {
  launcher.items(begin_frame_kernel_object{}, w.particles, w, Span{Stage::step, Stage::step});
  enqueue_groups_if_stale(launcher, w);
  launcher.teams(begin_first_substep_kernel_object<true, false, step_detail::kParticleTeam>{},
                 step_detail::kParticleTeam, w.group_capacity, w);
}
void begin_substep(HostLauncher& launcher, const DeviceView& w, int substep) {
  launcher.teams(begin_substep_kernel_object<true, false, step_detail::kRowTeam>{}, step_detail::kParticleTeam,
                 w.group_capacity, w, substep);
}

cutproof::Setup block_on_floor(double gap) {
  cutproof::Setup setup;
  setup.body = fixtures::block(15, 15, 15, 0.01);
  setup.substep_length.assign(1, 0.002);
  setup.step.gravity = {0, 0, -9.81};
  // Nodes begin one spacing above the origin.
  setup.walls = {{2, +1, 0.01 - gap, 0.3}};
  return setup;
}
State cooked(const cutproof::Setup& setup) {
  return fixtures::cook(setup.body, ClusterSpec{}, setup.expand, setup.merge, 1);
}

TEST(Groups, AreResolvedWhereTheyMayTouchAndNowhereElse) {
  const cutproof::Setup setup = block_on_floor(0);
  const Stepped found = step(setup, cooked(setup));
  int resolved = 0;
  double highest = 0, lowest_carried = 1;
  for (std::size_t g = 0; g < found.touched.size(); ++g) {
    double lowest = 1;
    for (const int p : particles_of(found.staging, found.staging.group_head[g])) {
      lowest = std::min(lowest, setup.body.rest_position(p).z);
    }
    if (found.touched[g] != 0) {
      ++resolved;
      highest = std::max(highest, lowest);
    } else {
      lowest_carried = std::min(lowest_carried, lowest);
    }
  }
  EXPECT_GT(resolved, 5);
  EXPECT_GT(lowest_carried, 0.0101) << "what lies on the floor is resolved";
  EXPECT_LE(highest, 0.05) << "what is far above it is carried";
  EXPECT_LT(resolved, static_cast<int>(found.touched.size()) / 2);
  const cutproof::Setup above = block_on_floor(0.05);
  for (const int touched : step(above, cooked(above)).touched) EXPECT_EQ(touched, 0);
}

// A plate stands in the middle of the body: groups with particles before and behind it are on neither side, whatever
// the one in their middle says, or one that comes through the plate might be taken for clear of it.
TEST(Groups, AreOnBothSidesOfTheBladeIfTheirParticlesAre) {
  cutproof::Setup setup = block_on_floor(0.05);
  setup.step.substeps = 2;
  const double h = setup.body.grid.spacing;
  setup.has_blade = true;
  setup.blade = {1, 1, 0.5 * h, 0};
  BladePose pose;
  pose.edge = {8.4 * h, 8 * h, -0.5};
  pose.along = {0, 1, 0};
  pose.back = {0, 0, 1};
  const double normal_x = cross(pose.along, pose.back).x;
  setup.blade_moves.assign(2, BladeMove{pose, pose, true, 0});
  const std::vector<cutproof::Setup> setups = {setup};
  StagingBuffers staging = make_staging_buffers(setups, {cooked(setup)}, Capacity{});
  const DeviceView w = staging.view();
  HostLauncher launcher;
  begin_frame(launcher, w);
  begin_substep(launcher, w, 1);
  int both = 0, one = 0;
  for (int g = 0; g < staging.counters.front().groups; ++g) {
    if (w.group_tracked[g] == step_detail::kUntouched) continue;
    const GroupHead& head = staging.group_head[at(g)];
    bool before = false, behind = false;
    for (int o = head.begin; o < head.begin + head.size; ++o) {
      const double x = setup.body.rest_position(staging.place_particle[at(o)]).x + w.start[o].x;
      (normal_x * (x - pose.edge.x) < 0 ? behind : before) = true;
    }
    ASSERT_EQ(w.group_side[g], before && behind ? 0 : behind ? -1 : 1) << "group " << g;
    ++(before && behind ? both : one);
  }
  EXPECT_GT(both, 5);
  EXPECT_GT(one, 5);
}

// Moments are about numbers near all of their group, though its middle particle, which gives those numbers else, may
// have been led, or be flying, far away.
TEST(Groups, HaveTheirBasesNearTheirMeans) {
  cutproof::Setup setup = block_on_floor(0.05);
  setup.step.substeps = 1;
  State state = cooked(setup);
  Random random(5);
  for (std::size_t i = 0; i < state.x.size(); i += 7) {
    state.x[i] += Vec3{normal(random), normal(random), 1 + std::abs(normal(random))} * 0.1;
  }
  for (std::size_t i = 0; i < state.v.size(); i += 11) {
    state.v[i] += Vec3{normal(random), normal(random), 1 + std::abs(normal(random))} * 50.0;
  }
  const Stepped found = step(setup, state);
  const StagingBuffers& staging = found.staging;
  const StagingBuffers begun = make_staging_buffers({setup}, {state}, Capacity{});
  const double near = (1.0 / 16 + 1e-3) * setup.body.grid.spacing;
  int moved = 0, hurried = 0;
  for (std::size_t g = 0; g < found.touched.size(); ++g) {
    const GroupHead& head = staging.group_head[g];
    const double mass = staging.group_mass[g].w;
    ASSERT_GT(mass, 0);
    const auto off = [&](const Elements<Float4>& moments) {
      const auto along = [&](std::size_t axis) { return moments[3 * g + axis].w / mass; };
      return norm(Vec3{along(0), along(1), along(2)});
    };
    EXPECT_LE(off(staging.frame_shape), near) << "group " << g;
    EXPECT_LE(off(staging.frame_motion), near / setup.substep_length.front()) << "group " << g;
    const auto middle = at(staging.place_particle[at(head.begin + head.middle)]);
    const auto differs = [](Float4 a, Float4 b) { return a.x != b.x || a.y != b.y || a.z != b.z; };
    const Float4 place = staging.group_origin[2 * g], velocity = staging.group_origin[2 * g + 1];
    moved += differs(begun.displacement[middle], place);
    hurried += differs(begun.velocity[middle], velocity);
    for (int k = 0; k < head.size; ++k) {
      const auto p = at(staging.place_particle[at(head.begin + k)]);
      const auto distance = [](Float4 a, Float4 b) { return norm(Vec3{a.x, a.y, a.z} - Vec3{b.x, b.y, b.z}); };
      EXPECT_LE(distance(begun.displacement[p], place), place.w);
      EXPECT_LE(distance(begun.velocity[p], velocity), velocity.w);
    }
  }
  for (const int many : {moved, hurried}) {
    EXPECT_GT(many, 20);
    EXPECT_LT(many, static_cast<int>(found.touched.size())) << "where it is near, it is the base";
  }
}

// An iteration adds a map and takes part of what a prediction has beyond its base, so particles may come to where they
// are at rest about the base: whatever an earlier substep has made of their group, no room is more than that leaves.
TEST(Groups, LeaveRoomForTheirRestShape) {
  cutproof::Setup setup = block_on_floor(0.05);
  setup.step.substeps = 2;
  const std::vector<cutproof::Setup> setups = {setup};
  StagingBuffers staging = make_staging_buffers(setups, {cooked(setup)}, Capacity{});
  const DeviceView w = staging.view();
  HostLauncher launcher;
  begin_frame(launcher, w);
  const int groups = staging.counters.front().groups;
  ASSERT_GT(groups, 20);
  const auto h = static_cast<float>(setup.body.grid.spacing);
  const float smaller = -0.9f * h;  // all are pressed together to a tenth, and stay so in the substep that ends
  const float lost = step_detail::numbers_of(w, 0, setup.step.iterations)->lost_before;
  for (int g = 0; g < groups; ++g) {
    for (int axis = 0; axis < 3; ++axis) {
      const int row = 3 * g + axis;
      const auto diagonal = [&](float entry) {
        return Float4{axis == 0 ? entry : 0, axis == 1 ? entry : 0, axis == 2 ? entry : 0, 0};
      };
      w.group_place[row] = diagonal(smaller);
      w.group_velocity[row] = {};
      w.group_map[row] = diagonal(lost * smaller);
    }
  }
  begin_substep(launcher, w, 1);
  for (int g = 0; g < groups; ++g) {
    ASSERT_EQ(w.group_tracked[g], step_detail::kUntouched);
    double lowest = 1;
    for (const int p : particles_of(staging, staging.group_head[at(g)])) {
      lowest = std::min(lowest, setup.body.rest_position(p).z);
    }
    EXPECT_LE(w.group_room[g], lowest + double{w.group_base[g].z} - setup.walls.front().offset) << "group " << g;
    EXPECT_GT(w.group_room[g], 0);
  }
}

// The same body, in which no two particles are named by the same grips: none of them is in a group.
cutproof::Setup without_groups(cutproof::Setup setup) {
  for (int32_t bit = 1; bit < setup.body.particle_count(); bit *= 2) {
    setup.grips.push_back(idle_grip(setup, [&](int32_t i) { return (i & bit) != 0; }));
  }
  return setup;
}

// Both candidates of an accelerated iteration are asked whether they touch. Seldom does only one of them, so the state
// in which one does is made by hand: all of a body is led to a floor, or comes back from below it.
TEST(Groups, AreResolvedIfEitherCandidateTouches) {
  constexpr int kIteration = 2;
  cutproof::Setup setup = block_on_floor(0.2);
  setup.step.substeps = 1;
  setup.step.iterations = 4;
  setup.step.gravity = {};
  setup.step.acceleration = Acceleration::chebyshev;
  const std::vector<cutproof::Setup> setups = {setup};
  const std::vector<State> states = {cooked(setup)};
  struct Candidates {
    float plain, accelerated;  // by how much all is moved [m]
    bool touches;
  };
  for (const Candidates& wanted : {Candidates{-0.01f, -0.02f, false}, Candidates{-0.01f, -0.4f, true},
                                   Candidates{-0.4f, -0.01f, true}, Candidates{-0.4f, -0.5f, true}}) {
    StagingBuffers staging = make_staging_buffers(setups, states, Capacity{});
    const DeviceView w = staging.view();
    HostLauncher launcher;
    begin_frame(launcher, w);
    const IterationNumbers& numbers = *step_detail::numbers_of(w, 0, kIteration);
    const step_detail::Combination combination = {numbers.pull, numbers.carry};
    // Where all is now, and where it was that the two lead to the candidate that is wanted.
    const float now = -0.005f;
    const float earlier =
        now - (wanted.accelerated - now - combination.pull * (wanted.plain - now)) / combination.carry;
    ASSERT_NEAR(combination(wanted.plain, now, earlier), wanted.accelerated, 1e-6);
    for (int slot = 0; slot < w.slot_capacity; ++slot) {
      w.placement[3 * slot] = w.placement[3 * slot + 1] = {};
      w.placement[3 * slot + 2] = {0, 0, 0, wanted.plain / staging.pace.front().s};
    }
    const int groups = staging.counters.front().groups;
    ASSERT_GT(groups, 20);
    for (int g = 0; g < groups; ++g) {
      ASSERT_EQ(w.group_resolved[g], kCarried);
      for (int axis = 0; axis < 3; ++axis) {
        const int row = 3 * g + axis;
        w.group_map[row] = {0, 0, 0, axis == 2 ? now : 0};
        w.group_earlier_map[row] = {0, 0, 0, axis == 2 ? earlier : 0};
      }
    }
    launcher.teams(advance_kernel_object<true, true, false, step_detail::kRowTeam>{}, step_detail::kParticleTeam,
                   w.group_capacity, w, 0, kIteration);
    for (int g = 0; g < groups; ++g) {
      ASSERT_EQ(w.group_resolved[g], wanted.touches ? kResolved : kCarried)
          << "plain " << wanted.plain << ", accelerated " << wanted.accelerated << ", group " << g;
    }
  }
}

// No way within the room around a ball leads to a contact: most groups of a body are asked nothing else. In the worst
// directions, of equal parts along all axes, among them.
TEST(Groups, TouchNothingWithinTheirRoom) {
  Random random(23);
  const auto direction = [&] {
    const Vec3 v = {normal(random), normal(random), normal(random)};
    return (1 / norm(v)) * v;
  };
  const auto single = [](const Vec3& v) {
    return Float3{static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
  };
  const float h = 0.01f;
  int roomy = 0, tight = 0, retarded = 0;
  for (int turn = 0; turn < 20'000; ++turn) {
    // A blade with its normal along a diagonal every other time, and a floor.
    const double third = 1 / std::sqrt(3.0);
    const auto sign = [&] { return uniform(random, -1, 1) < 0 ? -third : third; };
    const Vec3 towards = turn % 2 == 0 ? Vec3{sign(), sign(), sign()} : direction();
    Vec3 along = cross(towards, direction());
    along = (1 / norm(along)) * along;
    MoveF move = {};
    move.down = 1;
    move.to.edge = single(Vec3{0.03, 0.03, 0.03});
    move.to.along = single(along);
    move.to.normal = single(towards);
    move.to.back = single(cross(towards, along));
    const WallF floor = {2, 1, -0.02f, 0.0f};
    Contacts contacts = {};
    contacts.walls = &floor;
    contacts.wall_count = turn % 3 == 0 ? 1 : 0;
    contacts.move = &move;
    contacts.half_length = 0.05f;
    contacts.depth = 0.05f;
    contacts.clearance = 0.3f * h;
    contacts.frictionless = true;
    const Float3 node = {std::floor(static_cast<float>(uniform(random, 0, 8))),
                         std::floor(static_cast<float>(uniform(random, 0, 8))),
                         std::floor(static_cast<float>(uniform(random, 0, 8)))};
    Ball ball = {
        {h, node}, single(uniform(random, 0, 0.3) * h * direction()), static_cast<float>(uniform(random, 0, 2) * h)};
    const int side = turn % 5 == 0 ? 0 : uniform(random, -1, 1) < 0 ? -1 : 1;
    // With retardation the ball is of what lies ahead, and what touches is between there and where it began.
    Pace pace = {};
    pace.dt_fraction = turn % 4 == 1 ? static_cast<float>(uniform(random, 0.02, 0.9)) : 1.0f;
    const Ball began = {
        {h, node}, single(uniform(random, 0, 0.3) * h * direction()), static_cast<float>(uniform(random, 0, 2) * h)};
    const float room = step_detail::room_of_prediction<true>(pace, contacts, began, ball, side);
    if (!(room > 0)) continue;
    ++roomy;
    if (pace.dt_fraction < 1) ++retarded;
    // Whether some point of the ball is projected or touches when all of it is moved, the foremost among them.
    const auto meets = [&](const Vec3& moved, const Vec3& way) {
      for (const Vec3& from_middle : {way, direction(), direction()}) {
        const Float3 ahead = ball.d + single(moved + double{ball.radius} * from_middle);
        const Float3 d =
            step_detail::x_between<true>(pace, began.d + single(double{began.radius} * from_middle), ahead);
        for (const float own : {-1.0f, 1.0f}) {
          if (side != 0 && own != static_cast<float>(side)) continue;
          bool in_turn = false;
          if (!contacts_detail::same(project(contacts, ball.rest, d, own, ball.d, in_turn), d)) return true;
          if (contacts_detail::touches(contacts, ball.rest, d, own)) return true;
        }
      }
      return false;
    };
    for (const Vec3& way : {towards, -1.0 * towards, direction(), Vec3{0, 0, -1}}) {
      // As long as it may be along its longest axis.
      const double longest = std::max({std::abs(way[0]), std::abs(way[1]), std::abs(way[2])});
      const Vec3 most = step_detail::kPartOfRoom * double{room} / longest * way;
      EXPECT_FALSE(meets(most, way)) << "turn " << turn << ", room " << room;
      tight += meets(1.05 * std::sqrt(3.0) * most, way);
    }
  }
  EXPECT_GT(roomy, 5'000);
  EXPECT_GT(retarded, 1'000);
  EXPECT_GT(tight, 500) << "there is much more room than what is said of it";
}

// No particle of a group goes farther along an axis than its map's way along it.
TEST(Groups, GoNoFartherThanTheirWay) {
  Random random(29);
  const auto number = [&] { return static_cast<float>(normal(random)); };
  for (int turn = 0; turn < 2'000; ++turn) {
    const step_detail::Map map = {{{number(), number(), number(), number()},
                                   {number(), number(), number(), number()},
                                   {number(), number(), number(), number()}}};
    const float radius = static_cast<float>(uniform(random, 0.5, 4));
    for (int axis = 0; axis < 3; ++axis) {
      Float3 r;
      const double sign = uniform(random, -1, 1) < 0 ? -1 : 1;
      (axis == 0 ? r.x : axis == 1 ? r.y : r.z) = static_cast<float>(sign * radius);
      const Float3 moved = map(r);
      for (int k = 0; k < 3; ++k) {
        // Four terms each, which are rounded fewer than eight times.
        EXPECT_LE(std::abs(moved[k]), (1 + 16 * 0x1p-24) * step_detail::way_along(map.row[k], radius)) << "axis " << k;
      }
    }
  }
}

// The same body once with groups and once without any: what carries particles together must give what carries each
// alone, within a few roundings, with blade, floor, friction and a grip that holds, for every way to iterate.
TEST(Groups, GiveWhatTheirParticlesAloneGive) {
  Random random(17);
  int carried = 0, resolved = 0, held = 0;
  double worst = 0;
  for (int trial = 0; trial < 120; ++trial) {
    SCOPED_TRACE(trial);
    cutproof::Setup setup = block_on_floor(trial % 3 == 0 ? 0.0 : uniform(random, 0, 0.03));
    setup.body = fixtures::block(7 + trial % 5, 9, 8, 0.01);
    setup.step.iterations = trial % 7;
    setup.step.substeps = 1 + trial % 3;
    setup.step.solver = trial % 4 == 3 ? Solver::published : Solver::implicit;
    setup.step.acceleration = trial % 4 == 1 ? Acceleration::chebyshev : Acceleration::none;
    setup.step.damping = trial % 2;
    if (trial >= 60 && setup.step.solver == Solver::implicit) {
      setup.step.retardation = std::array{0.1, 1.0, 10.0}[at(trial % 3)] * setup.substep_length.front();
    }
    if (trial % 5 != 0) {
      setup.has_blade = true;
      setup.blade = {0.06, 0.05, 0.004, trial % 2 == 0 ? 0.2 : 0.0};
      BladePose pose = {{0.04, 0.05, 0.06}, {1, 0, 0}, {0, 0, 1}};
      for (int s = 0; s < setup.step.substeps; ++s) {
        BladePose next = pose;
        next.edge += Vec3{0, 0.0003, -0.002};
        setup.blade_moves.push_back({pose, next, true, 0});
        pose = next;
      }
    }
    State state = cooked(setup);
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      const Vec3 arm = state.x[i] - Vec3{0.05, 0.05, 0.05};
      state.v[i] = Vec3{0.2, 0.1, -0.3} + cross(Vec3{2, 3, 1}, arm) + 0.05 * Vec3{normal(random), normal(random), 0};
    }
    if (trial / 4 % 2 == 1) {
      Grip grip = idle_grip(setup, [&](int32_t i) { return setup.body.rest_position(i).x < 0.035; });
      for (int s = trial % 2; s < setup.step.substeps; ++s) {
        grip.active[at(s)] = true;
        grip.displacement[at(s)] = {0.0004, 0, 0.0002 * s};
        ++held;
      }
      setup.grips.push_back(std::move(grip));
    }
    const Stepped together = step(setup, state);
    for (const int touched : together.touched) (touched != 0 ? resolved : carried)++;
    const Stepped apart = step(without_groups(setup), state);
    ASSERT_EQ(apart.staging.counters.front().groups, 0);
    ASSERT_GT(together.staging.counters.front().groups, 10);
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      worst = std::max(worst, norm(together.state.x[i] - apart.state.x[i]) / 0.01);
    }
    // Roundings of displacements of some 0.2 h, a few for each iteration.
    EXPECT_LE(worst, 2e-6);
    EXPECT_LE(norm(together.state.impulse - apart.state.impulse), 1e-4 * (norm(apart.state.impulse) + 1e-6));
  }
  std::printf("greatest difference: %.1e h; %d groups carried, %d resolved\n", worst, carried, resolved);
  EXPECT_GT(carried, 300);
  EXPECT_GT(resolved, 500);
  EXPECT_GT(held, 20);
}

// Two layers between a floor and a ceiling that are nearer than they are: nothing is carried, everything is pushed.
TEST(Groups, AreAllResolvedWhereEverythingTouches) {
  for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
    cutproof::Setup setup = block_on_floor(0);
    setup.body = fixtures::block(31, 31, 2, 0.01);
    setup.walls = {{2, +1, 0.0101, 0.3}, {2, -1, 0.0199, 0.3}};
    setup.step.acceleration = acceleration;
    State state = cooked(setup);
    for (Vec3& v : state.v) v = {0.1, -0.05, 0};
    const Stepped found = step(setup, state);
    ASSERT_GT(found.touched.size(), 20U);
    for (const int touched : found.touched) EXPECT_EQ(touched, 1);
    const Stepped apart = step(without_groups(setup), state);
    State reference = state;
    cutproof::reference::step(setup, reference);
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      EXPECT_LE(norm(found.state.x[i] - apart.state.x[i]), 2e-6 * 0.01);
      EXPECT_LE(norm(found.state.x[i] - reference.x[i]), 1e-4 * 0.01);
    }
    EXPECT_GT(norm(reference.impulse), 0);
  }
}

}  // namespace
}  // namespace cutproof::gpu::groups_kernel_test
