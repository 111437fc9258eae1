// The backends that properties and hard cases run over.
#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "model/backend.h"

namespace cutproof::property_tests {

struct NamedBackend {
  std::string name;
  std::function<std::unique_ptr<Backend>()> make;
  int64_t fraction = 1;  // one in so many of the wanted cases: what a schedule costs buys fewer of them
  int most_size = 100;   // of a case: every access of a simulated schedule is a decision
};
void PrintTo(const NamedBackend& backend, std::ostream* os);

// Every backend that this build has and that has a device: each property runs over each of them, under its name.
std::vector<NamedBackend> all_backends();

// Throws std::invalid_argument (or out_of_range) unless the variable is a number.
int64_t number_from_environment(const char* name, int64_t otherwise);
// CUTPROOF_SEED, 1 without it: what cases and schedules are drawn from.
uint64_t wanted_seed();

}  // namespace cutproof::property_tests
