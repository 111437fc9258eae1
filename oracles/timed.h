// The time of judging.
#pragma once
#include <chrono>

#include "model/verdict.h"

namespace cutproof::oracles {

// The result of `judge`, with the wall time of the call (Verdict::took).
template <class Judge>
Verdict timed(Judge&& judge) {
  const auto begin = std::chrono::steady_clock::now();
  Verdict verdict = judge();
  verdict.took.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return verdict;
}

}  // namespace cutproof::oracles
