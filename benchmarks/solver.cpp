#include "benchmarks/solver.h"

#include <algorithm>
#include <cmath>

#include "benchmarks/scene.h"
#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "oracles/comparison/reference_solution.h"
#include "oracles/comparison/state_difference.h"
#include "oracles/relations/relations.h"

namespace cutproof::benchmarks {

namespace {

constexpr double kFrameLength = 0.004;  // [s]

// Twisted about the longest axis and stretched along it at the end of the frame's free motion.
void throw_body(ReadyScene& scene, double twist, double stretch) {
  const Body& body = scene.setup.body;
  Vec3 low, high;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    const Vec3 x = body.rest_position(i);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = i == 0 ? x[axis] : std::min(low[axis], x[axis]);
      high[axis] = i == 0 ? x[axis] : std::max(high[axis], x[axis]);
    }
  }
  const Vec3 extent = high - low;
  const int along = extent.x > extent.y && extent.x > extent.z ? 0 : extent.y > extent.z ? 1 : 2;
  const int u = (along + 1) % 3, v = (along + 2) % 3;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    const Vec3 d = body.rest_position(i) - 0.5 * (low + high);
    const double angle = twist * d[along] / extent[along];
    Vec3 end;
    end[u] = d[u] * std::cos(angle) - d[v] * std::sin(angle);
    end[v] = d[u] * std::sin(angle) + d[v] * std::cos(angle);
    end[along] = stretch * d[along];
    scene.state.v[static_cast<std::size_t>(i)] = (end - d) / kFrameLength;
  }
}

// One frame of so many substeps; held particles stay in place.
void divide_frame(Setup& setup, int32_t substeps) {
  setup.step.substeps = substeps;
  setup.substep_length = {kFrameLength / substeps};
  for (Grip& grip : setup.grips) {
    grip.active.assign(static_cast<std::size_t>(substeps), 1);
    grip.displacement.assign(static_cast<std::size_t>(substeps), {});
  }
}

// Only the step, in one frame of one substep.
void keep_the_step(Setup& setup) {
  setup.step.damping = 0;
  remove_nothing(setup.detect);
  setup.skin.wanted = false;
  setup.has_blade = false;
  setup.blade_moves.clear();
  setup.stroke_end.clear();
  divide_frame(setup, 1);
}

}  // namespace

ReadyScene make_block_scene() {
  ReadyScene scene;
  scene.name = "block";
  scene.setup.body = fixtures::block(12, 12, 12, 0.01);
  keep_the_step(scene.setup);
  ClusterSpec clusters;
  clusters.side = 4;
  scene.state = fixtures::cook(scene.setup.body, clusters, scene.setup.expand, scene.setup.merge, 1);
  throw_body(scene, 3.0, 1.8);
  return scene;
}

ReadyScene make_body_scene(int64_t particles) {
  BenchScene bench = make_bench_scene(particles, 1);
  ReadyScene scene{std::move(bench.name), std::move(bench.setup), std::move(bench.state)};
  keep_the_step(scene.setup);
  throw_body(scene, 1.0, 1.2);
  return scene;
}

Setup with_substeps(const ReadyScene& scene, int32_t substeps) {
  Setup setup = scene.setup;
  divide_frame(setup, substeps);
  return setup;
}

FrameSolution converged_frame(const Setup& setup, const State& state) {
  // Every substep is like the first: no blade, and held particles stay in place.
  const Setup single = oracles::single_substep_setup(setup, 0);
  const double dt = single.substep_length[0], decay = std::exp(-single.step.damping * dt);
  FrameSolution solution;
  State now = state;
  for (int32_t substep = 0; substep < setup.step.substeps; ++substep) {
    oracles::ReferenceSolution converged = oracles::reference_solution(single, now);
    solution.converged &= converged.converged;
    for (std::size_t i = 0; i < now.x.size(); ++i) now.v[i] = (decay / dt) * (converged.x[i] - now.x[i]);
    now.x = std::move(converged.x);
    now.clusters.rotation = std::move(converged.rotation);
    solution.energy = converged.energy;
  }
  if (setup.step.substeps > 1) solution.energy.reset();
  solution.x = std::move(now.x);
  return solution;
}

SolverError solver_error(Backend& backend, const Setup& setup, const State& state, const FrameSolution& solution) {
  backend.load({setup}, {state});
  backend.run(kStep);
  const State reached = backend.snapshot().front();
  SolverError error;
  error.position = oracles::position_error(setup, solution.x, reached.x, state.alive);
  if (solution.energy) {
    error.energy_gap = (oracles::substep_energy(setup, state, reached.x) - *solution.energy) / *solution.energy;
  }
  return error;
}

std::optional<int32_t> least_iterations(Backend& backend, Setup setup, const State& state,
                                        const FrameSolution& solution, double tolerance, int32_t above, int32_t below) {
  for (int32_t iterations = above + 1; iterations <= below; ++iterations) {
    setup.step.iterations = iterations;
    if (solver_error(backend, setup, state, solution).position.max < tolerance) return iterations;
  }
  return std::nullopt;
}

}  // namespace cutproof::benchmarks
