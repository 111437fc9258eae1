// `cutproof bench scale`: what a frame takes from a thousand particles to ten million.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "cli/bench/memory.h"
#include "cli/bench/report.h"
#include "cli/bench/stages.h"
#include "cli/bench/suites.h"

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

  std::vector<std::string> head = {"median ms", "particles", "clusters"};
  for (const Stage stage : kStages) head.emplace_back(name_of(stage));
  for (const char* word :
       {"frame", "least", "most", "M particles/s", "MB", "B/particle", "error of step", "topology"}) {
    head.emplace_back(word);
  }
  Table table(head);
  for (const int64_t size : sizes) {
    BenchScene scene = make_bench_scene(size, frames);
    // New ones for each size, so that what one keeps is what this size needs.
    contenders = make_contenders(options.backend, options.split, options.rotation);
    for (const Contender& contender : contenders) {
      const std::optional<int64_t> before = bytes_in_use(options.backend);
      const Measured measured = measure(contender, scene, frames, options.repeats);
      const std::optional<int64_t> after = bytes_in_use(options.backend);
      const int64_t particles = scene.setup.body.particle_count();
      const Times& frame = measured.timings.frame;
      const double rate = static_cast<double>(particles) / frame.median;
      std::optional<int64_t> kept;
      if (before && after && *after > *before) kept = *after - *before;

      std::vector<std::string> row = {scene.name, fmt::format("{}", particles),
                                      fmt::format("{}", scene.state.clusters.count())};
      for (const Stage stage : kStages) row.push_back(ms(measured.timings.stage[static_cast<std::size_t>(stage)]));
      row.push_back(ms(frame));
      row.push_back(fmt::format("{:.4g}", 1e3 * frame.min));
      row.push_back(fmt::format("{:.4g}", 1e3 * frame.max));
      row.push_back(fmt::format("{:.4g}", 1e-6 * rate));
      row.push_back(kept ? fmt::format("{:.4g}", 1e-6 * static_cast<double>(*kept)) : "-");
      row.push_back(kept ? fmt::format("{:.0f}", static_cast<double>(*kept) / static_cast<double>(particles)) : "-");
      row.push_back(error_of(Stage::step, measured.errors()).text);
      row.push_back(error_of_frame(measured.errors()).text);
      table.add(row);
      fmt::print("{}, split {}: {} particles, frame {} ms\n", scene.name, contender.split, particles, ms(frame));
      if (measured.judged) print_failures(*measured.judged);
      std::fflush(stdout);

      document["rows"].push_back({{"scene", scene.name},
                                  {"particles", particles},
                                  {"clusters", scene.state.clusters.count()},
                                  {"memberships", scene.state.clusters.members.size()},
                                  {"spacing", scene.setup.body.grid.spacing},
                                  {"backend", contender.backend},
                                  {"precision", contender.precision},
                                  {"substeps", scene.setup.step.substeps},
                                  {"iterations", scene.setup.step.iterations},
                                  {"rotation", contender.rotation},
                                  {"split", contender.split},
                                  {"seconds", seconds_by_stage(measured.timings)},
                                  {"particles_per_second", rate},
                                  {"bytes", kept ? json(*kept) : json(nullptr)},
                                  {"error", errors_by_stage(measured.errors())},
                                  {"judged_frames", measured.judged ? measured.judged->frames : 0}});
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
