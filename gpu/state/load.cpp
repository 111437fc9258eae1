// From setups and states to staging buffers.
#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "gpu/state/indices.h"
#include "gpu/state/staging.h"
#include "model/backend.h"
#include "model/body.h"

namespace cutproof::gpu {

namespace {

float f(double value) { return static_cast<float>(value); }
Float3 f(Vec3 v) { return {f(v.x), f(v.y), f(v.z)}; }

PoseF pose_of(const BladePose& pose) { return make_pose(f(pose.edge), f(pose.along), f(pose.back)); }

void require(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(std::string("kernels, load: ") + what);
}

void require_fit(const Setup& setup, const State& state) {
  if (!setup.body.on_grid()) throw Refused("the kernels run no body without a grid; the backend reference does");
  const std::size_t n = setup.body.node.size();
  require(setup.body.mass.size() == n && state.x.size() == n && state.v.size() == n && state.alive.size() == n,
          "masses, positions, velocities and alive need one entry per particle");
  const auto substeps = at(setup.frame_count() * setup.step.substeps);
  require(!setup.has_blade || setup.blade_moves.size() == substeps, "one blade move per substep is needed");
  for (const Grip& grip : setup.grips) {
    require(grip.active.size() == substeps && grip.displacement.size() == substeps,
            "one grip displacement per substep is needed");
  }
  const Clusters& c = state.clusters;
  const std::size_t m = at(c.count());
  require(c.number.size() == m && c.rotation.size() == m && c.rest_center.size() == m && c.mass.size() == m &&
              c.degenerate.size() == m,
          "every array of clusters needs one entry per cluster");
  require(c.offsets.front() == 0 && c.offsets.back() == static_cast<int64_t>(c.members.size()),
          "cluster offsets must run from 0 to the number of members");
  for (std::size_t k = 0; k < m; ++k) require(c.offsets[k] < c.offsets[k + 1], "no cluster may be empty");
  for (const int32_t i : c.members) {
    require(i >= 0 && at(i) < n, "cluster members must be particles of the body");
  }
  const Skin& skin = state.skin;
  require(skin.direction.size() == skin.owner.size() && skin.reach.size() == skin.owner.size(),
          "every array of skin vertices needs one entry per vertex");
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    require(skin.owner[v] >= 0 && at(skin.owner[v]) < n && skin.direction[v] < 6,
            "skin vertices must lie on grid edges of the body's particles");
  }
}

void add_constants(StagingBuffers& staging, const Setup& setup, const State& state, int64_t particles, int64_t nodes) {
  BodyConstants body{};
  body.particle_begin = narrow(particles, "particles");
  body.particle_end = narrow(particles + setup.body.particle_count(), "particles");
  body.node_begin = nodes;
  narrow(setup.body.grid.node_count(), "grid nodes of one body");
  for (int axis = 0; axis < 3; ++axis) body.nodes[axis] = setup.body.grid.nodes[at(axis)];
  body.by_row = divider_of(std::max(1, body.nodes[0]));
  body.by_layer = divider_of(std::max(1, body.nodes[0] * body.nodes[1]));
  body.h = f(setup.body.grid.spacing);
  body.solver = setup.step.solver;
  body.acceleration = setup.step.acceleration;
  body.substeps = setup.step.substeps;
  body.iterations = setup.step.iterations;
  body.last_iterations = setup.step.iterations - setup.withheld_iterations;
  body.stiffness = f(setup.step.stiffness);
  body.volume_share = f(setup.step.volume_share);
  body.relaxation = f(setup.step.relaxation);
  body.damping = f(setup.step.damping);
  body.retardation = f(setup.step.retardation);
  body.gravity = f(setup.step.gravity);
  body.criterion = setup.detect.criterion;
  body.remove = setup.detect.remove;
  body.needs_detection = needs_detection(setup);
  body.epsilon = f(setup.detect.epsilon);
  body.strain = f(setup.detect.strain);
  body.debris = setup.split.debris;
  body.merge_rule = setup.merge.rule;
  body.tau = state.tau;
  body.cap = state.cap;
  body.expand_rule = setup.expand.rule;
  body.depth = setup.expand.depth;
  body.skin_wanted = setup.skin.wanted;
  body.alpha = f(setup.skin.alpha);
  body.fit_cuts = setup.skin.fit_cuts;
  body.has_blade = setup.has_blade;
  body.blade_length = f(setup.blade.length);
  body.blade_depth = f(setup.blade.depth);
  body.blade_thickness = f(setup.blade.thickness);
  body.blade_friction = f(setup.blade.friction);
  body.clearance = f(blade_clearance(setup));
  body.frames = narrow(setup.frame_count(), "frames");
  body.schedule = static_cast<int64_t>(staging.moves.size());
  body.frame_begin = static_cast<int64_t>(staging.substep_length.size());

  for (const double dt : setup.substep_length) staging.substep_length.push_back(f(dt));
  const int64_t substeps = setup.frame_count() * setup.step.substeps;
  for (int64_t s = 0; s < substeps; ++s) {
    MoveF move{};
    if (setup.has_blade) {
      const BladeMove& given = setup.blade_moves[at(s)];
      move = {pose_of(given.from), pose_of(given.to), given.down};
    }
    staging.moves.push_back(move);
  }
  if (setup.walls.size() > std::numeric_limits<short>::max()) {  // Pace::wall_count
    throw MachineError("the kernels count the walls of a body with 16 bits, and this one has " +
                       std::to_string(setup.walls.size()));
  }
  body.wall_begin = narrow(static_cast<int64_t>(staging.walls.size()), "walls");
  for (const Wall& wall : setup.walls)
    staging.walls.push_back({wall.axis, wall.side, f(wall.offset), f(wall.friction)});
  body.wall_end = narrow(static_cast<int64_t>(staging.walls.size()), "walls");
  body.grip_begin = narrow(static_cast<int64_t>(staging.grips.size()), "grips");
  for (const Grip& grip : setup.grips) {
    GripF entry{};
    entry.table = static_cast<int64_t>(staging.grip_active.size());
    staging.grip_active.insert(staging.grip_active.end(), grip.active.begin(), grip.active.end());
    for (const Vec3 moved : grip.displacement) staging.grip_displacement.push_back(f(moved));
    staging.grips.push_back(entry);
  }
  body.grip_end = narrow(static_cast<int64_t>(staging.grips.size()), "grips");
  staging.body.push_back(body);
}

// Particles held by the same grips share a hold set.
void add_hold_sets(StagingBuffers& staging, const Setup& setup) {
  const BodyConstants& body = staging.body.back();
  std::map<int32_t, std::vector<int>> grips_of;
  for (std::size_t g = 0; g < setup.grips.size(); ++g) {
    for (const int32_t i : setup.grips[g].particles) grips_of[i].push_back(body.grip_begin + static_cast<int>(g));
  }
  std::map<std::vector<int>, int> sets;
  staging.hold_set.resize(staging.node.size(), 0);
  for (auto& [i, grips] : grips_of) {
    grips.erase(std::unique(grips.begin(), grips.end()), grips.end());
    const auto [found, added] =
        sets.emplace(grips, narrow(static_cast<int64_t>(staging.hold_begin.size()) - 1, "sets of grips"));
    if (added) {
      staging.hold_grips.insert(staging.hold_grips.end(), grips.begin(), grips.end());
      staging.hold_begin.push_back(narrow(static_cast<int64_t>(staging.hold_grips.size()), "sets of grips"));
    }
    staging.hold_set[at(body.particle_begin + i)] = found->second;
  }
}

void add_particles(StagingBuffers& staging, const Setup& setup, const State& state, int body_index) {
  const BodyConstants& body = staging.body.back();
  for (const int32_t p : setup.body.particle_at) {
    staging.particle_at.push_back(p < 0 ? -1 : body.particle_begin + p);
  }
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    const Vec3 moved = state.x[at(i)] - setup.body.rest_position(i);
    staging.body_of.push_back(body_index);
    staging.node.push_back(static_cast<int>(setup.body.node[at(i)]));
    staging.death.push_back(state.alive[at(i)] ? -1 : kDeadBefore);
    staging.displacement.push_back(with_w(f(moved), f(setup.body.mass[at(i)])));
    staging.velocity.push_back(with_w(f(state.v[at(i)]), 0));
    // The state has one impulse for the body. Distributed by mass it has the same sum.
    staging.impulse.push_back({});
  }
  double mass = 0;
  for (const double m : setup.body.mass) mass += m;
  if (mass > 0 && !(state.impulse == Vec3{})) {
    for (int p = body.particle_begin; p < body.particle_end; ++p)
      staging.impulse[at(p)] = with_w(f(state.impulse / mass), 0);
  }
  add_hold_sets(staging, setup);
  const int code = narrow(2 * state.frame, "frames");
  const auto mark = [&](const std::vector<int32_t>& particles, int value) {
    for (const int32_t i : particles) {
      require(i >= 0 && i < setup.body.particle_count() && !state.alive[at(i)],
              "removed and debris must list dead particles of the body");
      staging.death[at(body.particle_begin + i)] = value;
    }
  };
  mark(state.removed, code);
  mark(state.debris, code + 1);
  staging.frame.push_back(narrow(state.frame, "frames"));
  staging.cut.push_back(state.removed.empty() ? -1 : code);
  staging.edge_covered.push_back(state.edge_covered);
  staging.skin_made.push_back(0);
  staging.loaded_skin.push_back(state.skin);
}

// The first skin is made anew. Only the loaded skin knows the places of vertices that cuts have made, so they are kept.
void add_kept_reaches(StagingBuffers& staging, const Setup& setup, const Skin& skin) {
  const BodyConstants& body = staging.body.back();
  std::vector<std::pair<int, float>> kept;
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t owner = skin.owner[v];
    const int direction = skin.direction[v];
    if (setup.body.neighbour(owner, direction) < 0) continue;
    kept.emplace_back(narrow(6 * (int64_t{body.particle_begin} + owner) + direction, "particles"), f(skin.reach[v]));
  }
  std::sort(kept.begin(), kept.end());
  for (const auto& [edge, reach] : kept) {
    staging.kept_edge.push_back(edge);
    staging.kept_reach.push_back(reach);
  }
}

void add_clusters(StagingBuffers& staging, const Setup& setup, const State& state, int body_index) {
  const BodyConstants& body = staging.body.back();
  const Clusters& clusters = state.clusters;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    staging.slot_begin.push_back(narrow(static_cast<int64_t>(staging.members.size()), "cluster members"));
    staging.slot_size.push_back(narrow(clusters.size(c), "members of one cluster"));
    staging.slot_number.push_back(clusters.number[at(c)]);
    staging.slot_body.push_back(body_index);
    Matrix3 r;
    for (int k = 0; k < 9; ++k) r.m[k] = f(clusters.rotation[at(c)].m[at(k)]);
    staging.rotation.push_back(r);
    staging.degenerate.push_back(clusters.degenerate[at(c)]);
    staging.mass.push_back(f(clusters.mass[at(c)]));
    const auto base = setup.body.grid.coordinates(setup.body.node[at(clusters.of(c).front())]);
    Vec3 offset;
    for (int axis = 0; axis < 3; ++axis) {
      staging.rest_base.push_back(base[at(axis)]);
      offset[axis] = clusters.rest_center[at(c)][axis] / setup.body.grid.spacing - base[at(axis)];
    }
    staging.rest_offset.push_back(f(offset));
    for (const int32_t i : clusters.of(c)) staging.members.push_back(body.particle_begin + i);
  }
}

// The slots of each particle, ascending.
void find_memberships(StagingBuffers& staging) {
  const std::size_t n = staging.node.size();
  staging.membership_count.assign(n, 0);
  for (const int p : staging.members) ++staging.membership_count[at(p)];
  staging.membership_begin.assign(n + 1, 0);
  for (std::size_t p = 0; p < n; ++p)
    staging.membership_begin[p + 1] = staging.membership_begin[p] + staging.membership_count[p];
  staging.memberships.assign(staging.members.size(), -1);
  std::vector<int> next(staging.membership_begin.begin(), staging.membership_begin.end() - 1);
  for (std::size_t s = 0; s < staging.slot_size.size(); ++s) {
    for (int k = 0; k < staging.slot_size[s]; ++k) {
      const int p = staging.members[at(staging.slot_begin[s] + k)];
      staging.memberships[at(next[at(p)]++)] = static_cast<int>(s);
    }
  }
}

}  // namespace

void StagingBuffers::allocate(bool bare) {
  DeviceView unused;
  each(unused, [&](const auto& array, auto& vector, auto&) {
    using Element = std::remove_reference_t<decltype(vector.front())>;
    if (array.unset || !bare) {
      vector.resize(at(array.extent), array.unset.value_or(Element{}));
    } else {
      vector.resize(at(array.extent));
    }
  });
}

DeviceView StagingBuffers::view() {
  DeviceView view;
  static_cast<Extents&>(view) = *this;
  each(view, [](const auto&, auto& vector, auto& pointer) { pointer = vector.data(); });
  return view;
}

StagingBuffers make_contents(const std::vector<Setup>& setups, const std::vector<State>& states, Capacity capacity) {
  require(setups.size() == states.size(), "as many states as setups are needed");
  StagingBuffers staging;
  staging.hold_begin = {0, 0};
  int64_t particles = 0, nodes = 0;
  for (std::size_t b = 0; b < setups.size(); ++b) {
    require_fit(setups[b], states[b]);
    add_constants(staging, setups[b], states[b], particles, nodes);
    add_particles(staging, setups[b], states[b], static_cast<int>(b));
    add_clusters(staging, setups[b], states[b], static_cast<int>(b));
    add_kept_reaches(staging, setups[b], states[b].skin);
    particles += setups[b].body.particle_count();
    nodes += setups[b].body.grid.node_count();
  }
  find_memberships(staging);
  const auto knows_crossings = [](const Setup& setup) { return !setup.body.surface_crossing.empty(); };
  const bool any_crossing = std::any_of(setups.begin(), setups.end(), knows_crossings);
  for (std::size_t b = 0; b < setups.size() && any_crossing; ++b) {
    const std::vector<uint8_t>& known = setups[b].body.surface_crossing;
    staging.surface_crossing.insert(staging.surface_crossing.end(), known.begin(), known.end());
    staging.surface_crossing.resize(at(int64_t{6} * staging.body[b].particle_end), 0);
  }
  Counters counters{};
  counters.slots_used = narrow(static_cast<int64_t>(staging.slot_size.size()), "clusters");
  counters.members_used = narrow(static_cast<int64_t>(staging.members.size()), "cluster members");
  counters.groups_stale = counters.groups_whole = 1;
  staging.counters = {counters};
  static_cast<Extents&>(staging) = extents_of(staging, capacity);
  return staging;
}

StagingBuffers make_staging_buffers(const std::vector<Setup>& setups, const std::vector<State>& states,
                                    Capacity capacity) {
  StagingBuffers staging = make_contents(setups, states, capacity);
  staging.allocate();
  return staging;
}

}  // namespace cutproof::gpu
