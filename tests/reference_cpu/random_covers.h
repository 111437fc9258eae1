// Random bodies and random families of connected sets that cover them (I1, I2 and nothing more), and what tests ask
// of such families by brute force. Nothing here is taken from reference_cpu/.
#pragma once
#include <algorithm>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <random>
#include <set>
#include <vector>

#include "tests/oracles/states.h"

namespace cutproof::tests {

using ParticleSet = std::set<int32_t>;

inline int32_t draw(std::mt19937& random, int32_t low, int32_t high) {
  return low + static_cast<int32_t>(random() % static_cast<uint32_t>(high - low + 1));
}

// Each node of a box of nodes is tissue with the given chance.
inline Body random_body(std::mt19937& random, Node size, double chance) {
  std::vector<Node> nodes;
  for (int32_t k = 0; k < size[2]; ++k) {
    for (int32_t j = 0; j < size[1]; ++j) {
      for (int32_t i = 0; i < size[0]; ++i) {
        if (static_cast<double>(random()) < chance * 4294967296.0) nodes.push_back({i, j, k});
      }
    }
  }
  return body_of(nodes);
}

inline std::vector<int32_t> neighbours_of(const Body& body, int32_t particle) {
  std::vector<int32_t> neighbours;
  for (int direction = 0; direction < 6; ++direction) {
    if (const int32_t q = body.neighbour(particle, direction); q >= 0) neighbours.push_back(q);
  }
  return neighbours;
}

// Connected sets of at most `most` particles, grown from random particles until every particle is covered.
inline Lists random_cover(std::mt19937& random, const Body& body, int32_t most) {
  ParticleSet uncovered;
  for (int32_t p = 0; p < body.particle_count(); ++p) uncovered.insert(p);
  Lists lists;
  while (!uncovered.empty()) {
    const auto start = std::next(uncovered.begin(), draw(random, 0, static_cast<int32_t>(uncovered.size()) - 1));
    ParticleSet set = {*start};
    const auto wanted = static_cast<std::size_t>(draw(random, 1, most));
    for (int32_t attempt = 0; attempt < 8 * most && set.size() < wanted; ++attempt) {
      const auto from = std::next(set.begin(), draw(random, 0, static_cast<int32_t>(set.size()) - 1));
      const auto around = neighbours_of(body, *from);
      if (!around.empty()) set.insert(around[random() % around.size()]);
    }
    for (const int32_t p : set) uncovered.erase(p);
    lists.emplace_back(set.begin(), set.end());
  }
  return lists;
}

inline bool is_connected(const Body& body, const std::vector<int32_t>& members) {
  if (members.empty()) return false;
  ParticleSet left(members.begin(), members.end());
  std::vector<int32_t> reached = {*left.begin()};
  left.erase(left.begin());
  for (std::size_t next = 0; next < reached.size(); ++next) {
    for (const int32_t q : neighbours_of(body, reached[next])) {
      if (left.erase(q) > 0) reached.push_back(q);
    }
  }
  return left.empty();
}

// The partition of the particles (label = smallest particle of the class) that the given pairs generate.
class Classes {
 public:
  explicit Classes(int32_t count) : parent_(static_cast<std::size_t>(count)) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  int32_t label(int32_t p) const {
    while (parent_[static_cast<std::size_t>(p)] != p) p = parent_[static_cast<std::size_t>(p)];
    return p;
  }
  void join(int32_t a, int32_t b) {
    const int32_t la = label(a), lb = label(b);
    parent_[static_cast<std::size_t>(std::max(la, lb))] = std::min(la, lb);
  }
  std::vector<int32_t> labels() const {
    std::vector<int32_t> all;
    for (std::size_t p = 0; p < parent_.size(); ++p) all.push_back(label(static_cast<int32_t>(p)));
    return all;
  }

 private:
  std::vector<int32_t> parent_;
};

// Labels of the components of G; dead particles stand alone.
inline std::vector<int32_t> graph_labels(const Body& body, const std::vector<uint8_t>& alive) {
  Classes classes(body.particle_count());
  for (int32_t p = 0; p < body.particle_count(); ++p) {
    for (const int32_t q : neighbours_of(body, p)) {
      if (alive[static_cast<std::size_t>(p)] && alive[static_cast<std::size_t>(q)]) classes.join(p, q);
    }
  }
  return classes.labels();
}

// Labels of the components of "shares a cluster".
inline std::vector<int32_t> coupling_labels(const Body& body, const Lists& lists) {
  Classes classes(body.particle_count());
  for (const auto& list : lists) {
    for (const int32_t p : list) classes.join(list.front(), p);
  }
  return classes.labels();
}

// Edges of G (alive ends) that no set contains.
inline int64_t uncovered_edges(const Body& body, const std::vector<uint8_t>& alive, const Lists& lists) {
  std::set<std::pair<int32_t, int32_t>> edges;
  for (int32_t p = 0; p < body.particle_count(); ++p) {
    for (const int32_t q : neighbours_of(body, p)) {
      if (p < q && alive[static_cast<std::size_t>(p)] && alive[static_cast<std::size_t>(q)]) edges.insert({p, q});
    }
  }
  for (const auto& list : lists) {
    const ParticleSet set(list.begin(), list.end());
    for (const int32_t p : list) {
      for (const int32_t q : neighbours_of(body, p)) {
        if (set.count(q) > 0) edges.erase({std::min(p, q), std::max(p, q)});
      }
    }
  }
  return static_cast<int64_t>(edges.size());
}

}  // namespace cutproof::tests
