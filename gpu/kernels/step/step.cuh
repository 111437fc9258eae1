// Stage step (docs/design/method.md §3, §13): position-based dynamics with shape matching, one DeviceView of bodies.
// This file has its kernels and launches them; the other files of this folder implement them.
//
// The particles of a carried group are at d~ + M(r) - l e. Here d~ is the predicted displacement, e = d~ - base, and
// r = X - X_g. The number l belongs to body and iteration, the affine map M to the group. A prediction follows from the
// map of the substep before in the same way. So a frame touches particles twice, in begin_first_substep_kernel and in
// end_step_kernel. Between these a substep touches groups (begin_substep_kernel). An iteration touches clusters
// (match_shapes_kernel), whose sums are made of the moments of groups. It then touches groups (advance_kernel): the
// mean goal of a group's holders gives its next map, and the map its next moments.
//
// A group that may touch a contact is resolved: to the end of the substep its particles have positions of their own. To
// the end of the frame it is tracked: each substep begins with its particles, as it does with loose particles.
#pragma once
#include <type_traits>

#include "gpu/kernels/carried_tissue.cuh"
#include "gpu/kernels/frame.cuh"
#include "gpu/kernels/step/bodies.cuh"
#include "gpu/kernels/step/carried.cuh"
#include "gpu/kernels/step/goals.cuh"
#include "gpu/kernels/step/group_frame.cuh"
#include "gpu/kernels/step/groups.cuh"
#include "gpu/kernels/step/lists.cuh"
#include "gpu/kernels/step/loose.cuh"
#include "gpu/kernels/step/match_shapes.cuh"
#include "gpu/kernels/step/pace.cuh"
#include "gpu/kernels/step/resolved.cuh"
#include "gpu/kernels/step/tracked.cuh"
#include "gpu/kernels/step/untouched.cuh"
#include "gpu/kernels/step/work.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "gpu/state/plan.h"
#include "model/stage.h"

namespace cutproof::gpu {

// Clears a frame's counts, and computes the numbers of its bodies. The first kernel of a span that begins with the
// step.
template <class Block>
CUTPROOF_DEVICE void begin_frame_kernel(Block& block, const DeviceView& w, Span span) {
  using namespace step_detail;
  begin_span(block, w, span);
  if (block.first() == 0) {
    w.counters->removed = 0;
    w.counters->debris = 0;
    w.counters->affected = 0;
    *resolved_before(w, 0, 0) = 0;
    w.counters->tracked[0] = w.counters->newly_tracked[0] = w.counters->newly_tracked[1] = 0;
  }
  for (int64_t b = block.first(); b < w.bodies; b += block.stride()) {
    if (running(w, static_cast<int>(b))) w.cut[b] = -1;
    const Pace pace = pace_of(w, static_cast<int>(b));
    w.pace[b] = pace;
    store_numbers(w, static_cast<int>(b), pace);
  }
  for (int64_t i = block.first(); i < w.particles; i += block.stride()) {
    const int p = static_cast<int>(i);
    const int b = body_index(w, p);
    if (!running(w, b)) continue;
    // Every frame counts its own impulse and removals.
    w.impulse[p] = Float4{};
    const int death = w.death[p];
    if (death >= 2 * w.frame[b] && death != kDeadBefore) w.death[p] = kDeadBefore;
  }
}
CUTPROOF_KERNEL(begin_frame_kernel);

// Begins the first substep of a frame. kLanes: lanes that share a group.
template <bool kContacts, bool kRetarded, int kLanes, class Block>
CUTPROOF_DEVICE void begin_first_substep_kernel(Block& block, const DeviceView& w) {
  using namespace step_detail;
  const Team<Block, kLanes> team(block);
  const int groups = w.counters->groups, loose = w.counters->loose;
  for (int64_t g = team.first(); g < groups; g += team.stride()) {
    begin_group<kContacts, kRetarded>(block, team, w, static_cast<int>(g));
  }
  const Team<Block, 1> thread(block);
  for (int64_t k = first_job(thread, groups * team.kLanes); k < loose; k += thread.stride()) {
    begin_loose<kContacts, kRetarded>(w, w.loose_places[k], 0);
  }
}

template <bool kContacts, bool kRetarded, int kLanes>
struct begin_first_substep_kernel_object {
  static constexpr const char* kName = "begin_first_substep_kernel";
  static constexpr int kMaxThreads = 128, kMinBlocks = 4;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w) const {
    begin_first_substep_kernel<kContacts, kRetarded, kLanes>(block, w);
  }
};

// Ends the previous substep and begins `substep`, not the first one, for the bodies that have it. kRows: lanes that
// share an untouched group.
template <bool kContacts, bool kRetarded, int kRows, class Block>
CUTPROOF_DEVICE void begin_substep_kernel(Block& block, const DeviceView& w, int substep) {
  using namespace step_detail;
  const Team<Block, kRows> rows(block);
  // A warp, and its teams for tracked groups. These are many where a grip holds a part of a large body.
  const Team<Block, kResolvedTeam> warp(block);
  const Team<Block, kResolvedLanes<kRows>> team(block);
  const int groups = w.counters->groups, loose = w.counters->loose;
  // Warps go on together, as in advance_kernel.
  const int64_t in_warp = rows.first() % (warp.kLanes / rows.kLanes);
  int64_t next_group = rows.first();
  [[maybe_unused]] int64_t next_tracked = first_job(team, groups * rows.kLanes);
  [[maybe_unused]] unsigned found = 0;
  [[maybe_unused]] int tracked = -1;
  while (true) {
    [[maybe_unused]] bool begins = false;
    [[maybe_unused]] int g = -1;
    if (found != 0) {
      begins = true;
      g = take_each(warp, team, found, static_cast<int>(next_group - rows.stride()));
    } else if (next_group - in_warp < groups) {
      const bool touches = next_group < groups &&
                           begin_untouched<kContacts, kRetarded>(block, rows, w, static_cast<int>(next_group), substep);
      if constexpr (kContacts) {
        found = warp.found(touches && rows.leads());
        warp.sync();  // all lanes read the base of the group
      }
      next_group += rows.stride();
      continue;
    }
    if constexpr (kContacts) {
      if (tracked < 0) {
        block.wait_for_earlier();
        tracked = tracked_before(w, substep);
      }
      if (!begins) {
        if (next_tracked >= tracked) break;
        g = block.load(&w.tracked_groups[next_tracked]);
        next_tracked += team.stride();
      }
      if (g >= 0) begin_tracked<kRetarded>(block, team, w, g, substep, tracked, begins);
    } else {
      break;
    }
  }
  block.wait_for_earlier();
  if (kContacts && block.first() == 0) {
    w.counters->tracked[substep % 2] = tracked;
    block.store(&w.counters->newly_tracked[(substep + 1) % 3], 0);
  }
  const Team<Block, 1> thread(block);
  for (int64_t k = first_job(thread, busy_threads(rows, groups, team, tracked)); k < loose; k += thread.stride()) {
    begin_loose<kContacts, kRetarded>(w, w.loose_places[k], substep);
  }
}

template <bool kContacts, bool kRetarded, int kRows>
struct begin_substep_kernel_object {
  static constexpr const char* kName = "begin_substep_kernel";
  static constexpr int kMaxThreads = 128, kMinBlocks = 4;
  static constexpr bool kReadsAhead = true;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w, int substep) const {
    begin_substep_kernel<kContacts, kRetarded, kRows>(block, w, substep);
  }
};

// Advances groups and loose particles by an iteration. kRows: lanes that share a carried group.
template <bool kContacts, bool kAccelerated, bool kRetarded, int kRows, class Block>
CUTPROOF_DEVICE void advance_kernel(Block& block, const DeviceView& w, int substep, int iteration) {
  using namespace step_detail;
  const Team<Block, kRows> rows(block);
  // A warp, and its teams for resolved groups, as in begin_substep_kernel.
  const Team<Block, kResolvedTeam> warp(block);
  const Team<Block, kResolvedLanes<kRows>> team(block);
  const int groups = w.counters->groups, loose = w.counters->loose;
  const int resolved = kContacts ? *resolved_before(w, substep, iteration) : 0;
  // The lanes of a warp go on together. Where a group is no longer clear, teams of the whole warp resolve it. Behind
  // the warps that have carried groups, others advance the groups that were resolved before. Both go through one call,
  // because its code is long.
  const int64_t in_warp = rows.first() % (warp.kLanes / rows.kLanes);
  int64_t next_group = rows.first(), next_resolved = first_job(team, groups * rows.kLanes);
  [[maybe_unused]] unsigned found = 0;
  while (true) {
    [[maybe_unused]] bool begins = false;
    [[maybe_unused]] int g = -1;
    if (found != 0) {
      begins = true;
      g = take_each(warp, team, found, static_cast<int>(next_group - rows.stride()));
    } else if (next_group - in_warp < groups) {
      const bool touches = next_group < groups && advance_carried<kContacts, kAccelerated, kRetarded>(
                                                      block, rows, w, static_cast<int>(next_group), substep, iteration);
      if constexpr (kContacts) found = warp.found(touches && rows.leads());
      next_group += rows.stride();
      continue;
    } else if (next_resolved < resolved) {
      g = block.load(&w.resolved_groups[next_resolved]);
      next_resolved += team.stride();
    } else {
      break;
    }
    if constexpr (kContacts) {
      if (g >= 0) {
        advance_resolved<kContacts, kAccelerated, kRetarded>(block, team, w, group_ahead<kHoldersAtOnce<kRows>>(w, g),
                                                             substep, iteration, begins);
      }
    }
  }
  if (loose == 0) return;
  const Team<Block, 1> thread(block);
  for (int64_t k = first_job(thread, busy_threads(rows, groups, team, resolved)); k < loose; k += thread.stride()) {
    advance_loose<kContacts, kAccelerated, kRetarded, kHoldersAtOnce<kRows>>(block, w, w.loose_places[k], substep,
                                                                             iteration);
  }
}

template <bool kContacts, bool kAccelerated, bool kRetarded, int kRows>
struct advance_kernel_object {
  static constexpr const char* kName = "advance_kernel";
  static constexpr int kMaxThreads = 128, kMinBlocks = kRows > 1 ? 3 : 4;
  static constexpr bool kReadsAhead = true;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w, int substep, int iteration) const {
    advance_kernel<kContacts, kAccelerated, kRetarded, kRows>(block, w, substep, iteration);
  }
};

// Stores the final state of all particles. kLanes: lanes that share a group; no sum depends on them.
template <bool kContacts, bool kRetarded, int kLanes, class Block>
CUTPROOF_DEVICE void end_step_kernel(Block& block, const DeviceView& w) {
  using namespace step_detail;
  const Team<Block, kLanes> team(block);
  const int groups = w.counters->groups;
  for (int64_t g = team.first(); g < groups; g += team.stride()) {
    end_group<kContacts, kRetarded>(team, w, static_cast<int>(g));
  }
  const Team<Block, 1> thread(block);
  for (int64_t k = first_job(thread, groups * team.kLanes); k < w.counters->loose; k += thread.stride()) {
    finish_loose<kContacts, kRetarded>(w, w.loose_places[k]);
  }
}

template <bool kContacts, bool kRetarded, int kLanes>
struct end_step_kernel_object {
  static constexpr const char* kName = "end_step_kernel";
  static constexpr int kMaxThreads = 128, kMinBlocks = 5;
  template <class Block>
  CUTPROOF_DEVICE void operator()(Block& block, const DeviceView& w) const {
    end_step_kernel<kContacts, kRetarded, kLanes>(block, w);
  }
};

namespace step_detail {

template <bool kContacts, bool kAccelerated, bool kRetarded, class Launcher>
void enqueue(Launcher& launcher, const DeviceView& w, const Plan& plan, Span span) {
  const int64_t particles = w.particles > w.bodies ? w.particles : w.bodies;
  const int64_t of_places = (w.place_capacity + kParticleTeam - 1) / kParticleTeam;
  const int64_t teams = w.group_capacity > of_places ? w.group_capacity : of_places;
  launcher.items(begin_frame_kernel_object{}, particles, w, span);
  if (!span.is_whole_frame()) enqueue_groups_if_stale(launcher, w);
  // In a small load a lane has each row of a group's map. In a large load a thread has all rows: there are enough
  // groups for all threads.
  const auto by_rows = [&](auto start) {
    if (w.particles > kMostByRows) return start(std::integral_constant<int, 1>{});
    start(std::integral_constant<int, kRowTeam>{});
  };
  const auto by_clusters = [&](auto start) {
    if (w.slots_expected > kFewClusters) return start(std::integral_constant<int, kHalfTeam>{});
    start(std::integral_constant<int, kClusterTeam>{});
  };
  // The same for the lanes that share a group's particles.
  const auto by_particles = [&](auto start) {
    by_rows([&](auto rows) {
      constexpr int kLanes = rows.value == 1 ? kParticleTeam / 2 : kParticleTeam;
      start(std::integral_constant<int, kLanes>{});
    });
  };
  by_particles([&](auto lanes) {
    launcher.teams(begin_first_substep_kernel_object<kContacts, kRetarded, lanes.value>{}, lanes.value, teams, w);
  });
  for (int substep = 0; substep < plan.substeps; ++substep) {
    if (substep > 0) {
      by_rows([&](auto rows) {
        launcher.teams(begin_substep_kernel_object<kContacts, kRetarded, rows.value>{}, kParticleTeam, teams, w,
                       substep);
      });
    }
    for (int iteration = 0; iteration < plan.iterations; ++iteration) {
      by_clusters([&](auto lanes) {
        constexpr int kTeams = kMatchThreads / lanes.value;
        by_volume(w.keeps_volume != 0, [&](auto volume) {
          launcher.blocks(match_shapes_kernel_object<lanes.value, volume.value>{},
                          (w.slots_expected + kTeams - 1) / kTeams, kMatchThreads, kMatchShared<lanes.value>, w,
                          substep, iteration);
        });
      });
      by_rows([&](auto rows) {
        launcher.teams(advance_kernel_object<kContacts, kAccelerated, kRetarded, rows.value>{}, kParticleTeam, teams, w,
                       substep, iteration);
      });
    }
  }
  by_particles([&](auto lanes) {
    launcher.teams(end_step_kernel_object<kContacts, kRetarded, lanes.value>{}, lanes.value, teams, w);
  });
}

template <class Launcher>
void enqueue(Launcher& launcher, const DeviceView& w, const Plan& plan, Span span) {
  if (plan.retarded) {
    enqueue<true, true, true>(launcher, w, plan, span);
  } else if (plan.contacts && plan.accelerated) {
    enqueue<true, true, false>(launcher, w, plan, span);
  } else if (plan.contacts) {
    enqueue<true, false, false>(launcher, w, plan, span);
  } else if (plan.accelerated) {
    enqueue<false, true, false>(launcher, w, plan, span);
  } else {
    enqueue<false, false, false>(launcher, w, plan, span);
  }
}

}  // namespace step_detail

// All substeps of a frame of every running body. span: the one that begins with this step.
template <class Launcher>
void enqueue_step(Launcher& launcher, const DeviceView& w, const Plan& plan, Span span) {
  step_detail::enqueue(launcher, w, plan, span);
}

}  // namespace cutproof::gpu
