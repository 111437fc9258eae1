// One frame of a backend, for those who want to look at it between its stages.
#pragma once
#include <functional>

#include "harness/frame_result.h"
#include "model/backend.h"

namespace cutproof::cli {

using SeeState = std::function<void(Stage, const State&)>;
using SeeStage = std::function<void(Stage, const State&, bool ran)>;

// Runs one frame of the only body and hands its snapshots to `see`: after every stage that ran from detect on if
// something was removed, else once, after the last stage; that is what Gate::see takes. `see_stage` is called after
// every stage. Either may be empty; if both are, the frame runs whole.
FrameResult run_frame(Backend& backend, const SeeState& see, const SeeStage& see_stage);

}  // namespace cutproof::cli
