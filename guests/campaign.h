// A single kernel judged on many cases: asks a guest, judges what it answers, simplifies what fails.
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
  int64_t cases = 1000;                // matrices, or bodies; at least one question of each kind
  std::optional<double> seconds = {};  // begins no further question after so long
  double simplify = 20;                // [s] for each failure that is kept
  // After so many questions that were not answered at all the campaign ends; 0: never.
  int64_t most_lost = 10;
  StopAsked stop_asked = {};  // asks no further question, and simplifies no further
};

struct KernelFailure {
  int64_t index = 0;   // of the question
  bool at_end = true;  // where its arrays lay
  Verdict verdict;     // of the question as it was drawn
  Question simplest;
  Verdict of_simplest;
};

struct Unpromised {
  std::string property;
  int64_t checked = 0, failing = 0;  // verdicts
};

struct KernelCampaign {
  const OperationDescription* operation = nullptr;
  int64_t questions = 0, cases = 0, refused = 0, lost = 0;
  bool gave_up = false;
  bool ended = false;    // the guest has, and cannot be started anew
  bool stopped = false;  // it was asked to stop, and did before its end
  double seconds = 0;
  harness::PropertySummaries properties;
  std::vector<Unpromised> unpromised;
  std::vector<KernelFailure> failures;  // the first of each property
  int64_t failed = 0;                   // questions

  // Something was judged, and nothing failed.
  bool holds() const { return failed == 0 && questions > refused; }
};

// What a plugin promises of an operation: what it says, or what goes without saying. Throws InputError, naming the
// library, for words that there are not.
harness::Promises promises_of(const PluginInfo& plugin, const OperationDescription& operation,
                              const std::string& library);

// One question to a guest. `at_end`: Guest::call.
Answer ask(Guest& guest, const OperationDescription& operation, const Question& question, bool at_end);

// All verdicts on one question; empty if the guest refused it. `again`: asks a second time, for the same bits.
std::vector<Verdict> judge_answer(Guest& guest, const OperationDescription& operation, const Question& question,
                                  bool at_end, bool again);

// `progress` is called after every question.
KernelCampaign judge_kernel(Guest& guest, const OperationDescription& operation, const harness::Promises& promises,
                            const KernelCampaignOptions& options,
                            const std::function<void(const KernelCampaign&)>& progress);

// A question as data, in a line of JSON: replayed without the plugin's source (results_schema.md, Questions).
struct SavedQuestion {
  std::string operation;
  Question question;
  Precision precision = Precision::binary32;
  bool at_end = true;
  std::string plugin, found;  // who failed, and how
  uint64_t seed = 0;
  int64_t index = 0;
};
std::string to_json(const SavedQuestion& saved);
// Throws InputError, naming `file`, for anything else, and for fields that are not known.
SavedQuestion question_from_json(const std::string& text, const std::string& file);
SavedQuestion read_question(const std::string& file);

nlohmann::json to_json(const KernelCampaign& campaign);

}  // namespace cutproof::guests
