// A small scene, run and recorded, with whatever a test does to its snapshots, and judged as `cutproof check` judges
// it.
#pragma once
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fixtures/build.h"
#include "harness/frame_runner.h"
#include "harness/recorded_run.h"
#include "harness/scene_judge.h"
#include "model/io/recording.h"
#include "model/io/scene_io.h"

namespace cutproof::tests {

struct RecordedScene {
  Scene scene;
  fixtures::Built built;
  std::vector<io::Snapshot> snapshots;  // the first as loaded, then one after each span that the backend ran
  harness::Trace trace;                 // the same as it was seen live
  std::vector<Verdict> broken_contracts;
  std::array<bool, 6> left_to_reference = {};  // as it is recorded

  // `adapt` may change what is loaded.
  RecordedScene(
      const std::string& json, Backend& backend,
      const std::function<void(Setup&, State&)>& adapt = [](Setup&, State&) {})
      : scene(io::parse_scene(json, "the test's scene")), built(fixtures::build(scene, "the test's scene")) {
    adapt(built.setup, built.state);
    left_to_reference = harness::left_to_reference(backend);
    harness::FrameRunner runner(backend, {built.setup}, {built.state});
    trace.initial = runner.states().front();
    snapshots.push_back({Stage::skin, *trace.initial});
    while (!runner.is_over()) {
      runner.run_frame([&](const harness::Moment& moment) {
        trace.moments.push_back(moment);
        snapshots.push_back({moment.span.last, *moment.after});
      });
    }
    broken_contracts = runner.take_broken_contracts();
  }

  // As somebody else may have recorded it: the ends of frames alone.
  void keep_ends_of_frames() {
    std::erase_if(snapshots, [](const io::Snapshot& s) { return s.stage != Stage::skin; });
  }
  // The first snapshot after `stage`, of a frame that removes something or of one that does not.
  State& first(Stage stage, bool cutting) {
    const auto found = std::find_if(snapshots.begin() + 1, snapshots.end(), [&](const io::Snapshot& s) {
      return s.stage == stage && s.state.removed.empty() != cutting;
    });
    if (found == snapshots.end()) throw std::logic_error("the scene has no such snapshot");
    return found->state;
  }

  // Through the files of a recording.
  std::unique_ptr<harness::SceneJudge> judged() {
    const auto folder = std::filesystem::temp_directory_path() / ("cutproof.recorded." + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    const std::string name = (folder / "r").string();
    {
      io::Recorder recorder(name, built.setup, io::write_scene(scene), "a backend", left_to_reference);
      for (const io::Snapshot& snapshot : snapshots) recorder.add(snapshot.stage, snapshot.state);
      recorder.finish();
    }
    std::unique_ptr<harness::SceneJudge> judge;
    {
      const io::RecordingReader reader(name);
      const auto initial = std::make_shared<const State>(reader.snapshot(0).state);
      judge = std::make_unique<harness::SceneJudge>(built.setup, scene.expect, "a backend", initial);
      for (Verdict& wrong : harness::walk_recording(
               reader, initial, [&](const harness::Moment& moment) { judge->see(moment); },
               [](const harness::FrameResult&) {})) {
        judge->add(std::move(wrong));
      }
      judge->finish();
    }
    std::filesystem::remove_all(folder);
    return judge;
  }
};

// The properties that fail, each once, in order.
inline std::vector<std::string> failing(const harness::SceneJudge& judge) {
  std::vector<std::string> names;
  for (const Verdict& verdict : judge.verdicts()) {
    if (!verdict.holds && std::find(names.begin(), names.end(), verdict.property) == names.end()) {
      names.push_back(verdict.property);
    }
  }
  return names;
}

}  // namespace cutproof::tests
