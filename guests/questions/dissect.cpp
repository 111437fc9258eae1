// Whole simulators: random bodies and what blades do to them, judged as runs (oracles.md, A run of any simulator).
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "guests/questions/kinds.h"
#include "guests/tissue_arrays.h"
#include "harness/foreign_run.h"
#include "model/at.h"
#include "model/bare_graph.h"
#include "model/counted.h"
#include "model/error.h"
#include "oracles/runs/run.h"

namespace cutproof::guests {

bool is_promised(std::string_view words, oracles::RunPromise promise) {
  const std::string_view wanted = oracles::kRunPromises[at(static_cast<int>(promise))];
  for (std::size_t begin = 0; begin < words.size();) {
    const std::size_t end = std::min(words.find(' ', begin), words.size());
    const std::string_view word = words.substr(begin, end - begin);
    if (word == wanted || word == "*") return true;
    begin = end + 1;
  }
  return false;
}

namespace {

constexpr const char* kDissectSource = "docs/reference/plugins.md, Whole simulators";

// --- What a plugin takes ---------------------------------------------------------------------------------------------

struct Limits {
  double particles = 60;
  double gap = 1;                                                // [h] between cuts side by side
  double cut_resolution = 0;                                     // [h]
  double one_blade = 0, cells = 0, diagonals = 0, no_grips = 0;  // 1: the word is given
};

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
  for (std::size_t begin = 0; begin < words.size();) {
    const std::size_t end = std::min(words.find(' ', begin), words.size());
    const std::string_view word = std::string_view(words).substr(begin, end - begin);
    begin = end + 1;
    if (word.empty()) continue;
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

// --- Scenes ----------------------------------------------------------------------------------------------------------

struct Scene {
  double h = 1;
  std::vector<Vec3> rest, velocity;           // [n]
  std::vector<double> mass;                   // [n]
  std::vector<uint8_t> held;                  // [n]
  std::vector<int32_t> node;                  // [n][3]
  std::vector<int32_t> nodes;                 // [3]
  std::vector<std::array<int32_t, 2>> edges;  // each once, the smaller end first
  std::vector<int32_t> tetrahedra, hexahedra;
  Vec3 gravity;
  double frame_time = 0;
  int64_t frames = 0, blades = 0;
  std::vector<Vec3> blade;  // [frames][blades][4]
  int64_t count() const { return std::ssize(rest); }
};

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
template <class T>
std::vector<T> list_of(const Array& array) {
  const auto values = array.of<T>();
  return {values.begin(), values.end()};
}

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
          make_array("blade", {scene.frames * scene.blades, 12}, numbers_of(scene.blade))};
}

// Numbers that a guest gets in single precision have it.
Array as_it_is_given(Array array, Precision precision) {
  const Array got = in_precision_of_tissue(array, precision);
  if (got.type != ElementType::f32) return array;
  const auto rounded = got.of<float>();
  return make_array(array.name, array.shape, std::vector<double>(rounded.begin(), rounded.end()));
}

// Requires that problem_of_scene() finds none.
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
  for (const char* const name : {"mass", "node", "velocity", "held"}) {
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
  if (swept == 0 || swept % blades != 0 || swept / blades > kMostFrames) return "'blade' has no rows for each frame";
  for (const char* const name : {"rest", "mass", "velocity", "gravity"}) {
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
  if (promises.rows() != 1 || promises.integer(0) < 0 || promises.integer(0) >= 1 << oracles::kRunPromises.size())
    return "'promises' is no set of promises";
  if (cut.rows() != 1 || !(cut.number(0) >= 0) || !std::isfinite(cut.number(0))) return "'cut_resolution' is no length";
  Body body;
  body.rest.resize(at(n));
  body.edge_offsets = list_of<int64_t>(*find_array(arrays, "edge_offsets"));
  body.edge_ends = list_of<int32_t>(*find_array(arrays, "edge_ends"));
  return problem_of_edges(body);
}

std::string size_of_scene(const Question& question) {
  const Scene scene = scene_of(question.given);
  return fmt::format("{}, {}, {}", counted(scene.count(), "particle", "particles"),
                     counted(scene.blades, "stroke", "strokes"), counted(scene.frames, "frame", "frames"));
}

// --- Bodies ----------------------------------------------------------------------------------------------------------

using SceneNode = std::array<int32_t, 3>;

// Corners of the cube above a node, in VTK's order.
constexpr int32_t kCubeCorners[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                        {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
// Six tetrahedra around one diagonal of it, so that faces of neighbours meet.
constexpr int32_t kTetrahedraOfCube[6][4] = {{0, 1, 2, 6}, {0, 3, 7, 6}, {0, 4, 5, 6},
                                             {0, 2, 3, 6}, {0, 7, 4, 6}, {0, 5, 1, 6}};

// Numbers of particles by node, and the cubes of which all corners are particles.
using Numbers = std::map<SceneNode, int32_t>;
std::vector<std::array<int32_t, 8>> cubes_of(const Numbers& number) {
  std::vector<std::array<int32_t, 8>> cubes;
  for (const auto& [node, i] : number) {
    std::array<int32_t, 8> cube;
    bool is_whole = true;
    for (std::size_t c = 0; c < 8 && is_whole; ++c) {
      const auto corner =
          number.find({node[0] + kCubeCorners[c][0], node[1] + kCubeCorners[c][1], node[2] + kCubeCorners[c][2]});
      is_whole = corner != number.end();
      if (is_whole) cube[c] = corner->second;
    }
    if (is_whole) cubes.push_back(cube);
  }
  return cubes;
}

std::vector<SceneNode> draw_nodes(Random& random, const Limits& limits) {
  const bool by_cells = limits.cells > 0;
  const int32_t shape = random.below(10);  // 0 a wire, 1 a sheet, 2 and 3 with holes, 4 and 5 with a step, else a box
  const int32_t least = by_cells ? 2 : 1;
  SceneNode size = {random.between(3, 8), random.between(2, 5), random.between(least, 4)};
  if (shape == 0 && !by_cells) size = {random.between(2, 20), 1, 1};
  if (shape == 1 && !by_cells) size = {random.between(2, 8), random.between(2, 6), 1};
  while (size[0] * size[1] * size[2] > limits.particles) --*std::max_element(size.begin(), size.end());
  std::swap(size[0], size[at(random.below(3))]);
  std::vector<SceneNode> box, nodes;
  for (int32_t z = 0; z < size[2]; ++z) {
    for (int32_t y = 0; y < size[1]; ++y) {
      for (int32_t x = 0; x < size[0]; ++x) box.push_back({x, y, z});
    }
  }
  for (const SceneNode& node : box) {
    const bool is_hole = (shape == 2 || shape == 3) && random.chance(0.1);
    const bool is_step = (shape == 4 || shape == 5) && 2 * node[0] >= size[0] + 1 && 2 * node[1] >= size[1] + 1;
    if (!is_hole && !is_step) nodes.push_back(node);
  }
  if (by_cells) {
    Numbers number;
    for (const SceneNode& node : nodes) number.emplace(node, static_cast<int32_t>(number.size()));
    std::set<int32_t> corners;
    for (const auto& cube : cubes_of(number)) corners.insert(cube.begin(), cube.end());
    std::erase_if(nodes, [&](const SceneNode& node) { return !corners.contains(number.at(node)); });
  }
  return nodes.size() < 2 ? box : nodes;
}

Scene draw_body(Random& random, const Limits& limits) {
  Scene scene;
  scene.h = 0x1p-10 * random.between(4, 20);
  const Body body = on_grid(draw_nodes(random, limits), scene.h).body;
  scene.mass = body.mass;
  scene.nodes.assign(body.grid.nodes.begin(), body.grid.nodes.end());
  Numbers number;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    const SceneNode node = body.grid.coordinates(body.node[at(i)]);
    number.emplace(node, i);
    scene.node.insert(scene.node.end(), node.begin(), node.end());
    scene.rest.push_back(body.rest_position(i));
  }
  for (const auto& [node, i] : number) {
    for (int32_t k = 0; k < 27; ++k) {
      const SceneNode way = {k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
      if (limits.diagonals == 0 && std::abs(way[0]) + std::abs(way[1]) + std::abs(way[2]) != 1) continue;
      const auto other = number.find({node[0] + way[0], node[1] + way[1], node[2] + way[2]});
      if (other != number.end() && other->second > i) scene.edges.push_back({i, other->second});
    }
  }
  std::sort(scene.edges.begin(), scene.edges.end());
  for (const auto& cube : cubes_of(number)) {
    scene.hexahedra.insert(scene.hexahedra.end(), cube.begin(), cube.end());
    for (const auto& corners : kTetrahedraOfCube) {
      for (const int32_t corner : corners) scene.tetrahedra.push_back(cube[at(corner)]);
    }
  }
  return scene;
}

// How it moves at the start and what pulls it. A velocity that all have in common is returned.
Vec3 draw_motion(Random& random, const Limits& limits, Scene& scene) {
  const auto number = [&](double most) { return most * (2 * random.unit() - 1); };
  const auto vector = [&](double most) {
    const double x = number(most), y = number(most);
    return Vec3{x, y, number(most)};
  };
  scene.frame_time = 0x1p-8 * random.between(1, 4);
  scene.frames = random.between(8, 12);
  scene.velocity.resize(at(scene.count()));
  scene.held.resize(at(scene.count()));
  const bool is_held = random.chance(0.3), is_at_rest = random.chance(0.2);
  const int32_t of_gravity = random.below(4);
  if (limits.no_grips == 0 && is_held) {
    // One end is held, and the rest hangs there: so little that no method is at its limits.
    scene.gravity = vector(1);
    const int axis = random.below(3);
    double end = std::numeric_limits<double>::infinity();
    for (const Vec3 x : scene.rest) end = std::min(end, x[axis]);
    for (std::size_t i = 0; i < scene.rest.size(); ++i) scene.held[i] = scene.rest[i][axis] < end + 0.5 * scene.h;
    return {};
  }
  scene.gravity = of_gravity == 0 ? vector(10) : of_gravity == 1 ? Vec3{} : Vec3{0, 0, -9.81};
  if (is_at_rest) return {};
  const Vec3 common = vector(0.3), spin = vector(1), stretch = vector(1);
  Vec3 centre;
  for (const Vec3 x : scene.rest) centre += x / static_cast<double>(scene.count());
  for (std::size_t i = 0; i < scene.rest.size(); ++i) {
    const Vec3 way = scene.rest[i] - centre;
    scene.velocity[i] = common + cross(spin, way) + Vec3{stretch.x * way.x, stretch.y * way.y, stretch.z * way.z} +
                        vector(0.1 * scene.h);
  }
  return common;
}

// --- Strokes ---------------------------------------------------------------------------------------------------------

// The middle of a cutting edge goes through the tissue along `deep`, in the plane of `deep` and `along`. [h]
struct Plane {
  Vec3 normal, deep, along;  // orthonormal
  double offset = 0;         // along the normal
};
struct Range {
  double low = 0, high = 0;
};
Range range_along(const Scene& scene, Vec3 direction) {
  Range range = {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const Vec3 x : scene.rest) {
    range.low = std::min(range.low, dot(x, direction) / scene.h);
    range.high = std::max(range.high, dot(x, direction) / scene.h);
  }
  return range;
}

Vec3 axis_vector(int axis) {
  Vec3 v;
  v[axis] = 1;
  return v;
}

// Between two layers of the grid, or askew. `layers`: how many more have to be on its far side if there are as many.
Plane draw_plane(Random& random, const Scene& scene, bool may_be_askew, double layers = 0) {
  Plane plane;
  if (may_be_askew && random.chance(0.4)) {
    const double z = 2 * random.unit() - 1, angle = 2 * std::numbers::pi * random.unit(), r = std::sqrt(1 - z * z);
    plane.normal = {r * std::cos(angle), r * std::sin(angle), z};
    const Vec3 other = std::abs(z) < 0.7 ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
    plane.along = cross(plane.normal, other) / norm(cross(plane.normal, other));
    plane.deep = cross(plane.along, plane.normal);
    const Range range = range_along(scene, plane.normal);
    plane.offset = range.low + (0.3 + 0.4 * random.unit()) * (range.high - range.low) - 0.5 * layers;
    return plane;
  }
  // Along an axis of which there is more than one layer.
  int axis = random.below(3);
  for (int k = 0; k < 3; ++k, axis = (axis + 1) % 3) {
    const Range range = range_along(scene, axis_vector(axis));
    if (range.high - range.low > 0.5 + layers) break;
  }
  const int deep = (axis + 1 + random.below(2)) % 3;
  plane.normal = axis_vector(axis);
  plane.deep = axis_vector(deep) * (random.chance(0.5) ? 1.0 : -1.0);
  plane.along = axis_vector(3 - axis - deep);
  const Range range = range_along(scene, plane.normal);
  const int gaps = std::max(1, static_cast<int>(std::lround(range.high - range.low - layers)));
  plane.offset = range.low + random.below(gaps) + 0.25 + 0.5 * random.unit();
  return plane;
}

constexpr double kOutside = 1.5;  // how far a stroke that goes through begins and ends beside the tissue [h]

// Where the middle of the edge is after each of so many frames; `to`: 1 is through. `bend`: how far the way leaves the
// plane in its middle [h].
std::vector<Vec3> way_through(const Scene& scene, const Plane& plane, int32_t frames, double to = 1, double bend = 0) {
  const Range range = range_along(scene, plane.deep), across = range_along(scene, plane.along);
  const double from = range.low - kOutside,
               end = to < 1 ? range.low + to * (range.high - range.low) : range.high + kOutside;
  std::vector<Vec3> way;
  for (int32_t k = 0; k <= frames; ++k) {
    const double share = static_cast<double>(k) / frames;
    way.push_back((plane.offset + bend * std::sin(std::numbers::pi * share)) * plane.normal +
                  (from + share * (end - from)) * plane.deep + 0.5 * (across.low + across.high) * plane.along);
  }
  return way;
}

struct SceneStroke {
  Plane plane;
  int32_t first = 1;      // frame
  std::vector<Vec3> way;  // one place more than frames [h]
};

// In the frame of the body, which falls.
void add_strokes(Scene& scene, Vec3 common, const std::vector<SceneStroke>& strokes) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const bool is_held = std::find(scene.held.begin(), scene.held.end(), 1) != scene.held.end();
  scene.blades = std::ssize(strokes);
  scene.blade.assign(at(scene.frames * scene.blades * 4), {nan, nan, nan});
  for (std::size_t s = 0; s < strokes.size(); ++s) {
    const SceneStroke& stroke = strokes[s];
    const Range across = range_along(scene, stroke.plane.along);
    const Vec3 half = (0.5 * (across.high - across.low) + kOutside) * stroke.plane.along;
    for (std::size_t k = 0; k + 1 < stroke.way.size(); ++k) {
      const auto frame = at(stroke.first) + k;
      const double time = static_cast<double>(frame) * scene.frame_time;
      const Vec3 gone = is_held ? Vec3{} : time * common + 0.5 * time * time * scene.gravity;
      // A frame sweeps a little of the way of the last one again, so that no tissue slips through between them. Where
      // the blade turns back it would be tissue that no one meant to cut.
      const Vec3 step = stroke.way[k + 1] - stroke.way[k];
      const bool goes_on = k > 0 && dot(step, stroke.way[k] - stroke.way[k - 1]) > 0;
      const Vec3 from = stroke.way[k] - (goes_on ? 0.25 : 0) * step, to = stroke.way[k + 1];
      Vec3* const quad = &scene.blade[(frame * at(scene.blades) + s) * 4];
      const Vec3 corners[4] = {from + half, from - half, to - half, to + half};
      for (std::size_t c = 0; c < 4; ++c) quad[c] = scene.h * corners[c] + gone;
    }
  }
}

// --- Kinds -----------------------------------------------------------------------------------------------------------

// What the judge of runs found of the tissue, beside what the blade was to do.
struct SceneKind {
  const char* name;
  std::vector<SceneStroke> (*draw)(Random& random, const Scene& scene, const Limits& limits);
  bool (*is_one)(const oracles::RunPieces& pieces);
};

// So many frames from the first on, of those in which a blade may be there: all but the start and the last.
struct Frames {
  int32_t first = 1, count = 1;
};
Frames some_frames(Random& random, const Scene& scene, int32_t most) {
  const int32_t count = random.between(1, most);
  return {1 + random.below(static_cast<int32_t>(scene.frames) - 1 - count), count};
}

// Two strokes through, at the same time or one after the other.
std::vector<SceneStroke> two_strokes(Random& random, const Scene& scene, bool one_by_one, const Plane& a,
                                     const Plane& b) {
  const Frames frames = some_frames(random, scene, 3);
  if (!one_by_one && random.chance(0.5)) {
    return {{a, frames.first, way_through(scene, a, frames.count)},
            {b, frames.first, way_through(scene, b, frames.count)}};
  }
  const int32_t first = random.between(1, 3), second = random.between(1, 3);
  return {{a, 1, way_through(scene, a, first)}, {b, 1 + first, way_through(scene, b, second)}};
}
std::vector<SceneStroke> side_by_side(Random& random, const Scene& scene, const Limits& limits, double distance) {
  const Plane a = draw_plane(random, scene, true, distance);
  Plane b = a;
  b.offset += distance;
  return two_strokes(random, scene, limits.one_blade > 0, a, b);
}
std::vector<SceneStroke> one_stroke(Random& random, const Scene& scene, const Plane& plane, double to = 1,
                                    double bend = 0, int32_t least = 1) {
  const Frames frames = some_frames(random, scene, 4);
  const int32_t count = std::max(frames.count, least), last = static_cast<int32_t>(scene.frames) - 1;
  return {{plane, std::min(frames.first, last - count), way_through(scene, plane, count, to, bend)}};
}

bool has_more_pieces(const oracles::RunPieces& pieces) { return pieces.pieces > pieces.at_first; }
bool has_two_more_pieces(const oracles::RunPieces& pieces) { return pieces.pieces > pieces.at_first + 1; }
bool is_surely_cut(const oracles::RunPieces& pieces) { return pieces.surely_cut > 0; }

const SceneKind kSceneKinds[] = {
    {"cut through",
     [](Random& r, const Scene& scene, const Limits&) { return one_stroke(r, scene, draw_plane(r, scene, true)); },
     has_more_pieces},
    {"cut in part",
     [](Random& r, const Scene& scene, const Limits&) {
       const Plane plane = draw_plane(r, scene, true);
       return one_stroke(r, scene, plane, 0.3 + 0.5 * r.unit());
     },
     [](const oracles::RunPieces& pieces) { return is_surely_cut(pieces) && !has_more_pieces(pieces); }},
    {"curved cut",
     [](Random& r, const Scene& scene, const Limits&) {
       const Plane plane = draw_plane(r, scene, true);
       return one_stroke(r, scene, plane, 1, 0.5 + r.unit(), 3);
     },
     is_surely_cut},
    {"crossing cuts",
     [](Random& r, const Scene& scene, const Limits& limits) {
       const Plane a = draw_plane(r, scene, true);
       // Through the middle of the tissue, across the other one.
       Plane b = {r.chance(0.5) ? a.deep : a.along, a.normal, {}, 0};
       b.along = cross(b.normal, b.deep);
       const Range range = range_along(scene, b.normal);
       b.offset = 0.5 * (range.low + range.high) + 0.4 * (r.unit() - 0.5);
       return two_strokes(r, scene, limits.one_blade > 0, a, b);
     },
     has_two_more_pieces},
    {"along the grid",  // through the particles of a layer, or in the middle between two
     [](Random& r, const Scene& scene, const Limits&) {
       Plane plane = draw_plane(r, scene, false);
       plane.offset = std::floor(plane.offset) + 0.5 * r.below(3);
       return one_stroke(r, scene, plane);
     },
     [](const oracles::RunPieces& pieces) { return pieces.surely_cut + pieces.perhaps_cut > 0; }},
    {"thin remains",
     [](Random& r, const Scene& scene, const Limits& limits) {
       return side_by_side(r, scene, limits, std::max(1.0, limits.gap));
     },
     has_two_more_pieces},
    {"two blades' widths apart",
     [](Random& r, const Scene& scene, const Limits& limits) {
       return side_by_side(r, scene, limits, std::max(limits.gap, 2 * std::max(1.0, limits.cut_resolution)));
     },
     has_two_more_pieces},
    {"withdrawn",  // on the way that it came
     [](Random& r, const Scene& scene, const Limits&) {
       const Plane plane = draw_plane(r, scene, true);
       const int32_t count = r.between(1, 3);
       std::vector<Vec3> way = way_through(scene, plane, count, r.chance(0.5) ? 1 : 0.3 + 0.5 * r.unit());
       const std::vector<Vec3> in = way;
       way.insert(way.end(), in.rbegin() + 1, in.rend());
       return std::vector<SceneStroke>{{plane, 1, way}};
     },
     is_surely_cut},
    {"again at the same place",
     [](Random& r, const Scene& scene, const Limits&) {
       const Plane plane = draw_plane(r, scene, true);
       Plane back = plane;
       if (r.chance(0.5)) back.deep = -1.0 * plane.deep;
       const int32_t first = r.between(1, 3), second = r.between(1, 3);
       const double to = r.chance(0.5) ? 1 : 0.4 + 0.4 * r.unit();
       return std::vector<SceneStroke>{{plane, 1, way_through(scene, plane, first, to)},
                                       {back, 1 + first, way_through(scene, back, second, to)}};
     },
     is_surely_cut},
    {"beside the tissue",
     [](Random& r, const Scene& scene, const Limits& limits) {
       Plane plane = draw_plane(r, scene, true);
       plane.offset = range_along(scene, plane.normal).high + 1.5 + limits.cut_resolution + r.unit();
       return one_stroke(r, scene, plane);
     },
     [](const oracles::RunPieces& pieces) { return pieces.surely_cut + pieces.perhaps_cut == 0; }},
};
constexpr auto kSceneKindCount = static_cast<int64_t>(std::size(kSceneKinds));

std::vector<std::string> scene_kinds() {
  std::vector<std::string> names;
  for (const SceneKind& kind : kSceneKinds) names.emplace_back(kind.name);
  return names;
}

Question draw_within(uint64_t seed, int64_t index, Precision precision, const Limits& limits, uint32_t promises) {
  Random random(mixed(seed, index));
  const SceneKind& kind = kSceneKinds[index % kSceneKindCount];
  Scene scene = draw_body(random, limits);
  const Vec3 common = draw_motion(random, limits, scene);
  add_strokes(scene, common, kind.draw(random, scene, limits));
  Question question;
  question.kind = kind.name;
  for (Array& array : arrays_of(scene)) question.given.push_back(as_it_is_given(std::move(array), precision));
  question.known = {make_array("promises", {1}, std::vector<int32_t>{static_cast<int32_t>(promises)}),
                    make_array("cut_resolution", {1}, std::vector<double>{limits.cut_resolution * scene.h})};
  return question;
}

Question draw_scene(uint64_t seed, int64_t index, Precision precision) {
  return draw_within(seed, index, precision, {}, 0);
}
Question draw_scene_for(uint64_t seed, int64_t index, const PluginInfo& plugin) {
  uint32_t promises = 0;
  for (std::size_t k = 0; k < oracles::kRunPromises.size(); ++k) {
    const bool is_given = is_promised(plugin.promises.value_or(""), static_cast<oracles::RunPromise>(k));
    promises |= static_cast<uint32_t>(is_given) << k;
  }
  return draw_within(seed, index, plugin.precision, limits_of(plugin.limits, plugin.name), promises);
}

// --- Answers ---------------------------------------------------------------------------------------------------------

constexpr AnswerArray kRunAnswers[] = {
    {.name = "run/steps", .type = ElementType::i64, .text = "[1] substeps in a frame"},
    {.name = "run/damping", .real = true, .text = "[1] velocities decay by this rate [1/s]"},
    {.name = "run/particles", .type = ElementType::i32, .text = "[frames] how many"},
    {.name = "run/position", .real = true, .columns = 3, .text = "of all particles, frame by frame [m]"},
    {.name = "run/velocity", .real = true, .columns = 3, .text = "[m/s]"},
    {.name = "run/spin", .real = true, .columns = 3, .text = "angular momentum that they carry [kg m²/s]"},
    {.name = "run/mass", .real = true, .text = "[kg]"},
    {.name = "run/alive", .type = ElementType::u8, .text = "1: it exists"},
    {.name = "run/parent", .type = ElementType::i32, .text = "which one it was split from, or -1"},
    {.name = "run/contact_impulse", .real = true, .columns = 3, .text = "[frames] [kg m/s]"},
    {.name = "run/energy", .real = true, .text = "[frames] [J]"},
    {.name = "run/group_count", .type = ElementType::i32, .text = "[frames] coupling groups, or -1: as before"},
    {.name = "run/offsets", .type = ElementType::i64, .text = "of all groups that are given"},
    {.name = "run/members", .type = ElementType::i32, .text = "particles, group by group"},
    {.name = "run/weights", .real = true, .text = "of each member"},
    {.name = "run/cell_count", .type = ElementType::i32, .text = "[frames] cells, or -1: as before"},
    {.name = "run/tetrahedra", .type = ElementType::i32, .columns = 4, .text = "corners"},
    {.name = "run/hexahedra", .type = ElementType::i32, .columns = 8, .text = "corners, in VTK's order"}};

// As files of arrays, one for each frame; or why that cannot be.
struct RunFiles {
  std::vector<io::ArrayFile> frames;
  std::string problem;
};

// How many there are in each frame, of something that comes to `total`; -1: as before. "" or what is wrong.
std::string problem_of_counts(const Array& counts, int64_t frames, int64_t least, int64_t total,
                              std::string_view what) {
  if (counts.rows() != frames) {
    return fmt::format("'{}' has {} rows, and {} frames are wanted", counts.name, counts.rows(), frames);
  }
  int64_t sum = 0;
  for (int64_t f = 0; f < frames; ++f) {
    if (counts.integer(f) < least) return fmt::format("'{}' holds {}", counts.name, counts.integer(f));
    sum += std::max<int64_t>(counts.integer(f), 0);
  }
  return sum == total ? "" : fmt::format("'{}' adds up to {}, and '{}' has {}", counts.name, sum, what, total);
}

RunFiles run_files(const Question& question, const Arrays& answers, Precision precision) {
  const Scene scene = scene_of(question.given);
  RunFiles run;
  const auto answer = [&](const std::string& name) -> const Array& { return *find_array(answers, "run/" + name); };
  const auto refuse = [&](std::string problem) {
    run.problem = std::move(problem);
    return run;
  };
  // Particles.
  std::vector<int64_t> first = {0};  // [frames + 1]
  const Array &particles = answer("particles"), &position = answer("position");
  if (particles.rows() > 0) {
    std::string problem = problem_of_counts(particles, scene.frames, 1, position.rows(), position.name);
    if (!problem.empty()) return refuse(std::move(problem));
  }
  for (int64_t f = 0; f < scene.frames; ++f) {
    first.push_back(first.back() + (particles.rows() > 0 ? particles.integer(f) : scene.count()));
  }
  if (first[1] != scene.count()) {
    return refuse(fmt::format("it starts with {} particles, and the body has {}", first[1], scene.count()));
  }
  if (position.rows() != first.back()) {
    return refuse(fmt::format("'{}' has {} rows, and {} frames of {} particles are wanted", position.name,
                              position.rows(), scene.frames, scene.count()));
  }
  for (const auto& [names, rows] :
       {std::pair{std::vector<std::string>{"velocity", "spin", "mass", "alive", "parent"}, first.back()},
        {{"contact_impulse", "energy"}, scene.frames},
        {{"steps", "damping"}, int64_t{1}}}) {
    for (const std::string& name : names) {
      const Array& array = answer(name);
      if (array.rows() != 0 && array.rows() != rows) {
        return refuse(fmt::format("'{}' has {} rows; {} or none are wanted", array.name, array.rows(), rows));
      }
    }
  }
  // Groups and cells.
  const Array &group_count = answer("group_count"), &offsets = answer("offsets"), &members = answer("members"),
              &weights = answer("weights"), &cell_count = answer("cell_count");
  const bool has_groups = group_count.rows() > 0, has_cells = cell_count.rows() > 0;
  const std::string cells_name = answer("tetrahedra").rows() > 0 ? "tetrahedra" : "hexahedra";
  const Array& cells = answer(cells_name);
  if (has_groups || offsets.rows() + members.rows() > 0) {
    const auto ends = offsets.of<int64_t>();
    std::string problem =
        problem_of_counts(group_count, scene.frames, -1, std::max<int64_t>(offsets.rows() - 1, 0), offsets.name);
    if (!problem.empty()) return refuse(std::move(problem));
    if (ends.empty() || ends.front() != 0 || ends.back() != members.rows() ||
        !std::is_sorted(ends.begin(), ends.end())) {
      return refuse(fmt::format("'{}' does not begin at 0, ascend and end at {}", offsets.name, members.rows()));
    }
    if (weights.rows() != 0 && weights.rows() != members.rows())
      return refuse(
          fmt::format("'{}' has {} rows, and '{}' has {}", weights.name, weights.rows(), members.name, members.rows()));
  }
  if (has_cells || cells.rows() > 0) {
    std::string problem = problem_of_counts(cell_count, scene.frames, -1, cells.rows(), cells.name);
    if (!problem.empty()) return refuse(std::move(problem));
  }

  const bool is_held = std::find(scene.held.begin(), scene.held.end(), 1) != scene.held.end();
  int64_t group = 0, cell = 0;
  for (int64_t f = 0; f < scene.frames; ++f) {
    io::ArrayFile& file = run.frames.emplace_back();
    const auto add = [&](Array array, std::string name, std::vector<int64_t> shape) {
      array.name = std::move(name);
      array.shape = std::move(shape);
      file.arrays.push_back(std::move(array));
    };
    const auto put = [&](std::string name, const std::string& of, int64_t begin, int64_t end,
                         std::vector<int64_t> shape) {
      if (answer(of).rows() > 0) add(rows_of(answer(of), begin, end), std::move(name), std::move(shape));
    };
    const int64_t begin = first[at(f)], end = first[at(f) + 1], n = end - begin;
    put("positions", "position", begin, end, {1, n, 3});
    put("velocities", "velocity", begin, end, {1, n, 3});
    put("spin", "spin", begin, end, {1, n, 3});
    put("alive", "alive", begin, end, {1, n});
    put("mass", "mass", begin, end, {n});
    put("parent", "parent", begin, end, {n});
    put("contact_impulse", "contact_impulse", f, f + 1, {1, 3});
    put("energy", "energy", f, f + 1, {1});
    add(make_array("", {}, std::vector<double>{static_cast<double>(f) * scene.frame_time}), "time", {1});
    if (is_held) {
      std::vector<uint8_t> held = scene.held;
      held.resize(at(n));
      for (int64_t i = scene.count(); i < n && answer("parent").rows() > 0; ++i) {
        const int64_t parent = answer("parent").integer(begin + i);
        held[at(i)] = parent >= 0 && parent < i ? held[at(parent)] : 0;
      }
      add(make_array("", {}, held), "held", {1, n});
    }
    const auto quads = std::span(scene.blade).subspan(at(f * scene.blades * 4), at(scene.blades * 4));
    if (std::any_of(quads.begin(), quads.end(), [](Vec3 x) { return std::isfinite(x.x); }))
      add(make_array("", {}, numbers_of({quads.begin(), quads.end()})), "blade", {1, scene.blades, 4, 3});
    if (const int64_t count = has_groups ? group_count.integer(f) : -1; count >= 0) {
      std::vector<int64_t> ends;
      for (int64_t g = group; g <= group + count; ++g) ends.push_back(offsets.integer(g) - offsets.integer(group));
      const int64_t from = offsets.integer(group), to = from + ends.back();
      add(make_array("", {}, ends), "groups_offsets", {count + 1});
      add(rows_of(members, from, to), "groups_members", {to - from});
      put("groups_weights", "weights", from, to, {to - from});
      group += count;
    }
    if (const int64_t count = has_cells ? cell_count.integer(f) : -1; count >= 0) {
      add(rows_of(cells, cell, cell + count), "cells", {count, cells.columns()});
      cell += count;
    }
    if (f > 0) continue;
    const auto give = [&](const char* name) {
      add(*find_array(question.given, name), name, find_array(question.given, name)->shape);
    };
    for (const char* const name : {"rest", "gravity", "spacing"}) give(name);
    if (answer("mass").rows() == 0) give("mass");
    put("steps", "steps", 0, 1, {1});
    put("damping", "damping", 0, 1, {1});
    std::vector<int32_t> edges;
    for (const auto& [a, b] : scene.edges) edges.insert(edges.end(), {a, b});
    if (!edges.empty()) add(make_array("", {}, edges), "edges", {std::ssize(scene.edges), 2});
    const Array& cut_resolution = *find_array(question.known, "cut_resolution");
    add(cut_resolution, cut_resolution.name, {1});
    add(make_array("", {}, std::vector<double>{unit_roundoff(precision)}), "unit_roundoff", {1});
    std::string words;
    const int64_t promises = find_array(question.known, "promises")->integer(0);
    for (std::size_t k = 0; k < oracles::kRunPromises.size(); ++k) {
      if ((promises >> k & 1) != 0) words += (words.empty() ? "" : " ") + std::string(oracles::kRunPromises[k]);
    }
    file.texts.push_back({"promises", words});
  }
  return run;
}

std::vector<io::ArrayFile> files_of(const Question& question, const Arrays& answers, Precision precision) {
  return run_files(question, answers, precision).frames;
}

// --- Verdicts --------------------------------------------------------------------------------------------------------

constexpr const char* kAsAsked = "run as asked";
constexpr const char* kAsDrawn = "cut as drawn";

// Verdict on numbers of which the greatest is kept.
class Greatest {
 public:
  Greatest(const char* property, const char* unit, double bound) {
    verdict_.property = property;
    verdict_.unit = unit;
    verdict_.bound = bound;
    verdict_.bound_source = kDissectSource;
  }
  void see(double measured, int64_t particle, int64_t frame, const char* text) {
    ++verdict_.checked;
    const bool is_worse = !(measured <= verdict_.measured);
    if (is_worse) verdict_.measured = measured;
    if (measured <= verdict_.bound || !verdict_.holds) return;
    verdict_.holds = false;
    verdict_.frame = frame;
    verdict_.witness.particles = {static_cast<int32_t>(particle)};
    verdict_.witness.text =
        fmt::format("particle {} {} by {:.3g} {} in frame {}", particle, text, measured, verdict_.unit, frame);
  }
  const Verdict& verdict() const { return verdict_; }

 private:
  Verdict verdict_;
};

// It begins where it was told to, and what is held stays. `run`: of run_files().
std::vector<Verdict> judge_as_asked(const Scene& scene, const std::vector<io::ArrayFile>& run, double u) {
  const auto of = [&](std::size_t frame, const char* name) {
    const Array* const array = find_array(run[frame].arrays, name);
    return array != nullptr ? vectors_of(*array) : std::vector<Vec3>{};
  };
  double farthest = 0, fastest = 0;
  for (const Vec3 x : scene.rest) farthest = std::max(farthest, norm(x));
  for (const Vec3 v : scene.velocity) fastest = std::max(fastest, norm(v));
  const std::vector<Vec3> start = of(0, "positions"), velocity = of(0, "velocities");
  // Two roundings each; velocities of a staggered scheme are up to a frame of gravity away.
  Greatest places(kAsAsked, "m", 4 * u * farthest);
  Greatest velocities("velocities as asked", "m/s", 4 * u * fastest + scene.frame_time * norm(scene.gravity));
  Greatest held("what is held stays", "m", 4 * u * farthest);
  for (std::size_t i = 0; i < scene.rest.size(); ++i) {
    const auto particle = static_cast<int64_t>(i);
    places.see(norm(start[i] - scene.rest[i]), particle, 0, "does not start at rest, but beside it");
    if (!velocity.empty()) {
      velocities.see(scene.held[i] != 0 ? 0 : norm(velocity[i] - scene.velocity[i]), particle, 0,
                     "starts with another velocity");
    }
  }
  for (std::size_t f = 0; f < run.size(); ++f) {
    const std::vector<Vec3> now = of(f, "positions");
    for (std::size_t i = 0; i < std::min(now.size(), scene.held.size()); ++i) {
      if (scene.held[i] == 0) continue;
      held.see(norm(now[i] - start[i]), static_cast<int64_t>(i), static_cast<int64_t>(f), "is held, and has moved");
    }
  }
  return {places.verdict(), velocities.verdict(), held.verdict()};
}

// One case. Relations between this run and others of the same simulator are asked beside it, where a guest can be asked
// again (judge_answer).
std::vector<Verdict> judge_scene(const Question& question, const Arrays& answers, Precision precision) {
  RunFiles run = run_files(question, answers, precision);
  if (!run.problem.empty()) return {unreadable(kAsAsked, run.problem)};
  std::vector<Verdict> verdicts = judge_as_asked(scene_of(question.given), run.frames, unit_roundoff(precision));
  harness::JudgedRun judged;
  try {
    io::RunSegments segments("the run", std::move(run.frames));
    judged = harness::judge_run(std::move(segments));
  } catch (const InputError& error) {
    return {unreadable(kAsAsked, error.what())};
  }
  for (Verdict& verdict : judged.verdicts) {
    // Whether it was is said of the kind.
    if (verdict.property != "something was cut") verdicts.push_back(std::move(verdict));
  }
  for (const harness::NotJudged& each : judged.not_judged) {
    if (each.property == "determinism" || each.property == "something was cut") continue;
    Verdict& verdict = verdicts.emplace_back();
    verdict.property = each.property;
    verdict.vacuous = each.why;
  }
  Verdict& as_drawn = verdicts.emplace_back();
  as_drawn.property = kAsDrawn;
  as_drawn.bound_source = kDissectSource;
  const auto kind = std::find_if(std::begin(kSceneKinds), std::end(kSceneKinds),
                                 [&](const SceneKind& k) { return question.kind == k.name; });
  as_drawn.checked = kind != std::end(kSceneKinds) && judged.pieces.units > 0 && kind->is_one(judged.pieces) ? 1 : 0;
  if (as_drawn.checked == 0) as_drawn.vacuous = "the tissue was not cut as the kind says";
  return verdicts;
}

std::string difference_of_runs(const Question& question, const Arrays& one, const Arrays& other) {
  const Array &a = *find_array(one, "run/position"), &b = *find_array(other, "run/position");
  const Array& particles = *find_array(one, "run/particles");
  const Scene scene = scene_of(question.given);
  const int64_t row = 3 * size_of(a.type);
  for (int64_t f = 0, first = 0; f < scene.frames; ++f) {
    const int64_t count = f < particles.rows() ? particles.integer(f) : scene.count();
    for (int64_t i = first; i < std::min({first + count, a.rows(), b.rows()}); ++i) {
      if (std::memcmp(a.bytes.data() + i * row, b.bytes.data() + i * row, at(row)) == 0) continue;
      const auto place = [&](const Array& of) {
        return Vec3{of.number(3 * i), of.number(3 * i + 1), of.number(3 * i + 2)};
      };
      return fmt::format("run again, particle {} is {:.3g} m beside where it was in frame {}", i - first,
                         norm(place(a) - place(b)), f);
    }
    first += count;
  }
  for (const Array& array : one) {
    if (!(*find_array(other, array.name) == array)) return fmt::format("run again, '{}' is not the same", array.name);
  }
  return "";
}

// --- Simpler scenes --------------------------------------------------------------------------------------------------

Scene part_of(const Scene& scene, std::vector<uint8_t> keep) {
  // Where all particles are corners of cells they stay so.
  const auto cells_left = [&](const std::vector<int32_t>& cells, std::size_t corners, const auto& visit) {
    for (std::size_t k = 0; k + corners <= cells.size(); k += corners) {
      const auto cell = std::span(cells).subspan(k, corners);
      if (std::all_of(cell.begin(), cell.end(), [&](int32_t i) { return keep[at(i)] != 0; })) visit(cell);
    }
  };
  std::vector<uint8_t> is_corner(keep.size(), 0), was_corner(keep.size(), 0);
  for (const int32_t i : scene.tetrahedra) was_corner[at(i)] = 1;
  if (std::find(was_corner.begin(), was_corner.end(), 0) == was_corner.end()) {
    cells_left(scene.tetrahedra, 4, [&](std::span<const int32_t> cell) {
      for (const int32_t i : cell) is_corner[at(i)] = 1;
    });
    keep = is_corner;
  }
  Scene part = scene;
  std::vector<int32_t> number(keep.size(), -1);
  part.rest.clear(), part.velocity.clear(), part.mass.clear(), part.held.clear(), part.node.clear();
  part.edges.clear(), part.tetrahedra.clear(), part.hexahedra.clear();
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    number[i] = static_cast<int32_t>(part.count());
    part.rest.push_back(scene.rest[i]);
    part.velocity.push_back(scene.velocity[i]);
    part.mass.push_back(scene.mass[i]);
    part.held.push_back(scene.held[i]);
    part.node.insert(part.node.end(), &scene.node[3 * i], &scene.node[3 * i] + 3);
  }
  for (const auto& [a, b] : scene.edges) {
    if (keep[at(a)] != 0 && keep[at(b)] != 0) part.edges.push_back({number[at(a)], number[at(b)]});
  }
  cells_left(scene.tetrahedra, 4, [&](std::span<const int32_t> cell) {
    for (const int32_t i : cell) part.tetrahedra.push_back(number[at(i)]);
  });
  cells_left(scene.hexahedra, 8, [&](std::span<const int32_t> cell) {
    for (const int32_t i : cell) part.hexahedra.push_back(number[at(i)]);
  });
  return part;
}

std::vector<Question> simpler_scenes(const Question& question) {
  const Scene scene = scene_of(question.given);
  std::vector<Question> simpler;
  const auto add = [&](const Scene& other) {
    Question next = question;
    next.given = arrays_of(other);
    if (other.count() > 0 && !(next == question)) simpler.push_back(std::move(next));
  };
  // Without a stroke.
  for (int64_t gone = 0; gone < scene.blades && scene.blades > 1; ++gone) {
    Scene other = scene;
    other.blades -= 1;
    other.blade.clear();
    for (int64_t k = 0; k < scene.frames * scene.blades; ++k) {
      if (k % scene.blades != gone)
        other.blade.insert(other.blade.end(), &scene.blade[at(4 * k)], &scene.blade[at(4 * k)] + 4);
    }
    add(other);
  }
  // Without a half along an axis, the layer at an end of it, one particle.
  const auto keep_where = [&](const std::function<bool(std::size_t)>& is_kept) {
    std::vector<uint8_t> keep(scene.rest.size());
    for (std::size_t i = 0; i < keep.size(); ++i) keep[i] = is_kept(i);
    add(part_of(scene, keep));
  };
  for (const bool is_half : {true, false}) {
    for (int axis = 0; axis < 3; ++axis) {
      const Range range = range_along(scene, axis_vector(axis));
      if (range.high - range.low < 0.5) continue;
      const double middle = 0.5 * (range.low + range.high);
      const auto place = [&](std::size_t i) { return scene.rest[i][axis] / scene.h; };
      keep_where([&](std::size_t i) { return place(i) > (is_half ? middle : range.low + 0.5); });
      keep_where([&](std::size_t i) { return place(i) < (is_half ? middle : range.high - 0.5); });
    }
  }
  for (std::size_t gone = 0; gone < scene.rest.size(); ++gone) {
    keep_where([&](std::size_t i) { return i != gone; });
  }
  // Fewer frames, and less motion.
  for (const int64_t frames : {scene.frames / 2, scene.frames - 1}) {
    Scene other = scene;
    other.frames = std::max<int64_t>(frames, 2);
    other.blade.resize(at(other.frames * other.blades * 4));
    if (other.frames < scene.frames) add(other);
  }
  Scene other = scene;
  std::fill(other.velocity.begin(), other.velocity.end(), Vec3{});
  add(other);
  other = scene;
  other.gravity = {};
  add(other);
  other = scene;
  std::fill(other.held.begin(), other.held.end(), 0);
  add(other);
  return simpler;
}

}  // namespace

const OperationDescription kDissect = {
    .number = wire::dissect,
    .name = "dissect",
    .text = "a whole simulator: what becomes of a body that is cut",
    .by_itself = "",
    .answers = kRunAnswers,
    .cases = "scenes",
    .draw = draw_scene,
    .cases_of = one_body,
    .size_of = size_of_scene,
    .judge = judge_scene,
    .problem = problem_of_scene,
    .simpler = simpler_scenes,
    .kinds = scene_kinds,
    .draw_for = draw_scene_for,
    .as_drawn = kAsDrawn,
    .difference = difference_of_runs,
    .files = files_of,
};

}  // namespace cutproof::guests
