// What a load can need before it runs: stages of any body, and the longest loops. It decides which kernels the graph
// has.
#pragma once
#include <vector>

#include "model/setup.h"
#include "model/state.h"

namespace cutproof::gpu {

enum class SplitMethod { global_labels, blocks };  // split.cuh: ECL-CC over all pairs, or one block per cluster

struct Plan {
  int substeps = 0;          // most of any body
  int iterations = 0;        // most of any body
  bool contacts = false;     // some body has a blade, a wall or a grip
  bool accelerated = false;  // some body's iterations are accelerated
  bool retarded = false;     // some body has retardation; its kernels support everything
  bool detection = false;    // some body launches detect
  bool distance = false, geometric = false, strain = false;  // criteria in use
  bool nearer = false;                                       // by distance, some body removes the nearer ends of edges
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
