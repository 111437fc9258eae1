// The checks behind oracles/registry.cpp, one file each. Internal to oracles/.
#pragma once
#include "oracles/judged.h"
#include "oracles/registry.h"

namespace cutproof::oracles {

// "well formed" itself: the only check of arbitrary states. `known`: parts with the bits of a well-formed state of the
// same body; of these only the sizes that they share with other parts are checked again. kBody: the body is known to be
// well formed.
inline constexpr unsigned kBody = 1u << 31;
Verdict check_form(const Setup& setup, const State& state, unsigned known);

inline Property of_state(std::string_view name, std::string_view source, std::string_view unit, unsigned rests_on,
                         const Due& due, std::string_view nothing, void (*check)(Judged&, Verdict&),
                         StageSet promised_by = {}) {
  return {name, source, unit, rests_on, Cost::cheap, promised_by, due, nothing, check, nullptr};
}

// Of a state.
void check_finite(Judged& judged, Verdict& verdict);
void check_cluster_connectivity(Judged& judged, Verdict& verdict);
void check_coverage(Judged& judged, Verdict& verdict);
void check_component_match(Judged& judged, Verdict& verdict);
void check_skin_match(Judged& judged, Verdict& verdict);
void check_isolation(Judged& judged, Verdict& verdict);
void check_edge_cover(Judged& judged, Verdict& verdict);
void check_rest_frames(Judged& judged, Verdict& verdict);
void check_rotation_quality(Judged& judged, Verdict& verdict);
void check_rotation_match(Judged& judged, Verdict& verdict);
void check_best_rotation(Judged& judged, Verdict& verdict);
void check_merge_maximality(Judged& judged, Verdict& verdict);
void check_tissue_kept(Judged& judged, Verdict& verdict);
void check_no_pass(Judged& judged, Verdict& verdict);
void check_skin_surface(Judged& judged, Verdict& verdict);
void check_skin_vertices(Judged& judged, Verdict& verdict);
void check_skin_reach(const StageRun& run, Verdict& verdict);

// Of a stage.
void check_momentum(const StageRun& run, Verdict& verdict);
void check_component_momentum(const StageRun& run, Verdict& verdict);
void check_motion(const StageRun& run, Verdict& verdict);
// From oracles/step_model/step_again.cpp, which also has other callers.
inline constexpr std::string_view kAdmissibleStep = "admissible step", kNoStep = "nothing is alive",
                                  kAdmissibleStepSource = "method.md §3; tolerances.md, The step again";
void check_admissible_step(const StageRun& run, Verdict& verdict);
void check_detection(const StageRun& run, Verdict& verdict);
void check_split_exactness(const StageRun& run, Verdict& verdict);
void check_merge_legality(const StageRun& run, Verdict& verdict);
void check_cap_kept(const StageRun& run, Verdict& verdict);
void check_expansion(const StageRun& run, Verdict& verdict);
void check_untouched(const StageRun& run, Verdict& verdict);

// --- When there must be a skin ---------------------------------------------------------------------------------------

inline bool has_skin(const State& state) { return !state.skin.owner.empty() || !state.skin.triangles.empty(); }
// A frame that has ended has a skin if the scene wants one. Before the first frame ends there may be none yet.
inline bool skin_is_due(const Setup& setup, const State& state) {
  return has_skin(state) || (setup.skin.wanted && state.frame > 0);
}
inline constexpr Due kSkinThere = {"at the end of a frame, if there is a skin or must be one",
                                   [](const Setup& setup, const State& state, Stage after) {
                                     return after == Stage::skin && skin_is_due(setup, state);
                                   }};
// Only where nothing is alive may it have no triangles.
bool skin_is_missing(const Setup& setup, const State& state);
// For witnesses: the owners of these vertices, and these triangles; the triangles that have one of these vertices, at
// most as many as a witness names.
Concerned owners_of(const Skin& skin, const std::vector<int32_t>& vertices, std::vector<int32_t> triangles = {});
std::vector<int32_t> triangles_at(const Skin& skin, const std::vector<int32_t>& vertices);

}  // namespace cutproof::oracles
