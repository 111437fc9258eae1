// Scenes as JSON. One table of fields drives reading, checking, writing and the documentation.
#pragma once
#include <string>

#include "model/scene.h"

namespace cutproof::io {

// Throws InputError for anything that is not a valid scene: unknown field (with the nearest known name), wrong type,
// value out of bounds, NaN, wrong version. Nothing is read beyond this file.
Scene read_scene(const std::string& path);
// The same from text; `name` stands for the file in errors.
Scene parse_scene(const std::string& text, const std::string& name);
// The whole scene, defaults included; parse_scene(write_scene(s)) gives s.
std::string write_scene(const Scene& scene);
// docs/reference/scene.md: every field with type, unit, default, bounds and meaning.
std::string scene_reference();

}  // namespace cutproof::io
