// Merging (method.md §6): legal, found from the sets alone; and maximal.
#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "model/rules.h"
#include "oracles/checks.h"
#include "oracles/rotation_change.h"

namespace cutproof::oracles {
namespace {

// Finds from the sets alone which clusters of the input became which cluster of the result. A number of the result is
// the number of one of its inputs, and a cluster is used once, so an input whose number survives belongs to that
// result. The others vanished; each must lie in some result. An input that lies in a result never hurts it: the union
// stays the same, and it touches whatever covers it. So a vanished input matters only to results that need it, either
// to hold a particle that nothing else explains or to link others; and only among those is there a choice.
class MergeDecomposition {
 public:
  MergeDecomposition(const TissueGraph& graph, const Clusters& before, const Clusters& after, int64_t tau)
      : graph_(graph), before_(before), after_(after), tau_(tau) {}

  void judge(Verdict& verdict) {
    match_numbers(verdict);
    find_candidates(verdict);
    if (!verdict.holds) return;  // without these an assignment has no meaning
    assign(verdict);
  }

 private:
  int32_t number_before(int32_t c) const { return before_.number[at(c)]; }

  // kept_: the input whose number a result keeps. result_of_ of such an input is that result.
  void match_numbers(Verdict& verdict) {
    for (int32_t r = 0; r < after_.count(); ++r) {
      const int32_t number = after_.number[at(r)];
      const auto place = std::lower_bound(before_.number.begin(), before_.number.end(), number);
      if (place == before_.number.end() || *place != number) {
        violate(verdict, {{number}}, "cluster {} has a number that no cluster had before", number);
        continue;
      }
      const auto c = static_cast<int32_t>(place - before_.number.begin());
      kept_[at(r)] = c;
      result_of_[at(c)] = r;
      if (!same_bits(after_.rotation[at(r)], before_.rotation[at(c)]) ||
          after_.degenerate[at(r)] != before_.degenerate[at(c)]) {
        violate(verdict, {{number}}, "cluster {} did not keep its rotation: {}", number,
                rotation_change(before_, c, after_, r));
      }
    }
  }

  // For each input the results that contain it: the one with its number must; a vanished one needs at least one.
  void find_candidates(Verdict& verdict) {
    const Memberships memberships = memberships_of(after_, graph_.particle_count());
    std::vector<int64_t> shared(at(after_.count()), 0);
    std::vector<int32_t> met;
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
        const std::vector<int32_t> lost = set_difference(before_.of(c), after_.of(r)).only_first;
        const int32_t first = lost.empty() ? -1 : lost.front();  // none: one is there twice, which coverage rejects
        violate(verdict, {{number_before(c)}, {first}}, "cluster {} lost particle {}", number_before(c), first);
      } else if (r < 0 && candidates_[at(c)].empty()) {
        violate(verdict, {{number_before(c)}, {lonely >= 0 ? lonely : first_of(c)}},
                "cluster {} is lost: no cluster holds all of its particles", number_before(c));
      } else if (r < 0 && before_.size(c) >= tau_) {
        violate(verdict, {{number_before(c), after_.number[at(candidates_[at(c)].front())]}},
                "cluster {} was merged away, but with {} particles it is not small (tau = {})", number_before(c),
                before_.size(c), tau_);
      }
      for (const int32_t k : met) shared[at(k)] = 0;
    }
  }

  int32_t first_of(int32_t c) const { return before_.size(c) > 0 ? before_.of(c).front() : -1; }

  // The result is the input whose number it keeps, to the bit.
  bool is_unchanged(int32_t r) const {
    const auto now = after_.of(r), then = before_.of(kept_[at(r)]);
    return std::equal(now.begin(), now.end(), then.begin(), then.end());
  }

  // Whether `inputs` explain result r: their union is r, and they touch each other. If not, tells the verdict why.
  bool explains(int32_t r, const std::vector<int32_t>& inputs, Verdict* verdict = nullptr) {
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
      if (verdict != nullptr) {
        violate(*verdict, {{number}, {i}},
                "cluster {} holds particle {}, which no cluster that could have been merged into it held", number, i);
      }
      break;
    }
    if (explained && inputs.size() > 1) {
      for (const int32_t i : members) {
        for (const int32_t other : graph_.upper_neighbours(i)) {
          if (holder_[at(other)] >= 0) touching.unite(holder_[at(i)], holder_[at(other)]);
        }
      }
      for (std::size_t k = 1; k < inputs.size() && explained; ++k) {
        if (touching.find(static_cast<int32_t>(k)) == touching.find(0)) continue;
        explained = false;
        const int32_t one = number_before(inputs[0]), other = number_before(inputs[k]);
        if (verdict != nullptr) {
          violate(*verdict, {{one, other}, {first_of(inputs[0]), first_of(inputs[k])}},
                  "cluster {} joins clusters {} and {}, which do not touch each other", number, one, other);
        }
      }
    }
    for (const int32_t c : inputs) {
      for (const int32_t i : before_.of(c)) holder_[at(i)] = -1;
    }
    return explained;
  }

  void assign(Verdict& verdict) {
    Lists possible(results_);  // vanished inputs with a choice, by result
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
    std::vector<int32_t> needy;  // results that their certain inputs do not explain
    for (int32_t r = 0; r < after_.count(); ++r) {
      if (given_[at(r)].size() == 1 && is_unchanged(r)) continue;  // equal to its only input
      if (explains(r, given_[at(r)])) continue;
      std::vector<int32_t> all = given_[at(r)];
      all.insert(all.end(), possible[at(r)].begin(), possible[at(r)].end());
      if (explains(r, all, &verdict)) needy.push_back(r);
    }
    if (!verdict.holds || needy.empty()) return;

    for (int32_t c = 0; c < before_.count(); ++c) {
      if (result_of_[at(c)] >= 0 || candidates_[at(c)].size() == 1) continue;
      for (const int32_t r : candidates_[at(c)]) {
        if (std::binary_search(needy.begin(), needy.end(), r)) takers_[at(c)].push_back(r);
      }
      if (!takers_[at(c)].empty()) open_.push_back(c);
    }
    if (give_from(0)) return;
    if (budget_ < 0 && !is_refuted(needy)) {
      // Each result has an explanation of its own; that all have one at once was not refuted.
      verdict.inconclusive = static_cast<int64_t>(needy.size());
      return;
    }
    std::vector<int32_t> numbers;
    for (const int32_t r : needy) numbers.push_back(after_.number[at(r)]);
    violate(verdict, {numbers}, "these clusters can be explained one by one, but only by using a cluster twice");
  }

  // Whether for some particle, the needy results that lack it cannot all be given an input of their own that contains
  // it (a matching, found by augmenting paths). The absence of such a particle proves nothing.
  bool is_refuted(const std::vector<int32_t>& needy) {
    Lists inputs_of(at(graph_.particle_count()));  // of open_
    for (const int32_t c : open_) {
      for (const int32_t i : before_.of(c)) inputs_of[at(i)].push_back(c);
    }
    for (int32_t i = 0; i < graph_.particle_count(); ++i) {
      if (inputs_of[at(i)].empty()) continue;  // then no needy result lacks it
      std::vector<int32_t> user(inputs_, -1), tried(inputs_, -1);
      const std::function<bool(int32_t)> finds_one = [&](int32_t r) {
        for (const int32_t c : inputs_of[at(i)]) {
          const auto& takers = takers_[at(c)];
          if (tried[at(c)] >= 0 || std::find(takers.begin(), takers.end(), r) == takers.end()) continue;
          tried[at(c)] = r;
          if (user[at(c)] >= 0 && !finds_one(user[at(c)])) continue;
          user[at(c)] = r;
          return true;
        }
        return false;
      };
      for (const int32_t r : needy) {
        const auto members = after_.of(r);
        const auto holds = [&](int32_t c) {
          const auto held = before_.of(c);
          return std::find(held.begin(), held.end(), i) != held.end();
        };
        if (std::find(members.begin(), members.end(), i) == members.end()) continue;
        if (std::any_of(given_[at(r)].begin(), given_[at(r)].end(), holds)) continue;
        tried.assign(inputs_, -1);
        if (!finds_one(r)) return true;
      }
    }
    return false;
  }

  // Gives the inputs open_[k], open_[k + 1], … to needy results so that all are explained, if there is a way. Requires
  // that each of them is, if it gets all of these inputs that it could use. No input hurts a result that contains it,
  // so only those that an input is not given to may lack it then.
  bool give_from(std::size_t k) {
    if (k == open_.size()) return true;
    const int32_t c = open_[k];
    for (const int32_t r : takers_[at(c)]) {
      given_[at(r)].push_back(c);
      const auto can_do_without = [&](int32_t other) { return other == r || can_be_explained(other, k + 1); };
      if (std::all_of(takers_[at(c)].begin(), takers_[at(c)].end(), can_do_without) && give_from(k + 1)) return true;
      given_[at(r)].pop_back();
    }
    return false;
  }

  // By its given inputs, and all of open_ from k on that it could use. Also no when the budget is spent.
  bool can_be_explained(int32_t r, std::size_t k) {
    if (--budget_ < 0) return false;
    std::vector<int32_t> inputs = given_[at(r)];
    for (; k < open_.size(); ++k) {
      const auto& takers = takers_[at(open_[k])];
      if (std::find(takers.begin(), takers.end(), r) != takers.end()) inputs.push_back(open_[k]);
    }
    return explains(r, inputs);
  }

  static constexpr int64_t kSearchBudget = 10'000;  // of questions whether a result can be explained
  const TissueGraph graph_;
  const Clusters& before_;
  const Clusters& after_;
  const int64_t tau_;
  using Lists = std::vector<std::vector<int32_t>>;
  const std::size_t inputs_ = at(before_.count()), results_ = at(after_.count());
  std::vector<int32_t> result_of_ =
      std::vector<int32_t>(inputs_, -1);  // [before] result with the same number, -1: vanished
  std::vector<int32_t> kept_ = std::vector<int32_t>(results_, -1);  // [after] input with the same number
  Lists candidates_ = Lists(inputs_);                               // [before] results that contain it
  Lists given_ = Lists(results_);                                   // [after] inputs
  Lists takers_ = Lists(inputs_);                                   // [before] needy results that could use it
  std::vector<int32_t> open_;  // vanished inputs with a choice that matters to needy results
  std::vector<int32_t> holder_ = std::vector<int32_t>(at(graph_.particle_count()), -1);  // [n] scratch, -1 between uses
  int64_t budget_ = kSearchBudget;
};

}  // namespace

void check_merge_legality(const StageRun& run, Verdict& verdict) {
  const Setup& setup = run.setup;
  const State &before = run.before, &after = run.after;
  const Clusters &a = before.clusters, &b = after.clusters;
  verdict.checked = a.count();
  if (setup.merge.rule != MergeRule::none) {
    MergeDecomposition(TissueGraph(setup.body, before.alive), a, b, before.tau).judge(verdict);
  } else if (a.offsets != b.offsets || a.members != b.members || a.number != b.number) {
    violate(verdict, {}, "clusters changed, but the scene merges none");
  }
}

// Larger than cap only if nothing grew: a result is the cluster whose number it keeps, and others lay inside it.
void check_cap_kept(const StageRun& run, Verdict& verdict) {
  const Clusters &before = run.before.clusters, &after = run.after.clusters;
  verdict.checked = after.count();
  for (int32_t r = 0; r < after.count(); ++r) {
    const int32_t number = after.number[at(r)];
    const auto place = std::lower_bound(before.number.begin(), before.number.end(), number);
    const bool known = place != before.number.end() && *place == number;
    const int64_t size_before = known ? before.size(static_cast<int32_t>(place - before.number.begin())) : -1;
    if (after.size(r) <= run.before.cap || after.size(r) == size_before) continue;
    violate(verdict, {{number}}, "cluster {} was merged to {} particles, more than cap = {}", number, after.size(r),
            run.before.cap);
  }
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
      for (const int32_t other : judged.graph.neighbours(i)) {
        for (const int32_t t : memberships.of(other)) touch(t, i, other);
      }
    }
    for (const int32_t t : touched) {
      const int64_t joined = size + clusters.size(t) - shared[at(t)];
      const bool contained = shared[at(t)] == size;
      if (t == s || (!contained && joined > judged.state.cap)) continue;
      std::vector<int32_t> particles = {contact[at(t)].a};
      if (contact[at(t)].b != contact[at(t)].a) particles.push_back(contact[at(t)].b);
      violate(verdict, {{judged.number(s), judged.number(t)}, particles},
              "cluster {} has {} particles, fewer than tau = {}, and could still merge into "
              "cluster {}: together {} particles, cap = {}{}",
              judged.number(s), size, judged.state.tau, judged.number(t), joined, judged.state.cap,
              contained ? ", contained in it" : "");
      break;
    }
  }
}

}  // namespace cutproof::oracles
