// Questions to a single kernel, and the judge of its answers. Plugins, Python functions and files of test vectors get
// the same questions and the same judge.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "guests/guest.h"
#include "model/arrays.h"
#include "model/io/array_file.h"
#include "model/precision.h"
#include "model/verdict.h"

namespace cutproof::guests {

// One call of a kernel. Real numbers are f64 here, whatever the kernel takes; in questions for single precision their
// values have it.
struct Question {
  std::string kind;  // which of the operation's kinds of cases, in words
  Arrays given;      // input of the kernel, by the names of cutproof/plugin.h
  Arrays known;      // data for the judge alone
  int64_t size = 0;  // of a large one, which its seed, kind and size make again; else 0

  friend bool operator==(const Question&, const Question&) = default;
};

// The answer of a kernel.
struct AnswerArray {
  std::string_view name;
  bool real = false;  // of the kernel's precision; else of `type`
  ElementType type = ElementType::i32;
  int64_t columns = 1;
  std::string_view rows_of = {};  // as many rows as this array that is given has; empty: the kernel says how many
  std::string_view text;          // explanation, for a person
  bool optional = false;          // only in files: properties that need it are not judged without it
};

// Asks another question of the same guest; nothing if it does not answer.
using AskBeside = std::function<std::optional<Arrays>(const Question&)>;

struct OperationDescription {
  wire::Operation number;  // the plugin's member that answers it: of a stage `run`, by way of states
  std::string_view name;
  std::string_view text;       // explanation, for a person
  std::string_view by_itself;  // promises (harness/promises.h) that go without saying
  std::span<const AnswerArray> answers;
  // Unit in which cases are counted: matrices, or bodies.
  std::string_view cases;
  // Witness::particles of a failing verdict names all cases of the question that are wrong. Else a question is one
  // case.
  bool is_batch = false;
  // Question `index` of a campaign: the same on every machine. The first ones are one of each kind.
  Question (*draw)(uint64_t seed, int64_t index, Precision precision);
  int64_t (*cases_of)(const Question& question);
  std::string (*size_of)(const Question& question);  // "4 particles", for a person
  // One verdict for each property of the operation, promised or not; `answers` in the order above, in any precision.
  std::vector<Verdict> (*judge)(const Question& question, const Arrays& answers, Precision precision);
  // The defect of a question from a file, or "": sizes and indices. Types are checked already.
  std::string (*problem)(const Question& question);
  // Simpler questions, the most drastic first. Null for operations of files alone.
  std::vector<Question> (*simpler)(const Question& question);
  // Kinds of cases, in the order in which they are drawn.
  std::vector<std::string> (*kinds)();
  // Large questions, in which faults of width and of launch size show: kinds, sizes that are asked by default
  // (ascending), and one of them, the same on every machine. Nothing where there are none.
  std::vector<std::string> (*large_kinds)() = nullptr;
  std::span<const int64_t> sizes = {};
  Question (*draw_large)(uint64_t seed, int64_t kind, int64_t size, Precision precision) = nullptr;
  // Questions to a whole simulator, whose promises are those of runs. Null for all other operations. `draw` within what
  // a plugin states; throws InputError for unknown words.
  Question (*draw_for)(uint64_t seed, int64_t index, const PluginInfo& plugin) = nullptr;
  // The property whose verdict is not vacuous if a question matches its kind.
  std::string_view as_drawn = {};
  // The first difference of two answers to a question.
  std::string (*difference)(const Question& question, const Arrays& one, const Arrays& other) = nullptr;
  // Verdicts on further questions beside an answered one.
  std::vector<Verdict> (*judge_beside)(const Question& question, const Arrays& answers, Precision precision,
                                       const AskBeside& ask) = nullptr;
  // An answer as files of a run (docs/reference/run.md); nothing if it is none.
  std::vector<io::ArrayFile> (*files)(const Question& question, const Arrays& answers, Precision precision) = nullptr;
  bool is_simulator() const { return draw_for != nullptr; }
};

inline constexpr int64_t kMostSize = int64_t{1} << 25;  // of a large question

// Those that plugins are asked. guests/questions/vectors.h has more: the stages, which a plugin runs on whole states.
std::span<const OperationDescription> operations();
// Null if there is none of that name.
const OperationDescription* find_operation(std::string_view name);

// A failing verdict for an answer that cannot be judged.
Verdict unreadable(std::string_view property, const std::string& why);

}  // namespace cutproof::guests
