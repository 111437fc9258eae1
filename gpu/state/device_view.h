// gpu/state: a state in memory while kernels work on it. One DeviceView has all bodies of a load, one after the other.
// It consists of plain pointers and numbers and is passed to kernels by value. arrays.inc lists each array once.
// staging.h has the arrays in host memory, converts them from and to states, and determines their sizes.
//
// Indices: b body; p particle, over all bodies (body b has [particle_begin[b], particle_begin[b + 1])), in each body in
// the order of model/; s slot of a cluster, over all bodies; q place in the array of members.
//
// Positions are displacements from rest in single precision, x = X + d. So the motion is rounded, not the place, and a
// body of 200 spacings loses no digits to its size (docs/design/tolerances.md).
#pragma once
#include <cstdint>

#include "gpu/state/float3.h"
#include "model/setup.h"

namespace cutproof::gpu {

// Reasons to stop a run, combined by atomic_or in Counters::fault. The stage that would have overflowed has written
// nothing.
enum : int { kSlotsFull = 1, kMembersFull = 2, kVerticesFull = 4, kCellsFull = 8, kAdditionsFull = 16 };

// DeviceView::unsorted has an entry for so many particles.
inline constexpr int kParticleTile = 32;
CUTPROOF_BOTH inline int64_t particle_tiles(int64_t particles) {
  return (particles + kParticleTile - 1) / kParticleTile;
}

// Division by a number known in advance: n / d = n · multiplier >> shift for every 0 <= n < 2^31 (Granlund and
// Montgomery 1994). A normal division takes some 20 instructions, and kernels need two for each particle.
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
  Solver solver;
  Acceleration acceleration;
  int substeps, iterations, last_iterations;  // last: of the last substep of a frame
  float stiffness, volume_share, relaxation, damping, retardation;
  Float3 gravity;
  Criterion criterion;
  RemovedEnds remove;
  int needs_detection;
  float epsilon, strain;
  int debris;
  MergeRule merge_rule;
  int tau, cap;
  ExpandRule expand_rule;
  int depth;
  int skin_wanted, fit_cuts;
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

// model/blade.h BladePose; normal: along × back. Read in whole lines of 16 bytes, once for each particle near a blade.
struct alignas(16) PoseF {
  Float3 edge, along, back, normal;
};
CUTPROOF_BOTH inline PoseF make_pose(Float3 edge, Float3 along, Float3 back) {
  return {edge, along, back, cross(along, back)};
}
struct alignas(16) MoveF {
  PoseF from, to;
  int down;
};

struct GripF {
  int64_t table;  // first entry in DeviceView::grip_active and DeviceView::grip_displacement
};

// A body's numbers for its step in the frame in progress, in one cache line: most threads wait for nothing else before
// their own work.
struct alignas(128) Pace {
  int64_t first_move;  // of the blade in this frame, in DeviceView::moves; -1: none, or one that touches nothing
  int substeps, iterations, last_iterations;  // 0: its schedule is over
  int frame;
  float h, per_h;
  float prediction_time;        // dt + τ: from the start of a substep to y (step/prediction.cuh)
  float dt_fraction;            // dt / (dt + τ): the part of that time after which a particle is at x
  float decay, decay_per_dt;    // decay: e^(-c dt)
  float held_alpha, held_beta;  // coefficients of the push on held particles (step/iteration_numbers.cuh)
  float s, volume_share;        // pull towards the goal; β (docs/design/method.md §3)
  Float3 fall;                  // dt (dt + τ) · gravity
  Solver solver;                // of two bytes, so that nothing in here is padding
  Acceleration acceleration;
  int nodes[2];
  Divider by_row, by_layer;
  int wall_begin;
  short wall_count, frictionless_walls;
  float half_length, depth, clearance, blade_friction;
};
static_assert(sizeof(Pace) == 128);

// The numbers that an iteration has in all substeps (kernels/step/iteration_numbers.cuh).
struct alignas(16) IterationNumbers {
  float pull, carry;              // of the Chebyshev semi-iteration
  float lost_before, lost_after;  // lost part of a prediction's own shape
};

// A group: particles with the same holders (docs/design/method.md §13). Its particles have the places [begin, begin +
// size), ascending; its holders are DeviceView::holders[holder_begin .. holder_begin + holder_count).
struct alignas(16) GroupHead {
  int begin, size, body;
  int middle;  // index of its particle nearest to its rest centre
  int holder_begin, holder_count;
  float radius;  // [h], bound of the particles' distances from the rest centre, at rest
  int hold_set;  // of its particles
};
// A rest centre in kernels: h · (base + offset), where base has the grid coordinates of a particle.
struct alignas(16) RestCenter {
  int i, j, k;
  float x, y, z;
};
// One end of a pair of group and cluster: the other's index, and X_g - T_c [h].
struct alignas(16) Offset {
  float x, y, z;
  int index;
};
// The parts of a cluster: DeviceView::cluster_groups[group_begin .. group_begin + group_count), and
// DeviceView::cluster_loose[loose_begin .. loose_begin + loose_count). A vanished cluster has none.
struct alignas(16) ClusterHead {
  int group_begin, group_count, loose_begin, loose_count;
};
// Larger groups would give a team uneven work; kMostInGroup also keeps a body from being one job.
inline constexpr int kMostInGroup = 64;
// Fewer particles with the same holders do not justify a map; they are loose.
inline constexpr int kLeastInGroup = 4;

// DeviceView::group_resolved: particles are moved by the map, one by one, or by the map and a grip.
enum : int { kCarried = 0, kResolved = 1, kHeld = 2 };

// Sizes that change, and reports. One copy for all bodies.
struct Counters {
  int fault;               // see above
  int slots_used;          // slots [0, slots_used) have been given out
  int members_used;        // members [0, members_used) have been given out
  int vertices_used;       // skin vertices given out
  int cells_used;          // skin cells given out
  int changing;            // some running body lost a particle in this frame, or gets its first skin in this span
  int removed;             // particles removed by this frame's detection, over all bodies
  int debris;              // …, by this frame's split
  int fallen;              // split: length of DeviceView::fallen, without debris, which follows
  int whole_tissue;        // split: debris may be anywhere in some body, so all of its tissue is labelled
  int slots_before;        // split: slots used before it
  int affected;            // clusters that lost a particle in this frame: length of DeviceView::affected
  int merging;             // merge rounds go on while this is not 0
  int round;               // merge round, from 0: the next one
  int merging_round;       // merge: the round whose proposals are carried out
  int live_members;        // merge: members of all clusters
  int moving;              // merge: slots of lists to compact, because some union found no places…
  int moved_members;       // … and their members in all
  int small;               // length of DeviceView::small_clusters
  int expanding;           // some body of this span needs the expand stage
  int additions;           // length of DeviceView::additions
  int layer;               // expand: layers done
  int skin_changes;        // skin: particles that change the cells around them: length of DeviceView::fallen
  int stage_ran[6];        // by stage: launched in this span
  int changed;             // scratch of a stage's loop
  int failed;              // split: too few slots
  int additions_before;    // expand: length of DeviceView::additions before the layer in progress
  int growth;              // expand: members that the enlarged clusters need
  int memberships_before;  // expand: length of DeviceView::memberships in use before it
  // groups: these six are 0 after groups are made
  int groups_stale;      // clusters have changed since groups were made, or none were made yet
  int groups_whole;      // all groups are to be made anew
  int regrouped;         // clusters whose groups are made anew
  int remeasured;        // clusters whose lists of groups are made anew
  int due_particles;     // particles that get a new place…
  int due_pairs;         // … and their pairs of particle and cluster
  int groups;            // numbers in use; groups of size 0 are gone
  int placed;            // places used from the first on, by classes…
  int placed_last;       // … and from the last on, by particles in no class
  int loose;             // length of DeviceView::loose_places: living particles in no group, and gaps
  int pairs;             // of group and holder: length of DeviceView::holders
  int groups_before;     // groups: the first new one
  int listed[2][2];      // step, by turns of substeps: how many groups are listed in DeviceView::resolved_groups; by
                         // turns of iterations: when this one began, and by now
  int tracked[2];        // step, by turns of substeps: length of DeviceView::tracked_groups…
  int newly_tracked[3];  // … and groups added in the substep
  int scratch[8];
};

// The numbers that determine the sizes of arrays.
struct Extents {
  int bodies = 0, particles = 0;
  int64_t nodes = 0;                                   // over all bodies
  int64_t schedule_frames = 0, schedule_substeps = 0;  // of the schedules of all bodies, one after the other
  int wall_count = 0, grip_count = 0, hold_set_count = 0, hold_entry_count = 0;
  int64_t grip_substeps = 0;  // substeps of each grip's schedule, over all grips
  int most_substeps = 0;      // of any body
  int most_iterations = 0;    // of any body, in a substep
  int accelerated = 0;        // some body's iterations are accelerated
  int any_contact = 0;        // some body has a blade, a wall or a grip
  int retarded = 0;           // some body has retardation
  int keeps_volume = 0;       // some body keeps its volume
  int any_crossing = 0;       // some body has Body::surface_crossing
  int kept_count = 0;         // loaded skin vertices on edges that a cut has opened
  int slot_capacity = 0, member_capacity = 0, vertex_capacity = 0, cell_capacity = 0, addition_capacity = 0;
  int slots_expected = 0;  // clusters that grids are sized for: fewer than the capacity
  int group_capacity = 0, pair_capacity = 0, place_capacity = 0;
};

struct DeviceView : Extents {
#define ARRAY(name, Element, extent, lifetime, unset) Element* name = nullptr;
#include "gpu/state/arrays.inc"
};

inline constexpr int kDeadBefore = 0x7fffffff;
// DeviceView::vertex_reach of a new cut vertex until it is placed.
inline constexpr float kReachUnknown = -1;

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
// body: BodyConstants or Pace.
template <class Body>
CUTPROOF_BOTH inline Coordinates coordinates(const Body& body, int node) {
  const int k = node / body.by_layer;
  const int in_layer = node - k * (body.nodes[0] * body.nodes[1]);
  const int j = in_layer / body.by_row;
  return {in_layer - j * body.nodes[0], j, k};
}
CUTPROOF_BOTH inline Float3 rest_position(const BodyConstants& body, int node) {
  const Coordinates c = coordinates(body, node);
  return {body.h * static_cast<float>(c.i), body.h * static_cast<float>(c.j), body.h * static_cast<float>(c.k)};
}
// T_s.
CUTPROOF_BOTH inline RestCenter rest_center(const DeviceView& w, int s) {
  const Float3 o = w.rest_offset[s];
  return {w.rest_base[3 * s], w.rest_base[3 * s + 1], w.rest_base[3 * s + 2], o.x, o.y, o.z};
}
// From a rest centre to a node [h]: exact differences of grid coordinates, then one rounding.
CUTPROOF_BOTH inline Float3 nodes_between(RestCenter from, Coordinates to) {
  return {static_cast<float>(to.i - from.i) - from.x, static_cast<float>(to.j - from.j) - from.y,
          static_cast<float>(to.k - from.k) - from.z};
}
// X_p - T_s.
CUTPROOF_BOTH inline Float3 from_rest_center(const DeviceView& w, const BodyConstants& body, int p, int s) {
  return body.h * nodes_between(rest_center(w, s), coordinates(body, w.node[p]));
}
// Whether the body has lost particles in the frame in progress, so that its cluster stages run.
CUTPROOF_BOTH inline bool cut_now(const DeviceView& w, int b) { return w.frame[b] < w.body[b].frames && w.cut[b] >= 0; }
// Whether the body's schedule still runs.
CUTPROOF_BOTH inline bool running(const DeviceView& w, int b) { return w.frame[b] < w.body[b].frames; }

}  // namespace cutproof::gpu
