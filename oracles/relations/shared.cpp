#include "oracles/relations/shared.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "oracles/oracles.h"
#include "oracles/relations/relations.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {
namespace {

// By how much a cluster's rotation amplifies an error of positions: Σ w |X − T| r / (σ2 + σ3) at rest, r the greatest
// distance from the center. Of a collinear cluster the rotation moves no particle.
double greatest_amplification(const Body& body, const Clusters& clusters, const std::vector<int32_t>& counts,
                              const std::vector<Vec3>& rest) {
  double greatest = 0;
  const WeightedRest weighted = weighted_rest(body, counts);
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const ClusterMeans means = cluster_means(weighted, clusters, rest, c);
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    double moment = 0, radius = 0;
    for (const int32_t i : clusters.of(c)) {
      const Vec3 d = rest[at(i)] - means.rest;
      const double w = weighted.weight[at(i)];
      a += w * Eigen::Vector3d(d.x, d.y, d.z) * Eigen::RowVector3d(d.x, d.y, d.z);
      moment += w * norm(d);
      radius = std::max(radius, norm(d));
    }
    const Eigen::Vector3d sigma = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(a).eigenvalues();
    constexpr double kCollinear = 1e-12;
    const double gap = sigma[0] + sigma[1];  // ascending: the two smaller ones
    if (gap > kCollinear * sigma[2]) greatest = std::max(greatest, moment * radius / gap);
  }
  return greatest;
}

std::vector<Vec3> rest_positions(const Body& body) {
  std::vector<Vec3> rest;
  for (int32_t i = 0; i < body.particle_count(); ++i) rest.push_back(body.rest_position(i));
  return rest;
}

template <class T>
std::optional<BitDifference> first_different(const Field& field, const T& a, const T& b, const State&) {
  if (same_bits(a, b)) return std::nullopt;
  return BitDifference{fmt::format("{} differs", field.text), {}, {}};
}

template <class T>
std::optional<BitDifference> first_different(const Field& field, const std::vector<T>& a, const std::vector<T>& b,
                                             const State& names) {
  if (same_bits(a, b)) return std::nullopt;
  std::size_t i = 0;
  while (i < std::min(a.size(), b.size()) && same_bits(a[i], b[i])) ++i;
  const auto index = static_cast<int32_t>(i);
  if (field.space == IndexSpace::particle) {
    return BitDifference{fmt::format("{} of particle {} differs", field.text, i), {index}, {}};
  }
  if (field.space != IndexSpace::cluster) {
    return BitDifference{fmt::format("{} differs, first in entry {}", field.text, i), {}, {}};
  }
  BitDifference found{fmt::format("{} of the cluster in place {} differs", field.text, i), {}, {}};
  if (i < names.clusters.number.size()) found.clusters = {names.clusters.number[i]};
  return found;
}

}  // namespace

Verdict begin(const char* property, const Backend& backend, const State& state, const char* unit, const char* source) {
  Verdict verdict = start_verdict(property, state, unit, source);
  verdict.backend = backend.name();
  return verdict;
}

Verdict fail(Verdict verdict, std::string text, std::vector<int32_t> particles, std::vector<int32_t> clusters) {
  verdict.holds = false;
  verdict.witness.text = std::move(text);
  verdict.witness.particles = std::move(particles);
  verdict.witness.clusters = std::move(clusters);
  return verdict;
}

Verdict vacuous(Verdict verdict, std::string why) {
  verdict.checked = 0;
  verdict.vacuous = std::move(why);
  return verdict;
}

std::optional<Verdict> unfit(const Verdict& verdict, const Setup& setup, const State& state) {
  const Verdict form = well_formed(setup, state);
  if (form.holds) return std::nullopt;
  return fail(verdict, "not judged: the state is not well formed: " + form.witness.text);
}

std::optional<Verdict> unable(const Verdict& verdict, const Backend& backend, Span span) {
  if (backend.can_run(span)) return std::nullopt;
  return vacuous(verdict,
                 span.first == span.last
                     ? fmt::format("the backend cannot run {} by itself", name_of(span.first))
                     : fmt::format("the backend cannot run {} to {}", name_of(span.first), name_of(span.last)));
}

State after(Backend& backend, const Setup& setup, const State& state, const std::vector<Span>& spans) {
  backend.load({setup}, {state});
  for (const Span span : spans) backend.run(span);
  return backend.snapshot().at(0);
}

State after_frames(Backend& backend, const Setup& setup, const State& state, int64_t frames) {
  return after(backend, setup, state, std::vector<Span>(at(frames), kFrame));
}

Span step_span(const Backend& backend) { return backend.can_run(kStep) ? kStep : kFrame; }

State after_step(Backend& backend, const Setup& setup, const State& state) {
  return after(backend, setup, state, {step_span(backend)});
}

std::optional<BitDifference> bit_difference(const State& a, const State& b) {
  std::optional<BitDifference> found;
  for (const bool decisions : {true, false}) {
    for_each_field([&](const Field& field, auto get) {
      if (!found && field.is_decision == decisions) found = first_different(field, get(a), get(b), a);
    });
  }
  return found;
}

Verdict fail_on(Verdict verdict, const std::string& where, const BitDifference& difference) {
  verdict.measured = 1;
  return fail(std::move(verdict), where + ": " + difference.text, difference.particles, difference.clusters);
}

double substep_rounding(const Setup& setup, const State& state) {
  const Body& body = setup.body;
  double mass = 0, lightest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < body.mass.size(); ++i) {
    if (!state.alive[i]) continue;
    mass += body.mass[i];
    lightest = std::min(lightest, body.mass[i]);
  }
  if (mass == 0) return 0;
  const std::vector<int32_t> counts = membership_counts(state.clusters, body.particle_count());
  const double amplification = greatest_amplification(body, state.clusters, counts, rest_positions(body));
  const RoundingScale scale = rounding_scale(setup, state);
  return setup.step.iterations * error_growth(setup.step) * std::sqrt(mass / lightest) * (1 + amplification) *
             goal_rounding(scale) +
         8 * scale.unit_roundoff * scale.extent;
}

double greatest_distance(const State& state, const std::vector<Vec3>& expected, int32_t& where) {
  double greatest = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (!state.alive[i]) continue;
    const double distance = norm(state.x[i] - expected[i]);
    if (distance <= greatest) continue;
    where = static_cast<int32_t>(i);
    if (!std::isfinite(distance)) return distance;
    greatest = distance;
  }
  return greatest;
}

Setup undisturbed(Setup setup) {
  setup.has_blade = false;
  setup.blade_moves.clear();
  setup.walls.clear();
  setup.grips.clear();
  setup.detect.criterion = Criterion::none;
  setup.skin.wanted = false;
  return setup;
}

State at_rest(const Setup& setup, const State& state) {
  State rest = state;
  rest.frame = 0;
  for (int32_t i = 0; i < setup.body.particle_count(); ++i) {
    if (state.alive[at(i)]) rest.x[at(i)] = setup.body.rest_position(i);
    rest.v[at(i)] = {};
  }
  rest.removed.clear();
  rest.debris.clear();
  rest.clusters.rotation.assign(at(state.clusters.count()), Mat3{});
  rest.impulse = {};
  rest.skin = {};
  return rest;
}

}  // namespace cutproof::oracles
