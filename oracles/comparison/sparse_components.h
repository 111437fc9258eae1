// The number of components of G twice more, without searching a graph: by SuiteSparse.
#pragma once
#include <cstdint>

#include "model/setup.h"
#include "model/state.h"

namespace cutproof::oracles {

// Block triangular form (strongly connected components) by SuiteSparse BTF. 0 if the state is not well formed.
int32_t graph_component_count_btf(const Setup& setup, const State& state);
// n − rank of the Laplacian by SPQR. Slow; for tests.
int32_t graph_component_count_spqr(const Setup& setup, const State& state);

}  // namespace cutproof::oracles
