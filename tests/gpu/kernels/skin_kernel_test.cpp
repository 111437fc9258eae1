// The kernels' skin (gpu/kernels/skin.cuh): its case table by properties of its own, whole skins against the reference.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <map>
#include <random>
#include <set>

#include "gpu/host/host_launcher.h"
#include "gpu/kernels/skin.cuh"
#include "gpu/state/staging.h"
#include "model/at.h"
#include "reference_cpu/reference.h"
#include "tests/reference_cpu/random_covers.h"

namespace cutproof::gpu::skin_kernel_test {
namespace {

using namespace cutproof::tests;

// ---- The case table, without the reference

using Segment = std::pair<int, int>;  // cell edges, in the direction of a triangle

Vec3 corner_position(int corner) {
  return {static_cast<double>(corner & 1), static_cast<double>(corner >> 1 & 1), static_cast<double>(corner >> 2)};
}
int upper(int edge) { return skin_table().low[edge] + (1 << skin_table().axis[edge]); }
Vec3 middle(int edge) { return 0.5 * (corner_position(skin_table().low[edge]) + corner_position(upper(edge))); }
bool on_face(int edge, int axis, int side) {
  const int low = skin_table().low[edge];
  return (low >> axis & 1) == side && (upper(edge) >> axis & 1) == side;
}
bool on_any_face(Segment s) {
  for (int face = 0; face < 6; ++face) {
    if (on_face(s.first, face / 2, face % 2) && on_face(s.second, face / 2, face % 2)) return true;
  }
  return false;
}

std::vector<Segment> triangle_sides(int inside) {
  std::vector<Segment> sides;
  const signed char* corners = skin_table().corners[inside];
  for (int t = 0; t < kMostSkinTriangles && corners[3 * t] >= 0; ++t) {
    for (int k = 0; k < 3; ++k) sides.emplace_back(corners[3 * t + k], corners[3 * t + (k + 1) % 3]);
  }
  return sides;
}

// Its sides on a face, as midpoints within the face, times 2.
using FaceContour = std::set<std::array<int, 4>>;
FaceContour contour_on_face(int inside, int axis, int side, bool reversed) {
  FaceContour contour;
  for (Segment s : triangle_sides(inside)) {
    if (!on_face(s.first, axis, side) || !on_face(s.second, axis, side)) continue;
    if (reversed) std::swap(s.first, s.second);
    const Vec3 a = 2 * middle(s.first), b = 2 * middle(s.second);
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    contour.insert({static_cast<int>(a[u]), static_cast<int>(a[v]), static_cast<int>(b[u]), static_cast<int>(b[v])});
  }
  return contour;
}

TEST(GpuSkinTable, ClosesEveryPolygonInsideTheCellAndKeepsItsDiagonalsOffTheFaces) {
  for (int inside = 0; inside < 256; ++inside) {
    std::multiset<Segment> sides;
    for (const Segment& s : triangle_sides(inside)) sides.insert(s);
    std::map<int, int> left, entered;  // along the contour, by cell edge
    for (const Segment& s : sides) {
      ASSERT_EQ(sides.count(s), 1u) << "case " << inside;
      if (on_any_face(s)) {
        EXPECT_EQ(sides.count({s.second, s.first}), 0u) << "case " << inside;
        ++left[s.first];
        ++entered[s.second];
      } else {
        EXPECT_EQ(sides.count({s.second, s.first}), 1u) << "case " << inside;
      }
    }
    for (int e = 0; e < 12; ++e) {
      const bool crossed = (inside >> skin_table().low[e] & 1) != (inside >> upper(e) & 1);
      EXPECT_EQ(left[e], crossed ? 1 : 0) << "case " << inside << ", edge " << e;
      EXPECT_EQ(entered[e], crossed ? 1 : 0) << "case " << inside << ", edge " << e;
    }
  }
}

TEST(GpuSkinTable, MeetsTheCellBeyondEveryFaceInTheSameContour) {
  for (int axis = 0; axis < 3; ++axis) {
    // By the inside corners of a face, as bits in the order of corners: the contour as its lower cell draws it.
    std::map<int, FaceContour> expected;
    const auto pattern = [&](int inside, int side) {
      int bits = 0, count = 0;
      for (int c = 0; c < 8; ++c) {
        if ((c >> axis & 1) == side) bits |= (inside >> c & 1) << count++;
      }
      return bits;
    };
    for (int inside = 0; inside < 256; ++inside) {
      const FaceContour contour = contour_on_face(inside, axis, 1, false);
      const auto [found, is_new] = expected.emplace(pattern(inside, 1), contour);
      EXPECT_EQ(found->second, contour) << "case " << inside;
    }
    for (int inside = 0; inside < 256; ++inside) {
      EXPECT_EQ(expected.at(pattern(inside, 0)), contour_on_face(inside, axis, 0, true)) << "case " << inside;
    }
  }
}

TEST(GpuSkinTable, FacesOutward) {
  for (int inside = 0; inside < 256; ++inside) {
    for (const Segment& s : triangle_sides(inside)) {
      for (int axis = 0; axis < 3; ++axis) {
        for (int side = 0; side < 2; ++side) {
          if (!on_face(s.first, axis, side) || !on_face(s.second, axis, side)) continue;
          // The triangle lies on the left of its side and inside the cell, so its normal is s × (-n) up to a tilt, and
          // must point away from the tissue at the end of the crossed edge.
          Vec3 normal;
          normal[axis] = side ? 1 : -1;
          const bool low_inside = inside >> skin_table().low[s.first] & 1;
          const Vec3 tissue = corner_position(low_inside ? skin_table().low[s.first] : upper(s.first));
          EXPECT_GT(dot(cross(middle(s.second) - middle(s.first), normal), tissue - middle(s.first)), 0)
              << "case " << inside;
        }
      }
    }
  }
}

TEST(GpuSkinTable, SeparatesTheInsideCornersOfAnAmbiguousFace) {
  int diagonals = 0;
  for (int inside = 0; inside < 256; ++inside) {
    for (const Segment& s : triangle_sides(inside)) {
      if (!on_any_face(s)) continue;
      const auto owner = [&](int edge) {
        return inside >> skin_table().low[edge] & 1 ? static_cast<int>(skin_table().low[edge]) : upper(edge);
      };
      // The owners of both ends are the same, or neighbours, or joined by a third inside corner of the face.
      const int a = owner(s.first), b = owner(s.second);
      bool joined = false;
      for (int c = 0; c < 8; ++c) {
        const bool between = ((c ^ a) & (c ^ b)) == 0 && ((c ^ a) | (c ^ b)) == (a ^ b) && c != a && c != b;
        joined = joined || (between && (inside >> c & 1));
      }
      const int apart = a ^ b;
      const bool diagonal = apart == 3 || apart == 5 || apart == 6;
      EXPECT_TRUE(apart == 0 || apart == 1 || apart == 2 || apart == 4 || (diagonal && joined)) << "case " << inside;
      diagonals += diagonal;
    }
  }
  EXPECT_GT(diagonals, 0);
}

// ---- Skins of loads

using Setups = std::vector<Setup>;  // in a test, Setup alone is a member of testing::Test

struct Mode {
  const char* name;
  HostLauncher (*make)(uint32_t seed);
};
const Mode kModes[] = {
    {"one thread", [](uint32_t) { return HostLauncher(HostLauncher::Threads{1}); }},
    {"three threads", [](uint32_t) { return HostLauncher(HostLauncher::Threads{3}); }},
    {"simulated, random",
     [](uint32_t seed) { return HostLauncher(HostLauncher::Simulated{.schedule = random_walk(seed)}); }},
    {"simulated, reverse",
     [](uint32_t) { return HostLauncher(HostLauncher::Simulated{.schedule = reverse(), .live_blocks = 3}); }},
};

// Bodies under way: what the kernels see, and the setups.
struct Bodies {
  std::vector<Setup> setups;
  StagingBuffers staging;
  Plan plan;
};

Bodies make_bodies(std::vector<Setup> setups, const std::vector<State>& states) {
  Bodies bodies;
  bodies.staging = make_staging_buffers(setups, states, Capacity{});
  bodies.plan = make_plan(setups, states);
  bodies.setups = std::move(setups);
  return bodies;
}

void run_skin(HostLauncher& launcher, Bodies& bodies, const DeviceView& w) {
  w.counters->changing = 0;
  for (int b = 0; b < w.bodies; ++b) {
    if (running(w, b) && w.body[b].skin_wanted && (w.cut[b] >= 0 || !w.skin_made[b])) w.counters->changing = 1;
  }
  launcher.if_nonzero(&w.counters->changing, [&](HostLauncher& inner) {
    enqueue_skin_cells(inner, w, bodies.plan);
    enqueue_skin_clusters(inner, w, bodies.plan);
  });
  enqueue_skin_positions(launcher, w, false);
}
void run_skin(HostLauncher& launcher, Bodies& bodies) { run_skin(launcher, bodies, bodies.staging.view()); }

// The end of a frame, and what the next step begins with.
void next_frame(Bodies& bodies) {
  const DeviceView w = bodies.staging.view();
  for (int b = 0; b < w.bodies; ++b) {
    if (!running(w, b)) continue;
    ++w.frame[b];
    w.cut[b] = -1;
  }
}

// What detection, debris removal and split leave of clusters that stay in one piece: a dead particle lies in none.
void remove_now(Bodies& bodies, int b, const std::vector<int32_t>& particles, const std::vector<int32_t>& debris) {
  StagingBuffers& staging = bodies.staging;
  const DeviceView w = staging.view();
  const BodyConstants& body = w.body[b];
  w.cut[b] = 2 * w.frame[b] + 2;
  for (const int32_t i : particles) w.death[body.particle_begin + i] = w.cut[b];
  for (const int32_t i : debris) w.death[body.particle_begin + i] = w.cut[b] + 1;
  for (int p = body.particle_begin; p < body.particle_end; ++p) {
    if (alive(w, p)) continue;
    w.membership_count[p] = 0;
    for (int k = w.membership_begin[p]; k < w.membership_begin[p + 1]; ++k) w.memberships[k] = -1;
  }
  for (int s = 0; s < w.counters->slots_used; ++s) {
    if (w.slot_body[s] != b) continue;
    int* const members = w.members + w.slot_begin[s];
    w.slot_size[s] = static_cast<int>(
        std::remove_if(members, members + w.slot_size[s], [&](int p) { return !alive(w, p); }) - members);
    double mass = 0;
    Vec3 moment;
    for (int k = 0; k < w.slot_size[s]; ++k) {
      const double weight = w.displacement[members[k]].w / static_cast<double>(w.membership_count[members[k]]);
      const Coordinates c = coordinates(body, w.node[members[k]]);
      mass += weight;
      moment += weight * Vec3{static_cast<double>(c.i), static_cast<double>(c.j), static_cast<double>(c.k)};
    }
    if (w.slot_size[s] == 0) continue;
    const Vec3 center = moment / mass;
    w.mass[s] = static_cast<float>(mass);
    w.rest_offset[s] = {static_cast<float>(center.x - w.rest_base[3 * s]),
                        static_cast<float>(center.y - w.rest_base[3 * s + 1]),
                        static_cast<float>(center.z - w.rest_base[3 * s + 2])};
  }
}

// Any places and rotations: the skin must follow whatever the step has made.
void shake(Bodies& bodies, std::mt19937& random) {
  std::uniform_real_distribution<float> uniform(-1, 1);
  const DeviceView w = bodies.staging.view();
  for (int p = 0; p < w.particles; ++p) {
    const float reach = 2 * w.body[w.body_of[p]].h;
    Float4& d = w.displacement[p];
    d = {reach * uniform(random), reach * uniform(random), reach * uniform(random), d.w};
  }
  for (int s = 0; s < w.counters->slots_used; ++s) {
    double q[4] = {uniform(random), uniform(random), uniform(random), uniform(random)};
    const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) + 1e-9;
    for (double& part : q) part /= size;
    const double a = q[0], x = q[1], y = q[2], z = q[3];
    const double entries[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - a * z),     2 * (x * z + a * y),
                               2 * (x * y + a * z),     1 - 2 * (x * x + z * z), 2 * (y * z - a * x),
                               2 * (x * z - a * y),     2 * (y * z + a * x),     1 - 2 * (x * x + y * y)};
    for (int k = 0; k < 9; ++k) w.rotation[s].m[k] = static_cast<float>(entries[k]);
  }
}

std::multiset<std::array<int32_t, 3>> turned_to_lowest(const Skin& skin) {
  std::multiset<std::array<int32_t, 3>> triangles;
  for (std::array<int32_t, 3> t : skin.triangles) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    triangles.insert(t);
  }
  return triangles;
}

// Every body's skin against the reference's, made from scratch of the very state that the kernels have reached.
void expect_reference_skins(const Bodies& bodies, const std::string& where, const std::vector<Skin>& before = {}) {
  const std::vector<State> states = extract_states(bodies.staging, bodies.setups);
  for (std::size_t b = 0; b < states.size(); ++b) {
    const Setup& setup = bodies.setups[b];
    State expected = states[b];
    expected.skin = before.empty() ? Skin{} : before[b];
    reference::skin(setup, expected);
    const Skin& skin = states[b].skin;
    ASSERT_EQ(skin.owner, expected.skin.owner) << where << ", body " << b;
    ASSERT_EQ(skin.direction, expected.skin.direction) << where << ", body " << b;
    ASSERT_EQ(turned_to_lowest(skin), turned_to_lowest(expected.skin)) << where << ", body " << b;
    double worst = 0;
    for (std::size_t v = 0; v < skin.owner.size(); ++v) {
      // 16 times what heights over the blade are off by: some roundings of places within 10 h.
      ASSERT_NEAR(skin.reach[v], expected.skin.reach[v], 1e-5) << where << ", body " << b << ", vertex " << v;
      worst = std::max(worst, norm(skin.position[v] - expected.skin.position[v]) / setup.body.grid.spacing);
    }
    ASSERT_LE(worst, 1e-5) << where << ", body " << b;
  }
}

std::vector<int32_t> draw_alive(std::mt19937& random, const Bodies& bodies, int b, double chance) {
  std::vector<int32_t> drawn;
  const BodyConstants& body = bodies.staging.body[at(b)];
  for (int p = body.particle_begin; p < body.particle_end; ++p) {
    if (bodies.staging.death[at(p)] < 0 && static_cast<double>(random()) < chance * 4294967296.0) {
      drawn.push_back(p - body.particle_begin);
    }
  }
  return drawn;
}

// A few bodies of random shape, spacing, masses and clusters; one of them empty.
Bodies random_bodies(std::mt19937& random, int count, int64_t frames) {
  std::vector<Setup> setups;
  std::vector<State> states;
  for (int b = 0; b < count; ++b) {
    const double chance = std::array{0.0, 0.35, 0.6, 0.9, 1.0}[b == 1 ? 0 : random() % 5];
    Body body = random_body(random, {draw(random, 1, 8), draw(random, 1, 7), draw(random, 1, 6)}, chance);
    body.grid.spacing = std::array{1.0, 0.0013, 7.0}[random() % 3];
    for (double& mass : body.mass) mass = 0.1 * draw(random, 1, 30);
    const Lists lists = random_cover(random, body, 12);
    states.push_back(state_of(body, lists));
    Setup setup = setup_of(std::move(body), frames);
    setup.skin.alpha = 0.1 * draw(random, 1, 9);
    if (random() % 2 == 0) {
      setup.skin.fit_cuts = setup.has_blade = true;
      setup.blade = {1, 1, 0, 0};
      const double h = setup.body.grid.spacing;
      for (int64_t s = 0; s < setup.frame_count() * setup.step.substeps; ++s) {
        const double turn = 0.1 * draw(random, 0, 62);
        const BladePose pose = {{h * draw(random, 0, 8), h * draw(random, 0, 7), h * draw(random, 0, 6)},
                                {std::cos(turn), std::sin(turn), 0},
                                {0, 0, 1}};
        const BladePose before = {pose.edge - Vec3{0.3 * h, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        setup.blade_moves.push_back({before, pose, random() % 4 != 0, 0});
      }
    }
    if (random() % 2 == 0) {  // beside bodies of which nothing is known
      setup.body.surface_crossing.resize(6 * at(setup.body.particle_count()));
      for (uint8_t& crossing : setup.body.surface_crossing) {
        crossing = static_cast<uint8_t>(random() % 4 == 0 ? 0 : draw(random, kLeastCrossing, kGreatestCrossing));
      }
      for (std::size_t k = 0; k < setup.body.surface_crossing.size(); ++k) {
        if (setup.body.neighbour(static_cast<int32_t>(k / 6), static_cast<int>(k % 6)) >= 0) {
          setup.body.surface_crossing[k] = 0;
        }
      }
    }
    setups.push_back(std::move(setup));
  }
  return make_bodies(std::move(setups), states);
}

template <class T>
void expect_same_bytes(const Elements<T>& a, const Elements<T>& b, const std::string& where) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_TRUE(a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0) << where;
}

TEST(GpuSkin, AfterAnyRemovalsIsTheSkinFromScratchWhateverTheSchedule) {
  constexpr int kFrames = 6;
  for (uint32_t seed = 1; seed <= 12; ++seed) {
    std::vector<Bodies> all;
    for (const Mode& mode : kModes) {
      std::mt19937 random(seed);
      Bodies bodies = random_bodies(random, draw(random, 1, 4), kFrames);
      HostLauncher launcher = mode.make(seed);
      std::vector<Skin> before;
      for (int frame = 0; frame < kFrames; ++frame) {
        const std::string where =
            std::string(mode.name) + ", seed " + std::to_string(seed) + ", frame " + std::to_string(frame);
        for (int b = 0; b < static_cast<int>(bodies.setups.size()); ++b) {
          if (random() % 3 == 0) continue;
          const double chance = std::array{0.02, 0.1, 0.4}[random() % 3];
          const std::vector<int32_t> removed = draw_alive(random, bodies, b, chance);
          if (removed.empty()) continue;
          remove_now(bodies, b, removed, {});
          remove_now(bodies, b, {}, draw_alive(random, bodies, b, 0.03));
        }
        shake(bodies, random);
        run_skin(launcher, bodies);
        ASSERT_EQ(bodies.staging.counters[0].fault, 0);
        expect_reference_skins(bodies, where, before);
        if (HasFatalFailure()) return;
        before.clear();
        for (State& state : extract_states(bodies.staging, bodies.setups)) before.push_back(std::move(state.skin));
        next_frame(bodies);
      }
      all.push_back(std::move(bodies));
    }
    for (std::size_t k = 1; k < all.size(); ++k) {
      const std::string where = std::string(kModes[k].name) + ", seed " + std::to_string(seed);
      expect_same_bytes(all[k].staging.vertex_owner, all[0].staging.vertex_owner, where);
      expect_same_bytes(all[k].staging.vertex_reach, all[0].staging.vertex_reach, where);
      expect_same_bytes(all[k].staging.vertex_position, all[0].staging.vertex_position, where);
      expect_same_bytes(all[k].staging.cell_node, all[0].staging.cell_node, where);
      expect_same_bytes(all[k].staging.cell_triangles, all[0].staging.cell_triangles, where);
    }
  }
}

TEST(GpuSkin, KeepsAcrossALoadWhereEarlierCutsLeftItsVertices) {
  constexpr int kFrames = 4;
  int kept = 0;  // vertices that no load could make anew
  for (uint32_t seed = 1; seed <= 12; ++seed) {
    std::mt19937 random(seed);
    Bodies bodies = random_bodies(random, draw(random, 1, 4), kFrames);
    HostLauncher launcher;
    for (int frame = 0; frame + 1 < kFrames; ++frame) {
      for (int b = 0; b < static_cast<int>(bodies.setups.size()); ++b) {
        const std::vector<int32_t> removed = draw_alive(random, bodies, b, 0.1);
        if (!removed.empty()) remove_now(bodies, b, removed, {});
      }
      shake(bodies, random);
      run_skin(launcher, bodies);
      next_frame(bodies);
      const std::vector<State> states = extract_states(bodies.staging, bodies.setups);
      Bodies loaded = make_bodies(bodies.setups, states);
      run_skin(launcher, loaded);
      const std::vector<State> again = extract_states(loaded.staging, loaded.setups);
      for (std::size_t b = 0; b < states.size(); ++b) {
        ASSERT_EQ(again[b].skin.owner, states[b].skin.owner) << "seed " << seed << ", frame " << frame;
        ASSERT_EQ(again[b].skin.reach, states[b].skin.reach) << "seed " << seed << ", frame " << frame;
        const std::vector<double> uncut = uncut_reaches(bodies.setups[b], states[b].skin);
        for (std::size_t v = 0; v < uncut.size(); ++v) kept += std::abs(states[b].skin.reach[v] - uncut[v]) > 0.01;
      }
    }
  }
  EXPECT_GT(kept, 100);
}

TEST(GpuSkin, ExtractsOnlyTheCellsAroundADeadParticleAndNothingWithoutACut) {
  Body body = block_body(6, 6, 6);
  State state = state_of(body, box_clusters(6, 6, 6, 3));
  Bodies bodies = make_bodies({setup_of(std::move(body), 4)}, {state});
  HostLauncher launcher;
  run_skin(launcher, bodies);
  Counters& counters = bodies.staging.counters[0];
  EXPECT_EQ(counters.vertices_used, 6 * 36);
  EXPECT_EQ(counters.cells_used, 7 * 7 * 7 - 5 * 5 * 5);
  next_frame(bodies);
  counters.skin_changes = -7;
  run_skin(launcher, bodies);
  EXPECT_EQ(counters.skin_changes, -7) << "cells were looked for in a frame without a cut";
  next_frame(bodies);
  // A cavity of one node in the middle: its eight cells, and a vertex on each of its six edges.
  remove_now(bodies, 0, {2 + 6 * (2 + 6 * 2)}, {});
  run_skin(launcher, bodies);
  EXPECT_EQ(counters.skin_changes, 1);
  EXPECT_EQ(counters.vertices_used, 6 * 36 + 6);
  EXPECT_EQ(counters.cells_used, 7 * 7 * 7 - 5 * 5 * 5 + 8);
  expect_reference_skins(bodies, "cavity");
}

TEST(GpuSkin, OfASingleParticleIsAnOctahedronThatFacesOutward) {
  Body body = body_of({{0, 0, 0}}, 0.5);
  State state = state_of(body, {{0}});
  cutproof::Setup setup = setup_of(std::move(body));
  setup.skin.alpha = 0.3;
  Bodies bodies = make_bodies({setup}, {state});
  HostLauncher launcher;
  run_skin(launcher, bodies);
  const Skin skin = extract_states(bodies.staging, bodies.setups)[0].skin;
  ASSERT_EQ(skin.owner.size(), 6u);
  ASSERT_EQ(skin.triangles.size(), 8u);
  double volume = 0;
  for (const auto& [a, b, c] : skin.triangles) {
    volume += dot(skin.position[at(a)], cross(skin.position[at(b)], skin.position[at(c)])) / 6;
  }
  const double whole = 4.0 / 3 * 0.15 * 0.15 * 0.15;
  EXPECT_NEAR(volume, whole, 3 * 0x1p-24 * whole) << "alpha is kept in single precision";
}

TEST(GpuSkin, OfABodyThatIsCutAwayIsEmpty) {
  std::vector<State> states;
  Setups setups;
  for (int b = 0; b < 2; ++b) {
    Body body = block_body(3, 4, 2);
    states.push_back(state_of(body, box_clusters(3, 4, 2, 2)));
    setups.push_back(setup_of(std::move(body), 3));
  }
  Bodies bodies = make_bodies(setups, states);
  HostLauncher launcher;
  run_skin(launcher, bodies);
  next_frame(bodies);
  remove_now(bodies, 0, range(0, 24), {});
  run_skin(launcher, bodies);
  const std::vector<State> cut = extract_states(bodies.staging, bodies.setups);
  EXPECT_TRUE(cut[0].skin.owner.empty());
  EXPECT_TRUE(cut[0].skin.triangles.empty());
  EXPECT_FALSE(cut[1].skin.triangles.empty());
  expect_reference_skins(bodies, "one of two cut away");
  next_frame(bodies);
  run_skin(launcher, bodies);
  expect_reference_skins(bodies, "the frame after");
}

TEST(GpuSkin, OfABodyCutInItsVeryFirstFrameHasNoTraceOfTheDead) {
  Body body = block_body(4, 3, 3);
  State state = state_of(body, box_clusters(4, 3, 3, 2));
  Bodies bodies = make_bodies({setup_of(std::move(body))}, {state});
  remove_now(bodies, 0, {13, 14, 15}, {35});
  HostLauncher launcher;
  run_skin(launcher, bodies);
  expect_reference_skins(bodies, "first frame");
}

TEST(GpuSkin, IsLeftAloneWhereNoneIsWantedOrTheScheduleHasEnded) {
  std::vector<State> states;
  Setups setups;
  for (int b = 0; b < 3; ++b) {
    Body body = block_body(3, 3, 3);
    states.push_back(state_of(body, box_clusters(3, 3, 3, 2)));
    setups.push_back(setup_of(std::move(body), b == 1 ? 0 : 2));
    states.back().skin.owner = {b};  // something to recognise it by
    states.back().skin.direction = {1};
    states.back().skin.reach = {0.25};
    states.back().skin.position = {{1, 2, 3}};
  }
  setups[0].skin.wanted = false;
  Bodies bodies = make_bodies(setups, states);
  HostLauncher launcher;
  run_skin(launcher, bodies);
  const std::vector<State> after = extract_states(bodies.staging, bodies.setups);
  EXPECT_EQ(after[0].skin, states[0].skin);
  EXPECT_EQ(after[1].skin, states[1].skin);
  EXPECT_NE(after[2].skin, states[2].skin);
  EXPECT_EQ(bodies.staging.counters[0].vertices_used, 6 * 9) << "vertices of one body alone";
}

TEST(GpuSkin, FollowsATranslationExactlyAndAnOwnerWithoutAClusterAlone) {
  Body body = block_body(4, 3, 3);
  State state = state_of(body, {range(0, 20), range(10, 35)});  // particle 35 lies in none
  Bodies bodies = make_bodies({setup_of(std::move(body))}, {state});
  const DeviceView w = bodies.staging.view();
  const Float3 moved = {0.37f, -12.1f, 1e-3f}, own = {5, 6, 7};
  for (int p = 0; p < w.particles; ++p) w.displacement[p] = with_w(p == 35 ? own : moved, w.displacement[p].w);
  HostLauncher launcher;
  run_skin(launcher, bodies);
  int alone = 0;
  for (int v = 0; v < w.counters->vertices_used; ++v) {
    const Float3 expected = w.vertex_owner[v] == 35 ? own : moved;
    alone += w.vertex_owner[v] == 35;
    for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(xyz(w.vertex_position[v])[axis], expected[axis]);
  }
  EXPECT_EQ(alone, 3);
}

// A blade may have pushed a particle far from where its clusters are; its vertices go where these say, and no number as
// large as its own displacement may enter them.
TEST(GpuSkin, VerticesAreNoLessExactWhereTheirOwnerIsFarAway) {
  Body body = block_body(6, 6, 6);
  State state = state_of(body, {range(0, 216), range(0, 216), range(0, 216)});
  Bodies bodies = make_bodies({setup_of(std::move(body))}, {state});
  const DeviceView w = bodies.staging.view();
  const Float3 pushed = {4096.3f, -4096.7f, 4096.9f};
  w.displacement[215] = with_w(pushed, w.displacement[215].w);
  HostLauncher launcher;
  run_skin(launcher, bodies);
  int own = 0;
  for (int v = 0; v < w.counters->vertices_used; ++v) {
    if (w.vertex_owner[v] != 215) continue;
    ++own;
    for (int axis = 0; axis < 3; ++axis) {
      // All clusters are the body, and turned by nothing; their members are summed from the first one's place on.
      const double mean = static_cast<double>(pushed[axis]) / 216;
      EXPECT_NEAR(xyz(w.vertex_position[v])[axis], mean, 8 * 0x1p-24 * std::abs(mean));
    }
  }
  EXPECT_EQ(own, 3);
}

// Places of the centres that the step has left must not be taken for the final ones.
TEST(GpuSkin, DoesNotTrustTheCentresOfTheStep) {
  Body body = block_body(3, 3, 3);
  State state = state_of(body, box_clusters(3, 3, 3, 2));
  Bodies bodies = make_bodies({setup_of(std::move(body))}, {state});
  for (Float3& center : bodies.staging.center) center = {100, 200, 300};
  HostLauncher launcher;
  run_skin(launcher, bodies);
  expect_reference_skins(bodies, "centres");
}

TEST(GpuSkin, WritesNothingWhereRoomIsShort) {
  for (const bool first : {true, false}) {
    for (const bool vertices : {true, false}) {
      Body body = block_body(5, 5, 5);
      State state = state_of(body, box_clusters(5, 5, 5, 3));
      Bodies bodies = make_bodies({setup_of(std::move(body), 3)}, {state});
      HostLauncher launcher;
      if (!first) {
        run_skin(launcher, bodies);
        next_frame(bodies);
        remove_now(bodies, 0, {62}, {});  // the middle: 6 vertices, 8 cells
      }
      DeviceView w = bodies.staging.view();
      const int vertices_needed = 6 * 25 + (first ? 0 : 6), cells_needed = 6 * 6 * 6 - 4 * 4 * 4 + (first ? 0 : 8);
      w.vertex_capacity = vertices_needed - (vertices ? 1 : 0);
      w.cell_capacity = cells_needed - (vertices ? 0 : 1);
      const StagingBuffers before = bodies.staging;
      run_skin(launcher, bodies, w);
      EXPECT_EQ(w.counters->fault, vertices ? kVerticesFull : kCellsFull);
      const StagingBuffers& after = bodies.staging;
      const std::string where = first ? "first skin" : "cut";
      expect_same_bytes(after.vertex_of, before.vertex_of, where);
      expect_same_bytes(after.vertex_owner, before.vertex_owner, where);
      expect_same_bytes(after.vertex_direction, before.vertex_direction, where);
      expect_same_bytes(after.cell_of, before.cell_of, where);
      expect_same_bytes(after.cell_node, before.cell_node, where);
      expect_same_bytes(after.cell_triangles, before.cell_triangles, where);
      EXPECT_EQ(after.skin_made, before.skin_made);
      EXPECT_EQ(after.counters[0].vertices_used, before.counters[0].vertices_used);
      EXPECT_EQ(after.counters[0].cells_used, before.counters[0].cells_used);

      // With just enough capacity it goes through.
      w.vertex_capacity = vertices_needed;
      w.cell_capacity = cells_needed;
      w.counters->fault = 0;
      run_skin(launcher, bodies, w);
      EXPECT_EQ(w.counters->fault, 0);
      expect_reference_skins(bodies, where);
    }
  }
}

}  // namespace
}  // namespace cutproof::gpu::skin_kernel_test
