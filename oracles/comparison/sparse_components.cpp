// The number of components of G twice more, through SuiteSparse: nothing here searches a graph.
#include "oracles/comparison/sparse_components.h"

#include <btf.h>

#include <SuiteSparseQR.hpp>

#include "oracles/oracles.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

// [n] row of each alive particle in matrices over the alive particles; -1 if dead.
std::vector<int32_t> rows_of_alive(const State& state, int32_t& count) {
  std::vector<int32_t> row(state.alive.size(), -1);
  count = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (state.alive[i] != 0) row[i] = count++;
  }
  return row;
}

}  // namespace

// A symmetric matrix is irreducible within a block exactly if the block's graph is connected, so the diagonal blocks
// of the block triangular form of G's adjacency matrix are the components of G (Duff and Reid 1978; BTF in
// SuiteSparse).
int32_t graph_component_count_btf(const Setup& setup, const State& state) {
  if (!well_formed(setup, state).holds) return 0;
  const TissueGraph graph(setup.body, state.alive);
  int32_t count = 0;
  const std::vector<int32_t> row = rows_of_alive(state, count);
  if (count == 0) return 0;
  std::vector<int> column_start = {0};
  std::vector<int> rows;
  column_start.reserve(at(count) + 1);
  for (int32_t i = 0; i < graph.particle_count(); ++i) {
    if (!graph.alive(i)) continue;
    for (int direction = 0; direction < 6; ++direction) {
      const int32_t other = graph.neighbour(i, direction);
      if (other >= 0) rows.push_back(row[at(other)]);
    }
    column_start.push_back(static_cast<int>(rows.size()));
  }
  rows.push_back(0);  // so that data() is not null without edges
  std::vector<int> permutation(at(count)), blocks(at(count) + 1), work(4 * at(count));
  return btf_strongcomp(count, column_start.data(), rows.data(), nullptr, permutation.data(), blocks.data(),
                        work.data());
}

// The kernel of a graph's Laplacian is spanned by the indicator vectors of its components, so their number is
// n − rank (Chung 1997, §1.3).
int32_t graph_component_count_spqr(const Setup& setup, const State& state) {
  if (!well_formed(setup, state).holds) return 0;
  const TissueGraph graph(setup.body, state.alive);
  int32_t count = 0;
  const std::vector<int32_t> row = rows_of_alive(state, count);
  if (count == 0) return 0;

  cholmod_common common;
  cholmod_l_start(&common);
  const auto n = at(count);
  cholmod_triplet* entries = cholmod_l_allocate_triplet(n, n, 7 * n, 0, CHOLMOD_REAL, &common);
  auto* const rows = static_cast<SuiteSparse_long*>(entries->i);
  auto* const columns = static_cast<SuiteSparse_long*>(entries->j);
  auto* const values = static_cast<double*>(entries->x);
  const auto add = [&](int32_t i, int32_t j, double value) {
    rows[entries->nnz] = i;
    columns[entries->nnz] = j;
    values[entries->nnz] = value;
    ++entries->nnz;
  };
  for (int32_t i = 0; i < graph.particle_count(); ++i) {
    if (!graph.alive(i)) continue;
    double degree = 0;
    for (int direction = 0; direction < 6; ++direction) {
      const int32_t other = graph.neighbour(i, direction);
      if (other < 0) continue;
      add(row[at(i)], row[at(other)], -1);
      degree += 1;
    }
    add(row[at(i)], row[at(i)], degree);
  }
  cholmod_sparse* laplacian = cholmod_l_triplet_to_sparse(entries, entries->nnz, &common);
  SuiteSparseQR_factorization<double>* factor =
      SuiteSparseQR_factorize<double>(SPQR_ORDERING_DEFAULT, SPQR_DEFAULT_TOL, laplacian, &common);
  const int32_t rank = factor != nullptr ? static_cast<int32_t>(factor->rank) : 0;
  SuiteSparseQR_free(&factor, &common);
  cholmod_l_free_sparse(&laplacian, &common);
  cholmod_l_free_triplet(&entries, &common);
  cholmod_l_finish(&common);
  return count - rank;
}

}  // namespace cutproof::oracles
