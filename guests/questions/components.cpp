// Components of a graph of which some vertices are dead, judged by breadth-first search.
#include <fmt/format.h>

#include <algorithm>
#include <map>

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
  std::map<int32_t, int32_t> component_of;  // label -> first of the component that has it
  std::map<int32_t, int32_t> label_of;      // first of a component -> its label
  const auto fail = [&](int32_t a, int32_t b, std::string text) {
    verdict.measured += 1;
    if (!verdict.holds) return;
    verdict.holds = false;
    verdict.witness = {{}, {a, b}, {}, std::move(text)};
  };
  for (int32_t i = 0; i < static_cast<int32_t>(label.size()); ++i) {
    if (tissue.alive[at(i)] == 0) continue;
    ++verdict.checked;
    const int32_t first = search.first[at(i)];
    const auto [same, is_new] = label_of.try_emplace(first, label[at(i)]);
    if (same->second != label[at(i)]) {
      // Somewhere on the way to the first the label changes.
      int32_t here = i;
      while (label[at(search.from[at(here)])] == label[at(here)]) here = search.from[at(here)];
      const int32_t other = search.from[at(here)];
      fail(here, other,
           fmt::format("an edge joins {} and {}, which have the labels {} and {}", here, other, label[at(here)],
                       label[at(other)]));
      continue;
    }
    const auto [known, first_use] = component_of.try_emplace(label[at(i)], first);
    if (known->second != first) {
      fail(i, known->second,
           fmt::format("{} and {} both have the label {}, and no path joins them", known->second, i, label[at(i)]));
    }
  }
  if (verdict.checked == 0) verdict.vacuous = "nothing is alive";
  return {verdict};
}

constexpr AnswerArray kComponentAnswers[] = {
    {.name = "label", .rows_of = "alive", .text = "of each particle; of dead ones anything"}};

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
};

}  // namespace cutproof::guests
