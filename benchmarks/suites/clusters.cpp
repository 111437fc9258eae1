#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "benchmarks/paper.h"
#include "benchmarks/suites/suites.h"
#include "fixtures/build.h"
#include "model/io/verdict_json.h"
#include "oracles/oracles.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

constexpr const char* kScene = "cluster_growth";
constexpr int64_t kFewParticles = 3000;  // for a quick run
// Greatest growth that the paper's "about as many clusters as before" allows at the default τ.
constexpr double kWantedGrowth = 0.03;

double change(const std::vector<int64_t>& clusters, int64_t to) {
  return static_cast<double>(to) / static_cast<double>(clusters.front()) - 1;
}

// Times and then judges every whole frame: topology must be right for any number of clusters. Without a τ nothing is
// merged.
json run_cut(const Contender& contender, std::optional<double> tau, int64_t particles) {
  Scene scene = embedded_scene(kScene);
  if (tau) {
    scene.clusters.small = *tau;
  } else {
    scene.merge.rule = MergeRule::none;
  }
  fixtures::BuildOptions options;
  options.particles = particles;
  fixtures::Built built = fixtures::build(scene, std::string(kScene) + ".json", options);
  const Setup& setup = built.setup;
  Backend& backend = *contender.instance;

  std::vector<int64_t> scene_frame = {0}, clusters = {built.state.clusters.count()};
  std::vector<double> seconds;
  std::size_t removed = 0, judged = 0;
  json failed = json::array();
  backend.load({setup}, {built.state});
  for (int64_t frame = 0; frame < setup.frame_count(); ++frame) {
    backend.run({});
    seconds.push_back(backend.report().total_seconds);
    const State state = std::move(backend.snapshot().front());
    scene_frame.push_back(built.schedule.scene_frame[static_cast<std::size_t>(frame)] + 1);
    clusters.push_back(state.clusters.count());
    removed += state.removed.size() + state.debris.size();
    for (const auto oracle : {oracles::cluster_connectivity, oracles::coverage, oracles::edge_cover,
                              oracles::component_match, oracles::skin_match}) {
      Verdict verdict = oracle(setup, state);
      verdict.backend = backend.name();
      verdict.frame = frame;
      ++judged;
      if (!verdict.holds) failed.push_back(io::verdict_json(verdict, false));
    }
  }
  const double growth = change(clusters, clusters.back());
  return {{"tau", tau ? json(*tau) : json(nullptr)},
          {"particles", setup.body.particle_count()},
          {"backend", contender.described->name},
          {"precision", name_of(contender.described->precision)},
          {"scene_frame", scene_frame},
          {"clusters", clusters},
          {"growth", growth},
          {"greatest_growth", change(clusters, *std::max_element(clusters.begin(), clusters.end()))},
          {"within_wanted", std::abs(growth) <= kWantedGrowth},
          {"removed", removed},
          {"seconds", to_json(times_of(seconds))},
          {"error", {{"verdicts", judged}, {"failed", std::move(failed)}}}};
}

}  // namespace

json run_clusters(const ClustersOptions& options, const Progress& progress) {
  std::vector<std::optional<double>> taus(options.taus.begin(), options.taus.end());
  for (const double tau : options.taus) {
    require_option(tau > 0 && tau <= 1000, "--tau", fmt::format("{} is no valid fraction of the median size", tau),
                   "give numbers above 0, such as 0.25,0.5,0.75");
  }
  taus.emplace_back();
  const bool full = options.full || harness::described_backend(options.backend).takes_full_size;
  const int64_t particles = options.particles.value_or(full ? kPaperParticles : kFewParticles);
  const Contender contender = make_contender(options.backend);
  Report report("clusters", options.backend,
                {{"scene", kScene},
                 {"paper", {{"growth", kPaperGrowth}}},
                 {"wanted_growth", kWantedGrowth},
                 {"rows_at_most", taus.size()},
                 {"holds", true}},
                progress);
  for (const std::optional<double>& tau : taus) {
    json row = run_cut(contender, tau, particles);
    const bool holds = row.at("error").at("failed").empty();
    report.add(std::move(row), holds);
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
