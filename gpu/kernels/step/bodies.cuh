// Which body a particle, a cluster or a group belongs to, and where the nodes of its grid lie.
#pragma once
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// The body of a particle, a cluster and a group. (In a load of one body nothing is read from memory.)
CUTPROOF_DEVICE inline int body_index(const DeviceView& w, int p) { return w.bodies == 1 ? 0 : w.body_of[p]; }
CUTPROOF_DEVICE inline int body_of_slot(const DeviceView& w, int s) { return w.bodies == 1 ? 0 : w.slot_body[s]; }
CUTPROOF_DEVICE inline int body_of_group(const DeviceView& w, const GroupHead& head) {
  return w.bodies == 1 ? 0 : head.body;
}

CUTPROOF_DEVICE inline Float3 grid_node(const Pace& pace, int node) {
  const Coordinates c = coordinates(pace, node);
  return {static_cast<float>(c.i), static_cast<float>(c.j), static_cast<float>(c.k)};
}

// (X_p - T_s) / h of a particle p at the coordinates c.
CUTPROOF_DEVICE inline Float3 nodes_from_rest_center(const DeviceView& w, Coordinates c, int s) {
  return nodes_between(rest_center(w, s), c);
}

}  // namespace cutproof::gpu::step_detail
