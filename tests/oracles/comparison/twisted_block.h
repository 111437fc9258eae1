// The twisted block of tolerances.md, Reference solution, and the same one among walls and a grip: a first substep that
// is far from its answer.
#pragma once
#include <cmath>

#include "tests/oracles/states.h"

namespace cutproof::tests {

// A block of side³ particles, twisted about z and stretched along it by velocities: at the end of the free motion the
// two ends are turned against each other by `twist`, and everything is `stretch` times as long.
inline Scene twisted_block(int32_t side, double twist, double stretch, double spacing = 1.0) {
  Scene scene{setup_of(block_body(side, side, side, spacing)), {}};
  scene.setup.step.substeps = 1;
  scene.state = state_of(scene.setup.body, box_clusters(side, side, side, 4));
  const double middle = (side + 1) / 2.0 * spacing;
  const double dt = scene.setup.substep_length[0];
  for (std::size_t i = 0; i < scene.state.x.size(); ++i) {
    const Vec3 d = scene.state.x[i] - Vec3{middle, middle, middle};
    const double a = twist * d.z / ((side - 1) * spacing);
    const Vec3 end = {d.x * std::cos(a) - d.y * std::sin(a), d.x * std::sin(a) + d.y * std::cos(a), d.z * stretch};
    scene.state.v[i] = (end - d) / dt;
  }
  return scene;
}

// A block thrown against a floor and a side wall, with a grip that lifts one edge.
inline Scene obstructed_block(double stiffness) {
  Scene scene = twisted_block(6, 0.7, 1.2, 0.01);
  scene.setup.step.stiffness = stiffness;
  scene.setup.step.gravity = {0, 0, -9.81};
  scene.setup.walls = {{.axis = 2, .side = +1, .offset = 0.012}, {.axis = 0, .side = -1, .offset = 0.055}};
  scene.setup.grips = {{.particles = {5, 11, 17}, .active = {1}, .displacement = {Vec3{0.002, 0, 0.006}}}};
  for (Vec3& v : scene.state.v) v += Vec3{1.0, 0, -3.0};
  return scene;
}

// A block that falls on a floor while a blade, at a slant, is pressed into its top: both with the same friction.
inline Scene pressed_block(double stiffness, double friction) {
  Scene scene = twisted_block(6, 0.4, 1.1, 0.01);
  scene.setup.step.stiffness = stiffness;
  scene.setup.step.gravity = {0, 0, -9.81};
  scene.setup.walls = {{.axis = 2, .side = +1, .offset = 0.009, .friction = friction}};
  scene.setup.has_blade = true;
  scene.setup.blade = {0.05, 0.04, 0.004, friction};
  const Vec3 along = normalized(Vec3{1, 0.2, 0.1}), back = normalized(cross(cross(along, Vec3{0, 0.3, 1}), along));
  const BladePose from = {{0.034, 0.0362, 0.055}, along, back}, to = {{0.034, 0.0362, 0.052}, along, back};
  scene.setup.blade_moves = {{from, to, true, 0}};
  for (Vec3& v : scene.state.v) v += Vec3{0.6, 0.2, -1.0};
  return scene;
}

}  // namespace cutproof::tests
