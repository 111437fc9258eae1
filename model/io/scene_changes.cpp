#include "model/io/scene_changes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <string_view>
#include <variant>

#include "model/error.h"
#include "model/io/json_reader.h"
#include "model/io/limits.h"

namespace cutproof::io {
namespace {

using nlohmann::json;

// The name of a field, or the number of an entry.
using Step = std::variant<std::string, std::size_t>;

[[noreturn]] void refuse(const SceneChange& change, const std::string& problem, const std::string& remedy) {
  throw InputError(change.given, change.path, problem, remedy);
}

bool is_of_a_name(char c) {
  return c == '_' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

// No field lies deeper, but by hundreds of shapes within shapes.
constexpr std::size_t kMostSteps = 40;

std::vector<Step> steps_of(const SceneChange& change) {
  const auto refuse_path = [&] {
    refuse(
        change, "This is not a path to a field.",
        "Write names with dots between them, and numbers of entries in brackets, from 0: blade.strokes[0].points[1].");
  };
  std::vector<Step> steps;
  const std::string& path = change.path;
  for (std::size_t k = 0; k < path.size() || steps.empty();) {
    if (steps.size() == kMostSteps) refuse_path();
    const bool is_entry = k < path.size() && path[k] == '[' && !steps.empty();
    if (!steps.empty() && !is_entry && path[k++] != '.') refuse_path();
    if (is_entry) {
      std::size_t index = 0;
      const char* const end = path.data() + path.size();
      const auto [after, error] = std::from_chars(path.data() + k + 1, end, index);
      if (error != std::errc() || after == end || *after != ']') refuse_path();
      steps.emplace_back(index);
      k = static_cast<std::size_t>(after - path.data()) + 1;
    } else {
      const auto end = std::find_if_not(path.begin() + static_cast<std::ptrdiff_t>(k), path.end(), is_of_a_name);
      std::string name(path.begin() + static_cast<std::ptrdiff_t>(k), end);
      if (name.empty()) refuse_path();
      k += name.size();
      steps.emplace_back(std::move(name));
    }
  }
  return steps;
}

json value_of(const SceneChange& change) {
  const std::string& text = *change.value;
  // A shell takes quotation marks away, and a word can be nothing else.
  const bool is_word = !text.empty() && !(text[0] >= '0' && text[0] <= '9') && text.find('\n') == std::string::npos &&
                       text.find_first_of("\"[]{},:") == std::string::npos && text[0] != '-' && text[0] != '.';
  if (is_word && !json::accept(text)) return text;
  return parse_json(text, change.given, kSceneLimits,
                    "Give JSON, such as 8, true, [0, 0, -9.81], or a word; quote it for the shell.");
}

// Where `step` leads from `here`; made, in an object, if it is not there.
json& place_of(const SceneChange& change, json& here, const Step& step) {
  if (const auto* const name = std::get_if<std::string>(&step)) {
    if (!here.is_object()) {
      refuse(change, fmt::format("\"{}\" would be a field of a value without fields: {}.", *name, here.type_name()),
             "Give a path that the scene has, or the whole value.");
    }
    return here[*name];
  }
  const std::size_t index = std::get<std::size_t>(step);
  if (!here.is_array() || index >= here.size()) {
    refuse(change,
           here.is_array() ? fmt::format("There is no entry {}: the list has {}, counted from 0.", index, here.size())
                           : fmt::format("There is no entry {}: the value is not a list.", index),
           "Give an entry that the scene has, or the whole list.");
  }
  return here[index];
}

// Whether `field` is `path`, or in it.
bool is_within(std::string_view field, std::string_view path) {
  return field.starts_with(path) &&
         (field.size() == path.size() || field[path.size()] == '.' || field[path.size()] == '[');
}

}  // namespace

void make_change(const SceneChange& change, json& tree) {
  const std::vector<Step> steps = steps_of(change);
  if (!change.value) {
    json* here = &tree;
    for (std::size_t k = 0; k + 1 < steps.size(); ++k) {
      const auto* const name = std::get_if<std::string>(&steps[k]);
      if (name == nullptr || !here->is_object() || !here->contains(*name)) return;
      here = &here->at(*name);
    }
    const auto* const last = std::get_if<std::string>(&steps.back());
    if (here->is_object() && last != nullptr) here->erase(*last);
    return;
  }
  json* here = &tree;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    here = &place_of(change, *here, steps[k]);
    if (k + 1 < steps.size() && here->is_null() && std::holds_alternative<std::string>(steps[k + 1]))
      *here = json::object();
  }
  *here = value_of(change);
}

std::string source_of_field(const std::string& field, const std::string& name,
                            const std::vector<SceneChange>& changes) {
  std::vector<std::string> inside;
  for (auto change = changes.rbegin(); change != changes.rend(); ++change) {
    if (!change->value) continue;
    if (is_within(field, change->path)) return change->given;
    const bool is_known = std::find(inside.begin(), inside.end(), change->given) != inside.end();
    if (!is_known && (field.empty() || is_within(change->path, field))) inside.insert(inside.begin(), change->given);
  }
  return inside.empty() ? name : fmt::format("{} with {}", name, fmt::join(inside, " "));
}

}  // namespace cutproof::io
