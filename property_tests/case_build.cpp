// The input of a backend for a case.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "fixtures/blade_path.h"
#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "model/rules.h"
#include "property_tests/cases.h"
#include "property_tests/random.h"

namespace cutproof::property_tests {
namespace {

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

// The schedule (Setup): the strokes one after the other; in the rest of the last frame the blade is lifted.
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
  if (c.solver == Solver::implicit) setup.step.volume_share = c.volume_share / 100.0;
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

}  // namespace

void without_blade(Setup& setup) {
  setup.has_blade = false;
  setup.blade_moves.clear();
  setup.stroke_end.clear();
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
    spec.method = c.clusters == ClusterKind::boxes     ? Cooking::boxes
                  : c.clusters == ClusterKind::sampled ? Cooking::sampled
                                                       : Cooking::tiles;
    spec.side = c.side;
    spec.spacing = c.seed_spacing / 4.0;
    spec.radius = c.ball_radius / 4.0;
    loaded.state = fixtures::cook(setup.body, spec, setup.expand, setup.merge, c.seed);
  }
  tell_apart(loaded.state.clusters);
  return loaded;
}

}  // namespace cutproof::property_tests
