// From staging buffers to states.
#include <algorithm>
#include <utility>

#include "gpu/state/indices.h"
#include "gpu/state/staging.h"
#include "model/body.h"

namespace cutproof::gpu {

namespace {

Vec3 d(Float3 v) { return {v.x, v.y, v.z}; }

// The slots, skin vertices and cells of each body: bodies interleave once clusters have split and skins have grown.
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
  skin.reach.reserve(vertices.size());
  skin.position.reserve(vertices.size());
  const double h = setup.body.grid.spacing;
  for (const auto& [name, index] : vertices) {
    place[at(index)] = static_cast<int32_t>(skin.owner.size());
    const auto owner = static_cast<int32_t>(name / 6);
    const auto direction = static_cast<uint8_t>(name % 6);
    const auto& e = kDirections[direction];
    const double reach = staging.vertex_reach[at(index)];
    const Vec3 rest = setup.body.rest_position(owner) + (reach * h) * Vec3{double(e[0]), double(e[1]), double(e[2])};
    skin.owner.push_back(owner);
    skin.direction.push_back(direction);
    skin.reach.push_back(reach);
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

StepWork step_work_of(const Counters& counters, const GroupHead* heads, const int* resolved, const int* loose_places) {
  StepWork work;
  for (int g = 0; g < counters.groups; ++g) {
    if (heads[g].size == 0) continue;
    ++work.groups;
    const int state = resolved == nullptr ? kCarried : resolved[g];
    (state == kResolved ? work.resolved : state == kHeld ? work.held : work.carried) += heads[g].size;
  }
  work.loose = std::count_if(loose_places, loose_places + counters.loose, [](int place) { return place >= 0; });
  return work;
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

}  // namespace cutproof::gpu
