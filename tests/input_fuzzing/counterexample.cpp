// Counterexamples: what is read can be written, and reads back the same.
#include "property_tests/counterexample.h"

#include <algorithm>
#include <filesystem>

#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace of_counterexample {

Outcome feed(std::string_view bytes) {
  return feed_document(bytes, "a counterexample", property_tests::counterexample_from_json);
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

}  // namespace of_counterexample

const Target kCounterexample = {"counterexample", of_counterexample::feed, of_counterexample::seeds};

}  // namespace cutproof::input_fuzzing
