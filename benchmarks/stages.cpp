#include "benchmarks/stages.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "benchmarks/scene.h"
#include "oracles/oracles.h"
#include "reference_cpu/reference.h"

namespace cutproof::benchmarks {

namespace {

std::size_t at(Stage stage) { return static_cast<std::size_t>(stage); }

}  // namespace

namespace {

void run_reference(Stage stage, const Setup& setup, State& state) {
  switch (stage) {
    case Stage::step:
      return reference::step(setup, state);
    case Stage::detect:
      return reference::detect(setup, state);
    case Stage::split:
      return reference::split(setup, state);
    case Stage::merge:
      return reference::merge(setup, state);
    case Stage::expand:
      return reference::expand(setup, state);
    case Stage::skin:
      return reference::skin(setup, state);
  }
}

// Gathers distances one by one. A distance that is no number counts as infinite.
class DistanceSum {
 public:
  explicit DistanceSum(double spacing) : spacing_(spacing) {}
  void add(Vec3 a, Vec3 b) {
    double distance = norm(a - b) / spacing_;
    if (!std::isfinite(distance)) distance = std::numeric_limits<double>::infinity();
    found_.max = std::max(found_.max, distance);
    found_.beyond += distance > kDistanceBound;
    squares_ += distance * distance;
    ++count_;
  }
  Distances result() const {
    Distances distances = found_;
    if (count_ > 0) distances.rms = std::sqrt(squares_ / static_cast<double>(count_));
    return distances;
  }

 private:
  double spacing_;
  Distances found_;
  double squares_ = 0;
  int64_t count_ = 0;
};

Distances worse(const std::optional<Distances>& before, const Distances& now) {
  if (!before) return now;
  return {std::max(before->max, now.max), std::max(before->rms, now.rms), before->beyond + now.beyond};
}

Distances compare_positions(const Setup& setup, const State& expected, const State& got) {
  DistanceSum sum(setup.body.grid.spacing);
  for (std::size_t i = 0; i < got.x.size(); ++i) {
    if (got.alive[i]) sum.add(expected.x[i], got.x[i]);
  }
  return sum.result();
}

bool same_clusters(const Clusters& a, const Clusters& b) {
  return a.offsets == b.offsets && a.members == b.members && a.number == b.number;
}

// A skin without the order of its vertices and triangles: a vertex is named by 6 · owner + direction.
struct NamedSkin {
  std::vector<std::pair<int64_t, Vec3>> vertices;
  std::vector<std::array<int64_t, 3>> triangles;
};
NamedSkin named(const Skin& skin) {
  NamedSkin result;
  const auto name = [&](std::size_t v) { return 6 * int64_t{skin.owner[v]} + skin.direction[v]; };
  for (std::size_t v = 0; v < skin.owner.size(); ++v) result.vertices.emplace_back(name(v), skin.position[v]);
  for (const auto& triangle : skin.triangles) {
    std::array<int64_t, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = name(static_cast<std::size_t>(triangle[k]));
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    result.triangles.push_back(corners);
  }
  std::sort(result.vertices.begin(), result.vertices.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::sort(result.triangles.begin(), result.triangles.end());
  return result;
}

FrameErrors::Surface compare_skins(const Setup& setup, const Skin& expected, const Skin& got) {
  const NamedSkin a = named(expected), b = named(got);
  FrameErrors::Surface surface;
  surface.triangles_equal = a.triangles == b.triangles && a.vertices.size() == b.vertices.size();
  DistanceSum sum(setup.body.grid.spacing);
  for (std::size_t v = 0; v < std::min(a.vertices.size(), b.vertices.size()); ++v) {
    if (a.vertices[v].first != b.vertices[v].first) break;  // the triangles differ too
    sum.add(a.vertices[v].second, b.vertices[v].second);
  }
  surface.vertices = sum.result();
  return surface;
}

int64_t count_differing(const std::vector<int32_t>& a, const std::vector<int32_t>& b) {
  std::vector<int32_t> differing;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(differing));
  return static_cast<int64_t>(differing.size());
}

State take_snapshot(const Backend& backend) {
  std::vector<State> states = backend.snapshot();
  return std::move(states.front());
}

// `before` becomes the reference's answer.
void judge_stage(FrameErrors& errors, Stage stage, const Setup& setup, State& before, const State& after) {
  if (stage == Stage::detect) {
    State expected = before;
    run_reference(stage, setup, expected);
    FrameErrors::Detection found = errors.detect.value_or(FrameErrors::Detection{});
    found.removed += static_cast<int64_t>(after.removed.size());
    const int64_t differing = count_differing(expected.removed, after.removed);
    found.differing += differing;
    if (differing > 0) found.within_rounding &= oracles::detection(setup, before, after).holds;
    errors.detect = found;
    return;
  }
  run_reference(stage, setup, before);
  const State& expected = before;
  switch (stage) {
    case Stage::step:
      errors.step = worse(errors.step, compare_positions(setup, expected, after));
      break;
    case Stage::skin: {
      FrameErrors::Surface now = compare_skins(setup, expected.skin, after.skin);
      if (errors.skin) {
        now.vertices = worse(errors.skin->vertices, now.vertices);
        now.triangles_equal &= errors.skin->triangles_equal;
      }
      errors.skin = now;
      break;
    }
    default:
      errors.clusters_equal[at(stage)] =
          errors.clusters_equal[at(stage)].value_or(true) && same_clusters(expected.clusters, after.clusters);
  }
}

}  // namespace

bool FrameErrors::topology_holds() const {
  return std::all_of(topology.begin(), topology.end(), [](const Verdict& verdict) { return verdict.holds; });
}

FrameErrors judge_frames(Backend& backend, const Setup& setup) {
  FrameErrors errors;
  State state = take_snapshot(backend);
  bool cut = false;
  while (!cut && errors.frames < kJudgedFrames) {
    for (const Stage stage : kStages) {
      backend.run({stage, stage});
      if (!backend.report().ran[at(stage)]) continue;
      State after = take_snapshot(backend);
      judge_stage(errors, stage, setup, state, after);
      state = std::move(after);
      cut |= stage == Stage::split;
    }
    ++errors.frames;
  }
  std::vector<Verdict (*)(const Setup&, const State&)> asked = {oracles::cluster_connectivity, oracles::coverage,
                                                                oracles::edge_cover};
  if (state.edge_covered) asked.push_back(oracles::component_match);
  for (const auto oracle : asked) {
    errors.topology.push_back(oracle(setup, state));
    errors.topology.back().backend = backend.name();
  }
  errors.isolated_groups = oracles::isolation(setup, state).measured;
  return errors;
}

}  // namespace cutproof::benchmarks
