// Random bodies, strokes and kinds of scenes.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "guests/questions/kinds.h"
#include "guests/questions/scenes.h"
#include "model/at.h"

namespace cutproof::guests::scenes {
namespace {

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

std::vector<int32_t> tetrahedra_of(const std::vector<std::array<int32_t, 8>>& cubes) {
  std::vector<int32_t> tetrahedra;
  for (const auto& cube : cubes) {
    for (const auto& corners : kTetrahedraOfCube) {
      for (const int32_t corner : corners) tetrahedra.push_back(cube[at(corner)]);
    }
  }
  return tetrahedra;
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
    const std::vector<int32_t> corners = tetrahedra_of(cubes_of(number));
    if (!is_joined_by_faces(corners)) return box;
    const std::set<int32_t> kept(corners.begin(), corners.end());
    std::erase_if(nodes, [&](const SceneNode& node) { return !kept.contains(number.at(node)); });
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
  add_cells(scene);
  return scene;
}

// Initial motion and gravity. Returns a common velocity of all particles.
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
}  // namespace

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

namespace {

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

constexpr const char *kAlongTheGrid = "along the grid", *kBesideTheTissue = "beside the tissue";

// Tissue according to the judge of runs, compared with the intended cut.
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
    {kAlongTheGrid,  // through the particles of a layer, or in the middle between two
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
    {kBesideTheTissue,
     [](Random& r, const Scene& scene, const Limits& limits) {
       Plane plane = draw_plane(r, scene, true);
       plane.offset = range_along(scene, plane.normal).high + 1.5 + limits.cut_resolution + r.unit();
       return one_stroke(r, scene, plane);
     },
     [](const oracles::RunPieces& pieces) { return pieces.surely_cut + pieces.perhaps_cut == 0; }},
};
constexpr auto kSceneKindCount = static_cast<int64_t>(std::size(kSceneKinds));

Question question_within(const Scene& scene, std::string kind, Precision precision, const Limits& limits,
                         uint32_t promises) {
  Question question;
  question.kind = std::move(kind);
  for (Array& array : arrays_of(scene)) question.given.push_back(as_it_is_given(std::move(array), precision));
  question.known = {make_array("promises", {1}, std::vector<int32_t>{static_cast<int32_t>(promises)}),
                    make_array("cut_resolution", {1}, std::vector<double>{limits.cut_resolution * scene.h})};
  return question;
}

}  // namespace

void add_cells(Scene& scene) {
  Numbers number;
  for (int32_t i = 0; i < scene.count(); ++i) {
    const int32_t* const node = &scene.node[at(3 * i)];
    number.emplace(SceneNode{node[0], node[1], node[2]}, i);
  }
  const auto cubes = cubes_of(number);
  for (const auto& cube : cubes) scene.hexahedra.insert(scene.hexahedra.end(), cube.begin(), cube.end());
  scene.tetrahedra = tetrahedra_of(cubes);
}

Question question_of(const Scene& scene, std::string kind, const PluginInfo& plugin) {
  return question_within(scene, std::move(kind), plugin.precision, limits_of(plugin.limits, plugin.name),
                         scene_promises(plugin.promises.value_or("")));
}

bool is_as_drawn(const std::string& kind, const oracles::RunPieces& pieces) {
  const auto known =
      std::find_if(std::begin(kSceneKinds), std::end(kSceneKinds), [&](const SceneKind& k) { return kind == k.name; });
  return known != std::end(kSceneKinds) && known->is_one(pieces);
}
bool is_to_be_cut(std::string_view kind) { return kind != kAlongTheGrid && kind != kBesideTheTissue; }

std::vector<std::string> scene_kinds() {
  std::vector<std::string> names;
  for (const SceneKind& kind : kSceneKinds) names.emplace_back(kind.name);
  return names;
}

namespace {

Question draw_within(uint64_t seed, int64_t index, Precision precision, const Limits& limits, uint32_t promises) {
  Random random(mixed(seed, index));
  const SceneKind& kind = kSceneKinds[index % kSceneKindCount];
  Scene scene = draw_body(random, limits);
  scene.kick.assign(scene.rest.size(), Vec3{});
  const Vec3 common = draw_motion(random, limits, scene);
  add_strokes(scene, common, kind.draw(random, scene, limits));
  return question_within(scene, kind.name, precision, limits, promises);
}

}  // namespace

Question draw_scene(uint64_t seed, int64_t index, Precision precision) {
  return draw_within(seed, index, precision, {}, 0);
}
Question draw_scene_for(uint64_t seed, int64_t index, const PluginInfo& plugin) {
  return draw_within(seed, index, plugin.precision, limits_of(plugin.limits, plugin.name),
                     scene_promises(plugin.promises.value_or("")));
}

}  // namespace cutproof::guests::scenes
