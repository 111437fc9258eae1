// A recording as a run: the same moments that a backend's run shows, from files.
#pragma once
#include <vector>

#include "harness/moments.h"
#include "model/io/recording.h"

namespace cutproof::harness {

// Shows every snapshot after the first as the moment since the one before it; one with a stage that was left to the
// reference is not the backend's. `frame_done` is called after the moment that ends a frame, with what the frame shows
// to have run. Returns what is wrong with the order of the snapshots. Throws InputError if a part of a file is damaged.
std::vector<Verdict> walk_recording(const io::RecordingReader& reader, const Snapshot& initial, const Observer& observe,
                                    const std::function<void(const FrameResult&)>& frame_done);

}  // namespace cutproof::harness
