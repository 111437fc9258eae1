// A DeviceView in the host's memory: what a load is turned into before it is uploaded, and what a download is turned
// into states from. The host backend works on it directly.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "gpu/launch/plan.h"
#include "gpu/state/device_view.h"
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::gpu {

// How much room a DeviceView has beyond what is in it at load. Factors apply to slots and members; skin and additions
// are sized from the particles.
struct Capacity {
  double factor = 1;  // doubled each time something has become three quarters full
};

struct StagingBuffers {
  std::vector<BodyConstants> body;
  std::vector<int> frame, cut, edge_covered, skin_made;
  std::vector<float> substep_length;
  std::vector<MoveF> moves;
  std::vector<WallF> walls;
  std::vector<GripF> grips;
  std::vector<int> grip_particles;
  std::vector<unsigned char> grip_active;
  std::vector<Float3> grip_displacement;

  std::vector<int> body_of, node, particle_at, death;
  std::vector<Float4> displacement, velocity, start, predicted, pushed, earlier, pushed_earlier, impulse;
  std::vector<int> membership_count, membership_begin, memberships;

  std::vector<int> slot_begin, slot_size, slot_number, slot_body;
  std::vector<Matrix3> rotation;
  std::vector<int> degenerate;
  std::vector<float> mass;
  std::vector<int> rest_base;
  std::vector<Float3> rest_offset, center;
  std::vector<int> members;
  std::vector<unsigned char> slot_flag, rest_dirty;
  std::vector<int> affected, slot_scratch, label, member_scratch, proposal, best, small_clusters;
  std::vector<unsigned long long> additions;
  std::vector<unsigned char> particle_flag;
  std::vector<int> particle_scratch;

  std::vector<int> vertex_of, vertex_owner;
  std::vector<unsigned char> vertex_direction;
  std::vector<Float4> vertex_position;
  std::vector<int> cell_of, cell_node, cell_triangles;
  std::vector<unsigned char> cell_dirty;
  std::vector<int> dirty_cells, cell_scratch;
  std::vector<Counters> counters;

  int rotation_method = kJacobi4;
  // Skins as loaded: given back until a skin stage has made a body's own.
  std::vector<Skin> loaded_skin;

  // Calls visit(vector, pointer in `view`, keep) for every array. keep: its contents are part of the state, so a
  // download needs it; the rest is scratch or constant.
  template <class Visit>
  void each(DeviceView& view, Visit&& visit);

  // A DeviceView over these vectors.
  DeviceView view();
};

// Requires setups.size() == states.size(); throws std::invalid_argument if a state does not fit its setup, and
// MachineError if an index would not fit into 32 bits.
StagingBuffers make_staging_buffers(const std::vector<Setup>& setups, const std::vector<State>& states,
                                    int rotation_method, Capacity room);
Plan make_plan(const std::vector<Setup>& setups, const std::vector<State>& states, int rotation_method,
               SplitMethod split);
// The inverse of make_staging_buffers, after kernels have worked on it. Skin vertices come in the order (owner,
// direction), triangles in the order of their cells.
std::vector<State> extract_states(const StagingBuffers& staging, const std::vector<Setup>& setups);
// Only of the bodies that are wanted; the others' states are empty. `skins`: what an earlier call has found for bodies
// whose skin stage has not run since; filled where it is empty.
using KnownSkins = std::vector<std::optional<Skin>>;
std::vector<State> extract_states(const StagingBuffers& staging, const std::vector<Setup>& setups,
                                  const std::vector<bool>& wanted, KnownSkins& skins);

// Something is at least three quarters full, so the next load should have more room.
bool wants_capacity(const DeviceView& view, const Counters& counters);
// Throws MachineError if a stage found no room.
void require_no_fault(const Counters& counters);

template <class Visit>
void StagingBuffers::each(DeviceView& w, Visit&& visit) {
  constexpr bool kKeep = true, kScratch = false;
  visit(body, w.body, kScratch);
  visit(frame, w.frame, kKeep);
  visit(cut, w.cut, kKeep);
  visit(edge_covered, w.edge_covered, kKeep);
  visit(skin_made, w.skin_made, kKeep);
  visit(substep_length, w.substep_length, kScratch);
  visit(moves, w.moves, kScratch);
  visit(walls, w.walls, kScratch);
  visit(grips, w.grips, kScratch);
  visit(grip_particles, w.grip_particles, kScratch);
  visit(grip_active, w.grip_active, kScratch);
  visit(grip_displacement, w.grip_displacement, kScratch);
  visit(body_of, w.body_of, kScratch);
  visit(node, w.node, kScratch);
  visit(particle_at, w.particle_at, kScratch);
  visit(death, w.death, kKeep);
  visit(displacement, w.displacement, kKeep);
  visit(velocity, w.velocity, kKeep);
  visit(start, w.start, kScratch);
  visit(predicted, w.predicted, kScratch);
  visit(pushed, w.pushed, kScratch);
  visit(earlier, w.earlier, kScratch);
  visit(pushed_earlier, w.pushed_earlier, kScratch);
  visit(impulse, w.impulse, kKeep);
  visit(membership_count, w.membership_count, kScratch);
  visit(membership_begin, w.membership_begin, kScratch);
  visit(memberships, w.memberships, kScratch);
  visit(slot_begin, w.slot_begin, kKeep);
  visit(slot_size, w.slot_size, kKeep);
  visit(slot_number, w.slot_number, kKeep);
  visit(slot_body, w.slot_body, kKeep);
  visit(rotation, w.rotation, kKeep);
  visit(degenerate, w.degenerate, kKeep);
  visit(mass, w.mass, kKeep);
  visit(rest_base, w.rest_base, kKeep);
  visit(rest_offset, w.rest_offset, kKeep);
  visit(center, w.center, kScratch);
  visit(members, w.members, kKeep);
  visit(slot_flag, w.slot_flag, kScratch);
  visit(rest_dirty, w.rest_dirty, kScratch);
  visit(affected, w.affected, kScratch);
  visit(slot_scratch, w.slot_scratch, kScratch);
  visit(label, w.label, kScratch);
  visit(member_scratch, w.member_scratch, kScratch);
  visit(proposal, w.proposal, kScratch);
  visit(best, w.best, kScratch);
  visit(small_clusters, w.small_clusters, kScratch);
  visit(additions, w.additions, kScratch);
  visit(particle_flag, w.particle_flag, kScratch);
  visit(particle_scratch, w.particle_scratch, kScratch);
  visit(vertex_of, w.vertex_of, kScratch);
  visit(vertex_owner, w.vertex_owner, kKeep);
  visit(vertex_direction, w.vertex_direction, kKeep);
  visit(vertex_position, w.vertex_position, kKeep);
  visit(cell_of, w.cell_of, kScratch);
  visit(cell_node, w.cell_node, kKeep);
  visit(cell_triangles, w.cell_triangles, kKeep);
  visit(cell_dirty, w.cell_dirty, kScratch);
  visit(dirty_cells, w.dirty_cells, kScratch);
  visit(cell_scratch, w.cell_scratch, kScratch);
  visit(counters, w.counters, kKeep);
}

}  // namespace cutproof::gpu
