// The numbers that an iteration has in every substep of a body: the weights of the Chebyshev semi-iteration, and the
// lost part of the predicted shape (docs/design/method.md §11, §13).
#pragma once
#include "gpu/state/device_view.h"

namespace cutproof::gpu::step_detail {

// Whether a body takes part in an iteration. A body with fewer substeps or iterations than others waits.
CUTPROOF_DEVICE inline bool takes_part(const Pace& pace, int substep, int iteration) {
  const int iterations = substep + 1 < pace.substeps ? pace.iterations : pace.last_iterations;
  return substep < pace.substeps && iteration < iterations;
}

// Chebyshev semi-iteration (docs/design/method.md §11) of order 1 and more: x + pull (g - x) + carry (x - earlier),
// where the plain iteration goes from x to g. The recurrence of the weights in closed form, for j >= 2:
// omega_j = (1 + q) (1 + q^(j-1)) / (1 + q^j), with q = ((1 - r) / (1 + r))² and r² = 1 - b.
struct Combination {
  float pull, carry;
  template <class Number>
  CUTPROOF_DEVICE Number operator()(Number plain, Number now, Number earlier) const {
    return now + (pull * (plain - now) + carry * (now - earlier));
  }
};

// 1 - b at least. The weights are made for eigenvalues in [0, b], with b = min(s, 0.95).
inline constexpr float kLeastGap = 0.05f;
CUTPROOF_DEVICE inline Combination chebyshev(float kdt2, int order) {
  const float gap = 1.0f / (1.0f + kdt2);
  const float r2 = gap > kLeastGap ? gap : kLeastGap;
  const float r = sqrtf(r2);
  const float root = (1.0f - r) / (1.0f + r);
  const float q = root * root;
  float omega = 1;
  if (order > 1) {
    float power = 1, square = q;  // power: q^(order - 1)
    for (int n = order - 1; n > 0; n /= 2) {
      if (n % 2 != 0) power *= square;
      square *= square;
    }
    omega = (1.0f + q) * (1.0f + power) / (1.0f + q * power);
  }
  return {omega * (2.0f / (1.0f + r2)), omega - 1.0f};
}

// An iteration of a body.
struct Iteration {
  float s;
  float own;  // of where a particle is, the part that a plain iteration keeps: s β, and 1 - s unless implicit
  bool implicit;
  bool combined;  // the first iteration is plain
  bool keeps;     // stores data of the next iteration, unless this is the last
  Combination combination;
  float lost_before, lost_after;
};
CUTPROOF_DEVICE inline Iteration iteration_of(const Pace& pace, int iteration, const IterationNumbers& numbers) {
  Iteration now = {};
  now.s = pace.s;
  now.implicit = pace.solver == Solver::implicit;
  now.own = pace.s * pace.volume_share + (now.implicit ? 0.0f : 1.0f - pace.s);
  const bool accelerated = pace.acceleration == Acceleration::chebyshev;
  now.combined = accelerated && iteration > 0;
  now.keeps = accelerated && iteration + 1 < pace.iterations;
  now.combination = {numbers.pull, numbers.carry};
  now.lost_before = numbers.lost_before;
  now.lost_after = numbers.lost_after;
  return now;
}
// Of the iteration after the one with the numbers `before`. Computed once a frame: a root and powers take long.
CUTPROOF_DEVICE inline IterationNumbers iteration_numbers(const Pace& pace, float kdt2, int iteration,
                                                          const IterationNumbers& before) {
  IterationNumbers numbers = {0, 0, before.lost_after, 0};
  if (pace.acceleration == Acceleration::chebyshev && iteration > 0) {
    const Combination combination = chebyshev(kdt2, iteration);
    numbers.pull = combination.pull;
    numbers.carry = combination.carry;
  }
  // A plain iteration takes the kept part 1 - l to 1 - s + s β (1 - l) if implicit, else to (1 - s + s β)(1 - l).
  const Iteration now = iteration_of(pace, iteration, numbers);
  const float lost = numbers.lost_before, s = pace.s * (1.0f - pace.volume_share);
  const float plain = s + now.own * lost;
  numbers.lost_after = now.combined ? now.combination(plain, lost, before.lost_before) : plain;
  return numbers;
}
CUTPROOF_DEVICE inline IterationNumbers* numbers_of(const DeviceView& w, int body, int iteration) {
  return &w.iterations[int64_t{body} * (w.most_iterations + 1) + iteration];
}
CUTPROOF_DEVICE inline Iteration iteration_of(const DeviceView& w, int body, const Pace& pace, int iteration) {
  return iteration_of(pace, iteration, constant(numbers_of(w, body, iteration)));
}
// l at the end of a substep of so many iterations.
CUTPROOF_DEVICE inline float lost_in_all(const DeviceView& w, int body, int iterations) {
  return constant(numbers_of(w, body, iterations)).lost_before;
}

// Sets alpha and beta of the end of a substep of so many iterations. While a grip holds a group, its particles stay
// where the grip has put them. An iteration then changes only their push: alpha (x - d~) + beta e - M(r). M is a map,
// like that of a carried group.
//
// The recurrences follow from what an iteration does with one particle (advance_particle). Its goal less its base is
// G(r) + β (x - d~ + e), with G of mean_goal(). Its pull is that less e (implicit), or less e + x - d~ (published).
CUTPROOF_DEVICE inline void set_held_push(Pace& pace, float kdt2, int iterations) {
  float alpha = 1.0f, beta = 0.0f, earlier_alpha = 1.0f, earlier_beta = 0.0f;
  IterationNumbers numbers = {};
  for (int j = 0; j < iterations; ++j) {
    numbers = iteration_numbers(pace, kdt2, j, numbers);
    const Iteration now = iteration_of(pace, j, numbers);
    const float push_factor = now.implicit ? now.s : 1.0f, weight = now.combined ? now.combination.pull : 1.0f;
    const auto next = [&](float is, float was, float added) {
      const float kept_push = now.combined ? now.combination(push_factor * is, is, was) : push_factor * is;
      return kept_push + weight * added;
    };
    const float next_alpha = next(alpha, earlier_alpha, 1.0f - now.own);
    const float next_beta = next(beta, earlier_beta, pace.s * (1.0f - pace.volume_share));
    earlier_alpha = alpha;
    earlier_beta = beta;
    alpha = next_alpha;
    beta = next_beta;
  }
  pace.held_alpha = alpha;
  pace.held_beta = beta;
}

}  // namespace cutproof::gpu::step_detail
