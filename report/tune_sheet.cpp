#include <filesystem>

#include "model/io/columns.h"
#include "report/document_fields.h"

namespace cutproof::report {

namespace {

std::string configuration(const Field& trial) {
  std::string text =
      fmt::format("{} × {}, {}", trial["substeps"].count(), trial["iterations"].count(), trial["acceleration"].text());
  if (const std::string more = trial["differences"].text(); !more.empty()) text += ", " + more;
  return text;
}

struct Outcome {
  const char *word, *name;  // in the document, and on the page
};
constexpr Outcome kOutcomes[] = {
    {"within", "within the tolerance"},      {"over", "over the tolerance"},
    {"topology", "another number of parts"}, {"schedule", "another number of frames"},
    {"refused", "cannot be built"},          {"more_expensive", "given up as more expensive"}};

}  // namespace

Sheet tune_sheet(const Field& document) {
  Sheet sheet;
  sheet.kind = "tuning";
  sheet.title = std::filesystem::path(document["scene"].text()).stem().string();
  add_measurement(sheet, document);
  const double tolerance = document["tolerance_h"].number();
  const Field found = document["found"], trials = document["trials"];
  const bool has_found = !found.is_nothing();
  const std::size_t count = trials.length();
  const std::size_t answer = has_found ? static_cast<std::size_t>(found["trial"].count()) : count;
  if (has_found && answer >= count) found["trial"].refuse("there is no such trial");
  Chart chart;
  chart.title = "Error against cost";
  chart.words =
      "Each point is a configuration, substeps × iterations, that was timed. Left is cheaper, below is nearer to the "
      "reference solution. The thin line joins the best: no other configuration is both cheaper and nearer.";
  chart.x = {"time of a frame", "ms", true};
  chart.y = {"greatest RMS distance", "h", true};
  std::vector<Curve> curves;
  for (const Outcome& outcome : kOutcomes) curves.push_back({outcome.name, Look::dots, {}});
  std::vector<Dot> timed;
  Grid grid;
  grid.title = "Every configuration that was tried";
  grid.words =
      "In the order in which they were tried; the first is the scene as it was given. Without a time: it was "
      "given up before its end.";
  grid.columns = {{"configuration: substeps × iterations, acceleration"},
                  {"outcome"},
                  {"ms a frame", true},
                  {"RMS [h]", true},
                  {"greatest [h]", true},
                  {"removed otherwise", true},
                  {"why"}};
  grid.filter = 1;
  Dot chosen, given;
  for (std::size_t k = 0; k < count; ++k) {
    const Field trial = trials.at(k);
    const std::string word = trial["outcome"].text();
    std::size_t which = 0;
    while (which < std::size(kOutcomes) && word != kOutcomes[which].word) ++which;
    if (which == std::size(kOutcomes)) trial["outcome"].refuse("'" + word + "' is no outcome of a trial");
    const std::optional<double> seconds = seconds_of(trial["seconds_per_frame"]);
    const std::optional<double> rms = trial["rms_h"].number_or_null(), most = trial["max_h"].number_or_null();
    const std::string what = configuration(trial);
    Dot dot = {seconds ? std::optional(1e3 * *seconds) : std::nullopt, rms, what};
    if (k == answer) chosen = dot;
    if (k == 0) given = dot;
    timed.push_back(dot);
    curves[which].dots.push_back(std::move(dot));
    const std::string otherwise =
        trial["removed_otherwise"].is_nothing() ? "–" : io::grouped(trial["removed_otherwise"].count());
    grid.rows.push_back({{what + (k == answer ? " (the answer)"
                                  : k == 0    ? " (as given)"
                                              : ""),
                          kOutcomes[which].name, figure_text(seconds, 1e3), figure_text(rms), figure_text(most),
                          otherwise, trial["why"].text()},
                         k == answer ? "good" : ""});
  }
  for (Curve& curve : curves) {
    if (!curve.dots.empty()) chart.curves.push_back(std::move(curve));
  }
  if (given.x) chart.curves.push_back({"the scene as given", Look::dots, {given}});
  if (has_found) chart.curves.push_back({"the answer", Look::dots, {chosen}});
  chart.curves.push_back(front_of(timed, "the best"));
  add_tolerance(chart, timed, tolerance);
  if (has_found) {
    sheet.holds = sheet.badge != "incomplete";
    if (*sheet.holds) sheet.badge = "found";
    const Field verified = found["verified"];
    const double cheaper = found["times_cheaper"].number();
    sheet.summary = fmt::format(
        "The cheapest configuration of {} within {:.4g} h is {}: {} ms a frame, {}. Verified: RMS {} h, greatest {} h, "
        "and {} verdicts hold.",
        sheet.title, tolerance, chosen.text, figure_text(seconds_of(found["seconds_per_frame"]), 1e3),
        answer == 0    ? std::string("which is the scene as it was given")
        : cheaper >= 1 ? fmt::format("{:.2f} times cheaper than as given", cheaper)
                       : fmt::format("{:.2f} times as expensive as given, which is not within", 1 / cheaper),
        figure_text(verified["rms_h"].number_or_null()), figure_text(verified["max_h"].number_or_null()),
        io::grouped(found["verdicts"].count()));
  } else {
    sheet.holds = false;
    if (sheet.badge != "incomplete") sheet.badge = "nothing found";
    sheet.summary = fmt::format(
        "Of {} configurations of {} that were tried none is known to be within {:.4g} h of the "
        "reference solution.",
        io::grouped(static_cast<long long>(count)), sheet.title, tolerance);
  }
  if (const Field reference = document["reference"]; !reference.is_nothing()) {
    const std::string kind = reference["kind"].text();
    sheet.notes.push_back(
        kind == "limit" ? "The reference solution is the limit of short time steps."
                        : "The reference solution is the scene's own substeps, each solved until it is converged.");
    if (const Field levels = reference["levels"]; levels.length() > 0) {
      if (const Field solved = levels.at(levels.length() - 1)["solved"]; solved.is_there()) {
        const int64_t iterated = solved["by_iteration"].count(), unsolved = solved["unsolved"].count();
        sheet.notes.push_back(fmt::format(
            "In the end each of its {} substeps was solved without the reference's step{}.",
            io::grouped(solved["substeps"].count()),
            iterated == 0 ? ""
                          : fmt::format(", {} of them by iterations of their own, and {} of these not to their end",
                                        io::grouped(iterated), io::grouped(unsolved))));
      }
    }
    if (const std::string known = reference["known_text"].text(); !known.empty())
      sheet.notes.push_back("It is " + known + ".");
  }
  document["left"].each([&](const Field& left) {
    const Field trial = left["trial"];
    const auto k = static_cast<std::size_t>(trial.count());
    if (k >= count) trial.refuse("there is no such trial");
    sheet.notes.push_back(
        fmt::format("{} would be cheaper, and is not taken: {}.", configuration(trials.at(k)), left["why"].text()));
  });
  if (count > 0) sheet.pieces.emplace_back(std::move(chart));
  if (has_found) {
    Chart frames;
    frames.title = "Error over time";
    frames.words = "Distance from the reference solution, RMS over all particles, as given and of the answer.";
    frames.x = {"frame", "", false};
    frames.y = {"RMS distance", "h", true};
    const auto add = [&](const Field& trial, const std::string& name) {
      Curve curve = {name, Look::joined, {}};
      const Field values = trial["rms_h_by_frame"];
      for (std::size_t k = 0; k < values.length(); ++k)
        curve.dots.push_back(
            {static_cast<double>(k), values.at(k).number_or_null(), fmt::format("{}, frame {}", name, k)});
      frames.curves.push_back(std::move(curve));
    };
    add(trials.at(0), "as given");
    if (answer != 0) add(trials.at(answer), "the answer");
    sheet.pieces.emplace_back(std::move(frames));
  }
  if (const Field front = document["front"]; front.length() > 0) {
    Grid best;
    best.title = "The cheapest, by tolerance";
    best.words = "Of all that were carried to their end; what is not known of the reference solution counts.";
    best.columns = {{"within [h]", true}, {"configuration"}, {"ms a frame", true},  {"least to most", true},
                    {"of given", true},   {"RMS [h]", true}, {"greatest [h]", true}};
    const std::optional<double> of_given = seconds_of(trials.at(0)["seconds_per_frame"]);
    front.each([&](const Field& point) {
      const std::string within = fmt::format("{:g}", point["tolerance_h"].number());
      const Field which = point["trial"];
      if (which.is_nothing()) {
        best.rows.push_back({{within, "nothing that was tried", "", "", "", "", ""}, ""});
        return;
      }
      const auto k = static_cast<std::size_t>(which.count());
      if (k >= count) which.refuse("there is no such trial");
      const Field trial = trials.at(k), times = trial["seconds_per_frame"];
      const std::optional<double> seconds = seconds_of(times);
      best.rows.push_back(
          {{within, configuration(trial), figure_text(seconds, 1e3),
            figure_text(seconds_of(times, "min"), 1e3) + " to " + figure_text(seconds_of(times, "max"), 1e3),
            seconds && of_given ? figure_text(*seconds / *of_given) : "–", figure_text(trial["rms_h"].number_or_null()),
            figure_text(trial["max_h"].number_or_null())},
           k == answer ? "good" : ""});
    });
    sheet.pieces.emplace_back(std::move(best));
  }
  sheet.pieces.emplace_back(std::move(grid));
  return sheet;
}

}  // namespace cutproof::report
