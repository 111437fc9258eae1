// Scenes that come with the program, by their names.
#pragma once
#include <string>
#include <vector>

namespace cutproof::cli {

// The scene file for `given`: `given` itself if there is such a file or it is a path, else the scene of that name that
// comes with the program. "kidney_arc" is share/cutproof/scenes/kidney_arc.json of an installation or a package,
// fixtures/scenes/kidney_arc.json of a build. Throws InputError if it is neither, naming scenes of similar names.
std::string scene_file(const std::string& given);

// Names of all scenes that come with the program, ascending; empty if their folder is not where it should be.
std::vector<std::string> scene_names();

}  // namespace cutproof::cli
