// No tissue stands across the blade (method.md §3, Blade: lemma of the dynamic cut).
#include <fmt/format.h>

#include <algorithm>

#include "model/rules.h"
#include "oracles/blade_motion.h"
#include "oracles/checks.h"

namespace cutproof::oracles {
namespace {

// Whether the closed segment meets the closed rectangle |u| <= length / 2, 0 <= w <= depth, n = 0. No band is needed:
// both ends of an edge keep the distance ρ from the rectangle, and an edge of G is shorter than 2ρ / 1.001. So an edge
// that obeys the lemma misses the rectangle by far more than rounding.
bool crosses(const Blade& blade, Local p, Local q) {
  if ((p.n > 0 && q.n > 0) || (p.n < 0 && q.n < 0)) return false;
  double low = 0, high = 1;  // the part of the segment that lies in the rectangle's plane and slabs
  const auto clip = [&](double a, double b, double least, double most) {
    if (a == b) {
      if (a < least || a > most) high = -1;
      return;
    }
    const double t0 = (least - a) / (b - a), t1 = (most - a) / (b - a);
    low = std::max(low, std::min(t0, t1));
    high = std::min(high, std::max(t0, t1));
  };
  if (p.n != q.n) low = high = p.n / (p.n - q.n);
  const double t = low;
  clip(p.u, q.u, -blade.length / 2, blade.length / 2);
  clip(p.w, q.w, 0, blade.depth);
  // For a segment through the plane the clipped interval must still hold the point in the plane.
  return p.n != q.n ? low <= t && t <= high : low <= high;
}

}  // namespace

void check_no_pass(Judged& judged, Verdict& verdict) {
  const Setup& setup = judged.setup;
  const State& state = judged.state;
  const auto vacuous = [&](const char* why) { verdict.vacuous = why; };
  if (!setup.has_blade) return vacuous("no blade");
  // Only where particles keep their distance from the blade *and* stretched ones are removed does the lemma hold.
  if (!promise_of(setup.detect.criterion).keeps_blade_out) return vacuous("the criterion does not promise it");
  if (setup.step.substeps < 1 || state.frame >= setup.frame_count()) return vacuous("the schedule is over");
  const int64_t substep = (state.frame + 1) * setup.step.substeps - 1;
  if (!setup.blade_moves[at(substep)].down) return vacuous("the blade is up");
  const BladePose& pose = setup.blade_moves[at(substep)].to;
  const int32_t n = judged.body.particle_count();
  std::vector<uint8_t> held(at(n), 0);
  for (const Grip& grip : setup.grips) {
    if (grip.active[at(substep)] == 0) continue;
    for (const int32_t i : grip.particles) held[at(i)] = 1;
  }
  std::vector<Local> local(at(n));
  for (int32_t i = 0; i < n; ++i) local[at(i)] = to_local(pose, state.x[at(i)] - pose.edge);
  for (int32_t i = 0; i < n; ++i) {
    if (!judged.alive(i) || held[at(i)] != 0) continue;
    for (const int32_t other : judged.graph.upper_neighbours(i)) {
      if (held[at(other)] != 0) continue;
      // The blade keeps a distance that edges no longer than h cannot reach across; longer ones may.
      if (judged.body.rest_length(i, other) > judged.body.grid.spacing * (1 + 1e-9)) continue;
      ++verdict.checked;
      if (!crosses(setup.blade, local[at(i)], local[at(other)])) continue;
      violate(verdict, {{}, {i, other}, {i, other}},
              "the edge from particle {} to {}, {:.6g} h long, crosses the blade", i, other,
              norm(state.x[at(i)] - state.x[at(other)]) / judged.body.grid.spacing);
    }
  }
}

}  // namespace cutproof::oracles
