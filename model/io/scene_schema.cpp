// Scenes as JSON Schema, from the table of fields that also reads and checks them.
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/io/scene_fields.h"
#include "model/io/scene_io.h"
#include "model/io/scene_text.h"

namespace cutproof::io {
namespace {

using nlohmann::ordered_json;

ordered_json number_json(double x) {
  constexpr double kExact = 1e15;
  if (std::abs(x) < kExact && x == std::floor(x)) return static_cast<int64_t>(x);
  return x;
}

void add_bounds(ordered_json& schema, const Bounds& b) {
  if (std::isfinite(b.low)) schema[b.open_low ? "exclusiveMinimum" : "minimum"] = number_json(b.low);
  if (std::isfinite(b.high)) schema[b.open_high ? "exclusiveMaximum" : "maximum"] = number_json(b.high);
}

ordered_json number_schema(const char* type, const SceneField& f) {
  ordered_json schema = {{"type", type}};
  add_bounds(schema, f.bounds);
  return schema;
}

// --- What no single field can say; in the reader the checks of the same objects -------------------------------------

ordered_json field_is(const char* name, const ordered_json& what) {
  return {{"properties", {{name, what}}}, {"required", {name}}};
}

ordered_json exactly_one(const char* a, const char* b) {
  return {{"oneOf", {{{"required", {a}}}, {{"required", {b}}}}}};
}

template <class T>
void add_conditions(const T&, ordered_json&) {}

void add_conditions(const BodySpec&, ordered_json& schema) {
  schema["allOf"] = {exactly_one("shape", "mesh"), exactly_one("spacing", "particles")};
}
void add_conditions(const MeshSpec&, ordered_json& schema) { schema["properties"]["file"]["minLength"] = 1; }
void add_conditions(const StepParameters&, ordered_json& schema) {
  schema["if"] = field_is("solver", {{"const", name_of(Solver::published)}});
  schema["then"]["properties"] = {{"acceleration", {{"const", name_of(Acceleration::none)}}},
                                  {"retardation", {{"const", 0}}},
                                  {"volume_share", {{"const", 0}}}};
}
void add_conditions(const Scene&, ordered_json& schema) {
  schema["if"]["required"] = {"material"};
  ordered_json& excluded = schema["then"]["properties"];
  excluded["body"]["properties"]["density"] = false;
  excluded["step"]["properties"] = {{"stiffness", false}, {"volume_share", false}};
  excluded["step"]["properties"]["solver"]["const"] = name_of(Solver::implicit);
}
void add_conditions(const DetectFields&, ordered_json& schema) {
  schema["if"] = field_is("criterion", {{"not", {{"const", name_of(Criterion::distance)}}}});
  schema["then"]["properties"] = {{"remove", {{"const", name_of(RemovedEnds::both)}}}};
}
void add_conditions(const StrokeSpec&, ordered_json& schema) {
  schema["properties"]["points"]["minItems"] = 2;
  schema["if"] = field_is("curve", {{"const", name_of(Curve::arc)}});
  schema["then"]["properties"] = {{"points", {{"minItems", 3}, {"maxItems", 3}}}};
}
void add_conditions(const BladeSpec&, ordered_json& schema) { schema["properties"]["strokes"]["minItems"] = 1; }
void add_conditions(const WallSpec&, ordered_json& schema) { schema["properties"]["side"]["not"]["const"] = 0; }
void add_conditions(const Shape& shape, ordered_json& schema) {
  if (shape.kind != Shape::Kind::union_of && shape.kind != Shape::Kind::difference) return;
  schema["properties"]["parts"]["minItems"] = 1;
  schema["required"].push_back("parts");
}

// --- Fields ---------------------------------------------------------------------------------------------------------

constexpr const char* kShape = "shape";  // shapes contain shapes, so theirs has a name

template <class T>
ordered_json schema_of(T& value, const SceneField& f);

// The schema of one object.
class Schemer {
 public:
  template <class T>
  void field(T& value, const SceneField& f) {
    const std::string name(f.name);
    ordered_json text = ordered_json::object();
    const std::string unit = f.bounds.unit.empty() ? "" : fmt::format(" [{}]", f.bounds.unit);
    text["description"] = std::string(f.doc) + unit;
    if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
      if (f.presence == kOptional) text["default"] = value;
    } else if constexpr (std::is_enum_v<T>) {
      if (f.presence == kOptional) text["default"] = name_of(value);
    } else if constexpr (std::is_same_v<T, Vec3>) {
      if (f.presence == kOptional) text["default"] = {value.x, value.y, value.z};
    }
    text.update(schema_of(value, f));
    schema_["properties"][name] = std::move(text);
    if (f.presence == kRequired) schema_["required"].push_back(name);
  }
  bool applies(bool condition) const { return condition; }

  template <class T>
  ordered_json of(T& object) {
    schema_ = {{"type", "object"}, {"additionalProperties", false}};
    describe(*this, object);
    add_conditions(object, schema_);
    return std::move(schema_);
  }

 private:
  ordered_json schema_;
};

template <class T>
ordered_json schema_of(T& value, const SceneField& f) {
  if constexpr (is_optional<T>) {
    return schema_of(value.emplace(), f);
  } else if constexpr (is_vector<T>) {
    ordered_json schema = {{"type", "array"}, {"maxItems", f.most}};
    typename T::value_type entry{};
    schema["items"] = schema_of(entry, f);
    return schema;
  } else if constexpr (std::is_same_v<T, Shape>) {
    return {{"$ref", std::string("#/definitions/") + kShape}};
  } else if constexpr (std::is_same_v<T, Vec3>) {
    return {{"type", "array"}, {"minItems", 3}, {"maxItems", 3}, {"items", number_schema("number", f)}};
  } else if constexpr (std::is_same_v<T, cutproof::Range>) {
    const ordered_json number = number_schema("number", f);
    ordered_json range = {{"type", "object"}, {"minProperties", 1}, {"additionalProperties", false}};
    range["properties"] = {{"at_least", number}, {"at_most", number}};
    return {{"anyOf", {number, range}}};
  } else if constexpr (std::is_enum_v<T>) {
    return {{"enum", names_of(value)}};
  } else if constexpr (std::is_same_v<T, bool>) {
    return {{"type", "boolean"}};
  } else if constexpr (std::is_same_v<T, std::string>) {
    return {{"type", "string"}, {"maxLength", f.most}, {"pattern", "^[^\\u0000]*$"}};
  } else if constexpr (has_fields<T>) {
    return Schemer().of(value);
  } else {
    return number_schema(is_integer<T> ? "integer" : "number", f);
  }
}

// Of a shape each kind has fields of its own.
ordered_json schema_of_shapes() {
  ordered_json schema = {{"type", "object"}, {"required", {"kind"}}};
  ordered_json kinds = ordered_json::array();
  for (std::size_t k = 0; k < kShapeNames.size(); ++k) {
    Shape shape;
    shape.kind = static_cast<Shape::Kind>(k);
    ordered_json fields = Schemer().of(shape);
    schema["properties"]["kind"] = fields["properties"]["kind"];
    fields["properties"]["kind"] = {{"const", kShapeNames[k]}};
    kinds.push_back({{"if", field_is("kind", {{"const", kShapeNames[k]}})}, {"then", std::move(fields)}});
  }
  schema["allOf"] = std::move(kinds);
  return schema;
}

}  // namespace

std::string scene_schema() {
  Scene scene;
  ordered_json schema = {{"$schema", "http://json-schema.org/draft-07/schema#"},
                         {"title", "A scene of cutproof"},
                         {"description",
                          "Fields, bounds and defaults, for editors; `cutproof info --schema` prints this schema. The "
                          "reader of scenes checks more, such as that two walls leave room."}};
  schema.update(Schemer().of(scene));
  schema["definitions"][kShape] = schema_of_shapes();
  return schema.dump(1) + "\n";
}

}  // namespace cutproof::io
