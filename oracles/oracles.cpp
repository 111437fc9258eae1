#include "oracles/oracles.h"

namespace cutproof::oracles {
namespace {

Verdict of_state(std::string_view name, const Setup& setup, const State& state) {
  return ask(property_named(core_properties(), name), setup, state);
}
Verdict of_stage(std::string_view name, const Setup& setup, Stage stage, const State& before, const State& after) {
  return ask(property_named(core_properties(), name), setup, stage, before, after);
}

}  // namespace

Verdict well_formed(const Setup& setup, const State& state) { return of_state("well formed", setup, state); }
Verdict finite(const Setup& setup, const State& state) { return of_state("finite", setup, state); }
Verdict cluster_connectivity(const Setup& setup, const State& state) {
  return of_state("cluster connectivity", setup, state);
}
Verdict coverage(const Setup& setup, const State& state) { return of_state("coverage", setup, state); }
Verdict component_match(const Setup& setup, const State& state) { return of_state("component match", setup, state); }
Verdict isolation(const Setup& setup, const State& state) { return of_state("isolation", setup, state); }
Verdict edge_cover(const Setup& setup, const State& state) { return of_state("edge cover", setup, state); }
Verdict rest_frames(const Setup& setup, const State& state) { return of_state("rest frames", setup, state); }
Verdict rotation_quality(const Setup& setup, const State& state) { return of_state("rotation", setup, state); }
Verdict merge_maximality(const Setup& setup, const State& state) { return of_state("merge maximality", setup, state); }
Verdict no_pass(const Setup& setup, const State& state) { return of_state("no pass", setup, state); }
Verdict skin_surface(const Setup& setup, const State& state) { return of_state("skin surface", setup, state); }
Verdict skin_vertices(const Setup& setup, const State& state) { return of_state("skin vertices", setup, state); }

Verdict momentum(const Setup& setup, const State& before, const State& after) {
  return of_stage("linear momentum", setup, Stage::step, before, after);
}
Verdict motion(const Setup& setup, const State& before, const State& after) {
  return of_stage("motion", setup, Stage::step, before, after);
}
Verdict detection(const Setup& setup, const State& before, const State& after) {
  return of_stage("detection", setup, Stage::detect, before, after);
}
Verdict split_exactness(const Setup& setup, const State& before, const State& after) {
  return of_stage("split exactness", setup, Stage::split, before, after);
}
Verdict merge_legality(const Setup& setup, const State& before, const State& after) {
  return of_stage("merge legality", setup, Stage::merge, before, after);
}
Verdict expansion(const Setup& setup, const State& before, const State& after) {
  return of_stage("expansion", setup, Stage::expand, before, after);
}
Verdict untouched(const Setup& setup, Stage stage, const State& before, const State& after) {
  return of_stage("untouched", setup, stage, before, after);
}

}  // namespace cutproof::oracles
