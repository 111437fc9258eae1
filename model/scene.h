// A scene as a person writes it: a body, parameters of the simulation, the path of a blade, and expectations. A scene
// depends on no resolution and runs on any organ. Field by field documentation with unit, default and bounds is
// generated from the reader: docs/reference/scene.md.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/setup.h"

namespace cutproof {

// A closed implicit shape, or a tree of them. Lengths in metres, in the shape's own frame.
struct Shape {
  enum class Kind { box, ball, cylinder, capsule, torus, kidney, liver, union_of, difference };
  Kind kind = Kind::box;
  Vec3 center;                  // of all but union and difference [m]
  Vec3 size = {0.1, 0.1, 0.1};  // box: side lengths; kidney, liver: extents of the bounding box [m]
  double radius = 0.05;         // ball, cylinder, capsule; torus: of the circle in the middle of its tube [m]
  double tube = 0.02;           // torus: radius of its tube, less than `radius` [m]
  double length = 0.1;          // cylinder: between its ends; capsule: between the centres of its caps [m]
  Vec3 along = {0, 0, 1};       // cylinder, capsule, torus: direction of the axis, of any length but zero
  std::vector<Shape> parts;     // union: all of them; difference: the first without the others
  friend bool operator==(const Shape&, const Shape&) = default;
};

// Greatest change of volume by repair, as a share of the greater of both volumes. For a ball of 100,000 particles, this
// change moves the surface by half a spacing.
inline constexpr double kMostRepairChange = 0.05;

struct MeshSpec {
  std::string file;                          // as written in the scene; relative to the scene's file
  double unit = 0;                           // metres per unit of the file's numbers: 1e-3 for mm. Must be given.
  bool repair = false;                       // repair a surface that bounds no solid
  double repair_change = kMostRepairChange;  // the mesh is refused if repair changes the volume by more; 1: never
  friend bool operator==(const MeshSpec&, const MeshSpec&) = default;
};

struct BodySpec {
  std::optional<Shape> shape;  // exactly one of shape and mesh
  std::optional<MeshSpec> mesh;
  double spacing = 0;     // h [m]; exactly one of spacing and particles is positive
  int64_t particles = 0;  // wanted count, met within 2 %
  double density = 1000;  // [kg/m³]; m_i = density · h³
  bool fit_skin = true;   // the skin lies where the surface crosses the grid edges, else alpha beyond each particle
  bool align = true;      // turn the principal axes (longest, middle, shortest) to x, y, z
  Vec3 origin;            // where the body's frame lies in the world [m]
  friend bool operator==(const BodySpec&, const BodySpec&) = default;
};

// An isotropic material. The body's density, and the step's stiffness and volume share, follow from it.
struct MaterialSpec {
  double youngs_modulus = 0;  // E [Pa], > 0
  double poisson_ratio = 0;   // ν
  double density = 0;         // [kg/m³], > 0
  friend bool operator==(const MaterialSpec&, const MaterialSpec&) = default;
};

enum class Cooking { boxes, sampled, tiles };
struct ClusterSpec {
  Cooking method = Cooking::boxes;
  int32_t side = 5;      // boxes: c, nodes per side of a core; tiles: edges per side
  double spacing = 3.0;  // sampled: distance within which a seed covers particles [h]
  double radius = 4.0;   // sampled: radius of the balls [h]
  double small = 0.5;    // tau = small · median size at cooking
  double cap = 1.4;      // cap = cap · largest size at cooking
  friend bool operator==(const ClusterSpec&, const ClusterSpec&) = default;
};

// Points of paths and regions are in box coordinates: (0,0,0) is the lower, (1,1,1) the upper corner of the bounding
// box of the body's particles (half a spacing beyond the outermost), after alignment. Points may lie outside.
enum class Curve { line, arc };  // line: polyline through the points; arc: the circle through three points
struct StrokeSpec {
  Curve curve = Curve::line;
  std::vector<Vec3> points;   // where the middle of the cutting edge goes; at least two, arc: exactly three
  Vec3 back = {0, 0, 1};      // from the cutting edge to the back of the blade (metric direction)
  std::optional<Vec3> along;  // direction of the cutting edge; absent: the path's tangent, turning with it
  double pause = 0;           // [s] with the blade up, before the next stroke
  friend bool operator==(const StrokeSpec&, const StrokeSpec&) = default;
};

struct BladeSpec {
  double length = 1.5;     // of the cutting edge, in extents of the bounding box along it
  double depth = 1.5;      // in extents of the bounding box along `back`
  double thickness = 1.0;  // [h]
  double friction = 0;
  double speed = 0.1;  // of the middle of the edge [m/s]
  double start = 0;    // time at which the first stroke begins [s]
  std::vector<StrokeSpec> strokes;
  friend bool operator==(const BladeSpec&, const BladeSpec&) = default;
};

struct WallSpec {
  int32_t axis = 2;
  int32_t side = +1;
  double offset = 0;  // box coordinate along the axis; the ground is axis 2, side +1, offset 0
  double friction = 0;
  friend bool operator==(const WallSpec&, const WallSpec&) = default;
};

struct GripSpec {
  Vec3 low, high;              // box of rest positions that is held, box coordinates
  double start = 0;            // [s]; negative is not allowed
  double end = -1;             // [s]; < 0: until the scene ends
  bool after_strokes = false;  // start and end count from the end of the last stroke
  Vec3 velocity;               // [m/s]; zero: pinned
  friend bool operator==(const GripSpec&, const GripSpec&) = default;
};

// Expectations that `cutproof run --check` enforces. Absent: not enforced.
struct Range {
  double low = 0, high = 0;  // both included
  friend bool operator==(const Range&, const Range&) = default;
};
struct Expectations {
  std::vector<int64_t> components_after_stroke;  // of G, one entry per stroke
  std::optional<int64_t> components_at_end;      // of G
  std::optional<int64_t> shells_at_end;          // outer shells of the skin
  std::optional<Range> removed;                  // particles, over the whole run
  std::optional<Range> isolated_clusters;        // greatest count of uncoupled cluster groups in any frame
  std::optional<Range> cluster_growth;           // (clusters at the end - at the start) / at the start
  std::optional<Range> clusters;                 // after cooking
  std::optional<Range> particles;                // of the body
  std::optional<Range> dent;                     // greatest depth of the surface dent before the first removal [h]
  std::optional<Range> greatest_stretch;         // greatest neighbour distance in any frame [h]
  friend bool operator==(const Expectations&, const Expectations&) = default;
};

// Version of the format: a reader refuses any other.
inline constexpr int32_t kSceneVersion = 5;

// How often detection runs. substep: each frame of S substeps is laid out as S frames of one substep, in all of which
// every stage runs. Removal then follows a cut within one substep, not within S.
enum class DetectEvery { frame, substep };

struct Scene {
  int32_t version = kSceneVersion;
  std::string name;
  std::string description;
  uint64_t seed = 1;
  BodySpec body;
  std::optional<MaterialSpec> material;  // in place of body.density, step.stiffness and step.volume_share
  ClusterSpec clusters;
  double frame_length = 0.016;  // [s]
  int64_t frames = 0;           // 0: until the last stroke ends and `settle` is over
  double settle = 0;            // [s] after the last stroke
  StepParameters step = {.acceleration = Acceleration::chebyshev};
  DetectParameters detect = {.remove = RemovedEnds::nearer};
  DetectEvery detect_every = DetectEvery::frame;
  SplitParameters split;
  MergeParameters merge;
  ExpandParameters expand;
  SkinParameters skin = {.fit_cuts = true};
  std::optional<BladeSpec> blade;
  std::vector<WallSpec> walls;
  std::vector<GripSpec> grips;
  Expectations expect;
  friend bool operator==(const Scene&, const Scene&) = default;
};

// Names in files, in the order of the enumerators; those of the other choices are in model/rules.h.
inline constexpr std::array<std::string_view, 9> kShapeNames = {"box",    "ball",  "cylinder", "capsule",   "torus",
                                                                "kidney", "liver", "union",    "difference"};
inline constexpr std::array<std::string_view, 3> kCookingNames = {"boxes", "sampled", "tiles"};
inline constexpr std::array<std::string_view, 2> kCurveNames = {"line", "arc"};
inline constexpr std::array<std::string_view, 2> kDetectEveryNames = {"frame", "substep"};

constexpr std::span<const std::string_view> names_of(Shape::Kind) { return kShapeNames; }
constexpr std::span<const std::string_view> names_of(Cooking) { return kCookingNames; }
constexpr std::span<const std::string_view> names_of(Curve) { return kCurveNames; }
constexpr std::span<const std::string_view> names_of(DetectEvery) { return kDetectEveryNames; }

}  // namespace cutproof
