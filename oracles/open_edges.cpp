#include "oracles/open_edges.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "oracles/shape_sums.h"
#include "oracles/shells.h"

namespace cutproof::oracles {
namespace {

// Rounding band of d > εh, with u the unit roundoff of what is judged. From the stored positions: each difference is
// off by u relative to itself, its square by 3u, their sum by at most 5u, and the root by 2.5u + u. So every way to
// compute d in double is off by at most 4u d, every way to compute εh by u (squared and compared: 3u on squares, 1.5u
// here). What is compared here has the same errors once more: 2 (4u + 2u) = 12u; 16u leaves room for the terms of
// second order.
constexpr double kStretchBand = 16;  // [u]

// Of a bare graph the rest length is a distance as well, computed in double precision on both sides: 2 · 4u more.
constexpr double kRestBand = 8;  // [2⁻⁵³]

// Greatest number of inconclusive decisions that are tried in all combinations.
constexpr std::size_t kMostTried = 12;

}  // namespace

Demand openness(const Body& body, const State& state, int32_t i, int32_t j, double epsilon) {
  const double band = kStretchBand * unit_roundoff(state) + (body.on_grid() ? 0 : kRestBand * kUnitRoundoff);
  const double distance = norm(state.x[at(i)] - state.x[at(j)]), limit = epsilon * body.rest_length(i, j);
  // Of absolute coordinates the rest length is known as well as the places at rest of both ends.
  const double off = limit * band + 2 * epsilon * state.place_rounding;
  if (distance > limit + off) return Demand::remove;
  return distance < limit - off ? Demand::keep : Demand::either;
}

OneEndOfEach::OneEndOfEach(const Setup& setup, const TissueGraph& graph, const State& before,
                           std::span<const RotationKnown> known_rotations)
    : setup_(setup),
      before_(before),
      edges_at_(before.alive.size()),
      negative_(before.alive.size(), 0),
      side_bit_(before.alive.size(), -1) {
  const double u = unit_roundoff(before);
  for (int32_t i = 0; i < graph.particle_count(); ++i) {
    for (const int32_t j : graph.upper_neighbours(i)) {
      const Demand open = openness(setup.body, before, i, j, setup.detect.epsilon);
      if (open == Demand::keep) continue;
      for (const int32_t end : {i, j}) edges_at_[at(end)].push_back(static_cast<int32_t>(edges_.size()));
      edges_.push_back({.low = i, .high = j, .bit = open == Demand::either ? bits_++ : -1});
    }
  }
  const BladePose* const pose = last_lowered(setup, before.frame);
  has_lowered_blade_ = pose != nullptr;
  for (int32_t i = 0; has_lowered_blade_ && i < graph.particle_count(); ++i) {
    if (edges_at_[at(i)].empty()) continue;
    const double n = to_local(*pose, before.x[at(i)] - pose->edge).n;
    // Not below 0 counts as the positive side; places are rounded as those of geometric cuts are.
    const double band = kPlacesBand * u * (norm(before.x[at(i)]) + norm(pose->edge));
    if (std::abs(n) <= band) side_bit_[at(i)] = bits_++;
    negative_[at(i)] = n < 0;
  }
  if (has_lowered_blade_ && setup.detect.remove == RemovedEnds::nearer) find_nearer_ends(*pose, known_rotations);
}

void OneEndOfEach::find_nearer_ends(const BladePose& pose, std::span<const RotationKnown> known_rotations) {
  std::vector<uint8_t> is_unknown(before_.alive.size(), 0);  // where its clusters carry it
  for (std::size_t c = 0; c < known_rotations.size(); ++c) {
    if (known_rotations[c] == RotationKnown::yes) continue;
    for (const int32_t i : before_.clusters.of(static_cast<int32_t>(c))) is_unknown[at(i)] = 1;
  }
  std::vector<int32_t> ends;
  std::vector<std::size_t> place_of(before_.alive.size());
  for (std::size_t i = 0; i < edges_at_.size(); ++i) {
    if (edges_at_[i].empty()) continue;
    place_of[i] = ends.size();
    ends.push_back(static_cast<int32_t>(i));
  }
  const std::vector<VertexPlace> places = carried_places(setup_, before_, ends);
  const double u = unit_roundoff(before_), h = setup_.body.grid.spacing;
  struct Height {
    double distance, bound;
  };
  const auto height = [&](int32_t i) -> Height {
    const auto& [place, bound] = places[place_of[at(i)]];
    return {std::abs(to_local(pose, place - pose.edge).n), bound + kPlacesBand * u * (norm(place) + norm(pose.edge))};
  };
  for (Edge& edge : edges_) {
    const bool is_known = is_unknown[at(edge.low)] == 0 && is_unknown[at(edge.high)] == 0;
    bool is_between = false;
    for (const std::size_t k : {0u, 1u}) {
      // Only if rounding leaves it open may it be the one as well as the other.
      const int32_t negative = k == 0 ? edge.low : edge.high, positive = k == 0 ? edge.high : edge.low;
      const bool may_be = (side_bit_[at(negative)] >= 0 || negative_[at(negative)] != 0) &&
                          (side_bit_[at(positive)] >= 0 || negative_[at(positive)] == 0);
      if (!may_be) continue;
      is_between = true;
      const Height here = height(negative), there = height(positive);
      const double lead = here.distance - there.distance - kNearerBy * h;
      edge.positive_goes[k] = lead > 0;
      const bool is_decided = is_known && std::abs(lead) > here.bound + there.bound + 4 * u * h;
      if (!is_decided) edge.positive_bit[k] = bits_++;
    }
    if (is_between && !is_known) ++unknown_;
  }
}

template <class Value>
int OneEndOfEach::open_at(int32_t i, const Value& value) const {
  return static_cast<int>(std::count_if(edges_at_[at(i)].begin(), edges_at_[at(i)].end(),
                                        [&](int32_t e) { return is_open(edges_[at(e)], value); }));
}

template <class Value>
const OneEndOfEach::Edge* OneEndOfEach::edge_that_removes(int32_t i, const Value& value) const {
  for (const int32_t e : edges_at_[at(i)]) {
    const Edge& edge = edges_[at(e)];
    if (!is_open(edge, value)) continue;
    const int32_t j = other_end(edge, i);
    const bool negative = is_negative(i, value);
    if (has_lowered_blade_ && negative != is_negative(j, value)) {
      if (goes_by_side(edge, i, negative, value)) return &edge;
      continue;
    }
    const int here = open_at(i, value), there = open_at(j, value);
    if (here > there || (here == there && i < j)) return &edge;
  }
  return nullptr;
}

// All inconclusive decisions that the particle's fate depends on: which of its edges are open, on which side their ends
// are and which is nearer to the blade, and how many open edges the other ends have.
std::vector<int32_t> OneEndOfEach::bits_of(int32_t i) const {
  std::vector<int32_t> bits = {side_bit_[at(i)]};
  for (const int32_t e : edges_at_[at(i)]) {
    const int32_t j = other_end(edges_[at(e)], i);
    bits.push_back(side_bit_[at(j)]);
    for (const int32_t bit : edges_[at(e)].positive_bit) bits.push_back(bit);
    for (const int32_t beyond : edges_at_[at(j)]) bits.push_back(edges_[at(beyond)].bit);
  }
  std::sort(bits.begin(), bits.end());
  bits.erase(std::unique(bits.begin(), bits.end()), bits.end());
  std::erase(bits, -1);
  return bits;
}

Demand OneEndOfEach::bluntly(int32_t i) const {
  const auto surely = [](int32_t) { return false; };
  const auto perhaps = [](int32_t) { return true; };
  const auto undecided_side = [&](int32_t p) { return side_bit_[at(p)] >= 0; };
  // How many open edges a particle has at least and at most; an edge counts at both of its ends.
  const int least_here = open_at(i, surely), most_here = open_at(i, perhaps);
  Demand demand = Demand::keep;
  for (const int32_t e : edges_at_[at(i)]) {
    const Edge& edge = edges_[at(e)];
    const int32_t j = other_end(edge, i);
    const bool nearer_known = edge.positive_bit[0] < 0 && edge.positive_bit[1] < 0;
    const bool sides_known = !has_lowered_blade_ || (!undecided_side(i) && !undecided_side(j) && nearer_known);
    const bool between = has_lowered_blade_ && is_negative(i, surely) != is_negative(j, surely);
    const int least_there = open_at(j, surely), most_there = open_at(j, perhaps);
    const bool must_by_count = least_here > most_there || (least_here >= most_there && i < j);
    const bool may_by_count = most_here > least_there || (most_here >= least_there && i < j);
    const bool by_side = goes_by_side(edge, i, is_negative(i, surely), surely);
    const bool must = sides_known && (between ? by_side : must_by_count);
    const bool may = !sides_known || (between ? by_side : may_by_count);
    if (must && edge.bit < 0) return Demand::remove;
    if (may) demand = Demand::either;
  }
  return demand;
}

bool OneEndOfEach::is_explained(const std::vector<int32_t>& particles, const std::vector<int32_t>& bits,
                                const std::vector<uint8_t>& gone) const {
  for (uint32_t choice = 0; choice < uint32_t{1} << bits.size(); ++choice) {
    const auto value = [&](int32_t bit) {
      return (choice >> (std::lower_bound(bits.begin(), bits.end(), bit) - bits.begin()) & 1u) != 0;
    };
    const auto fits = [&](int32_t i) { return (edge_that_removes(i, value) != nullptr) == (gone[at(i)] != 0); };
    if (std::all_of(particles.begin(), particles.end(), fits)) return true;
  }
  return false;
}

void OneEndOfEach::reject(int32_t i, bool gone, Verdict& verdict) const {
  const auto never = [](int32_t) { return false; };
  const Edge* const edge = edge_that_removes(i, never);
  std::vector<int32_t> particles = {i};
  std::string why;
  if (gone) {
    why = edges_at_[at(i)].empty()
              ? fmt::format("none of its edges is longer than epsilon = {} allows", setup_.detect.epsilon)
              : "each of its too long edges loses the other end";
  } else if (edge == nullptr) {  // something that rounding decides was held against it
    why = "no choice of inconclusive decisions keeps it";
  } else {
    const int32_t other = other_end(*edge, i);
    const double length = norm(before_.x[at(i)] - before_.x[at(other)]) / setup_.body.grid.spacing;
    const std::string shown = figure_beside(length, setup_.detect.epsilon);
    particles.push_back(other);
    why = has_lowered_blade_ && is_negative(i, never) != is_negative(other, never)
              ? fmt::format("of its edge to particle {}, {} h long, it is the end {}", other, shown,
                            is_negative(i, never) ? "on the blade's negative side"
                                                  : "that its clusters carry nearer to the blade")
              : fmt::format("its edge to particle {} is {} h long; its own too long edges are {}, the other's {}",
                            other, shown, open_at(i, never), open_at(other, never));
  }
  violate(verdict, {{}, particles}, "particle {} {} removed, but should {}have been: {}", i, gone ? "was" : "was not",
          gone ? "not " : "", why);
}

void OneEndOfEach::judge(const std::vector<uint8_t>& gone, Verdict& verdict) const {
  const auto none = [](int32_t) { return false; };
  verdict.inconclusive += unknown_;
  DisjointSets together(bits_);
  std::vector<std::vector<int32_t>> bits(gone.size());
  for (std::size_t i = 0; i < gone.size(); ++i) {
    const auto particle = static_cast<int32_t>(i);
    if (edges_at_[i].empty()) {
      if (gone[i] != 0) reject(particle, true, verdict);
      continue;
    }
    bits[i] = bits_of(particle);
    for (const int32_t bit : bits[i]) together.unite(bits[i].front(), bit);
    if (bits[i].empty() && (edge_that_removes(particle, none) != nullptr) != (gone[i] != 0))
      reject(particle, gone[i] != 0, verdict);
  }
  struct Group {
    std::vector<int32_t> particles, bits;
  };
  std::map<int32_t, Group> groups;
  for (int32_t bit = 0; bit < bits_; ++bit) groups[together.find(bit)].bits.push_back(bit);
  for (std::size_t i = 0; i < gone.size(); ++i) {
    if (!bits[i].empty()) groups[together.find(bits[i].front())].particles.push_back(static_cast<int32_t>(i));
  }
  for (const auto& [root, group] : groups) {
    if (group.bits.size() <= kMostTried) {
      if (is_explained(group.particles, group.bits, gone)) continue;
      violate(verdict, {{}, group.particles},
              "no choice of the {} inconclusive decisions near particle {} explains the removal of these {} particles",
              group.bits.size(), group.particles.front(), group.particles.size());
      continue;
    }
    for (const int32_t i : group.particles) {
      const std::vector<int32_t>& own = bits[at(i)];
      const Demand demand = bluntly(i);
      const bool is_wrong = demand != Demand::either ? (demand == Demand::remove) != (gone[at(i)] != 0)
                                                     : own.size() <= kMostTried && !is_explained({i}, own, gone);
      if (is_wrong) reject(i, gone[at(i)] != 0, verdict);
      verdict.inconclusive += demand == Demand::either;
    }
  }
  // Whatever rounding decides, an edge that is too long beyond doubt loses an end.
  for (const Edge& edge : edges_) {
    if (edge.bit >= 0 || gone[at(edge.low)] != 0 || gone[at(edge.high)] != 0) continue;
    violate(verdict, {{}, {edge.low, edge.high}}, "the edge from particle {} to {} is too long, and neither end went",
            edge.low, edge.high);
  }
}

}  // namespace cutproof::oracles
