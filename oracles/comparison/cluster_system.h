// The linear system of one axis of an implicit substep (method.md §3) with fixed rotations: E's minimum over x and t
// after eliminating x. One row per cluster.
#pragma once
#include <cstdint>
#include <vector>

#include "model/body.h"
#include "model/clusters.h"
#include "oracles/comparison/sparse_cholesky.h"

namespace cutproof::oracles {

// B = diag(M) − Σ_g weight_g u_g u_gᵀ, where u_g has ones in the rows of the clusters that share the particles of g.
// Diagonally dominant: a row sums to at least (1 − s) M_c.
struct ClusterSystem {
  struct Shared {
    std::vector<int32_t> clusters;  // strictly ascending
    double weight = 0;              // s Σ m_i / n_i² over the particles that lie in exactly these clusters [kg]
  };
  std::vector<double> mass;    // [m] M_c [kg]
  std::vector<Shared> shared;  // each set of clusters once, ordered by its first particle
};

// With s = k dt² / (1 + k dt²). Particles whose `fixed` [n] is not 0 have inertia in M_c, but no coordinate that is
// solved for, so they are in no `shared`.
ClusterSystem cluster_system(const Body& body, const Clusters& clusters, double s, const std::vector<uint8_t>& fixed);

// B, of which the lower triangle is stored. Throws std::bad_alloc.
Sparse matrix_of(const ClusterSystem& system, Cholmod& cholmod);

}  // namespace cutproof::oracles
