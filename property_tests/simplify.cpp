#include "property_tests/simplify.h"

#include <chrono>

namespace cutproof::property_tests {

namespace {

using Clock = std::chrono::steady_clock;
using harness::BackendChoice;

constexpr int kSchedulesTried = 50;

bool takes_schedule(const BackendChoice& choice) { return harness::described_backend(choice.name).takes_schedule; }

}  // namespace

Simplified as_drawn(const Violation& violation, const BackendChoice& choice) {
  Simplified result;
  Counterexample& found = result.counterexample;
  found.failing = violation.failing;
  found.backend = choice.name;
  found.index = violation.index;
  found.found = describe(violation.verdict);
  result.verdict = violation.verdict;
  return result;
}

Simplified simplify(const Violation& violation, const BackendChoice& choice, double seconds,
                    const StopAsked& stop_asked) {
  Simplified result = as_drawn(violation, choice);
  Counterexample& found = result.counterexample;

  // Another case is another run of the schedule, so several are tried.
  const bool scheduled = takes_schedule(choice);
  BackendChoice failing_choice = choice;
  const auto fails = [&](const Case& c) {
    for (int k = 0; k < (scheduled ? kSchedulesTried : 1); ++k) {
      BackendChoice tried = failing_choice;
      tried.seed += static_cast<uint64_t>(k);
      if (k > 0) tried.schedule = k % 2 == 0 ? "pct" : "random";
      const Judgement judgement = dissect_alone([&] { return harness::make_backend(tried); }, c, true);
      if (!judgement.failure) continue;
      failing_choice = tried;
      result.verdict = *judgement.failure;
      return true;
    }
    return false;
  };
  if (!fails(violation.failing)) return result;
  result.alone = true;
  const Clock::time_point begin = Clock::now();
  const auto is_over = [&] {
    return std::chrono::duration<double>(Clock::now() - begin).count() >= seconds || is_asked(stop_asked);
  };
  found.failing = simplest(violation.failing, fails, is_over);
  if (scheduled) {
    const auto schedule = std::make_shared<gpu::ThreadSchedule>();
    static_cast<void>(
        dissect_alone([&] { return harness::make_recorded_backend(failing_choice, schedule); }, found.failing, true));
    found.schedule = gpu::shrink(*schedule, [&](const gpu::ThreadSchedule& tried) {
      if (is_over()) return false;
      return dissect_alone([&] { return harness::make_replaying_backend(tried); }, found.failing, true)
          .failure.has_value();
    });
  }
  found.found = describe(result.verdict);
  return result;
}

std::unique_ptr<Backend> backend_of(const Counterexample& counterexample, const BackendChoice& choice) {
  if (takes_schedule(choice) && !counterexample.schedule.empty()) {
    return harness::make_replaying_backend(counterexample.schedule);
  }
  return harness::make_backend(choice);
}

}  // namespace cutproof::property_tests
