#include "oracles/runs/run_judge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "model/at.h"

namespace cutproof::run_judge_tests {
namespace {

using oracles::RunCoupling;
using oracles::RunFrame;
using oracles::RunHeader;
using oracles::RunJudge;
using oracles::RunPromise;

// A bar of 6 × 2 × 2 particles, h = 0.1 m, that falls freely while it turns; a blade parts it in frames 3 to 5, in the
// plane between its two halves, and each half then has groups of its own: springs between neighbours.
struct Bar {
  static constexpr int kFrames = 10;
  static constexpr double kH = 0.1, kDt = 0.01;
  RunHeader header;
  std::vector<std::vector<Vec3>> x, v, blade;
  std::vector<std::vector<uint8_t>> alive;
  std::vector<RunCoupling> coupling;  // by frame
  std::vector<std::vector<int32_t>> piece;
  std::vector<double> time, mass;

  Bar() {
    for (int k = 0; k < 24; ++k) header.rest.push_back(kH * Vec3{double(k % 6), double(k / 6 % 2), double(k / 12)});
    mass.assign(24, 0.5);
    header.gravity = Vec3{0, 0, -10};
    header.spacing = kH;
    header.promises = 1u << static_cast<int>(RunPromise::free) | 1u << static_cast<int>(RunPromise::angular_momentum);
    const Vec3 middle = {2.5 * kH, 0.5 * kH, 0.5 * kH}, spin = {0, 0, 2};
    for (int f = 0; f < kFrames; ++f) {
      const double t = f * kDt, fallen = -5 * t * t, angle = norm(spin) * t;
      x.emplace_back();
      v.emplace_back();
      for (const Vec3 rest : header.rest) {
        const Vec3 arm = rest - middle;
        const Vec3 turned = {std::cos(angle) * arm.x - std::sin(angle) * arm.y,
                             std::sin(angle) * arm.x + std::cos(angle) * arm.y, arm.z};
        x.back().push_back(middle + turned + Vec3{0.3 * t, 0, fallen});
        v.back().push_back(cross(spin, turned) + Vec3{0.3, 0, -10 * t});
      }
      time.push_back(t);
      alive.emplace_back(24, 1);
      coupling.push_back(springs(f >= 5));
      piece.emplace_back();
      for (int k = 0; k < 24; ++k) piece.back().push_back(f >= 5 && k % 6 >= 3 ? 1 : 0);
      blade.emplace_back();
      if (f >= 3 && f <= 5) sweep(f);
    }
  }
  // A third of the section in each frame, from below; it turns and falls with the bar.
  void sweep(int f, double higher = 0) {
    const Vec3 middle = 0.5 * (x[at(f)][2] + x[at(f)][3]), side = x[at(f)][2 + 6] - x[at(f)][2];
    const double low = (f - 3) * 0.15 - 0.25 + higher, high = low + 0.15;
    const Vec3 up = {0, 0, 1}, across = side / norm(side);
    blade[at(f)] = {middle - 0.1 * across + low * up, middle + 0.3 * across + low * up,
                    middle + 0.3 * across + high * up, middle - 0.1 * across + high * up};
  }
  static RunCoupling springs(bool parted) {
    RunCoupling made;
    made.offsets = {0};
    for (int32_t k = 0; k < 24; ++k) {
      for (const int32_t step : {1, 6, 12}) {
        const bool is_there = step == 1 ? k % 6 < 5 : step == 6 ? k / 6 % 2 == 0 : k < 12;
        if (!is_there || (parted && step == 1 && k % 6 == 2)) continue;
        made.members.insert(made.members.end(), {k, k + step});
        made.offsets.push_back(std::ssize(made.members));
      }
    }
    return made;
  }
  std::vector<Verdict> verdicts() const {
    RunJudge judge(header);
    judge.weigh(mass);
    for (int f = 0; f < kFrames; ++f) {
      judge.couple(coupling[at(f)]);
      RunFrame frame;
      frame.index = f;
      frame.time = time[at(f)];
      frame.positions = x[at(f)];
      frame.velocities = v[at(f)];
      frame.alive = alive[at(f)];
      frame.blade = blade[at(f)];
      frame.piece = piece[at(f)];
      judge.see(frame);
    }
    judge.finish();
    pieces = judge.pieces();
    piece_of = judge.piece_of_particles();
    return judge.verdicts();
  }
  mutable oracles::RunPieces pieces;
  mutable std::vector<int32_t> piece_of;
};

std::string failing(const Bar& bar) {
  std::string names;
  for (const Verdict& verdict : bar.verdicts()) {
    if (!verdict.holds) names += (names.empty() ? "" : ", ") + verdict.property;
  }
  return names;
}

TEST(RunJudge, HoldsOfABarThatIsPartedByItsBlade) {
  const Bar bar;
  const std::vector<Verdict> verdicts = bar.verdicts();
  for (const Verdict& verdict : verdicts) EXPECT_TRUE(verdict.holds) << verdict.property << verdict.witness.text;
  EXPECT_EQ(verdicts.size(), 11u);
  EXPECT_EQ(bar.pieces.pieces, 2);
  EXPECT_EQ(bar.pieces.at_most, 2);
  EXPECT_EQ(bar.pieces.sizes, (std::vector<int64_t>{12, 12}));
  EXPECT_EQ(bar.pieces.surely_cut, 4);
  EXPECT_EQ(bar.pieces.coupled, 2);
  EXPECT_EQ(bar.pieces.last_cut, 5);
  for (int k = 0; k < 24; ++k) EXPECT_EQ(bar.piece_of.at(at(k)), k % 6 >= 3 ? 3 : 0);
}

// Rounding decides whether a sweep cuts what it ends on, or the next one, which goes on there.
TEST(RunJudge, KnowsEdgesThatTwoFramesMayCut) {
  for (const double higher : {0.0, 0.05}) {  // frame 4 ends at 0.05 m, or on the upper two edges, at 0.1 m
    Bar still;
    still.header.gravity = Vec3{};
    for (int f = 0; f < Bar::kFrames; ++f) {
      still.x[at(f)] = still.header.rest;
      still.v[at(f)].assign(24, Vec3{});
      if (f >= 3 && f <= 5) still.sweep(f, higher);
    }
    EXPECT_EQ(failing(still), "");
    EXPECT_EQ(still.pieces.surely_cut, 4);
    EXPECT_EQ(still.pieces.perhaps_cut, 0);
    EXPECT_EQ(still.pieces.ever_perhaps_cut, higher > 0 ? 2 : 0);
  }
}

TEST(RunJudge, HoldsOfABarThatIsWhollyRemoved) {
  Bar bar;
  for (std::size_t f = 6; f < bar.alive.size(); ++f) {
    std::fill(bar.alive[f].begin(), bar.alive[f].end(), 0);
    bar.coupling[f] = {};
    bar.coupling[f].offsets = {0};
    bar.piece[f].assign(24, -1);
  }
  EXPECT_EQ(failing(bar), "");
}

// What the judge's own sums round is no fault of a run.
TEST(RunJudge, HoldsOfManyParticles) {
  constexpr double kDt = 0.01;
  RunHeader header;
  header.gravity = Vec3{0, 0, -10};
  header.promises = 1u << static_cast<int>(RunPromise::free) | 1u << static_cast<int>(RunPromise::angular_momentum);
  std::vector<Vec3> x, v(100'000, {0.3, -0.7, 1.1});
  std::vector<double> mass(v.size(), 0.1);
  for (int k = 0; k < 100'000; ++k) x.push_back({1 + 0.001 * (k % 50), 2 + 0.001 * (k / 50 % 50), 0.001 * (k / 2500)});
  RunJudge judge(header);
  judge.weigh(mass);
  for (int f = 0; f < 6; ++f) {
    for (std::size_t k = 0; f == 3 && k < 100'000; k += 10) {  // some are split
      mass[k] /= 2;
      for (auto* const numbers : {&x, &v}) numbers->push_back((*numbers)[k]);
      mass.push_back(mass[k]);
    }
    if (f == 3) judge.weigh(mass);
    RunFrame frame;
    frame.index = f;
    frame.time = f * kDt;
    frame.positions = x;
    frame.velocities = v;
    judge.see(frame);
    for (std::size_t k = 0; k < x.size(); ++k) {
      v[k] += kDt * *header.gravity;
      x[k] += kDt * v[k];
    }
  }
  judge.finish();
  std::string judged;
  for (const Verdict& verdict : judge.verdicts()) {
    judged += verdict.property + ", ";
    EXPECT_TRUE(verdict.holds) << verdict.property << ": " << verdict.witness.text;
  }
  EXPECT_EQ(judged,
            "run well formed, finite, what is gone stays gone, no teleport, linear momentum, centre of mass, angular "
            "momentum, mass kept, ");
}

TEST(RunJudge, KnowsTheFacesThatCellsShare) {
  const std::vector<Vec3> x = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  for (const auto& other : {std::array{1, 2, 3, 4}, std::array{4, 3, 2, 1}, std::array{3, 1, 2, 4}}) {
    RunJudge judge({});
    RunCoupling cells;
    cells.cells = {0, 1, 2, 3, other[0], other[1], other[2], other[3]};
    cells.corners = 4;
    judge.couple(cells);
    RunFrame frame;
    frame.positions = x;
    judge.see(frame);
    EXPECT_EQ(judge.pieces().pieces, 1);
    RunCoupling groups = cells;
    groups.offsets = {0, 2};
    groups.members = {0, 4};
    judge.couple(groups);
    judge.see(frame);
    EXPECT_EQ(judge.pieces().units, 2);
    // Without cells there is no tissue: nothing more is known of pieces.
    cells.cells.clear();
    judge.couple(cells);
    judge.see(frame);
    judge.finish();
    EXPECT_EQ(judge.pieces().units, 0);
  }
}

// What one frame of particles, which have nothing else, fails.
std::string failing_of(const RunHeader& header, RunFrame frame, const std::vector<Vec3>& x) {
  RunJudge judge(header);
  frame.positions = x;
  judge.see(frame);
  judge.finish();
  std::string names;
  for (const Verdict& verdict : judge.verdicts()) {
    if (!verdict.holds) names += verdict.property + ": " + verdict.witness.text;
  }
  return names;
}

// A wrong spacing must not make pairs of all particles.
TEST(RunJudge, RejectsASpacingThatIsNotThatOfItsParticles) {
  RunHeader header;
  header.spacing = 1;
  header.rest.assign(64, {0.5, 0.5, 0.5});
  EXPECT_EQ(failing_of(header, {}, header.rest), "");
  header.rest.push_back({0.9, 0, 0});
  EXPECT_NE(failing_of(header, {}, header.rest).find("run well formed: particles do not rest about spacing"),
            std::string::npos);
  header.rest.assign(1'000'000, {0.5, 0.5, 0.5});
  EXPECT_NE(failing_of(header, {}, header.rest).find("run well formed"), std::string::npos);
  header.rest = {{0, 0, 0}, {0x1p49, 0, 0}};
  EXPECT_EQ(failing_of(header, {}, header.rest), "");
  header.rest.back().x = 0x1p50;
  EXPECT_NE(failing_of(header, {}, header.rest).find("run well formed"), std::string::npos);
  header.rest.back() = {NAN, NAN, NAN};  // nowhere
  EXPECT_EQ(failing_of(header, {}, {{}, {}}), "");
}

TEST(RunJudge, RejectsNumbersOfAFrameThatAreNone) {
  const std::vector<Vec3> x = {{}, {1, 0, 0}}, wrong = {{}, {0, INFINITY, 0}};
  RunFrame frame;
  frame.spin = x;
  frame.energy = 1;
  frame.contact_impulse = Vec3{1, 0, 0};
  EXPECT_EQ(failing_of({}, frame, x), "");
  const auto expect = [&](const char* text, auto&& plant) {
    RunFrame planted = frame;
    plant(planted);
    EXPECT_EQ(failing_of({}, planted, x), text);
  };
  expect("finite: energy is not a number in frame 0. Later frames are not judged", [](RunFrame& f) { f.energy = NAN; });
  expect("finite: contact_impulse is not a number in frame 0. Later frames are not judged",
         [](RunFrame& f) { f.contact_impulse->z = NAN; });
  expect("finite: the spin of particle 1 is not a number in frame 0. Later frames are not judged",
         [&](RunFrame& f) { f.spin = wrong; });
  const std::vector<int32_t> parent = {-1, 2}, itself = {0, -1};
  expect("run well formed: particle 1 was split from 2 of 2", [&](RunFrame& f) { f.parent = parent; });
  expect("", [&](RunFrame& f) { f.parent = itself; });
}

// Frame f of particles, dt after the one before.
void see(RunJudge& judge, int f, double dt, std::span<const Vec3> x, std::span<const Vec3> v,
         std::optional<Vec3> impulse = {}) {
  RunFrame frame;
  frame.index = f;
  frame.time = f * dt;
  frame.positions = x;
  frame.velocities = v;
  frame.contact_impulse = impulse;
  judge.see(frame);
}

// One particle meets another in frame 2 and leaves it half of its mass, with its momentum, or without: the frame before
// had other masses.
TEST(RunJudge, WeighsEachFrameWithItsOwnMasses) {
  constexpr double kDt = 0.25;
  for (const double taken : {1.0 / 3, 0.0}) {
    RunHeader header;
    header.promises = 1u << static_cast<int>(RunPromise::free) | 1u << static_cast<int>(RunPromise::angular_momentum);
    RunJudge judge(header);
    judge.weigh({1, 1});
    Vec3 x[] = {{-2 * kDt, 0, 0}, {0, 0, 0}}, v[] = {{1, 0, 0}, {0, 0, 0}};
    for (int f = 0; f < 5; ++f) {
      if (f == 2) {
        judge.weigh({0.5, 1.5});
        v[1].x = taken;
      }
      see(judge, f, kDt, x, v);
      for (int k = 0; k < 2; ++k) x[k] += kDt * v[k];
    }
    judge.finish();
    for (const Verdict& verdict : judge.verdicts()) {
      const bool is_momentum = verdict.property == "linear momentum";
      EXPECT_EQ(verdict.holds, taken > 0 || !is_momentum) << verdict.property << ": " << verdict.witness.text;
      EXPECT_EQ(is_momentum ? verdict.checked : 4, 4);
    }
  }
}

// A step of semi-implicit or implicit damping is off the exponential by the square of c dt.
TEST(RunJudge, AllowsWhatSchemesOfDampingDiffer) {
  const double dt = 0.01, c = 20;
  for (const double factor : {1 - c * dt, 1 / (1 + c * dt), 1 - 2 * c * dt}) {
    RunHeader header;
    header.damping = c;
    header.promises = 1u << static_cast<int>(RunPromise::free);
    RunJudge judge(header);
    judge.weigh({2});
    Vec3 x, v = {3, 0, 0};
    for (int f = 0; f < 5; ++f) {
      see(judge, f, dt, {&x, 1}, {&v, 1});
      v = factor * v;
      x += dt * v;
    }
    judge.finish();
    for (const Verdict& verdict : judge.verdicts()) {
      const bool is_right = factor > 1 - 1.5 * c * dt || verdict.property != "linear momentum";
      EXPECT_EQ(verdict.holds, is_right) << verdict.property << factor;
    }
  }
}

// A particle that something drags along: each velocity is damped once it has made its way.
std::vector<Verdict> dragged(double damping, std::optional<Vec3> impulse) {
  const double dt = 0.01, c = 2;
  RunHeader header;
  header.damping = damping * c;
  RunJudge judge(header);
  for (int f = 0; f < 5; ++f) {
    const Vec3 x = {3 * f * dt, 0, 0}, v = {3 * std::exp(-c * dt), 0, 0};
    see(judge, f, dt, {&x, 1}, {&v, 1}, impulse);
  }
  judge.finish();
  return judge.verdicts();
}
bool has_teleport(const std::vector<Verdict>& verdicts) {
  return std::any_of(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return v.property == "no teleport"; });
}
bool holds(const std::vector<Verdict>& verdicts) {
  return std::all_of(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return v.holds; });
}

TEST(RunJudge, AllowsVelocitiesThatAreDampedBehindTheirWay) {
  for (const double damping : {1.0, 0.1, 0.0}) {
    const std::vector<Verdict> verdicts = dragged(damping, {});
    EXPECT_TRUE(has_teleport(verdicts));
    EXPECT_EQ(holds(verdicts), damping == 1) << damping;
  }
}

// The mean velocity of a frame is that of its steps before each was damped.
TEST(RunJudge, AllowsACentreOfMassThatIsDampedBehindItsWay) {
  const double dt = 0.01, g = 10, mass = 2;
  for (const double damping : {0.0, 20.0, 90.0}) {
    for (const bool is_told : {true, false}) {
      RunHeader header;
      header.gravity = Vec3{0, 0, -g};
      header.damping = is_told ? damping : 0;
      header.promises = 1u << static_cast<int>(RunPromise::free);
      RunJudge judge(header);
      judge.weigh({mass});
      Vec3 x, v = {3, 0, 0};
      for (int f = 0; f < 8; ++f) {
        see(judge, f, dt, {&x, 1}, {&v, 1});
        v = v + Vec3{0, 0, -g * dt};
        x = x + dt * v;
        v = std::exp(-damping * dt) * v;
      }
      judge.finish();
      EXPECT_EQ(holds(judge.verdicts()), is_told || damping == 0) << damping;
    }
  }
}

// A sheet that falls along its normal: its particles have one coordinate, which rounds alike. Particles without a
// common coordinate that are off alike are wrong, unless one group holds them.
TEST(RunJudge, KnowsWhichParticlesRoundAlike) {
  constexpr int kSide = 200;
  constexpr double kDt = 0.001, kG = 10;
  for (const bool is_plane : {true, false}) {
    for (const bool is_group : {true, false}) {
      RunHeader header;
      header.gravity = Vec3{kG, 0, 0};
      header.promises = 1u << static_cast<int>(RunPromise::free);
      RunJudge judge(header);
      std::vector<Vec3> x;
      for (int k = 0; k < kSide * kSide; ++k) {
        const double y = 1e-6 * (k % kSide), z = 1e-6 * (k / kSide), own = is_plane ? 0 : 1e-9 * k;
        x.push_back({1.1 + own, y + own, z + own});
      }
      judge.weigh(std::vector<double>(x.size(), 0.1));
      if (is_group) {
        RunCoupling coupling;
        coupling.offsets = {0, std::ssize(x)};
        for (int k = 0; k < kSide * kSide; ++k) coupling.members.push_back(k);
        judge.couple(coupling);
      }
      double speed = 0;
      for (int f = 0; f < 6; ++f) {
        // All are off by one rounding of where they are, over dt.
        const double off = f % 2 == 0 ? 0 : 0x1p-53 * 1.1 / kDt;
        see(judge, f, kDt, x, std::vector<Vec3>(x.size(), {speed + off, 0, 0}));
        speed += kG * kDt;
        for (Vec3& place : x) place.x += speed * kDt;
      }
      judge.finish();
      EXPECT_EQ(holds(judge.verdicts()), is_plane || is_group) << is_plane << is_group;
    }
  }
}

// A sum of equal numbers rounds alike: the impulse of 1,000 particles is off by 127 roundings.
TEST(RunJudge, AllowsAnImpulseThatIsASum) {
  constexpr int kParticles = 1000;
  RunHeader header;
  RunJudge judge(header);
  std::vector<Vec3> x;
  for (int k = 0; k < kParticles; ++k) x.push_back({1e-9 * k, 1e-9 * k, 1e-9 * k});
  judge.weigh(std::vector<double>(x.size(), 1));
  double sum = 0;
  for (int k = 0; k < kParticles; ++k) sum += 0.1;
  for (int f = 0; f < 2; ++f) {
    see(judge, f, 1, x, std::vector<Vec3>(x.size(), {0.1 * f, 0, 0}), Vec3{sum * f, 0, 0});
  }
  judge.finish();
  EXPECT_TRUE(holds(judge.verdicts()));
}

TEST(RunJudge, AsksForNoTeleportWhereContactsPush) {
  EXPECT_FALSE(has_teleport(dragged(0, Vec3{0, 0, 1e-9})));
  EXPECT_TRUE(has_teleport(dragged(0, Vec3{})));
}

// Two particles that vibrate against each other with this phase in a frame, from rest; one is put `jump` aside in the
// middle of the run.
bool is_without_teleport(double phase, double jump) {
  constexpr double kDt = 0.01, kAmplitude = 1e-3;
  RunJudge judge({});
  double aside = 0;
  for (int f = 0; f < 200; ++f) {
    const double t = phase * f, v = kAmplitude * phase / kDt * std::cos(t);
    aside += f == 100 ? jump : 0;
    const std::vector<Vec3> x = {{-1 - kAmplitude * std::sin(t), aside, 0}, {1 + kAmplitude * std::sin(t), 0, 0}};
    const std::vector<Vec3> velocities = {{-v, 0, 0}, {v, 0, 0}};
    RunFrame frame;
    frame.index = f;
    frame.time = kDt * f;
    frame.positions = x;
    frame.velocities = velocities;
    judge.see(frame);
  }
  judge.finish();
  const std::vector<Verdict> verdicts = judge.verdicts();
  const auto teleport =
      std::find_if(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return v.property == "no teleport"; });
  return teleport != verdicts.end() && teleport->checked == 398 && teleport->holds;
}

TEST(RunJudge, TellsAVibrationThatFramesDoNotResolveFromATeleport) {
  for (const double phase : {0.01, 0.3, 1.0, 2.0, 2.7, 3.1416, 4.0, 6.2832, 6.3, 9.0}) {
    EXPECT_TRUE(is_without_teleport(phase, 0)) << phase;
    const double fastest_way = 1e-3 * phase;  // peak speed times the frame
    EXPECT_FALSE(is_without_teleport(phase, 2.51 * fastest_way)) << phase;
  }
  EXPECT_TRUE(is_without_teleport(0.01, 2.49 * 1e-5));
}

// The witness is where the pieces are joined, and not the first particle of each.
TEST(RunJudge, NamesTwoParticlesOfTheGroupThatJoinsWhatTheBladeHasParted) {
  Bar bar;
  for (std::size_t f = 5; f < Bar::kFrames; ++f) {
    bar.coupling[f].members.insert(bar.coupling[f].members.end(), {7, 22});
    bar.coupling[f].offsets.push_back(std::ssize(bar.coupling[f].members));
  }
  const std::vector<Verdict> verdicts = bar.verdicts();
  const auto across = std::find_if(verdicts.begin(), verdicts.end(),
                                   [](const Verdict& v) { return v.property == "no coupling across pieces"; });
  ASSERT_NE(across, verdicts.end());
  ASSERT_FALSE(across->holds);
  EXPECT_EQ(across->witness.particles, (std::vector<int32_t>{7, 22})) << across->witness.text;
  for (const char* const words : {" of 24 particles are coupled to another piece in frame 5",
                                  "one coupling group joins particles 7 and 22, which the blade has parted",
                                  "The property fails in 5 of 10 judged frames, first in frame 5 and last in frame 9"})
    EXPECT_NE(across->witness.text.find(words), std::string::npos) << across->witness.text;
  EXPECT_EQ(across->witness.frames, (std::vector<int64_t>{5, 9}));
}

// A vertex that is split off later is no tissue of its own.
TEST(RunJudge, NamesTissueOfAGroupWithLaterVertices) {
  Bar bar;
  for (std::size_t f = 5; f < Bar::kFrames; ++f) {
    bar.x[f].push_back(bar.x[f][2]);
    bar.v[f].push_back(bar.v[f][2]);
    bar.alive[f].push_back(1);
    bar.piece[f].push_back(0);
    bar.coupling[f].members.insert(bar.coupling[f].members.end(), {24, 7, 22});
    bar.coupling[f].offsets.push_back(std::ssize(bar.coupling[f].members));
  }
  for (const Verdict& verdict : bar.verdicts()) {
    if (verdict.property != "no coupling across pieces") continue;
    EXPECT_FALSE(verdict.holds);
    EXPECT_EQ(verdict.witness.particles, (std::vector<int32_t>{7, 22})) << verdict.witness.text;
  }
}

// One particle in the wrong body is not half of the tissue in it.
TEST(RunJudge, CountsWhatIsInTheWrongBody) {
  Bar bar;
  for (std::size_t f : {6, 8}) {
    RunCoupling& coupling = bar.coupling[f];
    coupling.offsets = {0};
    coupling.members.clear();
    const RunCoupling right = Bar::springs(true);
    for (std::size_t k = 0; k < right.members.size(); k += 2) {
      const int32_t a = right.members[k], b = right.members[k + 1];
      if (a == 2 || b == 2) continue;  // particle 2 leaves its piece, and joins 3
      coupling.members.insert(coupling.members.end(), {a, b});
      coupling.offsets.push_back(std::ssize(coupling.members));
    }
    coupling.members.insert(coupling.members.end(), {2, 3});
    coupling.offsets.push_back(std::ssize(coupling.members));
  }
  const std::vector<Verdict> verdicts = bar.verdicts();
  const auto across = std::find_if(verdicts.begin(), verdicts.end(),
                                   [](const Verdict& v) { return v.property == "no coupling across pieces"; });
  ASSERT_NE(across, verdicts.end());
  EXPECT_EQ(across->measured, 1) << across->witness.text;
  EXPECT_EQ(across->witness.frames, (std::vector<int64_t>{6, 6, 8, 8}));
}

// Of a failure that grows the worst frame is told.
TEST(RunJudge, TellsTheWorstFrame) {
  Bar bar;
  for (std::size_t f = 6; f < Bar::kFrames; ++f) {
    for (Vec3& v : bar.v[f]) v.x += f == 6 ? 1 : f == 8 ? 5 : 0;
  }
  for (const Verdict& verdict : bar.verdicts()) {
    if (verdict.property != "linear momentum") continue;
    EXPECT_EQ(verdict.frame, 6);
    EXPECT_NE(verdict.witness.text.find(", worst in frame 8: 60 kg m/s"), std::string::npos) << verdict.witness.text;
  }
}

std::string witness_of(const Bar& bar, std::string_view property) {
  for (const Verdict& verdict : bar.verdicts()) {
    if (verdict.property == property) return verdict.witness.text;
  }
  return "";
}

// Its size is a share, and one frame is told from many.
TEST(RunJudge, SaysHowMuchIsWrongAndInHowManyFrames) {
  Bar lost, pushed;
  for (int f = 8; f < Bar::kFrames; ++f) {
    const std::vector<Vec3> was = lost.v[at(f)];
    Vec3 mean;
    for (const Vec3 v : was) mean += v / 24.0;
    for (Vec3& v : lost.v[at(f)]) v = mean + 0.25 * (v - mean);
  }
  for (Vec3& v : pushed.v[8]) v.x += 1;
  const std::string spin = witness_of(lost, "angular momentum"), push = witness_of(pushed, "linear momentum");
  EXPECT_EQ(spin.find("75 % of the angular momentum is lost in frame 8, although no outside force acts"), 0U) << spin;
  EXPECT_NE(spin.find("The property fails in this frame alone, of 9 judged"), std::string::npos) << spin;
  EXPECT_NE(push.find("the whole body gains 1 m/s"), std::string::npos) << push;
  EXPECT_NE(push.find("The property fails in 2 of 9 judged frames, first in frame 8"), std::string::npos) << push;
}

struct Fault {
  const char *name, *property;
  std::function<void(Bar&)> plant;
};
class FaultOfARun : public ::testing::TestWithParam<Fault> {};

TEST_P(FaultOfARun, IsRejectedByItsProperty) {
  Bar bar;
  GetParam().plant(bar);
  EXPECT_EQ(failing(bar), GetParam().property);
}

constexpr std::size_t kLate = 8;
INSTANTIATE_TEST_SUITE_P(
    Of, FaultOfARun,
    ::testing::Values(Fault{"heals", "no coupling across pieces",
                            [](Bar& b) { b.coupling[kLate] = Bar::springs(false); }},
                      Fault{"glued_by_one_node", "no coupling across pieces",
                            [](Bar& b) {
                              for (std::size_t f = 5; f < Bar::kFrames; ++f) {
                                b.coupling[f].members.insert(b.coupling[f].members.end(), {2, 3});
                                b.coupling[f].offsets.push_back(std::ssize(b.coupling[f].members));
                              }
                            }},
                      Fault{"tear_elsewhere", "pieces coupled within",
                            [](Bar& b) {
                              RunCoupling& torn = b.coupling[kLate];
                              RunCoupling made;
                              made.offsets = {0};
                              for (std::size_t k = 0; k < torn.members.size(); k += 2) {
                                if (torn.members[k] == 0 || torn.members[k + 1] == 0) continue;
                                made.members.insert(made.members.end(), {torn.members[k], torn.members[k + 1]});
                                made.offsets.push_back(std::ssize(made.members));
                              }
                              torn = made;
                            }},
                      Fault{"nothing_is_coupled", "pieces coupled within",
                            [](Bar& b) {
                              b.coupling[kLate] = {};
                              b.coupling[kLate].offsets = {0};
                            }},
                      Fault{"revived", "what is gone stays gone",
                            [](Bar& b) {
                              b.alive[6][0] = 0;
                              b.mass.clear();
                            }},
                      Fault{"no_number", "finite", [](Bar& b) { b.x[kLate][5].y = NAN; }},
                      Fault{"too_large_to_be_squared", "finite", [](Bar& b) { b.v[kLate][5].y = 1e200; }},
                      Fault{"fewer_particles", "run well formed",
                            [](Bar& b) {
                              b.x[kLate].pop_back();
                              b.v[kLate].pop_back();
                              b.alive[kLate].pop_back();
                              b.piece[kLate].pop_back();
                              b.coupling[kLate] = {};
                            }},
                      Fault{"descending_offsets", "run well formed",
                            [](Bar& b) { std::swap(b.coupling[kLate].offsets[3], b.coupling[kLate].offsets[4]); }},
                      Fault{"members_of_no_group", "run well formed", [](Bar& b) { b.coupling[kLate].offsets = {0}; }},
                      Fault{"a_weight_that_is_no_number", "run well formed",
                            [](Bar& b) {
                              b.coupling[kLate].weights.assign(b.coupling[kLate].members.size(), 1);
                              b.coupling[kLate].weights.back() = NAN;
                            }},
                      Fault{"a_negative_weight", "no coupling across pieces",
                            [](Bar& b) {
                              b.coupling[kLate] = Bar::springs(false);
                              b.coupling[kLate].weights.assign(b.coupling[kLate].members.size(), -1);
                            }},
                      Fault{"half_a_patch", "run well formed", [](Bar& b) { b.blade[4][2].z = NAN; }},
                      Fault{"a_patch_without_end", "run well formed", [](Bar& b) { b.blade[4][2].z = INFINITY; }},
                      Fault{"endless_time", "run well formed", [](Bar& b) { b.time.back() = INFINITY; }},
                      Fault{"rest_without_end", "run well formed", [](Bar& b) { b.header.rest[7].x = INFINITY; }},
                      Fault{"bounds_without_end", "linear momentum, centre of mass, angular momentum",
                            [](Bar& b) { b.mass.assign(24, 1e300); }},
                      Fault{"said_otherwise", "pieces as said", [](Bar& b) { b.piece[kLate][0] = 7; }},
                      Fault{"blade_beside", "something was cut, pieces coupled within, pieces as said",
                            [](Bar& b) {
                              for (auto& quad : b.blade) {
                                for (Vec3& corner : quad) corner.x += 5;
                              }
                            }},
                      Fault{"teleport", "no teleport, linear momentum, centre of mass, angular momentum",
                            [](Bar& b) {
                              for (std::size_t f = kLate; f < Bar::kFrames; ++f) b.x[f][0].x += 0.2;
                              b.v[kLate][0].y += 1e-11;
                            }},
                      Fault{"momentum_from_nothing", "linear momentum, angular momentum",
                            [](Bar& b) {
                              for (std::size_t f = kLate; f < Bar::kFrames; ++f) b.v[f][0].x += 4e-11;
                            }},
                      Fault{"spin_lost", "angular momentum",
                            [](Bar& b) {
                              for (std::size_t f = kLate; f < Bar::kFrames; ++f) {
                                b.v[f][0].x += 4e-11;
                                b.v[f][23].x -= 4e-11;
                              }
                            }}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace cutproof::run_judge_tests
