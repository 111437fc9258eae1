// Contents of the files for ParaView: the recorder writes them, and the reader computes them again.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "model/setup.h"
#include "model/stage.h"
#include "model/state.h"

namespace cutproof::io {

// How many frames are over in a snapshot. Within a frame (any stage but skin) the positions are already those of its
// end. ParaView sees one step for each such number: the last snapshot of several in a row.
int64_t frames_done(Stage stage, int64_t frame);

// [frames + 1] When each frame starts [s].
std::vector<double> frame_starts(const Setup& setup);
// When so many frames are over [s]; a number that no run has counts as the nearest one.
double time_after(const std::vector<double>& frame_starts, int64_t frames);

// [particles] The number of the first cluster that holds each, -1 if none does. Makes sense of any clusters, also of
// broken ones.
std::vector<int32_t> cluster_of_particles(const Clusters& clusters, std::size_t particles);

// The box around the rounded plate where the blade stands when so many frames are over: the plate's mid-surface,
// thickness / 2 wider on all sides. Nothing while the blade is up.
std::optional<std::vector<Vec3>> blade_box(const Setup& setup, int64_t frames);
// Its six quadrangles, counter-clockwise seen from outside (along, back, normal: right-handed).
inline constexpr std::array<int64_t, 7> kBoxOffsets = {0, 4, 8, 12, 16, 20, 24};
inline constexpr std::array<int64_t, 24> kBoxCorners = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4,
                                                        2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};

}  // namespace cutproof::io
