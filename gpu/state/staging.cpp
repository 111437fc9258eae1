#include "gpu/state/staging.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>

#include "model/body.h"
#include "model/error.h"

namespace cutproof::gpu {

namespace {

std::size_t at(int64_t index) { return static_cast<std::size_t>(index); }
float f(double value) { return static_cast<float>(value); }
Float3 f(Vec3 v) { return {f(v.x), f(v.y), f(v.z)}; }
Vec3 d(Float3 v) { return {v.x, v.y, v.z}; }

int narrow(int64_t value, const char* what) {
  if (value > std::numeric_limits<int>::max()) {
    throw MachineError(std::string("the kernels index with 32 bits, and this load has too many ") + what + ": " +
                       std::to_string(value));
  }
  return static_cast<int>(value);
}

PoseF pose_of(const BladePose& pose) { return {f(pose.edge), f(pose.along), f(pose.back)}; }

void require(bool condition, const char* what) {
  if (!condition) throw std::invalid_argument(std::string("kernels, load: ") + what);
}

void require_fit(const Setup& setup, const State& state) {
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
}

int criterion_of(Criterion criterion) {
  switch (criterion) {
    case Criterion::none:
      return kNoCriterion;
    case Criterion::distance:
      return kDistance;
    case Criterion::geometric:
      return kGeometric;
    case Criterion::strain:
      return kStrain;
  }
  return kNoCriterion;
}

int merge_of(MergeRule rule) {
  switch (rule) {
    case MergeRule::none:
      return kNoMerge;
    case MergeRule::deterministic:
      return kDeterministic;
    case MergeRule::published:
      return kPublishedMerge;
    case MergeRule::single_pass:
      return kSinglePass;
  }
  return kNoMerge;
}

int expand_of(ExpandRule rule) {
  switch (rule) {
    case ExpandRule::none:
      return kNoExpand;
    case ExpandRule::edge_cover:
      return kEdgeCover;
    case ExpandRule::published:
      return kPublishedExpand;
  }
  return kNoExpand;
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
  body.solver = setup.step.solver == Solver::implicit ? kImplicit : kPublished;
  body.acceleration = setup.step.acceleration == Acceleration::chebyshev ? kChebyshev : kPlain;
  body.substeps = setup.step.substeps;
  body.iterations = setup.step.iterations;
  body.stiffness = f(setup.step.stiffness);
  body.relaxation = f(setup.step.relaxation);
  body.damping = f(setup.step.damping);
  body.gravity = f(setup.step.gravity);
  body.criterion = criterion_of(setup.detect.criterion);
  body.needs_detection = needs_detection(setup);
  body.epsilon = f(setup.detect.epsilon);
  body.strain = f(setup.detect.strain);
  body.debris = setup.split.debris;
  body.merge_rule = merge_of(setup.merge.rule);
  body.tau = state.tau;
  body.cap = state.cap;
  body.expand_rule = expand_of(setup.expand.rule);
  body.depth = setup.expand.depth;
  body.skin_wanted = setup.skin.wanted;
  body.alpha = f(setup.skin.alpha);
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
  body.wall_begin = narrow(static_cast<int64_t>(staging.walls.size()), "walls");
  for (const Wall& wall : setup.walls)
    staging.walls.push_back({wall.axis, wall.side, f(wall.offset), f(wall.friction)});
  body.wall_end = narrow(static_cast<int64_t>(staging.walls.size()), "walls");
  body.grip_begin = narrow(static_cast<int64_t>(staging.grips.size()), "grips");
  for (const Grip& grip : setup.grips) {
    GripF entry{};
    entry.particle_begin = narrow(static_cast<int64_t>(staging.grip_particles.size()), "held particles");
    for (const int32_t i : grip.particles) staging.grip_particles.push_back(body.particle_begin + i);
    entry.particle_end = narrow(static_cast<int64_t>(staging.grip_particles.size()), "held particles");
    entry.table = static_cast<int64_t>(staging.grip_active.size());
    staging.grip_active.insert(staging.grip_active.end(), grip.active.begin(), grip.active.end());
    for (const Vec3 moved : grip.displacement) staging.grip_displacement.push_back(f(moved));
    staging.grips.push_back(entry);
  }
  body.grip_end = narrow(static_cast<int64_t>(staging.grips.size()), "grips");
  staging.body.push_back(body);
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
    // The state has one impulse for the body; shared out by mass it adds up to the same.
    staging.impulse.push_back({});
  }
  double mass = 0;
  for (const double m : setup.body.mass) mass += m;
  if (mass > 0 && !(state.impulse == Vec3{})) {
    for (int p = body.particle_begin; p < body.particle_end; ++p)
      staging.impulse[at(p)] = with_w(f(state.impulse / mass), 0);
  }
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

// Which slots hold each particle, in ascending order.
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

// How many pairs of cluster and particle expansions may find, some of them several times: the other ends of edges, and
// at greater depth what lies around these.
int64_t additions_bound(const StagingBuffers& staging) {
  int64_t additions = 0;
  for (std::size_t b = 0; b < staging.body.size(); ++b) {
    const BodyConstants& body = staging.body[b];
    const bool covered = body.expand_rule == kEdgeCover && staging.edge_covered[b];
    if (body.expand_rule == kNoExpand || covered) continue;
    const int64_t r = std::min(body.depth, 64);  // more would pass the limit below for any body
    const int64_t around = r <= 1 ? 1 : (2 * r + 1) * (2 * r * r + 2 * r + 3) / 3;  // grid nodes within r edges of one
    additions += 6 * int64_t{body.particle_end - body.particle_begin} * around;
  }
  return additions;
}

// Whether some body has a blade, a wall or a grip.
bool has_contact(const StagingBuffers& staging) {
  return std::any_of(staging.body.begin(), staging.body.end(), [](const BodyConstants& b) {
    return b.has_blade || b.wall_end > b.wall_begin || b.grip_end > b.grip_begin;
  });
}

void make_capacity(StagingBuffers& staging, Capacity room) {
  const auto n = static_cast<int64_t>(staging.node.size());
  const auto nodes = static_cast<int64_t>(staging.particle_at.size());
  const auto slots = static_cast<int64_t>(staging.slot_size.size());
  const auto members = static_cast<int64_t>(staging.members.size());
  const auto scaled = [&](int64_t count) { return static_cast<int64_t>(room.factor * static_cast<double>(count)); };
  // A cut makes at most one new cluster for each member that it touches: all of a small body at once, a plane's share
  // of a large one. A merge writes unions to new room, and no round of it needs more than all lists together; expansion
  // copies what it enlarges.
  const int64_t slot_capacity = slots + scaled(std::min(members, std::max<int64_t>(65536, 2 * slots))) + 64;
  const int64_t additions = std::min(additions_bound(staging), scaled(1'000'000 + 3 * n));
  const int64_t member_capacity = members + scaled(2 * members + 4096) + additions;
  const int64_t vertex_capacity = std::min(6 * n, scaled(4'000'000 + n)) + 64;
  const int64_t cell_capacity = std::min(nodes, scaled(4'000'000 + n)) + 64;
  const int64_t addition_capacity = additions + 64;
  narrow(15 * cell_capacity, "skin cells");
  narrow(6 * n, "particles");
  narrow(member_capacity, "cluster members");

  Counters counters{};
  counters.slots_used = narrow(slots, "clusters");
  counters.members_used = narrow(members, "cluster members");
  staging.counters = {counters};

  for (std::vector<Float4>* v : {&staging.start, &staging.predicted, &staging.pushed}) v->assign(at(n), {});
  const bool accelerated = std::any_of(staging.body.begin(), staging.body.end(),
                                       [](const BodyConstants& b) { return b.acceleration != kPlain; });
  staging.earlier.assign(accelerated ? at(n) : 0, {});
  staging.pushed_earlier.assign(accelerated && has_contact(staging) ? at(n) : 0, {});
  staging.particle_flag.assign(at(n), 0);
  staging.particle_scratch.assign(at(2 * n), 0);
  for (std::vector<int>* v :
       {&staging.slot_begin, &staging.slot_size, &staging.slot_number, &staging.slot_body, &staging.degenerate,
        &staging.affected, &staging.proposal, &staging.best, &staging.small_clusters}) {
    v->resize(at(slot_capacity), 0);
  }
  staging.slot_scratch.assign(at(4 * slot_capacity), 0);
  staging.rotation.resize(at(slot_capacity));
  staging.mass.resize(at(slot_capacity), 0);
  staging.rest_base.resize(at(3 * slot_capacity), 0);
  staging.rest_offset.resize(at(slot_capacity));
  staging.center.resize(at(slot_capacity));
  staging.slot_flag.assign(at(slot_capacity), 0);
  staging.rest_dirty.assign(at(slot_capacity), 0);
  staging.members.resize(at(member_capacity), -1);
  staging.memberships.resize(at(member_capacity), -1);
  staging.label.assign(at(member_capacity), -1);
  staging.member_scratch.assign(at(member_capacity), -1);
  staging.additions.assign(at(addition_capacity), 0);
  staging.vertex_of.assign(at(6 * n), -1);
  staging.vertex_owner.assign(at(vertex_capacity), -1);
  staging.vertex_direction.assign(at(vertex_capacity), 0);
  staging.vertex_position.assign(at(vertex_capacity), {});
  staging.cell_of.assign(at(nodes), -1);
  staging.cell_node.assign(at(cell_capacity), -1);
  staging.cell_triangles.assign(at(15 * cell_capacity), -1);
  staging.cell_dirty.assign(at(nodes), 0);
  staging.dirty_cells.assign(at(nodes), 0);
  staging.cell_scratch.assign(at(nodes), 0);
}

// Which slots, skin vertices and cells each body has: they interleave once clusters have split and skins have grown.
// Entries of body b: list[begin[b] .. begin[b + 1]), ascending.
struct ByBody {
  std::vector<int> list;
  std::vector<std::size_t> begin;
};

// body_of(k): the body of entry k of 0 .. count - 1, or -1 to leave it out.
template <class BodyOf>
ByBody by_body(std::size_t bodies, int count, const BodyOf& body_of) {
  ByBody sorted;
  sorted.begin.assign(bodies + 1, 0);
  for (int k = 0; k < count; ++k) {
    if (const int b = body_of(k); b >= 0) ++sorted.begin[at(b) + 1];
  }
  for (std::size_t b = 0; b < bodies; ++b) sorted.begin[b + 1] += sorted.begin[b];
  sorted.list.resize(sorted.begin.back());
  std::vector<std::size_t> next(sorted.begin.begin(), sorted.begin.end() - 1);
  for (int k = 0; k < count; ++k) {
    if (const int b = body_of(k); b >= 0) sorted.list[next[at(b)]++] = k;
  }
  return sorted;
}

Clusters extract_clusters(const StagingBuffers& staging, const BodyConstants& body, double spacing, const int* slot,
                          const int* slots_end) {
  Clusters clusters;
  const auto count = static_cast<std::size_t>(slots_end - slot);
  clusters.offsets.reserve(count + 1);
  clusters.number.reserve(count);
  clusters.rotation.reserve(count);
  clusters.rest_center.reserve(count);
  clusters.mass.reserve(count);
  clusters.degenerate.reserve(count);
  int64_t members = 0;
  for (const int* s = slot; s != slots_end; ++s) members += staging.slot_size[at(*s)];
  clusters.members.reserve(at(members));
  for (; slot != slots_end; ++slot) {
    const int s = *slot;
    for (int k = 0; k < staging.slot_size[at(s)]; ++k) {
      clusters.members.push_back(staging.members[at(staging.slot_begin[at(s)] + k)] - body.particle_begin);
    }
    clusters.offsets.push_back(static_cast<int64_t>(clusters.members.size()));
    clusters.number.push_back(staging.slot_number[at(s)]);
    Mat3 r;
    for (int k = 0; k < 9; ++k) r.m[at(k)] = staging.rotation[at(s)].m[k];
    clusters.rotation.push_back(r);
    Vec3 center;
    const Float3 offset = staging.rest_offset[at(s)];
    for (int axis = 0; axis < 3; ++axis) {
      center[axis] = spacing * (staging.rest_base[at(3 * s + axis)] + double{offset[axis]});
    }
    clusters.rest_center.push_back(center);
    clusters.mass.push_back(staging.mass[at(s)]);
    clusters.degenerate.push_back(static_cast<uint8_t>(staging.degenerate[at(s)] != 0));
  }
  return clusters;
}

// Vertices in the order (owner, direction), triangles in the order of their cells. `place`: scratch, one entry for
// each vertex of the DeviceView.
Skin extract_skin(const StagingBuffers& staging, const Setup& setup, const BodyConstants& body, const int* vertex,
                  const int* vertices_end, const int* cell, const int* cells_end, std::vector<int32_t>& place) {
  // (6 · owner + direction, index)
  std::vector<std::pair<int64_t, int>> vertices;
  vertices.reserve(static_cast<std::size_t>(vertices_end - vertex));
  for (; vertex != vertices_end; ++vertex) {
    const int64_t owner = staging.vertex_owner[at(*vertex)] - body.particle_begin;
    vertices.emplace_back(6 * owner + staging.vertex_direction[at(*vertex)], *vertex);
  }
  std::sort(vertices.begin(), vertices.end());
  Skin skin;
  skin.owner.reserve(vertices.size());
  skin.direction.reserve(vertices.size());
  skin.position.reserve(vertices.size());
  const double h = setup.body.grid.spacing;
  for (const auto& [name, index] : vertices) {
    place[at(index)] = static_cast<int32_t>(skin.owner.size());
    const auto owner = static_cast<int32_t>(name / 6);
    const auto direction = static_cast<uint8_t>(name % 6);
    const auto& e = kDirections[direction];
    const Vec3 rest =
        setup.body.rest_position(owner) + (setup.skin.alpha * h) * Vec3{double(e[0]), double(e[1]), double(e[2])};
    skin.owner.push_back(owner);
    skin.direction.push_back(direction);
    skin.position.push_back(rest + d(xyz(staging.vertex_position[at(index)])));
  }
  std::vector<std::pair<int, int>> cells;  // node, cell
  cells.reserve(static_cast<std::size_t>(cells_end - cell));
  for (; cell != cells_end; ++cell) cells.emplace_back(staging.cell_node[at(*cell)], *cell);
  std::sort(cells.begin(), cells.end());
  for (const auto& [node, c] : cells) {
    for (int t = 0; t < 5; ++t) {
      const int* corner = &staging.cell_triangles[at(15 * int64_t{c} + 3 * t)];
      if (corner[0] < 0) continue;
      skin.triangles.push_back({place[at(corner[0])], place[at(corner[1])], place[at(corner[2])]});
    }
  }
  return skin;
}

}  // namespace

DeviceView StagingBuffers::view() {
  DeviceView w;
  w.bodies = static_cast<int>(body.size());
  w.particles = static_cast<int>(node.size());
  w.nodes = static_cast<int64_t>(particle_at.size());
  w.slot_capacity = static_cast<int>(slot_size.size());
  w.member_capacity = static_cast<int>(members.size());
  w.vertex_capacity = static_cast<int>(vertex_owner.size());
  w.cell_capacity = static_cast<int>(cell_node.size());
  w.addition_capacity = static_cast<int>(additions.size());
  w.rotation_method = rotation_method;
  w.any_contact = has_contact(*this);
  each(w, [](auto& vector, auto& pointer, bool) { pointer = vector.data(); });
  return w;
}

StagingBuffers make_staging_buffers(const std::vector<Setup>& setups, const std::vector<State>& states,
                                    int rotation_method, Capacity room) {
  require(setups.size() == states.size(), "as many states as setups are needed");
  StagingBuffers staging;
  staging.rotation_method = rotation_method;
  int64_t particles = 0, nodes = 0;
  for (std::size_t b = 0; b < setups.size(); ++b) {
    require_fit(setups[b], states[b]);
    add_constants(staging, setups[b], states[b], particles, nodes);
    add_particles(staging, setups[b], states[b], static_cast<int>(b));
    add_clusters(staging, setups[b], states[b], static_cast<int>(b));
    particles += setups[b].body.particle_count();
    nodes += setups[b].body.grid.node_count();
  }
  find_memberships(staging);
  make_capacity(staging, room);
  return staging;
}

Plan make_plan(const std::vector<Setup>& setups, const std::vector<State>& states, int rotation_method,
               SplitMethod split) {
  Plan plan;
  plan.rotation_method = rotation_method;
  plan.split = split;
  for (std::size_t b = 0; b < setups.size(); ++b) {
    const Setup& setup = setups[b];
    plan.substeps = std::max(plan.substeps, setup.step.substeps);
    plan.iterations = std::max(plan.iterations, setup.step.iterations);
    plan.accelerated = plan.accelerated || setup.step.acceleration != Acceleration::none;
    plan.contacts = plan.contacts || setup.has_blade || !setup.walls.empty() || !setup.grips.empty();
    plan.grips = plan.grips || !setup.grips.empty();
    const bool detection = needs_detection(setup);
    plan.detection = plan.detection || detection;
    plan.distance = plan.distance || (detection && setup.detect.criterion == Criterion::distance);
    plan.geometric = plan.geometric || (detection && setup.detect.criterion == Criterion::geometric);
    plan.strain = plan.strain || (detection && setup.detect.criterion == Criterion::strain);
    plan.debris = plan.debris || setup.split.debris > 0;
    plan.merge = plan.merge || setup.merge.rule != MergeRule::none;
    plan.deterministic_merge = plan.deterministic_merge || setup.merge.rule == MergeRule::deterministic;
    plan.published_merge = plan.published_merge || setup.merge.rule == MergeRule::published;
    plan.single_pass_merge = plan.single_pass_merge || setup.merge.rule == MergeRule::single_pass;
    plan.edge_cover = plan.edge_cover || (setup.expand.rule == ExpandRule::edge_cover && !states[b].edge_covered);
    plan.published_expand = plan.published_expand || setup.expand.rule == ExpandRule::published;
    plan.skin = plan.skin || setup.skin.wanted;
    for (int32_t c = 0; c < states[b].clusters.count(); ++c) {
      plan.largest_cluster =
          std::max(plan.largest_cluster, narrow(states[b].clusters.size(c), "members of one cluster"));
    }
    plan.largest_cluster = std::max(plan.largest_cluster, int{states[b].cap});
  }
  plan.expand = plan.edge_cover || plan.published_expand;
  return plan;
}

std::vector<State> extract_states(const StagingBuffers& staging, const std::vector<Setup>& setups) {
  KnownSkins skins(setups.size());
  return extract_states(staging, setups, std::vector<bool>(setups.size(), true), skins);
}

std::vector<State> extract_states(const StagingBuffers& staging, const std::vector<Setup>& setups,
                                  const std::vector<bool>& wanted, KnownSkins& skins) {
  const std::size_t bodies = setups.size();
  const Counters& counters = staging.counters.front();
  const ByBody slots = by_body(bodies, counters.slots_used,
                               [&](int s) { return staging.slot_size[at(s)] == 0 ? -1 : staging.slot_body[at(s)]; });
  ByBody vertices, cells;
  std::vector<int32_t> place;
  bool any_new_skin = false;
  for (std::size_t b = 0; b < bodies; ++b) {
    if (wanted.at(b) && staging.skin_made[b] && !skins.at(b)) any_new_skin = true;
  }
  if (any_new_skin) {
    vertices = by_body(bodies, counters.vertices_used, [&](int v) {
      const int p = staging.vertex_owner[at(v)];
      return p < 0 ? -1 : staging.body_of[at(p)];
    });
    const auto body_of_node = [&](int64_t node) {
      const auto after = std::upper_bound(staging.body.begin(), staging.body.end(), node,
                                          [](int64_t n, const BodyConstants& body) { return n < body.node_begin; });
      return static_cast<int>(after - staging.body.begin()) - 1;
    };
    cells = by_body(bodies, counters.cells_used, [&](int c) {
      const int node = staging.cell_node[at(c)];
      return node < 0 ? -1 : body_of_node(node);
    });
    place.assign(at(counters.vertices_used), -1);
  }
  std::vector<State> states(bodies);
  for (std::size_t b = 0; b < bodies; ++b) {
    if (!wanted[b]) continue;
    const Setup& setup = setups[b];
    const BodyConstants& body = staging.body[b];
    State& state = states[b];
    state.frame = staging.frame[b];
    state.precision = Precision::binary32;
    const auto n = at(setup.body.particle_count());
    state.x.reserve(n);
    state.v.reserve(n);
    state.alive.reserve(n);
    Vec3 impulse;
    for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
      const std::size_t p = at(body.particle_begin + i);
      state.x.push_back(setup.body.rest_position(i) + d(xyz(staging.displacement[p])));
      state.v.push_back(d(xyz(staging.velocity[p])));
      state.alive.push_back(staging.death[p] < 0);
      impulse += setup.body.mass[at(i)] * d(xyz(staging.impulse[p]));
      if (staging.cut[b] >= 0 && staging.death[p] == staging.cut[b]) state.removed.push_back(i);
      if (staging.cut[b] >= 0 && staging.death[p] == staging.cut[b] + 1) state.debris.push_back(i);
    }
    state.impulse = impulse;
    const auto range = [b](const ByBody& of, std::size_t past) { return of.list.data() + of.begin[b + past]; };
    state.clusters = extract_clusters(staging, body, setup.body.grid.spacing, range(slots, 0), range(slots, 1));
    state.tau = body.tau;
    state.cap = body.cap;
    state.edge_covered = staging.edge_covered[b] != 0;
    if (staging.skin_made[b] && !skins[b]) {
      skins[b] = extract_skin(staging, setup, body, range(vertices, 0), range(vertices, 1), range(cells, 0),
                              range(cells, 1), place);
    }
    state.skin = staging.skin_made[b] ? *skins[b] : staging.loaded_skin[b];
  }
  return states;
}

bool wants_capacity(const DeviceView& w, const Counters& c) {
  const auto full = [](int used, int capacity) { return int64_t{4} * used > int64_t{3} * capacity; };
  // A particle has at most six vertices and a node one cell: what has room for all of them cannot want more.
  return full(c.slots_used, w.slot_capacity) || full(c.members_used, w.member_capacity) ||
         (w.vertex_capacity < int64_t{6} * w.particles && full(c.vertices_used, w.vertex_capacity)) ||
         (w.cell_capacity < w.nodes && full(c.cells_used, w.cell_capacity));
}

void require_no_fault(const Counters& c) {
  if (c.fault == 0) return;
  std::string what;
  const auto name = [&](int bit, const char* text) {
    if (c.fault & bit) what += std::string(what.empty() ? "" : ", ") + text;
  };
  name(kSlotsFull, "clusters");
  name(kMembersFull, "cluster members");
  name(kVerticesFull, "skin vertices");
  name(kCellsFull, "skin cells");
  name(kAdditionsFull, "expanded particles");
  throw MachineError("a stage found no room for its " + what +
                     " and has written nothing; the state before that frame is the last sound one");
}

}  // namespace cutproof::gpu
