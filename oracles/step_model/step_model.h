// The step of one frame (method.md §3 and §11), by other means than any backend: rotations by singular value
// decompositions, impulses from the balance of momentum. A disturbed run rounds at random wherever a backend has to,
// and shows the effect of rounding. Internal to oracles/.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "model/setup.h"
#include "model/state.h"

namespace cutproof::oracles {

struct StepOutcome {
  std::vector<Vec3> x, v;      // [n] [m], [m/s]
  std::vector<Mat3> rotation;  // [m]
  Vec3 impulse;                // as State::impulse
  // [n] By how much, at least, what a particle has decided on its way was decided: on which side of the blade it
  // begins, which way leads off the blade, whether it touches; less what comparing rounds. 0 where a cluster of it
  // could be turned in any of many ways before the last iteration, or blade and walls have moved it in turn [m].
  std::vector<double> lead;
  // Of the last iteration: Σ w (x − t)(X − T)ᵀ of each cluster [m], empty without iterations.
  std::vector<Mat3> shape;
  // [m] Σ w |X − T|: by so much a displacement of its members by 1 m changes `shape` at most [kg m].
  std::vector<double> arms;
  // [m] 1: rounding, or a backend's threshold, decides which of many best rotations a cluster has in the end. It is the
  // nearest to the previous one here, unless it was given; any of them in a disturbed run.
  std::vector<uint8_t> is_free;
  // [m] 1: at rest a point or a line, so that many rotations are the best wherever its members are. Empty without
  // iterations.
  std::vector<uint8_t> is_thin;
  // [n] By how much the last iteration has raised the square of a particle's distance from where it would go, as it may
  // by rounding where blade and walls act in turn [m²].
  std::vector<double> raised;
  // Of an undisturbed run: [n] how far, at least, it was from where a contact that holds it would have let go [m];
  // infinite without contacts.
  std::vector<double> hold;
  // Of an undisturbed run: the quadratic sums of what single evaluations round, as if none of it grew.
  std::vector<double> rounding;       // [n] of positions [m²]
  std::vector<double> own_rounding;   // [n] of it, what is the particle's own: not of its clusters [m²]
  std::vector<double> turn_rounding;  // [m] of rotations [rad²]
  double impulse_rounding = 0;        // [(kg m/s)²]
};

class StepModel {
 public:
  // `before`: the state in which the step of frame before.frame begins, well formed and finite; the schedule is not
  // over. `unit_roundoff`: of the arithmetic whose rounding is looked at. Keeps references to both.
  StepModel(const Setup& setup, const State& before, double unit_roundoff);

  struct Wanted {
    uint64_t disturbance = 0;  // 0: none; else the seed of one
    // [n] Of a disturbed run: what a particle decides by no more than this is drawn [m]. Empty: nothing is drawn.
    std::span<const double> open = {};
    // [n] On which side of the blade a particle ends (Contact::side_of_end()). Where rounding decides on which side it
    // begins a substep, it begins on that one. Where decisions are drawn, this holds for the last substep alone.
    std::span<const int> side_of_end = {};
    // [m] Rotations that are given in the last iteration of the last substep, nullptr: the best one.
    std::span<const Mat3* const> given = {};
  };
  StepOutcome run(const Wanted& wanted) const;

  // [n] A field over the particles, less what their clusters share of it: in the mean over a particle's clusters, the
  // affine motion that comes nearest to the cluster's members (by their shares of mass).
  std::vector<Vec3> without_shared(const std::vector<Vec3>& field) const;

  // Σ over substeps of evaluations of positions and particles: what a run costs.
  int64_t evaluations() const;

 private:
  class Run;
  struct Cluster {
    int64_t begin = 0, end = 0;  // of members and arms
    double mass = 0;
    Vec3 rest;          // T
    double radius = 0;  // greatest |X - T|
    double arms = 0;    // Σ w |X - T|
    Mat3 moments;       // A0 = Σ w (X - T)(X - T)ᵀ
    Mat3 inverse;       // its pseudoinverse
    enum class Extent { point, line, more } extent = Extent::more;
  };

  const Setup& setup_;
  const State& before_;
  double u_;
  std::vector<Cluster> clusters_;  // [m]
  std::vector<Vec3> arm_;          // [members] X - T
  std::vector<double> weight_;     // [n] m_i / n_i
  std::vector<int32_t> holders_;   // [n] n_i
  std::vector<double> lever_;      // [n] √(Σ_c |X − T_c|² / n_i²)
};

}  // namespace cutproof::oracles
