#include "model/io/shown_run.h"

#include <algorithm>
#include <limits>

#include "model/at.h"

namespace cutproof::io {

int64_t frames_done(Stage stage, int64_t frame) {
  const bool within = stage != Stage::skin && frame < std::numeric_limits<int64_t>::max();
  return within ? frame + 1 : frame;
}

std::vector<double> frame_starts(const Setup& setup) {
  std::vector<double> starts = {0};
  for (const double dt : setup.substep_length) starts.push_back(starts.back() + dt * setup.step.substeps);
  return starts;
}

double time_after(const std::vector<double>& frame_starts, int64_t frames) {
  return frame_starts[at(std::clamp<int64_t>(frames, 0, std::ssize(frame_starts) - 1))];
}

std::vector<int32_t> cluster_of_particles(const Clusters& clusters, std::size_t particles) {
  std::vector<int32_t> found(particles, -1);
  const auto most = static_cast<int64_t>(clusters.members.size());
  for (std::size_t c = 0; c + 1 < clusters.offsets.size(); ++c) {
    const int64_t from = std::max<int64_t>(clusters.offsets[c], 0), to = std::min(clusters.offsets[c + 1], most);
    for (int64_t k = from; k < to; ++k) {
      const int32_t particle = clusters.members[at(k)];
      if (particle < 0 || static_cast<std::size_t>(particle) >= particles) continue;
      int32_t& number = found[at(particle)];
      if (number == -1) number = clusters.number[c];
    }
  }
  return found;
}

std::optional<std::vector<Vec3>> blade_box(const Setup& setup, int64_t frames) {
  if (!setup.has_blade || setup.blade_moves.empty()) return std::nullopt;
  // At the end of the frames that are over; before the first one, where it begins.
  const int64_t last = std::clamp<int64_t>(frames, 0, setup.frame_count()) * setup.step.substeps - 1;
  const BladeMove& move = setup.blade_moves[at(std::max<int64_t>(last, 0))];
  if (!move.down) return std::nullopt;
  const Blade& blade = setup.blade;
  const BladePose& pose = last < 0 ? move.from : move.to;
  const double margin = blade.thickness / 2;
  const Vec3 normal = cross(pose.along, pose.back);
  std::vector<Vec3> corners;
  for (const double n : {-margin, margin}) {
    for (const double w : {-margin, blade.depth + margin}) {
      for (const double u : {-blade.length / 2 - margin, blade.length / 2 + margin}) {
        corners.push_back(pose.edge + u * pose.along + w * pose.back + n * normal);
      }
    }
  }
  return corners;
}

}  // namespace cutproof::io
