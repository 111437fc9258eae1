// Sizes of the arrays, and overflows.
#include <algorithm>
#include <string>

#include "gpu/state/indices.h"
#include "gpu/state/staging.h"

namespace cutproof::gpu {

namespace {

// A bound of the (cluster, particle) pairs that expansion finds, some several times: other ends of edges, and at
// greater depth the grid nodes around these.
int64_t additions_bound(const StagingBuffers& staging) {
  int64_t additions = 0;
  for (std::size_t b = 0; b < staging.body.size(); ++b) {
    const BodyConstants& body = staging.body[b];
    const bool covered = body.expand_rule == ExpandRule::edge_cover && staging.edge_covered[b];
    if (body.expand_rule == ExpandRule::none || covered) continue;
    const int64_t r = std::min(body.depth, 64);  // more would pass the limit below for any body
    const int64_t around = r <= 1 ? 1 : (2 * r + 1) * (2 * r * r + 2 * r + 3) / 3;  // grid nodes within r edges of one
    additions += 6 * int64_t{body.particle_end - body.particle_begin} * around;
  }
  return additions;
}

template <class Condition>
bool some_body(const StagingBuffers& staging, Condition condition) {
  return std::any_of(staging.body.begin(), staging.body.end(), condition);
}

}  // namespace

Extents extents_of(const StagingBuffers& loaded, Capacity capacity) {
  const auto size = [](const auto& vector) { return static_cast<int64_t>(vector.size()); };
  const int64_t particles = size(loaded.node), nodes = size(loaded.particle_at);
  const int64_t slots = size(loaded.slot_size), members = size(loaded.members);
  const auto scaled = [&](int64_t count) { return static_cast<int64_t>(capacity.factor * static_cast<double>(count)); };
  Extents extents;
  extents.bodies = narrow(size(loaded.body), "bodies");
  extents.particles = narrow(particles, "particles");
  extents.nodes = nodes;
  extents.schedule_frames = size(loaded.substep_length);
  extents.schedule_substeps = size(loaded.moves);
  extents.wall_count = narrow(size(loaded.walls), "walls");
  extents.grip_count = narrow(size(loaded.grips), "grips");
  extents.hold_set_count = narrow(size(loaded.hold_begin), "sets of grips") - 1;
  extents.hold_entry_count = narrow(size(loaded.hold_grips), "sets of grips");
  extents.grip_substeps = size(loaded.grip_active);
  for (const BodyConstants& body : loaded.body) {
    extents.most_substeps = std::max(extents.most_substeps, body.substeps);
    extents.most_iterations = std::max(extents.most_iterations, body.iterations);
  }
  // The one set of kernels for bodies with retardation needs every array (plan.h).
  extents.retarded = some_body(loaded, [](const BodyConstants& b) { return b.retardation > 0; });
  extents.keeps_volume = some_body(loaded, [](const BodyConstants& b) { return b.volume_share > 0; });
  extents.accelerated = some_body(
      loaded, [](const BodyConstants& b) { return b.acceleration != Acceleration::none || b.retardation > 0; });
  extents.any_contact = some_body(loaded, [](const BodyConstants& b) {
    return b.retardation > 0 || b.has_blade || b.wall_end > b.wall_begin || b.grip_end > b.grip_begin;
  });
  extents.any_crossing = !loaded.surface_crossing.empty();
  extents.kept_count = narrow(size(loaded.kept_edge), "skin vertices");
  // A cut makes at most one new cluster for each member that it touches: all of a small body at once, a plane's share
  // of a large one. A merge writes unions behind the present lists, and a round needs at most as much as all lists
  // together. Expansion copies the lists that it enlarges.
  const int64_t additions = std::min(additions_bound(loaded), scaled(1'000'000 + 3 * particles));
  const int64_t cells = std::min(nodes, scaled(4'000'000 + particles)) + 64;
  narrow(15 * cells, "skin cells");
  narrow(6 * particles, "particles");
  extents.slot_capacity =
      narrow(slots + scaled(std::min(members, std::max<int64_t>(65536, 2 * slots))) + 64, "clusters");
  extents.slots_expected = std::min(extents.slot_capacity, narrow(slots + slots / 4 + 64, "clusters"));
  extents.member_capacity = narrow(members + scaled(2 * members + 4096) + additions, "cluster members");
  extents.vertex_capacity = narrow(std::min(6 * particles, scaled(4'000'000 + particles)) + 64, "skin vertices");
  extents.cell_capacity = narrow(cells, "skin cells");
  extents.addition_capacity = narrow(additions + 64, "expanded particles");
  // Particles that change groups get new places until none are left; then all get theirs anew.
  extents.place_capacity = narrow(particles + particles / 8 + 64, "particles");
  // A group has at least kLeastInGroup particles, all of them members of each holder.
  extents.pair_capacity = extents.member_capacity / kLeastInGroup;
  extents.group_capacity = static_cast<int>(std::min(particles / kLeastInGroup, int64_t{extents.pair_capacity}));
  return extents;
}

std::size_t empty_bytes(StagingBuffers& contents, std::size_t of_arrays) {
  std::size_t sum = 0;
  DeviceView view = contents.view();
  contents.each(view, [&](const auto& array, const auto& vector, const auto& pointer) {
    const auto extent = static_cast<std::size_t>(array.extent);
    if (array.unset || vector.size() >= extent || extent * sizeof(*pointer) < of_arrays) return;
    sum += (extent - vector.size()) * sizeof(*pointer);
  });
  return sum;
}

Extents in_use(const Extents& extents, const Counters& counters) {
  Extents used = extents;
  used.slot_capacity = counters.slots_used;
  used.member_capacity = counters.members_used;
  used.vertex_capacity = counters.vertices_used;
  used.cell_capacity = counters.cells_used;
  return used;
}

bool wants_capacity(const Extents& of, const Counters& c) {
  const auto full = [](int used, int capacity) { return int64_t{4} * used > int64_t{3} * capacity; };
  // Vertices and cells have capacity for the most that is possible: six per particle, one per node.
  return full(c.slots_used, of.slot_capacity) || full(c.members_used, of.member_capacity) ||
         (of.vertex_capacity < int64_t{6} * of.particles && full(c.vertices_used, of.vertex_capacity)) ||
         (of.cell_capacity < of.nodes && full(c.cells_used, of.cell_capacity));
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
