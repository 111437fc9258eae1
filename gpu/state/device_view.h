// How a state lies in memory while kernels work on it: one DeviceView for all bodies of a load, arrays one after the
// other. Plain pointers and numbers, passed to kernels by value. Who allocates: backend (state_transfer.h).
//
// Indices: b body; p particle, over all bodies (body b has [particle_begin[b], particle_begin[b + 1])), in each body in
// the order of model/; s slot of a cluster, over all bodies; q place in the array of members.
//
// Positions are kept as displacements from rest in single precision, x = X + d: what is rounded is then the motion and
// not the place, so a body of 200 spacings loses no digits to its size (docs/tolerances.md).
#pragma once
#include <cstdint>

#include "gpu/kernels/float3.h"

namespace cutproof::gpu {

enum : int { kImplicit = 0, kPublished = 1 };                                           // Solver
enum : int { kPlain = 0, kChebyshev = 1 };                                              // Acceleration
enum : int { kNoCriterion = 0, kDistance = 1, kGeometric = 2, kStrain = 3 };            // Criterion
enum : int { kNoMerge = 0, kDeterministic = 1, kPublishedMerge = 2, kSinglePass = 3 };  // MergeRule
enum : int { kNoExpand = 0, kEdgeCover = 1, kPublishedExpand = 2 };                     // ExpandRule

// Why a run had to stop; written with atomic_or into Counters::fault. The stage that would have overflowed has written
// nothing.
enum : int { kSlotsFull = 1, kMembersFull = 2, kVerticesFull = 4, kCellsFull = 8, kAdditionsFull = 16 };

// Which rotation method match_shapes uses (rotation.cuh); chosen by measurement, docs/rotations.md.
enum : int { kJacobi4 = 0, kMueller2016 = 1, kApd = 2, kSvd = 3, kQuest = 4, kNewton = 5 };

// Division by a number that is known before: n / d = n · multiplier >> shift for every 0 <= n < 2^31 (Granlund and
// Montgomery 1994). A division proper takes some 20 instructions, and kernels need two for each particle they look at.
struct Divider {
  unsigned multiplier;
  int shift;
};
CUTPROOF_BOTH inline Divider divider_of(int divisor) {
  int bits = 0;
  while ((1LL << bits) < divisor) ++bits;
  return {static_cast<unsigned>((1ULL << (31 + bits)) / static_cast<unsigned>(divisor) + 1), 31 + bits};
}
CUTPROOF_BOTH inline int operator/(int n, Divider d) {
  return static_cast<int>(static_cast<unsigned long long>(static_cast<unsigned>(n)) * d.multiplier >> d.shift);
}

// One body's parameters; constant between loads.
struct BodyConstants {
  int particle_begin, particle_end;
  int64_t node_begin;        // its first node in DeviceView::particle_at
  int nodes[3];              // of its grid
  Divider by_row, by_layer;  // by nodes[0] and by nodes[0] · nodes[1]
  float h;
  int solver, acceleration, substeps, iterations;
  float stiffness, relaxation, damping;
  Float3 gravity;
  int criterion, needs_detection;
  float epsilon, strain;
  int debris;
  int merge_rule, tau, cap;
  int expand_rule, depth;
  int skin_wanted;
  float alpha;
  int wall_begin, wall_end;  // in DeviceView::walls
  int grip_begin, grip_end;  // in DeviceView::grips
  int has_blade;
  float blade_length, blade_depth, blade_thickness, blade_friction, clearance;
  int frames;           // length of the schedule
  int64_t schedule;     // first substep in DeviceView::moves (blade) and in each grip's tables: schedule + f·S + s
  int64_t frame_begin;  // first frame in DeviceView::substep_length
};

struct WallF {
  int axis, side;
  float offset, friction;
};

struct PoseF {
  Float3 edge, along, back;  // model/blade.h BladePose
};
struct MoveF {
  PoseF from, to;
  int down;
};

struct GripF {
  int particle_begin, particle_end;  // in DeviceView::grip_particles
  int64_t table;                     // first entry in DeviceView::grip_active and DeviceView::grip_displacement
};

// What changes in size or says what happened. One copy for all bodies.
struct Counters {
  int fault;               // see above
  int slots_used;          // slots [0, slots_used) have been given out
  int members_used;        // members [0, members_used) have been given out
  int vertices_used;       // skin vertices given out
  int cells_used;          // skin cells given out
  int cut;                 // some running body lost a particle in this frame
  int extracting;          // some running body has skin cells to extract: cut, or no skin yet
  int removed;             // particles removed by this frame's detection, over all bodies
  int debris;              // …, by this frame's split
  int affected;            // clusters that lost a particle in this frame: length of DeviceView::affected
  int merging;             // merge rounds go on while this is not 0
  int round;               // merge round, from 0: the next one
  int merging_round;       // merge: the round whose proposals are being carried out
  int live_members;        // merge: members of all clusters
  int small;               // length of DeviceView::small_clusters
  int expanding;           // some body of this span needs the expand stage
  int additions;           // length of DeviceView::additions
  int layer;               // expand: layers done
  int dirty_cells;         // skin cells to be extracted again
  int stage_ran[6];        // by stage: launched in this span
  int changed;             // scratch of a stage's loop
  int failed;              // the stage in progress has found no room
  int additions_before;    // expand: length of DeviceView::additions before the layer in progress
  int growth;              // expand: members that the enlarged clusters need
  int memberships_before;  // expand: length of DeviceView::memberships in use before it
  int scratch[8];
};

struct DeviceView {
  int bodies = 0, particles = 0;
  int64_t nodes = 0;  // over all bodies
  int slot_capacity = 0, member_capacity = 0, vertex_capacity = 0, cell_capacity = 0, addition_capacity = 0;
  int rotation_method = kJacobi4;
  int any_contact = 0;  // some body has a blade, a wall or a grip

  BodyConstants* body = nullptr;    // [bodies]
  int* frame = nullptr;             // [bodies] State::frame
  int* cut = nullptr;               // [bodies] code of this frame's removals (see death); -1: nothing was removed
  int* edge_covered = nullptr;      // [bodies]
  int* skin_made = nullptr;         // [bodies] 0: the next skin stage extracts every cell
  float* substep_length = nullptr;  // see BodyConstants::frame_begin
  MoveF* moves = nullptr;
  WallF* walls = nullptr;
  GripF* grips = nullptr;
  int* grip_particles = nullptr;  // p
  unsigned char* grip_active = nullptr;
  Float3* grip_displacement = nullptr;

  // Particles, [particles] each.
  int* body_of = nullptr;
  int* node = nullptr;             // in its body's grid
  int* particle_at = nullptr;      // [nodes] p or -1
  int* death = nullptr;            // -1: alive; 2 f + 2: removed by detection in frame f; 2 f + 3: as debris by
                                   // its split; 2 f and 2 f + 1: in the removed and debris lists of a state loaded
                                   // at frame f; kDeadBefore: dead at load and in neither
  Float4* displacement = nullptr;  // d; w: mass m_i
  Float4* velocity = nullptr;
  Float4* start = nullptr;           // d when the substep began
  Float4* predicted = nullptr;       // d~ of x~; w: side of the blade, +1 or -1; 0: held by a grip
  Float4* pushed = nullptr;          // displacement by contacts and grips, carried through the iterations
  Float4* earlier = nullptr;         // d of one iteration ago; empty unless some body is accelerated
  Float4* pushed_earlier = nullptr;  // pushed of one iteration ago; empty too without contacts
  Float4* impulse = nullptr;         // per mass, this frame; Σ m_i impulse_i = State::impulse
  int* membership_count = nullptr;   // n_i: how many clusters hold it
  int* membership_begin =
      nullptr;  // [particles + 1] memberships of p: memberships[membership_begin[p] .. membership_begin[p + 1])
  int* memberships = nullptr;  // [member_capacity] slots, ascending, -1: none (any more) last; in no
                               // particular but a reproducible order from split to the beginning of skin

  // Clusters, [slot_capacity] each. Slots are given out in ascending order of number and never reused within a load
  // (the backend compacts them between frames), so the order of slots is the order of numbers.
  int* slot_begin = nullptr;  // members[slot_begin .. slot_begin + slot_size)
  int* slot_size = nullptr;   // 0: the cluster is gone
  int* slot_number = nullptr;
  int* slot_body = nullptr;
  Matrix3* rotation = nullptr;  // last R_c
  int* degenerate = nullptr;
  float* mass = nullptr;                // M_c
  int* rest_base = nullptr;             // [3 · slot_capacity] grid coordinates of one member
  Float3* rest_offset = nullptr;        // T_c = h · (rest_base + rest_offset)
  Float3* center = nullptr;             // t_c - T_c
  int* members = nullptr;               // [member_capacity] p, ascending within a cluster
  unsigned char* slot_flag = nullptr;   // scratch of a stage
  unsigned char* rest_dirty = nullptr;  // rest frame is to be recomputed
  int* affected = nullptr;              // slots that lost a particle in this frame, ascending
  int* slot_scratch = nullptr;          // [4 · slot_capacity]
  int* label = nullptr;                 // [member_capacity] scratch of split: by place in members
  int* member_scratch = nullptr;        // [member_capacity] scratch of split: by place in members
  int* proposal = nullptr;              // merge: the t that slot s proposes, or -1
  int* best = nullptr;                  // merge: the s whose proposal has the smallest key of those naming this slot
  int* small_clusters = nullptr;        // slots
  unsigned long long* additions = nullptr;  // [addition_capacity] expand: slot · 2^32 + particle
  unsigned char* particle_flag = nullptr;   // [particles] scratch
  int* particle_scratch = nullptr;          // [2 · particles]

  // Skin.
  int* vertex_of = nullptr;     // [6 · particles] vertex of owner p in direction d, or -1
  int* vertex_owner = nullptr;  // [vertex_capacity] p; -1: gone
  unsigned char* vertex_direction = nullptr;
  Float4* vertex_position = nullptr;    // displacement from X_v
  int* cell_of = nullptr;               // [nodes] the skin cell whose lowest corner is the node, or -1
  int* cell_node = nullptr;             // [cell_capacity] node over all bodies
  int* cell_triangles = nullptr;        // [cell_capacity · 15] up to 5 triangles, vertices; -1: none
  unsigned char* cell_dirty = nullptr;  // [nodes]
  int* dirty_cells = nullptr;           // [nodes] nodes of cells to be extracted again, ascending
  int* cell_scratch = nullptr;          // [nodes]

  Counters* counters = nullptr;
};

inline constexpr int kDeadBefore = 0x7fffffff;

CUTPROOF_BOTH inline bool alive(const DeviceView& w, int p) { return w.death[p] < 0; }

// Step in the linear node index along direction d of model/grid.h kDirections: +x -x +y -y +z -z.
CUTPROOF_BOTH inline int node_step(const BodyConstants& body, int direction) {
  const int step = direction < 2 ? 1 : direction < 4 ? body.nodes[0] : body.nodes[0] * body.nodes[1];
  return direction % 2 == 0 ? step : -step;
}
// The particle beyond the grid edge that leaves p along `direction`, alive or not; -1 if there is none.
CUTPROOF_BOTH inline int neighbour(const DeviceView& w, const BodyConstants& body, int p, int direction) {
  return w.particle_at[body.node_begin + w.node[p] + node_step(body, direction)];
}
struct Coordinates {
  int i, j, k;
};
CUTPROOF_BOTH inline Coordinates coordinates(const BodyConstants& body, int node) {
  const int k = node / body.by_layer;
  const int in_layer = node - k * (body.nodes[0] * body.nodes[1]);
  const int j = in_layer / body.by_row;
  return {in_layer - j * body.nodes[0], j, k};
}
CUTPROOF_BOTH inline Float3 rest_position(const BodyConstants& body, int node) {
  const Coordinates c = coordinates(body, node);
  return {body.h * static_cast<float>(c.i), body.h * static_cast<float>(c.j), body.h * static_cast<float>(c.k)};
}
// X_p - T_s: exact differences of grid coordinates, then one rounding.
CUTPROOF_BOTH inline Float3 from_rest_center(const DeviceView& w, const BodyConstants& body, int p, int s) {
  const Coordinates c = coordinates(body, w.node[p]);
  const Float3 o = w.rest_offset[s];
  return {body.h * (static_cast<float>(c.i - w.rest_base[3 * s]) - o.x),
          body.h * (static_cast<float>(c.j - w.rest_base[3 * s + 1]) - o.y),
          body.h * (static_cast<float>(c.k - w.rest_base[3 * s + 2]) - o.z)};
}
// Whether the body has lost particles in the frame in progress, so that its cluster stages run.
CUTPROOF_BOTH inline bool cut_now(const DeviceView& w, int b) { return w.frame[b] < w.body[b].frames && w.cut[b] >= 0; }
// Whether the body's schedule still runs.
CUTPROOF_BOTH inline bool running(const DeviceView& w, int b) { return w.frame[b] < w.body[b].frames; }

}  // namespace cutproof::gpu
