// Merge (method.md §6): small clusters join neighbours, so that cuts do not keep adding smaller, softer clusters.
#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include "reference_cpu/append_cluster.h"
#include "reference_cpu/reference.h"

namespace cutproof::reference {
namespace {

// The growing sets of one merge. A set's slot is its index in the input; a set merged into another leaves a dead slot.
class MergingSets {
 public:
  MergingSets(const Body& body, const std::vector<uint8_t>& alive, std::vector<std::vector<int32_t>> sets,
              const std::vector<int32_t>& numbers, int64_t tau, int64_t cap)
      : body_(body),
        alive_(alive),
        numbers_(numbers),
        tau_(tau),
        cap_(cap),
        sets_(std::move(sets)),
        exists_(sets_.size(), 1),
        first_holder_(static_cast<std::size_t>(body.particle_count()) + 1, 0),
        holder_count_(static_cast<std::size_t>(body.particle_count()), 0),
        visited_(static_cast<std::size_t>(body.particle_count()), 0),
        touches_(sets_.size()) {
    for (const auto& set : sets_) {
      for (const int32_t p : set) ++first_holder_[at(p) + 1];
    }
    std::partial_sum(first_holder_.begin(), first_holder_.end(), first_holder_.begin());
    memberships_.resize(first_holder_.back());
    for (std::size_t slot = 0; slot < sets_.size(); ++slot) {
      for (const int32_t p : sets_[slot]) {
        memberships_[first_holder_[at(p)] + holder_count_[at(p)]++] = static_cast<int32_t>(slot);
      }
      if (size(static_cast<int32_t>(slot)) < tau) small_.push_back(static_cast<int32_t>(slot));
    }
    std::sort(small_.begin(), small_.end(), [&](int32_t a, int32_t b) { return number(a) < number(b); });
  }

  int32_t number(int32_t slot) const { return numbers_[at(slot)]; }
  int64_t size(int32_t slot) const { return static_cast<int64_t>(sets_[at(slot)].size()); }

  // Slots of sets with fewer than tau particles, in the order of numbers.
  const std::vector<int32_t>& small() const { return small_; }

  // The set that `s` would join. It shares a particle with s, or an edge of G joins them. The union has at most cap
  // particles, or the set contains s. The smallest such set, of equals the lowest number.
  std::optional<int32_t> preferred_target(int32_t s) {
    std::vector<int32_t> touching;
    ++visit_;
    const auto touch = [&](int32_t slot, int32_t shares) {
      Touch& touched = touches_[at(slot)];
      if (touched.visit != visit_) {
        touched = {visit_, 0};
        if (slot != s) touching.push_back(slot);
      }
      touched.shared += shares;
    };
    for (const int32_t p : sets_[at(s)]) {
      visited_[at(p)] = visit_;
      for (const int32_t slot : memberships_of(p)) touch(slot, 1);
    }
    for (const int32_t p : sets_[at(s)]) {
      if (!alive_[at(p)]) continue;
      for (const int32_t q : body_.neighbours(p)) {
        if (!alive_[at(q)] || std::exchange(visited_[at(q)], visit_) == visit_) continue;
        for (const int32_t slot : memberships_of(q)) touch(slot, 0);
      }
    }

    std::optional<int32_t> best;
    for (const int32_t t : touching) {
      const int64_t shared = touches_[at(t)].shared;
      const bool legal = shared == size(s) || size(s) + size(t) - shared <= cap_;
      if (legal && (!best || std::pair(size(t), number(t)) < std::pair(size(*best), number(*best)))) best = t;
    }
    return best;
  }

  // `target` takes in `source`, whose slot dies.
  void join(int32_t source, int32_t target) {
    std::vector<int32_t>& from = sets_[at(source)];
    std::vector<int32_t>& to = sets_[at(target)];
    for (const int32_t p : from) {
      const auto memberships = memberships_of(p);
      const auto place = std::find(memberships.begin(), memberships.end(), source);
      if (std::find(memberships.begin(), memberships.end(), target) == memberships.end()) {
        *place = target;
      } else {
        *place = memberships.back();
        --holder_count_[at(p)];
      }
    }
    std::vector<int32_t> both;
    both.reserve(from.size() + to.size());
    std::set_union(from.begin(), from.end(), to.begin(), to.end(), std::back_inserter(both));
    to = std::move(both);
    from.clear();
    exists_[at(source)] = 0;
  }

  // Call after joins: drops merged and grown sets from small().
  void update_small() {
    std::erase_if(small_, [&](int32_t slot) { return !exists_[at(slot)] || size(slot) >= tau_; });
  }

  Merged result() && {
    std::vector<int32_t> slots;
    for (std::size_t slot = 0; slot < sets_.size(); ++slot) {
      if (exists_[slot]) slots.push_back(static_cast<int32_t>(slot));
    }
    std::sort(slots.begin(), slots.end(), [&](int32_t a, int32_t b) { return number(a) < number(b); });
    Merged merged;
    for (const int32_t slot : slots) {
      merged.sets.push_back(std::move(sets_[at(slot)]));
      merged.survivor.push_back(slot);
    }
    return merged;
  }

 private:
  static std::size_t at(int32_t index) { return static_cast<std::size_t>(index); }
  // Slots of the sets that contain a particle, unordered. Joining never increases their number.
  std::span<int32_t> memberships_of(int32_t p) {
    return {memberships_.data() + first_holder_[at(p)], holder_count_[at(p)]};
  }

  const Body& body_;
  const std::vector<uint8_t>& alive_;
  const std::vector<int32_t>& numbers_;
  int64_t tau_, cap_;
  std::vector<std::vector<int32_t>> sets_;  // by slot
  std::vector<uint8_t> exists_;             // by slot
  std::vector<std::size_t> first_holder_;   // [n + 1] begin of each particle's row of memberships_
  std::vector<std::size_t> holder_count_;   // [n] used length of the row
  std::vector<int32_t> memberships_;
  std::vector<int32_t> small_;
  // Scratch of preferred_target.
  struct Touch {
    int32_t visit = 0;   // last call that met the set
    int32_t shared = 0;  // particles shared with the set in question
  };
  int32_t visit_ = 0;             // calls that searched
  std::vector<int32_t> visited_;  // by particle: the last such call that visited it
  std::vector<Touch> touches_;    // by slot
};

struct Proposal {
  int32_t source, target;  // slots
};

// --- deterministic ---------------------------------------------------------------------------------------------

// A bijection of 32-bit words that scatters neighbouring values (method.md §6).
uint32_t mix(uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

using Key = std::tuple<uint32_t, int32_t, int32_t, int32_t>;

Key key_of(int32_t source_number, int32_t target_number, uint32_t round) {
  const auto [low, high] = std::minmax(source_number, target_number);
  const uint32_t word =
      0x9E3779B9u * static_cast<uint32_t>(low) ^ 0x85EBCA6Bu * static_cast<uint32_t>(high) ^ 0xC2B2AE35u * round;
  return {mix(word), low, high, source_number};
}

// The first round has the index 0.
void merge_deterministic(MergingSets& sets, std::size_t slot_count) {
  constexpr Key kNone = {std::numeric_limits<uint32_t>::max(), std::numeric_limits<int32_t>::max(),
                         std::numeric_limits<int32_t>::max(), std::numeric_limits<int32_t>::max()};
  std::vector<Key> least(slot_count, kNone);  // by slot: smallest key of the proposals that name it
  for (uint32_t round = 0;; ++round) {
    std::vector<std::pair<Key, Proposal>> proposals;
    for (const int32_t s : sets.small()) {
      if (const auto t = sets.preferred_target(s)) {
        proposals.push_back({key_of(sets.number(s), sets.number(*t), round), {s, *t}});
      }
    }
    if (proposals.empty()) return;

    const auto ends = [&](const Proposal& p) {
      return std::pair<Key&, Key&>(least[static_cast<std::size_t>(p.source)],
                                   least[static_cast<std::size_t>(p.target)]);
    };
    for (const auto& [key, proposal] : proposals) {
      auto [at_source, at_target] = ends(proposal);
      at_source = std::min(at_source, key);
      at_target = std::min(at_target, key);
    }
    for (const auto& [key, proposal] : proposals) {
      const auto [at_source, at_target] = ends(proposal);
      if (at_source == key && at_target == key) sets.join(proposal.source, proposal.target);
    }
    for (const auto& [key, proposal] : proposals) {
      auto [at_source, at_target] = ends(proposal);
      at_source = at_target = kNone;
    }
    sets.update_small();
  }
}

// --- published -------------------------------------------------------------------------------------------------

// The paper's claims (§2.2.3) with roles locked and passes repeated, clusters in the order of their numbers. In a pass
// each small cluster claims its preferred target once. The claim fails if the claimer has been claimed or the target
// has any role. A pass without a claim ends the merge: no small cluster has a target, because the first to have one
// would have succeeded.
void merge_published(MergingSets& sets, std::size_t slot_count) {
  std::vector<uint8_t> has_role(slot_count, 0);
  for (;;) {
    std::vector<Proposal> claims;
    for (const int32_t s : sets.small()) {
      if (has_role[static_cast<std::size_t>(s)]) continue;
      const auto t = sets.preferred_target(s);
      if (!t || has_role[static_cast<std::size_t>(*t)]) continue;
      has_role[static_cast<std::size_t>(s)] = has_role[static_cast<std::size_t>(*t)] = 1;
      claims.push_back({s, *t});
    }
    if (claims.empty()) return;
    for (const Proposal& claim : claims) {
      sets.join(claim.source, claim.target);
      has_role[static_cast<std::size_t>(claim.source)] = has_role[static_cast<std::size_t>(claim.target)] = 0;
    }
    sets.update_small();
  }
}

}  // namespace

Merged merge_sets(const Body& body, const std::vector<uint8_t>& alive, std::vector<std::vector<int32_t>> sets,
                  const std::vector<int32_t>& numbers, MergeRule rule, int64_t tau, int64_t cap) {
  const std::size_t slot_count = sets.size();
  MergingSets merging(body, alive, std::move(sets), numbers, tau, cap);
  if (rule == MergeRule::deterministic) merge_deterministic(merging, slot_count);
  if (rule == MergeRule::published) merge_published(merging, slot_count);
  return std::move(merging).result();
}

void merge(const Setup& setup, State& state) {
  if (setup.merge.rule == MergeRule::none) return;
  const Clusters& before = state.clusters;
  std::vector<std::vector<int32_t>> sets;
  sets.reserve(static_cast<std::size_t>(before.count()));
  for (int32_t c = 0; c < before.count(); ++c) sets.emplace_back(before.of(c).begin(), before.of(c).end());

  const Merged merged =
      merge_sets(setup.body, state.alive, std::move(sets), before.number, setup.merge.rule, state.tau, state.cap);
  if (static_cast<int32_t>(merged.sets.size()) == before.count()) return;

  Clusters after;
  for (std::size_t k = 0; k < merged.sets.size(); ++k) {
    const int32_t survivor = merged.survivor[k];
    append_cluster(after, merged.sets[k], before.number[static_cast<std::size_t>(survivor)], before, survivor);
  }
  update_rest_frames(setup.body, after);
  state.clusters = std::move(after);
}

}  // namespace cutproof::reference
