#include "harness/expectations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/at.h"
#include "model/fields.h"
#include "oracles/oracles.h"
#include "oracles/piece_sizes.h"
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

ExpectationCheck::ExpectationCheck(const Setup& setup, const Expectations& expectations, const Snapshot& initial,
                                   Extent extent)
    : setup_(setup),
      expectations_(expectations),
      extent_(extent),
      last_(initial),
      initial_clusters_(initial->clusters.count()),
      after_stroke_(setup.stroke_end.size()) {}

void ExpectationCheck::Greatest::see(double now, int64_t frame, const std::optional<Range>& expected) {
  value = std::max(value, now);
  if (!beyond && expected && value > expected->high) beyond = frame;
}

void ExpectationCheck::see(const Moment& moment) {
  if (!moment.span.contains(Stage::skin)) return;
  const int64_t frame = frames_seen_++;
  const State& state = *moment.after;
  if (!oracles::well_formed(setup_, state).holds) return;
  last_ = moment.after;
  const auto removed = static_cast<double>(state.removed.size() + state.debris.size());
  removed_.see(removed_.value + removed, frame, expectations_.removed);
  greatest_stretch_.see(greatest_stretch(setup_, state), frame, expectations_.greatest_stretch);
  if (removed_.value == 0 && setup_.has_blade && frame < setup_.frame_count()) {
    const BladeMove& move = setup_.blade_moves[at((frame + 1) * setup_.step.substeps - 1)];
    if (move.down) dent_.see(dent_depth(setup_, state, move.to.back), frame, expectations_.dent);
  }
  if (expectations_.isolated_clusters) {
    isolated_.see(oracles::isolation(setup_, state).measured, frame, expectations_.isolated_clusters);
  }
  const bool ends_a_stroke =
      std::find(setup_.stroke_end.begin(), setup_.stroke_end.end(), frame) != setup_.stroke_end.end();
  const bool may_differ = frame == 0 || removed > 0;
  if (!ends_a_stroke && !(may_differ && expectations_.components_at_end)) return;
  const oracles::Partition pieces = oracles::graph_components(setup_, state);
  if (pieces.count != components_) components_since_ = frame;
  components_ = pieces.count;
  for (std::size_t s = 0; s < setup_.stroke_end.size(); ++s) {
    if (setup_.stroke_end[s] == frame) after_stroke_[s] = {pieces.count, oracles::pieces_in_words(pieces)};
  }
}

ExpectationCheck::Judged ExpectationCheck::judged(const StagesRun& stages) const {
  using enum Stage;
  Judged found;
  // Stages that decide an outcome. A split removes particles only with debris.
  const StageSet removal =
                     setup_.split.debris > 0 ? cutproof::stages(step, detect, split) : cutproof::stages(step, detect),
                 of_skin = {removal.bits | cutproof::stages(skin).bits},
                 of_clusters = cutproof::stages(step, detect, split, merge, expand),
                 of_motion = cutproof::stages(step, detect), of_the_scene = cutproof::stages();
  const auto is_its_own = [&](const std::string& what, StageSet decided_by) {
    bool by_backend = false, by_reference = false;
    for (const Stage stage : kStages) {
      if (!decided_by.contains(stage)) continue;
      by_backend = by_backend || stages.by_backend[at(stage)] > 0;
      by_reference = by_reference || stages.by_reference[at(stage)] > 0;
    }
    if (by_backend || !by_reference) return true;
    found.not_its_own.push_back(what);
    return false;
  };
  const auto add = [&](const std::string& what, double measured, double low, double high, const std::string& unit,
                       int64_t frame, const std::string& text) {
    Verdict& verdict = found.verdicts.emplace_back();
    verdict.property = "expected " + what;
    verdict.stage = Stage::skin;
    verdict.frame = frame;
    verdict.holds = low <= measured && measured <= high;
    verdict.measured = measured;
    verdict.bound = measured < low ? low : high;
    verdict.unit = unit;
    verdict.bound_source = "the scene's expect block";
    verdict.checked = 1;
    if (!verdict.holds) verdict.witness.text = text;
  };
  const bool is_whole = extent_ == Extent::whole;
  // `measured`: absent if it could not be counted, and then `why` says why.
  const auto equal = [&](const std::string& what, std::optional<int64_t> measured, int64_t wanted, int64_t frame,
                         const std::string& when, const std::string& pieces, const std::string& why) {
    const auto value = static_cast<double>(measured.value_or(-1)), target = static_cast<double>(wanted);
    add(what, value, target, target, "1", frame,
        measured ? fmt::format("{} there are {}, expected {}; the tissue is {}", when, *measured, wanted, pieces)
                 : why);
    if (!measured) found.verdicts.back().holds = false;
  };
  // A value that may change until the run ends, unless it `is_final`; a value above its limit that cannot decrease
  // fails at once.
  const auto within = [&](const std::string& what, StageSet decided_by, double measured,
                          const std::optional<Range>& range, const std::string& unit, int64_t frame, bool is_final,
                          bool grows_only) {
    if (!range || !is_its_own(what, decided_by)) return;
    if (!is_whole && !is_final && !(grows_only && measured > range->high)) {
      found.not_reached.push_back(what);
      return;
    }
    add(what, measured, range->low, range->high, unit, frame,
        fmt::format("{} is {:.6g}, expected {:.6g} to {:.6g}", what, measured, range->low, range->high));
  };
  const auto greatest = [&](const std::string& what, StageSet decided_by, const Greatest& of,
                            const std::optional<Range>& range, const std::string& unit, bool is_final = false) {
    within(what, decided_by, of.value, range, unit, of.beyond.value_or(last_frame()), is_final, true);
  };
  const auto& after_stroke = expectations_.components_after_stroke;
  for (std::size_t s = 0; s < after_stroke.size(); ++s) {
    const std::string stroke = std::to_string(s + 1), what = "components after stroke " + stroke;
    if (!is_its_own(what, removal)) continue;
    const bool exists = s < after_stroke_.size();
    const bool is_reached = exists && setup_.stroke_end[s] >= 0 && setup_.stroke_end[s] < frames_seen_;
    if (exists && !is_whole && !is_reached) {
      found.not_reached.push_back(what);
      continue;
    }
    const std::optional<AfterStroke> seen = exists ? after_stroke_[s] : std::nullopt;
    equal(what, seen ? std::optional<int64_t>(seen->count) : std::nullopt, after_stroke[s],
          seen ? setup_.stroke_end[s] : last_frame(), "at the end of stroke " + stroke, seen ? seen->pieces : "",
          exists ? "the end of stroke " + stroke + " was never reached, or its state could not be read"
                 : "the scene has no stroke " + stroke);
  }
  const State& last = *last_;
  const auto at_end = [&](const std::string& what, StageSet decided_by, const std::optional<int64_t>& wanted,
                          const auto& judge) {
    if (!wanted || !is_its_own(what, decided_by)) return;
    if (is_whole) {
      judge(what, *wanted);
    } else {
      found.not_reached.push_back(what);
    }
  };
  const auto judge_components = [&](const std::string& what, int64_t wanted) {
    const oracles::Partition pieces = oracles::graph_components(setup_, last);
    const bool known_since = pieces.count == components_ && pieces.count > wanted;
    equal(what, pieces.count, wanted, known_since ? components_since_ : last_frame(), "at the end",
          oracles::pieces_in_words(pieces), "");
  };
  const auto judge_shells = [&](const std::string& what, int64_t wanted) {
    const std::optional<oracles::ShellCount> shells = oracles::skin_shells(last.skin);
    equal(what, shells ? std::optional<int64_t>(shells->outer) : std::nullopt, wanted, last_frame(), "at the end",
          oracles::pieces_in_words(oracles::graph_components(setup_, last)),
          "the shells of the skin at the end cannot be counted: its triangles are no closed surface");
  };
  at_end("components at the end", removal, expectations_.components_at_end, judge_components);
  at_end("shells at the end", of_skin, expectations_.shells_at_end, judge_shells);
  const double clusters = static_cast<double>(initial_clusters_);
  greatest("removed particles", removal, removed_, expectations_.removed, "1");
  greatest("isolated groups of clusters", of_clusters, isolated_, expectations_.isolated_clusters, "1");
  within("cluster growth", of_clusters, clusters > 0 ? (last.clusters.count() - clusters) / clusters : 0,
         expectations_.cluster_growth, "1", last_frame(), false, false);
  within("clusters", of_the_scene, clusters, expectations_.clusters, "1", 0, true, false);
  within("particles", of_the_scene, setup_.body.particle_count(), expectations_.particles, "1", 0, true, false);
  greatest("dent before the first removal", of_motion, dent_, expectations_.dent, "h", removed_.value > 0);
  greatest("greatest stretch", of_motion, greatest_stretch_, expectations_.greatest_stretch, "h");
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
