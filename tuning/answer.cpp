#include "tuning/answer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>
#include <memory>

#include "fixtures/build.h"
#include "reference_cpu/reference.h"

namespace cutproof::cli {

namespace {

// What is left, at most, of the error that a substep starts with.
constexpr double kLeft = 1e-4;
constexpr int32_t kLeastSubsteps = 32, kLeastIterations = 16;

// Iterations that shrink every error of a substep to kLeft: with rotations held, each multiplies it by at most
// s = k dt² / (1 + k dt²) (method.md §3).
int32_t enough_iterations(const Scene& scene, int32_t substeps) {
  const double dt = scene.frame_length / substeps, kdt2 = scene.step.stiffness * dt * dt, s = kdt2 / (1 + kdt2);
  if (s < kLeft) return 2;
  const double iterations = std::ceil(std::log(kLeft) / std::log(s));
  return static_cast<int32_t>(std::clamp(iterations, 2.0, 1.0 * Answer::kMostIterations));
}

}  // namespace

Staged::Staged(const Scene& scene, const std::string& source, std::optional<int64_t> frames) {
  fixtures::BuildOptions options;
  options.frames = frames;
  fixtures::Built built = fixtures::build(scene, source, options);
  setup_ = std::move(built.setup);
  start_ = std::move(built.state);
  const std::vector<int32_t>& scene_frame = built.schedule.scene_frame;
  for (std::size_t f = 0; f < scene_frame.size(); ++f) {
    if (f + 1 == scene_frame.size() || scene_frame[f + 1] != scene_frame[f])
      last_of_.push_back(static_cast<int64_t>(f));
  }
}

double Staged::run(Backend& backend, const std::function<bool(double seconds)>& see) const {
  double seconds = 0;
  backend.load({setup_}, {start_});
  for (int64_t frame = 0; frame < frame_count(); ++frame) {
    for_parts_of(frame, [&] {
      backend.run({Stage::step, Stage::skin});
      seconds += backend.report().total_seconds;
    });
    if (see && !see(seconds)) break;
  }
  return seconds;
}

std::vector<int64_t> Staged::stroke_end() const {
  std::vector<int64_t> ends;
  for (const int64_t frame : setup_.stroke_end) {
    const auto found = std::lower_bound(last_of_.begin(), last_of_.end(), frame);
    ends.push_back(frame < 0 || found == last_of_.end() ? -1 : found - last_of_.begin());
  }
  return ends;
}

std::string other_parts(const Course& expected, const Course& actual) {
  const auto differs = [](const oracles::Pose& e, const oracles::Pose& a, const std::string& when) {
    return e.components == a.components ? std::string()
                                        : fmt::format("{} parts {}, expected {}", a.components, when, e.components);
  };
  const auto frame = [](const Course& course, int64_t f) -> const oracles::Pose& {
    return course.frames[static_cast<std::size_t>(f)];
  };
  for (std::size_t s = 0; s < std::min(expected.stroke_end.size(), actual.stroke_end.size()); ++s) {
    const int64_t e = expected.stroke_end[s], a = actual.stroke_end[s];
    if (e < 0 || a < 0) continue;
    std::string found = differs(frame(expected, e), frame(actual, a), fmt::format("after stroke {}", s + 1));
    if (!found.empty()) return found;
  }
  if (expected.frames.empty() || actual.frames.empty()) return {};
  return differs(expected.frames.back(), actual.frames.back(), "at the end");
}

Answer::Answer(AnswerKind kind, const Scene& scene, std::string source, std::optional<int64_t> frames, double known)
    : kind_(kind), scene_(scene), source_(std::move(source)), frames_(frames) {
  scene_.skin.wanted = false;  // nothing moves with it
  scene_.step.acceleration = Acceleration::none;
  setup_ = Staged(scene_, source_, frames_).setup();
  levels_ = {next_level()};
  // Two levels are needed at least. They know nothing of each other, so they are run at once.
  const Level first = levels_.front(), second = next_level();
  std::future<Course> finer = std::async(std::launch::async, [&] { return run(second); });
  course_ = run(first);
  take(second, finer.get());
  while (known_to_h() > known) {
    const Level next = next_level();
    if (next.substeps > kMostSubsteps || next.iterations > kMostIterations) break;
    refine();
  }
}

Level Answer::next_level() const {
  Level level;
  if (kind_ == AnswerKind::substeps) {
    level.substeps = scene_.step.substeps;
    level.iterations =
        levels_.empty() ? std::max(kLeastIterations, scene_.step.iterations) : 2 * levels_.back().iterations;
  } else {
    level.substeps = levels_.empty() ? std::max(kLeastSubsteps, 4 * scene_.step.substeps) : 2 * levels_.back().substeps;
    level.iterations = enough_iterations(scene_, level.substeps);
  }
  return level;
}

Course Answer::run(const Level& level) const {
  Scene scene = scene_;
  scene.step.substeps = level.substeps;
  scene.step.iterations = level.iterations;
  const Staged staged(scene, source_, frames_);
  const std::unique_ptr<Backend> reference = reference::make_backend();
  Course course;
  course.stroke_end = staged.stroke_end();
  staged.run(*reference, [&](double) {
    course.frames.push_back(oracles::pose_of(staged.setup(), reference->snapshot().front(),
                                             course.frames.empty() ? nullptr : &course.frames.back()));
    return true;
  });
  return course;
}

void Answer::take(Level level, Course course) {
  double apart = 0;
  for (std::size_t f = 0; f < std::min(course.frames.size(), course_.frames.size()); ++f) {
    apart = std::max(apart, oracles::poses_apart(setup_, course.frames[f], course_.frames[f]).position.rms());
  }
  // Levels between which the tissue falls into other parts, or whose blades arrive in other frames, say nothing about
  // where anything is.
  if (!other_parts(course, course_).empty() || course.frames.size() != course_.frames.size())
    apart = std::numeric_limits<double>::infinity();
  level.apart_h = apart;
  levels_.push_back(level);
  course_ = std::move(course);
}

void Answer::refine() {
  const Level next = next_level();
  take(next, run(next));
}

bool Answer::nothing_removed() const {
  return std::all_of(course_.frames.begin(), course_.frames.end(), [](const oracles::Pose& pose) {
    return std::find(pose.alive.begin(), pose.alive.end(), 0) == pose.alive.end();
  });
}

}  // namespace cutproof::cli
