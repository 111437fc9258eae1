// Split: the rest of each cluster after a cut, judged by the oracles of the stage. Plugins get it as a stage, with
// whole states; files of test vectors as this question.
#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "guests/questions/dissected.h"
#include "model/at.h"
#include "oracles/oracles.h"

namespace cutproof::guests {

namespace {

using property_tests::ClusterKind;

void kill_where(Tissue& tissue, const std::function<bool(const std::array<int32_t, 3>&)>& dies) {
  for (std::size_t i = 0; i < tissue.alive.size(); ++i) {
    if (dies(tissue.body.grid.coordinates(tissue.body.node[i]))) tissue.alive[i] = 0;
  }
}

void kill_any(Tissue& tissue, Random& random, double share) {
  for (uint8_t& alive : tissue.alive) alive = random.chance(share) ? 0 : 1;
}

Dissected in_slabs(Tissue tissue, Random& random) {
  const int32_t width = random.between(1, 4);
  Dissected d;
  d.clusters = slabs(tissue, width, random.between(1, width));
  d.tissue = std::move(tissue);
  return d;
}

// n particles in any order, joined to a tree.
Tissue any_tree(int32_t n, Random& random) {
  std::vector<int32_t> order(at(n));
  std::iota(order.begin(), order.end(), 0);
  for (int32_t k = n - 1; k > 0; --k) std::swap(order[at(k)], order[at(random.below(k + 1))]);
  std::vector<std::array<int32_t, 2>> edges;
  for (int32_t k = 1; k < n; ++k) edges.push_back({order[at(random.below(k))], order[at(k)]});
  return bare(n, edges, random);
}

struct SplitKind {
  const char* name;
  Dissected (*draw)(Random& random);
};
constexpr SplitKind kSplitKinds[] = {
    {"no particle",
     [](Random&) {
       return Dissected{on_grid({}, 1), {}, {}};
     }},
    {"nothing lost", [](Random& r) { return in_slabs(draw_box(r, 6), r); }},
    {"clusters that fall into two pieces",
     [](Random& r) {
       Dissected d = in_slabs(draw_box(r, 6), r);
       const int32_t where = r.between(1, d.tissue.body.grid.nodes[1] - 2);
       kill_where(d.tissue, [&](const auto& node) { return node[1] == where; });
       return d;
     }},
    {"clusters that fall into single particles",
     [](Random& r) {
       Dissected d = in_slabs(draw_box(r, 5), r);
       const int32_t odd = r.below(2);
       kill_where(d.tissue, [&](const auto& node) { return (node[0] + node[1] + node[2]) % 2 == odd; });
       return d;
     }},
    {"one cluster that falls into many pieces",  // their order is that of their smallest particles
     [](Random& r) {
       Dissected d;
       d.tissue = any_tree(r.between(8, 120), r);
       d.clusters = {std::vector<int32_t>(d.tissue.alive.size())};
       std::iota(d.clusters[0].begin(), d.clusters[0].end(), 0);
       kill_any(d.tissue, r, 0.3);
       return d;
     }},
    {"a cluster that vanishes",
     [](Random& r) {
       Dissected d = in_slabs(draw_box(r, 6), r);
       const auto& gone = d.clusters[at(r.below(static_cast<int32_t>(d.clusters.size())))];
       for (const int32_t i : gone) d.tissue.alive[at(i)] = 0;
       return d;
     }},
    {"all clusters vanish",
     [](Random& r) {
       Dissected d = in_slabs(draw_box(r, 5), r);
       kill_where(d.tissue, [](const auto&) { return true; });
       return d;
     }},
    {"clusters of one particle",
     [](Random& r) {
       Dissected d;
       d.tissue = draw_box(r, 4);
       for (int32_t i = 0; i < d.tissue.body.particle_count(); ++i) d.clusters.push_back({i});
       kill_any(d.tissue, r, 0.3);
       return d;
     }},
    {"equal clusters",
     [](Random& r) {
       Dissected d;
       d.tissue = draw_box(r, 5);
       std::vector<int32_t> all(d.tissue.alive.size());
       std::iota(all.begin(), all.end(), 0);
       d.clusters.assign(at(r.between(2, 5)), all);
       kill_any(d.tissue, r, 0.4);
       return d;
     }},
    {"numbers with gaps",
     [](Random& r) {
       Dissected d = in_slabs(draw_box(r, 6), r);
       d.number = numbers_with_gaps(d.clusters.size(), r);
       kill_any(d.tissue, r, 0.3);
       return d;
     }},
    {"debris",
     [](Random& r) {
       Dissected d = in_slabs(draw_box(r, 6), r);
       kill_any(d.tissue, r, 0.6);
       d.debris = r.between(2, 6);
       return d;
     }},
    {"all that is left is debris",
     [](Random& r) {
       Dissected d = in_slabs(draw_box(r, 4), r);
       kill_any(d.tissue, r, 0.4);
       d.debris = d.tissue.body.particle_count() + 1;
       return d;
     }},
    {"any particles are dead",
     [](Random& r) {
       Dissected d = in_slabs(draw_box(r, 8), r);
       kill_any(d.tissue, r, r.unit());
       return d;
     }},
    {"any clusters of a graph",
     [](Random& r) {
       Dissected d;
       d.tissue = any_tree(r.between(2, 300), r);
       d.clusters = balls(d.tissue, 4, r);
       kill_any(d.tissue, r, 0.2);
       return d;
     }},
    {"a dissection: boxes", [](Random& r) { return draw_dissection(r, Stage::split, ClusterKind::boxes); }},
    {"a dissection: sampled clusters",
     [](Random& r) { return draw_dissection(r, Stage::split, ClusterKind::sampled); }},
    {"a dissection: foreign clusters",
     [](Random& r) { return draw_dissection(r, Stage::split, ClusterKind::foreign); }},
};

std::vector<std::string> kinds_of_split() {
  std::vector<std::string> names;
  for (const SplitKind& kind : kSplitKinds) names.emplace_back(kind.name);
  return names;
}

Question draw_split(uint64_t seed, int64_t index, Precision) {
  Random random(mixed(seed, index));
  const SplitKind& kind = kSplitKinds[at(index) % std::size(kSplitKinds)];
  const Dissected dissected = kind.draw(random);
  Question question{kind.name, arrays_of(dissected), {}};
  question.given.push_back(make_array("debris", {1}, std::vector<int32_t>{dissected.debris}));
  return question;
}

std::vector<Verdict> judge_split(const Question& question, const Arrays& answers, Precision) {
  const Array &alive = answers[3], &origin = answers[4];
  const bool rotations_are_told = !origin.name.empty();
  const BeforeStage before = before_stage(question, rotations_are_told);
  State after = with_clusters(before.state, answers[0], answers[1], answers[2]);
  const auto lives = alive.of<uint8_t>();
  after.alive.assign(lives.begin(), lives.end());
  for (int32_t i = 0; i < static_cast<int32_t>(after.alive.size()); ++i) {
    if (before.state.alive[at(i)] != 0 && after.alive[at(i)] == 0) after.debris.push_back(i);
  }
  for (std::size_t c = 0; rotations_are_told && c < after.clusters.rotation.size(); ++c) {
    after.clusters.rotation[c] = rotation_named(origin.integer(static_cast<int64_t>(c)));
  }
  std::vector<Verdict> verdicts = {oracles::well_formed(before.setup, after)};
  if (!verdicts.front().holds) return verdicts;  // nothing else can be asked
  verdicts.push_back(oracles::split_exactness(before.setup, before.state, after));
  verdicts.push_back(oracles::cluster_connectivity(before.setup, after));
  verdicts.push_back(oracles::coverage(before.setup, after));
  return verdicts;
}

constexpr AnswerArray kSplitAnswers[] = {
    {.name = "offsets", .type = ElementType::i64, .text = "where each cluster's members begin"},
    {.name = "members", .type = ElementType::i32, .text = "particles, ascending within each cluster"},
    {.name = "number", .type = ElementType::i32, .text = "numbers of clusters, ascending"},
    {.name = "alive",
     .type = ElementType::u8,
     .rows_of = "alive",
     .text = "1: in the tissue, also after debris is gone"},
    {.name = "origin",
     .type = ElementType::i32,
     .text = "number of the cluster whose rotation each keeps",
     .optional = true}};

}  // namespace

const OperationDescription kSplit = {
    .number = wire::run,
    .name = "split",
    .text = "the connected components of the rest of each cluster",
    .by_itself = "connected covered",
    .answers = kSplitAnswers,
    .cases = "bodies",
    .draw = draw_split,
    .cases_of = one_body,
    .size_of = size_of_body,
    .judge = judge_split,
    .problem = problem_of_dissected,
    .simpler = nullptr,
    .kinds = kinds_of_split,
};

}  // namespace cutproof::guests
