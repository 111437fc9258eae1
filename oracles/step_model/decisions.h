// Where a step does one thing or another and rounding may tip the scales: what was decided, and by how much. Internal
// to oracles/.
#pragma once
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace cutproof::oracles {

enum class DecisionKind : uint8_t {
  side,     // of the blade, on which a particle begins a substep: 0 positive, 1 negative
  way_out,  // of one that came through the plate: 0 its own side, 1 the cutting edge, 2 the back, 3 and 4 the ends
  touched,  // by a contact, in an accelerated iteration: 0 no, 1 yes
  kept,     // the previous rotation, of a cluster whose matrix is no more than rounding: 0 no, 1 yes
  refused   // a place that blade and walls have made in turn, because it is worse than the present one: 0 no, 1 yes
};

// Names one decision of a step, the same in every run of it.
struct DecisionKey {
  int32_t substep = 0, evaluation = 0;  // evaluation 0: the predicted position; k: iteration k
  int32_t particle = 0;                 // of a cluster its first member
  int32_t turn = 0;  // counts decisions of one kind within an evaluation of a particle; of a cluster its index
  DecisionKind kind = DecisionKind::side;
  friend auto operator<=>(const DecisionKey&, const DecisionKey&) = default;
  // All of one kind that a particle has to take in a substep; of ways out those from this turn on, in each evaluation.
  DecisionKey all_alike() const { return {substep, -1, particle, kind == DecisionKind::way_out ? turn : -1, kind}; }
};

// One that was near.
struct NearDecision {
  DecisionKey key;
  int taken = 0, other = 0;
  double lead = 0;         // of what was taken over the other [m]; not above 0 where it was settled against the numbers
  double rounding = 0;     // what comparing the two rounds [m]
  bool is_natural = true;  // as the numbers say
};

// Decisions that are settled from outside: their outcomes by their keys, and by those of all that are alike, which are
// followed where nothing else is said and the scales are all but even (the last that speaks of the turn).
using Settled = std::map<DecisionKey, int>;

// Takes decisions of one run: as the numbers say, unless they are near and settled from outside.
class Decisions {
 public:
  // `near`: what is decided by less is noted [m]. `unit_roundoff`: of the arithmetic that compares.
  Decisions(const Settled& settled, double near, double unit_roundoff)
      : settled_(settled), near_(near), unit_roundoff_(unit_roundoff) {}

  // `turn`: at which they begin to count.
  void begin(int32_t substep, int32_t evaluation, int32_t particle, int32_t turn = 0) {
    key_ = {substep, evaluation, particle, turn, DecisionKind::side};
  }

  // Whether `lead`, of outcome 1 over outcome 0, is above 0 [m].
  bool exceeds(DecisionKind kind, double lead) { return least(kind, std::array<double, 2>{lead, 0}) == 1; }

  // The outcome of least cost, the first of several [m].
  template <std::size_t N>
  int least(DecisionKind kind, const std::array<double, N>& cost) {
    DecisionKey key = key_;
    key.kind = kind;
    if (kind == DecisionKind::side) {
      // Taken once a substep, asked for again and again.
      key.evaluation = 0;
      key.turn = 0;
    } else {
      key.turn = key_.turn++;
    }
    std::size_t taken = 0;
    for (std::size_t k = 1; k < N; ++k) {
      if (cost[k] < cost[taken]) taken = k;
    }
    const auto is_near = [&](std::size_t k) { return k != taken && std::abs(cost[k] - cost[taken]) <= near_; };
    bool any = false;
    for (std::size_t k = 0; k < N; ++k) any = any || is_near(k);
    if (!any) return static_cast<int>(taken);
    const std::size_t natural = taken;
    if (const auto known = settled_.find(key); known != settled_.end()) {
      taken = static_cast<std::size_t>(known->second);
    } else if (const int alike = settled_alike(key); alike >= 0) {
      const auto wanted = static_cast<std::size_t>(alike);
      if (std::abs(cost[wanted] - cost[taken]) <= kEven * near_) taken = wanted;
    }
    for (std::size_t k = 0; k < N; ++k) {
      if (is_near(k))
        noted_.push_back({key, static_cast<int>(taken), static_cast<int>(k), cost[k] - cost[taken],
                          8 * unit_roundoff_ * (std::abs(cost[k]) + std::abs(cost[taken])), taken == natural});
    }
    return static_cast<int>(taken);
  }

  double near() const { return near_; }
  std::vector<NearDecision> take_near() { return std::move(noted_); }

 private:
  static constexpr double kEven = 0.005;  // of what is near

  // -1: nothing is said of decisions like this one.
  int settled_alike(const DecisionKey& key) const {
    const DecisionKey alike = key.all_alike();
    for (auto k = settled_.upper_bound(alike); k != settled_.begin();) {
      --k;
      if (k->first.substep != alike.substep || k->first.evaluation != -1 || k->first.particle != alike.particle) break;
      if (k->first.kind == alike.kind) return k->second;
    }
    return -1;
  }

  const Settled& settled_;
  double near_, unit_roundoff_;
  DecisionKey key_;
  std::vector<NearDecision> noted_;
};

}  // namespace cutproof::oracles
