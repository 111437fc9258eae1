// Scenes as JSON. One table of fields drives reading, checking, writing and the documentation.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "model/scene.h"

namespace cutproof::io {

// A field that is to have another value than its file says.
struct SceneChange {
  std::string given;                 // as whoever asked for it has it, for errors: "--set step.iterations=8"
  std::string path;                  // "step.iterations", "blade.strokes[0].points[1]"
  std::optional<std::string> value;  // JSON, or a word that is none, which is a text; nothing: the field goes
};

// Throws InputError for anything that is not a valid scene: unknown field (with the nearest known name), wrong type,
// value out of bounds, NaN, wrong version. Nothing is read beyond this file. `changes` are made one after the other,
// before anything is read; an error in a change names it.
Scene read_scene(const std::string& path, const std::vector<SceneChange>& changes = {});
// The same from text; `name` stands for the file in errors.
Scene parse_scene(const std::string& text, const std::string& name, const std::vector<SceneChange>& changes = {});
// The source that an error about this field names in place of the file `name`: the last change that made the field,
// with its fields and entries; the file with the changes that made parts of it; or the file alone.
std::string source_of_field(const std::string& field, const std::string& name, const std::vector<SceneChange>& changes);
// The whole scene, defaults included; parse_scene(write_scene(s)) gives s.
std::string write_scene(const Scene& scene);
// docs/reference/scene.md: every field with type, unit, default, bounds and meaning.
std::string scene_reference();
// fixtures/scene.schema.json: the same as JSON Schema (draft 7). Every scene that the reader accepts is valid. The
// reader accepts every valid scene, but for conditions that no schema can express.
std::string scene_schema();

}  // namespace cutproof::io
