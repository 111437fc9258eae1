// `cutproof info`: version, backends, devices.
#include <fmt/format.h>

#include <memory>

#include "cli/commands.h"
#include "cli/options.h"
#include "model/io/scene_io.h"

namespace cutproof::cli {

namespace {

struct InfoOptions {
  bool scene = false;  // print the reference of scene files
};

int info(const InfoOptions& options) {
  if (options.scene) {
    fmt::print("{}", io::scene_reference());
    return 0;
  }
  fmt::print("cutproof {}\nbackends:\n", kVersion);
  for (const harness::BackendDescriptor& backend : harness::backends()) {
    fmt::print("  {:<11} {}\n", backend.name, harness::description_of(backend));
  }
  fmt::print(
      "scene files: version 1 (`cutproof info --scene` lists every field)\n"
      "recordings: temporal VTKHDF 2.0, index version 1\n"
      "licence: sources MIT; this program links CGAL and SuiteSparse, which makes it GPL\n");
  return 0;
}

}  // namespace

void add_info(CLI::App& program, Work& work) {
  const auto options = std::make_shared<InfoOptions>();
  CLI::App* const command = program.add_subcommand("info", "version, backends, devices");
  command->add_flag("--scene", options->scene, "list every field of a scene file");
  command->callback([options, &work] { work = [options] { return info(*options); }; });
}

}  // namespace cutproof::cli
