// A scene on the command line, and changes of it, for every subcommand that takes a scene.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/error.h"
#include "model/io/scene_io.h"

namespace cutproof::cli {

struct SceneOptions {
  std::string file;
  std::vector<std::string> set;  // "step.iterations=8"
  std::optional<int64_t> particles;
  std::optional<double> spacing;
  std::optional<uint64_t> seed;
};

// SCENE, --set, --particles, --spacing and --seed.
CLI::Option* add_scene(CLI::App& command, SceneOptions& options);

// In the order in which they are made: every --set as given, then --particles, --spacing and --seed, which are short
// for fields. Throws InputError for a malformed change, or for two that contradict each other.
std::vector<io::SceneChange> changes_of(const SceneOptions& options);

// Removes the expected numbers of particles and clusters if the command line changes the number of particles. A --set
// of such an expectation stays. Returns the names of removed expectations.
std::vector<std::string> take_replaced_counts(const SceneOptions& options, Expectations& expected);

// As documents have them.
std::vector<std::string> given_changes(const std::vector<io::SceneChange>& changes);

// The result of `build` for a scene that was read with these changes. An error about a changed field names the change
// in place of `file`.
template <class Build>
auto with_sources(const std::string& file, const std::vector<io::SceneChange>& changes, const Build& build) {
  try {
    return build();
  } catch (const InputError& error) {
    const std::string source = error.field().empty() ? file : io::source_of_field(error.field(), file, changes);
    if (error.file() != file || source == file) throw;
    throw InputError(source, error.field(), error.problem(), error.remedy());
  }
}

}  // namespace cutproof::cli
