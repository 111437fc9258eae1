// The suites of `cutproof bench`: options in, a document out, whose fields docs/reference/schemas/ describes. All throw
// InputError for invalid options, MachineError if the machine fails.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "benchmarks/measured_scene.h"
#include "benchmarks/report.h"
#include "benchmarks/rotations.h"
#include "model/stop.h"

namespace cutproof::benchmarks {

// Whole frames and each stage while a blade cuts: Table 1 of the paper, or boxes and kidneys of given sizes.
struct StagesOptions : TimingOptions {
  std::vector<int64_t> sizes;  // particles; replaces the scenes
  std::vector<std::string> scenes = {"cuboid", "liver", "kidney", "irregular"};
  std::vector<std::string> cooking;  // empty: both of the scenes, boxes of given sizes
  bool full = false;                 // scenes at the paper's size
};
nlohmann::json run_stages(const StagesOptions& options, const Progress& progress);

// Table 2 of the paper, a kidney's discontinuous cut at four samplings.
struct SamplingOptions : TimingOptions {
  std::string cooking = "boxes";
  bool full = false;  // the paper's numbers of particles
};
nlohmann::json run_sampling(const SamplingOptions& options, const Progress& progress);

// Fig. 10 of the paper, the number of clusters while a kidney is cut through.
struct ClustersOptions {
  std::string backend = harness::kReferenceName;
  std::vector<double> taus = {0.25, 0.5, 0.75};  // a curve each, and one without merging
  std::optional<int64_t> particles;
  bool full = false;  // the paper's number of particles
};
inline constexpr int64_t kPaperParticles = 37'704;  // of the scene: the first row of Table 2
nlohmann::json run_clusters(const ClustersOptions& options, const Progress& progress);

// Times of frames from a thousand particles to ten million.
struct ScaleOptions : TimingOptions {
  ScaleOptions() { acceleration = {"none", "chebyshev"}; }
  std::vector<int64_t> sizes;  // particles; empty: by backend
};
nlohmann::json run_scale(const ScaleOptions& options, const Progress& progress);

// Methods for the rotation of a cluster, on every hard case (method.md, Rotations).
struct RotationsOptions {
  std::string backend = harness::kReferenceName;
  RotationCounts counts;
  std::optional<int64_t> timed;  // matrices timed together; absent: by backend
};
nlohmann::json run_rotations(const RotationsOptions& options, const Progress& progress, const RotationProgress& step);

// The machine's limits.
struct MachineLimitsOptions {
  std::string backend = harness::kReferenceName;
  int repeats = 21;
};
nlohmann::json run_machine_limits(const MachineLimitsOptions& options, const Progress& progress);

// Iterations of the step against its error, plain and accelerated (method.md §11).
struct SolverOptions {
  std::string backend = harness::kReferenceName;
  std::vector<double> stiffness = {1e4, 1e5, 1e6};  // [1/s²]
  std::vector<int32_t> substeps = {1, 4};
  std::vector<int32_t> iterations = {1, 2, 4, 8, 12, 16, 24, 32, 48, 64, 96};  // ascending
  std::optional<int64_t> particles;  // of the second body; 0: none; absent: by backend
  double tolerance = 1e-2;           // [h]
  int32_t samples = 9;
};
nlohmann::json run_solver(const SolverOptions& options, const Progress& progress);

// This method beside deletion, other expansion, detection and merging.
struct BaselinesOptions {
  std::string backend = harness::kReferenceName;
  int64_t particles = 1500;
  uint64_t seed = 1;  // of the clusters
  // Table 3 (benchmarks/methods.h): plugins beside this method; without any there is none.
  std::vector<std::string> with;        // FILE.so or FILE.so,PARAMETERS
  std::vector<int64_t> sizes = {2000};  // particles of the kidney
  std::string truth;                    // a plugin whose finer kidney is the converged solution; empty: no errors
  int64_t truth_particles = 16'000;
  double youngs_modulus = 3e4;                // [Pa]
  std::vector<int32_t> iterations = {8, 32};  // of this method, a row each
  bool kicks = true;
  std::string save;  // folder of their runs; empty: none
};
nlohmann::json run_baselines(const BaselinesOptions& options, const Progress& progress);

// Bars of a material beside closed forms (benchmarks/material.h).
struct MaterialOptions {
  std::string backend = harness::kReferenceName;
  std::vector<std::string> along = {"100"};
  std::vector<std::string> cooking = {"tiles"};
  std::vector<int32_t> sides = {1, 2};
  std::vector<double> poisson_ratios = {0, 0.45};
  std::vector<int32_t> across = {11};
  std::vector<int32_t> iterations = {2, 4, 8};  // a row each, of bars along 100
};
nlohmann::json run_material(const MaterialOptions& options, const Progress& progress);

// The least disturbance of a run that its judge rejects, by property and stage.
struct SensitivityOptions {
  std::string backend = harness::kReferenceName;
  int64_t particles = 1000;
  int64_t moments = 8;        // of each stage
  StopAsked stop_asked = {};  // ends it between two moments
};
nlohmann::json run_sensitivity(const SensitivityOptions& options, const Progress& progress);

// The cost of each part of a scene, and the scene without it.
struct PartsOptions {
  std::string backend = harness::kReferenceName;
  std::vector<std::string> scenes;  // their files
  std::optional<int64_t> frames;    // most of each scene
  int64_t repeats = 3;
  StopAsked stop_asked = {};  // ends it between two frames
};
nlohmann::json run_parts(const PartsOptions& options, const Progress& progress);

// Campaigns of random cases (property_tests/campaign.h), and the same over the reference.
struct CampaignsOptions {
  std::string backend = harness::kReferenceName;
  std::vector<std::string> kinds = {"small", "large", "moving"};
  double seconds = 10;           // of each
  std::optional<int64_t> cases;  // of each, instead of `seconds`
  uint64_t seed = 1;
  int batch = 0;              // bodies in one load; 0: by backend and size
  int threads = 0;            // 0: as many as the machine has
  std::string devices;        // as harness::devices_of takes them
  StopAsked stop_asked = {};  // ends it within a campaign, which then is no row
};
nlohmann::json run_campaigns(const CampaignsOptions& options, const Progress& progress);

}  // namespace cutproof::benchmarks
