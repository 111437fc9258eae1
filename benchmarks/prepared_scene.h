// A scene ready to run, with its own count of frames: the parts into which a fast blade divides frames are hidden.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fixtures/build.h"
#include "model/backend.h"
#include "model/scene.h"

namespace cutproof::benchmarks {

class PreparedScene {
 public:
  // `frames`: at most so many of the scene's. Throws InputError, naming `source`, if the scene's fields contradict each
  // other.
  PreparedScene(const Scene& scene, const std::string& source, std::optional<int64_t> frames);
  const Setup& setup() const { return setup_; }
  const State& start() const { return start_; }
  // `start`: a state of the same body.
  void begin_with(State start) { start_ = std::move(start); }
  const fixtures::BuildReport& report() const { return report_; }
  int64_t frame_count() const { return static_cast<int64_t>(last_of_.size()); }

  // Calls `run` for each part of a frame of the scene.
  template <typename Run>
  void for_parts_of(int64_t frame, const Run& run) const {
    const int64_t first = frame == 0 ? 0 : last_of_[static_cast<std::size_t>(frame) - 1] + 1;
    for (int64_t part = first; part <= last_of_[static_cast<std::size_t>(frame)]; ++part) run();
  }
  // Loads the scene and runs whole frames; returns the seconds. `see` (optional) is called after each frame of the
  // scene with the backend's seconds so far; the run ends when it returns false.
  double run(Backend& backend, const std::function<bool(double seconds)>& see) const;
  // [strokes] the frame that completes each stroke; -1: the run ends before.
  std::vector<int64_t> stroke_end() const;

 private:
  Setup setup_;
  State start_;
  fixtures::BuildReport report_;
  std::vector<int64_t> last_of_;  // [scene frames] the last frame of the schedule in each
};

}  // namespace cutproof::benchmarks
