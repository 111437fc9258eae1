// All constants of the simulation of one body: the body, the parameters of the six stages, and the contacts and grips
// of each substep. Paths are resolved to tables, so that two backends cannot disagree about kinematics.
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "model/blade.h"
#include "model/body.h"
#include "model/skin.h"

namespace cutproof {

enum class Solver : int16_t { implicit, published };         // method.md §3
enum class Acceleration : int16_t { none, chebyshev };       // of the implicit solver, method.md §11
enum class Criterion { none, distance, geometric, strain };  // method.md §4; none: nothing is ever removed
enum class RemovedEnds { both, one, nearer };                // of an edge that is too long, method.md §4
enum class MergeRule { none, deterministic, published };     // method.md §6
enum class ExpandRule { none, edge_cover, published };       // method.md §7

// A cluster has volume to keep if det A0 exceeds this part of (tr A0)³, A0 its second moments at rest. Otherwise it
// extends along the axes whose moments exceed this part of the greatest (method.md §3, Volume).
inline constexpr double kFlatVolume = 1.0 / (15 * 15 * 15), kFlatExtent = 1e-3;

struct StepParameters {
  Solver solver = Solver::implicit;
  int32_t substeps = 4;                            // per frame, >= 1
  int32_t iterations = 4;                          // K per substep, >= 0
  double stiffness = 1e5;                          // k [1/s²], implicit: s = k dt² / (1 + k dt²)
  double volume_share = 0;                         // β in [0, 1), implicit only: the share of k that keeps volume
  double relaxation = 0.5;                         // s in (0, 1], published
  Acceleration acceleration = Acceleration::none;  // implicit only
  double damping = 0;                              // c [1/s]: v = exp(-c dt) (x - x_prev) / dt
  double retardation = 0;                          // τ [s], implicit only: elasticity acts at x + τ v, method.md §3
  Vec3 gravity = {};                               // [m/s²], body frame
  friend bool operator==(const StepParameters&, const StepParameters&) = default;
};

struct DetectParameters {
  Criterion criterion = Criterion::distance;
  RemovedEnds remove = RemovedEnds::both;  // distance only
  double epsilon = 1.5;                    // an edge of G longer than epsilon · h (its rest length) is open
  double strain = 1.2;                     // strain baseline: removed if a principal stretch of a cluster exceeds this
  bool without_blade = false;              // false: a scene without a blade launches no detection
  friend bool operator==(const DetectParameters&, const DetectParameters&) = default;
};

// With RemovedEnds::nearer the end on the positive side goes if it is nearer to the blade's plane by more than this
// [h]. Where a blade lies halfway between two layers, both ends are equally near, and the whole negative layer goes.
inline constexpr double kNearerBy = 0.125;

// Switches removal off, and sets parameters without a meaning to their defaults.
inline void remove_nothing(DetectParameters& detect) {
  detect.criterion = Criterion::none;
  detect.remove = RemovedEnds::both;
}

struct SplitParameters {
  int32_t debris = 0;  // components of G with fewer particles are removed; 0 keeps all
  friend bool operator==(const SplitParameters&, const SplitParameters&) = default;
};

struct MergeParameters {
  MergeRule rule = MergeRule::deterministic;  // tau and cap are part of the state
  friend bool operator==(const MergeParameters&, const MergeParameters&) = default;
};

struct ExpandParameters {
  ExpandRule rule = ExpandRule::edge_cover;
  int32_t depth = 1;  // layers taken in, >= 1
  friend bool operator==(const ExpandParameters&, const ExpandParameters&) = default;
};

struct SkinParameters {
  bool wanted = true;     // false: no skin is made
  double alpha = 0.5;     // vertex at X_i + alpha h e where no crossing is known, in (0, 1)
  bool fit_cuts = false;  // a vertex that a blade brings about lies where the blade has crossed its grid edge
  friend bool operator==(const SkinParameters&, const SkinParameters&) = default;
};

// A half-space orthogonal to an axis: tissue keeps side · (x[axis] - offset) >= 0. The ground is one of these.
struct Wall {
  int32_t axis = 2;     // 0, 1, 2
  int32_t side = +1;    // +1 or -1
  double offset = 0;    // body frame [m]
  double friction = 0;  // Coulomb coefficient, >= 0
  friend bool operator==(const Wall&, const Wall&) = default;
};

// A particle nearer than this to a contact counts as touching in an accelerated iteration (method.md §11) [h]. Rounding
// must not decide for a particle that lies exactly on a wall.
inline constexpr double kTouchMargin = 0x1p-10;

// Where blade and walls are projected in turn, a worse place than the present one is refused (method.md §3). Worse
// means by more than this many roundings of the compared distance and of the present place.
inline constexpr double kRefusalRoundings = 64;

// Whether two walls face each other with no room between them: then no place is allowed.
inline bool leave_no_room(const Wall& a, const Wall& b) {
  return a.axis == b.axis && a.side != b.side && a.side * (b.offset - a.offset) <= 0;
}

// Particles that follow a given path while active. Pinned particles are a grip that never moves.
struct Grip {
  std::vector<int32_t> particles;  // ascending; no particle is held by two grips at once
  std::vector<uint8_t> active;     // [frames · substeps] 1: held in this substep
  std::vector<Vec3> displacement;  // [frames · substeps] by how much they move in this substep [m]
  friend bool operator==(const Grip&, const Grip&) = default;
};

struct Setup {
  Body body;
  StepParameters step;
  DetectParameters detect;
  SplitParameters split;
  MergeParameters merge;
  ExpandParameters expand;
  SkinParameters skin;
  std::vector<Wall> walls;
  std::vector<Grip> grips;
  bool has_blade = false;
  Blade blade;
  // The schedule. Frame f consists of substeps f·S .. f·S + S - 1 with S = step.substeps. A scene's frame in which
  // the blade would be too fast is already divided into equal frames here (method.md §3, Blade).
  std::vector<double> substep_length;  // [frames] dt [s], > 0
  std::vector<BladeMove> blade_moves;  // [frames · S], empty if there is no blade
  std::vector<int64_t> stroke_end;     // [strokes] frame that completes the stroke; -1: the run ends earlier

  // Iterations that the last substep of each frame leaves out, 0 .. iterations. No scene does: so a backend can be
  // asked for every iterate of a frame (oracles/iterates/).
  int32_t withheld_iterations = 0;

  int64_t frame_count() const { return static_cast<int64_t>(substep_length.size()); }
};

// Distance of a skin vertex from its owner on a grid edge that no cut has opened, as a fraction of h (method.md §8).
inline double uncut_reach(const Setup& setup, int32_t owner, int direction) {
  const double crossing = setup.body.crossing(owner, direction);
  return crossing > 0 ? crossing : setup.skin.alpha;
}

// The same for all vertices of a skin. A vertex with an invalid owner or direction has alpha.
inline std::vector<double> uncut_reaches(const Setup& setup, const Skin& skin) {
  std::vector<double> reaches(skin.owner.size(), setup.skin.alpha);
  for (std::size_t v = 0; v < std::min(skin.owner.size(), skin.direction.size()); ++v) {
    const bool exists = skin.owner[v] >= 0 && skin.owner[v] < setup.body.particle_count() && skin.direction[v] < 6;
    if (exists) reaches[v] = uncut_reach(setup, skin.owner[v], skin.direction[v]);
  }
  return reaches;
}

// Whether frames of this setup launch the detect stage.
inline bool needs_detection(const Setup& setup) {
  return setup.detect.criterion != Criterion::none && (setup.has_blade || setup.detect.without_blade);
}

// ρ: how far the blade keeps particles from its mid-surface [m] (method.md §3, Blade: dynamic).
inline double blade_clearance(const Setup& setup) {
  const double reach = setup.detect.epsilon * setup.body.grid.spacing;
  return 1.001 * (setup.blade.thickness > reach ? setup.blade.thickness : reach) / 2;
}

// The last pose of the lowered blade in a frame; null if the blade is never lowered, or if the schedule is over. For
// oracles: backends have their own.
inline const BladePose* last_lowered(const Setup& setup, int64_t frame) {
  const int64_t substeps = setup.step.substeps;
  if (!setup.has_blade || frame >= setup.frame_count()) return nullptr;
  for (int64_t s = (frame + 1) * substeps - 1; s >= frame * substeps; --s) {
    const BladeMove& move = setup.blade_moves[static_cast<std::size_t>(s)];
    if (move.down) return &move.to;
  }
  return nullptr;
}

}  // namespace cutproof
