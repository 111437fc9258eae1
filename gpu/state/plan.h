// What is known of a load before it runs: which stages any of its bodies can need, and the longest loops. Decides
// which kernels are in the graph at all.
#pragma once
#include <vector>

#include "model/setup.h"
#include "model/state.h"

namespace cutproof::gpu {

enum class SplitMethod { global_labels, blocks };  // split.cuh: ECL-CC over all pairs, or one block per cluster

struct Plan {
  int substeps = 0;                                          // most of any body
  int iterations = 0;                                        // most of any body
  bool contacts = false;                                     // some body has a blade, a wall or a grip
  bool accelerated = false;                                  // some body's iterations are
  bool retarded = false;                                     // some body has retardation: its kernels can do all
  bool detection = false;                                    // some body launches detect
  bool distance = false, geometric = false, strain = false;  // criteria in use
  bool nearer = false;  // by distance, of some edge the end nearer to the blade goes
  bool debris = false;
  bool merge = false;   // some body merges
  bool expand = false;  // some body may expand
  bool edge_cover = false, published_expand = false;
  bool skin = false;
  SplitMethod split = SplitMethod::blocks;
  int largest_cluster = 0;  // particles; a cluster beyond kMostInBlock is split by global labels whatever `split` says
};

// Requires states that fit their setups (state/staging.h make_staging_buffers). Throws MachineError if a cluster has
// more members than 32 bits can count.
Plan make_plan(const std::vector<Setup>& setups, const std::vector<State>& states,
               SplitMethod split = SplitMethod::blocks);

}  // namespace cutproof::gpu
