// Counterexamples: what is read can be written, and reads back the same.
#include "property_tests/counterexample.h"

#include <algorithm>
#include <filesystem>

#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace {

Outcome feed(std::string_view bytes) {
  return outcome_of([&] {
    const auto read = property_tests::counterexample_from_json(std::string(bytes), "fed.json");
    const std::string written = to_json(read);
    std::string again;
    try {
      again = to_json(property_tests::counterexample_from_json(written, "written.json"));
    } catch (const InputError& error) {
      broken_contract("a counterexample that was read is refused when it is written out: " + std::string(error.what()));
    }
    if (again != written) broken_contract("a counterexample changes when it is written out and read again");
  });
}

// The regressions, the smallest first; among them are histories and schedules.
std::vector<std::string> seeds() {
  std::vector<std::string> seeds;
  for (const auto& entry : std::filesystem::directory_iterator(CUTPROOF_SOURCE_DIR "/fixtures/regressions")) {
    if (entry.path().extension() == ".json") seeds.push_back(bytes_of_file(entry.path().string()));
  }
  std::sort(seeds.begin(), seeds.end(),
            [](const auto& a, const auto& b) { return std::pair(a.size(), a) < std::pair(b.size(), b); });
  return seeds;
}

}  // namespace

const Target kCounterexample = {"counterexample", feed, seeds};

}  // namespace cutproof::input_fuzzing
