// `cutproof bench sampling`: Table 2 of the paper, a kidney's discontinuous cut at four samplings.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "benchmarks/paper.h"
#include "benchmarks/report.h"
#include "benchmarks/stages.h"
#include "benchmarks/suites.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;

// Without --full, the paper's counts of particles divided by this.
constexpr int64_t kScaledDown = 16;

struct SamplingOptions : TimingOptions {
  std::string cooking = "boxes";
  bool full = false;
};

std::string percent(double ratio) { return fmt::format("{:+.1f} %", 100 * (ratio - 1)); }

int bench_sampling(const SamplingOptions& options) {
  const int64_t frames = options.frames_or_default();
  const Cooking cooking = cooking_of(options.cooking);
  const std::vector<Contender> contenders = make_contenders(options.backend, options.split, options.rotation);
  require_writable(options.json);
  const bool full = options.full || options.backend == "gpu";

  json document = begin_report("sampling", options.backend);
  document["frames"] = frames;
  document["repeats"] = options.repeats;
  document["cooking"] = options.cooking;
  document["scaled_down"] = full ? 1 : kScaledDown;
  document["rows"] = json::array();
  document["holds"] = true;

  Table table(joined({{"median ms", "particles", "clusters", "paper's"},
                      scene_row_times(),
                      {"to first", "paper ms", "to first"},
                      scene_row_errors()}));
  for (const Contender& contender : contenders) {
    double first_frame = 0;
    for (const PaperSampling& paper : paper_samplings()) {
      const int64_t wanted = full ? paper.particles : paper.particles / kScaledDown;
      BenchScene scene = make_paper_scene("kidney_101096", fmt::format("kidney_{}", wanted), wanted, cooking, frames);
      const Measured measured = measure(contender, scene, frames, options.repeats);
      const Times& frame = measured.timings.frame;
      if (first_frame == 0) first_frame = frame.median;
      const double growth = frame.median / first_frame;
      const double paper_growth = paper.frame_ms / paper_samplings().front().frame_ms;
      SceneRow row = scene_row(scene, contender, measured);
      table.add(joined({row.counts,
                        {full ? fmt::format("{}", paper.clusters) : "-"},
                        row.times,
                        {percent(growth), fmt::format("{:.2f}", paper.frame_ms), percent(paper_growth)},
                        row.errors}));
      print_measured(scene, contender, measured);

      row.json["frame_to_first"] = growth;
      row.json["paper"] = {{"particles", paper.particles},
                           {"clusters", paper.clusters},
                           {"frame_seconds", 1e-3 * paper.frame_ms},
                           {"frame_to_first", paper_growth}};
      document["rows"].push_back(std::move(row.json));
      document["holds"] = document["holds"].get<bool>() && measured.holds();
      document["complete"] = &contender == &contenders.back() && &paper == &paper_samplings().back();
      write_report(options.json, document);
    }
  }
  fmt::print("\n{}", table.text());
  if (!full) fmt::print("at 1/{} of the paper's particles; --full takes them all\n", kScaledDown);
  if (!options.json.empty()) fmt::print("wrote {}\n", options.json);
  return document["holds"].get<bool>() ? 0 : 1;
}

}  // namespace

Suite sampling_suite() {
  return {"sampling", "the cut of a kidney at the four samplings of Table 2", [](CLI::App& command) {
            const auto options = std::make_shared<SamplingOptions>();
            declare(*options, command);
            command.add_option("--clusters", options->cooking, "how they are cooked: boxes or sampled")
                ->capture_default_str()
                ->type_name("C");
            command.add_flag("--full", options->full, "the paper's counts of particles, as always on gpu");
            return [options] { return bench_sampling(*options); };
          }};
}

}  // namespace cutproof::cli
