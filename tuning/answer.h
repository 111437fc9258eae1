// The answer that configurations of a scene are measured against, by the double-precision reference, and how well it is
// known.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "model/backend.h"
#include "model/scene.h"
#include "oracles/comparison/trajectory.h"

namespace cutproof::cli {

// What a body does in a scene. Frames are the scene's: those into which a fast blade divides them do not show.
struct Course {
  std::vector<oracles::Pose> frames;  // at the end of each
  std::vector<int64_t> stroke_end;    // [strokes] the frame at whose end a stroke is complete; -1: the run ends before
};

// In which way the tissue is in a different number of parts at the end of a stroke, which each of the two may reach in
// a frame of its own, or at the end; empty: it is not.
std::string other_parts(const Course& expected, const Course& actual);

// A scene ready to be run. `unit_roundoff`: of the backend that will. Throws InputError, naming `source`, if the
// scene's fields make no sense together.
class Staged {
 public:
  Staged(const Scene& scene, const std::string& source, std::optional<int64_t> frames);
  const Setup& setup() const { return setup_; }
  const State& start() const { return start_; }
  int64_t frame_count() const { return static_cast<int64_t>(last_of_.size()); }

  // Calls `run` for each part into which a frame of the scene is divided.
  template <typename Run>
  void for_parts_of(int64_t frame, const Run& run) const {
    const int64_t first = frame == 0 ? 0 : last_of_[static_cast<std::size_t>(frame) - 1] + 1;
    for (int64_t part = first; part <= last_of_[static_cast<std::size_t>(frame)]; ++part) run();
  }
  // Loads it and runs whole frames. `see`, unless it is empty, is called after each frame of the scene with the seconds
  // that the backend has taken so far; the run ends where it says false. Returns the seconds.
  double run(Backend& backend, const std::function<bool(double seconds)>& see) const;
  std::vector<int64_t> stroke_end() const;

 private:
  Setup setup_;
  State start_;
  std::vector<int64_t> last_of_;  // [scene frames] the last frame of the schedule that belongs to it
};

enum class AnswerKind {
  limit,    // of ever shorter time steps, and of iterations that are enough for them
  substeps  // of ever more iterations, with the scene's own substeps: the time step is part of the scene
};

// One approximation of the answer.
struct Level {
  int32_t substeps = 0, iterations = 0;
  std::optional<double> apart_h;  // from the level before: greatest RMS distance in any frame [h]
};

class Answer {
 public:
  // Refines, a factor of 2 at a time, until two levels are apart by at most `known` [h], or no further level is allowed
  // (kMostSubsteps, kMostIterations). The scene must have the implicit solver.
  Answer(AnswerKind kind, const Scene& scene, std::string source, std::optional<int64_t> frames, double known);

  const Course& course() const { return course_; }
  const std::vector<Level>& levels() const { return levels_; }
  // By how much the answer may be off [h]: how far its last two levels are apart. What converges at first order or
  // faster is as far from its limit at most.
  double known_to_h() const { return levels_.back().apart_h.value_or(0); }
  bool nothing_removed() const;

  // One level more, whatever it costs: what the search has not seen.
  void refine();

  static constexpr int32_t kMostSubsteps = 256;    // per frame
  static constexpr int32_t kMostIterations = 512;  // per substep

 private:
  Level next_level() const;
  Course run(const Level& level) const;
  void take(Level level, Course course);

  AnswerKind kind_;
  Scene scene_;
  std::string source_;
  std::optional<int64_t> frames_;
  Setup setup_;
  std::vector<Level> levels_;
  Course course_;
};

}  // namespace cutproof::cli
