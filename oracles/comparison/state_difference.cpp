#include "oracles/comparison/state_difference.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <type_traits>

#include "oracles/support.h"

namespace cutproof::oracles {

namespace {

// --- Bits ------------------------------------------------------------------------------------------------------------

template <class T>
bool equal(const T& a, const T& b, bool rounded_once) {
  if constexpr (std::is_same_v<T, Vec3>) {
    const auto near = [&](int axis) { return std::abs(a[axis] - b[axis]) <= 0x1p-23 * std::abs(a[axis]); };
    if (rounded_once) return near(0) && near(1) && near(2);
  }
  return same_bits(a, b);
}
// -1 if they are equal.
template <class T>
int64_t first_unequal(const T& a, const T& b, bool rounded_once) {
  if (same_bits(a, b)) return -1;
  if constexpr (requires { a.size(); }) {
    const auto [p, q] = std::mismatch(a.begin(), a.end(), b.begin(), b.end(),
                                      [&](const auto& x, const auto& y) { return equal(x, y, rounded_once); });
    return p == a.end() && q == b.end() ? -1 : p - a.begin();
  } else {
    return equal(a, b, rounded_once) ? -1 : 0;
  }
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

template <class... Args>
std::optional<DecisionDifference> differs(Concerned concerned, fmt::format_string<Args...> text, Args&&... args) {
  return DecisionDifference{witness_of(std::move(concerned), text, std::forward<Args>(args)...), {}};
}

std::optional<DecisionDifference> difference_of_clusters(const Clusters& expected, const Clusters& actual) {
  if (expected.offsets == actual.offsets && expected.members == actual.members && expected.number == actual.number) {
    return {};
  }
  const auto wanted = numbered_sets(expected), found = numbered_sets(actual);
  const auto [w, f] = std::mismatch(wanted.begin(), wanted.end(), found.begin(), found.end());
  if (w == wanted.end() && f == found.end()) {
    return differs({}, "the clusters are those of the reference, but not in the order of their numbers");
  }
  if (w != wanted.end() && f != found.end() && w->first == f->first) {
    const int32_t particle = w->first.front();
    return differs({{f->second, w->second}, {particle}},
                   "the cluster of {} particles around particle {} has the number {}, but {} in the reference",
                   w->first.size(), particle, f->second, w->second);
  }
  const bool surplus = w == wanted.end() || (f != found.end() && f->first < w->first);
  const auto& [members, number] = surplus ? *f : *w;
  return differs({{number}, members}, "cluster {}, of {} particles around particle {}, is {}", number, members.size(),
                 members.empty() ? -1 : members.front(), surplus ? "not in the reference" : "only in the reference");
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
    return differs({}, "the skin's arrays of vertices have different lengths");
  }
  const auto wanted = vertex_order(expected), found = vertex_order(actual);
  for (std::size_t k = 0; k < std::min(wanted.size(), found.size()); ++k) {
    const std::size_t w = at(wanted[k]), f = at(found[k]);
    if (expected.owner[w] == actual.owner[f] && expected.direction[w] == actual.direction[f]) continue;
    return differs(
        {{}, {actual.owner[f], expected.owner[w]}},
        "skin vertex {} belongs to particle {}, direction {}, but in the reference to particle {}, direction {}", k,
        actual.owner[f], actual.direction[f], expected.owner[w], expected.direction[w]);
  }
  if (wanted.size() != found.size()) {
    return differs({}, "the skin has {} vertices, but {} in the reference", found.size(), wanted.size());
  }
  const auto first = first_in_one_only(canonical_triangles(expected, wanted), canonical_triangles(actual, found));
  if (!first) return {};
  std::vector<int32_t> owners;
  for (const int32_t place : first->element) {
    if (place >= 0) owners.push_back(expected.owner[at(wanted[at(place)])]);
  }
  return differs({{}, owners}, "a skin triangle is {}",
                 first->in_second ? "not in the reference" : "only in the reference");
}

// A particle of which something holds in one state only.
std::optional<DecisionDifference> differs_in(int32_t particle, std::string_view what, bool here) {
  return differs({{}, {particle}}, "particle {} is {} {}", particle, what,
                 here ? "here only" : "in the reference only");
}

template <class T>
std::optional<DecisionDifference> difference_of_field(const Field& field, const T& expected, const T& actual) {
  if constexpr (std::is_same_v<T, std::vector<int32_t>>) {  // an ascending list
    const auto first = first_in_one_only(expected, actual);
    return first ? differs_in(first->element, field.name, first->in_second) : std::nullopt;
  } else if constexpr (std::is_same_v<T, std::vector<uint8_t>>) {  // flags
    const auto [w, f] = std::mismatch(expected.begin(), expected.end(), actual.begin(), actual.end());
    if (w == expected.end() || f == actual.end()) return {};
    return differs_in(static_cast<int32_t>(w - expected.begin()), field.name, *f != 0);
  } else if constexpr (std::is_arithmetic_v<T>) {
    return differs({}, "{} is {}, but {} in the reference", field.text, actual, expected);
  } else {
    return differs({}, "{} differs from the reference's", field.text);
  }
}

// --- What is computed ------------------------------------------------------------------------------------------------

// Units of errors.
struct Scale {
  double spacing;  // h [m]
  double dt;       // [s]
};

std::string_view unit_of(Quantity quantity) {
  return quantity == Quantity::point      ? "h"
         : quantity == Quantity::velocity ? "h/dt"
         : quantity == Quantity::momentum ? "kg m/s"
         : quantity == Quantity::rotation ? "rad"
                                          : "1";
}

template <class T>
double error_of_entry(Quantity quantity, const T& expected, const T& actual, Scale scale) {
  if constexpr (std::is_same_v<T, Vec3>) {
    const double apart = norm(actual - expected);
    if (quantity == Quantity::point) return apart / scale.spacing;
    if (quantity == Quantity::velocity) return apart * scale.dt / scale.spacing;
    return apart;
  } else if constexpr (std::is_same_v<T, Mat3>) {
    return angle_between(expected, actual);
  } else if constexpr (std::is_same_v<T, double>) {
    if (quantity == Quantity::number) return std::abs(actual - expected);
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

// Two states, and what in them corresponds to what: clusters by their order, skin vertices by (owner, direction).
struct Pair {
  Pair(const State& expected, const State& actual)
      : skin(expected.skin),
        same_clusters(!difference_of_clusters(expected.clusters, actual.clusters)),
        same_skin(!difference_of_skins(expected.skin, actual.skin)) {
    if (!same_skin) return;
    expected_vertex = vertex_order(expected.skin);
    actual_vertex = vertex_order(actual.skin);
  }
  const Skin& skin;
  bool same_clusters, same_skin;
  std::vector<int32_t> expected_vertex, actual_vertex;
};

template <class T>
ErrorNorm error_of_field(const Field& field, const T& expected, const T& actual, Scale scale,
                         const std::vector<uint8_t>& mask, const Pair& pair) {
  ErrorNorm norm;
  const auto add = [&](const auto& one, const auto& other, auto where) {
    norm.add(error_of_entry(field.quantity, one, other, scale), static_cast<int32_t>(where));
  };
  if constexpr (!requires { expected.size(); }) {
    add(expected, actual, 0);
  } else if (field.space == IndexSpace::particle) {
    return error_of_particles(field.quantity, expected, actual, scale, mask);
  } else if (field.space == IndexSpace::cluster && pair.same_clusters) {
    for (std::size_t c = 0; c < expected.size(); ++c) add(expected[c], actual[c], c);
  } else if (field.space == IndexSpace::vertex && pair.same_skin) {
    for (std::size_t k = 0; k < expected.size(); ++k) {
      const std::size_t v = at(pair.expected_vertex[k]);
      add(expected[v], actual[at(pair.actual_vertex[k])], pair.skin.owner[v]);
    }
  }
  return norm;
}

}  // namespace

std::vector<FieldDifference> differences_in_bits(const State& expected, const State& actual, bool rounded_once) {
  std::vector<FieldDifference> found;
  for_each_field([&](const Field& field, auto get) {
    const bool rounded = rounded_once && (field.quantity == Quantity::velocity || field.quantity == Quantity::momentum);
    const int64_t index = first_unequal(get(expected), get(actual), rounded);
    constexpr bool is_list = requires { get(expected).size(); };
    if (index >= 0) found.push_back({field.name, field.text, field.space, field.is_decision, is_list, index});
  });
  return found;
}

std::optional<FieldDifference> first_difference_in_bits(const State& expected, const State& actual, bool rounded_once) {
  const std::vector<FieldDifference> found = differences_in_bits(expected, actual, rounded_once);
  return found.empty() ? std::nullopt : std::optional(found.front());
}

std::optional<DecisionDifference> difference_of_decisions(const State& expected, const State& actual, Sets sets) {
  std::optional<DecisionDifference> found;
  for (const bool derived : {false, true}) {
    for (const unsigned parts : kOrderOfDecisions) {
      bool looked = false;  // at fields that are compared together
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
  const Pair pair(expected, actual);
  std::vector<FieldError> errors;
  for_each_field([&](const Field& field, auto get) {
    if (field.is_decision) return;
    errors.push_back(
        {field.name, unit_of(field.quantity), error_of_field(field, get(expected), get(actual), scale, mask, pair)});
  });
  return errors;
}

const ErrorNorm& error_of(const std::vector<FieldError>& errors, std::string_view field) {
  for (const FieldError& error : errors) {
    if (error.field == field) return error.norm;
  }
  throw std::invalid_argument(fmt::format("no field that is computed is named '{}'", field));
}

double angle_between(const Mat3& a, const Mat3& b) {
  double squared = 0;
  for (std::size_t k = 0; k < 9; ++k) squared += (b.m[k] - a.m[k]) * (b.m[k] - a.m[k]);
  return std::isnan(squared) ? squared : 2 * std::asin(std::min(1.0, std::sqrt(squared / 8)));
}

}  // namespace cutproof::oracles
