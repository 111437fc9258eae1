#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "benchmarks/least_squares.h"
#include "benchmarks/prepared_scene.h"
#include "benchmarks/scene_parts.h"
#include "benchmarks/suites/suites.h"
#include "gpu/backends.h"
#include "model/at.h"
#include "model/error.h"
#include "model/io/json_number.h"
#include "model/io/scene_io.h"
#include "oracles/comparison/trajectory.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

// A run of a scene, stage by stage.
struct Looked {
  std::vector<oracles::Pose> poses;                 // at the end of each of its frames
  std::array<double, kStages.size()> seconds = {};  // total
  std::array<int64_t, kStages.size()> ran = {};     // number of frames with the stage
  std::vector<gpu::StepWork> work;                  // of each step; empty if the backend does not report it
  std::vector<double> step_seconds;                 // of each step
};
Looked look_at(Backend& backend, const PreparedScene& scene, const StopAsked& stop_asked) {
  Looked looked;
  const auto* const kernels = dynamic_cast<const gpu::KernelBackend*>(&backend);
  backend.load({scene.setup()}, {scene.start()});
  for (int64_t frame = 0; frame < scene.frame_count(); ++frame) {
    throw_if_asked(stop_asked);
    std::array<bool, kStages.size()> ran = {};
    scene.for_parts_of(frame, [&] {
      for (const Stage stage : kStages) {
        backend.run({stage, stage});
        const SpanReport report = backend.report();
        looked.seconds[at(stage)] += report.total_seconds;
        ran[at(stage)] = ran[at(stage)] || report.ran[at(stage)];
        if (stage != Stage::step) continue;
        looked.step_seconds.push_back(report.total_seconds);
        if (kernels != nullptr) looked.work.push_back(kernels->step_work());
      }
    });
    for (std::size_t s = 0; s < ran.size(); ++s) looked.ran[s] += ran[s];
    oracles::add_pose(looked.poses, scene.setup(), backend.snapshot().front());
  }
  return looked;
}

// The difference between a run and that of the full scene.
json error_of_run(const Setup& setup, const Looked& given, const Looked& without) {
  double rms = 0, max = 0;
  int64_t alive_in_one = 0;
  bool same_components = true;
  for (std::size_t f = 0; f < std::min(given.poses.size(), without.poses.size()); ++f) {
    const oracles::Apart apart = oracles::poses_apart(setup, given.poses[f], without.poses[f]);
    rms = std::max(rms, apart.position.rms());
    max = std::max(max, apart.position.max);
    alive_in_one = apart.alive_in_one;
    same_components = same_components && given.poses[f].components == without.poses[f].components;
  }
  return {{"rms_h", json_number(rms)},
          {"max_h", json_number(max)},
          {"removed_otherwise", alive_in_one},
          {"same_components", same_components}};
}

// Means over the steps; null if the backend does not report work.
json work_json(const std::vector<gpu::StepWork>& work) {
  if (work.empty()) return nullptr;
  const auto mean = [&](int64_t gpu::StepWork::*number) {
    double sum = 0;
    for (const gpu::StepWork& step : work) sum += static_cast<double>(step.*number);
    return sum / static_cast<double>(work.size());
  };
  return {{"carried", mean(&gpu::StepWork::carried)},
          {"held", mean(&gpu::StepWork::held)},
          {"resolved", mean(&gpu::StepWork::resolved)},
          {"loose", mean(&gpu::StepWork::loose)},
          {"groups", mean(&gpu::StepWork::groups)}};
}

// The cost of a resolved particle in a step, from the dependence of its time on their number. Numbers of groups and
// loose particles, which a cut changes, are separate factors. Null where more particles are loose than in groups: the
// cost of loose ones at a contact depends on the same number. seconds: of each step, in several runs.
json cost_of_resolved(const std::vector<gpu::StepWork>& work, const std::vector<std::vector<double>>& seconds) {
  int64_t loose = 0, grouped = 0;
  for (const gpu::StepWork& step : work) {
    loose += step.loose;
    grouped += step.carried + step.held + step.resolved;
  }
  if (loose >= grouped) return nullptr;
  std::vector<double> medians;
  for (const std::vector<double>& of_step : seconds) medians.push_back(times_of(of_step).median);
  std::vector<std::vector<double>> numbers;
  for (const auto number : {&gpu::StepWork::resolved, &gpu::StepWork::groups, &gpu::StepWork::loose}) {
    numbers.emplace_back();
    for (const gpu::StepWork& step : work) numbers.back().push_back(static_cast<double>(step.*number));
  }
  const std::optional<Slope> slope = slopes_of(numbers, medians).front();
  return slope ? json{{"seconds", slope->value}, {"standard_error", slope->standard_error}} : json(nullptr);
}

json stages_json(const Looked& looked, int64_t frames) {
  json stages = json::object();
  for (const Stage stage : kStages) {
    stages[std::string(name_of(stage))] = {
        {"seconds_per_frame", looked.seconds[at(stage)] / static_cast<double>(frames)},
        {"frames", looked.ran[at(stage)]}};
  }
  return stages;
}

// A scene, and the parts to leave out.
struct Asked {
  std::string file;
  Scene scene;
  std::vector<ScenePart> parts;
};
Asked asked_of(const std::string& file, std::optional<int64_t> frames) {
  Asked asked = {file, io::read_scene(file, {}), {}};
  const PreparedScene given(asked.scene, file, frames);
  const std::vector<int64_t> ends = given.stroke_end();
  std::optional<double> strokes_end;
  if (!ends.empty() && ends.back() >= 0) {
    strokes_end = static_cast<double>(ends.back() + 1) * asked.scene.frame_length;
  }
  asked.parts = parts_of(asked.scene, given.frame_count(), strokes_end);
  return asked;
}

// A run of the full scene, or without one part.
struct Variant {
  std::string part;  // empty: the full scene
  std::optional<PreparedScene> scene;
  std::string refused;  // why it cannot run
  Looked looked;
  std::vector<double> seconds;  // per frame, by turn
};
// The first is the full scene.
std::vector<Variant> look_at_all(Backend& backend, const Asked& asked, const PartsOptions& options) {
  std::vector<Variant> variants(1 + asked.parts.size());
  variants.front().scene.emplace(asked.scene, asked.file, options.frames);
  for (std::size_t p = 0; p < asked.parts.size(); ++p) {
    const ScenePart& part = asked.parts[p];
    Variant& variant = variants[p + 1];
    variant.part = part.name;
    try {
      variant.scene.emplace(part.without, asked.file, options.frames);
    } catch (const InputError& error) {
      variant.refused = error.what();
      continue;
    }
    if (part.cooks) variant.scene->begin_with(variants.front().scene->start());
  }
  for (Variant& variant : variants) {
    if (variant.scene) variant.looked = look_at(backend, *variant.scene, options.stop_asked);
  }
  return variants;
}

// In turns, so that disturbances of the machine affect all variants. Returns, for each turn, the times of the full
// scene's single steps.
std::vector<std::vector<double>> time_in_turns(Backend& backend, std::vector<Variant>& variants,
                                               const PartsOptions& options) {
  const Variant& given = variants.front();
  const auto frames = static_cast<double>(given.scene->frame_count());
  std::vector<std::vector<double>> steps(given.looked.step_seconds.size());
  for (int64_t repeat = 0; repeat < options.repeats; ++repeat) {
    for (Variant& variant : variants) {
      throw_if_asked(options.stop_asked);
      if (variant.scene) variant.seconds.push_back(variant.scene->run(backend, {}) / frames);
    }
    const Looked again = look_at(backend, *given.scene, options.stop_asked);
    for (std::size_t k = 0; k < steps.size(); ++k) steps[k].push_back(again.step_seconds[k]);
  }
  return steps;
}

// From the middle of its frames on, where a blade is cutting.
FrameErrors judge_midway(Backend& backend, const PreparedScene& scene) {
  backend.load({scene.setup()}, {scene.start()});
  for (int64_t frame = 0; frame < scene.frame_count() / 2; ++frame) {
    scene.for_parts_of(frame, [&] { backend.run(kWholeFrame); });
  }
  return judge_frames(backend, scene.setup());
}

json row_of(const Asked& asked, const Contender& contender, const Variant& given, const Variant& variant) {
  const Setup& setup = given.scene->setup();
  json row = {{"scene", asked.scene.name},
              {"particles", setup.body.particle_count()},
              {"clusters", given.scene->start().clusters.count()},
              {"backend", contender.described->name},
              {"precision", name_of(contender.described->precision)},
              {"substeps", asked.scene.step.substeps},
              {"iterations", asked.scene.step.iterations},
              {"frames", given.scene->frame_count()},
              {"without", variant.part.empty() ? json(nullptr) : json(variant.part)},
              {"refused", variant.refused},
              {"seconds_per_frame", to_json(times_of(variant.seconds))},
              {"of_given", nullptr},
              {"error", nullptr},
              {"work", work_json(variant.looked.work)}};
  if (!variant.scene) return row;
  std::vector<double> of_given;  // turn by turn
  for (std::size_t k = 0; k < variant.seconds.size(); ++k) of_given.push_back(variant.seconds[k] / given.seconds[k]);
  row["of_given"] = times_of(of_given).median;
  row["error"] = error_of_run(setup, given.looked, variant.looked);
  row["stages"] = stages_json(variant.looked, given.scene->frame_count());
  return row;
}

}  // namespace

json run_parts(const PartsOptions& options, const Progress& progress) {
  const Contender contender = make_contender(options.backend);
  Backend& backend = *contender.instance;
  // Invalid scenes are rejected before any measurement.
  std::vector<Asked> scenes;
  std::size_t rows = 0;
  for (const std::string& file : options.scenes) {
    scenes.push_back(asked_of(file, options.frames));
    rows += scenes.back().parts.size() + 1;
  }
  Report report("parts", options.backend,
                {{"frames", options.frames ? json(*options.frames) : json(nullptr)},
                 {"repeats", options.repeats},
                 {"rows_at_most", rows},
                 {"holds", true}},
                progress);
  for (const Asked& asked : scenes) {
    std::vector<Variant> variants = look_at_all(backend, asked, options);
    const Variant& given = variants.front();
    const std::vector<std::vector<double>> steps = time_in_turns(backend, variants, options);
    const FrameErrors judged = judge_midway(backend, *given.scene);
    for (const Variant& variant : variants) {
      json row = row_of(asked, contender, given, variant);
      if (&variant == &given) {
        row["judged"] = {{"frames", judged.frames},
                         {"topology_holds", judged.topology_holds()},
                         {"step_max_h", judged.step ? json_number(judged.step->position.max) : json(nullptr)}};
        row["per_resolved"] = cost_of_resolved(given.looked.work, steps);
      }
      report.add(std::move(row), &variant != &given || judged.topology_holds());
    }
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
