// How far a state of a backend is from the reference's: distances where a distance makes sense, and equality where only
// equality does (accuracy_and_speed.md §1, implementation and topology).
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "oracles/comparison/errors.h"
#include "oracles/comparison/step_comparison.h"

namespace cutproof::oracles {

// Distances of positions of the particles in `mask` [h]. Both states need one position per particle.
Spread positions_apart(const Setup& setup, const State& expected, const State& actual,
                       const std::vector<uint8_t>& mask);
// Rest centers [h] and masses [1] against those recomputed from the state's own memberships.
struct RestFrameSpread {
  Spread center, mass;
};
RestFrameSpread rest_frames_apart(const Setup& setup, const State& actual);

// Positions of skin vertices [h], vertices matched by (owner, direction). Requires equal topology.
Spread skins_apart(const Setup& setup, const Skin& expected, const Skin& actual);

// A difference for which there is no "close".
struct Difference {
  std::string text;
  std::vector<int32_t> clusters;  // numbers
  std::vector<int32_t> particles;
};
// The first difference in anything but numbers of arithmetic: alive and removed particles, debris, clusters as sets
// with their numbers, tau, cap, edge_covered, frame, skin vertices and triangles up to rotation. `sets_are_open`: the
// rule leaves several answers, so clusters and edge_covered are not compared.
std::optional<Difference> topological_difference(const State& expected, const State& actual, bool sets_are_open);

// d_i of method.md §4, among neighbours alive in `state` [m].
double greatest_neighbour_distance(const Setup& setup, const State& state, int32_t particle);

}  // namespace cutproof::oracles
