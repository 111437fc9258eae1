#include "tuning/reference_solution.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <limits>
#include <memory>

#include "benchmarks/prepared_scene.h"
#include "reference_cpu/reference.h"

namespace cutproof::tuning {

namespace {

// Greatest remaining part of a substep's initial error.
constexpr double kLeft = 1e-4;
constexpr int32_t kLeastSubsteps = 32, kLeastIterations = 16;
// Greatest distance that counts as rounding [h].
constexpr double kSeen = 1e-9;

// Iterations that shrink every error of a substep to kLeft: with rotations held, each multiplies it by at most
// s (method.md §3).
int32_t enough_iterations(const StepParameters& step, double frame_length, int32_t substeps) {
  const double dt = frame_length / substeps, kdt2 = step.stiffness * dt * (dt + step.retardation);
  const double s = kdt2 / (1 + kdt2);
  if (s < kLeft) return 2;
  const double iterations = std::ceil(std::log(kLeft) / std::log(s));
  return static_cast<int32_t>(std::clamp(iterations, 2.0, 1.0 * ReferenceSolution::kMostIterations));
}

// Neither of the last two distances may contain an event.
bool last_three_remove_the_same(std::span<const RefinementLevel> levels) {
  const auto apart = levels.last(std::min<std::size_t>(2, levels.empty() ? 0 : levels.size() - 1));
  return std::ranges::all_of(apart, [](const RefinementLevel& level) { return level.events.remove_the_same(); });
}

}  // namespace

std::optional<double> observed_order(std::span<const RefinementLevel> levels, std::size_t k) {
  if (k < 2 || !levels[k - 1].apart_h || !levels[k].apart_h) return std::nullopt;
  const double before = *levels[k - 1].apart_h, after = *levels[k].apart_h;
  if (!(before > kSeen) || !(after > kSeen) || !std::isfinite(before) || !std::isfinite(after)) return std::nullopt;
  return std::log2(before / after);
}

double remaining_error(std::span<const RefinementLevel> levels) {
  constexpr double kNotKnown = std::numeric_limits<double>::infinity();
  if (levels.empty() || !levels.back().apart_h || !std::isfinite(*levels.back().apart_h)) return kNotKnown;
  if (!last_three_remove_the_same(levels)) return kNotKnown;
  const double last = *levels.back().apart_h;
  if (last <= kSeen) return last;
  double falls_by = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k + 1 < levels.size(); ++k) {
    const std::optional<double> before = levels[k].apart_h, after = levels[k + 1].apart_h;
    if (before && after && std::isfinite(*before)) falls_by = std::min(falls_by, *before / *after);
  }
  if (!std::isfinite(falls_by) || !(falls_by > 1)) return kNotKnown;
  return std::max(last, last / (falls_by - 1));
}

std::string known_to(std::span<const RefinementLevel> levels) {
  const double known = remaining_error(levels);
  if (std::isfinite(known)) return fmt::format("known to {:.2g} h", known);
  const bool all_compare =
      std::all_of(levels.begin() + (levels.empty() ? 0 : 1), levels.end(),
                  [](const RefinementLevel& level) { return level.apart_h && std::isfinite(*level.apart_h); });
  if (!all_compare) {
    return "not known: between its levels tissue falls into other parts, or the blade arrives in another frame";
  }
  return last_three_remove_the_same(levels)
             ? "not known: distances between its levels do not keep falling"
             : "not known: its last three levels do not remove the same particles in the same frames";
}

ReferenceSolution::ReferenceSolution(ReferenceKind kind, const Scene& scene, std::string source,
                                     std::optional<int64_t> frames, double known, StopAsked stop_asked)
    : kind_(kind), scene_(scene), source_(std::move(source)), frames_(frames), stop_asked_(std::move(stop_asked)) {
  scene_.skin.wanted = false;  // the skin moves nothing
  scene_.step.acceleration = Acceleration::none;
  setup_ = benchmarks::PreparedScene(scene_, source_, frames_).setup();
  // The first three always run, because only the third shows the rate of convergence. With the scene's own substeps the
  // solved level also runs, as it comes last. They are independent, so they run at once: the third takes as long as
  // both others or longer, and the solved one about as long.
  const RefinementLevel first = level_after(nullptr), second = level_after(&first), third = level_after(&second);
  if (kind_ == ReferenceKind::substeps) solved_ = start(solved_level());
  std::future<Ran> finest = start(third);
  take(run(first));
  take(run(second));
  take(finest.get());
  const auto is_allowed = [](const RefinementLevel& next) {
    return next.substeps <= kMostSubsteps && next.iterations.value_or(0) <= kMostIterations;
  };
  while (known_to_h() > known && !is_last()) {
    RefinementLevel next = level_after(&levels_.back());
    if (!is_allowed(next)) {
      if (kind_ == ReferenceKind::limit) break;
      next = solved_level();
    }
    take(next.iterations ? run(next) : solved_.get());
  }
  // No other work may run during measurements of times.
  if (solved_.valid()) solved_.wait();
}

RefinementLevel ReferenceSolution::level_after(const RefinementLevel* before) const {
  RefinementLevel level;
  if (kind_ == ReferenceKind::substeps) {
    level.substeps = scene_.step.substeps;
    level.iterations =
        before == nullptr ? std::max(kLeastIterations, scene_.step.iterations) : 2 * before->iterations.value();
  } else {
    level.substeps = before == nullptr ? std::max(kLeastSubsteps, 4 * scene_.step.substeps) : 2 * before->substeps;
    level.iterations = enough_iterations(setup_.step, scene_.frame_length, level.substeps);
  }
  return level;
}

RefinementLevel ReferenceSolution::solved_level() const {
  RefinementLevel level;
  level.substeps = scene_.step.substeps;
  return level;
}

std::future<ReferenceSolution::Ran> ReferenceSolution::start(RefinementLevel level) const {
  return std::async(std::launch::async, [this, level] { return run(level); });
}

ReferenceSolution::Ran ReferenceSolution::run(RefinementLevel level) const {
  Scene scene = scene_;
  scene.step.substeps = level.substeps;
  scene.step.iterations = level.iterations.value_or(scene.step.iterations);
  const benchmarks::PreparedScene prepared(scene, source_, frames_);
  SolvedSteps solved;
  const std::unique_ptr<Backend> iterated = reference::make_backend();
  Backend& backend = level.iterations ? *iterated : solved;
  Trajectory trajectory;
  trajectory.stroke_end = prepared.stroke_end();
  prepared.run(backend, [&](double) {
    throw_if_asked(stop_asked_);
    oracles::add_pose(trajectory.frames, prepared.setup(), backend.snapshot().front());
    return true;
  });
  level.solved = solved.count();
  return {level, std::move(trajectory)};
}

void ReferenceSolution::take(Ran next) {
  auto& [level, trajectory] = next;
  if (levels_.empty()) {
    levels_.push_back(level);
    trajectory_ = std::move(trajectory);
    return;
  }
  double apart = 0;
  for (std::size_t f = 0; f < std::min(trajectory.frames.size(), trajectory_.frames.size()); ++f) {
    apart = std::max(apart, oracles::poses_apart(setup_, trajectory.frames[f], trajectory_.frames[f]).position.rms());
  }
  // Distances mean nothing between levels whose tissue falls into other parts, or whose blades arrive in other frames.
  if (!difference_in_parts(trajectory, trajectory_).empty() || trajectory.frames.size() != trajectory_.frames.size())
    apart = std::numeric_limits<double>::infinity();
  level.apart_h = apart;
  level.events = events_apart(trajectory, trajectory_);
  levels_.push_back(level);
  trajectory_ = std::move(trajectory);
}

void ReferenceSolution::refine() {
  if (is_last()) return;
  if (kind_ == ReferenceKind::limit) {
    take(run(level_after(&levels_.back())));
  } else {
    take(solved_.get());
  }
}

bool ReferenceSolution::nothing_removed() const {
  return std::all_of(trajectory_.frames.begin(), trajectory_.frames.end(), [](const oracles::Pose& pose) {
    return std::find(pose.alive.begin(), pose.alive.end(), 0) == pose.alive.end();
  });
}

}  // namespace cutproof::tuning
