#include <fmt/format.h>

#include <memory>
#include <optional>

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/results.h"
#include "cli/terminal.h"
#include "harness/judge.h"
#include "model/io/atomic_file.h"
#include "model/io/recording.h"
#include "model/io/scene_io.h"

namespace cutproof::cli {

namespace {

struct CheckOptions {
  std::string recording;
  std::string json;
};

// Which stages a recorded frame shows to have run: those it has snapshots of, and the ones that always run.
FrameResult frame_of(const State& last, const std::vector<Stage>& seen, const Setup& setup) {
  FrameResult frame;
  frame.frame = last.frame - 1;
  for (const Stage stage : seen) frame.ran[static_cast<std::size_t>(stage)] = true;
  frame.ran[static_cast<std::size_t>(Stage::step)] = true;
  frame.ran[static_cast<std::size_t>(Stage::detect)] = needs_detection(setup);
  frame.ran[static_cast<std::size_t>(Stage::skin)] = setup.skin.wanted;
  frame.removed = static_cast<int64_t>(last.removed.size());
  frame.debris = static_cast<int64_t>(last.debris.size());
  for (const uint8_t alive : last.alive) frame.alive += alive;
  frame.clusters = last.clusters.count();
  frame.triangles = static_cast<int64_t>(last.skin.triangles.size());
  return frame;
}

int check(const CheckOptions& options) {
  const io::RecordingReader reader(options.recording);
  const io::Recording& recording = reader.header();
  Scene scene;
  if (!recording.scene_json.empty()) scene = io::parse_scene(recording.scene_json, options.recording + " (its scene)");
  std::optional<io::AtomicFile> json_file;
  if (!options.json.empty()) json_file.emplace(options.json);

  const State initial = reader.snapshot(0).state;
  fmt::print("recording {}: scene {}, backend {}, {} snapshots of {} particles\n", options.recording,
             scene.name.empty() ? "(none)" : scene.name, recording.backend, recording.snapshot_count,
             recording.setup.body.particle_count());
  Gate gate(recording.setup, scene.expect, recording.backend, initial);
  RunResult result{"check",
                   options.recording,
                   scene.name,
                   recording.backend,
                   scene.seed,
                   recording.setup.body.name,
                   recording.setup.body.grid.spacing,
                   recording.setup.body.particle_count(),
                   initial.clusters.count(),
                   false,
                   {}};
  {
    Progress progress("frame", recording.setup.frame_count());
    std::vector<Stage> seen;
    for (int64_t index = 1; index < recording.snapshot_count; ++index) {
      const io::Snapshot snapshot = reader.snapshot(index);
      gate.see(snapshot.stage, snapshot.state);
      seen.push_back(snapshot.stage);
      if (snapshot.stage != Stage::skin) continue;
      result.frames.push_back(frame_of(snapshot.state, seen, recording.setup));
      seen.clear();
      progress.show(snapshot.state.frame, "judging");
    }
  }
  gate.finish();
  print_verdicts(gate);
  if (json_file) {
    io::write_text(json_file->temporary(), to_json(result, &gate).dump(1) + "\n");
    json_file->commit();
    fmt::print("wrote {}\n", options.json);
  }
  return gate.holds() ? 0 : 1;
}

}  // namespace

void add_check(CLI::App& program, Work& work) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* const command = program.add_subcommand("check", "judge a recording");
  command->add_option("recording", options->recording, "what --record was given")->required()->type_name("RECORDING");
  add_json(*command, options->json, "write verdicts and counts");
  command->callback([options, &work] { work = [options] { return check(*options); }; });
}

}  // namespace cutproof::cli
