// A recording as a subcommand opens it: one that contradicts itself is refused.
#pragma once
#include <memory>
#include <string>

#include "fixtures/recorded_scene.h"
#include "model/io/recording.h"

namespace cutproof::cli {

struct OpenRecording : fixtures::RecordedScene {
  std::unique_ptr<io::RecordingReader> reader;
  const io::Recording& header() const { return reader->header(); }
};

// Throws InputError as the reader and fixtures::scene_of() do, and if a backend of ours is said to have computed in
// another precision than it has.
OpenRecording open_recording(const std::string& name);

}  // namespace cutproof::cli
