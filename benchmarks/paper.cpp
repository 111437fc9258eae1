#include "benchmarks/paper.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "benchmarks/report.h"
#include "benchmarks/times.h"
#include "model/io/scene_io.h"

namespace cutproof::benchmarks {

const std::vector<PaperScene>& paper_scenes() {
  using Paper = PaperScene::Milliseconds;
  // step, detect, split, merge, expand, skin; frame
  const Paper cuboid = {{16.99, 0.03, 3.98, 1.98, 3.37, 5.97}, 26.92};
  const Paper liver = {{26.34, 0.33, 6.75, 2.47, 6.35, 8.67}, 50.19};
  const Paper kidney = {{31.79, 0.41, 7.16, 2.9, 10.77, 8.03}, 59.75};
  static const std::vector<PaperScene> scenes = {{"cuboid", "cuboid_press", {}, {}, 19'404, 2904, cuboid, false},
                                                 {"liver", "liver_cut", {}, {}, 70'000, 3000, liver, false},
                                                 {"kidney", "kidney_arc", 101'096, 795, 101'096, 3000, kidney, false},
                                                 {"irregular", "irregular_sampled", {}, {}, 101'096, 3000, {}, true}};
  return scenes;
}

std::optional<double> PaperScene::paper_ms(const std::string& what) const {
  if (!paper) return {};
  if (what == "frame") return paper->frame;
  const auto stage = std::find(kStageNames.begin(), kStageNames.end(), what);
  if (stage == kStageNames.end()) return {};
  return paper->stage[static_cast<std::size_t>(stage - kStageNames.begin())];
}

const PaperScene* find_paper_scene(const std::string& name) {
  const std::vector<PaperScene>& scenes = paper_scenes();
  const auto found = std::find_if(scenes.begin(), scenes.end(), [&](const auto& scene) { return scene.name == name; });
  return found == scenes.end() ? nullptr : &*found;
}

const std::vector<PaperSampling>& paper_samplings() {
  static const std::vector<PaperSampling> rows = {
      {37'704, 301, 42.05}, {48'385, 383, 46.99}, {63'649, 506, 48.34}, {101'096, 795, 59.75}, {12'800, {}, 20.2}};
  return rows;
}

Scene embedded_scene(const std::string& file) {
  static const std::map<std::string, std::string> texts = {
#define SCENE(name, text) {name, text},
#include "benchmarks/embedded_scenes.inc"
#undef SCENE
  };
  return io::parse_scene(texts.at(file), file + ".json");
}

namespace {

// The first frame of the last stroke, and its last frame.
std::pair<int64_t, int64_t> last_stroke(const Setup& setup) {
  const auto stroke = static_cast<int32_t>(setup.stroke_end.size()) - 1;
  std::pair<int64_t, int64_t> frames = {setup.frame_count(), -1};
  for (std::size_t k = 0; k < setup.blade_moves.size(); ++k) {
    if (!setup.blade_moves[k].down || setup.blade_moves[k].stroke != stroke) continue;
    const int64_t frame = static_cast<int64_t>(k) / setup.step.substeps;
    frames = {std::min(frames.first, frame), std::max(frames.second, frame)};
  }
  return frames;
}

}  // namespace

BenchScene make_paper_scene(const std::string& file, const std::string& name, int64_t particles, Cooking cooking,
                            int64_t frames) {
  const auto begin = Clock::now();
  Scene spec = embedded_scene(file);
  const bool as_it_is = spec.clusters.method == Cooking::sampled;
  spec.clusters.method = cooking;
  if (cooking == Cooking::sampled) {
    const ClusterSpec own = spec.clusters;
    sample_as_paper(spec);
    if (as_it_is) spec.clusters = own;
  }
  fixtures::BuildOptions options;
  options.particles = particles;
  fixtures::Built built = fixtures::build(spec, file + ".json", options);

  BenchScene scene;
  scene.name = name;
  scene.cooking = cooking;
  const auto [first, last] = last_stroke(built.setup);
  const int64_t available = last + 1 - first - kJudgedFrames;
  require_option(frames <= available, "--frames",
                 fmt::format("the last stroke of {} has only {} frames that can be timed", name, available),
                 fmt::format("give at most {}", available));
  scene.warm_up = first + (available - frames) / 2;
  const BladeMove* const moves =
      &built.setup.blade_moves[static_cast<std::size_t>(scene.warm_up * built.setup.step.substeps)];
  scene.advance =
      norm(moves[built.setup.step.substeps - 1].to.edge - moves[0].from.edge) / built.setup.body.grid.spacing;
  scene.setup = std::move(built.setup);
  scene.state = std::move(built.state);
  scene.build_seconds = seconds_since(begin);
  return scene;
}

}  // namespace cutproof::benchmarks
