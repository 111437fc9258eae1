#include "report/beside.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "model/at.h"
#include "model/fields.h"

namespace cutproof::report {

uint8_t code_of(double distance) {
  if (distance == 0) return 0;
  if (!std::isfinite(distance)) return kIncomparable;
  return static_cast<uint8_t>(std::clamp(std::lround(4 * (std::log10(distance) + 18)), 1L, 250L));
}

Apart apart_of(const State& one, const State& other, double spacing) {
  Apart apart;
  const std::size_t n = std::min(one.x.size(), other.x.size());
  apart.codes.resize(n);
  double squares = 0;
  int64_t count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (one.alive[i] != other.alive[i]) {
      apart.codes[i] = kIncomparable;
      continue;
    }
    if (one.alive[i] == 0) continue;
    // Two that are equal to the bit are not apart, even where they are no places.
    double distance = same_bits(one.x[i], other.x[i]) ? 0 : norm(one.x[i] - other.x[i]) / spacing;
    if (!std::isfinite(distance)) distance = std::numeric_limits<double>::infinity();
    apart.codes[i] = code_of(distance);
    squares += distance * distance;
    ++count;
    if (apart.where < 0 || distance > apart.max) {
      apart.max = distance;
      apart.where = static_cast<int32_t>(i);
    }
  }
  if (count > 0) apart.rms = std::sqrt(squares / static_cast<double>(count));
  const bool is_alive_alike = one.alive == other.alive;
  const bool is_clustered_alike =
      one.clusters.offsets == other.clusters.offsets && one.clusters.members == other.clusters.members;
  const bool is_skin_alike = one.skin.triangles == other.skin.triangles;
  apart.is_decision = !is_alive_alike || !is_clustered_alike || !is_skin_alike;
  apart.differs = !is_alive_alike       ? "which particles are there"
                  : !is_clustered_alike ? "which particles lie in which clusters"
                  : !is_skin_alike      ? "the triangles of the skin"
                  : apart.max > 0       ? "positions"
                                        : "";
  return apart;
}

namespace {

// In time: the start before all else.
std::tuple<bool, int64_t, Stage> when(const Moment& moment) {
  return {!moment.is_start, moment.is_start ? 0 : moment.frame, moment.is_start ? Stage::step : moment.stage};
}

}  // namespace

std::vector<Together> together(const std::vector<Moment>& own, const std::vector<Moment>& other, bool is_shown) {
  using When = std::tuple<bool, int64_t, Stage>;
  struct Sides {
    int64_t own = -1, other = -1;
    Moment moment;
  };
  std::map<When, Sides> all;
  // Frames of which a run has more than the end: a stage of which it has no snapshot there had nothing to do.
  std::set<int64_t> own_in_stages, other_in_stages;
  for (const Moment& moment : own) {
    Sides& sides = all[when(moment)];
    sides.own = moment.snapshot;
    sides.moment = moment;
    if (!moment.is_start && moment.stage != Stage::skin) own_in_stages.insert(moment.frame);
  }
  for (const Moment& moment : other) {
    if (!is_shown && all.count(when(moment)) == 0) continue;
    Sides& sides = all[when(moment)];
    sides.other = moment.snapshot;
    if (sides.own < 0) sides.moment = moment;
    if (!moment.is_start && moment.stage != Stage::skin) other_in_stages.insert(moment.frame);
  }
  std::vector<Together> found;
  int64_t last_own = 0, last_other = 0;
  for (const auto& [key, sides] : all) {
    if (sides.own >= 0) last_own = sides.own;
    if (sides.other >= 0) last_other = sides.other;
    const int64_t frame = sides.moment.frame;
    const bool has_own = sides.own >= 0 || own_in_stages.count(frame) != 0;
    const bool has_other = sides.other >= 0 || (is_shown && other_in_stages.count(frame) != 0);
    found.push_back({sides.moment, last_own, last_other, sides.own >= 0, sides.other >= 0, has_own && has_other});
    found.back().moment.snapshot = last_own;
  }
  return found;
}

Comparison compare(const Source& own, const Beside& beside, const std::vector<Together>& moments) {
  Comparison comparison;
  for (const Together& one : moments) {
    if (!one.is_comparable) continue;
    ++comparison.compared;
    const Apart apart =
        apart_of(own.snapshot(one.own).state, beside.source.snapshot(one.other).state, own.setup.body.grid.spacing);
    const FirstApart here = {one.moment, apart.differs, apart.max};
    if (!apart.differs.empty() && !comparison.any) comparison.any = here;
    if (apart.is_decision && !comparison.decision) comparison.decision = here;
    if (apart.max > (comparison.greatest ? comparison.greatest->max : 0)) comparison.greatest = here;
  }
  return comparison;
}

std::vector<Moment> moments_of(const Source& source) {
  std::vector<Moment> moments;
  for (int64_t i = 0; i < source.count; ++i) {
    const io::Snapshot snapshot = source.snapshot(i);
    const bool is_end = snapshot.stage == Stage::skin;
    const bool is_start = i == 0 && !source.is_foreign();
    moments.push_back({i, snapshot.state.frame - (!is_start && is_end ? 1 : 0), snapshot.stage, is_start});
  }
  return moments;
}

}  // namespace cutproof::report
