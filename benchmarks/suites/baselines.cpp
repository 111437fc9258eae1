#include "benchmarks/baselines.h"

#include <array>
#include <memory>

#include "benchmarks/suites/suites.h"
#include "harness/geometry_json.h"
#include "model/rules.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

const char* name_of(Deletion deletion) {
  constexpr std::array<const char*, 3> kNames = {"none", "particles", "clusters"};
  return kNames[static_cast<std::size_t>(deletion)];
}

json row_json(const Baseline& baseline, const BaselineRow& row) {
  return {{"name", baseline.name},
          {"source", baseline.source},
          {"settings",
           {{"expand", cutproof::name_of(baseline.expand)},
            {"merge", cutproof::name_of(baseline.merge)},
            {"detect", cutproof::name_of(baseline.criterion)},
            {"deletion", name_of(baseline.deletion)}}},
          {"frames", row.frames},
          {"seconds", to_json(row.frame)},
          {"removed", row.removed},
          {"clusters_before", row.clusters_before},
          {"clusters", row.clusters},
          {"components", row.end.components},
          {"couplings", row.end.couplings},
          {"shells", row.end.shells},
          {"equal", row.end.equal},
          {"unequal_frames", row.unequal_frames},
          {"isolated", row.isolated},
          {"geometry", harness::to_json(row.geometry)},
          {"interpenetration", harness::to_json(row.overlap)}};
}

}  // namespace

json run_baselines(const BaselinesOptions& options, const Progress& progress) {
  require_timed_backend(options.backend);
  Report report("baselines", options.backend,
                {{"particles_asked", options.particles}, {"seed", options.seed}, {"holds", true}}, progress);
  for (const Baseline& baseline : baselines()) {
    harness::BackendChoice choice;
    choice.name = options.backend;
    const std::unique_ptr<Backend> backend = harness::make_backend(choice);
    BaselineScene scene = make_baseline_scene(baseline, options.particles, options.seed);
    report.document["particles"] = scene.setup.body.particle_count();
    report.document["spacing"] = scene.setup.body.grid.spacing;
    const BaselineRow row = run_baseline(*backend, baseline, std::move(scene));
    // This method, the first, must leave nothing isolated and all components equal, in every frame.
    const bool is_ours = &baseline == &baselines().front();
    report.add(row_json(baseline, row), !is_ours || (row.isolated == 0 && row.unequal_frames == 0));
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
