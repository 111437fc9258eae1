#include "benchmarks/least_squares.h"

#include <Eigen/Dense>
#include <cmath>

namespace cutproof::benchmarks {

std::vector<std::optional<Slope>> slopes_of(const std::vector<std::vector<double>>& x, const std::vector<double>& y) {
  std::vector<std::optional<Slope>> slopes(x.size());
  const auto points = static_cast<Eigen::Index>(y.size());
  // Relative to their means, which removes the constant, and of length 1, so that units do not decide what counts as
  // zero.
  const auto centered = [&](const std::vector<double>& values) -> Eigen::VectorXd {
    const Eigen::Map<const Eigen::VectorXd> vector(values.data(), points);
    return vector.array() - (points > 0 ? vector.mean() : 0);
  };
  std::vector<std::size_t> changing;
  std::vector<double> lengths;
  Eigen::MatrixXd columns(points, static_cast<Eigen::Index>(x.size()));
  for (std::size_t k = 0; k < x.size(); ++k) {
    const Eigen::VectorXd column = centered(x[k]);
    const double length = column.norm();
    if (!(length > 0)) continue;
    columns.col(static_cast<Eigen::Index>(changing.size())) = column / length;
    changing.push_back(k);
    lengths.push_back(length);
  }
  const auto count = static_cast<Eigen::Index>(changing.size());
  const Eigen::Index free = points - count - 1;
  if (count == 0 || free < 1) return slopes;
  columns.conservativeResize(Eigen::NoChange, count);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  if (qr.rank() < count) return slopes;
  const Eigen::VectorXd right = centered(y), solution = qr.solve(right);
  const double variance = (right - columns * solution).squaredNorm() / static_cast<double>(free);
  const Eigen::MatrixXd inverse = (columns.transpose() * columns).inverse();
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto at = static_cast<std::size_t>(k);
    slopes[changing[at]] = Slope{solution(k) / lengths[at], std::sqrt(variance * inverse(k, k)) / lengths[at]};
  }
  return slopes;
}

}  // namespace cutproof::benchmarks
