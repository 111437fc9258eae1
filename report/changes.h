// What a stage changed: how the states of two snapshots, one right after the other, differ in each particle.
#pragma once
#include <cstdint>
#include <vector>

#include "model/state.h"

namespace cutproof::report {

// In the order in which they count where several are true of a particle. The page's words for them: page/colours.js.
enum class Change : uint8_t {
  nothing,
  moved,        // its position is another
  skin,         // a vertex of the skin is made for it
  reclustered,  // a cluster that holds it has lost members, or is new
  expanded,     // a cluster has grown over it
  merged,       // a cluster that holds it has taken over members of one that is gone
  removed,      // it is not alive any more
};

// One of each particle [n], n = after.x.size(). States may be as wrong as they like.
std::vector<uint8_t> changes_between(const State& before, const State& after);

}  // namespace cutproof::report
