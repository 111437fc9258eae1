// A single kernel judged on many cases: asks a guest, judges the answers, shrinks failures.
#pragma once
#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "guests/guest.h"
#include "guests/questions/question.h"
#include "harness/promises.h"
#include "harness/property_summary.h"
#include "model/stop.h"

namespace cutproof::guests {

// The verdict on a guest that did not answer: it crashed, hung, broke a rule of the interface.
inline constexpr const char* kAnswersProperty = "answers";

struct KernelCampaignOptions {
  uint64_t seed = 1;
  int64_t cases = 1000;  // matrices, or bodies; at least one question of each kind; large ones beside
  // Sizes of large questions, ascending: one question of each large kind in each size.
  std::vector<int64_t> sizes = {};
  double time_limit = 10;  // [s] for an answer; a larger question is not asked if its answer would take longer, should
                           // the time of an answer grow with the square of the size
  std::optional<double> seconds = {};  // begins no further question after so long
  double simplify = 20;                // [s] for each failure that is kept
  // The campaign ends after this number of unanswered questions; 0: never.
  int64_t most_lost = 10;
  StopAsked stop_asked = {};  // asks no further question, and shrinks no further
};

struct KernelFailure {
  int64_t index = 0;   // of the question; of a large one, of its kind
  int64_t size = 0;    // of a large question as it was asked
  bool at_end = true;  // where its arrays lay
  Verdict verdict;     // of the question as it was drawn
  Question simplest;
  Verdict of_simplest;
};

// Results of the questions of one kind.
struct KindSummary {
  // A promised verdict on one of them.
  struct Case {
    int64_t index = 0, size = 0;  // of the question, as in KernelFailure
    Verdict verdict;
  };
  std::string kind;
  int64_t questions = 0, cases = 0, refused = 0;
  int64_t failed = 0;    // cases
  int64_t as_drawn = 0;  // questions that match their kind (OperationDescription::as_drawn)
  // The one that fails, else the one that comes nearest to its bound. Nothing where no bound but 0 was met.
  std::optional<Case> worst, first_failure;
};

// A large question that was not asked.
struct NotAsked {
  std::string kind;
  int64_t size = 0;
  int64_t size_before = 0;  // the last size that was asked,
  double seconds = 0;       // and how long its answer took
};

struct Unpromised {
  std::string property;
  int64_t checked = 0, failing = 0;  // verdicts
};

struct KernelCampaign {
  const OperationDescription* operation = nullptr;
  int64_t questions = 0, cases = 0, refused = 0, lost = 0;
  bool gave_up = false;
  bool ended = false;    // the guest has ended, and cannot be restarted
  bool stopped = false;  // it was asked to stop, and did before its end
  double seconds = 0;
  harness::PropertySummaries properties;  // judged and failed: cases
  std::vector<KindSummary> kinds;         // in the order in which they were first asked
  std::vector<NotAsked> not_asked;
  std::vector<Unpromised> unpromised;
  std::vector<KernelFailure> failures;  // the first of each property
  int64_t failed = 0;                   // questions
  int64_t failed_cases = 0;

  // Why so little was judged that nothing is known, or "".
  std::string untested() const;
  bool holds() const { return failed == 0 && untested().empty(); }
};

// "question 5 (a wire)"; large ones by their size.
std::string name_of_question(int64_t index, int64_t size, const std::string& kind);

// A plugin's promises of an operation: the stated ones, or the defaults. Throws InputError, naming the library, for
// unknown words.
harness::Promises promises_of(const PluginInfo& plugin, const OperationDescription& operation,
                              const std::string& library);

// One question to a guest. `at_end`: Guest::call.
Answer ask(Guest& guest, const OperationDescription& operation, const Question& question, bool at_end);

// All verdicts on one question; empty if the guest refused it. `again`: asks a second time, for the same bits. A large
// question is asked twice in any case, and a second answer that differs is judged as well. `seconds`: how long the
// guest took for its first answer.
std::vector<Verdict> judge_answer(Guest& guest, const OperationDescription& operation, const Question& question,
                                  bool at_end, bool again, double* seconds = nullptr);

// `progress` is called after every question.
KernelCampaign judge_kernel(Guest& guest, const OperationDescription& operation, const harness::Promises& promises,
                            const KernelCampaignOptions& options,
                            const std::function<void(const KernelCampaign&)>& progress);

// A question as data, in a line of JSON: replayed without the plugin's source (json.md, Questions).
struct SavedQuestion {
  std::string operation;
  Question question;  // of a large one kind and size alone
  Precision precision = Precision::binary32;
  bool at_end = true;
  std::string plugin, found;  // failures
  uint64_t seed = 0;
  int64_t index = 0;
};
// The question itself: a large one is drawn again.
Question question_of(const SavedQuestion& saved);
std::string to_json(const SavedQuestion& saved);
// Throws InputError, naming `file`, for anything else, and for fields that are not known.
SavedQuestion question_from_json(const std::string& text, const std::string& file);
SavedQuestion read_question(const std::string& file);

nlohmann::json to_json(const KernelCampaign& campaign);

}  // namespace cutproof::guests
