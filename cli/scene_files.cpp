#include "cli/scene_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "model/error.h"
#include "model/nearest_word.h"

namespace cutproof::cli {

namespace {

namespace fs = std::filesystem;

// The folder of scenes beside the running program: of an installation, else of the source tree of the build. Not
// compiled in, because packages are unpacked anywhere. Empty if neither exists.
fs::path scene_folder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return {};
  if (const fs::path installed = program.parent_path().parent_path() / "share/cutproof/scenes";
      fs::is_directory(installed, error)) {
    return installed;
  }
  for (fs::path folder = program.parent_path(); folder != folder.parent_path(); folder = folder.parent_path()) {
    if (fs::is_directory(folder / "fixtures/scenes", error)) return folder / "fixtures/scenes";
  }
  return {};
}

}  // namespace

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(scene_folder(), error)) {
    if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string scene_file(const std::string& given) {
  std::error_code error;
  const bool is_path = given.find('/') != std::string::npos || given.find('.') != std::string::npos;
  if (is_path || fs::exists(given, error)) return given;
  const std::vector<std::string> names = scene_names();
  if (std::binary_search(names.begin(), names.end(), given)) return (scene_folder() / (given + ".json")).string();
  if (names.empty()) return given;
  throw InputError(
      given, "", "There is no file, and no included scene of this name.",
      did_you_mean(given, names) + fmt::format("Give a scene file, or one of: {}.", fmt::join(names, ", ")));
}

}  // namespace cutproof::cli
