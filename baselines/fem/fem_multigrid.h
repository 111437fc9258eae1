// Geometric multigrid for M + s K̂, as the preconditioner of conjugate gradients: one V cycle with a damped block Jacobi
// sweep before and after each coarser grid. Coarse operators are Galerkin's, Pᵀ (M + s K̂) P with trilinear P, kept as a
// dense matrix for each coarse cell. Grids are those of fem_grids.h, so that no bit crosses a cut.
#pragma once
#include "baselines/fem/fem_cells.h"
#include "baselines/fem/fem_grids.h"

namespace cutproof::baselines::fem {

// Which end of axis k corner a is at: kEnds, for devices.
BASELINES_HOST_DEVICE inline int end_of(int a, int k) {
  return k == 0 ? (a + 1) >> 1 & 1 : k == 1 ? a >> 1 & 1 : a >> 2;
}

// The trilinear function of a box's corner, at a corner of its cell in the octant whose axes are the bits of `octant`.
BASELINES_HOST_DEVICE inline float weight_in_box(int octant, int corner, int of_box) {
  float weight = 1;
  for (int k = 0; k < 3; ++k) {
    const float to = 0.5f * static_cast<float>((octant >> k & 1) + end_of(corner, k));
    weight *= end_of(of_box, k) == 1 ? to : 1 - to;
  }
  return weight;
}

// A coarse cell has its blocks A_ab as entries [8 a][8 b][9][c]. out = Σ_b A_ab u_b for corner a, `u` [8][3].
BASELINES_HOST_DEVICE inline void apply_row(const float* entries, int64_t cells, int64_t c, int a, const float* u,
                                            float* out) {
  out[0] = out[1] = out[2] = 0;
  for (int b = 0; b < 8; ++b) {
    const float* const block = entries + 9 * int64_t{8 * a + b} * cells + c;
    for (int k = 0; k < 9; ++k) out[k / 3] += block[k * cells] * u[3 * b + k % 3];
  }
}
// block = A_aa, xx xy xz yy yz zz.
BASELINES_HOST_DEVICE inline void diagonal_block(const float* entries, int64_t cells, int64_t c, int a, float* block) {
  for (int row = 0, k = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column) block[k++] = entries[(81 * int64_t{a} + 3 * row + column) * cells + c];
  }
}
// The greatest eigenvalue of D⁻¹A of a cell, D its diagonal blocks, by the power method. Σ λ_c D_c over all cells
// bounds A. Eight rounds end somewhat below λ_c; damping leaves room for a quarter.
BASELINES_HOST_DEVICE inline float greatest_eigenvalue(const float* entries, int64_t cells, int64_t c) {
  float v[24], inverse[8][6];
  for (int a = 0; a < 8; ++a) {
    float block[6];
    diagonal_block(entries, cells, c, a, block);
    invert(block, inverse[a]);
    for (int k = 0; k < 3; ++k) v[3 * a + k] = static_cast<float>((5 * a + 3 * k) % 7 - 3);
  }
  float greatest = 1;
  for (int round = 0; round < 8; ++round) {
    float w[24], above = 0, below = 0, size = 0;
    for (int a = 0; a < 8; ++a) {
      float out[3];
      apply_row(entries, cells, c, a, v, out);
      multiply(inverse[a], out, w + 3 * a);
      above += dot3(w + 3 * a, out);
      below += dot3(v + 3 * a, out);
      size += dot3(w + 3 * a, w + 3 * a);
    }
    if (!(below > 0) || !(size > 0)) break;
    greatest = above / below;  // Rayleigh's quotient of A^(1/2) D⁻¹ A^(1/2)
    for (int k = 0; k < 24; ++k) v[k] = w[k] / sqrtf(size);
  }
  return greatest;
}

// Of a system at one level; the finest has masses of nodes, and nodes that are fixed.
struct Level {
  CellsAround around;
  const float* mass;               // [p] kg, or null
  const uint8_t* fixed;            // [p], or null
  float scale;                     // of products
  const float *product, *inverse;  // [8 corners][3][c]; [p][6] of the diagonal, with the damping
  float *x, *b, *r;                // [p][3] the solution, the right side, the residual
};
// b − A x at a node, from the cells' products of x.
BASELINES_HOST_DEVICE inline void residual_at(const Level& level, int64_t i, float* r) {
  float sums[3];
  sum_around<3>(level.around, i, level.product, sums);
  for (int k = 0; k < 3; ++k) {
    const int64_t at = 3 * i + k;
    const float own = level.mass == nullptr ? 0 : level.mass[i] * level.x[at];
    r[k] = level.b[at] - own - level.scale * sums[k];
    if (level.fixed != nullptr && level.fixed[i] != 0) r[k] = 0;
  }
}

// A sparse matrix by rows, on vectors [p][3].
struct Weights {
  const int32_t *offsets, *columns;
  const float* values;
  BASELINES_HOST_DEVICE float sum(const float* x, int64_t k) const {
    float sum = 0;
    for (int32_t at = offsets[k / 3]; at < offsets[k / 3 + 1]; ++at) sum += values[at] * x[3 * columns[at] + k % 3];
    return sum;
  }
};

template <class Executor>
class Multigrid {
 public:
  template <class T>
  using Array = typename Executor::template Array<T>;

  // Sweeps are damped by 1.6 / λ, where λ bounds D⁻¹A: they leave at most 0.6 of errors in the upper three quarters of
  // the spectrum. Below 2 / λ they are positive definite.
  static constexpr float kDamping = 1.6f;
  static constexpr int kCoarsestSweeps = 4;

  // `corners` [8 c] nodes. Levels are added, `most` of them, while K̂ outweighs inertia: `stiffness` is
  // s (2 μ + λ) / (ρ h²), which falls to a quarter with each.
  void make(const Mesh& mesh, const std::vector<int32_t>& corners, const std::vector<uint8_t>& fixed, double stiffness,
            int most) {
    grids_.clear();
    has_bounds_ = false;
    Grid finer = finest(mesh, corners, fixed.size());
    std::vector<uint8_t> is_removed = mesh.is_removed;
    for (int level = 0; level < most && stiffness > kLeastStiffness; ++level, stiffness /= 4) {
      std::vector<int32_t> parent;
      const Grid grid = coarser(finer, parent);
      if (grid.place.size() == finer.place.size()) break;  // nothing is joined any more
      grids_.push_back(on_device(finer, grid, parent, is_removed, level == 0 ? fixed : std::vector<uint8_t>()));
      is_removed.clear();
      finer = grid;
    }
  }
  std::size_t levels() const { return grids_.size(); }
  std::vector<float> entries(std::size_t level) const { return grids_[level].entries.copy(); }  // [8][8][9][c]

  // Coarse operators and diagonals, from the rotations and twists of `s`. `eighth` [c] kg: a cell's mass at a corner.
  void assemble(Executor& executor, const View& s, const float* eighth, float scale) {
    for (std::size_t level = 0; level < grids_.size(); ++level) {
      OnDevice& grid = grids_[level];
      const int64_t cells = grid.cells;
      const int32_t *const begin = grid.child_offsets.data(), *const children = grid.children.data(),
                           *const octant = grid.octants.data();
      float* const entries = grid.entries.data();
      const float* const of_children = level == 0 ? nullptr : grids_[level - 1].entries.data();
      const int64_t finer = level == 0 ? s.cells : grids_[level - 1].cells;
      executor.for_each(static_cast<std::size_t>(36 * cells), [=] BASELINES_KERNEL(int64_t t) {
        const int64_t c = t % cells;
        const auto pair = static_cast<int>(t / cells);  // b >= a: 00 01 .. 07 11 12 ..
        int a = 0, before = 0;
        while (before + 8 - a <= pair) before += 8 - a++;
        const int b = a + pair - before;
        float block[9] = {};
        for (int32_t k = begin[c]; k < begin[c + 1]; ++k) {
          const int64_t child = children[k];
          float wa[8], wb[8];
          for (int corner = 0; corner < 8; ++corner) {
            const bool is_fixed = of_children == nullptr && s.fixed[s.corners[8 * child + corner]] != 0;
            wa[corner] = is_fixed ? 0 : weight_in_box(octant[child], corner, a);
            wb[corner] = is_fixed ? 0 : weight_in_box(octant[child], corner, b);
          }
          if (of_children == nullptr) {
            float stiffness[9] = {}, mass = 0;
            add_block(s, child, wa, wb, stiffness);
            for (int corner = 0; corner < 8; ++corner) mass += eighth[child] * wa[corner] * wb[corner];
            for (int e = 0; e < 9; ++e) block[e] += scale * stiffness[e] + (e % 4 == 0 ? mass : 0);
            continue;
          }
          for (int p = 0; p < 8; ++p) {
            for (int q = 0; q < 8; ++q) {
              const float weight = wa[p] * wb[q];
              if (weight == 0) continue;
              const float* const from = of_children + 9 * int64_t{8 * p + q} * finer + child;
              for (int e = 0; e < 9; ++e) block[e] += weight * from[e * finer];
            }
          }
        }
        for (int e = 0; e < 9; ++e) {
          entries[(9 * int64_t{8 * a + b} + e) * cells + c] = block[e];
          if (a != b) entries[(9 * int64_t{8 * b + a} + 3 * (e % 3) + e / 3) * cells + c] = block[e];
        }
      });
      float* const bound = grid.bounds.data();
      if (!has_bounds_) {
        executor.for_each(static_cast<std::size_t>(cells),
                          [=] BASELINES_KERNEL(int64_t c) { bound[c] = greatest_eigenvalue(entries, cells, c); });
      }
      const CellsAround around = grid.around();
      float* const inverse = grid.inverse.data();
      executor.for_each(static_cast<std::size_t>(grid.nodes), [=] BASELINES_KERNEL(int64_t i) {
        float block[6] = {};
        for (int32_t at = around.offsets[i]; at < around.offsets[i + 1]; ++at) {
          const int64_t c = around.slots[at] >> 3;
          float own[6];
          diagonal_block(entries, cells, c, around.slots[at] & 7, own);
          for (int k = 0; k < 6; ++k) block[k] += bound[c] * own[k];
        }
        invert(block, inverse + 6 * i);
        for (int k = 0; k < 6; ++k) inverse[6 * i + k] *= kDamping;
      });
    }
    has_bounds_ = true;
  }

  // finest.x = an approximation of A⁻¹ finest.b; linear, symmetric and positive definite.
  void solve(Executor& executor, const View& s, const Level& finest) { cycle(executor, s, finest, 0); }

  // Functions with kernels are public: nvcc demands it.

  void cycle(Executor& executor, const View& s, const Level& level, std::size_t depth) {
    const std::size_t nodes = static_cast<std::size_t>(depth == 0 ? s.nodes : grids_[depth - 1].nodes);
    executor.for_each(
        nodes, [=] BASELINES_KERNEL(int64_t i) { multiply(level.inverse + 6 * i, level.b + 3 * i, level.x + 3 * i); });
    if (depth == grids_.size()) {
      for (int sweep = 1; sweep < kCoarsestSweeps && depth > 0; ++sweep) relax(executor, s, level, depth);
      return;
    }
    apply(executor, s, level.x, depth);
    executor.for_each(nodes, [=] BASELINES_KERNEL(int64_t i) { residual_at(level, i, level.r + 3 * i); });
    OnDevice& grid = grids_[depth];
    const Level coarse = grid.level();
    const Weights restriction = grid.restriction.weights(), prolongation = grid.prolongation.weights();
    executor.for_each(static_cast<std::size_t>(3 * grid.nodes),
                      [=] BASELINES_KERNEL(int64_t k) { coarse.b[k] = restriction.sum(level.r, k); });
    cycle(executor, s, coarse, depth + 1);
    executor.for_each(3 * nodes, [=] BASELINES_KERNEL(int64_t k) { level.x[k] += prolongation.sum(coarse.x, k); });
    relax(executor, s, level, depth);
  }

  // x += D⁻¹ (b − A x)
  void relax(Executor& executor, const View& s, const Level& level, std::size_t depth) {
    apply(executor, s, level.x, depth);
    executor.for_each(static_cast<std::size_t>(depth == 0 ? s.nodes : grids_[depth - 1].nodes),
                      [=] BASELINES_KERNEL(int64_t i) {
                        float r[3], change[3];
                        residual_at(level, i, r);
                        multiply(level.inverse + 6 * i, r, change);
                        for (int k = 0; k < 3; ++k) level.x[3 * i + k] += change[k];
                      });
  }

  // The cells' products of x.
  void apply(Executor& executor, const View& s, const float* x, std::size_t depth) {
    if (depth == 0) {
      executor.for_each(static_cast<std::size_t>(s.cells), [=] BASELINES_KERNEL(int64_t c) { apply_cell(s, c, x); });
      return;
    }
    OnDevice& grid = grids_[depth - 1];
    const int64_t cells = grid.cells;
    const float* const entries = grid.entries.data();
    const int32_t* const corners = grid.corners.data();
    float* const product = grid.product.data();
    executor.for_each(static_cast<std::size_t>(8 * cells), [=] BASELINES_KERNEL(int64_t t) {
      const int64_t c = t % cells;
      const auto a = static_cast<int>(t / cells);
      float u[24], out[3];
      for (int k = 0; k < 24; ++k) u[k] = x[3 * int64_t{corners[8 * c + k / 3]} + k % 3];
      apply_row(entries, cells, c, a, u, out);
      for (int k = 0; k < 3; ++k) product[(3 * a + k) * cells + c] = out[k];
    });
  }

 private:
  struct Matrix {
    Array<int32_t> offsets, columns;
    Array<float> values;
    Weights weights() const { return {offsets.data(), columns.data(), values.data()}; }
  };
  struct Entry {
    int32_t row, column;
    float value;
  };
  static Matrix matrix_of(std::size_t rows, const std::vector<Entry>& entries) {
    std::vector<int32_t> offsets(rows + 1, 0), columns(entries.size());
    std::vector<float> values(entries.size());
    for (const Entry& entry : entries) ++offsets[static_cast<std::size_t>(entry.row) + 1];
    std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
    std::vector<int32_t> next = offsets;
    for (const Entry& entry : entries) {
      const auto at = static_cast<std::size_t>(next[static_cast<std::size_t>(entry.row)]++);
      columns[at] = entry.column, values[at] = entry.value;
    }
    return {Array<int32_t>(offsets), Array<int32_t>(columns), Array<float>(values)};
  }

  struct OnDevice {
    int64_t cells = 0, nodes = 0;
    Array<int32_t> corners, offsets, slots;           // [8 c]; cells around nodes
    Array<int32_t> child_offsets, children, octants;  // of each cell its finer cells, and of these their octants
    Matrix prolongation, restriction;                 // P and Pᵀ, to and from the finer grid
    Array<float> entries, product, bounds, inverse;   // [8][8][9][c]; [8][3][c]; [c] λ; [p][6]
    Array<float> x, b, r;                             // [p][3]
    CellsAround around() const { return {cells, offsets.data(), slots.data()}; }
    Level level() {
      return {around(), nullptr, nullptr, 1, product.data(), inverse.data(), x.data(), b.data(), r.data()};
    }
  };

  // `fixed` [finer nodes], or none.
  static OnDevice on_device(const Grid& finer, const Grid& grid, const std::vector<int32_t>& parent,
                            const std::vector<uint8_t>& is_removed, const std::vector<uint8_t>& fixed) {
    OnDevice made;
    const std::size_t cells = grid.place.size();
    made.cells = static_cast<int64_t>(cells), made.nodes = static_cast<int64_t>(grid.nodes);
    std::vector<int32_t> octants, corners;
    std::vector<Entry> children, at_node, up, down;
    std::vector<uint8_t> is_known(finer.corners.size() == 0 ? 0 : finer.nodes, 0);
    for (std::size_t c = 0; c < finer.place.size(); ++c) {
      int32_t octant = 0;
      for (int k = 0; k < 3; ++k) octant |= (finer.place[c][k] & 1) << k;
      octants.push_back(octant);
      if (!is_removed.empty() && is_removed[c] != 0) continue;
      children.push_back({parent[c], static_cast<int32_t>(c), 1});
      for (int a = 0; a < 8; ++a) {
        const auto node = static_cast<std::size_t>(finer.corners[c][a]);
        if (is_known[node] != 0 || (!fixed.empty() && fixed[node] != 0)) continue;
        is_known[node] = 1;
        for (int of_box = 0; of_box < 8; ++of_box) {
          const float weight = weight_in_box(octant, a, of_box);
          const int32_t coarse = grid.corners[static_cast<std::size_t>(parent[c])][of_box];
          if (weight == 0) continue;
          up.push_back({static_cast<int32_t>(node), coarse, weight});
          down.push_back({coarse, static_cast<int32_t>(node), weight});
        }
      }
    }
    for (std::size_t k = 0; k < 8 * cells; ++k) {
      corners.push_back(grid.corners[k / 8][k % 8]);
      at_node.push_back({corners.back(), static_cast<int32_t>(k), 1});
    }
    made.corners = Array<int32_t>(corners), made.octants = Array<int32_t>(octants);
    Matrix of_cells = matrix_of(cells, children), around = matrix_of(grid.nodes, at_node);
    made.child_offsets = std::move(of_cells.offsets), made.children = std::move(of_cells.columns);
    made.offsets = std::move(around.offsets), made.slots = std::move(around.columns);
    made.prolongation = matrix_of(finer.nodes, up), made.restriction = matrix_of(grid.nodes, down);
    made.entries = Array<float>(576 * cells), made.product = Array<float>(24 * cells);
    made.bounds = Array<float>(cells), made.inverse = Array<float>(6 * grid.nodes);
    for (Array<float>* const each : {&made.x, &made.b, &made.r}) *each = Array<float>(3 * grid.nodes);
    return made;
  }

  // A grid with less needs no coarser one.
  static constexpr double kLeastStiffness = 2;
  std::vector<OnDevice> grids_;  // the first has boxes of two cells a side
  bool has_bounds_ = false;      // of the cells' eigenvalues, which hardly change with the deformation
};

}  // namespace cutproof::baselines::fem
