#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <string>

#include "benchmarks/machine_limits.h"
#include "benchmarks/paper.h"
#include "benchmarks/stage_limits.h"
#include "benchmarks/suites/suites.h"
#include "model/io/verdict_json.h"
#include "model/rules.h"
#if CUTPROOF_HAS_CUDA
#include "benchmarks/raw_baseline.h"
#endif

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

// The requested scenes, made one at a time.
std::vector<std::function<BenchScene()>> scenes_of(const StagesOptions& options, int64_t frames) {
  std::vector<std::function<BenchScene()>> makers;
  std::vector<Cooking> asked;
  for (const std::string& name : options.cooking) asked.push_back(cooking_of(name));
  const auto asked_or = [&](std::vector<Cooking> otherwise) { return asked.empty() ? otherwise : asked; };
  require_timed_sizes(options.sizes);
  for (const int64_t size : options.sizes) {
    for (const Cooking cooking : asked_or({Cooking::boxes})) {
      makers.push_back([=] { return make_bench_scene(size, frames, cooking); });
    }
  }
  if (!makers.empty()) return makers;
  for (const std::string& name : options.scenes) {
    const PaperScene* const scene = find_paper_scene(name);
    require_option(scene != nullptr, "--scenes", fmt::format("there is no scene '{}'", name),
                   "use cuboid, liver, kidney and irregular");
    for (const Cooking method : asked_or({Cooking::boxes, Cooking::sampled})) {
      if (scene->sampled_only && method != Cooking::sampled) continue;
      const int64_t particles =
          options.full || options.described().takes_full_size ? scene->full_particles : scene->small_particles;
      makers.push_back([=] { return make_paper_scene(scene->file, scene->name, particles, method, frames); });
    }
  }
  return makers;
}

json scene_json(const BenchScene& scene, const Contender& contender, const Measured& measured) {
  const Setup& setup = scene.setup;
  const Groups groups = groups_of(setup, scene.state);
  json entry = {{"scene", scene.name},
                {"cooking", name_of(scene.cooking)},
                {"backend", contender.described->name},
                {"body",
                 {{"name", setup.body.name},
                  {"particles", setup.body.particle_count()},
                  {"clusters", scene.state.clusters.count()},
                  {"memberships", scene.state.clusters.members.size()},
                  {"groups", groups.groups},
                  {"loose", groups.loose},
                  {"spacing", setup.body.grid.spacing},
                  {"nodes", setup.body.grid.nodes}}},
                {"stiffness", setup.step.stiffness},
                {"damping", setup.step.damping},
                {"blade_advance_h", scene.advance},
                {"warm_up", scene.warm_up},
                {"bytes", measured.bytes ? json(*measured.bytes) : json(nullptr)},
                {"build_seconds", scene.build_seconds},
                {"judged_frames", 0},
                {"judge_seconds", measured.judge_seconds}};
  if (measured.judged) {
    entry["judged_frames"] = measured.judged->frames;
    entry["isolated_groups"] = measured.judged->isolated_groups;
    entry["topology"] = io::verdicts_json(measured.judged->topology);
  }
  return entry;
}

// Least times of a kernel backend's stages, by name.
std::map<std::string, StageLimit> limits_of(const BenchScene& scene, const Contender& contender) {
  std::map<std::string, StageLimit> limits;
  if (!contender.described->runs_kernels) return limits;
  const StageLimits found = stage_limits(scene.setup, scene.state);
  for (const Stage stage : kStages) limits.emplace(name_of(stage), found[static_cast<std::size_t>(stage)]);
  return limits;
}

// A row for whole frames and for each stage: its time, its error and its limit. unjudged: replaces the error of rows
// that are not judged.
void add_rows(const BenchScene& scene, const Contender& contender, const Measured& measured,
              const MachineLimits& machine, json& document, const char* unjudged = "not measured") {
  const std::map<std::string, StageLimit> limits = limits_of(scene, contender);
  const PaperScene* const known = find_paper_scene(scene.name);
  for (const auto& [what, times] : measured.timings.named()) {
    json row = run_fields(scene, contender);
    const json error = error_of(what, measured);
    row["cooking"] = name_of(scene.cooking);
    row["what"] = what;
    row["seconds"] = to_json(times);
    row["frames"] = times.count;
    row["of"] = document.at("frames").get<int64_t>() * document.at("repeats").get<int64_t>();
    row["paper_seconds"] = nullptr;
    if (const auto ms = known == nullptr ? std::nullopt : known->paper_ms(what)) row["paper_seconds"] = 1e-3 * *ms;
    row["error"] = error;
    row["error_text"] = in_words(error, measured.judged ? "did not run" : unjudged);
    row["limit"] = nullptr;
    if (const auto found = limits.find(what); found != limits.end() && times.count > 0) {
      row["limit"] = limit_json(found->second, machine, times.median);
    }
    document["rows"].push_back(std::move(row));
  }
}

}  // namespace

json run_stages(const StagesOptions& options, const Progress& progress) {
  const int64_t frames = options.frames_or_default();
  const auto scenes = scenes_of(options, frames);
  // Throws for bad options before any measurement.
  static_cast<void>(make_contender(options.backend));
  const std::size_t rows = scenes.size() * steps_of(options, {}).size();
  static_cast<void>(detection_of(options, {}));
  const MachineLimits machine = measure_machine(options.described());
  json fields = {
      {"frames", frames}, {"repeats", options.repeats}, {"machine_limits", to_json(machine)}, {"rows_at_most", rows},
      {"holds", true},    {"rows", json::array()}};
#if CUTPROOF_HAS_CUDA
  if (options.described().needs_device()) {
    fields["launch_layer"] = json::parse(gpu::raw_baseline_json(gpu::compare_with_raw(1'000'000, 200)));
  }
#endif
  Report report("stages", options.backend, fields, progress, "scenes");
  for (const auto& make_scene : scenes) {
    BenchScene scene = make_scene();
    scene.setup.detect = detection_of(options, scene.setup.detect);
    for (const StepParameters& asked : steps_of(options, scene.setup.step)) {
      scene.setup.step = asked;
      const Contender contender = make_contender(options.backend);
      const auto entry_of = [&](const Measured& measured) {
        json entry = scene_json(scene, contender, measured);
        entry["frames"] = frames;
        entry["repeats"] = options.repeats;
        return entry;
      };
      const Measured measured = measure(contender, scene, frames, options.repeats, [&](const Measured& times) {
        json so_far = report.document;
        add_rows(scene, contender, times, machine, so_far, "not judged yet");
        so_far["scenes"].push_back(entry_of(times));
        report.show_timed(std::move(so_far));
      });
      add_rows(scene, contender, measured, machine, report.document);
      report.add(entry_of(measured), measured.holds());
    }
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
