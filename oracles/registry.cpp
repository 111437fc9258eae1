#include "oracles/registry.h"

#include <fmt/format.h>

#include <stdexcept>

#include "model/rules.h"
#include "oracles/checks.h"
#include "oracles/timed.h"

namespace cutproof::oracles {
namespace {

// --- When a property of a state is due -------------------------------------------------------------------------------

constexpr Due kAlways = {"always", [](const Setup&, const State&, Stage) { return true; }};

// Between detect and split clusters hold dead particles.
constexpr Due kSplitDone = {"not between detection and split",
                            [](const Setup&, const State&, Stage after) { return after != Stage::detect; }};

// Until expansion, groups may be uncoupled, unless I4 forbids it.
constexpr Due kCouplingDone = {"after step, expand and skin; always from split on where I4 is promised",
                               [](const Setup&, const State& state, Stage after) {
                                 return after == Stage::step || after >= Stage::expand ||
                                        (after != Stage::detect && state.edge_covered);
                               }};

constexpr Due kEdgesPromised = {
    "where edge_covered promises it, not between detection and split",
    [](const Setup&, const State& state, Stage after) { return after != Stage::detect && state.edge_covered; }};

// Expansion may leave clusters that could merge.
bool merging_is_final(const Setup& setup, const State& state, Stage after) {
  if (!promise_of(setup.merge.rule).maximal || after == Stage::detect || after == Stage::split) return false;
  return after == Stage::merge || state.edge_covered || setup.expand.rule == ExpandRule::none;
}
constexpr Due kMergingFinal = {"where the rule promises it, after merge; later while nothing expands",
                               merging_is_final};

constexpr Due kBladeThere = {"after detection, if there is a blade", [](const Setup& setup, const State&, Stage after) {
                               return after == Stage::detect && setup.has_blade;
                             }};

Property of_stage(std::string_view name, std::string_view source, std::string_view unit, StageSet promised_by,
                  std::string_view nothing, void (*check)(const StageRun&, Verdict&)) {
  return {name, source, unit, kAll, Cost::cheap, promised_by, {}, nothing, nullptr, check};
}

PropertyList make_core_properties() {
  using enum Stage;
  const auto form = [](Judged& j, Verdict& verdict) { verdict = check_form(j.setup, j.state, 0); };
  return {
      of_state("well formed", "model/state.h, model/clusters.h, model/skin.h", "1", kAll, kAlways,
               "a body of no particles", form),
      of_stage("linear momentum", "tolerances.md, Linear momentum", "kg m/s", stages(step), "nothing is alive",
               check_momentum),
      of_stage("component momentum", "method.md §2, I3: no ghost force; tolerances.md, Linear momentum", "kg m/s",
               stages(step), "one component, or none that nothing holds or pushes", check_component_momentum),
      of_stage("motion", "method.md §3; tolerances.md, Motion", "h", stages(step),
               "nothing is alive, or a blade that is down, friction or a grip may push to any side", check_motion),
      of_stage("detection", "method.md §4; tolerances.md, Detection and rest frames", "1", stages(detect),
               "nothing was alive", check_detection),
      of_stage("split exactness", "method.md §5", "1", stages(split), "no cluster", check_split_exactness),
      of_stage("merge legality", "method.md §6: legal", "1", stages(merge), "no cluster", check_merge_legality),
      of_stage("cap kept", "method.md §6: at most cap particles", "1", stages(merge), "no cluster", check_cap_kept),
      of_stage("expansion", "method.md §7", "1", stages(expand), "no cluster", check_expansion),
      of_state("finite", "oracles.md, One state", "1", kMotion | kFrames | kRotations | kSkin, kAlways, "no numbers",
               check_finite, stages(step)),
      of_state("cluster connectivity", "method.md §2, I1", "1", kAlive | kSets, kSplitDone, "no cluster",
               check_cluster_connectivity),
      of_state("coverage", "method.md §2, I2", "1", kAlive | kSets | kCut, kSplitDone, "a body of no particles",
               check_coverage),
      of_state("component match", "method.md §2, I3", "1", kAlive | kSets, kCouplingDone, "nothing is alive",
               check_component_match),
      of_state("skin match", "method.md §8, lemma", "1", kAlive | kSkin, kSkinThere, "no tissue, or no skin",
               check_skin_match),
      of_state("isolation", "method.md §2, I3: no isolated cluster", "1", kAlive | kSets, kCouplingDone,
               "nothing is alive", check_isolation),
      of_state("edge cover", "method.md §2, I4", "1", kAlive | kSets | kLimits, kEdgesPromised,
               "no two neighbours are alive", check_edge_cover),
      of_state("rest frames", "method.md §5, Rest frames; tolerances.md, Detection and rest frames", "h",
               kSets | kFrames, kAlways, "no cluster", check_rest_frames, stages(split, merge, expand)),
      of_state("rotation", "tolerances.md, Rotation", "1", kRotations, kAlways, "no cluster", check_rotation_quality),
      of_state("merge maximality", "method.md §6: maximal", "1", kAlive | kSets | kLimits, kMergingFinal,
               "no cluster is small", check_merge_maximality, stages(merge)),
      of_state("no pass", "method.md §3, Blade: lemma of the dynamic cut", "1", kAlive | kMotion | kTime, kBladeThere,
               "no edge of free particles is alive", check_no_pass, stages(detect)),
      of_state("skin surface", "method.md §8: closed, oriented, 2-manifold", "1", kAlive | kSkin, kSkinThere, "no skin",
               check_skin_surface),
      of_state("skin vertices", "tolerances.md, One skin vertex", "h", kAlive | kSkin | kSets | kRotations | kMotion,
               kSkinThere, "no skin", check_skin_vertices),
      of_stage("skin reach",
               "method.md §8: where a vertex lies on its edge; tolerances.md, Where a blade crossed an edge", "h",
               stages(skin), "no skin", check_skin_reach),
      of_stage("untouched", "method.md §9: what a stage may change; model/fields.h", "1",
               stages(step, detect, split, merge, expand, skin), "nothing there that must stay", check_untouched),
  };
}

Verdict begin(const Property& property, const State& state) {
  return start_verdict(property.name, state, property.unit, property.source);
}

}  // namespace

const PropertyList& core_properties() {
  static const PropertyList list = make_core_properties();
  return list;
}

const PropertyList& motion_properties() {
  static const PropertyList list = {
      of_stage(kAdmissibleStep, kAdmissibleStepSource, "h", stages(Stage::step), kNoStep, check_admissible_step)};
  return list;
}

const PropertyList& lone_state_properties() {
  constexpr unsigned kFit = kSets | kMotion | kRotations;
  static const PropertyList list = {
      of_state("tissue kept", "oracles.md, A state from a file", "1", kAlive | kCut, kAlways, "nothing is dead",
               check_tissue_kept),
      of_state("rotation match", "tolerances.md, Rotations of a state", "1", kFit, kAlways,
               "no cluster whose particles tell its rotation", check_rotation_match),
      of_state("best rotation", "tolerances.md, Rotations of a state", "1", kFit, kAlways,
               "no cluster whose particles tell its rotation", check_best_rotation)};
  return list;
}

const Property& property_named(const PropertyList& list, std::string_view name) {
  for (const Property& property : list) {
    if (property.name == name) return property;
  }
  throw std::out_of_range(fmt::format("there is no property \"{}\" in this list", name));
}

Verdict ask(const Property& property, Judged& judged) {
  return timed([&] {
    Verdict verdict = begin(property, judged.state);
    property.check_state(judged, verdict);
    return conclude(std::move(verdict), property.nothing);
  });
}

Verdict ask(const Property& property, const StageRun& run, const Verdict& form_before, const Verdict& form_after) {
  for (const Verdict* form : {&form_before, &form_after}) {
    if (form->holds) continue;
    Verdict verdict = not_judged(property.name, *form);
    verdict.witness.text += form == &form_before ? " (before the stage)" : " (after the stage)";
    verdict.frame = run.after.frame;
    return verdict;
  }
  return timed([&] {
    Verdict verdict = begin(property, run.after);
    property.check_stage(run, verdict);
    return conclude(std::move(verdict), property.nothing);
  });
}

Verdict ask(const Property& property, const Setup& setup, const State& state) {
  Verdict form = check_form(setup, state, 0);
  if (property.name == form.property) return conclude(std::move(form), property.nothing);
  if (!form.holds) return not_judged(property.name, form);
  Judged judged(setup, state);
  return ask(property, judged);
}

Verdict ask(const Property& property, const Setup& setup, Stage stage, const State& before, const State& after) {
  return ask(property, {setup, stage, before, after}, check_form(setup, before, 0), check_form(setup, after, 0));
}

}  // namespace cutproof::oracles
