#include "oracles/relations/relations.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "oracles/comparison/reference_solution.h"
#include "oracles/relations/transformed_scene.h"
#include "oracles/shape_sums.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

constexpr Span kFrame{Stage::step, Stage::skin};
constexpr Span kStep{Stage::step, Stage::step};

Verdict fail(Verdict verdict, std::string text, std::vector<int32_t> particles = {},
             std::vector<int32_t> clusters = {}) {
  verdict.holds = false;
  verdict.witness.text = std::move(text);
  verdict.witness.particles = std::move(particles);
  verdict.witness.clusters = std::move(clusters);
  return verdict;
}

Verdict begin(const char* property, const Backend& backend, const State& state, const char* unit, const char* source) {
  Verdict verdict = start_verdict(property, state, unit, source);
  verdict.backend = backend.name();
  return verdict;
}

// What these oracles need to know of a state before they run it.
std::optional<Verdict> unfit(Verdict verdict, const Setup& setup, const State& state) {
  const Verdict form = well_formed(setup, state);
  if (!form.holds) return fail(std::move(verdict), "not judged: the state is not well formed: " + form.witness.text);
  return std::nullopt;
}

State after(Backend& backend, const Setup& setup, const State& state, const std::vector<Span>& spans) {
  backend.load({setup}, {state});
  for (const Span span : spans) backend.run(span);
  return backend.snapshot().at(0);
}

State after_frames(Backend& backend, const Setup& setup, const State& state, int64_t frames) {
  return after(backend, setup, state, std::vector<Span>(at(frames), kFrame));
}

// One step stage, on its own where the backend can do that.
State after_step(Backend& backend, const Setup& setup, const State& state) {
  return after(backend, setup, state, {backend.can_run(kStep) ? kStep : kFrame});
}

// --- Equal bits ----------------------------------------------------------------------------------------------------

struct Difference {
  std::string text;
  std::vector<int32_t> particles, clusters;
};

template <typename T>
std::optional<std::size_t> first_different(const std::vector<T>& a, const std::vector<T>& b) {
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (!same_bits(a[i], b[i])) return i;
  }
  if (a.size() != b.size()) return std::min(a.size(), b.size());
  return std::nullopt;
}

// In the order in which a fault would show first: decisions, clusters, positions, what follows from them.
std::optional<Difference> difference(const State& a, const State& b) {
  std::optional<Difference> found;
  const auto of_particle = [&](const char* what, const auto& in_a, const auto& in_b) {
    if (found) return;
    const auto i = first_different(in_a, in_b);
    if (i) found = Difference{fmt::format("{} of particle {} differs", what, *i), {static_cast<int32_t>(*i)}, {}};
  };
  const auto of_list = [&](const char* what, const auto& in_a, const auto& in_b) {
    if (found) return;
    const auto i = first_different(in_a, in_b);
    if (i) found = Difference{fmt::format("{} differ, first in entry {}", what, *i), {}, {}};
  };
  const auto of_cluster = [&](const char* what, const auto& in_a, const auto& in_b) {
    if (found) return;
    const auto c = first_different(in_a, in_b);
    if (!c) return;
    found = Difference{fmt::format("{} of the cluster in place {} differs", what, *c), {}, {}};
    if (*c < a.clusters.number.size()) found->clusters = {a.clusters.number[*c]};
  };
  const auto of_value = [&](const char* what, const auto& in_a, const auto& in_b) {
    if (!found && !same_bits(in_a, in_b)) found = Difference{fmt::format("{} differs", what), {}, {}};
  };
  of_value("the frame's index", a.frame, b.frame);
  of_particle("life", a.alive, b.alive);
  of_list("the removed particles", a.removed, b.removed);
  of_list("the particles removed as debris", a.debris, b.debris);
  of_particle("the position", a.x, b.x);
  of_particle("the velocity", a.v, b.v);
  of_list("the clusters' sizes", a.clusters.offsets, b.clusters.offsets);
  of_list("the clusters' members", a.clusters.members, b.clusters.members);
  of_cluster("the number", a.clusters.number, b.clusters.number);
  of_cluster("the rotation", a.clusters.rotation, b.clusters.rotation);
  of_cluster("the rest center", a.clusters.rest_center, b.clusters.rest_center);
  of_cluster("the mass", a.clusters.mass, b.clusters.mass);
  of_cluster("the flag for a rotation that is not unique", a.clusters.degenerate, b.clusters.degenerate);
  of_value("tau", a.tau, b.tau);
  of_value("cap", a.cap, b.cap);
  of_value("whether every edge is covered", a.edge_covered, b.edge_covered);
  of_value("the impulse", a.impulse, b.impulse);
  of_list("the skin's owners", a.skin.owner, b.skin.owner);
  of_list("the skin's directions", a.skin.direction, b.skin.direction);
  of_list("the skin's positions", a.skin.position, b.skin.position);
  of_list("the skin's triangles", a.skin.triangles, b.skin.triangles);
  return found;
}

Verdict fail_on(Verdict verdict, const std::string& where, const Difference& difference) {
  verdict.measured = 1;
  return fail(std::move(verdict), where + ": " + difference.text, difference.particles, difference.clusters);
}

// --- Rounding of one substep (docs/tolerances.md, "One substep") -----------------------------------------------------

// By how much a cluster's rotation amplifies an error of positions: Σ w |X − T| r / (σ2 + σ3) at rest, r the greatest
// distance from the center. Of a collinear cluster the rotation moves no particle.
double greatest_amplification(const Body& body, const Clusters& clusters, const std::vector<int32_t>& counts,
                              const std::vector<Vec3>& rest) {
  double greatest = 0;
  const WeightedRest weighted = weighted_rest(body, counts);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const ClusterMeans means = cluster_means(weighted, clusters, rest, c);
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    double moment = 0, radius = 0;
    for (const int32_t i : clusters.of(c)) {
      const Vec3 d = rest[at(i)] - means.rest;
      const double w = weighted.weight[at(i)];
      a += w * Eigen::Vector3d(d.x, d.y, d.z) * Eigen::RowVector3d(d.x, d.y, d.z);
      moment += w * norm(d);
      radius = std::max(radius, norm(d));
    }
    const Eigen::Vector3d sigma = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(a).eigenvalues();
    constexpr double kCollinear = 1e-12;
    const double gap = sigma[0] + sigma[1];  // ascending: the two smaller ones
    if (gap > kCollinear * sigma[2]) greatest = std::max(greatest, moment * radius / gap);
  }
  return greatest;
}

std::vector<Vec3> rest_positions(const Body& body) {
  std::vector<Vec3> rest;
  for (int32_t i = 0; i < body.particle_count(); ++i) rest.push_back(body.rest_position(i));
  return rest;
}

// How far rounding can carry a particle in one substep near the rest state [m].
double substep_rounding(const Setup& setup, const State& state) {
  const Body& body = setup.body;
  double mass = 0, lightest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < body.mass.size(); ++i) {
    if (!state.alive[i]) continue;
    mass += body.mass[i];
    lightest = std::min(lightest, body.mass[i]);
  }
  if (mass == 0) return 0;
  const std::vector<int32_t> counts = membership_counts(state.clusters, body.particle_count());
  const double amplification = greatest_amplification(body, state.clusters, counts, rest_positions(body));
  const RoundingScale scale = rounding_scale(setup, state);
  return setup.step.iterations * error_growth(setup.step) * std::sqrt(mass / lightest) * (1 + amplification) *
             goal_rounding(scale) +
         8 * scale.unit_roundoff * scale.extent;
}

// --- Scenes made from others -----------------------------------------------------------------------------------------

// Nothing acts from outside: no blade, walls, grips; nothing is removed.
Setup undisturbed(Setup setup) {
  setup.has_blade = false;
  setup.blade_moves.clear();
  setup.walls.clear();
  setup.grips.clear();
  setup.detect.criterion = Criterion::none;
  setup.skin.wanted = false;
  return setup;
}

// The same tissue and clusters, at rest.
State at_rest(const Setup& setup, const State& state) {
  State rest = state;
  rest.frame = 0;
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (state.alive[at(i)]) rest.x[at(i)] = setup.body.rest_position(i);
    rest.v[at(i)] = {};
  }
  rest.removed.clear();
  rest.debris.clear();
  rest.clusters.rotation.assign(at(state.clusters.count()), Mat3{});
  rest.impulse = {};
  rest.skin = {};
  return rest;
}

double greatest_distance(const State& state, const std::vector<Vec3>& expected, int32_t& where) {
  double greatest = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (!state.alive[i]) continue;
    const double distance = norm(state.x[i] - expected[i]);
    if (distance <= greatest) continue;
    where = static_cast<int32_t>(i);
    if (!std::isfinite(distance)) return distance;
    greatest = distance;
  }
  return greatest;
}

// --- Equivariance
// ------------------------------------------------------------------------------------------------------

uint64_t mixed(uint64_t& seed) {  // splitmix64 (Steele, Lea and Flood 2014)
  uint64_t z = (seed += 0x9E3779B97F4A7C15u);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

std::vector<int32_t> shuffled(int32_t count, uint64_t& seed) {
  std::vector<int32_t> order(at(count));
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[mixed(seed) % i]);
  return order;
}

int determinant_sign(const Motion& m) {
  const bool even = (m.target[0] + 1) % 3 == m.target[1];  // cyclic
  return (even ? 1 : -1) * m.sign[0] * m.sign[1] * m.sign[2];
}

// One of the 23 turns by quarter turns that are not the identity.
Motion random_turn(uint64_t& seed) {
  for (;;) {
    Motion motion;
    const auto order = shuffled(3, seed);
    for (std::size_t a = 0; a < 3; ++a) {
      motion.target[a] = order[a];
      motion.sign[a] = mixed(seed) % 2 == 0 ? 1 : -1;
    }
    const bool identity = motion.target == std::array{0, 1, 2} && motion.sign == std::array{1, 1, 1};
    if (determinant_sign(motion) > 0 && !identity) return motion;
  }
}

std::string text_of(const Motion& motion) {
  std::string text;
  for (std::size_t a = 0; a < 3; ++a) {
    text += fmt::format("{}{} -> {}{}", a == 0 ? "" : ", ", "xyz"[a], motion.sign[a] < 0 ? "-" : "+",
                        "xyz"[motion.target[a]]);
  }
  return text;
}

// The span in pieces, so that what merging and expansion may decide differently is judged where it happens.
std::vector<Span> pieces_of(const Backend& backend, Span span) {
  std::vector<Span> pieces;
  const auto add = [&](Stage first, Stage last) {
    first = std::max(first, span.first);
    last = std::min(last, span.last);
    if (first <= last) pieces.push_back({first, last});
  };
  add(Stage::step, Stage::split);
  add(Stage::merge, Stage::merge);
  add(Stage::expand, Stage::expand);
  add(Stage::skin, Stage::skin);
  for (const Span piece : pieces) {
    if (!backend.can_run(piece)) return {span};
  }
  return pieces;
}

std::vector<State> after_each(Backend& backend, const Setup& setup, const State& state,
                              const std::vector<Span>& pieces) {
  std::vector<State> states;
  backend.load({setup}, {state});
  for (const Span piece : pieces) {
    backend.run(piece);
    states.push_back(backend.snapshot().at(0));
  }
  return states;
}

struct Tolerance {
  double position = 0;  // [m], also of velocities times dt and of what a rotation does to a member
  double skin = 0;      // [m]
  double velocity = 0;  // [m/s]
  double impulse = 0;   // [kg m/s]
  double rest = 0;      // [m], rest centers; relative for masses times the extent
};

std::vector<int32_t> members_of(const Clusters& clusters, int32_t c) {
  const auto members = clusters.of(c);
  return {members.begin(), members.end()};
}

// Several clusters may have the same members: what is left of two after a cut.
std::multimap<std::vector<int32_t>, int32_t> places_by_members(const Clusters& clusters) {
  std::multimap<std::vector<int32_t>, int32_t> places;
  for (int32_t c = 0; c < clusters.count(); ++c) places.emplace(members_of(clusters, c), c);
  return places;
}

// Equal as families of sets.
bool same_families(const Clusters& a, const Clusters& b) {
  const auto sorted_lists = [](const Clusters& clusters) {
    std::vector<std::vector<int32_t>> lists;
    for (int32_t c = 0; c < clusters.count(); ++c) lists.push_back(members_of(clusters, c));
    std::sort(lists.begin(), lists.end());
    return lists;
  };
  return sorted_lists(a) == sorted_lists(b);
}

std::vector<int32_t> decided_differently(const State& a, const State& b) {
  std::vector<int32_t> particles;
  for (std::size_t i = 0; i < a.alive.size(); ++i) {
    if (a.alive[i] != b.alive[i]) particles.push_back(static_cast<int32_t>(i));
  }
  return particles;
}

struct Measured {
  double ratio = 0, distance = 0, bound = 0;  // the worst of all comparisons, by distance / bound
  Difference difference;
  int64_t checked = 0;
  void compare(double value, double limit, const char* what, std::vector<int32_t> particles,
               std::vector<int32_t> clusters = {}) {
    ++checked;
    if (value <= limit * ratio) return;
    ratio = limit > 0 && !std::isnan(value) ? value / limit : std::numeric_limits<double>::infinity();
    distance = value;
    bound = limit;
    difference = {fmt::format("{} differs by {}, more than {}", what, value, limit), std::move(particles),
                  std::move(clusters)};
  }
};

// Where two rotations put the members of a cluster and the skin's vertices next to them: the greatest distance [m], and
// of which member. (A single particle has no offset, but its skin turns.)
std::pair<double, int32_t> rotation_distance(const Body& body, const Clusters& clusters, int32_t c, const Mat3& other) {
  const Mat3& rotation = clusters.rotation[at(c)];
  double turned = 0;
  for (std::size_t entry = 0; entry < 9; ++entry) turned = std::hypot(turned, rotation.m[entry] - other.m[entry]);
  std::pair<double, int32_t> greatest = {turned * body.grid.spacing, clusters.of(c).front()};
  for (const int32_t i : clusters.of(c)) {
    const Vec3 offset = body.rest_position(i) - clusters.rest_center[at(c)];
    const double distance = norm(rotation * offset - other * offset);
    if (!(distance <= greatest.first)) greatest = {distance, i};
  }
  return greatest;
}

// Motion and impulse in two states with the same particles alive.
void compare_motion(const State& expected, const State& actual, const Tolerance& tolerance, Measured& measured) {
  for (std::size_t i = 0; i < expected.x.size(); ++i) {
    const std::vector<int32_t> particle = {static_cast<int32_t>(i)};
    measured.compare(norm(expected.x[i] - actual.x[i]), tolerance.position, "a position [m]", particle);
    measured.compare(norm(expected.v[i] - actual.v[i]), tolerance.velocity, "a velocity [m/s]", particle);
  }
  measured.compare(norm(expected.impulse - actual.impulse), tolerance.impulse, "the impulse [kg m/s]", {});
}

// How far the rotation of cluster c puts a member from where that of the like cluster does [m], and which member.
template <typename Places>
std::pair<double, int32_t> nearest_rotation(const Body& body, const Clusters& expected, const Places& places,
                                            const Clusters& actual, int32_t c) {
  std::pair<double, int32_t> nearest = {std::numeric_limits<double>::infinity(), -1};
  const auto [first, last] = places.equal_range(members_of(actual, c));
  for (auto like = first; like != last; ++like) {
    nearest = std::min(nearest, rotation_distance(body, actual, c, expected.rotation[at(like->second)]));
  }
  return nearest;
}

// Rest frames and rotations of two equal families. `free_rotation[i]`: clusters of nothing but such particles may have
// inherited another rotation.
void compare_clusters(const Setup& setup, const Clusters& expected, const Clusters& actual, const Tolerance& tolerance,
                      double extent, const std::vector<uint8_t>& free_rotation, Measured& measured) {
  const auto places = places_by_members(expected);
  for (int32_t c = 0; c < actual.count(); ++c) {
    const auto members = members_of(actual, c);
    const auto k = at(c), j = at(places.find(members)->second);
    const std::vector<int32_t> number = {actual.number[k]};
    measured.compare(norm(expected.rest_center[j] - actual.rest_center[k]), tolerance.rest, "a rest center [m]", {},
                     number);
    measured.compare(std::abs(expected.mass[j] - actual.mass[k]) * extent, tolerance.rest * expected.mass[j],
                     "a cluster's mass, times the extent [kg m],", {}, number);
    if (std::all_of(members.begin(), members.end(), [&](int32_t i) { return free_rotation[at(i)] != 0; })) continue;
    const auto [distance, member] = nearest_rotation(setup.body, expected, places, actual, c);
    measured.compare(distance, tolerance.position, "where a rotation puts a member [m]", {member}, number);
  }
}

// Merging chooses a target, whose rotation the union keeps; among equals it may choose either. Marks the particles of
// clusters whose rotation differs between the runs, if it is that of a part of them before the merge. Of several
// clusters with the same members it is not known which is which, so they count as different.
void mark_inherited_rotations(const Setup& setup, const Clusters& before, const Clusters& expected,
                              const Clusters& actual, double tolerance, std::vector<uint8_t>& free_rotation) {
  const auto places = places_by_members(expected);
  for (int32_t c = 0; c < actual.count(); ++c) {
    const auto members = actual.of(c);
    const bool alone = places.count(members_of(actual, c)) == 1;
    if (alone && nearest_rotation(setup.body, expected, places, actual, c).first <= tolerance) continue;
    for (int32_t b = 0; b < before.count(); ++b) {
      const auto part = before.of(b);
      if (!same_bits(before.rotation[at(b)], actual.rotation[at(c)])) continue;
      if (!std::includes(members.begin(), members.end(), part.begin(), part.end())) continue;
      for (const int32_t i : members) free_rotation[at(i)] = 1;
    }
  }
}

std::map<std::pair<int32_t, uint8_t>, Vec3> vertices_of(const Skin& skin) {
  std::map<std::pair<int32_t, uint8_t>, Vec3> vertices;
  for (std::size_t v = 0; v < skin.owner.size(); ++v) vertices[{skin.owner[v], skin.direction[v]}] = skin.position[v];
  return vertices;
}

// The same vertices; as many triangles and shells. Which fan a polygon gets depends on the numbering of grid edges, so
// triangles are not compared one by one.
std::optional<Difference> compare_skins(const Skin& expected, const Skin& actual,
                                        const std::vector<uint8_t>& free_rotation, const Tolerance& tolerance,
                                        Measured& measured) {
  const auto a = vertices_of(expected), b = vertices_of(actual);
  for (const auto& [key, position] : a) {
    const auto other = b.find(key);
    if (other == b.end()) {
      return Difference{
          fmt::format("the skin's vertex of particle {} in direction {} is missing", key.first, key.second),
          {key.first},
          {}};
    }
    if (free_rotation[at(key.first)]) continue;
    measured.compare(norm(position - other->second), tolerance.skin, "a vertex of the skin [m]", {key.first});
  }
  for (const auto& [key, position] : b) {
    if (a.count(key)) continue;
    return Difference{
        fmt::format("the skin has a vertex of particle {} in direction {} too many", key.first, key.second),
        {key.first},
        {}};
  }
  const ShellCount shells = skin_shells(expected), other = skin_shells(actual);
  if (shells.outer != other.outer || shells.inner != other.inner ||
      expected.triangles.size() != actual.triangles.size()) {
    return Difference{
        fmt::format("the skins have {} + {} and {} + {} shells and {} and {} triangles", shells.outer, shells.inner,
                    other.outer, other.inner, expected.triangles.size(), actual.triangles.size()),
        {},
        {}};
  }
  return std::nullopt;
}

// Relative size of the disturbances that show how sensitive a scene is: far above rounding, far below what tissue
// feels.
constexpr double kDisturbance = 1e-7;
constexpr double kCloserDisturbance = 1e-11;
constexpr int kCloserLooks = 8;
// The worst of all directions may grow more than the worst of eight random ones.
constexpr double kCloserFactor = 8;

State jittered(const Setup& setup, State state, double amplitude, uint64_t& seed) {
  const double step = amplitude * setup.body.grid.spacing;
  for (Vec3& x : state.x) {
    for (int axis = 0; axis < 3; ++axis) x[axis] += mixed(seed) % 2 == 0 ? step : -step;
  }
  return state;
}

// Criteria, blade and walls, relative to their size and to h.
Setup disturbed(Setup setup, double amount) {
  const double h = setup.body.grid.spacing;
  setup.detect.epsilon *= 1 + amount;
  setup.detect.strain *= 1 + amount;
  setup.blade.thickness = std::max(setup.blade.thickness, h) * (1 + amount);
  for (BladeMove& move : setup.blade_moves) {
    for (BladePose* pose : {&move.from, &move.to}) {
      pose->edge += amount * h * (cross(pose->along, pose->back) + pose->along + pose->back);
    }
  }
  return setup;
}

// Particles whose life depends on a disturbance of the input: decisions inside the rounding band among them.
std::vector<uint8_t> undecided(Backend& backend, const Setup& setup, const State& state, Span span, const State& result,
                               uint64_t seed) {
  std::vector<uint8_t> either(state.alive.size(), 0);
  const auto note = [&](const State& other) {
    for (const int32_t i : decided_differently(result, other)) either[at(i)] = 1;
  };
  note(after(backend, disturbed(setup, +kDisturbance), state, {span}));
  note(after(backend, disturbed(setup, -kDisturbance), state, {span}));
  note(after(backend, setup, jittered(setup, state, kDisturbance, seed), {span}));
  return either;
}

// Walls and the blade's whole path moved a little: where tissue stands in a corner of theirs, a disturbance of its own
// position is forgotten.
Setup moved_contacts(Setup setup, double amplitude, uint64_t& seed) {
  const double step = amplitude * setup.body.grid.spacing;
  const auto either = [&] { return mixed(seed) % 2 == 0 ? step : -step; };
  for (Wall& wall : setup.walls) wall.offset += either();
  Vec3 shift;
  for (int axis = 0; axis < 3; ++axis) shift[axis] = either();
  for (BladeMove& move : setup.blade_moves) {
    move.from.edge += shift;
    move.to.edge += shift;
  }
  return setup;
}

// How far a disturbance of positions and contacts by `amplitude` h has grown at the end of the span, relative to it: at
// least 1.
double sensitivity(Backend& backend, const Setup& setup, const State& state, Span span, const State& result,
                   double amplitude, uint64_t& seed) {
  const State other =
      after(backend, moved_contacts(setup, amplitude, seed), jittered(setup, state, amplitude, seed), {span});
  double greatest = 0;
  for (std::size_t i = 0; i < result.x.size(); ++i) {
    if (result.alive[i] && other.alive[i]) greatest = std::max(greatest, norm(result.x[i] - other.x[i]));
  }
  const auto vertices = vertices_of(result.skin);
  for (const auto& [key, position] : vertices_of(other.skin)) {
    const auto same = vertices.find(key);
    if (same != vertices.end()) greatest = std::max(greatest, norm(position - same->second));
  }
  if (result.clusters.offsets == other.clusters.offsets && result.clusters.members == other.clusters.members) {
    for (int32_t c = 0; c < result.clusters.count(); ++c) {
      const auto turned = rotation_distance(setup.body, result.clusters, c, other.clusters.rotation[at(c)]);
      greatest = std::max(greatest, turned.first);
    }
  }
  return std::max(1.0, greatest / (amplitude * setup.body.grid.spacing));
}

Verdict judge_exactly(Verdict verdict, const std::string& how, const State& expected, const State& actual) {
  verdict.unit = "1";
  verdict.checked += static_cast<int64_t>(expected.x.size());
  if (const auto found = difference(expected, actual)) return fail_on(std::move(verdict), how, *found);
  return verdict;
}

// A scene and the same one carried along, both run.
struct CarriedRuns {
  Backend& backend;
  const Setup& setup;
  const State& state;
  const Carrier& carrier;
  const State& carried_state;
  Span span;
  std::vector<Span> pieces;
  std::vector<State> original, carried;  // after each piece

  // What rounding may do to numbers, if disturbances of positions grow by `growth`.
  Tolerance tolerance(double growth) const {
    RoundingScale scale = rounding_scale(carrier.setup(), carried.back());
    const RoundingScale before = rounding_scale(carrier.setup(), carried_state);
    scale.extent = std::max(scale.extent, before.extent);
    scale.largest_cluster = std::max(scale.largest_cluster, before.largest_cluster);
    const double goal = goal_rounding(scale);
    Tolerance result;
    result.rest = result.skin = 2 * goal;
    if (!has_step()) return result;
    const double evaluations = static_cast<double>(setup.step.substeps) * (setup.step.iterations + 1.0);
    const double mass = std::accumulate(setup.body.mass.begin(), setup.body.mass.end(), 0.0);
    result.position = 4 * growth * error_growth(setup.step) * evaluations * goal;
    result.skin += 2 * result.position;
    result.velocity = 2 * result.position / setup.substep_length[at(state.frame)];
    result.impulse = setup.step.substeps * mass * result.velocity;
    return result;
  }
  bool has_step() const { return span.contains(Stage::step) && state.frame >= 0 && state.frame < setup.frame_count(); }
};

// The first particle (in the numbering of the original) that only one of the runs has removed, and that is not removed
// or kept by a hair; -1 if all are. `differ` says whether there are any.
int32_t wrongly_decided(const CarriedRuns& runs, std::size_t piece, uint64_t seed, bool& differ) {
  const State expected = runs.carrier.state(runs.original[piece]);
  const State& actual = runs.carried[piece];
  differ = !decided_differently(expected, actual).empty();
  if (!differ) return -1;
  const std::vector<uint8_t> either =
      undecided(runs.backend, runs.setup, runs.state, runs.span, runs.original.back(), seed);
  for (int32_t i = 0; i < runs.setup.body.particle_count(); ++i) {
    const auto j = at(runs.carrier.particle(i));
    if (expected.alive[j] != actual.alive[j] && !either[at(i)]) return i;
  }
  return -1;
}

// Clusters that differ are legal where merging or expansion met a tie: same coupling, and each stage within its rules.
std::optional<Difference> illegal_clusters(const CarriedRuns& runs, std::size_t piece) {
  const Setup& setup = runs.carrier.setup();
  const State& actual = runs.carried[piece];
  const State& input = piece == 0 ? runs.carried_state : runs.carried[piece - 1];
  const State expected = runs.carrier.state(runs.original[piece]);
  if (coupling_components(setup, expected).label != coupling_components(setup, actual).label) {
    return Difference{"the clusters couple the particles differently", {}, {}};
  }
  const Span span = runs.pieces[piece];
  std::optional<Verdict> legal;
  if (span == Span{Stage::merge, Stage::merge}) legal = merge_legality(setup, input, actual);
  if (span == Span{Stage::expand, Stage::expand}) legal = expansion(setup, input, actual);
  if (!legal || legal->holds) return std::nullopt;
  return Difference{legal->witness.text, legal->witness.particles, legal->witness.clusters};
}

// Both runs, piece by piece, up to rounding and ties. `numbers_only` tells whether a failure is one of numbers.
Verdict compare_runs(Verdict verdict, const std::string& how, const CarriedRuns& runs, const Tolerance& tolerance,
                     uint64_t seed, bool& numbers_only) {
  const Setup& setup = runs.carrier.setup();
  numbers_only = false;
  verdict.bound = 1;
  verdict.unit = "of the bound";
  bool families_agree = true;
  std::vector<uint8_t> free_rotation(runs.state.alive.size(), 0);
  for (std::size_t p = 0; p < runs.pieces.size(); ++p) {
    const Span piece = runs.pieces[p];
    const State expected = runs.carrier.state(runs.original[p]);
    const State& actual = runs.carried[p];
    const std::string where = fmt::format("{}, after {}", how, name_of(piece.last));

    bool differ = false;
    if (const int32_t i = wrongly_decided(runs, p, seed, differ); i >= 0) {
      return fail(std::move(verdict),
                  fmt::format("{}: particle {} is {} here and not in the other run", where, i,
                              runs.original[p].alive[at(i)] ? "alive" : "dead"),
                  {i});
    }
    if (differ) {  // either: removals inside the rounding band
      verdict.checked = 0;
      return verdict;
    }
    if (expected.removed != actual.removed || expected.debris != actual.debris || expected.frame != actual.frame ||
        expected.tau != actual.tau || expected.cap != actual.cap || expected.edge_covered != actual.edge_covered) {
      return fail(std::move(verdict),
                  where + ": the lists of removed particles, or frame, tau, cap or edge cover differ");
    }

    const bool may_tie = piece.contains(Stage::merge) || piece.contains(Stage::expand) || !families_agree;
    families_agree = same_families(expected.clusters, actual.clusters);
    if (!families_agree) {
      if (!may_tie) return fail(std::move(verdict), where + ": the clusters differ");
      if (const auto found = illegal_clusters(runs, p)) return fail_on(std::move(verdict), where, *found);
      free_rotation.assign(free_rotation.size(), 1);
    } else if (piece.contains(Stage::merge)) {
      const State& input = p == 0 ? runs.carried_state : runs.carried[p - 1];
      mark_inherited_rotations(setup, input.clusters, expected.clusters, actual.clusters, tolerance.position,
                               free_rotation);
    }

    Measured measured;
    compare_motion(expected, actual, tolerance, measured);
    if (families_agree) {
      compare_clusters(setup, expected.clusters, actual.clusters, tolerance, rounding_scale(setup, actual).extent,
                       free_rotation, measured);
    }
    if (piece.contains(Stage::skin)) {
      const auto found = compare_skins(expected.skin, actual.skin, free_rotation, tolerance, measured);
      if (found) return fail_on(std::move(verdict), where, *found);
    }
    verdict.checked += measured.checked;
    verdict.measured = std::max(verdict.measured, measured.ratio);
    if (measured.ratio > 1) {
      numbers_only = true;
      return fail(std::move(verdict), where + ": " + measured.difference.text, measured.difference.particles,
                  measured.difference.clusters);
    }
  }
  return verdict;
}

Verdict judge_carried(const Verdict& verdict, const std::string& how, Backend& backend, const Setup& setup,
                      const State& state, const Carrier& carrier, const State& carried_state, Span span,
                      uint64_t seed) {
  CarriedRuns runs{backend, setup, state, carrier, carried_state, span, pieces_of(backend, span), {}, {}};
  runs.original = after_each(backend, setup, state, runs.pieces);
  runs.carried = after_each(backend, carrier.setup(), carried_state, runs.pieces);
  const State& result = runs.original.back();
  double growth = runs.has_step() ? sensitivity(backend, setup, state, span, result, kDisturbance, seed) : 1;
  bool numbers_only = false;
  const Verdict first = compare_runs(verdict, how, runs, runs.tolerance(growth), seed, numbers_only);
  if (first.holds || !numbers_only || !runs.has_step()) return first;
  // A jump (a contact that lets go or not) hides below a disturbance that is larger than it. Look closer.
  for (int round = 0; round < kCloserLooks; ++round) {
    growth = std::max(growth, sensitivity(backend, setup, state, span, result, kCloserDisturbance, seed));
  }
  return compare_runs(verdict, how, runs, runs.tolerance(kCloserFactor * growth), seed, numbers_only);
}

}  // namespace

Setup single_substep_setup(const Setup& setup, int64_t frame) {
  const auto first = at(frame * setup.step.substeps);
  Setup single = setup;
  single.step.substeps = 1;
  single.substep_length = {setup.substep_length[at(frame)]};
  single.stroke_end.clear();
  if (!setup.blade_moves.empty()) single.blade_moves = {setup.blade_moves[first]};
  for (Grip& grip : single.grips) {
    grip.active = {grip.active[first]};
    grip.displacement = {grip.displacement[first]};
  }
  return single;
}

Verdict no_ghost_force(Backend& backend, const Setup& setup, const State& state, int32_t particle, Vec3 kick,
                       int64_t frames) {
  Verdict verdict = begin("no ghost force", backend, state, "1", "oracles_and_tests.md §1: the same bits");
  if (auto unjudged = unfit(verdict, setup, state)) return *unjudged;
  if (particle < 0 || particle >= setup.body.particle_count() || !state.alive[at(particle)]) return verdict;
  if (state.frame >= setup.frame_count()) return verdict;
  const Partition partition = graph_components(setup, state);
  const int32_t kicked = partition.label[at(particle)];
  const double dt = setup.substep_length[at(state.frame)];
  State disturbed_state = state;
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    if (partition.label[i] != kicked) continue;
    disturbed_state.x[i] += kick;
    disturbed_state.v[i] += kick / dt;
  }
  const State quiet = after_frames(backend, setup, state, frames);
  const State moved = after_frames(backend, setup, disturbed_state, frames);
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    if (!state.alive[i] || partition.label[i] == kicked) continue;
    ++verdict.checked;
    const bool same =
        same_bits(quiet.x[i], moved.x[i]) && same_bits(quiet.v[i], moved.v[i]) && quiet.alive[i] == moved.alive[i];
    if (same) continue;
    verdict.measured += 1;
    if (!verdict.holds) continue;
    verdict =
        fail(std::move(verdict),
             fmt::format("particle {} ends {} m elsewhere because the component of particle {}, to which it is not "
                         "connected, was kicked",
                         i, norm(quiet.x[i] - moved.x[i]), particle),
             {particle, static_cast<int32_t>(i)});
  }
  return verdict;
}

Verdict determinism(Backend& backend, const Setup& setup, const State& state, int64_t frames) {
  Verdict verdict = begin("determinism", backend, state, "1", "oracles_and_tests.md §1: the same bits");
  std::vector<State> first;
  backend.load({setup}, {state});
  for (int64_t f = 0; f < frames; ++f) {
    backend.run(kFrame);
    first.push_back(backend.snapshot().at(0));
  }
  backend.load({setup}, {state});
  for (const State& expected : first) {
    backend.run(kFrame);
    ++verdict.checked;
    if (const auto found = difference(expected, backend.snapshot().at(0))) {
      return fail_on(std::move(verdict), fmt::format("the second run, at the end of frame {}", expected.frame - 1),
                     *found);
    }
  }
  return verdict;
}

Verdict span_composition(Backend& backend, const Setup& setup, const State& state, int64_t frames) {
  Verdict verdict = begin("span composition", backend, state, "1", "architecture.md, Contract: bit for bit");
  std::vector<std::vector<Span>> ways(1);
  for (const Stage stage : kStages) ways[0].push_back({stage, stage});
  for (std::size_t cut = 1; cut < kStages.size(); ++cut) {
    ways.push_back({{Stage::step, kStages[cut - 1]}, {kStages[cut], Stage::skin}});
  }
  std::vector<State> whole;
  backend.load({setup}, {state});
  for (int64_t f = 0; f < frames; ++f) {
    backend.run(kFrame);
    whole.push_back(backend.snapshot().at(0));
  }
  for (const auto& way : ways) {
    if (!std::all_of(way.begin(), way.end(), [&](Span span) { return backend.can_run(span); })) continue;
    backend.load({setup}, {state});
    for (const State& expected : whole) {
      for (const Span span : way) backend.run(span);
      ++verdict.checked;
      const auto found = difference(expected, backend.snapshot().at(0));
      if (!found) continue;
      std::string text = "the frame in spans";
      for (const Span span : way) text += fmt::format(" {}-{}", name_of(span.first), name_of(span.last));
      return fail_on(std::move(verdict), text, *found);
    }
  }
  return verdict;
}

Verdict equivariance(Backend& backend, const Setup& setup, const State& state, Span span, uint64_t seed) {
  Verdict verdict = begin("equivariance", backend, state, "1", "docs/tolerances.md, A scene carried along");
  if (auto unjudged = unfit(verdict, setup, state)) return *unjudged;
  const uint64_t kind = seed % kEquivarianceKinds;
  uint64_t random = seed;
  Motion motion;
  switch (kind) {
    case 0: {  // turned
      motion = random_turn(random);
      for (int32_t& padding : motion.padding) padding = static_cast<int32_t>(mixed(random) % 3);
      const Carrier carrier(motion, setup);
      State carried = carrier.state(state);
      carried.clusters = reordered(carried.clusters, shuffled(carried.clusters.count(), random));
      return judge_carried(verdict, "turned, " + text_of(motion), backend, setup, state, carrier, carried, span,
                           random);
    }
    case 1: {  // shifted on the grid
      for (int32_t& padding : motion.padding) padding = static_cast<int32_t>(mixed(random) % 8);
      const Carrier carrier(motion, setup);
      return judge_carried(
          std::move(verdict),
          fmt::format("shifted by ({}, {}, {}) nodes", motion.padding[0], motion.padding[1], motion.padding[2]),
          backend, setup, state, carrier, carrier.state(state), span, random);
    }
    case 2: {  // clusters renumbered
      const Carrier carrier(motion, setup);
      State carried = state;
      carried.clusters = reordered(state.clusters, shuffled(state.clusters.count(), random));
      return judge_carried(verdict, "clusters in another order", backend, setup, state, carrier, carried, span, random);
    }
    case 3: {  // scaled by a power of two
      const int power = static_cast<int>(mixed(random) % 17) - 8;
      motion.scale = std::ldexp(1.0, power == 0 ? 9 : power);
      const Carrier carrier(motion, setup);
      const State expected = carrier.state(after(backend, setup, state, {span}));
      const State actual = after(backend, carrier.setup(), carrier.state(state), {span});
      return judge_exactly(std::move(verdict), fmt::format("scaled by {}", motion.scale), expected, actual);
    }
    case 4: {  // elsewhere in the world
      motion.world_shift = {1e6 * setup.body.grid.spacing, -3e5 * setup.body.grid.spacing, 0.1};
      const Carrier carrier(motion, setup);
      const State expected = after(backend, setup, state, {span});
      const State actual = after(backend, carrier.setup(), state, {span});
      return judge_exactly(std::move(verdict), "elsewhere in the world", expected, actual);
    }
    default: {  // two of them
      const State expected = after(backend, setup, state, {span});
      backend.load({setup, setup}, {state, state});
      backend.run(span);
      const std::vector<State> both = backend.snapshot();
      for (std::size_t body = 0; body < 2 && verdict.holds; ++body) {
        verdict =
            judge_exactly(std::move(verdict), fmt::format("body {} of two equal ones", body), expected, both.at(body));
      }
      return verdict;
    }
  }
}

Verdict refinement(Backend& backend, const Setup& more, const State& state, int64_t fewer_frames) {
  Verdict verdict = begin("refinement", backend, state, "1", "oracles_and_tests.md §1: a stroke only refines");
  if (auto unjudged = unfit(verdict, more, state)) return *unjudged;
  Setup fewer = more;
  const auto substeps = at(fewer_frames * more.step.substeps);
  fewer.substep_length.resize(at(fewer_frames));
  for (int64_t& end : fewer.stroke_end) end = end < fewer_frames ? end : -1;
  if (!fewer.blade_moves.empty()) fewer.blade_moves.resize(substeps);
  for (Grip& grip : fewer.grips) {
    grip.active.resize(substeps);
    grip.displacement.resize(substeps);
  }
  const State coarse = after_frames(backend, fewer, state, fewer_frames - state.frame);
  const State fine = after_frames(backend, more, state, more.frame_count() - state.frame);
  const Partition before = graph_components(fewer, coarse);
  const Partition now = graph_components(more, fine);
  // For each component of the finer partition, a particle of it.
  std::vector<int32_t> first(at(now.count), -1);
  for (int32_t i = 0; i < more.body.particle_count(); ++i) {
    if (!fine.alive[at(i)]) continue;
    ++verdict.checked;
    if (!coarse.alive[at(i)]) {
      verdict.measured = 1;
      return fail(std::move(verdict), fmt::format("particle {} is dead after fewer strokes and alive after more", i),
                  {i});
    }
    int32_t& other = first[at(now.label[at(i)])];
    if (other < 0) other = i;
    if (before.label[at(other)] == before.label[at(i)]) continue;
    verdict.measured = 1;
    return fail(std::move(verdict),
                fmt::format("particles {} and {} are separate after fewer strokes and connected after more", other, i),
                {other, i});
  }
  return verdict;
}

Verdict rest_is_fixed(Backend& backend, const Setup& setup, const State& given) {
  const State state = in_arithmetic_of(backend, given);
  Verdict verdict = begin("rest is fixed", backend, state, "h", "docs/tolerances.md, One substep");
  if (auto unjudged = unfit(verdict, setup, state)) return *unjudged;
  if (setup.frame_count() == 0) return verdict;
  Setup calm = single_substep_setup(undisturbed(setup), std::min(state.frame, setup.frame_count() - 1));
  calm.step.gravity = {};
  const State rest = at_rest(calm, state);
  const State end = after_step(backend, calm, rest);
  const double h = setup.body.grid.spacing;
  int32_t where = -1;
  verdict.measured = greatest_distance(end, rest.x, where) / h;
  verdict.bound = substep_rounding(calm, rest) / h;
  verdict.checked = static_cast<int64_t>(std::count(rest.alive.begin(), rest.alive.end(), 1));
  if (verdict.measured <= verdict.bound) return verdict;
  return fail(std::move(verdict),
              fmt::format("particle {} of the rest state moves by {} h in one substep", where, verdict.measured),
              {where});
}

Verdict translation_is_exact(Backend& backend, const Setup& setup, const State& given, Vec3 velocity) {
  const State state = in_arithmetic_of(backend, given);
  Verdict verdict = begin("translation is exact", backend, state, "h", "docs/tolerances.md, One substep");
  if (auto unjudged = unfit(verdict, setup, state)) return *unjudged;
  if (setup.frame_count() == 0) return verdict;
  Setup free = single_substep_setup(undisturbed(setup), std::min(state.frame, setup.frame_count() - 1));
  free.step.damping = 0;
  State start = at_rest(free, state);
  for (Vec3& v : start.v) v = velocity;
  const double dt = free.substep_length[0];
  std::vector<Vec3> expected = start.x;
  for (Vec3& x : expected) x += dt * (velocity + dt * free.step.gravity);
  const State end = after_step(backend, free, start);

  const double h = setup.body.grid.spacing;
  State moved = start;
  moved.x = expected;
  int32_t where = -1;
  verdict.measured = greatest_distance(end, expected, where) / h;
  verdict.bound = substep_rounding(free, moved) / h;
  // Velocities are differences of positions over dt.
  for (std::size_t i = 0; i < end.v.size(); ++i) {
    if (!start.alive[i]) continue;
    const double error = dt * norm(end.v[i] - (velocity + dt * free.step.gravity)) / (2 * h);
    if (error <= verdict.measured) continue;
    verdict.measured = error;
    where = static_cast<int32_t>(i);
  }
  verdict.checked = static_cast<int64_t>(std::count(start.alive.begin(), start.alive.end(), 1));
  if (verdict.measured <= verdict.bound) return verdict;
  return fail(std::move(verdict),
              fmt::format("particle {} of a body that is only carried along ends {} h from where it should", where,
                          verdict.measured),
              {where});
}

Verdict energy_is_monotone(Backend& backend, const Setup& setup, const State& given, int32_t iterations) {
  const State state = in_arithmetic_of(backend, given);
  Verdict verdict = begin("energy is monotone", backend, state, "J", "docs/tolerances.md, Energy");
  if (auto unjudged = unfit(verdict, setup, state)) return *unjudged;
  if (setup.step.solver != Solver::implicit || state.frame < 0 || state.frame >= setup.frame_count()) return verdict;
  // Accelerated, only the first iteration is promised to lower it: that one is plain.
  if (setup.step.acceleration != Acceleration::none) iterations = std::min(iterations, 1);
  Setup single = single_substep_setup(setup, state.frame);
  const bool blade = single.has_blade && single.blade_moves[0].down && single.blade.friction > 0;
  const bool wall = std::any_of(single.walls.begin(), single.walls.end(), [](const Wall& w) { return w.friction > 0; });
  if (blade || wall) return verdict;  // friction has no energy
  State start = state;
  start.frame = 0;

  double mass = 0;
  for (std::size_t i = 0; i < state.alive.size(); ++i) mass += state.alive[i] ? single.body.mass[i] : 0;
  const double dt = single.substep_length[0], k = single.step.stiffness;
  const auto terms = static_cast<double>(state.clusters.members.size() + state.x.size());
  double previous = 0, worst = -std::numeric_limits<double>::infinity();
  for (int32_t iteration = 0; iteration <= iterations; ++iteration) {
    single.step.iterations = iteration;
    const State end = after_step(backend, single, start);
    const double energy = substep_energy(single, start, end.x);
    RoundingScale scale = rounding_scale(single, start);
    scale.extent = std::max(scale.extent, rounding_scale(single, end).extent);
    const double rho = 2 * goal_rounding(scale);
    const double bound = rho * (std::sqrt(2 * mass * energy) / dt + std::sqrt(2 * k * mass * energy)) +
                         terms * scale.unit_roundoff * energy + mass * (1 / (dt * dt) + k) * rho * rho;
    const double growth = iteration == 0 ? 0 : energy - previous;
    if (iteration > 0) ++verdict.checked;
    if (!(growth <= bound)) {
      verdict.measured = growth;
      verdict.bound = bound;
      return fail(std::move(verdict), fmt::format("iteration {} raises the energy of the substep from {} to {} J",
                                                  iteration, previous, energy));
    }
    if (iteration > 0 && growth / bound > worst) {
      worst = growth / bound;
      verdict.measured = std::max(0.0, growth);
      verdict.bound = bound;
    }
    previous = energy;
  }
  return verdict;
}

}  // namespace cutproof::oracles
