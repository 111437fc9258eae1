// Oracles of one stage: the state before it and after it. Each asks whether the answer is right, not how it was found.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>

#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

// --- Detection -------------------------------------------------------------------------------------------------------

// d_i: greatest current distance from an alive particle to its neighbours in G, and that neighbour.
struct Stretch {
  double distance = 0;
  int32_t neighbour = -1;
};

Stretch stretch_of(const TissueGraph& graph, const std::vector<Vec3>& x, int32_t i) {
  Stretch stretch;
  for (int direction = 0; direction < 6; ++direction) {
    const int32_t other = graph.neighbour(i, direction);
    if (other < 0) continue;
    const Vec3 d = x[at(i)] - x[at(other)];
    const double square = dot(d, d);
    if (square > stretch.distance || stretch.neighbour < 0) stretch = {square, other};
  }
  stretch.distance =
      std::sqrt(stretch.distance);  // the root ascends: of the greatest square it is the greatest distance
  return stretch;
}

enum class Demand { keep, either, remove };

// Rounding band of d_i > εh, with u the unit roundoff of what is judged. From the stored positions: each difference is
// off by u relative to itself, its square by 3u, their sum by at most 5u, and the root by 2.5u + u. So every way to
// compute d_i in double is off by at most 4u d_i, every way to compute εh by u (squared and compared: 3u on
// squares, 1.5u here). What is compared here has the same errors once more: 2 (4u + 2u) = 12u; 16u leaves room for the
// terms of second order.
constexpr double kStretchBand = 16;  // [u]

Demand demand_of_distance(double distance, double limit, double u) {
  if (distance > limit * (1 + kStretchBand * u)) return Demand::remove;
  if (distance < limit * (1 - kStretchBand * u)) return Demand::keep;
  return Demand::either;
}

// --- The swept mid-surface -------------------------------------------------------------------------------------------

// The rectangle's own axes: u along the cutting edge, w from the edge to the back, n along the normal.
struct Local {
  double u = 0, n = 0, w = 0;
};

Local to_local(const BladePose& pose, Vec3 d) {
  return {dot(d, pose.along), dot(d, cross(pose.along, pose.back)), dot(d, pose.back)};
}

double distance_to_rectangle(const Blade& blade, Local p) {
  const double du = p.u - std::clamp(p.u, -blade.length / 2, blade.length / 2);
  const double dw = p.w - std::clamp(p.w, 0.0, blade.depth);
  return std::sqrt(du * du + p.n * p.n + dw * dw);
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

// Distance to the Minkowski sum of the rectangle and the segment [0, way]: the minimum over u, w, t of a convex
// quadratic in a box. For a given t the best u and w are clamped coordinates, because the axes are orthogonal; what is
// left is convex and piecewise quadratic in t, and changes its pieces where a coordinate starts or stops to be clamped.
// So it is exact: the least over the pieces' ends and over each piece's own stationary point.
// `p` and `d`: the point from the edge's middle, and the way, in the rectangle's own axes.
double distance_to_translated(const Blade& blade, Local p, Local d) {
  const auto place = [&](double t) { return Local{p.u - t * d.u, p.n - t * d.n, p.w - t * d.w}; };
  std::array<double, 6> ends = {0, 1};  // ascending
  std::size_t count = 2;
  const auto add_end = [&](double start, double rate, double bound) {
    if (rate == 0) return;
    const double t = (start - bound) / rate;
    if (!(t > 0 && t < 1)) return;
    std::size_t k = count++;
    for (; ends[k - 1] > t; --k) ends[k] = ends[k - 1];
    ends[k] = t;
  };
  add_end(p.u, d.u, -blade.length / 2);
  add_end(p.u, d.u, blade.length / 2);
  add_end(p.w, d.w, 0);
  add_end(p.w, d.w, blade.depth);

  double least = distance_to_rectangle(blade, place(0));
  for (std::size_t k = 1; k < count; ++k) {
    least = std::min(least, distance_to_rectangle(blade, place(ends[k])));
    // Within the piece the clamped coordinates are out, n always counts: minimise Σ (start - t rate)² over them.
    const Local middle = place((ends[k - 1] + ends[k]) / 2);
    double numerator = p.n * d.n, denominator = d.n * d.n;
    const auto count_in = [&](double at_middle, double start, double rate, double low, double high) {
      if (at_middle >= low && at_middle <= high) return;
      const double bound = at_middle < low ? low : high;
      numerator += (start - bound) * rate;
      denominator += rate * rate;
    };
    count_in(middle.u, p.u, d.u, -blade.length / 2, blade.length / 2);
    count_in(middle.w, p.w, d.w, 0, blade.depth);
    if (denominator == 0) continue;
    const double t = std::clamp(numerator / denominator, ends[k - 1], ends[k]);
    least = std::min(least, distance_to_rectangle(blade, place(t)));
  }
  return least;
}

struct Turn {
  Vec3 axis = {0, 0, 1};
  double angle = 0;
};

// The rotation that takes one orthonormal pose to another.
Turn turn_between(const BladePose& from, const BladePose& to) {
  const std::array<Vec3, 3> a = {from.along, from.back, cross(from.along, from.back)};
  const std::array<Vec3, 3> b = {to.along, to.back, cross(to.along, to.back)};
  Mat3 r;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      r(row, column) = 0;
      for (std::size_t k = 0; k < 3; ++k) r(row, column) += b[k][row] * a[k][column];
    }
  }
  const Vec3 sine = {r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)};
  Turn turn;
  turn.angle = std::atan2(norm(sine), r(0, 0) + r(1, 1) + r(2, 2) - 1);
  if (norm(sine) > 1e-8) {
    turn.axis = normalized(sine);
  } else if (turn.angle > 1) {  // half a turn: R + 1 = 2 a aᵀ, so its longest column is along the axis
    Vec3 longest;
    for (int column = 0; column < 3; ++column) {
      Vec3 v = {r(0, column), r(1, column), r(2, column)};
      v[column] += 1;
      if (norm(v) > norm(longest)) longest = v;
    }
    turn.axis = normalized(longest);
  }
  return turn;
}

Vec3 rotated(Vec3 v, const Turn& turn, double fraction) {
  const double angle = fraction * turn.angle;
  return std::cos(angle) * v + std::sin(angle) * cross(turn.axis, v) +
         (1 - std::cos(angle)) * dot(turn.axis, v) * turn.axis;
}

// Ties go to removal, also when rounding lifts them a little: a blade halfway between two layers takes both, because if
// it took none it would not separate them. So the limit is reach · (1 + kTie), and rounding, about 1e-13 of it on a
// body of a thousand spacings, is far inside the band around that.
constexpr double kTie = 1e-9;
constexpr double kSweepBand = 5e-10;
constexpr double kPlacesBand = 32;  // [u]: twice the lengthening of 16 u reach + 12 u (|x| + |edge|), and rounding

// A turning sweep has no closed form, and a backend may replace it by translations that are off by a little: between
// `reach` and `reach` + kTurningSlack · h either answer is right. The distance to the pose at t changes by at most
// |way| + radius · angle per unit of t, so halving intervals and dropping those that cannot matter finds the answer;
// what is undecided when the distance is known to kTurningStep · h is "either".
constexpr double kTurningSlack = 0.1;
constexpr double kTurningStep = 1e-3;

Demand demand_of_turning(const Blade& blade, const BladeMove& move, const Turn& turn, double h, double reach, Vec3 x) {
  const Vec3 way = move.to.edge - move.from.edge;
  const double rate = norm(way) + std::hypot(blade.length / 2, blade.depth) * turn.angle;
  const double must = reach * (1 + kTie - kSweepBand), most = reach + kTurningSlack * h;
  const auto distance = [&](double t) {
    const BladePose pose = {move.from.edge + t * way, rotated(move.from.along, turn, t),
                            rotated(move.from.back, turn, t)};
    return distance_to_rectangle(blade, to_local(pose, x - pose.edge));
  };
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

  Demand demand_of(double stretch, Vec3 x, double u) const {
    const Blade& blade = setup_.blade;
    const double h = setup_.body.grid.spacing;
    const double reach = std::max({blade.thickness, h, stretch}) / 2;
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

Verdict check_detection(const Setup& setup, const State& before, const State& after) {
  Verdict verdict = start_verdict("detection", after, "1", "method.md §4; docs/oracles.md, Rounding");
  const TissueGraph graph(setup.body, before.alive);
  const double h = setup.body.grid.spacing;
  const double limit = setup.detect.epsilon * h;
  const Criterion criterion = needs_detection(setup) ? setup.detect.criterion : Criterion::none;
  const Swept swept(setup, criterion == Criterion::geometric ? before.frame : setup.frame_count());
  std::vector<int32_t> gone;
  for (int32_t i = 0; i < graph.particle_count(); ++i) {
    const bool was = before.alive[at(i)] != 0, is = after.alive[at(i)] != 0;
    if (!was) {
      if (is) violate(verdict, fmt::format("particle {} was dead and is alive again", i), {}, {i});
      continue;
    }
    ++verdict.checked;
    if (!is) gone.push_back(i);
    const Stretch stretch = stretch_of(graph, before.x, i);
    Demand demand = Demand::keep;
    switch (criterion) {
      case Criterion::none:
        break;
      case Criterion::distance:
        demand = demand_of_distance(stretch.distance, limit, unit_roundoff(before));
        break;
      case Criterion::geometric:
        demand = swept.demand_of(stretch.distance, before.x[at(i)], unit_roundoff(before));
        break;
      case Criterion::strain:
        demand = Demand::either;
        break;
    }
    if (demand == Demand::either || (demand == Demand::remove) == !is) continue;
    std::vector<int32_t> particles = {i};
    if (stretch.neighbour >= 0) particles.push_back(stretch.neighbour);
    violate(verdict,
            fmt::format("particle {} {} removed, but should {}have been: its greatest neighbour distance is "
                        "{:.17g} h{}",
                        i, is ? "was not" : "was", is ? "" : "not ", stretch.distance / h,
                        criterion == Criterion::distance ? fmt::format(", epsilon = {}", setup.detect.epsilon) : ""),
            {}, particles);
  }
  if (gone != after.removed) {
    const auto [mine, listed] = std::mismatch(gone.begin(), gone.end(), after.removed.begin(), after.removed.end());
    const bool lists_more = mine == gone.end() || (listed != after.removed.end() && *listed < *mine);
    const int32_t first = lists_more ? *listed : *mine;
    violate(verdict,
            fmt::format("particle {} {}", first,
                        lists_more ? "is listed as removed, but did not die in this stage"
                                   : "died, but is not listed as removed"),
            {}, {first});
  }
  return verdict;
}

// --- Split -----------------------------------------------------------------------------------------------------------

// What must come out of a split, found from the definition.
struct ExpectedCluster {
  int64_t number = 0;  // may leave the range of numbers, and then no cluster can have it
  int32_t parent = 0;  // index of the cluster it comes from
  bool lost = false;   // whether that one lost a particle
  std::vector<int32_t> members;
};

// The components of what is left alive of one cluster, in the order of their smallest particles. `mark` [n] is
// scratch, -1 wherever it is not in use.
std::vector<std::vector<int32_t>> components_within(const TissueGraph& graph, std::span<const int32_t> members,
                                                    std::vector<int32_t>& mark) {
  std::vector<int32_t> left;
  for (const int32_t i : members) {
    if (graph.alive(i)) left.push_back(i);
  }
  std::sort(left.begin(), left.end());
  left.erase(std::unique(left.begin(), left.end()), left.end());
  DisjointSets sets(static_cast<int64_t>(left.size()));
  for (std::size_t k = 0; k < left.size(); ++k) mark[at(left[k])] = static_cast<int32_t>(k);
  for (std::size_t k = 0; k < left.size(); ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      const int32_t other = graph.neighbour(left[k], 2 * axis);
      if (other >= 0 && mark[at(other)] >= 0) sets.unite(static_cast<int32_t>(k), mark[at(other)]);
    }
  }
  for (const int32_t i : left) mark[at(i)] = -1;
  std::vector<std::vector<int32_t>> components;
  std::vector<std::size_t> component_of(left.size());
  for (std::size_t k = 0; k < left.size(); ++k) {
    const auto root = at(sets.find(static_cast<int32_t>(k)));
    if (root == k) {
      component_of[k] = components.size();
      components.emplace_back();
    } else {
      component_of[k] = component_of[root];
    }
    components[component_of[k]].push_back(left[k]);
  }
  return components;
}

std::vector<ExpectedCluster> expected_split(const TissueGraph& graph, const Clusters& before) {
  std::vector<ExpectedCluster> expected, separated;
  std::vector<int32_t> mark(at(graph.particle_count()), -1);
  for (int32_t c = 0; c < before.count(); ++c) {
    const auto members = before.of(c);
    const bool lost = std::any_of(members.begin(), members.end(), [&](int32_t i) { return !graph.alive(i); });
    if (!lost) {
      expected.push_back({before.number[at(c)], c, false, {members.begin(), members.end()}});
      continue;
    }
    auto components = components_within(graph, members, mark);
    for (std::size_t k = 0; k < components.size(); ++k) {
      (k == 0 ? expected : separated).push_back({before.number[at(c)], c, true, std::move(components[k])});
    }
  }
  int64_t next = before.count() == 0 ? 0 : int64_t{before.number.back()} + 1;
  for (ExpectedCluster& cluster : separated) {
    cluster.number = next++;
    expected.push_back(std::move(cluster));
  }
  return expected;
}

// Why a cluster is not the one that was expected under its number.
Witness difference_of_sets(int32_t number, const std::vector<int32_t>& expected, std::span<const int32_t> found,
                           const std::vector<int32_t>& component_of_parent) {
  std::vector<int32_t> sorted(found.begin(), found.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<int32_t> surplus, missing;
  std::set_difference(sorted.begin(), sorted.end(), expected.begin(), expected.end(), std::back_inserter(surplus));
  std::set_difference(expected.begin(), expected.end(), sorted.begin(), sorted.end(), std::back_inserter(missing));
  if (!surplus.empty()) {
    const int32_t i = surplus.front(), home = expected.front();
    if (component_of_parent[at(i)] >= 0) {
      return {{number},
              {home, i},
              {},
              fmt::format("cluster {} holds particles {} and {}, which lie in different components of what is left of "
                          "the old cluster",
                          number, home, i)};
    }
    return {{number}, {i}, {}, fmt::format("cluster {} holds particle {}, which does not belong to it", number, i)};
  }
  if (!missing.empty()) {
    return {{number},
            {missing.front(), expected.front()},
            {},
            fmt::format("cluster {} lacks particle {}, which is connected to its particle {} within the old cluster",
                        number, missing.front(), expected.front())};
  }
  return {{number}, {}, {}, fmt::format("the members of cluster {} are not in ascending order", number)};
}

void check_debris(const Setup& setup, const State& before, const State& after, Verdict& verdict) {
  std::vector<int32_t> debris;
  const TissueGraph graph(setup.body, before.alive);
  const int32_t n = graph.particle_count();
  if (setup.split.debris > 0) {
    const Partition components = components_of_graph(graph);
    std::vector<int32_t> size(at(components.count), 0);
    for (const int32_t label : components.label) {
      if (label >= 0) ++size[at(label)];
    }
    for (int32_t i = 0; i < n; ++i) {
      if (graph.alive(i) && size[at(components.label[at(i)])] < setup.split.debris) debris.push_back(i);
    }
  }
  if (debris != after.debris) {
    const auto [mine, listed] = std::mismatch(debris.begin(), debris.end(), after.debris.begin(), after.debris.end());
    const bool lists_more = mine == debris.end() || (listed != after.debris.end() && *listed < *mine);
    const int32_t first = lists_more ? *listed : *mine;
    violate(verdict,
            fmt::format("particle {} {} listed as debris; debris are the components of fewer than {} particles", first,
                        lists_more ? "must not be" : "must be", setup.split.debris),
            {}, {first});
  }
  std::size_t next = 0;
  for (int32_t i = 0; i < n; ++i) {
    while (next < debris.size() && debris[next] < i) ++next;
    const bool vanishes = next < debris.size() && debris[next] == i;
    const bool expected = before.alive[at(i)] != 0 && !vanishes;
    if (expected == (after.alive[at(i)] != 0)) continue;
    violate(verdict, fmt::format("particle {} should be {} after the split", i, expected ? "alive" : "dead"), {}, {i});
  }
}

Verdict check_split(const Setup& setup, const State& before, const State& after) {
  Verdict verdict = start_verdict("split exactness", after, "1", "method.md §5");
  check_debris(setup, before, after, verdict);
  verdict.checked = before.clusters.count();
  // From the particles that are alive after the stage; if those are wrong, the witness says so already.
  const TissueGraph graph(setup.body, after.alive);
  const std::vector<ExpectedCluster> expected = expected_split(graph, before.clusters);
  const Clusters& found = after.clusters;
  std::vector<int32_t> component_of_parent(at(graph.particle_count()), -1);

  // Both are in the order of numbers, so walk along both.
  std::size_t e = 0;
  int32_t f = 0;
  while (e < expected.size() || f < found.count()) {
    const bool missing = f >= found.count() || (e < expected.size() && expected[e].number < found.number[at(f)]);
    if (missing) {
      const ExpectedCluster& cluster = expected[e++];
      std::vector<int32_t> first;
      if (!cluster.members.empty()) first.push_back(cluster.members.front());
      violate(
          verdict,
          fmt::format("cluster {} is missing: it holds {} particles{}, {} of cluster {}", cluster.number,
                      cluster.members.size(),
                      cluster.members.empty() ? "" : fmt::format(", the smallest {}", cluster.members.front()),
                      cluster.lost ? "a component of what is left" : "all", before.clusters.number[at(cluster.parent)]),
          {static_cast<int32_t>(cluster.number)}, first);
      continue;
    }
    const int32_t number = found.number[at(f)];
    const auto members = found.of(f);
    if (e >= expected.size() || number < expected[e].number) {
      std::vector<int32_t> particles;
      if (!members.empty()) particles.push_back(members.front());
      violate(verdict, fmt::format("cluster {} comes from nowhere", number), {number}, particles);
      ++f;
      continue;
    }
    const ExpectedCluster& cluster = expected[e];
    if (!std::equal(members.begin(), members.end(), cluster.members.begin(), cluster.members.end())) {
      Witness witness;
      if (verdict.holds) {
        for (const int32_t i : before.clusters.of(cluster.parent)) {
          if (graph.alive(i)) component_of_parent[at(i)] = cluster.parent;
        }
        witness = cluster.members.empty()
                      ? Witness{{number}, {}, {}, fmt::format("cluster {} was empty and is not", number)}
                      : difference_of_sets(number, cluster.members, members, component_of_parent);
      }
      violate(verdict, witness);
    } else if (!same_bits(found.rotation[at(f)], before.clusters.rotation[at(cluster.parent)]) ||
               found.degenerate[at(f)] != before.clusters.degenerate[at(cluster.parent)]) {
      violate(verdict,
              fmt::format("cluster {} did not inherit the rotation of cluster {}", number,
                          before.clusters.number[at(cluster.parent)]),
              {number});
    }
    ++e;
    ++f;
  }
  return verdict;
}

// --- Merge -----------------------------------------------------------------------------------------------------------

// Finds out from the sets alone which clusters of the input became which cluster of the result. A number of the
// result is the number of one of its inputs, and a cluster is used once, so an input whose number survives belongs to
// that result. The others vanished; each must lie in some result. An input that lies in a result never hurts it: the
// union stays the same, and it touches whatever covers it. So a vanished input matters only to results that need it,
// either to hold a particle that nothing else explains or to link others; and only among those is there a choice.
class MergeDecomposition {
 public:
  MergeDecomposition(const TissueGraph& graph, const Clusters& before, const Clusters& after, const State& limits)
      : graph_(graph),
        before_(before),
        after_(after),
        tau_(limits.tau),
        cap_(limits.cap),
        result_of_(at(before.count()), -1),
        kept_(at(after.count()), -1),
        given_(at(after.count())),
        holder_(at(graph.particle_count()), -1) {}

  void judge(Verdict& verdict) {
    match_numbers(verdict);
    find_candidates(verdict);
    if (!verdict.holds) return;  // without these an assignment has no meaning
    assign(verdict);
    check_sizes(verdict);
  }

 private:
  int32_t number_before(int32_t c) const { return before_.number[at(c)]; }

  // kept_: the input whose number a result keeps. result_of_ of such an input is that result.
  void match_numbers(Verdict& verdict) {
    for (int32_t r = 0; r < after_.count(); ++r) {
      const int32_t number = after_.number[at(r)];
      const auto place = std::lower_bound(before_.number.begin(), before_.number.end(), number);
      if (place == before_.number.end() || *place != number) {
        violate(verdict, fmt::format("cluster {} has a number that no cluster had before", number), {number});
        continue;
      }
      const auto c = static_cast<int32_t>(place - before_.number.begin());
      kept_[at(r)] = c;
      result_of_[at(c)] = r;
      if (!same_bits(after_.rotation[at(r)], before_.rotation[at(c)]) ||
          after_.degenerate[at(r)] != before_.degenerate[at(c)]) {
        violate(verdict, fmt::format("cluster {} did not keep its rotation", number), {number});
      }
    }
  }

  // For each input the results that contain it: the one with its number must; a vanished one needs at least one.
  void find_candidates(Verdict& verdict) {
    const Memberships memberships = memberships_of(after_, graph_.particle_count());
    std::vector<int64_t> shared(at(after_.count()), 0);
    std::vector<int32_t> met;
    candidates_.resize(at(before_.count()));
    for (int32_t c = 0; c < before_.count(); ++c) {
      if (result_of_[at(c)] >= 0 && is_unchanged(result_of_[at(c)]))
        continue;  // and whom else it lies in matters to none
      met.clear();
      int32_t lonely = -1;  // a particle that no result with which c shares the others holds
      for (const int32_t i : before_.of(c)) {
        if (memberships.of(i).empty()) lonely = i;
        for (const int32_t r : memberships.of(i)) {
          if (shared[at(r)]++ == 0) met.push_back(r);
        }
      }
      for (const int32_t r : met) {
        if (shared[at(r)] == before_.size(c)) candidates_[at(c)].push_back(r);
      }
      const int32_t r = result_of_[at(c)];
      if (r >= 0 && shared[at(r)] != before_.size(c)) {
        violate(verdict, fmt::format("cluster {} lost particle {}", number_before(c), first_outside(c, r)),
                {number_before(c)}, {first_outside(c, r)});
      } else if (r < 0 && candidates_[at(c)].empty()) {
        violate(verdict, fmt::format("cluster {} is lost: no cluster holds all of its particles", number_before(c)),
                {number_before(c)}, {lonely >= 0 ? lonely : first_of(c)});
      } else if (r < 0 && before_.size(c) >= tau_) {
        violate(verdict,
                fmt::format("cluster {} was merged away, but with {} particles it is not small (tau = {})",
                            number_before(c), before_.size(c), tau_),
                {number_before(c), after_.number[at(candidates_[at(c)].front())]});
      }
      for (const int32_t k : met) shared[at(k)] = 0;
    }
  }

  int32_t first_of(int32_t c) const { return before_.size(c) > 0 ? before_.of(c).front() : -1; }
  int32_t first_outside(int32_t c, int32_t r) const {
    const auto members = after_.of(r);
    for (const int32_t i : before_.of(c)) {
      if (std::find(members.begin(), members.end(), i) == members.end()) return i;
    }
    return -1;
  }

  // The result is the input whose number it keeps, to the bit.
  bool is_unchanged(int32_t r) const {
    const auto now = after_.of(r), then = before_.of(kept_[at(r)]);
    return std::equal(now.begin(), now.end(), then.begin(), then.end());
  }

  // Whether `inputs` explain result r: their union is r, and they touch each other. If not, says why.
  bool explains(int32_t r, const std::vector<int32_t>& inputs, Witness* why) {
    const auto members = after_.of(r);
    DisjointSets touching(static_cast<int64_t>(inputs.size()));
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      for (const int32_t i : before_.of(inputs[k])) {
        if (holder_[at(i)] < 0) holder_[at(i)] = static_cast<int32_t>(k);
        touching.unite(holder_[at(i)], static_cast<int32_t>(k));
      }
    }
    const int32_t number = after_.number[at(r)];
    bool explained = true;
    for (const int32_t i : members) {
      if (holder_[at(i)] >= 0) continue;
      explained = false;
      if (why != nullptr) {
        *why = {{number},
                {i},
                {},
                fmt::format("cluster {} holds particle {}, which no cluster that could have been merged into it held",
                            number, i)};
      }
      break;
    }
    if (explained && inputs.size() > 1) {
      for (const int32_t i : members) {
        for (int axis = 0; axis < 3 && graph_.alive(i); ++axis) {
          const int32_t other = graph_.neighbour(i, 2 * axis);
          if (other >= 0 && holder_[at(other)] >= 0) touching.unite(holder_[at(i)], holder_[at(other)]);
        }
      }
      for (std::size_t k = 1; k < inputs.size() && explained; ++k) {
        if (touching.find(static_cast<int32_t>(k)) == touching.find(0)) continue;
        explained = false;
        if (why != nullptr) {
          *why = {{number_before(inputs[0]), number_before(inputs[k])},
                  {first_of(inputs[0]), first_of(inputs[k])},
                  {},
                  fmt::format("cluster {} joins clusters {} and {}, which do not touch each other", number,
                              number_before(inputs[0]), number_before(inputs[k]))};
        }
      }
    }
    for (const int32_t c : inputs) {
      for (const int32_t i : before_.of(c)) holder_[at(i)] = -1;
    }
    return explained;
  }

  void assign(Verdict& verdict) {
    std::vector<std::vector<int32_t>> possible(at(after_.count()));  // vanished inputs with a choice, by result
    for (int32_t r = 0; r < after_.count(); ++r) given_[at(r)].push_back(kept_[at(r)]);
    for (int32_t c = 0; c < before_.count(); ++c) {
      if (result_of_[at(c)] >= 0) continue;
      const auto& candidates = candidates_[at(c)];
      if (candidates.size() == 1) {
        given_[at(candidates[0])].push_back(c);
      } else {
        for (const int32_t r : candidates) possible[at(r)].push_back(c);
      }
    }
    std::vector<int32_t> needy;  // results that what is certainly theirs does not explain
    for (int32_t r = 0; r < after_.count(); ++r) {
      if (given_[at(r)].size() == 1 && is_unchanged(r)) continue;  // its only input is what it is
      if (explains(r, given_[at(r)], nullptr)) continue;
      std::vector<int32_t> all = given_[at(r)];
      all.insert(all.end(), possible[at(r)].begin(), possible[at(r)].end());
      Witness why;
      if (!explains(r, all, &why)) {
        violate(verdict, why);
      } else {
        needy.push_back(r);
      }
    }
    if (!verdict.holds || needy.empty()) return;

    std::vector<uint8_t> is_needy(at(after_.count()), 0);
    for (const int32_t r : needy) is_needy[at(r)] = 1;
    takers_.resize(at(before_.count()));
    wanted_.resize(at(after_.count()));
    for (int32_t c = 0; c < before_.count(); ++c) {
      if (result_of_[at(c)] >= 0 || candidates_[at(c)].size() == 1) continue;
      for (const int32_t r : candidates_[at(c)]) {
        if (is_needy[at(r)] == 0) continue;
        takers_[at(c)].push_back(r);
        wanted_[at(r)].push_back(c);
      }
    }
    budget_ = kSearchBudget;
    if (search(needy, needy)) return;
    if (budget_ <= 0) {
      // Each result has an explanation of its own; that all have one at once was not refuted.
      verdict.bound_source += "; simultaneous assignment not decided";
      return;
    }
    std::vector<int32_t> numbers;
    for (const int32_t r : needy) numbers.push_back(after_.number[at(r)]);
    violate(verdict, "these clusters can be explained one by one, but only by using a cluster twice", numbers);
  }

  // Whether result r is explained by what it was given and all that it still wants, but for input `without`. No input
  // hurts a result that contains it, so if this is false, no way to give the rest explains the result.
  bool can_be_explained(int32_t r, int32_t without = -1) {
    --budget_;
    std::vector<int32_t> inputs = given_[at(r)];
    for (const int32_t c : wanted_[at(r)]) {
      if (c != without) inputs.push_back(c);
    }
    return explains(r, inputs, nullptr);
  }

  // Result r gets none of `unwanted`. Who is left alone with one of them is looked at again.
  void renounce(int32_t r, const std::vector<int32_t>& unwanted, std::vector<int32_t>& again) {
    for (const int32_t c : unwanted) {
      std::erase(wanted_[at(r)], c);
      std::erase(takers_[at(c)], r);
      if (takers_[at(c)].size() == 1) again.push_back(takers_[at(c)].front());
    }
  }

  void give(int32_t c, int32_t r, std::vector<int32_t>& again) {
    given_[at(r)].push_back(c);
    for (const int32_t taker : takers_[at(c)]) {
      std::erase(wanted_[at(taker)], c);
      if (taker != r) again.push_back(taker);
    }
    takers_[at(c)].clear();
  }

  // Does, beginning with the results `again`, what every answer must do or may do: a result that is explained wants
  // nothing more; an input that a result cannot do without, or that nobody else wants, goes there. False: there is no
  // answer, or the budget is spent. If no result wants anything then, all are explained.
  bool settle(std::vector<int32_t> again) {
    while (!again.empty()) {
      const int32_t r = again.back();
      again.pop_back();
      if (budget_ <= 0 || !can_be_explained(r)) return false;
      const std::vector<int32_t> wanted = wanted_[at(r)];
      if (explains(r, given_[at(r)], nullptr)) {
        renounce(r, wanted, again);
        continue;
      }
      for (const int32_t c : wanted) {
        if (takers_[at(c)].size() == 1 || !can_be_explained(r, c)) give(c, r, again);
      }
      if (explains(r, given_[at(r)], nullptr)) renounce(r, std::vector<int32_t>(wanted_[at(r)]), again);
    }
    return true;
  }

  // Gives wanted inputs to needy results so that all are explained, if there is a way: settles what it can, then tries
  // both answers to whether a result gets an input that it wants.
  bool search(const std::vector<int32_t>& needy, std::vector<int32_t> again) {
    if (!settle(std::move(again))) return false;
    const auto wants = [&](int32_t r) { return !wanted_[at(r)].empty(); };
    const auto open = std::find_if(needy.begin(), needy.end(), wants);
    if (open == needy.end()) return true;
    const int32_t r = *open, c = wanted_[at(r)].front();
    const auto given = given_, wanted = wanted_, takers = takers_;
    again = {r};
    give(c, r, again);
    if (search(needy, again)) return true;
    given_ = given;
    wanted_ = wanted;
    takers_ = takers;
    again = {r};
    renounce(r, {c}, again);
    return search(needy, again);
  }

  // Larger than cap only if nothing grew: the result is the cluster whose number it keeps, and others lay inside it.
  void check_sizes(Verdict& verdict) {
    for (int32_t r = 0; r < after_.count(); ++r) {
      if (after_.size(r) <= cap_ || after_.size(r) == before_.size(kept_[at(r)])) continue;
      std::vector<int32_t> numbers;
      for (const int32_t c : given_[at(r)]) numbers.push_back(number_before(c));
      violate(verdict,
              fmt::format("cluster {} was merged to {} particles, more than cap = {}", after_.number[at(r)],
                          after_.size(r), cap_),
              numbers);
    }
  }

  static constexpr int64_t kSearchBudget = 10'000;  // of questions whether a result can be explained
  const TissueGraph& graph_;
  const Clusters& before_;
  const Clusters& after_;
  int64_t tau_, cap_;
  std::vector<int32_t> result_of_;                // [before] result with the same number, -1: vanished
  std::vector<int32_t> kept_;                     // [after] input with the same number
  std::vector<std::vector<int32_t>> candidates_;  // [before] results that contain it
  std::vector<std::vector<int32_t>> given_;       // [after] inputs
  std::vector<std::vector<int32_t>> takers_;      // [before] needy results that could use it
  std::vector<std::vector<int32_t>> wanted_;      // [after] and the other way round, ascending
  std::vector<int32_t> holder_;                   // [n] scratch, -1 between uses
  int64_t budget_ = 0;
};

Verdict check_merge(const Setup& setup, const State& before, const State& after) {
  Verdict verdict = start_verdict("merge legality", after, "1", "method.md §6: legal");
  verdict.checked = before.clusters.count();
  const TissueGraph graph(setup.body, before.alive);
  if (setup.merge.rule == MergeRule::none) {
    const Clusters &a = before.clusters, &b = after.clusters;
    if (a.offsets != b.offsets || a.members != b.members || a.number != b.number) {
      violate(verdict, "clusters changed, but the scene merges none");
    }
    return verdict;
  }
  MergeDecomposition(graph, before.clusters, after.clusters, before).judge(verdict);
  return verdict;
}

// --- Expand ----------------------------------------------------------------------------------------------------------

// A cluster is isolated by itself if it shares no particle with another while edges of G leave it (method.md §7,
// published). [m] 1 for those.
std::vector<uint8_t> singly_isolated(const TissueGraph& graph, const Clusters& clusters) {
  std::vector<int32_t> memberships(at(graph.particle_count()), 0), held_by(at(graph.particle_count()), -1);
  for (const int32_t i : clusters.members) ++memberships[at(i)];
  std::vector<uint8_t> isolated(at(clusters.count()), 0);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const auto members = clusters.of(c);
    if (std::any_of(members.begin(), members.end(), [&](int32_t i) { return memberships[at(i)] > 1; })) continue;
    for (const int32_t i : members) held_by[at(i)] = c;
    for (const int32_t i : members) {
      for (int direction = 0; direction < 6 && graph.alive(i); ++direction) {
        const int32_t other = graph.neighbour(i, direction);
        if (other >= 0 && held_by[at(other)] != c) isolated[at(c)] = 1;
      }
    }
  }
  return isolated;
}

// Whether cluster c, with these additions, was reached along edges of G within `depth` layers, and whether each
// addition of the first layer was called for.
void check_additions(const Setup& setup, const TissueGraph& graph, const Clusters& before, int32_t c,
                     const std::vector<int32_t>& added, const std::vector<uint8_t>& covered,
                     std::vector<int32_t>& layer, Verdict& verdict) {
  const int32_t number = before.number[at(c)];
  // layer: 0 for old members, k for the k-th layer, -2 for additions not reached yet, -1 for all others.
  for (const int32_t i : before.of(c)) layer[at(i)] = 0;
  std::vector<int32_t> front;
  for (const int32_t i : added) layer[at(i)] = -2;
  for (const int32_t i : added) {
    bool adjacent = false, called_for = setup.expand.rule == ExpandRule::published;
    for (int direction = 0; direction < 6 && graph.alive(i); ++direction) {
      const int32_t other = graph.neighbour(i, direction);
      if (other < 0 || layer[at(other)] != 0) continue;
      adjacent = true;
      const int32_t low = direction % 2 == 0 ? i : other;  // the end from which the edge leaves in + direction
      if (covered[at(low) * 3 + at(direction / 2)] == 0) called_for = true;
    }
    if (!adjacent) continue;
    front.push_back(i);
    if (!called_for && setup.expand.depth <= 1) {
      violate(verdict,
              fmt::format("cluster {} took in particle {}, though other clusters held every "
                          "edge between them already",
                          number, i),
              {number}, {i});
    }
  }
  for (const int32_t i : front) layer[at(i)] = 1;
  for (int32_t depth = 2; depth <= setup.expand.depth && !front.empty(); ++depth) {
    std::vector<int32_t> next;
    for (const int32_t i : front) {
      for (int direction = 0; direction < 6 && graph.alive(i); ++direction) {
        const int32_t other = graph.neighbour(i, direction);
        if (other < 0 || layer[at(other)] != -2) continue;
        layer[at(other)] = depth;
        next.push_back(other);
      }
    }
    front = std::move(next);
  }
  for (const int32_t i : added) {
    if (layer[at(i)] == -2) {
      violate(verdict,
              fmt::format("cluster {} took in particle {}, which no path of at most {} "
                          "edges through added particles joins to it",
                          number, i, setup.expand.depth),
              {number}, {i});
    }
  }
  for (const int32_t i : before.of(c)) layer[at(i)] = -1;
  for (const int32_t i : added) layer[at(i)] = -1;
}

Verdict check_expansion(const Setup& setup, const State& before, const State& after) {
  Verdict verdict = start_verdict("expansion", after, "1", "method.md §7");
  const Clusters &a = before.clusters, &b = after.clusters;
  verdict.checked = a.count();
  if (a.number != b.number) {
    const auto [old, now] = std::mismatch(a.number.begin(), a.number.end(), b.number.begin(), b.number.end());
    violate(verdict, "expansion changed the clusters' numbers", {old != a.number.end() ? *old : *now});
    return verdict;
  }
  const TissueGraph graph(setup.body, before.alive);
  const bool idle = setup.expand.rule == ExpandRule::none || before.edge_covered;
  const bool published = setup.expand.rule == ExpandRule::published;
  std::optional<std::vector<uint8_t>> covered;  // once a cluster has grown
  const std::vector<uint8_t> isolated_before = published ? singly_isolated(graph, a) : std::vector<uint8_t>{};
  std::vector<int32_t> layer(at(graph.particle_count()), -1);
  std::vector<int32_t> old_members, new_members, added, lost;
  for (int32_t c = 0; c < a.count(); ++c) {
    const int32_t number = a.number[at(c)];
    const auto old_span = a.of(c), new_span = b.of(c);
    if (std::equal(old_span.begin(), old_span.end(), new_span.begin(), new_span.end())) continue;
    old_members.assign(old_span.begin(), old_span.end());
    new_members.assign(new_span.begin(), new_span.end());
    std::sort(old_members.begin(), old_members.end());
    std::sort(new_members.begin(), new_members.end());
    added.clear();
    lost.clear();
    std::set_difference(new_members.begin(), new_members.end(), old_members.begin(), old_members.end(),
                        std::back_inserter(added));
    std::set_difference(old_members.begin(), old_members.end(), new_members.begin(), new_members.end(),
                        std::back_inserter(lost));
    if (!lost.empty()) {
      violate(verdict, fmt::format("cluster {} lost particle {}", number, lost.front()), {number}, {lost.front()});
      continue;
    }
    if (added.empty()) continue;  // only the order changed: coverage rejects that
    if (idle) {
      violate(verdict,
              fmt::format("cluster {} took in particle {}, but {}", number, added.front(),
                          before.edge_covered ? "every edge was covered already" : "the scene expands none"),
              {number}, {added.front()});
      continue;
    }
    if (published && isolated_before[at(c)] == 0) {
      violate(verdict, fmt::format("cluster {} took in particle {}, but it was not isolated", number, added.front()),
              {number}, {added.front()});
      continue;
    }
    if (!covered) covered = covered_edges(graph, a);
    check_additions(setup, graph, a, c, added, *covered, layer, verdict);
  }

  if (setup.expand.rule == ExpandRule::edge_cover) {
    const UncoveredEdges edges = uncovered_edges(graph, b);
    if (edges.uncovered > 0) {
      violate(verdict, fmt::format("no cluster holds both ends of the edge from particle {} to {}", edges.a, edges.b),
              {}, {edges.a, edges.b}, {edges.a, edges.b});
    } else if (!after.edge_covered) {
      violate(verdict, "every edge is covered, but edge_covered does not say so");
    }
  }
  if (published && !idle) {
    const std::vector<uint8_t> isolated = singly_isolated(graph, b);
    for (int32_t c = 0; c < b.count(); ++c) {
      if (isolated[at(c)] == 0) continue;
      violate(verdict,
              fmt::format("cluster {} still shares no particle with another, though edges of the tissue leave "
                          "it",
                          b.number[at(c)]),
              {b.number[at(c)]});
    }
  }
  return verdict;
}

// --- Untouched -------------------------------------------------------------------------------------------------------

// Compares what a stage must leave alone, bit for bit.
class Comparison {
 public:
  explicit Comparison(Verdict& verdict) : verdict_(verdict) {}

  template <typename T>
  void same(const T& before, const T& after, const char* what) {
    ++verdict_.checked;
    if (!same_bits(before, after)) violate(verdict_, fmt::format("{} changed", what));
  }
  template <typename T>
  void same(const std::vector<T>& before, const std::vector<T>& after, const char* what,
            std::vector<int32_t> Witness::*kind = nullptr, const std::vector<int32_t>* names = nullptr) {
    verdict_.checked += static_cast<int64_t>(before.size());
    if (before.size() != after.size()) {
      violate(verdict_, fmt::format("{} changed: {} entries before, {} after", what, before.size(), after.size()));
      return;
    }
    if (before.empty() || std::memcmp(before.data(), after.data(), before.size() * sizeof(T)) == 0) return;
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (same_bits(before[i], after[i])) continue;
      const int32_t name = names != nullptr ? (*names)[i] : static_cast<int32_t>(i);
      Witness witness;
      witness.text = fmt::format("{} changed, first at {}", what, name);
      if (kind != nullptr) witness.*kind = {name};
      violate(verdict_, witness);
    }
  }

 private:
  Verdict& verdict_;
};

Verdict check_untouched(const Setup& setup, Stage stage, const State& before, const State& after) {
  Verdict verdict =
      start_verdict("untouched", after, "1", fmt::format("method.md §9: what {} may change", name_of(stage)));
  Comparison compare(verdict);
  const Clusters &a = before.clusters, &b = after.clusters;
  const auto particles = &Witness::particles, clusters = &Witness::clusters;

  compare.same(before.tau, after.tau, "tau");
  compare.same(before.cap, after.cap, "cap");
  if (stage != Stage::expand) compare.same(before.edge_covered, after.edge_covered, "edge_covered");
  if (stage != Stage::skin) {
    compare.same(before.frame, after.frame, "the frame");
    compare.same(before.skin.owner, after.skin.owner, "a skin vertex's owner");
    compare.same(before.skin.direction, after.skin.direction, "a skin vertex's direction");
    compare.same(before.skin.position, after.skin.position, "a skin vertex's position");
    compare.same(before.skin.triangles, after.skin.triangles, "a skin triangle");
  }
  if (stage != Stage::step) {
    compare.same(before.x, after.x, "a position", particles);
    compare.same(before.v, after.v, "a velocity", particles);
    compare.same(before.impulse, after.impulse, "the impulse");
    if (stage != Stage::detect) compare.same(before.removed, after.removed, "the list of removed particles");
    if (stage != Stage::split) compare.same(before.debris, after.debris, "the list of debris");
  } else {
    for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
      if (before.alive[at(i)] != 0) continue;
      ++verdict.checked;
      if (!same_bits(before.x[at(i)], after.x[at(i)])) {
        violate(verdict, fmt::format("particle {} is dead, but moved", i), {}, {i});
      }
    }
    if (!after.removed.empty() || !after.debris.empty()) {
      violate(verdict, "a step starts a frame, but particles are listed as removed in it", {},
              after.removed.empty() ? after.debris : after.removed);
    }
  }
  if (stage != Stage::detect && stage != Stage::split) compare.same(before.alive, after.alive, "alive", particles);

  const bool sets_may_change = stage == Stage::split || stage == Stage::merge;
  if (!sets_may_change) {
    if (stage != Stage::expand) {
      compare.same(a.offsets, b.offsets, "a cluster's extent");
      compare.same(a.members, b.members, "a cluster's members");
      compare.same(a.rest_center, b.rest_center, "a rest center", clusters, &a.number);
      compare.same(a.mass, b.mass, "a cluster's mass", clusters, &a.number);
    }
    if (stage != Stage::step) {
      compare.same(a.rotation, b.rotation, "a rotation", clusters, &a.number);
      compare.same(a.degenerate, b.degenerate, "a degenerate flag", clusters, &a.number);
    }
    if (stage != Stage::skin) compare.same(a.number, b.number, "a cluster's number", clusters, &a.number);
  }
  if (stage == Stage::skin) {
    // The end of the frame, or the stage alone: then nothing is compacted.
    const bool ended = after.frame - 1 == before.frame;
    if (!ended) compare.same(before.frame, after.frame, "the frame, by other than one,");
    if (a.number.size() != b.number.size()) {
      violate(verdict, fmt::format("{} clusters before, {} after", a.number.size(), b.number.size()));
    } else {
      for (std::size_t c = 0; c < b.number.size(); ++c) {
        const bool compact = b.number[c] == static_cast<int32_t>(c);
        if (compact || (!ended && b.number[c] == a.number[c])) continue;
        violate(verdict, fmt::format("cluster {} should have the number {} at the end of the frame", b.number[c], c),
                {b.number[c]});
      }
    }
  }
  return verdict;
}

// --- Both states well formed -----------------------------------------------------------------------------------------

template <typename Check>
Verdict gated(const char* property, const Verdict& form_before, const Verdict& form_after, Check check) {
  for (const Verdict* form : {&form_before, &form_after}) {
    if (form->holds) continue;
    Verdict verdict = not_judged(property, *form);
    verdict.witness.text += form == &form_before ? " (before the stage)" : " (after the stage)";
    return verdict;
  }
  return check();
}

}  // namespace

Verdict stage_verdict(const Setup& setup, Stage stage, const State& before, const Verdict& form_before,
                      const State& after, const Verdict& form_after) {
  const auto answer = [&](const char* property, auto check) {
    return gated(property, form_before, form_after, [&] { return check(setup, before, after); });
  };
  switch (stage) {
    case Stage::detect:
      return answer("detection", check_detection);
    case Stage::split:
      return answer("split exactness", check_split);
    case Stage::merge:
      return answer("merge legality", check_merge);
    case Stage::expand:
      return answer("expansion", check_expansion);
    case Stage::step:
    case Stage::skin:
      break;
  }
  throw std::invalid_argument(fmt::format("stage_verdict: {} has no oracle of its own", name_of(stage)));
}

Verdict untouched_verdict(const Setup& setup, Stage stage, const State& before, const Verdict& form_before,
                          const State& after, const Verdict& form_after) {
  return gated("untouched", form_before, form_after, [&] { return check_untouched(setup, stage, before, after); });
}

namespace {
Verdict verdict_on(const Setup& setup, Stage stage, const State& before, const State& after) {
  return stage_verdict(setup, stage, before, well_formed(setup, before), after, well_formed(setup, after));
}
}  // namespace

Verdict detection(const Setup& setup, const State& before, const State& after) {
  return verdict_on(setup, Stage::detect, before, after);
}
Verdict split_exactness(const Setup& setup, const State& before, const State& after) {
  return verdict_on(setup, Stage::split, before, after);
}
Verdict merge_legality(const Setup& setup, const State& before, const State& after) {
  return verdict_on(setup, Stage::merge, before, after);
}
Verdict expansion(const Setup& setup, const State& before, const State& after) {
  return verdict_on(setup, Stage::expand, before, after);
}
Verdict untouched(const Setup& setup, Stage stage, const State& before, const State& after) {
  return untouched_verdict(setup, stage, before, well_formed(setup, before), after, well_formed(setup, after));
}

}  // namespace cutproof::oracles
