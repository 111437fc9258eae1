#include "tuning/verification.h"

#include <fmt/format.h>

#include <utility>

#include "harness/frame_runner.h"
#include "harness/scene_judge.h"
#include "model/io/scene_io.h"
#include "tuning/comparison.h"

namespace cutproof::tuning {

Verified verify(const Measuring& measuring, const ReferenceSolution& reference, const Configuration& configuration,
                const std::string& text, const std::string& path) {
  Verified verified;
  verified.trial.configuration = configuration;
  const Scene scene = io::parse_scene(text, path);
  const std::unique_ptr<Backend> backend = measuring.backend_for(configuration);
  const PreparedScene prepared(scene, path, measuring.asked.frames);
  harness::FrameRunner runner(*backend, {prepared.setup()}, {prepared.start()});
  // What a scene expects is of all of it; but isolation that it expects fails no verdict in a part of it either.
  Expectations expected = scene.expect;
  if (measuring.asked.frames) {
    expected = {};
    if (scene.expect.isolated_clusters && scene.expect.isolated_clusters->low >= 1) {
      expected.isolated_clusters = scene.expect.isolated_clusters;
    }
  }
  harness::SceneJudge judge(prepared.setup(), expected, measuring.asked.backend.name, runner.states().front());
  Comparison comparison(prepared.setup(), reference.trajectory(), measuring.allowed(reference), verified.trial);
  for (int64_t frame = 0; frame < prepared.frame_count(); ++frame) {
    throw_if_asked(measuring.asked.stop_asked);
    prepared.for_parts_of(frame, [&] { runner.run_frame([&](const harness::Moment& moment) { judge.see(moment); }); });
    comparison.add(*runner.states().front());
  }
  for (Verdict& verdict : runner.take_broken_contracts()) judge.add(std::move(verdict));
  judge.finish();
  comparison.trajectory().stroke_end = prepared.stroke_end();
  verified.verdicts = static_cast<int64_t>(judge.verdicts().size());
  const Trajectory& wanted = reference.trajectory();
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
    verified.trial.outcome = Outcome::within;
  }
  for (const Verdict& verdict : judge.verdicts()) {
    if (!verified.failure.empty()) break;
    if (verdict.holds || judge.is_expected_failure(verdict)) continue;
    verified.failure = fmt::format("{} fails in frame {}: {}", verdict.property, verdict.frame, verdict.witness.text);
  }
  return verified;
}

}  // namespace cutproof::tuning
