#include "benchmarks/factorise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>

#include "benchmarks/times.h"
#include "model/at.h"
#include "oracles/comparison/reference_solution.h"

namespace cutproof::benchmarks {

namespace {

using oracles::Cholmod;
using oracles::ClusterSystem;
using oracles::Factor;
using oracles::matrix_of;
using oracles::Sparse;

}  // namespace

const char* name_of(Way way) {
  switch (way) {
    case Way::analyse:
      return "analyse";
    case Way::ordered:
      return "ordered";
    case Way::numeric:
      return "numeric";
    case Way::updown:
      return "updown";
    case Way::rows:
      return "rows";
  }
  return "";
}

namespace {

// Rank-one terms C C' of a change, in permuted rows: C, which the caller owns.
cholmod_sparse* columns_of(const std::vector<std::vector<std::pair<int32_t, double>>>& columns, std::size_t rows,
                           Cholmod& cholmod) {
  std::size_t entries = 0;
  for (const auto& column : columns) entries += column.size();
  cholmod_sparse* const matrix = cholmod_allocate_sparse(rows, columns.size(), entries, /*sorted=*/1, /*packed=*/1, 0,
                                                         CHOLMOD_REAL, cholmod.get());
  cholmod.check();
  auto* starts = static_cast<int*>(matrix->p);
  auto* indices = static_cast<int*>(matrix->i);
  auto* values = static_cast<double*>(matrix->x);
  int end = 0;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    starts[k] = end;
    for (const auto& [row, value] : columns[k]) {
      indices[end] = row;
      values[end++] = value;
    }
  }
  starts[columns.size()] = end;
  return matrix;
}

// [rows] where each row of the system stands in the factor.
std::vector<int32_t> places_in(const cholmod_factor& factor) {
  const auto* permutation = static_cast<const int*>(factor.Perm);
  std::vector<int32_t> place(factor.n);
  for (std::size_t k = 0; k < factor.n; ++k) place[at(permutation[k])] = static_cast<int32_t>(k);
  return place;
}

// The elimination order of the system before, each new row right after its origin: what it shares particles with, its
// origin did, so it fills nothing that the origin did not.
std::vector<int> order_of(const SystemChange& change, const cholmod_factor& before) {
  const std::size_t old_rows = change.origin.size() - at(change.new_rows);
  std::vector<std::vector<int>> follow(old_rows);
  for (std::size_t r = old_rows; r < change.origin.size(); ++r) {
    follow[at(change.origin[r])].push_back(static_cast<int>(r));
  }
  const auto* permutation = static_cast<const int*>(before.Perm);
  std::vector<int> order;
  for (std::size_t k = 0; k < before.n; ++k) {
    if (at(permutation[k]) >= old_rows) continue;
    order.push_back(permutation[k]);
    const std::vector<int>& pieces = follow[at(permutation[k])];
    order.insert(order.end(), pieces.begin(), pieces.end());
  }
  return order;
}

// What stands in `common` for as long as this lives: the given order, and nothing else tried.
class GivenOrder {
 public:
  GivenOrder(Cholmod& cholmod, bool postorder) : common_(*cholmod.get()), before_(common_) {
    common_.nmethods = 1;
    common_.method[0].ordering = CHOLMOD_GIVEN;
    common_.postorder = postorder ? 1 : 0;
  }
  ~GivenOrder() {
    common_.nmethods = before_.nmethods;
    common_.method[0].ordering = before_.method[0].ordering;
    common_.postorder = before_.postorder;
  }
  GivenOrder(const GivenOrder&) = delete;
  GivenOrder& operator=(const GivenOrder&) = delete;

 private:
  cholmod_common& common_;
  cholmod_common before_;
};

// As L D L', column by column with room to grow: what can be updated.
class Updatable {
 public:
  explicit Updatable(Cholmod& cholmod) : common_(*cholmod.get()) {
    common_.supernodal = CHOLMOD_SIMPLICIAL;
    common_.final_ll = 0;
    common_.final_pack = 0;
  }
  ~Updatable() {
    common_.supernodal = CHOLMOD_AUTO;
    common_.final_pack = 1;
  }
  Updatable(const Updatable&) = delete;
  Updatable& operator=(const Updatable&) = delete;

 private:
  cholmod_common& common_;
};

bool within_pattern(const cholmod_sparse& before, const cholmod_sparse& after) {
  const auto *p = static_cast<const int*>(before.p), *q = static_cast<const int*>(after.p);
  const auto *i = static_cast<const int*>(before.i), *j = static_cast<const int*>(after.i);
  for (std::size_t c = 0; c < before.ncol; ++c) {
    if (!std::includes(i + p[c], i + p[c + 1], j + q[c], j + q[c + 1])) return false;
  }
  return true;
}

void update_by_rank_one(const SystemChange& change, const SystemDifferences& found, cholmod_factor* factor,
                        Cholmod& cholmod) {
  const std::vector<int32_t> place = places_in(*factor);
  std::vector<std::vector<std::pair<int32_t, double>>> up, down;
  for (const auto& [clusters, weight] : found.shared) {
    // B has −weight u u'.
    auto& column = (weight < 0 ? up : down).emplace_back();
    for (const int32_t r : clusters) column.emplace_back(place[at(r)], std::sqrt(std::abs(weight)));
    std::sort(column.begin(), column.end());
  }
  for (const auto& [r, mass] : found.mass) {
    (mass > 0 ? up : down).push_back({{place[at(r)], std::sqrt(std::abs(mass))}});
  }
  // What adds comes first: then every matrix on the way is at least the last one, so all are positive definite.
  for (const bool add : {true, false}) {
    const Sparse columns(columns_of(add ? up : down, change.origin.size(), cholmod), cholmod);
    cholmod_updown(add ? 1 : 0, columns.get(), factor, cholmod.get());
    cholmod.check();
  }
}

// `rows`: all of B after, both triangles.
void replace_rows(const SystemChange& change, const Sparse& rows, cholmod_factor* factor, Cholmod& cholmod) {
  const std::vector<int32_t> place = places_in(*factor);
  std::vector<uint8_t> absent(change.origin.size(), 0);
  for (const int32_t r : change.changed) {
    cholmod_rowdel(at(place[at(r)]), nullptr, factor, cholmod.get());
    cholmod.check();
    absent[at(r)] = 1;
  }
  const auto* starts = static_cast<const int*>(rows->p);
  const auto* indices = static_cast<const int*>(rows->i);
  const auto* values = static_cast<const double*>(rows->x);
  for (const int32_t r : change.changed) {
    absent[at(r)] = 0;
    std::vector<std::pair<int32_t, double>> row;
    for (int k = starts[r]; k < starts[r + 1]; ++k) {
      if (!absent[at(indices[k])]) row.emplace_back(place[at(indices[k])], values[k]);
    }
    std::sort(row.begin(), row.end());
    const Sparse column(columns_of({row}, change.origin.size(), cholmod), cholmod);
    cholmod_rowadd(at(place[at(r)]), column.get(), factor, cholmod.get());
    cholmod.check();
  }
}

int64_t entries_of(const cholmod_factor& factor) {
  if (factor.is_super) return static_cast<int64_t>(factor.xsize);
  const auto* counts = static_cast<const int*>(factor.nz);
  return std::accumulate(counts, counts + factor.n, int64_t{0});
}

double greatest(const std::vector<double>& values) {
  double most = 0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

// [rows] Σ |B_rc| of each row; all of `shared` are negative off the diagonal.
std::vector<double> row_sums(const ClusterSystem& system) {
  std::vector<double> sums = system.mass;
  for (const auto& [clusters, weight] : system.shared) {
    for (const int32_t r : clusters) sums[at(r)] += weight * (static_cast<double>(clusters.size()) - 2);
  }
  return sums;
}

double residual_of(const ClusterSystem& system, const std::vector<double>& right, const std::vector<double>& x) {
  std::vector<double> rest = right;
  for (std::size_t r = 0; r < rest.size(); ++r) rest[r] -= system.mass[r] * x[r];
  for (const auto& [clusters, weight] : system.shared) {
    double sum = 0;
    for (const int32_t r : clusters) sum += x[at(r)];
    for (const int32_t r : clusters) rest[at(r)] += weight * sum;
  }
  for (const double value : rest) {
    if (!std::isfinite(value)) return std::numeric_limits<double>::infinity();
  }
  return greatest(rest) / (greatest(row_sums(system)) * greatest(x));
}

}  // namespace

std::optional<Factorised> factorise(const SystemChange& change, Way way, const std::vector<double>& right) {
  Cholmod cholmod;
  const Sparse before = matrix_of(change.before, cholmod), after = matrix_of(change.after, cholmod);
  const SystemDifferences found = differences(change);
  const Sparse both_triangles(cholmod_copy(after.get(), 0, 1, cholmod.get()), cholmod);
  const Factor analysed(cholmod_analyze(before.get(), cholmod.get()), cholmod);
  const auto analyse_in_order = [&](const Sparse& matrix, bool postorder) {
    const GivenOrder given(cholmod, postorder);
    std::vector<int> order = order_of(change, *analysed.get());
    return cholmod_analyze_p(matrix.get(), order.data(), nullptr, 0, cholmod.get());
  };

  std::unique_ptr<Factor> factor;
  const auto make = [&](cholmod_factor* made) { factor = std::make_unique<Factor>(made, cholmod); };
  const auto numerically = [&](const Sparse& matrix) {
    cholmod_factorize(matrix.get(), factor->get(), cholmod.get());
    cholmod.check();
  };
  Clock::time_point begin;
  switch (way) {
    case Way::analyse:
      begin = Clock::now();
      make(cholmod_analyze(after.get(), cholmod.get()));
      numerically(after);
      break;
    case Way::ordered:
      begin = Clock::now();
      make(analyse_in_order(after, true));
      numerically(after);
      break;
    case Way::numeric:
      if (!within_pattern(*before.get(), *after.get())) return std::nullopt;
      make(cholmod_copy_factor(analysed.get(), cholmod.get()));
      numerically(before);
      begin = Clock::now();
      numerically(after);
      break;
    case Way::updown:
    case Way::rows: {
      const Updatable updatable(cholmod);
      make(analyse_in_order(before, false));
      numerically(before);
      begin = Clock::now();
      if (way == Way::updown) {
        update_by_rank_one(change, found, factor->get(), cholmod);
      } else {
        replace_rows(change, both_triangles, factor->get(), cholmod);
      }
      break;
    }
  }
  Factorised result;
  result.seconds = seconds_since(begin);
  begin = Clock::now();
  result.x = oracles::solve(cholmod, factor->get(), right);
  result.solve_seconds = seconds_since(begin);
  result.residual = residual_of(change.after, right, result.x);
  result.entries = entries_of(*factor->get());
  return result;
}

double residual_bound(const SystemChange& change, Way way) {
  const auto n = static_cast<double>(change.origin.size());
  const auto gamma = [](double k) { return k * 0x1p-53 / (1 - k * 0x1p-53); };
  const double growth = 2 * (1 + std::sqrt(n));
  const double amplified = 1 / (1 - change.s);
  double bound = gamma(3 * n + 1) * growth;
  if (way == Way::rows)
    bound += gamma(6 * n + 1) * growth * static_cast<double>(change.changed.size()) * (1 + amplified);
  if (way == Way::updown) {
    std::vector<double> sums = row_sums(change.before);
    double steps = 0;
    const SystemDifferences found = differences(change);
    for (const auto& [clusters, weight] : found.shared) {
      ++steps;
      for (const int32_t r : clusters) {
        if (weight < 0) sums[at(r)] -= weight * static_cast<double>(clusters.size());
        if (weight > 0) steps += weight * amplified / change.after.mass[at(r)];
      }
    }
    for (const auto& [r, mass] : found.mass) {
      ++steps;
      if (mass > 0) sums[at(r)] += mass;
      if (mass < 0) steps += -mass * amplified / change.after.mass[at(r)];
    }
    const double larger = std::max(1.0, greatest(sums) / greatest(row_sums(change.after)));
    bound += gamma(6 * n + 1) * growth * steps * larger;
  }
  return bound;
}

}  // namespace cutproof::benchmarks
