#include "harness/against.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "model/io/json_number.h"
#include "oracles/oracles.h"
#include "reference_cpu/reference.h"

namespace cutproof::cli {

namespace {

// Rounding of a neighbour distance, in units of u h.
constexpr double kDistanceBand = 64;

constexpr std::array<const char*, 6> kMeasureNames = {"positions",    "velocities", "rotations",
                                                      "rest centers", "masses",     "skin vertices"};
constexpr std::array<const char*, 6> kMeasureUnits = {"h", "h/dt", "h", "h", "1", "h"};

std::size_t at(int64_t index) { return static_cast<std::size_t>(index); }

bool wants_lockstep(AgainstMode mode) { return mode != AgainstMode::shadow; }
bool wants_shadow(AgainstMode mode) { return mode != AgainstMode::lockstep; }

std::vector<int32_t> symmetric_difference(const std::vector<int32_t>& a, const std::vector<int32_t>& b) {
  std::vector<int32_t> result;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result));
  return result;
}

constexpr const char* kSource = "accuracy_and_speed.md §1";

Verdict verdict_of(std::string property, std::string backend, std::string unit = "1", std::string source = kSource) {
  Verdict verdict;
  verdict.property = std::move(property);
  verdict.stage = Stage::step;
  verdict.backend = std::move(backend);
  verdict.unit = std::move(unit);
  verdict.bound_source = std::move(source);
  return verdict;
}

}  // namespace

Against::Against(const Setup& setup, const State& start, const State& loaded, std::string backend, AgainstMode mode)
    : setup_(setup),
      backend_(std::move(backend)),
      mode_(mode),
      position_bound_(oracles::position_bound(setup.body)),
      frame_(loaded.frame),
      before_(loaded) {
  const Verdict form = oracles::well_formed(setup_, loaded);
  if (!form.holds) {
    differ(Stage::step,
           {fmt::format("as loaded: {}", form.witness.text), form.witness.clusters, form.witness.particles});
    broken_ = true;
    return;
  }
  if (wants_shadow(mode)) {
    free_reference_ = reference::make_backend();
    free_reference_->load({setup}, {start});
  }
  if (!wants_lockstep(mode)) return;
  comparison_.emplace(setup_, reference::step);
  reference_ = reference::make_backend();
  // What the backend has made of what it was given.
  if (auto difference = topological_difference(start, loaded, false)) {
    difference->text = fmt::format("as loaded: {}", difference->text);
    differ(Stage::step, *difference);
  }
  LockstepFrame ignored;
  note(position, Stage::step, positions_apart(setup, start, loaded, loaded.alive), ignored.position);
  judge_rest_frames(Stage::step, loaded, ignored);
}

void Against::see(Stage stage, const State& after, bool launched) {
  if (broken_) return;
  const Verdict form = oracles::well_formed(setup_, after);
  if (!form.holds) {
    differ(stage, {form.witness.text, form.witness.clusters, form.witness.particles});
    broken_ = true;
    return;
  }
  if (wants_lockstep(mode_)) see_lockstep(stage, after, launched);
  if (free_reference_) see_shadow(stage, after);
  before_ = after;
  if (stage == Stage::skin) ++frame_;
}

// --- Lockstep -------------------------------------------------------------------------------------------------------

void Against::see_lockstep(Stage stage, const State& after, bool launched) {
  if (stage == Stage::step) {
    lockstep_.push_back({});
    lockstep_.back().frame = frame_;
    compare_step(after, lockstep_.back());
    return;
  }
  LockstepFrame& frame = lockstep_.back();
  reference_->load({setup_}, {before_});
  reference_->run({stage, stage});
  State expected = reference_->snapshot().front();
  const bool due = reference_->report().ran[static_cast<std::size_t>(stage)];
  ++stages_compared_;
  if (launched != due)
    differ(stage, {due ? "the stage was due, but did not run" : "the stage ran, but was not due", {}, {}});
  if (stage == Stage::detect && due) {
    ++detections_compared_;
    adopt_removals_within_band(after, expected, frame);
  }
  const bool sets_are_open = stage == Stage::merge && due && setup_.merge.rule != MergeRule::deterministic;
  auto difference = topological_difference(expected, after, sets_are_open);
  if (!difference && !sets_are_open && expected.clusters.rotation != after.clusters.rotation) {
    const auto [mine, theirs] = std::mismatch(expected.clusters.rotation.begin(), expected.clusters.rotation.end(),
                                              after.clusters.rotation.begin());
    const int32_t cluster = after.clusters.number[at(theirs - after.clusters.rotation.begin())];
    difference = Difference{fmt::format("cluster {} has not the rotation that it inherits", cluster), {cluster}, {}};
  }
  if (difference) differ(stage, *difference);
  // Later stages move nothing, so each of these is zero, and its count would only thin out the step's.
  const Spread moved = positions_apart(setup_, expected, after, before_.alive);
  if (moved.greatest > 0) note(position, stage, moved, frame.position);
  const Spread sped = velocities_apart(setup_, expected, after, setup_.substep_length[at(frame_)], before_.alive);
  if (sped.greatest > 0) note(velocity, stage, sped, frame.velocity);
  if (launched && stage != Stage::detect && stage != Stage::skin) judge_rest_frames(stage, after, frame);
  if (stage == Stage::skin && due && !difference) {
    note(skin, stage, skins_apart(setup_, expected.skin, after.skin), frame.skin);
  }
}

void Against::compare_step(const State& after, LockstepFrame& frame) {
  ++stages_compared_;
  const oracles::StepDifference found = comparison_->compare(before_, after);
  frame.sides_either = found.sides_either;
  frame.sides_taken_otherwise = found.sides_taken_otherwise;
  frame.sensitive_either = found.sensitive_either;
  frame.particles_excluded = found.particles_excluded;
  if (const auto difference = topological_difference(found.expected, after, false)) {
    differ(Stage::step, *difference);
  } else {
    frame.rotations_either = found.rotations_either;
    frame.angle.join(found.angle);
    note(rotation, Stage::step, found.rotation, frame.rotation);
  }
  note(position, Stage::step, found.position, frame.position);
  note(velocity, Stage::step, found.velocity, frame.velocity);
}

// Where backend and reference remove different particles, the oracle says whether each of them lies within its rounding
// band. After that the reference goes on with the backend's choice.
void Against::adopt_removals_within_band(const State& after, State& expected, LockstepFrame& frame) {
  const std::vector<int32_t> either = symmetric_difference(expected.removed, after.removed);
  if (either.empty()) return;
  const Verdict judged = oracles::detection(setup_, before_, after);
  if (judged.holds) {
    frame.removals_either += static_cast<int64_t>(either.size());
  } else {
    ++detection_failures_;
    if (!detection_failure_) {
      detection_failure_ = verdict_of("lockstep: removed particles", backend_, "1", judged.bound_source);
      detection_failure_->frame = frame_;
      detection_failure_->stage = Stage::detect;
      detection_failure_->holds = false;
      detection_failure_->measured = judged.measured;
      detection_failure_->witness = judged.witness;
    }
  }
  expected.removed = after.removed;
  expected.alive = before_.alive;
  for (const int32_t i : after.removed) expected.alive[at(i)] = 0;
}

void Against::judge_rest_frames(Stage stage, const State& after, LockstepFrame& frame) {
  for (int32_t c = 0; c < after.clusters.count(); ++c) {
    largest_cluster_ = std::max(largest_cluster_, after.clusters.size(c));
  }
  const RestFrameSpread apart = rest_frames_apart(setup_, after);
  note(rest_center, stage, apart.center, frame.rest_center);
  note(mass, stage, apart.mass, frame.mass);
}

void Against::differ(Stage stage, const Difference& difference) {
  if (!lockstep_.empty()) ++lockstep_.back().topology_differences;
  ++topology_failures_;
  if (topology_failure_) return;
  topology_failure_ = verdict_of("lockstep: topology", backend_);
  topology_failure_->frame = frame_;
  topology_failure_->stage = stage;
  topology_failure_->holds = false;
  topology_failure_->witness = {difference.clusters, difference.particles, {}, difference.text};
}

double Against::bound_of(Measure which) const {
  switch (which) {
    case velocity:
      return 2 * position_bound_;  // the difference of two positions over dt
    case mass:
      // Each weight carries one rounding, a sum of N positive terms at most N - 1, on both sides; and the state's.
      return 2 * static_cast<double>(largest_cluster_ + 4) * unit_roundoff(before_);
    default:
      return position_bound_;
  }
}

void Against::note(Measure which, Stage stage, const Spread& spread, Spread& of_frame) {
  of_frame.join(spread);
  Track& track = tracks_[which];
  if (spread.count > 0 && (spread.greatest > track.all.greatest || track.all.count == 0)) {
    track.worst_frame = frame_;
    track.worst_stage = stage;
  }
  track.all.join(spread);
  const double bound = bound_of(which);
  if (spread.count == 0 || spread.greatest <= bound) return;
  ++track.failures;
  if (track.failure) return;
  Verdict failure = verdict_of(fmt::format("lockstep: {}", kMeasureNames[which]), backend_, kMeasureUnits[which]);
  failure.frame = frame_;
  failure.stage = stage;
  failure.holds = false;
  failure.measured = spread.greatest;
  failure.bound = bound;
  const bool of_clusters = which == rotation || which == rest_center || which == mass;
  (of_clusters ? failure.witness.clusters : failure.witness.particles) = {spread.where};
  failure.witness.text =
      fmt::format("{} of {} {} are {:.3g} {} from the reference's", kMeasureNames[which],
                  of_clusters ? "cluster" : "particle", spread.where, spread.greatest, kMeasureUnits[which]);
  track.failure = std::move(failure);
}

// --- Shadow ---------------------------------------------------------------------------------------------------------

void Against::see_shadow(Stage stage, const State& after) {
  free_reference_->run({stage, stage});
  const State expected = free_reference_->snapshot().front();
  if (stage == Stage::step) {
    shadow_.push_back({frame_, positions_apart(setup_, expected, after, after.alive)});
  }
  const auto difference = topological_difference(expected, after, false);
  if (!difference) return;

  FirstDifference first{frame_, stage, *difference, {}, 0, false};
  const std::vector<int32_t> either = symmetric_difference(expected.removed, after.removed);
  if (stage == Stage::detect && !either.empty()) {
    first.what.particles = either;
    // Both may be right, each for its own positions.
    first.explained = oracles::detection(setup_, before_, after).holds;
    if (setup_.detect.criterion == Criterion::distance) {
      State present = expected;
      for (const int32_t i : expected.removed) present.alive[at(i)] = 1;
      const double h = setup_.body.grid.spacing;
      double margin = 0;
      for (const int32_t i : either) {
        margin =
            std::max(margin, std::abs(greatest_neighbour_distance(setup_, present, i) / h - setup_.detect.epsilon));
      }
      first.margin = margin;
      // Each end of an edge is off by at most the greatest error, so the edge's length by at most twice that.
      first.reach = 2 * shadow_.back().position.greatest + kDistanceBand * unit_roundoff(after);
      first.explained = first.explained && std::isfinite(first.reach) && margin <= first.reach;
    }
  }
  if (stage == Stage::merge && setup_.merge.rule != MergeRule::deterministic) first.explained = true;
  first_difference_ = std::move(first);
  free_reference_.reset();
}

// --- What came out --------------------------------------------------------------------------------------------------

std::vector<Verdict> Against::verdicts() const {
  std::vector<Verdict> verdicts;
  const auto counted = [&](const char* property, const std::optional<Verdict>& failure, int64_t failures,
                           int64_t checked) {
    Verdict verdict = failure ? *failure : verdict_of(property, backend_);
    if (failure && failures > 1)
      verdict.witness.text += fmt::format(" ({} stages differ, this is the first)", failures);
    verdict.measured = static_cast<double>(failures);
    verdict.checked = checked;
    verdicts.push_back(std::move(verdict));
  };
  if (wants_lockstep(mode_) || topology_failure_) {
    counted("lockstep: topology", topology_failure_, topology_failures_, stages_compared_);
  }
  if (wants_lockstep(mode_)) {
    counted("lockstep: removed particles", detection_failure_, detection_failures_, detections_compared_);
    for (const Measure which : {position, velocity, rotation, rest_center, mass, skin}) {
      const Track& track = tracks_[which];
      Verdict verdict = verdict_of(fmt::format("lockstep: {}", kMeasureNames[which]), backend_, kMeasureUnits[which]);
      verdict.frame = track.worst_frame;
      verdict.stage = track.worst_stage;
      verdict.measured = track.all.greatest;
      verdict.bound = bound_of(which);
      if (track.failure) {
        verdict = *track.failure;
        if (track.failures > 1) {
          verdict.witness.text += fmt::format(
              " ({} frames or stages are beyond the bound, this is the first; the worst, "
              "{:.3g} {}, is in frame {} after {})",
              track.failures, track.all.greatest, kMeasureUnits[which], track.worst_frame, name_of(track.worst_stage));
        }
      }
      verdict.checked = track.all.count;
      verdicts.push_back(std::move(verdict));
    }
  }
  if (wants_shadow(mode_)) {
    Verdict verdict = verdict_of("shadow: decisions", backend_, "h");
    verdict.checked = static_cast<int64_t>(shadow_.size());
    if (first_difference_) {
      const FirstDifference& first = *first_difference_;
      verdict.frame = first.frame;
      verdict.stage = first.stage;
      verdict.holds = first.explained;
      verdict.measured = first.margin.value_or(0);
      verdict.bound = first.reach;
      if (!verdict.holds) verdict.witness = {first.what.clusters, first.what.particles, {}, first.what.text};
    }
    verdicts.push_back(std::move(verdict));
  }
  return verdicts;
}

bool Against::holds() const {
  const auto all = verdicts();
  return std::all_of(all.begin(), all.end(), [](const Verdict& verdict) { return verdict.holds; });
}

nlohmann::json Against::to_json() const {
  using nlohmann::json;
  constexpr std::array<const char*, 3> kModes = {"lockstep", "shadow", "both"};
  json result = {{"reference", "reference"},
                 {"mode", kModes[static_cast<std::size_t>(mode_)]},
                 {"position_bound", position_bound_},
                 {"holds", holds()}};
  if (wants_lockstep(mode_)) {
    json frames = json::object();
    const auto column = [&](const char* name, auto value) {
      json values = json::array();
      for (const LockstepFrame& frame : lockstep_) values.push_back(value(frame));
      frames[name] = std::move(values);
    };
    const auto spread = [&](const std::string& name, Spread LockstepFrame::*member) {
      column((name + "_max").c_str(), [&](const LockstepFrame& f) { return json_number((f.*member).greatest); });
      column((name + "_rms").c_str(), [&](const LockstepFrame& f) { return json_number((f.*member).rms()); });
    };
    column("frame", [](const LockstepFrame& f) { return f.frame; });
    spread("position", &LockstepFrame::position);
    spread("velocity", &LockstepFrame::velocity);
    spread("angle", &LockstepFrame::angle);
    spread("rotation", &LockstepFrame::rotation);
    spread("rest_center", &LockstepFrame::rest_center);
    spread("mass", &LockstepFrame::mass);
    spread("skin", &LockstepFrame::skin);
    column("topology_differences", [](const LockstepFrame& f) { return f.topology_differences; });
    column("removals_either", [](const LockstepFrame& f) { return f.removals_either; });
    column("sides_either", [](const LockstepFrame& f) { return f.sides_either; });
    column("sides_taken_otherwise", [](const LockstepFrame& f) { return f.sides_taken_otherwise; });
    column("rotations_either", [](const LockstepFrame& f) { return f.rotations_either; });
    column("sensitive_either", [](const LockstepFrame& f) { return f.sensitive_either; });
    column("particles_excluded", [](const LockstepFrame& f) { return f.particles_excluded; });
    json greatest = json::object();
    for (const Measure which : {position, velocity, rotation, rest_center, mass, skin}) {
      constexpr std::array<const char*, kMeasures> kKeys = {"position",    "velocity", "rotation",
                                                            "rest_center", "mass",     "skin"};
      const Track& track = tracks_[which];
      greatest[kKeys[which]] = {{"max", json_number(track.all.greatest)},
                                {"rms", json_number(track.all.rms())},
                                {"frame", track.worst_frame},
                                {"stage", name_of(track.worst_stage)}};
    }
    result["lockstep"] = {{"frames", std::move(frames)}, {"greatest", std::move(greatest)}};
  }
  if (wants_shadow(mode_)) {
    json frames = {{"frame", json::array()}, {"position_max", json::array()}, {"position_rms", json::array()}};
    for (const ShadowFrame& frame : shadow_) {
      frames["frame"].push_back(frame.frame);
      frames["position_max"].push_back(json_number(frame.position.greatest));
      frames["position_rms"].push_back(json_number(frame.position.rms()));
    }
    json first = nullptr;
    if (first_difference_) {
      first = {{"frame", first_difference_->frame},
               {"stage", name_of(first_difference_->stage)},
               {"text", first_difference_->what.text},
               {"particles", first_difference_->what.particles},
               {"clusters", first_difference_->what.clusters},
               {"margin", nullptr},
               {"reach", json_number(first_difference_->reach)},
               {"explained", first_difference_->explained}};
      if (first_difference_->margin) first["margin"] = json_number(*first_difference_->margin);
    }
    result["shadow"] = {{"frames", std::move(frames)}, {"first_difference", std::move(first)}};
  }
  return result;
}

void print_against(const Against& against) {
  if (wants_lockstep(against.mode())) {
    Spread position, velocity, rotation, rest_center, mass, skin, angle;
    int64_t removals = 0, sides = 0, otherwise = 0, rotations = 0, sensitive = 0;
    for (const LockstepFrame& f : against.lockstep()) {
      position.join(f.position), velocity.join(f.velocity), rotation.join(f.rotation), angle.join(f.angle);
      rest_center.join(f.rest_center), mass.join(f.mass), skin.join(f.skin);
      removals += f.removals_either, sides += f.sides_either, otherwise += f.sides_taken_otherwise;
      rotations += f.rotations_either, sensitive += f.sensitive_either;
    }
    fmt::print("\nagainst the reference, lockstep, {} frames: errors of one frame\n", against.lockstep().size());
    fmt::print("{:<14} {:>11} {:>11} {:<5}\n", "", "greatest", "RMS", "unit");
    const auto row = [](const char* name, const Spread& spread, const char* unit) {
      if (spread.count > 0) {
        fmt::print("{:<14} {:>11.3g} {:>11.3g} {:<5}\n", name, spread.greatest, spread.rms(), unit);
      }
    };
    row("positions", position, "h");
    row("velocities", velocity, "h/dt");
    row("rotations", angle, "rad");
    row("", rotation, "h");
    row("rest centers", rest_center, "h");
    row("masses", mass, "1");
    row("skin vertices", skin, "h");
    fmt::print("either, so not measured:\n");
    fmt::print("{:>8} removals within the rounding band\n", removals);
    fmt::print("{:>8} particles in the blade's plane; {} of them on the other side in the end\n", sides, otherwise);
    fmt::print("{:>8} rotations that are not unique\n", rotations);
    fmt::print("{:>8} particles that one rounding carries beyond the bound\n", sensitive);
  }
  if (wants_shadow(against.mode())) {
    fmt::print("\nagainst the reference, shadow: both run freely\n");
    if (!against.shadow().empty()) {
      const ShadowFrame& last = against.shadow().back();
      fmt::print("positions in frame {}: greatest {:.3g} h, RMS {:.3g} h\n", last.frame, last.position.greatest,
                 last.position.rms());
    }
    if (against.first_difference()) {
      const FirstDifference& first = *against.first_difference();
      fmt::print("first difference: frame {}, {}: {}\n", first.frame, name_of(first.stage), first.what.text);
      if (first.margin) {
        fmt::print("  margin {:.3g} h; positions are so far apart that up to {:.3g} h is {}\n", *first.margin,
                   first.reach, first.explained ? "explained" : "explained, and this is not");
      }
    } else {
      fmt::print("no decision differs in {} frames\n", against.shadow().size());
    }
  }
  fmt::print("\n");
  for (const Verdict& verdict : against.verdicts()) {
    fmt::print("{:<28} {:<8} {:.4g} {}, bound {:.4g} (frame {}, {})\n", verdict.property,
               !verdict.holds         ? "FAILS"
               : verdict.checked == 0 ? "vacuous"
                                      : "holds",
               verdict.measured, verdict.unit, verdict.bound, verdict.frame, name_of(verdict.stage));
    if (!verdict.holds) fmt::print("  {}\n", verdict.witness.text);
  }
}

}  // namespace cutproof::cli
