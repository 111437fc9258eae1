// The number of components of G twice more, through SuiteSparse: nothing here searches a graph.
#include "oracles/comparison/sparse_components.h"

#include <btf.h>

#include <Eigen/SPQRSupport>

#include "oracles/oracles.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

// The Laplacian of G, over the alive particles; without rows if the state is not well formed.
Matrix laplacian_of(const Setup& setup, const State& state) {
  if (!well_formed(setup, state).holds) return {};
  const TissueGraph graph(setup.body, state.alive);
  std::vector<int32_t> row(state.alive.size(), -1);
  int32_t count = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (state.alive[i] != 0) row[i] = count++;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (int32_t i = 0; i < graph.particle_count(); ++i) {
    for (const int32_t other : graph.neighbours(i)) {
      entries.emplace_back(row[at(i)], row[at(other)], -1);
      entries.emplace_back(row[at(i)], row[at(i)], +1);
    }
  }
  Matrix laplacian(count, count);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  return laplacian;
}

}  // namespace

// A symmetric matrix is irreducible within a block exactly if the block's graph is connected, so the diagonal blocks
// of the block triangular form of a matrix with an entry for each edge of G are the components of G (Duff and Reid
// 1978; BTF in SuiteSparse).
int32_t graph_component_count_btf(const Setup& setup, const State& state) {
  Matrix matrix = laplacian_of(setup, state);
  const auto count = at(matrix.cols());
  if (count == 0) return 0;
  if (matrix.nonZeros() == 0) return static_cast<int32_t>(count);
  std::vector<int> permutation(count), blocks(count + 1), work(4 * count);
  return btf_strongcomp(static_cast<int>(count), matrix.outerIndexPtr(), matrix.innerIndexPtr(), nullptr,
                        permutation.data(), blocks.data(), work.data());
}

// The kernel of a graph's Laplacian is spanned by the indicator vectors of its components, so their number is
// n − rank (Chung 1997, §1.3).
int32_t graph_component_count_spqr(const Setup& setup, const State& state) {
  const Matrix laplacian = laplacian_of(setup, state);
  if (laplacian.cols() == 0) return 0;
  const Eigen::SPQR<Matrix> factors(laplacian);
  return static_cast<int32_t>(laplacian.cols() - factors.rank());
}

}  // namespace cutproof::oracles
