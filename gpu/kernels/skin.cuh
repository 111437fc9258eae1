// Stage skin (docs/design/method.md §8). enqueue_skin_cells extracts anew the cells that lost a corner in this frame,
// or every cell of a body without a skin. enqueue_skin_clusters then notes the clusters that carry vertices, and
// enqueue_skin_positions places all vertices.
//
// A vertex is known by its owner and direction. It is made when the particle beyond its grid edge dies, or with the
// body's first skin. It lasts as long as its owner, because particles do not revive; so cells that kept all corners
// keep their triangles. The changed particles decide all work. They are listed first, ascending, and get places for
// vertices and cells in that order.
#pragma once
#include "gpu/kernels/carried_tissue.cuh"
#include "gpu/kernels/lowered_plane.cuh"
#include "gpu/kernels/skin_table.h"
#include "gpu/kernels/sorted_lists.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"
#include "gpu/state/plan.h"

namespace cutproof::gpu {

namespace skin_detail {

// Use of Counters::scratch.
enum : int { kVertexBase = 0, kCellBase = 1, kSound = 2 };

CUTPROOF_DEVICE inline bool skinned(const DeviceView& w, int b) { return running(w, b) && w.body[b].skin_wanted; }
CUTPROOF_DEVICE inline bool extracts(const DeviceView& w, int b) {
  return skinned(w, b) && (w.cut[b] >= 0 || !w.skin_made[b]);
}
// Whether a particle with that DeviceView::death changes the cells around it. It does if it died in this frame, by
// detection or as debris, or if there is no skin yet and it is tissue. Only of a body that was cut.
CUTPROOF_DEVICE inline bool changes_cells(const DeviceView& w, int b, int death) {
  return w.skin_made[b] ? death == w.cut[b] || death == w.cut[b] + 1 : death < 0;
}
CUTPROOF_DEVICE inline int corner_step(const BodyConstants& body, int corner) {
  return (corner & 1) + body.nodes[0] * ((corner >> 1 & 1) + body.nodes[1] * (corner >> 2));
}

// The particles at a cell's corners (-1: none), and as bits which are tissue and which change the cells around them.
// All are read at once.
struct Cell {
  int corner[8];
  int inside, changing;
};
CUTPROOF_DEVICE inline Cell cell_at(const DeviceView& w, int b, int64_t node) {
  const BodyConstants& body = w.body[b];
  Cell cell;
  cell.inside = cell.changing = 0;
  int death[8];
  for (int c = 0; c < 8; ++c) cell.corner[c] = w.particle_at[node + corner_step(body, c)];
  for (int c = 0; c < 8; ++c) death[c] = cell.corner[c] < 0 ? kDeadBefore : w.death[cell.corner[c]];
  for (int c = 0; c < 8; ++c) {
    if (cell.corner[c] < 0) continue;
    if (death[c] < 0) cell.inside |= 1 << c;
    if (changes_cells(w, b, death[c])) cell.changing |= 1 << c;
  }
  return cell;
}

// The vertex that p's death, or p in a first skin, makes along d; no owner: none. No two particles make the same one.
struct NewVertex {
  int owner, direction;
};
CUTPROOF_DEVICE inline NewVertex new_vertex(const DeviceView& w, int b, int p, int d) {
  const int q = neighbour(w, w.body[b], p, d);
  const bool q_alive = q >= 0 && alive(w, q);
  if (w.skin_made[b]) return {q_alive && w.vertex_of[6 * q + (d ^ 1)] < 0 ? q : -1, d ^ 1};
  return {!q_alive && w.vertex_of[6 * p + d] < 0 ? p : -1, d};
}

// A vertex's place on its grid edge, as far as owner and direction decide it: where the uncut body's surface crosses
// the edge, or where the loaded skin had it, otherwise alpha. kReachUnknown: the blade may have made the vertex in this
// frame.
CUTPROOF_DEVICE inline float known_reach(const DeviceView& w, int b, NewVertex made) {
  const BodyConstants& body = w.body[b];
  const int edge = 6 * made.owner + made.direction;
  const int end = neighbour(w, body, made.owner, made.direction);
  if (end < 0) {
    const int crossing = w.any_crossing ? w.surface_crossing[edge] : 0;
    return crossing > 0 ? static_cast<float>(crossing) / kCrossingSteps : body.alpha;
  }
  if (!w.skin_made[b]) {
    int low = 0, high = w.kept_count;  // the first not less than the edge
    while (low < high) {
      const int middle = low + (high - low) / 2;
      if (w.kept_edge[middle] < edge) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    if (low < w.kept_count && w.kept_edge[low] == edge) return w.kept_reach[low];
  }
  const int death = w.death[end];
  const bool died = death >= 2 * w.frame[b] && death != kDeadBefore;
  return body.fit_cuts && died ? kReachUnknown : body.alpha;
}

// Lanes that share a particle's cells: one for each corner that it is.
inline constexpr int kCornerTeam = 8;
inline constexpr int kReserveThreads = 512;

// Particles that change the cells around them, ascending: as many as Counters::skin_changes. For each of them first the
// number of vertices and cells that it needs, then the number that earlier ones need.
CUTPROOF_BOTH inline int* changed(const DeviceView& w) { return w.fallen; }
CUTPROOF_BOTH inline int* new_vertices(const DeviceView& w) { return w.particle_scratch; }
CUTPROOF_BOTH inline int* new_cells(const DeviceView& w) { return w.particle_scratch + w.particles; }
// By particle, as bits: its own cells, in which it is the lowest changing corner.
CUTPROOF_BOTH inline unsigned char* own_corners(const DeviceView& w) { return w.particle_flag; }

}  // namespace skin_detail

// ---- Extraction

template <class Block>
CUTPROOF_DEVICE void flag_changed_particles_kernel(Block& block, const DeviceView& w) {
  using namespace skin_detail;
  for (int64_t s = block.first(); s < w.counters->slots_used; s += block.stride()) {
    if (extracts(w, w.slot_body[s])) w.under_skin[s] = 0;
  }
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i), b = w.body_of[p];
    w.particle_flag[p] = extracts(w, b) && changes_cells(w, b, w.death[p]);
  }
}
CUTPROOF_KERNEL(flag_changed_particles_kernel);

// Counts the vertices and cells that each needs.
template <class Block>
CUTPROOF_DEVICE void count_skin_changes_kernel(Block& block, const DeviceView& w) {
  using namespace skin_detail;
  const Team<Block, kCornerTeam> team(block);
  for (int64_t j = team.first(); j < w.counters->skin_changes; j += team.stride()) {
    const int p = changed(w)[j], b = w.body_of[p];
    const BodyConstants& body = w.body[b];
    int own_bits = 0, cells = 0, vertices = 0;
    team.each(6, [&](int d) { vertices += new_vertex(w, b, p, d).owner >= 0 ? 1 : 0; });
    team.each(8, [&](int corner) {
      const int64_t node = body.node_begin + w.node[p] - corner_step(body, corner);
      const int present = w.cell_of[node];
      const Cell cell = cell_at(w, b, node);
      if ((cell.changing & ((1 << corner) - 1)) != 0) return;
      own_bits += 1 << corner;
      if (present < 0 && skin_table().corners[cell.inside][0] >= 0) ++cells;
    });
    own_bits = team.total(own_bits);
    cells = team.total(cells);
    vertices = team.total(vertices);
    if (!team.leads()) continue;
    own_corners(w)[p] = static_cast<unsigned char>(own_bits);
    new_cells(w)[j] = cells;
    new_vertices(w)[j] = vertices;
  }
}
CUTPROOF_KERNEL(count_skin_changes_kernel);

namespace skin_detail {
// Replaces counts[k] by the sum of its predecessors; returns the sum of all. Reached by all threads of the one block.
template <class Block>
CUTPROOF_DEVICE int sum_before(Block& block, int* counts, int count) {
  constexpr int kEach = 4;
  int before = 0;
  for (int tile = 0; tile < count; tile += kEach * block.size()) {
    const int first = tile + kEach * block.thread();
    int own[kEach], sum = 0, total = 0;
    for (int k = 0; k < kEach; ++k) own[k] = first + k < count ? counts[first + k] : 0;
    for (int k = 0; k < kEach; ++k) sum += own[k];
    int next = before + block.exclusive_scan(sum, total);
    for (int k = 0; k < kEach; ++k) {
      if (first + k < count) counts[first + k] = next;
      next += own[k];
    }
    before += total;
  }
  return before;
}
}  // namespace skin_detail

// Gives places to new vertices and cells, or reports that there are too few. After a fault the skin stays unchanged.
// One block.
template <class Block>
CUTPROOF_DEVICE void reserve_skin_kernel(Block& block, const DeviceView& w) {
  using namespace skin_detail;
  if (block.index() != 0) return;
  Counters& c = *w.counters;
  const int changes = c.skin_changes;
  const int vertices = sum_before(block, new_vertices(w), changes), cells = sum_before(block, new_cells(w), changes);
  if (block.thread() != 0) return;
  c.scratch[kVertexBase] = c.vertices_used;
  c.scratch[kCellBase] = c.cells_used;
  if (vertices > w.vertex_capacity - c.vertices_used) block.atomic_or(&c.fault, kVerticesFull);
  if (cells > w.cell_capacity - c.cells_used) block.atomic_or(&c.fault, kCellsFull);
  c.scratch[kSound] = (block.load(&c.fault) & (kVerticesFull | kCellsFull)) == 0;
  if (!c.scratch[kSound]) return;
  c.vertices_used += vertices;
  c.cells_used += cells;
}
CUTPROOF_KERNEL_THREADS(reserve_skin_kernel, skin_detail::kReserveThreads);

// Removes vertices of the dead, adds those of deaths or of a first skin.
template <class Block>
CUTPROOF_DEVICE void renew_vertices_kernel(Block& block, const DeviceView& w) {
  using namespace skin_detail;
  if (!w.counters->scratch[kSound]) return;
  const Team<Block, kCornerTeam> team(block);
  for (int64_t j = team.first(); j < w.counters->skin_changes; j += team.stride()) {
    const int p = changed(w)[j], b = w.body_of[p];
    const bool dies = w.skin_made[b] != 0;
    int next = w.counters->scratch[kVertexBase] + new_vertices(w)[j];
    for (int tile = 0; tile < 6; tile += team.kLanes) {
      const int d = tile + team.lane();
      const NewVertex made = d < 6 ? new_vertex(w, b, p, d) : NewVertex{-1, 0};
      int found = 0;
      const int v = next + team.rank(made.owner >= 0, found);
      next += found;
      if (made.owner >= 0) {
        w.vertex_of[6 * made.owner + made.direction] = v;
        w.vertex_owner[v] = made.owner;
        w.vertex_direction[v] = static_cast<unsigned char>(made.direction);
        w.vertex_reach[v] = known_reach(w, b, made);
      }
      if (!dies || d >= 6) continue;
      const int gone = w.vertex_of[6 * p + d];
      if (gone < 0) continue;
      w.vertex_owner[gone] = -1;
      w.vertex_of[6 * p + d] = -1;
    }
  }
}
CUTPROOF_KERNEL(renew_vertices_kernel);

// Writes the triangles of the cells around changed particles.
template <class Block>
CUTPROOF_DEVICE void extract_cells_kernel(Block& block, const DeviceView& w) {
  using namespace skin_detail;
  const SkinTable& table = skin_table();
  const bool sound = w.counters->scratch[kSound];
  const Team<Block, kCornerTeam> team(block);
  for (int64_t j = team.first(); j < w.counters->skin_changes && sound; j += team.stride()) {
    const int p = changed(w)[j], b = w.body_of[p];
    const BodyConstants& body = w.body[b];
    const int own = own_corners(w)[p];
    int next = w.counters->scratch[kCellBase] + new_cells(w)[j];
    for (int tile = 0; tile < 8; tile += team.kLanes) {
      const int at = tile + team.lane();
      const int64_t node = body.node_begin + w.node[p] - corner_step(body, at);
      int place = -1;
      const signed char* corners = table.corners[0];
      Cell cell = {};
      if (own >> at & 1) {
        cell = cell_at(w, b, node);
        corners = table.corners[cell.inside];
        place = w.cell_of[node];
      }
      // All tissue or all empty, and never with a triangle: it stays without a place.
      const bool fresh = place < 0 && corners[0] >= 0;
      int found = 0;
      const int given = next + team.rank(fresh, found);
      next += found;
      if (fresh) {
        place = given;
        w.cell_of[node] = place;
        w.cell_node[place] = static_cast<int>(node);
      }
      if (place < 0) continue;
      int vertex[3 * kMostSkinTriangles];  // all read before the first is written
      for (int c = 0; c < 3 * kMostSkinTriangles; ++c) {
        vertex[c] = -1;
        const int edge = corners[c];
        if (edge < 0) continue;
        const int low = table.low[edge], axis = table.axis[edge];
        const bool low_owns = cell.inside >> low & 1;
        const int owner = cell.corner[low_owns ? low : low + (1 << axis)];
        vertex[c] = w.vertex_of[6 * owner + 2 * axis + (low_owns ? 0 : 1)];
      }
      for (int c = 0; c < 3 * kMostSkinTriangles; ++c) {
        w.cell_triangles[15 * static_cast<int64_t>(place) + c] = vertex[c];
      }
    }
  }
  for (int64_t b = block.first(); b < w.bodies; b += block.stride()) {
    if (sound && skinned(w, static_cast<int>(b))) w.skin_made[b] = 1;
  }
}
CUTPROOF_KERNEL(extract_cells_kernel);

// Notes the clusters that carry vertices.
template <class Block>
CUTPROOF_DEVICE void mark_under_skin_kernel(Block& block, const DeviceView& w) {
  for (int64_t v = block.first(); v < w.counters->vertices_used; v += block.stride()) {
    const int p = w.vertex_owner[v];
    if (p < 0 || !skin_detail::skinned(w, w.body_of[p])) continue;
    each_membership(block, w, p, [&](int, int slot) {
      if (slot >= 0) block.store(&w.under_skin[slot], 1);
    });
  }
}
CUTPROOF_KERNEL(mark_under_skin_kernel);

// Depends on which particles live, not on clusters; these may change meanwhile.
template <class Launcher>
void enqueue_skin_cells(Launcher& launcher, const DeviceView& w, const Plan&) {
  using namespace skin_detail;
  launcher.items(flag_changed_particles_kernel_object{}, w.particles, w);
  launcher.select(w.particle_flag, w.particles, changed(w), &w.counters->skin_changes);
  launcher.teams(count_skin_changes_kernel_object{}, kCornerTeam, w.particles, w);
  launcher.blocks(reserve_skin_kernel_object{}, 1, kReserveThreads, 0, w);
  launcher.teams(renew_vertices_kernel_object{}, kCornerTeam, w.particles, w);
  launcher.teams(extract_cells_kernel_object{}, kCornerTeam, w.particles, w);
}
// After clusters and cells have changed.
template <class Launcher>
void enqueue_skin_clusters(Launcher& launcher, const DeviceView& w, const Plan&) {
  launcher.items(mark_under_skin_kernel_object{}, w.vertex_capacity, w);
}

// ---- Positions

// DeviceView::center of the clusters that carry vertices; others need none. made: in frames with Counters::changing
// they are done.
template <bool kVolume, class Block>
CUTPROOF_DEVICE void recenter_clusters_kernel(Block& block, const DeviceView& w, bool made) {
  using namespace skin_detail;
  if (made && w.counters->changing != 0) return;
  const Team<Block, kCenterTeam> team(block);
  for (int64_t i = team.first(); i < w.counters->slots_used; i += team.stride()) {
    const int s = static_cast<int>(i);
    if (w.slot_size[s] == 0 || !skinned(w, w.slot_body[s]) || w.under_skin[s] == 0) continue;
    recenter<kVolume>(w, team, s);
  }
}
template <bool kVolume>
struct recenter_clusters_kernel_object {
  static constexpr const char* kName = "recenter_clusters_kernel";
  static constexpr int kMaxThreads = 256;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w, bool made) const {
    recenter_clusters_kernel<kVolume>(block, w, made);
  }
};

namespace skin_detail {

// From p towards the vertex on its edge in a direction [m].
CUTPROOF_DEVICE inline Float3 arm_of(const BodyConstants& body, int direction, float reach) {
  const float far = (direction % 2 == 0 ? reach : -reach) * body.h;
  return {direction / 2 == 0 ? far : 0.0f, direction / 2 == 1 ? far : 0.0f, direction / 2 == 2 ? far : 0.0f};
}

// Distance of a new cut vertex from its owner. `owner`, `end`: heights over the blade's plane to which the ends of its
// grid edge are carried [h]. The vertex goes where the edge crosses the plane, within [1/16, 15/16]. It comes nearer to
// alpha the farther the plane is from the edge, or the flatter the edge lies to it (docs/design/method.md §8). The
// error of t is that of the heights over their difference; the error of the result is at most 16 times that of the
// heights.
CUTPROOF_DEVICE inline float cut_reach(float owner, float end, float alpha) {
  constexpr float kLeast = static_cast<float>(kLeastCrossing) / kCrossingSteps, kGreatest = 1.0f - kLeast,
                  kFlat = 0.25f;
  const float t = owner / (owner - end);
  if (!(t > -1 && t < 3)) return alpha;
  const float crossing = t < 0   ? kLeast - t * (alpha - kLeast)
                         : t > 2 ? kGreatest + (t - 2) * (alpha - kGreatest)
                                 : fminf(fmaxf(t, kLeast), kGreatest);
  return alpha + fminf(1.0f, fabsf(owner - end) / kFlat) * (crossing - alpha);
}

// Where the blade's plane crosses the edge, as p's clusters carry both; alpha without a blade.
template <bool kVolume>
CUTPROOF_DEVICE inline float reach_by_blade(const DeviceView& w, const BodyConstants& body, int b, int p,
                                            int direction) {
  const Plane plane = lowered_plane(w, body, b);
  if (!plane.exists) return body.alpha;
  float height[2] = {};
  CUTPROOF_ROLLED for (int end = 0; end < 2; ++end) {
    const Float3 arm = arm_of(body, direction, static_cast<float>(end));
    height[end] = height_over(plane, rest_position(body, w.node[p]) + arm + carried<kVolume>(w, body, p, arm));
  }
  return cut_reach(height[0] / body.h, height[1] / body.h, body.alpha);
}

}  // namespace skin_detail

// Puts each vertex where its owner's clusters carry it, as displacement from X_v.
template <bool kVolume, class Block>
CUTPROOF_DEVICE void place_vertices_kernel(Block& block, const DeviceView& w, bool made) {
  if (made && w.counters->changing != 0) return;
  for (int64_t v = block.first(); v < w.counters->vertices_used; v += block.stride()) {
    const int p = w.vertex_owner[v];
    if (p < 0) continue;
    const int b = w.body_of[p];
    if (!skin_detail::skinned(w, b)) continue;
    const BodyConstants& body = w.body[b];
    const int direction = w.vertex_direction[v];
    float reach = w.vertex_reach[v];
    if (reach == kReachUnknown) {
      reach = skin_detail::reach_by_blade<kVolume>(w, body, b, p, direction);
      w.vertex_reach[v] = reach;
    }
    w.vertex_position[v] = with_w(carried<kVolume>(w, body, p, skin_detail::arm_of(body, direction, reach)), 0.0f);
  }
}
template <bool kVolume>
struct place_vertices_kernel_object {
  static constexpr const char* kName = "place_vertices_kernel";
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w, bool made) const {
    place_vertices_kernel<kVolume>(block, w, made);
  }
};

// made: as for the centres.
template <class Launcher>
void enqueue_skin_positions(Launcher& launcher, const DeviceView& w, bool made) {
  by_volume(w.keeps_volume != 0, [&](auto volume) {
    launcher.teams(recenter_clusters_kernel_object<volume.value>{}, kCenterTeam, w.slots_expected, w, made);
    launcher.items(place_vertices_kernel_object<volume.value>{}, w.vertex_capacity, w, made);
  });
}

}  // namespace cutproof::gpu
