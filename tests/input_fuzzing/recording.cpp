// Recordings whose files are any bytes: damage, mostly, which HDF5's checksums notice. Bytes: a digit that says which
// file ('0' index, '1' particles, '2' skin), then that file; the two others are sound.
#include "model/io/recording.h"

#include <algorithm>
#include <memory>

#include "fixtures/build.h"
#include "model/backend.h"
#include "model/io/scene_io.h"
#include "reference_cpu/reference.h"
#include "tests/input_fuzzing/recording_target.h"
#include "tests/model/recording_bits.h"

namespace cutproof::input_fuzzing {
namespace {

constexpr const char* kScene = R"({
  "version": 5, "name": "small",
  "body": {"shape": {"kind": "box", "size": [0.03, 0.02, 0.02]}, "spacing": 0.01, "fit_skin": false},
  "clusters": {"side": 2},
  "frame": {"count": 2},
  "step": {"substeps": 2, "iterations": 2, "acceleration": "none", "gravity": [0, 0, -9.81]},
  "detect": {"criterion": "geometric"},
  "skin": {"fit_cuts": false},
  "ground": {"friction": 0.5},
  "grips": [{"low": [0, 0, 0], "high": [0.2, 1, 1], "end": 0.02}],
  "blade": {"speed": 2, "strokes": [{"points": [[0.4, 0.5, 1.5], [0.4, 0.5, -0.5]], "along": [0, 1, 0]}]}
})";

std::array<std::string, 3> files_of(const std::string& name) {
  const io::RecordingPaths paths = io::recording_paths(name);
  return {paths.index, paths.particles, paths.skin};
}

RecordingBytes made_recording() {
  const Scene scene = io::parse_scene(kScene, "small.json");
  const fixtures::Built built = fixtures::build(scene, "small.json");
  const auto backend = reference::make_backend();
  backend->load({built.setup}, {built.state});
  io::Recorder recorder(scratch_path("small"), built.setup, kScene, backend->name());
  recorder.add(Stage::skin, backend->snapshot().front());
  bool cut = false;
  for (int64_t frame = 0; frame < built.setup.frame_count(); ++frame) {
    for (const Stage stage : kStages) {
      backend->run({stage, stage});
      if (stage < Stage::detect || !backend->report().ran[static_cast<std::size_t>(stage)]) continue;
      recorder.add(stage, backend->snapshot().front());
      cut |= !backend->snapshot().front().removed.empty();
    }
  }
  if (!cut) broken_contract("the blade of the small recording cuts nothing");
  recorder.finish();
  RecordingBytes bytes;
  std::ranges::transform(files_of(scratch_path("small")), bytes.begin(), bytes_of_file);
  return bytes;
}

struct Contents {
  io::Recording header;
  std::vector<io::Snapshot> snapshots;
};

// The first snapshots and the last one: a file may claim any number of them.
Contents contents_of(const std::string& name) {
  const io::RecordingReader reader(name);
  Contents contents{reader.header(), {}};
  const int64_t count = contents.header.snapshot_count;
  constexpr int64_t kMost = 16;
  for (int64_t i = 0; i < std::min(count, kMost); ++i) contents.snapshots.push_back(reader.snapshot(i));
  if (count > kMost) contents.snapshots.push_back(reader.snapshot(count - 1));
  return contents;
}

std::string bits_of(const Contents& contents) {
  std::string bits = io::bits_of(contents.header.setup) + contents.header.scene_json + contents.header.backend;
  for (const io::Snapshot& snapshot : contents.snapshots) bits += io::bits_of(snapshot);
  return bits;
}

Outcome feed(std::string_view bytes) {
  if (bytes.empty() || bytes[0] < '0' || bytes[0] > '2') return Outcome::refused;
  const auto given = static_cast<std::size_t>(bytes[0] - '0');
  for (std::size_t part = 0; part < 3; ++part) {
    write_recording_part(part, part == given ? bytes.substr(1) : std::string_view(small_recording()[part]));
  }
  return read_recording();
}

std::vector<std::string> seeds() {
  std::vector<std::string> seeds;
  for (std::size_t part = 0; part < 3; ++part) seeds.push_back(std::to_string(part) + small_recording()[part]);
  return seeds;
}

}  // namespace

const RecordingBytes& small_recording() {
  static const RecordingBytes bytes = made_recording();
  return bytes;
}

std::string recording_path(std::size_t part) { return files_of(scratch_path("fed"))[part]; }

void write_recording_part(std::size_t part, std::string_view bytes) { write_scratch(files_of("fed")[part], bytes); }

Outcome read_recording() {
  return outcome_of([] {
    const Contents contents = contents_of(scratch_path("fed"));
    io::Recorder again(scratch_path("again"), contents.header.setup, contents.header.scene_json,
                       contents.header.backend, contents.header.left_to_reference, contents.header.frames_asked);
    for (const io::Snapshot& snapshot : contents.snapshots) again.add(snapshot.stage, snapshot.state);
    again.finish();
    if (bits_of(contents_of(scratch_path("again"))) != bits_of(contents)) {
      broken_contract("a recording changes when what was read of it is recorded again");
    }
  });
}

const Target kRecording = {"recording", feed, seeds};

}  // namespace cutproof::input_fuzzing
