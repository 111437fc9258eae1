#include "harness/expectations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/at.h"
#include "oracles/oracles.h"
#include "oracles/surface/surface.h"

namespace cutproof::harness {

namespace {

double greatest_stretch(const Setup& setup, const State& state) {
  double greatest = 0;
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (!state.alive[at(i)]) continue;
    for (const int32_t j : setup.body.neighbours(i)) {
      if (state.alive[at(j)]) greatest = std::max(greatest, norm(state.x[at(i)] - state.x[at(j)]));
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

ExpectationCheck::ExpectationCheck(const Setup& setup, const Expectations& expectations, const Snapshot& initial)
    : setup_(setup),
      expectations_(expectations),
      last_(initial),
      initial_clusters_(initial->clusters.count()),
      components_after_stroke_(setup.stroke_end.size()) {}

void ExpectationCheck::see(const Moment& moment) {
  if (!moment.span.contains(Stage::skin)) return;
  const int64_t frame = frames_seen_++;
  const State& state = *moment.after;
  if (!oracles::well_formed(setup_, state).holds) return;
  last_ = moment.after;
  removed_ += static_cast<int64_t>(state.removed.size() + state.debris.size());
  greatest_stretch_ = std::max(greatest_stretch_, greatest_stretch(setup_, state));
  if (removed_ == 0 && setup_.has_blade && frame < setup_.frame_count()) {
    const BladeMove& move = setup_.blade_moves[at((frame + 1) * setup_.step.substeps - 1)];
    if (move.down) dent_ = std::max(dent_, dent_depth(setup_, state, move.to.back));
  }
  if (expectations_.isolated_clusters) {
    isolated_ = std::max(isolated_, oracles::isolation(setup_, state).measured);
  }
  for (std::size_t s = 0; s < setup_.stroke_end.size(); ++s) {
    if (setup_.stroke_end[s] == frame) components_after_stroke_[s] = oracles::graph_components(setup_, state).count;
  }
}

Verdict ExpectationCheck::verdict(const std::string& what, double measured, double low, double high,
                                  const std::string& unit, const std::string& text) const {
  Verdict verdict;
  verdict.property = "expected " + what;
  verdict.stage = Stage::skin;
  verdict.frame = std::max<int64_t>(frames_seen_ - 1, 0);
  verdict.holds = low <= measured && measured <= high;
  verdict.measured = measured;
  verdict.bound = measured < low ? low : high;
  verdict.unit = unit;
  verdict.bound_source = "the scene's expect block";
  verdict.checked = 1;
  if (!verdict.holds) verdict.witness.text = text;
  return verdict;
}

std::vector<Verdict> ExpectationCheck::verdicts() const {
  std::vector<Verdict> found;
  // `measured`: absent if it could not be counted, and then `why` says why.
  const auto equal = [&](const std::string& what, std::optional<int64_t> measured, int64_t wanted,
                         const std::string& when, const std::string& why) {
    const double value = static_cast<double>(measured.value_or(-1));
    found.push_back(verdict(what, value, static_cast<double>(wanted), static_cast<double>(wanted), "1",
                            measured ? fmt::format("{} there are {}, expected {}", when, *measured, wanted) : why));
    if (!measured) found.back().holds = false;
  };
  const auto within = [&](const std::string& what, double measured, const std::optional<Range>& range,
                          const std::string& unit) {
    if (!range) return;
    found.push_back(
        verdict(what, measured, range->low, range->high, unit,
                fmt::format("{} is {:.6g}, expected {:.6g} to {:.6g}", what, measured, range->low, range->high)));
  };
  const auto& after_stroke = expectations_.components_after_stroke;
  for (std::size_t s = 0; s < after_stroke.size(); ++s) {
    const std::string stroke = std::to_string(s + 1);
    const bool exists = s < components_after_stroke_.size();
    equal("components after stroke " + stroke, exists ? components_after_stroke_[s] : std::nullopt, after_stroke[s],
          "at the end of stroke " + stroke,
          exists ? "the end of stroke " + stroke + " was never reached, or its state could not be read"
                 : "the scene has no stroke " + stroke);
  }
  const State& last = *last_;
  if (expectations_.components_at_end) {
    equal("components at the end", oracles::graph_components(setup_, last).count, *expectations_.components_at_end,
          "at the end", "");
  }
  if (expectations_.shells_at_end) {
    const std::optional<oracles::ShellCount> shells = oracles::skin_shells(last.skin);
    equal("shells at the end", shells ? std::optional<int64_t>(shells->outer) : std::nullopt,
          *expectations_.shells_at_end, "at the end",
          "the shells of the skin at the end cannot be counted: its triangles are no closed surface");
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
  return found;
}

bool ExpectationCheck::any() const { return !(expectations_ == Expectations{}); }

bool ExpectationCheck::is_expected_failure(const Verdict& verdict) const {
  const auto& isolated = expectations_.isolated_clusters;
  if (!isolated || isolated->low < 1) return false;
  // Of a component match only that connected tissue is not coupled: what couples across a gap is a cluster, and named.
  return verdict.property == "isolation" ||
         (verdict.property == "component match" && !verdict.witness.path.empty() && verdict.witness.clusters.empty());
}

}  // namespace cutproof::harness
