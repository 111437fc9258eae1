// How the kernels of the step distribute jobs: lanes per job, and each team's first job.
#pragma once
#include <cstdint>

#include "gpu/launch/block.h"

namespace cutproof::gpu::step_detail {

// Lanes that share a group: one for each row of the map of a carried group; more for passes over its particles or if it
// is resolved. In a large load one thread has all rows, and half as many lanes share the particles.
inline constexpr int kRowTeam = 4, kParticleTeam = 16, kResolvedTeam = 32;
inline constexpr int kMostByRows = 150'000;  // a load with more is large

// Lanes that share a tracked or a resolved group, where kRows lanes share a carried one. (Half a warp leaves half as
// many idle, and takes longer. With it a frame of a million particles on a floor is an eighth shorter. If only a blade
// touches them, it is a hundredth longer.)
template <int kRows>
inline constexpr int kResolvedLanes = kRows == 1 ? kResolvedTeam / 2 : kResolvedTeam;

// The first job of a team in a list, where the first `threads` threads of the grid are busy with other jobs. The list
// begins with the threads behind those. (The last threads of the grid would be late: their blocks start last.)
template <class AnyTeam>
CUTPROOF_DEVICE int64_t first_job(const AnyTeam& team, int threads) {
  const auto teams = static_cast<unsigned>(team.stride());  // a remainder of 64 bits takes a hundred instructions
  unsigned busy = (static_cast<unsigned>(threads) + AnyTeam::kLanes - 1) / AnyTeam::kLanes;
  if (busy >= teams) busy %= teams;
  const int64_t first = team.first() - busy;
  return first < 0 ? first + teams : first;
}

// Threads of the grid that are busy with `jobs` jobs of small teams and, behind them, `others` jobs of large teams.
template <class Small, class Large>
CUTPROOF_DEVICE int busy_threads(const Small&, int jobs, const Large&, int others) {
  return jobs * Small::kLanes +
         (others > 0 ? (others + 1) * Large::kLanes : 0);  // + 1: large teams begin at a whole one
}

// The lanes of a warp have found jobs, and each team of the warp takes one. Returns this team's job, or -1 if none is
// left. found: the lanes, as bits; taken ones are cleared. job: the one of this lane.
template <class Warp, class AnyTeam>
CUTPROOF_DEVICE int take_each(const Warp& warp, const AnyTeam& team, unsigned& found, int job) {
  constexpr int kTeams = Warp::kLanes / AnyTeam::kLanes;
  int mine = -1;
  for (int k = 0; k < kTeams && found != 0; ++k) {
    const int next = warp.take(found, job);
    if (k == team.first() % kTeams) mine = next;
  }
  return mine;
}

}  // namespace cutproof::gpu::step_detail
