// A run of somebody else's simulator in segments, each of which is a file of arrays by itself (docs/reference/run.md):
// one NPZ; an HDF5 file with a group for each; or a folder with an NPZ for each.
#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/io/array_file.h"

namespace cutproof::io {

class RunSegments {
 public:
  // Whether this is a folder, or an HDF5 file with the group 000000.
  static bool has_segments(const std::string& path);
  // Whether a file of arrays is a run by itself: `positions` have three axes, and it is no kick.
  static bool is_segment(const ArrayFile& contents);

  // Requires has_segments(path). Throws InputError if there is no segment.
  explicit RunSegments(std::string path);
  // Those that are in memory; `source`: what errors name.
  RunSegments(std::string source, std::vector<ArrayFile> segments)
      : source_(std::move(source)), in_memory_(std::move(segments)) {}

  // The next one, or nothing after the last; the first with what is given once per run. Throws what read_array_file
  // throws.
  std::optional<ArrayFile> next();
  // What errors name: the file of the last segment, or its group in the file.
  const std::string& source() const { return source_; }

 private:
  std::string path_, source_;
  bool is_folder_ = false;
  std::vector<std::string> names_;
  std::vector<ArrayFile> in_memory_;  // without names
  std::size_t next_ = 0;
};

}  // namespace cutproof::io
