#include "benchmarks/baselines.h"

#include <algorithm>

#include "fixtures/bodies.h"
#include "fixtures/build.h"
#include "model/at.h"
#include "reference_cpu/reference.h"

namespace cutproof::benchmarks {

namespace {

constexpr Span kWholeFrame = {Stage::step, Stage::skin};

// Frames between two in which interpenetration is measured.
constexpr int64_t kOverlapEvery = 8;

}  // namespace

const std::vector<Baseline>& baselines() {
  static const std::vector<Baseline> kAll = [] {
    std::vector<Baseline> all(7);
    all[0] = {.name = "this method", .source = "method.md"};
    all[1] = {.name = "particles deleted, no split", .source = "Berndt 2017", .deletion = Deletion::particles};
    all[2] = {.name = "clusters deleted, no split",
              .source = "Berndt 2017, as Yu 2024 §4 reads it",
              .deletion = Deletion::clusters};
    all[3] = {.name = "published expansion", .source = "Yu 2024", .expand = ExpandRule::published};
    all[4] = {.name = "no expansion", .source = "Yu 2024, Fig. 13a", .expand = ExpandRule::none};
    all[5] = {.name = "strain detection", .source = "Yu 2024, Fig. 7", .criterion = Criterion::strain};
    all[6] = {.name = "single_pass merging", .source = "Yu 2024", .merge = MergeRule::single_pass};
    return all;
  }();
  return kAll;
}

BaselineScene make_baseline_scene(const Baseline& baseline, int64_t particles, uint64_t seed) {
  constexpr double kPush = 0.16;  // [s]
  Scene scene;
  scene.name = "baselines";
  scene.seed = seed;
  Shape shape;
  shape.kind = Shape::Kind::kidney;
  shape.size = {0.11, 0.06, 0.05};
  scene.body.shape = shape;
  scene.body.particles = particles;
  scene.clusters.method = Cooking::sampled;
  scene.clusters.spacing = 2;
  scene.clusters.radius = 1.7;
  scene.step.damping = 5;
  scene.detect.criterion = baseline.criterion;
  scene.merge.rule = baseline.merge;
  scene.expand.rule = baseline.expand;
  scene.settle = 2 * kPush;
  BladeSpec blade;
  blade.length = 0.06;
  blade.depth = 2;
  blade.thickness = 0.5;
  blade.speed = 0.2;
  StrokeSpec irregular;
  irregular.points = {{0.2, -0.1, 0.25},  {0.27, 0.45, 0.25}, {0.36, 0.15, 0.25}, {0.4, 0.6, 0.25}, {0.5, 0.3, 0.25},
                      {0.54, 0.75, 0.25}, {0.64, 0.35, 0.25}, {0.68, 0.8, 0.25},  {0.8, 0.4, 0.25}, {0.82, 0.75, 0.25}};
  StrokeSpec through;
  through.points = {{0.57, -0.2, -0.2}, {0.57, 1.2, -0.2}};
  blade.strokes = {irregular, through};
  scene.blade = blade;
  GripSpec left, right;
  left.high = {0.12, 1, 1};
  right.low = {0.9, 0, 0};
  right.high = {1, 1, 1};
  scene.grips = {left, right};

  // The right grip lets go where the push begins, and only the schedule knows when that is.
  fixtures::Built built = fixtures::build(scene, "command line");
  scene.grips[1].end = built.schedule.time[at(built.setup.stroke_end.back() + 1)];
  GripSpec push = right;
  push.after_strokes = true;
  push.end = kPush;
  push.velocity = {-0.06, 0, 0};
  scene.grips.push_back(push);
  fixtures::resolve_schedule(scene, "command line", {}, built.setup);
  return {std::move(built.setup), std::move(built.state)};
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

BaselineRow run_baseline(Backend& backend, const Baseline& baseline, BaselineScene scene) {
  backend.load({scene.setup}, {scene.state});
  const State start = std::move(backend.snapshot().front());
  BaselineRow row;
  row.clusters_before = start.clusters.count();
  std::vector<double> seconds;
  State state = start;
  for (int64_t frame = 0; frame < scene.setup.frame_count(); ++frame) {
    double spent = 0;
    const auto run = [&](Span span) {
      backend.run(span);
      spent += backend.report().total_seconds;
    };
    if (baseline.deletion == Deletion::none) {
      run(kWholeFrame);
    } else {
      run({Stage::step, Stage::detect});
      state = std::move(backend.snapshot().front());
      if (!state.removed.empty()) {
        delete_from_clusters(scene.setup, baseline.deletion, state);
        backend.load({scene.setup}, {state});
      }
      run({Stage::skin, Stage::skin});
    }
    seconds.push_back(spent);
    state = std::move(backend.snapshot().front());
    row.removed += static_cast<int64_t>(state.removed.size() + state.debris.size());
    const bool last = frame + 1 == scene.setup.frame_count();
    // Where nothing was removed, all is connected and coupled as before.
    if (frame == 0 || last || !state.removed.empty()) row.end = harness::topology_of(scene.setup, state);
    row.isolated = std::max(row.isolated, row.end.isolated);
    row.unequal_frames += !row.end.equal;
    if (last || frame % kOverlapEvery == 0) {
      const oracles::Interpenetration found = oracles::interpenetration(scene.setup, state);
      if (found.volume > row.overlap.volume) row.overlap = found;
    }
  }
  row.frame = times_of(std::move(seconds));
  row.frames = scene.setup.frame_count();
  row.clusters = state.clusters.count();
  row.geometry = oracles::cut_geometry(scene.setup, start, state);
  return row;
}

}  // namespace cutproof::benchmarks
