#include <algorithm>
#include <array>
#include <map>
#include <string>

#include "benchmarks/paper.h"
#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

using benchmarks::PaperScene;
using nlohmann::json;

void print_machine(const json& document) {
  const json& machine = document.at("machine_limits");
  say_filled("copy, read + written: {1e-9*copy_bytes_per_second:.4g} GB/s", machine);
  if (machine.contains("graph_node_seconds")) {
    say_filled(
        "; one node of a graph {1e6*graph_node_seconds:.2f} µs (40 empty kernels {1e6*chain_of_40_seconds:.1f} µs), a "
        "read that waits for another {1e6*l2_round_trip_seconds:.2f} µs, a barrier of the grid "
        "{1e6*grid_sync_seconds:.2f} µs",
        machine);
  }
  say("\n");
}

// [scenes] the rows of each, which stand one after the other and begin with whole frames.
std::vector<std::vector<json>> rows_by_scene(const json& document) {
  std::vector<std::vector<json>> scenes;
  for (const json& row : document.at("rows")) {
    if (row.at("what") == "frame") scenes.emplace_back();
    scenes.back().push_back(row);
  }
  return scenes;
}

void print_last_scene(const json& document) {
  const json& scene = document.at("scenes").back();
  const std::vector<json> rows = rows_by_scene(document).back();
  say_filled("\n{scene}: {body/particles} particles, {body/clusters} clusters ({cooking}), ", scene);
  say_filled("{body/memberships} memberships, h = {1e3*body/spacing:.4g} mm; ", scene);
  say_filled("the blade goes on by {blade_advance_h:.2g} h a frame\n", scene);
  const json& body = scene.at("body");
  const auto particles = body.at("particles").get<double>(), groups = body.at("groups").get<double>();
  const auto loose = body.at("loose").get<double>();
  say("{:.0f} groups of {:.3g} particles, {:.0f} particles in none", groups,
      groups > 0 ? (particles - loose) / groups : 0, loose);
  if (!scene.at("bytes").is_null()) say("; {:.0f} bytes a particle", scene.at("bytes").get<double>() / particles);
  say("\n");
  say_filled("{backend}, {precision} precision, {substeps} substeps × {iterations} iterations, ", rows.front());
  say_filled("acceleration {acceleration}, remove {remove}\n", rows.front());
  std::vector<Column> columns = columns_of(report::kStagesSuite);
  if (std::all_of(rows.begin(), rows.end(), [](const json& row) { return row.at("limit").is_null(); })) {
    std::erase_if(columns, [](const Column& column) {
      return column.head.find("limit") != std::string::npos || column.head == "MB" || column.head == "phases";
    });
  }
  say_as_it_is(table_of(rows, columns));
  if (scene.contains("topology")) {
    print_failures(rows.front().at("error"));
  } else {
    say("  errors not measured: beyond {} particles the reference takes minutes\n", benchmarks::kMostJudgedParticles);
  }
}

// As the paper has it: a row for each stage, a column for each scene, here for each way of cooking, and the paper's
// figures beside them.
void print_table_1(const json& document) {
  const std::vector<std::vector<json>> scenes = rows_by_scene(document);
  std::vector<std::string> whats(kStageNames.begin(), kStageNames.end());
  whats.emplace_back("frame");
  std::vector<std::vector<std::string>> lines = {{"Table 1, median ms"}, {""}, {"particles"}, {"clusters"}};
  for (const std::string& what : whats) lines.push_back({what});
  const auto add_column = [&](const std::vector<std::string>& cells) {
    for (std::size_t k = 0; k < lines.size(); ++k) lines[k].push_back(cells[k]);
  };
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const json &body = document.at("scenes")[k].at("body"), &any = scenes[k].front();
    std::map<std::string, std::string> ours, papers;
    for (const json& row : scenes[k]) {
      ours[row.at("what")] = io::filled("{1e3*seconds/median:.4g}", row);
      papers[row.at("what")] = io::filled("{1e3*paper_seconds:.2f}", row);
    }
    std::vector<std::string> column = {any.at("scene"), any.at("cooking"), io::filled("{particles}", body),
                                       io::filled("{clusters}", body)};
    for (const std::string& what : whats) column.push_back(ours.at(what));
    add_column(column);
    if (k + 1 < scenes.size() && scenes[k + 1].front().at("scene") == any.at("scene")) continue;
    const PaperScene& paper = *benchmarks::find_paper_scene(any.at("scene"));
    if (!paper.paper) continue;
    column = {paper.name, "paper", paper.particles ? fmt::format("{}", *paper.particles) : "?",
              paper.clusters ? fmt::format("{}", *paper.clusters) : "?"};
    for (const std::string& what : whats) column.push_back(papers.at(what));
    add_column(column);
  }
  Table table;
  for (const std::vector<std::string>& line : lines) table.add(line);
  say_as_it_is("\n" + table.text());
}

}  // namespace

void add_stages(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::StagesOptions>();
  CLI::App* const command =
      bench.add_subcommand("stages", "whole frames and each stage during a cut: Table 1, or bodies of given sizes");
  add_timing(*command, *options);
  add_list(*command, "--scenes", options->scenes, "scenes of Table 1, and the irregular path of Fig. 13", "S");
  add_list(*command, "--clusters", options->cooking, "methods of cooking (default: both; with --sizes, boxes)", "C");
  command->add_flag("--full", options->full, "the paper's sizes of the scenes, the default on a device");
  add_list(*command, "--sizes", options->sizes, "particles of bodies that replace the scenes");
  const auto print_all = [options](const json& document) {
    if (options->sizes.empty()) print_table_1(document);
  };
  add_suite(*command, work, "write times and errors as JSON",
            {.run = [options](const auto& progress) { return run_stages(*options, progress); },
             .begin = print_machine,
             .row = print_last_scene,
             .end = print_all,
             .rows = "scenes"});
}

}  // namespace cutproof::cli
