// The table of all fields of a scene: name, unit, bounds and meaning. Visitors of the table read, write and document
// scenes (scene_reader.cpp, scene_writer.cpp, scene_schema.cpp). Defaults are those of the structs in model/scene.h and
// model/setup.h.
//
// A visitor has
//   field(T&, const SceneField&)  T: bool, a number, std::string, Vec3, Range, an enumeration, a struct described here,
//                                 or a std::optional or std::vector of one of these
//   applies(condition)            whether to visit fields that have a meaning only under `condition`
#pragma once
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "model/io/limits.h"
#include "model/scene.h"

namespace cutproof::io {

// Bounds of a number, of each component of a vector, or of each entry of a list.
struct Bounds {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  std::string_view unit = "";                // empty: a pure number
  bool open_low = false, open_high = false;  // the bound itself is not allowed

  bool contains(double x) const {
    return (open_low ? x > low : x >= low) && (open_high ? x < high : x <= high);  // false for NaN
  }
};
constexpr Bounds between(double low, double high, std::string_view unit = "") { return {low, high, unit}; }
constexpr Bounds above(double low, double high, std::string_view unit = "") { return {low, high, unit, true}; }
constexpr Bounds inside(double low, double high, std::string_view unit = "") { return {low, high, unit, true, true}; }

enum Presence {
  kOptional,
  kRequired,
  kZeroIsAbsent  // zero stands for "not given": neither written nor accepted
};

struct SceneField {
  std::string_view name;
  std::string_view doc;
  Bounds bounds = {};
  Presence presence = kOptional;
  std::size_t most = 0;  // entries of a list or bytes of a text, each of which has a limit
};

// --- The fields ----------------------------------------------------------------------------------------------------
inline constexpr double kLongest = 1e6;  // of any length [m] and coordinate
inline constexpr double kMany = 1e9;     // of any count
inline constexpr double kFriction = 1e6;

// A wall with axis 2 and side +1.
struct Ground {
  double offset = 0;
  double friction = 0;
};

// Objects of the file that are no structs of the program.
struct FrameFields {
  double& length;
  int64_t& count;
  double& settle;
};
struct DetectFields {
  DetectParameters& parameters;
  DetectEvery& every;
};

void describe(auto& v, Shape& s) {
  using enum Shape::Kind;
  v.field(s.kind, {"kind",
                   "`kidney`, `liver`: organs made in code; `union`: all `parts` together; `difference`: the first of "
                   "`parts` without the others.",
                   {},
                   kRequired});
  const bool made_of_parts = s.kind == union_of || s.kind == difference;
  const bool has_size = s.kind == box || s.kind == kidney || s.kind == liver;
  const bool has_axis = s.kind == cylinder || s.kind == capsule || s.kind == torus;
  if (v.applies(!made_of_parts)) {
    v.field(s.center,
            {"center", "Middle of the shape; not for `union` and `difference`.", between(-kLongest, kLongest, "m")});
  }
  if (v.applies(has_size)) {
    v.field(s.size, {"size", "Extents of the bounding box along x, y, z; only for `box`, `kidney` and `liver`.",
                     above(0, kLongest, "m")});
  }
  if (v.applies(s.kind == ball || has_axis)) {
    v.field(s.radius, {"radius",
                       "Only for `ball`, `cylinder`, `capsule` and `torus`; in a torus, radius of the circle in the "
                       "middle of the tube.",
                       above(0, kLongest, "m")});
  }
  if (v.applies(s.kind == torus)) {
    v.field(s.tube, {"tube", "Radius of the tube, less than `radius`; only for `torus`.", above(0, kLongest, "m")});
  }
  if (v.applies(s.kind == cylinder || s.kind == capsule)) {
    v.field(
        s.length,
        {"length",
         "Only for `cylinder` (from end to end) and `capsule` (without its two round caps, which add `radius` each).",
         above(0, kLongest, "m")});
  }
  if (v.applies(has_axis)) {
    v.field(s.along,
            {"along", "Direction of the axis, of any length but zero; only for `cylinder`, `capsule` and `torus`.",
             between(-1e6, 1e6)});
  }
  if (v.applies(made_of_parts)) {
    v.field(s.parts,
            {"parts", "Further shapes, at least one; only for `union` and `difference`.", {}, kOptional, kMostShapes});
  }
}

void describe(auto& v, MeshSpec& s) {
  v.field(s.file, {"file",
                   "STL, OBJ, PLY or OFF file of a closed surface, relative to the folder of the scene's file.",
                   {},
                   kRequired,
                   kMostPathBytes});
  v.field(s.unit,
          {"unit", "Metres per unit of the mesh's file: 0.001 for millimetres.", above(0, kLongest, "m"), kRequired});
  v.field(s.repair, {"repair",
                     "Whether to repair a surface that bounds no solid, and report the changes (method.md §1). "
                     "Otherwise such a mesh is refused."});
  v.field(s.repair_change, {"repair_change",
                            "Greatest change of volume by repair, as a share of the larger of both volumes. Beyond it "
                            "the mesh is refused; 1 accepts any change.",
                            between(0, 1)});
}

void describe(auto& v, BodySpec& s) {
  v.field(s.shape, {"shape", "An implicit shape; give either `shape` or `mesh`."});
  v.field(s.mesh, {"mesh", "A closed surface mesh; give either `shape` or `mesh`."});
  v.field(s.spacing, {"spacing", "h, spacing of the background grid; give either `spacing` or `particles`.",
                      above(0, kLongest, "m"), kZeroIsAbsent});
  v.field(
      s.particles,
      {"particles",
       "Wanted number of particles, met within 2 % by a search for the spacing. Give either `spacing` or `particles`.",
       between(1, kMany), kZeroIsAbsent});
  v.field(s.density, {"density", "Mass per volume; a particle has the mass density · h³.", above(0, 1e9, "kg/m³")});
  v.field(s.fit_skin, {"fit_skin",
                       "Whether skin vertices of the uncut body lie where its surface crosses grid edges; otherwise "
                       "they lie `skin.alpha` beyond their particles (method.md §8)."});
  v.field(s.align, {"align",
                    "Whether the principal axes of a mesh (longest, middle, shortest) are first turned to x, y, z. "
                    "Implicit shapes are never turned."});
  v.field(s.origin, {"origin", "Place of the body's frame in the world; no computation depends on it.",
                     between(-1e12, 1e12, "m")});
}

void describe(auto& v, MaterialSpec& s) {
  v.field(s.youngs_modulus, {"youngs_modulus", "E.", above(0, 1e15, "Pa"), kRequired});
  v.field(s.poisson_ratio, {"poisson_ratio", "ν.", between(0, 0.49), kRequired});
  v.field(s.density, {"density", "ρ.", above(0, 1e9, "kg/m³"), kRequired});
}

void describe(auto& v, ClusterSpec& s) {
  v.field(s.method, {"method",
                     "`boxes`: cores tile the grid and grow by one node, so that every edge is covered. `sampled`: "
                     "greedy balls around seeds in random order. `tiles`: boxes that share their faces, for a "
                     "`material` (method.md §2)."});
  v.field(s.side, {"side", "`boxes`: nodes per side of a core. `tiles`: edges per side.", between(1, 1000, "nodes")});
  v.field(s.spacing,
          {"spacing", "`sampled`: distance within which a seed covers particles; covered ones become no seeds.",
           above(0, 1e4, "h")});
  v.field(s.radius, {"radius", "`sampled`: radius of the balls.", above(0, 1e4, "h")});
  v.field(s.small,
          {"small",
           "A cluster is small, and may merge, below this multiple of the median size at cooking, of `tiles` side³.",
           between(0, 1000)});
  v.field(s.cap, {"cap", "Merging makes no cluster larger than this multiple of the greatest size at cooking.",
                  between(1, 1000)});
}

void describe(auto& v, StepParameters& s) {
  v.field(s.solver, {"solver",
                     "`implicit`: implicit Euler, which converges to the minimum of one energy; `published`: the "
                     "paper's Jacobi PBD (method.md §3)."});
  v.field(s.substeps, {"substeps", "Substeps per frame.", between(1, 100000)});
  v.field(s.iterations, {"iterations", "K, solver iterations per substep.", between(0, 1e6)});
  v.field(s.stiffness,
          {"stiffness", "k, stiffness per mass; `implicit` only, with κ = k dt (dt + τ) and s = κ / (1 + κ).",
           between(0, 1e15, "1/s²")});
  v.field(s.volume_share,
          {"volume_share", "β, the share of k that keeps volume (method.md §3, Volume). `implicit` only.",
           between(0, 0.999)});
  v.field(s.relaxation, {"relaxation", "s; `published` only.", above(0, 1)});
  v.field(s.acceleration, {"acceleration",
                           "`chebyshev`: the same answer in fewer, slightly dearer iterations; the energy may rise in "
                           "some (method.md §11). `published` has only `none`, there the default."});
  v.field(s.damping, {"damping", "γ: velocities decay as exp(−γ t).", between(0, 1e9, "1/s")});
  v.field(s.retardation, {"retardation",
                          "τ, delay of elasticity, which acts on x + τ v: Rayleigh damping, a Kelvin–Voigt material of "
                          "viscosity τ times its elastic modulus. Deformations fade, rigid motion does not, and the "
                          "decay does not stem from the time step alone (method.md §3). `implicit` only.",
                          between(0, 1e3, "s")});
  v.field(s.gravity, {"gravity", "Acceleration in the body's frame.", between(-1e6, 1e6, "m/s²")});
}

void describe(auto& v, DetectParameters& s) {
  v.field(s.criterion, {"criterion",
                        "Reason to remove a particle. `distance`: a neighbour farther than epsilon · h. `geometric`: "
                        "the swept blade within half of max(thickness, h, distance to the farthest neighbour). "
                        "`strain`: a cluster's principal stretch. `none`: no particle is removed (method.md §4)."});
  v.field(s.remove, {"remove",
                     "`distance` only: the ends that an edge longer than epsilon · h loses. `both` is the paper's "
                     "rule. `one` halves the loss: if a lowered blade's plane separates the ends, the one on the "
                     "negative side goes (along × back is positive). Otherwise the end with more such edges goes, of "
                     "equals the lower particle. `nearer` is as `one`, but of separated ends the positive one goes if "
                     "the clusters carry it nearer to the plane by more than h/8. Both faces of the cut then lie where "
                     "the blade passed (method.md §4). With other criteria the default is `both`."});
  v.field(s.epsilon,
          {"epsilon",
           "Distance from a neighbour beyond which a particle is removed; at 1 or less, that removes tissue at rest.",
           above(0, 1e6, "h")});
  v.field(s.strain, {"strain", "`strain` only: greatest principal stretch that is not yet a cut.", above(0, 1e6)});
  v.field(s.without_blade, {"without_blade", "Whether detection also runs in a scene without a blade."});
}

void describe(auto& v, DetectFields& s) {
  describe(v, s.parameters);
  v.field(s.every, {"every",
                    "`frame`: detection and all later stages run once a frame, as in the paper; `substep`: after each "
                    "substep. A frame then counts as `step.substeps` frames of one substep."});
}

void describe(auto& v, SplitParameters& s) {
  v.field(s.debris, {"debris", "Pieces of tissue with fewer particles are removed and counted; 0 keeps all.",
                     between(0, kMany, "particles")});
}

void describe(auto& v, MergeParameters& s) {
  v.field(s.rule, {"rule", "How small clusters join their neighbours (method.md §6)."});
}

void describe(auto& v, ExpandParameters& s) {
  v.field(s.rule, {"rule", "How uncoupled clusters take in neighbours (method.md §7)."});
  v.field(s.depth, {"depth", "Layers of particles taken in.", between(1, 1000, "layers")});
}

void describe(auto& v, SkinParameters& s) {
  v.field(s.wanted, {"wanted", "Whether a skin is made."});
  v.field(s.alpha, {"alpha",
                    "Distance of a skin vertex from its particle where neither the body's surface (`body.fit_skin`) "
                    "nor a blade (`fit_cuts`) determines it.",
                    inside(0, 1, "h")});
  v.field(s.fit_cuts, {"fit_cuts",
                       "Whether vertices on cut faces lie where the blade's plane crosses their grid edges; otherwise "
                       "they lie `alpha` beyond their particles (method.md §8)."});
}

void describe(auto& v, StrokeSpec& s) {
  v.field(s.curve, {"curve",
                    "`line`: the polyline through the points, at whose corners a blade that follows the path turns on "
                    "the spot. `arc`: the circle through three points, from the first over the second to the third."});
  v.field(s.points, {"points", "Places of the middle of the cutting edge; at least two, for an arc exactly three.",
                     between(-1000, 1000, "box"), kRequired, kMostPoints});
  v.field(s.back,
          {"back", "Direction from the cutting edge to the back of the blade (metric, not box).", between(-1e6, 1e6)});
  v.field(s.along, {"along",
                    "Direction of the cutting edge (metric), made orthogonal to `back`. Absent: the path's tangent, "
                    "also made orthogonal, so that the blade turns with its path. A blade that is pressed in along "
                    "`back` requires this field.",
                    between(-1e6, 1e6)});
  v.field(s.pause, {"pause", "Time with a raised blade before the next stroke, rounded up to whole frames.",
                    between(0, 1e6, "s")});
}

void describe(auto& v, BladeSpec& s) {
  v.field(
      s.length,
      {"length",
       "Length of the cutting edge, as a multiple of the bounding box's extent along it when the first stroke begins.",
       above(0, 1e6, "extents")});
  v.field(s.depth, {"depth",
                    "Distance from the cutting edge to the back, as a multiple of the bounding box's extent along the "
                    "first stroke's `back`.",
                    above(0, 1e6, "extents")});
  v.field(s.thickness, {"thickness", "Thickness of the plate.", between(0, 1e6, "h")});
  v.field(s.friction, {"friction", "Coulomb coefficient of blade on tissue.", between(0, kFriction)});
  v.field(s.speed,
          {"speed",
           "Speed of the middle of the cutting edge, or of the edge's ends while the blade turns on the spot. The "
           "speed is lowered slightly: each straight piece takes whole substeps, each stroke whole frames.",
           above(0, 1e9, "m/s")});
  v.field(s.start,
          {"start", "Time at which the first stroke begins, rounded up to whole frames.", between(0, 1e6, "s")});
  v.field(s.strokes, {"strokes", "The path, stroke by stroke; at least one.", {}, kRequired, kMostStrokes});
}

void describe(auto& v, Ground& s) {
  v.field(s.offset, {"offset", "Height: box coordinate along z.", between(-1000, 1000, "box")});
  v.field(s.friction, {"friction", "Coulomb coefficient.", between(0, kFriction)});
}

void describe(auto& v, WallSpec& s) {
  v.field(s.axis, {"axis", "The wall is orthogonal to this axis: 0 x, 1 y, 2 z.", between(0, 2)});
  v.field(s.side, {"side", "+1: tissue stays above the wall; −1: below it.", between(-1, 1)});
  v.field(s.offset, {"offset", "Box coordinate along the axis.", between(-1000, 1000, "box")});
  v.field(s.friction, {"friction", "Coulomb coefficient.", between(0, kFriction)});
}

void describe(auto& v, GripSpec& s) {
  v.field(s.low, {"low", "Lower corner of the region; particles whose rest positions lie inside are held.",
                  between(-1000, 1000, "box"), kRequired});
  v.field(s.high, {"high", "Upper corner of the region.", between(-1000, 1000, "box"), kRequired});
  v.field(s.start, {"start", "Time at which holding begins.", between(0, 1e6, "s")});
  v.field(s.end, {"end", "Time at which holding ends; negative: with the scene.", between(-1, 1e6, "s")});
  v.field(s.after_strokes, {"after_strokes", "Whether `start` and `end` count from the end of the last stroke."});
  v.field(s.velocity, {"velocity", "Velocity of the held particles; zero pins them.", between(-1e6, 1e6, "m/s")});
}

void describe(auto& v, Expectations& s) {
  constexpr Bounds kCount = between(0, 1e15);
  v.field(s.components_after_stroke,
          {"components_after_stroke",
           "Connected components of the tissue graph at the end of each stroke, one entry per stroke.", kCount,
           kOptional, kMostStrokes});
  v.field(s.components_at_end, {"components_at_end", "Connected components when the scene ends.", kCount});
  v.field(s.shells_at_end, {"shells_at_end", "Outer shells of the skin when the scene ends.", kCount});
  v.field(s.removed, {"removed", "Particles removed over the whole run.", kCount});
  v.field(s.isolated_clusters,
          {"isolated_clusters",
           "Greatest number, in any frame, of groups of clusters isolated inside connected tissue.", kCount});
  v.field(s.cluster_growth,
          {"cluster_growth", "(Clusters at the end − at the start) / at the start.", between(-1, 1e9)});
  v.field(s.clusters, {"clusters", "Clusters after cooking.", kCount});
  v.field(s.particles, {"particles", "Particles of the body.", kCount});
  v.field(s.dent, {"dent", "Greatest depth of the surface's dent before the first removal.", between(0, 1e6, "h")});
  v.field(s.greatest_stretch,
          {"greatest_stretch", "Greatest distance of two neighbours in any frame.", between(0, 1e9, "h")});
}

void describe(auto& v, FrameFields& s) {
  v.field(s.length, {"length", "Duration of a frame. Frames with too fast a blade are divided into equal shorter ones.",
                     above(0, 1000, "s")});
  v.field(
      s.count,
      {"count",
       "Number of frames; 0: until the last stroke (without a blade, the last grip) has ended and `settle` is over.",
       between(0, 1e5)});
  v.field(s.settle, {"settle", "Time after the last stroke.", between(0, 1e6, "s")});
}

void describe(auto& v, Scene& s) {
  std::optional<std::string> schema;  // for editors
  v.field(schema, {"$schema",
                   "Place of the JSON Schema, for editors; cutproof ignores this field. `cutproof info --schema` "
                   "prints that schema.",
                   {},
                   kOptional,
                   kMostPathBytes});
  v.field(s.version,
          {"version", "Version of this format; no other is read.", between(kSceneVersion, kSceneVersion), kRequired});
  v.field(s.name, {"name", "A short name, for reports.", {}, kOptional, kMostNameBytes});
  v.field(s.description,
          {"description", "Description of the scene, for readers.", {}, kOptional, kMostDescriptionBytes});
  v.field(s.seed, {"seed", "Seed of all random numbers.", between(0, 18446744073709551615.0)});
  v.field(s.body, {"body", "The tissue that is cut.", {}, kRequired});
  v.field(s.material, {"material",
                       "An isotropic material (method.md §3, Volume), in place of `body.density`, `step.stiffness` and "
                       "`step.volume_share`; `implicit` only."});
  v.field(s.clusters, {"clusters", "Covering of the body with clusters."});
  FrameFields frame{s.frame_length, s.frames, s.settle};
  v.field(frame, {"frame", "Division of time."});
  v.field(s.step, {"step", "The stage that moves particles."});
  DetectFields detect{s.detect, s.detect_every};
  v.field(detect, {"detect", "The stage that decides which particles are removed."});
  v.field(s.split, {"split", "The stage that takes clusters apart."});
  v.field(s.merge, {"merge", "The stage that joins small clusters."});
  v.field(s.expand, {"expand", "The stage that keeps connected tissue coupled."});
  v.field(s.skin, {"skin", "The stage that makes the visible surface."});
  v.field(s.blade, {"blade", "The blade and its path; absent: no blade cuts."});
  std::optional<Ground> ground;
  v.field(ground, {"ground", "The wall on which tissue lies: short for a wall with axis 2 and side +1."});
  v.field(s.walls, {"walls", "Half-spaces that tissue cannot enter.", {}, kOptional, kMostWalls});
  if (ground) s.walls.insert(s.walls.begin(), {2, +1, ground->offset, ground->friction});
  v.field(s.grips,
          {"grips", "Kinematic constraints: regions whose particles are held or moved.", {}, kOptional, kMostGrips});
  v.field(s.expect, {"expect", "Expectations that `cutproof run --check` enforces; absent ones are not enforced."});
}

}  // namespace cutproof::io
