// The experiment of accuracy.md, Claims of the paper: how often do cuts leave connected tissue whose clusters are no
// longer coupled, and what does expansion do about it?
//
// Random bodies of up to 19 × 19 × 10 nodes get `sampled` clusters with a ball radius of 1.6 to 3.27 nodes and a
// spacing of the radius divided by a ratio, which is swept; then 1 to 4 partial planar cuts of half-thickness 0.45
// to 1.05 nodes at once; then the stage split. A run is uncoupled if G has fewer components than the relation "shares a
// cluster". The same bodies and cuts are used for every ratio, and for `boxes`.
//
// Exit status: 0 if cuts uncouple tissue in some run, the published expansion leaves some of it uncoupled, and neither
// edge_cover nor `boxes` leaves any; 1 if not; 2 for wrong arguments.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "model/setup.h"
#include "oracles/oracles.h"
#include "property_tests/cases.h"
#include "property_tests/random.h"
#include "reference_cpu/reference.h"

namespace cutproof::property_tests {
namespace {

constexpr Node kMostNodes = {19, 19, 10};
constexpr double kLeastRadius = 1.6, kGreatestRadius = 3.27;                 // [nodes]
constexpr double kLeastHalfThickness = 0.45, kGreatestHalfThickness = 1.05;  // [nodes]
constexpr int32_t kMostCuts = 4;
constexpr std::array<double, 7> kRatios = {1.0, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0};  // radius / spacing

Vec3 random_direction(Random& random) {
  for (;;) {
    Vec3 p;
    for (int axis = 0; axis < 3; ++axis) p[axis] = random.real(-1, 1);
    if (dot(p, p) <= 1 && dot(p, p) >= 1e-4) return normalized(p);
  }
}

// A block or an ellipsoid, solid or with holes.
Body random_body(Random& random) {
  Node dims;
  for (std::size_t axis = 0; axis < 3; ++axis) dims[axis] = random.between(3, kMostNodes[axis]);
  const bool round = random.chance(0.5);
  const double fill = random.chance(0.5) ? 1.0 : random.real(0.6, 1.0);
  const auto is_tissue = [&](Node node) {
    double square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) square += std::pow((2.0 * node[axis] + 1) / dims[axis] - 1, 2);
    return (!round || square <= 1) && random.chance(fill);
  };
  return fixtures::body_from_nodes(nodes_where(dims, is_tissue), 1.0);
}

// Particles within the half-thickness of a plane, on one side of a line in it: a cut that ends inside the body.
std::vector<uint8_t> random_cuts(Random& random, const Body& body) {
  std::vector<uint8_t> removed(at(body.particle_count()), 0);
  const int32_t cuts = random.between(1, kMostCuts);
  for (int32_t cut = 0; cut < cuts; ++cut) {
    Vec3 through;
    for (int axis = 0; axis < 3; ++axis) {
      through[axis] = random.real(1, body.grid.nodes[at(axis)] - 2);
    }
    const Vec3 normal = random_direction(random), forward = random_direction(random);
    const double half_thickness = random.real(kLeastHalfThickness, kGreatestHalfThickness);
    for (int32_t p = 0; p < body.particle_count(); ++p) {
      const Vec3 way = body.rest_position(p) - through;  // spacing 1
      if (std::abs(dot(normal, way)) <= half_thickness && dot(forward, way) >= 0) {
        removed[at(p)] = 1;
      }
    }
  }
  return removed;
}

bool is_uncoupled(const Setup& setup, const State& state) {
  return oracles::coupling_components(setup, state).count != oracles::graph_components(setup, state).count;
}

State split_by(const Setup& setup, State state, const std::vector<uint8_t>& removed) {
  for (std::size_t p = 0; p < removed.size(); ++p) {
    if (!removed[p]) continue;
    state.alive[p] = 0;
    state.removed.push_back(static_cast<int32_t>(p));
  }
  reference::split(setup, state);
  return state;
}

State expanded_by(Setup& setup, State state, ExpandRule rule) {
  setup.expand.rule = rule;
  reference::expand(setup, state);
  return state;
}

struct Row {
  int64_t runs = 0;
  int64_t before = 0, after_split = 0, after_published = 0, after_edge_cover = 0, edge_cover_first = 0;  // uncoupled
};

void run_once(Setup& setup, const State& cooked, const std::vector<uint8_t>& removed, Row& row) {
  const State cut = split_by(setup, cooked, removed);
  ++row.runs;
  row.before += is_uncoupled(setup, cooked);
  row.after_split += is_uncoupled(setup, cut);
  row.after_published += is_uncoupled(setup, expanded_by(setup, cut, ExpandRule::published));
  row.after_edge_cover += is_uncoupled(setup, expanded_by(setup, cut, ExpandRule::edge_cover));
  row.edge_cover_first +=
      is_uncoupled(setup, split_by(setup, expanded_by(setup, cooked, ExpandRule::edge_cover), removed));
}

void print(const std::string& name, const Row& row) {
  const auto cell = [&](int64_t count) {
    return fmt::format("{:6d} {:5.1f} %", count, 100.0 * static_cast<double>(count) / static_cast<double>(row.runs));
  };
  fmt::print("{:>10}  {:6d}  {}  {}  {}  {}  {}\n", name, row.runs, cell(row.before), cell(row.after_split),
             cell(row.after_published), cell(row.after_edge_cover), cell(row.edge_cover_first));
}

int sweep(int64_t bodies, uint64_t seed) {
  fmt::print(
      "Uncoupled connected tissue after cuts (accuracy.md, Claims of the paper)\n"
      "seed {}; {} bodies of up to {} x {} x {} nodes; ball radius {} to {} nodes, spacing = radius / ratio;\n"
      "1 to {} partial planar cuts of half-thickness {} to {} nodes at once; no merging\n\n",
      seed, bodies, kMostNodes[0], kMostNodes[1], kMostNodes[2], kLeastRadius, kGreatestRadius, kMostCuts,
      kLeastHalfThickness, kGreatestHalfThickness);

  std::array<Row, kRatios.size()> rows = {};
  Row boxes;
  Random bodies_seeds(seed);
  for (int64_t b = 0; b < bodies; ++b) {
    Random random(bodies_seeds.seed());
    Setup setup;
    setup.body = random_body(random);
    const std::vector<uint8_t> removed = random_cuts(random, setup.body);
    const double radius = random.real(kLeastRadius, kGreatestRadius);
    const uint64_t cooking_seed = random.seed();
    const auto run = [&](const ClusterSpec& spec, Row& row) {
      const State cooked = fixtures::cook(setup.body, spec, {ExpandRule::none, 1}, {MergeRule::none}, cooking_seed);
      run_once(setup, cooked, removed, row);
    };
    ClusterSpec spec;
    run(spec, boxes);
    spec.method = Cooking::sampled;
    spec.radius = radius;
    for (std::size_t r = 0; r < kRatios.size(); ++r) {
      spec.spacing = radius / kRatios[r];
      run(spec, rows[r]);
    }
  }

  fmt::print("{:>10}  {:>6}  {:>14}  {:>14}  {:>14}  {:>14}  {:>14}\n", "ratio", "runs", "before cutting",
             "after split", "published", "edge_cover", "covered before");
  Row all;
  for (std::size_t r = 0; r < kRatios.size(); ++r) {
    print(fmt::format("{:.2f}", kRatios[r]), rows[r]);
    all.after_split += rows[r].after_split;
    all.after_published += rows[r].after_published;
    all.after_edge_cover += rows[r].after_edge_cover + rows[r].edge_cover_first;
  }
  print("boxes", boxes);
  const bool as_expected = all.after_split > 0 && all.after_published > 0 && all.after_edge_cover == 0 &&
                           boxes.before == 0 && boxes.after_split == 0;
  fmt::print(
      "\n{}: cuts uncouple tissue, the published expansion mends only some of it, edge_cover and boxes leave none\n",
      as_expected ? "holds" : "DOES NOT HOLD");
  return as_expected ? 0 : 1;
}

}  // namespace
}  // namespace cutproof::property_tests

int main(int argc, char** argv) {
  int64_t bodies = 6000;
  uint64_t seed = 1;
  CLI::App app{"How often cuts leave connected tissue uncoupled, over the ratio of ball radius to seed spacing"};
  app.add_option("--bodies", bodies, "random bodies, each run at every ratio")->check(CLI::Range(1, 100'000'000));
  app.add_option("--seed", seed, "seed of bodies, cuts and clusters");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return cutproof::property_tests::sweep(bodies, seed);
}
