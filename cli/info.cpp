#include <fmt/format.h>

#include <string>

#include "cli/commands.h"
#include "gpu/backends.h"
#include "model/io/scene_io.h"

namespace cutproof::cli {

namespace {

std::string gpu_line() {
#if CUTPROOF_HAS_CUDA
  std::string why;
  const std::string device = gpu::device_description(why);
  return "  gpu         the CUDA kernels; device: " + (device.empty() ? "none (" + why + ")" : device) + "\n";
#else
  return "  gpu         not built: no CUDA toolkit of version 12.4 or newer was there\n";
#endif
}

}  // namespace

int info(const InfoOptions& options) {
  if (options.scene) {
    fmt::print("{}", io::scene_reference());
    return 0;
  }
  fmt::print(
      "cutproof {}\n"
      "backends:\n"
      "  reference   CPU, double precision, serial: the oracle that everything else is compared with\n"
      "  host        the CUDA kernels' source, single precision, on the threads of this CPU\n"
      "  simulated   the same on one thread, under a schedule that is chosen and can be replayed\n"
      "{}"
      "scene files: version 1 (`cutproof info --scene` lists every field)\n"
      "recordings: temporal VTKHDF 2.0, index version 1\n"
      "licence: sources MIT; this program links CGAL and SuiteSparse, which makes it GPL\n",
      kVersion, gpu_line());
  return 0;
}

}  // namespace cutproof::cli
