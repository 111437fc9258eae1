// Detection (method.md §4): the removals are those that the criterion demands, up to rounding.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "oracles/blade_motion.h"
#include "oracles/checks.h"
#include "oracles/open_edges.h"
#include "oracles/shape_sums.h"
#include "oracles/strain.h"

namespace cutproof::oracles {
namespace {

// d_i: greatest current distance from an alive particle to its neighbours in G, and that neighbour.
struct Stretch {
  double distance = 0;
  int32_t neighbour = -1;
};

Stretch stretch_of(const TissueGraph& graph, const std::vector<Vec3>& x, int32_t i) {
  Stretch stretch;
  for (const int32_t other : graph.neighbours(i)) {
    const double distance = norm(x[at(i)] - x[at(other)]);
    if (distance > stretch.distance || stretch.neighbour < 0) stretch = {distance, other};
  }
  return stretch;
}

// An edge is too long beyond ε times its own rest length: then both of its ends go.
Demand demand_of_distance(const Body& body, const TissueGraph& graph, const State& state, int32_t i, double epsilon) {
  Demand demand = Demand::keep;
  for (const int32_t other : graph.neighbours(i)) demand = std::max(demand, openness(body, state, i, other, epsilon));
  return demand;
}

// From the nearest point of the rectangle to p.
Local beyond_rectangle(const Blade& blade, Local p) {
  return {p.u - std::clamp(p.u, -blade.length / 2, blade.length / 2), p.n, p.w - std::clamp(p.w, 0.0, blade.depth)};
}

double distance_to_rectangle(const Blade& blade, Local p) {
  const Local out = beyond_rectangle(blade, p);
  return std::sqrt(out.u * out.u + out.n * out.n + out.w * out.w);
}

// A lower bound of the distance to the sum of the rectangle at `p` and a way `d`, all in the rectangle's own axes: how
// far the point lies outside of the sum's bounding box along one of them. Off by rounding of coordinates, as the
// distance is.
double least_distance_to_translated(const Blade& blade, Local p, Local d) {
  const auto beyond = [](double start, double rate, double low, double high) {
    return std::max(low + std::min(rate, 0.0) - start, start - (high + std::max(rate, 0.0)));
  };
  return std::max({beyond(p.u, d.u, -blade.length / 2, blade.length / 2), beyond(p.n, d.n, 0, 0),
                   beyond(p.w, d.w, 0, blade.depth)});
}

// Distance to the Minkowski sum of the rectangle and the segment [0, way]: the least over t in [0, 1] of the distance
// to the rectangle moved by t of the way. Its square is convex, because the rectangle is, and falls as long as the way
// goes towards the point; so halving finds where that ends. `p` and `d`: the point from the edge's middle, and the way,
// in the rectangle's own axes.
double distance_to_translated(const Blade& blade, Local p, Local d) {
  const auto seen_at = [&](double t) { return Local{p.u - t * d.u, p.n - t * d.n, p.w - t * d.w}; };
  double low = 0, high = 1;
  while (high - low > 1e-15) {
    const double middle = (low + high) / 2;
    const Local out = beyond_rectangle(blade, seen_at(middle));
    (out.u * d.u + out.n * d.n + out.w * d.w > 0 ? low : high) = middle;
  }
  return std::min({distance_to_rectangle(blade, p), distance_to_rectangle(blade, seen_at(1)),
                   distance_to_rectangle(blade, seen_at(low))});
}

// Ties go to removal, also when rounding lifts them a little: a blade halfway between two layers takes both, because if
// it took none it would not separate them. So the limit is reach · (1 + kTie), and rounding, about 1e-13 of it on a
// body of a thousand spacings, is far inside the band around that.
constexpr double kTie = 1e-9;
constexpr double kSweepBand = 5e-10;

// A turning sweep has no closed form, and a backend may replace it by translations that are off by a little: between
// `reach` and `reach` + kTurningSlack · h either answer is right. The distance to the pose at t changes by at most
// |way| + radius · angle per unit of t, so halving intervals and dropping those that cannot matter finds the answer;
// what is inconclusive when the distance is known to kTurningStep · h is "either".
constexpr double kTurningSlack = 0.1;
constexpr double kTurningStep = 1e-3;

// At t in [0, 1] of its turning move.
double distance_to_turning(const Blade& blade, const BladeMove& move, const Turn& turn, double t, Vec3 x) {
  const BladePose pose = {move.from.edge + t * (move.to.edge - move.from.edge), rotated(move.from.along, turn, t),
                          rotated(move.from.back, turn, t)};
  return distance_to_rectangle(blade, to_local(pose, x - pose.edge));
}

double least_of_turning(const Blade& blade, const BladeMove& move, const Turn& turn, double h, Vec3 x) {
  const double rate = norm(move.to.edge - move.from.edge) + std::hypot(blade.length / 2, blade.depth) * turn.angle;
  const double parts = std::clamp(std::ceil(rate / (2 * kTurningStep * h)), 1.0, 1e6);
  double least = distance_to_turning(blade, move, turn, 0, x);
  for (double part = 1; part <= parts; ++part)
    least = std::min(least, distance_to_turning(blade, move, turn, part / parts, x));
  return least;
}

Demand demand_of_turning(const Blade& blade, const BladeMove& move, const Turn& turn, double h, double reach, Vec3 x) {
  const Vec3 way = move.to.edge - move.from.edge;
  const double rate = norm(way) + std::hypot(blade.length / 2, blade.depth) * turn.angle;
  const double must = reach * (1 + kTie - kSweepBand), most = reach + kTurningSlack * h;
  const auto distance = [&](double t) { return distance_to_turning(blade, move, turn, t, x); };
  Demand demand = Demand::keep;
  struct Interval {
    double middle, half;
  };
  std::vector<Interval> open = {{0.5, 0.5}};
  while (!open.empty()) {
    const auto [middle, half] = open.back();
    open.pop_back();
    const double here = distance(middle);
    if (here <= must) return Demand::remove;
    if (here <= most) demand = Demand::either;
    const double least = here - rate * half;
    if (!(least <= (demand == Demand::keep ? most : must))) continue;
    if (rate * half < kTurningStep * h) {
      demand = Demand::either;
      continue;
    }
    open.push_back({middle - half / 2, half / 2});
    open.push_back({middle + half / 2, half / 2});
  }
  return demand;
}

// All that the blade swept in one frame. Nodes go at a distance of at most max(thickness, h, d_i) / 2: whichever edge
// the blade crosses then loses an end, stretched ones too.
class Swept {
 public:
  Swept(const Setup& setup, int64_t frame) : setup_(setup) {
    const int64_t substeps = setup.step.substeps;
    if (!setup.has_blade || frame >= setup.frame_count()) return;
    for (int64_t s = frame * substeps; s < (frame + 1) * substeps; ++s) {
      const BladeMove& move = setup.blade_moves[at(s)];
      if (!move.down) continue;
      const bool turns = move.from.along != move.to.along || move.from.back != move.to.back;
      const double way = norm(move.to.edge - move.from.edge);
      moves_.push_back({&move, std::hypot(setup.blade.length / 2, setup.blade.depth) + way, turns,
                        turns ? turn_between(move.from, move.to) : Turn{}});
    }
  }

  // How near the blade has to come to a particle for that to go [m].
  double reach_to(double stretch) const {
    return std::max({setup_.blade.thickness, setup_.body.grid.spacing, stretch}) / 2;
  }

  // How near it came to x [m], of a turning sweep to kTurningStep · h: for sentences. Nothing: it is not down.
  std::optional<double> least_distance(Vec3 x) const {
    const Blade& blade = setup_.blade;
    std::optional<double> least;
    for (const auto& [move, extent, turns, turn] : moves_) {
      const Vec3 way = move->to.edge - move->from.edge;
      const double distance =
          turns ? least_of_turning(blade, *move, turn, setup_.body.grid.spacing, x)
                : distance_to_translated(blade, to_local(move->from, x - move->from.edge), to_local(move->from, way));
      least = std::min(least.value_or(distance), distance);
    }
    return least;
  }

  Demand demand_of(double stretch, Vec3 x, double u) const {
    const Blade& blade = setup_.blade;
    const double h = setup_.body.grid.spacing;
    const double reach = reach_to(stretch);
    Demand demand = Demand::keep;
    for (const auto& [move, extent, turns, turn] : moves_) {
      const Vec3 way = move->to.edge - move->from.edge;
      if (norm(x - move->from.edge) > extent + reach + kTurningSlack * h) continue;
      Demand here = Demand::either;
      // A distance between places in the body is rounded as the places are; a backend lengthens its reach by as much,
      // so that ties still go to removal. In double precision this is far below the band.
      const double places = kPlacesBand * u * (reach + norm(x) + norm(move->from.edge));
      if (turns) {
        here = demand_of_turning(blade, *move, turn, h, reach, x);
      } else {
        const double most = reach * (1 + kTie + kSweepBand) + places;
        const Local p = to_local(move->from, x - move->from.edge), d = to_local(move->from, way);
        if (least_distance_to_translated(blade, p, d) > most) continue;
        const double distance = distance_to_translated(blade, p, d);
        if (distance <= reach * (1 + kTie - kSweepBand)) here = Demand::remove;
        if (distance > most) here = Demand::keep;
      }
      if (here == Demand::remove) return here;
      if (here == Demand::either) demand = here;
    }
    return demand;
  }

  std::string in_words(double stretch, Vec3 x) const {
    const double h = setup_.body.grid.spacing, limit = reach_to(stretch) / h;
    const std::optional<double> least = least_distance(x);
    if (!least) return "the blade is not down in this frame";
    const double found = *least / h;
    return sentence("the blade comes within {} h of it, and removes particles within {} h", figure_beside(found, limit),
                    figure_beside(limit, found));
  }

 private:
  struct Move {
    const BladeMove* move;
    double extent;  // nothing of the blade is farther from where the edge's middle began
    bool turns;
    Turn turn;
  };
  const Setup& setup_;
  std::vector<Move> moves_;
};

}  // namespace

void check_detection(const StageRun& run, Verdict& verdict) {
  const Setup& setup = run.setup;
  const State &before = run.before, &after = run.after;
  const TissueGraph graph(setup.body, before.alive);
  const double h = setup.body.grid.spacing;
  const double epsilon = setup.detect.epsilon, u = unit_roundoff(before);
  const Criterion criterion = needs_detection(setup) ? setup.detect.criterion : Criterion::none;
  const Swept swept(setup, criterion == Criterion::geometric ? before.frame : setup.frame_count());
  const std::vector<StrainDemand> strained =
      criterion == Criterion::strain ? demands_of_strain(setup, before) : std::vector<StrainDemand>{};
  const bool one_end = criterion == Criterion::distance && setup.detect.remove != RemovedEnds::both;
  std::vector<int32_t> gone;
  std::vector<uint8_t> is_gone(before.alive.size(), 0);
  for (int32_t i = 0; i < graph.particle_count(); ++i) {
    const bool was = before.alive[at(i)] != 0, is = after.alive[at(i)] != 0;
    if (!was) {
      if (is) violate(verdict, {{}, {i}}, "particle {} was dead and is alive again", i);
      continue;
    }
    ++verdict.checked;
    if (!is) {
      gone.push_back(i);
      is_gone[at(i)] = 1;
    }
    if (one_end) continue;
    const Stretch stretch = stretch_of(graph, before.x, i);
    const Demand demand = criterion == Criterion::distance ? demand_of_distance(setup.body, graph, before, i, epsilon)
                          : criterion == Criterion::geometric ? swept.demand_of(stretch.distance, before.x[at(i)], u)
                          : criterion == Criterion::strain    ? strained[at(i)].demand
                                                              : Demand::keep;
    if (demand == Demand::either || (demand == Demand::remove) == !is) continue;
    std::vector<int32_t> particles = {i};
    if (stretch.neighbour >= 0) particles.push_back(stretch.neighbour);
    // Of the first one only, which is the witness: each looks at the whole sweep.
    std::string why;
    if (verdict.holds && criterion == Criterion::distance && stretch.neighbour < 0) {
      why = "it has no living neighbour";
    } else if (verdict.holds && criterion == Criterion::distance) {
      why = sentence("it is {} h from its farthest neighbour, and edges beyond {} times their rest length are cut",
                     figure_beside(stretch.distance / h, epsilon), figure_beside(epsilon, stretch.distance / h));
    } else if (verdict.holds && criterion == Criterion::geometric) {
      why = swept.in_words(stretch.distance, before.x[at(i)]);
    } else if (verdict.holds && criterion == Criterion::strain) {
      const double found = strained[at(i)].stretch, limit = setup.detect.strain;
      why = sentence("the greatest stretch of its clusters is {}, and the limit is {}", figure_beside(found, limit),
                     figure_beside(limit, found));
    } else if (verdict.holds) {
      why = "nothing is ever removed in this scene";
    }
    violate(verdict, {{}, particles}, "particle {} {} removed, but should {}have been: {}", i, is ? "was not" : "was",
            is ? "" : "not ", why);
  }
  if (one_end) OneEndOfEach(setup, graph, before, run.known_rotations).judge(is_gone, verdict);
  if (const auto wrong = first_in_one_only(gone, after.removed)) {
    violate(verdict, {{}, {wrong->element}}, "particle {} {}", wrong->element,
            wrong->in_second ? "is listed as removed, but did not die in this stage"
                             : "died, but is not listed as removed");
  }
}

}  // namespace cutproof::oracles
