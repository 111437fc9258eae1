// The twisted block of tolerances.md, Reference solution, and the same one among walls and a grip: a first substep that
// is far from its answer.
#pragma once
#include <cmath>

#include "tests/oracles/states.h"

namespace cutproof::testing {

struct Scene {
  Setup setup;
  State state;
};

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

}  // namespace cutproof::testing
