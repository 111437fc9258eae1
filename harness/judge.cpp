#include "harness/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "oracles/oracles.h"
#include "oracles/surface/surface.h"

namespace cutproof::cli {

namespace {

std::size_t at(int64_t index) { return static_cast<std::size_t>(index); }

// The state as it was between step and detect: the removed particles still in G. Later stages move nothing.
State before_detection(const State& state, const State& frame_start, int64_t frame) {
  State before = state;
  before.frame = frame;
  before.alive = frame_start.alive;
  before.removed.clear();
  before.debris.clear();
  before.clusters = frame_start.clusters;
  before.clusters.rotation = state.clusters.rotation;
  before.clusters.degenerate = state.clusters.degenerate;
  before.skin = frame_start.skin;
  return before;
}

double greatest_stretch(const Setup& setup, const State& state) {
  double greatest = 0;
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (!state.alive[at(i)]) continue;
    for (const int direction : {0, 2, 4}) {
      const int32_t j = setup.body.neighbour(i, direction);
      if (j >= 0 && state.alive[at(j)]) greatest = std::max(greatest, norm(state.x[at(i)] - state.x[at(j)]));
    }
  }
  return greatest / setup.body.grid.spacing;
}

// How much deeper the blade has pressed its deepest particle of the surface than the surface sinks as a whole (its
// median), along the blade [h].
double dent_depth(const Setup& setup, const State& state, Vec3 back) {
  std::vector<double> depth;
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (!state.alive[at(i)]) continue;
    bool surface = false;
    for (int direction = 0; direction < 6; ++direction) surface = surface || setup.body.neighbour(i, direction) < 0;
    if (surface) depth.push_back(-dot(state.x[at(i)] - setup.body.rest_position(i), back));
  }
  if (depth.empty()) return 0;
  const auto middle = depth.begin() + static_cast<std::ptrdiff_t>(depth.size() / 2);
  std::nth_element(depth.begin(), middle, depth.end());
  const double median = *middle;
  return (*std::max_element(depth.begin(), depth.end()) - median) / setup.body.grid.spacing;
}

}  // namespace

Gate::Gate(const Setup& setup, const Expectations& expectations, std::string backend, const State& initial)
    : setup_(setup),
      expectations_(expectations),
      backend_(std::move(backend)),
      previous_(initial),
      frame_start_(initial),
      frame_(initial.frame),
      initial_clusters_(initial.clusters.count()),
      components_after_stroke_(setup.stroke_end.size(), -1) {}

void Gate::add(std::vector<Verdict> found, Stage stage, int64_t frame) {
  for (Verdict& verdict : found) {
    verdict.stage = stage;
    verdict.backend = backend_;
    verdict.frame = frame;
    verdicts_.push_back(std::move(verdict));
  }
}

void Gate::see(Stage stage, const State& state) {
  const Verdict sound = oracles::well_formed(setup_, state);
  if (!sound.holds) {
    // Nothing else can be asked of such a state, nor can it be compared with the next one.
    add({sound}, stage, frame_);
    return;
  }
  State now = state;
  now.frame = frame_;  // a state after the last stage has counted up already

  if (!frame_begun_) {
    frame_begun_ = true;
    const State undetected = before_detection(now, frame_start_, frame_);
    add(oracles::judge_stage(setup_, Stage::step, frame_start_, undetected, oracles::properties()), Stage::step,
        frame_);
    if (needs_detection(setup_)) {
      // Where nothing was removed the frame's only snapshot, after skin, holds what detect left, but for the skin.
      State detected = now;
      detected.skin = undetected.skin;
      add(oracles::judge_stage(setup_, Stage::detect, undetected, detected, oracles::properties()), Stage::detect,
          frame_);
    }
  }
  if (stage == Stage::split || stage == Stage::merge || stage == Stage::expand) {
    add(oracles::judge_stage(setup_, stage, previous_, now, oracles::properties()), stage, frame_);
  }
  if (stage == Stage::skin) {
    const bool cut = !now.removed.empty() || !now.debris.empty();
    const bool thorough = setup_.skin.wanted && (cut || !skin_judged_);
    add(oracles::judge(setup_, now, thorough, oracles::properties()), stage, frame_);
    skin_judged_ = true;
    frame_begun_ = false;
    note_progress(now, frame_);
    ++frame_;
    now.frame = frame_;
    frame_start_ = now;
  }
  previous_ = std::move(now);
}

void Gate::note_progress(const State& state, int64_t frame) {
  removed_ += static_cast<int64_t>(state.removed.size() + state.debris.size());
  greatest_stretch_ = std::max(greatest_stretch_, greatest_stretch(setup_, state));
  if (removed_ == 0 && setup_.has_blade) {
    const BladeMove& move = setup_.blade_moves[at((frame + 1) * setup_.step.substeps - 1)];
    if (move.down) dent_ = std::max(dent_, dent_depth(setup_, state, move.to.back));
  }
  const bool asks_for_isolation = expectations_.isolated_clusters.has_value();
  if (asks_for_isolation) isolated_ = std::max(isolated_, oracles::isolation(setup_, state).measured);
  for (std::size_t s = 0; s < setup_.stroke_end.size(); ++s) {
    if (setup_.stroke_end[s] == frame) components_after_stroke_[s] = oracles::graph_components(setup_, state).count;
  }
}

void Gate::expect(const std::string& what, double measured, double low, double high, const std::string& unit,
                  const std::string& text) {
  Verdict verdict;
  verdict.property = "expected " + what;
  verdict.holds = low <= measured && measured <= high;
  verdict.measured = measured;
  verdict.bound = measured < low ? low : high;
  verdict.unit = unit;
  verdict.bound_source = "the scene's expect block";
  verdict.checked = 1;
  if (!verdict.holds) verdict.witness.text = text;
  add({verdict}, Stage::skin, std::max<int64_t>(frame_ - 1, 0));
}

void Gate::finish() {
  const auto equal = [&](const std::string& what, int64_t measured, int64_t wanted, const std::string& when) {
    expect(what, static_cast<double>(measured), static_cast<double>(wanted), static_cast<double>(wanted), "1",
           measured < 0 ? fmt::format("{} was never reached: the run ended before it", when)
                        : fmt::format("{} there are {}, expected {}", when, measured, wanted));
  };
  const auto within = [&](const std::string& what, double measured, const std::optional<Range>& range,
                          const std::string& unit) {
    if (!range) return;
    expect(what, measured, range->low, range->high, unit,
           fmt::format("{} is {:.6g}, expected {:.6g} to {:.6g}", what, measured, range->low, range->high));
  };
  const auto& after_stroke = expectations_.components_after_stroke;
  for (std::size_t s = 0; s < after_stroke.size(); ++s) {
    const int64_t measured = s < components_after_stroke_.size() ? components_after_stroke_[s] : -1;
    equal("components after stroke " + std::to_string(s + 1), measured, after_stroke[s],
          "the end of stroke " + std::to_string(s + 1));
  }
  const State& last = previous_;
  if (expectations_.components_at_end) {
    equal("components at the end", oracles::graph_components(setup_, last).count, *expectations_.components_at_end,
          "at the end");
  }
  if (expectations_.shells_at_end) {
    const auto shells = oracles::skin_shells(last.skin);
    equal("shells at the end", shells ? shells->outer : -1, *expectations_.shells_at_end, "at the end");
  }
  const double clusters = static_cast<double>(initial_clusters_);
  within("removed particles", static_cast<double>(removed_), expectations_.removed, "1");
  within("isolated groups of clusters", isolated_, expectations_.isolated_clusters, "1");
  within("cluster growth", clusters > 0 ? (last.clusters.count() - clusters) / clusters : 0,
         expectations_.cluster_growth, "1");
  within("clusters", clusters, expectations_.clusters, "1");
  within("particles", setup_.body.particle_count(), expectations_.particles, "1");
  within("dent before the first removal", dent_, expectations_.dent, "h");
  within("greatest stretch", greatest_stretch_, expectations_.greatest_stretch, "h");
}

bool Gate::expected_failure(const Verdict& verdict) const {
  const auto& isolated = expectations_.isolated_clusters;
  return isolated && isolated->low >= 1 && (verdict.property == "isolation" || verdict.property == "component match");
}

bool Gate::holds() const {
  return std::all_of(verdicts_.begin(), verdicts_.end(),
                     [this](const Verdict& verdict) { return verdict.holds || expected_failure(verdict); });
}

}  // namespace cutproof::cli
