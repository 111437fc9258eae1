// The found scene, as a file.
#pragma once
#include <string>

#include "tuning/trial.h"

namespace cutproof::tuning {

// Paths of meshes are relative to the new scene's place. `source`: the file of the given scene; `path`: where the new
// one will be written.
std::string tuned_scene_text(const Configuration& configuration, const std::string& source, const std::string& path);

}  // namespace cutproof::tuning
