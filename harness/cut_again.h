// A cut of which only the final state is known: the reference's answer to the same removal, and the origins of the
// rotations of the final clusters.
#pragma once
#include <cstdint>
#include <vector>

#include "model/setup.h"
#include "model/stage.h"
#include "model/state.h"
#include "oracles/registry.h"

namespace cutproof::harness {

// [clusters] Which clusters before the cut (by their places, ascending) a cluster at its end may have its rotation
// from: one if known, none if the cluster is not among the answers. All pieces of a split inherit its rotation; a union
// has the rotation of the cluster whose number it keeps (method.md §5, §6).
using Origins = std::vector<std::vector<int32_t>>;

struct CutAgain {
  State state;
  std::vector<int32_t> origin;  // [clusters]
};
// The reference's split of a state after detection, and the stages after it up to `last`.
CutAgain cut_again(const Setup& setup, const State& detected, Stage last);

// Origins for another simulator's `end` of the same stages. `expected`: the reference's answer. Where the rule of
// merging leaves several answers, an origin follows from numbers as long as these are kept, up to skin. Later a cluster
// comes from one of the pieces that it contains. A piece that is not small and lies in no other keeps its number, so
// such a piece is the origin, if there is one. Numbers ascend, because clusters keep their order.
Origins origins_of(const Setup& setup, const State& detected, Stage last, const CutAgain& expected, const State& end);

// Gives the clusters before the cut the rotations and flags that those of `end` have from them, as far as that is
// known. Returns by place whether it is.
std::vector<oracles::RotationKnown> hand_back(const Origins& origins, const Clusters& end, Clusters& before);

// The first cluster of `end` that has no rotation that it could have inherited; -1: all have. `before`: the clusters
// before the cut, as the step has left them; `known`: which of their rotations are (empty: all). One that is not may be
// any.
int32_t first_that_inherits_otherwise(const Origins& origins, const Clusters& before,
                                      const std::vector<oracles::RotationKnown>& known, const Clusters& end);

}  // namespace cutproof::harness
