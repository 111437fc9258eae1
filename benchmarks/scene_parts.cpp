#include "benchmarks/scene_parts.h"

#include <algorithm>
#include <utility>

namespace cutproof::benchmarks {

namespace {

bool has_friction(const Scene& scene) {
  return (scene.blade && scene.blade->friction > 0) ||
         std::any_of(scene.walls.begin(), scene.walls.end(), [](const WallSpec& wall) { return wall.friction > 0; });
}

void drop_friction(Scene& scene) {
  if (scene.blade) scene.blade->friction = 0;
  for (WallSpec& wall : scene.walls) wall.friction = 0;
}

void drop_blade(Scene& scene, std::optional<double> strokes_end) {
  scene.blade.reset();
  if (!strokes_end) std::erase_if(scene.grips, [](const GripSpec& grip) { return grip.after_strokes; });
  for (GripSpec& grip : scene.grips) {
    if (!std::exchange(grip.after_strokes, false)) continue;
    grip.start += *strokes_end;
    if (grip.end >= 0) grip.end += *strokes_end;
  }
}

}  // namespace

std::vector<ScenePart> parts_of(const Scene& scene, int64_t frames, std::optional<double> strokes_end) {
  std::vector<ScenePart> parts;
  const auto add = [&](bool has, const char* name, const auto& drop, bool cooks = false) {
    if (!has) return;
    parts.push_back({name, scene, cooks});
    parts.back().without.frames = frames;
    drop(parts.back().without);
  };
  const StepParameters& step = scene.step;
  // A geometric blade only cuts, and would push if it did not cut: there detection is the blade.
  const Criterion criterion = scene.detect.criterion;
  const bool cuts = scene.blade && criterion != Criterion::none && criterion != Criterion::geometric;
  add(step.acceleration != Acceleration::none, "acceleration",
      [](Scene& s) { s.step.acceleration = Acceleration::none; });
  add(step.retardation > 0, "retardation", [](Scene& s) { s.step.retardation = 0; });
  add(scene.blade.has_value(), "blade", [&](Scene& s) { drop_blade(s, strokes_end); });
  add(!scene.walls.empty(), "walls", [](Scene& s) { s.walls.clear(); });
  add(has_friction(scene), "friction", drop_friction);
  add(!scene.grips.empty(), "grips", [](Scene& s) { s.grips.clear(); });
  add(cuts || (!scene.blade && scene.detect.without_blade), "detection",
      [](Scene& s) { s.detect.criterion = Criterion::none; });
  add(cuts && criterion == Criterion::distance && scene.detect.remove != RemovedEnds::both, "choice of ends",
      [](Scene& s) { s.detect.remove = RemovedEnds::both; });
  add(scene.split.debris > 0, "debris", [](Scene& s) { s.split.debris = 0; });
  add(
      scene.merge.rule != MergeRule::none, "merging", [](Scene& s) { s.merge.rule = MergeRule::none; }, true);
  add(
      scene.expand.rule != ExpandRule::none, "expansion", [](Scene& s) { s.expand.rule = ExpandRule::none; }, true);
  add(scene.skin.wanted, "skin", [](Scene& s) { s.skin.wanted = false; });
  add(scene.skin.wanted && (scene.body.fit_skin || scene.skin.fit_cuts), "fitted skin", [](Scene& s) {
    s.body.fit_skin = false;
    s.skin.fit_cuts = false;
  });
  return parts;
}

}  // namespace cutproof::benchmarks
