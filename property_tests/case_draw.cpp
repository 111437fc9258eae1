// Random cases.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "model/grid.h"
#include "model/rules.h"
#include "property_tests/cases.h"
#include "property_tests/random.h"

namespace cutproof::property_tests {
namespace {

// --- Bodies -------------------------------------------------------------------------------------------------------

struct Ball {
  std::array<double, 3> center;
  double radius;
  bool contains(Node node) const {
    double square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) square += (node[axis] - center[axis]) * (node[axis] - center[axis]);
    return square <= radius * radius;
  }
};

// Balls that are added or taken away, one after the other.
std::vector<Node> balls(Random& random, Node dims) {
  std::vector<std::pair<Ball, bool>> parts;
  const int32_t count = random.between(1, 5);
  const double longest = std::max({dims[0], dims[1], dims[2]});
  for (int32_t b = 0; b < count; ++b) {
    Ball ball;
    for (std::size_t axis = 0; axis < 3; ++axis) ball.center[axis] = random.real(0, dims[axis] - 1);
    ball.radius = random.real(0.2, 0.6) * longest;
    parts.emplace_back(ball, b == 0 || random.chance(0.6));
  }
  return nodes_where(dims, [&](Node node) {
    bool inside = false;
    for (const auto& [ball, added] : parts) {
      if (ball.contains(node)) inside = added;
    }
    return inside;
  });
}

// A sheet, one node thick where it is flat, bent along x and y.
std::vector<Node> sheet(Random& random, Node dims) {
  const double bend = random.chance(0.5) ? 0 : random.real(0, dims[2]);
  const double wave = random.real(0.1, 1.0);
  return nodes_where(dims, [&](Node node) {
    const double height = 0.5 * dims[2] + 0.5 * bend * std::sin(wave * node[0]) * std::cos(wave * node[1]);
    return node[2] == std::clamp(static_cast<int32_t>(std::floor(height)), 0, dims[2] - 1);
  });
}

// A random walk on the grid that seldom turns.
std::vector<Node> wire(Random& random, Node dims) {
  std::set<Node> nodes;
  Node place = {random.between(0, dims[0] - 1), random.between(0, dims[1] - 1), random.between(0, dims[2] - 1)};
  const int32_t steps = 3 * (dims[0] + dims[1] + dims[2]);
  auto direction = random.index(6);
  for (int32_t s = 0; s < steps; ++s) {
    nodes.insert(place);
    if (random.chance(0.2)) direction = random.index(6);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      place[axis] = std::clamp(place[axis] + kDirections[direction][axis], 0, dims[axis] - 1);
    }
  }
  return {nodes.begin(), nodes.end()};
}

std::vector<Node> degenerate_body(Random& random, Node dims) {
  switch (random.between(0, 6)) {
    case 0:
      return {};
    case 1:
      return {{0, 0, 0}};
    case 2:  // two particles, joined or only diagonal
      return {{0, 0, 0}, random.pick<Node>({{1, 0, 0}, {0, 0, 1}, {1, 1, 0}, {1, 1, 1}, {2, 0, 0}})};
    case 3:  // a straight wire
      return nodes_where({dims[0] + dims[1] + dims[2], 1, 1}, [](Node) { return true; });
    case 4:  // a flat sheet
      return nodes_where({dims[0], 1, dims[2]}, [](Node) { return true; });
    case 5:  // a checkerboard: no two particles are joined
      return nodes_where(dims, [](Node node) { return (node[0] + node[1] + node[2]) % 2 == 0; });
    default:  // two blocks that meet in an edge of the grid
      return nodes_where(dims, [&](Node node) { return (2 * node[0] < dims[0]) == (2 * node[1] < dims[1]); });
  }
}

std::vector<Node> draw_body(Random& random, Node dims) {
  if (random.chance(0.3)) return degenerate_body(random, dims);
  switch (random.between(0, 4)) {
    case 0:
      return nodes_where(dims, [](Node) { return true; });
    case 1:
      return balls(random, dims);
    case 2:
      return sheet(random, dims);
    case 3:
      return wire(random, dims);
    default: {  // a sponge
      const double fill = random.real(0.3, 0.95);
      return nodes_where(dims, [&](Node) { return random.chance(fill); });
    }
  }
}

// --- Strokes ------------------------------------------------------------------------------------------------------

Stroke draw_stroke(Random& random, Node dims) {
  constexpr int32_t kBeyond = 6;  // strokes may begin and end this far outside the body
  Stroke stroke;
  stroke.back = random.between(0, 5);
  stroke.down = random.chance(0.85);
  stroke.link = random.pick({Link::apart, Link::apart, Link::chained});
  const auto point = [&](Quarters& p) {
    for (std::size_t axis = 0; axis < 3; ++axis) p[axis] = random.between(-kBeyond, 4 * (dims[axis] - 1) + kBeyond);
  };
  point(stroke.from);
  point(stroke.to);
  if (random.chance(0.5)) stroke.to[random.index(3)] = stroke.from[0];
  if (!random.chance(0.3)) return stroke;

  const auto to_nodes = [](Quarters& p) {
    for (auto& q : p) q = 4 * (q / 4);
  };
  switch (random.between(0, 4)) {
    case 0:  // from vertex to vertex
      to_nodes(stroke.from);
      to_nodes(stroke.to);
      break;
    case 1: {  // along one edge of the grid
      to_nodes(stroke.from);
      stroke.to = stroke.from;
      stroke.to[random.index(3)] += 4;
      break;
    }
    case 2: {  // in a plane of the grid, or halfway between two of them
      const auto normal = random.index(3);
      stroke.from[normal] = stroke.to[normal] = 2 * (stroke.from[normal] / 2);
      stroke.back = static_cast<int32_t>(2 * ((normal + 1) % 3));
      break;
    }
    case 3:  // zero length
      stroke.to = stroke.from;
      break;
    default:
      stroke.link = Link::retraced;
  }
  return stroke;
}

// A turn of so many spacings at the blade's farthest corner, at most: backends and oracles follow a turning blade in
// pieces of a fixed length.
Quarters draw_turn(Random& random, const Case& c) {
  constexpr double kLongestArc = 4;  // [h]
  const double radius = std::hypot(c.blade_length / 2.0, c.blade_depth) / 4;
  const auto most = std::min(120, static_cast<int32_t>(100 * kLongestArc / std::sqrt(3.0) / radius));
  Quarters turn = {random.between(-most, most), random.between(-most, most), random.between(-most, most)};
  if (random.chance(0.3)) turn[random.index(3)] = turn[random.index(3)] = 0;  // about an axis, or in a plane of them
  return turn;
}

// Blades that stand at an angle, or turn, in a share of all cases. `c` has its strokes.
void incline(Random& random, Case& c) {
  if (random.chance(0.25)) {
    for (Stroke& stroke : c.strokes) {
      for (int32_t& t : stroke.tilt) t = random.between(-3, 3);
      if (random.chance(0.5)) continue;
      for (int32_t& a : stroke.along) a = random.between(-4, 4);
    }
  }
  if (random.chance(0.2)) {
    for (Stroke& stroke : c.strokes) {
      if (random.chance(0.7)) stroke.turn = draw_turn(random, c);
    }
  }
}

// --- What moves ---------------------------------------------------------------------------------------------------

// A short blade that comes to a place in the tissue with its face, one of its sides, its edge or its back ahead, from a
// few quarters away.
Stroke draw_press(Random& random, const Case& c) {
  Stroke stroke;
  stroke.back = random.between(0, 5);
  const std::size_t back_axis = at(stroke.back) / 2;
  const std::size_t along_axis = (back_axis + static_cast<std::size_t>(random.between(1, 2))) % 3;
  const std::size_t normal_axis = 3 - back_axis - along_axis;
  stroke.along[along_axis] = 1;
  const Node& target = c.nodes[random.index(c.nodes.size())];
  for (std::size_t axis = 0; axis < 3; ++axis) stroke.from[axis] = 4 * target[axis];
  // The place is somewhere under the blade, so often near a border of it: back from the middle of the edge.
  const int32_t towards_back = stroke.back % 2 == 0 ? +1 : -1;
  stroke.from[back_axis] -= towards_back * random.between(-1, c.blade_depth + 1);
  stroke.from[along_axis] += random.between(-c.blade_length / 2 - 1, c.blade_length / 2 + 1);
  // With the particle exactly over a border in most of them: how far a blade reaches is a whole number of quarters.
  const int32_t border = random.between(0, 4);
  if (border == 0) stroke.from[back_axis] = 4 * target[back_axis];
  if (border == 1) stroke.from[back_axis] = 4 * target[back_axis] - towards_back * c.blade_depth;
  if (border == 2) stroke.from[along_axis] = 4 * target[along_axis] - c.blade_length / 2;
  if (border == 3) stroke.from[along_axis] = 4 * target[along_axis] + c.blade_length / 2;
  stroke.to = stroke.from;
  const std::size_t ahead = random.pick({normal_axis, normal_axis, along_axis, back_axis});
  const int32_t sign = random.chance(0.5) ? +1 : -1;
  stroke.from[ahead] -= sign * random.between(0, 10);
  stroke.to[ahead] += sign * random.between(0, 8);
  if (random.chance(0.3)) stroke.to[normal_axis] += random.between(-4, 4);
  return stroke;
}

void draw_presses(Random& random, Case& c) {
  c.blade_length = random.pick({2, 4, 6, 8, 12});
  c.blade_depth = random.pick({2, 4, 6, 8, 12});
  c.blade_thickness = random.pick({0, 4, 6, 8});
  c.strokes.clear();
  const int32_t strokes = random.between(1, 3);
  for (int32_t s = 0; s < strokes; ++s) {
    c.strokes.push_back(draw_press(random, c));
    if (s > 0) c.strokes.back().link = random.pick({Link::apart, Link::chained, Link::retraced});
  }
  incline(random, c);
  if (random.chance(0.4)) {  // the tissue falls towards the blade that comes, and is led round it
    const Stroke& first = c.strokes.front();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int32_t way = first.to[axis] - first.from[axis];
      if (way != 0) c.gravity[axis] = (way > 0 ? -1 : +1) * random.pick({30, 100, 300});
    }
  }
  if (random.chance(0.5)) {  // the blade rests, and pushed tissue settles against it
    Stroke rest = c.strokes.back();
    rest.link = Link::chained;
    rest.from = rest.to;
    rest.turn = {0, 0, 0};
    c.strokes.push_back(rest);
  }
}

// At an outermost layer of nodes, often exactly, or a little beside it.
CaseWall draw_wall(Random& random, const Case& c) {
  CaseWall wall;
  wall.axis = random.between(0, 2);
  wall.side = random.chance(0.5) ? +1 : -1;
  const auto [low, high] = extent(c.nodes, at(wall.axis));
  wall.offset = 4 * (wall.side > 0 ? low : high) - wall.side * random.pick({0, 0, 1, 2, -1});
  wall.friction = random.pick({0, 0, 3, 10});
  return wall;
}

CaseGrip draw_grip(Random& random, const Case& c) {
  CaseGrip grip;
  grip.low = grip.high = c.nodes[random.index(c.nodes.size())];
  for (int32_t& k : grip.high) k += random.between(0, 3);
  if (random.chance(0.6)) {
    for (int32_t& p : grip.pull) p = random.between(-5, 5);
  }
  grip.from = random.pick({0, 0, 0, 1, 3});
  grip.until = random.chance(0.5) ? -1 : grip.from + random.between(1, 8);
  return grip;
}

// Takes over particles that an earlier grip releases, and some beside them.
CaseGrip draw_next_grip(Random& random, const CaseGrip& earlier) {
  CaseGrip grip = earlier;
  ++grip.high[random.index(3)];
  for (int32_t& p : grip.pull) p = random.between(-5, 5);
  grip.from = earlier.until + random.pick({0, 0, 1});
  grip.until = random.chance(0.5) ? -1 : grip.from + random.between(1, 8);
  grip.shared = true;
  return grip;
}

void draw_dynamics(Random& random, Case& c) {
  if (random.chance(0.2)) {
    c.solver = Solver::published;
    c.acceleration = Acceleration::none;
    c.relaxation = random.pick({1, 3, 5, 8, 10});
  }
  if (random.chance(0.25)) c.damping = random.pick({1, 10, 100, 1000});
  if (random.chance(0.3)) c.time_step = random.pick({20, 100, 250, 4000, 16000});
  if (random.chance(0.25)) c.epsilon = random.pick({11, 12, 13, 20, 30});
  if (random.chance(0.24)) {
    c.removal = random.pick({Removal::geometric, Removal::strain});
    c.strain = random.pick({101, 105, 120, 150, 200});
  }
  if (c.nodes.empty()) return;
  if (random.chance(0.65)) draw_presses(random, c);
  c.pace = random.pick({1, 1, 1, 2, 4});
  if (random.chance(0.4)) c.blade_friction = random.pick({1, 3, 5, 10, 30});
  if (random.chance(0.45)) {
    const int32_t walls = random.between(1, 2);
    for (int32_t w = 0; w < walls; ++w) c.walls.push_back(draw_wall(random, c));
    for (int32_t& g : c.gravity) g += random.between(-3, 3);
    const CaseWall& wall = c.walls[random.index(c.walls.size())];
    c.gravity[at(wall.axis)] = -wall.side * random.pick({0, 10, 30, 100});
  }
  if (random.chance(0.3)) {
    const int32_t grips = random.between(1, 2);
    for (int32_t g = 0; g < grips; ++g) {
      const bool takes_over = g > 0 && c.grips.back().until >= 0 && random.chance(0.5);
      c.grips.push_back(takes_over ? draw_next_grip(random, c.grips.back()) : draw_grip(random, c));
    }
  }
}

constexpr int kSizeOfSparseBalls = 80;

}  // namespace

std::vector<Node> nodes_where(Node dims, const std::function<bool(Node)>& is_tissue) {
  std::vector<Node> nodes;
  for (int32_t k = 0; k < dims[2]; ++k) {
    for (int32_t j = 0; j < dims[1]; ++j) {
      for (int32_t i = 0; i < dims[0]; ++i) {
        if (is_tissue({i, j, k})) nodes.push_back({i, j, k});
      }
    }
  }
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

std::pair<int32_t, int32_t> extent(const std::vector<Node>& nodes, std::size_t axis) {
  std::pair<int32_t, int32_t> range = {nodes.front()[axis], nodes.front()[axis]};
  for (const Node& node : nodes) range = {std::min(range.first, node[axis]), std::max(range.second, node[axis])};
  return range;
}

Case draw_case(uint64_t seed, int size) {
  Random random(seed);
  Case c;
  const double u = std::clamp(size, 0, kMostSize) / 100.0;
  const auto longest = static_cast<int32_t>(3 + 24 * u * u * u + 4 * u);
  const Node dims = {random.between(1, longest), random.between(1, longest), random.between(1, longest)};
  c.nodes = draw_body(random, dims);
  std::sort(c.nodes.begin(), c.nodes.end());
  c.nodes.erase(std::unique(c.nodes.begin(), c.nodes.end()), c.nodes.end());
  c.spacing = random.pick({1.0, 0.003});

  c.clusters = random.pick({ClusterKind::boxes, ClusterKind::sampled, ClusterKind::foreign, ClusterKind::tiles});
  c.side = random.between(1, 6);
  c.seed_spacing = random.between(2, 14);
  c.ball_radius = random.between(4, 18);
  // Balls of nine times their spacing hold every particle a thousand times: legal, and paid for by every other case, so
  // they are small and rare. In the largest bodies even three times is much: five thousand balls that share each
  // particle with seventy others cost as much as 400 cases.
  if (size > 40 || random.chance(0.9)) c.seed_spacing = std::max(c.seed_spacing, (c.ball_radius + 2) / 3);
  if (size > kSizeOfSparseBalls) c.seed_spacing = std::max(c.seed_spacing, 2 * c.ball_radius / 3);
  c.most = random.between(1, 30);
  c.tau = random.between(0, c.most);
  c.cap = random.between(c.most, 3 * c.most);
  c.seed = random.seed();
  c.merge = random.chance(0.1) ? MergeRule::none : random.chance(0.6) ? MergeRule::deterministic : MergeRule::published;
  c.expand = random.chance(0.1)   ? ExpandRule::none
             : random.chance(0.7) ? ExpandRule::edge_cover
                                  : ExpandRule::published;
  c.expand_depth = random.chance(0.7) ? 1 : random.between(2, 4);
  c.debris = random.chance(0.7) ? 0 : random.between(2, 12);

  c.blade_length = random.pick({1, 4, 8, 16, 400});
  c.blade_depth = random.pick({1, 4, 8, 400, 400});
  c.blade_thickness = random.chance(0.5) ? random.between(0, 10) : random.pick({0, 4, 8, 16, 100});
  const int32_t strokes = random.between(0, 1 + size / 15);
  for (int32_t s = 0; s < strokes; ++s) c.strokes.push_back(draw_stroke(random, dims));
  c.together = random.pick({1, 2, 3, 8, 8});
  if (c.merge == MergeRule::published && random.chance(0.4) && random.chance(0.6)) {
    // Every cluster is small, and most pairs are too many for the cap.
    c.clusters = ClusterKind::foreign;
    c.most = random.between(2, 8);
    c.tau = c.most;
    c.cap = c.most + random.between(0, 3);
  }
  if (random.chance(0.3)) c.alpha = random.between(1, 9);
  // By its own random numbers: crossings do not change the rest of a case.
  Random surface(seed ^ 0x5u);
  if (surface.chance(0.4)) c.surface = surface.between(1, 1'000'000);
  incline(random, c);
  return c;
}

Case draw_moving_case(uint64_t seed, int size) {
  Case c = draw_case(seed, size);
  Random random(~seed);
  c.moves = true;
  c.substeps = random.between(1, 4);
  c.iterations = random.between(1, 4);
  c.stiffness = random.between(3, 6);
  c.ground = random.chance(0.5);
  c.acceleration = random.chance(0.5) ? Acceleration::chebyshev : Acceleration::none;
  draw_dynamics(random, c);
  if (random.chance(0.4)) c.remove = random.chance(0.5) ? RemovedEnds::nearer : RemovedEnds::one;
  // By random numbers of its own, as `surface`.
  Random retarded(seed ^ 0x7u);
  if (c.solver == Solver::implicit && retarded.chance(0.3)) c.retardation = retarded.pick({1, 10, 40, 200});
  Random volume(seed ^ 0x9u);
  if (c.solver == Solver::implicit && volume.chance(0.6)) c.volume_share = volume.pick({10, 50, 80, 94, 99});
  return c;
}

Stroke draw_stroke(uint64_t seed, const Case& c) {
  Random random(seed);
  Node dims = {1, 1, 1};
  for (const Node& node : c.nodes) {
    for (std::size_t axis = 0; axis < 3; ++axis) dims[axis] = std::max(dims[axis], node[axis] + 1);
  }
  return draw_stroke(random, dims);
}

}  // namespace cutproof::property_tests
