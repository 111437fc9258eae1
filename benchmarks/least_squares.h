// Dependence of a figure on several others.
#pragma once
#include <optional>
#include <vector>

namespace cutproof::benchmarks {

struct Slope {
  double value = 0, standard_error = 0;
};
// Least squares of y over a constant and all columns of x: each column's slope and standard error. The error divides
// the squared residuals by the number of points less columns and constant. A constant column has none. No column has
// one if points are too few for an error or if columns are collinear. Requires columns as long as y.
std::vector<std::optional<Slope>> slopes_of(const std::vector<std::vector<double>>& x, const std::vector<double>& y);

}  // namespace cutproof::benchmarks
