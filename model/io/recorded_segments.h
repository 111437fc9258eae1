// A recording as a run of any simulator (docs/reference/run.md): the state as loaded, then the end of each frame, each
// as a segment. Internal to model/io/.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "model/io/array_file.h"
#include "model/io/recording.h"

namespace cutproof::io {

class RecordedSegments {
 public:
  // Throws what RecordingReader throws.
  explicit RecordedSegments(const std::string& name) : reader_(name) {}
  std::optional<ArrayFile> next();

 private:
  RecordingReader reader_;
  int64_t next_ = 0;
  bool has_begun_ = false;
  double time_ = 0;
  std::vector<int64_t> offsets_;  // of the clusters of the segment before
  std::vector<int32_t> members_;
};

}  // namespace cutproof::io
