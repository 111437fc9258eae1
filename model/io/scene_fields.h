// The table of all fields of a scene: name, unit, bounds and meaning, once. A visitor that goes through it reads,
// writes or documents a scene (scene_reader.cpp, scene_writer.cpp). Defaults are those of the structs in model/scene.h
// and model/setup.h.
//
// A visitor has
//   field(const Field&, T&)      T: bool, a number, std::string, Vec3, Range, an enumeration, a struct described here,
//                                or a std::optional or std::vector of one of these
//   group(const Field&, f)       an object of its own in the file whose fields f(visitor) describes
//   applies(condition)           whether fields that make sense only under `condition` are to be visited
#pragma once
#include <array>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include "model/rules.h"
#include "model/scene.h"

namespace cutproof::io {

struct Bounds {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool open_low = false, open_high = false;  // the bound itself is not allowed

  bool contains(double x) const {
    return (open_low ? x > low : x >= low) && (open_high ? x < high : x <= high);  // false for NaN
  }
};
constexpr Bounds between(double low, double high) { return {low, high, false, false}; }
constexpr Bounds inside(double low, double high) { return {low, high, true, true}; }
constexpr Bounds above(double low, double high) { return {low, high, true, false}; }

struct Field {
  std::string_view name;
  std::string_view unit = "";  // empty: a pure number, or no number
  Bounds bounds = {};          // of a number, of each component of a vector, of each entry of a list
  bool required = false;
  bool zero_is_absent = false;  // zero stands for "not given": neither written nor accepted
  std::string_view doc;
};

// --- Words that stand for enumerators ------------------------------------------------------------------------------
template <class E>
using Words = std::pair<E, std::string_view>;

inline constexpr auto words(Shape::Kind) {
  using enum Shape::Kind;
  return std::array<Words<Shape::Kind>, 6>{{{box, "box"},
                                            {ball, "ball"},
                                            {kidney, "kidney"},
                                            {liver, "liver"},
                                            {union_of, "union"},
                                            {difference, "difference"}}};
}
inline constexpr auto words(Cooking) {
  return std::array<Words<Cooking>, 2>{{{Cooking::boxes, "boxes"}, {Cooking::sampled, "sampled"}}};
}
inline constexpr auto words(Curve) { return std::array<Words<Curve>, 2>{{{Curve::line, "line"}, {Curve::arc, "arc"}}}; }

// Choices that setups have too are named in model/rules.h.
template <NamedChoice E>
std::vector<Words<E>> words(E choice) {
  std::vector<Words<E>> words;
  for (const std::string_view name : names_of(choice)) words.emplace_back(static_cast<E>(words.size()), name);
  return words;
}

// --- The fields ----------------------------------------------------------------------------------------------------
inline constexpr double kLongest = 1e6;  // of any length [m] and coordinate
inline constexpr double kMany = 1e9;     // of any count
inline constexpr double kFriction = 1e6;

// The ground is a wall that everybody knows by name.
struct Ground {
  double offset = 0;
  double friction = 0;
};

template <class Visitor>
void describe(Visitor& v, Shape& s) {
  using enum Shape::Kind;
  v.field({.name = "kind",
           .required = true,
           .doc = "`box`, `ball`; `kidney`, `liver`: organs made in code; `union`: all `parts` together; `difference`: "
                  "the first of `parts` without the others."},
          s.kind);
  const bool made_of_parts = s.kind == union_of || s.kind == difference;
  if (v.applies(!made_of_parts)) {
    v.field({.name = "center",
             .unit = "m",
             .bounds = between(-kLongest, kLongest),
             .doc = "Middle of the shape. Not for `union` and `difference`."},
            s.center);
  }
  if (v.applies(!made_of_parts && s.kind != ball)) {
    v.field({.name = "size",
             .unit = "m",
             .bounds = above(0, kLongest),
             .doc = "Extents of the bounding box along x, y, z. Only for `box`, `kidney` and `liver`."},
            s.size);
  }
  if (v.applies(s.kind == ball)) {
    v.field({.name = "radius", .unit = "m", .bounds = above(0, kLongest), .doc = "Only for `ball`."}, s.radius);
  }
  if (v.applies(made_of_parts)) {
    v.field({.name = "parts", .doc = "Further shapes. Only for `union` and `difference`; at least one."}, s.parts);
  }
}

template <class Visitor>
void describe(Visitor& v, MeshSpec& s) {
  v.field({.name = "file",
           .required = true,
           .doc = "STL, OBJ, PLY or OFF file of a closed surface, relative to the folder of the scene's file."},
          s.file);
  v.field({.name = "unit",
           .unit = "m",
           .bounds = above(0, kLongest),
           .required = true,
           .doc = "Metres per unit of the numbers in the mesh's file: 0.001 if they are millimetres."},
          s.unit);
}

template <class Visitor>
void describe(Visitor& v, BodySpec& s) {
  v.field({.name = "shape", .doc = "An implicit shape. Exactly one of `shape` and `mesh` must be given."}, s.shape);
  v.field({.name = "mesh", .doc = "A closed surface mesh. Exactly one of `shape` and `mesh` must be given."}, s.mesh);
  v.field({.name = "spacing",
           .unit = "m",
           .bounds = above(0, kLongest),
           .zero_is_absent = true,
           .doc = "h, spacing of the background grid. Exactly one of `spacing` and `particles` must be given."},
          s.spacing);
  v.field({.name = "particles",
           .bounds = between(1, kMany),
           .zero_is_absent = true,
           .doc = "Wanted number of particles; the spacing that gives it within 2 % is looked for. Exactly one of "
                  "`spacing` and `particles` must be given."},
          s.particles);
  v.field({.name = "density",
           .unit = "kg/m³",
           .bounds = above(0, 1e9),
           .doc = "Mass per volume: each particle weighs density · h³."},
          s.density);
  v.field({.name = "align",
           .doc = "Turn the principal axes of a mesh (longest, middle, shortest) to x, y, z before anything else. "
                  "Implicit shapes stay as their numbers put them."},
          s.align);
  v.field({.name = "origin",
           .unit = "m",
           .bounds = between(-1e12, 1e12),
           .doc = "Where the body's frame lies in the world. No computation depends on it."},
          s.origin);
}

template <class Visitor>
void describe(Visitor& v, ClusterSpec& s) {
  v.field({.name = "method",
           .doc = "`boxes`: cores that tile the grid, grown by one node, so that every edge is covered; `sampled`: "
                  "greedy balls around seeds in random order (method.md §2)."},
          s.method);
  v.field({.name = "side", .unit = "nodes", .bounds = between(1, 1000), .doc = "`boxes`: nodes per side of a core."},
          s.side);
  v.field({.name = "spacing",
           .unit = "h",
           .bounds = above(0, 1e4),
           .doc = "`sampled`: least distance of a new seed from what is covered."},
          s.spacing);
  v.field({.name = "radius", .unit = "h", .bounds = above(0, 1e4), .doc = "`sampled`: radius of the balls."}, s.radius);
  v.field({.name = "small",
           .bounds = between(0, 1000),
           .doc = "A cluster is small, and may merge, below this multiple of the median size at cooking."},
          s.small);
  v.field({.name = "cap",
           .bounds = between(1, 1000),
           .doc = "Merging makes no cluster above this multiple of the largest size at cooking."},
          s.cap);
}

template <class Visitor>
void describe(Visitor& v, StepParameters& s) {
  v.field({.name = "solver",
           .doc = "`implicit`: minimises one energy, so it has a converged answer; `published`: the paper's "
                  "position-based dynamics (method.md §3)."},
          s.solver);
  v.field({.name = "substeps", .bounds = between(1, 100000), .doc = "Substeps per frame."}, s.substeps);
  v.field({.name = "iterations", .bounds = between(0, 1e6), .doc = "K, solver iterations per substep."}, s.iterations);
  v.field({.name = "stiffness",
           .unit = "1/s²",
           .bounds = between(0, 1e15),
           .doc = "k, stiffness per mass. `implicit` only: s = k dt² / (1 + k dt²)."},
          s.stiffness);
  v.field({.name = "relaxation", .bounds = above(0, 1), .doc = "s, `published` only."}, s.relaxation);
  v.field({.name = "acceleration",
           .doc = "`implicit` only. `chebyshev`: the same answer in fewer iterations, each of which costs a little "
                  "more; the energy need not fall in every one (method.md §11)."},
          s.acceleration);
  v.field({.name = "damping", .unit = "1/s", .bounds = between(0, 1e9), .doc = "c: velocities decay as exp(−c t)."},
          s.damping);
  v.field({.name = "gravity", .unit = "m/s²", .bounds = between(-1e6, 1e6), .doc = "In the body's frame."}, s.gravity);
}

template <class Visitor>
void describe(Visitor& v, DetectParameters& s) {
  v.field({.name = "criterion",
           .doc = "What removes a particle. `distance`: a neighbour farther than epsilon · h; `geometric`: the swept "
                  "blade comes within max(thickness, h)/2 of its node; `strain`: a cluster's principal stretch; "
                  "`none`: nothing is ever removed (method.md §4)."},
          s.criterion);
  v.field({.name = "epsilon",
           .unit = "h",
           .bounds = above(0, 1e6),
           .doc = "Distance from a neighbour beyond which a particle is removed. At 1 or less, tissue at rest is."},
          s.epsilon);
  v.field({.name = "strain",
           .bounds = above(0, 1e6),
           .doc = "`strain` only: greatest principal stretch that is not yet a cut."},
          s.strain);
  v.field({.name = "without_blade", .doc = "Whether a scene without a blade launches detection too."}, s.without_blade);
}

template <class Visitor>
void describe(Visitor& v, SplitParameters& s) {
  v.field({.name = "debris",
           .unit = "particles",
           .bounds = between(0, kMany),
           .doc = "Pieces of tissue with fewer particles are removed, and counted; 0 keeps all."},
          s.debris);
}

template <class Visitor>
void describe(Visitor& v, MergeParameters& s) {
  v.field({.name = "rule", .doc = "How small clusters join their neighbours (method.md §6)."}, s.rule);
}

template <class Visitor>
void describe(Visitor& v, ExpandParameters& s) {
  v.field({.name = "rule", .doc = "How clusters that lost touch take in neighbours (method.md §7)."}, s.rule);
  v.field({.name = "depth", .unit = "layers", .bounds = between(1, 1000), .doc = "Layers of particles taken in."},
          s.depth);
}

template <class Visitor>
void describe(Visitor& v, SkinParameters& s) {
  v.field({.name = "wanted", .doc = "Whether a skin is made at all."}, s.wanted);
  v.field(
      {.name = "alpha", .unit = "h", .bounds = inside(0, 1), .doc = "How far beyond its particle a skin vertex lies."},
      s.alpha);
}

template <class Visitor>
void describe(Visitor& v, StrokeSpec& s) {
  v.field({.name = "curve",
           .doc = "`line`: the polyline through the points, at whose corners a blade that follows the path turns on "
                  "the spot; `arc`: the circle through three points, from the first over the second to the third."},
          s.curve);
  v.field({.name = "points",
           .unit = "box",
           .bounds = between(-1000, 1000),
           .required = true,
           .doc = "Where the middle of the cutting edge goes; at least two points, for an arc exactly three."},
          s.points);
  v.field({.name = "back",
           .bounds = between(-1e6, 1e6),
           .doc = "Direction from the cutting edge to the back of the blade, in the body's frame (metric, not box)."},
          s.back);
  v.field({.name = "along",
           .bounds = between(-1e6, 1e6),
           .doc = "Direction of the cutting edge (metric), made orthogonal to `back`. Absent: the path's tangent, "
                  "made orthogonal to `back`, so that the blade turns with its path. Needed when the blade is pressed "
                  "in along `back`."},
          s.along);
  v.field({.name = "pause",
           .unit = "s",
           .bounds = between(0, 1e6),
           .doc = "Time with the blade up before the next stroke, rounded up to whole frames."},
          s.pause);
}

template <class Visitor>
void describe(Visitor& v, BladeSpec& s) {
  v.field({.name = "length",
           .unit = "extents",
           .bounds = above(0, 1e6),
           .doc = "Length of the cutting edge, in extents of the bounding box along it at the start of the first "
                  "stroke."},
          s.length);
  v.field({.name = "depth",
           .unit = "extents",
           .bounds = above(0, 1e6),
           .doc = "From the cutting edge to the back, in extents of the bounding box along the first stroke's `back`."},
          s.depth);
  v.field({.name = "thickness", .unit = "h", .bounds = between(0, 1e6), .doc = "Thickness of the plate."}, s.thickness);
  v.field({.name = "friction", .bounds = between(0, kFriction), .doc = "Coulomb coefficient of blade on tissue."},
          s.friction);
  v.field({.name = "speed",
           .unit = "m/s",
           .bounds = above(0, 1e9),
           .doc = "Of the middle of the cutting edge. It is lowered a little so that every straight piece takes whole "
                  "substeps and every stroke whole frames; turning on the spot, the ends of the edge move this fast."},
          s.speed);
  v.field({.name = "start",
           .unit = "s",
           .bounds = between(0, 1e6),
           .doc = "When the first stroke begins, rounded up to whole frames."},
          s.start);
  v.field({.name = "strokes", .required = true, .doc = "The path, stroke by stroke; at least one."}, s.strokes);
}

template <class Visitor>
void describe(Visitor& v, Ground& s) {
  v.field({.name = "offset", .unit = "box", .bounds = between(-1000, 1000), .doc = "Height: box coordinate along z."},
          s.offset);
  v.field({.name = "friction", .bounds = between(0, kFriction), .doc = "Coulomb coefficient."}, s.friction);
}

template <class Visitor>
void describe(Visitor& v, WallSpec& s) {
  v.field({.name = "axis", .bounds = between(0, 2), .doc = "The wall is orthogonal to this axis: 0 x, 1 y, 2 z."},
          s.axis);
  v.field({.name = "side", .bounds = between(-1, 1), .doc = "+1: tissue stays above the wall; −1: below it."}, s.side);
  v.field({.name = "offset", .unit = "box", .bounds = between(-1000, 1000), .doc = "Box coordinate along the axis."},
          s.offset);
  v.field({.name = "friction", .bounds = between(0, kFriction), .doc = "Coulomb coefficient."}, s.friction);
}

template <class Visitor>
void describe(Visitor& v, GripSpec& s) {
  v.field({.name = "low",
           .unit = "box",
           .bounds = between(-1000, 1000),
           .required = true,
           .doc = "Lower corner of the region whose particles, by rest position, are held."},
          s.low);
  v.field({.name = "high", .unit = "box", .bounds = between(-1000, 1000), .required = true, .doc = "Upper corner."},
          s.high);
  v.field({.name = "start", .unit = "s", .bounds = between(0, 1e6), .doc = "When holding begins."}, s.start);
  v.field({.name = "end", .unit = "s", .bounds = between(-1, 1e6), .doc = "When it ends; negative: with the scene."},
          s.end);
  v.field({.name = "after_strokes", .doc = "`start` and `end` count from the end of the last stroke."},
          s.after_strokes);
  v.field({.name = "velocity",
           .unit = "m/s",
           .bounds = between(-1e6, 1e6),
           .doc = "How the held particles move; zero: pinned where they are."},
          s.velocity);
}

template <class Visitor>
void describe(Visitor& v, Expectations& s) {
  constexpr Bounds kCount = between(0, 1e15);
  v.field({.name = "components_after_stroke",
           .bounds = kCount,
           .doc = "Connected components of the tissue graph at the end of each stroke, one entry per stroke."},
          s.components_after_stroke);
  v.field({.name = "components_at_end", .bounds = kCount, .doc = "Connected components when the scene ends."},
          s.components_at_end);
  v.field({.name = "shells_at_end", .bounds = kCount, .doc = "Outer shells of the skin when the scene ends."},
          s.shells_at_end);
  v.field({.name = "removed", .bounds = kCount, .doc = "Particles removed over the whole run."}, s.removed);
  v.field({.name = "isolated_clusters",
           .bounds = kCount,
           .doc = "Greatest number, in any frame, of groups of clusters isolated inside connected tissue."},
          s.isolated_clusters);
  v.field({.name = "cluster_growth",
           .bounds = between(-1, 1e9),
           .doc = "(Clusters at the end − at the start) / at the start."},
          s.cluster_growth);
  v.field({.name = "clusters", .bounds = kCount, .doc = "Clusters after cooking."}, s.clusters);
  v.field({.name = "particles", .bounds = kCount, .doc = "Particles of the body."}, s.particles);
  v.field({.name = "dent",
           .unit = "h",
           .bounds = between(0, 1e6),
           .doc = "Greatest depth of the surface's dent before the first removal."},
          s.dent);
  v.field({.name = "greatest_stretch",
           .unit = "h",
           .bounds = between(0, 1e9),
           .doc = "Greatest distance of two neighbours in any frame."},
          s.greatest_stretch);
}

template <class Visitor>
void describe(Visitor& v, Scene& s) {
  v.field({.name = "version", .bounds = between(1, 1), .required = true, .doc = "Of this format: 1."}, s.version);
  v.field({.name = "name", .doc = "A short name, for reports."}, s.name);
  v.field({.name = "description", .doc = "What the scene shows, for people."}, s.description);
  v.field({.name = "seed", .bounds = between(0, 18446744073709551615.0), .doc = "Of everything random."}, s.seed);
  v.field({.name = "body", .required = true, .doc = "What is cut."}, s.body);
  v.field({.name = "clusters", .doc = "How the body is covered with clusters."}, s.clusters);
  v.group({.name = "frame", .doc = "How time is divided."}, [&s](auto& frame) {
    frame.field({.name = "length",
                 .unit = "s",
                 .bounds = above(0, 1000),
                 .doc = "Of a frame. Frames in which the blade would be too fast are divided into equal shorter ones."},
                s.frame_length);
    frame.field({.name = "count",
                 .bounds = between(0, 1e5),
                 .doc = "Frames in all. 0: until the last stroke has ended and `settle` is over; without a blade, "
                        "until the last grip has ended and `settle` is over."},
                s.frames);
    frame.field({.name = "settle", .unit = "s", .bounds = between(0, 1e6), .doc = "Time after the last stroke."},
                s.settle);
  });
  v.field({.name = "step", .doc = "The stage that moves particles."}, s.step);
  v.field({.name = "detect", .doc = "The stage that decides which particles are removed."}, s.detect);
  v.field({.name = "split", .doc = "The stage that takes clusters apart."}, s.split);
  v.field({.name = "merge", .doc = "The stage that joins small clusters."}, s.merge);
  v.field({.name = "expand", .doc = "The stage that keeps connected tissue coupled."}, s.expand);
  v.field({.name = "skin", .doc = "The stage that makes the visible surface."}, s.skin);
  v.field({.name = "blade", .doc = "The blade and its path. Absent: nothing is cut by a blade."}, s.blade);
  std::optional<Ground> ground;
  v.field({.name = "ground", .doc = "The wall on which tissue lies: short for a wall with axis 2 and side +1."},
          ground);
  v.field({.name = "walls", .doc = "Half-spaces that tissue cannot enter."}, s.walls);
  if (ground) s.walls.insert(s.walls.begin(), {2, +1, ground->offset, ground->friction});
  v.field({.name = "grips", .doc = "Regions that are held, and moved."}, s.grips);
  v.field({.name = "expect", .doc = "What `cutproof run --check` enforces; what is absent is not enforced."}, s.expect);
}

}  // namespace cutproof::io
