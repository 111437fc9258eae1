#include "oracles/runs/run_relation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "model/at.h"
#include "model/error.h"

namespace cutproof::run_relation_tests {
namespace {

using namespace oracles;

// A lattice of 3 × 3 × 2 particles, h = 0.1 m, that flies, turns and is held together by springs. In frame 5 its two
// halves get groups of their own. Another map of it is computed from its own formula, and rounds by itself.
struct Flight {
  static constexpr int kFrames = 10;
  static constexpr double kH = 0.1, kDt = 0.01;
  RunHeader header;
  std::vector<std::vector<Vec3>> x, v;
  std::vector<std::vector<uint8_t>> alive;
  std::vector<RunCoupling> coupling;
  std::vector<double> time, mass;

  Flight() {
    for (int k = 0; k < 18; ++k) header.rest.push_back(kH * Vec3{double(k % 3), double(k / 3 % 3), double(k / 9)});
    header.gravity = Vec3{0, 0, -10};
    header.spacing = kH;
    header.steps = 4;
    for (int k = 0; k < 18; ++k) mass.push_back(1 + k % 2);
    for (int f = 0; f < kFrames; ++f) {
      const double t = f * kDt, angle = 3 * t;
      x.emplace_back();
      v.emplace_back();
      for (const Vec3 arm : header.rest) {
        const Vec3 turned = {std::cos(angle) * arm.x - std::sin(angle) * arm.y,
                             std::sin(angle) * arm.x + std::cos(angle) * arm.y, arm.z};
        x.back().push_back(turned + Vec3{0.3 * t, 0, -5 * t * t});
        v.back().push_back(cross({0, 0, 3}, turned) + Vec3{0.3, 0, -10 * t});
      }
      alive.emplace_back(18, 1);
      time.push_back(t);
      RunCoupling groups;
      if (f < 5) {
        groups.offsets = {0, 18};
      } else {
        groups.offsets = {0, 9, 18};
      }
      groups.members.resize(18);
      std::iota(groups.members.begin(), groups.members.end(), 0);
      coupling.push_back(groups);
    }
  }

  void map(const RunMap& by) {
    for (Vec3& rest : header.rest) rest = by.point(rest, 0);
    header.gravity = by.mapped(*header.gravity, Follows::direction, {1, -2, 0});
    header.spacing *= by.scale({1, 0, 0});
    for (double& m : mass) m *= by.scale({0, 0, 1});
    for (int f = 0; f < kFrames; ++f) {
      for (Vec3& place : x[at(f)]) place = by.point(place, time[at(f)]);
      for (Vec3& velocity : v[at(f)]) velocity = by.velocity(velocity);
      time[at(f)] *= by.scale({0, 1, 0});
    }
  }
  // One rounding of the body's size, in each frame anew.
  void disturb(uint64_t seed, double by = 0x1p-53) {
    std::mt19937_64 random(seed);
    for (int f = 1; f < kFrames; ++f) {
      for (Vec3& place : x[at(f)]) place.x += random() % 2 == 0 ? by : -by;
      for (Vec3& velocity : v[at(f)]) velocity.x += random() % 2 == 0 ? by : -by;
    }
  }

  RelatedRun at_frame(int f) const {
    RelatedRun run;
    run.frame.index = f;
    run.frame.time = time[at(f)];
    run.frame.positions = x[at(f)];
    run.frame.velocities = v[at(f)];
    run.frame.alive = alive[at(f)];
    run.coupling = &coupling[at(f)];
    run.is_new_coupling = f == 0 || f == 5;
    return run;
  }
};

struct Judged {
  std::vector<Verdict> verdicts;
  std::vector<std::string> notes;
  RelationSharpness sharpest;

  std::vector<std::string> failed() const {
    std::vector<std::string> names;
    for (const Verdict& verdict : verdicts) {
      if (!verdict.holds) names.push_back(verdict.property);
    }
    return names;
  }
  const Verdict& of(const std::string& property) const {
    return *std::find_if(verdicts.begin(), verdicts.end(), [&](const Verdict& v) { return v.property == property; });
  }
};

Judged judge(const std::string& word, const Flight& a, const Flight& b, const std::vector<Flight>& noise = {},
             bool bits = false, const std::vector<int32_t>& permutation = {}) {
  RunRelation relation(RunMap::parse(word), a.header, b.header, static_cast<int>(noise.size()), bits);
  if (!permutation.empty()) relation.permute(permutation);
  relation.weigh(a.mass, b.mass);
  for (int f = 0; f < Flight::kFrames; ++f) {
    std::vector<RelatedRun> disturbed;
    for (const Flight& run : noise) disturbed.push_back(run.at_frame(f));
    relation.see(a.at_frame(f), b.at_frame(f), disturbed);
  }
  relation.finish();
  return {relation.verdicts(), relation.notes(), relation.sharpest()};
}

using Names = std::vector<std::string>;

constexpr const char* kMaps[] = {"same",        "reset",          "units:4,0.25,16", "units:1000,3,0.7",
                                 "mirror:x",    "mirror:z",       "rotate:90x",      "rotate:180y",
                                 "rotate:270z", "shift:0.1,-3,7", "boost:1,2,3"};

TEST(RunRelation, HoldsOfARunAndItsMap) {
  for (const char* const word : kMaps) {
    const Flight a;
    Flight b;
    b.map(RunMap::parse(word));
    EXPECT_EQ(judge(word, a, b).failed(), Names{}) << word;
    Flight one, other;
    one.disturb(1), other.disturb(2);
    EXPECT_EQ(judge(word, a, b, {one, other}).failed(), Names{}) << word;
  }
}

TEST(RunRelation, RejectsOneParticleThatIsBeyondTheBound) {
  for (const char* const word : kMaps) {
    for (const bool has_noise : {false, true}) {
      const Flight a;
      Flight b, one, other;
      one.disturb(1), other.disturb(2);
      b.map(RunMap::parse(word));
      const std::vector<Flight> noise = has_noise ? std::vector<Flight>{one, other} : std::vector<Flight>{};
      const double length = RunMap::parse(word).scale({1, 0, 0}),
                   bound = judge(word, a, b, noise).of("related positions").bound;
      EXPECT_LT(bound, word == std::string("shift:0.1,-3,7") ? 5e-12 : 1e-13) << word;
      b.x[7][11].y += 1e-11 * length;
      const Judged judged = judge(word, a, b, noise);
      EXPECT_EQ(judged.failed(), Names{"related positions"}) << word;
      EXPECT_EQ(judged.of("related positions").witness.particles, std::vector<int32_t>{11}) << word;
      const std::string text = judged.of("related positions").witness.text;
      const char* const explained = has_noise ? "64 times the noise of the disturbed runs explains" : "Rounding alone";
      for (const char* const words : {"1 of 18 particles is off in frame 7, particle 11 by most: ", " m. ", explained,
                                      "The property fails in 1 of "})
        EXPECT_NE(text.find(words), std::string::npos) << text;
      EXPECT_EQ(judged.of("related positions").frame, 7) << word;
      EXPECT_NEAR(judged.of("related positions").measured, 1e-11, 1e-12) << word;
    }
  }
}

TEST(RunRelation, RejectsAVelocityThatIsBeyondTheBound) {
  Flight b;
  b.v[7][3].z += 1e-9;
  EXPECT_EQ(judge("same", Flight(), b).failed(), Names{"related velocities"});
}

TEST(RunRelation, AllowsSinglePrecisionItsRounding) {
  const auto rounded = [](Flight run) {
    run.header.u = 0x1p-24;
    for (auto& places : run.x) {
      for (Vec3& x : places) x = {double(float(x.x)), double(float(x.y)), double(float(x.z))};
    }
    return run;
  };
  Flight b;
  b.map(RunMap::parse("shift:0.1,0,0"));
  const Flight a = rounded(Flight());
  b = rounded(b);
  EXPECT_EQ(judge("shift:0.1,0,0", a, b).failed(), Names{});
  b.x[1][4].x += 1e-5;
  EXPECT_EQ(judge("shift:0.1,0,0", a, b).failed(), Names{"related positions"});
}

TEST(RunRelation, TellsAnInputThatWasNotMapped) {
  const RunMap units = RunMap::parse("units:4,4,16");
  for (const char* const what : {"gravity", "rest", "mass", "time", "spacing"}) {
    Flight b;
    b.map(units);
    const Flight plain;
    if (what == std::string("gravity")) b.header.gravity = plain.header.gravity;
    if (what == std::string("rest")) b.header.rest[5].x += 1e-9;
    if (what == std::string("mass")) b.mass = plain.mass;
    if (what == std::string("time")) b.time = plain.time;
    if (what == std::string("spacing")) b.header.spacing = 0.1;
    const Judged judged = judge("units:4,4,16", plain, b);
    EXPECT_EQ(judged.failed(), Names{"related inputs"}) << what;
    EXPECT_NE(judged.of("related inputs").witness.text.find(what == std::string("time") ? "is at" : what),
              std::string::npos);
  }
}

TEST(RunRelation, FollowsAPermutationOfParticlesAndOfGroups) {
  const Flight a;
  std::vector<int32_t> was(18);
  std::iota(was.begin(), was.end(), 0);
  std::shuffle(was.begin(), was.end(), std::mt19937_64(3));
  Flight b;
  for (std::size_t i = 0; i < 18; ++i) {
    b.header.rest[i] = a.header.rest[at(was[i])];
    b.mass[i] = a.mass[at(was[i])];
    for (std::size_t f = 0; f < Flight::kFrames; ++f) {
      b.x[f][i] = a.x[f][at(was[i])];
      b.v[f][i] = a.v[f][at(was[i])];
      for (std::size_t k = 0; k < 18; ++k) {
        if (a.coupling[f].members[k] == was[i]) b.coupling[f].members[k] = static_cast<int32_t>(i);
      }
    }
  }
  EXPECT_EQ(judge("permute", a, b, {}, true, was).failed(), Names{});
  std::swap(b.x[6][2], b.x[6][3]);
  std::swap(b.coupling[5].members[0], b.coupling[5].members[17]);
  EXPECT_EQ(judge("permute", a, b, {}, false, was).failed(), (Names{"related positions", "related coupling"}));
}

TEST(RunRelation, AsksForBitsWhereTheyArePromised) {
  Flight b;
  b.x[4][9].x = std::nextafter(b.x[4][9].x, 1);
  const Judged without = judge("same", Flight(), b);
  EXPECT_EQ(without.failed(), Names{});
  EXPECT_NE(without.notes.front().find("frame 4 on, first in particle 9"), std::string::npos) << without.notes.front();
  EXPECT_EQ(judge("same", Flight(), b, {}, true).failed(), Names{"same bits"});
  EXPECT_EQ(judge("same", Flight(), Flight(), {}, true).failed(), Names{});
}

TEST(RunRelation, LeavesOpenWhatDisturbedRunsDecideOtherwise) {
  Flight a, b, one, other;
  one.disturb(1), other.disturb(2);
  for (std::size_t f = 6; f < Flight::kFrames; ++f) b.alive[f][3] = 0;
  EXPECT_EQ(judge("same", a, b, {one, other}).failed(), Names{"related existence"});
  for (std::size_t f = 6; f < Flight::kFrames; ++f) other.alive[f][3] = 0;
  EXPECT_EQ(judge("same", a, b, {one, other}).failed(), Names{});
  Flight cut;
  cut.coupling[5] = cut.coupling[4];
  EXPECT_EQ(judge("same", a, cut).failed(), Names{"related coupling"});
  one.coupling[5] = one.coupling[4];
  EXPECT_EQ(judge("same", a, cut, {one}).failed(), Names{});
}

// A run that goes on from a checkpoint has times that were summed since the first run began.
TEST(RunRelation, AllowsTimesTheRoundingOfAllFramesSinceTheBeginning) {
  for (const int64_t before : {0, 1000}) {
    const Flight a;
    RunRelation relation(RunMap::parse("checkpoint"), a.header, a.header, 0, false);
    for (int f = 1; f < Flight::kFrames; ++f) {
      RelatedRun one = a.at_frame(f), other = one;
      one.frame.index = before + f;
      other.frame.time = *other.frame.time * (1 + 0x1p-43);  // a thousand roundings
      relation.see(one, other, {});
    }
    relation.finish();
    const std::vector<Verdict> verdicts = relation.verdicts();
    EXPECT_EQ(verdicts.front().property, "related inputs");
    EXPECT_EQ(verdicts.front().holds, before > 0);
  }
}

TEST(RunRelation, NamesWhatIsNotAsked) {
  const Flight a;
  RunRelation relation(RunMap::parse("same"), a.header, a.header, 0, false);
  for (int f = 0; f < Flight::kFrames; ++f) {
    RelatedRun one = a.at_frame(f), other = one;
    other.frame.velocities = {};
    relation.see(one, other, {});
  }
  relation.finish();
  Names names;
  for (const RunJudge::NotAsked& each : relation.not_asked()) names.push_back(each.property);
  EXPECT_EQ(names, (Names{"related velocities", "related spin", "related contact impulse", "related energy"}));
}

TEST(RunRelation, SaysWhereNothingWasTested) {
  EXPECT_EQ(judge("same", Flight(), Flight(), {Flight()}).failed(), Names{"noise is there"});
  Flight chaotic;
  chaotic.disturb(1, 0.1);
  const Judged judged = judge("same", Flight(), Flight(), {chaotic});
  EXPECT_EQ(judged.failed(), Names{"something was judged"});
  EXPECT_NE(judged.notes.back().find("Lost in chaos from frame 1"), std::string::npos) << judged.notes.back();
  Flight still;
  still.x.assign(Flight::kFrames, still.x.front());
  EXPECT_EQ(judge("same", still, still).failed(), Names{"something was judged"});
}

TEST(RunRelation, OfRefinementAsksForAnOrder) {
  const auto with_error = [](int64_t steps, double error) {
    Flight run;
    run.header.steps = steps;
    for (std::size_t f = 0; f < Flight::kFrames; ++f) {
      for (Vec3& x : run.x[f]) x.x += error * run.time[f];
    }
    return run;
  };
  // The runs end with the frames of the last of them. "" or what fails.
  const auto failing = [](const std::vector<Flight>& runs, int frames = Flight::kFrames) {
    std::vector<RunHeader> headers;
    for (const Flight& run : runs) headers.push_back(run.header);
    RunRefinement refinement(headers);
    for (int f = 0; f < frames; ++f) {
      std::vector<RelatedRun> now;
      for (const Flight& run : runs) now.push_back(run.at_frame(f));
      refinement.see(now);
    }
    if (frames < Flight::kFrames) refinement.see_end_of_some(frames);
    std::string failed;
    for (const Verdict& verdict : refinement.verdicts()) failed += verdict.holds ? "" : verdict.property;
    return failed;
  };
  const std::vector<Flight> right = {with_error(4, 0.4), with_error(8, 0.2), with_error(16, 0.1)};
  EXPECT_EQ(failing(right), "");
  EXPECT_EQ(failing(right, 5), "related frames") << "a run is shorter";
  EXPECT_EQ(failing({with_error(4, 0.4), with_error(8, 0.2), with_error(16, 0.02)}), "converges");
  EXPECT_EQ(failing({with_error(4, 0), with_error(8, 0), with_error(16, 0)}), "something was judged");
  std::vector<Flight> wrong = right;
  wrong[1].alive[4][2] = 0;  // in the run between the others
  EXPECT_EQ(failing(wrong), "converges");
  wrong = right;
  wrong[2].time[3] += 0.001;
  EXPECT_EQ(failing(wrong), "related frames");
}

TEST(RunMap, RefusesWordsThatAreNone) {
  for (const char* const word : {"", "other", "units", "units:4,4", "units:0,1,1", "units:1,1,1,1", "mirror:w",
                                 "rotate:45z", "rotate:z", "shift:a,b,c", "same:1", "permute:x", "boost:1,2,inf"}) {
    EXPECT_THROW(RunMap::parse(word), InputError) << word;
  }
}

Array numbers(const char* name, std::vector<int64_t> shape, const std::vector<double>& values) {
  return make_array<double>(name, std::move(shape), values);
}
ArrayRule scalar(Dimension of) { return {Follows::scalar, of, true}; }

TEST(RunMap, MapsAnInputByTheDimensionsOfItsArrays) {
  const Arrays input = {numbers("rest", {2, 3}, {1, 2, 3, 4, 5, 6}),
                        numbers("gravity", {3}, {0, 0, -10}),
                        numbers("mass", {2}, {1, 2}),
                        numbers("young", {}, {1000}),
                        make_array<float>("velocities", {2, 3}, {1, 2, 3, 4, 5, 6}),
                        make_array<int32_t>("steps", {}, {4})};
  const std::vector<std::pair<std::string, ArrayRule>> rules = {{"young", scalar({-1, -2, 1})}};
  const Arrays made = mapped_input(RunMap::parse("units:4,2,16"), input, rules, "in.npz");
  const auto of = [&](const char* name, int64_t k) { return find_array(made, name)->number(k); };
  EXPECT_EQ(of("rest", 5), 24);
  EXPECT_EQ(of("gravity", 2), -10);  // 4 / 2²
  EXPECT_EQ(of("mass", 1), 32);
  EXPECT_EQ(of("young", 0), 1000);  // 16 / (4 · 2²)
  EXPECT_EQ(of("velocities", 1), 4);
  EXPECT_EQ(of("steps", 0), 4);
  EXPECT_EQ(find_array(made, "velocities")->type, ElementType::f32);
  EXPECT_THROW(mapped_input(RunMap::parse("units:4,2,16"), input, {}, "in.npz"), InputError);
}

TEST(RunMap, KeepsCellsAndTrianglesOutsideOutInAMirror) {
  const Arrays input = {
      numbers("rest", {8, 3}, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1}),
      make_array<int32_t>("cells", {1, 8}, {0, 1, 2, 3, 4, 5, 6, 7})};
  const auto volume = [](const Arrays& arrays, std::size_t a, std::size_t b, std::size_t c) {
    const std::span<const double> x = find_array(arrays, "rest")->of<double>();
    const std::span<const int32_t> cell = find_array(arrays, "cells")->of<int32_t>();
    const auto way = [&](std::size_t k) {
      const std::size_t i = 3 * at(cell[k]), o = 3 * at(cell[0]);
      return Vec3{x[i] - x[o], x[i + 1] - x[o + 1], x[i + 2] - x[o + 2]};
    };
    return dot(cross(way(a), way(b)), way(c));
  };
  for (const char* const word : {"mirror:x", "mirror:z", "rotate:90y", "rotate:180x"}) {
    EXPECT_EQ(volume(mapped_input(RunMap::parse(word), input, {}, "in.npz"), 1, 3, 4), 1) << word;
  }
  const Arrays tetrahedron = {input[0], make_array<int32_t>("cells", {1, 4}, {0, 1, 3, 4})};
  EXPECT_EQ(volume(mapped_input(RunMap::parse("mirror:y"), tetrahedron, {}, "in.npz"), 1, 2, 3), 1);
}

TEST(RunMap, PermutesEntriesAndNumbersOfParticlesAlike) {
  const Arrays input = {numbers("rest", {4, 3}, {0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0}),
                        numbers("mass", {4}, {0, 1, 2, 3}), make_array<int32_t>("edges", {3, 2}, {0, 1, 1, 2, 2, 3})};
  const Arrays made = mapped_input(RunMap::parse("permute:7"), input, {}, "in.npz");
  const auto of = [&](const char* name, int64_t k) { return find_array(made, name)->number(k); };
  bool moved = false;
  for (int64_t i = 0; i < 4; ++i) {
    EXPECT_EQ(of("rest", 3 * i), of("permutation", i));
    EXPECT_EQ(of("mass", i), of("permutation", i));
    moved = moved || of("permutation", i) != static_cast<double>(i);
  }
  EXPECT_TRUE(moved);
  for (int64_t k = 0; k < 6; ++k) {
    EXPECT_EQ(of("mass", find_array(made, "edges")->integer(k)), input[2].number(k));
  }
}

TEST(RunMap, MovesABladeWithTheFrameInWhichItSweeps) {
  const Arrays input = {numbers("time", {2}, {0, 0.5}), numbers("blade", {2, 1, 3, 3}, std::vector<double>(18, 1.0))};
  const Arrays made = mapped_input(RunMap::parse("boost:2,0,0"), input, {}, "in.npz");
  EXPECT_EQ(find_array(made, "blade")->number(0), 1);
  EXPECT_EQ(find_array(made, "blade")->number(9), 2);
  EXPECT_THROW(mapped_input(RunMap::parse("boost:2,0,0"), {input[1]}, {}, "in.npz"), InputError);
}

}  // namespace
}  // namespace cutproof::run_relation_tests
