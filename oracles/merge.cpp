// Merging (method.md §6): legal, found from the sets alone; and maximal.
#include <fmt/format.h>

#include <algorithm>

#include "model/rules.h"
#include "oracles/checks.h"

namespace cutproof::oracles {
namespace {

// Finds out from the sets alone which clusters of the input became which cluster of the result. A number of the
// result is the number of one of its inputs, and a cluster is used once, so an input whose number survives belongs to
// that result. The others vanished; each must lie in some result. An input that lies in a result never hurts it: the
// union stays the same, and it touches whatever covers it. So a vanished input matters only to results that need it,
// either to hold a particle that nothing else explains or to link others; and only among those is there a choice.
class MergeDecomposition {
 public:
  MergeDecomposition(const TissueGraph& graph, const Clusters& before, const Clusters& after, const State& limits)
      : graph_(graph),
        before_(before),
        after_(after),
        tau_(limits.tau),
        cap_(limits.cap),
        result_of_(at(before.count()), -1),
        kept_(at(after.count()), -1),
        given_(at(after.count())),
        holder_(at(graph.particle_count()), -1) {}

  void judge(Verdict& verdict) {
    match_numbers(verdict);
    find_candidates(verdict);
    if (!verdict.holds) return;  // without these an assignment has no meaning
    assign(verdict);
    check_sizes(verdict);
  }

 private:
  int32_t number_before(int32_t c) const { return before_.number[at(c)]; }

  // kept_: the input whose number a result keeps. result_of_ of such an input is that result.
  void match_numbers(Verdict& verdict) {
    for (int32_t r = 0; r < after_.count(); ++r) {
      const int32_t number = after_.number[at(r)];
      const auto place = std::lower_bound(before_.number.begin(), before_.number.end(), number);
      if (place == before_.number.end() || *place != number) {
        violate(verdict, fmt::format("cluster {} has a number that no cluster had before", number), {number});
        continue;
      }
      const auto c = static_cast<int32_t>(place - before_.number.begin());
      kept_[at(r)] = c;
      result_of_[at(c)] = r;
      if (!same_bits(after_.rotation[at(r)], before_.rotation[at(c)]) ||
          after_.degenerate[at(r)] != before_.degenerate[at(c)]) {
        violate(verdict, fmt::format("cluster {} did not keep its rotation", number), {number});
      }
    }
  }

  // For each input the results that contain it: the one with its number must; a vanished one needs at least one.
  void find_candidates(Verdict& verdict) {
    const Memberships memberships = memberships_of(after_, graph_.particle_count());
    std::vector<int64_t> shared(at(after_.count()), 0);
    std::vector<int32_t> met;
    candidates_.resize(at(before_.count()));
    for (int32_t c = 0; c < before_.count(); ++c) {
      if (result_of_[at(c)] >= 0 && is_unchanged(result_of_[at(c)]))
        continue;  // and whom else it lies in matters to none
      met.clear();
      int32_t lonely = -1;  // a particle that no result with which c shares the others holds
      for (const int32_t i : before_.of(c)) {
        if (memberships.of(i).empty()) lonely = i;
        for (const int32_t r : memberships.of(i)) {
          if (shared[at(r)]++ == 0) met.push_back(r);
        }
      }
      for (const int32_t r : met) {
        if (shared[at(r)] == before_.size(c)) candidates_[at(c)].push_back(r);
      }
      const int32_t r = result_of_[at(c)];
      if (r >= 0 && shared[at(r)] != before_.size(c)) {
        violate(verdict, fmt::format("cluster {} lost particle {}", number_before(c), first_outside(c, r)),
                {number_before(c)}, {first_outside(c, r)});
      } else if (r < 0 && candidates_[at(c)].empty()) {
        violate(verdict, fmt::format("cluster {} is lost: no cluster holds all of its particles", number_before(c)),
                {number_before(c)}, {lonely >= 0 ? lonely : first_of(c)});
      } else if (r < 0 && before_.size(c) >= tau_) {
        violate(verdict,
                fmt::format("cluster {} was merged away, but with {} particles it is not small (tau = {})",
                            number_before(c), before_.size(c), tau_),
                {number_before(c), after_.number[at(candidates_[at(c)].front())]});
      }
      for (const int32_t k : met) shared[at(k)] = 0;
    }
  }

  int32_t first_of(int32_t c) const { return before_.size(c) > 0 ? before_.of(c).front() : -1; }
  int32_t first_outside(int32_t c, int32_t r) const {
    const auto members = after_.of(r);
    for (const int32_t i : before_.of(c)) {
      if (std::find(members.begin(), members.end(), i) == members.end()) return i;
    }
    return -1;
  }

  // The result is the input whose number it keeps, to the bit.
  bool is_unchanged(int32_t r) const {
    const auto now = after_.of(r), then = before_.of(kept_[at(r)]);
    return std::equal(now.begin(), now.end(), then.begin(), then.end());
  }

  // Whether `inputs` explain result r: their union is r, and they touch each other. If not, says why.
  bool explains(int32_t r, const std::vector<int32_t>& inputs, Witness* why) {
    const auto members = after_.of(r);
    DisjointSets touching(static_cast<int64_t>(inputs.size()));
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      for (const int32_t i : before_.of(inputs[k])) {
        if (holder_[at(i)] < 0) holder_[at(i)] = static_cast<int32_t>(k);
        touching.unite(holder_[at(i)], static_cast<int32_t>(k));
      }
    }
    const int32_t number = after_.number[at(r)];
    bool explained = true;
    for (const int32_t i : members) {
      if (holder_[at(i)] >= 0) continue;
      explained = false;
      if (why != nullptr) {
        *why = {{number},
                {i},
                {},
                fmt::format("cluster {} holds particle {}, which no cluster that could have been merged into it held",
                            number, i)};
      }
      break;
    }
    if (explained && inputs.size() > 1) {
      for (const int32_t i : members) {
        for (int axis = 0; axis < 3 && graph_.alive(i); ++axis) {
          const int32_t other = graph_.neighbour(i, 2 * axis);
          if (other >= 0 && holder_[at(other)] >= 0) touching.unite(holder_[at(i)], holder_[at(other)]);
        }
      }
      for (std::size_t k = 1; k < inputs.size() && explained; ++k) {
        if (touching.find(static_cast<int32_t>(k)) == touching.find(0)) continue;
        explained = false;
        if (why != nullptr) {
          *why = {{number_before(inputs[0]), number_before(inputs[k])},
                  {first_of(inputs[0]), first_of(inputs[k])},
                  {},
                  fmt::format("cluster {} joins clusters {} and {}, which do not touch each other", number,
                              number_before(inputs[0]), number_before(inputs[k]))};
        }
      }
    }
    for (const int32_t c : inputs) {
      for (const int32_t i : before_.of(c)) holder_[at(i)] = -1;
    }
    return explained;
  }

  void assign(Verdict& verdict) {
    std::vector<std::vector<int32_t>> possible(at(after_.count()));  // vanished inputs with a choice, by result
    for (int32_t r = 0; r < after_.count(); ++r) given_[at(r)].push_back(kept_[at(r)]);
    for (int32_t c = 0; c < before_.count(); ++c) {
      if (result_of_[at(c)] >= 0) continue;
      const auto& candidates = candidates_[at(c)];
      if (candidates.size() == 1) {
        given_[at(candidates[0])].push_back(c);
      } else {
        for (const int32_t r : candidates) possible[at(r)].push_back(c);
      }
    }
    std::vector<int32_t> needy;  // results that what is certainly theirs does not explain
    for (int32_t r = 0; r < after_.count(); ++r) {
      if (given_[at(r)].size() == 1 && is_unchanged(r)) continue;  // its only input is what it is
      if (explains(r, given_[at(r)], nullptr)) continue;
      std::vector<int32_t> all = given_[at(r)];
      all.insert(all.end(), possible[at(r)].begin(), possible[at(r)].end());
      Witness why;
      if (!explains(r, all, &why)) {
        violate(verdict, why);
      } else {
        needy.push_back(r);
      }
    }
    if (!verdict.holds || needy.empty()) return;

    std::vector<uint8_t> is_needy(at(after_.count()), 0);
    for (const int32_t r : needy) is_needy[at(r)] = 1;
    takers_.resize(at(before_.count()));
    wanted_.resize(at(after_.count()));
    for (int32_t c = 0; c < before_.count(); ++c) {
      if (result_of_[at(c)] >= 0 || candidates_[at(c)].size() == 1) continue;
      for (const int32_t r : candidates_[at(c)]) {
        if (is_needy[at(r)] == 0) continue;
        takers_[at(c)].push_back(r);
        wanted_[at(r)].push_back(c);
      }
    }
    budget_ = kSearchBudget;
    if (search(needy, needy)) return;
    if (budget_ <= 0) {
      // Each result has an explanation of its own; that all have one at once was not refuted.
      verdict.bound_source += "; simultaneous assignment not decided";
      return;
    }
    std::vector<int32_t> numbers;
    for (const int32_t r : needy) numbers.push_back(after_.number[at(r)]);
    violate(verdict, "these clusters can be explained one by one, but only by using a cluster twice", numbers);
  }

  // Whether result r is explained by what it was given and all that it still wants, but for input `without`. No input
  // hurts a result that contains it, so if this is false, no way to give the rest explains the result.
  bool can_be_explained(int32_t r, int32_t without = -1) {
    --budget_;
    std::vector<int32_t> inputs = given_[at(r)];
    for (const int32_t c : wanted_[at(r)]) {
      if (c != without) inputs.push_back(c);
    }
    return explains(r, inputs, nullptr);
  }

  // Result r gets none of `unwanted`. Who is left alone with one of them is looked at again.
  void renounce(int32_t r, const std::vector<int32_t>& unwanted, std::vector<int32_t>& again) {
    for (const int32_t c : unwanted) {
      std::erase(wanted_[at(r)], c);
      std::erase(takers_[at(c)], r);
      if (takers_[at(c)].size() == 1) again.push_back(takers_[at(c)].front());
    }
  }

  void give(int32_t c, int32_t r, std::vector<int32_t>& again) {
    given_[at(r)].push_back(c);
    for (const int32_t taker : takers_[at(c)]) {
      std::erase(wanted_[at(taker)], c);
      if (taker != r) again.push_back(taker);
    }
    takers_[at(c)].clear();
  }

  // Does, beginning with the results `again`, what every answer must do or may do: a result that is explained wants
  // nothing more; an input that a result cannot do without, or that nobody else wants, goes there. False: there is no
  // answer, or the budget is spent. If no result wants anything then, all are explained.
  bool settle(std::vector<int32_t> again) {
    while (!again.empty()) {
      const int32_t r = again.back();
      again.pop_back();
      if (budget_ <= 0 || !can_be_explained(r)) return false;
      const std::vector<int32_t> wanted = wanted_[at(r)];
      if (explains(r, given_[at(r)], nullptr)) {
        renounce(r, wanted, again);
        continue;
      }
      for (const int32_t c : wanted) {
        if (takers_[at(c)].size() == 1 || !can_be_explained(r, c)) give(c, r, again);
      }
      if (explains(r, given_[at(r)], nullptr)) renounce(r, std::vector<int32_t>(wanted_[at(r)]), again);
    }
    return true;
  }

  // Gives wanted inputs to needy results so that all are explained, if there is a way: settles what it can, then tries
  // both answers to whether a result gets an input that it wants.
  bool search(const std::vector<int32_t>& needy, std::vector<int32_t> again) {
    if (!settle(std::move(again))) return false;
    const auto wants = [&](int32_t r) { return !wanted_[at(r)].empty(); };
    const auto open = std::find_if(needy.begin(), needy.end(), wants);
    if (open == needy.end()) return true;
    const int32_t r = *open, c = wanted_[at(r)].front();
    const auto given = given_, wanted = wanted_, takers = takers_;
    again = {r};
    give(c, r, again);
    if (search(needy, again)) return true;
    given_ = given;
    wanted_ = wanted;
    takers_ = takers;
    again = {r};
    renounce(r, {c}, again);
    return search(needy, again);
  }

  // Larger than cap only if nothing grew: the result is the cluster whose number it keeps, and others lay inside it.
  void check_sizes(Verdict& verdict) {
    for (int32_t r = 0; r < after_.count(); ++r) {
      if (after_.size(r) <= cap_ || after_.size(r) == before_.size(kept_[at(r)])) continue;
      std::vector<int32_t> numbers;
      for (const int32_t c : given_[at(r)]) numbers.push_back(number_before(c));
      violate(verdict,
              fmt::format("cluster {} was merged to {} particles, more than cap = {}", after_.number[at(r)],
                          after_.size(r), cap_),
              numbers);
    }
  }

  static constexpr int64_t kSearchBudget = 10'000;  // of questions whether a result can be explained
  const TissueGraph& graph_;
  const Clusters& before_;
  const Clusters& after_;
  int64_t tau_, cap_;
  std::vector<int32_t> result_of_;                // [before] result with the same number, -1: vanished
  std::vector<int32_t> kept_;                     // [after] input with the same number
  std::vector<std::vector<int32_t>> candidates_;  // [before] results that contain it
  std::vector<std::vector<int32_t>> given_;       // [after] inputs
  std::vector<std::vector<int32_t>> takers_;      // [before] needy results that could use it
  std::vector<std::vector<int32_t>> wanted_;      // [after] and the other way round, ascending
  std::vector<int32_t> holder_;                   // [n] scratch, -1 between uses
  int64_t budget_ = 0;
};

}  // namespace

void check_merge_legality(const StageRun& run, Verdict& verdict) {
  const Setup& setup = run.setup;
  const State &before = run.before, &after = run.after;
  verdict.checked = before.clusters.count();
  const TissueGraph graph(setup.body, before.alive);
  if (setup.merge.rule == MergeRule::none) {
    const Clusters &a = before.clusters, &b = after.clusters;
    if (a.offsets != b.offsets || a.members != b.members || a.number != b.number) {
      violate(verdict, "clusters changed, but the scene merges none");
    }
    return;
  }
  MergeDecomposition(graph, before.clusters, after.clusters, before).judge(verdict);
}

void check_merge_maximality(Judged& judged, Verdict& verdict) {
  if (!promise_of(judged.setup.merge.rule).maximal) {
    verdict.vacuous = "the rule does not promise it";
    return;
  }
  const Clusters& clusters = judged.clusters;
  const Memberships& memberships = judged.memberships();
  std::vector<int32_t> seen_by(at(clusters.count()), -1);  // the last small cluster that touched it
  std::vector<int64_t> shared(at(clusters.count()), 0);    // particles shared with that one
  std::vector<Edge> contact(at(clusters.count()));         // where they touch
  std::vector<int32_t> touched;
  for (int32_t s = 0; s < clusters.count(); ++s) {
    const int64_t size = clusters.size(s);
    if (size >= judged.state.tau || size == 0) continue;
    ++verdict.checked;
    touched.clear();
    const auto touch = [&](int32_t t, int32_t from, int32_t to) {
      if (seen_by[at(t)] == s) return;
      seen_by[at(t)] = s;
      shared[at(t)] = 0;
      contact[at(t)] = {from, to};
      touched.push_back(t);
    };
    for (const int32_t i : clusters.of(s)) {
      for (const int32_t t : memberships.of(i)) {
        touch(t, i, i);
        ++shared[at(t)];
      }
      if (!judged.alive(i)) continue;
      for (int direction = 0; direction < 6; ++direction) {
        const int32_t other = judged.graph.neighbour(i, direction);
        if (other < 0) continue;
        for (const int32_t t : memberships.of(other)) touch(t, i, other);
      }
    }
    for (const int32_t t : touched) {
      const int64_t joined = size + clusters.size(t) - shared[at(t)];
      const bool contained = shared[at(t)] == size;
      if (t == s || (!contained && joined > judged.state.cap)) continue;
      std::vector<int32_t> particles = {contact[at(t)].a};
      if (contact[at(t)].b != contact[at(t)].a) particles.push_back(contact[at(t)].b);
      violate(verdict,
              fmt::format("cluster {} has {} particles, fewer than tau = {}, and could still merge into "
                          "cluster {}: together {} particles, cap = {}{}",
                          judged.number(s), size, judged.state.tau, judged.number(t), joined, judged.state.cap,
                          contained ? ", contained in it" : ""),
              {judged.number(s), judged.number(t)}, particles);
      break;
    }
  }
}

}  // namespace cutproof::oracles
