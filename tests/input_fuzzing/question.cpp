// Questions to kernels: what is read can be written, and reads back the same.
#include "guests/questions/campaign.h"
#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace of_question {

Outcome feed(std::string_view bytes) { return feed_document(bytes, "a question", guests::question_from_json); }

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

}  // namespace of_question

const Target kQuestion = {"question", of_question::feed, of_question::seeds};

}  // namespace cutproof::input_fuzzing
