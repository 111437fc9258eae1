// Writes a scene, and documents its fields.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/io/columns.h"
#include "model/io/json_reader.h"
#include "model/io/scene_fields.h"
#include "model/io/scene_io.h"
#include "model/io/scene_text.h"

namespace cutproof::io {
namespace {

using nlohmann::ordered_json;

// How far from the left a small array or object may reach on one line.
constexpr std::size_t kLineLength = 100;

template <class T>
ordered_json written(const T& value);

class Writer {
 public:
  template <class T>
  void field(const T& value, const SceneField& f) {
    const std::string name(f.name);
    if constexpr (is_optional<T>) {
      if (value) object[name] = written(*value);
    } else if constexpr (is_vector<T>) {
      if (!value.empty() || f.presence == kRequired) object[name] = written(value);
    } else {
      if constexpr (std::is_arithmetic_v<T>) {
        if (f.presence == kZeroIsAbsent && value == T{}) return;
      }
      object[name] = written(value);
    }
  }
  bool applies(bool condition) const { return condition; }

  ordered_json object = ordered_json::object();
};

template <class T>
ordered_json written(const T& value) {
  if constexpr (std::is_enum_v<T>) {
    return name_of(value);
  } else if constexpr (std::is_same_v<T, Vec3>) {
    return ordered_json::array({value.x, value.y, value.z});
  } else if constexpr (std::is_same_v<T, Range>) {
    if (value.low == value.high) return value.low;
    ordered_json range = ordered_json::object();
    if (std::isfinite(value.low)) range["at_least"] = value.low;
    if (std::isfinite(value.high)) range["at_most"] = value.high;
    return range;
  } else if constexpr (is_vector<T>) {
    ordered_json list = ordered_json::array();
    for (const auto& entry : value) list.push_back(written(entry));
    return list;
  } else if constexpr (has_fields<T>) {
    Writer writer;
    T copy = value;  // the table of fields is written for values that can be changed
    describe(writer, copy);
    return std::move(writer.object);
  } else {
    return value;
  }
}

std::string on_one_line(const ordered_json& value) {
  std::string text;
  if (value.is_object()) {
    for (const auto& [key, entry] : value.items()) {
      text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", ordered_json(key).dump(), on_one_line(entry));
    }
    return "{" + text + "}";
  }
  if (value.is_array()) {
    for (const auto& entry : value) text += (text.empty() ? "" : ", ") + on_one_line(entry);
    return "[" + text + "]";
  }
  return value.dump();
}

// Indented; short arrays and objects stay on one line.
std::string pretty(const ordered_json& value, std::size_t indent) {
  std::string line = on_one_line(value);
  const bool whole_scene = indent == 0;
  if (!value.is_structured() || value.empty() || (!whole_scene && indent + line.size() <= kLineLength)) return line;
  const std::string margin(indent + 2, ' ');
  std::string text;
  const bool is_object = value.is_object();
  for (const auto& [key, entry] : value.items()) {
    text += fmt::format("{}{}{}{}", text.empty() ? "\n" : ",\n", margin,
                        is_object ? ordered_json(key).dump() + ": " : "", pretty(entry, indent + 2));
  }
  return fmt::format("{}{}\n{}{}", is_object ? '{' : '[', text, std::string(indent, ' '), is_object ? '}' : ']');
}

// --- Documentation ---------------------------------------------------------------------------------------------------

template <class T>
std::string type_name() {
  if constexpr (is_optional<T>) {
    return type_name<typename T::value_type>();
  } else if constexpr (is_vector<T>) {
    return "list of " + type_name<typename T::value_type>();
  } else if constexpr (std::is_enum_v<T>) {
    return all_names<T>("`");
  } else if constexpr (std::is_same_v<T, Vec3>) {
    return "[x, y, z]";
  } else if constexpr (std::is_same_v<T, Range>) {
    return "range";
  } else if constexpr (std::is_same_v<T, bool>) {
    return "true or false";
  } else if constexpr (std::is_same_v<T, std::string>) {
    return "text";
  } else if constexpr (has_fields<T>) {
    return "object";
  } else {
    return is_integer<T> ? "whole number" : "number";
  }
}

std::string interval_text(const Bounds& b) {
  if (!std::isfinite(b.low) && !std::isfinite(b.high)) return "";
  return fmt::format("{}{}, {}{}", b.open_low ? "(" : "[", number_text(b.low), number_text(b.high),
                     b.open_high ? ")" : "]");
}

// The interval of a number, the greatest count of entries of a list or bytes of a text.
std::string limits_text(const SceneField& f, bool is_list) {
  const std::string interval = interval_text(f.bounds), in = interval.empty() ? "" : ", in " + interval;
  if (f.most == 0) return in;
  return fmt::format("{}, at most {} {}", in, f.most, is_list ? "entries" : "bytes");
}

// The section of one object, followed by those of the objects in it.
template <class T>
std::string section(const std::string& path, T& value);

class Documenter {
 public:
  explicit Documenter(const std::string& path) : path_(path) {}

  template <class T>
  void field(T& value, const SceneField& f) {
    const std::string unit = f.bounds.unit.empty() ? "" : fmt::format(" [{}]", f.bounds.unit);
    rows_ += wrapped_text(fmt::format("- `{}`: {}{}; {}{}. {}\n", f.name, type_name<T>(), unit, default_text(value, f),
                                      limits_text(f, is_vector<T>), f.doc));
    const std::string path = join(path_, f.name);
    if constexpr (has_fields<T>) {
      inner_ += "\n" + section(path, value);
    } else if constexpr (is_optional<T>) {
      if constexpr (has_fields<typename T::value_type>) inner_ += "\n" + section(path, value.emplace());
    } else if constexpr (is_vector<T> && !std::is_same_v<T, std::vector<Shape>>) {  // shapes contain shapes
      if constexpr (has_fields<typename T::value_type>) inner_ += "\n" + section(path + "[]", value.emplace_back());
    }
  }

  bool applies(bool) const { return true; }

  std::string text() const {
    return fmt::format("## {}\n\n{}{}", path_.empty() ? "The scene" : "`" + path_ + "`", rows_, inner_);
  }

 private:
  template <class T>
  static std::string default_text(const T& value, const SceneField& f) {
    if (f.presence == kRequired) return "required";
    if constexpr (is_optional<T>) {
      return "absent";
    } else if constexpr (is_vector<T>) {
      return "default []";
    } else if constexpr (has_fields<T>) {
      return "see below";
    } else {
      return f.presence == kZeroIsAbsent ? "absent" : fmt::format("default `{}`", on_one_line(written(value)));
    }
  }

  std::string path_, rows_, inner_;
};

template <class T>
std::string section(const std::string& path, T& value) {
  Documenter documenter(path);
  describe(documenter, value);
  return documenter.text();
}

constexpr std::string_view kReferenceHead =
    R"(# Scenes

`cutproof info --scene` prints this page from the table of fields that reads and
checks scenes; a test compares the two. Each field has type and unit, default,
and bounds.

A scene is a JSON file (UTF-8, no comments): a body, the parameters of a
simulation, the path of a blade, and expectations. judge_a_run.md, A scene of
your own, shows a complete one, `cylinder`. An absent field has its default. A
field that is not listed, a field given twice and a value out of bounds are
errors. Units are SI unless stated:

- **box**: coordinates in the bounding box of the body's particles at rest,
  after alignment. (0, 0, 0) is the lower corner of this box and (1, 1, 1) the
  upper one, half a spacing beyond the outermost particles. Points may lie
  outside. A path in box coordinates fits any organ.
- **h**: the spacing of the background grid. **extents**: multiples of the
  bounding box's width along a direction.
- Directions (`back`, `along`, `velocity`, `gravity`) are metric and in the
  body's frame.
- A **range** is a number (exactly that), or `{"at_least": a}`, `{"at_most":
  b}`, or both.
- In bounds, a square bracket includes the number and a round one excludes it.
  Bounds hold for each component of a vector, each entry of a list and both ends
  of a range.

Time is divided into frames of `frame.length`, and frames into `step.substeps`.
If the blade is too fast for its thickness, a frame is divided into as few equal
shorter frames as suffice (not with `geometric`). In each substep no corner of
the blade then moves by more than 1.001 · max(thickness, epsilon · h) / 2. By
turning alone, no corner moves by more than half of the shorter of length and
depth (method.md §3, Blade). With `detect.every` = `substep`, each of these
frames becomes `step.substeps` frames of one substep.
)";

}  // namespace

std::string write_scene(const Scene& scene) {
  ordered_json tree = written(scene);
  if (scene.material) {  // these follow from it
    tree["body"].erase("density");
    tree["step"].erase("stiffness");
    tree["step"].erase("volume_share");
  }
  return pretty(tree, 0) + "\n";
}

std::string scene_reference() {
  Scene scene;
  return fmt::format("{}\n{}", kReferenceHead, section("", scene));
}

}  // namespace cutproof::io
