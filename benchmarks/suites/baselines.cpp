#include "benchmarks/baselines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <memory>
#include <optional>

#include "benchmarks/methods.h"
#include "benchmarks/suites/suites.h"

namespace cutproof::benchmarks {

namespace {

// Table 3: every method on every kidney.
void add_methods(const BaselinesOptions& options, Report& report, const Progress& progress) {
  std::vector<std::unique_ptr<Method>> methods;
  for (const int32_t iterations : options.iterations) {
    methods.push_back(make_own_method(options.backend, baselines().front(), iterations));
  }
  // Other rules of removal, with the most iterations.
  for (const Baseline& baseline : baselines()) {
    const bool is_ours = &baseline == &baselines().front();
    const bool is_about_removal = baseline.deletion != Deletion::none || baseline.remove != RemovedEnds::both;
    if (!is_ours && is_about_removal) {
      methods.push_back(make_own_method(options.backend, baseline, options.iterations.back()));
    }
  }
  for (const std::string& plugin : options.with) methods.push_back(make_plugin_method(plugin));
  std::optional<ConvergedKidney> truth;
  if (!options.truth.empty()) {
    const std::unique_ptr<Method> method = make_plugin_method(options.truth);
    truth.emplace(*method, options.truth_particles, options.youngs_modulus);
    report.document["truth"] = {
        {"name", method->name()}, {"settings", method->settings()}, {"particles", truth->particles()}};
  }
  report.document["youngs_modulus"] = options.youngs_modulus;
  report.document["methods"] = nlohmann::json::array();
  for (const int64_t size : options.sizes) {
    const Kidney kidney = make_kidney(size, options.youngs_modulus);
    for (std::size_t k = 0; k < methods.size(); ++k) {
      std::string folder;
      if (!options.save.empty()) {
        folder = fmt::format("{}_{}_{}", k, methods[k]->name(), size);
        std::replace_if(
            folder.begin(), folder.end(), [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
        folder = options.save + "/" + folder;
      }
      report.document["methods"].push_back(
          row_of(*methods[k], kidney, truth ? &*truth : nullptr, options.kicks, folder));
      progress(report.document);
    }
  }
}

}  // namespace

nlohmann::json run_baselines(const BaselinesOptions& options, const Progress& progress) {
  require_timed_backend(options.backend);
  require_option(!options.with.empty() || (options.truth.empty() && options.save.empty()), "--with",
                 "without it no other simulator is asked, and --truth and --save mean nothing",
                 "give a plugin, or leave them out");
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
    // This method, the first, must isolate nothing and keep components equal in every frame.
    const bool is_ours = &baseline == &baselines().front();
    const bool holds = !is_ours || (row.at("isolated") == 0 && row.at("unequal_frames") == 0);
    report.add(std::move(row), holds);
  }
  if (!options.with.empty()) add_methods(options, report, progress);
  return report.complete();
}

}  // namespace cutproof::benchmarks
