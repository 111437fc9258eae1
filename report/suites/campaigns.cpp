#include "report/suites/suites.h"

namespace cutproof::report {

namespace {

constexpr const char* kParts[] = {"generating", "simulating", "reference", "judging", "waiting"};

// Of the time of all threads.
std::string share_of(const char* part, const Field& row) {
  double sum = 0;
  for (const char* const each : kParts) sum += row["thread_seconds"][each].number();
  return sum > 0 ? fmt::format("{:.0f} %", 100 * row["thread_seconds"][part].number() / sum) : "";
}

RowColumns columns_of_campaigns() {
  RowColumns columns = {{"campaign", "{campaign}"},
                        {"backend", "{backend}"},
                        {"devices", [](const Field& row) { return std::to_string(row["devices"].length()); }},
                        {"particles", "{mean_particles:.0f}"},
                        {"batch", "{batch}"},
                        {"threads", "{threads}"},
                        {"cases", "{cases}", Shown::page},
                        {"cases/s", "{cases_per_second:.4g}"},
                        {"of reference", "{of_reference:.2f}"}};
  for (const char* const part : kParts) {
    columns.emplace_back(
        part, [part](const Field& row) { return share_of(part, row); }, Shown::terminal);
  }
  columns.insert(columns.end(), {{"verdicts", "{error/verdicts}", Shown::page},
                                 {"verdicts a case",
                                  [](const Field& row) {
                                    const auto cases = static_cast<double>(row["cases"].count());
                                    return cases > 0 ? fmt::format("{:.1f}", row["error"]["verdicts"].number() / cases)
                                                     : "";
                                  },
                                  Shown::terminal},
                                 {"violations", "{error/violations}"},
                                 {"inconclusive", "{error/inconclusive} of {error/checked}"},
                                 {"positions", "{error/positions}", Shown::page},
                                 {"max [h]", "{error/greatest_h:.2g}"}});
  return columns;
}

void add_campaigns(Sheet& sheet, const Field& document) {
  Stack stack = {"Where the time of a case goes",
                 "Time of all threads. Simulating is what they wait for a device, too; reference: its stages, with "
                 "which the backend's are compared.",
                 "ms",
                 {},
                 {}};
  for (const char* const part : kParts) stack.parts.push_back({part, {}});
  const RowColumns columns = columns_of_campaigns();
  Grid grid = grid_of("Campaigns",
                      "What was compared meanwhile stands beside each rate: verdicts, positions after a step beside "
                      "the reference's and the greatest distance of one, and what stayed inconclusive within rounding.",
                      columns);
  document["rows"].each([&](const Field& row) {
    const int64_t cases = row["cases"].count();
    stack.labels.push_back(row["campaign"].text() + ", " + row["backend"].text());
    for (Series& part : stack.parts) {
      const std::optional<double> seconds = row["thread_seconds"][part.name.c_str()].number_or_null();
      part.values.push_back(cases > 0 ? times(seconds, 1e3 / static_cast<double>(cases)) : std::nullopt);
    }
    const bool is_violated = row["error"]["violations"].count() > 0;
    if (is_violated) sheet.holds = false;
    add_row(grid, columns, row, is_violated ? "bad" : "");
  });
  sheet.summary = "Cases that random campaigns judge in a second, on " + document["processor"].text() + ".";
  sheet.pieces.emplace_back(std::move(stack));
  sheet.pieces.emplace_back(std::move(grid));
}

}  // namespace

const Suite kCampaignsSuite = {"campaigns", "rows", columns_of_campaigns, add_campaigns};

}  // namespace cutproof::report
