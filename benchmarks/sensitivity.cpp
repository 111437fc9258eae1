#include "benchmarks/sensitivity.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "harness/frame_runner.h"
#include "harness/judge.h"
#include "harness/reference_stages.h"
#include "model/at.h"
#include "oracles/iterates/probe.h"
#include "oracles/oracles.h"

namespace cutproof::benchmarks {

namespace {

using oracles::Measure;

constexpr double kEarth = 9.81;              // [m/s²] of a weight, also where a scene has no gravity
constexpr Vec3 kAlong = {0.36, -0.48, 0.8};  // of length 1, along no axis
constexpr double kFinest = 1.05;             // ratio of sizes at which bisection ends
constexpr double kParameters = 1e-3, kForces = 1e-4;

double spacing(const Setup& setup) { return setup.body.grid.spacing; }

// Length of a substep [s] in the state's frame; after the schedule, in its last frame.
double substep_of(const Setup& setup, const State& state) {
  return setup.substep_length[at(std::min(state.frame, setup.frame_count() - 1))];
}

// The living particle nearest to the middle of the list, or -1.
int32_t middle_particle(const State& state) {
  const auto n = static_cast<int32_t>(state.alive.size());
  for (int32_t away = 0; away <= n; ++away) {
    for (const int32_t i : {n / 2 + away, n / 2 - away}) {
      if (i >= 0 && i < n && state.alive[at(i)]) return i;
    }
  }
  return -1;
}

// Calls `change` with the index of the one in the middle of a list.
template <class List, class Change>
void in_the_middle(List& list, const Change& change) {
  if (!list.empty()) change(list[list.size() / 2]);
}

Mat3 turned(const Mat3& r, double angle) {
  const Vec3 a = kAlong;
  const double c = std::cos(angle), s = std::sin(angle), d = 1 - c;
  Mat3 turn;
  turn.m = {c + d * a.x * a.x,       d * a.x * a.y - s * a.z, d * a.x * a.z + s * a.y,
            d * a.x * a.y + s * a.z, c + d * a.y * a.y,       d * a.y * a.z - s * a.x,
            d * a.x * a.z - s * a.y, d * a.y * a.z + s * a.x, c + d * a.z * a.z};
  Mat3 product;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      product.m[3 * i + j] = 0;
      for (std::size_t k = 0; k < 3; ++k) product.m[3 * i + j] += turn.m[3 * i + k] * r.m[3 * k + j];
    }
  }
  return product;
}

double mass_of(const Setup& setup, const State& state) {
  double mass = 0;
  for (std::size_t i = 0; i < state.alive.size(); ++i) mass += state.alive[i] ? setup.body.mass[i] : 0;
  return mass;
}

// Equal and opposite impulses on the first two components along the line between them. Unit: the weight of the lighter
// one over the frame.
bool draw_together(Setup& setup, State& before, double size) {
  const oracles::Partition partition = oracles::graph_components(setup, before);
  if (partition.count < 2) return false;
  double mass[2] = {};
  Vec3 moment[2];
  const auto each = [&](const auto& see) {
    for (std::size_t i = 0; i < before.x.size(); ++i) {
      if (before.alive[i] && partition.label[i] < 2) see(i, at(partition.label[i]));
    }
  };
  each([&](std::size_t i, std::size_t piece) {
    mass[piece] += setup.body.mass[i];
    moment[piece] += setup.body.mass[i] * before.x[i];
  });
  const Vec3 way = moment[1] / mass[1] - moment[0] / mass[0];
  const double time = setup.step.substeps * substep_of(setup, before);
  const Vec3 impulse = (size * kEarth * std::min(mass[0], mass[1]) * time / norm(way)) * way;
  each([&](std::size_t i, std::size_t piece) { before.v[i] += (piece == 0 ? 1 : -1) / mass[piece] * impulse; });
  return true;
}

std::function<double(const oracles::StageDifference&)> greatest(Measure which) {
  return [which](const oracles::StageDifference& found) { return found.error(which).norm.max; };
}

std::vector<Disturbance> make_disturbances() {
  std::vector<Disturbance> all;
  const auto state = [&](std::string name, std::string unit, std::function<void(const Setup&, State&, double)> of_state,
                         std::function<double(const oracles::StageDifference&)> rounding) {
    all.push_back({std::move(name), std::move(unit), std::move(of_state), {}, std::move(rounding), {}});
  };
  state(
      "position", "h",
      [](const Setup& setup, State& s, double size) {
        if (const int32_t i = middle_particle(s); i >= 0) s.x[at(i)] += size * spacing(setup) * kAlong;
      },
      greatest(Measure::position));
  state(
      "velocity", "h/dt",
      [](const Setup& setup, State& s, double size) {
        const double unit = spacing(setup) / substep_of(setup, s);
        if (const int32_t i = middle_particle(s); i >= 0) s.v[at(i)] += size * unit * kAlong;
      },
      greatest(Measure::velocity));
  state("impulse", "M h/dt",
        [](const Setup& setup, State& s, double size) {
          s.impulse += size * mass_of(setup, s) * spacing(setup) / substep_of(setup, s) * kAlong;
        },
        {});
  state(
      "rotation", "rad",
      [](const Setup&, State& s, double size) {
        in_the_middle(s.clusters.rotation, [&](Mat3& r) { r = turned(r, size); });
      },
      [](const oracles::StageDifference& found) { return found.angle.max; });
  all.back().greatest = 3;
  state(
      "mass", "1",
      [](const Setup&, State& s, double size) { in_the_middle(s.clusters.mass, [&](double& m) { m *= 1 + size; }); },
      greatest(Measure::mass));
  state(
      "rest center", "h",
      [](const Setup& setup, State& s, double size) {
        in_the_middle(s.clusters.rest_center, [&](Vec3& t) { t += size * spacing(setup) * kAlong; });
      },
      greatest(Measure::rest_center));
  state(
      "skin vertex", "h",
      [](const Setup& setup, State& s, double size) {
        in_the_middle(s.skin.position, [&](Vec3& x) { x += size * spacing(setup) * kAlong; });
      },
      greatest(Measure::skin));

  const auto run = [&](std::string name, std::string unit, double goal,
                       std::function<bool(Setup&, State&, double)> of_run) {
    all.push_back({std::move(name), std::move(unit), {}, std::move(of_run), {}, goal});
  };
  run("gravity", "1", kParameters, [](Setup& setup, State&, double size) {
    setup.step.gravity = (1 + size) * setup.step.gravity;
    return norm(setup.step.gravity) > 0;
  });
  run("stiffness", "1", kParameters, [](Setup& setup, State&, double size) {
    setup.step.stiffness *= 1 + size;
    return setup.step.solver == Solver::implicit && setup.step.iterations > 0;
  });
  // Friction decreases: an increase would hold only particles that are held already.
  run("friction", "1", kParameters, [](Setup& setup, State&, double size) {
    bool any = setup.has_blade && setup.blade.friction > 0;
    setup.blade.friction /= 1 + size;
    for (Wall& wall : setup.walls) {
      any = any || wall.friction > 0;
      wall.friction /= 1 + size;
    }
    return any;
  });
  run("impulse between pieces", "weight", kForces, draw_together);
  return all;
}

std::optional<Verdict> first_failure(const Setup& setup, const harness::Moment& moment) {
  harness::Judge judge(setup, "", harness::Promises{}, harness::Thorough::never);
  judge.begin(moment.before);
  judge.see(moment);
  for (const Verdict& verdict : judge.verdicts()) {
    if (!verdict.holds) return verdict;
  }
  return std::nullopt;
}

// The moment under the disturbance; empty if there is nothing to change.
std::optional<harness::Moment> disturbed(Backend& backend, const Setup& setup, const Disturbance& disturbance,
                                         double size, harness::Moment moment) {
  if (disturbance.of_state) {
    State after = *moment.after;
    disturbance.of_state(setup, after, size);
    if (after == *moment.after) return std::nullopt;
    moment.after = std::make_shared<const State>(std::move(after));
    return moment;
  }
  Setup changed = setup;
  State before = *moment.before;
  if (!disturbance.of_run(changed, before, size)) return std::nullopt;
  backend.load({std::move(changed)}, {std::move(before)});
  backend.run(moment.span);
  moment.after = std::make_shared<const State>(backend.snapshot().front());
  return moment;
}

// A simulator with this error that shows its iterates.
class Disturbed final : public Backend {
 public:
  Disturbed(Backend& right, const Disturbance& disturbance, double size)
      : right_(right), disturbance_(disturbance), size_(size) {}

  std::string name() const override { return right_.name(); }
  Precision precision() const override { return right_.precision(); }
  bool can_run(Span span) const override { return right_.can_run(span); }
  bool shows_iterates() const override { return right_.shows_iterates(); }
  void load(std::vector<Setup> setups, std::vector<State> states) override {
    setups_ = setups;
    has_run_ = false;
    // The step is wrong, not its initial state.
    right_.load(setups, states);
    held_ = right_.snapshot();
    for (std::size_t b = 0; b < setups.size() && disturbance_.of_run; ++b) {
      disturbance_.of_run(setups[b], states[b], size_);
    }
    right_.load(std::move(setups), std::move(states));
  }
  void run(Span span) override {
    right_.run(span);
    has_run_ = true;
  }
  std::vector<State> snapshot() const override {
    if (!has_run_) return held_;
    std::vector<State> states = right_.snapshot();
    for (std::size_t b = 0; b < states.size() && disturbance_.of_state; ++b) {
      disturbance_.of_state(setups_[b], states[b], size_);
    }
    return states;
  }
  SpanReport report() const override { return right_.report(); }

 private:
  Backend& right_;
  const Disturbance& disturbance_;
  double size_;
  std::vector<Setup> setups_;
  std::vector<State> held_;
  bool has_run_ = false;
};

std::optional<Verdict> failure_of_iterates(Backend& backend, const Setup& setup, const Disturbance& disturbance,
                                           double size, const harness::Moment& moment) {
  Disturbed wrong(backend, disturbance, size);
  const oracles::IterateProbe probe(setup, *moment.before, oracles::Iterates::sampled, 1);
  Verdict verdict = probe.judged(oracles::shown_iterates(wrong, {&probe, 1}).front());
  return verdict.holds ? std::nullopt : std::optional(std::move(verdict));
}

}  // namespace

const std::vector<Disturbance>& disturbances() {
  static const std::vector<Disturbance> all = make_disturbances();
  return all;
}

KeptRun keep_run(Backend& backend, const ReadyScene& scene, const StopAsked& stop_asked) {
  harness::Traces traces = harness::run_to_the_end(backend, {scene.setup}, {scene.state});
  KeptRun kept;
  kept.trace = std::move(traces.of_body.front());
  kept.failed = std::move(traces.broken_contracts);
  harness::Judge judge(scene.setup, backend.name(), harness::Promises{}, harness::Thorough::never);
  judge.begin(kept.trace.initial);
  for (const harness::Moment& moment : kept.trace.moments) {
    throw_if_asked(stop_asked);
    judge.see(moment);
  }
  for (const Verdict& verdict : judge.verdicts()) {
    kept.properties.add(verdict);
    if (!verdict.holds) kept.failed.push_back(verdict);
  }
  return kept;
}

std::vector<harness::Moment> moments_of(const Setup& setup, const harness::Trace& trace, Stage stage, int64_t count) {
  std::vector<harness::Moment> fit, chosen;
  for (const harness::Moment& moment : trace.moments) {
    const auto due = harness::due_stages(setup, *moment.before, moment.span, *moment.after);
    if (moment.by_backend && moment.span == Span{stage, stage} && due[at(stage)]) fit.push_back(moment);
  }
  const auto all = static_cast<int64_t>(fit.size());
  const int64_t taken = std::min(count, all);
  // In the middle of each of as many parts of the run.
  for (int64_t k = 0; k < taken; ++k) chosen.push_back(fit[at((2 * k + 1) * all / (2 * taken))]);
  return chosen;
}

Sensitivity least_rejected(Backend& backend, const Setup& setup, const Disturbance& disturbance, Stage stage,
                           const std::vector<harness::Moment>& moments, const StopAsked& stop_asked) {
  Sensitivity found;
  std::vector<harness::Moment> fit;
  for (const harness::Moment& moment : moments) {
    throw_if_asked(stop_asked);
    if (disturbed(backend, setup, disturbance, disturbance.greatest, moment)) fit.push_back(moment);
  }
  found.moments = static_cast<int64_t>(fit.size());
  if (fit.empty()) return found;
  if (disturbance.rounding) {
    oracles::StageComparison comparison(setup, harness::reference_stages());
    found.rounding = 0;
    for (const harness::Moment& moment : fit) {
      throw_if_asked(stop_asked);
      const double off = disturbance.rounding(comparison.compare(stage, *moment.before, *moment.after, true));
      found.rounding = std::max(*found.rounding, off);
    }
  }
  const auto rejects = [&](double size) {
    for (const harness::Moment& moment : fit) {
      throw_if_asked(stop_asked);
      const std::optional<harness::Moment> wrong = disturbed(backend, setup, disturbance, size, moment);
      if (!wrong) continue;
      std::optional<Verdict> failure = first_failure(setup, *wrong);
      if (!failure && stage == Stage::step && setup.step.iterations > 0) {
        failure = failure_of_iterates(backend, setup, disturbance, size, moment);
      }
      if (!failure) continue;
      found.property = failure->property;
      return true;
    }
    return false;
  };
  if (!rejects(disturbance.greatest)) return found;
  double below = kLeastSize, above = disturbance.greatest;
  if (rejects(below)) above = below;
  while (above / below > kFinest) {
    const double middle = std::sqrt(above * below);
    (rejects(middle) ? above : below) = middle;
  }
  // `property` is that of the last rejected size, the least.
  found.least = above;
  return found;
}

}  // namespace cutproof::benchmarks
