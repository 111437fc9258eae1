// Results of verdicts and campaigns for continuous integration: test cases (JUnit) and annotations.
#pragma once
#include <cstdint>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/annotations.h"
#include "harness/scene_judge.h"
#include "model/io/junit.h"

namespace cutproof::cli {

// "PROPERTY after STAGE", or the property alone where there is no stage or it is not of one.
std::string case_name(const std::string& property, std::string_view stage);
// "cutproof.VERB.SUBJECT". Readers part such a name at its dots, so those of a path are written as '_'.
std::string class_of(const std::string& verb, std::string subject = "");

// The judging subcommand, the class of test cases, and the command that repeats the judgement.
struct Judging {
  std::string suite;       // such as "cutproof run"
  std::string class_name;  // of its cases: class_of()
  std::string again;       // a command line
  // Subject of verdicts: frames with stages, frames of another simulator's run, or one state.
  enum class Of : uint8_t { stages, frames, state } of = Of::stages;
  bool in_stages() const { return of == Of::stages; }
};

// The case and the annotation of a requirement that is no property: enough was judged, completely.
inline constexpr const char* kEnoughJudged = "enough was judged";

// A case for each property and stage, or each property where there are no stages, in the order of their first verdicts,
// with their time. A case fails with its first failing verdict. A case is skipped if all its verdicts are vacuous.
// `is_expected`: a failure that the scene asks for, which passes.
std::vector<io::JunitCase> cases_of(const std::vector<Verdict>& verdicts, const Judging& judging,
                                    const std::function<bool(const Verdict&)>& is_expected = {});
// The same for all verdicts of a run. Unpromised properties are skipped, with the number of states in which they would
// fail, and so is each stage that the reference ran.
std::vector<io::JunitCase> cases_of(const harness::SceneJudge& judge, const Judging& judging);
// A skipped case for each stage that the reference ran for the backend.
std::vector<io::JunitCase> cases_of_left(const std::vector<std::string>& stages, const Judging& judging);
// Of a campaign's document. `failure`: of its conclusion, empty if it holds; it is a case by itself unless it is that
// properties fail.
std::vector<io::JunitCase> cases_of_campaign(const nlohmann::json& document, const std::string& failure,
                                             const Judging& judging);

// One for each property, with its first failing verdict and the number of further ones.
std::vector<Failure> failures_of(const std::vector<Verdict>& verdicts, const Judging& judging,
                                 const std::function<bool(const Verdict&)>& is_expected = {});
std::vector<Failure> failures_of_campaign(const nlohmann::json& document, const std::string& failure,
                                          const Judging& judging);

// A file of one suite, with properties of the whole; nothing if `path` is empty.
void write_junit(const std::string& path, const Judging& judging, double seconds, std::vector<io::JunitCase> cases,
                 std::vector<std::pair<std::string, std::string>> properties = {});

}  // namespace cutproof::cli
