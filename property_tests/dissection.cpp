#include "property_tests/dissection.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "harness/backends.h"
#include "harness/frame_runner.h"
#include "harness/judge.h"
#include "harness/reference_stages.h"
#include "model/io/verdict_json.h"
#include "model/rules.h"
#include "oracles/oracles.h"
#include "property_tests/random.h"
#include "property_tests/touching.h"

namespace cutproof::property_tests {
namespace {

int64_t alive_count(const State& state) { return std::count(state.alive.begin(), state.alive.end(), 1); }

void note_what_is_given(const Case& c, const Instance& loaded, CaseCoverage& seen) {
  const auto n = loaded.setup.body.particle_count();
  seen["no particles"] = n == 0;
  seen["one particle"] = n == 1;
  seen["boxes"] = c.clusters == ClusterKind::boxes;
  seen["sampled clusters"] = c.clusters == ClusterKind::sampled;
  seen["tiles"] = c.clusters == ClusterKind::tiles;
  seen["foreign clusters"] = c.clusters == ClusterKind::foreign;
  seen["blade of thickness 0"] = c.blade_thickness == 0 && !c.strokes.empty();
  for (const Stroke& stroke : resolved_strokes(c)) {
    if (!stroke.down) seen["pen up"] = true;
    if (stroke.link == Link::retraced) seen["retraced stroke"] = true;
    if (stroke.down && stroke.from == stroke.to) seen["zero length stroke"] = true;
  }
}

// Turns, and stands at an angle, in some substep of the frame in which it is down.
void note_blade(const Setup& setup, int64_t frame, CaseCoverage& seen) {
  const auto is_along_an_axis = [](Vec3 v) {
    const double greatest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    return norm(v) - greatest < 1e-9;
  };
  for (int64_t s = frame * setup.step.substeps; setup.has_blade && s < (frame + 1) * setup.step.substeps; ++s) {
    const BladeMove& move = setup.blade_moves[at(s)];
    if (!move.down) continue;
    if (!is_along_an_axis(move.from.back)) seen["oblique blade"] = true;
    if (!(move.from.along == move.to.along && move.from.back == move.to.back)) seen["turning blade"] = true;
  }
}

// Parts of a setup that affected a step: something moved, and in more than free flight.
void note_parameters(const Setup& setup, const State& before, const State& after, CaseCoverage& seen) {
  const StepParameters& step = setup.step;
  if (step.iterations == 0 || before.x == after.x) return;
  const double dt = setup.substep_length[at(before.frame)];
  if (step.solver == Solver::published) seen["published solver"] = true;
  if (step.acceleration != Acceleration::none) seen["accelerated solver"] = true;
  if (step.damping > 0) seen["damped"] = true;
  if (step.retardation > 0) seen["retarded"] = true;
  if (step.volume_share > 0) seen["volume kept"] = true;
  if (dt < 0.001) seen["small dt"] = true;
  if (dt > 0.001) seen["large dt"] = true;
}

void note_touches(const Touches& touches, CaseCoverage& seen) {
  const std::pair<const char*, bool> noted[] = {{"grip", touches.held},
                                                {"grip released", touches.released},
                                                {"grip taken over", touches.taken_over},
                                                {"wall", touches.wall},
                                                {"wall that is no floor", touches.wall_that_is_no_floor},
                                                {"blade face", touches.blade_face},
                                                {"blade rim", touches.blade_rim},
                                                {"blade side", touches.blade_side},
                                                {"cutting edge", touches.cutting_edge},
                                                {"blade back", touches.blade_back},
                                                {"on a border", touches.on_a_border},
                                                {"led round the blade", touches.led_round},
                                                {"blade and wall at once", touches.blade_and_wall},
                                                {"friction slides", touches.slides},
                                                {"friction sticks", touches.sticks}};
  for (const auto& [name, is] : noted) {
    if (is) seen[name] = true;
  }
}

void note_what_was_removed(const Setup& setup, CaseCoverage& seen) {
  seen["removal"] = true;
  const DetectParameters& detect = setup.detect;
  if (detect.criterion == Criterion::distance && detect.epsilon != DetectParameters{}.epsilon) {
    seen["cut at another epsilon"] = true;
  }
  if (detect.remove == RemovedEnds::one) seen["one end of each edge"] = true;
  if (detect.remove == RemovedEnds::nearer) seen["nearer end of each edge"] = true;
  if (detect.criterion == Criterion::strain) seen["cut by strain"] = true;
  if (detect.criterion == Criterion::geometric && setup.step.iterations > 0) seen["geometric cut of what moves"] = true;
}

void note_what_a_stage_did(const Setup& setup, Stage stage, const State& before, const State& after,
                           CaseCoverage& seen) {
  const auto clusters_before = before.clusters.count(), clusters_after = after.clusters.count();
  switch (stage) {
    case Stage::detect: {
      bool down = false;  // detection may also run without a blade
      for (int32_t s = 0; setup.has_blade && s < setup.step.substeps; ++s) {
        down = down || setup.blade_moves[at(before.frame * setup.step.substeps + s)].down;
      }
      if (!after.removed.empty()) note_what_was_removed(setup, seen);
      if (after.removed.empty() && down && alive_count(before) > 0) seen["miss"] = true;
      break;
    }
    case Stage::split:
      if (clusters_after > clusters_before) seen["split"] = true;
      if (!after.debris.empty()) seen["debris"] = true;
      for (const int32_t number : before.clusters.number) {
        const auto& numbers = after.clusters.number;
        if (!std::binary_search(numbers.begin(), numbers.end(), number)) seen["vanished cluster"] = true;
      }
      if (alive_count(after) == 0) seen["consumed body"] = true;
      break;
    case Stage::merge:
      if (clusters_after < clusters_before) {
        seen["merge"] = true;
        if (setup.merge.rule == MergeRule::published) seen["published merge"] = true;
      }
      break;
    case Stage::expand:
      if (after.clusters.members.size() > before.clusters.members.size()) {
        seen["expansion"] = true;
        if (setup.expand.rule == ExpandRule::published) seen["published expansion"] = true;
      }
      break;
    case Stage::step:
      note_blade(setup, before.frame, seen);
      note_parameters(setup, before, after, seen);
      note_touches(touches_of(setup, before, after), seen);
      break;
    case Stage::skin:
      if (setup.skin.alpha != SkinParameters{}.alpha && !after.skin.triangles.empty()) seen["alpha"] = true;
      if (!setup.body.surface_crossing.empty() && !after.skin.triangles.empty()) seen["fitted skin"] = true;
      break;
  }
}

}  // namespace

int64_t least_count(const CoverageClass& wanted, int64_t cases, bool move) {
  if (wanted.occurs == Occurs::always) return 1;
  if (!move) return 0;
  return wanted.occurs == Occurs::often_where_bodies_move ? std::max<int64_t>(1, cases / 10) : 1;
}

void StepsCompared::add(const oracles::StageDifference& step) {
  const oracles::ErrorNorm& position = step.error(oracles::Measure::position).norm;
  ++steps;
  particles += position.count;
  undecidable += step.undecidable.positions;
  greatest = std::max(greatest, position.max);
}

void StepsCompared::join(const StepsCompared& other) {
  steps += other.steps;
  particles += other.particles;
  undecidable += other.undecidable;
  greatest = std::max(greatest, other.greatest);
}

namespace {

// The seed of a probe of this case, in any batch.
uint64_t probe_seed(const Instance& loaded) {
  const State& state = loaded.state;
  return static_cast<uint64_t>(state.x.size()) ^
         std::bit_cast<uint64_t>(state.x.empty() ? 0 : state.x.back().x + state.v.back().y);
}
oracles::IterateProbe probe_of(const Instance& loaded, const CaseRun& run) {
  return {loaded.setup, *run.trace.moments[at(run.probed)].before, oracles::Iterates::sampled, probe_seed(loaded)};
}

// Has the backend show iterates of one step of each moving body, all in one batch.
void probe_steps(Backend& backend, const std::vector<Instance>& loaded, std::vector<CaseRun>& runs) {
  std::vector<oracles::IterateProbe> probes;
  std::vector<std::size_t> probed;
  for (std::size_t b = 0; b < loaded.size(); ++b) {
    if (loaded[b].setup.step.iterations == 0 || runs[b].failure) continue;
    const std::vector<harness::Moment>& moments = runs[b].trace.moments;
    std::vector<int64_t> steps;
    for (std::size_t k = 0; k < moments.size(); ++k) {
      const bool is_step = moments[k].by_backend && moments[k].span.first == Stage::step;
      if (is_step && oracles::well_formed(loaded[b].setup, *moments[k].before).holds) {
        steps.push_back(static_cast<int64_t>(k));
      }
    }
    if (steps.empty()) continue;
    Random random(probe_seed(loaded[b]));
    runs[b].probed = steps[random.index(steps.size())];
    probes.push_back(probe_of(loaded[b], runs[b]));
    probed.push_back(b);
  }
  if (probes.empty()) return;
  std::vector<oracles::ShownStep> shown = oracles::shown_iterates(backend, probes);
  for (std::size_t k = 0; k < probed.size(); ++k) runs[probed[k]].iterates = std::move(shown[k]);
}

}  // namespace

namespace {

// Adds up their times.
oracles::ReferenceStages timed_reference_stages(double& seconds) {
  oracles::ReferenceStages stages = harness::reference_stages();
  for (auto& stage : stages) {
    stage = [run = std::move(stage), &seconds](const Setup& setup, State& state) {
      const auto begin = std::chrono::steady_clock::now();
      run(setup, state);
      seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    };
  }
  return stages;
}

}  // namespace

std::vector<CaseRun> run_cases(Backend& backend, const std::vector<Instance>& loaded) {
  std::vector<Setup> setups;
  std::vector<State> states;
  for (const Instance& one : loaded) {
    setups.push_back(one.setup);
    states.push_back(one.state);
  }
  harness::Traces traces = harness::run_to_the_end(backend, std::move(setups), states);
  std::vector<CaseRun> runs(loaded.size());
  harness::Promises promises = harness::kPromisesOfRules;
  promises.words = harness::parse_promises(backend.promises(), backend.name(), "promises");
  for (std::size_t b = 0; b < loaded.size(); ++b) {
    runs[b].trace = std::move(traces.of_body[b]);
    runs[b].promises = promises;
    const State& initial = *runs[b].trace.initial;
    // Loading rounds in single precision, and is exact in double.
    if (backend.precision() == Precision::binary64 && !(initial == loaded[b].state)) {
      runs[b].failure = harness::broken_contract("loading changes nothing", Stage::step, initial.frame);
    }
  }
  for (Verdict& broken : traces.broken_contracts) {
    std::optional<Verdict>& failure = runs[at(broken.body)].failure;
    if (!failure) failure = std::move(broken);
  }
  probe_steps(backend, loaded, runs);
  return runs;
}

Judgement judge_case(const Case& c, const Instance& loaded, const CaseRun& run, const std::string& backend,
                     bool thorough) {
  Judgement judgement;
  CaseCoverage& seen = judgement.coverage;
  const Setup& setup = loaded.setup;
  note_what_is_given(c, loaded, seen);
  judgement.failure = run.failure;

  const harness::BackendDescriptor* const described = harness::find_backend(backend);  // a test's has no description
  const bool is_the_reference = described != nullptr && described->is_the_reference;
  harness::Judge judge(setup, backend, run.promises, thorough ? harness::Thorough::always : harness::Thorough::never);
  judge.begin(run.trace.initial, run.has_expanded || c.clusters == ClusterKind::foreign);  // those begin anywhere
  const auto take = [&](std::vector<Verdict> verdicts) {
    for (Verdict& verdict : verdicts) {
      ++judgement.verdicts;
      judgement.properties.add(verdict);
      if (verdict.holds || judgement.failure) continue;
      verdict.backend = backend;
      judgement.failure = std::move(verdict);
    }
  };
  take(judge.take_verdicts());
  int32_t components = judge.component_count();
  seen["several components"] = components > 1;
  oracles::StageComparison comparison(setup, timed_reference_stages(judgement.reference_seconds));
  const auto compare = [&](Stage stage, const State& before, const State& after) {
    const oracles::StageDifference found = comparison.compare(stage, before, after, true);
    if (stage == Stage::step) judgement.compared.add(found);
    // For a backend that promises less than its rules, the oracles judge its own promises.
    if (run.promises.words == harness::kPromisesOfRules.words) take(found.verdicts("the reference's "));
  };
  if (run.probed >= 0) {
    Verdict verdict = probe_of(loaded, run).judged(run.iterates);
    verdict.stage = Stage::step;
    judge.add(std::move(verdict));
  }
  take(judge.take_verdicts());
  harness::Snapshot compared_skin;  // equal to the reference's
  for (const harness::Moment& moment : run.trace.moments) {
    if (judgement.failure) break;
    const State &before = *moment.before, &after = *moment.after;
    judgement.stages.see(setup, moment);
    judge.see(moment);
    take(judge.take_verdicts());
    for (const harness::Judge::Unpromised& u : judge.unpromised()) {
      if (u.property == "isolation" && u.failing > 0) seen["uncoupled without promise"] = true;
    }
    // Stages that the reference ran are not judged, but count in the coverage of the case.
    if (!moment.by_backend && moment.span.contains(Stage::skin) && !oracles::isolation(setup, after).holds) {
      seen["uncoupled without promise"] = true;
    }
    if (judgement.failure) break;
    const auto due = harness::due_stages(setup, before, moment.span, after);
    const auto due_count = std::count(due.begin(), due.end(), true);
    for (const Stage stage : kStages) {
      if (due[at(stage)]) note_what_a_stage_did(setup, stage, before, after, seen);
    }
    const int32_t components_before = std::exchange(components, judge.component_count());
    if (moment.span.contains(Stage::detect) && components > components_before) seen["separation"] = true;
    // A step that came together with other stages can still be compared: later ones move nothing, and where no cluster
    // has changed, they turn nothing either.
    if (c.moves && moment.by_backend && due[0] && due_count > 1 && before.clusters.members == after.clusters.members) {
      compare(Stage::step, before, harness::after_step(before, after));
    }
    if (is_the_reference || !moment.by_backend || due_count != 1) continue;
    const auto stage = static_cast<Stage>(std::find(due.begin(), due.end(), true) - due.begin());
    if (stage == Stage::step && !c.moves) continue;
    // Nothing is compared with the middle of a span that goes on to the end of the frame.
    if (moment.span.contains(Stage::skin) && stage != Stage::skin) continue;
    // The topology of the skin is a function of the living particles.
    const bool known = stage == Stage::skin && compared_skin && compared_skin->alive == after.alive &&
                       compared_skin->skin.owner == after.skin.owner &&
                       compared_skin->skin.direction == after.skin.direction &&
                       compared_skin->skin.triangles == after.skin.triangles;
    if (stage == Stage::skin) compared_skin = moment.after;
    if (known) continue;
    compare(stage, before, after);
  }
  seen["cavity"] = judge.inner_shells() > 0;
  return judgement;
}

Judgement dissect(Backend& backend, const Case& c, bool thorough) {
  const std::vector<Instance> loaded = {instance_of(c)};
  const CaseRun run = run_cases(backend, loaded).front();
  return judge_case(c, loaded.front(), run, backend.name(), thorough);
}

std::string describe(const Verdict& verdict) { return io::verdict_text(verdict); }

}  // namespace cutproof::property_tests
