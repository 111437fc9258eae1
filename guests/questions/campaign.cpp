#include "guests/questions/campaign.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <type_traits>
#include <utility>

#include "guests/questions/kinds.h"
#include "guests/questions/scenes.h"
#include "guests/tissue_arrays.h"
#include "model/at.h"
#include "model/error.h"
#include "model/io/input_file.h"
#include "model/io/json_number.h"
#include "model/io/json_reader.h"
#include "model/io/json_text.h"

namespace cutproof::guests {

namespace {

using nlohmann::json;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

const Verdict* first_failure(const std::vector<Verdict>& verdicts, const harness::Promises& promises,
                             const std::string& property = {}) {
  for (const Verdict& verdict : verdicts) {
    if (verdict.holds || !promises.cover(verdict.property)) continue;
    if (property.empty() || verdict.property == property) return &verdict;
  }
  return nullptr;
}

// A question of at most so many particles, or matrices, is saved as data, and shrunk as such.
constexpr int64_t kMostSaved = 2'048;

// Of a failure: the smallest large question of its kind that fails in the same property, and then questions that are
// simpler and still do.
void simplify(Guest& guest, const OperationDescription& operation, const harness::Promises& promises, bool again,
              const KernelCampaignOptions& options, KernelFailure& failure) {
  const Clock::time_point begin = Clock::now();
  const auto is_over = [&] {
    return seconds_since(begin) >= options.simplify || guest.has_ended() || is_asked(options.stop_asked);
  };
  const auto still_fails = [&](Question next) {
    const std::vector<Verdict> verdicts = judge_answer(guest, operation, next, failure.at_end, again);
    const Verdict* const failing = first_failure(verdicts, promises, failure.verdict.property);
    if (failing == nullptr) return false;
    failure.of_simplest = *failing;
    failure.simplest = std::move(next);
    return true;
  };
  for (int64_t holds = 0, fails = failure.simplest.size; fails - holds > 1 && !is_over();) {
    const int64_t size = holds + (fails - holds) / 2;
    const bool failed = still_fails(operation.draw_large(options.seed, failure.index, size, guest.plugin().precision));
    (failed ? fails : holds) = size;
  }
  if (failure.simplest.size > kMostSaved) return;
  failure.simplest.size = 0;
  for (bool simpler = true; simpler && !is_over();) {
    simpler = false;
    for (Question& next : operation.simpler(failure.simplest)) {
      if (is_over()) break;
      if ((simpler = still_fails(std::move(next)))) break;
    }
  }
}

// Whether `one` is worse than the worst so far: it fails, or comes nearer to its bound.
bool is_worse(const Verdict& one, const std::optional<KindSummary::Case>& known) {
  const auto share = [](const Verdict& verdict) {
    if (verdict.bound > 0 && !std::isnan(verdict.measured)) return verdict.measured / verdict.bound;
    return verdict.holds ? 0 : std::numeric_limits<double>::infinity();
  };
  if (!known) return !one.holds || share(one) > 0;
  if (one.holds != known->verdict.holds) return !one.holds;
  return share(one) > share(known->verdict);
}

// Adds the verdicts on one question to a campaign.
void count(KernelCampaign& campaign, const harness::Promises& promises, const Question& question, int64_t index,
           bool at_end, const std::vector<Verdict>& verdicts) {
  const OperationDescription& operation = *campaign.operation;
  const int64_t cases = operation.cases_of(question);
  const auto known_kind = std::find_if(campaign.kinds.begin(), campaign.kinds.end(),
                                       [&](const KindSummary& k) { return k.kind == question.kind; });
  KindSummary& kind = known_kind != campaign.kinds.end() ? *known_kind : campaign.kinds.emplace_back();
  kind.kind = question.kind;
  ++campaign.questions;
  ++kind.questions;
  campaign.cases += cases;
  kind.cases += cases;
  campaign.refused += verdicts.empty() ? 1 : 0;
  kind.refused += verdicts.empty() ? 1 : 0;
  std::set<int32_t> wrong;  // cases of a batch
  bool fails = false, all_fail = false;
  for (const Verdict& verdict : verdicts) {
    if (verdict.property == operation.as_drawn && verdict.checked > 0) ++kind.as_drawn;
    if (!promises.cover(verdict.property)) {
      const auto known = std::find_if(campaign.unpromised.begin(), campaign.unpromised.end(),
                                      [&](const Unpromised& u) { return u.property == verdict.property; });
      Unpromised& entry = known != campaign.unpromised.end()
                              ? *known
                              : campaign.unpromised.emplace_back(Unpromised{verdict.property, 0, 0});
      entry.checked += verdict.checked > 0 ? 1 : 0;
      entry.failing += verdict.holds ? 0 : 1;
      continue;
    }
    const auto& named = verdict.witness.particles;
    if (!operation.is_batch) {
      campaign.properties.add(verdict);
    } else {
      const int64_t wrong_ones = named.empty() ? verdict.checked : static_cast<int64_t>(named.size());
      campaign.properties.add(verdict, verdict.checked, verdict.holds ? 0 : wrong_ones);
    }
    if (is_worse(verdict, kind.worst)) kind.worst = {index, question.size, verdict};
    if (verdict.holds) continue;
    fails = true;
    if (operation.is_batch && !named.empty()) {
      wrong.insert(named.begin(), named.end());
    } else {
      all_fail = true;
    }
    if (!kind.first_failure) kind.first_failure = {index, question.size, verdict};
    if (verdict.property == kAnswersProperty) ++campaign.lost;
    const bool is_known = std::any_of(campaign.failures.begin(), campaign.failures.end(),
                                      [&](const KernelFailure& f) { return f.verdict.property == verdict.property; });
    if (!is_known) campaign.failures.push_back({index, question.size, at_end, verdict, question, verdict});
  }
  const int64_t failed = all_fail ? cases : static_cast<int64_t>(wrong.size());
  kind.failed += failed;
  campaign.failed_cases += failed;
  campaign.failed += fails ? 1 : 0;
}

// A kind with this many answered questions, none of which matches the kind, has not been tested.
constexpr int64_t kEnoughToBeOne = 10;

}  // namespace

std::string KernelCampaign::untested() const {
  const int64_t answered = questions - refused;
  if (answered == 0) return fmt::format("all {} questions were refused", questions);
  if (!operation->is_simulator()) return "";
  if (answered * 10 < questions) return fmt::format("{} of {} questions were refused", refused, questions);
  int64_t cut = 0;
  for (const KindSummary& kind : kinds) {
    cut += scenes::is_to_be_cut(kind.kind) ? kind.as_drawn : 0;
    if (kind.as_drawn == 0 && kind.questions - kind.refused >= kEnoughToBeOne) {
      return fmt::format("none of {} scenes of the kind '{}' was one", kind.questions - kind.refused, kind.kind);
    }
  }
  return cut == 0 ? fmt::format("in none of {} scenes was the tissue cut as drawn", answered) : "";
}

std::string name_of_question(int64_t index, int64_t size, const std::string& kind) {
  return size > 0 ? fmt::format("the question of size {} ({})", size, kind)
                  : fmt::format("question {} ({})", index, kind);
}

harness::Promises promises_of(const PluginInfo& plugin, const OperationDescription& operation,
                              const std::string& library) {
  harness::Promises promises;
  const std::string words = plugin.promises.value_or(std::string(operation.by_itself));
  promises.words = harness::parse_promises(words, library, "promises");
  if (!operation.is_simulator()) return promises;
  // The judge of runs checks promises of runs; these remain.
  promises.words = harness::Promises{}.words;
  if ((scenes::scene_promises(words) >> static_cast<int>(oracles::RunPromise::deterministic) & 1u) == 0) {
    promises.words &= ~harness::parse_promises("same_bits", library, "promises");
  }
  return promises;
}

Answer ask(Guest& guest, const OperationDescription& operation, const Question& question, bool at_end) {
  const Precision precision = guest.plugin().precision;
  Arrays rounded;
  for (const Array& array : question.given) rounded.push_back(in_precision_of_tissue(array, precision));
  std::vector<Argument> arguments;
  for (const Array& array : rounded) arguments.push_back(given_of_tissue(array));
  const ElementType real = precision == Precision::binary32 ? ElementType::f32 : ElementType::f64;
  for (const AnswerArray& wanted : operation.answers) {
    Argument& argument = arguments.emplace_back();
    argument.name = wanted.name;
    argument.type = wanted.real ? real : wanted.type;
    argument.columns = wanted.columns;
    argument.role = wanted.rows_of.empty() ? Role::grown : Role::answer;
    if (!wanted.rows_of.empty()) argument.rows = find_array(question.given, wanted.rows_of)->rows();
  }
  return guest.call(operation.number, 0, {}, arguments, at_end);
}

std::vector<Verdict> judge_answer(Guest& guest, const OperationDescription& operation, const Question& question,
                                  bool at_end, bool again, double* seconds) {
  const Precision precision = guest.plugin().precision;
  const Clock::time_point begin = Clock::now();
  const Answer answer = ask(guest, operation, question, at_end);
  if (seconds != nullptr) *seconds = seconds_since(begin);
  if (answer.kind == Answer::Kind::refused) return {};
  const auto of_all_cases = [&](std::string_view property, const std::string& why) {
    Verdict verdict = unreadable(property, why);
    verdict.checked = operation.cases_of(question);
    return verdict;
  };
  if (answer.kind == Answer::Kind::fault) return {of_all_cases(kAnswersProperty, answer.text)};
  std::vector<Verdict> verdicts = operation.judge(question, answer.arrays, precision);
  Verdict answers = of_all_cases(kAnswersProperty, "");
  answers.holds = true;
  answers.measured = 0;
  verdicts.insert(verdicts.begin(), answers);
  const auto judge_beside = [&] {
    if (operation.judge_beside == nullptr) return;
    const AskBeside beside = [&](const Question& next) {
      Answer other = ask(guest, operation, next, at_end);
      return other.kind == Answer::Kind::answered ? std::optional(std::move(other.arrays)) : std::nullopt;
    };
    for (Verdict& verdict : operation.judge_beside(question, answer.arrays, precision, beside))
      verdicts.push_back(std::move(verdict));
  };
  if (!again && question.size == 0) {
    judge_beside();
    return verdicts;
  }
  const Answer second = ask(guest, operation, question, !at_end);
  const bool answered = second.kind == Answer::Kind::answered;
  std::string how = second.text;
  if (answered && operation.difference != nullptr) {
    how = operation.difference(question, answer.arrays, second.arrays);
  } else if (answered && second.arrays != answer.arrays) {
    how = "asked again, it gives another answer";
  }
  const bool is_same = answered && how.empty();
  if (again) {
    Verdict same = of_all_cases("determinism", how);
    same.holds = is_same;
    if (same.holds) {
      same.measured = 0;
      same.witness = {};
    }
    verdicts.push_back(same);
    if (same.holds) judge_beside();  // a broken promise of determinism ends the judgement
  } else if (!answered) {
    verdicts.front() = of_all_cases(kAnswersProperty, "asked again: " + second.text);
  } else if (!is_same) {
    // Another answer, which may be as correct as the first, or the occasional result of a race.
    for (Verdict& verdict : operation.judge(question, second.arrays, precision)) {
      if (verdict.holds) continue;
      verdict.witness.text = "asked again: " + verdict.witness.text;
      const auto first = std::find_if(verdicts.begin(), verdicts.end(),
                                      [&](const Verdict& v) { return v.property == verdict.property; });
      if (first == verdicts.end()) {
        verdicts.push_back(std::move(verdict));
      } else if (first->holds) {
        *first = std::move(verdict);
      }
    }
  }
  return verdicts;
}

KernelCampaign judge_kernel(Guest& guest, const OperationDescription& operation, const harness::Promises& promises,
                            const KernelCampaignOptions& options,
                            const std::function<void(const KernelCampaign&)>& progress) {
  const Clock::time_point begin = Clock::now();
  KernelCampaign campaign;
  campaign.operation = &operation;
  // The defaults do not promise equal bits.
  const bool again = guest.plugin().promises && promises.cover("determinism");
  const auto kinds = static_cast<int64_t>(operation.kinds().size());
  const Precision precision = guest.plugin().precision;
  const auto goes_on = [&] {
    if (options.seconds && seconds_since(begin) >= *options.seconds) return false;
    campaign.stopped = is_asked(options.stop_asked);
    return !campaign.stopped && !campaign.gave_up;
  };
  // How long the guest took.
  const auto examine = [&](const Question& question, int64_t index, bool at_end) {
    double seconds = 0;
    const std::vector<Verdict> verdicts = judge_answer(guest, operation, question, at_end, again, &seconds);
    count(campaign, promises, question, index, at_end, verdicts);
    campaign.seconds = seconds_since(begin);
    if (progress) progress(campaign);
    campaign.ended = guest.has_ended();
    campaign.gave_up = campaign.ended || (options.most_lost > 0 && campaign.lost >= options.most_lost);
    return seconds;
  };
  const auto ask_large_ones = [&] {
    if (operation.draw_large == nullptr) return;
    const std::vector<std::string> large = operation.large_kinds();
    std::vector<NotAsked> last(large.size());  // the last question of each kind
    for (const int64_t size : options.sizes) {
      for (std::size_t kind = 0; kind < large.size() && goes_on(); ++kind) {
        NotAsked& before = last[kind];
        if (before.seconds < 0) continue;
        const double factor =
            before.size_before == 0 ? 0 : static_cast<double>(size) / static_cast<double>(before.size_before);
        if (before.seconds * factor * factor > options.time_limit) {
          campaign.not_asked.push_back({large[kind], size, before.size_before, before.seconds});
          continue;
        }
        const Question question = operation.draw_large(options.seed, static_cast<int64_t>(kind), size, precision);
        before.size_before = size;
        const int64_t failed = campaign.failed;
        before.seconds = examine(question, static_cast<int64_t>(kind), kind % 2 == 0);
        if (campaign.failed > failed) before.seconds = -1;  // nothing larger says more
      }
    }
  };
  // One of each kind, the large ones, all others.
  int64_t ordinary = 0;
  for (int64_t index = 0; (ordinary < options.cases || index < kinds) && goes_on(); ++index) {
    if (index == kinds) ask_large_ones();
    if (index >= kinds && !goes_on()) break;
    const Question question = operation.is_simulator() ? operation.draw_for(options.seed, index, guest.plugin())
                                                       : operation.draw(options.seed, index, precision);
    ordinary += operation.cases_of(question);
    // By turns both ends of every array are guarded, whatever the number of kinds.
    examine(question, index, (index + index / kinds) % 2 == 0);
    if (index + 1 == kinds && ordinary >= options.cases) ask_large_ones();
  }
  for (KernelFailure& failure : campaign.failures) {
    simplify(guest, operation, promises, again, options, failure);
  }
  return campaign;
}

// --- Data ------------------------------------------------------------------------------------------------------------

namespace {

constexpr int kFormatVersion = 1;
constexpr const char* kFormat = "cutproof.question";
constexpr const char* kWhatToGive = "give a question that `cutproof judge` has saved";

json to_json(const Array& array) {
  json values = json::array();
  const bool real = array.type == ElementType::f32 || array.type == ElementType::f64;
  for (int64_t k = 0; k < array.count(); ++k) {
    if (!real) {
      values.push_back(array.integer(k));
    } else if (const double value = array.number(k); std::isfinite(value)) {
      values.push_back(value);
    } else {
      values.push_back(std::isnan(value) ? "nan" : value > 0 ? "inf" : "-inf");
    }
  }
  return {{"type", name_of(array.type)}, {"shape", array.shape}, {"values", std::move(values)}};
}

Array array_from(const std::string& name, const json& j) {
  ElementType type = {};
  for (const ElementType each : {ElementType::i32, ElementType::i64, ElementType::u8, ElementType::f64}) {
    if (j.at("type") == name_of(each)) type = each;
  }
  std::vector<int64_t> shape;
  for (const json& extent : j.at("shape").get<std::vector<json>>()) shape.push_back(integer_from<int64_t>(extent));
  if (j.size() != 3 || type == ElementType{}) throw std::invalid_argument(name + " is no array");
  const json& values = j.at("values");
  const auto filled = [&]<class T>(T) {
    std::vector<T> numbers;
    for (const json& value : values) {
      if constexpr (std::is_integral_v<T>) {
        numbers.push_back(integer_from<T>(value));
      } else if (!value.is_string()) {
        numbers.push_back(value.get<T>());
      } else {
        const std::string text = value;
        const double number = text == "nan"   ? std::numeric_limits<double>::quiet_NaN()
                              : text == "inf" ? std::numeric_limits<double>::infinity()
                                              : -std::numeric_limits<double>::infinity();
        numbers.push_back(number);
      }
    }
    Array array = make_array(name, shape, numbers);
    if (array.count() != static_cast<int64_t>(numbers.size())) throw std::invalid_argument(name + " has another shape");
    return array;
  };
  switch (type) {
    case ElementType::i32:
      return filled(int32_t{});
    case ElementType::i64:
      return filled(int64_t{});
    case ElementType::u8:
      return filled(uint8_t{});
    default:
      return filled(double{});
  }
}

json to_json(const Arrays& arrays) {
  json object = json::object();
  for (const Array& array : arrays) object[array.name] = to_json(array);
  return object;
}

}  // namespace

Question question_of(const SavedQuestion& saved) {
  if (saved.question.size == 0) return saved.question;
  return find_operation(saved.operation)->draw_large(saved.seed, saved.index, saved.question.size, saved.precision);
}

std::string to_json(const SavedQuestion& saved) {
  if (saved.question.size > 0) {
    return io::json_text({{"format", kFormat},
                          {"format_version", kFormatVersion},
                          {"operation", saved.operation},
                          {"kind", saved.question.kind},
                          {"size", saved.question.size},
                          {"precision", saved.precision == Precision::binary32 ? "single" : "double"},
                          {"at_end", saved.at_end},
                          {"plugin", saved.plugin},
                          {"found", saved.found},
                          {"seed", saved.seed},
                          {"index", saved.index}});
  }
  return io::json_text({{"format", kFormat},
                        {"format_version", kFormatVersion},
                        {"operation", saved.operation},
                        {"kind", saved.question.kind},
                        {"precision", saved.precision == Precision::binary32 ? "single" : "double"},
                        {"at_end", saved.at_end},
                        {"plugin", saved.plugin},
                        {"found", saved.found},
                        {"seed", saved.seed},
                        {"index", saved.index},
                        {"given", to_json(saved.question.given)},
                        {"known", to_json(saved.question.known)}});
}

SavedQuestion question_from_json(const std::string& text, const std::string& file) {
  const auto refuse = [&](const std::string& problem) -> InputError { return {file, "", problem, kWhatToGive}; };
  SavedQuestion saved;
  try {
    const json j = io::parse_json(text, file, io::kQuestionLimits, std::string(kWhatToGive) + ".");
    if (!j.is_object() || j.value("format", "") != kFormat) throw refuse("it is not a question to a kernel");
    if (j.at("format_version") != kFormatVersion) {
      throw refuse(
          fmt::format("it has version {}, and this cutproof reads {}", j.at("format_version").dump(), kFormatVersion));
    }
    for (const auto& [key, value] : j.items()) {
      constexpr std::string_view kKnown[] = {"format", "format_version", "operation", "kind", "precision",
                                             "at_end", "plugin",         "found",     "seed", "index",
                                             "given",  "known",          "size"};
      if (std::find(std::begin(kKnown), std::end(kKnown), key) == std::end(kKnown)) {
        throw refuse("it has a field '" + key + "', which is not known");
      }
    }
    saved.operation = j.at("operation");
    const OperationDescription* const operation = find_operation(saved.operation);
    if (operation == nullptr) throw refuse("there is no operation '" + saved.operation + "'");
    saved.question.kind = j.at("kind");
    saved.precision = j.at("precision") == "double" ? Precision::binary64 : Precision::binary32;
    saved.at_end = j.at("at_end");
    saved.plugin = j.at("plugin");
    saved.found = j.at("found");
    saved.seed = integer_from<uint64_t>(j.at("seed"));
    saved.index = integer_from<int64_t>(j.at("index"));
    if (j.contains("size")) {
      saved.question.size = integer_from<int64_t>(j.at("size"));
      if (j.contains("given") || j.contains("known")) throw refuse("a question with a size has no arrays: it is drawn");
      if (saved.question.size < 1 || saved.question.size > kMostSize) {
        throw refuse(fmt::format("'size' is out of range: it goes from 1 to {}", kMostSize));
      }
      const std::vector<std::string> large =
          operation->large_kinds != nullptr ? operation->large_kinds() : std::vector<std::string>{};
      const bool is_one = saved.index >= 0 && saved.index < static_cast<int64_t>(large.size());
      if (!is_one || large[at(saved.index)] != saved.question.kind) {
        throw refuse(fmt::format("'kind' and 'index' are those of no large question of '{}'", saved.operation));
      }
      return saved;
    }
    // In the order in which the operation gives them, each of its type and as many columns.
    Question grid_model = operation->draw(1, 0, saved.precision);
    for (int64_t k = 0; k < static_cast<int64_t>(operation->kinds().size()); ++k) {
      Question other = operation->draw(1, k, saved.precision);
      if (other.given.size() > grid_model.given.size()) grid_model = std::move(other);
    }
    const auto take = [&](const char* member, const Arrays& wanted, Arrays& to) {
      for (const Array& array : wanted) {
        if (!j.at(member).contains(array.name)) continue;
        Array read = array_from(array.name, j.at(member).at(array.name));
        const bool fits = read.type == array.type && read.shape.size() == array.shape.size() &&
                          std::equal(read.shape.begin() + 1, read.shape.end(), array.shape.begin() + 1);
        if (!fits) throw refuse("'" + array.name + "' is of another type or shape");
        to.push_back(std::move(read));
      }
      if (to.size() != j.at(member).size()) throw refuse(std::string(member) + " has an array that is not known");
    };
    take("given", grid_model.given, saved.question.given);
    take("known", grid_model.known, saved.question.known);
    for (const Array& array : grid_model.given) {
      if (array.name == "node" || array.name == "nodes" || find_array(saved.question.given, array.name)) continue;
      throw refuse("'" + array.name + "' is missing");
    }
    if (saved.question.known.size() != grid_model.known.size()) throw refuse("data for the judge is missing");
    if (const std::string problem = operation->problem(saved.question); !problem.empty()) throw refuse(problem);
  } catch (const json::exception& error) {
    throw refuse(error.what());
  } catch (const std::invalid_argument& error) {
    throw refuse(error.what());
  }
  return saved;
}

SavedQuestion read_question(const std::string& file) {
  return question_from_json(io::read_file(file, io::kQuestionLimits), file);
}

namespace {

// Of a large question the size too, which with seed, kind and precision makes it again.
json to_json(const KindSummary::Case& one) {
  json j = {{"property", one.verdict.property},
            {"index", one.index},
            {"measured", json_number(one.verdict.measured)},
            {"bound", json_number(one.verdict.bound)},
            {"unit", one.verdict.unit},
            {"holds", one.verdict.holds}};
  if (one.size > 0) j["size"] = one.size;
  if (!one.verdict.holds) j["text"] = one.verdict.witness.text;
  return j;
}

}  // namespace

nlohmann::json to_json(const KernelCampaign& campaign) {
  json unpromised = json::array(), failures = json::array(), kinds = json::array(), not_asked = json::array();
  for (const Unpromised& u : campaign.unpromised) {
    unpromised.push_back({{"property", u.property}, {"judged", u.checked}, {"failing", u.failing}});
  }
  for (const KernelFailure& f : campaign.failures) {
    failures.push_back({{"property", f.verdict.property},
                        {"index", f.index},
                        {"kind", f.simplest.kind},
                        {"text", f.verdict.witness.text},
                        {"shrunk", f.of_simplest.witness.text},
                        {"measured", json_number(f.of_simplest.measured)},
                        {"bound", json_number(f.of_simplest.bound)},
                        {"unit", f.of_simplest.unit},
                        {"size", campaign.operation->size_of(f.simplest)}});
    if (f.size > 0) failures.back()["drawn_size"] = f.size;
  }
  const bool is_simulator = campaign.operation->is_simulator();
  for (const KindSummary& kind : campaign.kinds) {
    kinds.push_back({{"kind", kind.kind},
                     {"questions", kind.questions},
                     {"cases", kind.cases},
                     {"refused", kind.refused},
                     {"failed", kind.failed},
                     {"worst", kind.worst ? to_json(*kind.worst) : json()},
                     {"first_failure", kind.first_failure ? to_json(*kind.first_failure) : json()}});
    if (is_simulator) kinds.back()["as_drawn"] = kind.as_drawn;
  }
  for (const NotAsked& each : campaign.not_asked) {
    not_asked.push_back(
        {{"kind", each.kind}, {"size", each.size}, {"size_before", each.size_before}, {"seconds", each.seconds}});
  }
  return {{"operation", campaign.operation->name},
          {"cases", campaign.cases},
          {"of", campaign.operation->cases},
          {"questions", campaign.questions},
          {"refused", campaign.refused},
          {"not_answered", campaign.lost},
          {"not_asked", std::move(not_asked)},
          {"complete", !campaign.stopped},
          {"gave_up", campaign.gave_up},
          {"ended", campaign.ended},
          {"failed", campaign.failed},
          {"failed_cases", campaign.failed_cases},
          {"untested", campaign.untested()},
          {"seconds", campaign.seconds},
          {"properties", campaign.properties.to_json(false)},
          {"kinds", std::move(kinds)},
          {"unpromised", std::move(unpromised)},
          {"failures", std::move(failures)},
          {"holds", campaign.holds()}};
}

}  // namespace cutproof::guests
