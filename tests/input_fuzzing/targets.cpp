#include "tests/input_fuzzing/targets.h"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>

namespace cutproof::input_fuzzing {
namespace {

namespace fs = std::filesystem;

class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = (fs::temp_directory_path() / "cutproof_inputs_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw MachineError(pattern + ": The folder cannot be made.");
    path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

std::span<const Target> all_targets() {
  static const std::array<Target, 13> targets = {
      kScene,          kStl,      kObj,     kPly,      kOff, kRecording, kRecordingContents, kArrays,
      kCounterexample, kCampaign, kResults, kQuestion, kRun};
  return targets;
}

std::string scratch_path(const std::string& name) {
  static const ScratchFolder folder;
  return (folder.path() / name).string();
}

void write_scratch(const std::string& name, std::string_view bytes) {
  const std::string path = scratch_path(name);
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw MachineError(path + ": The file cannot be written.");
}

std::string bytes_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw MachineError(path + ": The file cannot be read.");
  return {std::istreambuf_iterator<char>(file), {}};
}

void broken_contract(const std::string& what) { throw std::logic_error(what); }

}  // namespace cutproof::input_fuzzing
