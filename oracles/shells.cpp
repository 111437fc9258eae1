// Shells of the skin and cavities of the tissue, by joining touching triangles and nodes.
#include "oracles/shells.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "oracles/eigen.h"
#include "oracles/rounding.h"
#include "oracles/shape_sums.h"
#include "oracles/volume_target.h"

namespace cutproof::oracles {

int32_t count_cavities(const Judged& judged) {
  const Grid& grid = judged.body.grid;
  if (judged.body.particle_count() == 0) return 0;
  const auto count = static_cast<int32_t>(grid.node_count());
  std::vector<uint8_t> empty(at(count), 1);
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    if (judged.alive(i)) empty[at(judged.body.node[at(i)])] = 0;
  }
  // The half of the 18 neighbours that comes earlier in the linear index.
  std::vector<int64_t> earlier;
  for (int dk = -1; dk <= 1; ++dk) {
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        const int64_t step = grid.index(di, dj, dk);
        if (step < 0 && std::abs(di) + std::abs(dj) + std::abs(dk) <= 2) earlier.push_back(step);
      }
    }
  }
  // A step that leaves the grid comes back to it on the other side: from one node of the outer ring to another. They
  // are all empty, and all belong to the outside, as node 0 does.
  DisjointSets sets(count);
  for (int32_t node = 0; node < count; ++node) {
    for (const int64_t step : earlier) {
      const int64_t other = node + step;
      if (other >= 0 && empty[at(node)] != 0 && empty[at(other)] != 0) sets.unite(node, static_cast<int32_t>(other));
    }
  }
  int32_t cavities = 0;
  for (int32_t node = 1; node < count; ++node) {
    if (empty[at(node)] != 0 && sets.find(node) == node) ++cavities;
  }
  return cavities;
}

Shells shells_of(const Skin& skin, const std::vector<Vec3>& points) {
  DisjointSets sets(static_cast<int64_t>(points.size()));
  std::vector<uint8_t> used(points.size(), 0);
  for (const auto& t : skin.triangles) {
    sets.unite(t[0], t[1]);
    sets.unite(t[0], t[2]);
    for (const int32_t v : t) used[at(v)] = 1;
  }
  Shells shells;
  shells.of_vertex.assign(points.size(), -1);
  int32_t count = 0;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v] == 0) continue;
    const auto root = at(sets.find(static_cast<int32_t>(v)));
    shells.of_vertex[v] = root == v ? count++ : shells.of_vertex[root];
  }
  shells.volume.assign(at(count), 0.0);
  shells.farthest.assign(at(count), -1);
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v] == 0) continue;
    int32_t& farthest = shells.farthest[at(shells.of_vertex[v])];
    if (farthest < 0 || points[v].x > points[at(farthest)].x) farthest = static_cast<int32_t>(v);
  }
  for (const auto& t : skin.triangles) {
    shells.volume[at(shells.of_vertex[at(t[0])])] += dot(points[at(t[0])], cross(points[at(t[1])], points[at(t[2])]));
  }
  return shells;
}

ShellCount count_shells(const Skin& skin) {
  ShellCount count;
  for (const double volume : shells_of(skin, skin.position).volume) (volume > 0 ? count.outer : count.inner) += 1;
  return count;
}

std::vector<VertexPlace> vertex_places(const Setup& setup, const State& state, const Skin& skin,
                                       const Memberships& memberships) {
  const Body& body = setup.body;
  const Clusters& clusters = state.clusters;
  const WeightedRest weighted = weighted_rest(body, clusters);
  const double u = unit_roundoff(state) + kUnitRoundoff;
  std::vector<ClusterMeans> means;
  std::vector<Mat3> maps = clusters.rotation, carry = maps;  // of owners, of points beside them
  std::vector<VolumeTarget> volumes;
  std::vector<double> volume_rounding;  // of V A0^(1/2), times its share
  std::vector<double> volume_absolute;  // of it, by absolute coordinates: at most
  std::vector<double> center_rounding;  // rounding of the sum of a cluster's center: squares [m²]
  std::vector<double> absolute;         // both centers of a cluster, as absolute coordinates: at most [m]
  for (int32_t c = 0; c < clusters.count(); ++c) {
    means.push_back(cluster_means(weighted, clusters, state.x, c));
    const auto members = clusters.of(c);
    Vec3 mean;
    double spread = 0, radius = 0, heaviest = 0;
    for (const int32_t i : members) {
      const double share = weighted.weight[at(i)] / means[at(c)].mass;
      const Vec3 kept = stored_place(body, state.precision, i, state.x[at(i)]);
      const int32_t first = members.front();
      mean += share * kept;
      spread += share * norm(kept - stored_place(body, state.precision, first, state.x[at(first)]));
      radius = std::max(radius, norm(weighted.position[at(i)] - means[at(c)].rest));
      heaviest = std::max(heaviest, weighted.weight[at(i)]);
    }
    const double sum = sum_rounds(static_cast<double>(members.size())) * u * spread;
    center_rounding.push_back(4 * u * u * dot(mean, mean) + 3 * sum * sum + 3 * u * u * radius * radius);
    const double weights = sum_rounds_at_most(static_cast<double>(members.size()), means[at(c)].mass, heaviest);
    const double of_mean = absolute_mean_rounding(state, weights);
    double lengthens = 1;  // at most so many times, the map
    if (const double part = setup.step.volume_share; part > 0) {
      Eigen::Matrix3d a = Eigen::Matrix3d::Zero(), a0 = a;
      double size = 0, lengths = 0, lengths_at_rest = 0;
      for (const int32_t i : members) {
        const Eigen::Vector3d arm = as_eigen(weighted.position[at(i)] - means[at(c)].rest);
        const Eigen::Vector3d now = weighted.weight[at(i)] * as_eigen(state.x[at(i)] - means[at(c)].current);
        a += now * arm.transpose();
        a0 += weighted.weight[at(i)] * arm * arm.transpose();
        size += now.norm() * arm.norm();
        lengths += now.norm();
        lengths_at_rest += weighted.weight[at(i)] * arm.norm();
      }
      if (members.size() == 1) a0.setZero();  // it was the rounding of its centre
      volumes.push_back(volume_target(to_mat3(a), to_mat3(a0), maps[at(c)]));
      const double sums = sum_rounds(static_cast<double>(members.size())) * u;
      const double places = u * spread * std::sqrt(a0.trace() * means[at(c)].mass);
      const double off = sums * size + places;
      // The errors of both centers add their product to a moment: all else of them cancels.
      const double p = state.place_rounding, of_centers = means[at(c)].mass * of_mean * of_mean;
      const double far = off + p * (lengths + lengths_at_rest) + of_centers;
      const double far_at_rest = a0.trace() > 0 ? sums + (2 * p * lengths_at_rest + of_centers) / a0.trace() : sums;
      volume_rounding.push_back(part * volumes.back().rounding(off, sums, u));
      volume_absolute.push_back(part * volumes.back().rounding(far, far_at_rest, u) - volume_rounding.back());
      const Mat3& r = clusters.rotation[at(c)];
      carry[at(c)] = volumes.back().carry_map(part, r);
      maps[at(c)] = volumes.back().goal_map(part, r);
      lengthens = std::max(1.0, as_eigen(maps[at(c)]).norm());
    }
    absolute.push_back((1 + lengthens) * of_mean);  // of the deformed center, and of the arm from that at rest
  }
  std::vector<VertexPlace> places(skin.owner.size());
  for (std::size_t v = 0; v < places.size(); ++v) {
    const Vec3 rest = vertex_at_rest(setup, skin, v);
    const int32_t owner = skin.owner[v];
    const Vec3 owner_at_rest = body.rest_position(owner), beside = rest - owner_at_rest;
    const double own = setup.step.volume_share;
    const auto holders = memberships.of(owner);
    Vec3 sum, first;
    double squares = 0, terms = 0;  // of single clusters; how far they are from the first
    double at_most = 0;
    for (const int32_t c : holders) {
      const ClusterMeans& m = means[at(c)];
      const Vec3 arm = owner_at_rest - m.rest;
      const Vec3 goal = own * state.x[at(owner)] + (1 - own) * m.current + maps[at(c)] * arm + carry[at(c)] * beside;
      if (c == holders.front()) first = goal;
      sum += goal;
      terms += norm(goal - first);
      squares += center_rounding[at(c)] + 4 * u * u * (dot(arm, arm) + dot(beside, beside));
      if (!volumes.empty()) {
        const double lever = volumes[at(c)].lever(arm) + volumes[at(c)].lever(beside),
                     off = volume_rounding[at(c)] * lever;
        squares += off * off;
        at_most += volume_absolute[at(c)] * lever;
      }
      at_most += absolute[at(c)];
    }
    const auto count = static_cast<double>(holders.size());
    // Partial sums of terms that are as large as their mean: u² q² (1² + … + n²) / 3n².
    squares += count * u * u * terms * terms / 9;
    const Vec3 place = sum / count, kept = state.precision == Precision::binary32 ? place - rest : place;
    const double in_doubles = 4 * kUnitRoundoff * norm(place),
                 from_owner = 2 * u * own * norm(state.x[at(owner)] - place);
    squares = squares / (count * count) + u * u * dot(kept, kept) + in_doubles * in_doubles + from_owner * from_owner;
    // Of the mean of the clusters' answers, whose weights are equal; and where it rests.
    const double of_answers = absolute_mean_rounding(state, (count + 1) / 2);
    places[v] = {place, kDeviations * std::sqrt(squares) + at_most / count + of_answers + own * state.place_rounding};
  }
  return places;
}

std::vector<VertexPlace> carried_places(const Setup& setup, const State& state, const std::vector<int32_t>& particles) {
  const Memberships memberships = memberships_of(state.clusters, setup.body.particle_count());
  Skin on_particles;
  for (const int32_t i : particles) {
    if (memberships.of(i).empty()) continue;
    on_particles.owner.push_back(i);
    on_particles.direction.push_back(0);
    on_particles.reach.push_back(0);
  }
  const std::vector<VertexPlace> carried = vertex_places(setup, state, on_particles, memberships);
  std::vector<VertexPlace> places;
  auto next = carried.begin();
  for (const int32_t i : particles) {
    places.push_back(memberships.of(i).empty() ? VertexPlace{state.x[at(i)], 0} : *next++);
  }
  return places;
}

}  // namespace cutproof::oracles
