// Elasticity acts on the points y = x + τ v of a body with retardation τ (docs/design/method.md §3). Predictions and
// iterates are such points: they lie dt + τ ahead of the start of the substep. In the time dt a particle comes
// dt / (dt + τ) of the way to its y, which is x.
//
// kRetarded: some body of the load has retardation. The kernels of other loads contain no code for it, and their x is
// y.
#pragma once
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// The predicted y of a particle with displacement d and velocity v at the start of the substep.
CUTPROOF_DEVICE inline Float3 predict(const Pace& pace, Float3 d, Float3 v) {
  return d + (pace.prediction_time * v + pace.fall);
}

// Whether the y of this body's particles differs from their x.
template <bool kRetarded>
CUTPROOF_DEVICE inline bool is_retarded(const Pace& pace) {
  return kRetarded && pace.dt_fraction != 1.0f;
}
// The x of a particle that starts at `start` and has this y. Number: a displacement, or a number that displacements are
// linear in.
template <bool kRetarded, class Number>
CUTPROOF_DEVICE inline Number x_between(const Pace& pace, Number start, Number y) {
  return is_retarded<kRetarded>(pace) ? start + pace.dt_fraction * (y - start) : y;
}
// The y of a particle that contacts have put at x. Without contacts it would have `free_x` and `free_y`. Without any
// displacement y has the bits of `free_y`.
template <bool kRetarded>
CUTPROOF_DEVICE inline Float3 y_ahead_of(const Pace& pace, Float3 x, Float3 free_x, Float3 free_y) {
  return is_retarded<kRetarded>(pace) ? free_y + (1.0f / pace.dt_fraction) * (x - free_x) : x;
}

// The x of the particle at place o with this y, which contacts may have displaced. With retardation x is stored:
// computed from y it would round, and particles held by friction would creep.
template <bool kRetarded>
CUTPROOF_DEVICE inline Float3 x_of(const DeviceView& w, const Pace& pace, int64_t o, Float3 y) {
  return is_retarded<kRetarded>(pace) ? xyz(w.place[o]) : y;
}

}  // namespace cutproof::gpu::step_detail
