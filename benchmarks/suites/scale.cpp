#include "benchmarks/suites/suites.h"

namespace cutproof::benchmarks {

namespace {

std::vector<int64_t> sizes_of(const ScaleOptions& options) {
  require_timed_sizes(options.sizes);
  if (!options.sizes.empty()) return options.sizes;
  if (options.described().takes_full_size) {
    return {1000, 3000, 10'000, 30'000, 100'000, 300'000, 1'000'000, 3'000'000, 10'000'000};
  }
  return {1000, 3000, 10'000};  // less than a minute
}

}  // namespace

nlohmann::json run_scale(const ScaleOptions& options, const Progress& progress) {
  const std::vector<int64_t> sizes = sizes_of(options);
  const int64_t frames = options.frames_or_default();
  // Throws for bad options before anything is shown.
  static_cast<void>(make_contender(options.backend));
  const std::size_t rows = sizes.size() * steps_of(options, {}).size();
  static_cast<void>(detection_of(options, {}));
  Report report("scale", options.backend,
                {{"frames", frames}, {"repeats", options.repeats}, {"rows_at_most", rows}, {"holds", true}}, progress);
  for (const int64_t size : sizes) {
    BenchScene scene = make_bench_scene(size, frames);
    scene.setup.detect = detection_of(options, scene.setup.detect);
    for (const StepParameters& step : steps_of(options, scene.setup.step)) {
      scene.setup.step = step;
      const Contender contender = make_contender(options.backend);
      const auto row_of = [&](const Measured& measured) {
        nlohmann::json row = scene_row(scene, contender, measured);
        row["particles_per_second"] =
            static_cast<double>(scene.setup.body.particle_count()) / measured.timings.frame.median;
        row["bytes"] = measured.bytes ? nlohmann::json(*measured.bytes) : nlohmann::json(nullptr);
        return row;
      };
      const Measured measured = measure(contender, scene, frames, options.repeats, [&](const Measured& times) {
        nlohmann::json so_far = report.document;
        so_far["rows"].push_back(row_of(times));
        report.show_timed(std::move(so_far));
      });
      report.add(row_of(measured), measured.holds());
    }
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
