// The suites of `cutproof bench`. Each has a file here: it declares the options, calls the suite, prints its table.
#pragma once
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "benchmarks/measured_scene.h"
#include "benchmarks/provenance.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/table.h"

namespace cutproof::cli {

void add_stages(CLI::App& bench, Work& work);
void add_sampling(CLI::App& bench, Work& work);
void add_clusters(CLI::App& bench, Work& work);
void add_scale(CLI::App& bench, Work& work);
void add_rotations(CLI::App& bench, Work& work);
void add_machine_limits(CLI::App& bench, Work& work);
void add_solver(CLI::App& bench, Work& work);
void add_baselines(CLI::App& bench, Work& work);
void add_factors(CLI::App& bench, Work& work);

// The options of a suite, and where its document goes.
template <class Options>
struct Asked : Options {
  std::string json;
};

// The options that suites which time whole scenes have in common.
void add_timing(CLI::App& command, benchmarks::TimingOptions& options);

// The line with which every suite's output begins.
void print_head(const benchmarks::Provenance& provenance);

// Shows what a suite finds as it finds it, and writes it down after each row, so that what has been measured is kept if
// a later row fails. `begin` is shown first, `row` whenever there is a new one.
template <class Result, class Begin, class Row>
benchmarks::Progress<Result> reporting(const std::string& json, Begin begin, Row row) {
  return [json, begin, row, begun = false](const Result& so_far) mutable {
    if (begun) {
      row(so_far);
      write_document(json, to_json(so_far));
    } else {
      print_head(so_far.provenance);
      begin(so_far);
      begun = true;
    }
    flush_output();
  };
}
// For suites that show nothing before their first row.
inline constexpr auto kNothing = [](const auto&) {};

// The end of a suite's output, and its exit status. `rows`: how many there are; a suite that measured nothing fails.
int conclude_suite(const std::string& json, std::size_t rows, bool holds);

// A row of a suite that times whole scenes: the parts that such suites have in common.
std::vector<std::string> scene_counts(const benchmarks::SceneRow& row);  // scene, particles, clusters
std::vector<std::string> scene_time_names();
std::vector<std::string> scene_times(const benchmarks::SceneRow& row);
std::vector<std::string> scene_error_names();
std::vector<std::string> scene_errors(const benchmarks::SceneRow& row);
// One line for each row as soon as it is there, and the verdicts that fail.
void print_scene(const benchmarks::SceneRow& row);
void print_failures(const benchmarks::Measured& measured);

}  // namespace cutproof::cli
