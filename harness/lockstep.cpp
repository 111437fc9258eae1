#include "harness/lockstep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "harness/reference_stages.h"
#include "oracles/oracles.h"

namespace cutproof::harness {

using oracles::Measure;
using oracles::MeasuredError;

namespace {

constexpr const char* kPrefix = "lockstep: ";

Verdict verdict_of(const char* property, const std::string& backend) {
  return {.property = fmt::format("{}{}", kPrefix, property),
          .stage = Stage::step,
          .backend = backend,
          .unit = "1",
          .bound_source = "docs/design/tolerances.md, Against the reference",
          .witness = {}};
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
    tracks_[static_cast<std::size_t>(which)].worst.bound = bound;
  }
  tracks_[static_cast<std::size_t>(Measure::velocity)].worst.bound = 2 * bound;

  // What the backend has made of what it was given.
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

void Lockstep::see(Stage stage, const State& after, bool launched) {
  if (broken_) return;
  const oracles::StageDifference found = comparison_.compare(stage, before_, after, launched);
  broken_ = !found.is_readable;
  if (broken_) return differ(stage, found.decisions.front());
  if (stage == Stage::step) frames_.emplace_back().frame = frame_;
  LockstepFrame& frame = frames_.back();
  ++topology_.checked;
  for (const oracles::DecisionDifference& difference : found.decisions) differ(stage, difference);
  if (stage == Stage::detect && found.due) ++removals_.checked;
  if (found.detection && !found.detection->holds) {
    ++removals_.failures;
    if (!removals_.failure) {
      removals_.failure = verdict_of("removed particles", backend_);
      removals_.failure->bound_source = found.detection->bound_source;
      removals_.failure->frame = frame_;
      removals_.failure->stage = stage;
      removals_.failure->holds = false;
      removals_.failure->witness = found.detection->witness;
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
  ++topology_.failures;
  if (topology_.failure) return;
  topology_.failure = verdict_of("topology", backend_);
  topology_.failure->frame = frame_;
  topology_.failure->stage = stage;
  topology_.failure->holds = false;
  topology_.failure->witness = difference;
}

void Lockstep::note(Measure which, Stage stage, const MeasuredError& error, oracles::ErrorNorm& of_frame) {
  if (error.norm.count == 0) return;
  of_frame.join(error.norm);
  Track& track = tracks_[static_cast<std::size_t>(which)];
  LockstepWorst& worst = track.worst;
  if (error.norm.max > worst.norm.max || worst.norm.count == 0) {
    worst.frame = frame_;
    worst.stage = stage;
  }
  worst.norm.join(error.norm);
  worst.bound = std::max(worst.bound, error.bound);
  if (error.holds()) return;
  ++track.failures;
  if (track.failure) return;
  track.failure = oracles::verdict_of(which, error, stage, frame_, kPrefix);
  track.failure->backend = backend_;
}

std::vector<Verdict> Lockstep::verdicts() const {
  std::vector<Verdict> verdicts;
  const auto counted = [&](const char* property, const Count& count) {
    Verdict verdict = count.failure ? *count.failure : verdict_of(property, backend_);
    if (count.failure && count.failures > 1)
      verdict.witness.text += fmt::format(" ({} stages differ, this is the first)", count.failures);
    verdict.measured = static_cast<double>(count.failures);
    verdict.checked = count.checked;
    verdicts.push_back(std::move(verdict));
  };
  counted("topology", topology_);
  counted("removed particles", removals_);
  for (std::size_t m = 0; m < tracks_.size(); ++m) {
    const Track& track = tracks_[m];
    const LockstepWorst& worst = track.worst;
    Verdict verdict =
        oracles::verdict_of(static_cast<Measure>(m), {worst.norm, worst.bound}, worst.stage, worst.frame, kPrefix);
    verdict.backend = backend_;
    if (track.failure) {
      verdict = *track.failure;
      if (track.failures > 1) {
        verdict.witness.text += fmt::format(
            " ({} frames or stages are beyond the bound, this is the first; the worst, {:.3g} {}, is in frame {} after "
            "{})",
            track.failures, worst.norm.max, verdict.unit, worst.frame, name_of(worst.stage));
      }
    }
    verdict.checked = worst.norm.count;
    verdicts.push_back(std::move(verdict));
  }
  return verdicts;
}

bool Lockstep::holds() const {
  const auto all = verdicts();
  return std::all_of(all.begin(), all.end(), [](const Verdict& verdict) { return verdict.holds; });
}

}  // namespace cutproof::harness
