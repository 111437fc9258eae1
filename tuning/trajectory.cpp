#include "tuning/trajectory.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

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

EventsApart events_apart(const Trajectory& expected, const Trajectory& actual) {
  EventsApart apart;
  const std::size_t frames = std::min(expected.frames.size(), actual.frames.size());
  if (frames == 0) return apart;
  // The first frame at whose end a particle is gone; the number of frames: none.
  const auto gone_at = [&](const Trajectory& trajectory) {
    std::vector<std::size_t> gone(trajectory.frames.front().alive.size(), frames);
    for (std::size_t f = frames; f-- > 0;) {
      const std::vector<uint8_t>& alive = trajectory.frames[f].alive;
      for (std::size_t i = 0; i < alive.size(); ++i) {
        if (alive[i] == 0) gone[i] = f;
      }
    }
    return gone;
  };
  const std::vector<std::size_t> e = gone_at(expected), a = gone_at(actual);
  for (std::size_t i = 0; i < e.size(); ++i) {
    if (e[i] == a[i]) continue;
    ++(e[i] == frames || a[i] == frames ? apart.alive_in_one : apart.in_another_frame);
  }
  for (std::size_t f = 0; f < frames; ++f) {
    const oracles::Pose &one = expected.frames[f], &other = actual.frames[f];
    if (one.alive != other.alive || one.clusters == other.clusters) continue;
    std::vector<uint64_t> both;
    std::set_intersection(one.clusters.begin(), one.clusters.end(), other.clusters.begin(), other.clusters.end(),
                          std::back_inserter(both));
    const std::size_t most = std::max(one.clusters.size(), other.clusters.size());
    apart.clusters_in_one = std::max(apart.clusters_in_one, static_cast<int64_t>(most - both.size()));
  }
  return apart;
}

}  // namespace cutproof::tuning
