// Edges that the criterion `distance` finds too long, and which of their ends go where one is enough (method.md §4).
// Internal to oracles/.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "oracles/blade_motion.h"
#include "oracles/demand.h"
#include "oracles/judged.h"
#include "oracles/registry.h"

namespace cutproof::oracles {

// Of distances between places in the body and the blade, in units of u (|x| + |edge|): such a place carries 10 u |x| +
// 8 u |edge| (gpu/kernels/detect.cuh), by which a backend may lengthen its reach, 16 u reach + 12 u (|x| + |edge|)
// there; twice that, and rounding. Here for both the reach of geometric cuts and the sides of the blade's plane.
constexpr double kPlacesBand = 32;

// Whether the edge between two neighbours is open, longer than epsilon times its rest length: `remove`: it is, `keep`:
// it is not, however a backend of the state's precision computes it.
Demand openness(const Body& body, const State& state, int32_t i, int32_t j, double epsilon);

// Detection with `detect.remove` = `one` or `nearer`. Each particle's fate follows from whether edges near it are open,
// from which side of the blade's plane their ends are on, and with `nearer` from which end the clusters carry nearer to
// it. Where rounding leaves some of that open, one choice of all of it must explain all particles that hang on it.
// Where that is too much to try, each particle must be explained by some choice of its own; and where even that is, it
// must stay if no choice takes it, and go if every one does, as far as bounds of its count of open edges tell. A
// particle with both answers then counts as inconclusive.
class OneEndOfEach {
 public:
  // `known_rotations`: as StageRun has it. Where that of a cluster is not known which holds an end of an edge, either
  // end may be the nearer one, and the edge counts as inconclusive.
  OneEndOfEach(const Setup& setup, const TissueGraph& graph, const State& before,
               std::span<const RotationKnown> known_rotations = {});
  // `gone`: [n] particles that were alive and are not any more.
  void judge(const std::vector<uint8_t>& gone, Verdict& verdict) const;

 private:
  struct Edge {
    int32_t low, high;
    int32_t bit;  // whether it is open, if rounding decides; -1: it is
    // If the blade's plane is between the ends, of which `low` or (second) `high` is on its negative side: whether the
    // other one goes, which is nearer to it; and its bit, if rounding decides.
    std::array<uint8_t, 2> positive_goes = {0, 0};
    std::array<int32_t, 2> positive_bit = {-1, -1};
  };
  int32_t other_end(const Edge& edge, int32_t i) const { return edge.low == i ? edge.high : edge.low; }
  template <class Value>
  bool is_open(const Edge& edge, const Value& value) const {
    return edge.bit < 0 || value(edge.bit);
  }
  template <class Value>
  bool is_negative(int32_t i, const Value& value) const {
    return side_bit_[at(i)] < 0 ? negative_[at(i)] != 0 : value(side_bit_[at(i)]);
  }
  // Of an edge with the plane between its ends, of which i is on the negative side or on the positive: whether i goes.
  template <class Value>
  bool goes_by_side(const Edge& edge, int32_t i, bool negative, const Value& value) const {
    const std::size_t k = (edge.low == i) == negative ? 0 : 1;
    const bool positive = edge.positive_bit[k] < 0 ? edge.positive_goes[k] != 0 : value(edge.positive_bit[k]);
    return negative != positive;
  }
  template <class Value>
  int open_at(int32_t i, const Value& value) const;
  // The edge that removes the particle, in these values of the bits; null: it stays.
  template <class Value>
  const Edge* edge_that_removes(int32_t i, const Value& value) const;
  // Whether some values of these bits explain the fates of all these particles.
  bool is_explained(const std::vector<int32_t>& particles, const std::vector<int32_t>& bits,
                    const std::vector<uint8_t>& gone) const;
  std::vector<int32_t> bits_of(int32_t i) const;
  // `keep` or `remove` only if that is so in all values of the bits.
  Demand bluntly(int32_t i) const;
  void reject(int32_t i, bool gone, Verdict& verdict) const;
  // Of the edges, which end is nearer to the blade.
  void find_nearer_ends(const BladePose& pose, std::span<const RotationKnown> known_rotations);

  const Setup& setup_;
  const State& before_;
  bool has_lowered_blade_ = false;              // it was lowered in this frame
  std::vector<Edge> edges_;                     // those that may be open
  std::vector<std::vector<int32_t>> edges_at_;  // [n] of them, those at a particle
  std::vector<uint8_t> negative_;               // [n] whether it is on the blade's negative side, if that is decided
  std::vector<int32_t> side_bit_;               // [n] whether it is, if rounding decides; -1: that is decided
  int32_t bits_ = 0;                            // inconclusive decisions
  int64_t unknown_ = 0;                         // edges whose nearer end is not known
};

}  // namespace cutproof::oracles
