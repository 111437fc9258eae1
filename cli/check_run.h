// `cutproof check` of a run of another simulator.
#pragma once
#include "cli/check_state.h"
#include "model/io/run_segments.h"

namespace cutproof::cli {

// `segments`: of the run in `file`, which is read again for a page. Returns the exit status: 0 if all verdicts hold, 1
// otherwise. Throws InputError if a segment cannot be read.
int check_run(io::RunSegments segments, const std::string& file, const StateReports& reports);

}  // namespace cutproof::cli
