#include <fmt/format.h>

#include "cli/commands.h"
#include "model/io/scene_io.h"

namespace cutproof::cli {

int info(const InfoOptions& options) {
  if (options.scene) {
    fmt::print("{}", io::scene_reference());
    return 0;
  }
  fmt::print(
      "cutproof {}\n"
      "backends:\n"
      "  reference   CPU, double precision, serial: the oracle that everything else is compared with\n"
      "devices: none is used by these backends\n"
      "scene files: version 1 (`cutproof info --scene` lists every field)\n"
      "recordings: temporal VTKHDF 2.0, index version 1\n"
      "licence: sources MIT; this program links CGAL and SuiteSparse, which makes it GPL\n",
      kVersion);
  return 0;
}

}  // namespace cutproof::cli
