// gpu/kernels: the six stages, a file each (the step a folder), and shared parts. Kernels are templates over the Block
// of launch/block.h and work on the DeviceView of state/device_view.h. Each stage has an enqueue_… that starts its
// kernels in order on a Launcher (launch/launcher.h). Nothing here depends on device or host.
//
// This file has the work around the stages: which stages are due, and at the end of a frame the order of memberships,
// the numbers of clusters and the count of frames.
#pragma once
#include "gpu/kernels/sorted_lists.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/launch/team.h"
#include "gpu/state/device_view.h"
#include "model/stage.h"

namespace cutproof::gpu {

// Whether a stage has anything to do for a body (model/backend.h, run).
CUTPROOF_DEVICE inline bool is_due(const DeviceView& w, int b, int stage) {
  const BodyConstants& body = w.body[b];
  switch (stage) {
    case static_cast<int>(Stage::step):
      return running(w, b);
    case static_cast<int>(Stage::detect):
      return running(w, b) && body.needs_detection != 0;
    case static_cast<int>(Stage::split):
      return cut_now(w, b);
    case static_cast<int>(Stage::merge):
      return cut_now(w, b) && body.merge_rule != MergeRule::none;
    case static_cast<int>(Stage::expand):
      return cut_now(w, b) && (body.expand_rule == ExpandRule::published ||
                               (body.expand_rule == ExpandRule::edge_cover && w.edge_covered[b] == 0));
    default:
      return running(w, b) && body.skin_wanted != 0;
  }
}

// A span's report of step and detect: whether some body has them due. Written by the last block of the span's first
// kernel; the first block has other work.
template <class Block>
CUTPROOF_DEVICE void begin_span(Block& block, const DeviceView& w, Span span) {
  if (block.index() != block.count() - 1) return;
  Counters& c = *w.counters;
  for (int k = block.thread(); k < static_cast<int>(kStages.size()); k += block.size()) block.store(&c.stage_ran[k], 0);
  block.sync();
  for (int b = block.thread(); b < w.bodies; b += block.size()) {
    for (int k = 0; k < 2; ++k) {
      if (span.contains(static_cast<Stage>(k)) && is_due(w, b, k)) block.store(&c.stage_ran[k], 1);
    }
  }
}
template <class Block>
CUTPROOF_DEVICE void begin_span_kernel(Block& block, const DeviceView& w, Span span) {
  begin_span(block, w, span);
}
CUTPROOF_KERNEL(begin_span_kernel);

// The report of all later stages, once detection is complete; and the conditions of a span. One block.
template <class Block>
CUTPROOF_DEVICE void note_cuts_kernel(Block& block, const DeviceView& w, Span span) {
  if (block.index() != 0) return;
  Counters& c = *w.counters;
  if (block.thread() == 0) {
    block.store(&c.expanding, 0);
    block.store(&c.changing, 0);
  }
  block.sync();
  for (int b = block.thread(); b < w.bodies; b += block.size()) {
    const auto due = [&](Stage stage) {
      const int k = static_cast<int>(stage);
      const bool is = is_due(w, b, k);
      if (is && span.contains(stage)) block.store(&c.stage_ran[k], 1);
      return is;
    };
    if (due(Stage::split)) {
      block.store(&c.changing, 1);
      block.store(&c.groups_stale, 1);
    }
    static_cast<void>(due(Stage::merge));
    if (due(Stage::expand)) block.store(&c.expanding, 1);
    if (due(Stage::skin) && w.skin_made[b] == 0 && span.contains(Stage::skin)) block.store(&c.changing, 1);
  }
}
CUTPROOF_KERNEL(note_cuts_kernel);

// Split and merge rename memberships in place. This restores the order of a load before anything is summed over them.
// So sums have the same bits however often a state was loaded on the way. A warp for each tile of particles.
template <class Block>
CUTPROOF_DEVICE void sort_memberships_kernel(Block& block, const DeviceView& w) {
  const Team<Block, kParticleTile> team(block);
  const int64_t tiles = particle_tiles(w.particles);
  for (int64_t tile = team.first(); tile < tiles; tile += team.stride()) {
    if (w.unsorted[tile] == 0) continue;
    const int64_t begin = tile * kParticleTile, left = w.particles - begin;
    team.each(left < kParticleTile ? static_cast<int>(left) : kParticleTile,
              [&](int k) { sort_memberships(w, begin + k); });
    team.sync();  // all lanes have read the mark
    if (team.leads()) w.unsorted[tile] = 0;
  }
}
CUTPROOF_KERNEL(sort_memberships_kernel);

// Slots numbered by one block, which itself counts the preceding ones.
inline constexpr int kSlotRun = 8192;
CUTPROOF_BOTH inline int64_t slot_runs(int64_t slots) { return (slots + kSlotRun - 1) / kSlotRun; }
// Numbers follow slots, in each body from 0. Slots of bodies interleave once clusters have split.
template <class Block>
CUTPROOF_DEVICE void number_slots_kernel(Block& block, const DeviceView& w) {
  const int slots = w.counters->slots_used, runs = static_cast<int>(slot_runs(slots));
  for (int64_t job = block.index(); job < int64_t{w.bodies} * runs; job += block.count()) {
    const int b = static_cast<int>(job / runs), begin = static_cast<int>(job % runs) * kSlotRun;
    if (!running(w, b)) continue;
    const auto wanted = [&](int s) { return w.slot_size[s] > 0 && (w.bodies == 1 || w.slot_body[s] == b); };
    int before = 0;
    for (int s = block.thread(); s < begin; s += block.size()) before += wanted(s) ? 1 : 0;
    before = block.sum(before);
    count_off(block, begin, begin + kSlotRun < slots ? begin + kSlotRun : slots, before, wanted,
              [&](int number, int s) { w.slot_number[s] = number; });
  }
}
CUTPROOF_KERNEL_THREADS(number_slots_kernel, kListThreads);

template <class Block>
CUTPROOF_DEVICE void end_frame_kernel(Block& block, DeviceView w) {
  for (int64_t b = block.first(); b < w.bodies; b += block.stride()) {
    if (running(w, static_cast<int>(b))) ++w.frame[b];
  }
}
CUTPROOF_KERNEL(end_frame_kernel);

}  // namespace cutproof::gpu
