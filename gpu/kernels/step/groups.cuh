// Groups: particles with the same holders, which the step carries together (docs/design/method.md §13). They depend on
// the clusters alone, and only those of changed clusters are made anew.
#pragma once
#include "gpu/kernels/step/make_groups.cuh"
#include "gpu/kernels/step/measure_groups.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/state/device_view.h"

namespace cutproof::gpu {

// Makes the groups of the clusters that have changed since the last call. Requires memberships in order.
template <class Launcher>
void enqueue_groups(Launcher& launcher, const DeviceView& w) {
  launcher.teams(find_changed_clusters_kernel_object{}, kMemberTeam, w.slots_expected, w);
  launcher.teams(dissolve_groups_kernel_object{}, kMemberTeam, w.slots_expected, w);
  launcher.teams(find_classes_kernel_object{}, kMemberTeam, w.slots_expected, w);
  launcher.blocks(deal_out_groups_kernel_object{}, w.slots_expected, kDealThreads, (3 * kMostDealt + 4) * sizeof(int),
                  w);
  launcher.teams(measure_groups_kernel_object{}, kGroupTeam, w.group_capacity, w);
  launcher.teams(measure_clusters_kernel_object{}, kMemberTeam, w.slots_expected, w);
  launcher.clear(&w.counters->groups_stale, 6 * sizeof(int));  // and the five counters behind it
}

// The same if any cluster has changed, for callers that do not know it.
template <class Launcher>
void enqueue_groups_if_stale(Launcher& launcher, const DeviceView& w) {
  Counters* const c = w.counters;  // an address only: counters lie on the device
  launcher.if_nonzero(&c->groups_stale, [&](Launcher& stale) { enqueue_groups(stale, w); });
}

}  // namespace cutproof::gpu
