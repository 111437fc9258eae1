#include "model/io/limits.h"

#include <fmt/format.h>

#include "model/io/columns.h"

namespace cutproof::io {
namespace {

std::string count_text(uint64_t count) { return grouped(static_cast<long long>(count)); }

// What is read, where that is another thing than in the row before, and below it one limit.
std::string row(std::string_view file, std::string_view what, const std::string& most) {
  const std::string head = file.empty() ? "" : fmt::format("- {}\n", file);
  return wrapped_text(fmt::format("{}  - {}: {}\n", head, what, most));
}

std::string json_rows(const JsonLimits& limits, std::string_view read_by) {
  return row(fmt::format("{} ({})", limits.what, read_by), "bytes", bytes_text(limits.bytes)) +
         row("", "brackets within brackets", count_text(static_cast<uint64_t>(limits.depth))) +
         row("", "values, names of fields included", count_text(static_cast<uint64_t>(limits.values)));
}

constexpr std::string_view kHead = R"(# Limits of what is read

This page is what `cutproof info --limits` prints; a test sees to it that the
two are equal.

What goes beyond a limit is refused with exit status 2, before memory is taken
for it; the error names the limit. A scene, counterexample, result or question
within the limits is read in seconds and some hundred megabytes.

What is read of each at most:

)";

constexpr std::string_view kRest = R"(
**Regular files only.** Files to read may be links, but what these lead to must
be a regular file. Pipes, sockets, devices and folders are refused before they
are opened, so nothing waits. That holds for process substitution, `<(...)`,
too, and for `/dev/stdin` unless it is a file (`< scene.json`): write into a
file first what comes through a pipe.

**What is compressed** (recordings, NPZ, HDF5) is refused before it is inflated
if it would become larger than the last two limits say, each number of a file of
arrays counted as 8 bytes, all segments of a run together. HDF5 files hold
everything themselves: links to other files, soft links, data in other files
(external storage, virtual datasets) and filters that are not HDF5's own are
refused, and no filter is loaded.

**Meshes** are read as STL (text, or binary with or without attribute bytes
behind each triangle), OBJ, PLY (text or binary, corners of every type of
integers, polygons or triangle strips) and OFF as text ([ST][C][N][4]OFF), each
in ASCII or UTF-8, with or without a byte order mark, with lines that end in
any way, and with numbers as C or Fortran print them. Colours, normals and
textures are passed over. Refused by name: text in UTF-16 or UTF-32, decimal
commas, binary OFF, nOFF, and vertices of an OBJ with a weight other than 1.

**Names.** A file may have any name, UTF-8 or not, without line ends, which are
refused on the command line. Names of plugins (`judge FILE.so`, `--backend
plugin:FILE.so`) are kept in counterexamples, so they must be UTF-8. What is
printed of names and of texts from files has `\x1b`, `\u202e` and the like in
place of what would act on a terminal or change the direction of reading, and
`\xe9` for a byte that is no UTF-8; commands to be given again quote such names
as `$'caf\xe9.json'`. JSON, JUnit and annotations have the same, and stay valid
UTF-8.
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
  text += json_rows(kSceneLimits, "`run`, `tune`, `bench`");
  text += row("", "bytes of `name`, of `description`, of `mesh.file`",
              fmt::format("{}, {}, {}", count_text(kMostNameBytes), count_text(kMostDescriptionBytes),
                          count_text(kMostPathBytes)));
  text += row("", "shapes, those within others included", count_text(kMostShapes));
  text +=
      row("", "strokes, points of a stroke", fmt::format("{}, {}", count_text(kMostStrokes), count_text(kMostPoints)));
  text += row("", "walls, grips", fmt::format("{}, {}", count_text(kMostWalls), count_text(kMostGrips)));
  text += row("", "substeps times grips", count_text(kMostGripSubsteps));
  text += json_rows(kCounterexampleLimits, "`replay`");
  text +=
      row("", "particles, commands, decisions of a schedule",
          fmt::format("{}, {}, {}", count_text(kMostCaseNodes), count_text(kMostCommands), count_text(kMostDecisions)));
  text += row("", "grid nodes of the box around the particles", count_text(kMostCaseCells));
  text += json_rows(kResultsLimits, "`report`");
  text += json_rows(kCampaignLimits, "`fuzz --merge`");
  text += row("", "properties", count_text(kMostProperties));
  text += json_rows(kQuestionLimits, "`judge --case`");
  text += row("A mesh (`--mesh`, `mesh.file`)", "bytes", bytes_text(kMostMeshBytes));
  text += row("", "faces, vertices", fmt::format("{0}, {0}", count_text(kMostMeshElements)));
  text += row("A file of arrays (`check`, `kick`, `check-vectors`)", "arrays, axes of an array",
              fmt::format("{}, {}", kMostArrays, kMostArrayAxes));
  text += row("", "bytes of all arrays in memory, of a text",
              fmt::format("{}, {}", bytes_text(kMostArrayBytes), bytes_text(kMostTextBytes)));
  text += row("A run (`check`)", "segments, each with the arrays of one file", count_text(kMostSegments));
  text += row("", "patches of the blade in a frame", count_text(kMostPatches));
  text +=
      row("A recording (`check`, `digest`, `report`)", "snapshots", count_text(static_cast<uint64_t>(kMostSnapshots)));
  text += row("What is compressed", "bytes that it may become in any case", bytes_text(kFreeInflation));
  text += row("", "and beyond these, in sizes of the file", fmt::format("{} times", kMostInflation));
  text += kRest;
  return text;
}

}  // namespace cutproof::io
