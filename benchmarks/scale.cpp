// `cutproof bench scale`: what a frame takes from a thousand particles to ten million.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "benchmarks/memory.h"
#include "benchmarks/report.h"
#include "benchmarks/stages.h"
#include "benchmarks/suites.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;

struct ScaleOptions : TimingOptions {
  std::vector<int64_t> sizes;  // empty: by backend
};

std::vector<int64_t> sizes_of(const ScaleOptions& options) {
  require_timed_sizes(options.sizes);
  if (!options.sizes.empty()) return options.sizes;
  if (options.backend == "gpu") {
    return {1000, 3000, 10'000, 30'000, 100'000, 300'000, 1'000'000, 3'000'000, 10'000'000};
  }
  return {1000, 3000, 10'000};  // less than a minute
}

int bench_scale(const ScaleOptions& options) {
  const int64_t frames = options.frames_or_default();
  const std::vector<int64_t> sizes = sizes_of(options);
  std::vector<Contender> contenders = make_contenders(options.backend, options.split, options.rotation);
  require_writable(options.json);

  json document = begin_report("scale", options.backend);
  document["frames"] = frames;
  document["repeats"] = options.repeats;
  document["rows"] = json::array();
  document["holds"] = true;

  Table table(joined({{"median ms", "particles", "clusters"},
                      scene_row_times(),
                      {"M particles/s", "MB", "B/particle"},
                      scene_row_errors()}));
  for (const int64_t size : sizes) {
    BenchScene scene = make_bench_scene(size, frames);
    // New ones for each size, so that what one keeps is what this size needs.
    contenders = make_contenders(options.backend, options.split, options.rotation);
    for (const Contender& contender : contenders) {
      const std::optional<int64_t> before = bytes_in_use(options.backend);
      const Measured measured = measure(contender, scene, frames, options.repeats);
      const std::optional<int64_t> after = bytes_in_use(options.backend);
      const auto particles = static_cast<double>(scene.setup.body.particle_count());
      const double rate = particles / measured.timings.frame.median;
      std::optional<int64_t> kept;
      if (before && after && *after > *before) kept = *after - *before;

      SceneRow row = scene_row(scene, contender, measured);
      table.add(joined(
          {row.counts,
           row.times,
           {fmt::format("{:.4g}", 1e-6 * rate), kept ? fmt::format("{:.4g}", 1e-6 * static_cast<double>(*kept)) : "-",
            kept ? fmt::format("{:.0f}", static_cast<double>(*kept) / particles) : "-"},
           row.errors}));
      print_measured(scene, contender, measured);

      row.json["particles_per_second"] = rate;
      row.json["bytes"] = kept ? json(*kept) : json(nullptr);
      document["rows"].push_back(std::move(row.json));
      document["holds"] = document["holds"].get<bool>() && measured.holds();
      document["complete"] = size == sizes.back() && &contender == &contenders.back();
      // After each size, so that what has been measured is kept if a later one fails.
      write_report(options.json, document);
    }
  }
  fmt::print("\n{}", table.text());
  if (!options.json.empty()) fmt::print("wrote {}\n", options.json);
  return document["holds"].get<bool>() ? 0 : 1;
}

}  // namespace

Suite scale_suite() {
  return {"scale", "a frame, its stages and its memory from a thousand particles to ten million",
          [](CLI::App& command) {
            const auto options = std::make_shared<ScaleOptions>();
            declare(*options, command);
            command
                .add_option("--sizes", options->sizes,
                            "particles, separated by commas (default: 1000 to 10000; gpu: to 10000000)")
                ->delimiter(',')
                ->type_name("N,N...");
            return [options] { return bench_scale(*options); };
          }};
}

}  // namespace cutproof::cli
