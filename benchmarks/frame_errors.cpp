#include "benchmarks/frame_errors.h"

#include <algorithm>
#include <utility>

#include "benchmarks/scene.h"
#include "harness/reference_stages.h"
#include "model/at.h"
#include "model/rules.h"
#include "oracles/comparison/stage_comparison.h"
#include "oracles/oracles.h"

namespace cutproof::benchmarks {

namespace {

State take_snapshot(const Backend& backend) {
  std::vector<State> states = backend.snapshot();
  return std::move(states.front());
}

void note(FrameErrors& errors, const oracles::StageDifference& found, const State& after) {
  const bool equal = found.decisions.empty();
  switch (found.stage) {
    case Stage::step:
      if (!errors.step) errors.step.emplace();
      errors.step->position.join(found.error(oracles::Measure::position).norm);
      errors.step->undecidable += found.undecidable.positions;
      break;
    case Stage::detect:
      if (!errors.detect) errors.detect.emplace();
      errors.detect->removed += static_cast<int64_t>(after.removed.size());
      errors.detect->differing += static_cast<int64_t>(found.removals.size());
      errors.detect->within_rounding &= equal && (!found.detection || found.detection->holds);
      break;
    case Stage::skin:
      if (!errors.skin) errors.skin.emplace();
      errors.skin->vertices.join(found.error(oracles::Measure::skin).norm);
      errors.skin->triangles_equal &= equal;
      break;
    default:
      if (found.sets_are_open) break;
      errors.clusters_equal[at(found.stage)] = errors.clusters_equal[at(found.stage)].value_or(true) && equal;
  }
}

}  // namespace

bool FrameErrors::topology_holds() const {
  return std::all_of(topology.begin(), topology.end(), [](const Verdict& verdict) { return verdict.holds; });
}

FrameErrors judge_frames(Backend& backend, const Setup& setup) {
  FrameErrors errors;
  oracles::StageComparison comparison(setup, harness::reference_stages());
  State state = take_snapshot(backend);
  bool cut = false, readable = true;
  while (!cut && readable && errors.frames < kJudgedFrames) {
    for (const Stage stage : kStages) {
      backend.run({stage, stage});
      const bool ran = backend.report().ran[at(stage)];
      const bool due = is_due(setup, stage, !state.removed.empty(), state.edge_covered);
      if (!ran && !due && stage != Stage::skin) continue;  // skin increments the frame
      State after = take_snapshot(backend);
      const oracles::StageDifference found = comparison.compare(stage, state, after, ran);
      if (ran || due) note(errors, found, after);
      state = std::move(after);
      cut |= stage == Stage::split;
      readable = found.is_readable;
      if (!readable) break;  // the oracles below report this
    }
    ++errors.frames;
  }
  std::vector<oracles::StateOracle> asked = {oracles::cluster_connectivity, oracles::coverage, oracles::edge_cover,
                                             oracles::skin_match};
  if (state.edge_covered) asked.push_back(oracles::component_match);
  for (const auto oracle : asked) {
    errors.topology.push_back(oracle(setup, state));
    errors.topology.back().backend = backend.name();
  }
  errors.isolated_groups = oracles::isolation(setup, state).measured;
  return errors;
}

}  // namespace cutproof::benchmarks
