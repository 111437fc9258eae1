// A state of ours as somebody else's simulator would write it, and a state that was cut.
#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "harness/foreign_judge.h"
#include "model/at.h"
#include "model/io/array_file.h"
#include "reference_cpu/reference.h"
#include "tests/harness/recorded_scene.h"

namespace cutproof::tests {

// 10 × 3 × 4 particles in overlapping clusters, cut in two by one stroke, skinned.
inline constexpr const char* kForeignScene = R"({"version": 5, "name": "foreign",
  "body": {"shape": {"kind": "box", "size": [0.1, 0.03, 0.04]}, "spacing": 0.01, "fit_skin": false},
  "clusters": {"side": 3}, "skin": {"fit_cuts": false},
  "frame": {"settle": 0.016}, "step": {"acceleration": "none"}, "detect": {"criterion": "geometric"},
  "ground": {"friction": 0.5},
  "blade": {"speed": 2, "strokes": [{"points": [[0.5, 0.5, 1.3], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]}})";

struct CutBody {
  Setup setup;
  State state;  // at the end; `removed`: all that ever was
};

inline CutBody cut_body() {
  const std::unique_ptr<Backend> reference = reference::make_backend();
  RecordedScene recorded(kForeignScene, *reference);
  CutBody cut{recorded.built.setup, recorded.snapshots.back().state};
  cut.state.removed.clear();
  for (int32_t i = 0; i < cut.setup.body.particle_count(); ++i) {
    if (cut.state.alive[at(i)] == 0) cut.state.removed.push_back(i);
  }
  return cut;
}

enum class As { grid, pairs, rows };

template <class Real>
std::vector<Real> flat(const std::vector<Vec3>& values) {
  std::vector<Real> numbers;
  for (const Vec3 v : values) {
    for (int axis = 0; axis < 3; ++axis) numbers.push_back(static_cast<Real>(v[axis]));
  }
  return numbers;
}

// Everything that a state has; floating-point numbers as Real, moved by `shift`.
template <class Real = double>
io::ArrayFile arrays_of(const Setup& setup, const State& state, As as, Vec3 shift = {}) {
  const Body& body = setup.body;
  const auto n = static_cast<int64_t>(state.x.size()), m = int64_t{state.clusters.count()};
  io::ArrayFile file;
  const auto add = [&]<class T>(const char* name, std::vector<int64_t> shape, const std::vector<T>& values) {
    file.arrays.push_back(make_array(name, std::move(shape), values));
  };
  const auto moved = [&](std::vector<Vec3> places) {
    for (Vec3& x : places) x += shift;
    return flat<Real>(places);
  };
  add("positions", {n, 3}, moved(state.x));
  add("velocities", {n, 3}, flat<Real>(state.v));
  add("alive", {n}, state.alive);
  add("removed", {static_cast<int64_t>(state.removed.size())}, state.removed);
  add("mass", {n}, std::vector<Real>(body.mass.begin(), body.mass.end()));
  std::vector<Vec3> rest;
  for (int32_t i = 0; i < n; ++i) rest.push_back(body.rest_position(i));
  add("rest", {n, 3}, moved(rest));
  const Clusters& clusters = state.clusters;
  add("cluster_offsets", {m + 1}, clusters.offsets);
  add("cluster_members", {static_cast<int64_t>(clusters.members.size())}, clusters.members);
  add("numbers", {m}, clusters.number);
  std::vector<Real> rotations;
  for (const Mat3& r : clusters.rotation) {
    for (const double entry : r.m) rotations.push_back(static_cast<Real>(entry));
  }
  add("rotations", {m, 3, 3}, rotations);
  add("rest_centers", {m, 3}, moved(clusters.rest_center));
  add("cluster_masses", {m}, std::vector<Real>(clusters.mass.begin(), clusters.mass.end()));
  add("tau", {}, std::vector<int32_t>{state.tau});
  add("cap", {}, std::vector<int32_t>{state.cap});
  if (as == As::grid) {
    std::vector<int32_t> nodes;
    for (const int64_t node : body.node) {
      for (const int32_t c : body.grid.coordinates(node)) nodes.push_back(c);
    }
    add("nodes", {n, 3}, nodes);
    add("spacing", {}, std::vector<double>{body.grid.spacing});
    const auto v = static_cast<int64_t>(state.skin.owner.size());
    add("vertices", {v, 3}, moved(state.skin.position));
    std::vector<int32_t> corners;
    for (const auto& triangle : state.skin.triangles) corners.insert(corners.end(), triangle.begin(), triangle.end());
    add("triangles", {static_cast<int64_t>(state.skin.triangles.size()), 3}, corners);
    add("vertex_owner", {v}, state.skin.owner);
    add("vertex_direction", {v}, state.skin.direction);
    return file;
  }
  std::vector<int32_t> pairs, ends;
  std::vector<int64_t> offsets = {0};
  for (int32_t i = 0; i < n; ++i) {
    for (const int32_t other : body.neighbours(i)) {
      if (i >= other) continue;
      pairs.insert(pairs.end(), {i, other});
      ends.push_back(other);  // at one end alone
    }
    offsets.push_back(static_cast<int64_t>(ends.size()));
  }
  if (as == As::pairs) {
    add("edges", {static_cast<int64_t>(pairs.size() / 2), 2}, pairs);
  } else {
    add("edge_offsets", {n + 1}, offsets);
    add("edge_ends", {static_cast<int64_t>(ends.size())}, ends);
  }
  return file;
}

inline Array& array_in(io::ArrayFile& file, std::string_view name) {
  for (Array& array : file.arrays) {
    if (array.name == name) return array;
  }
  throw std::logic_error("the file has no such array");
}
// To be changed in place.
template <class T>
std::span<T> values_in(io::ArrayFile& file, std::string_view name) {
  Array& array = array_in(file, name);
  const std::span<const T> values = array.of<T>();
  return {const_cast<T*>(values.data()), values.size()};
}
template <class T>
void put(io::ArrayFile& file, std::string name, std::vector<int64_t> shape, const std::vector<T>& values) {
  std::erase_if(file.arrays, [&](const Array& array) { return array.name == name; });
  file.arrays.push_back(make_array(std::move(name), std::move(shape), values));
}
inline void leave_out(io::ArrayFile& file, std::string_view name) {
  if (std::erase_if(file.arrays, [&](const Array& array) { return array.name == name; }) == 0) {
    throw std::logic_error("the file has no such array");
  }
}

// Every number in double precision, as a program writes it that knows no other.
inline io::ArrayFile widened(io::ArrayFile file) {
  for (Array& array : file.arrays) {
    if (array.type != ElementType::f32) continue;
    const std::span<const float> values = array.of<float>();
    array = make_array(array.name, array.shape, std::vector<double>(values.begin(), values.end()));
  }
  return file;
}
// All lengths times this, in the arithmetic of the file.
template <class Real>
void scale(io::ArrayFile& file, Real factor) {
  for (const char* const name : {"positions", "rest", "rest_centers", "vertices"}) {
    if (find_array(file.arrays, name) == nullptr) continue;
    for (Real& x : values_in<Real>(file, name)) x *= factor;
  }
  if (find_array(file.arrays, "spacing") != nullptr) values_in<double>(file, "spacing")[0] *= factor;
}

inline harness::ForeignVerdicts judged(const io::ArrayFile& file) {
  return harness::judge_foreign_state(harness::foreign_state_of(file, "state.npz"));
}
inline std::vector<std::string> failing(const harness::ForeignVerdicts& judged) {
  std::vector<std::string> names;
  for (const Verdict& verdict : judged.verdicts) {
    if (!verdict.holds) names.push_back(verdict.property);
  }
  return names;
}
// Null if it was not judged.
inline const Verdict* verdict_on(const harness::ForeignVerdicts& judged, std::string_view property) {
  for (const Verdict& verdict : judged.verdicts) {
    if (verdict.property == property) return &verdict;
  }
  return nullptr;
}

}  // namespace cutproof::tests
