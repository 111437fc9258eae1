// The judge of a run, by what it rejects: one wrong state after each stage, and exactly the verdicts that must fail, so
// that a property that is not asked, or asked of something else, shows. By the oracles alone: nothing here is compared
// with the reference but what has the same mistake as the reference.
#include "harness/judge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "fixtures/build.h"
#include "gpu/backends.h"
#include "harness/frame_runner.h"
#include "harness/reference_stages.h"
#include "harness/scene_judge.h"
#include "model/at.h"
#include "model/error.h"
#include "model/io/scene_io.h"
#include "model/rules.h"
#include "oracles/comparison/stage_comparison.h"
#include "oracles/surface/surface.h"
#include "reference_cpu/reference.h"

namespace cutproof::harness::judge_test {
namespace {

using ::testing::IsEmpty;

using Counts = std::map<std::string, int>;  // of verdicts, by property

// Each stage has something to do: a stroke cuts the block in two, what is left of its clusters is small and merges, and
// what does not cover its edges grows (uncover).
constexpr const char* kEveryStage = R"({"version": 5, "name": "every stage",
  "body": {"shape": {"kind": "box", "size": [0.08, 0.04, 0.02]}, "spacing": 0.01},
  "clusters": {"side": 2, "small": 1},
  "frame": {"settle": 0.032}, "detect": {"criterion": "geometric"}, "split": {"debris": 2},
  "step": {"acceleration": "none", "gravity": [0, 0, -9.81]},
  "blade": {"speed": 1, "strokes": [{"points": [[0.5, 0.5, 1.3], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]}})";

// Some clusters are isolated.
constexpr const char* kSparse = R"({"version": 5, "name": "sparse",
  "body": {"shape": {"kind": "box", "size": [0.08, 0.04, 0.02]}, "spacing": 0.01},
  "clusters": {"method": "sampled", "spacing": 1.5, "radius": 1}, "expand": {"rule": "none"},
  "frame": {"settle": 0.032}, "step": {"acceleration": "none"}, "detect": {"criterion": "geometric"},
  "blade": {"speed": 1, "strokes": [{"points": [[0.5, 0.5, 1.3], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]}})";

// A block that a blade presses on, and tears by distance.
constexpr const char* kPressed = R"({"version": 5, "name": "pressed",
  "body": {"shape": {"kind": "box", "size": [0.08, 0.04, 0.02]}, "spacing": 0.01}, "clusters": {"side": 2},
  "frame": {"settle": 0.016}, "step": {"acceleration": "none"}, "detect": {"remove": "both"},
  "ground": {"friction": 0.5},
  "blade": {"speed": 1, "strokes": [{"points": [[0.5, 0.5, 1.3], [0.5, 0.5, 0.3]], "along": [0, 1, 0]}]}})";

// One cluster of all, which the stroke parts.
constexpr const char* kHalved = R"({"version": 5, "name": "halved",
  "body": {"shape": {"kind": "box", "size": [0.08, 0.04, 0.02]}, "spacing": 0.01}, "clusters": {"side": 8},
  "frame": {"settle": 0.032}, "detect": {"criterion": "geometric"},
  "step": {"acceleration": "none", "gravity": [0, 0, -9.81]},
  "blade": {"speed": 4, "strokes": [{"points": [[0.5, 0.5, 1.3], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]}})";

int32_t first_alive(const State& state) {
  return static_cast<int32_t>(std::find(state.alive.begin(), state.alive.end(), 1) - state.alive.begin());
}
int32_t last_alive(const State& state) {
  int32_t i = static_cast<int32_t>(state.alive.size()) - 1;
  while (state.alive[at(i)] == 0) --i;
  return i;
}
// Changes members, and with them what follows from them.
void with_lists(const cutproof::Setup& setup, State& state,
                const std::function<void(std::vector<std::vector<int32_t>>&)>& change) {
  Clusters& clusters = state.clusters;
  std::vector<std::vector<int32_t>> lists;
  for (int32_t c = 0; c < clusters.count(); ++c) {
    const auto members = clusters.of(c);
    lists.emplace_back(members.begin(), members.end());
  }
  change(lists);
  clusters.members.clear();
  clusters.offsets = {0};
  for (const auto& list : lists) {
    clusters.members.insert(clusters.members.end(), list.begin(), list.end());
    clusters.offsets.push_back(static_cast<int64_t>(clusters.members.size()));
  }
  reference::update_rest_frames(setup.body, clusters);
}
// The last cluster loses its last particle that others hold too.
void shrink(const cutproof::Setup& setup, const State&, State& after) {
  std::vector<int> held(after.alive.size(), 0);
  for (const int32_t i : after.clusters.members) ++held[at(i)];
  with_lists(setup, after, [&](auto& lists) {
    for (auto list = lists.rbegin(); list != lists.rend(); ++list) {
      for (auto i = list->rbegin(); list->size() > 1 && i != list->rend(); ++i) {
        if (held[at(*i)] < 2) continue;
        list->erase(std::next(i).base());
        return;
      }
    }
    FAIL() << "no particle lies in two clusters";
  });
}
// Clusters lose particles that others hold, and with them edges that nothing else covers.
void uncover(fixtures::Built& built) {
  for (int k = 0; k < 6; ++k) shrink(built.setup, built.state, built.state);
  built.state.edge_covered = false;
}

// A scene and the moments of its run by the reference.
struct SceneRun {
  explicit SceneRun(const std::string& json, const std::function<void(cutproof::Setup&)>& adapt = {})
      : SceneRun(json, *reference::make_backend(), adapt) {}
  SceneRun(const std::string& json, Backend& backend, const std::function<void(cutproof::Setup&)>& adapt = {})
      : built(fixtures::build(io::parse_scene(json, "the test's scene"), "the test's scene")) {
    if (json == kEveryStage) uncover(built);
    if (adapt) adapt(built.setup);
    FrameRunner runner(backend, {built.setup}, {built.state});
    initial = runner.states().front();
    while (!runner.is_over()) runner.run_frame([&](const Moment& moment) { moments.push_back(moment); });
    broken = runner.take_broken_contracts();
  }
  std::vector<Verdict> judged(Promises promises = {}) const {
    Judge judge(built.setup, "a backend", promises, Thorough::always);
    judge.begin(initial);
    for (const Moment& moment : moments) judge.see(moment);
    return judge.take_verdicts();
  }
  // The first moment of a stage in a frame that removes something; of the last frame that removes nothing if not.
  std::size_t find(Stage stage, bool cutting) const {
    std::size_t found = moments.size();
    for (std::size_t k = 0; k < moments.size(); ++k) {
      if (moments[k].span.last != stage) continue;
      bool cuts = false;
      for (const Moment& other : moments) {
        cuts = cuts || (other.before->frame == moments[k].before->frame && !other.after->removed.empty());
      }
      if (cuts != cutting) continue;
      found = k;
      if (cutting) return found;
    }
    EXPECT_LT(found, moments.size()) << "the scene has no such moment: " << name_of(stage);
    return found;
  }

  fixtures::Built built;
  Snapshot initial;
  std::vector<Moment> moments;
  std::vector<Verdict> broken;
};

Counts counted(const std::vector<Verdict>& verdicts) {
  Counts counts;
  for (const Verdict& verdict : verdicts) ++counts[verdict.property];
  return counts;
}
Counts failures(const std::vector<Verdict>& verdicts) {
  Counts counts;
  for (const Verdict& verdict : verdicts) counts[verdict.property] += verdict.holds ? 0 : 1;
  std::erase_if(counts, [](const auto& entry) { return entry.second == 0; });
  return counts;
}
std::string first_failure(const std::vector<Verdict>& verdicts) {
  for (const Verdict& verdict : verdicts) {
    if (!verdict.holds) return verdict.property + ": " + verdict.witness.text;
  }
  return "";
}

// --- What is wrong ---------------------------------------------------------------------------------------------------

using Change = std::function<void(const cutproof::Setup&, const State& before, State& after)>;

struct Wrong {
  const char* what;
  const char* scene;
  Stage stage;
  bool cutting;
  Change change;
  Counts fails;  // verdicts of the whole run, by property
};

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Mat3 kTurned = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};

// The first cluster takes in a particle from far away.
void reach_far(const cutproof::Setup& setup, const State&, State& after) {
  with_lists(setup, after, [&](auto& lists) {
    const int32_t far = last_alive(after);
    if (lists[0].back() != far) lists[0].push_back(far);
  });
}
// A cluster loses a particle without which all edges are covered, and every cluster is connected, as before.
void shrink_where_nothing_needs_it(const cutproof::Setup& setup, const State&, State& after) {
  const State right = after;
  for (int32_t c = 0; c < right.clusters.count(); ++c) {
    for (int64_t k = 0; k < right.clusters.size(c); ++k) {
      after = right;
      with_lists(setup, after, [&](auto& lists) { lists[at(c)].erase(lists[at(c)].begin() + k); });
      const bool small = after.clusters.size(c) < after.tau;
      if (!small && oracles::edge_cover(setup, after).holds && oracles::cluster_connectivity(setup, after).holds)
        return;
    }
  }
  FAIL() << "every particle is needed";
}
void turn_inside_out(const cutproof::Setup&, const State&, State& after) {
  for (auto& t : after.skin.triangles) std::swap(t[0], t[1]);
}

std::vector<Wrong> wrong_states() {
  using enum Stage;
  const char *all = kEveryStage, *pressed = kPressed;
  return {
      // After step.
      {"a particle is shifted",
       all,
       step,
       false,
       [](const cutproof::Setup&, const State&, State& s) { s.x[at(first_alive(s))].y += 1e-5; },
       {{"admissible step", 1}, {"motion", 1}}},
      {"all are shifted",
       all,
       step,
       false,
       [](const cutproof::Setup&, const State&, State& s) {
         for (std::size_t i = 0; i < s.x.size(); ++i) s.x[i].y += s.alive[i] != 0 ? 1e-9 : 0;
       },
       {{"admissible step", 1}, {"motion", 1}}},
      {"a velocity is off",
       all,
       step,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.v[at(first_alive(s))].x += 1e-6; },
       {{"admissible step", 1}, {"linear momentum", 1}}},
      {"one piece pulls another",
       all,
       step,
       false,
       [](const cutproof::Setup&, const State&, State& s) {
         s.v[at(first_alive(s))].x += 1e-6;
         s.v[at(last_alive(s))].x -= 1e-6;
       },
       {{"admissible step", 1}, {"component momentum", 1}}},
      {"an impulse out of nothing",
       all,
       step,
       false,
       [](const cutproof::Setup&, const State&, State& s) { s.impulse.z = 1e-6; },
       {{"admissible step", 1}, {"linear momentum", 1}, {"motion", 1}}},
      {"a position is no number",
       all,
       step,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.x[at(first_alive(s))].z = kNan; },
       {{"admissible step", 1}, {"finite", 1}}},
      {"two particles are shifted, their centre of mass is not",
       all,
       step,
       true,
       [](const cutproof::Setup&, const State&, State& s) {
         const std::size_t one = at(first_alive(s)), other = at(last_alive(s));
         s.x[one].y += 1e-9;
         s.x[other].y -= 1e-9;
       },
       {{"admissible step", 1}}},
      {"a rotation is off",
       all,
       step,
       true,
       [](const cutproof::Setup&, const State&, State& s) {
         Mat3& r = s.clusters.rotation[1];
         for (int row = 0; row < 3; ++row) r(row, 0) += 1e-9 * r(row, 1);
       },
       {{"admissible step", 1}}},
      {"a rotation reflects",
       all,
       skin,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.clusters.rotation[1].m = {1, 0, 0, 0, 1, 0, 0, 0, -1}; },
       {{"rotation", 1}, {"skin vertices", 1}, {"untouched", 1}}},
      {"a dead particle moves",
       all,
       step,
       false,
       [](const cutproof::Setup&, const State&, State& s) {
         s.x[at(static_cast<int32_t>(std::find(s.alive.begin(), s.alive.end(), 0) - s.alive.begin()))].x += 1e-3;
       },
       {{"untouched", 1}}},
      {"a dead particle gets another velocity",
       all,
       step,
       false,
       [](const cutproof::Setup&, const State&, State& s) {
         s.v[at(static_cast<int32_t>(std::find(s.alive.begin(), s.alive.end(), 0) - s.alive.begin()))].x += 1e-3;
       },
       {{"untouched", 1}}},
      {"a cluster says that another rotation would be as good",
       all,
       step,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.clusters.degenerate[1] = 1; },
       {{"admissible step", 1}}},
      {"a step keeps a list of removals",
       all,
       step,
       false,
       [](const cutproof::Setup&, const State&, State& s) {
         s.removed = {static_cast<int32_t>(std::find(s.alive.begin(), s.alive.end(), 0) - s.alive.begin())};
       },
       {{"untouched", 1}}},
      {"a cluster's mass is off",
       all,
       step,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.clusters.mass[2] *= 1 + 1e-9; },
       {{"untouched", 1}}},
      // After detect.
      {"nothing is removed",
       all,
       detect,
       true,
       [](const cutproof::Setup&, const State& before, State& s) {
         s.removed.clear();
         s.alive = before.alive;
       },
       {{"detection", 1}}},
      {"one particle too few is removed",
       all,
       detect,
       true,
       [](const cutproof::Setup&, const State&, State& s) {
         s.alive[at(s.removed.back())] = 1;
         s.removed.pop_back();
       },
       {{"detection", 1}}},
      {"one particle too many is removed",
       all,
       detect,
       false,
       [](const cutproof::Setup&, const State&, State& s) {
         s.removed = {last_alive(s)};
         s.alive[at(s.removed[0])] = 0;
       },
       {{"detection", 1}}},
      {"a particle dies unlisted",
       all,
       detect,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.removed.erase(s.removed.begin()); },
       {{"detection", 1}}},
      {"a dead particle comes back in detection",
       all,
       detect,
       false,
       [](const cutproof::Setup&, const State&, State& s) {
         s.alive[at(static_cast<int32_t>(std::find(s.alive.begin(), s.alive.end(), 0) - s.alive.begin()))] = 1;
       },
       {{"detection", 1}}},
      {"a velocity changes in detection",
       all,
       detect,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.v[0].x += 1e-9; },
       {{"untouched", 1}}},
      {"tissue stands across the blade",
       pressed,
       detect,
       true,
       [](const cutproof::Setup& setup, const State& before, State& s) {
         // Two neighbours, on either side of the blade where the frame ends.
         const auto last = (before.frame + 1) * setup.step.substeps - 1;
         const BladePose& pose = setup.blade_moves[at(last)].to;
         const Vec3 normal = cross(pose.along, pose.back), middle = pose.edge + (setup.blade.depth / 2) * pose.back;
         const int32_t i = first_alive(s);
         s.x[at(i)] = middle - (setup.body.grid.spacing / 2) * normal;
         s.x[at(setup.body.neighbour(i, 0))] = middle + (setup.body.grid.spacing / 2) * normal;
       },
       {{"no pass", 1}, {"untouched", 1}}},
      // After split.
      {"a cluster reaches across the cut",
       all,
       split,
       true,
       reach_far,
       {{"cluster connectivity", 1}, {"split exactness", 1}}},
      {"a cluster has not the rotation that it inherits",
       all,
       split,
       true,
       [](const cutproof::Setup&, const State& before, State& s) {
         int32_t c = 0;  // one that lost something
         while (s.clusters.size(c) == before.clusters.size(c)) ++c;
         s.clusters.rotation[at(c)] = kTurned;
       },
       {{"split exactness", 1}}},
      {"a rest center is that of before",
       all,
       split,
       true,
       [](const cutproof::Setup& setup, const State&, State& s) {
         s.clusters.rest_center.front().x += 1e-6 * setup.body.grid.spacing;
       },
       {{"rest frames", 1}}},
      {"nothing is split",
       all,
       split,
       true,
       [](const cutproof::Setup&, const State& before, State& s) { s.clusters = before.clusters; },
       {{"coverage", 1}, {"split exactness", 1}}},
      {"debris that is none",
       all,
       split,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.debris = {first_alive(s)}; },
       {{"coverage", 1}, {"split exactness", 1}}},
      {"debris where none is wanted",
       pressed,
       split,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.debris = {first_alive(s)}; },
       {{"coverage", 1}, {"split exactness", 1}}},
      {"a position changes in split",
       all,
       split,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.x[0].x += 1e-9; },
       {{"untouched", 1}}},
      // After merge.
      {"nothing is merged",
       all,
       merge,
       true,
       [](const cutproof::Setup&, const State& before, State& s) { s.clusters = before.clusters; },
       {{"merge maximality", 1}}},
      {"a cluster takes in what was not merged into it",
       all,
       merge,
       true,
       reach_far,
       {{"cluster connectivity", 1}, {"merge legality", 1}}},
      {"a cluster loses a particle", all, merge, true, shrink, {{"merge legality", 1}, {"merge maximality", 1}}},
      {"a cluster does not keep its rotation",
       all,
       merge,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.clusters.rotation.front() = kTurned; },
       {{"merge legality", 1}}},
      {"a mass is off",
       all,
       merge,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.clusters.mass.front() *= 1 + 1e-9; },
       {{"rest frames", 1}}},
      {"the cap changes in merge",
       all,
       merge,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.cap += 1; },
       {{"untouched", 1}}},
      // After expand.
      {"nothing grows",
       all,
       expand,
       true,
       [](const cutproof::Setup&, const State& before, State& s) { s.clusters = before.clusters; },
       {{"edge cover", 1}, {"expansion", 1}}},
      {"nothing grows, and nothing is promised",
       all,
       expand,
       true,
       [](const cutproof::Setup&, const State& before, State& s) {
         s.clusters = before.clusters;
         s.edge_covered = false;
       },
       {{"expansion", 1}}},
      {"a cluster grows from far away", all, expand, true, reach_far, {{"cluster connectivity", 1}, {"expansion", 1}}},
      {"a cluster shrinks", all, expand, true, shrink, {{"edge cover", 1}, {"expansion", 1}}},
      {"a cluster loses what it need not hold", all, expand, true, shrink_where_nothing_needs_it, {{"expansion", 1}}},
      {"a number changes in expand",
       all,
       expand,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.clusters.number.back() += 1; },
       {{"expansion", 1}, {"untouched", 1}}},
      {"every group stands alone",
       all,
       expand,
       true,
       [](const cutproof::Setup& setup, const State&, State& s) {
         with_lists(setup, s, [&](auto& lists) {  // each particle in its first cluster only
           std::set<int32_t> held;
           for (auto& list : lists) std::erase_if(list, [&](int32_t i) { return !held.insert(i).second; });
           for (auto& list : lists) {
             if (list.empty()) list.push_back(first_alive(s));
           }
         });
         s.edge_covered = false;
       },
       {{"cluster connectivity", 1}, {"component match", 1}, {"expansion", 1}, {"isolation", 1}}},
      // After skin.
      {"a triangle is flipped",
       all,
       skin,
       true,
       [](const cutproof::Setup&, const State&, State& s) {
         std::swap(s.skin.triangles[5][0], s.skin.triangles[5][1]);
       },
       {{"skin geometry", 1}, {"skin shells", 1}, {"skin surface", 1}}},
      {"a triangle is missing",
       all,
       skin,
       false,
       [](const cutproof::Setup&, const State&, State& s) { s.skin.triangles.pop_back(); },
       {{"skin geometry", 1}, {"skin surface", 1}}},
      {"a vertex is off",
       all,
       skin,
       true,
       [](const cutproof::Setup& setup, const State&, State& s) {
         s.skin.position[7].y += 1e-6 * setup.body.grid.spacing;
       },
       {{"skin vertices", 1}}},
      {"a vertex lies elsewhere on its edge",
       all,
       skin,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.skin.reach[0] = 0.4; },
       {{"skin reach", 1}, {"skin vertices", 1}}},
      {"the skin is turned inside out", all, skin, true, turn_inside_out, {{"skin geometry", 1}, {"skin match", 1}}},
      {"the skin is that of before",
       all,
       skin,
       true,
       [](const cutproof::Setup&, const State& before, State& s) { s.skin = before.skin; },
       {{"skin geometry", 1}, {"skin match", 1}, {"skin surface", 1}, {"skin vertices", 1}}},
      {"there is no skin",
       all,
       skin,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.skin = {}; },
       {{"skin geometry", 1}, {"skin match", 1}, {"skin surface", 1}, {"skin vertices", 1}}},
      {"numbers are not compact",
       all,
       skin,
       true,
       [](const cutproof::Setup&, const State&, State& s) { s.clusters.number.back() += 1; },
       {{"untouched", 1}}},
      {"a particle comes back in skin",
       all,
       skin,
       false,
       [](const cutproof::Setup&, const State&, State& s) {
         s.alive[at(static_cast<int32_t>(std::find(s.alive.begin(), s.alive.end(), 0) - s.alive.begin()))] = 1;
       },
       {{"component match", 1},
        {"coverage", 1},
        {"edge cover", 1},
        {"isolation", 1},
        {"skin geometry", 1},
        {"skin vertices", 1},
        {"untouched", 1}}},
      {"a cluster shrinks in skin", all, skin, true, shrink, {{"edge cover", 1}, {"untouched", 1}}},
  };
}

const SceneRun& run_of(const char* scene) {
  static std::map<const char*, std::unique_ptr<SceneRun>> runs;
  std::unique_ptr<SceneRun>& run = runs[scene];
  if (!run) run = std::make_unique<SceneRun>(scene);
  return *run;
}

// The moments of a run, one of whose states is another; what comes after it begins with the right one again.
SceneRun changed(const SceneRun& right, const Wrong& wrong) {
  SceneRun run = right;
  Moment& moment = run.moments[right.find(wrong.stage, wrong.cutting)];
  State after = *moment.after;
  wrong.change(right.built.setup, *moment.before, after);
  EXPECT_FALSE(same_bits(after, *moment.after)) << wrong.what;
  moment.after = std::make_shared<const State>(std::move(after));
  return run;
}

// Each property after each stage that it is said to be due after (docs/reference/oracles.md): neither fewer nor more.
TEST(Judge, AcceptsEveryStageOfARightRunAndAsksAsOftenAsItMust) {
  struct Expected {
    const char* scene;
    std::map<Stage, int> moments;
    Counts verdicts;
  };
  using enum Stage;
  const std::vector<Expected> expected = {
      // The first of two frames that cut covers every edge; what rests on that is asked from its expansion on.
      {kEveryStage,
       {{step, 4}, {detect, 4}, {split, 2}, {merge, 2}, {expand, 1}, {skin, 4}},
       {{"admissible step", 4},  {"linear momentum", 4}, {"component momentum", 4}, {"motion", 4},
        {"detection", 4},        {"no pass", 4},         {"split exactness", 2},    {"merge legality", 2},
        {"cap kept", 2},         {"expansion", 1},       {"untouched", 17},         {"finite", 17},
        {"well formed", 13},     {"rest frames", 13},    {"rotation", 13},          {"cluster connectivity", 9},
        {"coverage", 9},         {"edge cover", 7},      {"component match", 7},    {"isolation", 7},
        {"merge maximality", 7}, {"skin match", 4},      {"skin surface", 4},       {"skin vertices", 4},
        {"skin shells", 4},      {"skin geometry", 4},   {"skin reach", 4}}},
      // Every edge is covered from the beginning.
      {kPressed,
       {{step, 3}, {detect, 3}, {split, 1}, {merge, 1}, {skin, 3}},
       {{"admissible step", 3}, {"linear momentum", 3},  {"component momentum", 3},
        {"motion", 3},          {"detection", 3},        {"no pass", 3},
        {"split exactness", 1}, {"merge legality", 1},   {"cap kept", 1},
        {"untouched", 11},      {"finite", 11},          {"well formed", 8},
        {"rest frames", 8},     {"rotation", 8},         {"cluster connectivity", 5},
        {"coverage", 5},        {"edge cover", 5},       {"component match", 5},
        {"isolation", 5},       {"merge maximality", 4}, {"skin match", 3},
        {"skin surface", 3},    {"skin vertices", 3},    {"skin shells", 3},
        {"skin geometry", 3},   {"skin reach", 3}}}};
  for (const auto& [scene, moments, counts] : expected) {
    const SceneRun& run = run_of(scene);
    std::map<Stage, int> seen;
    for (const Moment& moment : run.moments) ++seen[moment.span.last];
    EXPECT_EQ(seen, moments);
    const auto verdicts = run.judged();
    EXPECT_THAT(failures(verdicts), IsEmpty()) << first_failure(verdicts);
    EXPECT_EQ(counted(verdicts), counts);
  }
}

TEST(Judge, RejectsOneWrongStateByExactlyWhatItViolates) {
  std::set<std::string> shown;
  for (const Wrong& wrong : wrong_states()) {
    SCOPED_TRACE(std::string(wrong.what) + ", after " + std::string(name_of(wrong.stage)));
    const SceneRun& right = run_of(wrong.scene);
    const SceneRun run = changed(right, wrong);
    const auto verdicts = run.judged();
    EXPECT_EQ(failures(verdicts), wrong.fails) << first_failure(verdicts);
    for (const Verdict& verdict : verdicts) {
      if (verdict.holds) continue;
      shown.insert(verdict.property);
      EXPECT_EQ(verdict.stage, wrong.stage) << verdict.property;
      EXPECT_FALSE(verdict.witness.text.empty()) << verdict.property;
    }
  }
  // A property that no row shows is not tested here: it needs one.
  for (const oracles::PropertyList* list : oracles::properties()) {
    for (const oracles::Property& property : *list) {
      const std::string name(property.name);
      // Those two have tests of their own.
      EXPECT_TRUE(name == "well formed" || name == "cap kept" || shown.contains(name)) << name;
    }
  }
}

// Of what cannot be read nothing else is asked, and what follows is looked at again.
TEST(Judge, RejectsAStateThatCannotBeReadAfterEachStageAndGoesOn) {
  const SceneRun& right = run_of(kEveryStage);
  for (const Stage stage : kStages) {
    SCOPED_TRACE(name_of(stage));
    const Wrong wrong = {"a member that does not exist",
                         kEveryStage,
                         stage,
                         true,
                         [](const cutproof::Setup&, const State&, State& s) { s.clusters.members[0] = 1'000'000; },
                         {}};
    const auto verdicts = changed(right, wrong).judged();
    EXPECT_EQ(failures(verdicts), (Counts{{"well formed", 1}})) << first_failure(verdicts);
    EXPECT_EQ(verdicts.back().frame, right.built.setup.frame_count() - 1);
  }
}

// Every property is vouched for by one word, or asked of everybody; and every word names properties that there are, or
// that only relations, or states of others, are asked for.
TEST(Promises, NameEveryPropertyOnce) {
  std::map<std::string_view, int> words;
  std::map<std::string_view, std::set<std::string_view>> named;
  for (const PromiseWord& word : promise_words()) {
    named[word.name] = {word.properties.begin(), word.properties.end()};
    if (word.name == "free_skin") continue;  // part of what "skin" promises
    for (const std::string_view property : word.properties) ++words[property];
  }
  for (const std::string_view property : named.at("free_skin")) EXPECT_TRUE(named.at("skin").contains(property));
  for (const auto& [property, count] : words) EXPECT_EQ(count, 1) << property;
  const std::set<std::string_view> of_everybody = {"well formed",     "finite",         "untouched", "detection",
                                                   "split exactness", "merge legality", "expansion"};
  for (const oracles::PropertyList* list : properties_of(Depth::motion)) {
    for (const oracles::Property& property : *list) {
      EXPECT_NE(words.contains(property.name), of_everybody.contains(property.name)) << property.name;
      EXPECT_EQ(Promises{.words = 0}.cover(property.name), of_everybody.contains(property.name)) << property.name;
      EXPECT_TRUE(Promises{}.cover(property.name)) << property.name;
    }
  }
}

TEST(Promises, LeaveThePlacesOfASkinFreeUnlessBothWordsAreGiven) {
  const Promises free{.words = parse_promises("free_skin", "f", "promises")};
  const Promises both{.words = parse_promises("free_skin skin", "f", "promises")};
  EXPECT_TRUE(free.free_skin_places());
  EXPECT_FALSE(both.free_skin_places());
  EXPECT_FALSE(Promises{}.free_skin_places()) << "who promises all promises skin";
  for (const char* property : {"skin surface", "skin match", "surface", "surface shells", "surface places"}) {
    EXPECT_TRUE(free.cover(property)) << property;
  }
  for (const char* property : {"skin vertices", "skin geometry", "skin reach", "surface vertices"}) {
    EXPECT_FALSE(free.cover(property)) << property;
    EXPECT_TRUE(both.cover(property)) << property;
  }
}

TEST(Promises, AreReadAsWords) {
  EXPECT_EQ(parse_promises("", "f", "promises"), 0u);
  const uint32_t bits = parse_promises("  coupled connected ", "f", "promises");
  EXPECT_TRUE(Promises{.words = bits}.cover("isolation"));
  EXPECT_TRUE(Promises{.words = bits}.cover("cluster connectivity"));
  EXPECT_FALSE(Promises{.words = bits}.cover("coverage"));
  try {
    parse_promises("connected perfect", "my.npz", "promises");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find("my.npz: promises: there is no promise 'perfect'"), 0u) << error.what();
    EXPECT_NE(std::string(error.what()).find("edges_covered"), std::string::npos);
  }
}

// A union that is legal but for a cap that was lower all along.
TEST(Judge, RejectsAUnionAboveTheCap) {
  const SceneRun run(kEveryStage);
  int merged = 0;
  for (const Moment& moment : run.moments) {
    if (moment.span != Span{Stage::merge, Stage::merge}) continue;
    int32_t largest = 0;
    for (int32_t c = 0; c < moment.after->clusters.count(); ++c) {
      largest = std::max(largest, static_cast<int32_t>(moment.after->clusters.size(c)));
    }
    const auto with_cap = [&](const Snapshot& state, int32_t cap) {
      State changed = *state;
      changed.cap = cap;
      return std::make_shared<const State>(std::move(changed));
    };
    for (const int32_t cap : {largest, 1}) {
      Judge judge(run.built.setup, "a backend", Promises{}, Thorough::never);
      Moment lower = moment;
      lower.before = with_cap(moment.before, cap);
      lower.after = with_cap(moment.after, cap);
      judge.begin(lower.before);
      judge.see(lower);
      const Counts failing = failures(judge.verdicts());
      EXPECT_EQ(failing.contains("cap kept"),
                cap == 1 && moment.before->clusters.count() > moment.after->clusters.count());
      EXPECT_FALSE(failing.contains("merge legality"));
    }
    merged += moment.before->clusters.count() > moment.after->clusters.count();
  }
  EXPECT_GT(merged, 0);
}

// A word that nobody gives takes its properties out of the verdicts, wrong or right, and they are named.
TEST(Judge, JudgesOnlyTheWordsThatAreGiven) {
  const SceneRun run(kEveryStage);
  Promises promises;
  promises.words = parse_promises("connected rest_frames skin momentum", "", "");
  Judge judge(run.built.setup, "a backend", promises, Thorough::never);
  judge.begin(run.initial);
  for (const Moment& moment : run.moments) judge.see(moment);
  std::set<std::string> judged, left_out;
  for (const Verdict& verdict : judge.verdicts()) judged.insert(verdict.property);
  for (const Judge::Unpromised& unpromised : judge.unpromised()) left_out.insert(unpromised.property);
  for (const char* property : {"cluster connectivity", "rest frames", "skin surface", "untouched"}) {
    EXPECT_TRUE(judged.contains(property)) << property;
  }
  for (const char* property : {"coverage", "component match", "cap kept", "rotation", "admissible step"}) {
    EXPECT_TRUE(left_out.contains(property)) << property;
    EXPECT_FALSE(judged.contains(property)) << property;
  }
}

// Where nothing covers every edge, rules promise no coupling; all else is asked for as before, the skin too.
TEST(Judge, LeavesOutWhatNobodyPromisesAndNothingElse) {
  const SceneRun run(kSparse);
  const Counts all = counted(run.judged());
  Judge judge(run.built.setup, "a backend", kPromisesOfRules, Thorough::always);
  judge.begin(run.initial);
  for (const Moment& moment : run.moments) judge.see(moment);
  Counts found = counted(judge.verdicts());
  for (const Judge::Unpromised& unpromised : judge.unpromised()) {
    EXPECT_TRUE(unpromised.property == "component match" || unpromised.property == "isolation") << unpromised.property;
    EXPECT_FALSE(found.contains(unpromised.property));
    EXPECT_GT(unpromised.failing, 0);
    found[unpromised.property] = static_cast<int>(unpromised.states);
  }
  EXPECT_EQ(judge.unpromised().size(), 2u);
  EXPECT_EQ(found, all);
}

// --- What reference and backend have in common -----------------------------------------------------------------------

// A comparison with a reference that makes the same mistake holds; the oracles know nothing of either.
TEST(Judge, FindsAMistakeThatTheReferenceSharesWhereTheComparisonIsBlind) {
  std::map<Stage, int> blind;
  for (const Wrong& wrong : wrong_states()) {
    if (wrong.stage == Stage::step) continue;  // its comparison runs the reference many times, from other states
    SCOPED_TRACE(std::string(wrong.what) + ", after " + std::string(name_of(wrong.stage)));
    const SceneRun& right = run_of(wrong.scene);
    const SceneRun run = changed(right, wrong);
    const Moment& moment = run.moments[right.find(wrong.stage, wrong.cutting)];
    oracles::ReferenceStages mistaken = reference_stages();
    mistaken[at(wrong.stage)] = [&](const cutproof::Setup&, State& state) {
      state = *moment.after;
      if (wrong.stage != Stage::skin) return;
      state.frame = moment.before->frame;  // the end of the frame is no part of the stage
    };
    oracles::StageComparison comparison(run.built.setup, mistaken);
    bool holds = true;
    for (const Verdict& verdict : comparison.compare(wrong.stage, *moment.before, *moment.after, true).verdicts("")) {
      holds = holds && verdict.holds;
    }
    if (!holds) continue;
    ++blind[wrong.stage];
    EXPECT_FALSE(failures(run.judged()).empty());
  }
  for (const Stage stage : {Stage::detect, Stage::split, Stage::merge, Stage::expand, Stage::skin}) {
    EXPECT_GE(blind[stage], 1) << name_of(stage);
  }
}

// Mutants of both at once are found here: no state is compared with another one.
TEST(Judge, AcceptsTheReferenceAndTheKernelsByTheOraclesAlone) {
  for (const char* scene : {kEveryStage, kPressed}) {
    for (const MergeRule rule : {MergeRule::deterministic, MergeRule::published}) {
      for (const bool kernels : {false, true}) {
        const auto backend = kernels ? gpu::make_host_backend() : reference::make_backend();
        const SceneRun run(scene, *backend, [&](cutproof::Setup& setup) { setup.merge.rule = rule; });
        const auto verdicts = run.judged();
        EXPECT_THAT(failures(verdicts), IsEmpty()) << backend->name() << ": " << first_failure(verdicts);
        EXPECT_THAT(run.broken, IsEmpty());
      }
    }
  }
}

// --- Several stages in one piece -------------------------------------------------------------------------------------

// Moments of split and merge as one.
SceneRun split_and_merge_joined(MergeRule rule, const Change& change) {
  SceneRun run(kEveryStage, [&](cutproof::Setup& setup) { setup.merge.rule = rule; });
  const std::size_t split = run.find(Stage::split, true), merge = run.find(Stage::merge, true);
  EXPECT_EQ(merge, split + 1);
  State after = *run.moments[merge].after;
  change(run.built.setup, *run.moments[split].before, after);
  run.moments[split].span.last = Stage::merge;
  run.moments[split].after = std::make_shared<const State>(std::move(after));
  run.moments.erase(run.moments.begin() + static_cast<std::ptrdiff_t>(merge));
  return run;
}

TEST(StagesInOnePiece, ThatLeaveSeveralRightAnswersAreJudgedByTheOracleWhereItCan) {
  const Change nothing = [](const cutproof::Setup&, const State&, State&) {};
  for (const MergeRule rule : {MergeRule::deterministic, MergeRule::published}) {
    const bool unique = rule == MergeRule::deterministic;
    SCOPED_TRACE(cutproof::name_of(rule));
    const auto right = split_and_merge_joined(rule, nothing).judged();
    EXPECT_THAT(failures(right), IsEmpty()) << first_failure(right);
    EXPECT_EQ(counted(right)["stages in one piece"], 1);
    EXPECT_EQ(counted(right)["merge legality"], unique ? 1 : 2) << "of the other frame that cuts, and of this";
    for (const Verdict& verdict : right) EXPECT_EQ(verdict.inconclusive, 0) << verdict.property;
    const Counts found = failures(split_and_merge_joined(rule, reach_far).judged());
    EXPECT_TRUE(found.contains(unique ? "stages in one piece" : "merge legality"));
    const Counts unsplit =
        failures(split_and_merge_joined(rule, [](const cutproof::Setup&, const State& before, State& s) {
                   s.clusters = before.clusters;
                 }).judged());
    EXPECT_TRUE(unsplit.contains(unique ? "stages in one piece" : "merge legality"));
  }
}

// The same run, of which the stages from `first` to skin are seen as one.
SceneRun joined_from(Stage first, SceneRun run) {
  std::vector<Moment> moments;
  for (const Moment& moment : run.moments) {
    const bool begins =
        moment.span.first <= first || moments.back().span.last == Stage::skin || moments.back().span.last < first;
    if (begins) {
      moments.push_back(moment);
    } else {
      moments.back().after = moment.after;
      moments.back().span.last = moment.span.last;
    }
  }
  run.moments = moments;
  return run;
}
SceneRun in_whole_frames(SceneRun run) { return joined_from(Stage::step, std::move(run)); }

TEST(StagesInOnePiece, ThatNobodyCanTellApartAreCounted) {
  const SceneRun run =
      in_whole_frames(SceneRun(kEveryStage, [](cutproof::Setup& setup) { setup.merge.rule = MergeRule::published; }));
  const auto verdicts = run.judged();
  EXPECT_THAT(failures(verdicts), IsEmpty()) << first_failure(verdicts);
  int64_t inconclusive = 0;
  for (const Verdict& verdict : verdicts) {
    if (verdict.property != "stages in one piece") continue;
    EXPECT_GT(verdict.checked, 0) << "all but the clusters was compared";
    inconclusive += verdict.inconclusive;
  }
  EXPECT_GT(inconclusive, 0);
}

// --- Rotations through a cut of which only the end is seen
// ------------------------------------------------------------

// Turned about z, as a state and its skin would have it.
void turn(const cutproof::Setup& setup, State& state, int32_t c, double angle) {
  const double s = std::sin(angle), k = std::cos(angle);
  const Mat3 by = {{k, -s, 0, s, k, 0, 0, 0, 1}};
  Mat3& r = state.clusters.rotation[at(c)];
  Mat3 turned;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      double sum = 0;
      for (int i = 0; i < 3; ++i) sum += by(row, i) * r(i, column);
      turned(row, column) = sum;
    }
  }
  r = turned;
  reference::skin(setup, state);
}

// A whole frame that cuts, or that does not, in which clusters are turned; what follows begins with the right state.
SceneRun with_turned(const SceneRun& frames, bool cutting, const std::function<bool(int32_t)>& which, double angle) {
  SceneRun run = frames;
  Moment& moment = run.moments[run.find(Stage::skin, cutting)];
  State after = *moment.after;
  for (int32_t c = 0; c < after.clusters.count(); ++c) {
    if (which(c)) turn(run.built.setup, after, c, angle);
  }
  moment.after = std::make_shared<const State>(std::move(after));
  return run;
}

const std::array kRules = {MergeRule::deterministic, MergeRule::published};

// Skins are made for the turned clusters, so nothing but the rotations is wrong.
TEST(WholeFrames, ThatCutAreRejectedIfEveryClusterIsTurned) {
  for (const MergeRule rule : kRules) {
    const SceneRun frames =
        in_whole_frames(SceneRun(kEveryStage, [&](cutproof::Setup& setup) { setup.merge.rule = rule; }));
    EXPECT_THAT(failures(frames.judged()), IsEmpty()) << first_failure(frames.judged());
    for (const double angle : {3.0, 0.1, 1e-6, 1e-10}) {
      SCOPED_TRACE(std::string(cutproof::name_of(rule)) + " by " + std::to_string(angle));
      const auto verdicts = with_turned(
                                frames, true, [](int32_t) { return true; }, angle)
                                .judged();
      EXPECT_THAT(failures(verdicts), testing::Contains(testing::Key("admissible step")));
      for (const Verdict& verdict : verdicts) {
        if (verdict.holds || verdict.property != "admissible step") continue;
        EXPECT_EQ(verdict.witness.clusters.size(), 1u);
        EXPECT_NE(verdict.witness.text.find("the rotation of cluster"), std::string::npos) << verdict.witness.text;
      }
    }
  }
}

// Each by itself, but for what several small ones were merged to by a rule that leaves several answers.
TEST(WholeFrames, ThatCutAreRejectedIfOneClusterIsTurned) {
  for (const MergeRule rule : kRules) {
    const SceneRun frames =
        in_whole_frames(SceneRun(kEveryStage, [&](cutproof::Setup& setup) { setup.merge.rule = rule; }));
    const int32_t clusters = frames.moments[frames.find(Stage::skin, true)].after->clusters.count();
    int32_t accepted = 0;
    for (int32_t c = 0; c < clusters; ++c) {
      const Counts found = failures(with_turned(
                                        frames, true, [&](int32_t other) { return other == c; }, 0.1)
                                        .judged());
      accepted += found.contains("admissible step") || found.contains("stages in one piece") ? 0 : 1;
    }
    EXPECT_GT(clusters, 3);
    EXPECT_LE(accepted, rule == MergeRule::deterministic ? 0 : clusters / 4) << cutproof::name_of(rule);
  }
}

TEST(WholeFrames, ThatCutNothingAreRejectedIfAClusterIsTurned) {
  const SceneRun frames = in_whole_frames(run_of(kEveryStage));
  for (const double angle : {0.1, 1e-9}) {
    const auto verdicts = with_turned(
                              frames, false, [](int32_t c) { return c == 1; }, angle)
                              .judged();
    EXPECT_THAT(failures(verdicts), testing::Contains(testing::Key("admissible step"))) << angle;
  }
}

// What a split has parted has one rotation, and a union that of the cluster whose number it keeps; where the step was
// seen before, theirs.
TEST(StagesInOnePiece, LeaveEveryClusterTheRotationThatItInherits) {
  for (const char* scene : {kEveryStage, kHalved}) {
    for (const Stage first : {Stage::step, Stage::detect, Stage::split}) {
      const SceneRun run = joined_from(first, run_of(scene));
      EXPECT_THAT(failures(run.judged()), IsEmpty()) << first_failure(run.judged());
      const std::size_t cut = run.find(Stage::skin, true);
      const int32_t clusters = run.moments[cut].after->clusters.count();
      int32_t found = 0;
      for (int32_t c = 0; c < clusters; ++c) {
        State after = *run.moments[cut].after;
        after.clusters.degenerate[at(c)] ^= 1;
        SceneRun wrong = run;
        wrong.moments[cut].after = std::make_shared<const State>(std::move(after));
        for (const Verdict& verdict : wrong.judged()) {
          if (verdict.holds || verdict.property != "stages in one piece") continue;
          ++found;
          EXPECT_FALSE(verdict.witness.clusters.empty());
          EXPECT_NE(verdict.witness.text.find("has not the rotation"), std::string::npos) << verdict.witness.text;
        }
      }
      // Of a step that nobody saw by itself one piece tells of the other, and a cluster by itself of nothing.
      if (first != Stage::step || scene == kHalved) {
        EXPECT_EQ(found, clusters) << name_of(first);
      }
      EXPECT_GT(clusters, 1);
    }
  }
}

// Every rotation of a right frame is asked for, but what nobody is shown.
TEST(WholeFrames, LeaveOpenTheRotationsOfWhatIsGoneAlone) {
  for (const MergeRule rule : kRules) {
    for (const bool kernels : {false, true}) {
      const auto backend = kernels ? gpu::make_host_backend() : reference::make_backend();
      const SceneRun run =
          in_whole_frames(SceneRun(kEveryStage, *backend, [&](cutproof::Setup& setup) { setup.merge.rule = rule; }));
      const auto verdicts = run.judged();
      EXPECT_THAT(failures(verdicts), IsEmpty()) << first_failure(verdicts);
      int64_t inconclusive = 0, checked = 0, clusters = 0;
      for (const Verdict& verdict : verdicts) {
        if (verdict.property != "admissible step") continue;
        inconclusive += verdict.inconclusive;
        checked += verdict.checked;
      }
      for (const Moment& moment : run.moments) {
        if (!moment.after->removed.empty()) clusters += moment.before->clusters.count();
      }
      EXPECT_LT(inconclusive, clusters / 2) << inconclusive << " of " << clusters << " clusters";
      EXPECT_GT(checked, clusters);
    }
  }
}

// --- What a scene expects --------------------------------------------------------------------------------------------

// Whether a run with one wrong state holds for a scene that expects isolated clusters.
bool holds_as_expected(const std::function<void(const cutproof::Setup&, State&)>& change, Stage stage) {
  SceneRun run(kSparse);
  Expectations expectations;
  expectations.isolated_clusters = Range{1, 1000};
  Moment& moment = run.moments[run.find(stage, true)];
  State after = *moment.after;
  change(run.built.setup, after);
  moment.after = std::make_shared<const State>(std::move(after));
  SceneJudge judge(run.built.setup, expectations, "a backend", run.initial);
  for (const Moment& one : run.moments) judge.see(one);
  judge.finish();
  return judge.holds();
}

TEST(Expectations, OfIsolatedClustersExcuseNothingElse) {
  EXPECT_TRUE(holds_as_expected([](const cutproof::Setup&, State&) {}, Stage::skin)) << "some are isolated";
  EXPECT_FALSE(holds_as_expected(
      [](const cutproof::Setup&, State& s) {  // all around one of two pieces
        const std::vector<int32_t> owner = s.skin.owner;
        std::erase_if(s.skin.triangles, [&](const auto& t) { return owner[at(t[0])] % 8 >= 4; });
      },
      Stage::skin));
  EXPECT_FALSE(holds_as_expected([](const cutproof::Setup& setup, State& s) { reach_far(setup, s, s); }, Stage::split));
}

TEST(Expectations, OfIsolatedClustersExcuseConnectedTissueThatIsNotCoupledAlone) {
  const auto excused = [](Verdict verdict) {
    Expectations expectations;
    expectations.isolated_clusters = Range{1, 1000};
    const SceneRun& run = run_of(kEveryStage);
    verdict.holds = false;
    return ExpectationCheck(run.built.setup, expectations, run.initial).is_expected_failure(verdict);
  };
  Verdict uncoupled, across;
  uncoupled.property = across.property = "component match";
  uncoupled.witness.path = {1, 2};
  across.witness.clusters = {3};
  EXPECT_TRUE(excused(uncoupled));
  EXPECT_FALSE(excused(across));
  for (const oracles::PropertyList* list : oracles::properties()) {
    for (const oracles::Property& property : *list) {
      if (property.name == "component match") continue;
      Verdict verdict = uncoupled;
      verdict.property = property.name;
      EXPECT_EQ(excused(verdict), property.name == "isolation") << property.name;
    }
  }
}

}  // namespace
}  // namespace cutproof::harness::judge_test
