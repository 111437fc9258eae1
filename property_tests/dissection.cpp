#include "property_tests/dissection.h"

#include <algorithm>
#include <sstream>

#include "oracles/oracles.h"

namespace cutproof::property_tests {
namespace {

int64_t alive_count(const State& state) { return std::count(state.alive.begin(), state.alive.end(), 1); }

void note_what_is_given(const Case& c, const Loaded& loaded, Judgement& judgement) {
  const auto n = loaded.setup.body.particle_count();
  judgement[Happened::no_particles] = n == 0;
  judgement[Happened::one_particle] = n == 1;
  judgement[Happened::several_components] = oracles::graph_components(loaded.setup, loaded.state).count > 1;
  judgement[Happened::boxes] = c.clusters == ClusterKind::boxes;
  judgement[Happened::sampled] = c.clusters == ClusterKind::sampled;
  judgement[Happened::foreign] = c.clusters == ClusterKind::foreign;
  judgement[Happened::thin_blade] = c.blade_thickness == 0 && !c.strokes.empty();
  for (const Stroke& stroke : resolved_strokes(c)) {
    if (!stroke.down) judgement[Happened::pen_up] = true;
    if (stroke.link == Link::retraced) judgement[Happened::retraced_stroke] = true;
    if (stroke.down && stroke.from == stroke.to) judgement[Happened::zero_length_stroke] = true;
  }
}

void note_what_a_stage_did(const Setup& setup, Stage stage, const State& before, const State& after,
                           Judgement& judgement) {
  const auto clusters_before = before.clusters.count(), clusters_after = after.clusters.count();
  switch (stage) {
    case Stage::detect: {
      const bool down = setup.blade_moves[static_cast<std::size_t>(before.frame)].down;
      if (!after.removed.empty()) judgement[Happened::removal] = true;
      if (after.removed.empty() && down && alive_count(before) > 0) judgement[Happened::miss] = true;
      if (oracles::graph_components(setup, after).count > oracles::graph_components(setup, before).count) {
        judgement[Happened::separation] = true;
      }
      break;
    }
    case Stage::split:
      if (clusters_after > clusters_before) judgement[Happened::split] = true;
      if (!after.debris.empty()) judgement[Happened::debris] = true;
      for (const int32_t number : before.clusters.number) {
        const auto& numbers = after.clusters.number;
        if (!std::binary_search(numbers.begin(), numbers.end(), number)) judgement[Happened::vanished_cluster] = true;
      }
      if (alive_count(after) == 0) judgement[Happened::consumed] = true;
      break;
    case Stage::merge:
      if (clusters_after < clusters_before) {
        judgement[Happened::merge] = true;
        if (setup.merge.rule == MergeRule::published) judgement[Happened::published_merge] = true;
      }
      break;
    case Stage::expand:
      if (after.clusters.members.size() > before.clusters.members.size()) {
        judgement[Happened::expansion] = true;
        if (setup.expand.rule == ExpandRule::published) judgement[Happened::published_expansion] = true;
      }
      break;
    case Stage::step:
    case Stage::skin:
      break;
  }
}

// The state with which a frame begins is nobody's promise yet where clusters came from outside, and neither `none` nor
// `published` promises coupled tissue at all (method.md §2): without I4 the coupling is noted and not demanded.
// A cluster that has grown may touch others that it did not touch: maximality is the promise of the merge stage, and
// of every later stage only as long as no expansion changes clusters.
bool is_promised(const Verdict& verdict, Stage stage, const State& state, bool has_expanded) {
  if (verdict.property == "component match" || verdict.property == "isolation") return state.edge_covered;
  if (verdict.property == "merge maximality") return stage == Stage::merge || !has_expanded;
  return true;
}

}  // namespace

Judgement dissect(Backend& backend, const Case& c, bool thorough) {
  Judgement judgement;
  const Loaded loaded = load(c);
  const Setup& setup = loaded.setup;
  note_what_is_given(c, loaded, judgement);

  bool has_expanded = c.clusters == ClusterKind::foreign;  // foreign clusters begin anywhere
  const auto take = [&](std::vector<Verdict> verdicts, Stage stage, const State& state) {
    for (Verdict& verdict : verdicts) {
      if (!verdict.holds && !is_promised(verdict, stage, state, has_expanded)) {
        if (verdict.property == "isolation") judgement[Happened::uncoupled] = true;
        continue;
      }
      ++judgement.verdicts;
      if (verdict.holds || judgement.failure) continue;
      verdict.backend = backend.name();
      judgement.failure = std::move(verdict);
    }
  };

  const auto failed = [&](const char* property, Stage stage) {
    Verdict verdict;
    verdict.property = property;
    verdict.stage = stage;
    verdict.backend = backend.name();
    verdict.holds = false;
    return verdict;
  };

  backend.load({setup}, {loaded.state});
  State before = backend.snapshot().front();
  if (!(before == loaded.state)) {
    judgement.failure = failed("loading changes nothing", Stage::step);
  }
  while (before.frame < setup.frame_count() && !judgement.failure) {
    for (const Stage stage : kStages) {
      backend.run({stage, stage});
      const State after = backend.snapshot().front();
      const bool ran = backend.report().ran[static_cast<std::size_t>(stage)];
      if (stage == Stage::expand && after.clusters.members != before.clusters.members) has_expanded = true;
      if (ran) {
        note_what_a_stage_did(setup, stage, before, after, judgement);
        take(oracles::judge_stage(setup, stage, before, after), stage, after);
        if (stage != Stage::step) take(oracles::judge(setup, after, stage, thorough), stage, after);
      } else if (!(after == before)) {
        judgement.failure = failed("a stage that did not run changes nothing", stage);
      }
      before = after;
      if (judgement.failure) break;
    }
  }
  if (!before.skin.owner.empty() && oracles::skin_shells(before.skin).inner > 0) judgement[Happened::cavity] = true;
  return judgement;
}

std::string describe(const Verdict& verdict) {
  std::ostringstream text;
  text << "'" << verdict.property << "' fails after " << name_of(verdict.stage) << " in frame " << verdict.frame
       << " on backend '" << verdict.backend << "': measured " << verdict.measured << " " << verdict.unit << ", bound "
       << verdict.bound << " (" << verdict.bound_source << "). " << verdict.witness.text;
  return text.str();
}

}  // namespace cutproof::property_tests
