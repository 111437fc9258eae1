#include "guests/tissue_arrays.h"

#include <algorithm>
#include <iterator>
#include <string_view>

#include "model/at.h"

namespace cutproof::guests {

namespace {

// Members of a struct, not arrays.
bool is_member(const Array& array) {
  constexpr std::string_view kMembers[] = {"spacing", "nodes", "gravity", "frame_time", "blades", "kick_frame"};
  return std::find(std::begin(kMembers), std::end(kMembers), array.name) != std::end(kMembers);
}

}  // namespace

Arrays tissue_arrays(const Body& body) {
  const int64_t n = body.particle_count();
  std::vector<int64_t> offsets = {0};
  std::vector<int32_t> ends, nodes;
  std::vector<double> rest;
  for (int32_t i = 0; i < n; ++i) {
    for (const int32_t other : body.neighbours(i)) ends.push_back(other);
    offsets.push_back(static_cast<int64_t>(ends.size()));
    const Vec3 place = body.rest_position(i);
    rest.insert(rest.end(), {place.x, place.y, place.z});
    if (!body.on_grid()) continue;
    const auto node = body.grid.coordinates(body.node[at(i)]);
    nodes.insert(nodes.end(), node.begin(), node.end());
  }
  Arrays arrays = {make_array("edge_offsets", {n + 1}, offsets),
                   make_array("edge_ends", {static_cast<int64_t>(ends.size())}, ends), make_array("rest", {n, 3}, rest),
                   make_array("mass", {n}, body.mass)};
  if (body.on_grid()) {
    arrays.push_back(make_array("node", {n, 3}, nodes));
    arrays.push_back(make_array("nodes", {3}, std::vector<int32_t>(body.grid.nodes.begin(), body.grid.nodes.end())));
  }
  arrays.push_back(make_array("spacing", {1}, std::vector<double>{body.grid.spacing}));
  return arrays;
}

Array in_precision_of_tissue(const Array& array, Precision precision) {
  return is_member(array) ? array : in_precision(array, precision);
}

Argument given_of_tissue(const Array& array) {
  Argument argument = given(array);
  if (is_member(array)) argument.role = Role::setup;
  return argument;
}

}  // namespace cutproof::guests
