#include "gpu/state/plan.h"

#include <algorithm>

#include "gpu/state/indices.h"
#include "model/body.h"

namespace cutproof::gpu {

Plan make_plan(const std::vector<Setup>& setups, const std::vector<State>& states, SplitMethod split) {
  Plan plan;
  plan.split = split;
  for (std::size_t b = 0; b < setups.size(); ++b) {
    const Setup& setup = setups[b];
    plan.substeps = std::max(plan.substeps, setup.step.substeps);
    plan.iterations = std::max(plan.iterations, setup.step.iterations);
    plan.accelerated = plan.accelerated || setup.step.acceleration != Acceleration::none;
    plan.retarded = plan.retarded || setup.step.retardation > 0;
    plan.contacts = plan.contacts || setup.has_blade || !setup.walls.empty() || !setup.grips.empty();
    const bool detection = needs_detection(setup);
    plan.detection = plan.detection || detection;
    plan.distance = plan.distance || (detection && setup.detect.criterion == Criterion::distance);
    plan.nearer = plan.nearer || (detection && setup.detect.remove == RemovedEnds::nearer && setup.has_blade);
    plan.geometric = plan.geometric || (detection && setup.detect.criterion == Criterion::geometric);
    plan.strain = plan.strain || (detection && setup.detect.criterion == Criterion::strain);
    plan.debris = plan.debris || setup.split.debris > 0;
    plan.merge = plan.merge || setup.merge.rule != MergeRule::none;
    plan.edge_cover = plan.edge_cover || (setup.expand.rule == ExpandRule::edge_cover && !states[b].edge_covered);
    plan.published_expand = plan.published_expand || setup.expand.rule == ExpandRule::published;
    plan.skin = plan.skin || setup.skin.wanted;
    for (int32_t c = 0; c < states[b].clusters.count(); ++c) {
      plan.largest_cluster =
          std::max(plan.largest_cluster, narrow(states[b].clusters.size(c), "members of one cluster"));
    }
    plan.largest_cluster = std::max(plan.largest_cluster, int{states[b].cap});
  }
  plan.expand = plan.edge_cover || plan.published_expand;
  return plan;
}

}  // namespace cutproof::gpu
