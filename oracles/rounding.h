// What single operations of shape matching round, by the numbers that enter them (tolerances.md, The step again, What
// rounds). Internal to oracles/.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "model/body.h"
#include "model/state.h"

namespace cutproof::oracles {

// A sum of N terms, one after the other, in units of u times the sum of their sizes.
inline double sum_rounds(double terms) { return 2 + std::sqrt(terms) / 2; }

// A mean of `terms` places that were summed and stored as absolute coordinates, each rounded by at most
// State::place_rounding [m]: as such a sum, and once more for each place and for the mean itself (tolerances.md,
// Absolute coordinates). Squares of this are the share of a single mean.
inline double absolute_mean_rounding(const State& state, double terms) {
  return (2 + sum_rounds(terms)) * state.place_rounding;
}

// The number that arithmetic of this precision keeps of a place x of particle i [m]: in single precision its
// displacement from rest.
inline Vec3 stored_place(const Body& body, Precision precision, int32_t i, Vec3 x) {
  return precision == Precision::binary32 ? x - body.rest_position(i) : x;
}

// What a rounding error of so many roundings of one size seldom exceeds, in standard deviations: 8, with probability
// 3e-14 (Higham and Mary 2019; tolerances.md, Linear momentum).
inline constexpr double kDeviations = 8;

inline double absolute_place_bound(const State& state, double terms) {
  return kDeviations * absolute_mean_rounding(state, terms);
}

// Of many comparisons the one that comes nearest to its bound, or goes farthest beyond. What is not a number is beyond.
struct Nearest {
  double share = -1, measured = 0, bound = 0;
  int32_t where = -1;

  void see(double of, double within, int32_t index) {
    if (std::isnan(of)) of = std::numeric_limits<double>::infinity();
    double ratio = of == 0 ? 0 : of / within;
    if (std::isnan(ratio) || !std::isfinite(within)) ratio = std::numeric_limits<double>::infinity();
    if (!(ratio > share)) return;
    share = ratio;
    measured = of;
    bound = within;
    where = index;
  }
  bool holds() const { return share <= 1; }
};

}  // namespace cutproof::oracles
