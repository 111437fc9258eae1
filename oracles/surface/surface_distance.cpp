#include "oracles/surface/surface_distance.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace cutproof::oracles {

namespace {

// Nothing is decided here, only measured: no exact predicates are needed.
using Cartesian = CGAL::Simple_cartesian<double>;
using Triangle = Cartesian::Triangle_3;
using Primitive = CGAL::AABB_triangle_primitive<Cartesian, std::vector<Triangle>::const_iterator>;
using Triangles = CGAL::AABB_tree<CGAL::AABB_traits<Cartesian, Primitive>>;
using Neighbours = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<Cartesian>>;

Cartesian::Point_3 point(Vec3 p) { return {p.x, p.y, p.z}; }

}  // namespace

std::vector<double> distances_to(const std::vector<std::array<Vec3, 3>>& triangles, const std::vector<Vec3>& points,
                                 const std::vector<Vec3>& from) {
  std::vector<Triangle> kept;
  for (const auto& [a, b, c] : triangles) {
    if (norm(cross(b - a, c - a)) > 0) kept.emplace_back(point(a), point(b), point(c));
  }
  const Triangles tree(kept.begin(), kept.end());
  Neighbours::Tree neighbours;
  for (const Vec3 p : points) neighbours.insert(point(p));

  std::vector<double> distances;
  distances.reserve(from.size());
  for (const Vec3 p : from) {
    double squared = std::numeric_limits<double>::infinity();
    if (!kept.empty()) squared = tree.squared_distance(point(p));
    if (!points.empty()) {
      const Neighbours search(neighbours, point(p), 1);
      squared = std::min(squared, search.begin()->second);
    }
    distances.push_back(std::sqrt(squared));
  }
  return distances;
}

}  // namespace cutproof::oracles
