#include "benchmarks/suites/clusters.h"

#include <span>

#include "benchmarks/paper.h"
#include "cli/bench/suites.h"

namespace cutproof::cli {

namespace {

using benchmarks::ClustersOptions;
using benchmarks::ClustersResult;
using Curve = benchmarks::ClustersRow;

std::string percent(double growth) { return fmt::format("{:+.1f} %", 100 * growth); }

void print_curves(std::span<const Curve> curves) {
  std::vector<std::string> head = {"clusters after frame"};
  for (const Curve& curve : curves) head.push_back(curve.name());
  head.emplace_back("paper");
  Table table(head);
  const auto add = [&](const std::string& name, const auto& text_of, const std::string& paper) {
    std::vector<std::string> row = {name};
    for (const Curve& curve : curves) row.push_back(text_of(curve));
    row.push_back(paper);
    table.add(row);
  };
  for (int64_t frame = 0; frame <= curves.front().scene_frame.back(); frame += 8) {
    add(
        fmt::format("{}", frame), [&](const Curve& c) { return fmt::format("{}", c.clusters_at(frame)); }, "");
  }
  add(
      "growth at the end", [](const Curve& c) { return percent(c.growth()); }, percent(benchmarks::kPaperGrowth));
  add(
      "greatest", [](const Curve& c) { return percent(c.greatest_growth()); }, "");
  add(
      "particles removed", [](const Curve& c) { return fmt::format("{}", c.removed); }, "");
  add(
      "frame, median ms", [](const Curve& c) { return ms(benchmarks::times_of(c.seconds)); }, "");
  add(
      "error: verdicts that fail", [](const Curve& c) { return fmt::format("{} of {}", c.failed.size(), c.judged); },
      "");
  fmt::print("\n{}", table.text());
}

void print_row(const ClustersResult& so_far) {
  const Curve& curve = so_far.rows.back();
  fmt::print("{}, split {}: {} particles, {} to {} clusters\n", curve.name(), curve.split, curve.particles,
             curve.clusters.front(), curve.clusters.back());
  for (const Verdict& verdict : curve.failed) {
    fmt::print("  FAILS in frame {}: {}: {}\n", verdict.frame, verdict.property, verdict.witness.text);
  }
}

int clusters(const Asked<ClustersOptions>& asked) {
  require_writable(asked.json);
  const ClustersResult result =
      benchmarks::run_clusters(asked, reporting<ClustersResult>(asked.json, kNothing, print_row));
  // One table for each contender.
  const std::size_t curves = asked.taus.size() + 1;
  for (std::size_t first = 0; first < result.rows.size(); first += curves) {
    print_curves(std::span(result.rows).subspan(first, curves));
  }
  if (!result.rows.empty() && result.rows.front().particles < benchmarks::kPaperParticles * 98 / 100) {
    fmt::print("at {} particles a cluster more or less is much; --full takes {}\n", result.rows.front().particles,
               benchmarks::kPaperParticles);
  }
  return conclude_suite(asked.json, result.rows.size(), result.holds());
}

}  // namespace

void add_clusters(CLI::App& bench, Work& work) {
  const auto asked = std::make_shared<Asked<ClustersOptions>>();
  CLI::App* const command =
      bench.add_subcommand("clusters", "how the number of clusters changes during a cut: Fig. 10");
  add_backend_name(*command, asked->backend, "backend under test", is_timed);
  command
      ->add_option("--tau", asked->taus,
                   "below which multiple of the median size a cluster is small, separated by commas")
      ->capture_default_str()
      ->delimiter(',')
      ->type_name("T,T...");
  command->add_option("--particles", asked->particles, "of the kidney")
      ->type_name("N")
      ->check(CLI::Range(500, 100'000'000));
  command->add_flag("--full", asked->full, "37,704 particles, as always on a device");
  command->add_option("--split", asked->split, "kernels: how clusters are split, blocks, global or both")
      ->type_name("M");
  add_json(*command, asked->json, "write curves, times and errors");
  command->callback([asked, &work] { work = [asked] { return clusters(*asked); }; });
}

}  // namespace cutproof::cli
