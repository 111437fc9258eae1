#include "benchmarks/suites/stages.h"

#include <array>

#include "benchmarks/paper.h"
#include "cli/bench/suites.h"
#include "model/at.h"

namespace cutproof::cli {

namespace {

using benchmarks::MachineLimits;
using benchmarks::PaperScene;
using benchmarks::StagesOptions;
using benchmarks::StagesResult;
using benchmarks::StagesScene;
using benchmarks::StepLimit;
using benchmarks::Times;

void print_machine(const StagesResult& result) {
  const MachineLimits& machine = result.machine;
  fmt::print("copy, read + written: {:.4g} GB/s", 1e-9 * machine.copy_bytes_per_second);
  if (machine.graph_node_seconds) {
    fmt::print("; one node of a graph {:.2f} µs (40 empty kernels {:.1f} µs)", 1e6 * *machine.graph_node_seconds,
               1e6 * *machine.chain_seconds);
  }
  fmt::print("\n");
}

void print_timed(const StagesScene::Timed& timed, int64_t of) {
  const Times& times = timed.seconds;
  const auto one = [&](double seconds) { return times.count == 0 ? "-" : fmt::format("{:.4f}", 1e3 * seconds); };
  fmt::print("  {:<14} {:>11} {:>11} {:>11} {:>9} {:>9}  {}\n", timed.what, one(times.median), one(times.min),
             one(times.max), fmt::format("{}/{}", times.count, of),
             timed.paper_ms ? fmt::format("{:.2f}", *timed.paper_ms) : "", timed.error.text);
}

void print_limit(const StepLimit& limit) {
  fmt::print("  limit of step: {:.4g} MB at the copy's bandwidth {:.4f} ms", 1e-6 * limit.traffic.bytes,
             1e3 * limit.bytes_seconds);
  if (limit.launch_seconds) fmt::print(", {} launches {:.4f} ms", limit.traffic.launches, 1e3 * *limit.launch_seconds);
  fmt::print("; step takes {:.2f} × its limit ({:.2f} × bytes / bandwidth)\n", limit.multiple, limit.multiple_of_bytes);
}

void print_row(const StagesResult& so_far) {
  const StagesScene& scene = so_far.scenes.back();
  const benchmarks::SceneRow& row = scene.row;
  fmt::print(
      "\n{}: {} particles, {} clusters ({}), {} memberships, h = {:.4g} mm; the blade goes on by {:.2g} h a frame\n",
      row.scene, row.particles, row.clusters, scene.cooking, row.memberships, 1e3 * row.spacing, scene.advance);
  fmt::print("{}, {} precision, {} substeps × {} iterations, rotation {}, split {}\n", row.backend, row.precision,
             row.substeps, row.iterations, row.rotation, row.split);
  fmt::print("  {:<14} {:>11} {:>11} {:>11} {:>9} {:>9}  {}\n", "", "median ms", "least ms", "most ms", "frames",
             "paper ms", "error");
  for (const StagesScene::Timed& timed : scene.timed()) print_timed(timed, so_far.frames * so_far.repeats);
  print_failures(row.measured);
  if (!row.measured.judged) {
    fmt::print("  errors not measured: beyond {} particles the reference takes minutes\n",
               benchmarks::kMostJudgedParticles);
  }
  if (scene.step_limit) print_limit(*scene.step_limit);
}

// As the paper has it: a row for each stage, a column for each scene, here for each way of cooking, and the paper's
// figures beside them.
void print_table_1(const std::vector<StagesScene>& scenes) {
  std::vector<std::string> head = {"Table 1, median ms"}, cooking = {""}, particles = {"particles"},
                           clusters = {"clusters"}, frame = {"frame"};
  std::array<std::vector<std::string>, 6> stages;
  for (const Stage stage : kStages) stages[at(stage)] = {std::string(name_of(stage))};
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const StagesScene& column = scenes[k];
    const benchmarks::SceneRow& row = column.row;
    head.push_back(row.scene);
    cooking.push_back(row.split == "global" ? column.cooking + ", global" : column.cooking);
    particles.push_back(fmt::format("{}", row.particles));
    clusters.push_back(fmt::format("{}", row.clusters));
    frame.push_back(ms(row.measured.timings.frame));
    for (const Stage stage : kStages) stages[at(stage)].push_back(ms(row.measured.timings.stage[at(stage)]));
    if (k + 1 < scenes.size() && scenes[k + 1].row.scene == row.scene) continue;
    const PaperScene& paper = *benchmarks::find_paper_scene(row.scene);
    if (!paper.paper) continue;
    head.push_back(row.scene);
    cooking.push_back("paper");
    particles.push_back(paper.particles ? fmt::format("{}", *paper.particles) : "?");
    clusters.push_back(paper.clusters ? fmt::format("{}", *paper.clusters) : "?");
    frame.push_back(fmt::format("{:.2f}", paper.paper->frame));
    for (const Stage stage : kStages) stages[at(stage)].push_back(fmt::format("{:.2f}", paper.paper->stage[at(stage)]));
  }
  Table table(head);
  for (const auto& row : {cooking, particles, clusters}) table.add(row);
  for (const auto& row : stages) table.add(row);
  table.add(frame);
  fmt::print("\n{}", table.text());
}

int stages(const Asked<StagesOptions>& asked) {
  require_writable(asked.json);
  const StagesResult result =
      benchmarks::run_stages(asked, reporting<StagesResult>(asked.json, print_machine, print_row));
  if (result.is_table_1 && !result.scenes.empty()) print_table_1(result.scenes);
  return conclude_suite(asked.json, result.scenes.size(), result.holds());
}

}  // namespace

void add_stages(CLI::App& bench, Work& work) {
  const auto asked = std::make_shared<Asked<StagesOptions>>();
  CLI::App* const command = bench.add_subcommand(
      "stages", "whole frames and each stage, a blade cutting: Table 1, or boxes and kidneys of given sizes");
  add_timing(*command, *asked);
  command->add_option("--scenes", asked->scenes, "of Table 1, and the irregular path of Fig. 13, separated by commas")
      ->capture_default_str()
      ->delimiter(',')
      ->type_name("S,S...");
  command->add_option("--clusters", asked->cooking, "how they are cooked, separated by commas")
      ->capture_default_str()
      ->delimiter(',')
      ->type_name("C,C...");
  command->add_flag("--full", asked->full, "the scenes at the paper's size, as always on a device");
  command
      ->add_option("--sizes", asked->sizes, "instead of the scenes: bodies with so many particles, separated by commas")
      ->delimiter(',')
      ->type_name("N,N...");
  add_json(*command, asked->json, "write times and errors");
  command->callback([asked, &work] { work = [asked] { return stages(*asked); }; });
}

}  // namespace cutproof::cli
