// The kick test from a file of arrays (docs/reference/state.md, A kick).
#pragma once
#include <string>
#include <vector>

#include "harness/named_arrays.h"
#include "oracles/relations/kick.h"

namespace cutproof::harness {

struct RecordedKick {
  oracles::KickedRuns runs;
  std::vector<double> time;        // [frames] [s]; empty: not given
  std::vector<std::string> notes;  // on ignored arrays
};

const std::vector<KnownArray>& kick_arrays();

// Throws InputError where the file cannot be understood. Numbers that are not finite are the judge's.
RecordedKick recorded_kick_of(const io::ArrayFile& contents, const std::string& file);

}  // namespace cutproof::harness
