#include "property_tests/cases.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "fixtures/blade_path.h"
#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "model/io/limits.h"
#include "model/rules.h"
#include "property_tests/random.h"

namespace cutproof::property_tests {
namespace {

// Of nodes along an axis; there is one.
std::pair<int32_t, int32_t> extent(const std::vector<Node>& nodes, std::size_t axis) {
  std::pair<int32_t, int32_t> range = {nodes.front()[axis], nodes.front()[axis]};
  for (const Node& node : nodes) range = {std::min(range.first, node[axis]), std::max(range.second, node[axis])};
  return range;
}

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
  if (random.chance(0.5)) {  // it stands where it has come to, and what it has pushed settles against it
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

// Takes over what an earlier one releases, and some of what is beside it.
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

// --- Foreign clusters ---------------------------------------------------------------------------------------------

// Connected sets of at most `most` particles that cover the body: I1, I2 and nothing more.
std::vector<std::vector<int32_t>> connected_cover(const Body& body, int32_t most, uint64_t seed) {
  Random random(seed);
  std::vector<uint8_t> covered(at(body.particle_count()), 0);
  std::vector<int32_t> order(body.node.size());
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t k = order.size(); k > 1; --k) {
    std::swap(order[k - 1], order[random.index(k)]);
  }
  std::vector<std::vector<int32_t>> clusters;
  for (const int32_t start : order) {
    if (covered[at(start)]) continue;
    std::vector<int32_t> members = {start};
    const auto wanted = at(random.between(1, most));
    for (int32_t attempt = 0; attempt < 6 * most && members.size() < wanted; ++attempt) {
      const int32_t from = members[random.index(members.size())];
      const int32_t next = body.neighbour(from, random.between(0, 5));
      if (next >= 0 && std::find(members.begin(), members.end(), next) == members.end()) members.push_back(next);
    }
    std::sort(members.begin(), members.end());
    for (const int32_t p : members) covered[at(p)] = 1;
    clusters.push_back(std::move(members));
  }
  return clusters;
}

// --- Blade --------------------------------------------------------------------------------------------------------

Vec3 metric(Quarters p, double h) { return (h / 4) * Vec3{1.0 * p[0], 1.0 * p[1], 1.0 * p[2]}; }

Vec3 direction_vector(int32_t direction) {
  const auto& d = kDirections[at(direction)];
  return {1.0 * d[0], 1.0 * d[1], 1.0 * d[2]};
}

Vec3 whole_vector(const std::array<int32_t, 3>& v) { return {1.0 * v[0], 1.0 * v[1], 1.0 * v[2]}; }

// Halfway along the stroke. Directions that lie along an axis do so exactly.
struct Orientation {
  Vec3 along, back;
};

Orientation orientation_of(const Stroke& stroke) {
  Orientation blade;
  blade.back = direction_vector(stroke.back);
  if (stroke.tilt != Quarters{}) blade.back = normalized(4 * blade.back + whole_vector(stroke.tilt));
  const auto across = [&](Vec3 wish) { return wish - dot(wish, blade.back) * blade.back; };
  // The edge lies along the stroke, as far as that is orthogonal to the back; if the stroke is along the back, or of no
  // length, along another axis.
  constexpr double kRounding = 1e-9;
  Vec3 wish = stroke.along != Quarters{} ? whole_vector(stroke.along) : metric(stroke.to, 4) - metric(stroke.from, 4);
  if (!(norm(across(wish)) > kRounding * norm(wish))) wish = direction_vector((stroke.back + 2) % 6);
  // Of a direction that is nearly along the back the first difference is rounded too much to be orthogonal to it.
  blade.along = normalized(across(wish));
  if (stroke.tilt != Quarters{}) blade.along = normalized(across(blade.along));
  return blade;
}

// By Rodrigues' formula.
Vec3 turned(Vec3 v, Vec3 axis, double angle) {
  return std::cos(angle) * v + std::sin(angle) * cross(axis, v) + (1 - std::cos(angle)) * dot(axis, v) * axis;
}

// Where the blade is along its stroke, from 0 to 1.
class BladeWay {
 public:
  BladeWay(const Stroke& stroke, Vec3 first_node, double h)
      : middle_(orientation_of(stroke)),
        from_(first_node + metric(stroke.from, h)),
        to_(first_node + metric(stroke.to, h)),
        angle_(0.01 * norm(whole_vector(stroke.turn))),
        axis_(angle_ > 0 ? normalized(whole_vector(stroke.turn)) : Vec3{}) {}

  BladePose at(double fraction) const {
    const Vec3 edge = from_ + fraction * (to_ - from_);
    if (!(angle_ > 0)) return {edge, middle_.along, middle_.back};
    const double angle = (fraction - 0.5) * angle_;
    return {edge, turned(middle_.along, axis_, angle), turned(middle_.back, axis_, angle)};
  }

  // How many substeps it takes at least so that nothing tunnels (method.md §3, Blade).
  double substeps_needed(const Setup& setup) const {
    // A small part of the turn has an axis however far the whole one goes; each part is as long as any other.
    constexpr int kParts = 64;
    const double turning =
        angle_ > 0 ? kParts * fixtures::motion_between(at(0), at(1.0 / kParts), setup.blade).turning : 0;
    return std::max((norm(to_ - from_) + turning) / blade_clearance(setup),
                    turning / (std::min(setup.blade.length, setup.blade.depth) / 2));
  }

 private:
  Orientation middle_;
  Vec3 from_, to_;
  double angle_;
  Vec3 axis_;
};

// One substep, or if the body moves as many frames as the blade needs so that it does not pass what it pushes.
void add_moves(const Stroke& stroke, Vec3 first_node, const Case& c, Setup& setup) {
  const BladeWay way(stroke, first_node, c.spacing);
  int64_t moves = 1;
  if (c.moves) {
    const auto frames = static_cast<int64_t>(std::ceil(way.substeps_needed(setup) / setup.step.substeps));
    moves = std::max<int64_t>(1, frames) * c.pace * setup.step.substeps;
  }
  const auto number = static_cast<int32_t>(setup.stroke_end.size());
  BladeMove move;
  move.from = way.at(0);
  move.down = stroke.down;
  move.stroke = stroke.down ? number : -1;
  for (int64_t k = 1; k <= moves; ++k) {
    move.to = way.at(static_cast<double>(k) / static_cast<double>(moves));
    setup.blade_moves.push_back(move);
    move.from = move.to;
  }
  const auto substeps = static_cast<int64_t>(setup.blade_moves.size());
  if (stroke.down) setup.stroke_end.push_back((substeps - 1) / setup.step.substeps);
}

// The schedule (Setup): the strokes one after the other; in what is left of the last frame the blade is lifted.
void add_schedule(const Case& c, Vec3 first_node, Setup& setup) {
  for (const Stroke& stroke : resolved_strokes(c)) add_moves(stroke, first_node, c, setup);
  const auto substeps = at(setup.step.substeps);
  while (setup.blade_moves.size() % substeps != 0) {
    BladeMove lifted = setup.blade_moves.back();
    lifted.from = lifted.to;
    lifted.down = false;
    lifted.stroke = -1;
    setup.blade_moves.push_back(lifted);
  }
  setup.substep_length.assign(setup.blade_moves.size() / substeps, 1e-6 * c.time_step);
}

bool is_over_before(const CaseGrip& a, const CaseGrip& b) { return a.until >= 0 && a.until <= b.from; }

// A strip of substeps for each grip.
void add_grips(const Case& c, Setup& setup) {
  const auto substeps = static_cast<int64_t>(setup.blade_moves.size());
  for (std::size_t g = 0; g < c.grips.size(); ++g) {
    const CaseGrip& asked = c.grips[g];
    Grip grip;
    std::vector<uint8_t> taken(c.nodes.size(), 0);
    for (std::size_t k = 0; k < g; ++k) {
      const CaseGrip& other = c.grips[k];
      if (asked.shared && (is_over_before(other, asked) || is_over_before(asked, other))) continue;
      for (const int32_t i : setup.grips[k].particles) taken[at(i)] = 1;
    }
    for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
      const auto node = setup.body.grid.coordinates(setup.body.node[at(i)]);
      bool inside = taken[at(i)] == 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int32_t k = node[axis] - 1;  // behind the ring of empty nodes
        inside = inside && asked.low[axis] <= k && k <= asked.high[axis];
      }
      if (!inside) continue;
      grip.particles.push_back(i);
    }
    for (int64_t s = 0; s < substeps; ++s) {
      const bool active = asked.from <= s && (asked.until < 0 || s < asked.until);
      grip.active.push_back(active ? 1 : 0);
      grip.displacement.push_back(active ? (c.spacing / 100) * whole_vector(asked.pull) : Vec3{});
    }
    setup.grips.push_back(std::move(grip));
  }
}

void add_dynamics(const Case& c, Vec3 first_node, Setup& setup) {
  const double h = c.spacing, dt = 1e-6 * c.time_step;
  setup.step.solver = c.solver;
  setup.step.relaxation = c.relaxation / 10.0;
  if (c.solver == Solver::implicit) setup.step.acceleration = c.acceleration;
  setup.step.damping = c.damping;
  if (c.solver == Solver::implicit) setup.step.retardation = c.retardation / 10.0 * dt;
  setup.step.gravity = (h / 1000 / (dt * dt)) * whole_vector(c.gravity);
  setup.detect.epsilon = c.epsilon / 10.0;
  setup.detect.strain = c.strain / 100.0;
  if (c.removal == Removal::usual) setup.detect.remove = c.remove;
  if (c.removal == Removal::geometric) setup.detect.criterion = Criterion::geometric;
  if (c.removal == Removal::strain) setup.detect.criterion = Criterion::strain;
  setup.blade.friction = c.blade_friction / 10.0;
  if (c.ground) {
    setup.step.gravity += Vec3{0, 0, -9.81};
    setup.walls.push_back({2, +1, first_node.z - 0.5 * h, 0.3});
  }
  for (const CaseWall& drawn : c.walls) {
    const Wall wall = {drawn.axis, drawn.side, first_node[drawn.axis] + drawn.offset * h / 4, drawn.friction / 10.0};
    const bool has_room = std::none_of(setup.walls.begin(), setup.walls.end(),
                                       [&](const Wall& other) { return leave_no_room(wall, other); });
    if (has_room) setup.walls.push_back(wall);
  }
}

// Without iterations rotations stay as they are loaded. Each cluster gets one of its own, so that a stage that gives a
// cluster the wrong one is seen; small ones, so that the skin keeps its shape.
void tell_apart(Clusters& clusters) {
  constexpr double kGreatestAngle = 1e-3;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const double angle = kGreatestAngle * (c + 1) / clusters.count();
    const double cosine = std::cos(angle), sine = std::sin(angle);
    clusters.rotation[at(c)] = {{cosine, -sine, 0, sine, cosine, 0, 0, 0, 1}};
    clusters.degenerate[at(c)] = c % 3 == 1;
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

void without_blade(Setup& setup) {
  setup.has_blade = false;
  setup.blade_moves.clear();
  setup.stroke_end.clear();
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

  c.clusters = random.pick({ClusterKind::boxes, ClusterKind::sampled, ClusterKind::foreign});
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
  // By random numbers of its own: the rest of a case is what it was before there were crossings.
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

std::vector<Stroke> resolved_strokes(const Case& c) {
  std::vector<Stroke> strokes = c.strokes;
  for (std::size_t s = 1; s < strokes.size(); ++s) {
    if (strokes[s].link != Link::apart) strokes[s].from = strokes[s - 1].to;
    if (strokes[s].link == Link::retraced) {
      strokes[s].to = strokes[s - 1].from;
      strokes[s].back = strokes[s - 1].back;
      strokes[s].tilt = strokes[s - 1].tilt;
      strokes[s].along = strokes[s - 1].along;
      for (std::size_t axis = 0; axis < 3; ++axis) strokes[s].turn[axis] = -strokes[s - 1].turn[axis];
    }
  }
  return strokes;
}

namespace {

// Of each edge that leaves the tissue by itself, so that a simpler case keeps those that it still has. Some are at the
// least and some at the greatest that there is; of some nothing is known.
std::vector<uint8_t> random_crossings(const Body& body, int32_t seed) {
  constexpr int kBetween = kGreatestCrossing - kLeastCrossing + 1;
  std::vector<uint8_t> crossings(6 * static_cast<std::size_t>(body.particle_count()), 0);
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    const auto particle = static_cast<int32_t>(k / 6);
    if (body.neighbour(particle, static_cast<int>(k % 6)) >= 0) continue;
    // splitmix64 of what names the edge; a generator for each of them would take longer than the rest of a small case.
    uint64_t z = static_cast<uint64_t>(seed);
    const Vec3 place = body.rest_position(particle) / body.grid.spacing;
    for (int axis = 0; axis < 3; ++axis) z = z * 1'048'583 + static_cast<uint64_t>(std::llround(place[axis]));
    z = (6 * z + k % 6) * 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    z ^= z >> 31;
    const int kind = static_cast<int>(z % 5);
    const int anywhere = kLeastCrossing + static_cast<int>(z / 5 % kBetween);
    crossings[k] = static_cast<uint8_t>(kind == 0   ? 0
                                        : kind == 1 ? kLeastCrossing
                                        : kind == 2 ? kGreatestCrossing
                                                    : anywhere);
  }
  return crossings;
}

}  // namespace

Setup setup_of(const Case& c) {
  Setup setup;
  const double h = c.spacing;
  setup.body = fixtures::body_from_nodes(c.nodes, h);
  if (c.surface != 0) setup.body.surface_crossing = random_crossings(setup.body, c.surface);
  setup.step.substeps = c.moves ? c.substeps : c.together;
  setup.step.iterations = c.moves ? c.iterations : 0;
  setup.step.stiffness = std::pow(10.0, c.stiffness);
  setup.detect.criterion = c.moves ? Criterion::distance : Criterion::geometric;
  setup.skin.alpha = c.alpha / 10.0;
  setup.skin.fit_cuts = c.surface != 0;
  setup.split.debris = c.debris;
  setup.merge.rule = c.merge;
  setup.expand = {c.expand, c.expand_depth};

  setup.has_blade = true;
  setup.blade = {c.blade_length * h / 4, c.blade_depth * h / 4, c.blade_thickness * h / 4, 0};
  // Node (0, 0, 0) of the case rests one spacing from the grid's lowest node, behind the ring of empty ones.
  const Vec3 first_node = {h, h, h};
  if (c.moves) add_dynamics(c, first_node, setup);
  add_schedule(c, first_node, setup);
  if (c.moves) add_grips(c, setup);
  return setup;
}

Instance instance_of(const Case& c) {
  Instance loaded = {setup_of(c), {}};
  const Setup& setup = loaded.setup;
  if (c.clusters == ClusterKind::foreign) {
    loaded.state = fixtures::foreign_state(setup.body, connected_cover(setup.body, c.most, c.seed), c.tau, c.cap);
  } else {
    ClusterSpec spec;
    spec.method = c.clusters == ClusterKind::boxes ? Cooking::boxes : Cooking::sampled;
    spec.side = c.side;
    spec.spacing = c.seed_spacing / 4.0;
    spec.radius = c.ball_radius / 4.0;
    loaded.state = fixtures::cook(setup.body, spec, setup.expand, setup.merge, c.seed);
  }
  tell_apart(loaded.state.clusters);
  return loaded;
}

// --- Simpler cases ------------------------------------------------------------------------------------------------

namespace {

using Edits = std::vector<std::function<void(Case&)>>;

// Without a run of elements: all, halves, quarters, … down to single ones. About 2n edits of n elements.
template <typename T>
void drop_chunks(std::size_t count, std::vector<T> Case::*list, Edits& edits) {
  for (std::size_t length = count; length > 0; length = length == 1 ? 0 : (length + 1) / 2) {
    for (std::size_t begin = 0; begin < count; begin += length) {
      edits.push_back([list, begin, end = std::min(begin + length, count)](Case& c) {
        auto& elements = c.*list;
        elements.erase(elements.begin() + static_cast<std::ptrdiff_t>(begin),
                       elements.begin() + static_cast<std::ptrdiff_t>(end));
      });
    }
  }
}

// Without what lies on one side of a plane of the grid.
void drop_slabs(const std::vector<Node>& nodes, Edits& edits) {
  for (std::size_t axis = 0; axis < 3 && !nodes.empty(); ++axis) {
    const auto [low, high] = extent(nodes, axis);
    for (const int32_t plane : {(low + high + 1) / 2, low + 1, high}) {
      for (const bool keep_lower : {true, false}) {
        edits.push_back([axis, plane, keep_lower](Case& c) {
          std::erase_if(c.nodes, [&](const Node& node) { return (node[axis] < plane) != keep_lower; });
        });
      }
    }
  }
}

// Body, strokes, walls and grips to the origin.
void shift(const std::vector<Node>& nodes, Edits& edits) {
  for (std::size_t axis = 0; axis < 3 && !nodes.empty(); ++axis) {
    edits.push_back([axis, low = extent(nodes, axis).first](Case& c) {
      for (Node& node : c.nodes) node[axis] -= low;
      for (CaseGrip& grip : c.grips) {
        grip.low[axis] -= low;
        grip.high[axis] -= low;
      }
      for (CaseWall& wall : c.walls) {
        if (at(wall.axis) == axis) wall.offset -= 4 * low;
      }
      for (Stroke& stroke : c.strokes) {
        stroke.from[axis] -= 4 * low;
        stroke.to[axis] -= 4 * low;
      }
    });
  }
}

// To the value wanted, and halfway there.
template <typename T>
void towards(const Case& from, T Case::*field, T wanted, Edits& edits) {
  edits.push_back([field, wanted](Case& c) { c.*field = wanted; });
  if constexpr (std::is_same_v<T, int32_t>) {
    const int32_t halfway = wanted + (from.*field - wanted) / 2;
    edits.push_back([field, halfway](Case& c) { c.*field = halfway; });
  }
}

void simplify_stroke(const Case& from, std::size_t k, Edits& edits) {
  edits.push_back([k](Case& c) { c.strokes[k].down = true; });
  for (Quarters Stroke::*vector : {&Stroke::turn, &Stroke::tilt, &Stroke::along}) {
    edits.push_back([=](Case& c) { c.strokes[k].*vector = {0, 0, 0}; });
    for (std::size_t axis = 0; axis < 3; ++axis) {
      edits.push_back([=](Case& c) { (c.strokes[k].*vector)[axis] = 0; });
      edits.push_back([=](Case& c) { (c.strokes[k].*vector)[axis] /= 2; });
    }
  }
  edits.push_back([k](Case& c) {
    c.strokes[k] = resolved_strokes(c)[k];
    c.strokes[k].link = Link::apart;
  });
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (Quarters Stroke::*end : {&Stroke::from, &Stroke::to}) {
      const int32_t value = (from.strokes[k].*end)[axis];  // division rounds towards zero: each step is a shorter one
      for (const int32_t simpler : {0, value / 2, 4 * (value / 4), 2 * (value / 2)}) {
        edits.push_back([=](Case& c) { (c.strokes[k].*end)[axis] = simpler; });
      }
    }
  }
}

void simplify_grip(std::size_t k, Edits& edits) {
  edits.push_back([k](Case& c) { c.grips[k].pull = {0, 0, 0}; });
  edits.push_back([k](Case& c) { c.grips[k].from = 0; });
  edits.push_back([k](Case& c) { c.grips[k].until = -1; });
  edits.push_back([k](Case& c) { c.grips[k].high = c.grips[k].low; });
  edits.push_back([k](Case& c) { c.grips[k].shared = false; });
}

}  // namespace

std::vector<std::function<void(Case&)>> simplifications(const Case& c) {
  Edits edits;
  drop_chunks(c.strokes.size(), &Case::strokes, edits);
  drop_slabs(c.nodes, edits);
  drop_chunks(c.nodes.size(), &Case::nodes, edits);

  drop_chunks(c.walls.size(), &Case::walls, edits);
  drop_chunks(c.grips.size(), &Case::grips, edits);

  towards(c, &Case::moves, false, edits);
  towards(c, &Case::ground, false, edits);
  towards(c, &Case::gravity, {0, 0, 0}, edits);
  towards(c, &Case::removal, Removal::usual, edits);
  towards(c, &Case::remove, RemovedEnds::both, edits);
  towards(c, &Case::strain, 120, edits);
  towards(c, &Case::epsilon, 15, edits);
  towards(c, &Case::solver, Solver::implicit, edits);
  towards(c, &Case::relaxation, 5, edits);
  towards(c, &Case::damping, 0, edits);
  towards(c, &Case::retardation, 0, edits);
  towards(c, &Case::time_step, 1000, edits);
  towards(c, &Case::pace, 1, edits);
  towards(c, &Case::blade_friction, 0, edits);
  towards(c, &Case::alpha, 5, edits);
  towards(c, &Case::surface, 0, edits);
  towards(c, &Case::acceleration, Acceleration::none, edits);
  towards(c, &Case::together, 1, edits);
  towards(c, &Case::substeps, 1, edits);
  towards(c, &Case::iterations, 1, edits);
  towards(c, &Case::stiffness, 5, edits);
  towards(c, &Case::clusters, ClusterKind::boxes, edits);
  if (c.clusters == ClusterKind::foreign) towards(c, &Case::clusters, ClusterKind::sampled, edits);
  towards(c, &Case::merge, MergeRule::none, edits);
  towards(c, &Case::expand, ExpandRule::none, edits);
  towards(c, &Case::spacing, 1.0, edits);
  towards(c, &Case::seed, uint64_t{1}, edits);
  towards(c, &Case::expand_depth, 1, edits);
  towards(c, &Case::debris, 0, edits);
  towards(c, &Case::blade_thickness, 4, edits);
  towards(c, &Case::blade_length, 400, edits);
  towards(c, &Case::blade_depth, 400, edits);
  towards(c, &Case::side, 1, edits);
  towards(c, &Case::most, 1, edits);
  towards(c, &Case::tau, 0, edits);
  towards(c, &Case::cap, 1, edits);
  for (std::size_t k = 0; k < c.strokes.size(); ++k) simplify_stroke(c, k, edits);
  for (std::size_t k = 0; k < c.walls.size(); ++k) {
    edits.push_back([k](Case& simpler) { simpler.walls[k].friction = 0; });
  }
  for (std::size_t k = 0; k < c.grips.size(); ++k) simplify_grip(k, edits);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    edits.push_back([axis](Case& simpler) { simpler.gravity[axis] = 0; });
    edits.push_back([axis](Case& simpler) { simpler.gravity[axis] /= 2; });
  }
  shift(c.nodes, edits);
  return edits;
}

Case simplest(Case c, const std::function<bool(const Case&)>& fails, const std::function<bool()>& is_over) {
  for (bool found = true; found && !is_over();) {
    found = false;
    for (const auto& edit : simplifications(c)) {
      if (is_over()) break;
      Case simpler = c;
      edit(simpler);
      if (simpler == c || !fails(simpler)) continue;
      c = std::move(simpler);
      found = true;
      break;
    }
  }
  return c;
}

// --- JSON ---------------------------------------------------------------------------------------------------------

NLOHMANN_JSON_SERIALIZE_ENUM(ClusterKind, {{ClusterKind::boxes, "boxes"},
                                           {ClusterKind::sampled, "sampled"},
                                           {ClusterKind::foreign, "foreign"}})
NLOHMANN_JSON_SERIALIZE_ENUM(Link, {{Link::apart, "apart"}, {Link::chained, "chained"}, {Link::retraced, "retraced"}})
NLOHMANN_JSON_SERIALIZE_ENUM(Removal, {{Removal::usual, "usual"},
                                       {Removal::geometric, "geometric"},
                                       {Removal::strain, "strain"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CaseWall, axis, side, offset, friction)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CaseGrip, low, high, pull, from, until, shared)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Stroke, from, to, back, down, link, tilt, along, turn)

}  // namespace cutproof::property_tests

// By their names in model/rules.h; what has none is read as the first of them.
namespace cutproof {
template <NamedChoice E>
void to_json(nlohmann::json& json, E choice) {
  json = name_of(choice);
}
template <NamedChoice E>
void from_json(const nlohmann::json& json, E& choice) {
  choice = choice_named<E>(json.get<std::string>()).value_or(E{});
}
}  // namespace cutproof

namespace cutproof::property_tests {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Case, nodes, spacing, clusters, side, seed_spacing, ball_radius, most, tau, cap,
                                   seed, merge, expand, expand_depth, debris, blade_length, blade_depth,
                                   blade_thickness, strokes, together, moves, substeps, iterations, stiffness,
                                   acceleration, ground, alpha, surface, removal, remove, epsilon, strain, solver,
                                   relaxation, damping, retardation, time_step, pace, blade_friction, gravity, walls,
                                   grips)

std::string to_json(const Case& c) { return nlohmann::json(c).dump(); }

namespace {

// Nodes of the grid in the box around them, each axis of which is within 2^20: the product fits.
int64_t cells_around(const std::vector<Node>& nodes) {
  int64_t cells = 1;
  for (std::size_t axis = 0; axis < 3 && !nodes.empty(); ++axis) {
    const auto [low, high] = std::minmax_element(nodes.begin(), nodes.end(),
                                                 [&](const Node& a, const Node& b) { return a[axis] < b[axis]; });
    cells *= int64_t{(*high)[axis]} - (*low)[axis] + 1;
  }
  return cells;
}

// Throws std::invalid_argument for numbers that no case can have.
void require_sane(const Case& c) {
  const auto require = [](bool holds, const char* field, const char* what) {
    if (!holds) throw std::invalid_argument(std::string(field) + " must be " + what);
  };
  constexpr int32_t kFarthest = 1 << 20;  // [quarters]; a grid beyond that fits no memory
  const auto is_near = [](const std::array<int32_t, 3>& p, int32_t low) {
    return std::all_of(p.begin(), p.end(), [&](int32_t q) { return q >= low && q <= kFarthest; });
  };
  require(std::is_sorted(c.nodes.begin(), c.nodes.end()) &&
              std::adjacent_find(c.nodes.begin(), c.nodes.end()) == c.nodes.end() &&
              std::all_of(c.nodes.begin(), c.nodes.end(), [&](const Node& n) { return is_near(n, 0); }),
          "nodes", "ascending, without duplicates, between 0 and 2^20");
  const auto require_few = [&](const auto& list, std::size_t most, const char* field) {
    require(list.size() <= most, field, (std::to_string(most) + " at most").c_str());
  };
  require_few(c.nodes, io::kMostCaseNodes, "nodes");
  require_few(c.strokes, io::kMostStrokes, "strokes");
  require_few(c.walls, io::kMostWalls, "walls");
  require_few(c.grips, io::kMostGrips, "grips");
  require(cells_around(c.nodes) <= io::kMostCaseCells, "nodes", "nearer to each other");
  require(c.spacing > 0 && c.spacing <= 1e6, "spacing", "in (0, 1e6]");
  require(c.side >= 1, "side", ">= 1");
  require(c.seed_spacing >= 1, "seed_spacing", ">= 1");
  require(c.ball_radius >= 1, "ball_radius", ">= 1");
  require(c.most >= 1, "most", ">= 1");
  require(c.tau >= 0 && c.cap >= 0, "tau and cap", ">= 0");
  require(c.expand_depth >= 1, "expand_depth", ">= 1");
  require(c.debris >= 0, "debris", ">= 0");
  require(c.blade_length > 0 && c.blade_depth > 0 && c.blade_thickness >= 0, "blade_…", "> 0 (thickness: >= 0)");
  require(c.together >= 1 && c.together <= 1000, "together", "in [1, 1000]");
  require(c.substeps >= 1 && c.substeps <= 1000, "substeps", "in [1, 1000]");
  require(c.iterations >= 0 && c.iterations <= 1000, "iterations", "in [0, 1000]");
  require(c.stiffness >= 0 && c.stiffness <= 12, "stiffness", "in [0, 12]");
  const auto is_within = [](const std::array<int32_t, 3>& v, int32_t most) {
    return std::all_of(v.begin(), v.end(), [&](int32_t q) { return -most <= q && q <= most; });
  };
  for (const Stroke& stroke : c.strokes) {
    require(stroke.back >= 0 && stroke.back < 6, "strokes.back", "in [0, 5]");
    require(is_near(stroke.from, -kFarthest) && is_near(stroke.to, -kFarthest), "strokes", "within 2^20 of the origin");
    require(is_within(stroke.tilt, 3), "strokes.tilt", "within -3 .. 3");
    require(is_within(stroke.along, 1000), "strokes.along", "within -1000 .. 1000");
    // Less than half a turn, so that a blade that takes one substep turns the way that was meant.
    require(is_within(stroke.turn, 180), "strokes.turn", "within -180 .. 180");
  }
  require(c.alpha >= 1 && c.alpha <= 9, "alpha", "in [1, 9]");
  require(c.surface >= 0, "surface", ">= 0");
  require(c.epsilon >= 1 && c.epsilon <= 1000, "epsilon", "in [1, 1000]");
  require(c.strain >= 1 && c.strain <= 100'000, "strain", "in [1, 100000]");
  require(c.relaxation >= 1 && c.relaxation <= 10, "relaxation", "in [1, 10]");
  require(c.damping >= 0 && c.damping <= 100'000, "damping", "in [0, 100000]");
  require(c.retardation >= 0 && c.retardation <= 10'000, "retardation", "in [0, 10000]");
  require(c.time_step >= 1 && c.time_step <= 1'000'000, "time_step", "in [1, 1000000]");
  require(c.pace >= 1 && c.pace <= 1000, "pace", "in [1, 1000]");
  require(c.blade_friction >= 0 && c.blade_friction <= 10'000, "blade_friction", "in [0, 10000]");
  require(is_within(c.gravity, 10'000), "gravity", "within -10000 .. 10000");
  for (const CaseWall& wall : c.walls) {
    require(wall.axis >= 0 && wall.axis < 3, "walls.axis", "0, 1 or 2");
    require(wall.side == 1 || wall.side == -1, "walls.side", "1 or -1");
    require(std::abs(int64_t{wall.offset}) <= 4 * int64_t{kFarthest}, "walls.offset", "within 2^22 of the origin");
    require(wall.friction >= 0 && wall.friction <= 10'000, "walls.friction", "in [0, 10000]");
  }
  for (const CaseGrip& grip : c.grips) {
    require(is_within(grip.low, kFarthest) && is_within(grip.high, kFarthest), "grips", "within 2^20 of the origin");
    require(is_within(grip.pull, 1000), "grips.pull", "within -1000 .. 1000");
    require(grip.from >= 0 && grip.until >= -1, "grips.from and until", ">= 0 (until: >= -1)");
  }
}

}  // namespace

Case from_json(const std::string& text) {
  try {
    const auto document = nlohmann::json::parse(text);
    const Case c = document.get<Case>();
    // What nlohmann reads without a word, such as a rule that does not exist, does not come back as it was.
    const nlohmann::json again = c;
    for (const auto& [key, value] : document.items()) {
      if (!again.contains(key)) throw std::invalid_argument("there is no field '" + key + "'");
      if (again[key] != value) throw std::invalid_argument(key + ": " + value.dump().substr(0, 60) + " is not known");
    }
    require_sane(c);
    return c;
  } catch (const nlohmann::json::exception& error) {
    throw std::invalid_argument(std::string("This is not a case of the property tests: ") + error.what());
  }
}

}  // namespace cutproof::property_tests
