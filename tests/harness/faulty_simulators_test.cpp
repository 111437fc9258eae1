// Simulators that compute something else than the method says, each by little: `run --check` and `check` reject every
// one of them, and the one without a fault holds. They keep the topology right to the bit, so all that shows is the
// motion, or a number a little off.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "harness/relation_sample.h"
#include "harness/scene_judge.h"
#include "model/at.h"
#include "oracles/oracles.h"
#include "tests/harness/recorded_scene.h"
#include "tests/harness/simulator.h"

namespace cutproof::faulty_simulators_test {
namespace {

using ::testing::IsEmpty;
using ::testing::Not;
using tests::failing;
using tests::Fault;
using tests::RecordedScene;
using tests::Simulator;

// --- Faults ----------------------------------------------------------------------------------------------------------

constexpr double kGravity = 9.81;  // [m/s²]

struct Piece {
  double mass = 0;
  Vec3 momentum, moment;  // Σ m v, Σ m x
};
std::vector<Piece> pieces_of(const Setup& setup, const State& state, const oracles::Partition& partition) {
  std::vector<Piece> pieces(at(partition.count));
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    if (!state.alive[i]) continue;
    Piece& piece = pieces[at(partition.label[i])];
    const double m = setup.body.mass[i];
    piece.mass += m;
    piece.momentum += m * state.v[i];
    piece.moment += m * state.x[i];
  }
  return pieces;
}

// The first two pieces draw each other by 5 % of the lighter one's weight.
void attract(const Setup& setup, State& state) {
  const oracles::Partition partition = oracles::graph_components(setup, state);
  if (partition.count < 2) return;
  const std::vector<Piece> pieces = pieces_of(setup, state, partition);
  const Vec3 way = pieces[1].moment / pieces[1].mass - pieces[0].moment / pieces[0].mass;
  const double time = setup.step.substeps * setup.substep_length[at(state.frame)];
  const Vec3 impulse = (0.05 * kGravity * std::min(pieces[0].mass, pieces[1].mass) * time / norm(way)) * way;
  for (std::size_t i = 0; i < state.v.size(); ++i) {
    if (partition.label[i] == 0) state.v[i] += impulse / pieces[0].mass;
    if (partition.label[i] == 1) state.v[i] -= impulse / pieces[1].mass;
  }
}

// What each piece moves beside its centre of mass, but for particles that follow a grip.
void heat(const Setup& setup, State& state) {
  const oracles::Partition partition = oracles::graph_components(setup, state);
  const std::vector<Piece> pieces = pieces_of(setup, state, partition);
  std::vector<uint8_t> held(state.v.size(), 0);
  for (const Grip& grip : setup.grips) {
    for (const int32_t i : grip.particles) held[at(i)] = 1;
  }
  for (std::size_t i = 0; i < state.v.size(); ++i) {
    if (!state.alive[i] || held[i]) continue;
    const Piece& piece = pieces[at(partition.label[i])];
    const Vec3 mean = piece.momentum / piece.mass;
    state.v[i] = mean + std::sqrt(1.04) * (state.v[i] - mean);
  }
}

void shift_rest_centers(const Setup& setup, Clusters& clusters) {
  for (Vec3& center : clusters.rest_center) center.x += 3e-4 * setup.body.grid.spacing;
}

void shift_skin(const Setup& setup, Skin& skin) {
  for (Vec3& position : skin.position) position.y += 1e-3 * setup.body.grid.spacing;
}

// --- Scenes ----------------------------------------------------------------------------------------------------------

std::string scene_named(const std::string& name) {
  std::ostringstream text;
  text << std::ifstream(CUTPROOF_SOURCE "/fixtures/scenes/" + name + ".json").rdbuf();
  return text.str();
}

// A block on a floor with friction, under gravity, cut in two.
std::string small_block() { return scene_named("small_block"); }
// Two pieces, one of them pulled away; nothing else acts on them. A fault takes 5 to 20 s here: there is an attraction
// only once there are two pieces, so the whole scene is judged, twice.
std::string kidney() {
  nlohmann::json scene = nlohmann::json::parse(scene_named("kidney_discontinuous"));
  scene["body"]["particles"] = 600;
  return scene.dump();
}

// --- Judged as the program judges ------------------------------------------------------------------------------------

struct Rejections {
  std::vector<std::string> by_run, by_check;  // properties that fail
};

Rejections judge(const Fault& fault, const std::string& scene) {
  Simulator simulator(fault);
  RecordedScene recorded(scene, simulator);
  harness::SceneJudge live(recorded.built.setup, recorded.scene.expect, simulator.name(), recorded.trace.initial);
  harness::RelationSample relations(recorded.built.setup, std::make_unique<Simulator>(fault));
  for (const harness::Moment& moment : recorded.trace.moments) {
    live.see(moment);
    relations.see(moment);
  }
  for (Verdict& verdict : relations.take_verdicts()) live.add(std::move(verdict));
  for (const Verdict& verdict : recorded.broken_contracts) live.add(verdict);
  live.finish();
  return {failing(live), failing(*recorded.judged())};
}

using FaultAndScene = std::tuple<Fault, std::string>;

class FaultySimulator : public testing::TestWithParam<FaultAndScene> {};

TEST_P(FaultySimulator, IsRejectedByRunAndByCheck) {
  const auto& [fault, scene] = GetParam();
  const Rejections found = judge(fault, scene == "kidney" ? kidney() : small_block());
  std::cout << "run --check: " << testing::PrintToString(found.by_run)
            << "; check: " << testing::PrintToString(found.by_check) << std::endl;
  EXPECT_THAT(found.by_run, Not(IsEmpty())) << "run --check holds";
  EXPECT_THAT(found.by_check, Not(IsEmpty())) << "check holds";
}

std::string name_of_test(const testing::TestParamInfo<FaultAndScene>& info) {
  return std::get<Fault>(info.param).name + "_" + std::get<std::string>(info.param);
}

Fault of_setup(const std::string& name, void (*setup)(Setup&)) {
  Fault fault{name};
  fault.setup = setup;
  return fault;
}
Fault of_state(const std::string& name, std::function<void(const Setup&, State&)> before,
               std::function<void(const Setup&, State&)> after) {
  Fault fault{name};
  fault.before_step = std::move(before);
  fault.after_step = std::move(after);
  return fault;
}
Fault of_rest_centers() {
  Fault fault{"RestCentersOff"};
  fault.rest_frames = shift_rest_centers;
  return fault;
}
Fault of_skin() {
  Fault fault{"SkinOff"};
  fault.skin = shift_skin;
  return fault;
}

// In the kidney's scene there is neither gravity nor a floor.
const std::vector<Fault> kInEveryScene = {of_setup("NoIterations", [](Setup& setup) { setup.step.iterations = 0; }),
                                          of_setup("OneIteration", [](Setup& setup) { setup.step.iterations = 1; }),
                                          of_setup("StiffnessTenth", [](Setup& setup) { setup.step.stiffness *= 0.1; }),
                                          of_state("AttractionBetweenPieces", attract, {}),
                                          of_state("EnergyGrowing", {}, heat),
                                          of_rest_centers(),
                                          of_skin()};
INSTANTIATE_TEST_SUITE_P(InEveryScene, FaultySimulator,
                         testing::Combine(testing::ValuesIn(kInEveryScene), testing::Values("small_block", "kidney")),
                         name_of_test);
INSTANTIATE_TEST_SUITE_P(OnTheFloor, FaultySimulator,
                         testing::Combine(testing::Values(of_setup("FloorWithoutFriction",
                                                                   [](Setup& setup) {
                                                                     for (Wall& wall : setup.walls) wall.friction = 0;
                                                                   }),
                                                          of_setup("GravityOff",
                                                                   [](Setup& setup) {
                                                                     setup.step.gravity = 1.005 * setup.step.gravity;
                                                                   })),
                                          testing::Values("small_block")),
                         name_of_test);

// The control: all of the above are rejected for their faults, and not for how they are run or rounded here.
TEST(FaultlessSimulator, HoldsInTheSameScenes) {
  for (const std::string& scene : {small_block(), kidney()}) {
    const Rejections found = judge({"Faultless"}, scene);
    EXPECT_THAT(found.by_run, IsEmpty());
    EXPECT_THAT(found.by_check, IsEmpty());
  }
}

}  // namespace
}  // namespace cutproof::faulty_simulators_test
