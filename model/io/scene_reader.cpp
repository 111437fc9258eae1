#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/error.h"
#include "model/io/input_file.h"
#include "model/io/json_reader.h"
#include "model/io/scene_changes.h"
#include "model/io/scene_fields.h"
#include "model/io/scene_io.h"
#include "model/io/scene_text.h"
#include "model/nearest_word.h"

namespace cutproof::io {
namespace {

using nlohmann::json;

constexpr const char* kWhatASceneIs = "A scene is a JSON object; docs/reference/scene.md lists its fields.";

std::string bounds_text(const Bounds& b) {
  const bool low = std::isfinite(b.low), high = std::isfinite(b.high);
  std::string text;
  if (low) text = fmt::format("{} {}", b.open_low ? "greater than" : "at least", number_text(b.low));
  if (high) {
    if (low) text += " and ";
    text += fmt::format("{} {}", b.open_high ? "less than" : "at most", number_text(b.high));
  }
  if (!b.unit.empty() && !text.empty()) text += fmt::format(" [{}]", b.unit);
  return text;
}

// --- Reading ---------------------------------------------------------------------------------------------------------

std::string type_text(const json& value) {
  if (value.is_null()) return "null";
  if (value.is_boolean()) return value.get<bool>() ? "true" : "false";
  if (value.is_number()) return "the number " + value.dump();
  if (value.is_string()) {
    const auto text = value.get<std::string>();
    return text.size() > 40 ? "a text" : fmt::format("the text \"{}\"", text);
  }
  return value.is_array() ? "a list" : "an object";
}

// Where a value stands: in which file, under which path.
struct Place {
  std::string file;
  std::string path;
  const std::vector<SceneChange>& changes;

  Place inner(std::string_view name) const { return {file, join(path, name), changes}; }
  Place entry(std::size_t index) const { return {file, fmt::format("{}[{}]", path, index), changes}; }
  [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const {
    throw InputError(source_of_field(path, file, changes), path, problem, remedy);
  }
};

// `needed` begins a sentence; `is_given`: whether this is it.
void require(bool is_given, const std::string& needed, const json& value, const Place& at, const std::string& remedy) {
  if (!is_given) at.fail(fmt::format("{} is needed, and this is {}.", needed, type_text(value)), remedy);
}

void require_bounds(double value, const std::string& text, const SceneField& field, const Place& at) {
  if (field.bounds.contains(value)) return;
  at.fail(fmt::format("The value {} is out of bounds.", text),
          fmt::format("Give a number {}.", bounds_text(field.bounds)));
}

template <class T>
requires std::is_floating_point_v<T>
void read(const json& value, const Place& at, const SceneField& field, T& out) {
  require(value.is_number(), "A number", value, at, "Give a number without quotation marks.");
  const double number = value.get<double>();
  require_bounds(number, value.dump(), field, at);
  out = number;
}

template <class T>
requires is_integer<T>
void read(const json& value, const Place& at, const SceneField& field, T& out) {
  // 1e5 and 5.0 are whole numbers too, although JSON's grammar does not call them integers.
  const bool whole =
      value.is_number_integer() || (value.is_number_float() && std::floor(value.get<double>()) == value.get<double>());
  require(whole, "A whole number", value, at, "Give a whole number without quotation marks.");
  const double approximate = value.get<double>();
  require_bounds(approximate, value.dump(), field, at);
  // 2^53: beyond it a number written with a fraction or an exponent is not exact.
  if (!value.is_number_integer() && std::abs(approximate) > 9007199254740992.0) {
    at.fail(fmt::format("The whole number {} is too large to be exact in this notation.", value.dump()),
            "Write it with digits only.");
  }
  out = value.is_number_integer() ? value.get<T>() : static_cast<T>(approximate);
}

void read(const json& value, const Place& at, const SceneField&, bool& out) {
  require(value.is_boolean(), "true or false", value, at, "Write true or false without quotation marks.");
  out = value.get<bool>();
}

void read(const json& value, const Place& at, const SceneField& field, std::string& out) {
  require(value.is_string(), "A text", value, at, "Put it in quotation marks.");
  const auto& text = value.get_ref<const std::string&>();
  if (text.size() > field.most) {
    at.fail(fmt::format("The text has {} bytes, more than {}.", text.size(), field.most), "Write a shorter one.");
  }
  if (text.find('\0') != std::string::npos) at.fail("The text contains a NUL character.", "Leave the character out.");
  out = text;
}

void read(const json& value, const Place& at, const SceneField& field, Vec3& out) {
  if (!value.is_array() || value.size() != 3) {
    at.fail(fmt::format("A vector is needed, and this is {}{}.", type_text(value),
                        value.is_array() ? fmt::format(" of {} entries", value.size()) : ""),
            "Give three numbers: [x, y, z].");
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    read(value[axis], at.entry(axis), field, out[static_cast<int>(axis)]);
  }
}

void read(const json& value, const Place& at, const SceneField& field, Range& out) {
  if (value.is_number()) {
    read(value, at, field, out.low);
    out.high = out.low;
    return;
  }
  const char* remedy = "Give a number, or {\"at_least\": a}, {\"at_most\": b}, or both.";
  if (!value.is_object() || value.empty()) {
    at.fail(fmt::format("A range is needed, and this is {}.", value.is_object() ? "an empty object" : type_text(value)),
            remedy);
  }
  out = {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  for (const auto& [key, bound] : value.items()) {
    if (key != "at_least" && key != "at_most") at.inner(key).fail("This field is not known.", remedy);
    read(bound, at.inner(key), field, key == "at_least" ? out.low : out.high);
  }
  if (out.low > out.high) {
    at.fail(fmt::format("at_least {} is greater than at_most {}.", out.low, out.high), "Exchange the two.");
  }
}

template <NamedChoice E>
void read(const json& value, const Place& at, const SceneField&, E& out) {
  const auto choice = value.is_string() ? choice_named<E>(value.get<std::string>()) : std::nullopt;
  if (!choice) {
    at.fail(fmt::format("{} is not one of the known words.", type_text(value)),
            fmt::format("Give one of {}.", all_names<E>("\"")));
  }
  out = *choice;
}

// Structs with fields, lists and optional values refer to each other.
template <class T>
requires std::is_class_v<T>
void read(const json& value, const Place& at, const SceneField& field, T& out);

template <class T>
void read(const json& value, const Place& at, const SceneField& field, std::optional<T>& out) {
  read(value, at, field, out.emplace());
}

template <class T>
void read(const json& value, const Place& at, const SceneField& field, std::vector<T>& out) {
  require(value.is_array(), "A list", value, at, "Put the entries in square brackets.");
  if (value.size() > field.most) {
    at.fail(fmt::format("The list has {} entries, more than {}.", value.size(), field.most),
            "Leave some out, or make several scenes.");
  }
  out.clear();
  for (std::size_t i = 0; i < value.size(); ++i) read(value[i], at.entry(i), field, out.emplace_back());
}

// --- What no single field can say: conditions between the fields of one object -----------------------------------
template <class T>
void check(const T&, const Place&) {}

void check(const Shape& s, const Place& at) {
  if ((s.kind == Shape::Kind::union_of || s.kind == Shape::Kind::difference) && s.parts.empty()) {
    at.inner("parts").fail("The list of parts is empty or missing.", "Give at least one shape.");
  }
  if (!(norm(s.along) > 1e-150)) {  // its square is a normal number
    at.inner("along").fail("This is not a direction: its length is zero.",
                           "Give the direction of the axis: [0, 0, 1].");
  }
  if (s.kind == Shape::Kind::torus && s.tube >= s.radius) {
    at.inner("tube").fail(fmt::format("A tube of radius {} closes the hole of a torus of radius {}.", s.tube, s.radius),
                          "Give a tube less than the radius, or choose another \"kind\".");
  }
}

std::size_t shapes_in(const Shape& shape) {
  std::size_t count = 1;
  for (const Shape& part : shape.parts) count += shapes_in(part);
  return count;
}

void check(const BodySpec& s, const Place& at) {
  if (s.shape && shapes_in(*s.shape) > kMostShapes) {
    at.inner("shape").fail(fmt::format("There are {} shapes in it, more than {}.", shapes_in(*s.shape), kMostShapes),
                           "Use fewer shapes, or give the body as a mesh.");
  }
  if (s.shape.has_value() == s.mesh.has_value()) {
    at.fail(s.shape ? "Both shape and mesh are given." : "Neither shape nor mesh is given.",
            "Give exactly one of \"shape\" and \"mesh\".");
  }
  if ((s.spacing > 0) == (s.particles > 0)) {
    at.fail(s.spacing > 0 ? "Both spacing and particles are given." : "Neither spacing nor particles is given.",
            "Give exactly one of \"spacing\" [m] and \"particles\".");
  }
}

void check(const MeshSpec& s, const Place& at) {
  if (s.file.empty()) at.inner("file").fail("The file's name is empty.", "Name a mesh file.");
}

void check(const StepParameters& s, const Place& at) {
  if (s.solver == Solver::published && s.acceleration != Acceleration::none) {
    at.inner("acceleration")
        .fail("The solver \"published\" has no acceleration.",
              "Choose \"solver\": \"implicit\", or \"acceleration\": \"none\".");
  }
  if (s.solver == Solver::published && s.retardation != 0) {
    at.inner("retardation")
        .fail("The solver \"published\" has no elastic modulus, and so no viscosity.",
              "Choose \"solver\": \"implicit\", or leave \"retardation\" out.");
  }
  if (s.solver == Solver::published && s.volume_share != 0) {
    at.inner("volume_share")
        .fail("The solver \"published\" has no elastic modulus, and so no share of it.",
              "Choose \"solver\": \"implicit\", or leave \"volume_share\" out.");
  }
}

void check(const DetectFields& s, const Place& at) {
  if (s.parameters.criterion != Criterion::distance && s.parameters.remove != RemovedEnds::both) {
    at.inner("remove").fail(
        fmt::format("The criterion \"{}\" judges particles, not edges, so \"remove\" has no choice of ends.",
                    name_of(s.parameters.criterion)),
        "Choose \"criterion\": \"distance\", or \"remove\": \"both\".");
  }
}

void check(const StrokeSpec& s, const Place& at) {
  const Place points = at.inner("points");
  if (s.points.size() < 2) {
    points.fail(fmt::format("The blade's path is empty: this stroke has {} point{}.", s.points.size(),
                            s.points.size() == 1 ? "" : "s"),
                "Give at least two points.");
  }
  if (s.curve == Curve::arc && s.points.size() != 3) {
    points.fail(fmt::format("An arc needs three points, and {} are given.", s.points.size()),
                "Give a first point, one on the way, and a last one; or choose \"curve\": \"line\".");
  }
  const bool still =
      std::all_of(s.points.begin(), s.points.end(), [&s](const Vec3& p) { return p == s.points.front(); });
  if (still && s.points.size() > 2) {
    points.fail("The blade's path is empty: all points of this stroke are the same.",
                "Give points that differ. (A stroke that stands still on purpose has two equal points.)");
  }
}

void check(const BladeSpec& s, const Place& at) {
  if (s.strokes.empty()) {
    at.inner("strokes").fail("The blade's path is empty: there is no stroke.",
                             "Give at least one stroke with two points, or leave out \"blade\".");
  }
}

void check(const WallSpec& s, const Place& at) {
  if (s.side == 0) at.inner("side").fail("The value 0 is out of bounds.", "Give 1 or -1.");
}

void check(const Scene& s, const Place& at) {
  for (std::size_t a = 0; a < s.walls.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const WallSpec &one = s.walls[a], &other = s.walls[b];
      if (one.axis != other.axis || one.side == other.side || one.side * (other.offset - one.offset) > 0) continue;
      at.inner("walls").fail(
          fmt::format("Two walls across {} leave no room: from {} upwards and from {} downwards.", "xyz"[one.axis],
                      (one.side > 0 ? one : other).offset, (one.side > 0 ? other : one).offset),
          "Move them apart (\"ground\" is a wall from its offset upwards along z).");
    }
  }
}

void check(const GripSpec& s, const Place& at) {
  for (int axis = 0; axis < 3; ++axis) {
    if (s.low[axis] > s.high[axis]) {
      at.inner("low").fail(fmt::format("The lower corner {} lies above the upper one {} along {}.", s.low[axis],
                                       s.high[axis], "xyz"[axis]),
                           "Exchange the two.");
    }
  }
  if (s.end >= 0 && s.end <= s.start) {
    at.inner("end").fail(fmt::format("The grip ends at {} s and starts at {} s.", s.end, s.start),
                         "Give an end after the start, or leave it out to hold until the scene ends.");
  }
}

// Reads the fields of one object.
class Reader {
 public:
  Reader(const json& object, Place at) : object_(object), at_(std::move(at)) {
    require(object.is_object(), "An object", object, at_, "Put its fields in braces: {\"name\": value, ...}.");
  }

  template <class T>
  void field(T& value, const SceneField& f) {
    known_.push_back(f.name);
    const auto found = object_.find(std::string(f.name));
    if (found != object_.end()) {
      read(*found, at_.inner(f.name), f, value);
    } else if (f.presence == kRequired) {
      missing_.push_back(f.name);
    }
  }

  bool applies(bool condition) const { return condition; }

  // Unknown fields come before missing ones: a misspelt field is both.
  void finish() const {
    for (const auto& [key, value] : object_.items()) {
      if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
      const std::string nearest = nearest_word(key, known_);
      at_.inner(key).fail(
          "This field is not known here.",
          fmt::format("{}Known fields: {}.", nearest.empty() ? "" : fmt::format("Did you mean \"{}\"? ", nearest),
                      fmt::join(known_, ", ")));
    }
    if (!missing_.empty()) at_.inner(missing_.front()).fail("This field is missing.", "It must be given.");
  }

 private:
  const json& object_;
  Place at_;
  std::vector<std::string_view> known_, missing_;
};

template <class T>
requires std::is_class_v<T>
void read(const json& value, const Place& at, const SceneField&, T& out) {
  Reader reader(value, at);
  describe(reader, out);
  reader.finish();
  check(out, at);
}

// A scene of another version has other fields, so this comes before anything else.
void require_version(const json& tree, const std::string& name) {
  if (!tree.is_object()) {
    throw InputError(name, "", fmt::format("A scene is an object, and this is {}.", type_text(tree)),
                     fmt::format("Put its fields in braces: {{\"version\": {}, \"body\": ...}}.", kSceneVersion));
  }
  const auto version = tree.find("version");
  if (version == tree.end()) {
    throw InputError(name, "version", "This field is missing.",
                     fmt::format("Add \"version\": {} if this is a cutproof scene.", kSceneVersion));
  }
  if (version->is_number() && version->get<double>() == kSceneVersion) return;
  throw InputError(
      name, "version", fmt::format("This is {}, and only version {} is read.", type_text(*version), kSceneVersion),
      fmt::format("Write \"version\": {}, with the fields that `cutproof info --scene` lists.", kSceneVersion));
}

// Of a scene that does not say.
Acceleration default_acceleration(const json& tree) {
  const auto step = tree.find("step");
  const bool published = step != tree.end() && step->is_object() && step->contains("solver") &&
                         step->at("solver") == name_of(Solver::published);
  return published ? Acceleration::none : Acceleration::chebyshev;
}

RemovedEnds default_remove(const json& tree) {
  const auto detect = tree.find("detect");
  const bool by_distance = detect == tree.end() || !detect->is_object() || !detect->contains("criterion") ||
                           detect->at("criterion") == name_of(Criterion::distance);
  return by_distance ? RemovedEnds::nearer : RemovedEnds::both;
}

// What follows from a material is not given beside it.
void check_material(const json& tree, const Place& at, Scene& scene) {
  if (!scene.material) return;
  for (const auto& [group, name] : {std::pair{"body", "density"}, {"step", "stiffness"}, {"step", "volume_share"}}) {
    const auto found = tree.find(group);
    if (found == tree.end() || !found->contains(name)) continue;
    at.inner(group).inner(name).fail("The scene has a \"material\", from which this follows.",
                                     "Leave out this field, or \"material\".");
  }
  if (scene.step.solver == Solver::published) {
    at.inner("material")
        .fail("The solver \"published\" has no elastic modulus.",
              "Choose \"solver\": \"implicit\", or leave \"material\" out.");
  }
  scene.body.density = scene.material->density;
}

}  // namespace

Scene parse_scene(const std::string& text, const std::string& name, const std::vector<SceneChange>& changes) {
  json tree = parse_json(text, name, kSceneLimits, kWhatASceneIs);
  for (const SceneChange& change : changes) {
    if (tree.is_object()) make_change(change, tree);
  }
  require_version(tree, source_of_field("version", name, changes));
  Scene scene;
  scene.step.acceleration = default_acceleration(tree);
  scene.detect.remove = default_remove(tree);
  const Place at = {name, "", changes};
  read(tree, at, SceneField{}, scene);
  check_material(tree, at, scene);
  return scene;
}

Scene read_scene(const std::string& path, const std::vector<SceneChange>& changes) {
  return parse_scene(read_file(path, kSceneLimits), path, changes);
}

}  // namespace cutproof::io
