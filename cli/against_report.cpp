#include "cli/against_report.h"

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <utility>

#include "cli/screen.h"
#include "cli/terminal.h"
#include "model/io/json_number.h"

namespace cutproof::cli {

using harness::Against;
using harness::FirstDifference;
using harness::FreeFrame;
using harness::LockstepFrame;
using nlohmann::json;
using oracles::ErrorNorm;
using oracles::Measure;
using oracles::Undecidable;

json worst_json(const harness::Lockstep& lockstep) {
  json result = json::object();
  for (std::size_t m = 0; m < oracles::kMeasures.size(); ++m) {
    const harness::LockstepWorst& worst = lockstep.worst(static_cast<Measure>(m));
    result[std::string(oracles::kMeasures[m].key)] = {{"max", json_number(worst.norm.max)},
                                                      {"rms", json_number(worst.norm.rms())},
                                                      {"frame", worst.frame},
                                                      {"stage", name_of(worst.stage)}};
  }
  return result;
}

namespace {

// [frames] what `value` says of each.
template <class Frame, class Value>
json column_of(const std::vector<Frame>& frames, Value value) {
  json values = json::array();
  for (const Frame& frame : frames) values.push_back(value(frame));
  return values;
}

json lockstep_json(const harness::Lockstep& lockstep) {
  json frames = json::object();
  const auto column = [&](const std::string& name, auto value) { frames[name] = column_of(lockstep.frames(), value); };
  const auto norm = [&](const std::string& name, auto norm_of) {
    column(name + "_max", [&](const LockstepFrame& f) { return json_number(norm_of(f).max); });
    column(name + "_rms", [&](const LockstepFrame& f) { return json_number(norm_of(f).rms()); });
  };
  column("frame", [](const LockstepFrame& f) { return f.frame; });
  norm("angle", [](const LockstepFrame& f) { return f.angle; });
  for (std::size_t m = 0; m < oracles::kMeasures.size(); ++m) {
    norm(std::string(oracles::kMeasures[m].key), [m](const LockstepFrame& f) { return f.errors[m]; });
  }
  column("topology_differences", [](const LockstepFrame& f) { return f.topology_differences; });
  column("removals_not_compared", [](const LockstepFrame& f) { return f.undecidable.removals; });
  column("decisions_taken_otherwise", [](const LockstepFrame& f) { return f.undecidable.otherwise; });
  column("positions_not_compared", [](const LockstepFrame& f) { return f.undecidable.positions; });
  column("rotations_not_compared", [](const LockstepFrame& f) { return f.undecidable.rotations; });
  column("positions_inconclusive", [](const LockstepFrame& f) { return f.undecidable.inconclusive; });
  return {{"frames", std::move(frames)}, {"greatest", worst_json(lockstep)}};
}

json free_running_json(const harness::FreeRunning& run) {
  const auto column = [&](auto value) { return column_of(run.frames(), value); };
  json frames = {{"frame", column([](const FreeFrame& f) { return f.frame; })},
                 {"position_max", column([](const FreeFrame& f) { return json_number(f.position.max); })},
                 {"position_rms", column([](const FreeFrame& f) { return json_number(f.position.rms()); })}};
  json first = nullptr;
  if (const auto& found = run.first_difference()) {
    first = {{"frame", found->frame},
             {"stage", name_of(found->stage)},
             {"text", found->what.text},
             {"particles", found->what.particles},
             {"clusters", found->what.clusters},
             {"margin", json_number(found->margin)},
             {"reach", json_number(found->reach)},
             {"explained", found->explained}};
  }
  return {{"frames", std::move(frames)}, {"first_difference", std::move(first)}};
}

void print_lockstep(const harness::Lockstep& lockstep) {
  ErrorNorm angle;
  Undecidable undecidable;
  for (const LockstepFrame& frame : lockstep.frames()) {
    angle.join(frame.angle);
    undecidable.join(frame.undecidable);
  }
  say("\nagainst the reference, lockstep, {} frames: errors of one frame\n", lockstep.frames().size());
  say("{:<14} {:>11} {:>11} {}\n", "", "greatest", "RMS", "unit");
  const auto row = [](std::string_view name, const ErrorNorm& norm, std::string_view unit) {
    if (norm.count > 0)
      say("{:<14} {:>11.3g} {:>11.3g} {}\n", name, norm.max, norm.rms(), unit == "1" ? "relative" : unit);
  };
  for (std::size_t m = 0; m < oracles::kMeasures.size(); ++m) {
    const auto measure = static_cast<Measure>(m);
    const bool rotations = measure == Measure::rotation;
    if (rotations) row(oracles::kMeasures[m].name, angle, "rad");
    row(rotations ? "" : oracles::kMeasures[m].name, lockstep.worst(measure).norm, oracles::kMeasures[m].unit);
  }
  say("inconclusive within rounding:\n");
  say("{:>8} removals within the rounding band\n", undecidable.removals);
  say("{:>8} decisions of steps that differ from the reference's\n", undecidable.otherwise);
  say("{:>8} positions that rounding carries beyond the bound: not measured, but judged\n", undecidable.positions);
  say("{:>8} rotations, the same\n", undecidable.rotations);
  say("{:>8} positions that rounding carries so far that they are not judged sharply\n", undecidable.inconclusive);
}

void print_free_running(const harness::FreeRunning& run) {
  say("\nagainst the reference, free-running: both run freely\n");
  if (!run.frames().empty()) {
    const FreeFrame& last = run.frames().back();
    say("positions in frame {}: greatest {:.3g} h, RMS {:.3g} h\n", last.frame, last.position.max, last.position.rms());
  }
  if (!run.first_difference()) {
    say("no decision differs in {} frames\n", run.frames().size());
    return;
  }
  const FirstDifference& first = *run.first_difference();
  say("first difference: frame {}, {}: {}\n", first.frame, name_of(first.stage), first.what.text);
  if (first.margin) {
    say("  margin {:.3g} h; positions are so far apart that up to {:.3g} h is {}\n", *first.margin, first.reach,
        first.explained ? "explained" : "explained, and this is not");
  }
}

}  // namespace

json to_json(const Against& against, const Setup& setup) {
  const char* const mode = !against.free_running ? "lockstep" : !against.lockstep ? "free-running" : "both";
  json result = {{"reference", "reference"},
                 {"mode", mode},
                 {"position_bound", oracles::position_bound(setup.body)},
                 {"holds", against.holds()}};
  if (against.lockstep) result["lockstep"] = lockstep_json(*against.lockstep);
  if (against.free_running) result["free_running"] = free_running_json(*against.free_running);
  return result;
}

void print_against(const Against& against, const std::string& again) {
  if (against.lockstep) print_lockstep(*against.lockstep);
  if (against.free_running) print_free_running(*against.free_running);
  print_verdicts(against.verdicts(), Shown{again});
}

}  // namespace cutproof::cli
