// What the two targets on recordings share: a small recording, and what must hold of one that is read.
#pragma once
#include <array>
#include <string>
#include <string_view>

#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {

// The files of a recording that its reader opens, as bytes: index, particles, skin.
using RecordingBytes = std::array<std::string, 3>;

// Of a run of the reference: a block of 3 × 2 × 2 particles with ground and grip, cut by a blade; two frames.
const RecordingBytes& small_recording();

// Where the file `part` of the recording that is fed to the reader lies.
std::string recording_path(std::size_t part);
void write_recording_part(std::size_t part, std::string_view bytes);

// Reads the recording at recording_path(). What is read must be fit to be recorded again, and must then be the same.
Outcome read_recording();

}  // namespace cutproof::input_fuzzing
