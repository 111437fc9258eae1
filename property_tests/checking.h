// Shared code of the property tests: their backends, the drawing of cases by rapidcheck, and the report of a failure.
//
// Environment: CUTPROOF_CASES, how many cases of the first property (default 2000; the others take shares of it);
// CUTPROOF_SEED, what they are drawn from (default 1); RC_PARAMS, anything that rapidcheck takes, such as the
// reproduce=… that a failure prints; CUTPROOF_REGRESSIONS, the folder of saved counterexamples.
#pragma once
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/backend.h"
#include "property_tests/cases.h"
#include "property_tests/coverage.h"

namespace cutproof::property_tests {

void showValue(const Case& c, std::ostream& os);

// To be called before any property is checked.
void set_up_rapidcheck();

// Both throw std::invalid_argument (or out_of_range) unless the variable is a number.
int64_t wanted_cases();
uint64_t wanted_seed();

struct NamedBackend {
  std::string name;
  std::function<std::unique_ptr<Backend>()> make;
  int64_t fraction = 1;  // divisor of the number of wanted cases: schedules are expensive
  int most_size = 100;   // of a case: every access of a simulated schedule is a decision
};
void PrintTo(const NamedBackend& backend, std::ostream* os);

// Every available backend of this build, the kernels with both methods of splitting, and with several schedules where
// they can be chosen. Each property runs over each of them, under its name. Backends that only find faults run the
// kernels of another one in another way, and are left out unless their schedule is chosen.
std::vector<NamedBackend> all_backends();

class EveryBackend : public ::testing::TestWithParam<NamedBackend> {
 protected:
  const std::unique_ptr<Backend> backend_ = GetParam().make();
  std::string id() const;
  int64_t cases_of(int64_t fraction) const;
  // Whether all cases ran as planned and every class of cases must have occurred.
  bool ran_in_full() const;
  // Prints how many `things` were in each class; if all ran in full each class that is `wanted` must have occurred.
  template <const auto& names>
  void report(
      const Coverage<names>& seen, const char* things,
      const std::function<bool(std::size_t)>& wanted = [](std::size_t) { return true; }) const {
    const char* separator = " ";
    for (std::size_t k = 0; k < names.size(); ++k) {
      if (!wanted(k)) continue;
      std::cout << std::exchange(separator, ", ") << names[k] << " " << seen.begin()[k];
      if (ran_in_full()) {
        EXPECT_GT(seen.begin()[k], 0) << "no " << things << " with '" << names[k] << "': nothing was tested there";
      }
    }
    std::cout << std::endl;
  }
};

// Shrinking has no bound of its own: after the first failure it may take a minute.
struct Deadline {
  std::optional<std::chrono::steady_clock::time_point> at;
  void start();
  bool is_over() const { return at && std::chrono::steady_clock::now() > *at; }
};

// The case that `draw` makes of a seed and a size. It shrinks by simplifications(), until the deadline.
using Draw = Case (*)(uint64_t seed, int size);
rc::Gen<Case> random_cases(std::shared_ptr<const Deadline> deadline, Draw draw = draw_case);

// The drawn case, as the line of a saved counterexample, and its failure, for a person; empty: the property holds.
struct Example {
  std::string line, problem;
};
// Draws (by the operator * of a Gen, from the calling thread) and judges.
using Attempt = std::function<Example()>;

// Makes `attempts` of them; on a failure prints the simplest example found, and the line that replays it.
void check(const std::string& id, int64_t attempts, int most_size, Deadline& deadline, const Attempt& attempt);

// Empty: the property holds. Otherwise the failure, for a person. An exception is a failure, too.
using Property = std::function<std::string(const Case&)>;

// The same over random cases.
void check(const std::string& id, int64_t cases, int most_size, const Property& property);

}  // namespace cutproof::property_tests
