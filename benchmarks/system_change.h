// What a cut does to the linear system of a substep (oracles/comparison/cluster_system.h).
#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "model/setup.h"
#include "model/state.h"
#include "oracles/comparison/cluster_system.h"

namespace cutproof::benchmarks {

// In rows of a factor that is kept: those of the clusters before, in their order, then one for each cluster that none
// of these is left for. A row without a cluster has a mass and is not shared.
struct SystemChange {
  oracles::ClusterSystem before, after;
  double s = 0;
  std::vector<int32_t> origin;   // [rows] the row of the cluster that a new row was cut from; else the row itself
  std::vector<int32_t> changed;  // rows of which an entry differs, ascending
  int32_t new_rows = 0;
  // By how much weights of sets of clusters and masses of rows differ: after − before.
  std::vector<oracles::ClusterSystem::Shared> shared;
  std::vector<std::pair<int32_t, double>> mass;
};
// With every alive particle free and s = k dt² / (1 + k dt²). A cluster keeps its row if its members are the same; of
// the others each takes the row of the cluster that most of its members were in, the largest first.
SystemChange change_of(const Body& body, const State& before, const State& after, double s);

}  // namespace cutproof::benchmarks
