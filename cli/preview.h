// --preview F of `run`: a scene as a page before it runs.
#pragma once
#include <string>

#include "fixtures/build.h"
#include "model/scene.h"

namespace cutproof::cli {

// The body as it begins, with its skin, and the way of the blade. `again`: the command line that runs it.
void write_preview(const std::string& path, const Scene& scene, const fixtures::Built& built, const std::string& again);

}  // namespace cutproof::cli
