#include "oracles/relations/transformed_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "oracles/oracles.h"
#include "oracles/shape_sums.h"
#include "oracles/shells.h"

namespace cutproof::oracles {
namespace {

// The span in pieces, so that different choices of merging and expansion are judged where they happen.
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

struct Tolerance {
  double position = 0;  // [m], also of velocities times dt and of places that a rotation gives members
  double skin = 0;      // [m]
  double velocity = 0;  // [m/s]
  double impulse = 0;   // [kg m/s]
  double rest = 0;      // [m], rest centers; relative for masses times the extent
};

std::vector<int32_t> members_of(const Clusters& clusters, int32_t c) {
  const auto members = clusters.of(c);
  return {members.begin(), members.end()};
}

// Several clusters may have the same members: the rests of two after a cut.
std::multimap<std::vector<int32_t>, int32_t> places_by_members(const Clusters& clusters) {
  std::multimap<std::vector<int32_t>, int32_t> places;
  for (int32_t c = 0; c < clusters.count(); ++c) places.emplace(members_of(clusters, c), c);
  return places;
}

bool same_families(const Clusters& a, const Clusters& b) {
  const auto of_a = places_by_members(a), of_b = places_by_members(b);
  const auto same_members = [](const auto& one, const auto& other) { return one.first == other.first; };
  return std::equal(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), same_members);
}

std::vector<int32_t> decided_differently(const State& a, const State& b) {
  std::vector<int32_t> particles;
  for (std::size_t i = 0; i < a.alive.size(); ++i) {
    if (a.alive[i] != b.alive[i]) particles.push_back(static_cast<int32_t>(i));
  }
  return particles;
}

struct Measured {
  double ratio = 0;  // the worst of all comparisons, by distance / bound
  Witness difference;
  int64_t checked = 0;
  void compare(double value, double limit, const char* what, const Concerned& concerned) {
    ++checked;
    if (value <= limit * ratio) return;
    ratio = limit > 0 && !std::isnan(value) ? value / limit : std::numeric_limits<double>::infinity();
    difference = witness_of(concerned, "{} differs by {}, more than {}", what, figure_beside(value, limit),
                            figure_beside(limit, value));
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

// Transform and impulse in two states with the same particles alive.
void compare_motion(const State& expected, const State& actual, const Tolerance& tolerance, Measured& measured) {
  for (std::size_t i = 0; i < expected.x.size(); ++i) {
    const Concerned particle = {{}, {static_cast<int32_t>(i)}};
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
    const Concerned cluster = {{actual.number[k]}};
    measured.compare(norm(expected.rest_center[j] - actual.rest_center[k]), tolerance.rest, "a rest center [m]",
                     cluster);
    measured.compare(std::abs(expected.mass[j] - actual.mass[k]) * extent, tolerance.rest * expected.mass[j],
                     "a cluster's mass, times the extent [kg m],", cluster);
    if (std::all_of(members.begin(), members.end(), [&](int32_t i) { return free_rotation[at(i)] != 0; })) continue;
    const auto [distance, member] = nearest_rotation(setup.body, expected, places, actual, c);
    measured.compare(distance, tolerance.position, "where a rotation puts a member [m]", {cluster.clusters, {member}});
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
std::optional<Witness> compare_skins(const Setup& setup, const State& expected_state, const State& actual_state,
                                     const std::vector<uint8_t>& free_rotation, const Tolerance& tolerance,
                                     Measured& measured) {
  const Skin &expected = expected_state.skin, &actual = actual_state.skin;
  const auto a = vertices_of(expected), b = vertices_of(actual);
  for (const auto& [key, position] : a) {
    const auto other = b.find(key);
    if (other == b.end()) {
      return witness_of({{}, {key.first}}, "the skin's vertex of particle {} in direction {} is missing", key.first,
                        key.second);
    }
    if (free_rotation[at(key.first)]) continue;
    measured.compare(norm(position - other->second), tolerance.skin, "a vertex of the skin [m]", {{}, {key.first}});
  }
  for (const auto& [key, position] : b) {
    if (a.count(key)) continue;
    return witness_of({{}, {key.first}}, "the skin has a vertex of particle {} in direction {} too many", key.first,
                      key.second);
  }
  // Shells joined at vertices are those joined at edges only where the surface is a manifold.
  const bool closed = skin_surface(setup, expected_state).holds;
  if (closed != skin_surface(setup, actual_state).holds) {
    return witness_of({}, "only the skin of {} is a closed surface", closed ? "the other run" : "this run");
  }
  const ShellCount shells = count_shells(expected), other = count_shells(actual);
  if (shells == other && expected.triangles.size() == actual.triangles.size()) return std::nullopt;
  return witness_of({}, "the skins have {} + {} and {} + {} shells and {} and {} triangles", shells.outer, shells.inner,
                    other.outer, other.inner, expected.triangles.size(), actual.triangles.size());
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
std::vector<uint8_t> inconclusive(Backend& backend, const Setup& setup, const State& state, Span span,
                                  const State& result, uint64_t seed) {
  std::vector<uint8_t> undecidable(state.alive.size(), 0);
  const auto note = [&](const State& other) {
    for (const int32_t i : decided_differently(result, other)) undecidable[at(i)] = 1;
  };
  note(after(backend, disturbed(setup, +kDisturbance), state, span));
  note(after(backend, disturbed(setup, -kDisturbance), state, span));
  note(after(backend, setup, jittered(setup, state, kDisturbance, seed), span));
  return undecidable;
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
      after(backend, moved_contacts(setup, amplitude, seed), jittered(setup, state, amplitude, seed), span);
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

// A scene and the same one transformed along, both run.
struct TransformedRuns {
  Backend& backend;
  const Setup& setup;
  const State& state;
  const TransformedScene& scene;
  const State& transformed_state;
  Span span;
  std::vector<Span> pieces;
  std::vector<State> original, transformed;  // after each piece

  // The transformed state in which a piece began.
  const State& before(std::size_t piece) const { return piece == 0 ? transformed_state : transformed[piece - 1]; }

  // Effect of rounding on numbers, if disturbances of positions grow by `growth`.
  Tolerance tolerance(double growth) const {
    RoundingScale scale = rounding_scale(scene.setup(), transformed.back());
    const RoundingScale first = rounding_scale(scene.setup(), transformed_state);
    scale.extent = std::max(scale.extent, first.extent);
    scale.largest_cluster = std::max(scale.largest_cluster, first.largest_cluster);
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
// or kept by a hair; -1 if there is none.
int32_t wrongly_decided(const TransformedRuns& runs, std::size_t piece, uint64_t seed) {
  const State expected = runs.scene.state(runs.original[piece]);
  const std::vector<uint8_t> undecidable =
      inconclusive(runs.backend, runs.setup, runs.state, runs.span, runs.original.back(), seed);
  for (int32_t i = 0; i < runs.setup.body.particle_count(); ++i) {
    const auto j = at(runs.scene.particle(i));
    if (expected.alive[j] != runs.transformed[piece].alive[j] && !undecidable[at(i)]) return i;
  }
  return -1;
}

// Clusters that differ are legal where merging or expansion met a tie: same coupling, and each stage within its rules.
std::optional<Witness> illegal_clusters(const TransformedRuns& runs, std::size_t piece) {
  const Setup& setup = runs.scene.setup();
  const State &input = runs.before(piece), &actual = runs.transformed[piece];
  const State expected = runs.scene.state(runs.original[piece]);
  if (coupling_components(setup, expected).label != coupling_components(setup, actual).label) {
    return witness_of({}, "the clusters couple the particles differently");
  }
  const Span span = runs.pieces[piece];
  std::optional<Verdict> legal;
  if (span == Span{Stage::merge, Stage::merge}) {
    legal = merge_legality(setup, input, actual);
    if (legal->holds) legal = cap_kept(setup, input, actual);
  }
  if (span == Span{Stage::expand, Stage::expand}) legal = expansion(setup, input, actual);
  return legal && !legal->holds ? std::optional(legal->witness) : std::nullopt;
}

// Both runs, piece by piece, up to rounding and ties. True: only numbers fail.
bool compare_runs(Verdict& verdict, const std::string& how, const TransformedRuns& runs, const Tolerance& tolerance,
                  uint64_t seed) {
  const Setup& setup = runs.scene.setup();
  verdict.bound = 1;
  verdict.unit = "of the bound";
  bool families_agree = true;
  std::vector<uint8_t> free_rotation(runs.state.alive.size(), 0);
  for (std::size_t p = 0; p < runs.pieces.size(); ++p) {
    const Span piece = runs.pieces[p];
    const State expected = runs.scene.state(runs.original[p]);
    const State& actual = runs.transformed[p];
    const std::string where = fmt::format("{}, after {}", how, name_of(piece.last));
    const auto differ = [&](Witness difference) {
      difference.text = where + ": " + difference.text;
      fail(verdict, std::move(difference));
      return false;
    };

    if (!decided_differently(expected, actual).empty()) {
      const int32_t i = wrongly_decided(runs, p, seed);
      if (i >= 0) {
        return differ(witness_of({{}, {i}}, "particle {} is {} here and not in the other run", i,
                                 runs.original[p].alive[at(i)] ? "alive" : "dead"));
      }
      vacuous(verdict, "the removal of particles is inconclusive within rounding");
      return false;
    }
    if (expected.removed != actual.removed || expected.debris != actual.debris || expected.frame != actual.frame ||
        expected.tau != actual.tau || expected.cap != actual.cap || expected.edge_covered != actual.edge_covered) {
      return differ(witness_of({}, "the lists of removed particles, or frame, tau, cap or edge cover differ"));
    }

    const bool may_tie = piece.contains(Stage::merge) || piece.contains(Stage::expand) || !families_agree;
    families_agree = same_families(expected.clusters, actual.clusters);
    if (!families_agree) {
      if (!may_tie) return differ(witness_of({}, "the clusters differ"));
      if (const auto found = illegal_clusters(runs, p)) {
        verdict.measured = 1;
        return differ(*found);
      }
      free_rotation.assign(free_rotation.size(), 1);
    } else if (piece.contains(Stage::merge)) {
      mark_inherited_rotations(setup, runs.before(p).clusters, expected.clusters, actual.clusters, tolerance.position,
                               free_rotation);
    }

    Measured measured;
    compare_motion(expected, actual, tolerance, measured);
    if (families_agree) {
      compare_clusters(setup, expected.clusters, actual.clusters, tolerance, rounding_scale(setup, actual).extent,
                       free_rotation, measured);
    }
    if (piece.contains(Stage::skin)) {
      const auto found = compare_skins(setup, expected, actual, free_rotation, tolerance, measured);
      if (found) {
        verdict.measured = 1;
        return differ(*found);
      }
    }
    verdict.checked += measured.checked;
    verdict.measured = std::max(verdict.measured, measured.ratio);
    if (measured.ratio > 1) {
      differ(measured.difference);
      return true;
    }
  }
  return false;
}

}  // namespace

uint64_t mixed(uint64_t& seed) {
  uint64_t z = (seed += 0x9E3779B97F4A7C15u);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

void judge_transformed(Verdict& verdict, const std::string& how, Backend& backend, const Setup& setup,
                       const State& state, const TransformedScene& scene, const State& transformed_state, Span span,
                       uint64_t seed) {
  TransformedRuns runs{backend, setup, state, scene, transformed_state, span, pieces_of(backend, span), {}, {}};
  runs.original = after_each(backend, setup, state, runs.pieces);
  runs.transformed = after_each(backend, scene.setup(), transformed_state, runs.pieces);
  for (const State& answer : runs.original) {
    if (!is_fit(verdict, setup, answer)) return;
  }
  for (const State& answer : runs.transformed) {
    if (!is_fit(verdict, scene.setup(), answer)) return;
  }
  const State& result = runs.original.back();
  double growth = runs.has_step() ? sensitivity(backend, setup, state, span, result, kDisturbance, seed) : 1;
  Verdict first = verdict;
  if (!compare_runs(first, how, runs, runs.tolerance(growth), seed) || !runs.has_step()) {
    verdict = first;
    return;
  }
  // A jump (a contact that lets go or not) hides below a disturbance that is larger than it. Look closer.
  for (int round = 0; round < kCloserLooks; ++round) {
    growth = std::max(growth, sensitivity(backend, setup, state, span, result, kCloserDisturbance, seed));
  }
  compare_runs(verdict, how, runs, runs.tolerance(kCloserFactor * growth), seed);
}

}  // namespace cutproof::oracles
