#include "benchmarks/solver.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "benchmarks/stages.h"
#include "benchmarks/suites.h"
#include "cli/json_number.h"
#include "fixtures/bodies.h"
#include "fixtures/cook.h"
#include "harness/backends.h"
#include "model/error.h"
#include "oracles/comparison/reference_solution.h"
#include "oracles/relations/relations.h"

namespace cutproof::cli {

namespace {

using nlohmann::json;

constexpr double kFrameLength = 0.004;  // [s]
constexpr Span kStep = {Stage::step, Stage::step};

// Turned about the longest axis and drawn out along it, when the free motion of the frame is over.
void throw_body(SolverScene& scene, double twist, double stretch) {
  const Body& body = scene.setup.body;
  Vec3 low, high;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    const Vec3 x = body.rest_position(i);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = i == 0 ? x[axis] : std::min(low[axis], x[axis]);
      high[axis] = i == 0 ? x[axis] : std::max(high[axis], x[axis]);
    }
  }
  const Vec3 extent = high - low;
  const int along = extent.x > extent.y && extent.x > extent.z ? 0 : extent.y > extent.z ? 1 : 2;
  const int u = (along + 1) % 3, v = (along + 2) % 3;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    const Vec3 d = body.rest_position(i) - 0.5 * (low + high);
    const double angle = twist * d[along] / extent[along];
    Vec3 end;
    end[u] = d[u] * std::cos(angle) - d[v] * std::sin(angle);
    end[v] = d[u] * std::sin(angle) + d[v] * std::cos(angle);
    end[along] = stretch * d[along];
    scene.state.v[static_cast<std::size_t>(i)] = (end - d) / kFrameLength;
  }
}

// Nothing but the step, in one frame of one substep.
void keep_the_step(Setup& setup) {
  setup.step.substeps = 1;
  setup.step.damping = 0;
  setup.detect.criterion = Criterion::none;
  setup.skin.wanted = false;
  setup.has_blade = false;
  setup.blade_moves.clear();
  setup.stroke_end.clear();
  setup.substep_length = {kFrameLength};
  for (Grip& grip : setup.grips) {
    grip.active = {1};
    grip.displacement.assign(1, {});
  }
}

}  // namespace

SolverScene make_block_scene() {
  SolverScene scene;
  scene.name = "block";
  scene.setup.body = fixtures::block(12, 12, 12, 0.01);
  keep_the_step(scene.setup);
  ClusterSpec clusters;
  clusters.side = 4;
  scene.state = fixtures::cook(scene.setup.body, clusters, scene.setup.expand, scene.setup.merge, 1);
  throw_body(scene, 3.0, 1.8);
  return scene;
}

SolverScene make_body_scene(int64_t particles) {
  BenchScene bench = make_bench_scene(particles, 1);
  SolverScene scene{bench.name, std::move(bench.setup), std::move(bench.state)};
  keep_the_step(scene.setup);
  throw_body(scene, 1.0, 1.2);
  return scene;
}

Setup with_substeps(const SolverScene& scene, int32_t substeps) {
  Setup setup = scene.setup;
  setup.step.substeps = substeps;
  setup.substep_length = {kFrameLength / substeps};
  for (Grip& grip : setup.grips) {
    grip.active.assign(static_cast<std::size_t>(substeps), 1);
    grip.displacement.assign(static_cast<std::size_t>(substeps), {});
  }
  return setup;
}

FrameAnswer converged_frame(const Setup& setup, const State& state) {
  // Every substep is like the first: no blade, and what is held stays where it is.
  const Setup single = oracles::single_substep_setup(setup, 0);
  const double dt = single.substep_length[0], decay = std::exp(-single.step.damping * dt);
  FrameAnswer answer;
  State now = state;
  for (int32_t substep = 0; substep < setup.step.substeps; ++substep) {
    oracles::ReferenceSolution converged = oracles::reference_solution(single, now);
    answer.converged &= converged.converged;
    for (std::size_t i = 0; i < now.x.size(); ++i) now.v[i] = (decay / dt) * (converged.x[i] - now.x[i]);
    now.x = std::move(converged.x);
    now.clusters.rotation = std::move(converged.rotation);
    answer.energy = converged.energy;
  }
  if (setup.step.substeps > 1) answer.energy.reset();
  answer.x = std::move(now.x);
  return answer;
}

SolverError solver_error(Backend& backend, const Setup& setup, const State& state, const FrameAnswer& answer) {
  backend.load({setup}, {state});
  backend.run(kStep);
  const State reached = backend.snapshot().front();
  SolverError error;
  double squares = 0;
  for (std::size_t i = 0; i < reached.x.size(); ++i) {
    double distance = norm(reached.x[i] - answer.x[i]) / setup.body.grid.spacing;
    if (!std::isfinite(distance)) distance = std::numeric_limits<double>::infinity();
    error.max_h = std::max(error.max_h, distance);
    squares += distance * distance;
  }
  error.rms_h = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, reached.x.size())));
  if (answer.energy) {
    error.energy_gap = (oracles::substep_energy(setup, state, reached.x) - *answer.energy) / *answer.energy;
  }
  return error;
}

std::optional<int32_t> least_iterations(Backend& backend, Setup setup, const State& state, const FrameAnswer& answer,
                                        double tolerance, int32_t above, int32_t below) {
  for (int32_t iterations = above + 1; iterations <= below; ++iterations) {
    setup.step.iterations = iterations;
    if (solver_error(backend, setup, state, answer).max_h < tolerance) return iterations;
  }
  return std::nullopt;
}

// --- The suite -------------------------------------------------------------------------------------------------------

namespace {

struct SolverOptions {
  std::string backend = "reference";
  std::vector<double> stiffness = {1e4, 1e5, 1e6};
  std::vector<int32_t> substeps = {1, 4};
  std::vector<int32_t> iterations = {1, 2, 4, 8, 12, 16, 24, 32, 48, 64, 96};
  std::optional<int64_t> particles;  // of the second body; 0: none; absent: by backend
  double tolerance = 1e-2;           // [h]
  int32_t samples = 9;
  std::string json;
};

constexpr Acceleration kAccelerations[] = {Acceleration::none, Acceleration::chebyshev};
const char* name_of(Acceleration acceleration) { return acceleration == Acceleration::none ? "none" : "chebyshev"; }

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

struct Row {
  SolverError error;
  Times times;
};

// Rows by iterations: those that were asked for, and the least that comes within the tolerance.
struct Curve {
  std::map<int32_t, Row> rows;
  std::optional<int32_t> least;
};
Curve measure_curve(Backend& backend, const SolverOptions& options, Setup setup, const State& state,
                    const FrameAnswer& answer) {
  Curve curve;
  const auto measure = [&](int32_t iterations) {
    setup.step.iterations = iterations;
    const SolverError error = solver_error(backend, setup, state, answer);
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
  curve.least = least_iterations(backend, setup, state, answer, options.tolerance, above, *below);
  if (curve.least && !curve.rows.contains(*curve.least)) measure(*curve.least);
  return curve;
}

void report_curve(const Curve& curve, Acceleration acceleration, Table& table, json& entry) {
  for (const auto& [iterations, row] : curve.rows) {
    const auto& [error, times] = row;
    table.add({name_of(acceleration), fmt::format("{}", iterations), fmt::format("{:.2g}", error.max_h),
               fmt::format("{:.2g}", error.rms_h), error.energy_gap ? fmt::format("{:.1e}", *error.energy_gap) : "-",
               fmt::format("{:.4f}", 1e3 * times.median)});
    entry["rows"].push_back({{"acceleration", name_of(acceleration)},
                             {"iterations", iterations},
                             {"max_h", json_number(error.max_h)},
                             {"rms_h", json_number(error.rms_h)},
                             {"energy_gap", error.energy_gap ? json_number(*error.energy_gap) : json(nullptr)},
                             {"seconds", to_json(times)}});
  }
  if (!curve.least) return;
  entry["to_tolerance"].push_back({{"acceleration", name_of(acceleration)},
                                   {"iterations", *curve.least},
                                   {"seconds", curve.rows.at(*curve.least).times.median}});
}

int bench_solver(const SolverOptions& options) {
  check(options);
  require_timed_backend(options.backend);
  require_writable(options.json);
  BackendChoice choice;
  choice.name = options.backend;
  const std::unique_ptr<Backend> backend = make_backend(choice);
  const std::string precision = backend->precision() == Precision::binary64 ? "double" : "single";

  const int64_t particles = options.particles.value_or(options.backend == "gpu" ? 101'096 : 2000);
  std::vector<SolverScene> scenes = {make_block_scene()};
  if (particles > 0) scenes.push_back(make_body_scene(particles));

  json document = begin_report("solver", options.backend);
  document["precision"] = precision;
  document["tolerance_h"] = options.tolerance;
  document["samples"] = options.samples;
  document["scenes"] = json::array();
  for (const SolverScene& scene : scenes) {
    for (const double stiffness : options.stiffness) {
      for (const int32_t substeps : options.substeps) {
        Setup setup = with_substeps(scene, substeps);
        setup.step.stiffness = stiffness;
        const FrameAnswer answer = converged_frame(setup, scene.state);
        fmt::print("\n{}: {} particles, {} clusters; k = {:g}, {} substep{} of {:g} ms; {} precision{}\n", scene.name,
                   setup.body.particle_count(), scene.state.clusters.count(), stiffness, substeps,
                   substeps == 1 ? "" : "s", 1e3 * setup.substep_length[0], precision,
                   answer.converged ? "" : "; NO converged answer was found, errors are from the last alternation");
        Table table({"acceleration", "iterations", "max h", "RMS h", "energy gap", "median ms"});
        json entry = {{"scene", scene.name},
                      {"particles", setup.body.particle_count()},
                      {"clusters", scene.state.clusters.count()},
                      {"stiffness", stiffness},
                      {"substeps", substeps},
                      {"substep_seconds", setup.substep_length[0]},
                      {"converged", answer.converged},
                      {"rows", json::array()},
                      {"to_tolerance", json::array()}};
        for (const Acceleration acceleration : kAccelerations) {
          setup.step.acceleration = acceleration;
          report_curve(measure_curve(*backend, options, setup, scene.state, answer), acceleration, table, entry);
        }
        fmt::print("{}", table.text());
        for (const json& found : entry["to_tolerance"]) {
          fmt::print("  {:g} h: {} after {} iterations, {:.4f} ms\n", options.tolerance,
                     found["acceleration"].get<std::string>(), found["iterations"].get<int32_t>(),
                     1e3 * found["seconds"].get<double>());
        }
        std::fflush(stdout);
        document["scenes"].push_back(entry);
        // After each, so that what has been measured is kept if a later one fails.
        document["complete"] =
            document["scenes"].size() == scenes.size() * options.stiffness.size() * options.substeps.size();
        write_report(options.json, document);
      }
    }
  }
  if (!options.json.empty()) fmt::print("\nwrote {}\n", options.json);
  return 0;
}

}  // namespace

Suite solver_suite() {
  return {"solver", "iterations of the step against its error, plain and accelerated", [](CLI::App& command) {
            const auto options = std::make_shared<SolverOptions>();
            command.add_option("--backend", options->backend, "who is timed; `cutproof info` lists them")
                ->capture_default_str()
                ->type_name("B");
            command.add_option("--stiffness", options->stiffness, "k [1/s²], separated by commas")
                ->delimiter(',')
                ->capture_default_str()
                ->type_name("K,K...");
            command.add_option("--substeps", options->substeps, "of the frame of 4 ms, separated by commas")
                ->delimiter(',')
                ->capture_default_str()
                ->type_name("N,N...");
            command.add_option("--iterations", options->iterations, "of a substep, separated by commas")
                ->delimiter(',')
                ->capture_default_str()
                ->type_name("N,N...");
            command
                .add_option("--particles", options->particles,
                            "of a second body; 0: the block alone (default: 2000; gpu: 101096)")
                ->type_name("N");
            command.add_option("--tolerance", options->tolerance, "greatest error that is asked for [h]")
                ->capture_default_str()
                ->type_name("H")
                ->check(CLI::PositiveNumber);
            command.add_option("--samples", options->samples, "timed steps of each row")
                ->capture_default_str()
                ->type_name("N")
                ->check(CLI::Range(1, 10'000));
            command.add_option("--json", options->json, "write every row")->type_name("F");
            return [options] { return bench_solver(*options); };
          }};
}

}  // namespace cutproof::cli
