// Judges one substep of a backend iterate by iterate. Each iterate is compared with one iteration from the backend's
// own previous iterate, so that errors do not grow and each decision is one particle's (tolerances.md, Iterate by
// iterate). Internal to oracles/.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "model/at.h"
#include "model/setup.h"
#include "model/state.h"
#include "oracles/contact.h"
#include "oracles/partitions.h"
#include "oracles/rounding.h"

namespace cutproof::oracles {

// The compared quantities of an iterate, each with its own bounds.
enum class IteratePart : uint8_t {
  place,
  contact,  // a place that a contact or a grip has made
  velocity,
  rotation,
  orthogonal,
  kept,  // a rotation that nothing determines, or that no iteration has looked at
  flag,
  impulse,
  sum,   // of places over a component, by mass: momentum, over one iteration
  pull,  // the same along where each particle is pulled
};
const char* name_of(IteratePart part);

struct IterateFinding {
  IteratePart part = IteratePart::place;
  int32_t iteration = -1;  // it led to the iterate after it; -1: the prediction
  int32_t where = -1;      // particle, cluster, or the first particle of a component
  double share = -1, measured = 0, bound = 0;
  bool holds() const { return share <= 1; }
};

class SubstepJudge {
 public:
  // Substep `substep` of a frame, which begins with `began`: well formed and finite, of the backend's precision; both
  // must live as long as this. Where it is not the first one, `began` rounds what the backend itself goes on from.
  // The frame began with `frame_began`.
  SubstepJudge(const Setup& setup, int64_t frame, int32_t substep, const State& began, const State& frame_began);

  // The state after no iteration.
  void prediction(const State& after);
  // The state after iteration `k` = 0, 1, …, given those after `k` and, where k > 0, `k` − 1 iterations.
  void iteration(int32_t k, const State* earlier, const State& now, const State& next);

  // The comparison that comes nearest to its bound, or goes farthest beyond.
  const IterateFinding& worst() const { return worst_; }
  int64_t checked() const { return checked_; }
  // Particles of which turns of blade and walls let rounding decide, clusters whose rotation is no more than rounding.
  int64_t inconclusive() const { return inconclusive_; }

 private:
  struct Cluster {
    double mass = 0, radius = 0;
    Vec3 rest;              // T
    Mat3 moments;           // A0
    bool is_line = false;   // at rest a line; of radius 0 a point
    double center_off = 0;  // what rounds in its center in this iteration [m]
  };
  struct Candidate {
    Vec3 plain, free;    // where the plain solver would go, and where the solver goes
    double squares = 0;  // of what rounds in them [m²]
    Vec3 pull;           // what part of the way is the solver's
  };
  // A particle that touches nothing, for sums.
  struct Free {
    int32_t particle;
    Vec3 off;
    double squares;
    Vec3 pull;
  };

  void see(IteratePart part, double measured, double bound, int32_t where);
  double weight(int32_t i) const { return setup_.body.mass[at(i)] / holders_[at(i)]; }
  Vec3 stored(int32_t i, Vec3 x) const { return stored_place(setup_.body, began_.precision, i, x); }
  Vec3 ahead(int32_t i, Vec3 x) const;
  Vec3 back(int32_t i, Vec3 y) const;
  double place_rounding(int32_t i, Vec3 x) const;
  std::pair<double, double> chebyshev(int32_t k) const;

  void rotation(int32_t c, const Eigen::Matrix3d& a, double off, const Mat3& previous, const Clusters& after);
  void particle(int32_t i, const Candidate& candidate, Vec3 seen, Vec3 present);
  double nearest_contact(int32_t i, const Candidate& candidate, Vec3 seen, Vec3 present, double wide, double& after,
                         bool& decided);
  void velocities(const State& after);
  void impulse(Vec3 carried, double rounding, const State& after);
  void sums();

  const Setup& setup_;
  const State& began_;
  const double u_;
  const double places_u_;  // of places as such
  const double dt_, share_;
  const bool first_;  // of its frame
  const BladeMove* const move_;
  const Contact contact_;
  bool implicit_ = true;
  double s_ = 0, decay_ = 1;
  int32_t k_ = -1;
  Partition coupled_;
  std::vector<int32_t> holders_;
  std::vector<Cluster> clusters_;
  std::vector<Vec3> arm_;              // [members] X - T
  std::vector<double> lever_;          // [n] √(Σ_c |X − T_c|²) / n_i
  std::vector<double> volume_off_;     // [members] what rounds in where a volume's map puts it, in this iteration [m]
  std::vector<double> inertia_;        // [n] |dt v| + |dt² g|, which may all but cancel
  std::vector<Vec3> predicted_;        // [n] x~
  std::vector<double> begin_squares_;  // [n] of what rounds in x~ [m²]
  std::vector<std::optional<Vec3>> held_;  // [n] where a grip puts it
  std::vector<uint8_t> sides_;             // [n] bit 0: positive, bit 1: negative: those that it may have begun on
  std::vector<Free> free_;
  double shared_ = 0;  // of a center, so much goes into a place in this iteration
  Vec3 pushed_;
  double pushed_rounding_ = 0, push_in_doubt_ = 0;
  IterateFinding worst_;
  int64_t checked_ = 0, inconclusive_ = 0;
};

}  // namespace cutproof::oracles
