// Oracles that need two runs of one backend (oracles_and_tests.md §1). Each loads, runs and compares; the backend is
// used only through its contract, so they judge any backend.
#pragma once
#include "model/backend.h"
#include "model/verdict.h"

namespace cutproof::oracles {

// Every particle of every other component ends `frames` frames with the same bits when the component of `particle`
// is kicked: displaced by `kick` and given the velocity `kick` / dt.
Verdict no_ghost_force(Backend& backend, const Setup& setup, const State& state, int32_t particle, Vec3 kick, int64_t frames);
// Same input, same bits, over `frames` frames.
Verdict determinism(Backend& backend, const Setup& setup, const State& state, int64_t frames);
// A frame equals the composition of its spans, bit for bit: whole, six single stages, and every cut in two.
Verdict span_composition(Backend& backend, const Setup& setup, const State& state, int64_t frames);
// The same scene turned by a multiple of 90°, mirrored axes excluded; shifted on the grid; scaled by a power of two;
// particles and clusters renumbered; duplicated as two bodies: same answer, carried along (method in
// oracles_and_tests.md §1). `seed` chooses.
Verdict equivariance(Backend& backend, const Setup& setup, const State& state, Span span, uint64_t seed);
// Geometric cuts: what is separate after fewer strokes stays separate after more (setup with all strokes, without
// the last).
Verdict refinement(Backend& backend, const Setup& more, const State& state, int64_t fewer_frames);
// The rest state (no gravity, no blade, no contact) does not move in one substep.
Verdict rest_is_fixed(Backend& backend, const Setup& setup, const State& state);
// A rigid translation is reproduced exactly (no damping, pins, friction).
Verdict translation_is_exact(Backend& backend, const Setup& setup, const State& state, Vec3 velocity);
// Implicit: E(x_k) never grows over k = 0 .. iterations in one substep (iterates from runs with k iterations).
Verdict energy_is_monotone(Backend& backend, const Setup& setup, const State& state, int32_t iterations);

}  // namespace cutproof::oracles
