// Clusters made of tissue, judged by the oracles of states.
#include <algorithm>
#include <numeric>

#include "guests/questions/kinds.h"
#include "model/at.h"
#include "oracles/oracles.h"

namespace cutproof::guests {

namespace {

Question draw_clusters(uint64_t seed, int64_t index, Precision) {
  Random random(mixed(seed, index));
  const auto kinds = static_cast<int64_t>(graph_kinds().size());
  Tissue tissue = draw_graph(random, index % kinds);
  tissue = part_of(tissue, tissue.alive);  // dead particles are in no cluster, and not in the question
  return {graph_kinds()[at(index % kinds)], arrays_of(tissue), {}};
}

Question draw_large_clusters(uint64_t seed, int64_t kind, int64_t size, Precision) {
  Random random(large_seed(seed, kind));
  Tissue tissue = draw_large_graph(random, kind, static_cast<int32_t>(size));
  tissue.alive.assign(tissue.alive.size(), 1);
  return {large_graph_kinds()[at(kind)], arrays_of(tissue), {}, size};
}

std::vector<Verdict> judge_clusters(const Question& question, const Arrays& answers, Precision) {
  const Tissue tissue = tissue_of(question.given);
  Setup setup;
  setup.body = tissue.body;
  setup.skin.wanted = false;
  State state;
  const auto n = at(tissue.body.particle_count());
  for (std::size_t i = 0; i < n; ++i) state.x.push_back(tissue.body.rest_position(static_cast<int32_t>(i)));
  state.v.resize(n);
  state.alive.assign(n, 1);
  Clusters& clusters = state.clusters;
  const auto offsets = answers[0].of<int64_t>();
  const auto members = answers[1].of<int32_t>();
  // A body without particles has no clusters, with or without an answer.
  if (!offsets.empty()) clusters.offsets.assign(offsets.begin(), offsets.end());
  clusters.members.assign(members.begin(), members.end());
  const auto count = clusters.offsets.size() - 1;
  clusters.number.resize(count);
  std::iota(clusters.number.begin(), clusters.number.end(), 0);
  clusters.rotation.resize(count);
  clusters.degenerate.resize(count);
  clusters.rest_center.resize(count);
  clusters.mass.resize(count, 1);
  state.edge_covered = true;  // judged only if promised
  std::vector<Verdict> verdicts;
  for (const auto& oracle : {oracles::well_formed, oracles::cluster_connectivity, oracles::coverage,
                             oracles::component_match, oracles::isolation, oracles::edge_cover}) {
    verdicts.push_back(oracle(setup, state));
    if (!verdicts.front().holds) break;  // nothing else can be asked
  }
  return verdicts;
}

constexpr AnswerArray kClusterAnswers[] = {
    {.name = "offsets", .type = ElementType::i64, .text = "[m + 1] of cluster c: members[offsets[c]] and following"},
    {.name = "members", .type = ElementType::i32, .text = "particles, ascending within each cluster"}};

// Beside 2¹⁶. The least ones show how the time of an answer grows.
constexpr int64_t kClusterSizes[] = {4'097, 16'385, 65'535, 65'536, 65'537};

}  // namespace

const OperationDescription kClusters = {
    .number = wire::clusters,
    .name = "clusters",
    .text = "overlapping clusters for shape matching",
    .by_itself = "connected covered coupled",
    .answers = kClusterAnswers,
    .cases = "bodies",
    .draw = draw_clusters,
    .cases_of = one_body,
    .size_of = size_of_body,
    .judge = judge_clusters,
    .problem = problem_of_body,
    .simpler = fewer_particles,
    .kinds = graph_kinds,
    .large_kinds = large_graph_kinds,
    .sizes = kClusterSizes,
    .draw_large = draw_large_clusters,
};

}  // namespace cutproof::guests
