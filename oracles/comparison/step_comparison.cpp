#include "oracles/comparison/step_comparison.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <utility>

#include "oracles/comparison/state_difference.h"
#include "oracles/eigen.h"
#include "oracles/shape_sums.h"
#include "oracles/single_substep.h"
#include "oracles/support.h"

namespace cutproof::oracles {

namespace {

// Of larger bodies the project asks for less (tolerances.md, Against the reference) [h].
constexpr double kBoundOfLargeBodies = 3e-4;
constexpr double kLargeBody = 100;  // [h] across
// A particle this near to the blade's plane, in units of the rounding of its place and the blade's, may count as being
// on either side of it.
constexpr double kSideBand = 32;
// A particle beyond the bound is measured for how far roundings of the frame's start carry it
// (docs/design/tolerances.md, Against the reference), in so many runs, from a fixed seed.
constexpr uint32_t kDisturbedRuns = 16;
constexpr uint32_t kDisturbanceSeed = 1;

double height_over(const BladePose& pose, Vec3 x) { return dot(x - pose.edge, cross(pose.along, pose.back)); }

// Over one of the four sides of the blade's rectangle, up to rounding: whether it is over the rectangle decides which
// way it is pushed. Going round a side, a particle is put exactly there.
bool on_a_border(const Setup& setup, const BladePose& pose, Vec3 x, double unit_roundoff) {
  const double band = kSideBand * unit_roundoff * (norm(x) + norm(pose.edge));
  const double u = std::abs(dot(x - pose.edge, pose.along)), w = dot(x - pose.edge, pose.back);
  return std::abs(u - setup.blade.length / 2) <= band || std::abs(w) <= band || std::abs(w - setup.blade.depth) <= band;
}

std::vector<uint8_t> without(std::vector<uint8_t> mask, const std::vector<uint8_t>& excluded) {
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = mask[i] && !excluded[i];
  return mask;
}

// The matrix of which a cluster's rotation is the best one, Σ w (x − t) (X − T)ᵀ, as far as it says how sure that is.
struct Shape {
  bool finite = true;
  bool unique = true;           // (σ2 + σ3) / σ1 >= kUniqueRotation, with σ3 negative for a reflection
  bool line = false;            // collinear at rest
  double second_and_third = 0;  // σ2 + σ3
  double arm = 0;               // Σ w |X − T|
};

Shape shape_of(const WeightedRest& body, const Clusters& clusters, const std::vector<Vec3>& x, int32_t c) {
  using Eigen::Matrix3d, Eigen::Vector3d;
  const ClusterMeans means = cluster_means(body, clusters, x, c);
  Matrix3d a = Matrix3d::Zero(), of_rest = Matrix3d::Zero();
  Shape shape;
  for (const int32_t i : clusters.of(c)) {
    const double w = body.weight[at(i)];
    const Vec3 arm = body.position[at(i)] - means.rest;
    shape.arm += w * norm(arm);
    const Vector3d now = w * as_eigen(x[at(i)] - means.current), rest = as_eigen(arm);
    a += now * rest.transpose();
    of_rest += w * rest * rest.transpose();
  }
  const Vector3d widths = Eigen::SelfAdjointEigenSolver<Matrix3d>(of_rest, Eigen::EigenvaluesOnly).eigenvalues();
  shape.line = !(widths[1] > kUniqueRotation * kUniqueRotation * widths[2]);  // of lengths squared
  shape.finite = a.allFinite();
  if (!shape.finite) return shape;
  // Singular values as roots of the eigenvalues of AᵀA: exact to about 1e-8 of the greatest, which is far below
  // kUniqueRotation.
  const Eigen::SelfAdjointEigenSolver<Matrix3d> squares(a.transpose() * a, Eigen::EigenvaluesOnly);
  Vector3d sigma = squares.eigenvalues().reverse().cwiseMax(0.0).cwiseSqrt();
  if (a.determinant() < 0) sigma[2] = -sigma[2];
  shape.second_and_third = sigma[1] + sigma[2];
  shape.unique = shape.second_and_third >= kUniqueRotation * sigma[0] && sigma[0] > 0;
  return shape;
}

// Each iteration carries what a particle does to the others of its clusters.
void spread(std::vector<uint8_t>& particles, const Clusters& clusters, int64_t iterations) {
  for (bool grows = true; grows && iterations > 0; --iterations) {
    grows = false;
    std::vector<uint8_t> next = particles;
    for (int32_t c = 0; c < clusters.count(); ++c) {
      const auto members = clusters.of(c);
      const auto reached = [&](int32_t i) { return particles[at(i)] != 0; };
      if (std::none_of(members.begin(), members.end(), reached)) continue;
      for (const int32_t i : members) {
        grows |= next[at(i)] == 0;
        next[at(i)] = 1;
      }
    }
    particles = std::move(next);
  }
}

}  // namespace

std::vector<RotationDifference> rotation_differences(const Setup& setup, const State& expected, const State& actual) {
  const Clusters& clusters = expected.clusters;
  std::vector<RotationDifference> turns(at(clusters.count()));
  const WeightedRest rest = weighted_rest(setup.body, clusters);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const double angle = angle_between(clusters.rotation[at(c)], actual.clusters.rotation[at(c)]);
    if (angle == 0) continue;
    RotationDifference& turn = turns[at(c)];
    const Shape shape = shape_of(rest, clusters, expected.x, c);
    if (!shape.finite || !shape.unique) {
      turn.unique = false;
      turn.moves_members = shape.finite && !shape.line;  // if it is not finite, its positions tell of it
      continue;
    }
    turn.angle = angle;
    turn.displacement = angle * shape.second_and_third / (std::sqrt(2.0) * shape.arm * setup.body.grid.spacing);
  }
  return turns;
}

double body_extent(const Body& body) {
  Eigen::AlignedBox<int32_t, 3> box;  // empty
  for (const int64_t node : body.node) {
    const auto c = body.grid.coordinates(node);
    box.extend(Eigen::Vector3i(c[0], c[1], c[2]));
  }
  return box.isEmpty() ? 0 : box.sizes().maxCoeff();
}

// The reference's step of frame before.frame, substep by substep, which gives the same bits as all at once. A tied
// particle is led to the side `wanted` [n] (0: none) by moving it across the plane, within its rounding.
StepComparison::Stepped StepComparison::step(const State& before, const std::vector<int8_t>& wanted,
                                             std::vector<State>* starts) {
  const Setup& setup = setup_;
  Setup& single = one_substep_;
  Stepped result{before, std::vector<uint8_t>(before.x.size(), 0), 0};
  State& state = result.state;
  state.frame = 0;
  const bool touches = setup.has_blade && setup.detect.criterion != Criterion::geometric;
  for (int32_t s = 0; s < setup.step.substeps; ++s) {
    take_substep(setup, before.frame, s, single);
    if (touches && single.blade_moves[0].down) {
      const BladePose& pose = single.blade_moves[0].from;
      for (std::size_t i = 0; i < state.x.size(); ++i) {
        if (!state.alive[i]) continue;
        const double height = height_over(pose, state.x[i]);
        const double rounding = unit_roundoff(state) * (norm(state.x[i]) + norm(pose.edge));
        if (!(std::abs(height) <= kSideBand * rounding)) continue;
        result.tied[i] = 1;
        const int side = height < 0 ? -1 : +1;
        if (wanted[i] == 0 || wanted[i] == side) continue;
        const double other = wanted[i] * std::max(std::abs(height), rounding);
        state.x[i] += (other - height) * cross(pose.along, pose.back);
        ++result.led;
      }
    }
    if (starts != nullptr) starts->push_back(state);
    reference_step_(single, state);
  }
  state.frame = before.frame;
  return result;
}

// If every coordinate of the start is off by one rounding of a position, where it begins or where it ends, whichever is
// more, up or down, and every velocity by what one such rounding at the end of a substep makes of it. In each four runs
// a particle goes along all four diagonals, so none is missed along which it matters; particles are out of step with
// each other.
StepComparison::Growth StepComparison::growth_of_rounding(const State& before, const State& expected,
                                                          const std::vector<int8_t>& wanted) {
  const Setup& setup = setup_;
  Growth growth;
  growth.position.resize(before.x.size());
  growth.turn.resize(at(expected.clusters.count()));
  std::vector<std::uint_fast32_t> phase(before.x.size());
  std::mt19937 random(kDisturbanceSeed);
  for (uint32_t run = 0; run < kDisturbedRuns; ++run) {
    if (run % 4 == 0) std::generate(phase.begin(), phase.end(), random);
    State disturbed = before;
    for (std::size_t i = 0; i < phase.size(); ++i) {
      Vec3& x = disturbed.x[i];
      const double up = ((phase[i] >> 8) & 1) != 0 ? 1 : -1;
      const double rounding = up * unit_roundoff(before) * std::max(norm(x), norm(expected.x[i]));
      const int reversed = static_cast<int>((phase[i] + run) % 4);  // 3: none
      for (int axis = 0; axis < 3; ++axis) {
        const double off = axis == reversed ? -rounding : rounding;
        x[axis] += off;
        disturbed.v[i][axis] += off / setup.substep_length[at(before.frame)];
      }
    }
    const State end = step(disturbed, wanted).state;
    for (std::size_t i = 0; i < growth.position.size(); ++i) {
      growth.position[i] = std::max(growth.position[i], norm(end.x[i] - expected.x[i]) / setup.body.grid.spacing);
    }
    const std::vector<RotationDifference> turns = rotation_differences(setup, expected, end);
    for (std::size_t c = 0; c < turns.size(); ++c) {
      growth.turn[c] = std::max(growth.turn[c], turns[c].displacement);
    }
  }
  return growth;
}

// What rounding may decide somewhere in the step, though nothing at its start or end tells.
StepComparison::OnTheWay StepComparison::open_on_the_way(const State& before, const std::vector<int8_t>& wanted) {
  std::vector<State> starts;
  step(before, wanted, &starts);
  const WeightedRest rest = weighted_rest(setup_.body, before.clusters);
  OnTheWay open{std::vector<uint8_t>(at(before.clusters.count()), 0), std::vector<uint8_t>(before.x.size(), 0)};
  const bool touches = setup_.has_blade && setup_.detect.criterion != Criterion::geometric;
  for (std::size_t s = 0; s < starts.size(); ++s) {
    Setup fewer = one_substep_;
    take_substep(setup_, before.frame, static_cast<int64_t>(s), fewer);
    for (fewer.step.iterations = 0; fewer.step.iterations < setup_.step.iterations; ++fewer.step.iterations) {
      State state = starts[s];
      reference_step_(fewer, state);
      for (int32_t c = 0; c < before.clusters.count(); ++c) {
        const Shape shape = shape_of(rest, before.clusters, state.x, c);
        if (shape.finite && !shape.unique && !shape.line) open.turning[at(c)] = 1;
      }
      if (!touches || !fewer.blade_moves[0].down) continue;
      for (std::size_t i = 0; i < state.x.size(); ++i) {
        if (on_a_border(setup_, fewer.blade_moves[0].to, state.x[i], unit_roundoff(before))) open.bordering[i] = 1;
      }
    }
  }
  return open;
}

void Undecidable::join(const Undecidable& other) {
  removals += other.removals;
  sides += other.sides;
  sides_taken_otherwise += other.sides_taken_otherwise;
  rotations += other.rotations;
  sensitive += other.sensitive;
  particles_excluded += other.particles_excluded;
}

double position_bound(const Body& body) {
  return body_extent(body) > kLargeBody ? kBoundOfLargeBodies : kPositionsWanted;
}

StepComparison::StepComparison(const Setup& setup, ReferenceStep reference_step)
    : setup_(setup),
      reference_step_(std::move(reference_step)),
      bound_(position_bound(setup.body)),
      one_substep_(frame_of_one_substep(setup)) {}

StepDifference StepComparison::compare(const State& before, const State& after) {
  std::vector<int8_t> wanted(before.x.size(), 0);
  Stepped expected = step(before, wanted);
  const auto apart = [&](const Stepped& stepped, const std::vector<uint8_t>& mask) {
    return position_error(setup_, stepped.state.x, after.x, mask);
  };
  std::vector<uint8_t> mask = without(before.alive, expected.tied);
  // A tie that the backend has broken the other way moves the particle, and with it its clusters, to the other side of
  // the blade. Then the reference is asked again, with these particles on the backend's side.
  if (std::find(expected.tied.begin(), expected.tied.end(), 1) != expected.tied.end() &&
      apart(expected, before.alive).max > bound_) {
    const BladePose& pose = setup_.blade_moves[at((before.frame + 1) * setup_.step.substeps - 1)].to;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      if (expected.tied[i]) wanted[i] = height_over(pose, after.x[i]) < 0 ? -1 : +1;
    }
    Stepped led = step(before, wanted);
    const std::vector<uint8_t> led_mask = without(before.alive, led.tied);
    if (apart(led, led_mask).max < apart(expected, mask).max) {
      expected = std::move(led);
      mask = led_mask;
    } else {
      std::fill(wanted.begin(), wanted.end(), int8_t{0});
    }
  }
  StepDifference difference;
  difference.undecidable.sides = std::count(expected.tied.begin(), expected.tied.end(), 1);
  difference.undecidable.sides_taken_otherwise = expected.led;

  const Clusters &mine = expected.state.clusters, &others = after.clusters;
  const bool same_clusters = mine.offsets == others.offsets && mine.members == others.members;
  std::vector<RotationDifference> turns;
  if (same_clusters) turns = rotation_differences(setup_, expected.state, after);
  for (int32_t c = 0; c < static_cast<int32_t>(turns.size()); ++c) {
    if (!turns[at(c)].moves_members) continue;
    for (const int32_t i : mine.of(c)) mask[at(i)] = 0;
  }
  const bool turned_too_far = std::any_of(
      turns.begin(), turns.end(), [&](const RotationDifference& turn) { return !(turn.displacement <= bound_); });
  std::vector<uint8_t> turn_is_sensitive(turns.size(), 0);
  if (turned_too_far || apart(expected, mask).max > bound_) {
    const Growth growth = growth_of_rounding(before, expected.state, wanted);
    // Each evaluation of the positions rounds again, independently of the others.
    const double grown = std::sqrt(setup_.step.substeps * (setup_.step.iterations + 1.0));
    const OnTheWay open = open_on_the_way(before, wanted);
    std::vector<uint8_t> decided = open.bordering;  // by rounding, and beyond the bound
    for (std::size_t c = 0; c < turns.size(); ++c) {
      if (!open.turning[c]) continue;
      turns[c].unique = false;
      for (const int32_t i : mine.of(static_cast<int32_t>(c))) decided[at(i)] = 1;
    }
    for (std::size_t i = 0; i < mask.size(); ++i) {
      const double deviation = norm(after.x[i] - expected.state.x[i]) / setup_.body.grid.spacing;
      const bool sensitive = mask[i] && deviation <= grown * growth.position[i];
      decided[i] = before.alive[i] && deviation > bound_ && (decided[i] || expected.tied[i] || sensitive);
      if (decided[i] && sensitive) ++difference.undecidable.sensitive;
    }
    if (same_clusters) spread(decided, mine, setup_.step.substeps * int64_t{setup_.step.iterations});
    mask = without(std::move(mask), decided);
    for (std::size_t c = 0; c < turns.size(); ++c) {
      turn_is_sensitive[c] = turns[c].displacement > bound_ && turns[c].displacement <= grown * growth.turn[c];
    }
  }
  // A cluster follows its particles: where one of them may go either way, so may its rotation.
  for (int32_t c = 0; c < static_cast<int32_t>(turns.size()); ++c) {
    const RotationDifference& turn = turns[at(c)];
    const auto members = mine.of(c);
    const bool undecidable = !turn.unique || turn_is_sensitive[at(c)] ||
                             (turn.displacement > bound_ &&
                              std::any_of(members.begin(), members.end(), [&](int32_t i) { return mask[at(i)] == 0; }));
    if (undecidable) {
      ++difference.undecidable.rotations;
    } else {
      difference.angle.add(turn.angle, c);
      difference.rotation.add(turn.displacement, c);
    }
  }
  difference.undecidable.particles_excluded = std::count(before.alive.begin(), before.alive.end(), 1) -
                                              std::count_if(mask.begin(), mask.end(), [](uint8_t m) { return m != 0; });
  difference.position = apart(expected, mask);
  difference.velocity =
      velocity_error(setup_, expected.state.v, after.v, setup_.substep_length[at(before.frame)], mask);
  difference.expected = std::move(expected.state);
  return difference;
}

}  // namespace cutproof::oracles
