#include "tuning/trajectory.h"

#include <fmt/format.h>

#include <algorithm>

namespace cutproof::tuning {

std::string difference_in_parts(const Trajectory& expected, const Trajectory& actual) {
  const auto differs = [](const oracles::Pose& e, const oracles::Pose& a, const std::string& when) {
    return e.components == a.components ? std::string()
                                        : fmt::format("{} parts {}, expected {}", a.components, when, e.components);
  };
  const auto frame = [](const Trajectory& trajectory, int64_t f) -> const oracles::Pose& {
    return trajectory.frames[static_cast<std::size_t>(f)];
  };
  for (std::size_t s = 0; s < std::min(expected.stroke_end.size(), actual.stroke_end.size()); ++s) {
    const int64_t e = expected.stroke_end[s], a = actual.stroke_end[s];
    if (e < 0 || a < 0) continue;
    std::string found = differs(frame(expected, e), frame(actual, a), fmt::format("after stroke {}", s + 1));
    if (!found.empty()) return found;
  }
  if (expected.frames.empty() || actual.frames.empty()) return {};
  return differs(expected.frames.back(), actual.frames.back(), "at the end");
}

}  // namespace cutproof::tuning
