// Stage skin (docs/design/method.md §8). enqueue_skin_cells extracts again the cells that lost a corner in this frame,
// or every cell of a body that has no skin yet; enqueue_skin_positions puts all vertices where the clusters carry them.
//
// A vertex is known by its owner and direction. It is made when the particle beyond its grid edge dies (or with the
// body's first skin) and lasts as long as its owner, because the dead do not come back; so cells that kept all
// corners keep their triangles as they are. Places of vertices and cells are given out by scans over particles and
// nodes, in ascending order.
#pragma once
#include "gpu/kernels/float3.h"
#include "gpu/kernels/skin_table.h"
#include "gpu/launch/launcher.h"
#include "gpu/launch/plan.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"

namespace cutproof::gpu {

namespace skin_detail {

// Use of Counters::scratch.
enum : int { kNewVertices = 0, kNewCells = 1, kVertexBase = 2, kCellBase = 3, kSound = 4 };

inline constexpr int kClusterTeam = 32;  // lanes that find where a cluster is

CUTPROOF_DEVICE inline bool skinned(const DeviceView& w, int b) { return running(w, b) && w.body[b].skin_wanted; }
CUTPROOF_DEVICE inline bool extracts(const DeviceView& w, int b) {
  return skinned(w, b) && (w.cut[b] >= 0 || !w.skin_made[b]);
}
// Whether p died in this frame, by detection or as debris. Only of a body that was cut.
CUTPROOF_DEVICE inline bool died_now(const DeviceView& w, int b, int p) {
  return w.death[p] == w.cut[b] || w.death[p] == w.cut[b] + 1;
}
// Whether p changes the cells around it: it died, or there is no skin yet and it is tissue.
CUTPROOF_DEVICE inline bool changes_cells(const DeviceView& w, int b, int p) {
  return w.skin_made[b] ? died_now(w, b, p) : alive(w, p);
}
CUTPROOF_DEVICE inline int corner_step(const BodyConstants& body, int corner) {
  return (corner & 1) + body.nodes[0] * ((corner >> 1 & 1) + body.nodes[1] * (corner >> 2));
}

// The body whose grid holds a node; node counts over all bodies.
CUTPROOF_DEVICE inline int body_of_node(const DeviceView& w, int64_t node) {
  int low = 0, high = w.bodies;  // body[low].node_begin <= node < body[high].node_begin
  while (high - low > 1) {
    const int middle = low + (high - low) / 2;
    (w.body[middle].node_begin <= node ? low : high) = middle;
  }
  return low;
}

// The particles at a cell's corners, -1 where there is none, and which of them are tissue, as bits.
struct Cell {
  int corner[8];
  int inside;
};
CUTPROOF_DEVICE inline Cell cell_at(const DeviceView& w, const BodyConstants& body, int64_t node) {
  Cell cell;
  cell.inside = 0;
  for (int c = 0; c < 8; ++c) {
    const int p = w.particle_at[node + corner_step(body, c)];
    cell.corner[c] = p;
    if (p >= 0 && alive(w, p)) cell.inside |= 1 << c;
  }
  return cell;
}

// Calls visit(owner, direction) for each vertex that p's death, or p in a first skin, brings about. No two particles
// bring about the same one.
template <class Visit>
CUTPROOF_DEVICE inline void visit_new_vertices(const DeviceView& w, int b, int p, const Visit& visit) {
  if (!changes_cells(w, b, p)) return;
  const BodyConstants& body = w.body[b];
  for (int d = 0; d < 6; ++d) {
    const int q = neighbour(w, body, p, d);
    const bool q_alive = q >= 0 && alive(w, q);
    if (w.skin_made[b]) {
      if (q_alive && w.vertex_of[6 * q + (d ^ 1)] < 0) visit(q, d ^ 1);
    } else {
      if (!q_alive && w.vertex_of[6 * p + d] < 0) visit(p, d);
    }
  }
}

}  // namespace skin_detail

// ---- Extraction

// Flags the cells to be extracted and counts the vertices that each particle brings about.
template <class Block>
CUTPROOF_DEVICE void mark_dirty_cells_kernel(Block& block, const DeviceView& w) {
  using namespace skin_detail;
  for (int64_t s = block.first(); s < w.counters->slots_used; s += block.stride()) {
    if (extracts(w, w.slot_body[s])) w.under_skin[s] = 0;
  }
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i);
    const int b = w.body_of[p];
    int vertices = 0;
    if (extracts(w, b) && changes_cells(w, b, p)) {
      const BodyConstants& body = w.body[b];
      for (int corner = 0; corner < 8; ++corner) {
        const int64_t node = body.node_begin + w.node[p] - corner_step(body, corner);
        // The flag is written by the lowest of the corners that change, so by one thread alone.
        bool first = true;
        for (int lower = 0; lower < corner && first; ++lower) {
          const int q = w.particle_at[node + corner_step(body, lower)];
          first = q < 0 || !changes_cells(w, b, q);
        }
        if (first) w.cell_dirty[node] = 1;
      }
      visit_new_vertices(w, b, p, [&](int, int) { ++vertices; });
    }
    w.particle_scratch[p] = vertices;
  }
}
CUTPROOF_KERNEL(mark_dirty_cells_kernel);

// cell_scratch[k]: dirty cell k needs a place. 0 beyond the last one, for the scan.
template <class Block>
CUTPROOF_DEVICE void count_new_cells_kernel(Block& block, const DeviceView& w) {
  using namespace skin_detail;
  const int dirty = w.counters->dirty_cells;
  for (int64_t k = block.first(); k < w.nodes; k += block.stride()) {
    int needed = 0;
    if (k < dirty) {
      const int node = w.dirty_cells[k];
      if (w.cell_of[node] < 0) {
        const Cell cell = cell_at(w, w.body[body_of_node(w, node)], node);
        needed = skin_table().corners[cell.inside][0] >= 0;
      }
    }
    w.cell_scratch[k] = needed;
  }
}
CUTPROOF_KERNEL(count_new_cells_kernel);

// Gives out places for new vertices and cells, or says that there are too few. After a fault the skin stays as it is.
// One thread.
template <class Block>
CUTPROOF_DEVICE void reserve_skin_kernel(Block& block, const DeviceView& w) {
  using namespace skin_detail;
  if (block.first() != 0) return;
  Counters& c = *w.counters;
  c.scratch[kVertexBase] = c.vertices_used;
  c.scratch[kCellBase] = c.cells_used;
  if (c.scratch[kNewVertices] > w.vertex_capacity - c.vertices_used) block.atomic_or(&c.fault, kVerticesFull);
  if (c.scratch[kNewCells] > w.cell_capacity - c.cells_used) block.atomic_or(&c.fault, kCellsFull);
  c.scratch[kSound] = (block.load(&c.fault) & (kVerticesFull | kCellsFull)) == 0;
  if (!c.scratch[kSound]) return;
  c.vertices_used += c.scratch[kNewVertices];
  c.cells_used += c.scratch[kNewCells];
}
CUTPROOF_KERNEL(reserve_skin_kernel);

// Vertices of the dead go, those that deaths or a first skin bring about come.
template <class Block>
CUTPROOF_DEVICE void renew_vertices_kernel(Block& block, const DeviceView& w) {
  using namespace skin_detail;
  if (!w.counters->scratch[kSound]) return;
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i);
    const int b = w.body_of[p];
    if (!extracts(w, b)) continue;
    if (w.skin_made[b] && died_now(w, b, p)) {
      for (int d = 0; d < 6; ++d) {
        const int v = w.vertex_of[6 * p + d];
        if (v < 0) continue;
        w.vertex_owner[v] = -1;
        w.vertex_of[6 * p + d] = -1;
      }
    }
    int v = w.counters->scratch[kVertexBase] + w.particle_scratch[p];
    visit_new_vertices(w, b, p, [&](int owner, int direction) {
      w.vertex_of[6 * owner + direction] = v;
      w.vertex_owner[v] = owner;
      w.vertex_direction[v] = static_cast<unsigned char>(direction);
      ++v;
    });
  }
}
CUTPROOF_KERNEL(renew_vertices_kernel);

// Writes the triangles of dirty cells and takes the flags down again. Says which clusters vertices hang on.
template <class Block>
CUTPROOF_DEVICE void extract_cells_kernel(Block& block, const DeviceView& w) {
  using namespace skin_detail;
  const SkinTable& table = skin_table();
  const bool sound = w.counters->scratch[kSound];
  for (int64_t k = block.first(); k < w.counters->dirty_cells; k += block.stride()) {
    const int node = w.dirty_cells[k];
    w.cell_dirty[node] = 0;
    if (!sound) continue;
    const Cell cell = cell_at(w, w.body[body_of_node(w, node)], node);
    const signed char* corners = table.corners[cell.inside];
    int place = w.cell_of[node];
    if (place < 0) {
      if (corners[0] < 0) continue;  // all tissue or all empty, and it never had a triangle
      place = w.counters->scratch[kCellBase] + w.cell_scratch[k];
      w.cell_of[node] = place;
      w.cell_node[place] = node;
    }
    for (int c = 0; c < 3 * kMostSkinTriangles; ++c) {
      int vertex = -1;
      const int edge = corners[c];
      if (edge >= 0) {
        const int low = table.low[edge], axis = table.axis[edge];
        const bool low_owns = cell.inside >> low & 1;
        const int owner = cell.corner[low_owns ? low : low + (1 << axis)];
        vertex = w.vertex_of[6 * owner + 2 * axis + (low_owns ? 0 : 1)];
      }
      w.cell_triangles[15 * static_cast<int64_t>(place) + c] = vertex;
    }
  }
  for (int64_t v = block.first(); v < w.counters->vertices_used; v += block.stride()) {
    const int p = w.vertex_owner[v];
    if (p < 0 || !skinned(w, w.body_of[p])) continue;
    for (int k = w.membership_begin[p]; k < w.membership_begin[p + 1]; ++k) {
      if (w.memberships[k] >= 0) block.store(&w.under_skin[w.memberships[k]], 1);
    }
  }
  for (int64_t b = block.first(); b < w.bodies; b += block.stride()) {
    if (sound && skinned(w, static_cast<int>(b))) w.skin_made[b] = 1;
  }
}
CUTPROOF_KERNEL(extract_cells_kernel);

template <class Launcher>
CUTPROOF_ENQUEUE void enqueue_skin_cells(Launcher& launcher, const DeviceView& w, const Plan&) {
  int* const scratch = w.counters->scratch;  // an address only: counters lie on the device
  launcher.items(mark_dirty_cells_kernel_object{}, w.particles, w);
  launcher.select(w.cell_dirty, w.nodes, w.dirty_cells, &w.counters->dirty_cells);
  launcher.items(count_new_cells_kernel_object{}, w.nodes, w);
  launcher.exclusive_scan(w.particle_scratch, w.particle_scratch, w.particles, scratch + skin_detail::kNewVertices);
  launcher.exclusive_scan(w.cell_scratch, w.cell_scratch, w.nodes, scratch + skin_detail::kNewCells);
  launcher.items(reserve_skin_kernel_object{}, 1, w);
  launcher.items(renew_vertices_kernel_object{}, w.particles, w);
  launcher.items(extract_cells_kernel_object{}, w.nodes, w);
}

// ---- Positions

// DeviceView::center from the final displacements, of the clusters that a vertex hangs on: deep in the tissue nobody
// asks.
template <class Block>
CUTPROOF_DEVICE void recenter_clusters_kernel(Block& block, const DeviceView& w) {
  using namespace skin_detail;
  const Team<Block, kClusterTeam> team(block);
  for (int64_t i = team.first(); i < w.counters->slots_used; i += team.stride()) {
    const int s = static_cast<int>(i);
    const int size = w.slot_size[s], b = w.slot_body[s];
    if (size == 0 || !skinned(w, b) || w.under_skin[s] == 0) continue;
    const int* const members = w.members + w.slot_begin[s];
    const Float3 base = xyz(w.displacement[members[0]]);
    // Σ w (d - base), Σ w (X - T), which is zero but for the rounding of T, and Σ w.
    typename Team<Block, kClusterTeam>::template Sums<7> sums;
    team.each(size, [&](int k) {
      const int p = members[k];
      const Float4 now = w.displacement[p];
      const float weight = now.w / static_cast<float>(w.membership_count[p]);
      const Float3 moved = weight * (xyz(now) - base), rest = weight * from_rest_center(w, w.body[b], p, s);
      float* const sum = sums.of(k);
      sum[0] += moved.x;
      sum[1] += moved.y;
      sum[2] += moved.z;
      sum[3] += rest.x;
      sum[4] += rest.y;
      sum[5] += rest.z;
      sum[6] += weight;
    });
    const auto total = team.total(sums);
    if (!team.leads()) continue;
    const Float3 moved = {total.v[0], total.v[1], total.v[2]}, rest = {total.v[3], total.v[4], total.v[5]};
    // The rounded T must not move the cluster (docs/design/decisions.md, Momentum and the rounding of sums).
    const Float3 turned = w.rotation[s] * rest - rest;
    w.center[s] = base + (1.0f / total.v[6]) * (moved - turned);
  }
}
CUTPROOF_KERNEL(recenter_clusters_kernel);

// The mean over the owner's clusters of (t - T) + (R - I)(X_v - T), as displacement from X_v. An owner without a
// cluster takes its vertices with it.
template <class Block>
CUTPROOF_DEVICE void place_vertices_kernel(Block& block, const DeviceView& w) {
  for (int64_t v = block.first(); v < w.counters->vertices_used; v += block.stride()) {
    const int p = w.vertex_owner[v];
    if (p < 0) continue;
    const int b = w.body_of[p];
    if (!skin_detail::skinned(w, b)) continue;
    const BodyConstants& body = w.body[b];
    const int direction = w.vertex_direction[v];
    const float reach = (direction % 2 == 0 ? body.alpha : -body.alpha) * body.h;
    const Float3 arm = {direction / 2 == 0 ? reach : 0.0f, direction / 2 == 1 ? reach : 0.0f,
                        direction / 2 == 2 ? reach : 0.0f};
    // Relative to where the first cluster puts it, so that summing costs no digits of d. (Not to the owner: where a
    // blade has pushed it away, that is far from what all of them say.)
    Float3 base = xyz(w.displacement[p]), sum;
    int clusters = 0;
    for (int k = w.membership_begin[p]; k < w.membership_begin[p + 1]; ++k) {
      const int s = w.memberships[k];
      if (s < 0) continue;
      const Float3 r = from_rest_center(w, body, p, s) + arm;
      const Float3 center = w.center[s], turned = w.rotation[s] * r - r;
      if (clusters == 0) base = center + turned;
      sum = sum + ((center - base) + turned);
      ++clusters;
    }
    w.vertex_position[v] = with_w(clusters > 0 ? base + (1.0f / static_cast<float>(clusters)) * sum : base, 0.0f);
  }
}
CUTPROOF_KERNEL(place_vertices_kernel);

template <class Launcher>
CUTPROOF_ENQUEUE void enqueue_skin_positions(Launcher& launcher, const DeviceView& w, const Plan&) {
  launcher.teams(recenter_clusters_kernel_object{}, skin_detail::kClusterTeam, w.slots_expected, w);
  launcher.items(place_vertices_kernel_object{}, w.vertex_capacity, w);
}

}  // namespace cutproof::gpu
