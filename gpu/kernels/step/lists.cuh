// The lists of groups that contacts or grips have touched: tracked ones, to the end of the frame, and resolved ones, to
// the end of the substep.
#pragma once
#include "gpu/state/device_view.h"
#include "gpu/state/float3.h"

namespace cutproof::gpu::step_detail {

// DeviceView::group_tracked.
enum : int { kUntouched = 0, kTracked = 1 };

// Counts the groups of a substep that were resolved before this iteration. A group that is resolved in an iteration
// counts from the next one on. So this number does not change in an iteration, and may be read ahead.
CUTPROOF_DEVICE inline int* resolved_before(const DeviceView& w, int substep, int iteration) {
  return &w.counters->listed[substep % 2][iteration % 2];
}

// Groups that were tracked when a substep began, for begin_substep_kernel. New ones of this substep are counted apart.
// There are three counts: one is read, one counts, and one is cleared.
CUTPROOF_DEVICE inline int tracked_before(const DeviceView& w, int substep) {
  return w.counters->tracked[(substep + 1) % 2] + w.counters->newly_tracked[(substep + 2) % 3];
}

// Lists a group as resolved. iteration: the first one in which it is resolved from the beginning.
template <class AnyTeam, class Block>
CUTPROOF_DEVICE void list_resolved(Block& block, const AnyTeam& team, const DeviceView& w, const Pace& pace, int g,
                                   int substep, int iteration) {
  // A resolved group may never have had a map; lanes that read ahead read it all the same.
  team.sync();  // all lanes have read the last map
  team.each(3, [&](int axis) { w.group_map[3 * int64_t{g} + axis] = Float4{}; });
  if (!team.leads()) return;
  w.group_resolved[g] = kResolved;
  if (pace.iterations == 0) return;  // the list is neither read nor emptied
  block.store(&w.resolved_groups[block.atomic_add(resolved_before(w, substep, iteration), 1)], g);
}
// Lists a group as tracked. tracked_so_far: tracked_before() of this substep.
template <class AnyTeam, class Block>
CUTPROOF_DEVICE void list_tracked(Block& block, const AnyTeam& team, const DeviceView& w, int g, int substep,
                                  int tracked_so_far) {
  if (!team.leads()) return;
  w.group_tracked[g] = kTracked;
  block.store(&w.tracked_groups[tracked_so_far + block.atomic_add(&w.counters->newly_tracked[substep % 3], 1)], g);
}

}  // namespace cutproof::gpu::step_detail
