#include "cli/terminal.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

#include "cli/screen.h"
#include "cli/table.h"
#include "model/counted.h"
#include "model/io/columns.h"
#include "model/io/filled.h"
#include "model/io/verdict_json.h"
#include "model/left_stages.h"
#include "oracles/property_count.h"
#include "oracles/registry.h"

namespace cutproof::cli {

namespace {

constexpr std::size_t kMostFailuresShown = 5;

// All verdicts of one property after one stage.
struct Row {
  const Verdict* any = nullptr;
  const Verdict *first_failing = nullptr, *worst_failing = nullptr, *first_expected = nullptr;
  const Verdict* worst = nullptr;  // the failing one with the greatest measure, or the greatest that holds
  int64_t verdicts = 0, looked = 0, failed = 0, expected = 0, checked = 0, inconclusive = 0;
  // The greatest of all frames: the worst figure need not be the one that came nearest to its own bound.
  double of_bound = -1;  // -1: every bound is 0, as it is of what is counted
  std::string vacuous = {};
};

bool is_greater(const Verdict& verdict, const Verdict* other) {
  return other == nullptr || !(verdict.measured <= other->measured);  // what is no number is the worst
}

// In order of first appearance, which is that of time within each.
std::vector<Row> rows_of(const std::vector<Verdict>& verdicts, const Shown& shown) {
  std::vector<Row> rows;
  for (const Verdict& verdict : verdicts) {
    auto row = std::find_if(rows.begin(), rows.end(), [&](const Row& known) {
      return known.any->property == verdict.property && known.any->stage == verdict.stage;
    });
    if (row == rows.end()) row = rows.insert(rows.end(), Row{&verdict});
    ++row->verdicts;
    row->looked += verdict.checked > 0 || !verdict.holds;
    row->checked += verdict.checked;
    row->inconclusive += verdict.inconclusive;
    if (row->vacuous.empty()) row->vacuous = verdict.vacuous;
    // What demands at least its bound has no room to lose.
    if (verdict.checked > 0 && verdict.bound > 0 && std::isfinite(verdict.bound) &&
        (!verdict.holds || verdict.measured < verdict.bound)) {
      row->of_bound = std::max(row->of_bound, verdict.measured / verdict.bound);
    }
    const bool worse = row->worst == nullptr || (row->worst->holds && !verdict.holds) ||
                       (row->worst->holds == verdict.holds && is_greater(verdict, row->worst));
    if (worse) row->worst = &verdict;
    if (verdict.holds) continue;
    if (shown.is_expected(verdict)) {
      ++row->expected;
      if (row->first_expected == nullptr) row->first_expected = &verdict;
    } else {
      ++row->failed;
      if (row->first_failing == nullptr || verdict.frame < row->first_failing->frame) row->first_failing = &verdict;
      if (is_greater(verdict, row->worst_failing)) row->worst_failing = &verdict;
    }
  }
  if (shown.summaries == nullptr) return rows;
  for (Row& row : rows) {
    const harness::PropertySummary* const summary = shown.summaries->find(row.any->property, row.any->stage);
    row.of_bound = summary != nullptr ? summary->of_bound.value_or(-1) : -1;
  }
  return rows;
}

std::string figure(double value) { return fmt::format("{:.4g}", value); }
// In a column of the table: counts up to five digits as they are, so that 1,010 is not 1.01e+03.
std::string short_figure(double value) {
  const bool is_count = std::abs(value) < 100'000 && value == std::floor(value);
  return is_count ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value);
}

// Of a bound, in as many columns as its head has.
std::string share(double of_bound) { return of_bound > 0 && of_bound < 0.001 ? "<0.001" : io::share_of(of_bound); }

std::string plural(int64_t count, const char* one, const char* several) {
  return fmt::format("{} {}", io::grouped(count), count == 1 ? one : several);
}

bool is_expectation(const Row& row) { return row.any->property.starts_with(oracles::kExpectation); }

std::string name_of_row(const Row& row, const Shown& shown) {
  const bool has_stage = shown.in_frames && shown.in_stages && oracles::is_of_a_moment(row.any->property);
  return has_stage ? fmt::format("{} after {}", row.any->property, name_of(row.any->stage)) : row.any->property;
}

std::string measured_and_bound(const Verdict& verdict) {
  const bool is_count = verdict.unit == "1" && verdict.bound == 0;
  return fmt::format("{} {}, bound {}", is_count ? "counted" : "measured",
                     io::in_unit(figure(verdict.measured), verdict.unit),
                     io::in_unit(figure(verdict.bound), verdict.unit));
}

std::string listed(const std::vector<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

void print_failing(const std::vector<Row>& rows, const Shown& shown) {
  // By the time at which each begins to fail: what comes first is nearest to the cause.
  std::vector<const Row*> failing_rows;
  for (const Row& row : rows) {
    if (row.failed > 0) failing_rows.push_back(&row);
  }
  std::stable_sort(failing_rows.begin(), failing_rows.end(), [](const Row* a, const Row* b) {
    const Verdict &one = *a->first_failing, &other = *b->first_failing;
    return std::pair(one.frame, one.stage) < std::pair(other.frame, other.stage);
  });
  const std::size_t failures = failing_rows.size();
  for (std::size_t k = 0; k < std::min(failures, kMostFailuresShown); ++k) {
    const Row& row = *failing_rows[k];
    const Verdict &first = *row.first_failing, &worst = *row.worst_failing;
    say("\n");
    insist("{}: {}", failing("FAILS"), name_of_row(row, shown));
    if (shown.in_frames) insist(", {}in frame {}", row.failed > 1 ? "first " : "", first.frame);
    if (row.failed > 1) insist(" ({} of {} verdicts)", io::grouped(row.failed), io::grouped(row.verdicts));
    insist("\n");
    if (was_judged(first)) insist("  {} ({})\n", measured_and_bound(first), first.bound_source);
    if (!first.witness.text.empty()) insist("  {}\n", first.witness.text);
    if (&worst != &first && worst.measured > first.measured && was_judged(first) && was_judged(worst)) {
      insist("  worst in frame {}: {}\n", worst.frame, measured_and_bound(worst));
    }
  }
  if (failures > kMostFailuresShown) {
    insist("\n… and {}; --json holds all verdicts.\n",
           counted(failures - kMostFailuresShown, "more property fails", "more properties fail"));
  }
  if (failures > 0 && !shown.again.empty()) {
    say("\n");
    insist_copy("see it again:", shown.again);
  }
}

// A row for each property and stage.
void print_table(const std::vector<Row>& rows, const Shown& shown) {
  std::vector<std::string> head = {"property"};
  if (shown.in_frames && shown.in_stages) head.push_back("after");
  if (shown.in_frames) head.push_back("frames");
  head.insert(head.end(), {"checked", "failed", "worst", "bound", "unit", "of bound"});
  Table table(head);
  for (const Row& row : rows) {
    const Verdict& worst = *row.worst;
    const std::string failed = row.failed + row.expected == 0 ? "-" : fmt::format("{}", row.failed + row.expected);
    std::vector<std::string> cells = {worst.property};
    if (shown.in_frames && shown.in_stages) cells.emplace_back(name_of(worst.stage));
    if (shown.in_frames) cells.push_back(fmt::format("{}", row.looked));
    cells.insert(
        cells.end(),
        {short_figure(static_cast<double>(row.checked)), row.failed > 0 ? failing(failed) : failed,
         was_judged(worst) ? short_figure(worst.measured) : "-", was_judged(worst) ? short_figure(worst.bound) : "-",
         worst.unit == "1" ? "" : worst.unit, row.of_bound < 0 ? "-" : share(row.of_bound)});
    table.add(cells);
  }
  say_as_it_is("\n" + table.text());
}

// What holds, and how near it came.
void print_holding(const std::vector<Row>& rows, const Shown& shown) {
  std::set<std::string> wrong;
  std::vector<oracles::AfterStage> counted_rows;
  const Row* nearest = nullptr;
  for (const Row& row : rows) {
    if (row.failed + row.expected > 0) wrong.insert(row.any->property);
    counted_rows.push_back({row.any->property, row.looked > 0, row.failed > 0, row.expected > 0});
  }
  const int64_t right = oracles::count_properties(counted_rows).hold;
  std::vector<std::string> expected;
  for (const Row& row : rows) {
    if (row.looked == 0 || wrong.contains(row.any->property) || oracles::is_of_the_judging(row.any->property)) continue;
    if (is_expectation(row)) {
      // A no-break space: a value stays with its name.
      expected.push_back(fmt::format("{}:\u00A0{}", row.any->property.substr(oracles::kExpectation.size()),
                                     io::in_unit(figure(row.any->measured), row.any->unit)));
      continue;
    }
    const bool tells = row.of_bound > 0 && !oracles::asks_wider(row.any->property);
    if (tells && (nearest == nullptr || row.of_bound > nearest->of_bound)) nearest = &row;
  }
  if (!expected.empty()) say("\n{}: {}.\n", holding("As the scene expects"), listed(expected));
  if (right == 0) return;
  say("{}{} {}", expected.empty() ? "\n" : "", plural(right, "property", "properties"),
      right == 1 ? holding("holds") : holding("hold"));
  if (nearest != nullptr) {
    say("; the nearest to its bound: {}, at {} of it", name_of_row(*nearest, shown), io::share_of(nearest->of_bound));
  }
  say(".\n");
}

void print_the_rest(const std::vector<Row>& rows, const Shown& shown) {
  std::vector<std::string> expected, unsure;
  std::vector<std::pair<std::string, std::string>> vacuous;
  std::set<std::string> looked;
  for (const Row& row : rows) {
    if (row.looked > 0) looked.insert(row.any->property);
    if (row.expected > 0) {
      expected.push_back(fmt::format("{} ({} of {} verdicts, first in frame {})", name_of_row(row, shown),
                                     io::grouped(row.expected), io::grouped(row.verdicts), row.first_expected->frame));
    }
    if (row.inconclusive > 0) {
      unsure.push_back(fmt::format("{} of {} in {}", io::grouped(row.inconclusive), io::grouped(row.checked),
                                   name_of_row(row, shown)));
    }
  }
  for (const Row& row : rows) {
    if (row.looked == 0 && looked.insert(row.any->property).second) {
      vacuous.emplace_back(row.any->property, row.vacuous.empty() ? "no reason given" : row.vacuous);
    }
  }
  if (!expected.empty()) say("{}: {}.\n", unsettled("Fails, as the scene expects"), listed(expected));
  print_grouped(lesser("Nothing to look at"), vacuous);
  if (!unsure.empty()) say("{}: {}.\n", unsettled("Inconclusive within rounding"), listed(unsure));
}

void print_conclusion(std::size_t verdicts, int64_t failed, bool all, const char* holds) {
  say("\n");
  insist("{} {}, {} failed: {}\n", io::grouped(static_cast<long long>(verdicts)),
         verdicts == 1 ? "verdict" : "verdicts", io::grouped(failed),
         all ? holding(holds) : failing("NOT everything holds."));
}

int64_t failures_in(const std::vector<Verdict>& verdicts, const Shown& shown) {
  return std::count_if(verdicts.begin(), verdicts.end(),
                       [&](const Verdict& verdict) { return !verdict.holds && !shown.is_expected(verdict); });
}

Shown shown_of(const harness::SceneJudge& judge, const std::string& again) {
  return {again, [&judge](const Verdict& verdict) { return judge.is_expected_failure(verdict); }, true,
          &judge.summaries()};
}

}  // namespace

void say_filled(const std::string& text, const nlohmann::json& values) { say_text(io::filled(text, values)); }

void print_verdicts(const std::vector<Verdict>& verdicts, const Shown& shown) {
  const std::vector<Row> rows = rows_of(verdicts, shown);
  print_failing(rows, shown);
  if (style().verbose) print_table(rows, shown);
  print_holding(rows, shown);
  print_the_rest(rows, shown);
}

void print_verdicts(const harness::SceneJudge& judge, const std::string& again) {
  print_verdicts(judge.verdicts(), shown_of(judge, again));
  if (!judge.not_reached().empty()) {
    say("{}: {}.\n", unsettled("Not reached, because the run stops before"), listed(judge.not_reached()));
  }
  if (const std::vector<std::string> left = judge.left_to_reference(); !left.empty()) {
    say("{}\n", unsettled(left_in_words(left)));
  }
  if (!judge.not_its_own().empty()) {
    say("{}: {}.\n", unsettled("Not judged, because only such stages decide it"), listed(judge.not_its_own()));
  }
  std::vector<std::string> unpromised;
  for (const harness::Judge::Unpromised& u : judge.unpromised()) {
    unpromised.push_back(u.failing > 0 ? fmt::format("{} (would not hold in {} of {} states)", u.property,
                                                     io::grouped(u.failing), io::grouped(u.states))
                                       : u.property);
  }
  if (!unpromised.empty()) say("{}: {}.\n", unsettled("Not promised here, so not judged"), listed(unpromised));
  print_notes(judge.notes_beside_lists());
}

void print_grouped(const std::string& what, const std::vector<std::pair<std::string, std::string>>& names_and_reasons) {
  std::vector<std::pair<std::string, std::vector<std::string>>> groups;  // by reason
  for (const auto& [name, reason] : names_and_reasons) {
    auto group = std::find_if(groups.begin(), groups.end(), [&r = reason](const auto& g) { return g.first == r; });
    if (group == groups.end()) group = groups.insert(groups.end(), {reason, {}});
    group->second.push_back(name);
  }
  if (groups.empty()) return;
  if (groups.size() == 1) {
    say("{} ({}): {}.\n", what, groups[0].first, listed(groups[0].second));
    return;
  }
  say("{}:\n", what);
  for (const auto& [reason, names] : groups) say("  {}: {}\n", reason, listed(names));
}

void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) say("{} {}\n", lesser("note:"), note);
}

void print_judged(const harness::PropertySummaries& properties, int64_t harness::PropertySummary::*judged) {
  Table table({"property", "judged", "failed", "greatest of bound"});
  for (const harness::PropertySummary& p : properties.all()) {
    const std::string failed = fmt::format("{}", p.failed);
    table.add({p.property, fmt::format("{}", p.*judged), p.failed > 0 ? failing(failed) : failed,
               p.of_bound ? io::share_of(*p.of_bound) : "-"});
  }
  say_as_it_is(table.text());
}

void print_conclusion(const std::vector<Verdict>& verdicts, const Shown& shown, const char* holds) {
  const int64_t failed = failures_in(verdicts, shown);
  print_conclusion(verdicts.size(), failed, failed == 0, holds);
}

void print_conclusion(const harness::SceneJudge& judge) {
  const char* const holds = judge.is_stopped()                   ? "what was reached holds."
                            : !judge.left_to_reference().empty() ? "what the backend ran holds."
                            : judge.not_reached().empty()        ? "everything holds."
                                                                 : "what was reached holds.";
  const int64_t failed = failures_in(judge.verdicts(), shown_of(judge, ""));
  print_conclusion(judge.verdicts().size(), failed, failed == 0, holds);
}

}  // namespace cutproof::cli
