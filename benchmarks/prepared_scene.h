// A scene ready to be run, whose frames are counted as the scene counts them: those into which a fast blade divides
// them do not show.
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
  // `frames`: at most so many of the scene's. Throws InputError, naming `source`, if the scene's fields make no sense
  // together.
  PreparedScene(const Scene& scene, const std::string& source, std::optional<int64_t> frames);
  const Setup& setup() const { return setup_; }
  const State& start() const { return start_; }
  // Of the same body.
  void begin_with(State start) { start_ = std::move(start); }
  const fixtures::BuildReport& report() const { return report_; }
  int64_t frame_count() const { return static_cast<int64_t>(last_of_.size()); }

  // Calls `run` for each part into which a frame of the scene is divided.
  template <typename Run>
  void for_parts_of(int64_t frame, const Run& run) const {
    const int64_t first = frame == 0 ? 0 : last_of_[static_cast<std::size_t>(frame) - 1] + 1;
    for (int64_t part = first; part <= last_of_[static_cast<std::size_t>(frame)]; ++part) run();
  }
  // Loads it and runs whole frames. `see`, unless it is empty, is called after each frame of the scene with the seconds
  // that the backend has taken so far; the run ends where it returns false. Returns the seconds.
  double run(Backend& backend, const std::function<bool(double seconds)>& see) const;
  // [strokes] the frame at whose end a stroke is complete; -1: the run ends before.
  std::vector<int64_t> stroke_end() const;

 private:
  Setup setup_;
  State start_;
  fixtures::BuildReport report_;
  std::vector<int64_t> last_of_;  // [scene frames] the last frame of the schedule that belongs to it
};

}  // namespace cutproof::benchmarks
