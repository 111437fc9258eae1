// A scene that is turned, shifted, scaled, renumbered or doubled must give the same answer, transformed.
#include <fmt/format.h>

#include <cmath>
#include <numeric>

#include "model/rules.h"
#include "oracles/relations/relations.h"
#include "oracles/relations/transformed_runs.h"

namespace cutproof::oracles {
namespace {

std::vector<int32_t> shuffled(int32_t count, uint64_t& seed) {
  std::vector<int32_t> order(at(count));
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[mixed(seed) % i]);
  return order;
}

int determinant_sign(const Transform& m) {
  const bool even = (m.target[0] + 1) % 3 == m.target[1];  // cyclic
  return (even ? 1 : -1) * m.sign[0] * m.sign[1] * m.sign[2];
}

// One of the 23 turns by quarter turns that are not the identity.
Transform random_turn(uint64_t& seed) {
  for (;;) {
    Transform transform;
    const auto order = shuffled(3, seed);
    for (std::size_t a = 0; a < 3; ++a) {
      transform.target[a] = order[a];
      transform.sign[a] = mixed(seed) % 2 == 0 ? 1 : -1;
    }
    const bool identity = transform.target == std::array{0, 1, 2} && transform.sign == std::array{1, 1, 1};
    if (determinant_sign(transform) > 0 && !identity) return transform;
  }
}

std::string text_of(const Transform& transform) {
  std::string text;
  for (std::size_t a = 0; a < 3; ++a) {
    text += fmt::format("{}{} -> {}{}", a == 0 ? "" : ", ", "xyz"[a], transform.sign[a] < 0 ? "-" : "+",
                        "xyz"[transform.target[a]]);
  }
  return text;
}

}  // namespace

Verdict equivariance(Backend& backend, const Setup& setup, const State& state, Span span, uint64_t seed) {
  const Relation relation = {"equivariance", "1", "tolerances.md, A transformed scene", "a body of no particles"};
  return judge_relation(relation, backend, span, setup, state, [&](Verdict& verdict) {
    uint64_t kind = seed % kEquivarianceKinds;
    // A turned body has its particles in another order, and so another end goes of two that are alike.
    if (kind == 0 && !promise_of(setup.detect.remove).order_independent) kind = 1;
    uint64_t random = seed;
    Transform transform;
    const auto pad = [&](uint64_t layers) {
      for (int32_t& padding : transform.padding) padding = static_cast<int32_t>(mixed(random) % layers);
    };
    std::string how;
    if (kind == 0) {
      transform = random_turn(random);
      pad(3);
      how = "turned, " + text_of(transform);
    } else if (kind == 1) {
      pad(8);
      const auto [i, j, k] = transform.padding;
      how = fmt::format("shifted by ({}, {}, {}) nodes", i, j, k);
    } else if (kind == 2) {
      how = "clusters in another order";
    } else if (kind == 3) {
      const int power = static_cast<int>(mixed(random) % 17) - 8;
      transform.scale = std::ldexp(1.0, power == 0 ? 9 : power);
      how = fmt::format("scaled by {}", transform.scale);
    } else if (kind == 4) {
      transform.world_shift = {1e6 * setup.body.grid.spacing, -3e5 * setup.body.grid.spacing, 0.1};
      how = "elsewhere in the world";
    }
    const TransformedScene scene(transform, setup);
    State transformed = scene.state(state);
    if (kind == 0 || kind == 2) transformed = reordered(transformed, shuffled(state.clusters.count(), random));
    if (kind < 3) return judge_transformed(verdict, how, backend, setup, state, scene, transformed, span, random);

    const State original = after(backend, setup, state, span);
    if (!is_fit(verdict, setup, original)) return;
    const auto judge_exactly = [&](const std::string& which, const State& actual) {
      verdict.checked += static_cast<int64_t>(actual.x.size());
      return require_same_bits(verdict, which, scene.state(original), actual);
    };
    if (kind < 5) {
      judge_exactly(how, after(backend, scene.setup(), transformed, span));
      return;
    }
    backend.load({setup, setup}, {state, state});
    backend.run(span);
    const std::vector<State> both = backend.snapshot();
    for (std::size_t body = 0; body < 2; ++body) {
      if (!judge_exactly(fmt::format("body {} of two equal ones", body), both.at(body))) return;
    }
  });
}

}  // namespace cutproof::oracles
