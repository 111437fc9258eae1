// A bar of 6 × 3 × 3 particles, made by hand and held together by two clusters. The oracles certify it, reject it once it
// is broken, and certify what the reference and the kernels make of it in one frame.
#include <cutproof/gpu/backends.h>
#include <cutproof/model/backend.h>
#include <cutproof/model/setup.h>
#include <cutproof/model/state.h>
#include <cutproof/model/verdict.h>
#include <cutproof/oracles/oracles.h>
#include <cutproof/reference_cpu/reference.h>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace {

using namespace cutproof;

constexpr int kLength = 6, kWidth = 3;

Setup bar() {
  Setup setup;
  Body& body = setup.body;
  body.name = "bar";
  body.grid = {{kLength + 2, kWidth + 2, kWidth + 2}, 0.01};
  body.particle_at.assign(static_cast<std::size_t>(body.grid.node_count()), -1);
  for (int32_t k = 1; k <= kWidth; ++k) {
    for (int32_t j = 1; j <= kWidth; ++j) {
      for (int32_t i = 1; i <= kLength; ++i) {
        const int64_t node = body.grid.index(i, j, k);
        body.particle_at[static_cast<std::size_t>(node)] = body.particle_count();
        body.node.push_back(node);
        body.mass.push_back(1e-3);
      }
    }
  }
  setup.step.gravity = {0, 0, -9.81};
  setup.skin.wanted = false;
  setup.substep_length = {0.0025};  // one frame
  return setup;
}

// Two clusters that share the two middle layers, so that each edge of the grid lies within one of them.
State at_rest(const Setup& setup) {
  State state;
  const int32_t n = setup.body.particle_count();
  for (int32_t i = 0; i < n; ++i) state.x.push_back(setup.body.rest_position(i));
  state.v.assign(static_cast<std::size_t>(n), Vec3{});
  state.alive.assign(static_cast<std::size_t>(n), 1);
  Clusters& clusters = state.clusters;
  for (int32_t c = 0; c < 2; ++c) {
    for (int32_t i = 0; i < n; ++i) {
      const int32_t layer = i % kLength;
      if (c == 0 ? layer <= 3 : layer >= 2) clusters.members.push_back(i);
    }
    clusters.offsets.push_back(static_cast<int64_t>(clusters.members.size()));
    clusters.number.push_back(c);
  }
  clusters.rotation.resize(2);
  clusters.degenerate.assign(2, 0);
  reference::update_rest_frames(setup.body, clusters);
  state.tau = 1;
  state.cap = n;
  state.edge_covered = true;
  return state;
}

int failures = 0;

void require(bool holds, const std::string& what) {
  if (holds) return;
  std::printf("not so: %s\n", what.c_str());
  ++failures;
}

void require_all_hold(const Setup& setup, const State& state, const std::string& what) {
  int64_t checked = 0;
  for (const Verdict& verdict : oracles::judge(setup, state, true)) {
    require(verdict.holds, what + ": " + verdict.property + ": " + verdict.witness.text);
    checked += verdict.checked;
  }
  require(checked > 0, what + ": something was checked");
}

void require_a_frame_holds(Backend& backend, const Setup& setup, const State& begin) {
  backend.load({setup}, {begin});
  backend.run({});
  const State end = backend.snapshot().front();
  require(end.frame == 1, backend.name() + ": one frame is over");
  require(end.v.front().z < 0, backend.name() + ": the bar falls");
  require_all_hold(setup, end, backend.name() + ", after a frame");
}

}  // namespace

int main() {
  const Setup setup = bar();
  const State right = at_rest(setup);
  require_all_hold(setup, right, "the state made by hand");

  // Particle 0 leaves the only cluster that holds it.
  State broken = right;
  broken.clusters.members.erase(broken.clusters.members.begin());
  for (std::size_t c = 1; c < broken.clusters.offsets.size(); ++c) --broken.clusters.offsets[c];
  const Verdict coverage = oracles::coverage(setup, broken);
  require(!coverage.holds, "an uncovered particle is found");
  require(coverage.witness.particles == std::vector<int32_t>{0}, "the witness names the uncovered particle");

  require_a_frame_holds(*reference::make_backend(), setup, right);
  require_a_frame_holds(*gpu::make_host_backend(), setup, right);

  std::printf(failures == 0 ? "everything holds\n" : "%d failures\n", failures);
  return failures == 0 ? 0 : 1;
}
