// What several oracles of topology need: grid edges between alive particles, disjoint sets, and verdicts that are not
// judged because the state is not well formed. Internal to oracles/.
#pragma once
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "model/at.h"
#include "model/fields.h"
#include "model/verdict.h"
#include "oracles/memberships.h"
#include "oracles/partitions.h"

namespace cutproof::oracles {

// The graph G of a well-formed state (method.md §1). `alive` may be that of another moment.
class TissueGraph {
 public:
  TissueGraph(const Body& body, const std::vector<uint8_t>& alive) : body_(body), alive_(alive) {
    for (int direction = 0; direction < 6; ++direction) steps_[at(direction)] = body.grid.step(direction);
  }
  int32_t particle_count() const { return body_.particle_count(); }
  bool alive(int32_t particle) const { return alive_[at(particle)] != 0; }
  // The particle at the other end of the edge of G that leaves an alive particle along kDirections[direction], or -1.
  int32_t neighbour(int32_t particle, int direction) const {
    const int32_t other = body_.particle_at[at(body_.node[at(particle)] + steps_[at(direction)])];
    return other >= 0 && alive_[at(other)] != 0 ? other : -1;
  }

 private:
  const Body& body_;
  const std::vector<uint8_t>& alive_;
  std::array<int64_t, 6> steps_ = {};
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

// A verdict that holds so far.
inline Verdict start_verdict(std::string property, const State& state, std::string unit, std::string bound_source) {
  Verdict verdict;
  verdict.property = std::move(property);
  verdict.frame = state.frame;
  verdict.unit = std::move(unit);
  verdict.bound_source = std::move(bound_source);
  return verdict;
}

// Counts one more violation; the first one is the witness.
inline void violate(Verdict& verdict, Witness witness) {
  if (verdict.holds) verdict.witness = std::move(witness);
  verdict.holds = false;
  verdict.measured += 1;
}
inline void violate(Verdict& verdict, std::string text, std::vector<int32_t> clusters = {},
                    std::vector<int32_t> particles = {}, std::vector<int32_t> path = {}) {
  violate(verdict, Witness{std::move(clusters), std::move(particles), std::move(path), std::move(text)});
}

// A verdict as it is given out. What was measured against a bound says nothing where one of the two is not finite, so
// it does not hold; and where nothing was checked it says why: `nothing`, unless the check has said so itself.
inline Verdict conclude(Verdict verdict, std::string_view nothing) {
  if (verdict.holds && !(std::isfinite(verdict.measured) && std::isfinite(verdict.bound))) {
    verdict.holds = false;
    verdict.witness.text = fmt::format("what was measured, {} {}, or its bound, {} {}, is not finite", verdict.measured,
                                       verdict.unit, verdict.bound, verdict.unit);
  }
  const bool is_vacuous = verdict.holds && verdict.checked == 0;
  if (!is_vacuous) verdict.vacuous.clear();
  if (is_vacuous && verdict.vacuous.empty()) verdict.vacuous = nothing;
  return verdict;
}

// The answer of every oracle on a state that is not well formed. `form` is the failing verdict of well_formed.
inline Verdict not_judged(std::string property, const Verdict& form) {
  Verdict verdict = form;
  verdict.property = std::move(property);
  verdict.witness.text = "not judged: the state is not well formed: " + form.witness.text;
  verdict.checked = 0;
  return verdict;
}

// The partitions themselves, of a well-formed state.
Partition components_of_graph(const TissueGraph& graph);
Partition components_of_coupling(const TissueGraph& graph, const Clusters& clusters);
// How many different pairs of labels occur among particles. Equal to a.count exactly if a refines b, and to b.count
// exactly if b refines a.
int64_t distinct_pairs(const Partition& a, const Partition& b);

struct Edge {
  int32_t a = -1, b = -1;
};

// The first edge of G that no cluster contains, and how many there are, in a well-formed state (I4).
struct UncoveredEdges {
  int64_t edges = 0;  // of G
  int64_t uncovered = 0;
  int32_t a = -1, b = -1;  // ends of the first one
};
UncoveredEdges uncovered_edges(const TissueGraph& graph, const Clusters& clusters);
// [3 n] 1 where some cluster contains both ends of the grid edge from particle i along axis d: entry 3 i + d.
std::vector<uint8_t> covered_edges(const TissueGraph& graph, const Clusters& clusters);

}  // namespace cutproof::oracles
