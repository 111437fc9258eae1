#include "harness/lockstep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "harness/reference_stages.h"
#include "model/at.h"
#include "oracles/oracles.h"

namespace cutproof::harness {

using oracles::Measure;
using oracles::MeasuredError;

namespace {

constexpr const char* kPrefix = "lockstep: ";

Verdict verdict_of(const char* property) {
  return {.property = fmt::format("{}{}", kPrefix, property),
          .stage = Stage::step,
          .backend = {},
          .unit = "1",
          .bound_source = "docs/design/tolerances.md, Against the reference",
          .witness = {}};
}

Verdict failing(const char* property, Stage stage, int64_t frame, Witness witness) {
  Verdict verdict = verdict_of(property);
  verdict.stage = stage;
  verdict.frame = frame;
  verdict.holds = false;
  verdict.witness = std::move(witness);
  return verdict;
}

}  // namespace

Lockstep::Lockstep(const Setup& setup, const State& start, const State& loaded, std::string backend)
    : setup_(setup),
      backend_(std::move(backend)),
      frame_(loaded.frame),
      before_(loaded),
      comparison_(setup, reference_stages()) {
  const double bound = oracles::position_bound(setup.body);
  for (const Measure which : {Measure::position, Measure::rotation, Measure::rest_center, Measure::skin}) {
    tracks_[at(which)].worst.bound = bound;
  }
  tracks_[at(Measure::velocity)].worst.bound = 2 * bound;

  // The backend's state after loading.
  const Verdict form = oracles::well_formed(setup_, loaded);
  if (!form.holds) {
    oracles::DecisionDifference difference{form.witness};
    difference.text = fmt::format("as loaded: {}", form.witness.text);
    differ(Stage::step, difference);
    broken_ = true;
    return;
  }
  if (auto difference = oracles::difference_of_decisions(start, loaded)) {
    difference->text = fmt::format("as loaded: {}", difference->text);
    differ(Stage::step, *difference);
  }
  oracles::ErrorNorm ignored;
  const auto apart = oracles::position_error(setup, start.x, loaded.x, loaded.alive);
  note(Measure::position, Stage::step, {apart, bound}, ignored);
  const oracles::RestFrameComparison rest = oracles::compare_rest_frames(setup, loaded);
  note(Measure::rest_center, Stage::step, rest.center, ignored);
  note(Measure::mass, Stage::step, rest.mass, ignored);
}

void Lockstep::see(Stage stage, const State& after, bool launched, bool by_backend) {
  if (broken_) return;
  if (!by_backend) {
    if (stage == Stage::step) frames_.emplace_back().frame = frame_;
    if (observer_ && launched) observer_(stage, after);
    before_ = after;
    if (stage == Stage::skin) ++frame_;
    return;
  }
  const oracles::StageDifference found = comparison_.compare(stage, before_, after, launched);
  broken_ = !found.is_readable;
  if (broken_) return differ(stage, found.decisions.front());
  if (observer_ && launched && found.due) {
    State expected = found.expected;
    expected.frame = after.frame;  // a stage by itself does not say whether it ends the frame
    observer_(stage, expected);
  }
  if (stage == Stage::step) frames_.emplace_back().frame = frame_;
  LockstepFrame& frame = frames_.back();
  ++stages_;
  for (const oracles::DecisionDifference& difference : found.decisions) differ(stage, difference);
  if (stage == Stage::detect && found.due) ++detections_;
  if (found.detection && !found.detection->holds) {
    Verdict failure = failing("removed particles", stage, frame_, found.detection->witness);
    failure.bound_source = found.detection->bound_source;
    removals_.add(std::move(failure));
  }
  if (found.step) {
    ++steps_;
    if (!found.step->holds) {
      Verdict failure = *found.step;
      failure.property = kPrefix + failure.property;
      steps_failed_.add(std::move(failure));
    }
  }
  frame.undecidable.join(found.undecidable);
  frame.angle.join(found.angle);
  for (std::size_t m = 0; m < tracks_.size(); ++m) {
    note(static_cast<Measure>(m), stage, found.errors[m], frame.errors[m]);
  }
  before_ = after;
  if (stage == Stage::skin) ++frame_;
}

void Lockstep::differ(Stage stage, const oracles::DecisionDifference& difference) {
  if (!frames_.empty()) ++frames_.back().topology_differences;
  topology_.add(failing("topology", stage, frame_, difference));
}

void Lockstep::note(Measure which, Stage stage, const MeasuredError& error, oracles::ErrorNorm& of_frame) {
  if (error.norm.count == 0) return;
  of_frame.join(error.norm);
  Track& track = tracks_[at(which)];
  LockstepWorst& worst = track.worst;
  if (error.norm.max > worst.norm.max || worst.norm.count == 0) {
    worst.frame = frame_;
    worst.stage = stage;
  }
  worst.norm.join(error.norm);
  worst.bound = std::max(worst.bound, error.bound);
  if (!error.holds()) track.failures.add(oracles::verdict_of(which, error, stage, frame_, kPrefix));
}

std::vector<Verdict> Lockstep::verdicts() const {
  std::vector<Verdict> verdicts;
  const auto counted = [&](const char* property, const Failures& failures, int64_t checked) {
    Verdict& verdict = verdicts.emplace_back(failures.count > 0 ? failures.first : verdict_of(property));
    if (failures.count > 1) {
      verdict.witness.text += fmt::format(" ({} stages differ, this is the first)", failures.count);
    }
    verdict.measured = static_cast<double>(failures.count);
    verdict.checked = checked;
  };
  counted("topology", topology_, stages_);
  counted("removed particles", removals_, detections_);
  counted("admissible step", steps_failed_, steps_);
  for (std::size_t m = 0; m < tracks_.size(); ++m) {
    const auto& [worst, failures] = tracks_[m];
    Verdict& verdict = verdicts.emplace_back(
        oracles::verdict_of(static_cast<Measure>(m), {worst.norm, worst.bound}, worst.stage, worst.frame, kPrefix));
    if (failures.count > 0) verdict = failures.first;
    if (failures.count > 1) {
      verdict.witness.text += fmt::format(
          " ({} frames or stages are beyond the bound, this is the first; the worst, {:.3g} {}, is in frame {} after "
          "{})",
          failures.count, worst.norm.max, verdict.unit, worst.frame, name_of(worst.stage));
    }
    verdict.checked = worst.norm.count;
  }
  for (Verdict& verdict : verdicts) verdict.backend = backend_;
  return verdicts;
}

}  // namespace cutproof::harness
