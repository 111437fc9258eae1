// A scene that is turned, shifted, scaled, renumbered or doubled must give the same answer, transformed.
#include <fmt/format.h>

#include <cmath>
#include <numeric>

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

Verdict judge_exactly(Verdict verdict, const std::string& how, const State& expected, const State& actual) {
  verdict.checked += static_cast<int64_t>(expected.x.size());
  if (const auto found = bit_difference(expected, actual)) return fail_on(std::move(verdict), how, *found);
  return verdict;
}

Verdict run_transformed(Backend& backend, const Setup& setup, const State& state, Span span, uint64_t seed) {
  Verdict verdict = begin("equivariance", backend, state, "1", "tolerances.md, A transformed scene");
  if (auto unjudged = unfit(verdict, setup, state)) return *unjudged;
  if (auto unjudged = unable(verdict, backend, span)) return *unjudged;
  const uint64_t kind = seed % kEquivarianceKinds;
  uint64_t random = seed;
  Transform transform;
  switch (kind) {
    case 0: {  // turned
      transform = random_turn(random);
      for (int32_t& padding : transform.padding) padding = static_cast<int32_t>(mixed(random) % 3);
      const TransformedScene scene(transform, setup);
      const State transformed = reordered(scene.state(state), shuffled(state.clusters.count(), random));
      return judge_transformed(verdict, "turned, " + text_of(transform), backend, setup, state, scene, transformed,
                               span, random);
    }
    case 1: {  // shifted on the grid
      for (int32_t& padding : transform.padding) padding = static_cast<int32_t>(mixed(random) % 8);
      const TransformedScene scene(transform, setup);
      return judge_transformed(std::move(verdict),
                               fmt::format("shifted by ({}, {}, {}) nodes", transform.padding[0], transform.padding[1],
                                           transform.padding[2]),
                               backend, setup, state, scene, scene.state(state), span, random);
    }
    case 2: {  // clusters renumbered
      const TransformedScene scene(transform, setup);
      const State transformed = reordered(state, shuffled(state.clusters.count(), random));
      return judge_transformed(verdict, "clusters in another order", backend, setup, state, scene, transformed, span,
                               random);
    }
    case 3: {  // scaled by a power of two
      const int power = static_cast<int>(mixed(random) % 17) - 8;
      transform.scale = std::ldexp(1.0, power == 0 ? 9 : power);
      const TransformedScene scene(transform, setup);
      const State original = after(backend, setup, state, {span});
      if (auto unjudged = unfit(verdict, setup, original)) return *unjudged;
      const State expected = scene.state(original);
      const State actual = after(backend, scene.setup(), scene.state(state), {span});
      return judge_exactly(std::move(verdict), fmt::format("scaled by {}", transform.scale), expected, actual);
    }
    case 4: {  // elsewhere in the world
      transform.world_shift = {1e6 * setup.body.grid.spacing, -3e5 * setup.body.grid.spacing, 0.1};
      const TransformedScene scene(transform, setup);
      const State expected = after(backend, setup, state, {span});
      const State actual = after(backend, scene.setup(), state, {span});
      return judge_exactly(std::move(verdict), "elsewhere in the world", expected, actual);
    }
    default: {  // two of them
      const State expected = after(backend, setup, state, {span});
      backend.load({setup, setup}, {state, state});
      backend.run(span);
      const std::vector<State> both = backend.snapshot();
      for (std::size_t body = 0; body < 2 && verdict.holds; ++body) {
        verdict =
            judge_exactly(std::move(verdict), fmt::format("body {} of two equal ones", body), expected, both.at(body));
      }
      return verdict;
    }
  }
}

}  // namespace

Verdict equivariance(Backend& backend, const Setup& setup, const State& state, Span span, uint64_t seed) {
  return conclude(run_transformed(backend, setup, state, span, seed), "a body of no particles");
}

}  // namespace cutproof::oracles
