#include "oracles/registry.h"

#include <fmt/format.h>

#include <stdexcept>

#include "model/rules.h"
#include "oracles/checks.h"

namespace cutproof::oracles {
namespace {

// --- When a property of a state is due -------------------------------------------------------------------------------

// Between detect and split clusters hold dead particles.
bool split_is_done(const Setup&, const State&, Stage after) { return after != Stage::detect; }

// Until expansion, groups may be uncoupled, unless I4 forbids it.
bool coupling_is_done(const Setup&, const State& state, Stage after) {
  return after == Stage::step || after >= Stage::expand || (after != Stage::detect && state.edge_covered);
}

bool edges_are_promised(const Setup&, const State& state, Stage after) {
  return after != Stage::detect && state.edge_covered;
}

// Expansion may leave clusters that could merge.
bool merging_is_final(const Setup& setup, const State& state, Stage after) {
  if (!promise_of(setup.merge.rule).maximal || after == Stage::detect || after == Stage::split) return false;
  return after == Stage::merge || state.edge_covered || setup.expand.rule == ExpandRule::none;
}

bool blade_was_there(const Setup& setup, const State&, Stage after) {
  return after == Stage::detect && setup.has_blade;
}

bool skin_is_there(const Setup& setup, const State& state, Stage after) {
  return after == Stage::skin && skin_is_due(setup, state);
}

bool always(const Setup&, const State&, Stage) { return true; }

constexpr StageSet kNoStage = stages();
constexpr std::string_view kSplitDone = "not between detection and split";
constexpr std::string_view kSkinThere = "at the end of a frame, if there is a skin or must be one";

Property of_stage(std::string_view name, std::string_view source, std::string_view unit, StageSet promised_by,
                  std::string_view nothing, void (*check)(const StageRun&, Verdict&)) {
  return {name, source, unit, kAll, Cost::cheap, promised_by, "", nullptr, nothing, nullptr, check};
}

PropertyList make_core_properties() {
  using enum Stage;
  constexpr Cost cheap = Cost::cheap;
  return {
      {"well formed", "model/state.h, model/clusters.h, model/skin.h", "1", kAll, cheap, kNoStage, "always", always,
       "a body of no particles", [](Judged& j, Verdict& verdict) { verdict = check_form(j.setup, j.state, 0); },
       nullptr},
      of_stage("linear momentum", "tolerances.md, Linear momentum", "kg m/s", stages(step), "nothing is alive",
               check_momentum),
      of_stage("motion", "method.md §3; tolerances.md, Motion", "h", stages(step),
               "nothing is alive, or a blade that is down, friction or a grip may push to any side", check_motion),
      of_stage("detection", "method.md §4; tolerances.md, Detection and rest frames", "1", stages(detect),
               "nothing was alive", check_detection),
      of_stage("split exactness", "method.md §5", "1", stages(split), "no cluster", check_split_exactness),
      of_stage("merge legality", "method.md §6: legal", "1", stages(merge), "no cluster", check_merge_legality),
      of_stage("expansion", "method.md §7", "1", stages(expand), "no cluster", check_expansion),
      {"finite", "oracles.md, One state", "1", kMotion | kFrames | kRotations | kSkin, cheap, stages(step), "always",
       always, "no numbers", check_finite, nullptr},
      {"cluster connectivity", "method.md §2, I1", "1", kAlive | kSets, cheap, kNoStage, kSplitDone, split_is_done,
       "no cluster", check_cluster_connectivity, nullptr},
      {"coverage", "method.md §2, I2", "1", kAlive | kSets | kCut, cheap, kNoStage, kSplitDone, split_is_done,
       "a body of no particles", check_coverage, nullptr},
      {"component match", "method.md §2, I3; §8, lemma", "1", kAlive | kSets | kSkin, cheap, kNoStage,
       "after step, expand and skin; always from split on where I4 is promised", coupling_is_done, "nothing is alive",
       check_component_match, nullptr},
      {"isolation", "method.md §2, I3: no isolated cluster", "1", kAlive | kSets, cheap, kNoStage,
       "after step, expand and skin; always from split on where I4 is promised", coupling_is_done, "nothing is alive",
       check_isolation, nullptr},
      {"edge cover", "method.md §2, I4", "1", kAlive | kSets | kLimits, cheap, kNoStage,
       "where edge_covered promises it, not between detection and split", edges_are_promised,
       "no two neighbours are alive", check_edge_cover, nullptr},
      {"rest frames", "method.md §5, Rest frames; tolerances.md, Detection and rest frames", "h", kSets | kFrames,
       cheap, stages(split, merge, expand), "always", always, "no cluster", check_rest_frames, nullptr},
      {"rotation", "tolerances.md, Rotation", "1", kRotations, cheap, kNoStage, "always", always, "no cluster",
       check_rotation_quality, nullptr},
      {"merge maximality", "method.md §6: maximal", "1", kAlive | kSets | kLimits, cheap, stages(merge),
       "where the rule promises it, after merge; later while nothing expands", merging_is_final, "no cluster is small",
       check_merge_maximality, nullptr},
      {"no pass", "method.md §3, Blade: lemma of the dynamic cut", "1", kAlive | kMotion | kTime, cheap, stages(detect),
       "after detection, if there is a blade", blade_was_there, "no edge of free particles is alive", check_no_pass,
       nullptr},
      {"skin surface", "method.md §8: closed, oriented, 2-manifold", "1", kAlive | kSkin, cheap, kNoStage, kSkinThere,
       skin_is_there, "no skin", check_skin_surface, nullptr},
      {"skin vertices", "tolerances.md, One goal position", "h",
       kAlive | kSkin | kSets | kFrames | kRotations | kMotion, cheap, kNoStage, kSkinThere, skin_is_there, "no skin",
       check_skin_vertices, nullptr},
      of_stage("untouched", "method.md §9: what a stage may change; model/fields.h", "1",
               stages(step, detect, split, merge, expand, skin), "nothing there that must stay", check_untouched),
  };
}

Verdict begin(const Property& property, const State& state) {
  return start_verdict(std::string(property.name), state, std::string(property.unit), std::string(property.source));
}

}  // namespace

const PropertyList& core_properties() {
  static const PropertyList list = make_core_properties();
  return list;
}

const Property& property_named(const PropertyList& list, std::string_view name) {
  for (const Property& property : list) {
    if (property.name == name) return property;
  }
  throw std::out_of_range(fmt::format("there is no property \"{}\" in this list", name));
}

Verdict ask(const Property& property, Judged& judged) {
  Verdict verdict = begin(property, judged.state);
  property.check_state(judged, verdict);
  return conclude(std::move(verdict), property.nothing);
}

Verdict ask(const Property& property, const StageRun& run, const Verdict& form_before, const Verdict& form_after) {
  for (const Verdict* form : {&form_before, &form_after}) {
    if (form->holds) continue;
    Verdict verdict = not_judged(std::string(property.name), *form);
    verdict.witness.text += form == &form_before ? " (before the stage)" : " (after the stage)";
    verdict.frame = run.after.frame;
    return verdict;
  }
  Verdict verdict = begin(property, run.after);
  property.check_stage(run, verdict);
  return conclude(std::move(verdict), property.nothing);
}

Verdict ask(const Property& property, const Setup& setup, const State& state) {
  Verdict form = check_form(setup, state, 0);
  if (property.name == form.property) return conclude(std::move(form), property.nothing);
  if (!form.holds) return not_judged(std::string(property.name), form);
  Judged judged(setup, state);
  return ask(property, judged);
}

Verdict ask(const Property& property, const Setup& setup, Stage stage, const State& before, const State& after) {
  return ask(property, {setup, stage, before, after}, check_form(setup, before, 0), check_form(setup, after, 0));
}

}  // namespace cutproof::oracles
