// Recordings: temporal VTKHDF 2.0, one file per dataset (particles, skin, blade) and an index file
// (docs/reference/recording.md).
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/setup.h"
#include "model/stage.h"
#include "model/state.h"

namespace cutproof::io {

// The only version that is written and read.
inline constexpr int32_t kFormatVersion = 9;

// One moment of one body: the state after a span of stages. A full recording has one after each due stage and at the
// end of each frame; a short one may have the ends of frames alone. Snapshot 0 is the state as loaded (stage: skin).
struct Snapshot {
  Stage stage = Stage::skin;
  State state;
};

// HDF5 keeps global state: recorders and readers are used from one thread.

// F is a name, with or without a folder: F.cutproof.h5 is the index; F.particles.vtkhdf, F.skin.vtkhdf, F.blade.vtkhdf
// are for ParaView. `--record F` may be given with or without ".cutproof.h5".
struct RecordingPaths {
  std::string index, particles, skin, blade;
};
RecordingPaths recording_paths(const std::string& name);

// Writes to temporary names; finish() renames all of them, the index last. Without finish() no file is left. Fields
// that did not change from the previous snapshot are stored once. One recorder records one body.
class Recorder {
 public:
  // scene_json and backend are kept as they are. `left_to_reference`: as Recording has it. `frames_asked`: the run was
  // asked to stop after so many of the scene's frames, which are not all of them; nothing: it goes to the scene's end.
  // `promises`: as Recording has it. Throws InputError if the folder is not there or not writable, before anything else
  // is done; std::invalid_argument if the setup is not valid; MachineError if the disk fails.
  Recorder(const std::string& name, const Setup& setup, const std::string& scene_json, const std::string& backend,
           std::array<bool, 6> left_to_reference = {}, std::optional<int64_t> frames_asked = {},
           const std::string& promises = "*");
  ~Recorder();
  // The contents of a state may be anything (an oracle is to judge them), but its arrays must have the lengths of the
  // setup and of each other: std::invalid_argument otherwise. Throws MachineError if the disk fails, is full, …; the
  // recorder is then good for nothing more.
  void add(Stage stage, const State& state);
  // Throws MachineError as add() does.
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
  std::array<bool, 6> left_to_reference = {};  // by stage: the backend cannot run it, the reference did
  std::string promises = "*";                  // words of harness/promises.h with blanks between them; "*": all
  Precision precision = Precision::binary64;   // of all states
  int64_t snapshot_count = 0;
  std::optional<int64_t> frames_asked;  // as the recorder was told
  // Whether scene, frames_asked, setup and the first snapshot are those that were recorded, to the bit.
  bool begins_as_recorded = false;
};

class RecordingReader {
 public:
  // Throws InputError if the file is missing, cut off, not a recording, of another version, or inconsistent.
  // Inconsistent are sizes and rows that do not fit each other, a setup with particles out of range or NaN, files for
  // ParaView that show another run than the index, …. What a snapshot's state contains is not judged, nor whether the
  // setup is the scene's (fixtures/recorded_scene.h). The particles and skin files must be beside the index; the
  // blade's is not needed.
  explicit RecordingReader(const std::string& name);
  ~RecordingReader();
  const Recording& header() const;
  // 0 <= index < snapshot_count, std::out_of_range otherwise. Throws InputError if that part of a file is damaged, or
  // if the particles file shows other clusters than the index.
  Snapshot snapshot(int64_t index) const;

 private:
  struct File;
  std::unique_ptr<File> file_;
};

}  // namespace cutproof::io
