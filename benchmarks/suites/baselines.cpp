#include "benchmarks/suites/baselines.h"

#include <array>
#include <memory>

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

bool BaselinesResult::holds() const {
  return !rows.empty() && rows.front().found.isolated == 0 && rows.front().found.unequal_frames == 0;
}

json to_json(const BaselinesResult& result) {
  json document = begin_document(result.provenance, result.complete);
  document["particles_asked"] = result.particles_asked;
  document["particles"] = result.particles;
  document["spacing"] = result.spacing;
  document["seed"] = result.seed;
  document["holds"] = result.holds();
  document["rows"] = json::array();
  for (const auto& [baseline, found] : result.rows) document["rows"].push_back(row_json(baseline, found));
  return document;
}

BaselinesResult run_baselines(const BaselinesOptions& options, const Progress<BaselinesResult>& progress) {
  require_timed_backend(options.backend);
  BaselinesResult result;
  result.provenance = provenance_of("baselines", options.backend);
  result.particles_asked = options.particles;
  result.seed = options.seed;
  progress(result);
  for (const Baseline& baseline : baselines()) {
    harness::BackendChoice choice;
    choice.name = options.backend;
    const std::unique_ptr<Backend> backend = harness::make_backend(choice);
    BaselineScene scene = make_baseline_scene(baseline, options.particles, options.seed);
    result.particles = scene.setup.body.particle_count();
    result.spacing = scene.setup.body.grid.spacing;
    result.rows.push_back({baseline, run_baseline(*backend, baseline, std::move(scene))});
    result.complete = result.rows.size() == baselines().size();
    progress(result);
  }
  return result;
}

}  // namespace cutproof::benchmarks
