#include "harness/free_running.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "model/at.h"
#include "model/rules.h"
#include "oracles/comparison/stage_comparison.h"
#include "oracles/oracles.h"
#include "oracles/shells.h"
#include "reference_cpu/reference.h"

namespace cutproof::harness {

namespace {

// Rounding of a neighbour distance, in units of u h.
constexpr double kDistanceBand = 64;
// Rounding of places in the body, in units of u (|x| + |edge of the blade|): on which side of its plane they are.
constexpr double kPlacesBand = 32;

// By how much an edge is longer than allowed (method.md §4) [h].
double excess_of(const Setup& setup, const State& state, int32_t a, int32_t b) {
  const double limit = setup.detect.epsilon * setup.body.rest_length(a, b);
  return (norm(state.x[at(a)] - state.x[at(b)]) - limit) / setup.body.grid.spacing;
}

// visit(end) for the edges of a particle to what is alive.
template <class Visit>
void for_edges(const Setup& setup, const State& state, int32_t particle, const Visit& visit) {
  for (const int32_t other : setup.body.neighbours(particle)) {
    if (state.alive[at(other)]) visit(other);
  }
}

// How far something that decides a removal is from being decided otherwise, and how far it may be by what the runs are
// apart [h].
struct Closeness {
  double margin = std::numeric_limits<double>::infinity(), reach = 0;
  double beyond() const { return margin - reach; }
};

// Of a particle's removal, with positions at most `apart` from each other in the two runs [h]. If both ends of an edge
// go: by how much its longest edge is longer than allowed. If one does: of the edges at it and at its neighbours, of
// the sides of these of the plane of the blade where it was lowered last, and by the nearer end of how much nearer to
// it one end of these edges is, whatever is nearest to being otherwise.
Closeness closeness_of(const Setup& setup, const State& state, const State& other_run, int32_t particle, double apart,
                       double u) {
  // Each end of an edge is off by at most `apart`, so the edge's length by at most twice that.
  const double of_edges = 2 * apart + kDistanceBand * u;
  if (setup.detect.remove == RemovedEnds::both) {
    double greatest = -setup.detect.epsilon;  // without neighbours nothing is long
    for_edges(setup, state, particle,
              [&](int32_t other) { greatest = std::max(greatest, excess_of(setup, state, particle, other)); });
    return {std::abs(greatest), of_edges};
  }
  Closeness nearest;
  const auto note = [&](double distance, double reach) {
    const Closeness found{std::abs(distance), reach};
    if (found.beyond() < nearest.beyond()) nearest = found;
  };
  std::vector<int32_t> near = {particle};
  for_edges(setup, state, particle, [&](int32_t other) { near.push_back(other); });
  for (const int32_t i : near) {
    for_edges(setup, state, i, [&](int32_t other) { note(excess_of(setup, state, i, other), of_edges); });
  }
  if (const BladePose* const pose = last_lowered(setup, state.frame)) {
    const Vec3 normal = cross(pose->along, pose->back);
    const double h = setup.body.grid.spacing;
    for (const int32_t i : near) {
      const double places = (norm(state.x[at(i)]) + norm(pose->edge)) / h;
      note(dot(state.x[at(i)] - pose->edge, normal) / h, apart + kPlacesBand * u * places);
    }
    if (setup.detect.remove != RemovedEnds::nearer) return nearest;
    std::vector<int32_t> ends = near;
    for (const int32_t i : near) for_edges(setup, state, i, [&](int32_t other) { ends.push_back(other); });
    std::map<int32_t, std::array<double, 2>> from_plane;  // in the two runs [h]
    const auto here = oracles::carried_places(setup, state, ends),
               there = oracles::carried_places(setup, other_run, ends);
    double rounding = 0;
    for (std::size_t k = 0; k < ends.size(); ++k) {
      from_plane[ends[k]] = {std::abs(dot(here[k].place - pose->edge, normal)) / h,
                             std::abs(dot(there[k].place - pose->edge, normal)) / h};
      const double places = (norm(here[k].place) + norm(pose->edge)) / h;
      rounding = std::max(rounding, (here[k].bound + there[k].bound) / h + kPlacesBand * u * places);
    }
    const auto is_negative = [&](int32_t i) { return dot(state.x[at(i)] - pose->edge, normal) < 0; };
    for (const int32_t i : near) {
      for_edges(setup, state, i, [&](int32_t other) {
        if (is_negative(i) == is_negative(other)) return;  // which of them is nearer does not matter
        const auto &negative = from_plane[is_negative(i) ? i : other],
                   &positive = from_plane[is_negative(i) ? other : i];
        const double lead = negative[0] - positive[0], in_other_run = negative[1] - positive[1];
        note(lead - kNearerBy, std::abs(lead - in_other_run) + 2 * rounding);
      });
    }
  }
  return nearest;
}

}  // namespace

FreeRunning::FreeRunning(const Setup& setup, const State& start, const State& loaded, std::string backend)
    : setup_(setup), backend_(std::move(backend)), frame_(loaded.frame), before_(loaded) {
  const Verdict form = oracles::well_formed(setup, loaded);
  if (!form.holds) {
    end_with(Stage::step, {form.witness}).what.text = "as loaded: " + form.witness.text;
    return;
  }
  reference_ = reference::make_backend();
  reference_->load({setup}, {start});
}

FirstDifference& FreeRunning::end_with(Stage stage, oracles::DecisionDifference what) {
  reference_.reset();
  FirstDifference& first = first_difference_.emplace();
  first.frame = frame_;
  first.stage = stage;
  first.what = std::move(what);
  return first;
}

void FreeRunning::see(Stage stage, const State& after) {
  if (!reference_) return;
  const Verdict form = oracles::well_formed(setup_, after);
  if (!form.holds) {
    end_with(stage, {form.witness});
    return;
  }
  reference_->run({stage, stage});
  const State expected = reference_->snapshot().front();
  if (observer_ && reference_->report().ran[at(static_cast<int>(stage))]) observer_(stage, expected);
  if (stage == Stage::step) {
    frames_.push_back({frame_, oracles::position_error(setup_, expected.x, after.x, after.alive)});
  }
  if (auto difference = oracles::difference_of_decisions(expected, after)) {
    FirstDifference& first = end_with(stage, std::move(*difference));
    const std::vector<int32_t> inconclusive = oracles::in_one_only(expected.removed, after.removed);
    if (stage == Stage::detect && !inconclusive.empty()) {
      first.what.particles = inconclusive;
      // Both may be right, each for its own positions.
      first.explained = oracles::detection(setup_, before_, after).holds;
      if (setup_.detect.criterion == Criterion::distance) {
        State present = expected;
        for (const int32_t i : expected.removed) present.alive[at(i)] = 1;
        Closeness farthest{0, 0};
        for (const int32_t i : inconclusive) {
          const Closeness of =
              closeness_of(setup_, present, after, i, frames_.back().position.max, unit_roundoff(after));
          if (i == inconclusive.front() || !(of.beyond() <= farthest.beyond())) farthest = of;
        }
        first.margin = farthest.margin;
        first.reach = farthest.reach;
        first.explained = first.explained && std::isfinite(first.reach) && farthest.margin <= first.reach;
      }
    }
    // Where the rule leaves several right answers, this one may be another: all else is equal, and it is right.
    if (stage == Stage::merge && !promise_of(setup_.merge.rule).unique) {
      first.explained = !oracles::difference_of_decisions(expected, after, oracles::Sets::open) &&
                        oracles::merge_legality(setup_, before_, after).holds &&
                        oracles::cap_kept(setup_, before_, after).holds &&
                        oracles::merge_maximality(setup_, after).holds;
    }
    return;
  }
  before_ = after;
  if (stage == Stage::skin) ++frame_;
}

Verdict FreeRunning::verdict() const {
  Verdict verdict{.property = "free-running: decisions",
                  .stage = Stage::step,
                  .backend = backend_,
                  .unit = "h",
                  .bound_source = "docs/design/tolerances.md, Against the reference",
                  .checked = static_cast<int64_t>(frames_.size()),
                  .witness = {}};
  if (!first_difference_) return verdict;
  const FirstDifference& first = *first_difference_;
  verdict.frame = first.frame;
  verdict.stage = first.stage;
  verdict.holds = first.explained;
  verdict.measured = first.margin.value_or(0);
  verdict.bound = first.reach;
  if (!verdict.holds) verdict.witness = first.what;
  return verdict;
}

}  // namespace cutproof::harness
