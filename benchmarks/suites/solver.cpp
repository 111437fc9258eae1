#include "benchmarks/suites/solver.h"

#include <fmt/format.h>

#include "benchmarks/contenders.h"
#include "model/error.h"
#include "model/io/json_number.h"
#include "model/rules.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

constexpr Span kStep = {Stage::step, Stage::step};
constexpr Acceleration kAccelerations[] = {Acceleration::none, Acceleration::chebyshev};

void check(const SolverOptions& options) {
  const auto refuse = [](const char* option, const std::string& problem, const char* remedy) {
    throw InputError("command line", option, problem, remedy);
  };
  for (const double k : options.stiffness) {
    if (!(k > 0 && k <= 1e15)) refuse("--stiffness", fmt::format("{} is out of bounds", k), "give k in (0, 1e15]");
  }
  for (const int32_t s : options.substeps) {
    if (s < 1 || s > 1000) refuse("--substeps", fmt::format("{} is out of bounds", s), "give numbers from 1 to 1000");
  }
  for (std::size_t i = 0; i < options.iterations.size(); ++i) {
    const int32_t k = options.iterations[i];
    if (k < 1 || k > 10'000 || (i > 0 && k <= options.iterations[i - 1])) {
      refuse("--iterations", fmt::format("{} is out of bounds or out of order", k),
             "give numbers from 1 to 10000, the least first");
    }
  }
  if (options.particles && *options.particles != 0 && *options.particles < 100) {
    refuse("--particles", fmt::format("{} particles are too few", *options.particles), "give at least 100, or 0");
  }
}

// Steps from the state that the backend has, one after the other: what a step costs does not depend on where it begins.
Times time_steps(Backend& backend, int32_t samples) {
  std::vector<double> seconds;
  for (int32_t sample = 0; sample < samples; ++sample) {
    backend.run(kStep);
    seconds.push_back(backend.report().total_seconds);
  }
  return times_of(seconds);
}

SolverCurve measure_curve(Backend& backend, const SolverOptions& options, Setup setup, const State& state,
                          const FrameSolution& solution) {
  SolverCurve curve;
  curve.acceleration = setup.step.acceleration;
  const auto measure = [&](int32_t iterations) {
    setup.step.iterations = iterations;
    const SolverError error = solver_error(backend, setup, state, solution);
    curve.rows[iterations] = {error, time_steps(backend, options.samples)};
  };
  int32_t above = 0;
  std::optional<int32_t> below;
  for (const int32_t iterations : options.iterations) {
    measure(iterations);
    const bool within = curve.rows[iterations].error.max_h < options.tolerance;
    if (!within) above = iterations;
    below = within ? below.value_or(iterations) : std::optional<int32_t>();
  }
  if (!below) return curve;
  curve.least = least_iterations(backend, setup, state, solution, options.tolerance, above, *below);
  if (curve.least && !curve.rows.contains(*curve.least)) measure(*curve.least);
  return curve;
}

json entry_json(const SolverEntry& entry) {
  json result = {
      {"scene", entry.scene},         {"particles", entry.particles}, {"clusters", entry.clusters},
      {"stiffness", entry.stiffness}, {"substeps", entry.substeps},   {"substep_seconds", entry.substep_seconds},
      {"converged", entry.converged}, {"rows", json::array()},        {"to_tolerance", json::array()}};
  for (const SolverCurve& curve : entry.curves) {
    for (const auto& [iterations, row] : curve.rows) {
      const SolverError& error = row.error;
      result["rows"].push_back({{"acceleration", name_of(curve.acceleration)},
                                {"iterations", iterations},
                                {"max_h", json_number(error.max_h)},
                                {"rms_h", json_number(error.rms_h)},
                                {"energy_gap", error.energy_gap ? json_number(*error.energy_gap) : json(nullptr)},
                                {"seconds", to_json(row.times)}});
    }
    if (!curve.least) continue;
    result["to_tolerance"].push_back({{"acceleration", name_of(curve.acceleration)},
                                      {"iterations", *curve.least},
                                      {"seconds", curve.rows.at(*curve.least).times.median}});
  }
  return result;
}

}  // namespace

json to_json(const SolverResult& result) {
  json document = begin_document(result.provenance, result.complete);
  document["precision"] = result.precision;
  document["tolerance_h"] = result.tolerance;
  document["samples"] = result.samples;
  document["scenes"] = json::array();
  for (const SolverEntry& entry : result.scenes) document["scenes"].push_back(entry_json(entry));
  return document;
}

SolverResult run_solver(const SolverOptions& options, const Progress<SolverResult>& progress) {
  check(options);
  const harness::BackendDescriptor& described = require_timed_backend(options.backend);
  harness::BackendChoice choice;
  choice.name = options.backend;
  const std::unique_ptr<Backend> backend = harness::make_backend(choice);

  const int64_t particles = options.particles.value_or(described.takes_full_size ? 101'096 : 2000);
  std::vector<SolverScene> scenes = {make_block_scene()};
  if (particles > 0) scenes.push_back(make_body_scene(particles));

  SolverResult result;
  result.provenance = provenance_of("solver", options.backend);
  result.precision = name_of(backend->precision());
  result.tolerance = options.tolerance;
  result.samples = options.samples;
  progress(result);
  for (const SolverScene& scene : scenes) {
    for (const double stiffness : options.stiffness) {
      for (const int32_t substeps : options.substeps) {
        Setup setup = with_substeps(scene, substeps);
        setup.step.stiffness = stiffness;
        const FrameSolution solution = converged_frame(setup, scene.state);
        SolverEntry entry{scene.name, setup.body.particle_count(), scene.state.clusters.count(), stiffness,
                          substeps,   setup.substep_length[0],     solution.converged,           {}};
        for (const Acceleration acceleration : kAccelerations) {
          setup.step.acceleration = acceleration;
          entry.curves.push_back(measure_curve(*backend, options, setup, scene.state, solution));
        }
        result.scenes.push_back(std::move(entry));
        result.complete = result.scenes.size() == scenes.size() * options.stiffness.size() * options.substeps.size();
        progress(result);
      }
    }
  }
  return result;
}

}  // namespace cutproof::benchmarks
