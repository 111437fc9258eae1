// What a page shows of a state beside what stands in it: the pieces of the tissue, and each particle's clusters.
#pragma once
#include <cstdint>
#include <vector>

#include "model/body.h"
#include "model/clusters.h"

namespace cutproof::report {

struct Pieces {
  std::vector<int32_t> of;  // [n] piece of each particle, -1 of the dead; 0 is the largest, of equals that of the
                            // lowest particle
  int32_t count = 0;
};
// Components of the alive particles along edges of the body. `alive`: [n].
Pieces pieces_of(const Body& body, const std::vector<uint8_t>& alive);
// The same of pieces that are known: `label`, [n], any number below n for each, -1 of what is in none.
Pieces pieces_of(const std::vector<int32_t>& label);

// Clusters of a state that may be as wrong as it likes: nothing is read that is not there.
struct Holders {
  std::vector<int32_t> lowest;  // [n] of the first cluster that holds a particle the lowest of those that it is the
                                // first to hold, -1 without one: no two clusters have the same, and it stays where
                                // clusters are numbered anew
  std::vector<uint8_t> count;   // [n] how many clusters hold it, at most 255
};
Holders holders_of(const Clusters& clusters, int32_t particles);
// Of each particle the lowest of those that clusters join it with, -1 of what is dead or in none. `alive`: [n].
std::vector<int32_t> coupled_of(const Clusters& clusters, const std::vector<uint8_t>& alive);
// Particles of the cluster of this number, none twice; empty if there is no such cluster.
std::vector<int32_t> members_of(const Clusters& clusters, int32_t number, int32_t particles);

// The same of the cluster in this place of the list.
std::vector<int32_t> members_at(const Clusters& clusters, std::size_t place, int32_t particles);

}  // namespace cutproof::report
