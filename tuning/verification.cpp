#include "tuning/verification.h"

#include <fmt/format.h>

#include <utility>

#include "harness/frame_runner.h"
#include "harness/scene_judge.h"
#include "model/io/scene_io.h"
#include "tuning/comparison.h"
#include "tuning/tuned_scene.h"

namespace cutproof::tuning {

JudgedRun judged_run(const Measuring& measuring, const Configuration& configuration, const std::string& path) {
  JudgedRun run;
  run.configuration = configuration;
  run.text = tuned_scene_text(configuration, measuring.asked.scene, path);
  const Scene scene = io::parse_scene(run.text, path);
  const std::unique_ptr<Backend> backend = measuring.make_backend();
  const benchmarks::PreparedScene prepared(scene, path, measuring.asked.frames);
  run.setup = prepared.setup();
  harness::FrameRunner runner(*backend, {prepared.setup()}, {prepared.start()});
  // Expectations refer to the whole scene, but expected isolation also fails no verdict in a part of it.
  Expectations expected = scene.expect;
  if (measuring.asked.frames) {
    expected = {};
    if (scene.expect.isolated_clusters && scene.expect.isolated_clusters->low >= 1) {
      expected.isolated_clusters = scene.expect.isolated_clusters;
    }
  }
  harness::SceneJudge judge(prepared.setup(), expected, measuring.asked.backend.name, runner.states().front());
  for (int64_t frame = 0; frame < prepared.frame_count(); ++frame) {
    throw_if_asked(measuring.asked.stop_asked);
    prepared.for_parts_of(frame, [&] { runner.run_frame([&](const harness::Moment& moment) { judge.see(moment); }); });
    oracles::add_pose(run.trajectory.frames, prepared.setup(), *runner.states().front());
  }
  run.trajectory.stroke_end = prepared.stroke_end();
  for (Verdict& verdict : runner.take_broken_contracts()) judge.add(std::move(verdict));
  judge.finish();
  run.verdicts = static_cast<int64_t>(judge.verdicts().size());
  for (const Verdict& verdict : judge.verdicts()) {
    if (verdict.holds || judge.is_expected_failure(verdict)) continue;
    run.failure = fmt::format("{} fails in frame {}: {}", verdict.property, verdict.frame, verdict.witness.text);
    break;
  }
  return run;
}

Verified verify(const Measuring& measuring, const ReferenceSolution& reference, JudgedRun run) {
  Verified verified;
  verified.trial.configuration = std::move(run.configuration);
  verified.verdicts = run.verdicts;
  const Trajectory& wanted = reference.trajectory();
  Comparison comparison(run.setup, wanted, measuring.allowed(reference), verified.trial);
  comparison.add(std::move(run.trajectory));
  if (wanted.frames.size() != comparison.trajectory().frames.size()) {
    verified.failure = "it has another number of frames than a finer reference solution";
    verified.trial.outcome = Outcome::schedule;
  } else if (verified.failure = difference_in_parts(wanted, comparison.trajectory()); !verified.failure.empty()) {
    verified.trial.outcome = Outcome::topology;
  } else if (comparison.beyond()) {
    verified.failure = fmt::format("it is {:.2g} h from a finer reference solution, itself {}",
                                   verified.trial.greatest_rms_h, known_to(reference.levels()));
    verified.trial.outcome = Outcome::over;
  } else {
    verified.failure = std::move(run.failure);
    verified.trial.outcome = Outcome::within;
  }
  return verified;
}

}  // namespace cutproof::tuning
