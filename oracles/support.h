// Helpers of oracles of topology: grid edges between alive particles, disjoint sets, and verdicts of states that are
// not well formed. Internal to oracles/.
#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <iterator>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "model/at.h"
#include "model/fields.h"
#include "model/verdict.h"
#include "oracles/figures.h"
#include "oracles/memberships.h"
#include "oracles/partitions.h"
#include "oracles/registry.h"

namespace cutproof::oracles {

// The graph G of a well-formed state (method.md §1). `alive` may be that of another moment.
class TissueGraph {
 public:
  TissueGraph(const Body& body, const std::vector<uint8_t>& alive) : body_(body), alive_(alive) {}
  int32_t particle_count() const { return body_.particle_count(); }
  bool alive(int32_t particle) const { return alive_[at(particle)] != 0; }
  // The other ends of the edges of G at a particle, in the order of Body::neighbours; a dead one has none.
  Neighbours neighbours(int32_t particle) const { return ends(particle, -1); }
  // Only those with a greater number: over all particles each edge once.
  Neighbours upper_neighbours(int32_t particle) const { return ends(particle, particle); }

 private:
  Neighbours ends(int32_t particle, int32_t above) const {
    Neighbours found;
    if (!alive(particle)) return found;
    for (const int32_t other : body_.neighbours(particle)) {
      if (other > above && alive(other)) found.add(other);
    }
    return found;
  }

  const Body& body_;
  const std::vector<uint8_t>& alive_;
};

// Disjoint sets of 0 .. n - 1; the root of a set is its smallest element.
class DisjointSets {
 public:
  explicit DisjointSets(int64_t n) : parent_(at(n)) {
    for (std::size_t i = 0; i < parent_.size(); ++i) parent_[i] = static_cast<int32_t>(i);
  }
  int32_t find(int32_t i) {
    while (parent_[at(i)] != i) {
      parent_[at(i)] = parent_[at(parent_[at(i)])];
      i = parent_[at(i)];
    }
    return i;
  }
  void unite(int32_t a, int32_t b) {
    a = find(a);
    b = find(b);
    if (a < b) parent_[at(b)] = a;
    if (b < a) parent_[at(a)] = b;
  }

 private:
  std::vector<int32_t> parent_;
};

// The symmetric difference of two sets in any order; ascending.
struct SetDifference {
  std::vector<int32_t> only_first, only_second;
};
inline SetDifference set_difference(std::span<const int32_t> first, std::span<const int32_t> second) {
  const std::set<int32_t> a(first.begin(), first.end()), b(second.begin(), second.end());
  SetDifference found;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(found.only_first));
  std::set_difference(b.begin(), b.end(), a.begin(), a.end(), std::back_inserter(found.only_second));
  return found;
}

// The first element that only one of two ascending lists has. `in_second`: the second; nothing if they are equal.
template <class T>
struct OneSided {
  T element;
  bool in_second;
};
template <class T>
std::optional<OneSided<T>> first_in_one_only(const std::vector<T>& a, const std::vector<T>& b) {
  const auto [p, q] = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
  if (p == a.end() && q == b.end()) return std::nullopt;
  const bool in_second = p == a.end() || (q != b.end() && *q < *p);
  return OneSided<T>{in_second ? *q : *p, in_second};
}

// A verdict that holds so far.
inline Verdict start_verdict(std::string_view property, const State& state, std::string_view unit,
                             std::string_view bound_source) {
  Verdict verdict;
  verdict.property = property;
  verdict.frame = state.frame;
  verdict.unit = unit;
  verdict.bound_source = bound_source;
  return verdict;
}

// What a witness names: numbers of clusters, particles, particles along a path of G that shows it, and triangles of the
// skin, of which only the first kMostWitnessTriangles are kept.
struct Concerned {
  std::vector<int32_t> clusters = {}, particles = {}, path = {}, triangles = {};
};

// With a sentence for a person (oracles/figures.h).
template <class... Args>
Witness witness_of(Concerned concerned, fmt::format_string<Readable<Args>...> text, Args&&... args) {
  if (std::ssize(concerned.triangles) > kMostWitnessTriangles) concerned.triangles.resize(kMostWitnessTriangles);
  return {std::move(concerned.clusters), std::move(concerned.particles), std::move(concerned.path),
          sentence<Args...>(text, std::forward<Args>(args)...), std::move(concerned.triangles)};
}

// For a verdict that computes its measured value itself.
inline void fail(Verdict& verdict, Witness witness) {
  verdict.holds = false;
  verdict.witness = std::move(witness);
}
template <class... Args>
void fail(Verdict& verdict, Concerned concerned, fmt::format_string<Readable<Args>...> text, Args&&... args) {
  fail(verdict, witness_of<Args...>(std::move(concerned), text, std::forward<Args>(args)...));
}

// Counts one more violation; the first one is the witness.
template <class... Args>
void violate(Verdict& verdict, Concerned concerned, fmt::format_string<Readable<Args>...> text, Args&&... args) {
  if (verdict.holds) verdict.witness = witness_of<Args...>(std::move(concerned), text, std::forward<Args>(args)...);
  verdict.holds = false;
  verdict.measured += 1;
}

// Completes a verdict. A verdict with a measured value or bound that is not finite does not hold. A verdict without
// checks gives the reason `nothing`, unless the check has given one.
inline Verdict conclude(Verdict verdict, std::string_view nothing) {
  if (verdict.holds && !(std::isfinite(verdict.measured) && std::isfinite(verdict.bound))) {
    verdict.holds = false;
    verdict.witness.text = sentence("what was measured, {} {}, or its bound, {} {}, is not finite", verdict.measured,
                                    verdict.unit, verdict.bound, verdict.unit);
  }
  const bool is_vacuous = verdict.holds && verdict.checked == 0;
  if (!is_vacuous) verdict.vacuous.clear();
  if (is_vacuous && verdict.vacuous.empty()) verdict.vacuous = nothing;
  return verdict;
}

// The answer of every oracle on a state that is not well formed. `form` is the failing verdict of well_formed.
inline Verdict not_judged(std::string_view property, const Verdict& form) {
  Verdict verdict = form;
  verdict.property = property;
  verdict.witness.text = fmt::format("{}: the state is not well formed: {}", kNotJudged, form.witness.text);
  verdict.checked = 0;
  return verdict;
}

// The partitions themselves, of a well-formed state.
Partition components_of_graph(const TissueGraph& graph);
Partition components_of_coupling(const TissueGraph& graph, const Clusters& clusters);
// Number of different pairs of labels among particles. Equal to a.count exactly if a refines b, and to b.count exactly
// if b refines a.
int64_t distinct_pairs(const Partition& a, const Partition& b);

struct Edge {
  int32_t a = -1, b = -1;  // a < b
  friend auto operator<=>(const Edge&, const Edge&) = default;
};

// The edges of G that no cluster contains, ascending, and how many there are in all, in a well-formed state (I4).
struct UncoveredEdges {
  int64_t edges = 0;  // of G
  std::vector<Edge> uncovered;
};
UncoveredEdges uncovered_edges(const TissueGraph& graph, const Clusters& clusters);

}  // namespace cutproof::oracles
