// How a figure goes with several others.
#pragma once
#include <optional>
#include <vector>

namespace cutproof::benchmarks {

struct Slope {
  double value = 0, standard_error = 0;
};
// Least squares of y over a constant and all columns of x: the slope of each column and its standard error, from what
// is left, whose squares are divided by the points less the columns and the constant. None for a column that does not
// change; none for any if points are too few to tell an error, or if columns go together so that nothing tells which of
// them it is. Requires columns as long as y.
std::vector<std::optional<Slope>> slopes_of(const std::vector<std::vector<double>>& x, const std::vector<double>& y);

}  // namespace cutproof::benchmarks
