// The table of all fields of a scene: name, unit, bounds and meaning, once. A visitor that goes through it reads,
// writes or documents a scene (scene_reader.cpp, scene_writer.cpp, scene_schema.cpp). Defaults are those of the structs
// in model/scene.h and model/setup.h.
//
// A visitor has
//   field(T&, const SceneField&)      T: bool, a number, std::string, Vec3, Range, an enumeration, a struct described
//   here,
//                                or a std::optional or std::vector of one of these
//   applies(condition)           whether fields that make sense only under `condition` are to be visited
#pragma once
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "model/io/limits.h"
#include "model/scene.h"

namespace cutproof::io {

// What a number may be: each component of a vector and each entry of a list too.
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
  std::size_t most = 0;  // entries of a list, bytes of a text; of these all have a limit
};

// --- The fields ----------------------------------------------------------------------------------------------------
inline constexpr double kLongest = 1e6;  // of any length [m] and coordinate
inline constexpr double kMany = 1e9;     // of any count
inline constexpr double kFriction = 1e6;

// The ground is a wall that everybody knows by name.
struct Ground {
  double offset = 0;
  double friction = 0;
};

// Objects of their own in the file.
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
                   "`box`, `ball`, `cylinder`, `capsule`, `torus`; `kidney`, `liver`: organs made in code; `union`: "
                   "all `parts` together; `difference`: the first of `parts` without the others.",
                   {},
                   kRequired});
  const bool made_of_parts = s.kind == union_of || s.kind == difference;
  const bool has_size = s.kind == box || s.kind == kidney || s.kind == liver;
  const bool has_axis = s.kind == cylinder || s.kind == capsule || s.kind == torus;
  if (v.applies(!made_of_parts)) {
    v.field(s.center,
            {"center", "Middle of the shape. Not for `union` and `difference`.", between(-kLongest, kLongest, "m")});
  }
  if (v.applies(has_size)) {
    v.field(s.size, {"size", "Extents of the bounding box along x, y, z. Only for `box`, `kidney` and `liver`.",
                     above(0, kLongest, "m")});
  }
  if (v.applies(s.kind == ball || has_axis)) {
    v.field(s.radius, {"radius",
                       "Only for `ball`, `cylinder`, `capsule` and `torus`: there of the circle in the middle of the "
                       "tube.",
                       above(0, kLongest, "m")});
  }
  if (v.applies(s.kind == torus)) {
    v.field(s.tube, {"tube", "Radius of the tube, less than `radius`. Only for `torus`.", above(0, kLongest, "m")});
  }
  if (v.applies(s.kind == cylinder || s.kind == capsule)) {
    v.field(s.length, {"length",
                       "Only for `cylinder`, from end to end, and `capsule`: without its two round caps, which add "
                       "`radius` each.",
                       above(0, kLongest, "m")});
  }
  if (v.applies(has_axis)) {
    v.field(s.along,
            {"along", "Direction of the axis, of any length but zero. Only for `cylinder`, `capsule` and `torus`.",
             between(-1e6, 1e6)});
  }
  if (v.applies(made_of_parts)) {
    v.field(s.parts,
            {"parts", "Further shapes. Only for `union` and `difference`; at least one.", {}, kOptional, kMostShapes});
  }
}

void describe(auto& v, MeshSpec& s) {
  v.field(s.file, {"file",
                   "STL, OBJ, PLY or OFF file of a closed surface, relative to the folder of the scene's file.",
                   {},
                   kRequired,
                   kMostPathBytes});
  v.field(s.unit, {"unit", "Metres per unit of the numbers in the mesh's file: 0.001 if they are millimetres.",
                   above(0, kLongest, "m"), kRequired});
  v.field(s.repair, {"repair",
                     "Repair a surface that does not bound a solid, and say what was done (method.md §1). Otherwise "
                     "such a mesh is refused."});
  v.field(s.repair_change,
          {"repair_change",
           "Most that repair may change the volume by, as a share of the greater of the volumes before "
           "and after; beyond it the mesh is refused. 1 accepts any change.",
           between(0, 1)});
}

void describe(auto& v, BodySpec& s) {
  v.field(s.shape, {"shape", "An implicit shape. Exactly one of `shape` and `mesh` must be given."});
  v.field(s.mesh, {"mesh", "A closed surface mesh. Exactly one of `shape` and `mesh` must be given."});
  v.field(s.spacing,
          {"spacing", "h, spacing of the background grid. Exactly one of `spacing` and `particles` must be given.",
           above(0, kLongest, "m"), kZeroIsAbsent});
  v.field(s.particles, {"particles",
                        "Wanted number of particles; the spacing that gives it within 2 % is looked for. Exactly one "
                        "of `spacing` and `particles` must be given.",
                        between(1, kMany), kZeroIsAbsent});
  v.field(s.density, {"density", "Mass per volume: each particle weighs density · h³.", above(0, 1e9, "kg/m³")});
  v.field(s.fit_skin, {"fit_skin",
                       "Whether the skin of the uncut body lies where its surface crosses the grid edges; otherwise "
                       "it lies `skin.alpha` beyond its particles (method.md §8)."});
  v.field(s.align, {"align",
                    "Turn the principal axes of a mesh (longest, middle, shortest) to x, y, z before anything else. "
                    "Implicit shapes stay as their numbers put them."});
  v.field(s.origin, {"origin", "Where the body's frame lies in the world. No computation depends on it.",
                     between(-1e12, 1e12, "m")});
}

void describe(auto& v, ClusterSpec& s) {
  v.field(s.method, {"method",
                     "`boxes`: cores that tile the grid, grown by one node, so that every edge is covered; `sampled`: "
                     "greedy balls around seeds in random order (method.md §2)."});
  v.field(s.side, {"side", "`boxes`: nodes per side of a core.", between(1, 1000, "nodes")});
  v.field(s.spacing, {"spacing", "`sampled`: least distance of a new seed from what is covered.", above(0, 1e4, "h")});
  v.field(s.radius, {"radius", "`sampled`: radius of the balls.", above(0, 1e4, "h")});
  v.field(s.small, {"small", "A cluster is small, and may merge, below this multiple of the median size at cooking.",
                    between(0, 1000)});
  v.field(s.cap,
          {"cap", "Merging makes no cluster above this multiple of the largest size at cooking.", between(1, 1000)});
}

void describe(auto& v, StepParameters& s) {
  v.field(s.solver, {"solver",
                     "`implicit`: minimises one energy, so it has a converged answer; `published`: the paper's "
                     "position-based dynamics (method.md §3)."});
  v.field(s.substeps, {"substeps", "Substeps per frame.", between(1, 100000)});
  v.field(s.iterations, {"iterations", "K, solver iterations per substep.", between(0, 1e6)});
  v.field(s.stiffness,
          {"stiffness", "k, stiffness per mass. `implicit` only: s = k dt² / (1 + k dt²).", between(0, 1e15, "1/s²")});
  v.field(s.relaxation, {"relaxation", "s, `published` only.", above(0, 1)});
  v.field(s.acceleration, {"acceleration",
                           "`chebyshev`: the same answer in fewer iterations, each of which costs a little more; the "
                           "energy need not fall in every one (method.md §11). `implicit` only: left out, it is `none` "
                           "with `published`."});
  v.field(s.damping, {"damping", "c: velocities decay as exp(−c t).", between(0, 1e9, "1/s")});
  v.field(
      s.retardation,
      {"retardation",
       "τ: elasticity acts on x + τ v, so deformations fade and not motion as a whole (Kelvin and Voigt's material, "
       "of viscosity τ times its elastic modulus). What fades then belongs to the material, and not to the time step "
       "alone (method.md §3). `implicit` only.",
       between(0, 1e3, "s")});
  v.field(s.gravity, {"gravity", "In the body's frame.", between(-1e6, 1e6, "m/s²")});
}

void describe(auto& v, DetectParameters& s) {
  v.field(s.criterion, {"criterion",
                        "What removes a particle. `distance`: a neighbour farther than epsilon · h; `geometric`: the "
                        "swept blade comes within max(thickness, h)/2 of its node; `strain`: a cluster's principal "
                        "stretch; `none`: nothing is ever removed (method.md §4)."});
  v.field(s.remove, {"remove",
                     "`distance` only: of an edge that is longer than epsilon · h `both` ends go, as in the paper, or "
                     "`one`, which halves the loss: the end on the negative side of the plane of a lowered blade "
                     "between them (along × back is positive), else the one with more such edges, of equals the lower "
                     "particle; or `nearer`: as `one`, but of two ends on different sides of that plane the positive "
                     "one if the clusters carry it nearer to it by more than h/8, so that both faces of the cut lie "
                     "where the blade passed (method.md §4). Left out, it is `both` with other criteria."});
  v.field(s.epsilon,
          {"epsilon", "Distance from a neighbour beyond which a particle is removed. At 1 or less, tissue at rest is.",
           above(0, 1e6, "h")});
  v.field(s.strain, {"strain", "`strain` only: greatest principal stretch that is not yet a cut.", above(0, 1e6)});
  v.field(s.without_blade, {"without_blade", "Whether a scene without a blade launches detection too."});
}

void describe(auto& v, DetectFields& s) {
  describe(v, s.parameters);
  v.field(s.every, {"every",
                    "`frame`: detection, and all stages behind it, run once a frame, as in the paper; `substep`: after "
                    "each substep. A frame is then laid out as `step.substeps` frames of one substep, and counts as so "
                    "many."});
}

void describe(auto& v, SplitParameters& s) {
  v.field(s.debris, {"debris", "Pieces of tissue with fewer particles are removed, and counted; 0 keeps all.",
                     between(0, kMany, "particles")});
}

void describe(auto& v, MergeParameters& s) {
  v.field(s.rule, {"rule", "How small clusters join their neighbours (method.md §6)."});
}

void describe(auto& v, ExpandParameters& s) {
  v.field(s.rule, {"rule", "How clusters that lost touch take in neighbours (method.md §7)."});
  v.field(s.depth, {"depth", "Layers of particles taken in.", between(1, 1000, "layers")});
}

void describe(auto& v, SkinParameters& s) {
  v.field(s.wanted, {"wanted", "Whether a skin is made at all."});
  v.field(s.alpha, {"alpha",
                    "How far beyond its particle a skin vertex lies where neither the body's surface (`body.fit_skin`) "
                    "nor a blade (`fit_cuts`) tells.",
                    inside(0, 1, "h")});
  v.field(s.fit_cuts,
          {"fit_cuts",
           "Whether a vertex that a cut brings about lies where the plane of the blade crosses its grid edge; "
           "otherwise it lies `alpha` beyond its particle (method.md §8)."});
}

void describe(auto& v, StrokeSpec& s) {
  v.field(s.curve, {"curve",
                    "`line`: the polyline through the points, at whose corners a blade that follows the path turns on "
                    "the spot; `arc`: the circle through three points, from the first over the second to the third."});
  v.field(s.points,
          {"points", "Where the middle of the cutting edge goes; at least two points, for an arc exactly three.",
           between(-1000, 1000, "box"), kRequired, kMostPoints});
  v.field(s.back,
          {"back", "Direction from the cutting edge to the back of the blade, in the body's frame (metric, not box).",
           between(-1e6, 1e6)});
  v.field(
      s.along,
      {"along",
       "Direction of the cutting edge (metric), made orthogonal to `back`. Absent: the path's tangent, made orthogonal "
       "to `back`, so that the blade turns with its path. Needed when the blade is pressed in along `back`.",
       between(-1e6, 1e6)});
  v.field(s.pause, {"pause", "Time with the blade up before the next stroke, rounded up to whole frames.",
                    between(0, 1e6, "s")});
}

void describe(auto& v, BladeSpec& s) {
  v.field(s.length,
          {"length",
           "Length of the cutting edge, in extents of the bounding box along it at the start of the first stroke.",
           above(0, 1e6, "extents")});
  v.field(
      s.depth,
      {"depth", "From the cutting edge to the back, in extents of the bounding box along the first stroke's `back`.",
       above(0, 1e6, "extents")});
  v.field(s.thickness, {"thickness", "Thickness of the plate.", between(0, 1e6, "h")});
  v.field(s.friction, {"friction", "Coulomb coefficient of blade on tissue.", between(0, kFriction)});
  v.field(s.speed,
          {"speed",
           "Of the middle of the cutting edge. It is lowered a little so that every straight piece takes whole "
           "substeps and every stroke whole frames; turning on the spot, the ends of the edge move this fast.",
           above(0, 1e9, "m/s")});
  v.field(s.start, {"start", "When the first stroke begins, rounded up to whole frames.", between(0, 1e6, "s")});
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
  v.field(s.low, {"low", "Lower corner of the region whose particles, by rest position, are held.",
                  between(-1000, 1000, "box"), kRequired});
  v.field(s.high, {"high", "Upper corner.", between(-1000, 1000, "box"), kRequired});
  v.field(s.start, {"start", "When holding begins.", between(0, 1e6, "s")});
  v.field(s.end, {"end", "When it ends; negative: with the scene.", between(-1, 1e6, "s")});
  v.field(s.after_strokes, {"after_strokes", "`start` and `end` count from the end of the last stroke."});
  v.field(s.velocity,
          {"velocity", "How the held particles move; zero: pinned where they are.", between(-1e6, 1e6, "m/s")});
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
  v.field(s.length,
          {"length", "Of a frame. Frames in which the blade would be too fast are divided into equal shorter ones.",
           above(0, 1000, "s")});
  v.field(s.count, {"count",
                    "Frames in all. 0: until the last stroke has ended and `settle` is over; without a blade, until "
                    "the last grip has ended and `settle` is over.",
                    between(0, 1e5)});
  v.field(s.settle, {"settle", "Time after the last stroke.", between(0, 1e6, "s")});
}

void describe(auto& v, Scene& s) {
  std::optional<std::string> schema;  // for others
  v.field(schema, {"$schema",
                   "Where an editor finds the JSON Schema of scenes, which `cutproof info --schema` prints; nothing is "
                   "read there.",
                   {},
                   kOptional,
                   kMostPathBytes});
  v.field(s.version,
          {"version", "Of this format; no other is read.", between(kSceneVersion, kSceneVersion), kRequired});
  v.field(s.name, {"name", "A short name, for reports.", {}, kOptional, kMostNameBytes});
  v.field(s.description, {"description", "What the scene shows, for people.", {}, kOptional, kMostDescriptionBytes});
  v.field(s.seed, {"seed", "Of everything random.", between(0, 18446744073709551615.0)});
  v.field(s.body, {"body", "What is cut.", {}, kRequired});
  v.field(s.clusters, {"clusters", "How the body is covered with clusters."});
  FrameFields frame{s.frame_length, s.frames, s.settle};
  v.field(frame, {"frame", "How time is divided."});
  v.field(s.step, {"step", "The stage that moves particles."});
  DetectFields detect{s.detect, s.detect_every};
  v.field(detect, {"detect", "The stage that decides which particles are removed."});
  v.field(s.split, {"split", "The stage that takes clusters apart."});
  v.field(s.merge, {"merge", "The stage that joins small clusters."});
  v.field(s.expand, {"expand", "The stage that keeps connected tissue coupled."});
  v.field(s.skin, {"skin", "The stage that makes the visible surface."});
  v.field(s.blade, {"blade", "The blade and its path. Absent: nothing is cut by a blade."});
  std::optional<Ground> ground;
  v.field(ground, {"ground", "The wall on which tissue lies: short for a wall with axis 2 and side +1."});
  v.field(s.walls, {"walls", "Half-spaces that tissue cannot enter.", {}, kOptional, kMostWalls});
  if (ground) s.walls.insert(s.walls.begin(), {2, +1, ground->offset, ground->friction});
  v.field(s.grips, {"grips", "Regions that are held, and moved.", {}, kOptional, kMostGrips});
  v.field(s.expect, {"expect", "What `cutproof run --check` enforces; what is absent is not enforced."});
}

}  // namespace cutproof::io
