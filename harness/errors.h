// `cutproof run --errors`: the errors of accuracy_and_speed.md §1 of one run (docs/errors.md).
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "harness/against.h"
#include "oracles/comparison/errors.h"

namespace cutproof::cli {

struct ErrorsWanted {
  bool implementation = false, solver = false, time_step = false, geometry = false, topology = false,
       conservation = false;
};
// Names with commas between them, or `all`. Throws InputError.
ErrorsWanted errors_wanted(const std::string& list);

// Frames in which solver error and interpenetration are looked at, evenly over the run; the last one among them.
inline constexpr int64_t kLookedAt = 8;
// Of the free body whose momentum and energy are followed.
inline constexpr int64_t kFreeFrames = 1000;
// Bound of the relative drift of momentum, in double precision (accuracy_and_speed.md §1).
inline constexpr double kDoubleDrift = 1e-10;

// Components counted three ways, in a frame's last state.
struct TopologyFigures {
  int32_t components = 0;  // of the tissue
  int32_t couplings = 0;   // of "shares a cluster"
  int32_t shells = 0;      // outer ones of the skin
  int64_t isolated = 0;    // groups of clusters isolated inside connected tissue
  bool equal = false;      // as partitions (oracle component_match)
};
TopologyFigures topology_of(const Setup& setup, const State& state);

class Errors {
 public:
  // `make` gives more backends of the kind that is judged. `setup` must outlive this.
  // `start` is what was loaded.
  Errors(const ErrorsWanted& wanted, const Setup& setup, const State& start, oracles::MakeBackend make);

  // The backend's states at the beginning and the end of every frame, in order; whether it is wanted.
  bool wants(int64_t frame) const;
  void frame_begins(const State& state);
  void frame_ends(const State& state);
  // After the last frame: what takes runs of its own. `against` is null without the implementation error.
  void finish(const State& end, const Against* against);

  // Whether what has a bound is within it: conservation. (The implementation's bounds are verdicts of `against`.)
  bool holds() const;
  nlohmann::json to_json() const;
  void print() const;

 private:
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

  bool looked_at(int64_t frame) const;

  ErrorsWanted wanted_;
  const Setup& setup_;
  Precision precision_;
  State start_;
  oracles::MakeBackend make_;
  std::unique_ptr<Backend> judged_, exact_;
  std::vector<Solver> solver_;
  Topology topology_;
  std::optional<Overlap> overlap_;  // the greatest
  std::optional<oracles::TimeStepError> time_step_;
  std::optional<oracles::CutGeometry> geometry_;
  std::optional<oracles::Conservation> conservation_;
  nlohmann::json implementation_;
};

// null where something is absent.
nlohmann::json to_json(const oracles::CutGeometry& geometry);
nlohmann::json to_json(const oracles::Interpenetration& found);

}  // namespace cutproof::cli
