#include "benchmarks/baselines.h"

#include <memory>

#include "benchmarks/suites/suites.h"

namespace cutproof::benchmarks {

nlohmann::json run_baselines(const BaselinesOptions& options, const Progress& progress) {
  require_timed_backend(options.backend);
  Report report("baselines", options.backend,
                {{"particles_asked", options.particles},
                 {"seed", options.seed},
                 {"rows_at_most", baselines().size()},
                 {"holds", true}},
                progress);
  for (const Baseline& baseline : baselines()) {
    const std::unique_ptr<Backend> backend = make_timed_backend(options.backend);
    const ReadyScene scene = make_baseline_scene(baseline, options.particles, options.seed);
    report.document["particles"] = scene.setup.body.particle_count();
    report.document["spacing"] = scene.setup.body.grid.spacing;
    nlohmann::json row = run_baseline(*backend, baseline, scene);
    // This method, the first, must leave nothing isolated and all components equal, in every frame.
    const bool is_ours = &baseline == &baselines().front();
    const bool holds = !is_ours || (row.at("isolated") == 0 && row.at("unequal_frames") == 0);
    report.add(std::move(row), holds);
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
