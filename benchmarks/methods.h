// Table 3 of the paper: other simulators, as plugins with `dissect`, beside this one. All cut the same kidney of the
// same material, and are judged as runs.
#pragma once
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/baselines.h"
#include "guests/questions/scenes.h"
#include "model/io/array_file.h"

namespace cutproof::benchmarks {

// The kidney hangs from its left end until it is at rest, and is then cut as the paper's (scene kidney_101096). Frame 0
// of a run is the start.
struct Kidney {
  Setup setup;
  State start;
  guests::scenes::Scene scene;  // the same for plugins
  double youngs_modulus = 0;    // [Pa]
  int64_t uncut = 0;            // the last frame before the first cut
  int64_t last_cut = 0;         // the last frame in which the blade sweeps
};
// Stiffness follows from the modulus: E = ½ ρ k c h² for cores of c nodes a side, Poisson's ratio 0.
// Throws InputError if no kidney has so many particles, within 2 %.
Kidney make_kidney(int64_t particles, double youngs_modulus);

// A run of the kidney, whoever has simulated it. `refused`: why there is none.
struct MethodRun {
  std::string refused;
  std::vector<io::ArrayFile> frames;  // docs/reference/run.md
  std::vector<double> seconds;        // [frames - 1] that each took
  bool timed_by_judge = false;        // the plugin tells no times: the call's, transfers included
};

// A piece that is kicked as the way to a frame begins.
struct MethodKick {
  int64_t frame = 0;
  std::vector<int32_t> particles;
  Vec3 velocity;  // [m/s]
};

// One row of the table.
class Method {
 public:
  virtual ~Method() = default;
  virtual std::string name() const = 0;
  virtual std::string source() const = 0;
  virtual std::string settings() const = 0;
  // Of the kidney's first frames, as many; with a kick or without.
  virtual MethodRun run(const Kidney& kidney, int64_t frames, const MethodKick* kick) = 0;
};
// This method with its rules or another's, by a backend.
std::unique_ptr<Method> make_own_method(const std::string& backend, const Baseline& baseline, int32_t iterations);
// FILE.so or FILE.so,PARAMETERS. Parameters youngs_modulus, poisson_ratio, density and damping are added. Throws what
// guests::Guest throws.
std::unique_ptr<Method> make_plugin_method(const std::string& plugin);

// Where a converged solution moves the kidney until the first cut: of a finer kidney, between whose nodes it is
// interpolated.
class ConvergedKidney {
 public:
  // Throws InputError if the method refuses.
  ConvergedKidney(Method& method, int64_t particles, double youngs_modulus);
  // Displacement of a place at rest, in the world's frame [m]; nothing outside of the finer kidney's cells.
  std::optional<Vec3> at_rest_place(Vec3 place) const;
  int64_t particles() const { return kidney_.setup.body.particle_count(); }

 private:
  Kidney kidney_;
  std::vector<Vec3> displacement_;  // [n] world's frame [m]
};

// The row: docs/reference/schemas/bench_baselines.json, "methods". `truth` may be null. `folder`: where the run is
// saved (docs/reference/run.md), in a new folder; empty: nowhere. Throws InputError if it cannot be written.
nlohmann::json row_of(Method& method, const Kidney& kidney, const ConvergedKidney* truth, bool with_kicks,
                      const std::string& folder = {});

}  // namespace cutproof::benchmarks
