// The numbers of a body in the frame in progress, which begin_frame_kernel computes once.
#pragma once
#include "gpu/kernels/step/frame_parts.cuh"
#include "gpu/kernels/step/iteration_numbers.cuh"
#include "gpu/state/device_view.h"

namespace cutproof::gpu::step_detail {

// e^(-x) for x >= 0, within 2 units in the last place, and with the same bits on every machine, unlike the libraries'
// expf.
CUTPROOF_DEVICE inline float decay_by(float x) {
  if (x > 87.0f) return 0.0f;  // e^(-88) is below the least normal number
  const float n = rintf(x * -1.44269504f);
  // ln 2 in two parts; the first is so short that n times it is exact.
  const float r = fmaf(n, -1.42860677e-6f, fmaf(n, -0.693145752f, -x));
  float sum = 1.0f / 5040.0f;
  sum = fmaf(sum, r, 1.0f / 720.0f);
  sum = fmaf(sum, r, 1.0f / 120.0f);
  sum = fmaf(sum, r, 1.0f / 24.0f);
  sum = fmaf(sum, r, 1.0f / 6.0f);
  sum = fmaf(sum, r, 0.5f);
  sum = fmaf(sum, r, 1.0f);
  sum = fmaf(sum, r, 1.0f);
  return ldexpf(sum, static_cast<int>(n));
}

// k dt (dt + τ). Without retardation it has the bits of k dt².
CUTPROOF_DEVICE inline float kdt2_of(const BodyConstants& body, const Pace& pace) {
  return body.stiffness * (pace.dt_fraction * pace.prediction_time) * pace.prediction_time;
}
CUTPROOF_DEVICE inline void store_numbers(const DeviceView& w, int body, const Pace& pace) {
  const float kdt2 = kdt2_of(w.body[body], pace);
  float lost = 0, lost_at_last = 0;
  IterationNumbers numbers = {};
  for (int iteration = 0; iteration <= pace.iterations; ++iteration) {
    numbers = iteration_numbers(pace, kdt2, iteration, numbers);
    *numbers_of(w, body, iteration) = numbers;
    lost = numbers.lost_before;
    if (iteration == pace.last_iterations) lost_at_last = lost;
  }
  FrameParts now = first_parts();
  for (int substep = 0; substep <= pace.substeps; ++substep) {
    *parts_of(w, body, substep) = {now.place.shape, now.place.motion, now.velocity.shape, now.velocity.motion};
    now = parts_after(pace, substep + 1 < pace.substeps ? lost : lost_at_last, now);
  }
}

CUTPROOF_DEVICE inline Pace pace_of(const DeviceView& w, int b) {
  const BodyConstants& body = w.body[b];
  Pace pace = {};
  pace.first_move = -1;
  if (!running(w, b)) return pace;
  pace.substeps = body.substeps;
  pace.iterations = body.iterations;
  pace.last_iterations = body.last_iterations;
  pace.frame = w.frame[b];
  pace.h = body.h;
  pace.per_h = 1.0f / body.h;
  const float dt = w.substep_length[body.frame_begin + pace.frame];
  pace.prediction_time = dt + body.retardation;
  pace.dt_fraction = dt / pace.prediction_time;
  const float kdt2 = kdt2_of(body, pace);
  pace.decay = decay_by(body.damping * dt);
  pace.decay_per_dt = pace.decay / dt;
  pace.s = body.solver == Solver::implicit ? kdt2 / (1.0f + kdt2) : body.relaxation;
  pace.volume_share = body.volume_share;
  pace.fall = (dt * pace.prediction_time) * body.gravity;
  pace.solver = body.solver;
  pace.acceleration = body.acceleration;
  for (int axis = 0; axis < 2; ++axis) pace.nodes[axis] = body.nodes[axis];
  pace.by_row = body.by_row;
  pace.by_layer = body.by_layer;
  // A geometric blade removes tissue and touches nothing.
  if (body.has_blade && body.criterion != Criterion::geometric) {
    pace.first_move = body.schedule + int64_t{pace.frame} * body.substeps;
  }
  pace.wall_begin = body.wall_begin;
  pace.wall_count = static_cast<short>(body.wall_end - body.wall_begin);
  pace.frictionless_walls = 1;
  for (int k = body.wall_begin; k < body.wall_end; ++k) {
    if (w.walls[k].friction != 0) pace.frictionless_walls = 0;
  }
  pace.half_length = 0.5f * body.blade_length;
  pace.depth = body.blade_depth;
  pace.clearance = body.clearance;
  pace.blade_friction = body.blade_friction;
  set_held_push(pace, kdt2, pace.iterations);
  return pace;
}
// The pace with which the last substep of a frame ends.
CUTPROOF_DEVICE inline Pace pace_at_end(const DeviceView& w, int body) {
  Pace pace = constant(&w.pace[body]);
  if (pace.last_iterations != pace.iterations) set_held_push(pace, kdt2_of(w.body[body], pace), pace.last_iterations);
  return pace;
}

}  // namespace cutproof::gpu::step_detail
