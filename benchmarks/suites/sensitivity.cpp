#include "benchmarks/sensitivity.h"

#include <fmt/format.h>

#include <array>

#include "benchmarks/paper.h"
#include "benchmarks/suites/suites.h"
#include "fixtures/build.h"
#include "harness/backends.h"
#include "model/at.h"
#include "model/io/json_number.h"
#include "model/io/verdict_json.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

ReadyScene make_scene(const std::string& name, int64_t particles) {
  Scene scene = embedded_scene(name);
  fixtures::BuildOptions build;
  build.particles = particles;
  fixtures::Built built = fixtures::build(scene, "command line", build);
  return {name, std::move(built.setup), std::move(built.state)};
}

json scene_entry(const ReadyScene& scene, const KeptRun& run) {
  json properties = json::array(), failed = json::array();
  for (const harness::PropertySummary& one : run.properties.all()) {
    properties.push_back({{"property", one.property},
                          {"stage", name_of(one.stage)},
                          {"unit", one.unit},
                          {"checked", one.checked},
                          {"measured", json_number(one.measured)},
                          {"of_bound", json_number(one.of_bound)}});
  }
  for (const Verdict& verdict : run.failed) failed.push_back(io::verdict_json(verdict, false));
  return {{"scene", scene.name},
          {"particles", scene.setup.body.particle_count()},
          {"clusters", scene.state.clusters.count()},
          {"frames", scene.setup.frame_count()},
          {"properties", properties},
          {"failed", failed}};
}

json row_of(const ReadyScene& scene, const KeptRun& run, const Disturbance& disturbance, Stage stage,
            const Sensitivity& found) {
  json row = {{"scene", scene.name},
              {"disturbance", disturbance.name},
              {"stage", name_of(stage)},
              {"unit", disturbance.unit},
              {"moments", found.moments},
              {"greatest_tried", disturbance.greatest},
              {"least", json_number(found.least)},
              {"property", nullptr},
              {"measured", nullptr},
              {"measured_unit", nullptr},
              {"of_bound", nullptr},
              {"rounding", json_number(found.rounding)},
              {"ratio", nullptr},
              {"goal", json_number(disturbance.goal)},
              {"within_goal", nullptr}};
  if (found.least) {
    row["property"] = found.property;
    if (const harness::PropertySummary* const correct = run.properties.find(found.property, stage)) {
      row["measured"] = json_number(correct->measured);
      row["measured_unit"] = correct->unit;
      row["of_bound"] = json_number(correct->of_bound);
    }
  }
  std::optional<double> goal = disturbance.goal;
  // Where correct code has no rounding, no error is allowed.
  if (found.rounding) goal = std::max(kRoundingsAllowed * *found.rounding, kLeastSize);
  if (found.rounding && *found.rounding > 0 && found.least) row["ratio"] = *found.least / *found.rounding;
  if (goal) {
    row["goal"] = *goal;
    row["within_goal"] = found.least && *found.least <= *goal;
  }
  return row;
}

// Weight at 45 degrees, where friction 0.5 does not hold; nothing else slides.
constexpr const char* kSliding = "small_block, sliding";
constexpr double kAcross = 7;  // [m/s²]

}  // namespace

json run_sensitivity(const SensitivityOptions& options, const Progress& progress) {
  require_option(options.particles >= 100 && options.particles <= 3000, "--particles",
                 fmt::format("{} particles are too few or too many", options.particles),
                 "give a number from 100 to 3000");
  harness::BackendChoice choice;
  choice.name = options.backend;
  const std::unique_ptr<Backend> backend = harness::make_backend(choice);
  require_option(
      backend->can_run({Stage::step, Stage::step}), "--backend",
      fmt::format("'{}' runs no step by itself, so nothing can be disturbed between its stages", options.backend),
      fmt::format("use one of {}", harness::backend_names()));
  constexpr std::array<const char*, 3> kScenes = {"small_block", "kidney_discontinuous", kSliding};
  std::size_t rows_of_a_scene = 0;
  for (const Disturbance& disturbance : disturbances()) rows_of_a_scene += disturbance.of_run ? 1 : kStages.size();
  Report report("sensitivity", options.backend,
                {{"particles_asked", options.particles},
                 {"moments", options.moments},
                 {"least_tried", kLeastSize},
                 {"scenes", json::array()},
                 {"rows_at_most", kScenes.size() * rows_of_a_scene},
                 {"holds", true}},
                progress);
  for (const std::string name : kScenes) {
    ReadyScene scene = make_scene(name == kSliding ? "small_block" : name, options.particles);
    if (name == kSliding) {
      scene.name = name;
      scene.setup.step.gravity = {kAcross, 0, -kAcross};
    }
    const KeptRun run = keep_run(*backend, scene, options.stop_asked);
    report.document["scenes"].push_back(scene_entry(scene, run));
    for (const Stage stage : kStages) {
      const std::vector<harness::Moment> moments = moments_of(scene.setup, run.trace, stage, options.moments);
      for (const Disturbance& disturbance : disturbances()) {
        if (disturbance.of_run && stage != Stage::step) continue;
        const Sensitivity found =
            least_rejected(*backend, scene.setup, disturbance, stage, moments, options.stop_asked);
        if (found.moments == 0) continue;
        report.add(row_of(scene, run, disturbance, stage, found), run.failed.empty());
      }
    }
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
