// A well-formed state with the data that several properties derive from it, derived once. For authors of checks.
#pragma once
#include <optional>
#include <vector>

#include "oracles/support.h"

namespace cutproof::oracles {

class Judged {
 public:
  // Keeps references to both.
  Judged(const Setup& of_setup, const State& of_state);

  const Partition& components();  // of G
  const Partition& coupling();    // by "shares a cluster"
  int64_t coupled_components();   // how many sets of particles are both connected and coupled
  const Memberships& memberships();
  // An edge of G whose ends are not coupled, the shortest path that shows an isolated group; { -1, -1 } if all
  // connected particles are coupled.
  Edge first_uncoupled_edge();

  // Takes over derived data of another state of the same body that depend on none of the parts that `differ`.
  void take_over(Judged& last, unsigned differ);

  int32_t number(int32_t cluster) const { return clusters.number[at(cluster)]; }
  bool alive(int32_t particle) const { return state.alive[at(particle)] != 0; }

  const Setup& setup;
  const State& state;
  const Body& body;
  const Clusters& clusters;
  const TissueGraph graph;
  std::vector<uint8_t> connected;  // [m] 1: "cluster connectivity" has found the cluster to be; empty: it knows of none

 private:
  std::optional<Partition> components_, coupling_;
  std::optional<int64_t> coupled_components_;
  std::optional<Memberships> memberships_;
};

}  // namespace cutproof::oracles
