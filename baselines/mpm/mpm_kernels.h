// The method in single precision, as kernels over an executor of parallel.h.
//
// Points are sorted by cell, the least node of their stencil. A node belongs to the first cell that has it, and gathers
// from the points of all cells that have it, always in the same order: so without atomics, and with the same bits.
#pragma once
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "baselines/mpm/mpm.h"
#include "baselines/parallel.h"

namespace cutproof::baselines::mpm_kernels {

#define MPM_INLINE inline BASELINES_HOST_DEVICE

struct V3 {
  float x, y, z;
};
MPM_INLINE V3 operator+(V3 a, V3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
MPM_INLINE V3 operator-(V3 a, V3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
MPM_INLINE V3 operator*(float s, V3 a) { return {s * a.x, s * a.y, s * a.z}; }
MPM_INLINE float dot(V3 a, V3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
MPM_INLINE V3 cross(V3 a, V3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

struct M3 {
  V3 row[3];
};
MPM_INLINE V3 operator*(const M3& m, V3 a) { return {dot(m.row[0], a), dot(m.row[1], a), dot(m.row[2], a)}; }

constexpr int kMostPlates = 16;  // two bits each in a word: 1 along the normal, 2 against it
struct FlatPlate {
  V3 corner[4], velocity;
};
struct Plates {
  int count = 0;
  FlatPlate plate[kMostPlates];
};
// Whether a node and a point lie on different sides of a plate.
MPM_INLINE bool are_parted(uint32_t node, uint32_t point) {
  return ((node & (point >> 1) & 0x55555555u) | (point & (node >> 1) & 0x55555555u)) != 0;
}
// That of one plate.
MPM_INLINE int side_in(uint32_t word, int plate) {
  const uint32_t bits = word >> (2 * plate) & 3u;
  return bits == 1 ? 1 : bits == 2 ? -1 : 0;
}

// A place in its stencil: from 0.5 to 1.5 cells from the base, along each axis.
struct Place {
  int base[3];
  float off[3];
  bool is_fine;  // finite, and not too far away for whole numbers
};
MPM_INLINE Place place_in_grid(V3 x, float cell) {
  Place place;
  place.is_fine = true;
  const float at[3] = {x.x / cell, x.y / cell, x.z / cell};
  for (int a = 0; a < 3; ++a) {
    const float base = floorf(at[a] - 0.5f);
    const bool is_fine = fabsf(base) < 1e6f;
    place.is_fine = place.is_fine && is_fine;
    place.base[a] = is_fine ? static_cast<int>(base) : 0;
    place.off[a] = at[a] - base;
  }
  return place;
}
MPM_INLINE float spline(float off, int k) {
  const float far = k == 0 ? 1.5f - off : off - 0.5f, near = off - 1;
  return k == 1 ? 0.75f - near * near : 0.5f * far * far;
}
MPM_INLINE float weight_of(const Place& p, int k) {
  return spline(p.off[0], k / 9) * spline(p.off[1], k / 3 % 3) * spline(p.off[2], k % 3);
}
MPM_INLINE V3 way_to(const Place& p, int k, float cell) {
  return {cell * (static_cast<float>(k / 9) - p.off[0]), cell * (static_cast<float>(k / 3 % 3) - p.off[1]),
          cell * (static_cast<float>(k % 3) - p.off[2])};
}

// The rotation with the greatest tr(RᵀF) by its quaternion: the eigenvector of the greatest eigenvalue of a symmetric
// matrix (Horn 1987, Closed-form solution of absolute orientation), by Jacobi's rotations.
MPM_INLINE M3 nearest_rotation(const M3& f) {
  const V3 a = f.row[0], b = f.row[1], c = f.row[2];
  float k[4][4] = {{a.x + b.y + c.z, c.y - b.z, a.z - c.x, b.x - a.y},
                   {c.y - b.z, a.x - b.y - c.z, a.y + b.x, a.z + c.x},
                   {a.z - c.x, a.y + b.x, b.y - a.x - c.z, b.z + c.y},
                   {b.x - a.y, a.z + c.x, b.z + c.y, c.z - a.x - b.y}};
  float v[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  for (int sweep = 0; sweep < 10; ++sweep) {
    float off = 0, size = 0;
    for (int p = 0; p < 4; ++p) {
      size += k[p][p] * k[p][p];
      for (int q = p + 1; q < 4; ++q) off += k[p][q] * k[p][q];
    }
    if (off <= 1e-15f * size) break;
    for (int p = 0; p < 3; ++p) {
      for (int q = p + 1; q < 4; ++q) {
        if (k[p][q] == 0) continue;
        const float theta = 0.5f * (k[q][q] - k[p][p]) / k[p][q];
        const float t = (theta >= 0 ? 1.0f : -1.0f) / (fabsf(theta) + sqrtf(theta * theta + 1));
        const float cosine = 1 / sqrtf(t * t + 1), sine = t * cosine;
        for (int i = 0; i < 4; ++i) {
          const float one = k[i][p], other = k[i][q];
          k[i][p] = cosine * one - sine * other;
          k[i][q] = sine * one + cosine * other;
        }
        for (int i = 0; i < 4; ++i) {
          const float one = k[p][i], other = k[q][i];
          k[p][i] = cosine * one - sine * other;
          k[q][i] = sine * one + cosine * other;
        }
        for (int i = 0; i < 4; ++i) {
          const float one = v[i][p], other = v[i][q];
          v[i][p] = cosine * one - sine * other;
          v[i][q] = sine * one + cosine * other;
        }
      }
    }
  }
  int best = 0;
  for (int p = 1; p < 4; ++p) best = k[p][p] > k[best][best] ? p : best;
  const float size =
      sqrtf(v[0][best] * v[0][best] + v[1][best] * v[1][best] + v[2][best] * v[2][best] + v[3][best] * v[3][best]);
  const float w = v[0][best] / size, x = v[1][best] / size, y = v[2][best] / size, z = v[3][best] / size;
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

// τ = 2 μ (F - R) Fᵀ + λ (J - 1) J, symmetric to the bit, so that it turns nothing.
MPM_INLINE M3 stress_of(const M3& f, float mu, float lambda) {
  const M3 r = nearest_rotation(f);
  const float j = dot(f.row[0], cross(f.row[1], f.row[2])), pressure = lambda * (j - 1) * j;
  const V3 a = f.row[0] - r.row[0], b = f.row[1] - r.row[1], c = f.row[2] - r.row[2];
  const float xy = mu * (dot(a, f.row[1]) + dot(b, f.row[0])), xz = mu * (dot(a, f.row[2]) + dot(c, f.row[0])),
              yz = mu * (dot(b, f.row[2]) + dot(c, f.row[1]));
  return {{{2 * mu * dot(a, f.row[0]) + pressure, xy, xz},
           {xy, 2 * mu * dot(b, f.row[1]) + pressure, yz},
           {xz, yz, 2 * mu * dot(c, f.row[2]) + pressure}}};
}

// Side of a place against a plate and the distance along its normal; side 0: not near (mpm.h, near_plate).
struct Beside {
  int side;
  float distance;
  V3 normal;
};
MPM_INLINE Beside beside(const FlatPlate& plate, V3 x, float reach) {
  Beside result = {0, 0, {0, 0, 0}};
  for (int half = 0; half < 2; ++half) {
    const V3 p = plate.corner[0], u = plate.corner[1 + half] - p, v = plate.corner[2 + half] - p, w = x - p;
    const V3 area = cross(u, v);
    const float twice = dot(area, area);
    if (!(twice > 0)) continue;
    // Barycentric coordinates of the foot.
    const float s = dot(cross(w, v), area) / twice, t = dot(cross(u, w), area) / twice;
    const float distance = dot(w, area) / sqrtf(twice);
    if (!(s >= 0 && t >= 0 && s + t <= 1) || fabsf(distance) > reach) continue;
    if (result.side != 0 && fabsf(distance) >= fabsf(result.distance)) continue;
    result = {distance >= 0 ? 1 : -1, distance, (1 / sqrtf(twice)) * area};
  }
  return result;
}

// A plane seen from a point: its normal to the point's side, and how far the point is behind it.
struct Behind {
  V3 normal;
  float depth;
};
// Least squares of d + n · (x_i - x_p) against the distances of nodes near the plate, in cells, by Cholesky's
// factorization; the heaviest node's plane where the nodes leave the slope open. `side`: what the point has, or 0.
// Returns the point's side.
MPM_INLINE int fit_plane(const FlatPlate& plate, const Place& place, float cell, int side, Behind& behind) {
  float m[4][4] = {}, b[4] = {}, heaviest = 0, reach = 1.5f * sqrtf(3.0f) * cell;
  V3 normal = {0, 0, 0};
  float distance = 0;
  for (int k = 0; k < 27; ++k) {
    const float w = weight_of(place, k);
    const V3 node = {cell * static_cast<float>(place.base[0] + k / 9),
                     cell * static_cast<float>(place.base[1] + k / 3 % 3),
                     cell * static_cast<float>(place.base[2] + k % 3)};
    const Beside of_node = beside(plate, node, reach);
    if (of_node.side == 0) continue;
    const V3 way = way_to(place, k, 1);
    const float terms[4] = {1, way.x, way.y, way.z};
    for (int i = 0; i < 4; ++i) {
      b[i] += w * (of_node.distance / cell) * terms[i];
      for (int j = 0; j <= i; ++j) m[i][j] += w * terms[i] * terms[j];
    }
    if (w > heaviest) {
      heaviest = w;
      normal = of_node.normal;
      distance = of_node.distance - cell * dot(of_node.normal, way);
    }
  }
  if (!(m[0][0] > 1e-6f)) return 0;
  if (side == 0) side = b[0] >= 0 ? 1 : -1;
  bool is_open = false;
  const float total = m[0][0];
  for (int j = 0; j < 4; ++j) {
    for (int l = 0; l < j; ++l) m[j][j] -= m[j][l] * m[j][l];
    is_open = is_open || !(m[j][j] > 0.02f * total);
    m[j][j] = sqrtf(fmaxf(m[j][j], 1e-12f));
    for (int i = j + 1; i < 4; ++i) {
      for (int l = 0; l < j; ++l) m[i][j] -= m[i][l] * m[j][l];
      m[i][j] /= m[j][j];
    }
  }
  if (!is_open) {
    for (int i = 0; i < 4; ++i) {
      for (int l = 0; l < i; ++l) b[i] -= m[i][l] * b[l];
      b[i] /= m[i][i];
    }
    for (int i = 3; i >= 0; --i) {
      for (int l = i + 1; l < 4; ++l) b[i] -= m[l][i] * b[l];
      b[i] /= m[i][i];
    }
    const V3 slope = {b[1], b[2], b[3]};
    const float steep = sqrtf(dot(slope, slope));
    if (steep > 0.5f) normal = (1 / steep) * slope, distance = cell * b[0];
  }
  const auto sign = static_cast<float>(side);
  behind = {sign * normal, fmaxf(0, -sign * distance)};
  return side;
}

// Whether the segment passes through a triangle: its ends lie on two sides of the plane (a point in it counts as along
// the normal), and its line passes all edges on the same side.
MPM_INLINE bool passes(V3 p, V3 q, V3 r, V3 a, V3 b) {
  const V3 normal = cross(q - p, r - p);
  const bool above = dot(a - p, normal) >= 0;
  if (above == (dot(b - p, normal) >= 0)) return false;
  const V3 way = above ? a - b : b - a;
  const float one = dot(way, cross(p - a, q - a)), two = dot(way, cross(q - a, r - a)),
              three = dot(way, cross(r - a, p - a));
  return one >= 0 && two >= 0 && three >= 0;
}

// What a node gathers of a point.
struct Packet {
  Place place;
  float mass;
  V3 momentum;
  M3 moved;  // multiplies x_i - x_p: m C - dt V₀ (4 / dx²) τ
  uint32_t sides;
  bool is_held;
};
struct Node {
  float mass, held;  // of all points, of held ones; held = 1 and 0 say in the end whether the node is clamped
  V3 velocity;
};

template <class Executor>
struct Program : Simulator {
  template <class T>
  using Array = typename Executor::template Array<T>;

  Program(const Scene& asked, const Parameters& parameters)
      : scene(asked), settings(mpm::settings_of(asked, parameters)), n(asked.rest.size()) {
    for (const auto& patches : scene.blade) {
      if (patches.size() > kMostPlates)
        throw std::invalid_argument("a frame has " + std::to_string(patches.size()) + " blades; give at most 16");
    }
    std::vector<float> masses(scene.mass.begin(), scene.mass.end());
    std::vector<float> volumes(settings.volume.begin(), settings.volume.end());
    std::vector<V3> places, velocities;
    for (std::size_t i = 0; i < n; ++i) {
      places.push_back(single(scene.rest[i]));
      velocities.push_back(scene.held[i] != 0 ? V3{0, 0, 0} : single(scene.velocity[i]));
    }
    const M3 one = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    x = Array<V3>(places);
    v = Array<V3>(velocities);
    affine = Array<M3>(n);
    deformation = Array<M3>(std::vector<M3>(n, one));
    mass = Array<float>(masses);
    volume = Array<float>(volumes);
    held = Array<uint8_t>(scene.held);
    sides = Array<uint32_t>(n);
    impulse = Array<V3>(n);
    edges = Array<std::array<int32_t, 2>>(scene.edges);
    broken = Array<uint8_t>(scene.edges.size());
    keys = Array<uint32_t>(n);
    order = Array<int32_t>(n);
    heads = Array<int32_t>(n);
    numbers = Array<int32_t>(n + 1);
    first = Array<int32_t>(n + 1);
    boxes = Array<Box>(n + n / 31 + 8);  // n + n / 32 + n / 1024 + …, each rounded up
    is_fine = Array<int32_t>(std::vector<int32_t>(1, 1));
    neighbour = Array<int32_t>(125 * n);
    slot = Array<int32_t>(27 * n);
    marks = Array<uint32_t>(27 * n);
    nodes = Array<Node>(27 * n);
    packets = Array<Packet>(n);
    relabel();
  }

  int substeps() const override { return settings.substeps; }
  double damping() const override { return settings.damping; }

  void kick(const std::vector<Vec3>& given) override {
    std::vector<V3> kicks;
    for (std::size_t i = 0; i < given.size(); ++i) kicks.push_back(scene.held[i] != 0 ? V3{0, 0, 0} : single(given[i]));
    const Array<V3> kicked(kicks);
    const V3* const by = kicked.data();
    V3* const to = v.data();
    executor.for_each(kicks.size(), [=] BASELINES_KERNEL(int64_t i) { to[i] = to[i] + by[i]; });
    executor.finish();
  }

  void advance(double frame_time) override {
    ++frame_number;
    keep_sides();
    V3* const clear = impulse.data();
    executor.for_each(n, [=] BASELINES_KERNEL(int64_t i) { clear[i] = {0, 0, 0}; });
    const double dt = frame_time / settings.substeps;
    for (int s = 0; s < settings.substeps && n > 0; ++s) {
      const Plates plates = plates_of(s);
      prepare(plates, static_cast<float>(dt));
      gather(static_cast<float>(dt));
      move(plates, static_cast<float>(dt));
    }
  }

  // Which edges are crossed a kernel says; components are found on the host.
  void cut(const std::vector<Patch>& patches) override {
    if (patches.size() > kMostPlates) throw std::invalid_argument("a frame has more than 16 blades");
    Plates plates;
    for (const Patch& patch : patches) plates.plate[plates.count++] = flat({patch, Vec3::Zero()});
    const V3* const at = x.data();
    const std::array<int32_t, 2>* const ends = edges.data();
    uint8_t* const is_broken = broken.data();
    executor.for_each(edges.size(), [=] BASELINES_KERNEL(int64_t e) {
      const int32_t* const pair = reinterpret_cast<const int32_t*>(ends + e);
      for (int k = 0; k < plates.count; ++k) {
        const V3* const c = plates.plate[k].corner;
        if (passes(c[0], c[1], c[2], at[pair[0]], at[pair[1]]) || passes(c[0], c[2], c[3], at[pair[0]], at[pair[1]]))
          is_broken[e] = 1;
      }
    });
    relabel();
  }

  void finish() override { executor.finish(); }

  Frame frame(bool) const override { return const_cast<Program*>(this)->read(); }

  // All below is public, because nvcc takes no kernels from private functions.

  static V3 single(const Vec3& a) {
    return {static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
  }
  static FlatPlate flat(const mpm::Plate& plate) {
    FlatPlate result;
    for (std::size_t c = 0; c < 4; ++c) result.corner[c] = single(plate.patch[c]);
    result.velocity = single(plate.velocity);
    return result;
  }
  Plates plates_of(int substep) const {
    Plates plates;
    for (const mpm::Plate& plate : mpm::plates_at(scene, frame_number, substep, settings.substeps))
      plates.plate[plates.count++] = flat(plate);
    return plates;
  }

  void relabel() {
    const std::vector<uint8_t> is_broken = broken.copy();
    std::vector<std::array<int32_t, 2>> whole;
    for (std::size_t e = 0; e < is_broken.size(); ++e) {
      if (is_broken[e] == 0) whole.push_back(scene.edges[e]);
    }
    std::vector<int32_t> labels(n, 0);
    if (settings.keeps_labels) labels = components(static_cast<int32_t>(n), whole);
    label_count = labels.empty() ? 1 : 1 + *std::max_element(labels.begin(), labels.end());
    label = Array<int32_t>(labels);
  }

  struct OldPlates {
    int count = 0, plate[kMostPlates];
  };
  // Sides of plates that go on stay, under the plates' new numbers.
  void keep_sides() {
    OldPlates from;
    for (const int32_t k : mpm::continued_plates(scene, frame_number, settings.substeps, settings.cell))
      from.plate[from.count++] = k;
    uint32_t* const of = sides.data();
    executor.for_each(n, [=] BASELINES_KERNEL(int64_t p) {
      uint32_t now = 0;
      for (int k = 0; k < from.count; ++k) {
        const int old = from.plate[k];
        if (old == 0) continue;
        const int side = old > 0 ? side_in(of[p], old - 1) : -side_in(of[p], -old - 1);
        now |= (side > 0 ? 1u : side < 0 ? 2u : 0u) << (2 * k);
      }
      of[p] = now;
    });
  }

  // --- Kernels, in the order of a substep ---

  // Sorts points by label and cell, finds nodes and the plates' sides, and makes packets.
  void prepare(const Plates& plates, float dt) {
    sort_points();
    find_nodes(plates);
    pack(plates, dt);
  }

  struct Box {
    int low[3], high[3], is_fine;
    BASELINES_HOST_DEVICE void join(const Box& other) {
      for (int a = 0; a < 3; ++a) {
        low[a] = other.low[a] < low[a] ? other.low[a] : low[a];
        high[a] = other.high[a] > high[a] ? other.high[a] : high[a];
      }
      is_fine &= other.is_fine;
    }
  };

  void sort_points() {
    const V3* const at = x.data();
    const auto dx = static_cast<float>(settings.cell);
    const auto count = static_cast<int64_t>(n);
    Box* box = boxes.data();
    executor.for_each(n, [=] BASELINES_KERNEL(int64_t i) {
      const Place place = place_in_grid(at[i], dx);
      for (int a = 0; a < 3; ++a) box[i].low[a] = box[i].high[a] = place.base[a];
      box[i].is_fine = place.is_fine ? 1 : 0;
    });
    constexpr int64_t kChunk = 32;
    for (int64_t left = count; left > 1;) {
      const Box* const from = box;
      const int64_t chunks = (left + kChunk - 1) / kChunk;
      Box* const to = box += left;
      executor.for_each(static_cast<std::size_t>(chunks), [=] BASELINES_KERNEL(int64_t c) {
        Box sum = from[c * kChunk];
        for (int64_t k = c * kChunk + 1; k < (c + 1) * kChunk && k < left; ++k) sum.join(from[k]);
        to[c] = sum;
      });
      left = chunks;
    }
    whole_box = box;
    const int64_t labels = label_count;
    int32_t* const all_fine = is_fine.data();
    executor.for_each(1, [=] BASELINES_KERNEL(int64_t) {
      double all = static_cast<double>(labels);
      for (int a = 0; a < 3; ++a) all *= box->high[a] - box->low[a] + 1;
      if (!(all < 4294967295.0 && box->is_fine != 0)) all_fine[0] = 0;
    });
    uint32_t* const key = keys.data();
    int32_t* const who = order.data();
    const int32_t* const of = label.data();
    executor.for_each(n, [=] BASELINES_KERNEL(int64_t i) {
      const Place place = place_in_grid(at[i], dx);
      who[i] = static_cast<int32_t>(i);
      key[i] = key_of(*box, of[i], place.base[0], place.base[1], place.base[2]);
    });
    executor.sort(keys, order);
    const uint32_t* const sorted = keys.data();
    int32_t* const head = heads.data();
    executor.for_each(n, [=] BASELINES_KERNEL(int64_t i) { head[i] = i == 0 || sorted[i] != sorted[i - 1] ? 1 : 0; });
    executor.scan(heads, numbers);
    const int32_t* const number = numbers.data();
    int32_t* const begin = first.data();
    executor.for_each(n, [=] BASELINES_KERNEL(int64_t i) {
      if (head[i] != 0) begin[number[i]] = static_cast<int32_t>(i);
      if (i + 1 == count) begin[number[count]] = static_cast<int32_t>(count);
    });
  }
  // How many cells have points, in the executor's memory: the host does not wait for it.
  const int32_t* cells() const { return numbers.data() + n; }
  static BASELINES_HOST_DEVICE uint32_t key_of(const Box& box, int32_t of, int i, int j, int k) {
    const auto size = [&](int a) { return static_cast<uint32_t>(box.high[a] - box.low[a] + 1); };
    return ((static_cast<uint32_t>(of) * size(2) + static_cast<uint32_t>(k - box.low[2])) * size(1) +
            static_cast<uint32_t>(j - box.low[1])) *
               size(0) +
           static_cast<uint32_t>(i - box.low[0]);
  }

  void find_nodes(const Plates& plates) {
    const V3* const at = x.data();
    const Box* const box = whole_box;
    const int32_t *const who = order.data(), *const begin = first.data(), *const of = label.data();
    const uint32_t* const key = keys.data();
    const auto dx = static_cast<float>(settings.cell);
    const int32_t* const count = cells();
    int32_t *const beside_cell = neighbour.data(), *const to = slot.data();
    // The cells around a cell, by bisection.
    executor.for_each(125, cells(), [=] BASELINES_KERNEL(int64_t t) {
      const int64_t c = t / 125;
      const int32_t p = who[begin[c]];
      const Place place = place_in_grid(at[p], dx);
      const int off = static_cast<int>(t % 125);
      const int node[3] = {place.base[0] + off / 25 - 2, place.base[1] + off / 5 % 5 - 2, place.base[2] + off % 5 - 2};
      beside_cell[t] = -1;
      for (int a = 0; a < 3; ++a) {
        if (node[a] < box->low[a] || node[a] > box->high[a]) return;
      }
      const uint32_t wanted = key_of(*box, of[p], node[0], node[1], node[2]);
      int32_t low = 0, high = *count;
      while (low + 1 < high) {
        const int32_t middle = (low + high) / 2;
        (key[begin[middle]] <= wanted ? low : high) = middle;
      }
      if (key[begin[low]] == wanted) beside_cell[t] = low;
    });
    // A node is that of the first place of a stencil in which a cell has it.
    uint32_t* const mark = marks.data();
    executor.for_each(27, cells(), [=] BASELINES_KERNEL(int64_t t) {
      const int64_t c = t / 27;
      const int k = static_cast<int>(t % 27);
      for (int other = 0; other <= k; ++other) {
        const int32_t cell = beside_cell[125 * c + between(k, other)];
        if (cell < 0) continue;
        to[t] = 27 * cell + other;
        break;
      }
      if (to[t] != t) return;
      const Place place = place_in_grid(at[who[begin[c]]], dx);
      const V3 node = {dx * static_cast<float>(place.base[0] + k / 9),
                       dx * static_cast<float>(place.base[1] + k / 3 % 3),
                       dx * static_cast<float>(place.base[2] + k % 3)};
      uint32_t word = 0;
      for (int r = 0; r < plates.count; ++r) {
        const int side = beside(plates.plate[r], node, 1.5f * sqrtf(3.0f) * dx).side;
        word |= (side > 0 ? 1u : side < 0 ? 2u : 0u) << (2 * r);
      }
      mark[t] = word;
    });
  }
  // Of the cells around one, that in which its node k is node `other`.
  static BASELINES_HOST_DEVICE int between(int k, int other) {
    return 25 * (k / 9 - other / 9 + 2) + 5 * (k / 3 % 3 - other / 3 % 3 + 2) + k % 3 - other % 3 + 2;
  }

  void pack(const Plates& plates, float dt) {
    const std::size_t wanted = n * static_cast<std::size_t>(std::max(plates.count, 1));
    if (planes.size() < wanted) planes = Array<Behind>(wanted);
    const V3 *const at = x.data(), *const speed = v.data();
    const M3 *const c = affine.data(), *const f = deformation.data();
    const float *const m = mass.data(), *const v0 = volume.data();
    const uint32_t* const side = sides.data();
    const uint8_t* const is_held = held.data();
    const int32_t* const who = order.data();
    Packet* const packet = packets.data();
    Behind* const plane = planes.data();
    const auto dx = static_cast<float>(settings.cell), mu = static_cast<float>(settings.mu),
               lambda = static_cast<float>(settings.lambda);
    executor.for_each(n, [=] BASELINES_KERNEL(int64_t i) {
      const int32_t p = who[i];
      Packet made;
      made.place = place_in_grid(at[p], dx);
      made.mass = m[p];
      made.is_held = is_held[p] != 0;
      made.momentum = m[p] * speed[p];
      const M3 stress = stress_of(f[p], mu, lambda);
      const float scale = 4 * dt * v0[p] / (dx * dx);
      for (int row = 0; row < 3; ++row) made.moved.row[row] = m[p] * c[p].row[row] - scale * stress.row[row];
      made.sides = 0;
      for (int r = 0; r < plates.count; ++r) {
        const int now = fit_plane(plates.plate[r], made.place, dx, side_in(side[p], r), plane[i * plates.count + r]);
        made.sides |= (now > 0 ? 1u : now < 0 ? 2u : 0u) << (2 * r);
      }
      packet[i] = made;
    });
  }

  void gather(float dt) {
    const int32_t *const beside_cell = neighbour.data(), *const begin = first.data(), *const to = slot.data();
    const Packet* const packet = packets.data();
    const uint32_t* const mark = marks.data();
    Node* const node = nodes.data();
    const auto dx = static_cast<float>(settings.cell);
    const V3 fall = dt * single(scene.gravity);
    executor.for_each(27, cells(), [=] BASELINES_KERNEL(int64_t t) {
      if (to[t] != t) return;
      const int64_t c = t / 27;
      const int k = static_cast<int>(t % 27);
      Node sum = {0, 0, {0, 0, 0}};
      for (int other = k; other < 27; ++other) {
        const int32_t cell = beside_cell[125 * c + between(k, other)];
        if (cell < 0) continue;
        for (int32_t i = begin[cell]; i < begin[cell + 1]; ++i) {
          const Packet& of = packet[i];
          if (are_parted(mark[t], of.sides)) continue;
          const float w = weight_of(of.place, other);
          sum.mass += w * of.mass;
          if (of.is_held) sum.held += w * of.mass;
          sum.velocity = sum.velocity + w * (of.momentum + of.moved * way_to(of.place, other, dx));
        }
      }
      // Of a smaller mass the digits, or its inverse, would be lost. It weighs nothing in the velocities of points.
      const bool is_heavy = sum.mass > 1e-34f;
      const V3 mean = {sum.velocity.x / sum.mass, sum.velocity.y / sum.mass, sum.velocity.z / sum.mass};
      sum.velocity = is_heavy ? mean + fall : fall;
      sum.held = is_heavy && sum.held > static_cast<float>(mpm::kClampedShare) * sum.mass ? 1 : 0;
      if (sum.held > 0) sum.velocity = {0, 0, 0};
      node[t] = sum;
    });
  }

  void move(const Plates& plates, float dt) {
    V3 *const at = x.data(), *const speed = v.data(), *const given = impulse.data();
    M3 *const c = affine.data(), *const f = deformation.data();
    uint32_t* const side = sides.data();
    const uint8_t* const is_held = held.data();
    const int32_t *const who = order.data(), *const number = numbers.data(), *const to = slot.data();
    const Packet* const packet = packets.data();
    const Behind* const plane = planes.data();
    const uint32_t* const mark = marks.data();
    const Node* const node = nodes.data();
    const auto dx = static_cast<float>(settings.cell), friction = static_cast<float>(settings.friction),
               push = static_cast<float>(settings.push * settings.rate * settings.rate) * dt,
               kept = static_cast<float>(std::exp(-settings.damping * static_cast<double>(dt)));
    const V3 fall = dt * single(scene.gravity);
    executor.for_each(n, [=] BASELINES_KERNEL(int64_t i) {
      const int32_t p = who[i];
      const Packet of = packet[i];
      const int64_t cell = number[i + 1] - 1;
      V3 mean = {0, 0, 0}, got = {0, 0, 0};
      M3 moment = {};
      for (int k = 0; k < 27; ++k) {
        const int32_t s = to[27 * cell + k];
        const float w = weight_of(of.place, k);
        const V3 way = way_to(of.place, k, dx);
        V3 found = node[s].velocity;
        if (are_parted(mark[s], of.sides)) {
          const V3 own = speed[p] + fall;
          found = own;
          for (int r = 0; r < plates.count; ++r) {
            if (side_in(mark[s], r) * side_in(of.sides, r) >= 0) continue;
            const Behind& wall = plane[i * plates.count + r];
            V3 slip = found - plates.plate[r].velocity;
            const float into = -dot(slip, wall.normal);
            if (into > 0) {
              slip = slip + into * wall.normal;
              const float size = sqrtf(dot(slip, slip));
              if (size > 0) slip = fmaxf(0, 1 - friction * into / size) * slip;
            }
            found = plates.plate[r].velocity + slip + (push * wall.depth) * wall.normal;
          }
          got = got + w * (of.mass * (found - own) - of.moved * way);
        } else if (node[s].held > 0) {
          got = got - w * (of.momentum + of.mass * fall + of.moved * way);
        }
        mean = mean + w * found;
        moment.row[0] = moment.row[0] + (w * found.x) * way;
        moment.row[1] = moment.row[1] + (w * found.y) * way;
        moment.row[2] = moment.row[2] + (w * found.z) * way;
      }
      const float scale = 4 / (dx * dx);
      M3 gradient, next;
      const M3 old = f[p];
      for (int row = 0; row < 3; ++row) {
        const V3 g = scale * moment.row[row];
        gradient.row[row] = g;
        next.row[row] = old.row[row] + dt * (g.x * old.row[0] + g.y * old.row[1] + g.z * old.row[2]);
      }
      if (is_held[p] != 0) {
        got = got - of.mass * mean;
        mean = {0, 0, 0};
      }
      at[p] = at[p] + dt * mean;
      speed[p] = kept * mean;
      for (int row = 0; row < 3; ++row) gradient.row[row] = kept * gradient.row[row];
      c[p] = gradient;
      f[p] = next;
      side[p] = of.sides;
      given[p] = given[p] + got;
    });
  }

  // --- The state, and which points share nodes ---

  Frame read() {
    Frame frame;
    frame.has_groups = true;
    frame.contact_impulse = Vec3::Zero();
    if (n == 0) return frame;
    prepare(plates_of(settings.substeps), 0);
    if (is_fine.copy()[0] == 0)
      throw std::runtime_error(
          "points are no longer finite, or too far apart for a grid; take more steps, or soften it");
    const std::vector<V3> at = x.copy(), speed = v.copy(), given = impulse.copy();
    const std::vector<M3> c = affine.copy();
    const std::vector<int32_t> who = order.copy(), number = numbers.copy(), to = slot.copy();
    const std::vector<uint32_t> mark = marks.copy();
    const std::vector<Packet> packet = packets.copy();
    const auto wide = [](V3 a) { return Vec3(a.x, a.y, a.z); };
    for (std::size_t p = 0; p < n; ++p) {
      frame.position.push_back(wide(at[p]));
      frame.velocity.push_back(wide(speed[p]));
      const double inertia = scene.mass[p] * settings.cell * settings.cell / 4;
      const V3* const row = c[p].row;
      frame.spin.push_back(inertia * Vec3(row[2].y - row[1].z, row[0].z - row[2].x, row[1].x - row[0].y));
      *frame.contact_impulse += wide(given[p]);
      if (!frame.velocity[p].allFinite() || !frame.spin[p].allFinite())
        throw std::runtime_error("a point is no longer finite; take more steps, or soften it");
    }
    std::vector<std::vector<std::pair<int32_t, double>>> at_node(27 * static_cast<std::size_t>(number[n]));
    for (std::size_t i = 0; i < n; ++i) {
      for (int k = 0; k < 27; ++k) {
        const auto s = static_cast<std::size_t>(
            to[27 * static_cast<std::size_t>(number[i + 1] - 1) + static_cast<std::size_t>(k)]);
        const float w = weight_of(packet[i].place, k);
        if (w > 0 && !are_parted(mark[s], packet[i].sides)) at_node[s].emplace_back(who[i], w);
      }
    }
    for (auto& members : at_node) {
      if (members.empty()) continue;
      std::sort(members.begin(), members.end());
      double greatest = 0;
      for (const auto& member : members) greatest = std::max(greatest, member.second);
      for (const auto& member : members) {
        frame.members.push_back(member.first);
        frame.weights.push_back(member.second / greatest);
      }
      frame.offsets.push_back(static_cast<int64_t>(frame.members.size()));
    }
    return frame;
  }

  Executor executor;
  const Scene scene;
  const mpm::Settings settings;
  const std::size_t n;
  int frame_number = 0;
  int64_t label_count = 1;

  Array<V3> x, v;                        // [n] m, m/s
  Array<M3> affine, deformation;         // [n] C [1/s], F
  Array<float> mass, volume;             // [n] kg, m³ at rest
  Array<int32_t> label;                  // [n]
  Array<uint8_t> held;                   // [n]
  Array<uint32_t> sides;                 // [n] of plates
  Array<V3> impulse;                     // [n] kg m/s, from plates and grips in the frame
  Array<std::array<int32_t, 2>> edges;   // of the tissue
  Array<uint8_t> broken;                 // [edges]
  Array<uint32_t> keys;                  // [n] cells, ascending
  Array<int32_t> order;                  // [n] points in the order of their cells
  Array<int32_t> heads, numbers, first;  // first of a cell; cells before; by cell its first in `order`
  Array<Box> boxes;                      // of the points' cells, of 32 of them, of 1,024 and so on
  const Box* whole_box = nullptr;        // the last of them
  Array<int32_t> is_fine;                // 1 until points are no longer finite, or too far apart for keys
  Array<int32_t> neighbour;              // [cells x 125] cells around a cell, or -1
  Array<int32_t> slot;                   // [cells x 27] where the data of a cell's node are
  Array<uint32_t> marks;                 // [cells x 27] sides of nodes
  Array<Node> nodes;                     // [cells x 27]
  Array<Packet> packets;                 // [n] in the order of cells
  Array<Behind> planes;                  // [n x plates] likewise
};

}  // namespace cutproof::baselines::mpm_kernels
