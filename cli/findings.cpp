#include "cli/findings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "cli/options.h"
#include "cli/output.h"
#include "model/io/verdict_json.h"
#include "model/stage.h"
#include "oracles/property_count.h"

namespace cutproof::cli {

namespace {

using io::JunitCase;
using io::JunitOutcome;
using nlohmann::json;

std::string name_of_case(const Verdict& verdict, const Judging& judging) {
  return case_name(verdict.property, judging.in_stages() ? name_of(verdict.stage) : "");
}

// In a line, as all that is known of it where a person reads nothing else.
std::string in_full(const Verdict& verdict, const Judging& judging) {
  if (judging.in_stages()) return io::verdict_text(verdict);
  std::string text = fmt::format("'{}' fails", verdict.property);
  if (judging.of == Judging::Of::frames) text += fmt::format(" in frame {}", verdict.frame);
  if (!verdict.witness.particles.empty())
    text += fmt::format(" at {} {}", verdict.witness.particles.size() == 1 ? "particle" : "particles",
                        fmt::join(verdict.witness.particles, ", "));
  return text + ": " + io::measured_text(verdict);
}

// The witness describes the failure; a property of few words has none.
std::string what_was_found(const Verdict& verdict, const Judging& judging) {
  return verdict.witness.text.empty() ? in_full(verdict, judging) : verdict.witness.text;
}

// Of the case that its command shows: the shrunk one, where there is one.
const json& as_it_is_shown(const json& violation) {
  const auto simplified = violation.find("shrunk");
  return simplified != violation.end() && simplified->contains("text") ? *simplified : violation;
}

std::string what_was_found(const json& violation) {
  const json& shown = as_it_is_shown(violation);
  const std::string witness = shown.value("witness", "");
  return witness.empty() ? shown.at("text").get<std::string>() : witness;
}

std::string nothing_to_look_at(const std::string& why) { return "nothing to look at: " + why; }

// Adds a failure, unless its property has one: then it counts.
class FailuresOfProperties {
 public:
  // `more`: what there are several of.
  explicit FailuresOfProperties(const char* more) : more_(more) {}
  void add(Failure failure) {
    const auto known = std::find_if(failures_.begin(), failures_.end(),
                                    [&](const Failure& one) { return one.property == failure.property; });
    if (known != failures_.end()) {
      ++counts_[static_cast<std::size_t>(known - failures_.begin())];
    } else {
      failures_.push_back(std::move(failure));
      counts_.push_back(1);
    }
  }
  std::vector<Failure> take() {
    for (std::size_t k = 0; k < failures_.size(); ++k) {
      if (counts_[k] > 1) failures_[k].text += fmt::format(" (the first of {} {})", counts_[k], more_);
    }
    return std::move(failures_);
  }

 private:
  const char* more_;
  std::vector<Failure> failures_;
  std::vector<int64_t> counts_;
};

// Of one property after one stage.
struct CaseRow {
  std::string name;
  const Verdict* failing = nullptr;   // the first
  const Verdict* expected = nullptr;  // the first that fails as the scene expects
  int64_t verdicts = 0, failed = 0, looked = 0;
  double seconds = 0;
  std::string vacuous = {};  // the first reason that was given
};

std::string replay_command(const json& violation, const Judging& judging) {
  const std::string file = violation.value("file", "");
  return file.empty() ? judging.again : "cutproof replay " + quoted(file);
}

// Why a campaign does not hold although its properties hold.
bool is_about_the_whole(const json& document, const std::string& failure) {
  return !failure.empty() && (document.at("violations").empty() || !document.at("complete"));
}

}  // namespace

std::string case_name(const std::string& property, std::string_view stage) {
  const bool has_stage = !stage.empty() && oracles::is_of_a_moment(property);
  return has_stage ? fmt::format("{} after {}", property, stage) : property;
}

std::string class_of(const std::string& verb, std::string subject) {
  std::replace(subject.begin(), subject.end(), '.', '_');
  return "cutproof." + verb + (subject.empty() ? "" : "." + subject);
}

std::vector<JunitCase> cases_of(const std::vector<Verdict>& verdicts, const Judging& judging,
                                const std::function<bool(const Verdict&)>& is_expected) {
  std::vector<CaseRow> rows;
  for (const Verdict& verdict : verdicts) {
    const std::string name = name_of_case(verdict, judging);
    auto row = rows.begin();
    while (row != rows.end() && row->name != name) ++row;
    if (row == rows.end()) row = rows.insert(rows.end(), {name});
    ++row->verdicts;
    row->seconds += verdict.took.seconds;
    row->looked += verdict.checked > 0 || !verdict.holds;
    if (row->vacuous.empty()) row->vacuous = verdict.vacuous;
    if (verdict.holds) continue;
    if (is_expected && is_expected(verdict)) {
      if (row->expected == nullptr) row->expected = &verdict;
    } else {
      ++row->failed;
      if (row->failing == nullptr) row->failing = &verdict;
    }
  }
  std::vector<JunitCase> cases;
  for (const CaseRow& row : rows) {
    JunitCase& one = cases.emplace_back(JunitCase{row.name, judging.class_name, row.seconds});
    if (row.failing != nullptr) {
      one.outcome = JunitOutcome::failed;
      one.message = what_was_found(*row.failing, judging);
      one.text = in_full(*row.failing, judging) + "\n";
      if (judging.in_stages()) one.text += fmt::format("{} of {} verdicts fail.\n", row.failed, row.verdicts);
      one.text += "see it again: " + judging.again + "\n";
    } else if (row.expected != nullptr) {
      one.text = fmt::format("It fails, as the scene expects: {}\n", io::verdict_text(*row.expected));
    } else if (row.looked == 0) {
      one.outcome = JunitOutcome::skipped;
      one.message = nothing_to_look_at(row.vacuous.empty() ? "no reason given" : row.vacuous);
    }
  }
  return cases;
}

std::vector<JunitCase> cases_of(const harness::SceneJudge& judge, const Judging& judging) {
  std::vector<JunitCase> cases =
      cases_of(judge.verdicts(), judging, [&](const Verdict& verdict) { return judge.is_expected_failure(verdict); });
  for (const harness::Judge::Unpromised& one : judge.unpromised()) {
    cases.push_back({fmt::format("{}, where it is not promised", one.property), judging.class_name, 0,
                     JunitOutcome::skipped,
                     fmt::format("not promised: of {} states it would fail in {}", one.states, one.failing)});
  }
  const auto skip_expected = [&](const std::vector<std::string>& expected, const char* why) {
    for (const std::string& one : expected) {
      cases.push_back(
          {case_name("expected " + one, name_of(Stage::skin)), judging.class_name, 0, JunitOutcome::skipped, why});
    }
  };
  skip_expected(judge.not_reached(), "not reached: the run stops before");
  skip_expected(judge.not_its_own(), "not judged: only stages decide it that the reference ran for the backend");
  for (JunitCase& one : cases_of_left(judge.left_to_reference(), judging)) cases.push_back(std::move(one));
  return cases;
}

std::vector<JunitCase> cases_of_left(const std::vector<std::string>& stages, const Judging& judging) {
  std::vector<JunitCase> cases;
  for (const std::string& stage : stages) {
    cases.push_back({"stage " + stage, judging.class_name, 0, JunitOutcome::skipped,
                     "not judged: the reference ran it for the backend"});
  }
  return cases;
}

std::vector<JunitCase> cases_of_campaign(const json& document, const std::string& failure, const Judging& judging) {
  std::vector<JunitCase> cases;
  const auto case_named = [&](const std::string& name) -> JunitCase& {
    for (JunitCase& one : cases) {
      if (one.name == name) return one;
    }
    return cases.emplace_back(JunitCase{name, judging.class_name});
  };
  for (const json& property : document.at("properties")) {
    JunitCase& one =
        case_named(case_name(property.at("property").get<std::string>(), property.at("stage").get<std::string>()));
    one.seconds = property.at("seconds");
    if (property.at("failed").get<int64_t>() > 0) {
      one.outcome = JunitOutcome::failed;
      one.message = fmt::format("{} verdicts fail", property.at("failed").get<int64_t>());
    } else if (property.at("judged").get<int64_t>() == 0) {
      one.outcome = JunitOutcome::skipped;
      one.message = nothing_to_look_at("in none of the cases");
    }
  }
  for (const json& violation : document.at("violations")) {
    JunitCase& one =
        case_named(case_name(violation.value("property", "violation"), violation.value("stage", "a case")));
    const auto text = as_it_is_shown(violation).at("text").get<std::string>();
    if (one.outcome != JunitOutcome::failed || one.text.empty()) one.message = what_was_found(violation);
    one.outcome = JunitOutcome::failed;
    one.text += fmt::format("case {}: {}\nsee it again: {}\n", violation.at("index").get<int64_t>(), text,
                            replay_command(violation, judging));
  }
  for (JunitCase& one : cases) {
    if (one.outcome == JunitOutcome::failed && one.text.empty()) one.text = "see it again: " + judging.again + "\n";
  }
  for (JunitCase& one : cases_of_left(document.at("left_to_reference"), judging)) cases.push_back(std::move(one));
  JunitCase& whole = case_named(kEnoughJudged);
  if (is_about_the_whole(document, failure)) {
    // Missing cases could not be judged: an error. Too few judgements are a failure.
    whole.outcome = document.at("complete") ? JunitOutcome::failed : JunitOutcome::error;
    whole.message = failure;
    whole.text = fmt::format("{}\nsee it again: {}\n", failure, judging.again);
  }
  return cases;
}

std::vector<Failure> failures_of(const std::vector<Verdict>& verdicts, const Judging& judging,
                                 const std::function<bool(const Verdict&)>& is_expected) {
  FailuresOfProperties failures("verdicts that fail");
  for (const Verdict& verdict : verdicts) {
    if (verdict.holds || (is_expected && is_expected(verdict))) continue;
    failures.add({verdict.property, what_was_found(verdict, judging), judging.again});
  }
  return failures.take();
}

std::vector<Failure> failures_of_campaign(const json& document, const std::string& failure, const Judging& judging) {
  FailuresOfProperties failures("cases that fail");
  if (is_about_the_whole(document, failure)) failures.add({kEnoughJudged, failure, judging.again});
  for (const json& violation : document.at("violations")) {
    failures.add({as_it_is_shown(violation).value("property", violation.value("property", "violation")),
                  what_was_found(violation), replay_command(violation, judging)});
  }
  return failures.take();
}

void write_junit(const std::string& path, const Judging& judging, double seconds, std::vector<JunitCase> cases,
                 std::vector<std::pair<std::string, std::string>> properties) {
  write_output(path, io::junit_xml({{judging.suite, seconds, std::move(cases), std::move(properties)}}));
}

}  // namespace cutproof::cli
