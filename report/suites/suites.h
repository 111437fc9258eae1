// What the pages of several suites of `bench` need.
#pragma once
#include <string>

#include "report/suites/columns.h"

namespace cutproof::report {

// Nothing of nothing.
std::optional<double> times(const std::optional<double>& value, double factor);
// The median of *times*.
std::optional<double> in_ms(const Field& times);
// The curve of that name, made when it is first asked for.
Curve& curve_named(Chart& chart, const std::string& name, Look look);

}  // namespace cutproof::report
