// Stage detect (method.md §4): which particles a cut removes from the tissue. Every particle is judged by the tissue
// before the stage; then all are removed at once.
//
// Rounding of decisions, compared with exact arithmetic on the same stored numbers (u = 2^-24):
// - distance: d_i > epsilon h is inconclusive where |d_i - epsilon h| <= 8 u (1 + epsilon) h. An edge is h e plus a
//   difference of displacements, so the body's place does not matter. The bound adds u for the difference, u for
//   the sum, 1.5 u for the squares and their sum, and u each for h, epsilon, their product and its square.
// - distance, where one end of each edge is removed: a fate is also inconclusive if this holds of a neighbour's edge.
//   So it is where an end is as near to the blade's plane as places are rounded (as for geometric). By the nearer end
//   it also is where the distances to which the clusters carry both ends differ from the limit by no more than their
//   rounding: as skin vertices, and as places.
// - geometric: distances to the blade are between places in the body, so they carry 10 u |x| + 8 u |edge|. These are u
//   each for h, X, X + d and the stored edge; and for x - edge the difference, the stored axes and the products with
//   them. Ties are removed, so the reach is longer by swept_slack(), which exceeds that. All within the reach is
//   removed; particles farther by up to twice the slack may be.
#pragma once
#include <type_traits>

#include "gpu/kernels/carried_tissue.cuh"
#include "gpu/kernels/lowered_plane.cuh"
#include "gpu/kernels/symmetric.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/plan.h"

namespace cutproof::gpu {

namespace detect_detail {

// DeviceView::particle_flag. kContested: the particle has open edges whose removed end is not yet chosen. The choice
// follows when all open edges are counted and centres of clusters are known.
enum : unsigned char { kStays = 0, kGoes = 1, kWentBefore = 2, kContested = 3 };

inline constexpr float kRounding = 0x1p-24f;

CUTPROOF_DEVICE inline int body_index(const DeviceView& w, int p) { return w.bodies == 1 ? 0 : w.body_of[p]; }

CUTPROOF_DEVICE inline bool detects(const DeviceView& w, int b) { return w.body[b].needs_detection && running(w, b); }

// The removal code of this frame's detection.
CUTPROOF_DEVICE inline int removal_code(const DeviceView& w, int b) { return 2 * w.frame[b] + 2; }

// visit(direction, squared length, other end) for the edges of G at p. Each is evaluated from its lower to its upper
// end, so both ends get the same bits.
template <class Visit>
CUTPROOF_DEVICE inline void for_edges(const DeviceView& w, const BodyConstants& body, int p, Visit visit) {
  const Float3 here = xyz(w.displacement[p]);
  for (int direction = 0; direction < 6; ++direction) {
    const int q = neighbour(w, body, p, direction);
    if (q < 0 || !alive(w, q)) continue;
    const Float3 there = xyz(w.displacement[q]);
    const Float3 difference = direction % 2 == 0 ? there - here : here - there;
    const int axis = direction / 2;
    const Float3 edge = {axis == 0 ? body.h + difference.x : difference.x,
                         axis == 1 ? body.h + difference.y : difference.y,
                         axis == 2 ? body.h + difference.z : difference.z};
    visit(direction, dot(edge, edge), q);
  }
}

// d_i²: the greatest squared distance to a neighbour in G; 0 without neighbours.
CUTPROOF_DEVICE inline float greatest_squared_edge(const DeviceView& w, const BodyConstants& body, int p) {
  float greatest = 0;
  for_edges(w, body, p, [&](int, float squared, int) { greatest = squared > greatest ? squared : greatest; });
  return greatest;
}

// ---- one end of each edge that is too long

// A particle's open edges, as DeviceView::particle_scratch shows them to its neighbours: their number, the directions
// in which the blade chooses no end, and those in which it takes the nearer end.
struct OpenEdges {
  int count = 0;
  unsigned contested = 0, crossing = 0;
};
CUTPROOF_DEVICE inline int packed(OpenEdges edges) {
  return edges.count << 12 | static_cast<int>(edges.crossing << 6 | edges.contested);
}
CUTPROOF_DEVICE inline OpenEdges unpacked(int word) {
  return {word >> 12, static_cast<unsigned>(word) & 63u, static_cast<unsigned>(word) >> 6 & 63u};
}

CUTPROOF_DEVICE inline bool is_negative(const DeviceView& w, const BodyConstants& body, const Plane& plane, int p) {
  return height_over(plane, rest_position(body, w.node[p]) + xyz(w.displacement[p])) < 0;
}

// Distance from the plane to which the clusters carry a particle.
CUTPROOF_DEVICE inline float carried_from(const DeviceView& w, const BodyConstants& body, const Plane& plane, int p) {
  const Float3 d = w.keeps_volume != 0 ? carried<true>(w, body, p, {}) : carried<false>(w, body, p, {});
  return fabsf(height_over(plane, rest_position(body, w.node[p]) + d));
}

// Of an edge across the plane, by the nearer end: whether its end on the negative side is removed. Both ends ask with
// the same numbers.
CUTPROOF_DEVICE inline bool negative_goes(const DeviceView& w, const BodyConstants& body, const Plane& plane,
                                          int negative, int positive) {
  const float limit = static_cast<float>(kNearerBy) * body.h;
  return carried_from(w, body, plane, negative) <= carried_from(w, body, plane, positive) + limit;
}

// The fate of a particle with an edge longer than the root of `limit`. Marks the clusters whose centres decide it.
template <bool kNearer, class Block>
CUTPROOF_DEVICE unsigned char flag_of_open(Block& block, const DeviceView& w, const BodyConstants& body, int b, int p,
                                           float limit) {
  if (body.remove == RemovedEnds::both) return kGoes;
  const Plane plane = lowered_plane(w, body, b);
  const bool negative = plane.exists && is_negative(w, body, plane, p);
  OpenEdges open;
  bool goes = false;
  for_edges(w, body, p, [&](int direction, float squared, int q) {
    if (!(squared > limit)) return;
    ++open.count;
    if (!plane.exists || is_negative(w, body, plane, q) == negative) {
      open.contested |= 1u << direction;
    } else if (kNearer && body.remove == RemovedEnds::nearer) {
      open.crossing |= 1u << direction;
    } else {
      goes = goes || negative;
    }
  });
  w.particle_scratch[p] = packed(open);
  if (kNearer && open.crossing != 0) {
    for (int k = w.membership_begin[p]; k < w.membership_begin[p + 1]; ++k) {
      const int s = w.memberships[k];
      if (s >= 0) block.store(&w.center_asked[s], removal_code(w, b));
    }
  }
  return goes ? kGoes : (open.contested | open.crossing) != 0 ? kContested : kStays;
}

// Whether the particle loses one of the remaining edges. If the edge crosses the blade's plane, this is the removed
// end. Otherwise it has more open edges than the other end, or as many and the lower number.
template <bool kNearer>
CUTPROOF_DEVICE inline bool loses(const DeviceView& w, int b, int p) {
  const BodyConstants& body = w.body[b];
  const OpenEdges open = unpacked(w.particle_scratch[p]);
  bool goes = false;
  if (kNearer && open.crossing != 0) {
    const Plane plane = lowered_plane(w, body, b);
    const bool negative = is_negative(w, body, plane, p);
    for (int direction = 0; direction < 6; ++direction) {
      if (!(open.crossing >> direction & 1u)) continue;
      const int q = neighbour(w, body, p, direction);
      goes = goes || negative_goes(w, body, plane, negative ? p : q, negative ? q : p) == negative;
    }
  }
  for (int direction = 0; direction < 6; ++direction) {
    if (!(open.contested >> direction & 1u)) continue;
    const int q = neighbour(w, body, p, direction);
    const int others = unpacked(w.particle_scratch[q]).count;
    goes = goes || open.count > others || (open.count == others && p < q);
  }
  return goes;
}

// ---- the swept mid-surface

// Directions along the cutting edge, to the back, and normal to both.
struct Axes {
  Float3 along, back, normal;
};
CUTPROOF_DEVICE inline Float3 in_axes(const Axes& axes, Float3 v) {
  return {dot(v, axes.along), dot(v, axes.back), dot(v, axes.normal)};
}

// Signed distance of c beyond [low, high].
CUTPROOF_DEVICE inline float beyond(float c, float low, float high) {
  return c < low ? c - low : c > high ? c - high : 0.0f;
}

// The vector from the rectangle |x| <= half, 0 <= y <= depth, z = 0 to a point.
struct Rectangle {
  float half, depth;
};
CUTPROOF_DEVICE inline Float3 from_rectangle(Rectangle r, Float3 c) {
  return {beyond(c.x, -r.half, r.half), beyond(c.y, 0.0f, r.depth), c.z};
}

// The least distance between a point and the rectangle while the rectangle moves along `way`; all in the rectangle's
// axes.
//
// Half the squared distance at time t in [0, 1] is convex with the slope -way · from_rectangle(c - t way). The slope is
// linear between the times at which a coordinate enters or leaves its range. Those times narrow down the change of its
// sign to a linear part, whose zero has a formula.
CUTPROOF_DEVICE inline float distance_to_sweep(Rectangle r, Float3 c, Float3 way) {
  const auto slope = [&](float t) { return -dot(way, from_rectangle(r, c - t * way)); };
  float low = 0, high = 1, t = 0;
  float slope_low = slope(low), slope_high = slope(high);
  if (slope_low >= 0) {
    t = 0;
  } else if (slope_high <= 0) {
    t = 1;
  } else {
    const float bounds[4] = {-r.half, r.half, 0, r.depth};
    for (int k = 0; k < 4; ++k) {
      const float speed = k < 2 ? way.x : way.y;
      const float crossing = ((k < 2 ? c.x : c.y) - bounds[k]) / speed;  // outside (low, high) if never crossed
      if (!(crossing > low && crossing < high)) continue;
      const float here = slope(crossing);
      if (here < 0) {
        low = crossing;
        slope_low = here;
      } else {
        high = crossing;
        slope_high = here;
      }
    }
    t = low + (high - low) * (slope_low / (slope_low - slope_high));
  }
  return norm(from_rectangle(r, c - t * way));
}

// A rotation about `axis` by an angle in [0, π], given by its cosine and sine.
struct Turn {
  Float3 axis;
  float cosine, sine;
};
struct Angle {
  float cosine, sine;
};

CUTPROOF_DEVICE inline Float3 turned(Float3 v, Float3 axis, Angle a) {  // Rodrigues
  return a.cosine * v + a.sine * cross(axis, v) + ((1.0f - a.cosine) * dot(axis, v)) * axis;
}
CUTPROOF_DEVICE inline Angle half_of(Angle a) {  // of an angle in [0, π]
  const float larger = sqrtf((1.0f + fabsf(a.cosine)) / 2.0f), smaller = a.sine / (2.0f * larger);
  return a.cosine < 0 ? Angle{smaller, larger} : Angle{larger, smaller};
}
CUTPROOF_DEVICE inline Angle between(Angle a, Angle b) {  // half way; the two are at most a quarter turn apart
  const float c = a.cosine + b.cosine, s = a.sine + b.sine;
  const float length = sqrtf(c * c + s * s);
  return {c / length, s / length};
}
// At least the angle between two: that of a chord x is 2 asin(x / 2) = x + x³ / 24 + …
CUTPROOF_DEVICE inline float angle_between(Angle a, Angle b) {
  const float c = a.cosine - b.cosine, s = a.sine - b.sine;
  const float chord = sqrtf(c * c + s * s);
  return chord <= 1.0f ? chord * (1.0f + chord * chord / 20.0f) : 1.5708f * chord;
}

// The rotation Σ to_k from_kᵀ that takes one set of axes to the other.
CUTPROOF_DEVICE inline Turn turn_between(const Axes& from, const Axes& to) {
  const auto entry = [&](int row, int column) {
    return to.along[row] * from.along[column] + to.back[row] * from.back[column] + to.normal[row] * from.normal[column];
  };
  const Float3 diagonal = {entry(0, 0), entry(1, 1), entry(2, 2)};
  const Float3 twice_sine = {entry(2, 1) - entry(1, 2), entry(0, 2) - entry(2, 0), entry(1, 0) - entry(0, 1)};
  const float length = norm(twice_sine);
  Turn turn = {{0, 0, 1}, (diagonal.x + diagonal.y + diagonal.z - 1.0f) / 2.0f, length / 2.0f};
  if (turn.cosine > 0) {
    if (length > 0) turn.axis = (1.0f / length) * twice_sine;
  } else {
    // Near half a turn the sine is inaccurate. The axis is the longest column of (R + Rᵀ) / 2 = cos + (1 - cos) axis
    // axisᵀ.
    const int k = diagonal.x >= diagonal.y && diagonal.x >= diagonal.z ? 0 : diagonal.y >= diagonal.z ? 1 : 2;
    const auto symmetric = [&](int row) {
      return (entry(row, k) + entry(k, row)) / 2.0f - (row == k ? turn.cosine : 0.0f);
    };
    const Float3 column = {symmetric(0), symmetric(1), symmetric(2)};
    const float sign = dot(column, twice_sine) < 0 ? -1.0f : 1.0f;
    turn.axis = (sign / norm(column)) * column;
  }
  const float scale = 1.0f / sqrtf(turn.cosine * turn.cosine + turn.sine * turn.sine);
  turn.cosine *= scale;
  turn.sine *= scale;
  return turn;
}

// Extension of the reach that removes ties, given the length of |x| + |edge|.
CUTPROOF_DEVICE inline float swept_slack(float reach, float places) {
  return 16.0f * kRounding * reach + 12.0f * kRounding * places;
}

// Whether the plate comes as near as `reach` to x while it rotates and its edge moves along `way`. A part of the move
// counts as a translation; the plate is never farther from it than its radius times the part's angle. Where it matters,
// parts with more than h / 25 are halved.
CUTPROOF_DEVICE inline bool turning_comes_near(const BodyConstants& body, const PoseF& from, const Axes& axes,
                                               const Axes& last, Float3 way, float reach, Float3 x) {
  constexpr int kMostHalvings = 24;
  const Rectangle rectangle = {body.blade_length / 2.0f, body.blade_depth};
  const float radius = sqrtf(rectangle.half * rectangle.half + rectangle.depth * rectangle.depth);
  const Turn turn = turn_between(axes, last);
  // The binary tree of parts in depth-first order; of the 2^level parts at `level` this is `part`.
  int level = 0;
  unsigned part = 0;
  for (;;) {
    Angle a = {1, 0}, b = {turn.cosine, turn.sine};
    for (int bit = level - 1; bit >= 0; --bit) {
      const Angle middle = bit == level - 1 ? half_of(b) : between(a, b);
      (part >> bit & 1u ? a : b) = middle;
    }
    const float length = ldexpf(1.0f, -level);
    const float begin = static_cast<float>(part) * length;
    const float slack = radius * angle_between(a, b);
    const Axes now = {turned(axes.along, turn.axis, a), turned(axes.back, turn.axis, a),
                      turned(axes.normal, turn.axis, a)};
    const float distance =
        distance_to_sweep(rectangle, in_axes(now, x - from.edge - begin * way), length * in_axes(now, way));
    const bool near = distance <= reach + slack;
    const bool fine = slack <= 0.04f * body.h || level == kMostHalvings;
    if (near && (fine || distance + slack <= reach)) return true;
    if (near && !fine) {
      ++level;
      part *= 2;
      continue;
    }
    for (; part & 1u; part /= 2) --level;
    if (level == 0) return false;
    ++part;
  }
}

CUTPROOF_DEVICE inline bool same(Float3 a, Float3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

// Whether the blade comes as near as max(thickness, h, d_i) / 2 to a particle at x in this move. So each edge that it
// crosses loses an end, stretched tissue included.
CUTPROOF_DEVICE inline bool is_swept(const BodyConstants& body, const MoveF& move, float longest_edge, Float3 x) {
  const PoseF &from = move.from, &to = move.to;
  const Axes axes = {from.along, from.back, cross(from.along, from.back)};
  const Rectangle rectangle = {body.blade_length / 2.0f, body.blade_depth};
  const float longest = longest_edge > body.h ? longest_edge : body.h;
  const float half = (body.blade_thickness > longest ? body.blade_thickness : longest) / 2.0f;
  const float reach = half + swept_slack(half, norm(x) + norm(from.edge));

  const bool turns = !same(from.along, to.along) || !same(from.back, to.back);
  const Axes last = {to.along, to.back, cross(to.along, to.back)};
  float arc = 0;
  if (turns) {
    // Σ |e' - e|² over three orthonormal e is 8 sin²(angle / 2), and angle <= π sin(angle / 2).
    const Float3 a = last.along - axes.along, b = last.back - axes.back, c = last.normal - axes.normal;
    const float radius = sqrtf(rectangle.half * rectangle.half + rectangle.depth * rectangle.depth);
    arc = radius * 3.1416f * sqrtf((dot(a, a) + dot(b, b) + dot(c, c)) / 8.0f);
  }

  // A bounding box spares most particles the exact distance.
  const Float3 way = to.edge - from.edge;
  const Float3 at = in_axes(axes, x - from.edge), moved = in_axes(axes, way);
  const float margin = reach + arc;
  const auto outside = [&](float c, float low, float high, float goes) {
    return c < low + (goes < 0 ? goes : 0.0f) - margin || c > high + (goes > 0 ? goes : 0.0f) + margin;
  };
  if (outside(at.x, -rectangle.half, rectangle.half, moved.x) || outside(at.y, 0, rectangle.depth, moved.y) ||
      outside(at.z, 0, 0, moved.z)) {
    return false;
  }
  if (turns) return turning_comes_near(body, from, axes, last, way, reach, x);
  return distance_to_sweep(rectangle, at, moved) <= reach;
}

// ---- strain

// The greatest stretch of the deformation gradient A A0⁺, with A0 = Σ w r rᵀ (r = X - T) and A = A0 + B, B = Σ w e rᵀ
// (e: displacement less its mean). As with the pseudo-inverse, directions without extent are left out. Not finite if B
// is not.
CUTPROOF_DEVICE inline float greatest_stretch(const float (&a0)[3][3], const float (&b)[3][3]) {
  // An eigenvalue of a flat cluster is a sum of exact zeros: connected clusters are flat only along axes.
  constexpr float kNoExtent = 0x1p-22f;
  float n[3][3], v[3][3];
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) n[row][column] = a0[row][column];
  }
  diagonalise(n, v);
  const float most = fmaxf(n[0][0], fmaxf(n[1][1], n[2][2]));
  // With A0 = V Λ Vᵀ the gradient times V has the columns v_k + B v_k / λ_k, or 0.
  float f[3][3];
  for (int k = 0; k < 3; ++k) {
    const float inverse = n[k][k] > kNoExtent * most ? 1.0f / n[k][k] : 0.0f;
    for (int row = 0; row < 3; ++row) {
      const float bv = b[row][0] * v[0][k] + b[row][1] * v[1][k] + b[row][2] * v[2][k];
      f[row][k] = inverse > 0 ? v[row][k] + inverse * bv : 0.0f;
    }
  }
  float c[3][3], unused[3][3];
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      c[row][column] = f[0][row] * f[0][column] + f[1][row] * f[1][column] + f[2][row] * f[2][column];
    }
  }
  const float trace = c[0][0] + c[1][1] + c[2][2];
  if (!(trace <= 3.0e38f)) return trace;
  diagonalise(c, unused);
  return sqrtf(fmaxf(c[0][0], fmaxf(c[1][1], c[2][2])));
}

inline constexpr int kStrainTeam = 32;  // lanes of a cluster

}  // namespace detect_detail

// slot_flag: clusters stretched too much in some direction. The paper rejects this criterion (Fig. 7); it is a
// baseline.
template <class Block>
CUTPROOF_DEVICE void flag_strained_clusters_kernel(Block& block, DeviceView w) {
  using namespace detect_detail;
  const Team<Block, kStrainTeam> team(block);
  for (int64_t i = team.first(); i < w.counters->slots_used; i += team.stride()) {
    const int s = static_cast<int>(i);
    const int b = w.slot_body[s], size = w.slot_size[s];
    const BodyConstants& body = w.body[b];
    if (size == 0 || body.criterion != Criterion::strain || !detects(w, b)) continue;
    const int* const members = w.members + w.slot_begin[s];
    const Float3 base = xyz(w.displacement[members[0]]);
    // add(k, p, w, d - base) for the members of this lane.
    const auto weighted = [&](auto add) {
      team.each(size, [&](int k) {
        const int p = members[k];
        const Float4 now = w.displacement[p];
        add(k, p, now.w / static_cast<float>(w.membership_count[p]), xyz(now) - base);
      });
    };
    typename Team<Block, kStrainTeam>::template Sums<3> means;
    weighted([&](int k, int, float weight, Float3 e) {
      float* const sum = means.of(k);
      sum[0] += weight * e.x;
      sum[1] += weight * e.y;
      sum[2] += weight * e.z;
    });
    const auto moment = team.total(means);
    const Float3 mean = (1.0f / w.mass[s]) * Float3{moment.v[0], moment.v[1], moment.v[2]};
    // Σ w r rᵀ, then Σ w (e - mean) rᵀ, by rows.
    typename Team<Block, kStrainTeam>::template Sums<18> products;
    weighted([&](int k, int p, float weight, Float3 e) {
      const Float3 r = from_rest_center(w, body, p, s), d = e - mean;
      float* const sum = products.of(k);
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          sum[3 * row + column] += weight * (r[row] * r[column]);
          sum[9 + 3 * row + column] += weight * (d[row] * r[column]);
        }
      }
    });
    const auto total = team.total(products);
    if (!team.leads()) continue;
    float a0[3][3], moved[3][3];
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        a0[row][column] = total.v[3 * row + column];
        moved[row][column] = total.v[9 + 3 * row + column];
      }
    }
    const float stretch = greatest_stretch(a0, moved);
    w.slot_flag[s] = stretch > body.strain && stretch <= 3.0e38f;
  }
}
CUTPROOF_KERNEL(flag_strained_clusters_kernel);

// DeviceView::center of the clusters that carry an end of an edge whose nearer end is removed. (They may include
// clusters that an earlier detection of this frame marked.)
template <bool kVolume, class Block>
CUTPROOF_DEVICE void recenter_asked_clusters_kernel(Block& block, DeviceView w) {
  using namespace detect_detail;
  const Team<Block, kCenterTeam> team(block);
  for (int64_t i = team.first(); i < w.counters->slots_used; i += team.stride()) {
    const int s = static_cast<int>(i);
    if (w.slot_size[s] > 0 && w.center_asked[s] == removal_code(w, w.slot_body[s])) recenter<kVolume>(w, team, s);
  }
}
template <bool kVolume>
struct recenter_asked_clusters_kernel_object {
  static constexpr const char* kName = "recenter_asked_clusters_kernel";
  static constexpr int kMaxThreads = 256;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w) const {
    recenter_asked_clusters_kernel<kVolume>(block, w);
  }
};

// Judges the particles of every body without a geometric cut. kNearer: some body removes the nearer ends of edges.
template <bool kNearer, class Block>
CUTPROOF_DEVICE void flag_particles_kernel(Block& block, const DeviceView& w) {
  using namespace detect_detail;
  if (block.first() == 0) w.counters->removed = 0;
  for (int64_t b = block.first(); b < w.bodies; b += block.stride()) {
    if (detects(w, static_cast<int>(b))) w.cut[b] = -1;
  }
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i), b = body_index(w, p);
    const BodyConstants& body = w.body[b];
    unsigned char flag = kStays;
    if (detects(w, b)) {
      if (!alive(w, p)) {
        if (w.death[p] == removal_code(w, b)) flag = kWentBefore;
      } else if (body.criterion == Criterion::distance) {
        const float limit = body.epsilon * body.h;
        if (greatest_squared_edge(w, body, p) > limit * limit)
          flag = flag_of_open<kNearer>(block, w, body, b, p, limit * limit);
      } else if (body.criterion == Criterion::strain) {
        for (int k = w.membership_begin[p]; k < w.membership_begin[p + 1]; ++k) {
          const int s = w.memberships[k];
          if (s >= 0 && w.slot_flag[s]) flag = kGoes;
        }
      }
    }
    w.particle_flag[p] = flag;
  }
}
template <bool kNearer>
struct flag_particles_kernel_object {
  static constexpr const char* kName = "flag_particles_kernel";
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w) const {
    flag_particles_kernel<kNearer>(block, w);
  }
};

template <class Block>
CUTPROOF_DEVICE void flag_swept_particles_kernel(Block& block, DeviceView w) {
  using namespace detect_detail;
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i), b = body_index(w, p);
    const BodyConstants& body = w.body[b];
    if (body.criterion != Criterion::geometric || !body.has_blade || !detects(w, b) || !alive(w, p)) continue;
    const MoveF* const moves = w.moves + body.schedule + int64_t{w.frame[b]} * body.substeps;
    float longest = -1;
    for (int s = 0; s < body.substeps; ++s) {
      if (!moves[s].down) continue;
      if (longest < 0) longest = sqrtf(greatest_squared_edge(w, body, p));
      if (is_swept(body, moves[s], longest, rest_position(body, w.node[p]) + xyz(w.displacement[p]))) {
        w.particle_flag[p] = kGoes;
        break;
      }
    }
  }
}
CUTPROOF_KERNEL(flag_swept_particles_kernel);

// Particles that an earlier detection of this frame removed leave the list; this detection writes it anew.
template <bool kNearer, class Block>
CUTPROOF_DEVICE void remove_particles_kernel(Block& block, const DeviceView& w) {
  using namespace detect_detail;
  int removed = 0;
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i);
    const unsigned char flag = w.particle_flag[p];
    if (flag == kStays) continue;
    if (flag == kWentBefore) {
      w.death[p] = kDeadBefore;
      block.store(&w.debris_anywhere[body_index(w, p)], 1);  // beside it too
      continue;
    }
    const int b = body_index(w, p), code = removal_code(w, b);
    if (flag == kContested && !loses<kNearer>(w, b, p)) continue;
    w.death[p] = code;
    block.store(&w.cut[b], code);
    ++removed;
  }
  if (removed > 0) block.atomic_add(&w.counters->removed, removed);
}
template <bool kNearer>
struct remove_particles_kernel_object {
  static constexpr const char* kName = "remove_particles_kernel";
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w) const {
    remove_particles_kernel<kNearer>(block, w);
  }
};

template <class Launcher>
void enqueue_detect(Launcher& launcher, const DeviceView& w, const Plan& plan) {
  using namespace detect_detail;
  if (plan.strain) launcher.teams(flag_strained_clusters_kernel_object{}, kStrainTeam, w.slots_expected, w);
  // Only these instances contain code for the nearer end: code for few particles takes registers of all.
  const auto by_ends = [&](auto nearer) {
    launcher.items(flag_particles_kernel_object<nearer.value>{}, w.particles, w);
    if (plan.geometric) launcher.items(flag_swept_particles_kernel_object{}, w.particles, w);
    if constexpr (nearer.value) {
      by_volume(w.keeps_volume != 0, [&](auto volume) {
        launcher.teams(recenter_asked_clusters_kernel_object<volume.value>{}, kCenterTeam, w.slots_expected, w);
      });
    }
    launcher.items(remove_particles_kernel_object<nearer.value>{}, w.particles, w);
  };
  if (plan.nearer) {
    by_ends(std::true_type{});
  } else {
    by_ends(std::false_type{});
  }
}

}  // namespace cutproof::gpu
