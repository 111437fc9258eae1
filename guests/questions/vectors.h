// Test vectors: questions to single kernels as a file of arrays, for programs that link nothing, and the answers of
// such programs, judged like those of plugins (docs/reference/vectors.md).
#pragma once
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "guests/questions/campaign.h"
#include "guests/questions/question.h"
#include "harness/promises.h"
#include "harness/property_summary.h"
#include "model/io/array_file.h"

namespace cutproof::guests {

// Those of operations(), and the stages that are functions of sets alone: split, merge.
std::span<const OperationDescription> vector_operations();
// Null if there is none of that name.
const OperationDescription* find_vector_operation(std::string_view name);

struct Vectors {
  const OperationDescription* operation = nullptr;
  Precision precision = Precision::binary32;
  uint64_t seed = 1;
  std::vector<std::string> kinds;  // of cases
  std::vector<int32_t> kind;       // [cases] index into `kinds`
  std::vector<Question> cases;     // numbers have the precision
};

// The first questions of this seed, as in a campaign: at least one of each kind, at most kMostCases.
inline constexpr int64_t kMostCases = 100'000;
Vectors draw_vectors(const OperationDescription& operation, uint64_t seed, int64_t cases, Precision precision);
// Default number of drawn cases.
int64_t usual_vector_cases(const OperationDescription& operation);

// The whole file: questions, answers where they are unique, and criteria for other answers.
io::ArrayFile file_of(const Vectors& vectors);
// Throws InputError, naming `file` and the array, for an array that is unknown, missing, of another shape or type, or
// that does not follow from the questions.
Vectors vectors_of(const io::ArrayFile& contents, const std::string& file);

// Contents of a file of answers: those of each case, in the order of the operation's answers. An optional one that is
// not there has no name.
using AllAnswers = std::vector<Arrays>;
// Throws InputError, naming `file`, the array, and the first case without an answer.
AllAnswers answers_of(const io::ArrayFile& contents, const std::string& file, const Vectors& vectors);
// The reverse, for answers from C++.
io::ArrayFile file_of_answers(const Vectors& vectors, const AllAnswers& answers);

struct VectorFailure {
  int64_t index = 0;  // of the case
  Verdict verdict;
};

struct NotJudged {
  std::string property, why;
  int64_t failing = 0;  // cases in which it would fail
};

struct VectorReport {
  const OperationDescription* operation = nullptr;
  int64_t cases = 0, failed = 0;
  int64_t verdicts = 0;  // that looked at something, or fail
  harness::PropertySummaries properties;
  std::vector<VectorFailure> failures;  // by case
  std::vector<NotJudged> not_judged;

  // Something was judged, and nothing failed.
  bool holds() const { return failed == 0 && verdicts > 0; }
};

// The default promises, or those of `words`. Throws InputError for unknown words.
harness::Promises promises_of(const OperationDescription& operation, const std::optional<std::string>& words);
// The verdicts of `cutproof judge` on the same answers.
VectorReport judge_vectors(const Vectors& vectors, const AllAnswers& answers, const harness::Promises& promises);

// Where the entries of a case begin in the arrays with one entry for each particle, or matrix.
int64_t first_row(const Vectors& vectors, int64_t index);

// `cases` and `failures` of the document (docs/reference/schemas/check_vectors.json).
nlohmann::json to_json(const Vectors& vectors, const VectorReport& report);

}  // namespace cutproof::guests
