#include "cli/relate_page.h"

#include <algorithm>
#include <utility>

#include "cli/report_page.h"
#include "harness/run_states.h"
#include "model/at.h"
#include "model/io/atomic_file.h"
#include "model/io/run_segments.h"

namespace cutproof::cli {

namespace {

harness::RunStates states_of(const std::string& file, int64_t particles) {
  harness::JudgedRun judged;
  judged.particles_at_end = particles;
  return {[file] { return io::RunSegments::of(file); }, judged};
}

// What takes a run that was mapped back: a map of points is affine in them, and turns and scales all alike.
class Back {
 public:
  Back(const oracles::RunMap& map, const std::vector<int32_t>& permutation) : map_(map), permutation_(permutation) {}

  // `time`: of the first run, which a boost needs.
  Vec3 point(Vec3 x, double time) const {
    const Vec3 from = x - map_.point({}, time);
    Vec3 result;
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 unit;
      unit[axis] = 1;
      const Vec3 column = map_.point(unit, time) - map_.point({}, time);
      result[axis] = dot(column, from) / dot(column, column);
    }
    return result;
  }
  State state(const State& mapped, double time) const {
    State state = mapped;
    for (std::size_t i = 0; i < mapped.x.size(); ++i) {
      const std::size_t to = i < permutation_.size() ? at(permutation_[i]) : i;
      if (to >= state.x.size()) continue;
      state.x[to] = point(mapped.x[i], time);
      state.alive[to] = mapped.alive[i];
    }
    for (int32_t& member : state.clusters.members) {
      if (at(member) < permutation_.size()) member = permutation_[at(member)];
    }
    sort_members(state.clusters);
    for (Vec3& place : state.skin.position) place = point(place, time);
    return state;
  }
  // So that the same groups are the same lists, however they were written.
  static void sort_members(Clusters& groups) {
    std::vector<std::vector<int32_t>> sets;
    for (std::size_t k = 0; k + 1 < groups.offsets.size(); ++k) {
      sets.emplace_back(groups.members.begin() + groups.offsets[k], groups.members.begin() + groups.offsets[k + 1]);
      std::sort(sets.back().begin(), sets.back().end());
    }
    std::sort(sets.begin(), sets.end());
    groups.members.clear();
    for (std::size_t k = 0; k < sets.size(); ++k) {
      groups.members.insert(groups.members.end(), sets[k].begin(), sets[k].end());
      groups.offsets[k + 1] = std::ssize(groups.members);
    }
  }

 private:
  const oracles::RunMap& map_;
  const std::vector<int32_t>& permutation_;
};

// Which pieces there are, a relation does not ask.
report::FrameOfRun frame_of(const harness::RunStates& states, const State& state) {
  return {std::vector<int32_t>(state.x.size(), -1), states.swept(), states.time()};
}

}  // namespace

void write_relate_page(const std::string& path, const oracles::RunMap& map, const std::vector<std::string>& files,
                       const harness::JudgedRelation& judged, const nlohmann::json& document,
                       const std::string& again) {
  // Of refinements the last two are the nearest to each other.
  const std::string& own_file = map.name() == "refine" ? files[files.size() - 2] : files.front();
  harness::RunStates own = states_of(own_file, judged.particles), other = states_of(files.back(), judged.particles);
  const Back back(map, judged.permutation);
  const report::Source source = {own.setup(), judged.frames,
                                 [&](int64_t frame) {
                                   State state = own.after(frame);
                                   Back::sort_members(state.clusters);
                                   return io::Snapshot{Stage::skin, std::move(state)};
                                 },
                                 [&](int64_t frame) { return frame_of(own, own.after(frame)); }};
  // A checkpoint begins in the middle of the first run, and of a scene in parts each has a run of its own.
  const bool is_beside = map.name() != "checkpoint" && map.name() != "split";
  const report::Beside beside = {{own.setup(), judged.frames,
                                  [&](int64_t frame) {
                                    const State& state = other.after(frame);
                                    own.after(frame);
                                    return io::Snapshot{Stage::skin, back.state(state, own.time().value_or(0))};
                                  },
                                  [&](int64_t frame) {
                                    report::FrameOfRun of_run = frame_of(other, other.after(frame));
                                    own.after(frame);
                                    for (Vec3& corner : of_run.swept)
                                      corner = back.point(corner, own.time().value_or(0));
                                    return of_run;
                                  }},
                                 true,
                                 files.back(),
                                 own_file,
                                 "the same particle of the other run, brought back to where the first one is"};
  io::write_text(path, report::page(source, report::results_of(document, path), again, made_by(again),
                                    is_beside ? &beside : nullptr));
}

}  // namespace cutproof::cli
