// One implicit substep as a minimisation problem (method.md §3): its energy, and the places that contacts allow. Shares
// nothing with a backend. Internal to oracles/.
#pragma once
#include <algorithm>
#include <array>
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "oracles/contact.h"
#include "oracles/memberships.h"
#include "oracles/shape_sums.h"

namespace cutproof::oracles {

// The constants of E during the substep, and the data of contacts. Keeps references to setup and state.
struct SubstepProblem {
  // The first substep of frame state.frame. Throws std::invalid_argument if the solver is not implicit, the schedule is
  // over, or the state is not well formed.
  SubstepProblem(const Setup& setup, const State& state);

  const Body& body;
  const Clusters& clusters;
  double dt = 0;
  double retardation = 0;  // τ
  double share = 1;        // dt / (dt + τ)
  double stiffness = 0, volume_share = 0;
  double s = 0;  // k dt (dt + τ) / (1 + k dt (dt + τ))
  std::vector<uint8_t> alive, held;
  std::vector<Vec3> start;      // x_prev
  std::vector<Vec3> predicted;  // x~ of method.md §3, before contacts; of held particles, where the grip puts them
  std::vector<Vec3> predicted_ahead;  // its y~
  WeightedRest rest;
  std::vector<Vec3> offset;   // [members] X_i − T_c
  std::vector<Mat3> moments;  // [m] Σ w (X_i − T_c)(X_i − T_c)ᵀ
  Memberships memberships;
  std::array<double, 3> low, high;  // walls: low <= x <= high
  Contact contacts;
  std::vector<int> side;  // [n] of the blade, on which a particle begins: +1 or -1

  bool is_free(int32_t i) const { return alive[at(i)] && !held[at(i)]; }
  // Elasticity acts on y = x + τ (x − x_prev) / dt. Without retardation the two are one.
  Vec3 ahead(int32_t i, Vec3 x) const { return share == 1 ? x : start[at(i)] + (x - start[at(i)]) / share; }
  Vec3 back(int32_t i, Vec3 y) const { return share == 1 ? y : start[at(i)] + share * (y - start[at(i)]); }
  std::vector<Vec3> ahead(const std::vector<Vec3>& x) const;
  double clamped(double value, int axis) const { return std::clamp(value, low[at(axis)], high[at(axis)]); }
  // Where contacts let a free particle be that would go to `free`. `present`, if given: where it is, which it does not
  // leave for what is worse.
  Vec3 placed(int32_t i, Vec3 free, const Vec3* present = nullptr) const;
  // Whether blade and walls both move it, in turn: then its place need not be the nearest one.
  bool is_placed_in_turn(int32_t i, Vec3 free) const;
};

// Positions from which the iteration begins: x~ where contacts let it be.
std::vector<Vec3> first_positions(const SubstepProblem& problem);

struct Poses {
  std::vector<Vec3> y;         // [n] where elasticity acts
  std::vector<Vec3> center;    // t_c
  std::vector<Mat3> rotation;  // R_c
  std::vector<Mat3> from_f;    // V_c - F_c; without a share of it, 0
  std::vector<Mat3> map;       // C_c
};
// The best where elasticity acts when particles are at x. Where many rotations are, the one nearest to `previous`.
Poses poses_at(const SubstepProblem& problem, const std::vector<Vec3>& x, const std::vector<Mat3>& previous);

// [n] g_i less the mean of t_c over a particle's clusters: the mean of C_c (X_i − T_c) + β (y_i − t_c). With these
// held fixed, a function bounds E from above and meets it at y. So its minimum has less E.
std::vector<Vec3> turned_offsets(const SubstepProblem& problem, const Poses& poses);

// One plain iteration from x, whose poses are given.
std::vector<Vec3> plain_iterate(const SubstepProblem& problem, const std::vector<Vec3>& x, const Poses& poses);

// E at positions x with these t, R and V − F [kg m²/s²]. Held particles have no inertia: their positions are given.
double energy_at(const SubstepProblem& problem, const std::vector<Vec3>& x, const Poses& poses);

}  // namespace cutproof::oracles
