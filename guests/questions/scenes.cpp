#include "guests/questions/scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>

#include "guests/tissue_arrays.h"
#include "model/at.h"
#include "model/bare_graph.h"
#include "model/counted.h"
#include "model/error.h"
#include "model/words.h"
#include "oracles/support.h"

namespace cutproof::guests::scenes {

Limits limits_of(const std::string& words, const std::string& plugin) {
  struct Word {
    std::string_view name;
    double Limits::*value;
    double least, most;  // that it may be; both 0: it has no number
  };
  constexpr Word kLimitWords[] = {{"particles=", &Limits::particles, 8, 1000},
                                  {"gap=", &Limits::gap, 0.1, 100},
                                  {"cut_resolution=", &Limits::cut_resolution, 0, 10},
                                  {"one_blade", &Limits::one_blade, 0, 0},
                                  {"cells", &Limits::cells, 0, 0},
                                  {"diagonals", &Limits::diagonals, 0, 0},
                                  {"no_grips", &Limits::no_grips, 0, 0}};
  Limits limits;
  for (const std::string_view word : words_in(words)) {
    const auto refuse = [&](const std::string& problem) -> InputError {
      return {plugin, "limits", problem,
              "give words of these, separated by spaces: particles=N, gap=H, cut_resolution=H, one_blade, cells, "
              "diagonals, no_grips"};
    };
    const auto known = std::find_if(std::begin(kLimitWords), std::end(kLimitWords), [&](const Word& w) {
      return w.most > 0 ? word.starts_with(w.name) : word == w.name;
    });
    if (known == std::end(kLimitWords)) throw refuse(fmt::format("there is no limit '{}'", word));
    double number = 1;
    if (known->most > 0) {
      const char* const last = word.data() + word.size();
      const auto [after, error] = std::from_chars(word.data() + known->name.size(), last, number);
      if (error != std::errc{} || after != last || !(number >= known->least && number <= known->most)) {
        throw refuse(fmt::format("'{}' has no number from {} to {}", word, known->least, known->most));
      }
    }
    limits.*(known->value) = number;
  }
  return limits;
}

std::vector<double> numbers_of(const std::vector<Vec3>& vectors) {
  std::vector<double> numbers;
  for (const Vec3 v : vectors) numbers.insert(numbers.end(), {v.x, v.y, v.z});
  return numbers;
}
std::vector<Vec3> vectors_of(const Array& array) {
  std::vector<Vec3> vectors;
  for (int64_t k = 0; k + 2 < array.count(); k += 3) {
    vectors.push_back({array.number(k), array.number(k + 1), array.number(k + 2)});
  }
  return vectors;
}
namespace {
template <class T>
std::vector<T> list_of(const Array& array) {
  const auto values = array.of<T>();
  return {values.begin(), values.end()};
}
}  // namespace

Arrays arrays_of(const Scene& scene) {
  const int64_t n = scene.count();
  std::vector<std::vector<int32_t>> neighbours(at(n));
  for (const auto& [a, b] : scene.edges) {
    neighbours[at(a)].push_back(b);
    neighbours[at(b)].push_back(a);
  }
  std::vector<int64_t> offsets = {0};
  std::vector<int32_t> ends;
  for (auto& of_one : neighbours) {
    std::sort(of_one.begin(), of_one.end());
    ends.insert(ends.end(), of_one.begin(), of_one.end());
    offsets.push_back(std::ssize(ends));
  }
  return {make_array("edge_offsets", {n + 1}, offsets),
          make_array("edge_ends", {std::ssize(ends)}, ends),
          make_array("rest", {n, 3}, numbers_of(scene.rest)),
          make_array("mass", {n}, scene.mass),
          make_array("node", {n, 3}, scene.node),
          make_array("nodes", {3}, scene.nodes),
          make_array("spacing", {1}, std::vector<double>{scene.h}),
          make_array("velocity", {n, 3}, numbers_of(scene.velocity)),
          make_array("held", {n}, scene.held),
          make_array("tetrahedra", {std::ssize(scene.tetrahedra) / 4, 4}, scene.tetrahedra),
          make_array("hexahedra", {std::ssize(scene.hexahedra) / 8, 8}, scene.hexahedra),
          make_array("gravity", {3}, numbers_of({scene.gravity})),
          make_array("frame_time", {1}, std::vector<double>{scene.frame_time}),
          make_array("blades", {1}, std::vector<int32_t>{static_cast<int32_t>(scene.blades)}),
          make_array("blade", {scene.frames * scene.blades, 12}, numbers_of(scene.blade)),
          make_array("kick", {n, 3}, numbers_of(scene.kick)),
          make_array("kick_frame", {1}, std::vector<int32_t>{static_cast<int32_t>(scene.kick_frame)})};
}

Array as_it_is_given(Array array, Precision precision) {
  const Array got = in_precision_of_tissue(array, precision);
  if (got.type != ElementType::f32) return array;
  const auto rounded = got.of<float>();
  return make_array(array.name, array.shape, std::vector<double>(rounded.begin(), rounded.end()));
}

Scene scene_of(const Arrays& arrays) {
  const auto array = [&](std::string_view name) -> const Array& { return *find_array(arrays, name); };
  Scene scene;
  scene.h = array("spacing").number(0);
  scene.rest = vectors_of(array("rest"));
  scene.velocity = vectors_of(array("velocity"));
  scene.mass = list_of<double>(array("mass"));
  scene.held = list_of<uint8_t>(array("held"));
  scene.node = list_of<int32_t>(array("node"));
  scene.nodes = list_of<int32_t>(array("nodes"));
  scene.tetrahedra = list_of<int32_t>(array("tetrahedra"));
  scene.hexahedra = list_of<int32_t>(array("hexahedra"));
  scene.gravity = vectors_of(array("gravity")).front();
  scene.frame_time = array("frame_time").number(0);
  scene.blades = array("blades").integer(0);
  scene.frames = array("blade").rows() / scene.blades;
  scene.blade = vectors_of(array("blade"));
  scene.kick = vectors_of(array("kick"));
  scene.kick_frame = array("kick_frame").integer(0);
  const auto offsets = array("edge_offsets").of<int64_t>();
  const auto ends = array("edge_ends").of<int32_t>();
  for (int32_t i = 0; i < scene.count(); ++i) {
    for (int64_t k = offsets[at(i)]; k < offsets[at(i) + 1]; ++k) {
      if (ends[at(k)] > i) scene.edges.push_back({i, ends[at(k)]});
    }
  }
  return scene;
}

constexpr int64_t kMostFrames = 10'000;

std::string problem_of_scene(const Question& question) {
  const Arrays& arrays = question.given;
  const auto rows = [&](std::string_view name) { return find_array(arrays, name)->rows(); };
  for (const char* const name : {"node", "nodes"}) {
    if (find_array(arrays, name) == nullptr) return fmt::format("'{}' is missing", name);
  }
  const int64_t n = rows("rest");
  if (n == 0) return "'rest' has no particle";
  for (const char* const name : {"mass", "node", "velocity", "held", "kick"}) {
    if (rows(name) != n) return fmt::format("'{}' is not as long as 'rest'", name);
  }
  for (const char* const name : {"nodes", "gravity"}) {
    if (rows(name) != 3) return fmt::format("'{}' has other numbers than one for each axis", name);
  }
  for (const char* const name : {"spacing", "frame_time", "blades"}) {
    const Array& one = *find_array(arrays, name);
    if (one.rows() != 1 || !(one.number(0) > 0) || !std::isfinite(one.number(0))) {
      return fmt::format("'{}' is not one positive number", name);
    }
  }
  const int64_t blades = find_array(arrays, "blades")->integer(0), swept = rows("blade");
  if (swept == 0 || swept % blades != 0) return "'blade' has no rows for each frame";
  if (swept / blades > kMostFrames) return fmt::format("'blade' has more than {} frames", kMostFrames);
  if (rows("kick_frame") != 1) return "'kick_frame' is not one number";
  for (const char* const name : {"rest", "mass", "velocity", "gravity", "kick"}) {
    const auto numbers = find_array(arrays, name)->of<double>();
    if (!std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); }))
      return fmt::format("'{}' holds what is no number", name);
  }
  const auto mass = find_array(arrays, "mass")->of<double>();
  if (!std::all_of(mass.begin(), mass.end(), [](double m) { return m > 0; })) return "'mass' is not positive";
  for (const char* const name : {"tetrahedra", "hexahedra"}) {
    const auto corners = find_array(arrays, name)->of<int32_t>();
    if (!std::all_of(corners.begin(), corners.end(), [&](int32_t i) { return i >= 0 && i < n; }))
      return fmt::format("'{}' names a particle that there is not", name);
  }
  const Array &promises = *find_array(question.known, "promises"), &cut = *find_array(question.known, "cut_resolution");
  if (promises.rows() != 1 || promises.integer(0) < 0 || promises.integer(0) >= 2 * int64_t{kPromisesMirror})
    return "'promises' is no set of promises";
  if (cut.rows() != 1 || !(cut.number(0) >= 0) || !std::isfinite(cut.number(0))) return "'cut_resolution' is no length";
  Body body;
  body.rest.resize(at(n));
  body.edge_offsets = list_of<int64_t>(*find_array(arrays, "edge_offsets"));
  body.edge_ends = list_of<int32_t>(*find_array(arrays, "edge_ends"));
  return problem_of_edges(body);
}

bool is_joined_by_faces(const std::vector<int32_t>& tetrahedra) {
  oracles::DisjointSets joined(std::ssize(tetrahedra) / 4);
  std::map<std::array<int32_t, 3>, int32_t> cell_of_face;
  std::map<int32_t, int32_t> cell_of_corner;
  for (int32_t k = 0; k < std::ssize(tetrahedra); ++k) {
    std::array<int32_t, 3> face;  // opposite of this corner
    for (int32_t other = k / 4 * 4, c = 0; other < k / 4 * 4 + 4; ++other) {
      if (other != k) face[at(c++)] = tetrahedra[at(other)];
    }
    std::sort(face.begin(), face.end());
    joined.unite(k / 4, cell_of_face.emplace(face, k / 4).first->second);
    cell_of_corner.emplace(tetrahedra[at(k)], k / 4);
  }
  for (int32_t k = 0; k < std::ssize(tetrahedra); ++k) {
    if (joined.find(k / 4) != joined.find(cell_of_corner.at(tetrahedra[at(k)]))) return false;
  }
  return true;
}

std::string size_of_scene(const Question& question) {
  const Scene scene = scene_of(question.given);
  return fmt::format("{}, {}, {}", counted(scene.count(), "particle", "particles"),
                     counted(scene.blades, "stroke", "strokes"), counted(scene.frames, "frame", "frames"));
}

}  // namespace cutproof::guests::scenes
