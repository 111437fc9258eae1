// Bodies and states made by hand for the tests of the oracles: blocks and lists of nodes, clusters as lists of
// particles. Written without fixtures/ and reference_cpu/, so that an oracle and what it judges share no code.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "model/setup.h"
#include "model/state.h"

namespace cutproof::tests {

using Node = std::array<int32_t, 3>;
using Lists = std::vector<std::vector<int32_t>>;

struct Scene {
  Setup setup;
  State state;
};

// A body of the given nodes (i, j, k) >= 0, without duplicates, in any order; one ring of empty nodes is added.
// Particles are numbered by (k, j, i). The grid holds at least one node, so a body of no particles has a grid too.
inline Body body_of(const std::vector<Node>& nodes, double spacing = 1.0, double particle_mass = 1.0) {
  Body body;
  body.name = "made by hand";
  Node most = {0, 0, 0};
  for (const Node& node : nodes) {
    for (std::size_t axis = 0; axis < 3; ++axis) most[axis] = std::max(most[axis], node[axis]);
  }
  body.grid.nodes = {most[0] + 3, most[1] + 3, most[2] + 3};
  body.grid.spacing = spacing;
  for (const Node& node : nodes) body.node.push_back(body.grid.index(node[0] + 1, node[1] + 1, node[2] + 1));
  std::sort(body.node.begin(), body.node.end());
  body.particle_at.assign(static_cast<std::size_t>(body.grid.node_count()), -1);
  for (std::size_t i = 0; i < body.node.size(); ++i) {
    body.particle_at[static_cast<std::size_t>(body.node[i])] = static_cast<int32_t>(i);
  }
  body.mass.assign(body.node.size(), particle_mass);
  return body;
}

// A solid block of nx × ny × nz particles; particle i + nx·(j + ny·k) is the one at (i, j, k).
inline Body block_body(int32_t nx, int32_t ny, int32_t nz, double spacing = 1.0, double particle_mass = 1.0) {
  std::vector<Node> nodes;
  for (int32_t k = 0; k < nz; ++k) {
    for (int32_t j = 0; j < ny; ++j) {
      for (int32_t i = 0; i < nx; ++i) nodes.push_back({i, j, k});
    }
  }
  return body_of(nodes, spacing, particle_mass);
}

// A setup of this body with default parameters, no blade, and `frames` frames of 4 substeps of 4 ms.
inline Setup setup_of(Body body, int64_t frames = 1) {
  Setup setup;
  setup.body = std::move(body);
  setup.substep_length.assign(static_cast<std::size_t>(frames), 0.004);
  return setup;
}

// T_c, M_c of every cluster, with w_ic = m_i / n_i (method.md §2, §3).
inline void set_rest_frames(const Body& body, Clusters& clusters) {
  std::vector<int32_t> memberships(body.node.size(), 0);
  for (const int32_t i : clusters.members) ++memberships[static_cast<std::size_t>(i)];
  clusters.rest_center.assign(static_cast<std::size_t>(clusters.count()), Vec3{});
  clusters.mass.assign(static_cast<std::size_t>(clusters.count()), 0.0);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    Vec3 sum;
    double mass = 0;
    for (const int32_t i : clusters.of(c)) {
      const double w = body.mass[static_cast<std::size_t>(i)] / memberships[static_cast<std::size_t>(i)];
      sum += w * body.rest_position(i);
      mass += w;
    }
    clusters.rest_center[static_cast<std::size_t>(c)] = sum / mass;
    clusters.mass[static_cast<std::size_t>(c)] = mass;
  }
}

// Clusters 0 .. m - 1 with the given members (taken as they are, so that they may be wrong) at rest.
inline Clusters clusters_of(const Body& body, const Lists& lists) {
  Clusters clusters;
  for (const auto& list : lists) {
    clusters.members.insert(clusters.members.end(), list.begin(), list.end());
    clusters.offsets.push_back(static_cast<int64_t>(clusters.members.size()));
    clusters.number.push_back(static_cast<int32_t>(clusters.number.size()));
  }
  clusters.rotation.assign(lists.size(), Mat3{});
  clusters.degenerate.assign(lists.size(), 0);
  set_rest_frames(body, clusters);
  return clusters;
}

// All particles alive, at rest, without skin. tau = 0: no cluster is small.
inline State state_of(const Body& body, const Lists& lists, int32_t tau = 0, int32_t cap = 1000) {
  State state;
  for (int32_t i = 0; i < body.particle_count(); ++i) state.x.push_back(body.rest_position(i));
  state.v.assign(body.node.size(), Vec3{});
  state.alive.assign(body.node.size(), 1);
  state.clusters = clusters_of(body, lists);
  state.tau = tau;
  state.cap = cap;
  return state;
}

// What detection leaves: the particles are dead and listed, clusters still hold them.
inline void remove_particles(State& state, std::vector<int32_t> particles) {
  std::sort(particles.begin(), particles.end());
  for (const int32_t i : particles) state.alive[static_cast<std::size_t>(i)] = 0;
  state.removed = std::move(particles);
}

// The members of every cluster, as lists that a test can change before it calls clusters_of again.
inline Lists lists_of(const Clusters& clusters) {
  Lists lists;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const auto members = clusters.of(c);
    lists.emplace_back(members.begin(), members.end());
  }
  return lists;
}

// All particles first .. last - 1.
inline std::vector<int32_t> range(int32_t first, int32_t last) {
  std::vector<int32_t> list;
  for (int32_t i = first; i < last; ++i) list.push_back(i);
  return list;
}

// Overlapping boxes: cores of side × side × side nodes, each grown by one node on every side. Connected and edge
// covered on a solid block (nx × ny × nz as in block_body).
inline Lists box_clusters(int32_t nx, int32_t ny, int32_t nz, int32_t side) {
  Lists lists;
  for (int32_t k0 = 0; k0 < nz; k0 += side) {
    for (int32_t j0 = 0; j0 < ny; j0 += side) {
      for (int32_t i0 = 0; i0 < nx; i0 += side) {
        std::vector<int32_t> list;
        for (int32_t k = std::max(0, k0 - 1); k < std::min(nz, k0 + side + 1); ++k) {
          for (int32_t j = std::max(0, j0 - 1); j < std::min(ny, j0 + side + 1); ++j) {
            for (int32_t i = std::max(0, i0 - 1); i < std::min(nx, i0 + side + 1); ++i) {
              list.push_back(i + nx * (j + ny * k));
            }
          }
        }
        lists.push_back(std::move(list));
      }
    }
  }
  return lists;
}

// The skin at rest of a body whose grid cells each hold at most one polygon (boxes, boxes with box cavities, and
// such bodies apart from each other): one polygon per cell around the crossed grid edges, ordered by angle. No case
// table, and no ambiguous cell either.
inline Skin convex_cell_skin(const Setup& setup, const State& state) {
  Skin skin;
  const Body& body = setup.body;
  const Grid& grid = body.grid;
  if (body.particle_count() == 0) return skin;
  const auto inside = [&](Node c) {
    const int32_t p = body.particle_at[static_cast<std::size_t>(grid.index(c[0], c[1], c[2]))];
    return p >= 0 && state.alive[static_cast<std::size_t>(p)] != 0 ? p : -1;
  };
  // Vertex of (owner, direction), made on first use.
  std::vector<int32_t> vertex(body.node.size() * 6, -1);
  const auto vertex_of = [&](int32_t owner, int direction) {
    int32_t& v = vertex[static_cast<std::size_t>(owner * 6 + direction)];
    if (v < 0) {
      v = static_cast<int32_t>(skin.owner.size());
      const auto& d = kDirections[static_cast<std::size_t>(direction)];
      skin.owner.push_back(owner);
      skin.direction.push_back(static_cast<uint8_t>(direction));
      skin.reach.push_back(setup.skin.alpha);
      skin.position.push_back(body.rest_position(owner) + setup.skin.alpha * grid.spacing *
                                                              Vec3{static_cast<double>(d[0]), static_cast<double>(d[1]),
                                                                   static_cast<double>(d[2])});
    }
    return v;
  };
  for (int32_t k = 0; k + 1 < grid.nodes[2]; ++k) {
    for (int32_t j = 0; j + 1 < grid.nodes[1]; ++j) {
      for (int32_t i = 0; i + 1 < grid.nodes[0]; ++i) {
        std::vector<int32_t> corners;  // vertices of this cell's polygon
        Vec3 outward;
        for (int corner = 0; corner < 8; ++corner) {
          const std::array<int, 3> bit = {corner & 1, (corner >> 1) & 1, (corner >> 2) & 1};
          const int32_t owner = inside({i + bit[0], j + bit[1], k + bit[2]});
          if (owner < 0) continue;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            Node other = {i + bit[0], j + bit[1], k + bit[2]};
            const int direction = static_cast<int>(2 * axis) + (bit[axis] == 0 ? 0 : 1);
            other[axis] += bit[axis] == 0 ? 1 : -1;
            if (inside(other) >= 0) continue;
            corners.push_back(vertex_of(owner, direction));
            outward[static_cast<int>(axis)] += bit[axis] == 0 ? 1 : -1;
          }
        }
        if (corners.empty()) continue;
        Vec3 center;
        for (const int32_t v : corners) center += skin.position[static_cast<std::size_t>(v)];
        center = center / static_cast<double>(corners.size());
        const Vec3 normal = normalized(outward);
        const Vec3 first = skin.position[static_cast<std::size_t>(corners[0])] - center;
        const Vec3 e1 = normalized(first - dot(first, normal) * normal);
        const Vec3 e2 = cross(normal, e1);
        const auto angle = [&](int32_t v) {
          const Vec3 d = skin.position[static_cast<std::size_t>(v)] - center;
          return std::atan2(dot(d, e2), dot(d, e1));
        };
        std::sort(corners.begin(), corners.end(), [&](int32_t a, int32_t b) { return angle(a) < angle(b); });
        for (std::size_t c = 1; c + 1 < corners.size(); ++c) {
          skin.triangles.push_back({corners[0], corners[c], corners[c + 1]});
        }
      }
    }
  }
  return skin;
}

// What single precision keeps of a state: displacements from rest, velocities and rotations.
inline void round_to_single(const Body& body, State& state) {
  const auto single = [](double value) { return static_cast<double>(static_cast<float>(value)); };
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const Vec3 rest = body.rest_position(static_cast<int32_t>(i));
    for (int axis = 0; axis < 3; ++axis) {
      state.x[i][axis] = rest[axis] + single(state.x[i][axis] - rest[axis]);
      state.v[i][axis] = single(state.v[i][axis]);
    }
  }
  for (Mat3& r : state.clusters.rotation) {
    for (double& entry : r.m) entry = single(entry);
  }
  state.precision = Precision::binary32;
}

}  // namespace cutproof::tests
