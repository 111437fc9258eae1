#include "cli/scene_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "cli/options.h"
#include "cli/scene_files.h"

namespace cutproof::cli {

CLI::Option* add_scene(CLI::App& command, SceneOptions& options) {
  CLI::Option* const scene =
      command
          .add_option("scene", options.file,
                      "scene file (JSON, see `cutproof info --scene`), or a name (`cutproof info --scenes`)")
          ->type_name("SCENE")
          ->check(usually_one_of(scene_names()));
  command.add_option("--set", options.set, "change a field of the scene, such as step.iterations=8; repeatable")
      ->allow_extra_args(false)
      ->type_name("FIELD=V");
  add_count(command, "--particles", options.particles, "number of particles of the body", whole_number(1));
  command.add_option("--spacing", options.spacing, "distance of particles [m], instead of --particles")
      ->type_name("H")
      ->check(number_above(0));
  command.add_option("--seed", options.seed, "seed of all random numbers, instead of the scene's")
      ->type_name("N")
      ->check(seed_number());
  return scene;
}

std::vector<io::SceneChange> changes_of(const SceneOptions& options) {
  std::vector<io::SceneChange> changes;
  for (const std::string& given : options.set) {
    const std::size_t equals = given.find('=');
    if (equals == std::string::npos || equals == 0) {
      refuse("--set", fmt::format("'{}' is not a field with a value", given),
             "give both, such as --set step.iterations=8; `cutproof info --scene` lists the fields");
    }
    changes.push_back({"--set " + given, given.substr(0, equals), given.substr(equals + 1)});
  }
  if (options.particles && options.spacing) {
    refuse("--spacing", "a number of particles is given as well", "give one of --particles and --spacing");
  }
  const auto replace = [&](const std::string& given, const char* field, const std::string& value, const char* other) {
    if (other != nullptr) changes.push_back({given, other, std::nullopt});
    changes.push_back({given, field, value});
  };
  if (options.particles) {
    replace(fmt::format("--particles {}", *options.particles), "body.particles", fmt::format("{}", *options.particles),
            "body.spacing");
  }
  if (options.spacing) {
    replace(fmt::format("--spacing {}", *options.spacing), "body.spacing", fmt::format("{}", *options.spacing),
            "body.particles");
  }
  if (options.seed) replace(fmt::format("--seed {}", *options.seed), "seed", fmt::format("{}", *options.seed), nullptr);
  return changes;
}

std::vector<std::string> take_replaced_counts(const SceneOptions& options, Expectations& expected) {
  std::vector<std::string> taken;
  if (!options.particles && !options.spacing) return taken;
  const auto take = [&](std::optional<Range>& range, const std::string& what) {
    const bool is_set = std::any_of(options.set.begin(), options.set.end(),
                                    [&](const std::string& set) { return set.starts_with("expect." + what); });
    if (!range || is_set) return;
    range.reset();
    taken.push_back(what);
  };
  take(expected.particles, "particles");
  take(expected.clusters, "clusters");
  return taken;
}

std::vector<std::string> given_changes(const std::vector<io::SceneChange>& changes) {
  std::vector<std::string> given;
  for (const io::SceneChange& change : changes) {
    if (change.value) given.push_back(change.given);
  }
  return given;
}

}  // namespace cutproof::cli
