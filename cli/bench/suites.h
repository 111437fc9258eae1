// The suites of `cutproof bench`. Each has a file here that declares the options, calls the suite, and prints the
// document for people.
#pragma once
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>

#include "benchmarks/suites/suites.h"
#include "cli/commands.h"
#include "cli/options.h"
#include "cli/progress.h"
#include "cli/screen.h"
#include "cli/table.h"
#include "cli/terminal.h"
#include "model/io/filled.h"
#include "report/suites/columns.h"

namespace cutproof::cli {

void add_stages(CLI::App& bench, Work& work);
void add_sampling(CLI::App& bench, Work& work);
void add_clusters(CLI::App& bench, Work& work);
void add_scale(CLI::App& bench, Work& work);
void add_rotations(CLI::App& bench, Work& work);
void add_machine_limits(CLI::App& bench, Work& work);
void add_solver(CLI::App& bench, Work& work);
void add_baselines(CLI::App& bench, Work& work);
void add_sensitivity(CLI::App& bench, Work& work);
void add_parts(CLI::App& bench, Work& work);
void add_campaigns(CLI::App& bench, Work& work);
void add_material(CLI::App& bench, Work& work);

// The run of a suite, and the output of its document: before the first row, after each row, and at the end.
struct Suite {
  using Show = std::function<void(const nlohmann::json& document)>;
  static void nothing(const nlohmann::json&) {}

  std::function<nlohmann::json(const benchmarks::Progress& progress)> run;
  Show begin = nothing, row = nothing, end = nothing;
  std::string rows = "rows";  // the list of the document that must not be empty
};
// Adds --json, which writes `what`, and sets `work` if the command line names this suite. The document is written after
// each row, so that measurements are kept if a later row fails.
void add_suite(CLI::App& command, Work& work, const std::string& what, Suite suite);

// The options that suites which time whole scenes have in common.
void add_timing(CLI::App& command, benchmarks::TimingOptions& options);

// Of a suite that times whole scenes: a line for each row as soon as it is there, and a table of all.
void print_scene(const nlohmann::json& document);
void print_scenes(const nlohmann::json& document, const report::Suite& suite);
// The verdicts that fail, of a row's error of whole frames.
void print_failures(const nlohmann::json& frame_error);

// Those columns of a suite that a terminal shows.
std::vector<Column> columns_of(const report::Suite& suite);

}  // namespace cutproof::cli
