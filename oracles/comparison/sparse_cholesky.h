// CHOLMOD (Chen, Davis, Hager and Rajamanickam 2008) with value semantics: memory is freed, and failures throw.
#pragma once
#include <cholmod.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

namespace cutproof::oracles {

// CHOLMOD's parameters and workspace.
class Cholmod {
 public:
  Cholmod() {
    cholmod_start(&common_);
    common_.print = 0;  // failures throw, and are not printed
  }
  ~Cholmod() { cholmod_finish(&common_); }
  Cholmod(const Cholmod&) = delete;
  Cholmod& operator=(const Cholmod&) = delete;
  cholmod_common* get() { return &common_; }

  // Throws if the last call failed.
  void check() const {
    if (common_.status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
    if (common_.status != CHOLMOD_OK) {
      throw std::runtime_error("CHOLMOD cannot factorise the system of a substep: its status is " +
                               std::to_string(common_.status));
    }
  }

 private:
  cholmod_common common_{};
};

// Something that CHOLMOD made.
template <class T, int (*free)(T**, cholmod_common*)>
class Made {
 public:
  Made(T* made, Cholmod& cholmod) : made_(made), cholmod_(cholmod) { cholmod.check(); }  // null after a failed call
  ~Made() { free(&made_, cholmod_.get()); }
  Made(const Made&) = delete;
  Made& operator=(const Made&) = delete;
  T* get() const { return made_; }
  T* operator->() const { return made_; }

 private:
  T* made_;
  Cholmod& cholmod_;
};
using Triplets = Made<cholmod_triplet, cholmod_free_triplet>;
using Sparse = Made<cholmod_sparse, cholmod_free_sparse>;
using Dense = Made<cholmod_dense, cholmod_free_dense>;
using Factor = Made<cholmod_factor, cholmod_free_factor>;

// One entry of a matrix; several entries of one place add up.
struct Entry {
  int r = 0, c = 0;
  double v = 0;
  // As Eigen reads them.
  int row() const { return r; }
  int col() const { return c; }
  double value() const { return v; }
};

// A symmetric matrix by its lower triangle.
inline Sparse sparse_of(std::size_t size, const std::vector<Entry>& entries, Cholmod& cholmod) {
  const Triplets triplets(cholmod_allocate_triplet(size, size, entries.size(), -1, CHOLMOD_REAL, cholmod.get()),
                          cholmod);
  for (const Entry& entry : entries) {
    static_cast<int*>(triplets->i)[triplets->nnz] = entry.r;
    static_cast<int*>(triplets->j)[triplets->nnz] = entry.c;
    static_cast<double*>(triplets->x)[triplets->nnz++] = entry.v;
  }
  return Sparse(cholmod_triplet_to_sparse(triplets.get(), triplets->nnz, cholmod.get()), cholmod);
}

// x of A x = right by A's factor.
inline std::vector<double> solve(Cholmod& cholmod, cholmod_factor* factor, std::vector<double> right) {
  cholmod_dense b{};
  b.nrow = b.d = b.nzmax = right.size();
  b.ncol = 1;
  b.x = right.data();
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  const Dense x(cholmod_solve(CHOLMOD_A, factor, &b, cholmod.get()), cholmod);
  const auto* values = static_cast<const double*>(x->x);
  std::copy(values, values + right.size(), right.begin());
  return right;
}

}  // namespace cutproof::oracles
