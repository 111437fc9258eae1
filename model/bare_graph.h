// Bodies that are given as a graph alone.
#pragma once
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "model/at.h"
#include "model/body.h"

namespace cutproof {

// The first defect of the edges of a bare graph, or "". Offsets must run from 0 to the number of ends. Edges must lead
// to existing particles. Each edge must be listed once at each of its ends.
inline std::string problem_of_edges(const Body& body) {
  const std::vector<int64_t>& offsets = body.edge_offsets;
  const auto n = static_cast<int32_t>(body.rest.size());
  const auto said = [](auto... part) { return (std::string() + ... + part); };
  const auto number = [](auto k) { return std::to_string(k); };
  if (offsets.size() != body.rest.size() + 1) {
    return said("there are ", number(offsets.size()), " offsets of edges for ", number(n), " particles");
  }
  if (offsets.front() != 0 || offsets.back() != static_cast<int64_t>(body.edge_ends.size())) {
    return said("offsets of edges run from ", number(offsets.front()), " to ", number(offsets.back()),
                ", not from 0 to ", number(body.edge_ends.size()));
  }
  for (int32_t i = 0; i < n; ++i) {
    if (offsets[at(i)] > offsets[at(i + 1)]) return said("offsets of edges descend at particle ", number(i));
  }
  std::vector<std::vector<int32_t>> ends(at(n));
  for (int32_t i = 0; i < n; ++i) {
    std::vector<int32_t>& of_i = ends[at(i)];
    of_i.assign(body.edge_ends.begin() + offsets[at(i)], body.edge_ends.begin() + offsets[at(i + 1)]);
    for (const int32_t end : of_i) {
      if (end < 0 || end >= n) return said("an edge leads from particle ", number(i), " to ", number(end));
      if (end == i) return said("an edge leads from particle ", number(i), " to itself");
    }
    std::sort(of_i.begin(), of_i.end());
    if (const auto twice = std::adjacent_find(of_i.begin(), of_i.end()); twice != of_i.end()) {
      return said("the edge from particle ", number(i), " to ", number(*twice), " is there twice");
    }
  }
  for (int32_t i = 0; i < n; ++i) {
    for (const int32_t other : ends[at(i)]) {
      if (std::binary_search(ends[at(other)].begin(), ends[at(other)].end(), i)) continue;
      return said("the edge from particle ", number(i), " to ", number(other), " is not there the other way");
    }
  }
  return "";
}

// Adds edges to a body that has its particles. An edge may be listed at one end or both, and repeatedly. Requires that
// edges join different particles.
inline void set_edges(Body& body, std::vector<std::pair<int32_t, int32_t>> edges) {
  for (std::size_t k = edges.size(); k-- > 0;) edges.emplace_back(edges[k].second, edges[k].first);
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  body.edge_offsets.assign(body.rest.size() + 1, 0);
  for (const auto& [a, b] : edges) {
    ++body.edge_offsets[at(a) + 1];
    body.edge_ends.push_back(b);
  }
  std::partial_sum(body.edge_offsets.begin(), body.edge_offsets.end(), body.edge_offsets.begin());
}

// The same tissue without its grid.
inline Body as_bare_graph(const Body& body) {
  Body bare = body;
  bare.grid.nodes = {0, 0, 0};
  bare.node.clear();
  bare.particle_at.clear();
  bare.surface_crossing.clear();
  bare.rest.clear();
  bare.edge_ends.clear();
  bare.edge_offsets = {0};
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    bare.rest.push_back(body.rest_position(i));
    for (const int32_t other : body.neighbours(i)) bare.edge_ends.push_back(other);
    bare.edge_offsets.push_back(static_cast<int64_t>(bare.edge_ends.size()));
  }
  return bare;
}

}  // namespace cutproof
