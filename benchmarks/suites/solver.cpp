#include "benchmarks/solver.h"

#include <fmt/format.h>

#include <map>

#include "benchmarks/contenders.h"
#include "benchmarks/suites/suites.h"
#include "model/io/json_number.h"
#include "model/rules.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;

void check(const SolverOptions& options) {
  for (const double k : options.stiffness) {
    require_option(k > 0 && k <= 1e15, "--stiffness", fmt::format("{} is out of bounds", k), "give k in (0, 1e15]");
  }
  for (const int32_t s : options.substeps) {
    require_option(s >= 1 && s <= 1000, "--substeps", fmt::format("{} is out of bounds", s),
                   "give numbers from 1 to 1000");
  }
  int32_t before = 0;
  for (const int32_t k : options.iterations) {
    require_option(k > before && k <= 10'000, "--iterations", fmt::format("{} is out of bounds or out of order", k),
                   "give numbers from 1 to 10000, the least first");
    before = k;
  }
  const int64_t particles = options.particles.value_or(0);
  require_option(particles == 0 || particles >= 100, "--particles", fmt::format("{} particles are too few", particles),
                 "give at least 100, or 0");
}

// Sequential steps from the backend's state: a step's cost does not depend on its start.
Times time_steps(Backend& backend, int32_t samples) {
  std::vector<double> seconds;
  for (int32_t sample = 0; sample < samples; ++sample) {
    backend.run(kStep);
    seconds.push_back(backend.report().total_seconds);
  }
  return times_of(seconds);
}

// One body with one acceleration. Adds rows by iterations: the requested ones, and the least within the tolerance,
// which also goes to `to_tolerance`.
void measure_curve(Backend& backend, const SolverOptions& options, Setup setup, const State& state,
                   const FrameSolution& solution, json& entry) {
  const std::string acceleration(name_of(setup.step.acceleration));
  std::map<int32_t, json> rows;
  const auto measure = [&](int32_t iterations) {
    setup.step.iterations = iterations;
    const SolverError error = solver_error(backend, setup, state, solution);
    rows[iterations] = {{"acceleration", acceleration},
                        {"iterations", iterations},
                        {"max_h", json_number(error.position.max)},
                        {"rms_h", json_number(error.position.rms())},
                        {"energy_gap", json_number(error.energy_gap)},
                        {"seconds", to_json(time_steps(backend, options.samples))}};
    return error.position.max < options.tolerance;
  };
  int32_t above = 0;
  std::optional<int32_t> below;
  for (const int32_t iterations : options.iterations) {
    const bool within = measure(iterations);
    if (!within) above = iterations;
    below = within ? below.value_or(iterations) : std::optional<int32_t>();
  }
  std::optional<int32_t> least;
  if (below) least = least_iterations(backend, setup, state, solution, options.tolerance, above, *below);
  if (least) {
    if (!rows.contains(*least)) measure(*least);
    entry["to_tolerance"].push_back({{"acceleration", acceleration},
                                     {"iterations", *least},
                                     {"seconds", rows.at(*least).at("seconds").at("median")}});
  }
  for (auto& [iterations, row] : rows) entry["rows"].push_back(std::move(row));
}

}  // namespace

json run_solver(const SolverOptions& options, const Progress& progress) {
  check(options);
  const harness::BackendDescriptor& described = require_timed_backend(options.backend);
  const std::unique_ptr<Backend> backend = make_timed_backend(options.backend);
  const int64_t particles = options.particles.value_or(described.takes_full_size ? 101'096 : 2000);
  std::vector<ReadyScene> scenes = {make_block_scene()};
  if (particles > 0) scenes.push_back(make_body_scene(particles));

  Report report("solver", options.backend,
                {{"precision", name_of(backend->precision())},
                 {"tolerance_h", options.tolerance},
                 {"samples", options.samples},
                 {"rows_at_most", scenes.size() * options.stiffness.size() * options.substeps.size()}},
                progress, "scenes");
  for (const ReadyScene& scene : scenes) {
    for (const double stiffness : options.stiffness) {
      for (const int32_t substeps : options.substeps) {
        Setup setup = with_substeps(scene, substeps);
        setup.step.stiffness = stiffness;
        const FrameSolution solution = converged_frame(setup, scene.state);
        json entry = {{"scene", scene.name},
                      {"particles", setup.body.particle_count()},
                      {"clusters", scene.state.clusters.count()},
                      {"stiffness", stiffness},
                      {"substeps", substeps},
                      {"substep_seconds", setup.substep_length[0]},
                      {"converged", solution.converged},
                      {"rows", json::array()},
                      {"to_tolerance", json::array()}};
        for (const Acceleration acceleration : {Acceleration::none, Acceleration::chebyshev}) {
          setup.step.acceleration = acceleration;
          measure_curve(*backend, options, setup, scene.state, solution, entry);
        }
        report.add(std::move(entry));
      }
    }
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
