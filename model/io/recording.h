// Recordings: temporal VTKHDF 2.0, one file per dataset (particles, skin, blade) and an index file (architecture.md,
// Recordings; docs/recording.md).
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "model/setup.h"
#include "model/stage.h"
#include "model/state.h"

namespace cutproof::io {

// One moment of one body. A frame in which nothing was removed has one snapshot, after its last stage; a frame with
// removals has one after each stage that ran from detect on. Snapshot 0 is the state as loaded (stage: skin).
struct Snapshot {
  Stage stage = Stage::skin;
  State state;
};

// F names a folder-less stem: F.cutproof.h5 is the index; F.particles.vtkhdf, F.skin.vtkhdf, F.blade.vtkhdf are for
// ParaView. `--record F` may be given with or without ".cutproof.h5".
struct RecordingPaths {
  std::string index, particles, skin, blade;
};
RecordingPaths recording_paths(const std::string& name);

// Writes as it goes, to temporary names; finish() renames all of them, and without it nothing is left behind. One
// recorder holds one body.
class Recorder {
 public:
  // scene_json and backend are kept as they are.
  Recorder(const std::string& name, const Setup& setup, const std::string& scene_json, const std::string& backend);
  ~Recorder();
  void add(Stage stage, const State& state);
  void finish();

 private:
  struct File;
  std::unique_ptr<File> file_;
};

// Everything that was recorded, bit for bit: the setup, and every snapshot.
struct Recording {
  Setup setup;
  std::string scene_json;
  std::string backend;
  int64_t snapshot_count = 0;
};

class RecordingReader {
 public:
  // Throws InputError if the file is missing, cut off, not a recording, of a newer version, or inconsistent
  // (offsets that decrease, particles out of range, …).
  explicit RecordingReader(const std::string& name);
  ~RecordingReader();
  const Recording& header() const;
  Snapshot snapshot(int64_t index) const;

 private:
  struct File;
  std::unique_ptr<File> file_;
};

}  // namespace cutproof::io
