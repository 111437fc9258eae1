// Questions to kernels: what is read can be written, and reads back the same.
#include "guests/campaign.h"
#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace {

Outcome feed(std::string_view bytes) {
  return outcome_of([&] {
    const guests::SavedQuestion read = guests::question_from_json(std::string(bytes), "fed.json");
    const std::string written = to_json(read);
    std::string again;
    try {
      again = to_json(guests::question_from_json(written, "written.json"));
    } catch (const InputError& error) {
      broken_contract("a question that was read is refused when it is written out: " + std::string(error.what()));
    }
    if (again != written) broken_contract("a question changes when it is written out and read again");
  });
}

// The first two kinds of each operation.
std::vector<std::string> seeds() {
  std::vector<std::string> seeds;
  for (const guests::OperationDescription& operation : guests::operations()) {
    for (int64_t index = 0; index < 2; ++index) {
      guests::SavedQuestion saved;
      saved.operation = operation.name;
      saved.question = operation.draw(5, index, Precision::binary64);
      saved.precision = Precision::binary64;
      saved.found = "what was found";
      seeds.push_back(to_json(saved));
    }
  }
  return seeds;
}

}  // namespace

const Target kQuestion = {"question", feed, seeds};

}  // namespace cutproof::input_fuzzing
