// Rounding errors of single operations of shape matching, by their operands (tolerances.md, What a step rounds).
// Internal to oracles/.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>

#include "model/body.h"
#include "model/state.h"

namespace cutproof::oracles {

// A sum of N terms, one after the other, in units of u times the sum of their sizes: the amplitude of a uniform error.
// Products round twice; partial sums that grow evenly round by √(N / 3) at most, taken as √N / 2.
inline double sum_rounds(double terms) { return 2 + std::sqrt(terms) / 2; }

// The same at most, in whatever order and however the roundings are related: terms of a grid are equal, and then all
// round the same way. No partial sum of j terms exceeds the sum of all sizes, nor j times the greatest.
inline double sum_rounds_at_most(double terms, double total, double greatest) {
  return greatest > 0 ? terms + 0.5 - total / (2 * greatest) : 0;
}

// At most, of a mean of absolute coordinates [m] (tolerances.md, Absolute coordinates). `weights`: what the sum of the
// weights rounds, in units of u; the weighted sum of places rounds as much. Beyond these a place is rounded when it is
// handed over, its product, the quotient, and the mean when it is stored.
inline double absolute_mean_rounding(const State& state, double weights) {
  return (2 * weights + 4) * state.place_rounding;
}

// u of places as such: where they are absolute coordinates that of the state, else that of the doubles in which states
// hold them.
inline double unit_of_places(const State& state) {
  return state.place_rounding > 0 ? unit_roundoff(state) : unit_roundoff(Precision::binary64);
}

// The number that arithmetic of this precision keeps of a place x of particle i [m]: in single precision its
// displacement from rest.
inline Vec3 stored_place(const Body& body, Precision precision, int32_t i, Vec3 x) {
  return precision == Precision::binary32 ? x - body.rest_position(i) : x;
}

// Up to this, in units of u, (σ2 + σ3) / σ1 may be taken for zero: backends have thresholds, 9,000 in double precision
// and 4 to 16 in single, and what rounds moves it.
inline double degenerate_rounds(double u) { return u < 1e-10 ? 1e4 : 64; }

// Bound of a sum of many roundings of one size, in standard deviations: exceeded with probability 3e-14 (Higham and
// Mary 2019; tolerances.md, Linear momentum).
inline constexpr double kDeviations = 8;

// An explicit method is stable only while dt² k / m <= 4, so forces add at most so many times what moved, divided by
// the substep, to a velocity; more than that is not there to be rounded (tolerances.md, Runs).
inline constexpr double kStableForces = 4;

// Greatest noise of another run of the same simulator, as a multiple of the measured noise (tolerances.md, A kick in a
// noisy simulator).
inline constexpr double kNoiseFactor = 64;

// Of many comparisons the one that comes nearest to its bound, or goes farthest beyond. NaN is beyond.
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
