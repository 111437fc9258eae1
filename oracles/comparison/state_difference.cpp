#include "oracles/comparison/state_difference.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "oracles/shape_sums.h"

namespace cutproof::oracles {

namespace {

std::size_t at(int64_t index) { return static_cast<std::size_t>(index); }

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

std::optional<Difference> difference_of_clusters(const Clusters& expected, const Clusters& actual) {
  if (expected.offsets == actual.offsets && expected.members == actual.members && expected.number == actual.number) {
    return {};
  }
  const auto wanted = numbered_sets(expected), found = numbered_sets(actual);
  const auto [w, f] = std::mismatch(wanted.begin(), wanted.end(), found.begin(), found.end());
  if (w == wanted.end() && f == found.end()) {
    return Difference{"the clusters are those of the reference, but not in the order of their numbers", {}, {}};
  }
  if (w != wanted.end() && f != found.end() && w->first == f->first) {
    return Difference{
        fmt::format("the cluster of {} particles around particle {} has the number {}, but {} in the reference",
                    w->first.size(), w->first.front(), f->second, w->second),
        {f->second, w->second},
        {w->first.front()}};
  }
  const bool surplus = w == wanted.end() || (f != found.end() && f->first < w->first);
  const auto& [members, number] = surplus ? *f : *w;
  return Difference{
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

std::optional<Difference> difference_of_skins(const Skin& expected, const Skin& actual) {
  if (expected == actual) return {};
  if (actual.direction.size() != actual.owner.size() || actual.position.size() != actual.owner.size()) {
    return Difference{"the skin's arrays of vertices have different lengths", {}, {}};
  }
  const auto wanted = vertex_order(expected), found = vertex_order(actual);
  for (std::size_t k = 0; k < std::min(wanted.size(), found.size()); ++k) {
    const std::size_t w = at(wanted[k]), f = at(found[k]);
    if (expected.owner[w] == actual.owner[f] && expected.direction[w] == actual.direction[f]) continue;
    return Difference{fmt::format("skin vertex {} belongs to particle {}, direction {}, but in the reference to "
                                  "particle {}, direction {}",
                                  k, actual.owner[f], actual.direction[f], expected.owner[w], expected.direction[w]),
                      {},
                      {actual.owner[f], expected.owner[w]}};
  }
  if (wanted.size() != found.size()) {
    return Difference{
        fmt::format("the skin has {} vertices, but {} in the reference", found.size(), wanted.size()), {}, {}};
  }
  const auto triangles = canonical_triangles(expected, wanted), others = canonical_triangles(actual, found);
  const auto [w, f] = std::mismatch(triangles.begin(), triangles.end(), others.begin(), others.end());
  if (w == triangles.end() && f == others.end()) return {};
  const bool surplus = w == triangles.end() || (f != others.end() && *f < *w);
  Difference difference{
      fmt::format("a skin triangle is {}", surplus ? "not in the reference" : "only in the reference"), {}, {}};
  for (const int32_t place : surplus ? *f : *w) {
    if (place >= 0) difference.particles.push_back(expected.owner[at(wanted[at(place)])]);
  }
  return difference;
}

// The first particle in one ascending list and not in the other, said in a sentence.
std::optional<Difference> difference_of_lists(const std::vector<int32_t>& expected, const std::vector<int32_t>& actual,
                                              const char* what) {
  const auto [w, f] = std::mismatch(expected.begin(), expected.end(), actual.begin(), actual.end());
  if (w == expected.end() && f == actual.end()) return {};
  const bool surplus = w == expected.end() || (f != actual.end() && *f < *w);
  const int32_t particle = surplus ? *f : *w;
  return Difference{
      fmt::format("particle {} is {} {}", particle, what, surplus ? "here only" : "in the reference only"),
      {},
      {particle}};
}

}  // namespace

Spread positions_apart(const Setup& setup, const State& expected, const State& actual,
                       const std::vector<uint8_t>& mask) {
  return positions_apart(setup, expected.x, actual.x, mask);
}

RestFrameSpread rest_frames_apart(const Setup& setup, const State& actual) {
  const Clusters& clusters = actual.clusters;
  const WeightedRest rest = weighted_rest(setup.body, membership_counts(clusters, setup.body.particle_count()));
  RestFrameSpread spread;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const ClusterMeans fresh = cluster_means(rest, clusters, rest.position, c);
    spread.center.add(norm(clusters.rest_center[at(c)] - fresh.rest) / setup.body.grid.spacing, c);
    spread.mass.add(std::abs(clusters.mass[at(c)] - fresh.mass) / fresh.mass, c);
  }
  return spread;
}

Spread skins_apart(const Setup& setup, const Skin& expected, const Skin& actual) {
  const auto wanted = vertex_order(expected), found = vertex_order(actual);
  Spread spread;
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    const Vec3 apart = actual.position[at(found[k])] - expected.position[at(wanted[k])];
    spread.add(norm(apart) / setup.body.grid.spacing, expected.owner[at(wanted[k])]);
  }
  return spread;
}

std::optional<Difference> topological_difference(const State& expected, const State& actual, bool sets_are_open) {
  const auto say = [](std::string text) { return Difference{std::move(text), {}, {}}; };
  if (expected.frame != actual.frame) {
    return say(fmt::format("the state is of frame {}, but of {} in the reference", actual.frame, expected.frame));
  }
  if (auto found = difference_of_lists(expected.removed, actual.removed, "removed")) return found;
  if (auto found = difference_of_lists(expected.debris, actual.debris, "debris")) return found;
  if (expected.alive != actual.alive) {
    const auto [w, f] = std::mismatch(expected.alive.begin(), expected.alive.end(), actual.alive.begin());
    const auto particle = static_cast<int32_t>(w - expected.alive.begin());
    return Difference{
        fmt::format("particle {} is alive {}", particle, *f ? "here only" : "in the reference only"), {}, {particle}};
  }
  if (expected.tau != actual.tau || expected.cap != actual.cap) {
    return say(fmt::format("tau and cap are {} and {}, but {} and {} in the reference", actual.tau, actual.cap,
                           expected.tau, expected.cap));
  }
  if (!sets_are_open) {
    if (auto found = difference_of_clusters(expected.clusters, actual.clusters)) return found;
    if (expected.edge_covered != actual.edge_covered) {
      return say(
          fmt::format("edge_covered is {}, but {} in the reference", actual.edge_covered, expected.edge_covered));
    }
  }
  return difference_of_skins(expected.skin, actual.skin);
}

double greatest_neighbour_distance(const Setup& setup, const State& state, int32_t particle) {
  double greatest = 0;
  for (int direction = 0; direction < 6; ++direction) {
    const int32_t other = setup.body.neighbour(particle, direction);
    if (other < 0 || !state.alive[at(other)]) continue;
    greatest = std::max(greatest, norm(state.x[at(particle)] - state.x[at(other)]));
  }
  return greatest;
}

}  // namespace cutproof::oracles
