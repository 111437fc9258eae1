#include "benchmarks/timing.h"

#include "model/at.h"

namespace cutproof::benchmarks {

namespace {

// Runs the backend up to the timed frames.
void warm_up(Backend& backend, const BenchScene& scene) {
  backend.load({scene.setup}, {scene.state});
  for (int64_t frame = 0; frame < scene.warm_up; ++frame) backend.run(kWholeFrame);
  static_cast<void>(backend.report());  // waits
}

}  // namespace

Timings time_stages(Backend& backend, const BenchScene& scene, int64_t frames, bool pipelined, int64_t repeats) {
  Timings timings;
  std::vector<double> whole, cutting, back_to_back;
  for (int64_t repeat = 0; repeat < repeats; ++repeat) {
    warm_up(backend, scene);
    for (int64_t frame = 0; frame < frames; ++frame) {
      backend.run(kWholeFrame);
      const SpanReport report = backend.report();
      whole.push_back(report.total_seconds);
      if (report.ran[at(Stage::split)]) cutting.push_back(report.total_seconds);
    }
  }
  timings.frame = times_of(whole);
  timings.cutting = times_of(cutting);

  for (int64_t repeat = 0; pipelined && repeat < repeats; ++repeat) {
    warm_up(backend, scene);
    const auto begin = Clock::now();
    for (int64_t frame = 0; frame < frames; ++frame) backend.run(kWholeFrame);
    static_cast<void>(backend.report());
    back_to_back.push_back(seconds_since(begin) / static_cast<double>(frames));
  }
  timings.back_to_back = times_of(back_to_back);

  // Last, so that the backend stays at the end of the timed frames.
  std::array<std::vector<double>, 6> alone;
  for (int64_t repeat = 0; repeat < repeats; ++repeat) {
    warm_up(backend, scene);
    for (int64_t frame = 0; frame < frames; ++frame) {
      for (const Stage stage : kStages) {
        backend.run({stage, stage});
        const SpanReport report = backend.report();
        if (report.ran[at(stage)]) alone[at(stage)].push_back(report.total_seconds);
      }
    }
  }
  for (const Stage stage : kStages) timings.stage[at(stage)] = times_of(alone[at(stage)]);
  return timings;
}

std::vector<std::pair<std::string, Times>> Timings::named() const {
  std::vector<std::pair<std::string, Times>> all = {{"frame", frame}, {"frame, cutting", cutting}};
  if (back_to_back.count > 0) all.emplace_back("back to back", back_to_back);
  for (const Stage one : kStages) all.emplace_back(name_of(one), stage[at(one)]);
  return all;
}

int64_t count_added_memberships(Backend& backend, const BenchScene& scene, int64_t frames) {
  const auto memberships = [&] { return static_cast<int64_t>(backend.snapshot().front().clusters.members.size()); };
  int64_t added = 0;
  warm_up(backend, scene);
  for (int64_t frame = 0; frame < frames; ++frame) {
    backend.run({Stage::step, Stage::merge});
    const int64_t before = memberships();
    backend.run({Stage::expand, Stage::expand});
    if (backend.report().ran[at(Stage::expand)]) added += memberships() - before;
    backend.run({Stage::skin, Stage::skin});
  }
  return added;
}

}  // namespace cutproof::benchmarks
