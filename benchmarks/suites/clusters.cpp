#include "benchmarks/suites/clusters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "benchmarks/contenders.h"
#include "benchmarks/paper.h"
#include "fixtures/build.h"
#include "model/error.h"
#include "model/io/verdict_json.h"
#include "oracles/oracles.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

constexpr const char* kScene = "cluster_growth";
constexpr int64_t kFewParticles = 3000;  // where nobody wants to wait
// How much growth is still "about as many clusters as before" at the default τ.
constexpr double kWantedGrowth = 0.03;

// Every frame is timed as a whole and then judged: its topology has to be right whatever the number of clusters is.
ClustersRow run_cut(const Contender& contender, std::optional<double> tau, int64_t particles) {
  Scene scene = paper_scene(kScene);
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

  ClustersRow curve;
  curve.tau = tau;
  curve.backend = contender.backend;
  curve.precision = contender.precision;
  curve.split = contender.split;
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

void require_taus(const std::vector<double>& taus) {
  for (const double tau : taus) {
    if (tau > 0 && tau <= 1000) continue;
    throw InputError("command line", "--tau", fmt::format("{} is no fraction of the median size", tau),
                     "give numbers above 0, such as 0.25,0.5,0.75");
  }
}

double change(const std::vector<int64_t>& clusters, int64_t to) {
  return static_cast<double>(to) / static_cast<double>(clusters.front()) - 1;
}

}  // namespace

std::string ClustersRow::name() const { return tau ? fmt::format("τ = {:g}", *tau) : "no merging"; }
double ClustersRow::growth() const { return change(clusters, clusters.back()); }
double ClustersRow::greatest_growth() const {
  return change(clusters, *std::max_element(clusters.begin(), clusters.end()));
}
int64_t ClustersRow::clusters_at(int64_t scene_frame_end) const {
  const auto after = std::upper_bound(scene_frame.begin(), scene_frame.end(), scene_frame_end);
  return clusters[static_cast<std::size_t>(after - scene_frame.begin() - 1)];
}

bool ClustersResult::holds() const {
  return std::all_of(rows.begin(), rows.end(), [](const ClustersRow& row) { return row.failed.empty(); });
}

json to_json(const ClustersResult& result) {
  json document = begin_document(result.provenance, result.complete);
  document["scene"] = kScene;
  document["paper"] = {{"growth", kPaperGrowth}};
  document["wanted_growth"] = kWantedGrowth;
  document["holds"] = result.holds();
  document["rows"] = json::array();
  for (const ClustersRow& row : result.rows) {
    json failed = json::array();
    for (const Verdict& verdict : row.failed) failed.push_back(io::verdict_json(verdict, false));
    document["rows"].push_back({{"tau", row.tau ? json(*row.tau) : json(nullptr)},
                                {"particles", row.particles},
                                {"backend", row.backend},
                                {"precision", row.precision},
                                {"split", row.split},
                                {"scene_frame", row.scene_frame},
                                {"clusters", row.clusters},
                                {"growth", row.growth()},
                                {"greatest_growth", row.greatest_growth()},
                                {"within_wanted", std::abs(row.growth()) <= kWantedGrowth},
                                {"removed", row.removed},
                                {"seconds", to_json(times_of(row.seconds))},
                                {"error", {{"verdicts", row.judged}, {"failed", failed}}}});
  }
  return document;
}

ClustersResult run_clusters(const ClustersOptions& options, const Progress<ClustersResult>& progress) {
  require_taus(options.taus);
  const bool full = options.full || harness::described_backend(options.backend).takes_full_size;
  const int64_t particles = options.particles.value_or(full ? kPaperParticles : kFewParticles);
  const std::vector<Contender> contenders = make_contenders(options.backend, options.split, "");
  ClustersResult result;
  result.provenance = provenance_of("clusters", options.backend);
  progress(result);
  std::vector<std::optional<double>> wanted(options.taus.begin(), options.taus.end());
  wanted.emplace_back();
  for (const Contender& contender : contenders) {
    for (const std::optional<double>& tau : wanted) {
      result.rows.push_back(run_cut(contender, tau, particles));
      result.complete = &contender == &contenders.back() && &tau == &wanted.back();
      progress(result);
    }
  }
  return result;
}

}  // namespace cutproof::benchmarks
