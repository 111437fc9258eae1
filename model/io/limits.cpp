#include "model/io/limits.h"

#include <fmt/format.h>

#include "model/io/columns.h"

namespace cutproof::io {
namespace {

std::string count_text(uint64_t count) { return grouped(static_cast<long long>(count)); }

// The kind of input, where it differs from the previous row, and below it one limit.
std::string row(std::string_view file, std::string_view what, const std::string& most) {
  const std::string head = file.empty() ? "" : fmt::format("- {}\n", file);
  return wrapped_text(fmt::format("{}  - {}: {}\n", head, what, most));
}

std::string json_rows(const JsonLimits& limits, std::string_view read_by) {
  return row(fmt::format("{} ({})", limits.what, read_by), "size, values",
             fmt::format("{}, {}", bytes_text(limits.bytes), count_text(static_cast<uint64_t>(limits.values))));
}

constexpr std::string_view kHead = R"(# Limits of readers

`cutproof info --limits` prints this page. A reader refuses a file beyond a
limit with exit status 2, before it allocates memory, and names the limit. Names
of fields count as values.

)";

constexpr std::string_view kRest = R"(
**Regular files only**, or links to them. Pipes, sockets, devices and folders
(except of runs) are refused unopened, so no reader waits. So are `<(...)`, and
`/dev/stdin` unless it is a file (`< scene.json`).

**Compressed data** (recordings, NPZ, HDF5) is refused before inflation beyond
the last limit. In files of arrays each number counts as 8 bytes; segments of a
run count together. HDF5 files must contain all their data: soft and external
links, external storage, virtual datasets and foreign filters are refused.

**Meshes**: STL (text, or binary with or without attribute bytes), OBJ, text OFF
([ST][C][N][4]OFF), and PLY (text or binary; any integer type). Faces of PLY may
be polygons or triangle strips. Text is ASCII or UTF-8, with any line
ends, and numbers as C or Fortran print them. Colours, normals and textures are
ignored. UTF-16, UTF-32, decimal commas, binary OFF, nOFF and OBJ weights other
than 1 are refused.

**Names** of files may hold any bytes except line ends; names of plugins must be
UTF-8. Output, JSON and JUnit included, escapes control and bidirectional
characters (`\x1b`, `\u202e`) and bytes that are not UTF-8 (`\xe9`). Commands
quote such names: `$'caf\xe9.json'`.
)";

}  // namespace

std::string bytes_text(uint64_t bytes) {
  if (bytes >= kGiB && bytes % kGiB == 0) return fmt::format("{} GiB", bytes / kGiB);
  if (bytes >= kMiB && bytes % kMiB == 0) return fmt::format("{} MiB", bytes / kMiB);
  if (bytes >= 1024 && bytes % 1024 == 0) return fmt::format("{} KiB", bytes / 1024);
  return fmt::format("{} bytes", count_text(bytes));
}

std::string limits_reference() {
  std::string text(kHead);
  text += row("Any JSON file", "nested brackets", count_text(static_cast<uint64_t>(kSceneLimits.depth)));
  text += json_rows(kSceneLimits, "`run`, `tune`, `bench`");
  text += row("", "bytes of `name`, `description`, `mesh.file`",
              fmt::format("{}, {}, {}", count_text(kMostNameBytes), count_text(kMostDescriptionBytes),
                          count_text(kMostPathBytes)));
  text += row("", "shapes, also nested", count_text(kMostShapes));
  text +=
      row("", "strokes, points per stroke", fmt::format("{}, {}", count_text(kMostStrokes), count_text(kMostPoints)));
  text += row("", "walls, grips", fmt::format("{}, {}", count_text(kMostWalls), count_text(kMostGrips)));
  text += row("", "substeps times grips", count_text(kMostGripSubsteps));
  text += json_rows(kCounterexampleLimits, "`replay`");
  text +=
      row("", "particles, commands, schedule decisions",
          fmt::format("{}, {}, {}", count_text(kMostCaseNodes), count_text(kMostCommands), count_text(kMostDecisions)));
  text += row("", "grid nodes of their box", count_text(kMostCaseCells));
  text += json_rows(kResultsLimits, "`report`");
  text += json_rows(kCampaignLimits, "`fuzz --merge`");
  text += row("", "properties", count_text(kMostProperties));
  text += json_rows(kQuestionLimits, "`judge --case`");
  text += row("A mesh (`--mesh`, `mesh.file`)", "size", bytes_text(kMostMeshBytes));
  text += row("", "faces, vertices", fmt::format("{0}, {0}", count_text(kMostMeshElements)));
  text += row("An array file (`check`, `kick`, `relate`, `check-vectors`)", "arrays, axes per array",
              fmt::format("{}, {}", kMostArrays, kMostArrayAxes));
  text += row("", "all arrays together, one text",
              fmt::format("{}, {}", bytes_text(kMostArrayBytes), bytes_text(kMostTextBytes)));
  text += row("A run (`check`, `relate`)", "segments", count_text(kMostSegments));
  text += row("", "blade patches per frame", count_text(kMostPatches));
  text +=
      row("A recording (`check`, `digest`, `report`)", "snapshots", count_text(static_cast<uint64_t>(kMostSnapshots)));
  text += row("Compressed data, inflated", "larger of",
              fmt::format("{}, {} times the file", bytes_text(kFreeInflation), kMostInflation));
  text += kRest;
  return text;
}

}  // namespace cutproof::io
