// The remaining parts, in a substep, of the shape and motion with which a particle began the frame.
//
// A particle began the frame at d = D + u with velocity v = V + m; D and V belong to its group. Until its group is
// touched, it moves by b v + T + (a - 1) u + A(r). The map T + A(r) is its group's; the numbers a and b are its body's
// (docs/design/method.md §13). All particles of a group are uniform where u and m are zero. Such a group stores D + b V
// + T in place of T, and adds nothing to where a particle was. Its particles then have the bits of loose particles that
// move alike.
#pragma once
#include "gpu/kernels/step/prediction.cuh"
#include "gpu/state/device_view.h"

namespace cutproof::gpu::step_detail {

// The remaining parts of the shape u and of the motion v in a displacement or in a velocity.
struct Parts {
  float shape, motion;  // a - 1, which may be small; b
};
struct FrameParts {
  Parts place, velocity;
};
// At the start of a frame.
CUTPROOF_DEVICE inline FrameParts first_parts() { return {{0, 0}, {0, 1}}; }
// In the prediction of a substep that begins with `now`.
CUTPROOF_DEVICE inline Parts predicted_parts(const Pace& pace, const FrameParts& now) {
  return {now.place.shape + pace.prediction_time * now.velocity.shape,
          now.place.motion + pace.prediction_time * now.velocity.motion};
}
// A moment of the remaining u and v, from the moments of u and of v - V.
CUTPROOF_DEVICE inline float own_moment(const Parts& now, float of_shape, float of_motion) {
  return (1.0f + now.shape) * of_shape + now.motion * of_motion;
}
// After a substep that began with `now`. (Computed once a frame, so no test for retardation is needed.)
CUTPROOF_DEVICE inline FrameParts parts_after(const Pace& pace, float lost, const FrameParts& now) {
  const Parts predicted = predicted_parts(pace, now);
  FrameParts next;
  next.place = {x_between<true>(pace, now.place.shape, predicted.shape - lost * (1.0f + predicted.shape)),
                x_between<true>(pace, now.place.motion, predicted.motion - lost * predicted.motion)};
  next.velocity = {pace.decay_per_dt * (next.place.shape - now.place.shape),
                   pace.decay_per_dt * (next.place.motion - now.place.motion)};
  return next;
}
CUTPROOF_DEVICE inline Float4* parts_of(const DeviceView& w, int body, int substep) {
  return &w.parts[int64_t{body} * (w.most_substeps + 1) + substep];
}
CUTPROOF_DEVICE inline FrameParts load_parts(const DeviceView& w, int body, int substep) {
  const Float4 parts = constant(parts_of(w, body, substep));
  return {{parts.x, parts.y}, {parts.z, parts.w}};
}

}  // namespace cutproof::gpu::step_detail
