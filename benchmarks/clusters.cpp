// `cutproof bench clusters`: Fig. 10 of the paper, how the number of clusters changes while a kidney is cut through.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "benchmarks/paper.h"
#include "benchmarks/report.h"
#include "benchmarks/stages.h"
#include "benchmarks/suites.h"
#include "cli/results.h"
#include "fixtures/build.h"
#include "model/error.h"
#include "oracles/oracles.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;

constexpr const char* kScene = "cluster_growth";
constexpr int64_t kPaperParticles = 37'704;  // of the scene: the first row of Table 2
constexpr int64_t kFewParticles = 3000;      // where nobody wants to wait
// How much growth is still "about as many clusters as before" at the default τ.
constexpr double kWantedGrowth = 0.03;

struct ClustersOptions {
  std::string backend = "reference", split, json;
  std::vector<double> taus = {0.25, 0.5, 0.75};
  std::optional<int64_t> particles;
  bool full = false;
};

// One curve: the same cut with one rule of merging.
struct Curve {
  std::string name;
  double tau = 0;  // multiple of the median size at cooking below which a cluster is small; 0: nothing is merged
  int64_t particles = 0, removed = 0;
  std::vector<int64_t> scene_frame, clusters;  // [frames + 1], [0]: before the first one
  std::vector<double> seconds;                 // of whole frames
  int64_t judged = 0;                          // verdicts
  std::vector<Verdict> failed;
  double growth() const { return change(clusters.back()); }
  double greatest_growth() const { return change(*std::max_element(clusters.begin(), clusters.end())); }
  double change(int64_t to) const { return static_cast<double>(to) / static_cast<double>(clusters.front()) - 1; }
};

// Every frame is timed as a whole and then judged: its topology has to be right whatever the number of clusters is.
Curve run_cut(Backend& backend, std::optional<double> tau, int64_t particles) {
  Scene scene = paper_scene(kScene);
  if (tau) {
    scene.clusters.small = *tau;
  } else {
    scene.merge.rule = MergeRule::none;
  }
  fixtures::BuildOptions options;
  options.particles = particles;
  fixtures::Built built = fixtures::build(scene, std::string(kScene) + ".json", options);
  Setup& setup = built.setup;

  Curve curve;
  curve.name = tau ? fmt::format("τ = {:g}", *tau) : "no merging";
  curve.tau = tau.value_or(0);
  curve.particles = setup.body.particle_count();
  curve.scene_frame.push_back(0);
  curve.clusters.push_back(built.state.clusters.count());
  backend.load({setup}, {built.state});
  for (int64_t frame = 0; frame < setup.frame_count(); ++frame) {
    backend.run({});
    curve.seconds.push_back(backend.report().total_seconds);
    const State state = std::move(backend.snapshot().front());
    curve.scene_frame.push_back(built.schedule.scene_frame[static_cast<std::size_t>(frame)] + 1);
    curve.clusters.push_back(state.clusters.count());
    curve.removed += static_cast<int64_t>(state.removed.size() + state.debris.size());
    for (const auto oracle :
         {oracles::cluster_connectivity, oracles::coverage, oracles::edge_cover, oracles::component_match}) {
      Verdict verdict = oracle(setup, state);
      verdict.backend = backend.name();
      verdict.frame = frame;
      ++curve.judged;
      if (!verdict.holds) curve.failed.push_back(std::move(verdict));
    }
  }
  return curve;
}

std::string percent(double growth) { return fmt::format("{:+.1f} %", 100 * growth); }

// The number of clusters at the end of the given frame of the scene.
int64_t clusters_at(const Curve& curve, int64_t scene_frame) {
  const auto after = std::upper_bound(curve.scene_frame.begin(), curve.scene_frame.end(), scene_frame);
  return curve.clusters[static_cast<std::size_t>(after - curve.scene_frame.begin() - 1)];
}

void print_curves(const std::vector<Curve>& curves) {
  std::vector<std::string> head = {"clusters after frame"};
  for (const Curve& curve : curves) head.push_back(curve.name);
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
        fmt::format("{}", frame), [&](const Curve& c) { return fmt::format("{}", clusters_at(c, frame)); }, "");
  }
  add(
      "growth at the end", [](const Curve& c) { return percent(c.growth()); }, percent(kPaperGrowth));
  add(
      "greatest", [](const Curve& c) { return percent(c.greatest_growth()); }, "");
  add(
      "particles removed", [](const Curve& c) { return fmt::format("{}", c.removed); }, "");
  add(
      "frame, median ms", [](const Curve& c) { return ms(times_of(c.seconds)); }, "");
  add(
      "error: verdicts that fail", [](const Curve& c) { return fmt::format("{} of {}", c.failed.size(), c.judged); },
      "");
  fmt::print("\n{}", table.text());
}

void require_taus(const std::vector<double>& taus) {
  for (const double tau : taus) {
    if (tau > 0 && tau <= 1000) continue;
    throw InputError("command line", "--tau", fmt::format("{} is no fraction of the median size", tau),
                     "give numbers above 0, such as 0.25,0.5,0.75");
  }
}

int bench_clusters(const ClustersOptions& options) {
  require_taus(options.taus);
  const int64_t particles =
      options.particles.value_or(options.full || options.backend == "gpu" ? kPaperParticles : kFewParticles);
  const std::vector<Contender> contenders = make_contenders(options.backend, options.split, "");
  require_writable(options.json);

  json document = begin_report("clusters", options.backend);
  document["scene"] = kScene;
  document["paper"] = {{"growth", kPaperGrowth}};
  document["wanted_growth"] = kWantedGrowth;
  document["rows"] = json::array();
  document["holds"] = true;
  for (const Contender& contender : contenders) {
    std::vector<std::optional<double>> wanted(options.taus.begin(), options.taus.end());
    wanted.emplace_back();
    std::vector<Curve> curves;
    for (const std::optional<double>& tau : wanted) {
      curves.push_back(run_cut(*contender.instance, tau, particles));
      const Curve& curve = curves.back();
      fmt::print("{}, split {}: {} particles, {} to {} clusters\n", curve.name, contender.split, curve.particles,
                 curve.clusters.front(), curve.clusters.back());
      json failed = json::array();
      for (const Verdict& verdict : curve.failed) {
        fmt::print("  FAILS in frame {}: {}: {}\n", verdict.frame, verdict.property, verdict.witness.text);
        failed.push_back(to_json(verdict, false));
      }
      std::fflush(stdout);
      document["rows"].push_back({{"tau", tau ? json(*tau) : json(nullptr)},
                                  {"particles", curve.particles},
                                  {"backend", contender.backend},
                                  {"precision", contender.precision},
                                  {"split", contender.split},
                                  {"scene_frame", curve.scene_frame},
                                  {"clusters", curve.clusters},
                                  {"growth", curve.growth()},
                                  {"greatest_growth", curve.greatest_growth()},
                                  {"within_wanted", std::abs(curve.growth()) <= kWantedGrowth},
                                  {"removed", curve.removed},
                                  {"seconds", to_json(times_of(curve.seconds))},
                                  {"error", {{"verdicts", curve.judged}, {"failed", failed}}}});
      document["holds"] = document["holds"].get<bool>() && curve.failed.empty();
      document["complete"] = &contender == &contenders.back() && &tau == &wanted.back();
      write_report(options.json, document);
    }
    print_curves(curves);
  }
  if (particles < kPaperParticles) {
    fmt::print("at {} particles a cluster more or less is much; --full takes {}\n", particles, kPaperParticles);
  }
  if (!options.json.empty()) fmt::print("wrote {}\n", options.json);
  return document["holds"].get<bool>() ? 0 : 1;
}

}  // namespace

Suite clusters_suite() {
  return {"clusters", "how the number of clusters changes during a cut: Fig. 10", [](CLI::App& command) {
            const auto options = std::make_shared<ClustersOptions>();
            command.add_option("--backend", options->backend, "who cuts; `cutproof info` lists them")
                ->capture_default_str()
                ->type_name("B");
            command
                .add_option("--tau", options->taus,
                            "below which multiple of the median size a cluster is small, separated by commas")
                ->capture_default_str()
                ->delimiter(',')
                ->type_name("T,T...");
            command.add_option("--particles", options->particles, "of the kidney")
                ->type_name("N")
                ->check(CLI::Range(500, 100'000'000));
            command.add_flag("--full", options->full, "37,704 particles, as always on gpu");
            command.add_option("--split", options->split, "kernels: how clusters are split, blocks, global or both")
                ->type_name("M");
            command.add_option("--json", options->json, "write curves, times and errors")->type_name("F");
            return [options] { return bench_clusters(*options); };
          }};
}

}  // namespace cutproof::cli
