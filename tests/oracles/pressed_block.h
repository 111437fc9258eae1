// A step in which everything acts: contacts, friction, a grip, a blade, spin and bending.
#pragma once
#include "model/setup.h"
#include "model/state.h"
#include "reference_cpu/reference.h"
#include "tests/oracles/expectations.h"

namespace cutproof::tests {

inline constexpr double kSpacing = 0.01;

struct StepScene {
  cutproof::Setup setup;
  State before, after;
  void take_step() {
    after = before;
    reference::step(setup, after);
  }
};

// A bent, spinning block on a floor with friction, held at one end, with a blade that presses its middle.
inline StepScene pressed_block(Solver solver = Solver::implicit, Acceleration acceleration = Acceleration::none,
                               double retardation = 0, double volume_share = 0) {
  StepScene scene{setup_of(block_body(9, 5, 4, kSpacing, 0.002)), {}, {}};
  cutproof::Setup& setup = scene.setup;
  setup.step.solver = solver;
  setup.step.acceleration = acceleration;
  setup.step.gravity = {1, -2, -9.81};
  setup.step.damping = 3;
  setup.step.retardation = retardation;
  setup.step.volume_share = volume_share;
  setup.walls = {{.axis = 2, .side = +1, .offset = 0.0102, .friction = 0.4}};
  setup.grips = {{.particles = {0, 9, 18}, .active = {1, 1, 0, 1}, .displacement = {4, Vec3{0.001, 0, 0.0005}}}};
  setup.has_blade = true;
  setup.blade = {0.1, 0.1, 0.004, 0.2};
  BladeMove move;
  move.down = true;
  move.from = {{0.051, 0.03, 0.041}, {0, 1, 0}, {0, 0, 1}};
  move.to = move.from;
  for (int k = 0; k < 4; ++k) {
    move.to.edge.z -= 0.001;
    setup.blade_moves.push_back(move);
    move.from = move.to;
  }
  setup.stroke_end = {0};
  scene.before = state_of(setup.body, box_clusters(9, 5, 4, 3));
  for (std::size_t i = 0; i < scene.before.x.size(); ++i) {
    Vec3& x = scene.before.x[i];
    x.z += 3 * (x.x - 0.05) * (x.x - 0.05);
    scene.before.v[i] = {0.3 - 4 * x.y, 4 * x.x, -0.5};
  }
  scene.take_step();
  return scene;
}

// A particle in the middle of a block, away from blade, floor and grips.
inline constexpr std::size_t kInside = 2 + 9 * (2 + 5 * 2);

}  // namespace cutproof::tests
