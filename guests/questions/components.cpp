// Components of a graph of which some vertices are dead, judged by breadth-first search.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "guests/questions/kinds.h"
#include "model/at.h"

namespace cutproof::guests {

namespace {

constexpr const char* kSource = "method.md §2, I3: components of the tissue";

Question draw_components(uint64_t seed, int64_t index, Precision) {
  Random random(mixed(seed, index));
  const auto kinds = static_cast<int64_t>(graph_kinds().size());
  return {graph_kinds()[at(index % kinds)], arrays_of(draw_graph(random, index % kinds)), {}};
}

Question draw_large_components(uint64_t seed, int64_t kind, int64_t size, Precision) {
  Random random(large_seed(seed, kind));
  return {
      large_graph_kinds()[at(kind)], arrays_of(draw_large_graph(random, kind, static_cast<int32_t>(size))), {}, size};
}

// The living particles reached from each, by the first of them.
struct Search {
  explicit Search(const Tissue& tissue) : first(tissue.alive.size(), -1), from(tissue.alive.size(), -1) {
    std::vector<int32_t> queue;
    for (int32_t start = 0; start < static_cast<int32_t>(first.size()); ++start) {
      if (tissue.alive[at(start)] == 0 || first[at(start)] >= 0) continue;
      queue = {start};
      first[at(start)] = start;
      for (std::size_t k = 0; k < queue.size(); ++k) {
        for (const int32_t other : tissue.body.neighbours(queue[k])) {
          if (tissue.alive[at(other)] == 0 || first[at(other)] >= 0) continue;
          first[at(other)] = start;
          from[at(other)] = queue[k];
          queue.push_back(other);
        }
      }
    }
  }
  std::vector<int32_t> first, from;
};

std::vector<Verdict> judge_components(const Question& question, const Arrays& answers, Precision) {
  const Tissue tissue = tissue_of(question.given);
  const auto label = answers[0].of<int32_t>();
  const Search search(tissue);
  Verdict verdict;
  verdict.property = "components";
  verdict.bound_source = kSource;
  verdict.unit = "1";
  // By the first particle of each component, whose label is the component's: the first component with this label.
  std::vector<int32_t> firsts;
  for (int32_t i = 0; i < static_cast<int32_t>(label.size()); ++i) {
    if (search.first[at(i)] == i) firsts.push_back(i);
  }
  std::sort(firsts.begin(), firsts.end(),
            [&](int32_t a, int32_t b) { return std::pair(label[at(a)], a) < std::pair(label[at(b)], b); });
  std::vector<int32_t> same_label(label.size(), -1);
  for (std::size_t k = 0; k < firsts.size(); ++k) {
    const bool is_new = k == 0 || label[at(firsts[k])] != label[at(firsts[k - 1])];
    same_label[at(firsts[k])] = is_new ? firsts[k] : same_label[at(firsts[k - 1])];
  }
  for (int32_t i = 0; i < static_cast<int32_t>(label.size()); ++i) {
    if (tissue.alive[at(i)] == 0) continue;
    ++verdict.checked;
    const int32_t first = search.first[at(i)], other = same_label[at(first)];
    const bool parted = label[at(first)] != label[at(i)], joined = !parted && other != first;
    verdict.measured += parted || joined ? 1 : 0;
    if (!verdict.holds) continue;
    if (parted) {
      // Somewhere on the way to the first the label changes.
      int32_t here = i;
      while (label[at(search.from[at(here)])] == label[at(here)]) here = search.from[at(here)];
      const int32_t before = search.from[at(here)];
      verdict.witness = {{},
                         {here, before},
                         {},
                         fmt::format("an edge joins {} and {}, which have the labels {} and {}", here, before,
                                     label[at(here)], label[at(before)])};
    }
    if (joined) {
      verdict.witness = {
          {},
          {i, other},
          {},
          fmt::format("{} and {} both have the label {}, and no path joins them", other, i, label[at(i)])};
    }
    verdict.holds = !parted && !joined;
  }
  if (verdict.checked == 0) verdict.vacuous = "nothing is alive";
  return {verdict};
}

constexpr AnswerArray kComponentAnswers[] = {
    {.name = "label", .rows_of = "alive", .text = "of each particle; of dead ones anything"}};

// Beside 2¹⁶, and beyond 2²⁰. The least ones show how the time of an answer grows.
constexpr int64_t kComponentSizes[] = {4'097, 16'385, 65'535, 65'536, 65'537, 1'048'577};

}  // namespace

const OperationDescription kComponents = {
    .number = wire::components,
    .name = "components",
    .text = "a label for each living particle: equal exactly where edges between living ones join them",
    .by_itself = "",
    .answers = kComponentAnswers,
    .cases = "bodies",
    .draw = draw_components,
    .cases_of = one_body,
    .size_of = size_of_body,
    .judge = judge_components,
    .problem = problem_of_body,
    .simpler = fewer_particles,
    .kinds = graph_kinds,
    .large_kinds = large_graph_kinds,
    .sizes = kComponentSizes,
    .draw_large = draw_large_components,
};

}  // namespace cutproof::guests
