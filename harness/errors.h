// The errors of one run (docs/how_to/measure_and_tune.md, Errors).
#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "oracles/comparison/carried_sweep.h"
#include "oracles/comparison/conservation.h"
#include "oracles/comparison/cut_geometry.h"
#include "oracles/comparison/interpenetration.h"
#include "oracles/comparison/solver_error.h"
#include "oracles/comparison/time_step_error.h"

namespace cutproof::harness {

// `implementation` is measured by Lockstep and not here.
struct ErrorsWanted {
  bool implementation = false, solver = false, time_step = false, geometry = false, topology = false,
       conservation = false;
  // Frames in which solver error and interpenetration are looked at, evenly over the run, the last one among them; all
  // if there are no more. At least 1.
  int64_t frames = 8;
};

// Number of frames of the free body whose momentum and energy are followed.
inline constexpr int64_t kFreeFrames = 1000;
// Bound of the relative drift of momentum, in double precision (tolerances.md, Conservation).
inline constexpr double kDoubleDrift = 1e-10;

// Components counted three ways, in a frame's last state.
struct TopologyFigures {
  int32_t components = 0;  // of the tissue
  int32_t couplings = 0;   // of "shares a cluster"
  int32_t shells = 0;      // outer ones of the skin
  int64_t isolated = 0;    // groups of clusters isolated inside connected tissue
  bool equal = false;      // as partitions (oracles component_match, skin_match)
};
TopologyFigures topology_of(const Setup& setup, const State& state);

class Errors {
 public:
  struct Solver {
    int64_t frame;
    oracles::SolverError error;
  };
  struct Topology {
    TopologyFigures end;
    int64_t frames = 0;   // that were looked at: those that removed something, and the last
    int64_t unequal = 0;  // of these
    std::optional<int64_t> first_unequal;
    int64_t isolated = 0;  // the most in one frame
  };
  struct Overlap {
    int64_t frame;
    oracles::Interpenetration found;
  };

  // `make` gives more backends of the kind that is judged. `setup` must outlive this.
  // `start` is what was loaded.
  Errors(const ErrorsWanted& wanted, const Setup& setup, const State& start, oracles::MakeBackend make);

  // The backend's states at the beginning and the end of every frame, in order; whether it is wanted.
  bool wants(int64_t frame) const;
  void frame_begins(const State& state);
  void frame_ends(const State& state);
  // After the last frame: measurements that need further runs.
  void finish(const State& end);

  // Whether all measurements with a bound (conservation) are within it.
  bool holds() const;

  // The measurements. Those that were not requested, or that this run does not have, are empty.
  const ErrorsWanted& wanted() const { return wanted_; }
  Precision precision() const { return precision_; }  // which bound of momentum holds
  const std::vector<Solver>& solver() const { return solver_; }
  const Topology& topology() const { return topology_; }
  const std::optional<Overlap>& overlap() const { return overlap_; }
  const std::optional<oracles::TimeStepError>& time_step() const { return time_step_; }
  const std::optional<oracles::CutGeometry>& geometry() const { return geometry_; }
  const std::optional<oracles::Conservation>& conservation() const { return conservation_; }

 private:
  bool looked_at(int64_t frame) const;

  ErrorsWanted wanted_;
  const Setup& setup_;
  Precision precision_;
  State start_;
  oracles::MakeBackend make_;
  std::unique_ptr<Backend> judged_;
  std::vector<Solver> solver_;
  Topology topology_;
  std::optional<Overlap> overlap_;  // the greatest
  std::optional<oracles::TimeStepError> time_step_;
  oracles::CarriedSweep sweep_;
  State frame_start_;  // of a frame that it wants
  std::optional<oracles::CutGeometry> geometry_;
  std::optional<oracles::Conservation> conservation_;
};

}  // namespace cutproof::harness
