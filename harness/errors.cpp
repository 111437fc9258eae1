#include "harness/errors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "oracles/oracles.h"
#include "oracles/surface/surface.h"

namespace cutproof::harness {

TopologyFigures topology_of(const Setup& setup, const State& state) {
  TopologyFigures figures;
  figures.components = oracles::graph_components(setup, state).count;
  figures.couplings = oracles::coupling_components(setup, state).count;
  const auto shells = oracles::skin_shells(state.skin);
  figures.shells = shells ? shells->outer : -1;
  figures.isolated = static_cast<int64_t>(oracles::isolation(setup, state).measured);
  figures.equal = oracles::component_match(setup, state).holds && oracles::skin_match(setup, state).holds;
  return figures;
}

Errors::Errors(const ErrorsWanted& wanted, const Setup& setup, const State& start, oracles::MakeBackend make)
    : wanted_(wanted),
      setup_(setup),
      precision_(start.precision),
      start_(start),
      make_(std::move(make)),
      sweep_(setup) {
  if (wanted_.solver) judged_ = make_();
}

bool Errors::looked_at(int64_t frame) const {
  const int64_t frames = setup_.frame_count();
  // Frame f is the last one of its part if the next frame belongs to another. (More parts than frames: the products
  // might not fit.)
  return wanted_.frames >= frames || (frame + 1) * wanted_.frames / frames != frame * wanted_.frames / frames;
}

bool Errors::wants(int64_t frame) const {
  return wanted_.topology || ((wanted_.solver || wanted_.geometry) && looked_at(frame)) ||
         (wanted_.geometry && sweep_.wants(frame));
}

void Errors::frame_begins(const State& state) {
  if (wanted_.geometry && sweep_.wants(state.frame)) frame_start_ = state;
  if (!wanted_.solver || !looked_at(state.frame)) return;
  if (auto error = oracles::solver_error(*judged_, setup_, state)) solver_.push_back({state.frame, *error});
}

void Errors::frame_ends(const State& state) {
  const int64_t frame = state.frame - 1;
  const bool last = state.frame == setup_.frame_count();
  if (wanted_.topology && (last || !state.removed.empty())) {
    const TopologyFigures figures = topology_of(setup_, state);
    ++topology_.frames;
    topology_.isolated = std::max(topology_.isolated, figures.isolated);
    if (!figures.equal) {
      ++topology_.unequal;
      if (!topology_.first_unequal) topology_.first_unequal = frame;
    }
    topology_.end = figures;
  }
  if (wanted_.geometry && sweep_.wants(frame)) sweep_.add(frame_start_, state);
  if (wanted_.geometry && looked_at(frame)) {
    const oracles::Interpenetration found = oracles::interpenetration(setup_, state);
    // NaN stays.
    if (!overlap_ || !(found.volume <= overlap_->found.volume || std::isnan(overlap_->found.volume))) {
      overlap_ = Overlap{frame, found};
    }
  }
}

void Errors::finish(const State& end) {
  if (wanted_.geometry) geometry_ = oracles::cut_geometry(setup_, start_, end, sweep_.surface());
  if (wanted_.time_step) time_step_ = oracles::time_step_error(make_, setup_, start_, setup_.frame_count());
  const bool any_alive = std::find(start_.alive.begin(), start_.alive.end(), 1) != start_.alive.end();
  if (wanted_.conservation && any_alive && setup_.frame_count() > 0) {
    const Setup free = oracles::free_setup(setup_, 0, kFreeFrames);
    State moving = start_;
    oracles::set_in_motion(free, moving);
    conservation_ = oracles::conservation(*make_(), free, moving);
  }
}

bool Errors::holds() const {
  if (!conservation_) return true;
  const oracles::Conservation& found = *conservation_;
  const bool momentum = precision_ == Precision::binary64 ? found.momentum_relative <= kDoubleDrift
                                                          : found.momentum <= found.momentum_bound;
  return momentum && found.mass == 0 && (!found.energy || *found.energy <= found.energy_bound);
}

}  // namespace cutproof::harness
