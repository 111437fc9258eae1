// Distances to a set of triangles and points. Internal to oracles/.
#pragma once
#include <array>
#include <vector>

#include "model/vec.h"

namespace cutproof::oracles {

// For each of `from` the distance to the nearest point of the triangles and of `points` (CGAL's tree of bounding
// boxes). Infinite if there is neither. Triangles without area are left out.
std::vector<double> distances_to(const std::vector<std::array<Vec3, 3>>& triangles, const std::vector<Vec3>& points,
                                 const std::vector<Vec3>& from);

}  // namespace cutproof::oracles
