// `cutproof bench sampling`: Table 2 of the paper, a kidney's discontinuous cut at four samplings.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "cli/bench/paper.h"
#include "cli/bench/report.h"
#include "cli/bench/stages.h"
#include "cli/bench/suites.h"

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

  std::vector<std::string> head = {"median ms", "particles", "clusters", "paper's"};
  for (const Stage stage : kStages) head.emplace_back(name_of(stage));
  for (const char* word : {"frame", "least", "most", "to first", "paper ms", "to first", "error of step", "topology"}) {
    head.emplace_back(word);
  }
  Table table(head);
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
      const int64_t particles = scene.setup.body.particle_count();
      const int64_t clusters = scene.state.clusters.count();

      std::vector<std::string> row = {scene.name, fmt::format("{}", particles), fmt::format("{}", clusters),
                                      full ? fmt::format("{}", paper.clusters) : "-"};
      for (const Stage stage : kStages) row.push_back(ms(measured.timings.stage[static_cast<std::size_t>(stage)]));
      row.push_back(ms(frame));
      row.push_back(fmt::format("{:.4g}", 1e3 * frame.min));
      row.push_back(fmt::format("{:.4g}", 1e3 * frame.max));
      row.push_back(percent(growth));
      row.push_back(fmt::format("{:.2f}", paper.frame_ms));
      row.push_back(percent(paper_growth));
      row.push_back(error_of(Stage::step, measured.errors()).text);
      row.push_back(error_of_frame(measured.errors()).text);
      table.add(row);
      fmt::print("{}, split {}: {} particles, frame {} ms\n", scene.name, contender.split, particles, ms(frame));
      if (measured.judged) print_failures(*measured.judged);
      std::fflush(stdout);

      document["rows"].push_back({{"scene", scene.name},
                                  {"particles", particles},
                                  {"clusters", clusters},
                                  {"memberships", scene.state.clusters.members.size()},
                                  {"spacing", scene.setup.body.grid.spacing},
                                  {"backend", contender.backend},
                                  {"precision", contender.precision},
                                  {"substeps", scene.setup.step.substeps},
                                  {"iterations", scene.setup.step.iterations},
                                  {"rotation", contender.rotation},
                                  {"split", contender.split},
                                  {"seconds", seconds_by_stage(measured.timings)},
                                  {"frame_to_first", growth},
                                  {"error", errors_by_stage(measured.errors())},
                                  {"judged_frames", measured.judged ? measured.judged->frames : 0},
                                  {"paper",
                                   {{"particles", paper.particles},
                                    {"clusters", paper.clusters},
                                    {"frame_seconds", 1e-3 * paper.frame_ms},
                                    {"frame_to_first", paper_growth}}}});
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
