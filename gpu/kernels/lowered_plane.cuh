// The plane that separates the two sides of a cut for detection and skin (docs/design/method.md §4 and §8).
#pragma once
#include "gpu/launch/launcher.h"
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu {

// The plane of the blade's mid-surface in its last lowered pose of the frame in progress.
struct Plane {
  bool exists = false;
  Float3 edge, normal;
};
CUTPROOF_DEVICE inline Plane lowered_plane(const DeviceView& w, const BodyConstants& body, int b) {
  Plane plane;
  if (!body.has_blade) return plane;
  const MoveF* const moves = w.moves + body.schedule + int64_t{w.frame[b]} * body.substeps;
  for (int s = body.substeps - 1; s >= 0 && !plane.exists; --s) {
    if (moves[s].down) plane = {true, moves[s].to.edge, cross(moves[s].to.along, moves[s].to.back)};
  }
  return plane;
}
// Signed height of x over the plane [m]. Wrong by at most 10 u |x| + 8 u |edge| (detect.cuh).
CUTPROOF_DEVICE inline float height_over(const Plane& plane, Float3 x) { return dot(x - plane.edge, plane.normal); }

}  // namespace cutproof::gpu
