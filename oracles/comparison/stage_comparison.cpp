#include "oracles/comparison/stage_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "model/rules.h"
#include "oracles/oracles.h"
#include "oracles/rest_places.h"
#include "oracles/rounding.h"
#include "oracles/shape_sums.h"
#include "oracles/shells.h"
#include "oracles/step_model/admissible_step.h"

namespace cutproof::oracles {

namespace {

constexpr const char* kBoundSource = "docs/design/tolerances.md, Against the reference";

// Of larger bodies the project asks for less (tolerances.md, Against the reference) [h].
constexpr double kBoundOfLargeBodies = 3e-4;
constexpr double kLargeBody = 100;  // [h] across

// Of a frame after its last stage (model/backend.h, run).
void end_frame(State& state) {
  for (int32_t c = 0; c < state.clusters.count(); ++c) state.clusters.number[at(c)] = c;
  ++state.frame;
}

Verdict start_verdict(std::string property, Stage stage, int64_t frame) {
  Verdict verdict;
  verdict.property = std::move(property);
  verdict.stage = stage;
  verdict.frame = frame;
  verdict.unit = "1";
  verdict.bound_source = kBoundSource;
  verdict.checked = 1;
  return verdict;
}

// Where the stage moves nothing each of these is zero, and its count would only thin out the step's.
void note_if_any(MeasuredError& error, const ErrorNorm& norm) {
  if (norm.max > 0) error.norm = norm;
}

// Computed fields that the stage must leave unchanged, to the bit. Positions and velocities of living particles are
// measured instead; dead particles keep theirs.
std::optional<DecisionDifference> difference_of_kept(const StageDifference& stage, const State& before,
                                                     const State& after) {
  std::optional<DecisionDifference> found;
  for_each_field([&](const Field& field, auto get) {
    if (found || field.is_decision) return;
    if constexpr (requires { get(before).size(); }) {
      if (field.space == IndexSpace::particle) {
        for (std::size_t i = 0; i < before.alive.size() && !found; ++i) {
          if (before.alive[i] != 0 || same_bits(get(before)[i], get(after)[i])) continue;
          found = DecisionDifference{
              witness_of({{}, {static_cast<int32_t>(i)}}, "particle {} is dead, but {} changed", i, field.text),
              field.name};
        }
        return;
      }
    }
    if ((stage.due && field.changed_by.contains(stage.stage)) || same_bits(get(before), get(after))) return;
    found = DecisionDifference{
        witness_of({}, "{} changed, which {} must leave as it is", field.text, name_of(stage.stage)), field.name};
  });
  return found;
}

}  // namespace

std::vector<int32_t> in_one_only(const std::vector<int32_t>& a, const std::vector<int32_t>& b) {
  std::vector<int32_t> result;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result));
  return result;
}

double body_extent(const Body& body) {
  Vec3 low, high;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    const Vec3 place = rest_in_spacings(body, i);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = i == 0 ? place[axis] : std::min(low[axis], place[axis]);
      high[axis] = i == 0 ? place[axis] : std::max(high[axis], place[axis]);
    }
  }
  return std::max({high.x - low.x, high.y - low.y, high.z - low.z});
}

double position_bound(const Body& body) {
  return body_extent(body) > kLargeBody ? kBoundOfLargeBodies : kPositionsWanted;
}

void Undecidable::join(const Undecidable& other) {
  removals += other.removals;
  otherwise += other.otherwise;
  positions += other.positions;
  rotations += other.rotations;
  inconclusive += other.inconclusive;
}

RestFrameComparison compare_rest_frames(const Setup& setup, const State& state) {
  const Clusters& clusters = state.clusters;
  const WeightedRest rest = weighted_rest(setup.body, clusters);
  RestFrameComparison found;
  int64_t largest = 0;
  double absolute = 0;  // rounding of absolute coordinates
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const ClusterMeans fresh = cluster_means(rest, clusters, rest.position, c);
    found.center.norm.add(norm(clusters.rest_center[at(c)] - fresh.rest) / setup.body.grid.spacing, c);
    found.mass.norm.add(std::abs(clusters.mass[at(c)] - fresh.mass) / fresh.mass, c);
    largest = std::max(largest, clusters.size(c));
    double heaviest = 0;
    for (const int32_t i : clusters.of(c)) heaviest = std::max(heaviest, rest.weight[at(i)]);
    const auto terms = static_cast<double>(clusters.size(c));
    absolute = std::max(absolute, absolute_mean_rounding(state, sum_rounds_at_most(terms, fresh.mass, heaviest)));
  }
  found.center.bound = position_bound(setup.body) + absolute / setup.body.grid.spacing;
  // Each weight carries one rounding, a sum of N positive terms at most N - 1, on both sides; and the state's.
  found.mass.bound = 2 * static_cast<double>(largest + 4) * unit_roundoff(state);
  return found;
}

StageComparison::StageComparison(const Setup& setup, ReferenceStages reference)
    : setup_(setup), reference_(std::move(reference)) {}

StageDifference StageComparison::compare(Stage stage, const State& before, const State& after, bool launched) {
  StageDifference found;
  found.stage = stage;
  found.frame = before.frame;
  found.due =
      before.frame < setup_.frame_count() && is_due(setup_, stage, !before.removed.empty(), before.edge_covered);
  const double bound = position_bound(setup_.body);
  for (const Measure which : {Measure::position, Measure::rotation, Measure::skin}) found.error(which).bound = bound;
  found.error(Measure::velocity).bound = 2 * bound;  // the difference of two positions over dt

  const Verdict form = well_formed(setup_, after);
  if (!form.holds) {
    found.is_readable = false;
    found.decisions.push_back({form.witness});
    return found;
  }
  if (launched != found.due) {
    found.decisions.push_back(
        {witness_of({}, "{}", found.due ? "the stage was due, but did not run" : "the stage ran, but was not due")});
  }
  if (stage == Stage::step && found.due) {
    compare_step(before, after, found);
  } else {
    compare_later_stage(before, after, launched, found);
  }
  if (auto kept = difference_of_kept(found, before, after); kept && found.decisions.empty()) {
    found.decisions.push_back(std::move(*kept));
  }
  return found;
}

void StageComparison::compare_step(const State& before, const State& after, StageDifference& found) {
  found.expected = before;
  State& expected = found.expected;
  reference_[at(static_cast<int>(Stage::step))](setup_, expected);
  if (auto difference = difference_of_decisions(expected, after)) {
    found.decisions.push_back(std::move(*difference));
    found.step = ask(property_named(motion_properties(), "admissible step"), setup_, Stage::step, before, after);
    return;
  }
  StepAgain again = step_again(setup_, before, after);
  found.step = std::move(again.verdict);
  std::vector<uint8_t> measured = before.alive, measured_speed = before.alive;
  const Clusters& clusters = after.clusters;
  if (again.step) {
    AdmissibleStep& step = *again.step;
    found.undecidable.otherwise = step.otherwise;
    found.undecidable.inconclusive = step.inconclusive;
    // How far the reference is from the oracle's outcome: particles [h], velocities [h] times dt, rotations by their
    // farthest member [h].
    const double h = setup_.body.grid.spacing, dt = setup_.substep_length[at(before.frame)];
    std::vector<double> off(measured.size()), fast(measured.size()), turned(at(clusters.count()));
    bool is_elsewhere = step.otherwise > 0;
    for (std::size_t i = 0; i < off.size(); ++i) {
      if (before.alive[i] == 0) continue;
      off[i] = norm(expected.x[i] - step.outcome.x[i]) / h;
      fast[i] = norm(expected.v[i] - step.outcome.v[i]) * dt / h;
      is_elsewhere |= !(off[i] <= step.position_bound[i]) || !(fast[i] <= step.velocity_bound[i]);
    }
    for (int32_t c = 0; c < clusters.count(); ++c) {
      const std::size_t k = at(c);
      turned[k] = step.reach[k] * angle_between(expected.clusters.rotation[k], step.outcome.rotation[k]);
      is_elsewhere |= !(turned[k] <= 2 * step.rotation_bound[k]);
    }
    if (is_elsewhere) {
      // The reference has gone another way; from here on it goes the backend's.
      if (step.otherwise == 0) ++found.undecidable.otherwise;
      expected.x = std::move(step.outcome.x);
      expected.v = std::move(step.outcome.v);
      expected.impulse = step.outcome.impulse;
      expected.clusters.rotation = std::move(step.outcome.rotation);
      for (std::vector<double>* const apart : {&off, &fast, &turned}) std::fill(apart->begin(), apart->end(), 0.0);
    }
    // The backend may be as far from the outcome as rounding takes it, on the other side of it than the reference.
    const double bound = found.error(Measure::position).bound;
    for (std::size_t i = 0; i < measured.size(); ++i) {
      if (before.alive[i] == 0) continue;
      measured[i] = step.position_bound[i] + off[i] <= bound;
      measured_speed[i] = step.velocity_bound[i] + fast[i] <= 2 * bound;
      if (measured[i] == 0 || measured_speed[i] == 0) ++found.undecidable.positions;
    }
    for (int32_t c = 0; c < clusters.count(); ++c) {
      const double angle = angle_between(expected.clusters.rotation[at(c)], clusters.rotation[at(c)]);
      if (step.rotation_bound[at(c)] + turned[at(c)] > bound) {
        ++found.undecidable.rotations;
        continue;
      }
      found.angle.add(angle, c);
      found.error(Measure::rotation).norm.add(angle * step.reach[at(c)], c);
    }
  }
  found.error(Measure::position).norm = position_error(setup_, expected.x, after.x, measured);
  found.error(Measure::velocity).norm =
      velocity_error(setup_, expected.v, after.v, setup_.substep_length[at(before.frame)], measured_speed);
}

void StageComparison::compare_later_stage(const State& before, const State& after, bool launched,
                                          StageDifference& found) {
  State expected = before;
  if (found.due) reference_[at(static_cast<int>(found.stage))](setup_, expected);
  if (found.stage == Stage::skin) end_frame(expected);

  // Where both remove different particles, the oracle says whether each of them lies within its rounding band. After
  // that the reference goes on with the backend's choice.
  if (found.stage == Stage::detect && found.due) {
    found.removals = in_one_only(expected.removed, after.removed);
    if (!found.removals.empty()) {
      found.detection = detection(setup_, before, after);
      if (found.detection->holds) found.undecidable.removals = static_cast<int64_t>(found.removals.size());
      expected.removed = after.removed;
      expected.alive = before.alive;
      for (const int32_t i : after.removed) expected.alive[at(i)] = 0;
    }
  }

  found.sets_are_open = found.stage == Stage::merge && found.due && !promise_of(setup_.merge.rule).unique;
  auto difference = difference_of_decisions(expected, after, found.sets_are_open ? Sets::open : Sets::compared);
  if (found.sets_are_open && !difference) {  // not compared, but they must be one of the rule's answers
    for (const Verdict& promised :
         {merge_legality(setup_, before, after), cap_kept(setup_, before, after), merge_maximality(setup_, after)}) {
      if (!difference && !promised.holds) difference = DecisionDifference{promised.witness};
    }
  }
  for (int32_t c = 0; !difference && !found.sets_are_open && c < after.clusters.count(); ++c) {
    const int32_t cluster = after.clusters.number[at(c)];
    if (expected.clusters.rotation[at(c)] != after.clusters.rotation[at(c)]) {
      difference =
          DecisionDifference{witness_of({{cluster}}, "cluster {} has not the rotation that it inherits", cluster)};
    } else if (expected.clusters.degenerate[at(c)] != after.clusters.degenerate[at(c)]) {
      difference = DecisionDifference{witness_of({{cluster}}, "cluster {} has not the flag that it inherits", cluster)};
    }
  }

  const double dt =
      setup_.substep_length.empty() ? 1 : setup_.substep_length[at(std::min(before.frame, setup_.frame_count() - 1))];
  note_if_any(found.error(Measure::position), position_error(setup_, expected.x, after.x, before.alive));
  note_if_any(found.error(Measure::velocity), velocity_error(setup_, expected.v, after.v, dt, before.alive));
  if (launched && found.stage != Stage::detect && found.stage != Stage::skin && found.stage != Stage::step) {
    const RestFrameComparison rest = compare_rest_frames(setup_, after);
    found.error(Measure::rest_center) = rest.center;
    found.error(Measure::mass) = rest.mass;
  }
  if (found.stage == Stage::skin && found.due && !difference) {
    MeasuredError& skin = found.error(Measure::skin);
    const std::vector<FieldError> errors = errors_of_fields(setup_, expected, after, dt, before.alive);
    skin.norm = error_of(errors, "skin_position");
    // Reaches show in positions, unless a vertex's position and reach disagree.
    if (const ErrorNorm& reach = error_of(errors, "reach"); !(reach.max <= skin.norm.max)) skin.norm = reach;
    // Far from rest, single precision cannot have the required accuracy: then the effect of rounding is the bound.
    for (const VertexPlace& vertex :
         vertex_places(setup_, after, after.skin, memberships_of(after.clusters, setup_.body.particle_count()))) {
      skin.bound = std::max(skin.bound, vertex.bound / setup_.body.grid.spacing);
    }
  }
  if (difference) found.decisions.push_back(std::move(*difference));
  found.expected = std::move(expected);
}

Verdict verdict_of(Measure which, const MeasuredError& error, Stage stage, int64_t frame, const std::string& prefix) {
  const MeasureInfo& info = info_of(which);
  const ErrorNorm& norm = error.norm;
  Verdict verdict = start_verdict(prefix + std::string(info.name), stage, frame);
  verdict.measured = norm.max;
  verdict.bound = error.bound;
  verdict.unit = info.unit;
  verdict.checked = norm.count;
  if (error.holds()) return verdict;
  const Concerned concerned = info.of_clusters ? Concerned{{norm.where}} : Concerned{{}, {norm.where}};
  fail(verdict, concerned, "{} of {} {} are {:.3g} {} from the reference's", info.name,
       info.of_clusters ? "cluster" : "particle", norm.where, norm.max, info.unit);
  return verdict;
}

std::vector<Verdict> StageDifference::verdicts(const std::string& prefix) const {
  std::vector<Verdict> verdicts = {start_verdict(prefix + "topology", stage, frame)};
  if (!decisions.empty()) {
    verdicts.back().measured = static_cast<double>(decisions.size());
    fail(verdicts.back(), decisions.front());
  }
  if (stage == Stage::detect && due) {
    verdicts.push_back(start_verdict(prefix + "removed particles", stage, frame));
    if (detection && !detection->holds) {
      Verdict& removed = verdicts.back();
      removed.holds = false;
      removed.measured = detection->measured;
      removed.bound = detection->bound;
      removed.unit = detection->unit;
      removed.bound_source = detection->bound_source;
      removed.witness = detection->witness;
    }
  }
  if (step) {
    verdicts.push_back(*step);
    verdicts.back().property = prefix + step->property;
  }
  for (std::size_t m = 0; m < errors.size(); ++m) {
    if (errors[m].norm.count == 0) continue;
    verdicts.push_back(verdict_of(static_cast<Measure>(m), errors[m], stage, frame, prefix));
  }
  return verdicts;
}

}  // namespace cutproof::oracles
