#include "oracles/relations/transformed_scene.h"

#include <algorithm>
#include <numeric>

#include "oracles/support.h"

namespace cutproof::oracles {

TransformedScene::TransformedScene(const Transform& transform, const Setup& setup) : transform_(transform) {
  const Grid& grid = setup.body.grid;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto b = at(transform.target[a]);
    const bool mirrored = transform.sign[a] < 0 && setup.body.on_grid();
    const int32_t nodes = transform.padding[b] + (mirrored ? grid.nodes[a] - 1 : 0);
    offset_[transform.target[a]] = grid.spacing * nodes;
  }
  transformed_ = setup;
  transformed_.body = transform_body(setup.body);
  transformed_.step.gravity = vector(setup.step.gravity);
  for (Wall& wall : transformed_.walls) {
    const auto a = at(wall.axis);
    Vec3 corner;
    corner[wall.axis] = wall.offset;
    wall.axis = transform.target[a];
    wall.side *= transform.sign[a];
    wall.offset = point(corner)[wall.axis];
  }
  for (Grip& grip : transformed_.grips) {
    grip.particles = particles(grip.particles);
    for (Vec3& d : grip.displacement) d = vector(d);
  }
  transformed_.blade.length *= transform.scale;
  transformed_.blade.depth *= transform.scale;
  transformed_.blade.thickness *= transform.scale;
  for (BladeMove& move : transformed_.blade_moves) {
    move.from = pose(move.from);
    move.to = pose(move.to);
  }
}

Body TransformedScene::transform_body(const Body& body) {
  Body transformed = body;
  transformed.grid.spacing = transform_.scale * body.grid.spacing;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto b = at(transform_.target[a]);
    transformed.grid.nodes[b] = body.grid.nodes[a] + transform_.padding[b];
  }
  std::vector<int64_t> node(body.node.size());
  if (!body.on_grid()) {
    transformed.grid.nodes = body.grid.nodes;
    for (Vec3& rest : transformed.rest) rest = point(rest);
  }
  for (std::size_t i = 0; i < node.size(); ++i) {
    const auto old = body.grid.coordinates(body.node[i]);
    std::array<int32_t, 3> c{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto b = at(transform_.target[a]);
      c[b] = transform_.padding[b] + (transform_.sign[a] < 0 ? body.grid.nodes[a] - 1 - old[a] : old[a]);
    }
    node[i] = transformed.grid.index(c[0], c[1], c[2]);
  }
  std::vector<int32_t> order(at(body.particle_count()));
  std::iota(order.begin(), order.end(), 0);
  // Edges of a bare graph have no order of their own: its particles keep their numbers.
  if (body.on_grid()) {
    std::sort(order.begin(), order.end(), [&](int32_t i, int32_t j) { return node[at(i)] < node[at(j)]; });
  }
  // Where each direction of kDirections comes to lie.
  std::array<std::size_t, 6> turned{};
  for (std::size_t d = 0; d < 6; ++d) {
    const std::size_t against = (d % 2 != 0) != (transform_.sign[d / 2] < 0) ? 1 : 0;
    turned[d] = 2 * at(transform_.target[d / 2]) + against;
  }
  particle_.resize(order.size());
  transformed.particle_at.assign(at(transformed.grid.node_count()), -1);
  for (std::size_t j = 0; j < order.size(); ++j) {
    const auto i = at(order[j]);
    particle_[i] = static_cast<int32_t>(j);
    transformed.mass[j] = body.mass[i];
    if (!body.on_grid()) continue;
    transformed.node[j] = node[i];
    transformed.particle_at[at(node[i])] = static_cast<int32_t>(j);
    for (std::size_t d = 0; d < 6 && !body.surface_crossing.empty(); ++d) {
      transformed.surface_crossing[6 * j + turned[d]] = body.surface_crossing[6 * i + d];
    }
  }
  // The body lies in the (scaled) world as it did: orientation' = orientation · Pᵀ.
  for (int row = 0; row < 3; ++row) {
    for (std::size_t a = 0; a < 3; ++a) {
      transformed.orientation(row, transform_.target[a]) =
          transform_.sign[a] * body.orientation(row, static_cast<int>(a));
    }
  }
  transformed.origin = transform_.scale * body.origin;
  if (offset_ != Vec3{}) transformed.origin -= transformed.orientation * (transform_.scale * offset_);
  if (transform_.world_shift != Vec3{}) transformed.origin += transform_.world_shift;
  return transformed;
}

Vec3 TransformedScene::unit(Vec3 v) const {
  Vec3 result;
  for (std::size_t a = 0; a < 3; ++a) result[transform_.target[a]] = transform_.sign[a] * v[static_cast<int>(a)];
  return result;
}

Vec3 TransformedScene::vector(Vec3 v) const { return transform_.scale * unit(v); }

// An axis without offset keeps its bits, the sign of zero included.
Vec3 TransformedScene::point(Vec3 p) const {
  Vec3 result = unit(p);
  for (int b = 0; b < 3; ++b) {
    if (offset_[b] != 0) result[b] += offset_[b];
  }
  return transform_.scale * result;
}

Mat3 TransformedScene::rotation(const Mat3& r) const {
  Mat3 result;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = 0; b < 3; ++b) {
      result(transform_.target[a], transform_.target[b]) =
          transform_.sign[a] * transform_.sign[b] * r(static_cast<int>(a), static_cast<int>(b));
    }
  }
  return result;
}

BladePose TransformedScene::pose(const BladePose& pose) const {
  return {point(pose.edge), unit(pose.along), unit(pose.back)};
}

uint8_t TransformedScene::direction(uint8_t d) const {
  const auto a = at(d / 2);
  return static_cast<uint8_t>(2 * transform_.target[a] + ((d % 2 != 0) != (transform_.sign[a] < 0) ? 1 : 0));
}

std::vector<int32_t> TransformedScene::particles(const std::vector<int32_t>& list) const {
  std::vector<int32_t> result;
  for (const int32_t i : list) result.push_back(particle(i));
  std::sort(result.begin(), result.end());
  return result;
}

namespace {

void sort_members(Clusters& clusters) {
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const auto begin = clusters.members.begin();
    std::sort(begin + clusters.offsets[at(c)], begin + clusters.offsets[at(c) + 1]);
  }
}

}  // namespace

// One value of a field, by its kind.
template <class T>
T TransformedScene::value(Quantity quantity, const T& given) const {
  if constexpr (std::is_same_v<T, Vec3>) {
    return quantity == Quantity::point ? point(given) : vector(given);
  } else if constexpr (std::is_same_v<T, Mat3>) {
    return rotation(given);
  } else if constexpr (std::is_same_v<T, int32_t>) {
    return quantity == Quantity::particle ? particle(given) : given;
  } else if constexpr (std::is_same_v<T, uint8_t>) {
    return quantity == Quantity::direction ? direction(given) : given;
  } else {
    return given;
  }
}

State TransformedScene::state(const State& state) const {
  State result = state;
  for_each_field([&](const Field& field, auto get) {
    const auto& from = get(state);
    auto& to = get(result);
    if constexpr (requires { from.size(); }) {
      for (std::size_t i = 0; i < from.size(); ++i) {
        to[field.space == IndexSpace::particle ? at(particle_[i]) : i] = value(field.quantity, from[i]);
      }
    } else {
      to = value(field.quantity, from);
    }
  });
  std::sort(result.removed.begin(), result.removed.end());
  std::sort(result.debris.begin(), result.debris.end());
  sort_members(result.clusters);
  return result;
}

State reordered(const State& state, const std::vector<int32_t>& order) {
  State result = state;
  Clusters& clusters = result.clusters;
  clusters.members.clear();
  for (std::size_t j = 0; j < order.size(); ++j) {
    const auto members = state.clusters.of(order[j]);
    clusters.members.insert(clusters.members.end(), members.begin(), members.end());
    clusters.offsets[j + 1] = static_cast<int64_t>(clusters.members.size());
  }
  for_each_field([&](const Field& field, auto get) {
    if (field.space != IndexSpace::cluster || field.part == kNumbers) return;
    if constexpr (requires { get(state).size(); }) {
      for (std::size_t j = 0; j < order.size(); ++j) get(result)[j] = get(state)[at(order[j])];
    }
  });
  return result;
}

}  // namespace cutproof::oracles
