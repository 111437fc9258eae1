// What several relations share: running a backend, comparing bits, rounding of a substep, scenes made from others.
// Internal to oracles/relations/.
#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/backend.h"
#include "oracles/support.h"

namespace cutproof::oracles {

inline constexpr Span kFrame{Stage::step, Stage::skin};
inline constexpr Span kStep{Stage::step, Stage::step};

// --- Verdicts --------------------------------------------------------------------------------------------------------

// A verdict that holds so far.
Verdict begin(const char* property, const Backend& backend, const State& state, const char* unit, const char* source);
Verdict fail(Verdict verdict, std::string text, std::vector<int32_t> particles = {},
             std::vector<int32_t> clusters = {});
// Nothing was checked, and why.
Verdict vacuous(Verdict verdict, std::string why);

// What a relation needs to know before it runs anything: a state that is well formed, and a backend that can run this
// span. Else the verdict: a failure, or one that says what the backend cannot do.
std::optional<Verdict> unfit(const Verdict& verdict, const Setup& setup, const State& state);
std::optional<Verdict> unable(const Verdict& verdict, const Backend& backend, Span span);

// --- Runs ------------------------------------------------------------------------------------------------------------

// The state after these spans. Requires that the backend can run each of them.
State after(Backend& backend, const Setup& setup, const State& state, const std::vector<Span>& spans);
State after_frames(Backend& backend, const Setup& setup, const State& state, int64_t frames);
// One step stage, on its own where the backend can do that, else as a part of the frame.
Span step_span(const Backend& backend);
State after_step(Backend& backend, const Setup& setup, const State& state);

// --- Equal bits ------------------------------------------------------------------------------------------------------

struct BitDifference {
  std::string text;
  std::vector<int32_t> particles, clusters;
};
// The first one, field by field, in the order in which a fault would show first: decisions, then what is computed.
std::optional<BitDifference> bit_difference(const State& a, const State& b);
Verdict fail_on(Verdict verdict, const std::string& where, const BitDifference& difference);

// --- One substep near rest -------------------------------------------------------------------------------------------

// How far rounding can carry a particle in one substep near the rest state [m] (tolerances.md, "One substep").
double substep_rounding(const Setup& setup, const State& state);
// The greatest distance of an alive particle from where it is expected [m]; `where`: which one.
double greatest_distance(const State& state, const std::vector<Vec3>& expected, int32_t& where);

// --- Scenes made from others -----------------------------------------------------------------------------------------

// Nothing acts from outside: no blade, walls, grips; nothing is removed.
Setup undisturbed(Setup setup);
// The same tissue and clusters, at rest.
State at_rest(const Setup& setup, const State& state);

}  // namespace cutproof::oracles
