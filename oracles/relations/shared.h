// Helpers of relations: judging, running a backend, comparing bits. Internal to oracles/relations/.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/backend.h"
#include "oracles/single_substep.h"
#include "oracles/support.h"

namespace cutproof::oracles {

inline constexpr Span kFrame{Stage::step, Stage::skin};
inline constexpr Span kStep{Stage::step, Stage::step};

// --- Verdicts --------------------------------------------------------------------------------------------------------

struct Relation {
  const char* property;
  const char* unit;
  const char* source;
  const char* nothing;  // why nothing was checked, where nothing was
};
// The verdict that `check` fills, which begins as one that holds. `check` runs only if the state is well formed and the
// backend can run `span`. Otherwise the verdict fails, or is vacuous with the missing ability.
Verdict judge_relation(const Relation& relation, const Backend& backend, Span span, const Setup& setup,
                       const State& state, const std::function<void(Verdict&)>& check);

// Whether the state is well formed; if not, the verdict fails.
bool is_fit(Verdict& verdict, const Setup& setup, const State& state);
// Nothing was checked, and why.
void vacuous(Verdict& verdict, std::string why);

// --- Runs ------------------------------------------------------------------------------------------------------------

// The states after each of these spans, one after the other, and the last of them. Requires that the backend can run
// each of them, and that there is one.
std::vector<State> after_each(Backend& backend, const Setup& setup, const State& state, const std::vector<Span>& spans);
State after(Backend& backend, const Setup& setup, const State& state, Span span);
// The state itself after none.
State after_frames(Backend& backend, const Setup& setup, const State& state, int64_t frames);
// One step stage, on its own where the backend can do that, else as a part of the frame.
Span step_span(const Backend& backend);

// --- Equal bits ------------------------------------------------------------------------------------------------------

// The first difference, field by field, in the order in which a fault would show first: decisions, then what is
// computed.
std::optional<Witness> bit_difference(const State& a, const State& b);
// Fails, `measured` 1, if there is one; `where` comes before what the witness says. Returns whether all bits are equal.
bool require_same_bits(Verdict& verdict, const std::string& where, const State& expected, const State& actual);

}  // namespace cutproof::oracles
