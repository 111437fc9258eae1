// The work of a frame, defined once for every launcher: kernels, order, conditions. Sizes are not known here; all are
// in DeviceView::counters.
#pragma once
#include "gpu/kernels/detect.cuh"
#include "gpu/kernels/expand.cuh"
#include "gpu/kernels/frame.cuh"
#include "gpu/kernels/merge.cuh"
#include "gpu/kernels/skin.cuh"
#include "gpu/kernels/split.cuh"
#include "gpu/kernels/step/step.cuh"
#include "gpu/launch/launcher.h"
#include "gpu/state/device_view.h"
#include "gpu/state/plan.h"
#include "model/stage.h"

namespace cutproof::gpu {

// A span of a whole frame uses the groups that the previous frame made, and makes those of the next frame. (A cut has a
// condition anyway, so the step needs none in front.) Any other span makes groups where its step needs them.
// Load::needs_groups() says whether groups must be made first: before the first whole frame, and after any other span
// (step/groups.cuh, enqueue_groups_if_stale).
//
// `mark` is called with each stage before its work is launched; a synchronous launcher can time stages by it.
template <class Launcher, class Mark>
void enqueue_span(Launcher& launcher, const DeviceView& w, const Plan& plan, Span span, Mark mark) {
  if (span.contains(Stage::step)) {
    mark(Stage::step);
    enqueue_step(launcher, w, plan, span);
  } else {
    launcher.blocks(begin_span_kernel_object{}, 1, 128, 0, w, span);
  }
  const bool clusters = span.contains(Stage::split) || span.contains(Stage::merge) || span.contains(Stage::expand);
  const bool skin = span.contains(Stage::skin);
  // A whole frame places vertices without waiting for the next frame's groups.
  const bool places_at_once = span.is_whole_frame() && plan.skin;
  // A small load places vertices during detection, as if nothing were cut. After a cut it places them again, and
  // nothing waits for that. (With RemovedEnds::nearer detection computes centres of clusters too, so vertices wait.)
  const bool places_early = places_at_once && plan.detection && !plan.nearer &&
                            w.particles <= step_detail::kMostByRows && launcher.overlaps();
  const auto detect = [&](Launcher& on) {
    if (span.contains(Stage::detect) && plan.detection) {
      mark(Stage::detect);
      enqueue_detect(on, w, plan);
    }
    if (clusters || skin) on.blocks(note_cuts_kernel_object{}, 1, 128, 0, w, span);
  };
  if (places_early) {
    launcher.side_by_side(detect, [&](Launcher& on) { enqueue_skin_positions(on, w, false); });
  } else {
    detect(launcher);
  }
  if (clusters || skin) {
    // One condition for everything that only a cut needs, because a condition costs as much as ten launches. (A first
    // skin needs only the cells; the other kernels find no body that was cut.)
    launcher.if_nonzero(&w.counters->changing, [&](Launcher& inner) {
      if (span.contains(Stage::split)) {
        mark(Stage::split);
        enqueue_components(inner, w, plan);
      }
      // Cells depend only on which particles live, and that is final here.
      const auto change_clusters = [&](Launcher& on) {
        const bool merges = span.contains(Stage::merge) && plan.merge;
        const auto rest_frames = [&](Launcher& own) {
          if (span.contains(Stage::split)) enqueue_rest_frames_of_components(own, w);
          if (merges) mark(Stage::merge);
        };
        if (merges) {
          enqueue_merge(on, w, rest_frames);
        } else {
          rest_frames(on);
        }
        if (span.contains(Stage::expand) && plan.expand) {
          on.if_nonzero(&w.counters->expanding, [&](Launcher& innermost) {
            mark(Stage::expand);
            enqueue_expand(innermost, w, plan);
          });
        }
        if (skin) {
          mark(Stage::skin);
          on.teams(sort_memberships_kernel_object{}, kParticleTile, particle_tiles(w.particles), w);
        }
      };
      const auto follow_clusters = [&](Launcher& on) {
        if (skin) {
          on.blocks(number_slots_kernel_object{}, w.bodies * slot_runs(w.slots_expected), kListThreads, 0, w);
          if (plan.skin) enqueue_skin_clusters(on, w, plan);
        }
        if (places_at_once) enqueue_skin_positions(on, w, false);
      };
      inner.side_by_side(
          change_clusters,
          [&](Launcher& on) {
            if (skin && plan.skin) enqueue_skin_cells(on, w, plan);
          },
          [&](Launcher& on) {
            if (span.is_whole_frame()) enqueue_groups(on, w);
          },
          follow_clusters);
    });
  }
  if (skin) {
    mark(Stage::skin);
    if (plan.skin && !places_early) enqueue_skin_positions(launcher, w, places_at_once);
    launcher.items(end_frame_kernel_object{}, w.bodies, w);
  }
}

}  // namespace cutproof::gpu
