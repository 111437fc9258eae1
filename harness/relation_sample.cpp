#include "harness/relation_sample.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "model/at.h"
#include "oracles/iterates/probe.h"
#include "oracles/oracles.h"
#include "oracles/relations/relations.h"
#include "oracles/timed.h"

namespace cutproof::harness {

namespace {

// Kick of a component, and displacement of a thrown body in a substep [h]: of the size of tissue motion, along no axis.
constexpr Vec3 kKick = {0.7, -0.4, 1.3};
constexpr Vec3 kThrow = {0.3, -0.2, 0.1};

Setup without_friction(Setup setup) {
  setup.blade.friction = 0;
  for (Wall& wall : setup.walls) wall.friction = 0;
  return setup;
}

}  // namespace

RelationSample::RelationSample(const Setup& setup, std::unique_ptr<Backend> second)
    : setup_(setup), frictionless_(without_friction(setup)), second_(std::move(second)) {}
RelationSample::~RelationSample() = default;

std::vector<Verdict> RelationSample::take_verdicts() { return std::exchange(verdicts_, {}); }

void RelationSample::see(const Moment& moment) {
  if (moment.span.contains(Stage::step)) {
    begin_ = moment.before;
    is_separated_ = false;
    // Only a cut can have changed how many there are.
    if (components_ == 0 || removed_before_) {
      const int32_t count = oracles::graph_components(setup_, *begin_).count;
      is_separated_ = components_ > 0 && count > components_;
      components_ = count;
    }
  }
  if (!moment.span.contains(Stage::skin)) return;
  ++frames_;
  const bool removes = !moment.after->removed.empty();
  const bool cut_ended = std::exchange(removed_before_, removes) && !removes;
  const Snapshot begin = std::exchange(begin_, nullptr);
  const bool is_asked = begin != nullptr && (begin->frame % kFramesBetweenSamples == 0 || cut_ended || is_separated_);
  // One that is not well formed has been rejected already, and no backend could load it.
  if (is_asked && oracles::well_formed(setup_, *begin).holds) {
    wait();
    asking_ = std::async(std::launch::async, [this, begin, turn = asked_++] { return ask(*begin, turn); });
  }
}

void RelationSample::wait() {
  if (!asking_.valid()) return;
  for (Verdict& verdict : asking_.get()) verdicts_.push_back(std::move(verdict));
}

std::vector<Verdict> RelationSample::ask(const State& begin, int64_t turn) {
  const double h = setup_.body.grid.spacing, dt = setup_.substep_length[at(begin.frame)];
  // Each component in turn.
  const oracles::Partition pieces = oracles::graph_components(setup_, begin);
  const auto kicked = static_cast<int32_t>(turn % std::max(pieces.count, 1));
  const auto first = std::find(pieces.label.begin(), pieces.label.end(), kicked);
  const auto particle = first == pieces.label.end() ? -1 : static_cast<int32_t>(first - pieces.label.begin());
  // Some iterations even where the scene has none: a simulator that makes some is judged by them.
  const int32_t iterations = std::max(setup_.step.iterations, 2);
  using oracles::timed;
  std::vector<Verdict> verdicts = {
      timed([&] { return oracles::no_ghost_force(*second_, setup_, begin, particle, h * kKick, 1); }),
      timed([&] { return oracles::energy_is_monotone(*second_, frictionless_, begin, iterations); }),
      timed([&] { return oracles::rest_is_fixed(*second_, setup_, begin); }),
      timed([&] { return oracles::translation_is_exact(*second_, setup_, begin, (h / dt) * kThrow); }), timed([&] {
        return oracles::step_by_iterates(*second_, setup_, begin, oracles::Iterates::sampled,
                                         static_cast<uint64_t>(begin.frame));
      })};
  for (Verdict& verdict : verdicts) {
    verdict.stage = Stage::step;
    verdict.frame = begin.frame;
  }
  return verdicts;
}

std::vector<std::string> RelationSample::notes() const {
  const bool runs_frames = second_->can_run({});
  if (!runs_frames && !second_->can_run({Stage::step, Stage::step})) {
    return {"This backend runs neither whole frames nor the step alone: no relation between runs could be judged."};
  }
  std::vector<std::string> notes = {fmt::format(
      "Relations between runs were judged in {} of {} frames: every {}th, after each cut, and at new pieces.", asked_,
      frames_, kFramesBetweenSamples)};
  if (!runs_frames) notes.push_back("This backend runs no whole frames: 'no ghost force' could not be judged.");
  return notes;
}

}  // namespace cutproof::harness
