// A run made by hand: a block that drifts and falls in two.
#pragma once
#include <cmath>
#include <string>

#include "model/setup.h"
#include "report/pictures.h"

namespace cutproof::report {

inline constexpr double kSpacing = 0.01;

// n × n × n nodes with a ring of empty ones around them.
inline Setup block(int32_t n) {
  Setup setup;
  Body& body = setup.body;
  body.name = "block";
  body.grid = {{n + 2, n + 2, n + 2}, kSpacing};
  body.particle_at.assign(static_cast<std::size_t>(body.grid.node_count()), -1);
  for (int32_t k = 1; k <= n; ++k) {
    for (int32_t j = 1; j <= n; ++j) {
      for (int32_t i = 1; i <= n; ++i) {
        const int64_t node = body.grid.index(i, j, k);
        body.particle_at[static_cast<std::size_t>(node)] = body.particle_count();
        body.node.push_back(node);
        body.mass.push_back(1);
      }
    }
  }
  return setup;
}

// As loaded: one cluster of all particles.
inline State at_rest(const Body& body) {
  State state;
  const int32_t n = body.particle_count();
  for (int32_t i = 0; i < n; ++i) {
    state.x.push_back(body.rest_position(i));
    state.clusters.members.push_back(i);
  }
  state.v.resize(state.x.size());
  state.alive.assign(state.x.size(), 1);
  state.clusters.offsets = {0, n};
  state.clusters.number = {7};
  return state;
}

// Frames of which each ends with a snapshot after skin, and has one after split before it. Particles move by no step of
// 16 bits, and so differently that little of it is compressed away.
inline io::Snapshot drifted(const Body& body, int64_t index) {
  io::Snapshot snapshot = {index % 2 == 0 ? Stage::skin : Stage::split, at_rest(body)};
  State& state = snapshot.state;
  state.frame = index / 2;
  const auto frame = static_cast<double>((index + 1) / 2);
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const auto p = static_cast<double>(i);
    state.x[i] += Vec3{1e-4 * std::sin(12.9898 * p + frame), 1e-4 * std::sin(78.233 * p * frame), -3e-4 * frame};
  }
  return snapshot;
}

inline Source source_of(const Setup& setup, int64_t frames) {
  return {setup, 2 * frames + 1, [&setup](int64_t index) { return drifted(setup.body, index); }};
}

}  // namespace cutproof::report
