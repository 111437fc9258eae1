#include "oracles/relations/transformed_scene.h"

#include <algorithm>
#include <numeric>

#include "oracles/support.h"

namespace cutproof::oracles {

Carrier::Carrier(const Motion& motion, const Setup& setup) : motion_(motion) {
  const Grid& grid = setup.body.grid;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto b = at(motion.target[a]);
    const int32_t nodes = motion.padding[b] + (motion.sign[a] < 0 ? grid.nodes[a] - 1 : 0);
    offset_[motion.target[a]] = grid.spacing * nodes;
  }
  carried_ = setup;
  carried_.body = carry_body(setup.body);
  carried_.step.gravity = vector(setup.step.gravity);
  for (Wall& wall : carried_.walls) {
    const auto a = at(wall.axis);
    Vec3 corner;
    corner[wall.axis] = wall.offset;
    wall.axis = motion.target[a];
    wall.side *= motion.sign[a];
    wall.offset = point(corner)[wall.axis];
  }
  for (Grip& grip : carried_.grips) {
    grip.particles = particles(grip.particles);
    for (Vec3& d : grip.displacement) d = vector(d);
  }
  carried_.blade.length *= motion.scale;
  carried_.blade.depth *= motion.scale;
  carried_.blade.thickness *= motion.scale;
  for (BladeMove& move : carried_.blade_moves) {
    move.from = pose(move.from);
    move.to = pose(move.to);
  }
}

Body Carrier::carry_body(const Body& body) {
  Body carried = body;
  carried.grid.spacing = motion_.scale * body.grid.spacing;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto b = at(motion_.target[a]);
    carried.grid.nodes[b] = body.grid.nodes[a] + motion_.padding[b];
  }
  std::vector<int64_t> node(body.node.size());
  for (std::size_t i = 0; i < node.size(); ++i) {
    const auto old = body.grid.coordinates(body.node[i]);
    std::array<int32_t, 3> c{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto b = at(motion_.target[a]);
      c[b] = motion_.padding[b] + (motion_.sign[a] < 0 ? body.grid.nodes[a] - 1 - old[a] : old[a]);
    }
    node[i] = carried.grid.index(c[0], c[1], c[2]);
  }
  std::vector<int32_t> order(node.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int32_t i, int32_t j) { return node[at(i)] < node[at(j)]; });
  particle_.resize(node.size());
  carried.particle_at.assign(at(carried.grid.node_count()), -1);
  for (std::size_t j = 0; j < order.size(); ++j) {
    const auto i = at(order[j]);
    particle_[i] = static_cast<int32_t>(j);
    carried.node[j] = node[i];
    carried.mass[j] = body.mass[i];
    carried.particle_at[at(node[i])] = static_cast<int32_t>(j);
  }
  // The body lies in the (scaled) world as it did: orientation' = orientation · Pᵀ.
  for (int row = 0; row < 3; ++row) {
    for (std::size_t a = 0; a < 3; ++a) {
      carried.orientation(row, motion_.target[a]) = motion_.sign[a] * body.orientation(row, static_cast<int>(a));
    }
  }
  carried.origin = motion_.scale * body.origin;
  if (offset_ != Vec3{}) carried.origin -= carried.orientation * (motion_.scale * offset_);
  if (motion_.world_shift != Vec3{}) carried.origin += motion_.world_shift;
  return carried;
}

Vec3 Carrier::unit(Vec3 v) const {
  Vec3 result;
  for (std::size_t a = 0; a < 3; ++a) result[motion_.target[a]] = motion_.sign[a] * v[static_cast<int>(a)];
  return result;
}

Vec3 Carrier::vector(Vec3 v) const { return motion_.scale * unit(v); }

// An axis without offset keeps its bits, the sign of zero included.
Vec3 Carrier::point(Vec3 p) const {
  Vec3 result = unit(p);
  for (int b = 0; b < 3; ++b) {
    if (offset_[b] != 0) result[b] += offset_[b];
  }
  return motion_.scale * result;
}

Mat3 Carrier::rotation(const Mat3& r) const {
  Mat3 result;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = 0; b < 3; ++b) {
      result(motion_.target[a], motion_.target[b]) =
          motion_.sign[a] * motion_.sign[b] * r(static_cast<int>(a), static_cast<int>(b));
    }
  }
  return result;
}

BladePose Carrier::pose(const BladePose& pose) const { return {point(pose.edge), unit(pose.along), unit(pose.back)}; }

uint8_t Carrier::direction(uint8_t d) const {
  const auto a = at(d / 2);
  return static_cast<uint8_t>(2 * motion_.target[a] + ((d % 2 != 0) != (motion_.sign[a] < 0) ? 1 : 0));
}

std::vector<int32_t> Carrier::particles(const std::vector<int32_t>& list) const {
  std::vector<int32_t> result;
  for (const int32_t i : list) result.push_back(particle(i));
  std::sort(result.begin(), result.end());
  return result;
}

State Carrier::state(const State& state) const {
  State carried = state;
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const auto j = at(particle_[i]);
    carried.x[j] = point(state.x[i]);
    carried.v[j] = vector(state.v[i]);
    carried.alive[j] = state.alive[i];
  }
  carried.removed = particles(state.removed);
  carried.debris = particles(state.debris);
  carried.impulse = vector(state.impulse);
  Clusters& clusters = carried.clusters;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const auto begin = clusters.members.begin() + clusters.offsets[at(c)];
    const auto end = clusters.members.begin() + clusters.offsets[at(c) + 1];
    for (auto member = begin; member != end; ++member) *member = particle(*member);
    std::sort(begin, end);
    clusters.rotation[at(c)] = rotation(clusters.rotation[at(c)]);
    clusters.rest_center[at(c)] = point(clusters.rest_center[at(c)]);
  }
  for (std::size_t v = 0; v < state.skin.owner.size(); ++v) {
    carried.skin.owner[v] = particle(state.skin.owner[v]);
    carried.skin.direction[v] = direction(state.skin.direction[v]);
    carried.skin.position[v] = point(state.skin.position[v]);
  }
  return carried;
}

Clusters reordered(const Clusters& clusters, const std::vector<int32_t>& order) {
  Clusters result = clusters;
  result.members.clear();
  for (std::size_t j = 0; j < order.size(); ++j) {
    const int32_t c = order[j];
    const auto members = clusters.of(c);
    result.members.insert(result.members.end(), members.begin(), members.end());
    result.offsets[j + 1] = static_cast<int64_t>(result.members.size());
    result.rotation[j] = clusters.rotation[at(c)];
    result.rest_center[j] = clusters.rest_center[at(c)];
    result.mass[j] = clusters.mass[at(c)];
    result.degenerate[j] = clusters.degenerate[at(c)];
  }
  return result;
}

}  // namespace cutproof::oracles
