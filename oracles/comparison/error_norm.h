// Norm of many errors of one kind, used for every distance in the project.
#pragma once
#include <cmath>
#include <cstdint>
#include <limits>

namespace cutproof::oracles {

// Required accuracy of positions after one stage (tolerances.md, Against the reference) [h].
inline constexpr double kPositionsWanted = 1e-4;

// NaN counts as infinite.
struct ErrorNorm {
  double max = 0;
  int32_t where = -1;  // index of the greatest; -1 if there is none
  double sum_of_squares = 0;
  int64_t count = 0;
  int64_t beyond = 0;  // how many are greater than kPositionsWanted, in whatever unit

  void add(double error, int32_t index) {
    if (!std::isfinite(error)) error = std::numeric_limits<double>::infinity();
    ++count;
    beyond += error > kPositionsWanted;
    sum_of_squares += error * error;
    if (error > max || where < 0) {
      max = error;
      where = index;
    }
  }
  void join(const ErrorNorm& other) {
    if (other.count == 0) return;
    if (other.max > max || where < 0) {
      max = other.max;
      where = other.where;
    }
    sum_of_squares += other.sum_of_squares;
    count += other.count;
    beyond += other.beyond;
  }
  double rms() const { return count == 0 ? 0 : std::sqrt(sum_of_squares / static_cast<double>(count)); }
};

// Error of data that cannot be measured.
inline ErrorNorm infinite_error() {
  ErrorNorm norm;
  norm.add(std::numeric_limits<double>::infinity(), -1);
  return norm;
}

}  // namespace cutproof::oracles
