// The states of a scene as a run of any simulator (docs/reference/run.md): the state as loaded, then the end of each
// frame, each as a segment.
#pragma once
#include <vector>

#include "model/io/array_file.h"
#include "model/setup.h"
#include "model/state.h"

namespace cutproof::io {

class StateSegments {
 public:
  enum class WithSkin { no, yes };

  // `setup` must outlive this.
  StateSegments(const Setup& setup, Precision precision, WithSkin with_skin)
      : setup_(setup), precision_(precision), with_skin_(with_skin) {}
  // Requires as many particles as the body has.
  ArrayFile next(const State& state);

 private:
  const Setup& setup_;
  Precision precision_;
  WithSkin with_skin_;
  bool has_begun_ = false;
  double time_ = 0;
  std::vector<int64_t> offsets_;  // of the clusters of the segment before
  std::vector<int32_t> members_;
};

}  // namespace cutproof::io
