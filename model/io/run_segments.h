// A run of any simulator in segments, each of which is a file of arrays by itself (docs/reference/run.md): one NPZ; an
// HDF5 file with a group for each; a folder with an NPZ for each; or a recording.
#pragma once
#include <cstdint>
#include <memory>
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

  // Segments of any kind. Throws the exceptions of read_array_file and RecordingReader, and InputError if there is no
  // segment.
  static RunSegments of(const std::string& path);
  // Requires has_segments(path). Throws InputError if there is no segment, or if one between others is missing.
  explicit RunSegments(std::string path);
  // Segments in memory; `source`: the name in errors.
  RunSegments(std::string source, std::vector<ArrayFile> segments)
      : source_(std::move(source)), in_memory_(std::move(segments)) {}

  // The next one, or nothing after the last; the first with what is given once per run. Throws what read_array_file
  // throws, and InputError if all so far have become more than files of their size may.
  std::optional<ArrayFile> next();
  // The name in errors: the file of the last segment, or its group in the file.
  const std::string& source() const { return source_; }

 private:
  RunSegments() = default;
  std::string path_, source_;
  bool is_folder_ = false;
  std::vector<std::string> names_;
  std::vector<ArrayFile> in_memory_;  // without names
  struct Recorded;
  std::shared_ptr<Recorded> recorded_;
  std::size_t next_ = 0;
  uint64_t file_bytes_ = 0, read_bytes_ = 0;  // so far
};

}  // namespace cutproof::io
