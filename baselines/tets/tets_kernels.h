// The method in single precision, as kernels of an executor (baselines/parallel.h). Formulas are its own: displacements
// of a substep instead of places, so that velocities keep all their digits; gradients by opposite faces; crossings by
// signed volumes. What a cut makes of the mesh is done on the host (tets_mesh.h); which edges it crosses, by a kernel.
#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "baselines/parallel.h"
#include "baselines/tets/tets.h"

namespace cutproof::baselines::tets {

template <class Real>
struct Triple {
  Real x, y, z;
};
template <class Real>
BASELINES_HOST_DEVICE inline Triple<Real> operator+(Triple<Real> a, Triple<Real> b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Real>
BASELINES_HOST_DEVICE inline Triple<Real> operator-(Triple<Real> a, Triple<Real> b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Real>
BASELINES_HOST_DEVICE inline Triple<Real> operator*(Real s, Triple<Real> a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class Real>
BASELINES_HOST_DEVICE inline Real dot(Triple<Real> a, Triple<Real> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Real>
BASELINES_HOST_DEVICE inline Triple<Real> cross(Triple<Real> a, Triple<Real> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
// Six times the signed volume of a tetrahedron.
template <class Real>
BASELINES_HOST_DEVICE inline Real volume6(Triple<Real> a, Triple<Real> b, Triple<Real> c, Triple<Real> d) {
  return dot(b - a, cross(c - a, d - a));
}

using Float3 = Triple<float>;
using Double3 = Triple<double>;
BASELINES_HOST_DEVICE inline Double3 wide(Float3 a) { return {double{a.x}, double{a.y}, double{a.z}}; }
inline Float3 narrow(const Vec3& a) {
  return {static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
}
inline Vec3 vector_of(Float3 a) { return {double{a.x}, double{a.y}, double{a.z}}; }

constexpr float kMost = 1e38f;  // what is greater may have overflowed

// One answer of the kernel that looks for crossings.
struct Found {
  int32_t is_crossed = 0;
  float share = 0;
};

// Height of a point above a triangle's plane, times twice the triangle's area.
BASELINES_HOST_DEVICE inline double height_of(const Double3* p, Double3 a) { return volume6(p[0], p[1], p[2], a); }

// Whether a vertex is above the plane. A new one that is nearer than `thin` is where its parent is.
BASELINES_HOST_DEVICE inline bool is_above(const Double3* p, double thin, int32_t particles, const int32_t* parent,
                                           const Float3* x, int32_t i) {
  double height = height_of(p, wide(x[i]));
  for (; i >= particles && height < thin && -height < thin; height = height_of(p, wide(x[i]))) i = parent[i];
  return height >= 0;
}

template <class Executor>
class Kernels : public Simulator {
  template <class T>
  using Array = typename Executor::template Array<T>;

 public:
  Kernels(const Scene& scene, const Parameters& parameters)
      : mesh_(scene),
        steps_(static_cast<int>(parameters("steps"))),
        iterations_(static_cast<int>(parameters("iterations"))),
        damping_(parameters("damping")),
        thickness_(kThickness * scene.spacing),
        density_(parameters("density") > 0 ? parameters("density") : density_of(scene, mesh_)),
        gravity_(narrow(scene.gravity)),
        alone_(scene.mass),
        held_(scene.held) {
    const double modulus = parameters("youngs_modulus");
    stiffness_ = stiffness_of(modulus > 0 ? modulus : 2e7 * scene.spacing * scene.spacing, parameters("poisson_ratio"));
    std::vector<Float3> x, v;
    for (std::size_t i = 0; i < scene.rest.size(); ++i) {
      x.push_back(narrow(scene.rest[i]));
      v.push_back(held_[i] != 0 ? Float3{} : narrow(scene.velocity[i]));
    }
    x_ = Array<Float3>(x);
    v_ = Array<Float3>(v);
    build();
  }

  int substeps() const override { return steps_; }
  double damping() const override { return damping_; }
  void finish() override { run_.finish(); }

  void kick(const std::vector<Vec3>& kick) override {
    const std::vector<int32_t> nearest = mesh_.nearest_particles();
    std::vector<Float3> of_vertex;
    for (const int32_t i : nearest) of_vertex.push_back(i < 0 ? Float3{} : narrow(kick[static_cast<std::size_t>(i)]));
    const Array<Float3> change(of_vertex);
    const Float3* const by = change.data();
    const float* const w = inverse_mass_.data();
    Float3* const v = v_.data();
    run_.for_each(nearest.size(), [=] BASELINES_KERNEL(int64_t i) {
      if (w[i] > 0) v[i] = v[i] + by[i];
    });
  }

  void advance(double frame_time) override {
    for (int step = 0; step < steps_; ++step) substep(frame_time / steps_);
  }

  void cut(const std::vector<Patch>& patches) override {
    std::vector<Vec3> x, v;
    for (const Patch& patch : patches) {
      const std::vector<Crossing> found = crossed(patch);
      if (found.empty()) continue;
      if (x.empty()) {
        for (const Float3& each : x_.copy()) x.push_back(vector_of(each));
        for (const Float3& each : v_.copy()) v.push_back(vector_of(each));
      }
      for (auto parts = mesh_.cut(found); !parts.empty(); parts = mesh_.cut({})) {
        x = after_cut(mesh_, parts, x);
        v = after_cut(mesh_, parts, v);
      }
      upload(x, x_);
    }
    if (x.empty()) return;
    upload(v, v_);
    build();
  }

  Frame frame(bool changed) const override {
    Frame frame;
    for (const Float3& x : x_.copy()) frame.position.push_back(vector_of(x));
    for (const Float3& v : v_.copy()) frame.velocity.push_back(vector_of(v));
    for (const float m : mass_.copy()) frame.mass.push_back(m);
    frame.parent = mesh_.parent();
    if (changed) couple(mesh_, frame);
    return frame;
  }

  // What has kernels is public, because nvcc wants it so.

  static void upload(const std::vector<Vec3>& from, Array<Float3>& to) {
    std::vector<Float3> values;
    for (const Vec3& each : from) values.push_back(narrow(each));
    to = Array<Float3>(values);
  }

  // Which cells are around each of `count` things: those of thing i are items[starts[i]] .. items[starts[i + 1] - 1].
  struct Around {
    Array<int32_t> starts, items;
  };
  template <class Visit>
  Around around(std::size_t count, const Visit& visit) {
    std::vector<int32_t> starts(count + 1), items;
    visit([&](std::size_t thing, int32_t) { ++starts[thing + 1]; });
    for (std::size_t k = 0; k < count; ++k) starts[k + 1] += starts[k];
    items.resize(static_cast<std::size_t>(starts.back()));
    std::vector<int32_t> next = starts;
    visit([&](std::size_t thing, int32_t cell) { items[static_cast<std::size_t>(next[thing]++)] = cell; });
    return {Array<int32_t>(starts), Array<int32_t>(items)};
  }

  // What follows from the mesh.
  void build() {
    const auto n = static_cast<std::size_t>(mesh_.size());
    hold_new(mesh_, held_);
    sweep_ = sweep_of(mesh_);
    edges_ = Array<Edge>(sweep_.edges);
    cells_ = Array<Tetrahedron>(sweep_.cells);
    displacement_ = Array<Float3>(n);
    of_edge_ = Array<float>(sweep_.edges.size());
    of_cell_ = Array<float>(sweep_.cells.size());

    std::vector<Double3> places;
    for (const Vec3& x : mesh_.rest()) places.push_back({x[0], x[1], x[2]});
    const Array<Double3> rest_places(places);
    Array<double> exact_volume(sweep_.cells.size());
    volume_ = Array<float>(sweep_.cells.size());
    volume_compliance_ = Array<float>(sweep_.cells.size());
    const Double3* const rest = rest_places.data();
    const Tetrahedron* const cells = cells_.data();
    double* const exact = exact_volume.data();
    float *const volume = volume_.data(), *const resists = volume_compliance_.data();
    const double bulk = stiffness_.volume;
    run_.for_each(sweep_.cells.size(), [=] BASELINES_KERNEL(int64_t c) {
      const int32_t* const t = reinterpret_cast<const int32_t*>(cells + c);
      exact[c] = volume6(rest[t[0]], rest[t[1]], rest[t[2]], rest[t[3]]) / 6;
      volume[c] = static_cast<float>(exact[c]);
      resists[c] = bulk > 0 && exact[c] > 0 ? static_cast<float>(exact[c] / bulk) : -1;
    });

    const auto each_corner = [&](const auto& add) {
      for (std::size_t c = 0; c < sweep_.cells.size(); ++c) {
        for (const int32_t i : sweep_.cells[c]) add(static_cast<std::size_t>(i), static_cast<int32_t>(c));
      }
    };
    const Around of_vertex = around(n, each_corner);
    std::vector<float> alone(n);
    for (std::size_t i = 0; i < alone_.size(); ++i) alone[i] = static_cast<float>(alone_[i]);
    mass_ = Array<float>(alone);
    inverse_mass_ = Array<float>(n);
    const Array<uint8_t> held(held_);
    const int32_t *const starts = of_vertex.starts.data(), *const items = of_vertex.items.data();
    const uint8_t* const is_held = held.data();
    float *const mass = mass_.data(), *const w = inverse_mass_.data();
    const double quarter = density_ / 4;
    run_.for_each(n, [=] BASELINES_KERNEL(int64_t i) {
      double sum = 0;
      for (int32_t k = starts[i]; k < starts[i + 1]; ++k) sum += quarter * exact[items[k]];
      if (sum > 0) mass[i] = static_cast<float>(sum);
      w[i] = is_held[i] != 0 || !(mass[i] > 0) ? 0 : 1 / mass[i];
    });

    // Cells around edges, by the edges' numbers in the sweep.
    std::vector<std::size_t> number(sweep_.edges.size());
    for (std::size_t e = 0; e < number.size(); ++e)
      number[mesh_.edge_number(sweep_.edges[e][0], sweep_.edges[e][1])] = e;
    const auto each_edge = [&](const auto& add) {
      for (std::size_t c = 0; c < sweep_.cells.size(); ++c) {
        const Tetrahedron& t = sweep_.cells[c];
        for (const auto& [k, l] : kCornersOfEdges)
          add(number[mesh_.edge_number(t[static_cast<std::size_t>(k)], t[static_cast<std::size_t>(l)])],
              static_cast<int32_t>(c));
      }
    };
    const Around of_edge = around(sweep_.edges.size(), each_edge);
    length_ = Array<float>(sweep_.edges.size());
    distance_compliance_ = Array<float>(sweep_.edges.size());
    const Edge* const edges = edges_.data();
    const int32_t *const first = of_edge.starts.data(), *const cell = of_edge.items.data();
    float *const length = length_.data(), *const gives = distance_compliance_.data();
    const double stiff = stiffness_.distance;
    run_.for_each(sweep_.edges.size(), [=] BASELINES_KERNEL(int64_t e) {
      const int32_t* const ends = reinterpret_cast<const int32_t*>(edges + e);
      const Double3 way = rest[ends[1]] - rest[ends[0]];
      const double square = dot(way, way), distance = sqrt(square);
      // An edge of no cell is a link: a sixth of the cube over it counts.
      double sum = first[e] == first[e + 1] ? square * distance / 6 : 0;
      for (int32_t k = first[e]; k < first[e + 1]; ++k) sum += exact[cell[k]];
      length[e] = static_cast<float>(distance);
      gives[e] = sum > 0 ? static_cast<float>(square / (stiff * sum)) : -1;
    });
    run_.finish();  // what this function has made is still in use
  }

  void substep(double time) {
    const auto n = static_cast<std::size_t>(mesh_.size());
    const auto dt = static_cast<float>(time), decay = static_cast<float>(std::exp(-damping_ * time));
    const auto rate = static_cast<float>(1 / time), per_time = static_cast<float>(1 / (time * time));
    const Float3 gravity = gravity_;
    Float3 *const x = x_.data(), *const v = v_.data(), *const d = displacement_.data();
    const float* const w = inverse_mass_.data();
    run_.for_each(n, [=] BASELINES_KERNEL(int64_t i) {
      d[i] = w[i] > 0 ? dt * (decay * (v[i] + dt * gravity)) : Float3{0, 0, 0};
    });
    for (int iteration = 0; iteration < iterations_; ++iteration) {
      for (std::size_t colour = 0; colour + 1 < sweep_.edge_starts.size(); ++colour)
        distances(sweep_.edge_starts[colour], sweep_.edge_starts[colour + 1], per_time, iteration == 0);
      for (std::size_t colour = 0; colour + 1 < sweep_.cell_starts.size(); ++colour)
        volumes(sweep_.cell_starts[colour], sweep_.cell_starts[colour + 1], per_time, iteration == 0);
    }
    run_.for_each(n, [=] BASELINES_KERNEL(int64_t i) {
      x[i] = x[i] + d[i];
      v[i] = rate * d[i];
    });
  }

  void distances(std::size_t begin, std::size_t end, float per_time, bool is_first) {
    const Edge* const edges = edges_.data() + begin;
    const float *const lengths = length_.data() + begin, *const gives = distance_compliance_.data() + begin;
    float* const multipliers = of_edge_.data() + begin;
    const float* const w = inverse_mass_.data();
    const Float3* const x = x_.data();
    Float3* const d = displacement_.data();
    run_.for_each(end - begin, [=] BASELINES_KERNEL(int64_t e) {
      const int32_t* const ends = reinterpret_cast<const int32_t*>(edges + e);
      const int32_t a = ends[0], b = ends[1];
      const float known = is_first ? 0 : multipliers[e], soft = gives[e] * per_time, sum = w[a] + w[b] + soft;
      multipliers[e] = known;
      const Float3 way = (x[b] - x[a]) + (d[b] - d[a]);
      const float square = dot(way, way), distance = sqrtf(square);
      if (!(gives[e] >= 0 && distance > 0 && sum > 0 && w[a] + w[b] > 0 && sum < kMost)) return;
      const float off = (square - lengths[e] * lengths[e]) / (distance + lengths[e]);
      const float change = -(off + soft * known) / sum;
      multipliers[e] = known + change;
      const Float3 push = (change / distance) * way;
      d[a] = d[a] - w[a] * push;
      d[b] = d[b] + w[b] * push;
    });
  }

  void volumes(std::size_t begin, std::size_t end, float per_time, bool is_first) {
    const Tetrahedron* const cells = cells_.data() + begin;
    const float *const rests = volume_.data() + begin, *const resists = volume_compliance_.data() + begin;
    float* const multipliers = of_cell_.data() + begin;
    const float* const w = inverse_mass_.data();
    const Float3* const x = x_.data();
    Float3* const d = displacement_.data();
    run_.for_each(end - begin, [=] BASELINES_KERNEL(int64_t c) {
      const int32_t* const t = reinterpret_cast<const int32_t*>(cells + c);
      const float known = is_first ? 0 : multipliers[c], soft = resists[c] * per_time;
      multipliers[c] = known;
      // Edges from corner 0, and from 1.
      const Float3 a = (x[t[1]] - x[t[0]]) + (d[t[1]] - d[t[0]]), b = (x[t[2]] - x[t[0]]) + (d[t[2]] - d[t[0]]),
                   g = (x[t[3]] - x[t[0]]) + (d[t[3]] - d[t[0]]), p = (x[t[2]] - x[t[1]]) + (d[t[2]] - d[t[1]]),
                   q = (x[t[3]] - x[t[1]]) + (d[t[3]] - d[t[1]]);
      const float sixth = 1.0f / 6;
      const Float3 normal[4] = {sixth * cross(q, p), sixth * cross(b, g), sixth * cross(g, a), sixth * cross(a, b)};
      float sum = soft;
      for (int k = 0; k < 4; ++k) sum += w[t[k]] * dot(normal[k], normal[k]);
      if (!(resists[c] >= 0 && sum > soft && sum < kMost)) return;
      const float change = -(dot(g, normal[3]) - rests[c] + soft * known) / sum;
      multipliers[c] = known + change;
      for (int k = 0; k < 4; ++k) d[t[k]] = d[t[k]] + (w[t[k]] * change) * normal[k];
    });
  }

  // The edges that a patch crosses, in double precision, so that a decision is one about the places as they are told.
  std::vector<Crossing> crossed(const Patch& patch) {
    const std::vector<Edge>& all = mesh_.edges();
    const Array<Edge> edge_array(all);
    const Array<int32_t> parent_array(mesh_.parent());
    Array<Found> found_array(all.size());
    const Edge* const edges = edge_array.data();
    const int32_t* const parent = parent_array.data();
    const int32_t particles = mesh_.particles();
    const Float3* const x = x_.data();
    Found* const found = found_array.data();
    Double3 corners[4];
    for (std::size_t k = 0; k < 4; ++k) corners[k] = {patch[k][0], patch[k][1], patch[k][2]};
    for (int side = 0; side < 2; ++side) {
      const Double3 p0 = corners[0], p1 = corners[side + 1], p2 = corners[side + 2];
      const Double3 normal = cross(p1 - p0, p2 - p0);
      const double area = std::sqrt(dot(normal, normal)), thin = thickness_ * area, shared = -1e-9 * area * area;
      run_.for_each(all.size(), [=] BASELINES_KERNEL(int64_t e) {
        if (found[e].is_crossed != 0) return;
        const Double3 p[3] = {p0, p1, p2};
        const int32_t* const ends = reinterpret_cast<const int32_t*>(edges + e);
        if (is_above(p, thin, particles, parent, x, ends[0]) == is_above(p, thin, particles, parent, x, ends[1]))
          return;
        const Double3 a = wide(x[ends[0]]), b = wide(x[ends[1]]);
        const double from = height_of(p, a), to = height_of(p, b), s = from < 0 ? -from : from, t = to < 0 ? -to : to;
        const bool is_thin = ends[0] >= particles && s < thin && t < thin;  // the first end is the smaller number
        const double share = is_thin ? 0.5 : (from >= 0) != (to >= 0) ? s / (s + t) : s < t ? 0 : 1;
        const Double3 there = (1 - share) * a + share * b;
        // Signed volumes over the triangle's sides: tetrahedra with an apex above its plane.
        const double borders[3] = {dot(normal, cross(p1 - p0, there - p0)), dot(normal, cross(p2 - p1, there - p1)),
                                   dot(normal, cross(p0 - p2, there - p2))};
        if (borders[0] < (side == 1 ? shared : 0) || borders[1] < 0 || borders[2] < (side == 0 ? shared : 0)) return;
        found[e] = {1, static_cast<float>(share)};
      });
    }
    std::vector<Crossing> crossings;
    const std::vector<Found> answers = found_array.copy();
    for (std::size_t e = 0; e < all.size(); ++e) {
      if (answers[e].is_crossed != 0) crossings.push_back({all[e], double{answers[e].share}});
    }
    return crossings;
  }

 private:
  Executor run_;
  Mesh mesh_;
  Stiffness stiffness_;
  int steps_, iterations_;
  double damping_, thickness_, density_;
  Float3 gravity_;
  std::vector<double> alone_;
  std::vector<uint8_t> held_;
  Sweep sweep_;
  Array<Float3> x_, v_, displacement_;
  Array<Edge> edges_;
  Array<Tetrahedron> cells_;
  Array<float> length_, distance_compliance_, volume_, volume_compliance_, mass_, inverse_mass_, of_edge_, of_cell_;
};

}  // namespace cutproof::baselines::tets
