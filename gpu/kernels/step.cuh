// Stage step (docs/design/method.md §3, §13): position-based dynamics with shape matching, one DeviceView of bodies.
//
// The particles of a group (groups.cuh) are carried: they are at d~ + M(r) - l e, with e = d~ - base from the
// prediction, r = X - X_g, l a number of body and iteration, and M one affine map for all of them. A prediction follows
// from the map of the substep before in the same way, so a frame touches particles twice: it sums what they begin with
// (begin_first_substep), and puts them where they have come to (end_step). Between these a substep touches groups
// (begin_substep) and an iteration touches clusters (match_shapes, from the moments of their groups) and groups
// (advance: the mean of their holders' goals is the next map, and has the next moments). A group that may touch a
// contact is resolved: from there to the end of the substep its particles have positions of their own, and to the end
// of the frame it is tracked: each substep begins with its particles, as it does with those that are in no group.
//
// Everything is a displacement from rest: with d = x - X,  t_c - T_c = Σ w d / M,  and the goal of particle i in
// cluster c lies at X_i + (t_c - T_c) + (R_c - I)(X_i - T_c). A body at rest or moved as a whole is then reproduced
// exactly: d is the same everywhere, all moments about bases are zero, and R_c is I to the last bit.
#pragma once
#include <type_traits>

#include "gpu/kernels/contacts.cuh"
#include "gpu/kernels/float3.h"
#include "gpu/kernels/frame.cuh"
#include "gpu/kernels/groups.cuh"
#include "gpu/kernels/rotation.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/launch/plan.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "model/stage.h"

namespace cutproof::gpu {

// What other work a team begins with where so many threads have had something to do, the first of all and those behind
// them: the next ones begin with the first. (Not the last threads of all, which are the last to come.)
template <class AnyTeam>
CUTPROOF_DEVICE int64_t behind(const AnyTeam& team, int threads) {
  const auto teams = static_cast<unsigned>(team.stride());  // a remainder of 64 bits takes a hundred instructions
  unsigned busy = (static_cast<unsigned>(threads) + AnyTeam::kLanes - 1) / AnyTeam::kLanes;
  if (busy >= teams) busy %= teams;
  const int64_t first = team.first() - busy;
  return first < 0 ? first + teams : first;
}

// Threads that have had something to do where `jobs` of smaller teams come first, and behind them `others` of larger
// ones.
template <class Small, class Large>
CUTPROOF_DEVICE int busy_threads(const Small&, int jobs, const Large&, int others) {
  return jobs * Small::kLanes + (others > 0 ? (others + 1) * Large::kLanes : 0);  // + 1: they begin with a whole team
}

// Of the jobs that the lanes of a warp have found, one for each of its teams: this one's, or -1 if none is left for it.
template <class Warp, class AnyTeam>
CUTPROOF_DEVICE int take_each(const Warp& warp, const AnyTeam& team, unsigned& found, int job) {
  constexpr int kTeams = Warp::kLanes / AnyTeam::kLanes;
  int mine = -1;
  for (int k = 0; k < kTeams && found != 0; ++k) {
    const int next = warp.take(found, job);
    if (k == team.first() % kTeams) mine = next;
  }
  return mine;
}

namespace step_detail {

// Whether a body takes part in this iteration. One with fewer substeps or iterations than others waits.
CUTPROOF_DEVICE inline bool takes_part(const Pace& pace, int substep, int iteration) {
  return substep < pace.substeps && iteration < pace.iterations;
}

// The body of a particle, a cluster, a group. (Of a load of one body nothing has to be waited for.)
CUTPROOF_DEVICE inline int body_index(const DeviceView& w, int p) { return w.bodies == 1 ? 0 : w.body_of[p]; }
CUTPROOF_DEVICE inline int body_of_slot(const DeviceView& w, int s) { return w.bodies == 1 ? 0 : w.slot_body[s]; }
CUTPROOF_DEVICE inline int body_of_group(const DeviceView& w, const GroupHead& head) {
  return w.bodies == 1 ? 0 : head.body;
}

CUTPROOF_DEVICE inline Float3 grid_node(const Pace& pace, int node) {
  const Coordinates c = coordinates(pace, node);
  return {static_cast<float>(c.i), static_cast<float>(c.j), static_cast<float>(c.k)};
}

// (X_p - T_s) / h.
CUTPROOF_DEVICE inline Float3 nodes_from_rest_center(const DeviceView& w, Coordinates c, int s) {
  return nodes_between(rest_center(w, s), c);
}

// e^(-x) for x >= 0, within 2 units in the last place, by operations that give the same bits on every machine (the
// libraries' expf do not).
CUTPROOF_DEVICE inline float decay_by(float x) {
  if (x > 87.0f) return 0.0f;  // e^(-87) is the last above the least normal number
  const float n = rintf(x * -1.44269504f);
  // ln 2 in two parts, the first short enough for n times it to be exact.
  const float r = fmaf(n, -1.42860677e-6f, fmaf(n, -0.693145752f, -x));
  float sum = 1.0f / 5040.0f;
  sum = fmaf(sum, r, 1.0f / 720.0f);
  sum = fmaf(sum, r, 1.0f / 120.0f);
  sum = fmaf(sum, r, 1.0f / 24.0f);
  sum = fmaf(sum, r, 1.0f / 6.0f);
  sum = fmaf(sum, r, 0.5f);
  sum = fmaf(sum, r, 1.0f);
  sum = fmaf(sum, r, 1.0f);
  return ldexpf(sum, static_cast<int>(n));
}

// Chebyshev semi-iteration (docs/design/method.md §11), order >= 1: x + pull (g - x) + carry (x - earlier), with g
// where the plain iteration goes from x. The recurrence of the weights in closed form: omega_j = (1 + q) (1 + q^(j-1))
// / (1 + q^j) for j >= 2, with q = ((1 - r) / (1 + r))², r² = 1 - b.
struct Combination {
  float pull, carry;
  template <class Number>
  CUTPROOF_DEVICE Number operator()(Number plain, Number now, Number earlier) const {
    return now + (pull * (plain - now) + carry * (now - earlier));
  }
};

// 1 - b: the eigenvalues that the weights are made for are those of [0, b], b = min(s, 0.95).
inline constexpr float kLeastGap = 0.05f;

CUTPROOF_DEVICE inline Combination chebyshev(float kdt2, int order) {
  const float gap = 1.0f / (1.0f + kdt2);
  const float r2 = gap > kLeastGap ? gap : kLeastGap;
  const float r = sqrtf(r2);
  const float root = (1.0f - r) / (1.0f + r);
  const float q = root * root;
  float omega = 1;
  if (order > 1) {
    float power = 1, square = q;  // power: q^(order - 1)
    for (int n = order - 1; n > 0; n /= 2) {
      if (n % 2 != 0) power *= square;
      square *= square;
    }
    omega = (1.0f + q) * (1.0f + power) / (1.0f + q * power);
  }
  return {omega * (2.0f / (1.0f + r2)), omega - 1.0f};
}

// The M of a group: its rows of h L, and its a (arrays.inc).
struct Map {
  Float4 row[3];
  // L (h r)
  CUTPROOF_DEVICE Float3 linear(Float3 r) const {
    return {row[0].x * r.x + row[0].y * r.y + row[0].z * r.z, row[1].x * r.x + row[1].y * r.y + row[1].z * r.z,
            row[2].x * r.x + row[2].y * r.y + row[2].z * r.z};
  }
  CUTPROOF_DEVICE Float3 moved() const { return {row[0].w, row[1].w, row[2].w}; }
  // a + L (h r)
  CUTPROOF_DEVICE Float3 operator()(Float3 r) const { return moved() + linear(r); }
};
CUTPROOF_DEVICE inline Map load_map(const Float4* rows, int g) {
  return {{rows[3 * int64_t{g}], rows[3 * int64_t{g} + 1], rows[3 * int64_t{g} + 2]}};
}
// Entry by entry.
template <class Of>
CUTPROOF_DEVICE Float4 row_of(Of of, Float4 a, Float4 b) {
  return {of(a.x, b.x), of(a.y, b.y), of(a.z, b.z), of(a.w, b.w)};
}
CUTPROOF_DEVICE inline float entry(const Map& map, int row, int k) {
  const Float4 r = map.row[row];
  return k == 0 ? r.x : k == 1 ? r.y : k == 2 ? r.z : r.w;
}

// l: how much of a prediction's own shape is lost after so many iterations.
CUTPROOF_DEVICE inline float lost_fraction(const Pace& pace, int iterations) {
  if (iterations == 0) return 0.0f;
  if (pace.solver == Solver::implicit) return pace.s;
  float kept = 1.0f, power = 1.0f - pace.s;
  for (int n = iterations; n > 0; n /= 2) {
    if (n % 2 != 0) kept *= power;
    power *= power;
  }
  return 1.0f - kept;
}

// Of one body, in one iteration.
struct Iteration {
  float s;
  bool implicit;
  bool combined;  // the first iteration is plain
  bool kept;      // the last has no next one to keep anything for
  Combination combination;
  float lost_before, lost_after;
};
CUTPROOF_DEVICE inline Iteration iteration_of(const Pace& pace, int iteration, const IterationNumbers& numbers) {
  Iteration now = {};
  now.s = pace.s;
  now.implicit = pace.solver == Solver::implicit;
  const bool accelerated = pace.acceleration == Acceleration::chebyshev;
  now.combined = accelerated && iteration > 0;
  now.kept = accelerated && iteration + 1 < pace.iterations;
  now.combination = {numbers.pull, numbers.carry};
  now.lost_before = numbers.lost_before;
  now.lost_after = numbers.lost_after;
  return now;
}
// Computed once a frame, because a root and powers take long.
CUTPROOF_DEVICE inline IterationNumbers iteration_numbers(const Pace& pace, float kdt2, int iteration) {
  Combination combination = {};
  if (pace.acceleration == Acceleration::chebyshev && iteration > 0) combination = chebyshev(kdt2, iteration);
  return {combination.pull, combination.carry, lost_fraction(pace, iteration), lost_fraction(pace, iteration + 1)};
}
CUTPROOF_DEVICE inline IterationNumbers* numbers_of(const DeviceView& w, int body, int iteration) {
  return &w.iterations[int64_t{body} * (w.most_iterations + 1) + iteration];
}
CUTPROOF_DEVICE inline Iteration iteration_of(const DeviceView& w, int body, const Pace& pace, int iteration) {
  return iteration_of(pace, iteration, constant(numbers_of(w, body, iteration)));
}
// l at the end of a substep.
CUTPROOF_DEVICE inline float lost_in_all(const DeviceView& w, int body, const Pace& pace) {
  return constant(numbers_of(w, body, pace.iterations)).lost_before;
}

// The displacement [m] that the active grip of a set gives to its particles in a substep, from where they began. At
// most one is active at a time (model/setup.h).
struct Held {
  bool active = false;
  Float3 moved;
};
CUTPROOF_DEVICE inline Held held_by(const DeviceView& w, const Pace& pace, int set, int substep) {
  Held held;
  if (set == 0) return held;
  for (int k = w.hold_begin[set]; k < w.hold_begin[set + 1]; ++k) {
    const int64_t entry = w.grips[w.hold_grips[k]].table + int64_t{pace.frame} * pace.substeps + substep;
    if (w.grip_active[entry]) held = {true, w.grip_displacement[entry]};
  }
  return held;
}

// A group and what its lanes need of it.
struct Group {
  int index;
  GroupHead head;
  RestCenter center;
  // X - X_g [h] of its particle k.
  CUTPROOF_DEVICE Float3 rest(const DeviceView& w, const Pace& pace, int k) const {
    return rest_of(pace, constant(&w.place_node[head.begin + k]));
  }
  // The same of the particle that is at this node.
  CUTPROOF_DEVICE Float3 rest_of(const Pace& pace, int node) const {
    return nodes_between(center, coordinates(pace, node));
  }
};
CUTPROOF_DEVICE inline Group group_of(const DeviceView& w, int g) {
  return {g, constant(&w.group_head[g]), constant(&w.group_center[g])};
}

// Lanes that share a group: one for each row of its map; and where its particles are looked at one by one, in the pass
// over all of them and while it is resolved. Of a large load one thread has all rows, and half as many lanes do the
// work of all, but in an iteration, whose resolved groups are few.
inline constexpr int kRowTeam = 4, kParticleTeam = 16, kResolvedTeam = 32;
inline constexpr int kMostByRows = 150'000;  // particles of a load; more make it a large one
// Lanes that a tracked or a resolved group gets, where kRows of them share a carried one. (Half a warp leaves half as
// many idle, and takes longer: of a million particles on a floor a frame is an eighth shorter, of a million that only a
// blade touches a hundredth longer.)
template <int kRows>
inline constexpr int kResolvedLanes = kRows == 1 ? kResolvedTeam / 2 : kResolvedTeam;

// Weighted sums in the order of arrays.inc: 4 axis + k: of e rᵀ / h; 4 axis + 3: of e. kOrder: lanes whose work the
// team does.
template <class AnyTeam, int kOrder>
using GroupSums = typename AnyTeam::template Sums<12, kOrder>;

// The rows of a map, each in the lane that has the item of its axis (Team::each).
template <class AnyTeam>
class Rows {
 public:
  CUTPROOF_DEVICE Float4& of(int axis) { return row_[AnyTeam::kLanes >= 3 ? 0 : axis]; }
  CUTPROOF_DEVICE Map all(const AnyTeam& team) {  // to every lane
    static_assert(AnyTeam::kLanes == 1 || AnyTeam::kLanes >= 3);
    return {{team.from(0, of(0)), team.from(1, of(1)), team.from(2, of(2))}};
  }

 private:
  Float4 row_[AnyTeam::kLanes >= 3 ? 1 : 3];
};

CUTPROOF_DEVICE inline void add_moments(float* sums, float weight, Float3 e, Float3 e_per_h, Float3 r) {
  for (int axis = 0; axis < 3; ++axis) {
    const float mass_e_per_h = weight * e_per_h[axis];
    sums[4 * axis] += mass_e_per_h * r.x;
    sums[4 * axis + 1] += mass_e_per_h * r.y;
    sums[4 * axis + 2] += mass_e_per_h * r.z;
    sums[4 * axis + 3] += weight * e[axis];
  }
}
// Sum n of group g.
CUTPROOF_DEVICE inline void store_moment(Float4* rows, int g, int n, float sum) {
  Float4& row = rows[3 * int64_t{g} + n / 4];
  (n % 4 == 0 ? row.x : n % 4 == 1 ? row.y : n % 4 == 2 ? row.z : row.w) = sum;
}

// At least |(h diagonal + L) r| for every |r| <= 1 [h]: the root of the greatest sum by rows times the greatest sum by
// columns.
CUTPROOF_DEVICE inline float greatest_stretch(const Map& map, float diagonal) {
  float rows = 0, columns = 0;
  for (int k = 0; k < 3; ++k) {
    float row = 0, column = 0;
    for (int j = 0; j < 3; ++j) {
      row += fabsf(entry(map, k, j) + (j == k ? diagonal : 0.0f));
      column += fabsf(entry(map, j, k) + (j == k ? diagonal : 0.0f));
    }
    rows = fmaxf(rows, row);
    columns = fmaxf(columns, column);
  }
  return sqrtf(rows * columns);
}
// All points of a group that are at d~ + M(r) - l e; kept: 1 - l.
CUTPROOF_DEVICE inline Ball ball_around(const Pace& pace, const Group& group, Float4 base, float kept, const Map& map) {
  const RestCenter& center = group.center;
  const RestPoint rest = {pace.h,
                          {static_cast<float>(center.i) + center.x, static_cast<float>(center.j) + center.y,
                           static_cast<float>(center.k) + center.z}};
  const float radius = greatest_stretch(map, pace.h) * group.head.radius + kept * base.w;
  return {rest, xyz(base) + map.moved(), radius};
}

// How far at most a map leads a point that is `radius` [h] from the rest centre, along the axis of this row.
CUTPROOF_DEVICE inline float way_along(Float4 row, float radius) {
  return fabsf(row.w) + (fabsf(row.x) + fabsf(row.y) + fabsf(row.z)) * radius;
}
// No longer a way along any axis than this part of the room leaves it: 1 / √3 = 0.57735, less what is rounded, the way
// itself (8 roundings) and what room_around() leaves for farther coordinates (32 √3): some 4e-6 of it, of 6e-4.
inline constexpr float kOfRoom = 0.577f;

// ---- substeps

// [h] A base farther than this from the mean of its group is not used.
inline constexpr float kFarBase = 1.0f / 16.0f;
// Bounds of lengths are made greater by this part: more than the roundings of their own sums and of what they bound.
inline constexpr float kOfRoundings = 0x1p-20f;

// Predicts, from a particle's end of the last substep.
CUTPROOF_DEVICE inline Float3 predict(const Pace& pace, Float3 d, Float3 v) { return d + (pace.ahead * v + pace.fall); }

// Predictions, and where iterations lead, are places y = x + τ v, on which elasticity acts (docs/design/method.md §3):
// a particle has come `share` of the way to there. Number: of places, or of what is linear in them.
// kRetarded: some body of the load has retardation; the kernels of others know nothing of it.
template <bool kRetarded>
CUTPROOF_DEVICE inline bool leads(const Pace& pace) {
  return kRetarded && pace.share != 1.0f;
}
template <bool kRetarded, class Number>
CUTPROOF_DEVICE inline Number come_to(const Pace& pace, Number start, Number ahead) {
  return leads<kRetarded>(pace) ? start + pace.share * (ahead - start) : ahead;
}
// The y of a particle that contacts have put at x, where nothing would have put it at `free`, with the y `free_ahead`:
// the same to the bit where they do nothing.
template <bool kRetarded>
CUTPROOF_DEVICE inline Float3 ahead_of(const Pace& pace, Float3 x, Float3 free, Float3 free_ahead) {
  return leads<kRetarded>(pace) ? free_ahead + (1.0f / pace.share) * (x - free) : x;
}

// How far from their predictions particles may go, which lie in `ahead`, and began the substep in `began`: what touches
// nothing is x, and x lies between the two.
template <bool kRetarded>
CUTPROOF_DEVICE inline float room_ahead(const Pace& pace, const Contacts& contacts, const Ball& began, Ball ahead,
                                        int side) {
  if (!leads<kRetarded>(pace)) return room_around(contacts, ahead, side);
  ahead.d = come_to<kRetarded>(pace, began.d, ahead.d);
  ahead.radius = come_to<kRetarded>(pace, began.radius, ahead.radius) * (1.0f + kOfRoundings);
  return room_around(contacts, ahead, side) / pace.share;
}

// While a grip holds a group, its particles stay where it has put them, and what changes in an iteration is how much
// they are pushed: by alpha (x - d~) + beta e - M(r), M being a map as those of carried groups are.
// Sets alpha and beta of the end of a substep. They follow from what an iteration does with one particle
// (advance_particle), whose pull is G(r) - e, or, from where it is, G(r) - e - (x - d~).
CUTPROOF_DEVICE inline void set_held_push(Pace& pace, float kdt2) {
  float alpha = 1.0f, beta = 0.0f, earlier_alpha = 1.0f, earlier_beta = 0.0f;
  for (int j = 0; j < pace.iterations; ++j) {
    const Iteration now = iteration_of(pace, j, iteration_numbers(pace, kdt2, j));
    const float kept = now.implicit ? now.s : 1.0f, part = now.combined ? now.combination.pull : 1.0f;
    const auto next = [&](float is, float was, float added) {
      const float carried = now.combined ? now.combination(kept * is, is, was) : kept * is;
      return carried + part * added;
    };
    const float next_alpha = next(alpha, earlier_alpha, now.implicit ? 1.0f : now.s);
    const float next_beta = next(beta, earlier_beta, now.s);
    earlier_alpha = alpha;
    earlier_beta = beta;
    alpha = next_alpha;
    beta = next_beta;
  }
  pace.held_alpha = alpha;
  pace.held_beta = beta;
}

// Where a particle is that contacts may have put there, with this y. (Not found from y, which would round: what
// friction holds would creep.)
template <bool kRetarded>
CUTPROOF_DEVICE inline Float3 place_of(const DeviceView& w, const Pace& pace, int64_t o, Float3 ahead) {
  return leads<kRetarded>(pace) ? xyz(w.place[o]) : ahead;
}

// The displacement (y) that contacts, or its grip, let a particle have that is predicted at `predicted`.
template <bool kRetarded>
CUTPROOF_DEVICE inline Float3 enter_substep(const DeviceView& w, const Pace& pace, const Contacts& contacts,
                                            const Held& held, const RestPoint& rest, int64_t o, Float4 predicted,
                                            Float3 start, float share) {
  bool in_turn = false;  // of no interest: there is no earlier point to compare with
  const Float3 free = come_to<kRetarded>(pace, start, xyz(predicted));
  const Float3 x = held.active ? start + held.moved : project(contacts, rest, free, predicted.w, start, in_turn);
  const Float3 ahead = ahead_of<kRetarded>(pace, x, free, xyz(predicted));
  w.position[o] = with_w(ahead, share);
  if (leads<kRetarded>(pace)) w.place[o] = with_w(x, 0.0f);
  w.pushed[o] = with_w(x - free, 0.0f);
  return ahead;
}

CUTPROOF_DEVICE inline void end_impulse(const DeviceView& w, int p, const Pace& pace, Float3 pushed) {
  w.impulse[p] = with_w(pace.decay * xyz(w.impulse[p]) + pace.decay_per_dt * pushed, 0.0f);
}

// Where a carried particle with prediction `predicted` is. What is added is small where little has happened, however
// far the particle is from the base.
CUTPROOF_DEVICE inline Float3 carried_to(Float3 base, float lost, Float3 predicted, const Map& map, Float3 r) {
  return predicted + (map(r) - lost * (predicted - base));
}

// How many groups of a substep were resolved when an iteration began. Those that are resolved in it are counted with
// the next one, so that this number stands from one iteration to the next, and may be read ahead.
CUTPROOF_DEVICE inline int* listed_before(const DeviceView& w, int substep, int iteration) {
  return &w.counters->listed[substep % 2][iteration % 2];
}

// The moments of a resolved group. (After its particles have moved, not while they do: sums and projections together
// would need more registers than there are.) own: where the first particle of this lane, nearly always the only one,
// has come to, and its mass: what was just written would have to be waited for.
template <class AnyTeam>
CUTPROOF_DEVICE void sum_resolved(const AnyTeam& team, const DeviceView& w, const Group& group, const Pace& pace,
                                  Float3 base, Float4 own) {
  const float of_each = 1.0f / static_cast<float>(group.head.holder_count), per_h = pace.per_h;
  GroupSums<AnyTeam, kResolvedTeam> sums;
  team.each(sums, group.head.size, [&](int k, int, float* sum) {
    const int o = group.head.begin + k;
    const Float4 at = k == team.lane() ? own : with_w(xyz(w.position[o]), w.start[o].w);
    const Float3 e = xyz(at) - base;
    add_moments(sum, of_each * at.w, e, per_h * e, group.rest(w, pace, k));
  });
  team.parted(sums).each(team, [&](int n, float sum) { store_moment(w.group_moments, group.index, n, sum); });
}

// How many groups were tracked when a substep began, for begin_substep_kernel, which then has it in `tracked`; those of
// the substep itself are counted by themselves. (Three such counts: one is read, one counts, and one is cleared.)
CUTPROOF_DEVICE inline int tracked_before(const DeviceView& w, int substep) {
  return w.counters->tracked[(substep + 1) % 2] + w.counters->newly_tracked[(substep + 2) % 3];
}

// DeviceView::group_tracked.
enum : int { kUntouched = 0, kTracked = 1 };
// A group is resolved, and tracked from now on. before: the iteration that it is to be resolved in from the first.
template <class AnyTeam, class Block>
CUTPROOF_DEVICE void list_resolved(Block& block, const AnyTeam& team, const DeviceView& w, const Pace& pace, int g,
                                   int substep, int before) {
  // It has no map any more, and may never have had one; who reads ahead reads it all the same.
  team.sync();  // all have read the last one
  team.each(3, [&](int axis) { w.group_map[3 * int64_t{g} + axis] = Float4{}; });
  if (!team.leads()) return;
  w.group_resolved[g] = kResolved;
  if (pace.iterations == 0) return;  // nobody asks for the list, or empties it
  block.store(&w.resolved_groups[block.atomic_add(listed_before(w, substep, before), 1)], g);
}
// tracked: how many were before this substep.
template <class AnyTeam, class Block>
CUTPROOF_DEVICE void list_tracked(Block& block, const AnyTeam& team, const DeviceView& w, int g, int substep,
                                  int tracked) {
  if (!team.leads()) return;
  w.group_tracked[g] = kTracked;
  block.store(&w.tracked_groups[tracked + block.atomic_add(&w.counters->newly_tracked[substep % 3], 1)], g);
}

// ---- groups that nothing has touched in this frame
//
// Their particles began it with d = D + u and v = V + m, D and V being the group's and u and m the particle's own, and
// have moved since by b v + T + (a - 1) u + A(r): by what they do of themselves, most of all. a and b are numbers of
// body and substep. Where u and m are zero for all of them, D + b V + T is kept instead of T, and nothing is added to
// where a particle was: then they do to the bit what single particles do that move alike.

struct Parts {
  float shape, motion;  // a - 1, which may be small; b
};
struct FrameParts {
  Parts place, velocity;
};
CUTPROOF_DEVICE inline FrameParts first_parts() { return {{0, 0}, {0, 1}}; }  // where a frame begins
CUTPROOF_DEVICE inline Parts predicted_parts(const Pace& pace, const FrameParts& now) {
  return {now.place.shape + pace.ahead * now.velocity.shape, now.place.motion + pace.ahead * now.velocity.motion};
}
// One entry of the moments of what is left there of u and v, from those of u and of v - V.
CUTPROOF_DEVICE inline float own_moment(const Parts& now, float of_shape, float of_motion) {
  return (1.0f + now.shape) * of_shape + now.motion * of_motion;
}
// (Computed once a frame, so whether anybody has retardation is not asked before.)
CUTPROOF_DEVICE inline FrameParts parts_after(const Pace& pace, float lost, const FrameParts& now) {
  const Parts predicted = predicted_parts(pace, now);
  FrameParts next;
  next.place = {come_to<true>(pace, now.place.shape, predicted.shape - lost * (1.0f + predicted.shape)),
                come_to<true>(pace, now.place.motion, predicted.motion - lost * predicted.motion)};
  next.velocity = {pace.decay_per_dt * (next.place.shape - now.place.shape),
                   pace.decay_per_dt * (next.place.motion - now.place.motion)};
  return next;
}
CUTPROOF_DEVICE inline Float4* parts_of(const DeviceView& w, int body, int substep) {
  return &w.parts[int64_t{body} * (w.most_substeps + 1) + substep];
}
CUTPROOF_DEVICE inline FrameParts load_parts(const DeviceView& w, int body, int substep) {
  const Float4 parts = constant(parts_of(w, body, substep));
  return {{parts.x, parts.y}, {parts.z, parts.w}};
}
// k dt (dt + τ); without retardation k dt², to the bit.
CUTPROOF_DEVICE inline float kdt2_of(const BodyConstants& body, const Pace& pace) {
  return body.stiffness * (pace.share * pace.ahead) * pace.ahead;
}
// What the substeps and iterations of a body's frame have in common.
CUTPROOF_DEVICE inline void store_numbers(const DeviceView& w, int body, const Pace& pace) {
  const float kdt2 = kdt2_of(w.body[body], pace);
  const float lost = lost_fraction(pace, pace.iterations);
  FrameParts now = first_parts();
  for (int substep = 0; substep <= pace.substeps; ++substep) {
    *parts_of(w, body, substep) = {now.place.shape, now.place.motion, now.velocity.shape, now.velocity.motion};
    now = parts_after(pace, lost, now);
  }
  for (int iteration = 0; iteration <= pace.iterations; ++iteration) {
    *numbers_of(w, body, iteration) = iteration_numbers(pace, kdt2, iteration);
  }
}

// Along one axis: its row of A, with T in w; and the same of velocities.
struct Axis {
  Float4 place, velocity;
};
CUTPROOF_DEVICE inline Axis load_axis(const DeviceView& w, int64_t at) {
  return {w.group_place[at], w.group_velocity[at]};
}
// Its prediction, as predict().
CUTPROOF_DEVICE inline Float4 predicted_row(const Pace& pace, int axis, const Axis& now) {
  return {now.place.x + pace.ahead * now.velocity.x, now.place.y + pace.ahead * now.velocity.y,
          now.place.z + pace.ahead * now.velocity.z, now.place.w + (pace.ahead * now.velocity.w + pace.fall[axis])};
}
// What its particles have in common when the frame begins.
struct Origin {
  Float4 place, velocity;  // D, V; w: at least every |u|, |m|
  CUTPROOF_DEVICE bool uniform() const { return place.w == 0 && velocity.w == 0; }
  // The base where T is zero, and velocities have that part in places.
  CUTPROOF_DEVICE Float3 from(float motion) const { return uniform() ? Float3{} : xyz(place) + motion * xyz(velocity); }
};
CUTPROOF_DEVICE inline Origin origin_of(const DeviceView& w, int g) {
  return {w.group_origin[2 * int64_t{g}], w.group_origin[2 * int64_t{g} + 1]};
}

// After a substep with this map, whose shift is that of the base. predicted: parts of the prediction.
template <bool kRetarded>
CUTPROOF_DEVICE inline Axis axis_after(const Pace& pace, int axis, float lost, const Origin& origin,
                                       const Parts& predicted_part, Float4 map, const Axis& now) {
  const Float4 predicted = predicted_row(pace, axis, now);
  const auto led = [&](float was, float is, float by_map) {
    return come_to<kRetarded>(pace, was, is + (by_map - lost * is));
  };
  const auto rate = [&](float is, float was) { return pace.decay_per_dt * (is - was); };
  const float lost_motion = origin.uniform() ? 0.0f : lost * (predicted_part.motion * xyz(origin.velocity)[axis]);
  Axis next;
  next.place = {led(now.place.x, predicted.x, map.x), led(now.place.y, predicted.y, map.y),
                led(now.place.z, predicted.z, map.z),
                come_to<kRetarded>(pace, now.place.w, predicted.w + (map.w + lost_motion))};
  next.velocity = row_of(rate, next.place, now.place);
  return next;
}

// What a particle began the frame with.
struct Own {
  Float4 began;          // displacement; w: mass
  Float3 shape, motion;  // displacement less its group's; velocity
};
CUTPROOF_DEVICE inline Own own_of(const DeviceView& w, int p, const Origin& origin) {
  const Float4 d = w.displacement[p];
  return {d, xyz(d) - xyz(origin.place), xyz(w.velocity[p])};
}
// Where it is now. Its group's part is small where little has happened, wherever the others are.
CUTPROOF_DEVICE inline Float3 led_to(const Map& map, const Parts& parts, const Origin& origin, const Own& own,
                                     Float3 r) {
  const Float3 turned = map.linear(r);
  if (origin.uniform()) return map.moved() + turned;
  return xyz(own.began) + (parts.motion * own.motion + (map.moved() + (parts.shape * own.shape + turned)));
}

// Gives the particles of such a group positions of their own: where the substep began, and its prediction. Gives the
// base of that.
template <class AnyTeam>
CUTPROOF_DEVICE Float3 track_particles(const AnyTeam& team, const DeviceView& w, const Group& group, const Pace& pace,
                                       const Contacts& contacts, bool held, int substep) {
  const int64_t g = group.index;
  const FrameParts parts = load_parts(w, body_of_group(w, group.head), substep);
  const Parts of_prediction = predicted_parts(pace, parts);
  const Origin origin = origin_of(w, group.index);
  Map now, next;
  for (int axis = 0; axis < 3; ++axis) {
    const Axis is = load_axis(w, 3 * g + axis);
    now.row[axis] = is.place;
    next.row[axis] = predicted_row(pace, axis, is);
  }
  team.each(group.head.size, [&](int k) {
    const int o = group.head.begin + k, node = constant(&w.place_node[o]);
    const Own own = own_of(w, w.place_particle[o], origin);
    const Float3 r = group.rest_of(pace, node), start = led_to(now, parts.place, origin, own, r);
    const float side = held ? 0.0f : blade_side(contacts, {pace.h, grid_node(pace, node)}, start);
    w.start[o] = with_w(start, own.began.w);
    w.predicted[o] = with_w(led_to(next, of_prediction, origin, own, r), side);
  });
  return origin.from(of_prediction.motion) + next.moved();
}

// Moments of what a group's particles have, value(k) with a weight in w, about `base`: that of the particle in the
// middle, or, where that one is farther off the others than `far`, their mean. (Not always: what moves as a whole must
// have moments that vanish.) Small numbers are summed. Gives the base, with at least every distance from it in w.
template <int kOrder, class AnyTeam, class Value>
CUTPROOF_DEVICE Float4 sum_about(const AnyTeam& team, const DeviceView& w, const Group& group, const Pace& pace,
                                 float per_mass, float far, Value value, typename AnyTeam::template Parted<12>& total) {
  const GroupHead& head = group.head;
  Float3 base;
  if (team.has(head.middle)) base = xyz(value(head.middle));
  base = team.from(head.middle, base);
  float reach = 0;
  for (int round = 0;; ++round) {
    GroupSums<AnyTeam, kOrder> sums;
    reach = 0;
    team.each(sums, head.size, [&](int k, int, float* sum) {
      const Float4 particle = value(k);
      const Float3 e = xyz(particle) - base;
      reach = fmaxf(reach, dot(e, e));
      add_moments(sum, particle.w, e, pace.per_h * e, group.rest(w, pace, k));
    });
    total = team.parted(sums);
    const Float3 off = {per_mass * total.get(team, 3), per_mass * total.get(team, 7), per_mass * total.get(team, 11)};
    if (round > 0 || !(dot(off, off) > far * far)) break;
    base = base + off;
  }
  return with_w(base, sqrtf(team.greatest(reach)) * (1.0f + kOfRoundings));
}

// Notes the base of such a group in this substep, and how far from its prediction it may go: the room, which it gives;
// not positive: a contact may touch it there. from: where it begins the substep, asked for if there is a blade or
// retardation; parts: of that; to: what its prediction adds to `base`, which is `moved` from there.
template <bool kRetarded, class AnyTeam, class From>
CUTPROOF_DEVICE float note_room(const AnyTeam& team, const DeviceView& w, const Group& group, const Pace& pace,
                                const Contacts& contacts, const Origin& origin, const Parts& parts,
                                const Parts& of_prediction, From from, Map to) {
  const int g = group.index;
  Float4 base = with_w(origin.from(of_prediction.motion) + to.moved(), 0.0f);
  for (Float4& row : to.row) row.w = 0;
  // Every particle's own part of where it is, and of its prediction.
  const auto reach_of = [&](const Parts& part) {
    return (fabsf(1.0f + part.shape) * origin.place.w + fabsf(part.motion) * origin.velocity.w) * (1.0f + kOfRoundings);
  };
  const float own = reach_of(of_prediction);
  base.w = (greatest_stretch(to, 0.0f) * group.head.radius + own) * (1.0f + kOfRoundings);
  int side = 1;
  Ball began = {};
  if (contacts.move != nullptr || leads<kRetarded>(pace)) {
    began = ball_around(pace, group, with_w(origin.from(parts.motion), reach_of(parts)), 1.0f, from());
    if (contacts.move != nullptr) side = side_of_all(contacts, began);
  }
  // What an iteration adds is M(r), and takes is a part of e: a ball that contains the rest shape too contains every
  // such d~ - l e.
  Ball ball = ball_around(pace, group, with_w(xyz(base), own), 1.0f, to);
  ball.radius = fmaxf(ball.radius, pace.h * group.head.radius);
  const float room = room_ahead<kRetarded>(pace, contacts, began, ball, side);
  if (team.leads()) {
    w.group_base[g] = base;
    w.group_room[g] = room;
    w.group_side[g] = side;
    w.group_resolved[g] = kCarried;
  }
  return room;
}

// Begins a substep of a group that nothing has touched so far. Says whether something may in its prediction, or a grip
// holds it: then its particles are to be tracked.
template <bool kContacts, bool kRetarded, class Block, int kRows>
CUTPROOF_DEVICE bool begin_untouched(Block& block, const Team<Block, kRows>& team, const DeviceView& w, int g,
                                     int substep) {
  const Group group = group_of(w, g);
  const GroupHead& head = group.head;
  const int body = body_of_group(w, head);
  const Pace pace = constant(&w.pace[body]);
  const Contacts contacts = kContacts ? contacts_of(w, pace, substep) : Contacts{};
  const Float4 mass = constant(&w.group_mass[g]), upper = constant(&w.group_spread[2 * int64_t{g}]),
               lower = constant(&w.group_spread[2 * int64_t{g} + 1]);
  const bool active = head.size > 0 && substep < pace.substeps;
  FrameParts parts = {};  // of no more substeps than its body has
  if (active) parts = load_parts(w, body, substep);
  const Parts of_prediction = predicted_parts(pace, parts);
  Parts of_last_prediction = {};
  if (active) of_last_prediction = predicted_parts(pace, load_parts(w, body, substep - 1));
  const float lost = lost_in_all(w, body, pace), per_h = pace.per_h;
  block.wait_for_earlier();
  if (!active) return false;
  [[maybe_unused]] int state = kUntouched;
  if constexpr (kContacts) state = w.group_tracked[g];
  // All that is read before anything is written: behind a store, each would be waited for by itself.
  Rows<Team<Block, kRows>> place, velocity, map, shape, motion;
  const Origin origin = origin_of(w, g);
  team.each(3, [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    place.of(axis) = w.group_place[at];
    velocity.of(axis) = w.group_velocity[at];
    if (pace.iterations > 0) map.of(axis) = w.group_map[at];
    shape.of(axis) = w.frame_shape[at];
    motion.of(axis) = w.frame_motion[at];
  });
  if (state != kUntouched) return false;
  Rows<Team<Block, kRows>>& predicted = map;
  team.each(3, [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    const Axis now = axis_after<kRetarded>(pace, axis, lost, origin, of_last_prediction, map.of(axis),
                                           {place.of(axis), velocity.of(axis)});
    place.of(axis) = w.group_place[at] = now.place;
    w.group_velocity[at] = now.velocity;
    predicted.of(axis) = predicted_row(pace, axis, now);
  });
  if constexpr (kContacts) {
    const float room = note_room<kRetarded>(
        team, w, group, pace, contacts, origin, parts.place, of_prediction, [&] { return place.all(team); },
        predicted.all(team));
    if (!(room > 0) || held_by(w, pace, head.hold_set, substep).active) return true;
  } else {
    const Float3 base = origin.from(of_prediction.motion) + predicted.all(team).moved();
    if (team.leads()) w.group_base[g] = with_w(base, 0.0f);
  }
  team.each(3, [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    const Float4 row = predicted.of(axis), u = shape.of(axis), m = motion.of(axis);
    const auto own = [&](float of_shape, float of_motion) { return own_moment(of_prediction, of_shape, of_motion); };
    const Float4 moment = {own(u.x, m.x) + per_h * (row.x * upper.x + row.y * upper.y + row.z * upper.z),
                           own(u.y, m.y) + per_h * (row.x * upper.y + row.y * upper.w + row.z * lower.x),
                           own(u.z, m.z) + per_h * (row.x * upper.z + row.y * lower.x + row.z * lower.y),
                           own(u.w, m.w) + (row.x * mass.x + row.y * mass.y + row.z * mass.z)};
    w.group_predicted[at] = moment;
    w.group_moments[at] = moment;
  });
  return false;
}

// ---- groups that are tracked

// How the substep before has left the particles of one.
struct Ending {
  Map map;
  Float3 base;
  float lost;
  int state;
};
CUTPROOF_DEVICE inline Ending ending_of(const DeviceView& w, int body, const Pace& pace, int g) {
  Ending ending = {{}, xyz(w.group_base[g]), lost_in_all(w, body, pace), w.group_resolved[g]};
  if (pace.iterations > 0) ending.map = load_map(w.group_map, g);
  return ending;
}
// Displacement and mass of its particle k; sets its velocity, and ends its impulse.
template <bool kRetarded>
CUTPROOF_DEVICE inline Float4 end_tracked(const DeviceView& w, const Pace& pace, const Group& group,
                                          const Ending& ending, int k, Float3& v) {
  const int o = group.head.begin + k;
  const Float4 start = w.start[o];
  const Float3 predicted = xyz(w.predicted[o]), r = group.rest(w, pace, k);
  Float3 ahead = carried_to(ending.base, ending.lost, predicted, ending.map, r);
  Float3 pushed;
  if (ending.state != kCarried) ahead = xyz(w.position[o]);
  if (ending.state == kResolved) pushed = xyz(w.pushed[o]);
  if (ending.state == kHeld) {
    pushed = pace.held_alpha * (ahead - predicted) + (pace.held_beta * (predicted - ending.base) - ending.map(r));
    if constexpr (kRetarded) pushed = pace.share * pushed;
  }
  const Float3 d =
      ending.state == kCarried ? come_to<kRetarded>(pace, xyz(start), ahead) : place_of<kRetarded>(w, pace, o, ahead);
  end_impulse(w, w.place_particle[o], pace, pushed);
  v = pace.decay_per_dt * (d - xyz(start));
  return with_w(d, start.w);
}

// Begins a substep of a group whose particles are to be tracked from here on (`begins`), or have been.
template <bool kRetarded, class Block, class AnyTeam>
CUTPROOF_DEVICE void begin_tracked(Block& block, const AnyTeam& team, const DeviceView& w, int g, int substep,
                                   int tracked, bool begins) {
  const Group group = group_of(w, g);
  const GroupHead& head = group.head;
  const int body = body_of_group(w, head);
  const Pace pace = constant(&w.pace[body]);
  if (substep >= pace.substeps) return;
  const Contacts contacts = contacts_of(w, pace, substep);
  const Held held = held_by(w, pace, head.hold_set, substep);
  Float3 base;
  bool resolve = true;
  // Of the first particle of this lane, nearly always the only one: what was just written would have to be waited for.
  const int first = team.lane();
  Float4 first_start, first_predicted;
  const auto start_of = [&](int k) { return k == first ? first_start : w.start[head.begin + k]; };
  const auto predicted_of = [&](int k) { return k == first ? first_predicted : w.predicted[head.begin + k]; };
  if (begins) {
    base = track_particles(team, w, group, pace, contacts, held.active, substep);
    if (first < head.size) {
      first_start = w.start[head.begin + first];
      first_predicted = w.predicted[head.begin + first];
    }
    list_tracked(block, team, w, g, substep, tracked);
  } else {
    const Ending ending = ending_of(w, body, pace, g);
    const float of_each = 1.0f / static_cast<float>(head.holder_count);
    bool before = false, behind = false;  // the blade, when the substep begins
    Float3 began;                         // somewhere among its particles, when the substep begins
    float reach = 0;                      // of them from there, squared
    if (leads<kRetarded>(pace)) {
      began = xyz(w.start[head.begin]);
      team.sync();  // all have read it
    }
    team.each(head.size, [&](int k) {
      const int o = head.begin + k;
      Float3 v;
      const Float4 d = end_tracked<kRetarded>(w, pace, group, ending, k, v);
      float side = 0.0f;
      if (!held.active) {
        side = blade_side(contacts, {pace.h, grid_node(pace, constant(&w.place_node[o]))}, xyz(d));
        (side < 0 ? behind : before) = true;
      }
      const Float4 predicted = with_w(predict(pace, xyz(d), v), side);
      if constexpr (kRetarded) {
        const Float3 off = xyz(d) - began;
        reach = fmaxf(reach, dot(off, off));
      }
      w.start[o] = d;
      w.predicted[o] = predicted;
      if (k == first) {
        first_start = d;
        first_predicted = predicted;
      }
    });
    typename AnyTeam::template Parted<12> total;
    const Float4 base_and_reach = sum_about<kResolvedTeam>(
        team, w, group, pace, 1.0f / constant(&w.group_mass[g]).w, kFarBase * pace.h,
        [&](int k) { return with_w(xyz(predicted_of(k)), of_each * start_of(k).w); }, total);
    before = team.any(before);
    behind = team.any(behind);
    const int side = before && behind ? 0 : behind ? -1 : 1;
    // (Of a group that a grip holds nobody asks.)
    const Ball ahead = ball_around(pace, group, base_and_reach, 1.0f, Map{});
    Ball start = {};
    if constexpr (kRetarded) {
      start = ball_around(pace, group, with_w(began, sqrtf(team.greatest(reach)) * (1.0f + kOfRoundings)), 1.0f, Map{});
    }
    const float room = held.active ? 0.0f : room_ahead<kRetarded>(pace, contacts, start, ahead, side);
    resolve = !(room > 0);
    base = xyz(base_and_reach);
    if (team.leads()) {
      w.group_base[g] = base_and_reach;
      w.group_room[g] = room;
      w.group_side[g] = side;
      w.group_resolved[g] = kCarried;
    }
    total.each(team, [&](int n, float sum) {
      store_moment(w.group_predicted, g, n, sum);
      if (!resolve) store_moment(w.group_moments, g, n, sum);
    });
  }
  if (!resolve) return;
  if (held.active) {
    if (team.leads()) w.group_resolved[g] = kHeld;
  } else {
    list_resolved(block, team, w, pace, g, substep, 0);
  }
  Float4 first_at;
  team.each(head.size, [&](int k) {
    const int o = head.begin + k;
    const RestPoint rest = {pace.h, grid_node(pace, constant(&w.place_node[o]))};
    const Float4 start = start_of(k);
    const Float3 x = enter_substep<kRetarded>(w, pace, contacts, held, rest, o, predicted_of(k), xyz(start), 0.0f);
    if (k == first) first_at = with_w(x, start.w);
  });
  sum_resolved(team, w, group, pace, base, first_at);
}

// ---- particles that are in no group

// Where the substep before, if there was one, has left the particle at place o.
template <bool kContacts, bool kRetarded>
CUTPROOF_DEVICE inline Float4 end_loose(const DeviceView& w, const Pace& pace, int o, int p, int substep, Float3& v) {
  if (substep == 0) {
    v = xyz(w.velocity[p]);
    return w.displacement[p];
  }
  const Float4 start = w.start[o];
  static_assert(kContacts || !kRetarded);  // who has retardation has places (plan.h)
  const Float3 d = place_of<kRetarded>(w, pace, o, xyz(w.position[o]));
  if constexpr (kContacts) end_impulse(w, p, pace, xyz(w.pushed[o]));
  v = pace.decay_per_dt * (d - xyz(start));
  return with_w(d, start.w);
}

template <bool kContacts, bool kRetarded>
CUTPROOF_DEVICE inline void begin_loose(const DeviceView& w, int o, int substep) {
  if (o < 0) return;
  const int p = w.place_particle[o];
  const Pace pace = constant(&w.pace[body_index(w, p)]);
  if (substep >= pace.substeps) return;
  Float3 v;
  const Float4 d = end_loose<kContacts, kRetarded>(w, pace, o, p, substep, v);
  const float share = d.w / static_cast<float>(w.membership_count[p]);
  Float4 predicted = with_w(predict(pace, xyz(d), v), 1.0f);
  w.start[o] = d;
  if constexpr (kContacts) {
    const Contacts contacts = contacts_of(w, pace, substep);
    const RestPoint rest = {pace.h, grid_node(pace, constant(&w.place_node[o]))};
    const Held held = held_by(w, pace, groups_detail::hold_set(w, p), substep);
    predicted.w = held.active ? 0.0f : blade_side(contacts, rest, xyz(d));
    enter_substep<kRetarded>(w, pace, contacts, held, rest, o, predicted, xyz(d), share);
  } else {
    w.position[o] = with_w(xyz(predicted), share);
  }
  w.predicted[o] = predicted;
}

// ---- the beginning of a frame

// What a group begins the frame with, and its first substep.
template <bool kContacts, bool kRetarded, class Block, class AnyTeam>
CUTPROOF_DEVICE void begin_group(Block& block, const AnyTeam& team, const DeviceView& w, int g) {
  if constexpr (kContacts) {
    if (team.leads()) w.group_tracked[g] = kUntouched;
  }
  const Group group = group_of(w, g);
  const GroupHead& head = group.head;
  const Pace pace = constant(&w.pace[body_of_group(w, head)]);
  if (head.size == 0 || pace.substeps == 0) {
    // Who reads ahead reads these before it knows that nothing is to be done.
    if (!team.leads()) return;
    w.group_base[g] = Float4{};
    if constexpr (kContacts) w.group_resolved[g] = kCarried;
    return;
  }
  const float per_mass = 1.0f / constant(&w.group_mass[g]).w;
  const float of_each = 1.0f / static_cast<float>(head.holder_count);
  const auto particle = [&](int k) { return w.place_particle[head.begin + k]; };
  const auto mass_share = [&](float mass) { return of_each * mass; };
  // The first of this lane's particles, one for each lane that it stands for: nearly always all that it has.
  constexpr int kFirst = AnyTeam::kLanes > 1 ? kParticleTeam / AnyTeam::kLanes : 1;
  static_assert(kFirst <= 2);
  Float4 first_place[kFirst], first_velocity[kFirst];
  int index[kFirst];
  for (int t = 0; t < kFirst; ++t) {
    const int k = team.lane() + t * team.kLanes;
    index[t] = k < head.size ? particle(k) : -1;
  }
  for (int t = 0; t < kFirst; ++t) {
    if (index[t] < 0) continue;
    first_place[t] = w.displacement[index[t]];
    first_velocity[t] = w.velocity[index[t]];
  }
  for (int t = 0; t < kFirst; ++t) first_velocity[t].w = first_place[t].w = mass_share(first_place[t].w);
  using Total = typename AnyTeam::template Parted<12>;
  const auto sum = [&](auto value, float far, Float4* rows, Total& total) {
    const Float4 base = sum_about<kParticleTeam>(team, w, group, pace, per_mass, far, value, total);
    total.each(team, [&](int n, float of) { store_moment(rows, g, n, of); });
    return base;
  };
  Origin origin;
  Total shape, motion;
  origin.place = sum(
      [&](int k) {
        if (k == team.lane()) return first_place[0];
        if (kFirst > 1 && k == team.lane() + team.kLanes) return first_place[kFirst - 1];
        const Float4 d = w.displacement[particle(k)];
        return with_w(xyz(d), mass_share(d.w));
      },
      kFarBase * pace.h, w.frame_shape, shape);
  origin.velocity = sum(
      [&](int k) {
        if (k == team.lane()) return first_velocity[0];
        if (kFirst > 1 && k == team.lane() + team.kLanes) return first_velocity[kFirst - 1];
        const int p = particle(k);
        return with_w(xyz(w.velocity[p]), mass_share(w.displacement[p].w));
      },
      kFarBase * pace.h / pace.ahead, w.frame_motion, motion);
  const Float3 since = origin.uniform() ? xyz(origin.place) : Float3{};
  const Float3 began = origin.uniform() ? xyz(origin.velocity) : Float3{};
  const Parts of_prediction = predicted_parts(pace, first_parts());
  Map from, to;
  for (int axis = 0; axis < 3; ++axis) {
    const Axis now = {{0, 0, 0, since[axis]}, {0, 0, 0, began[axis]}};
    from.row[axis] = now.place;
    to.row[axis] = predicted_row(pace, axis, now);
    if (!team.leads()) continue;
    w.group_place[3 * int64_t{g} + axis] = now.place;
    w.group_velocity[3 * int64_t{g} + axis] = now.velocity;
  }
  if (team.leads()) {
    w.group_origin[2 * int64_t{g}] = origin.place;
    w.group_origin[2 * int64_t{g} + 1] = origin.velocity;
  }
  if constexpr (kContacts) {
    const float room = note_room<kRetarded>(
        team, w, group, pace, contacts_of(w, pace, 0), origin, first_parts().place, of_prediction, [&] { return from; },
        to);
    if (!(room > 0) || held_by(w, pace, head.hold_set, 0).active) {
      team.sync();  // what its leader has written is all lanes' to read
      begin_tracked<kRetarded>(block, team, w, g, 0, 0, true);
      return;
    }
  } else if (team.leads()) {
    w.group_base[g] = with_w(origin.from(of_prediction.motion) + to.moved(), 0.0f);
  }
  shape.each(team, motion, [&](int n, float of_shape, float of_motion) {
    // (A group begins with no shape of its own.)
    const float moment = own_moment(of_prediction, of_shape, of_motion);
    store_moment(w.group_predicted, g, n, moment);
    store_moment(w.group_moments, g, n, moment);
  });
}

// ---- the end of the last substep

template <bool kContacts, bool kRetarded, class AnyTeam>
CUTPROOF_DEVICE void end_group(const AnyTeam& team, const DeviceView& w, int g) {
  const Group group = group_of(w, g);
  const GroupHead& head = group.head;
  const int body = body_of_group(w, head);
  const Pace pace = constant(&w.pace[body]);
  if (head.size == 0 || pace.substeps == 0) return;
  if constexpr (kContacts) {
    if (w.group_tracked[g] != kUntouched) {
      const Ending ending = ending_of(w, body, pace, g);
      team.each(head.size, [&](int k) {
        const int p = w.place_particle[head.begin + k];
        Float3 v;
        w.displacement[p] = end_tracked<kRetarded>(w, pace, group, ending, k, v);
        w.velocity[p] = with_w(v, 0.0f);
      });
      return;
    }
  }
  const Origin origin = origin_of(w, g);
  const FrameParts before = load_parts(w, body, pace.substeps - 1), after = load_parts(w, body, pace.substeps);
  const float lost = lost_in_all(w, body, pace);
  Map start, end;
  for (int axis = 0; axis < 3; ++axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    const Float4 map = pace.iterations > 0 ? w.group_map[at] : Float4{};
    const Axis now = load_axis(w, at);
    start.row[axis] = now.place;
    end.row[axis] = axis_after<kRetarded>(pace, axis, lost, origin, predicted_parts(pace, before), map, now).place;
  }
  // Several particles at once: behind a store, each would be waited for by itself.
  constexpr int kAtOnce = 2;
  CUTPROOF_ROLLED
  for (int begin = team.lane(); begin < head.size; begin += kAtOnce * team.kLanes) {
    int p[kAtOnce], node[kAtOnce];
    Own own[kAtOnce];
    for (int t = 0; t < kAtOnce; ++t) {
      const int k = begin + t * team.kLanes, o = head.begin + (k < head.size ? k : begin);
      p[t] = w.place_particle[o];
      node[t] = constant(&w.place_node[o]);
    }
    for (int t = 0; t < kAtOnce; ++t) own[t] = own_of(w, p[t], origin);
    for (int t = 0; t < kAtOnce; ++t) {
      if (begin + t * team.kLanes >= head.size) break;
      const Float3 r = group.rest_of(pace, node[t]), d = led_to(end, after.place, origin, own[t], r);
      // Not from velocities of the same form: what a position rounds to is how far its particle has moved.
      const Float3 v = pace.decay_per_dt * (d - led_to(start, before.place, origin, own[t], r));
      w.displacement[p[t]] = with_w(d, own[t].began.w);
      w.velocity[p[t]] = with_w(v, 0.0f);
    }
  }
}

template <bool kContacts, bool kRetarded>
CUTPROOF_DEVICE inline void finish_loose(const DeviceView& w, int o) {
  if (o < 0) return;
  const int p = w.place_particle[o];
  const Pace pace = constant(&w.pace[body_index(w, p)]);
  if (pace.substeps == 0) return;
  Float3 v;
  w.displacement[p] = end_loose<kContacts, kRetarded>(w, pace, o, p, pace.substeps, v);
  w.velocity[p] = with_w(v, 0.0f);
}

CUTPROOF_DEVICE inline Pace pace_of(const DeviceView& w, int b) {
  const BodyConstants& body = w.body[b];
  Pace pace = {};
  pace.first_move = -1;
  if (!running(w, b)) return pace;
  pace.substeps = body.substeps;
  pace.iterations = body.iterations;
  pace.frame = w.frame[b];
  pace.h = body.h;
  pace.per_h = 1.0f / body.h;
  const float dt = w.substep_length[body.frame_begin + pace.frame];
  pace.ahead = dt + body.retardation;
  pace.share = dt / pace.ahead;
  const float kdt2 = kdt2_of(body, pace);
  pace.decay = decay_by(body.damping * dt);
  pace.decay_per_dt = pace.decay / dt;
  pace.s = body.solver == Solver::implicit ? kdt2 / (1.0f + kdt2) : body.relaxation;
  pace.fall = (dt * pace.ahead) * body.gravity;
  pace.solver = body.solver;
  pace.acceleration = body.acceleration;
  for (int axis = 0; axis < 2; ++axis) pace.nodes[axis] = body.nodes[axis];
  pace.by_row = body.by_row;
  pace.by_layer = body.by_layer;
  // A geometric blade removes what it sweeps and touches nothing.
  if (body.has_blade && body.criterion != Criterion::geometric) {
    pace.first_move = body.schedule + int64_t{pace.frame} * body.substeps;
  }
  pace.wall_begin = body.wall_begin;
  pace.wall_count = body.wall_end - body.wall_begin;
  pace.frictionless_walls = 1;
  for (int k = body.wall_begin; k < body.wall_end; ++k) {
    if (w.walls[k].friction != 0) pace.frictionless_walls = 0;
  }
  pace.half_length = 0.5f * body.blade_length;
  pace.depth = body.blade_depth;
  pace.clearance = body.clearance;
  pace.blade_friction = body.blade_friction;
  set_held_push(pace, kdt2);
  return pace;
}

}  // namespace step_detail

// Clears what a frame counts, and says what its bodies need. The first kernel of a span that begins with the step.
template <class Block>
CUTPROOF_DEVICE void begin_frame_kernel(Block& block, const DeviceView& w, Span span) {
  using namespace step_detail;
  begin_span(block, w, span);
  if (block.first() == 0) {
    w.counters->removed = 0;
    w.counters->debris = 0;
    w.counters->affected = 0;
    *step_detail::listed_before(w, 0, 0) = 0;
    w.counters->tracked[0] = w.counters->newly_tracked[0] = w.counters->newly_tracked[1] = 0;
  }
  for (int64_t b = block.first(); b < w.bodies; b += block.stride()) {
    if (running(w, static_cast<int>(b))) w.cut[b] = -1;
    const Pace pace = pace_of(w, static_cast<int>(b));
    w.pace[b] = pace;
    store_numbers(w, static_cast<int>(b), pace);
  }
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i);
    const int b = body_index(w, p);
    if (!running(w, b)) continue;
    // Every frame counts its own impulse and removals.
    w.impulse[p] = Float4{};
    const int death = w.death[p];
    if (death >= 2 * w.frame[b] && death != kDeadBefore) w.death[p] = kDeadBefore;
  }
}
CUTPROOF_KERNEL(begin_frame_kernel);

// Begins a frame's first substep. kLanes: that share a group.
template <bool kContacts, bool kRetarded, int kLanes, class Block>
CUTPROOF_DEVICE void begin_first_substep_kernel(Block& block, const DeviceView& w) {
  using namespace step_detail;
  const Team<Block, kLanes> team(block);
  const int groups = w.counters->groups, loose = w.counters->loose;
  for (int64_t g = team.first(); g < groups; g += team.stride()) {
    begin_group<kContacts, kRetarded>(block, team, w, static_cast<int>(g));
  }
  const Team<Block, 1> thread(block);
  for (int64_t k = behind(thread, groups * team.kLanes); k < loose; k += thread.stride()) {
    begin_loose<kContacts, kRetarded>(w, w.loose_places[k], 0);
  }
}

// Ends the substep before `substep`, which is not the first, and begins that one, of the bodies that have it. kRows:
// lanes that share a group that is not tracked.
template <bool kContacts, bool kRetarded, int kRows, class Block>
CUTPROOF_DEVICE void begin_substep_kernel(Block& block, const DeviceView& w, int substep) {
  using namespace step_detail;
  const Team<Block, kRows> rows(block);
  // A warp, and what it has of teams for the groups that are tracked: where a grip holds a part of a large body these
  // are many, and two of them side by side.
  const Team<Block, kResolvedTeam> warp(block);
  const Team<Block, kResolvedLanes<kRows>> team(block);
  const int groups = w.counters->groups, loose = w.counters->loose;
  // Whole warps at a time, as in advance_kernel.
  const int64_t in_warp = rows.first() % (warp.kLanes / rows.kLanes);
  int64_t row = rows.first();
  [[maybe_unused]] int64_t listed = behind(team, groups * rows.kLanes);
  [[maybe_unused]] unsigned found = 0;
  [[maybe_unused]] int tracked = -1;
  while (true) {
    [[maybe_unused]] bool begins = false;
    [[maybe_unused]] int g = -1;
    if (found != 0) {
      begins = true;
      g = take_each(warp, team, found, static_cast<int>(row - rows.stride()));
    } else if (row - in_warp < groups) {
      const bool touches =
          row < groups && begin_untouched<kContacts, kRetarded>(block, rows, w, static_cast<int>(row), substep);
      if constexpr (kContacts) {
        found = warp.found(touches && rows.leads());
        warp.sync();  // its base is all lanes' to read
      }
      row += rows.stride();
      continue;
    }
    if constexpr (kContacts) {
      if (tracked < 0) {
        block.wait_for_earlier();
        tracked = tracked_before(w, substep);
      }
      if (!begins) {
        if (listed >= tracked) break;
        g = block.load(&w.tracked_groups[listed]);
        listed += team.stride();
      }
      if (g >= 0) begin_tracked<kRetarded>(block, team, w, g, substep, tracked, begins);
    } else {
      break;
    }
  }
  block.wait_for_earlier();
  if (kContacts && block.first() == 0) {
    w.counters->tracked[substep % 2] = tracked;
    block.store(&w.counters->newly_tracked[(substep + 1) % 3], 0);
  }
  const Team<Block, 1> thread(block);
  for (int64_t k = behind(thread, busy_threads(rows, groups, team, tracked)); k < loose; k += thread.stride()) {
    begin_loose<kContacts, kRetarded>(w, w.loose_places[k], substep);
  }
}

// Once a frame: where all particles have come to. kLanes: that share a group; no sum goes by them.
template <bool kContacts, bool kRetarded, int kLanes, class Block>
CUTPROOF_DEVICE void end_step_kernel(Block& block, const DeviceView& w) {
  using namespace step_detail;
  const Team<Block, kLanes> team(block);
  const int groups = w.counters->groups;
  for (int64_t g = team.first(); g < groups; g += team.stride()) {
    end_group<kContacts, kRetarded>(team, w, static_cast<int>(g));
  }
  const Team<Block, 1> thread(block);
  for (int64_t k = behind(thread, groups * team.kLanes); k < w.counters->loose; k += thread.stride()) {
    finish_loose<kContacts, kRetarded>(w, w.loose_places[k]);
  }
}

// ---- clusters

namespace step_detail {

// Lanes that share a cluster. Few clusters have more than 32 groups; where there are clusters enough, half of the lanes
// do the work of all, and sum in the same order.
inline constexpr int kClusterTeam = 32, kHalfTeam = 16;
inline constexpr int kMatchThreads = 128;
inline constexpr int kFewClusters = 4096;  // of a load
// What a cluster's place follows from: sums about `base`, in the order of GroupSums.
struct ClusterSums {
  Floats<12> moments;
  Float3 base;
};
// How many clusters at most a team sums before their rotations are computed, which take so long that few threads of a
// block should not do so while others wait.
template <int kLanes>
inline constexpr int kMostTurns = kLanes == kClusterTeam ? 1 : kMatchThreads / kLanes / 2;
template <int kLanes>
inline constexpr std::size_t kMatchShared = kMostTurns<kLanes>*(kMatchThreads / kLanes) * sizeof(ClusterSums);

// A cluster, and what its lanes need of it that no iteration changes: of the first group of each lane that they stand
// for, and the first particle that is in none.
template <class AnyTeam>
inline constexpr int kGroupsAhead = AnyTeam::kLanes > 1 ? kClusterTeam / AnyTeam::kLanes : 1;
template <class AnyTeam>
struct ClusterAhead {
  ClusterHead head;
  Offset to[kGroupsAhead<AnyTeam>];
  Float4 mass[kGroupsAhead<AnyTeam>];
  Float3 base[kGroupsAhead<AnyTeam>];
  int loose;
  Pace pace;
  // visit(bank, k) for these groups.
  template <class Visit>
  CUTPROOF_DEVICE void each(const AnyTeam& team, Visit visit) const {
    for (int bank = 0; bank < kGroupsAhead<AnyTeam>; ++bank) {
      const int k = team.lane() + bank * AnyTeam::kLanes;
      if (k < head.group_count) visit(bank, k);
    }
  }
  CUTPROOF_DEVICE void read_bases(const AnyTeam& team, const DeviceView& w) {
    each(team, [&](int bank, int) { base[bank] = xyz(w.group_base[to[bank].index]); });
  }
};
template <class AnyTeam>
CUTPROOF_DEVICE ClusterAhead<AnyTeam> cluster_ahead(const AnyTeam& team, const DeviceView& w, int s,
                                                    const ClusterHead& head) {
  ClusterAhead<AnyTeam> ahead = {};
  ahead.head = head;
  ahead.pace = constant(&w.pace[body_of_slot(w, s)]);
  ahead.each(team, [&](int bank, int k) { ahead.to[bank] = constant(&w.cluster_groups[head.group_begin + k]); });
  ahead.each(team, [&](int bank, int) { ahead.mass[bank] = constant(&w.group_mass[ahead.to[bank].index]); });
  if (team.lane() < head.loose_count) ahead.loose = w.cluster_loose[head.loose_begin + team.lane()];
  return ahead;
}

struct Moments {
  Float4 row[3];
};
CUTPROOF_DEVICE inline Moments load_moments(const DeviceView& w, int g) {
  const Float4* const row = w.group_moments + 3 * int64_t{g};
  return {{row[0], row[1], row[2]}};
}

template <class AnyTeam>
CUTPROOF_DEVICE void sum_cluster(const AnyTeam& team, const DeviceView& w, int s, const ClusterAhead<AnyTeam>& ahead,
                                 ClusterSums& found) {
  const ClusterHead& head = ahead.head;
  const float per_h = ahead.pace.per_h;
  typename AnyTeam::template Sums<12, kClusterTeam> sums;
  const Float3 base =
      head.group_count > 0 ? team.from(0, ahead.base[0]) : xyz(w.position[w.cluster_loose[head.loose_begin]]);
  Moments moments[kGroupsAhead<AnyTeam>];
  ahead.each(team, [&](int bank, int) { moments[bank] = load_moments(w, ahead.to[bank].index); });
  team.each(sums, head.group_count, [&](int k, int bank, float* sum) {
    const int read = bank < kGroupsAhead<AnyTeam> ? bank : 0;
    Offset to = ahead.to[read];
    Float4 mass = ahead.mass[read];
    Float3 from = ahead.base[read];
    Moments of_group = moments[read];
    if (k != team.lane() + read * team.kLanes) {
      to = constant(&w.cluster_groups[head.group_begin + k]);
      mass = constant(&w.group_mass[to.index]);
      from = xyz(w.group_base[to.index]);
      of_group = load_moments(w, to.index);
    }
    const Float3 apart = from - base;
    for (int axis = 0; axis < 3; ++axis) {
      const Float4 own = of_group.row[axis];
      const float moved = own.w + mass.w * apart[axis];
      const float shift = per_h * apart[axis], lever = per_h * moved;
      sum[4 * axis] += own.x + (shift * mass.x + lever * to.x);
      sum[4 * axis + 1] += own.y + (shift * mass.y + lever * to.y);
      sum[4 * axis + 2] += own.z + (shift * mass.z + lever * to.z);
      sum[4 * axis + 3] += moved;
    }
  });
  team.each(sums, head.loose_count, [&](int k, int, float* sum) {
    const int o = k == team.lane() ? ahead.loose : w.cluster_loose[head.loose_begin + k];
    const Float4 now = w.position[o];
    const Float3 e = xyz(now) - base;
    add_moments(sum, now.w, e, per_h * e,
                nodes_from_rest_center(w, coordinates(ahead.pace, constant(&w.place_node[o])), s));
  });
  team.parted(sums).each(team, [&](int n, float sum) { found.moments.v[n] = sum; });
  if (team.leads()) found.base = base;
}

// What else it follows from.
struct ClusterRest {
  Float4 row[3];  // DeviceView::cluster_rest
  Start<float> start;
  float h, per_mass, per_mass_and_h;
  int size;
};
CUTPROOF_DEVICE inline ClusterRest rest_of_cluster(const DeviceView& w, int s) {
  const Float4* const row = w.cluster_rest + 3 * int64_t{s};
  ClusterRest rest = {};
  for (int k = 0; k < 3; ++k) rest.row[k] = constant(&row[k]);
  rest.start = start_from(w.rotation[s]);
  rest.h = constant(&w.pace[body_of_slot(w, s)]).h;
  rest.per_mass = 1.0f / rest.row[0].w;
  rest.per_mass_and_h = 1.0f / (rest.row[0].w * rest.h);
  rest.size = w.slot_size[s];
  return rest;
}

// Centre and rotation of a cluster from its sums.
CUTPROOF_DEVICE inline void place_cluster(const DeviceView& w, int s, const ClusterRest& rest,
                                          const ClusterSums& sums) {
  const float* const moment = sums.moments.v;
  const Float4 first = rest.row[0], second = rest.row[1], third = rest.row[2];
  const Float3 rest_moment = xyz(first), moved = {moment[3], moment[7], moment[11]};
  const float spread[9] = {second.x, second.y, second.z, second.y, second.w, third.x, second.z, third.x, third.y};
  // A = Σ w (x - t)(X - T)ᵀ / h². The rest moment is zero but for the rounding of T.
  const Float3 shift = rest.per_mass_and_h * moved;
  Matrix3 a;
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) {
      a(row, k) = spread[3 * row + k] + (moment[4 * row + k] - shift[row] * rest_moment[k]);
    }
  }
  // One particle has no extent: what is left of A is rounding, and rotate() would make a rotation of it.
  const Matrix3& previous = w.rotation[s];
  const Rotation<float> best = rest.size > 1 ? rotate(a, previous, rest.start) : Rotation<float>{previous, true};
  // Such that Σ w (goal) = Σ w x to the rounding of these two sums (docs/design/decisions.md, Momentum and the rounding
  // of sums): the rounded T must not push the cluster.
  const Float3 turned = best.r * rest_moment - rest_moment;
  const Float3 center = sums.base + rest.per_mass * (moved - rest.h * turned);
  for (int axis = 0; axis < 3; ++axis) {
    const auto entry = [&](int k) { return best.r(axis, k) - (k == axis ? 1.0f : 0.0f); };
    w.placement[3 * int64_t{s} + axis] = {entry(0), entry(1), entry(2), center[axis]};
  }
  w.rotation[s] = best.r;
  w.degenerate[s] = best.degenerate;
}

}  // namespace step_detail

// On the device the teams of a block sum. Where clusters are many, each team sums several, and neighbouring threads
// then compute the rotations of all of them side by side; where they are few, each team's own first thread does, and
// nobody waits for others.
template <int kLanes, class Block>
CUTPROOF_DEVICE void match_shapes_kernel(Block& block, const DeviceView& w, int substep, int iteration) {
  using namespace step_detail;
  const Team<Block, kLanes> team(block);
  const int slots = w.counters->slots_used;
  const auto wanted = [&](int64_t s, ClusterHead& head) {
    if (s >= slots) return false;
    head = constant(&w.cluster_head[s]);
    return head.group_count + head.loose_count > 0 &&
           takes_part(constant(&w.pace[body_of_slot(w, static_cast<int>(s))]), substep, iteration);
  };
  if constexpr (Block::on_device) {
    constexpr int kTeams = kMatchThreads / kLanes;
    constexpr int kMost = kMostTurns<kLanes>;
    constexpr bool apart = kLanes == kClusterTeam;
    ClusterSums* const all = block.template shared<ClusterSums>(kMost * kTeams);
    const int mine = block.thread() / kLanes;
    const int which = apart ? mine : block.thread();  // of the block's clusters this thread places, if any
    int turns = 1;
    while (turns < kMost && turns * kTeams * block.count() < slots) ++turns;
    for (int64_t begin = static_cast<int64_t>(block.index()) * turns * kTeams; begin < slots;
         begin += static_cast<int64_t>(block.count()) * turns * kTeams) {
      const int placed = static_cast<int>(begin) + which;
      ClusterHead ignored;
      bool places = false;
      ClusterRest rest = {};
      for (int turn = 0; turn < turns; ++turn) {
        const int own = static_cast<int>(begin) + turn * kTeams + mine;
        ClusterHead head = {};
        const bool sums = wanted(own, head);
        ClusterAhead<Team<Block, kLanes>> ahead = {};
        if (sums) ahead = cluster_ahead(team, w, own, head);
        // What begins with a substep is read ahead in all its iterations but the first.
        if (sums && iteration > 0) ahead.read_bases(team, w);
        if (turn == 0) {
          places = apart ? sums && team.leads() : which < turns * kTeams && wanted(placed, ignored);
          // (Where few threads place many clusters, registers for it would be missing in all that sum.)
          if (apart && places) rest = rest_of_cluster(w, placed);
        }
        block.wait_for_earlier();
        if (!sums) continue;
        if (iteration == 0) ahead.read_bases(team, w);
        sum_cluster(team, w, own, ahead, all[turn * kTeams + mine]);
      }
      apart ? team.sync() : block.sync();
      if (!apart && places) rest = rest_of_cluster(w, placed);
      if (places) place_cluster(w, placed, rest, all[which]);
      apart ? team.sync() : block.sync();
    }
  } else {
    for (int64_t i = team.first(); i < slots; i += team.stride()) {
      const int s = static_cast<int>(i);
      ClusterHead head = {};
      if (!wanted(s, head)) continue;
      ClusterAhead<Team<Block, kLanes>> ahead = cluster_ahead(team, w, s, head);
      ahead.read_bases(team, w);
      ClusterSums sums;
      sum_cluster(team, w, s, ahead, sums);
      place_cluster(w, s, rest_of_cluster(w, s), sums);
    }
  }
  block.wait_for_earlier();
  if (block.first() == 0) {
    *listed_before(w, substep, iteration + 1) = *listed_before(w, substep, iteration);
    *listed_before(w, substep + 1, 0) = 0;
  }
}

template <int kLanes>
struct match_shapes_kernel_object {
  static constexpr const char* kName = "match_shapes_kernel";
  static constexpr bool kReadsAhead = true;
  static constexpr int kMaxThreads = step_detail::kMatchThreads, kMinBlocks = 4;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w, int substep, int iteration) const {
    match_shapes_kernel<kLanes>(block, w, substep, iteration);
  }
};

// ---- iterations

namespace step_detail {

// A particle on its own, before an iteration.
struct Particle {
  Float4 predicted, at;
  Float4 start;                            // with contacts…
  Float4 pushed, earlier, pushed_earlier;  // … and accelerated
  int node;
};
template <bool kContacts, bool kAccelerated>
CUTPROOF_DEVICE inline Particle particle_at(const DeviceView& w, const Iteration& now, int64_t o) {
  Particle found;
  found.predicted = w.predicted[o];
  found.at = w.position[o];
  found.node = constant(&w.place_node[o]);
  if constexpr (kContacts) {
    found.start = w.start[o];
    found.pushed = w.pushed[o];
  }
  if constexpr (kAccelerated) {
    if (now.combined) found.earlier = w.earlier[o];
    if constexpr (kContacts) {
      if (now.combined) found.pushed_earlier = w.pushed_earlier[o];
    }
  }
  return found;
}

// Particle by particle: the one at place o goes from where it is towards `from` + pull, `from` being its prediction, or
// where it is in the published way. Gives where it has come to.
template <bool kContacts, bool kAccelerated, bool kRetarded>
CUTPROOF_DEVICE inline Float3 advance_particle(const DeviceView& w, const Pace& pace, const Contacts& contacts,
                                               const Iteration& now, int64_t o, const Particle& particle, Float3 from,
                                               Float3 pull) {
  const Float3 x = xyz(particle.at);
  const Float3 plain = from + now.s * pull;
  Float3 free = plain;
  if constexpr (kAccelerated) {
    if (now.combined) free = now.combination(plain, x, xyz(particle.earlier));
    if (now.kept) w.earlier[o] = particle.at;
  }
  Float3 next = free;
  if constexpr (kContacts) {
    const float side = particle.predicted.w;
    const Float3 start = xyz(particle.start), free_place = come_to<kRetarded>(pace, start, free);
    Float3 push;
    if (side == 0) {
      next = x;  // a held particle stays where its grip has put it
      push = place_of<kRetarded>(w, pace, o, x) - free_place;
    } else {
      const RestPoint rest = {pace.h, grid_node(pace, particle.node)};
      const Float3 plain_place = come_to<kRetarded>(pace, start, plain);
      Float3 wanted = free_place;
      if constexpr (kAccelerated) {
        // Where several answers are right, the way there decides: touched particles go the plain way.
        if (now.combined && path_matters(contacts)) {
          bool touched = false;
          CUTPROOF_ROLLED
          for (int k = 0; k < 2; ++k) {
            touched = touched || contacts_detail::touches(contacts, rest, k == 0 ? free_place : plain_place, side);
          }
          if (touched) wanted = plain_place;
        }
      }
      const Float3 place = next_position(contacts, rest, wanted, side, start, place_of<kRetarded>(w, pace, o, x));
      if (leads<kRetarded>(pace)) w.place[o] = with_w(place, 0.0f);
      push = place - free_place;
      next = ahead_of<kRetarded>(pace, place, free_place, free);
    }
    const Float3 before = xyz(particle.pushed);
    Float3 carried = (now.implicit ? now.s : 1.0f) * before;
    if constexpr (kAccelerated) {
      if (now.combined) carried = now.combination(carried, before, xyz(particle.pushed_earlier));
      if (now.kept) w.pushed_earlier[o] = particle.pushed;
    }
    w.pushed[o] = with_w(carried + push, 0.0f);
  }
  w.position[o] = with_w(next, particle.at.w);
  return next;
}

// Several of a group's holders, which do not change in a substep.
template <int kAtOnce>
struct SomeHolders {
  Offset to[kAtOnce];
};
template <int kAtOnce>
CUTPROOF_DEVICE inline SomeHolders<kAtOnce> holders_from(const DeviceView& w, const GroupHead& head, int begin) {
  SomeHolders<kAtOnce> holders;
  for (int k = 0; k < kAtOnce; ++k) {
    holders.to[k] = constant(&w.holders[head.holder_begin + begin + (begin + k < head.holder_count ? k : 0)]);
  }
  return holders;
}

// What the holders of a group want of it, their mean goal: base + goal(r), each axis in the lane that has it.
template <int kAtOnce, class AnyTeam>
CUTPROOF_DEVICE inline Rows<AnyTeam> mean_goal(const AnyTeam& team, const DeviceView& w, const GroupHead& head,
                                               SomeHolders<kAtOnce> some, float h, Float4 base) {
  Rows<AnyTeam> goal;
  const auto add = [&](int begin) {
    // Several at once, along all axes: one by one, each would wait for the one before.
    Rows<AnyTeam> row[kAtOnce];
    for (int k = 0; k < kAtOnce; ++k) {
      team.each(3, [&](int axis) { row[k].of(axis) = w.placement[3 * int64_t{some.to[k].index} + axis]; });
    }
    team.each(3, [&](int axis) {
      const float from = xyz(base)[axis];
      Float4& sum = goal.of(axis);
      for (int k = 0; k < kAtOnce; ++k) {
        if (begin + k >= head.holder_count) break;
        const Offset to = some.to[k];
        const Float4 of = row[k].of(axis);
        sum.x += of.x;
        sum.y += of.y;
        sum.z += of.z;
        sum.w += (of.w - from) + h * (of.x * to.x + of.y * to.y + of.z * to.z);
      }
    });
  };
  add(0);
  CUTPROOF_ROLLED
  for (int begin = kAtOnce; begin < head.holder_count; begin += kAtOnce) {
    some = holders_from<kAtOnce>(w, head, begin);
    add(begin);
  }
  const float mean = 1.0f / static_cast<float>(head.holder_count), turn = h * mean;
  team.each(3, [&](int axis) {
    Float4& sum = goal.of(axis);
    sum = {turn * sum.x, turn * sum.y, turn * sum.z, mean * sum.w};
  });
  return goal;
}

// A group that has been carried so far is resolved from here on: where its particles are, and, accelerated, were one
// iteration ago. Nothing has touched them.
template <bool kAccelerated, bool kRetarded, class Block, class AnyTeam>
CUTPROOF_DEVICE void resolve(Block& block, const AnyTeam& team, const DeviceView& w, const Group& group,
                             const Pace& pace, const Contacts& contacts, const Iteration& now, Float3 base, int substep,
                             int iteration) {
  const int g = group.index;
  if (!team.any(w.group_tracked[g] != kUntouched)) {
    track_particles(team, w, group, pace, contacts, false, substep);
    list_tracked(block, team, w, g, substep, w.counters->tracked[substep % 2]);
  }
  Map is = {}, was = {};
  if (iteration > 0) is = load_map(w.group_map, g);
  if constexpr (kAccelerated) was = iteration > 1 && now.combined ? load_map(w.group_earlier_map, g) : is;
  const float lost = now.lost_before;
  [[maybe_unused]] float lost_earlier = 0;
  if constexpr (kAccelerated) {
    if (iteration > 0) {
      lost_earlier = constant(numbers_of(w, body_of_group(w, group.head), iteration - 1)).lost_before;
    }
  }
  team.each(group.head.size, [&](int k) {
    const int o = group.head.begin + k;
    const Float3 predicted = xyz(w.predicted[o]), r = group.rest(w, pace, k);
    const Float3 ahead = carried_to(base, lost, predicted, is, r);
    w.position[o] = with_w(ahead, 0.0f);
    if (leads<kRetarded>(pace)) w.place[o] = with_w(come_to<kRetarded>(pace, xyz(w.start[o]), ahead), 0.0f);
    w.pushed[o] = Float4{};
    if constexpr (kAccelerated) {
      w.earlier[o] = with_w(carried_to(base, lost_earlier, predicted, was, r), 0.0f);
      w.pushed_earlier[o] = Float4{};
    }
  });
  list_resolved(block, team, w, pace, g, substep, iteration + 1);
}

// A group, and what of it does not change in a substep.
template <int kAtOnce>
struct GroupAhead {
  Group group;
  SomeHolders<kAtOnce> holders;
  Float4 base;
};
template <int kAtOnce>
CUTPROOF_DEVICE inline GroupAhead<kAtOnce> group_ahead(const DeviceView& w, int g) {
  const Group group = group_of(w, g);
  return {group, holders_from<kAtOnce>(w, group.head, 0), w.group_base[g]};
}
// Where lanes share a group there is room for all of most groups' holders, and for all else that is read ahead.
template <int kRows>
inline constexpr int kHoldersAtOnce = kRows > 1 ? 8 : 4;

// One iteration of the particles of a resolved group. begins: it has been carried so far.
template <bool kContacts, bool kAccelerated, bool kRetarded, class Block, class AnyTeam, int kAtOnce>
CUTPROOF_DEVICE void advance_resolved(Block& block, const AnyTeam& team, const DeviceView& w,
                                      const GroupAhead<kAtOnce>& ahead, int substep, int iteration, bool begins) {
  const Group& group = ahead.group;
  const GroupHead& head = group.head;
  const int body = body_of_group(w, head);
  const Pace pace = constant(&w.pace[body]);
  if (!takes_part(pace, substep, iteration)) return;
  const Contacts contacts = contacts_of(w, pace, substep);
  const Iteration now = iteration_of(w, body, pace, iteration);
  const Float3 base = xyz(ahead.base);
  if (begins) resolve<kAccelerated, kRetarded>(block, team, w, group, pace, contacts, now, base, substep, iteration);
  const int first = team.lane();  // of this lane's particles
  Particle of_first;
  if (first < head.size) of_first = particle_at<kContacts, kAccelerated>(w, now, head.begin + first);
  block.wait_for_earlier();  // for the clusters: all else is older
  const Map goal = mean_goal(team, w, head, ahead.holders, pace.h, ahead.base).all(team);
  Float4 first_at;
  team.each(head.size, [&](int k) {
    const int o = head.begin + k;
    const Particle particle = k == first ? of_first : particle_at<kContacts, kAccelerated>(w, now, o);
    const Float3 from = now.implicit ? xyz(particle.predicted) : xyz(particle.at);
    const Float3 pull = (base - from) + goal(group.rest_of(pace, particle.node));
    const Float3 x =
        advance_particle<kContacts, kAccelerated, kRetarded>(w, pace, contacts, now, o, particle, from, pull);
    if (k == first) first_at = with_w(x, particle.start.w);
  });
  sum_resolved(team, w, group, pace, base, first_at);
}

// Of a group that was carried until now. Says whether it may touch a contact in this iteration: then nothing has been
// done.
template <bool kContacts, bool kAccelerated, bool kRetarded, class Block, int kRows>
CUTPROOF_DEVICE bool advance_carried(Block& block, const Team<Block, kRows>& team, const DeviceView& w, int g,
                                     int substep, int iteration) {
  const GroupAhead<kHoldersAtOnce<kRows>> ahead = group_ahead<kHoldersAtOnce<kRows>>(w, g);
  const GroupHead& head = ahead.group.head;
  const Float4 base = ahead.base;
  const int body = body_of_group(w, head);
  const Pace pace = constant(&w.pace[body]);
  [[maybe_unused]] float room = 0;
  [[maybe_unused]] int state = kCarried;
  if constexpr (kContacts) state = w.group_resolved[g];
  // In this order: who takes no part may have no state.
  const bool active = head.size > 0 && takes_part(pace, substep, iteration) && state != kResolved;
  const bool more = iteration + 1 < pace.iterations;
  if constexpr (kContacts) {
    if (active && state == kCarried) room = w.group_room[g];
  }
  Iteration now = {};
  if (active) now = iteration_of(w, body, pace, iteration);
  Rows<Team<Block, kRows>> present, earlier, of_prediction;
  Float4 mass, upper, lower;
  const auto read_maps = [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    if (iteration > 0) earlier.of(axis) = present.of(axis) = w.group_map[at];
    // The one before the first is no map of this kind, and of no weight.
    if constexpr (kAccelerated) {
      if (iteration > 1 && now.combined) earlier.of(axis) = w.group_earlier_map[at];
    }
  };
  const auto read_moments = [&] {
    mass = constant(&w.group_mass[g]);
    upper = constant(&w.group_spread[2 * int64_t{g}]);
    lower = constant(&w.group_spread[2 * int64_t{g} + 1]);
    if (more) team.each(3, [&](int axis) { of_prediction.of(axis) = w.group_predicted[3 * int64_t{g} + axis]; });
  };
  constexpr bool kAllAhead = kRows > 1;  // one thread has no registers for so much
  if constexpr (kAllAhead) {
    if (active) {
      team.each(3, read_maps);
      if (state == kCarried) read_moments();  // one that is held has none
    }
  }
  block.wait_for_earlier();  // for the clusters: all else is older
  if (!active) return false;
  const float lost_next = now.lost_after;
  Rows<Team<Block, kRows>> goals = mean_goal(team, w, head, ahead.holders, pace.h, base), plain, next;
  if constexpr (!kAllAhead) team.each(3, read_maps);
  team.each(3, [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    const Float4 goal = goals.of(axis);
    if constexpr (kContacts) {
      if (state == kHeld) {
        // As set_held_push().
        const float kept = now.implicit ? now.s : 1.0f, added = now.combined ? now.combination.pull * now.s : now.s;
        const auto pushed = [&](float of_goal, float is) { return kept * is + added * of_goal; };
        Float4 row = row_of(pushed, goal, present.of(axis));
        if constexpr (kAccelerated) {
          if (now.combined) {
            const Float4 y = present.of(axis), z = earlier.of(axis);
            const auto combined = [&](float is, float was, float of_goal) {
              return now.combination(kept * is, is, was) + added * of_goal;
            };
            row = {combined(y.x, z.x, goal.x), combined(y.y, z.y, goal.y), combined(y.z, z.z, goal.z),
                   combined(y.w, z.w, goal.w)};
          }
          if (now.kept) w.group_earlier_map[at] = present.of(axis);
        }
        w.group_map[at] = row;
        return;
      }
    }
    const auto relaxed = [&](float wanted, float is) {
      const float toward = now.s * wanted;
      return now.implicit ? toward : (1.0f - now.s) * is + toward;
    };
    plain.of(axis) = row_of(relaxed, goal, present.of(axis));
    next.of(axis) = plain.of(axis);
    if constexpr (kAccelerated) {
      if (!now.combined) return;
      const Float4 x = plain.of(axis), y = present.of(axis), z = earlier.of(axis);
      next.of(axis) = {now.combination(x.x, y.x, z.x), now.combination(x.y, y.y, z.y), now.combination(x.z, y.z, z.z),
                       now.combination(x.w, y.w, z.w)};
    }
  });
  if constexpr (kContacts) {
    if (state == kHeld) return false;
    // A contact with either candidate of an accelerated iteration means the plain way. Most groups are so far from any
    // that how far each axis leads them says enough.
    bool near = false;
    team.each(3, [&](int axis) {
      near = near || !(way_along(plain.of(axis), head.radius) <= kOfRoom * room) ||
             (now.combined && !(way_along(next.of(axis), head.radius) <= kOfRoom * room));
    });
    // (With retardation x lies between y and where it began, which is not at hand: resolved, nothing is left out.)
    if (team.any(near)) {
      if (leads<kRetarded>(pace)) return true;
      const Contacts contacts = contacts_of(w, pace, substep);
      const int side = w.group_side[g];
      CUTPROOF_ROLLED
      for (int k = 0; k < (now.combined ? 2 : 1); ++k) {
        Rows<Team<Block, kRows>> candidate = k == 0 ? plain : next;
        const Ball ball = ball_around(pace, ahead.group, base, 1.0f - lost_next, candidate.all(team));
        if (!is_clear(contacts, ball, side)) return true;
      }
    }
  }
  const float per_h = pace.per_h;
  // All that is read before anything is written: behind a store, each would be waited for by itself.
  if constexpr (!kAllAhead) read_moments();
  team.each(3, [&](int axis) {
    const int64_t at = 3 * int64_t{g} + axis;
    const Float4 row = next.of(axis);
    w.group_map[at] = row;
    if constexpr (kAccelerated) {
      if (now.kept) w.group_earlier_map[at] = present.of(axis);
    }
    if (!more) return;
    const Float4 predicted = of_prediction.of(axis);
    const auto moved = [&](float at_first, float by_map) { return at_first + (by_map - lost_next * at_first); };
    w.group_moments[at] = {
        moved(predicted.x, per_h * (row.w * mass.x + (row.x * upper.x + row.y * upper.y + row.z * upper.z))),
        moved(predicted.y, per_h * (row.w * mass.y + (row.x * upper.y + row.y * upper.w + row.z * lower.x))),
        moved(predicted.z, per_h * (row.w * mass.z + (row.x * upper.z + row.y * lower.x + row.z * lower.y))),
        moved(predicted.w, row.w * mass.w + (row.x * mass.x + row.y * mass.y + row.z * mass.z))};
  });
  return false;
}

// kAhead: of how many of its clusters is read before the wait where the particle rests in them.
template <bool kContacts, bool kAccelerated, bool kRetarded, int kAhead, class Block>
CUTPROOF_DEVICE void advance_loose(Block& block, const DeviceView& w, int o, int substep, int iteration) {
  if (o < 0) return;
  const int p = w.place_particle[o], body = body_index(w, p);
  const Pace pace = constant(&w.pace[body]);
  if (!takes_part(pace, substep, iteration)) return;
  const Iteration now = iteration_of(w, body, pace, iteration);
  const Particle particle = particle_at<kContacts, kAccelerated>(w, now, o);
  const Float3 at = xyz(particle.at), from = now.implicit ? xyz(particle.predicted) : at;
  // Mean of the goals, less `from`: small numbers, so that summing them costs no digits of d.
  const int clusters = w.membership_count[p], begin = w.membership_begin[p];
  const Contacts contacts = kContacts ? contacts_of(w, pace, substep) : Contacts{};
  const Coordinates c = coordinates(pace, particle.node);
  struct Holder {
    int slot;
    Float3 r;
  };
  const auto holder_at = [&](int k) {
    const int slot = constant(&w.memberships[begin + (k < clusters ? k : 0)]);
    return Holder{slot, pace.h * nodes_from_rest_center(w, c, slot)};
  };
  Holder ahead[kAhead] = {};
  if (clusters > 0) {
    for (int t = 0; t < kAhead; ++t) ahead[t] = holder_at(t);
  }
  block.wait_for_earlier();  // for the clusters: all else is older
  Float3 pull = at - from;   // a particle in no cluster stays where it is
  if (clusters > 0) {
    Float3 sum;
    // Several at once: one by one, each would wait for the one before.
    constexpr int kAtOnce = 4;
    static_assert(kAhead % kAtOnce == 0);
    const auto add = [&](const Holder* some, int first) {
      Map place[kAtOnce];
      for (int t = 0; t < kAtOnce; ++t) place[t] = load_map(w.placement, some[t].slot);
      for (int t = 0; t < kAtOnce; ++t) {
        if (first + t >= clusters) break;
        const Float4* const row = place[t].row;
        const Float3 r = some[t].r, center = {row[0].w, row[1].w, row[2].w};
        const Float3 turned = {row[0].x * r.x + row[0].y * r.y + row[0].z * r.z,
                               row[1].x * r.x + row[1].y * r.y + row[1].z * r.z,
                               row[2].x * r.x + row[2].y * r.y + row[2].z * r.z};
        sum = sum + ((center - from) + turned);
      }
    };
    for (int first = 0; first < kAhead; first += kAtOnce) {
      if (first < clusters) add(ahead + first, first);
    }
    CUTPROOF_ROLLED for (int first = kAhead; first < clusters; first += kAtOnce) {
      for (int t = 0; t < kAtOnce; ++t) ahead[t] = holder_at(first + t);
      add(ahead, first);
    }
    pull = (1.0f / static_cast<float>(clusters)) * sum;
  }
  advance_particle<kContacts, kAccelerated, kRetarded>(w, pace, contacts, now, o, particle, from, pull);
}

}  // namespace step_detail

// kRows: lanes that share a carried group.
template <bool kContacts, bool kAccelerated, bool kRetarded, int kRows, class Block>
CUTPROOF_DEVICE void advance_kernel(Block& block, const DeviceView& w, int substep, int iteration) {
  using namespace step_detail;
  const Team<Block, kRows> rows(block);
  // A warp, and what it has of teams for resolved groups, as in begin_substep_kernel.
  const Team<Block, kResolvedTeam> warp(block);
  const Team<Block, kResolvedLanes<kRows>> team(block);
  const int groups = w.counters->groups, loose = w.counters->loose;
  const int resolved = kContacts ? *listed_before(w, substep, iteration) : 0;
  // Whole warps at a time: groups that turn out to be no longer clear are everybody's, as are those that were resolved
  // before, with which the warps behind begin. All of them in one place, because there is much to it.
  const int64_t in_warp = rows.first() % (warp.kLanes / rows.kLanes);
  int64_t row = rows.first(), listed = behind(team, groups * rows.kLanes);
  [[maybe_unused]] unsigned found = 0;
  while (true) {
    [[maybe_unused]] bool begins = false;
    [[maybe_unused]] int g = -1;
    if (found != 0) {
      begins = true;
      g = take_each(warp, team, found, static_cast<int>(row - rows.stride()));
    } else if (row - in_warp < groups) {
      const bool touches = row < groups && advance_carried<kContacts, kAccelerated, kRetarded>(
                                               block, rows, w, static_cast<int>(row), substep, iteration);
      if constexpr (kContacts) found = warp.found(touches && rows.leads());
      row += rows.stride();
      continue;
    } else if (listed < resolved) {
      g = block.load(&w.resolved_groups[listed]);
      listed += team.stride();
    } else {
      break;
    }
    if constexpr (kContacts) {
      if (g >= 0) {
        advance_resolved<kContacts, kAccelerated, kRetarded>(block, team, w, group_ahead<kHoldersAtOnce<kRows>>(w, g),
                                                             substep, iteration, begins);
      }
    }
  }
  if (loose == 0) return;
  const Team<Block, 1> thread(block);
  for (int64_t k = behind(thread, busy_threads(rows, groups, team, resolved)); k < loose; k += thread.stride()) {
    advance_loose<kContacts, kAccelerated, kRetarded, kHoldersAtOnce<kRows>>(block, w, w.loose_places[k], substep,
                                                                             iteration);
  }
}

template <bool kContacts, bool kRetarded, int kLanes>
struct begin_first_substep_kernel_object {
  static constexpr const char* kName = "begin_first_substep_kernel";
  static constexpr int kMaxThreads = 128, kMinBlocks = 4;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w) const {
    begin_first_substep_kernel<kContacts, kRetarded, kLanes>(block, w);
  }
};
template <bool kContacts, bool kRetarded, int kRows>
struct begin_substep_kernel_object {
  static constexpr const char* kName = "begin_substep_kernel";
  static constexpr int kMaxThreads = 128, kMinBlocks = 4;
  static constexpr bool kReadsAhead = true;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w, int substep) const {
    begin_substep_kernel<kContacts, kRetarded, kRows>(block, w, substep);
  }
};
template <bool kContacts, bool kRetarded, int kLanes>
struct end_step_kernel_object {
  static constexpr const char* kName = "end_step_kernel";
  static constexpr int kMaxThreads = 128, kMinBlocks = 5;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w) const {
    end_step_kernel<kContacts, kRetarded, kLanes>(block, w);
  }
};
template <bool kContacts, bool kAccelerated, bool kRetarded, int kRows>
struct advance_kernel_object {
  static constexpr const char* kName = "advance_kernel";
  static constexpr int kMaxThreads = 128, kMinBlocks = kRows > 1 ? 3 : 4;
  static constexpr bool kReadsAhead = true;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w, int substep, int iteration) const {
    advance_kernel<kContacts, kAccelerated, kRetarded, kRows>(block, w, substep, iteration);
  }
};

namespace step_detail {

template <bool kContacts, bool kAccelerated, bool kRetarded, class Launcher>
void enqueue(Launcher& launcher, const DeviceView& w, const Plan& plan, Span span) {
  const int64_t particles = w.particles > w.bodies ? w.particles : w.bodies;
  const int64_t of_places = (w.place_capacity + kParticleTeam - 1) / kParticleTeam;
  const int64_t teams = w.group_capacity > of_places ? w.group_capacity : of_places;
  launcher.items(begin_frame_kernel_object{}, particles, w, span);
  if (!span.is_whole_frame()) enqueue_groups_if_stale(launcher, w);
  // Of a small load each group has lanes enough for its rows; of a large one they would all do what one can do for
  // three.
  const auto by_rows = [&](auto start) {
    if (w.particles > kMostByRows) return start(std::integral_constant<int, 1>{});
    start(std::integral_constant<int, kRowTeam>{});
  };
  const auto by_clusters = [&](auto start) {
    if (w.slots_expected > kFewClusters) return start(std::integral_constant<int, kHalfTeam>{});
    start(std::integral_constant<int, kClusterTeam>{});
  };
  // The same for the lanes that share a group's particles.
  const auto by_particles = [&](auto start) {
    by_rows([&](auto rows) {
      constexpr int kLanes = rows.value == 1 ? kParticleTeam / 2 : kParticleTeam;
      start(std::integral_constant<int, kLanes>{});
    });
  };
  by_particles([&](auto lanes) {
    launcher.teams(begin_first_substep_kernel_object<kContacts, kRetarded, lanes.value>{}, lanes.value, teams, w);
  });
  for (int substep = 0; substep < plan.substeps; ++substep) {
    if (substep > 0) {
      by_rows([&](auto rows) {
        launcher.teams(begin_substep_kernel_object<kContacts, kRetarded, rows.value>{}, kParticleTeam, teams, w,
                       substep);
      });
    }
    for (int iteration = 0; iteration < plan.iterations; ++iteration) {
      by_clusters([&](auto lanes) {
        constexpr int kTeams = kMatchThreads / lanes.value;
        launcher.blocks(match_shapes_kernel_object<lanes.value>{}, (w.slots_expected + kTeams - 1) / kTeams,
                        kMatchThreads, kMatchShared<lanes.value>, w, substep, iteration);
      });
      by_rows([&](auto rows) {
        launcher.teams(advance_kernel_object<kContacts, kAccelerated, kRetarded, rows.value>{}, kParticleTeam, teams, w,
                       substep, iteration);
      });
    }
  }
  by_particles([&](auto lanes) {
    launcher.teams(end_step_kernel_object<kContacts, kRetarded, lanes.value>{}, lanes.value, teams, w);
  });
}

template <class Launcher>
void enqueue(Launcher& launcher, const DeviceView& w, const Plan& plan, Span span) {
  if (plan.retarded) {
    enqueue<true, true, true>(launcher, w, plan, span);
  } else if (plan.contacts && plan.accelerated) {
    enqueue<true, true, false>(launcher, w, plan, span);
  } else if (plan.contacts) {
    enqueue<true, false, false>(launcher, w, plan, span);
  } else if (plan.accelerated) {
    enqueue<false, true, false>(launcher, w, plan, span);
  } else {
    enqueue<false, false, false>(launcher, w, plan, span);
  }
}

}  // namespace step_detail

// All substeps of the frame of every running body. span: that of which the step is the first stage.
template <class Launcher>
void enqueue_step(Launcher& launcher, const DeviceView& w, const Plan& plan, Span span) {
  step_detail::enqueue(launcher, w, plan, span);
}

}  // namespace cutproof::gpu
