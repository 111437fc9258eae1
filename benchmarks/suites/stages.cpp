#include "benchmarks/suites/stages.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "benchmarks/paper.h"
#include "model/at.h"
#include "model/error.h"
#include "model/io/verdict_json.h"
#if CUTPROOF_HAS_CUDA
#include "benchmarks/raw_baseline.h"
#endif

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

// The scenes that are asked for, made one after the other.
std::vector<std::function<BenchScene()>> scenes_of(const StagesOptions& options, int64_t frames) {
  std::vector<std::function<BenchScene()>> makers;
  require_timed_sizes(options.sizes);
  for (const int64_t size : options.sizes) makers.push_back([=] { return make_bench_scene(size, frames); });
  if (!makers.empty()) return makers;
  for (const std::string& name : options.scenes) {
    const PaperScene* const scene = find_paper_scene(name);
    if (scene == nullptr) {
      throw InputError("command line", "--scenes", fmt::format("there is no scene '{}'", name),
                       "use cuboid, liver, kidney and irregular");
    }
    for (const std::string& cooking : options.cooking) {
      const Cooking method = cooking_of(cooking);
      if (scene->sampled_only && method != Cooking::sampled) continue;
      const int64_t particles =
          options.full || options.described().takes_full_size ? scene->full_particles : scene->small_particles;
      makers.push_back([=] { return make_paper_scene(scene->file, scene->name, particles, method, frames); });
    }
  }
  return makers;
}

StepLimit step_limit(const BenchScene& scene, const Times& step, const MachineLimits& machine) {
  StepLimit limit;
  limit.traffic = step_traffic(scene.setup, scene.state);
  limit.bytes_seconds = limit.traffic.bytes / machine.copy_bytes_per_second;
  limit.seconds = limit.bytes_seconds;
  if (machine.graph_node_seconds) {
    limit.launch_seconds = static_cast<double>(limit.traffic.launches) * *machine.graph_node_seconds;
    limit.seconds = std::max(limit.seconds, *limit.launch_seconds);
  }
  limit.multiple = step.median / limit.seconds;
  limit.multiple_of_bytes = step.median / limit.bytes_seconds;
  return limit;
}

StagesScene stages_scene(const BenchScene& scene, const Contender& contender, Measured measured,
                         const MachineLimits& machine) {
  StagesScene result;
  const Setup& setup = scene.setup;
  result.cooking = scene.cooking;
  result.body = setup.body.name;
  result.nodes = setup.body.grid.nodes;
  result.stiffness = setup.step.stiffness;
  result.damping = setup.step.damping;
  result.advance = scene.advance;
  result.warm_up = scene.warm_up;
  result.build_seconds = scene.build_seconds;
  if (contender.runs_kernels) {
    result.step_limit = step_limit(scene, measured.timings.stage[at(Stage::step)], machine);
  }
  result.row = scene_row(scene, contender, std::move(measured));
  return result;
}

json to_json(const StepLimit& limit) {
  json result = {{"bytes", limit.traffic.bytes},         {"launches", limit.traffic.launches},
                 {"bytes_seconds", limit.bytes_seconds}, {"seconds", limit.seconds},
                 {"multiple", limit.multiple},           {"multiple_of_bytes", limit.multiple_of_bytes}};
  if (limit.launch_seconds) result["launch_seconds"] = *limit.launch_seconds;
  return result;
}

json scene_json(const StagesScene& scene, const StagesResult& result) {
  const SceneRow& row = scene.row;
  const std::optional<FrameErrors>& judged = row.measured.judged;
  json entry = {{"scene", row.scene},
                {"cooking", scene.cooking},
                {"backend", row.backend},
                {"rotation", row.rotation},
                {"split", row.split},
                {"body",
                 {{"name", scene.body},
                  {"particles", row.particles},
                  {"clusters", row.clusters},
                  {"memberships", row.memberships},
                  {"spacing", row.spacing},
                  {"nodes", scene.nodes}}},
                {"stiffness", scene.stiffness},
                {"damping", scene.damping},
                {"blade_advance_h", scene.advance},
                {"warm_up", scene.warm_up},
                {"frames", result.frames},
                {"repeats", result.repeats},
                {"build_seconds", scene.build_seconds},
                {"judged_frames", judged ? judged->frames : 0},
                {"judge_seconds", row.measured.judge_seconds}};
  if (judged) {
    entry["isolated_groups"] = judged->isolated_groups;
    entry["topology"] = json::array();
    for (const Verdict& verdict : judged->topology) entry["topology"].push_back(io::verdict_json(verdict, false));
  }
  if (scene.step_limit) entry["step_limit"] = to_json(*scene.step_limit);
  return entry;
}

}  // namespace

std::vector<StagesScene::Timed> StagesScene::timed() const {
  const Timings& timings = row.measured.timings;
  const PaperScene* const known = find_paper_scene(row.scene);
  const PaperScene::Milliseconds* const paper = known && known->paper ? &*known->paper : nullptr;
  const ErrorColumn frame_error = error_of_frame(row.measured);
  std::vector<Timed> all;
  all.push_back({"frame", timings.frame, paper ? std::optional(paper->frame) : std::nullopt, frame_error});
  all.push_back({"frame, cutting", timings.cutting, {}, frame_error});
  if (timings.back_to_back.count > 0) all.push_back({"back to back", timings.back_to_back, {}, frame_error});
  for (const Stage stage : kStages) {
    all.push_back({std::string(name_of(stage)), timings.stage[at(stage)],
                   paper ? std::optional(paper->stage[at(stage)]) : std::nullopt, error_of(stage, row.measured)});
  }
  return all;
}

bool StagesResult::holds() const {
  return std::all_of(scenes.begin(), scenes.end(), [](const auto& scene) { return scene.row.measured.holds(); });
}

json to_json(const StagesResult& result) {
  json document = begin_document(result.provenance, result.complete);
  document["frames"] = result.frames;
  document["repeats"] = result.repeats;
  document["machine_limits"] = to_json(result.machine);
  if (!result.launch_layer.is_null()) document["launch_layer"] = result.launch_layer;
  document["holds"] = result.holds();
  document["rows"] = json::array();
  document["scenes"] = json::array();
  for (const StagesScene& scene : result.scenes) {
    for (const StagesScene::Timed& timed : scene.timed()) {
      document["rows"].push_back({{"scene", scene.row.scene},
                                  {"particles", scene.row.particles},
                                  {"cooking", scene.cooking},
                                  {"backend", scene.row.backend},
                                  {"precision", scene.row.precision},
                                  {"substeps", scene.row.substeps},
                                  {"iterations", scene.row.iterations},
                                  {"rotation", scene.row.rotation},
                                  {"split", scene.row.split},
                                  {"what", timed.what},
                                  {"seconds", to_json(timed.seconds)},
                                  {"frames", timed.seconds.count},
                                  {"of", result.frames * result.repeats},
                                  {"paper_seconds", timed.paper_ms ? json(1e-3 * *timed.paper_ms) : json(nullptr)},
                                  {"error", timed.error.value},
                                  {"error_text", timed.error.text}});
    }
    document["scenes"].push_back(scene_json(scene, result));
  }
  return document;
}

StagesResult run_stages(const StagesOptions& options, const Progress<StagesResult>& progress) {
  StagesResult result;
  result.frames = options.frames_or_default();
  result.repeats = options.repeats;
  result.is_table_1 = options.sizes.empty();
  const auto scenes = scenes_of(options, result.frames);
  const std::vector<Contender> contenders = make_contenders(options.backend, options.split, options.rotation);
  result.provenance = provenance_of("stages", options.backend);
  result.machine = measure_machine(options.described());
#if CUTPROOF_HAS_CUDA
  if (options.described().needs_device()) {
    result.launch_layer = json::parse(gpu::raw_baseline_json(gpu::compare_with_raw(1'000'000, 200)));
  }
#endif
  progress(result);
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const BenchScene scene = scenes[k]();
    for (const Contender& contender : contenders) {
      result.scenes.push_back(
          stages_scene(scene, contender, measure(contender, scene, result.frames, result.repeats), result.machine));
      result.complete = k + 1 == scenes.size() && &contender == &contenders.back();
      progress(result);
    }
  }
  return result;
}

}  // namespace cutproof::benchmarks
