#include <algorithm>

#include "benchmarks/paper.h"
#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;

// At the end of that frame of the scene.
std::string clusters_at(const json& curve, int64_t scene_frame_end) {
  const auto frames = curve.at("scene_frame").get<std::vector<int64_t>>();
  const auto after = std::upper_bound(frames.begin(), frames.end(), scene_frame_end);
  return curve.at("clusters").at(static_cast<std::size_t>(after - frames.begin() - 1)).dump();
}

// A line for each figure, a column for each curve.
void print_curves(const std::vector<json>& curves) {
  Table table;
  const auto add = [&](const std::string& name, const Column::Cell& text_of, const std::string& paper = "") {
    std::vector<std::string> row = {name};
    for (const json& curve : curves) row.push_back(text_of(curve));
    row.push_back(paper);
    table.add(row);
  };
  const std::vector<Column> columns = columns_of(report::kClustersSuite);
  add("clusters after frame", columns.front().cell, "paper");
  for (int64_t frame = 0; frame <= curves.front().at("scene_frame").back().get<int64_t>(); frame += 8) {
    add(fmt::format("{}", frame), [&](const json& curve) { return clusters_at(curve, frame); });
  }
  for (const Column& column : columns) {
    if (&column == &columns.front()) continue;
    const bool is_papers = &column == &columns[1];
    add(column.head, column.cell, is_papers ? fmt::format("{:+.1f}", 100 * benchmarks::kPaperGrowth) : "");
  }
  say_as_it_is("\n" + table.text());
}

void print_row(const json& document) {
  const json& curve = document.at("rows").back();
  say("{}, ", columns_of(report::kClustersSuite).front().cell(curve));
  say_filled("{particles} particles, ", curve);
  say("{} to {} clusters\n", curve.at("clusters").front().dump(), curve.at("clusters").back().dump());
  for (const json& verdict : curve.at("error").at("failed")) {
    insist_text(io::filled("  FAILS in frame {frame}: {property}: {witness/text}\n", verdict));
  }
}

// One table for each contender.
void print_tables(const json& document) {
  std::vector<json> curves;
  for (const json& curve : document.at("rows")) {
    curves.push_back(curve);
    if (!curve.at("tau").is_null()) continue;
    print_curves(curves);
    curves.clear();
  }
  const auto particles = document.at("rows").front().at("particles").get<int64_t>();
  if (particles < benchmarks::kPaperParticles * 98 / 100) {
    say("at {} particles a cluster more or less is much; --full takes {}\n", particles, benchmarks::kPaperParticles);
  }
}

}  // namespace

void add_clusters(CLI::App& bench, Work& work) {
  const auto options = std::make_shared<benchmarks::ClustersOptions>();
  CLI::App* const command = bench.add_subcommand("clusters", "number of clusters during a cut: Fig. 10");
  add_backend_name(*command, options->backend, "backend under test", is_timed);
  add_list(*command, "--tau", options->taus, "multiples of the median size below which a cluster is small", "T");
  add_count(*command, "--particles", options->particles, "particles of the kidney", whole_number(500, 100'000'000));
  command->add_flag("--full", options->full, "37,704 particles, the default on a device");
  add_suite(*command, work, "write curves, times and errors as JSON",
            {.run = [options](const auto& progress) { return run_clusters(*options, progress); },
             .row = print_row,
             .end = print_tables});
}

}  // namespace cutproof::cli
