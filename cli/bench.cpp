// `cutproof bench`: times, each beside its error.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>
#include <vector>

#include "cli/bench/suites.h"

namespace cutproof::cli {

void add_bench(CLI::App& program, Work& work) {
  CLI::App* const bench = program.add_subcommand("bench", "times, each beside its error");
  const auto suite = std::make_shared<Work>();
  for (const auto add : {add_stages, add_sampling, add_clusters, add_scale, add_rotations, add_machine_limits,
                         add_solver, add_baselines, add_factors}) {
    add(*bench, *suite);
  }
  std::vector<std::string> names;
  for (const CLI::App* const command : bench->get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(command->get_name());
  }
  // What is no suite's name ends up here, where it is refused.
  const auto unknown = std::make_shared<std::vector<std::string>>();
  bench->add_option("suite", *unknown)->group("");
  bench->callback([suite, unknown, names, &work] {
    work = [suite, unknown, names] {
      const std::string remedy = fmt::format("use one of {}", fmt::join(names, ", "));
      if (!unknown->empty()) refuse("bench", fmt::format("there is no suite '{}'", unknown->front()), remedy);
      if (!*suite) refuse("bench", "no suite is named", remedy);
      return (*suite)();
    };
  });
}

void add_timing(CLI::App& command, benchmarks::TimingOptions& options) {
  add_backend_name(command, options.backend, "backend under test", is_timed);
  command.add_option("--frames", options.frames, "timed frames of each repeat (default: by backend)")
      ->type_name("N")
      ->check(CLI::Range(1, 10'000));
  command.add_option("--repeats", options.repeats, "how often they are timed, each time after a warm-up")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::Range(1, 1'000));
  command.add_option("--split", options.split, "kernels: how clusters are split, blocks, global or both")
      ->type_name("M");
  command.add_option("--rotation", options.rotation, "kernels: how rotations are found")->type_name("M");
}

void print_head(const benchmarks::Provenance& provenance) {
  fmt::print("{} on {}, {}\n", provenance.backend, provenance.device, provenance.date);
}

int conclude_suite(const std::string& json, std::size_t rows, bool holds) {
  if (rows == 0) {
    fmt::print("FAILS: nothing was measured\n");
    return 1;
  }
  if (!json.empty()) fmt::print("\nwrote {}\n", json);
  return holds ? 0 : 1;
}

std::vector<std::string> scene_counts(const benchmarks::SceneRow& row) {
  return {row.scene, fmt::format("{}", row.particles), fmt::format("{}", row.clusters)};
}

std::vector<std::string> scene_time_names() {
  std::vector<std::string> names;
  for (const Stage stage : kStages) names.emplace_back(name_of(stage));
  names.insert(names.end(), {"frame", "least", "most"});
  return names;
}

std::vector<std::string> scene_times(const benchmarks::SceneRow& row) {
  const benchmarks::Timings& timings = row.measured.timings;
  std::vector<std::string> times;
  for (const benchmarks::Times& stage : timings.stage) times.push_back(ms(stage));
  times.push_back(ms(timings.frame));
  times.push_back(fmt::format("{:.4g}", 1e3 * timings.frame.min));
  times.push_back(fmt::format("{:.4g}", 1e3 * timings.frame.max));
  return times;
}

std::vector<std::string> scene_error_names() { return {"error of step", "topology"}; }

std::vector<std::string> scene_errors(const benchmarks::SceneRow& row) {
  return {benchmarks::error_of(Stage::step, row.measured).text, benchmarks::error_of_frame(row.measured).text};
}

void print_scene(const benchmarks::SceneRow& row) {
  fmt::print("{}, split {}: {} particles, frame {} ms\n", row.scene, row.split, row.particles,
             ms(row.measured.timings.frame));
  print_failures(row.measured);
}

void print_failures(const benchmarks::Measured& measured) {
  if (!measured.judged) return;
  for (const Verdict& verdict : measured.judged->topology) {
    if (!verdict.holds) fmt::print("  FAILS: {}: {}\n", verdict.property, verdict.witness.text);
  }
}

}  // namespace cutproof::cli
