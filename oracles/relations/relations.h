// Relations between runs of one backend (metamorphic testing; oracles.md, Relations). Each loads, runs and compares;
// the backend is used only through its contract, so they judge any backend. If a backend cannot run a relation, the
// verdict is vacuous and gives the reason, and nothing throws. Target cutproof_relations.
#pragma once
#include <cstdint>

#include "model/backend.h"
#include "model/verdict.h"
#include "oracles/single_substep.h"

namespace cutproof::oracles {

// Every particle of every other component ends `frames` frames with the same bits when the component of `particle`
// is kicked: displaced by `kick` and given the velocity `kick` / dt. Neither run drops debris.
Verdict no_ghost_force(Backend& backend, const Setup& setup, const State& state, int32_t particle, Vec3 kick,
                       int64_t frames);
// Same input, same bits, over `frames` frames.
Verdict determinism(Backend& backend, const Setup& setup, const State& state, int64_t frames);
// A frame equals the composition of its spans, bit for bit: whole, six single stages, and every cut in two.
Verdict span_composition(Backend& backend, const Setup& setup, const State& state, int64_t frames);
// The same scene transformed must give the same answer, transformed (oracles.md, Relations). seed mod 6 chooses 0:
// turned by a multiple of 90° (mirrored axes excluded), which renumbers particles, and clusters in another order; as 1
// where the rule of detection depends on the order of particles (rules.h, RemovePromise); 1: shifted on the grid; 2:
// clusters in another order; 3: scaled by a power of two; 4: elsewhere in the world; 5: duplicated as two bodies. The
// rest of the seed chooses by how much. 3 to 5 in bits; 0 to 2: decisions, clusters and skin vertices exactly, numbers
// up to rounding (tolerances.md, A transformed scene), merge and expand up to ties, and the fans of the skin's polygons
// not at all (they follow the numbering of grid edges). A removal that a disturbance of 1e-7 h also changes is
// inconclusive: then the verdict holds and is vacuous.
inline constexpr uint64_t kEquivarianceKinds = 6;
Verdict equivariance(Backend& backend, const Setup& setup, const State& state, Span span, uint64_t seed);
// Geometric cuts: what is separate after fewer strokes stays separate after more (setup with all strokes, without
// the last).
Verdict refinement(Backend& backend, const Setup& more, const State& state, int64_t fewer_frames);
// The rest state (no gravity, no blade, no contact) does not move in one substep.
Verdict rest_is_fixed(Backend& backend, const Setup& setup, const State& state);
// A rigid translation is reproduced exactly (no damping, pins, friction).
Verdict translation_is_exact(Backend& backend, const Setup& setup, const State& state, Vec3 velocity);
// Implicit: E(x_k) never grows over k = 0 .. iterations in one substep (iterates from runs with k iterations); with an
// acceleration over the first alone, which is plain.
Verdict energy_is_monotone(Backend& backend, const Setup& setup, const State& state, int32_t iterations);
enum class Iterates : uint8_t;  // oracles/iterates/probe.h
// Iterates of the step of frame state.frame, all or a sample by `seed`, follow from the ones before them, within the
// rounding of one iteration (tolerances.md, Iterate by iterate).
Verdict step_by_iterates(Backend& backend, const Setup& setup, const State& state, Iterates wanted, uint64_t seed);

}  // namespace cutproof::oracles
