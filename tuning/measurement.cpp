#include "tuning/measurement.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "model/error.h"
#include "tuning/comparison.h"
#include "tuning/search.h"

namespace cutproof::tuning {

namespace {

// Timed runs of each trial in a search with `full`.
constexpr int kSearchRuns = 3;

double seconds_per_frame(Backend& backend, const benchmarks::PreparedScene& scene, const StopAsked& stop_asked) {
  const auto look_up = [&](double) {
    throw_if_asked(stop_asked);
    return true;
  };
  return scene.run(backend, look_up) / static_cast<double>(scene.frame_count());
}

}  // namespace

std::unique_ptr<Backend> Measuring::make_backend() const { return harness::make_backend(asked.backend); }

Trial measure(const Measuring& measuring, const ReferenceSolution& reference, const Configuration& configuration,
              std::optional<double> limit, const std::vector<Trial>& before) {
  Trial trial;
  trial.configuration = configuration;
  const bool is_given = configuration == measuring.given, to_the_end = measuring.asked.full || is_given;
  const std::unique_ptr<Backend> backend = measuring.make_backend();
  std::optional<benchmarks::PreparedScene> scene;
  try {
    scene.emplace(configuration.scene, measuring.asked.scene, measuring.asked.frames);
  } catch (const InputError& error) {  // such as a blade that few substeps cannot follow
    if (is_given) throw;
    trial.outcome = Outcome::refused;
    trial.why = error.what();
    return trial;
  }
  const auto frames = static_cast<int64_t>(reference.trajectory().frames.size());
  const bool other_schedule = scene->frame_count() != frames;
  if (other_schedule) {
    trial.outcome = Outcome::schedule;
    trial.why = fmt::format("{} frames, the reference solution has {}", scene->frame_count(), frames);
    if (!to_the_end) return trial;
  }
  Comparison comparison(scene->setup(), reference.trajectory(), measuring.allowed(reference), trial);
  bool given_up = false;
  scene->run(*backend, [&](double seconds) {
    throw_if_asked(measuring.asked.stop_asked);
    comparison.add(backend->snapshot().front());
    if (to_the_end) return true;
    // A first run may be slower than a cheaper median.
    const bool more_expensive = limit && seconds > 1.5 * *limit * static_cast<double>(frames);
    given_up = comparison.beyond() || more_expensive;
    if (given_up) trial.outcome = comparison.beyond() ? Outcome::over : Outcome::more_expensive;
    return !given_up;
  });
  if (given_up) {
    trial.why = fmt::format("given up in frame {} of {}", trial.rms_h.size() - 1, frames);
    return trial;
  }
  comparison.trajectory().stroke_end = scene->stroke_end();
  if (!other_schedule) {
    trial.why = difference_in_parts(reference.trajectory(), comparison.trajectory());
    trial.outcome = !trial.why.empty() ? Outcome::topology : comparison.beyond() ? Outcome::over : Outcome::within;
  }
  if (trial.outcome == Outcome::within || to_the_end) {
    const int most = measuring.asked.full ? std::min(kSearchRuns, measuring.asked.repeats) : measuring.asked.repeats;
    std::vector<double> samples;
    do {
      samples.push_back(seconds_per_frame(*backend, *scene, measuring.asked.stop_asked));
      // More runs would only refine the cost of a trial that is no point of the front.
      if (measuring.asked.full && !is_given && is_behind(trial, samples.front(), before, measuring.asked.tolerance))
        break;
    } while (static_cast<int>(samples.size()) < most);
    trial.frame = benchmarks::times_of(samples);
  }
  return trial;
}

std::vector<benchmarks::Times> times_in_turns(const Measuring& measuring,
                                              const std::vector<Configuration>& configurations) {
  std::vector<benchmarks::PreparedScene> scenes;
  for (const Configuration& configuration : configurations) {
    scenes.emplace_back(configuration.scene, measuring.asked.scene, measuring.asked.frames);
  }
  const std::unique_ptr<Backend> backend = measuring.make_backend();
  const auto run = [&](std::size_t k) { return seconds_per_frame(*backend, scenes[k], measuring.asked.stop_asked); };
  if (!scenes.empty()) static_cast<void>(run(0));  // a backend's first run takes longer
  std::vector<benchmarks::Times> times;
  for (const std::vector<double>& samples : benchmarks::in_turns(measuring.asked.repeats, scenes.size(), run)) {
    times.push_back(benchmarks::times_of(samples));
  }
  return times;
}

}  // namespace cutproof::tuning
