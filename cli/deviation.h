// How far a state of a backend is from the reference's: distances where a distance makes sense, and equality where only
// equality does (accuracy_and_speed.md §1, implementation and topology).
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "oracles/errors.h"

namespace cutproof::cli {

using oracles::Spread;

// Distances of positions of the particles in `mask` [h]. Both states need one position per particle.
Spread positions_apart(const Setup& setup, const State& expected, const State& actual,
                       const std::vector<uint8_t>& mask);
// Differences of velocities of the particles in `mask`, as a part of h / dt.
Spread velocities_apart(const Setup& setup, const State& expected, const State& actual, double dt,
                        const std::vector<uint8_t>& mask);

// Rotations of the same clusters, compared where the best rotation of the cluster at expected.x is unique:
// (σ2 + σ3) / σ1 >= kUniqueRotation, with σ3 negative for a reflection.
inline constexpr double kUniqueRotation = 1e-4;
struct RotationSpread {
  Spread angle;  // [rad]
  // What moved positions of members would explain the angle: |angle| (σ2 + σ3) / (√2 Σ w |X - T|) [h]. Positions off by
  // δ change A by at most Σ w |X - T| δ, and this turns R by at most √2 / (σ2 + σ3) of that (docs/tolerances.md, One
  // substep).
  Spread displacement;
  std::vector<int32_t> either;  // clusters that differ, but whose rotation is not unique
  // Particles that such a rotation moves; a collinear cluster's free axis moves none of them.
  std::vector<int32_t> moved_by_either;
};
RotationSpread rotations_apart(const Setup& setup, const State& expected, const State& actual);

// Rest centers [h] and masses [1] against those recomputed by the reference from the state's own memberships.
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

// Greatest extent of the body at rest, over the three axes [h].
double body_extent(const Body& body);

// d_i of method.md §4, among neighbours alive in `state` [m].
double greatest_neighbour_distance(const Setup& setup, const State& state, int32_t particle);

}  // namespace cutproof::cli
