#include "cli/terminal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "model/io/filled.h"

namespace cutproof::cli {

namespace {

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

constexpr std::size_t kMostFailuresShown = 5;

struct Row {
  const Verdict* worst = nullptr;  // the failing one with the greatest measure, or the greatest that holds
  int64_t frames = 0, failed = 0, expected = 0, checked = 0, undecided = 0;
};

// The greatest of all frames: the worst figure need not be the one that came nearest to its own bound.
std::string share_of_bound(const harness::SceneJudge& judge, const Verdict& verdict) {
  const harness::PropertySummary* const summary = judge.summaries().find(verdict.property, verdict.stage);
  return summary != nullptr && summary->of_bound ? fmt::format("{:.2g}", *summary->of_bound) : "-";
}

std::string figure(double value) { return fmt::format("{:.4g}", value); }

}  // namespace

Progress::Progress(std::string thing, int64_t total)
    : thing_(std::move(thing)), total_(total), terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() { clear(); }

void Progress::clear() {
  if (!terminal_ || width_ == 0) return;
  fmt::print(stderr, "\r{:{}}\r", "", width_);
  std::fflush(stderr);
  width_ = 0;
}

void Progress::show(int64_t done, const std::string& what) {
  if (!terminal_ || (now() - last_ < 0.1 && done != total_)) return;
  last_ = now();
  const std::string line = total_ > 0 ? fmt::format("{} {} of {}: {}", thing_, done, total_, what)
                                      : fmt::format("{} {}: {}", thing_, done, what);
  clear();
  fmt::print(stderr, "\r{}", line);
  std::fflush(stderr);
  width_ = line.size();
}

void print_filled(const std::string& text, const nlohmann::json& values) { fmt::print("{}", io::filled(text, values)); }

void print_verdicts(const harness::SceneJudge& judge) {
  std::vector<std::pair<std::string, Row>> rows;  // in order of first appearance
  for (const Verdict& verdict : judge.verdicts()) {
    // Expectations are read one by one; properties are gathered over frames.
    const std::string key = fmt::format("{}\t{}", verdict.property, name_of(verdict.stage));
    auto found = rows.begin();
    while (found != rows.end() && found->first != key) ++found;
    if (found == rows.end()) found = rows.insert(rows.end(), {key, {}});
    Row& row = found->second;
    row.frames += verdict.checked > 0 || !verdict.holds;
    row.checked += verdict.checked;
    row.undecided += verdict.undecided;
    if (!verdict.holds) ++(judge.is_expected_failure(verdict) ? row.expected : row.failed);
    const bool worse = row.worst == nullptr || (row.worst->holds && !verdict.holds) ||
                       (row.worst->holds == verdict.holds && verdict.measured > row.worst->measured);
    if (worse) row.worst = &verdict;
  }
  fmt::print("\n{:<40} {:<7} {:>7} {:>12} {:>7} {:>11} {:>11} {:<7} {:>8}  {}\n", "property", "after", "frames",
             "checked", "failed", "worst", "bound", "unit", "of bound", "");
  for (const auto& [key, row] : rows) {
    const Verdict& worst = *row.worst;
    std::string mark = row.failed > 0     ? "FAILS"
                       : row.expected > 0 ? "fails, as the scene expects"
                       : row.frames == 0  ? "vacuous"
                                          : "holds";
    if (row.undecided > 0) mark += fmt::format(", {} undecided", row.undecided);
    fmt::print("{:<40} {:<7} {:>7} {:>12} {:>7} {:>11} {:>11} {:<7} {:>8}  {}\n", worst.property, name_of(worst.stage),
               row.frames, row.checked, row.failed + row.expected, figure(worst.measured), figure(worst.bound),
               worst.unit, share_of_bound(judge, worst), mark);
  }
  std::size_t failures = 0;
  for (const Verdict& verdict : judge.verdicts()) {
    if (verdict.holds || judge.is_expected_failure(verdict)) continue;
    if (++failures > kMostFailuresShown) continue;
    fmt::print("\nFAILS: {} after {}, frame {}, backend {}\n  measured {} {}, bound {} ({})\n  {}\n", verdict.property,
               name_of(verdict.stage), verdict.frame, verdict.backend, figure(verdict.measured), verdict.unit,
               figure(verdict.bound), verdict.bound_source, verdict.witness.text);
  }
  if (failures > kMostFailuresShown) {
    fmt::print("\n… and {} more failing verdicts; --json holds all of them.\n", failures - kMostFailuresShown);
  }
  for (const std::string& note : judge.notes()) fmt::print("\nnote: {}\n", note);
  fmt::print("\n{} verdicts, {} failed: {}\n", judge.verdicts().size(), failures,
             judge.holds() ? "everything holds." : "NOT everything holds.");
}

void print_single_verdicts(const std::vector<Verdict>& verdicts) {
  fmt::print("\n{:<24} {:>12} {:>11} {:>11} {:<7}  {}\n", "property", "checked", "measured", "bound", "unit", "");
  for (const Verdict& verdict : verdicts) {
    std::string mark = !verdict.holds ? "FAILS" : verdict.vacuous.empty() ? "holds" : "vacuous: " + verdict.vacuous;
    if (verdict.undecided > 0) mark += fmt::format(", {} undecided", verdict.undecided);
    fmt::print("{:<24} {:>12} {:>11} {:>11} {:<7}  {}\n", verdict.property, verdict.checked, figure(verdict.measured),
               figure(verdict.bound), verdict.unit, mark);
  }
  for (const Verdict& verdict : verdicts) {
    if (verdict.holds) continue;
    fmt::print("\nFAILS: {}\n  measured {} {}, bound {} ({})\n  {}\n", verdict.property, figure(verdict.measured),
               verdict.unit, figure(verdict.bound), verdict.bound_source, verdict.witness.text);
  }
}

void print_whether_all_hold(const std::vector<Verdict>& verdicts) {
  const auto failures = std::count_if(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return !v.holds; });
  fmt::print("\n{} verdicts, {} failed: {}\n", verdicts.size(), failures,
             failures == 0 ? "what was judged holds." : "NOT everything holds.");
}

}  // namespace cutproof::cli
