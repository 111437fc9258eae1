#include "benchmarks/baselines.h"

#include <algorithm>

#include "benchmarks/paper.h"
#include "benchmarks/timing.h"
#include "fixtures/build.h"
#include "harness/errors.h"
#include "harness/geometry_json.h"
#include "model/at.h"
#include "model/rules.h"
#include "reference_cpu/reference.h"

namespace cutproof::benchmarks {

namespace {

constexpr const char* kDeletionNames[] = {"none", "particles", "clusters"};

// Interpenetration is measured in every so many frames.
constexpr int64_t kOverlapEvery = 8;

}  // namespace

const std::vector<Baseline>& baselines() {
  static const std::vector<Baseline> kAll = [] {
    std::vector<Baseline> all(8);
    all[0] = {.name = "this method", .source = "method.md"};
    all[1] = {.name = "particles deleted, no split", .source = "Berndt 2017", .deletion = Deletion::particles};
    all[2] = {.name = "clusters deleted, no split",
              .source = "Berndt 2017, as Yu 2024 §4 reads it",
              .deletion = Deletion::clusters};
    all[3] = {.name = "published expansion", .source = "Yu 2024", .expand = ExpandRule::published};
    all[4] = {.name = "no expansion", .source = "Yu 2024, Fig. 13a", .expand = ExpandRule::none};
    all[5] = {.name = "strain detection", .source = "Yu 2024, Fig. 7", .criterion = Criterion::strain};
    all[6] = {.name = "one end of each edge", .source = "method.md §4", .remove = RemovedEnds::one};
    all[7] = {.name = "nearer end of each edge", .source = "method.md §4", .remove = RemovedEnds::nearer};
    return all;
  }();
  return kAll;
}

ReadyScene make_baseline_scene(const Baseline& baseline, int64_t particles, uint64_t seed) {
  Scene scene = embedded_scene("baselines");
  scene.seed = seed;
  scene.body.particles = particles;
  scene.detect.criterion = baseline.criterion;
  scene.detect.remove = baseline.remove;
  scene.merge.rule = baseline.merge;
  scene.expand.rule = baseline.expand;
  // The right grip lets go where the push begins; only the schedule knows when.
  const GripSpec push = scene.grips.back();
  scene.grips.pop_back();
  fixtures::Built built = fixtures::build(scene, "command line");
  scene.grips.back().end = built.schedule.time[at(built.setup.stroke_end.back() + 1)];
  scene.grips.push_back(push);
  fixtures::resolve_schedule(scene, "command line", {}, built.setup);
  return {scene.name, std::move(built.setup), std::move(built.state)};
}

void delete_from_clusters(const Setup& setup, Deletion deletion, State& state) {
  const Clusters& before = state.clusters;
  const auto is_dead = [&](int32_t i) { return state.alive[at(i)] == 0; };
  std::vector<uint8_t> kept(at(before.count()), 1);
  if (deletion == Deletion::clusters) {
    std::vector<uint8_t> held(state.alive.size(), 0);
    for (int32_t c = 0; c < before.count(); ++c) {
      const auto members = before.of(c);
      kept[at(c)] = std::none_of(members.begin(), members.end(), is_dead);
      for (const int32_t i : members) held[at(i)] = held[at(i)] || kept[at(c)];
    }
    for (std::size_t i = 0; i < held.size(); ++i) {
      if (held[i] || !state.alive[i]) continue;
      state.alive[i] = 0;
      state.removed.push_back(static_cast<int32_t>(i));
    }
    std::sort(state.removed.begin(), state.removed.end());
    state.edge_covered = false;
  }
  Clusters after;
  for (int32_t c = 0; c < before.count(); ++c) {
    if (!kept[at(c)]) continue;
    const std::size_t first = after.members.size();
    for (const int32_t i : before.of(c)) {
      if (!is_dead(i)) after.members.push_back(i);
    }
    if (after.members.size() == first) continue;
    after.offsets.push_back(static_cast<int64_t>(after.members.size()));
    after.number.push_back(before.number[at(c)]);
    after.rotation.push_back(before.rotation[at(c)]);
    after.degenerate.push_back(before.degenerate[at(c)]);
  }
  after.rest_center.resize(after.number.size());
  after.mass.resize(after.number.size());
  reference::update_rest_frames(setup.body, after);
  state.clusters = std::move(after);
  state.skin = {};
}

double run_frame(Backend& backend, const Baseline& baseline, const Setup& setup) {
  double seconds = 0;
  const auto run = [&](Span span) {
    backend.run(span);
    seconds += backend.report().total_seconds;
  };
  if (baseline.deletion == Deletion::none) {
    run(kWholeFrame);
    return seconds;
  }
  run({Stage::step, Stage::detect});
  State state = std::move(backend.snapshot().front());
  if (!state.removed.empty()) {
    delete_from_clusters(setup, baseline.deletion, state);
    backend.load({setup}, {state});
  }
  run({Stage::skin, Stage::skin});
  return seconds;
}

nlohmann::json run_baseline(Backend& backend, const Baseline& baseline, const ReadyScene& scene) {
  backend.load({scene.setup}, {scene.state});
  const State start = std::move(backend.snapshot().front());
  const int64_t frames = scene.setup.frame_count();
  std::vector<double> seconds;
  std::size_t removed = 0;
  int64_t isolated = 0, unequal_frames = 0;
  harness::TopologyFigures end;
  oracles::Interpenetration overlap;  // the greatest measured
  State state = start;
  oracles::CarriedSweep sweep(scene.setup);
  for (int64_t frame = 0; frame < frames; ++frame) {
    const bool is_swept = sweep.wants(state.frame);
    const State before = is_swept ? state : State{};
    seconds.push_back(run_frame(backend, baseline, scene.setup));
    state = std::move(backend.snapshot().front());
    if (is_swept) sweep.add(before, state);
    removed += state.removed.size() + state.debris.size();
    const bool last = frame + 1 == frames;
    // Without a removal all is connected and coupled as before.
    if (frame == 0 || last || !state.removed.empty()) end = harness::topology_of(scene.setup, state);
    isolated = std::max(isolated, end.isolated);
    unequal_frames += !end.equal;
    if (last || frame % kOverlapEvery == 0) {
      const oracles::Interpenetration found = oracles::interpenetration(scene.setup, state);
      if (found.volume > overlap.volume) overlap = found;
    }
  }
  return {{"name", baseline.name},
          {"source", baseline.source},
          {"settings",
           {{"expand", name_of(baseline.expand)},
            {"merge", name_of(baseline.merge)},
            {"detect", name_of(baseline.criterion)},
            {"remove", name_of(baseline.remove)},
            {"deletion", kDeletionNames[static_cast<std::size_t>(baseline.deletion)]}}},
          {"frames", frames},
          {"seconds", to_json(times_of(std::move(seconds)))},
          {"removed", removed},
          {"clusters_before", start.clusters.count()},
          {"clusters", state.clusters.count()},
          {"components", end.components},
          {"couplings", end.couplings},
          {"shells", end.shells},
          {"equal", end.equal},
          {"unequal_frames", unequal_frames},
          {"isolated", isolated},
          {"geometry", harness::to_json(oracles::cut_geometry(scene.setup, start, state, sweep.surface()))},
          {"interpenetration", harness::to_json(overlap)}};
}

}  // namespace cutproof::benchmarks
