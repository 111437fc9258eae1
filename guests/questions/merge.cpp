// Merge: small clusters joined with neighbours, judged by the oracles of the stage from the sets alone.
#include <algorithm>
#include <numeric>

#include "guests/questions/dissected.h"
#include "model/at.h"
#include "oracles/oracles.h"

namespace cutproof::guests {

namespace {

using property_tests::ClusterKind;

Tissue wire_of(int32_t n) {
  std::vector<std::array<int32_t, 3>> nodes;
  for (int32_t x = 0; x < n; ++x) nodes.push_back({x, 0, 0});
  return on_grid(nodes, 0x1p-7);
}

// Consecutive particles of a wire.
std::vector<int32_t> piece(int32_t first, int32_t end) {
  std::vector<int32_t> members;
  for (int32_t i = first; i < end; ++i) members.push_back(i);
  return members;
}

// A wire in pieces of these lengths, each of which shares `shared` particles with the next.
Dissected in_pieces(const std::vector<int32_t>& lengths, int32_t shared) {
  Dissected d;
  int32_t first = 0, end = 0;
  for (const int32_t length : lengths) {
    end = first + length;
    d.clusters.push_back(piece(first, end));
    first = end - shared;
  }
  d.tissue = wire_of(end);
  return d;
}

struct MergeKind {
  const char* name;
  Dissected (*draw)(Random& random);
};
constexpr MergeKind kMergeKinds[] = {
    {"no particle", [](Random&) { return Dissected{on_grid({}, 1), {}, {}, 0, 3, 9}; }},
    {"no small cluster",
     [](Random& r) {
       Dissected d;
       d.tissue = draw_box(r, 6);
       d.clusters = slabs(d.tissue, 2, 1);
       d.tau = 1;
       d.cap = 1000;
       return d;
     }},
    {"a chain of small clusters that share nothing",
     [](Random& r) {
       std::vector<int32_t> lengths(at(r.between(2, 60)));
       for (int32_t& length : lengths) length = r.between(1, 3);
       Dissected d = in_pieces(lengths, 0);
       d.tau = r.between(2, 8);
       d.cap = r.between(d.tau, 3 * d.tau);
       return d;
     }},
    {"a chain of small clusters that overlap",
     [](Random& r) {
       std::vector<int32_t> lengths(at(r.between(2, 60)));
       for (int32_t& length : lengths) length = r.between(2, 4);
       Dissected d = in_pieces(lengths, 1);
       d.tau = r.between(3, 8);
       d.cap = r.between(d.tau, 3 * d.tau);
       return d;
     }},
    {"ties: all clusters are equally large",
     [](Random& r) {
       const int32_t length = r.between(1, 3);
       Dissected d = in_pieces(std::vector<int32_t>(at(r.between(2, 40)), length), 0);
       d.tau = length + 1;
       d.cap = length * r.between(2, 5);
       return d;
     }},
    {"together as many as the cap, or one more",
     [](Random& r) {
       const int32_t small = r.between(1, 4), large = r.between(5, 8);
       std::vector<int32_t> lengths;
       for (int32_t k = r.between(1, 12); k > 0; --k) {
         lengths.insert(lengths.end(), {large + r.below(2), small, large + r.below(2)});
       }
       Dissected d = in_pieces(lengths, 0);
       d.tau = small + 1;
       d.cap = small + large;
       return d;
     }},
    {"clusters within others that are above the cap",
     [](Random& r) {
       Dissected d;
       const int32_t n = r.between(6, 30);
       d.tissue = wire_of(n);
       d.clusters = {piece(0, n)};
       for (int32_t k = r.between(1, 8); k > 0; --k) {
         const int32_t first = r.below(n - 3);
         d.clusters.push_back(piece(first, first + r.between(1, 3)));
       }
       d.tau = 4;
       d.cap = 3;  // so that unions stay small until they vanish in the first
       return d;
     }},
    {"equal clusters",
     [](Random& r) {
       Dissected d;
       const int32_t n = r.between(1, 6);
       d.tissue = wire_of(n);
       d.clusters.assign(at(r.between(2, 9)), piece(0, n));
       d.tau = n + 1;
       d.cap = r.between(1, n);
       return d;
     }},
    {"nothing fits",
     [](Random& r) {
       const int32_t length = r.between(2, 4);
       Dissected d = in_pieces(std::vector<int32_t>(at(r.between(2, 20)), length), 1);
       d.tau = length + 3;
       d.cap = 2 * length - 2;
       return d;
     }},
    {"a star of small clusters around one",
     [](Random& r) {
       Dissected d;
       const int32_t n = r.between(3, 60), middle = r.below(n);
       std::vector<std::array<int32_t, 2>> edges;
       for (int32_t i = 0; i < n; ++i) edges.push_back({middle, i});
       d.tissue = bare(n, edges, r);
       for (int32_t i = 0; i < n; ++i) d.clusters.push_back({i});
       d.tau = r.between(2, 4);
       d.cap = r.between(2, 12);
       return d;
     }},
    {"small pieces apart",  // isolated clusters stay small
     [](Random& r) {
       Dissected d;
       std::vector<std::array<int32_t, 3>> nodes;
       for (int32_t k = r.between(1, 20), x = 0; k > 0; --k) {
         for (int32_t length = r.between(1, 4); length > 0; --length) nodes.push_back({x++, 0, 0});
         ++x;
       }
       d.tissue = on_grid(nodes, 0x1p-7);
       d.clusters = balls(d.tissue, 1, r);
       d.tau = 6;
       d.cap = r.between(3, 9);
       return d;
     }},
    {"numbers with gaps, and dead particles",
     [](Random& r) {
       Dissected d;
       d.tissue = draw_box(r, 6);
       for (uint8_t& alive : d.tissue.alive) alive = r.chance(0.4) ? 0 : 1;
       d.clusters = balls(d.tissue, 2, r);
       d.number = numbers_with_gaps(d.clusters.size(), r);
       d.tau = r.between(2, 6);
       d.cap = r.between(4, 20);
       return d;
     }},
    {"any clusters of a graph",
     [](Random& r) {
       Dissected d;
       const int32_t n = r.between(2, 300);
       std::vector<std::array<int32_t, 2>> edges;
       for (int32_t k = 0; k < n; ++k) edges.push_back({r.below(n), r.below(n)});
       d.tissue = bare(n, edges, r);
       d.clusters = balls(d.tissue, 3, r);
       d.tau = r.between(1, 12);
       d.cap = r.between(1, 40);
       return d;
     }},
    {"a dissection: boxes", [](Random& r) { return draw_dissection(r, Stage::merge, ClusterKind::boxes); }},
    {"a dissection: sampled clusters",
     [](Random& r) { return draw_dissection(r, Stage::merge, ClusterKind::sampled); }},
    {"a dissection: foreign clusters",
     [](Random& r) { return draw_dissection(r, Stage::merge, ClusterKind::foreign); }},
};

std::vector<std::string> kinds_of_merge() {
  std::vector<std::string> names;
  for (const MergeKind& kind : kMergeKinds) names.emplace_back(kind.name);
  return names;
}

Question draw_merge(uint64_t seed, int64_t index, Precision) {
  Random random(mixed(seed, index));
  const MergeKind& kind = kMergeKinds[at(index) % std::size(kMergeKinds)];
  const Dissected dissected = kind.draw(random);
  Question question{kind.name, arrays_of(dissected), {}};
  question.given.push_back(make_array("tau", {1}, std::vector<int32_t>{dissected.tau}));
  question.given.push_back(make_array("cap", {1}, std::vector<int32_t>{dissected.cap}));
  return question;
}

std::string problem_of_merge(const Question& question) {
  if (std::string problem = problem_of_dissected(question); !problem.empty()) return problem;
  const BeforeStage before = before_stage(question, false);
  for (const Verdict& verdict :
       {oracles::coverage(before.setup, before.state), oracles::cluster_connectivity(before.setup, before.state)}) {
    if (!verdict.holds) return verdict.witness.text;
  }
  return "";
}

std::vector<Verdict> judge_merge(const Question& question, const Arrays& answers, Precision) {
  // A cluster's number tells the origin of its rotation, so the rotation itself is not judged.
  const BeforeStage before = before_stage(question, false);
  const State after = with_clusters(before.state, answers[0], answers[1], answers[2]);
  std::vector<Verdict> verdicts = {oracles::well_formed(before.setup, after)};
  if (!verdicts.front().holds) return verdicts;  // nothing else can be asked
  verdicts.push_back(oracles::merge_legality(before.setup, before.state, after));
  verdicts.push_back(oracles::cap_kept(before.setup, before.state, after));
  verdicts.push_back(oracles::merge_maximality(before.setup, after));
  verdicts.push_back(oracles::cluster_connectivity(before.setup, after));
  verdicts.push_back(oracles::coverage(before.setup, after));
  return verdicts;
}

constexpr AnswerArray kMergeAnswers[] = {
    {.name = "offsets", .type = ElementType::i64, .text = "where each cluster's members begin"},
    {.name = "members", .type = ElementType::i32, .text = "particles, ascending within each cluster"},
    {.name = "number", .type = ElementType::i32, .text = "numbers of clusters, ascending"}};

}  // namespace

const OperationDescription kMerge = {
    .number = wire::run,
    .name = "merge",
    .text = "small clusters joined with neighbours",
    .by_itself = "connected covered cap_kept maximal",
    .answers = kMergeAnswers,
    .cases = "bodies",
    .draw = draw_merge,
    .cases_of = one_body,
    .size_of = size_of_body,
    .judge = judge_merge,
    .problem = problem_of_merge,
    .simpler = nullptr,
    .kinds = kinds_of_merge,
};

}  // namespace cutproof::guests
