#include "tuning/verification.h"

#include <fmt/format.h>

#include "harness/frame_runner.h"
#include "harness/judge.h"
#include "model/io/scene_io.h"
#include "tuning/comparison.h"

namespace cutproof::tuning {

Verified verify(const Measuring& measuring, const ReferenceSolution& reference, const Configuration& configuration,
                const std::string& text, const std::string& path) {
  using cli::Gate;
  Verified verified;
  verified.trial.configuration = configuration;
  const Scene scene = io::parse_scene(text, path);
  const std::unique_ptr<Backend> backend = measuring.backend_for(configuration);
  const PreparedScene prepared(scene, path, measuring.frames);
  backend->load({prepared.setup()}, {prepared.start()});
  // What a scene expects is of all of it; but isolation that it expects fails no verdict in a part of it either.
  Expectations expected = scene.expect;
  if (measuring.frames) {
    expected = {};
    if (scene.expect.isolated_clusters && scene.expect.isolated_clusters->low >= 1) {
      expected.isolated_clusters = scene.expect.isolated_clusters;
    }
  }
  Gate gate(prepared.setup(), expected, measuring.backend.name, backend->snapshot().front());
  Comparison comparison(prepared.setup(), reference.trajectory(), measuring.allowed(reference));
  for (int64_t frame = 0; frame < prepared.frame_count(); ++frame) {
    prepared.for_parts_of(
        frame, [&] { cli::run_frame(*backend, [&](Stage stage, const State& state) { gate.see(stage, state); }, {}); });
    comparison.add(backend->snapshot().front());
  }
  gate.finish();
  comparison.report(verified.trial);
  comparison.trajectory().stroke_end = prepared.stroke_end();
  verified.verdicts = static_cast<int64_t>(gate.verdicts().size());
  const Trajectory& wanted = reference.trajectory();
  if (wanted.frames.size() != comparison.trajectory().frames.size()) {
    verified.failure = "it has another number of frames than a finer reference solution";
    verified.trial.outcome = Outcome::schedule;
  } else if (verified.failure = difference_in_parts(wanted, comparison.trajectory()); !verified.failure.empty()) {
    verified.trial.outcome = Outcome::topology;
  } else if (comparison.beyond()) {
    verified.failure = fmt::format("it is {:.2g} h from a finer reference solution, known to {:.2g} h",
                                   verified.trial.greatest_rms_h, reference.known_to_h());
    verified.trial.outcome = Outcome::over;
  } else {
    verified.trial.outcome = Outcome::within;
  }
  for (const Verdict& verdict : gate.verdicts()) {
    if (!verified.failure.empty()) break;
    if (verdict.holds || gate.expected_failure(verdict)) continue;
    verified.failure = fmt::format("{} fails in frame {}: {}", verdict.property, verdict.frame, verdict.witness.text);
  }
  return verified;
}

}  // namespace cutproof::tuning
