#include "cli/recordings.h"

#include <fmt/format.h>

#include "harness/backends.h"
#include "model/error.h"
#include "model/precision.h"

namespace cutproof::cli {

OpenRecording open_recording(const std::string& name) {
  OpenRecording opened;
  opened.reader = std::make_unique<io::RecordingReader>(name);
  const io::Recording& recording = opened.header();
  // A plugin has a precision of its own.
  const bool is_ours = !recording.backend.starts_with("plugin:");
  const harness::BackendDescriptor* const backend = is_ours ? harness::find_backend(recording.backend) : nullptr;
  if (backend != nullptr && backend->precision != recording.precision) {
    throw InputError(
        io::recording_paths(name).index, "unit_roundoff",
        fmt::format("This is {}, and the backend {} has {}.", unit_roundoff(recording.precision), backend->name,
                    unit_roundoff(backend->precision)),
        "A program that writes recordings must give its own name as `backend`; otherwise record the scene again.");
  }
  static_cast<fixtures::RecordedScene&>(opened) = fixtures::scene_of(*opened.reader, name);
  return opened;
}

}  // namespace cutproof::cli
