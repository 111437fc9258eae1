// Changes of a scene before it is read.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "model/io/scene_io.h"

namespace cutproof::io {

// Throws InputError, naming the change, where the scene has no such place or the value is none.
void make_change(const SceneChange& change, nlohmann::json& tree);

}  // namespace cutproof::io
