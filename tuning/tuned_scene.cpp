#include "tuning/tuned_scene.h"

#include <filesystem>

#include "model/io/scene_io.h"

namespace cutproof::tuning {

namespace fs = std::filesystem;

std::string tuned_scene_text(const Configuration& configuration, const std::string& source, const std::string& path) {
  Scene scene = configuration.scene;
  if (scene.body.mesh && fs::path(scene.body.mesh->file).is_relative()) {
    // Resolves links.
    const fs::path file = fs::canonical(fs::path(source).parent_path() / scene.body.mesh->file);
    std::error_code none;
    const fs::path near = fs::proximate(file, fs::canonical(fs::absolute(path).parent_path()), none);
    scene.body.mesh->file = (none ? file : near).string();
  }
  return io::write_scene(scene);
}

}  // namespace cutproof::tuning
