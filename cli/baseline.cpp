#include "cli/baseline.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "cli/findings.h"
#include "cli/screen.h"
#include "model/counted.h"
#include "model/io/json_reader.h"
#include "model/io/limits.h"
#include "model/printable.h"
#include "oracles/property_count.h"
#include "report/field.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;
using report::Field;

constexpr const char* kRemedy = "give what --json has written of the same command";
// Times of one run differ by less on a machine that has nothing else to do.
constexpr double kSlower = 1.25;

struct Judged {
  std::string name;
  int64_t looked = 0, failed = 0;
  bool is_of_the_judging = false;
};

// In the order in which they first appear.
class AllJudged {
 public:
  void add(const std::string& name, bool looked, bool failed, bool is_of_the_judging) {
    const auto [place, is_new] = places_.try_emplace(name, all_.size());
    if (is_new) all_.push_back({name, 0, 0, is_of_the_judging});
    Judged& one = all_[place->second];
    one.looked += looked;
    one.failed += failed;
  }
  void add_verdicts(const Field& verdicts) {
    verdicts.each([&](const Field& verdict) {
      const std::string property = verdict["property"].text();
      const bool holds = verdict["holds"].flag(), expected = verdict["expected_failure"].flag_or(false);
      const Field stage = verdict["stage"];
      add(case_name(property, stage.is_nothing() ? "" : stage.text()), verdict["checked"].count() > 0 || !holds,
          !holds && !expected, oracles::is_of_the_judging(property));
    });
  }
  const std::vector<Judged>& all() const { return all_; }
  const Judged* find(const std::string& name) const {
    const auto found = places_.find(name);
    return found == places_.end() ? nullptr : &all_[found->second];
  }

 private:
  std::map<std::string, std::size_t> places_;
  std::vector<Judged> all_;
};

AllJudged judged_in(const Field& document) {
  AllJudged judged;
  if (const Field verdicts = document["verdicts"]; verdicts.is_there()) judged.add_verdicts(verdicts);
  if (const Field against = document["against"]; against.is_there()) judged.add_verdicts(against["verdicts"]);
  if (const Field errors = document["errors"]; errors.is_there()) {
    const Field conservation = errors["conservation"];
    if (!conservation.is_nothing()) judged.add("conservation", true, !conservation["holds"].flag(), false);
  }
  return judged;
}

// Of those that were timed, in the mean over the frames in which they ran [s].
std::map<std::string, double> stage_times(const Field& document) {
  std::map<std::string, double> seconds;
  std::map<std::string, int64_t> frames;
  const Field all = document["frames"];
  if (!all.is_there()) return seconds;
  all.each([&](const Field& frame) {
    const Field stages = frame["seconds"];
    for (const Stage stage : kStages) {
      const std::string name(name_of(stage));
      if (!stages.is_there() || !stages[name.c_str()].is_there()) continue;
      seconds[name] += stages[name.c_str()].number();
      ++frames[name];
    }
  });
  for (auto& [name, sum] : seconds) sum /= static_cast<double>(frames.at(name));
  return seconds;
}

std::size_t frames_in(const Field& document) {
  const Field frames = document["frames"], run = document["run"];
  return frames.is_there() ? frames.length() : run.is_there() ? static_cast<std::size_t>(run["frames"].count()) : 0;
}

json to_json(const SinceBaseline& since) {
  json known = json::array(), slower = json::array();
  for (const auto& [name, failed, then] : since.known)
    known.push_back({{"name", name}, {"failed", failed}, {"failed_then", then}});
  for (const auto& [stage, seconds, then] : since.slower)
    slower.push_back({{"stage", stage}, {"seconds_per_frame", seconds}, {"seconds_per_frame_then", then}});
  return {{"source", since.file},           {"new", since.fresh}, {"known", known}, {"mended", since.mended},
          {"not_judged", since.not_judged}, {"slower", slower}};
}

std::string in_words(const SinceBaseline::Known& known) {
  return fmt::format("{} ({}, {} in the baseline)", known.name, counted(known.failed, "verdict", "verdicts"),
                     known.failed_then);
}
std::string in_words(const SinceBaseline::Slower& slower) {
  return fmt::format("{}, {:.3g} ms a frame instead of {:.3g}", slower.stage, 1e3 * slower.seconds,
                     1e3 * slower.seconds_then);
}
template <class Entry>
std::string in_words(const std::vector<Entry>& entries) {
  std::vector<std::string> words;
  for (const Entry& one : entries) words.push_back(in_words(one));
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace

void add_baseline(CLI::App& command, std::string& path) {
  command
      .add_option("--baseline", path, "an earlier --json result of the same command; its failures do not count again")
      ->type_name("F");
}

std::optional<Baseline> read_baseline(const std::string& path, const std::vector<std::string>& formats,
                                      const std::string& scene) {
  if (path.empty()) return std::nullopt;
  Baseline baseline = {path, io::read_json(path, io::kResultsLimits, kRemedy)};
  const Field document = {&baseline.document, path, "", kRemedy};
  if (!baseline.document.is_object()) document.refuse("this is no result of cutproof");
  const std::string format = document["format"].text();
  if (std::find(formats.begin(), formats.end(), format) == formats.end())
    document["format"].refuse(
        fmt::format("this is '{}', and not '{}'", printable(format), fmt::join(formats, "' or '")));
  if (const Field of = document["scene"]; !scene.empty() && of.text() != scene)
    of.refuse(fmt::format("this is of scene '{}', and not of '{}'", printable(of.text()), printable(scene)));
  if (const Field checked = document["checked"];
      checked.is_there() && !checked.flag() && !document["against"].is_there())
    checked.refuse("nothing was judged");
  static_cast<void>(judged_in(document));
  return baseline;
}

bool SinceBaseline::is_known(const std::string& name) const {
  return std::any_of(known.begin(), known.end(), [&](const Known& one) { return one.name == name; });
}
bool SinceBaseline::is_known(const Verdict& verdict, bool in_stages) const {
  return is_known(case_name(verdict.property, in_stages ? name_of(verdict.stage) : ""));
}

std::optional<SinceBaseline> since_baseline(const std::optional<Baseline>& baseline, json& document) {
  if (!baseline) return std::nullopt;
  const std::string here = "this result";
  const Field then_field = {&baseline->document, baseline->file, "", kRemedy},
              now_field = {&document, here, "", kRemedy};
  const AllJudged then = judged_in(then_field), now = judged_in(now_field);
  SinceBaseline since;
  since.file = baseline->file;
  for (const Judged& one : now.all()) {
    if (one.failed == 0) continue;
    const Judged* const before = then.find(one.name);
    if (before != nullptr && before->failed > 0 && !one.is_of_the_judging) {
      since.known.push_back({one.name, one.failed, before->failed});
    } else {
      since.fresh.push_back(one.name);
    }
  }
  const bool is_as_long = frames_in(now_field) >= frames_in(then_field);
  for (const Judged& before : then.all()) {
    if (before.failed == 0) continue;
    const Judged* const one = now.find(before.name);
    if (one != nullptr && one->failed > 0) continue;
    (one != nullptr && one->looked > 0 && is_as_long ? since.mended : since.not_judged).push_back(before.name);
  }
  const auto times_then = stage_times(then_field);
  for (const auto& [stage, seconds] : stage_times(now_field)) {
    const auto before = times_then.find(stage);
    if (before != times_then.end() && before->second > 0 && seconds >= kSlower * before->second)
      since.slower.push_back({stage, seconds, before->second});
  }
  document["baseline"] = to_json(since);
  return since;
}

void excuse_known(const SinceBaseline& since, std::vector<io::JunitCase>& cases) {
  for (io::JunitCase& one : cases) {
    if (one.outcome != io::JunitOutcome::failed || !since.is_known(one.name)) continue;
    one.outcome = io::JunitOutcome::skipped;
    one.message = "fails as in the baseline: " + one.message;
  }
}

void add_baseline_to(ForGitHub& said, const SinceBaseline& since) {
  for (const SinceBaseline::Known& one : since.known) said.known.push_back(one.name);
  if (!since.mended.empty())
    said.notes.push_back(fmt::format("Mended since the baseline: {}", fmt::join(since.mended, ", ")));
  if (!since.slower.empty()) said.notes.push_back("Slower than in the baseline: " + in_words(since.slower));
}

void print_since(const SinceBaseline& since) {
  say("\n");
  if (!since.fresh.empty()) insist("{}: {}\n", failing("new since the baseline"), fmt::join(since.fresh, ", "));
  if (!since.known.empty()) insist("{}: {}\n", unsettled("fails as in the baseline"), in_words(since.known));
  if (!since.mended.empty()) say("{}: {}\n", holding("mended since the baseline"), fmt::join(since.mended, ", "));
  if (!since.not_judged.empty())
    say("{}: {}\n", unsettled("failed in the baseline, and was not judged as far"), fmt::join(since.not_judged, ", "));
  if (!since.slower.empty()) say("{}: {}\n", unsettled("slower than in the baseline"), in_words(since.slower));
  insist("beside {}: {}\n", since.file,
         since.fresh.empty() ? holding("nothing new fails.") : failing("something new fails."));
}

}  // namespace cutproof::cli
