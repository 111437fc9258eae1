// The CPU reference: double precision, serial, readable. Each stage is a function from a state to the next one, in a
// file of its name.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "model/backend.h"

namespace cutproof::reference {

// method.md §3: all substeps of frame state.frame; starts a frame, so it clears state.removed, .debris, .impulse.
void step(const Setup& setup, State& state);
// method.md §4: marks removed particles dead and lists them in state.removed.
void detect(const Setup& setup, State& state);
// method.md §5: replaces every cluster that lost a particle by the connected components of the rest.
void split(const Setup& setup, State& state);
// method.md §6: joins small clusters with neighbours.
void merge(const Setup& setup, State& state);
// method.md §7: lets clusters take in particles until no tissue is uncoupled.
void expand(const Setup& setup, State& state);
// method.md §8: triangles where something changed (always, if state.skin is empty), then all vertex positions.
void skin(const Setup& setup, State& state);

std::unique_ptr<Backend> make_backend();

// --- Parts that cooking, tests and tools use alone ---------------------------------------------------------------

// Each particle's containing clusters (indices, ascending), as compressed rows.
struct Memberships {
  std::vector<int64_t> offsets;   // [n + 1]
  std::vector<int32_t> clusters;  // cluster indices, ascending within each particle
  std::span<const int32_t> of(int32_t particle) const {
    const auto i = static_cast<std::size_t>(particle);
    return {clusters.data() + offsets[i], static_cast<std::size_t>(offsets[i + 1] - offsets[i])};
  }
  int64_t count(int32_t particle) const {
    const auto i = static_cast<std::size_t>(particle);
    return offsets[i + 1] - offsets[i];
  }
};
Memberships memberships_of(const Clusters& clusters, int32_t particle_count);

// T_c and M_c of every cluster, from the present memberships (method.md §5, Rest frames). Recomputing unchanged ones
// gives the same bits.
void update_rest_frames(const Body& body, Clusters& clusters);

// One rotation problem (method.md §3): argmax over rotations R of tr(Rᵀ A); of several answers the nearest to
// `previous`. `degenerate`: the answer was not unique, or A was not finite (then R = previous).
struct Rotation {
  Mat3 r;
  bool degenerate = false;
};
Rotation closest_rotation(const Mat3& a, const Mat3& previous);

// The linear maps of a cluster of several members (method.md §3, Volume), given A, A0 and R. F = A A0⁻¹; V is the
// nearest to it of the matrices of determinant 1, in the norm of A0, and of several the nearest to R. A flat cluster
// has no volume: V is F along its extent and R across it, and V - F counts as 0. Requires A0 symmetric and not
// negative.
struct ClusterMaps {
  Mat3 goal;   // C = (1 - β) R + β (V - F): from the rest centre to where members are wanted
  Mat3 carry;  // B = (1 - β) R + β V: of points beside a member
};
ClusterMaps cluster_maps(double volume_share, const Mat3& a, const Mat3& rest_moment, const Mat3& rotation);

// method.md §6 on any family of sets (each strictly ascending), overlapping or not: a set with fewer than tau
// particles is small. `numbers` are distinct. Does not touch rest frames. `rule` must not be none.
struct Merged {
  std::vector<std::vector<int32_t>> sets;  // unions, in the order of their numbers
  std::vector<int32_t> survivor;           // index of the input set whose number each set of the result keeps
};
Merged merge_sets(const Body& body, const std::vector<uint8_t>& alive, std::vector<std::vector<int32_t>> sets,
                  const std::vector<int32_t>& numbers, MergeRule rule, int64_t tau, int64_t cap);

}  // namespace cutproof::reference
