#include "oracles/comparison/state_difference.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <type_traits>

#include "model/at.h"
#include "model/fields.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {

namespace {

// --- Bits ------------------------------------------------------------------------------------------------------------

template <class T>
bool equal(const T& a, const T& b, bool rounded_once) {
  if constexpr (std::is_same_v<T, Vec3>) {
    if (rounded_once) {
      for (int axis = 0; axis < 3; ++axis) {
        if (!(std::abs(a[axis] - b[axis]) <= 0x1p-23 * std::abs(a[axis]))) return false;
      }
      return true;
    }
  }
  return same_bits(a, b);
}
// -1 if they are equal.
template <class T>
int64_t first_unequal(const T& a, const T& b, bool rounded_once) {
  return equal(a, b, rounded_once) ? -1 : 0;
}
template <class T>
int64_t first_unequal(const std::vector<T>& a, const std::vector<T>& b, bool rounded_once) {
  if (same_bits(a, b)) return -1;
  const auto [p, q] = std::mismatch(a.begin(), a.end(), b.begin(), b.end(),
                                    [&](const T& x, const T& y) { return equal(x, y, rounded_once); });
  return p == a.end() && q == b.end() ? -1 : p - a.begin();
}

// --- Decisions -------------------------------------------------------------------------------------------------------

// Fields of these parts are compared together, as sets, and not entry by entry. This is said here and nowhere else.
constexpr unsigned kNumberedSets = kSets | kNumbers;
constexpr unsigned kTriangleSets = kSkin;

// Differences are reported in this order; among them those that are derived from others last.
constexpr std::array<unsigned, 6> kOrderOfDecisions = {kTime, kCut, kAlive, kLimits, kNumberedSets, kTriangleSets};

// Clusters as sets with their numbers, in an order that depends on nothing else.
std::vector<std::pair<std::vector<int32_t>, int32_t>> numbered_sets(const Clusters& clusters) {
  std::vector<std::pair<std::vector<int32_t>, int32_t>> sets;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const auto members = clusters.of(c);
    sets.push_back({{members.begin(), members.end()}, clusters.number[at(c)]});
  }
  std::sort(sets.begin(), sets.end());
  return sets;
}

std::optional<DecisionDifference> difference_of_clusters(const Clusters& expected, const Clusters& actual) {
  if (expected.offsets == actual.offsets && expected.members == actual.members && expected.number == actual.number) {
    return {};
  }
  const auto wanted = numbered_sets(expected), found = numbered_sets(actual);
  const auto [w, f] = std::mismatch(wanted.begin(), wanted.end(), found.begin(), found.end());
  if (w == wanted.end() && f == found.end()) {
    return DecisionDifference{"the clusters are those of the reference, but not in the order of their numbers", {}, {}};
  }
  if (w != wanted.end() && f != found.end() && w->first == f->first) {
    return DecisionDifference{
        fmt::format("the cluster of {} particles around particle {} has the number {}, but {} in the reference",
                    w->first.size(), w->first.front(), f->second, w->second),
        {f->second, w->second},
        {w->first.front()}};
  }
  const bool surplus = w == wanted.end() || (f != found.end() && f->first < w->first);
  const auto& [members, number] = surplus ? *f : *w;
  return DecisionDifference{
      fmt::format("cluster {}, of {} particles around particle {}, is {}", number, members.size(),
                  members.empty() ? -1 : members.front(), surplus ? "not in the reference" : "only in the reference"),
      {number},
      members};
}

// Vertices in the order of (owner, direction).
std::vector<int32_t> vertex_order(const Skin& skin) {
  std::vector<int32_t> order(skin.owner.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int32_t v) { return std::pair(skin.owner[at(v)], skin.direction[at(v)]); };
  const auto before = [&](int32_t a, int32_t b) { return key(a) < key(b); };
  if (!std::is_sorted(order.begin(), order.end(), before)) std::sort(order.begin(), order.end(), before);
  return order;
}

// Triangles by their vertices' places in `order`, each beginning at its lowest, sorted.
std::vector<std::array<int32_t, 3>> canonical_triangles(const Skin& skin, const std::vector<int32_t>& order) {
  std::vector<int32_t> place(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) place[at(order[k])] = static_cast<int32_t>(k);
  std::vector<std::array<int32_t, 3>> triangles = skin.triangles;
  for (auto& t : triangles) {
    for (int32_t& v : t) v = v >= 0 && at(v) < place.size() ? place[at(v)] : -1;
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  }
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

std::optional<DecisionDifference> difference_of_skins(const Skin& expected, const Skin& actual) {
  if (expected == actual) return {};
  if (actual.direction.size() != actual.owner.size() || actual.position.size() != actual.owner.size()) {
    return DecisionDifference{"the skin's arrays of vertices have different lengths", {}, {}};
  }
  const auto wanted = vertex_order(expected), found = vertex_order(actual);
  for (std::size_t k = 0; k < std::min(wanted.size(), found.size()); ++k) {
    const std::size_t w = at(wanted[k]), f = at(found[k]);
    if (expected.owner[w] == actual.owner[f] && expected.direction[w] == actual.direction[f]) continue;
    return DecisionDifference{
        fmt::format("skin vertex {} belongs to particle {}, direction {}, but in the reference to "
                    "particle {}, direction {}",
                    k, actual.owner[f], actual.direction[f], expected.owner[w], expected.direction[w]),
        {},
        {actual.owner[f], expected.owner[w]}};
  }
  if (wanted.size() != found.size()) {
    return DecisionDifference{
        fmt::format("the skin has {} vertices, but {} in the reference", found.size(), wanted.size()), {}, {}};
  }
  const auto triangles = canonical_triangles(expected, wanted), others = canonical_triangles(actual, found);
  const auto [w, f] = std::mismatch(triangles.begin(), triangles.end(), others.begin(), others.end());
  if (w == triangles.end() && f == others.end()) return {};
  const bool surplus = w == triangles.end() || (f != others.end() && *f < *w);
  DecisionDifference difference{
      fmt::format("a skin triangle is {}", surplus ? "not in the reference" : "only in the reference"), {}, {}};
  for (const int32_t place : surplus ? *f : *w) {
    if (place >= 0) difference.particles.push_back(expected.owner[at(wanted[at(place)])]);
  }
  return difference;
}

// The first particle in one ascending list and not in the other, said in a sentence.
std::optional<DecisionDifference> difference_of_lists(const std::vector<int32_t>& expected,
                                                      const std::vector<int32_t>& actual, std::string_view what) {
  const auto [w, f] = std::mismatch(expected.begin(), expected.end(), actual.begin(), actual.end());
  if (w == expected.end() && f == actual.end()) return {};
  const bool surplus = w == expected.end() || (f != actual.end() && *f < *w);
  const int32_t particle = surplus ? *f : *w;
  return DecisionDifference{
      fmt::format("particle {} is {} {}", particle, what, surplus ? "here only" : "in the reference only"),
      {},
      {particle}};
}

std::optional<DecisionDifference> difference_of_flags(const std::vector<uint8_t>& expected,
                                                      const std::vector<uint8_t>& actual, std::string_view what) {
  const auto [w, f] = std::mismatch(expected.begin(), expected.end(), actual.begin(), actual.end());
  if (w == expected.end() || f == actual.end()) return {};
  const auto particle = static_cast<int32_t>(w - expected.begin());
  return DecisionDifference{
      fmt::format("particle {} is {} {}", particle, what, *f ? "here only" : "in the reference only"), {}, {particle}};
}

template <class T>
std::optional<DecisionDifference> difference_of_field(const Field& field, const T& expected, const T& actual) {
  if constexpr (std::is_same_v<T, std::vector<int32_t>>) {
    return difference_of_lists(expected, actual, field.name);
  } else if constexpr (std::is_same_v<T, std::vector<uint8_t>>) {
    return difference_of_flags(expected, actual, field.name);
  } else if constexpr (std::is_arithmetic_v<T>) {
    return DecisionDifference{fmt::format("{} is {}, but {} in the reference", field.text, actual, expected), {}, {}};
  } else {
    return DecisionDifference{fmt::format("{} differs from the reference's", field.text), {}, {}};
  }
}

// --- What is computed ------------------------------------------------------------------------------------------------

// What errors are divided by.
struct Scale {
  double spacing;  // h [m]
  double dt;       // [s]
};

std::string_view unit_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::point:
      return "h";
    case Quantity::velocity:
      return "h/dt";
    case Quantity::momentum:
      return "kg m/s";
    case Quantity::rotation:
      return "rad";
    default:
      return "1";
  }
}

template <class T>
double error_of_entry(Quantity quantity, const T& expected, const T& actual, Scale scale) {
  if constexpr (std::is_same_v<T, Vec3>) {
    const double apart = norm(actual - expected);
    if (quantity == Quantity::point) return apart / scale.spacing;
    if (quantity == Quantity::velocity) return apart * scale.dt / scale.spacing;
    return apart;
  } else if constexpr (std::is_same_v<T, Mat3>) {
    // ‖R − R'‖² = 8 sin²(angle / 2): exact for small angles, where the trace loses all digits.
    double squared = 0;
    for (std::size_t k = 0; k < 9; ++k) squared += (actual.m[k] - expected.m[k]) * (actual.m[k] - expected.m[k]);
    return std::isnan(squared) ? squared : 2 * std::asin(std::min(1.0, std::sqrt(squared / 8)));
  } else if constexpr (std::is_same_v<T, double>) {
    return expected == actual ? 0 : std::abs(actual - expected) / std::abs(expected);
  } else if constexpr (std::is_same_v<T, uint8_t>) {
    return expected == actual ? 0 : 1;
  } else {
    throw std::logic_error("errors of fields: a field is computed whose values have no distance");
  }
}

// Particles: those in the mask, all that both have.
template <class T>
ErrorNorm error_of_particles(Quantity quantity, const std::vector<T>& expected, const std::vector<T>& actual,
                             Scale scale, const std::vector<uint8_t>& mask) {
  ErrorNorm norm;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (mask[i]) norm.add(error_of_entry(quantity, expected[i], actual[i], scale), static_cast<int32_t>(i));
  }
  return norm;
}

// What corresponds to what: clusters by their order, skin vertices by (owner, direction).
struct Correspondence {
  bool clusters = false, skin = false;
  std::vector<int32_t> expected_vertex, actual_vertex;
};
Correspondence correspondence_of(const State& expected, const State& actual) {
  Correspondence found;
  found.clusters = !difference_of_clusters(expected.clusters, actual.clusters);
  found.skin = !difference_of_skins(expected.skin, actual.skin);
  if (!found.skin) return found;
  found.expected_vertex = vertex_order(expected.skin);
  found.actual_vertex = vertex_order(actual.skin);
  return found;
}

template <class T>
ErrorNorm error_of_field(const Field& field, const T& expected, const T& actual, Scale scale,
                         const std::vector<uint8_t>&, const Correspondence&, const Skin&) {
  ErrorNorm norm;
  norm.add(error_of_entry(field.quantity, expected, actual, scale), 0);
  return norm;
}
template <class T>
ErrorNorm error_of_field(const Field& field, const std::vector<T>& expected, const std::vector<T>& actual, Scale scale,
                         const std::vector<uint8_t>& mask, const Correspondence& same, const Skin& skin) {
  if (field.space == IndexSpace::particle) return error_of_particles(field.quantity, expected, actual, scale, mask);
  ErrorNorm norm;
  if (field.space == IndexSpace::cluster && same.clusters) {
    for (std::size_t c = 0; c < expected.size(); ++c) {
      norm.add(error_of_entry(field.quantity, expected[c], actual[c], scale), static_cast<int32_t>(c));
    }
  }
  if (field.space == IndexSpace::vertex && same.skin) {
    for (std::size_t k = 0; k < expected.size(); ++k) {
      const std::size_t v = at(same.expected_vertex[k]);
      norm.add(error_of_entry(field.quantity, expected[v], actual[at(same.actual_vertex[k])], scale), skin.owner[v]);
    }
  }
  return norm;
}

}  // namespace

std::optional<FieldDifference> first_difference_in_bits(const State& expected, const State& actual, bool rounded_once) {
  std::optional<FieldDifference> found;
  for_each_field([&](const Field& field, auto get) {
    if (found) return;
    const bool rounded = rounded_once && (field.quantity == Quantity::velocity || field.quantity == Quantity::momentum);
    const int64_t index = first_unequal(get(expected), get(actual), rounded);
    if (index >= 0) found = FieldDifference{field.name, field.text, index};
  });
  return found;
}

std::optional<DecisionDifference> difference_of_decisions(const State& expected, const State& actual, Sets sets) {
  std::optional<DecisionDifference> found;
  for (const bool derived : {false, true}) {
    for (const unsigned parts : kOrderOfDecisions) {
      bool looked = false;  // at what is compared together
      for_each_field([&](const Field& field, auto get) {
        if (found || looked || !field.is_decision || (field.part & parts) == 0) return;
        if (derived == field.derived_from.empty() || same_bits(get(expected), get(actual))) return;
        const bool of_sets =
            (field.part & kNumberedSets) != 0 || field.derived_from.find("members") != field.derived_from.npos;
        if (sets == Sets::open && of_sets) return;
        if ((field.part & kNumberedSets) != 0) {
          found = difference_of_clusters(expected.clusters, actual.clusters);
          looked = true;
        } else if ((field.part & kTriangleSets) != 0) {
          found = difference_of_skins(expected.skin, actual.skin);
          looked = true;
        } else {
          found = difference_of_field(field, get(expected), get(actual));
        }
        if (found) found->field = field.name;
      });
    }
  }
  return found;
}

ErrorNorm position_error(const Setup& setup, const std::vector<Vec3>& expected, const std::vector<Vec3>& actual,
                         const std::vector<uint8_t>& mask) {
  return error_of_particles(Quantity::point, expected, actual, {setup.body.grid.spacing, 0}, mask);
}

ErrorNorm velocity_error(const Setup& setup, const std::vector<Vec3>& expected, const std::vector<Vec3>& actual,
                         double dt, const std::vector<uint8_t>& mask) {
  return error_of_particles(Quantity::velocity, expected, actual, {setup.body.grid.spacing, dt}, mask);
}

std::vector<FieldError> errors_of_fields(const Setup& setup, const State& expected, const State& actual, double dt,
                                         const std::vector<uint8_t>& mask) {
  const Scale scale{setup.body.grid.spacing, dt};
  const Correspondence same = correspondence_of(expected, actual);
  std::vector<FieldError> errors;
  for_each_field([&](const Field& field, auto get) {
    if (field.is_decision) return;
    errors.push_back({field.name, unit_of(field.quantity),
                      error_of_field(field, get(expected), get(actual), scale, mask, same, expected.skin)});
  });
  return errors;
}

const ErrorNorm& error_of(const std::vector<FieldError>& errors, std::string_view field) {
  for (const FieldError& error : errors) {
    if (error.field == field) return error.norm;
  }
  throw std::invalid_argument(fmt::format("no field that is computed is named '{}'", field));
}

RestFrameErrors rest_frame_errors(const Setup& setup, const State& actual) {
  const Clusters& clusters = actual.clusters;
  const WeightedRest rest = weighted_rest(setup.body, membership_counts(clusters, setup.body.particle_count()));
  RestFrameErrors errors;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const ClusterMeans fresh = cluster_means(rest, clusters, rest.position, c);
    errors.center.add(norm(clusters.rest_center[at(c)] - fresh.rest) / setup.body.grid.spacing, c);
    errors.mass.add(std::abs(clusters.mass[at(c)] - fresh.mass) / fresh.mass, c);
  }
  return errors;
}

}  // namespace cutproof::oracles
