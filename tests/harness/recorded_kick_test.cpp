// The kick test: who feels a kick that is none of his business is found, with when and by how much; a right simulator
// holds; a test that tested nothing fails; noise makes it blunt and does not make it blind. Of the kicked piece: where
// it goes, and that equal kicks are answered equally.
#include "harness/recorded_kick.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "model/at.h"
#include "model/error.h"

namespace cutproof::recorded_kick_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int64_t kFrames = 10, kParticles = 6;  // two pieces of three

// Positions [frame][particle][axis].
std::size_t place(int64_t frame, int64_t particle, int64_t axis = 0) {
  return at(3 * (frame * kParticles + particle) + axis);
}

// Falls; from frame 4 on piece 7 moves aside by 0.01 m a frame. One frame a millisecond.
struct Runs {
  Runs() {
    for (int64_t f = 0; f < kFrames; ++f) {
      for (int64_t i = 0; i < kParticles; ++i) {
        const auto t = static_cast<double>(f);
        for (const double x : {static_cast<double>(i), 0.5, 1 - 0.001 * t * t}) positions.push_back(x);
        kicked.insert(kicked.end(), positions.end() - 3, positions.end());
        if (i >= 3 && f >= 4) kicked[place(f, i, 1)] += 0.01 * (t - 3);
      }
    }
  }
  std::vector<double> positions, kicked, again;
  std::vector<int32_t> piece = {2, 2, 2, 7, 7, 7};

  io::ArrayFile file() const {
    io::ArrayFile file;
    const std::vector<int64_t> shape = {kFrames, kParticles, 3};
    file.arrays = {make_array("positions", shape, positions), make_array("kicked", shape, kicked),
                   make_array("piece", {kParticles}, piece)};
    if (!again.empty()) file.arrays.push_back(make_array("again", shape, again));
    return file;
  }
  // Each coordinate off by up to `size`, growing by `growth` a frame from frame `first` on.
  static void disturb(std::vector<double>& run, double size, double growth, int64_t first, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<double> direction(at(3 * kParticles));
    for (double& d : direction) d = std::uniform_real_distribution<double>(-1, 1)(random);
    for (int64_t f = first; f < kFrames; ++f) {
      for (int64_t i = 0; i < kParticles; ++i) {
        for (int64_t axis = 0; axis < 3; ++axis) {
          const double grown = size * std::pow(growth, static_cast<double>(f - first));
          run[place(f, i, axis)] += grown * direction[at(3 * i + axis)];
        }
      }
    }
  }
};

oracles::KickReport judged(const io::ArrayFile& file) {
  return oracles::judge_kick(harness::recorded_kick_of(file, "kick.npz").runs);
}
std::vector<std::string> failing(const oracles::KickReport& report) {
  std::vector<std::string> names;
  for (const Verdict& verdict : report.all()) {
    if (!verdict.holds) names.push_back(verdict.property);
  }
  return names;
}
Verdict verdict_on(const oracles::KickReport& report, const std::string& property) {
  for (const Verdict& verdict : report.all()) {
    if (verdict.property == property) return verdict;
  }
  throw std::logic_error(property + " was not judged");
}

TEST(Kick, OfOnePieceThatNobodyElseFeelsHolds) {
  const oracles::KickReport report = judged(Runs().file());
  EXPECT_THAT(failing(report), IsEmpty());
  ASSERT_EQ(report.kicks.size(), 1u);
  EXPECT_EQ(report.kicks[0].kicked_piece, 7);
  EXPECT_EQ(report.kicks[0].kick_frame, 4);
  EXPECT_EQ(verdict_on(report, "no ghost force").checked, 3 * kFrames);
  EXPECT_EQ(verdict_on(report, "no ghost force").bound, 0);
  const std::vector<oracles::KickedPiece>& pieces = report.kicks[0].pieces;
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(pieces[1].felt, 3);
  EXPECT_EQ(pieces[1].first_frame, 4);
  EXPECT_NEAR(pieces[1].greatest, 0.06, 1e-12);
  EXPECT_NEAR(pieces[1].centre, 0.06, 1e-12);
  EXPECT_EQ(pieces[0].centre, 0);
  EXPECT_EQ(pieces[0].of_kick, 0);
}

// The least that is wrong: the last bit of one coordinate in one frame.
TEST(Kick, ThatASingleBitOfAnotherPieceFeelsIsRejected) {
  Runs runs;
  double& x = runs.kicked[place(6, 1)];
  x = std::nextafter(x, 2);
  const oracles::KickReport report = judged(runs.file());
  EXPECT_THAT(failing(report), ElementsAre("no ghost force"));
  const Verdict& verdict = verdict_on(report, "no ghost force");
  EXPECT_EQ(verdict.witness.particles, (std::vector<int32_t>{1}));
  EXPECT_EQ(verdict.frame, 6);
  EXPECT_EQ(verdict.measured, 0x1p-52);
  EXPECT_EQ(verdict.bound, 0);
  EXPECT_EQ(report.kicks[0].pieces[0].felt, 1);
  EXPECT_EQ(report.kicks[0].pieces[0].first_frame, 6);
  EXPECT_NEAR(report.kicks[0].pieces[0].of_kick, 0x1p-52 / 0.06, 1e-20);
}

TEST(Kick, NamesWhoFeltItFirstAndHowMany) {
  Runs runs;
  for (int64_t f = 5; f < kFrames; ++f) runs.kicked[place(f, 0, 2)] += 1e-6;
  for (int64_t f = 4; f < kFrames; ++f) runs.kicked[place(f, 2, 2)] += 1e-9 * static_cast<double>(f);
  io::ArrayFile file = runs.file();
  file.arrays.push_back(make_array("spacing", {}, std::vector<double>{0.5}));
  const Verdict verdict = verdict_on(judged(file), "no ghost force");
  EXPECT_EQ(verdict.witness.particles, (std::vector<int32_t>{2}));
  EXPECT_EQ(verdict.frame, 4);
  EXPECT_NEAR(verdict.measured, 4e-9, 1e-15);
  EXPECT_THAT(verdict.witness.text,
              HasSubstr("Particle 2 of piece 2 felt it first, from frame 4 on, by 4e-09 m (8e-09 h)"));
  EXPECT_THAT(verdict.witness.text, HasSubstr("2 of 3 particles of piece 2 move because piece"));
}

// Piece 2 moves first, so it is the kicked one unless the file says who was.
TEST(Kick, TakesTheKickedPieceFromTheFileIfItIsThere) {
  Runs runs;
  runs.kicked[place(2, 0)] += 1e-3;
  EXPECT_EQ(judged(runs.file()).kicks[0].kicked_piece, 2);
  EXPECT_EQ(verdict_on(judged(runs.file()), "no ghost force").witness.particles, (std::vector<int32_t>{3}));
  io::ArrayFile file = runs.file();
  file.arrays.push_back(make_array("kicked_piece", {}, std::vector<int32_t>{7}));
  const oracles::KickReport report = judged(file);
  EXPECT_EQ(report.kicks[0].kick_frame, 4);
  EXPECT_EQ(verdict_on(report, "no ghost force").witness.particles, (std::vector<int32_t>{0}));
  EXPECT_EQ(verdict_on(report, "no ghost force").frame, 2);
}

TEST(Kick, ThatTestedNothingFails) {
  Runs still;
  still.kicked = still.positions;
  EXPECT_THAT(failing(judged(still.file())), ElementsAre("the kick was felt"));
  Runs other;
  io::ArrayFile file = other.file();
  file.arrays.push_back(make_array("kicked_piece", {}, std::vector<int32_t>{2}));
  EXPECT_THAT(failing(judged(file)), ElementsAre("the kick was felt")) << "piece 2 was kicked and did not move";
  Runs alone;
  alone.piece = {7, 7, 7, 7, 7, 7};
  EXPECT_THAT(failing(judged(alone.file())), ElementsAre("something was judged"));
  EXPECT_THAT(verdict_on(judged(alone.file()), "something was judged").witness.text, HasSubstr("single piece"));
}

TEST(Kick, WithNumbersThatAreNoneFails) {
  for (const double wrong : {std::nan(""), HUGE_VAL}) {
    for (std::vector<double> Runs::*run : {&Runs::positions, &Runs::kicked, &Runs::again}) {
      Runs runs;
      runs.again = runs.positions;
      (runs.*run)[place(3, 4, 2)] = wrong;
      const oracles::KickReport report = judged(runs.file());
      EXPECT_THAT(failing(report), ElementsAre("finite"));
      EXPECT_EQ(report.verdicts[0].witness.particles, (std::vector<int32_t>{4}));
      EXPECT_EQ(report.verdicts[0].frame, 3);
    }
  }
}

// A cut makes vertices: until they exist they are NaN, or `alive` says so.
TEST(Kick, LooksAtParticlesFromTheFrameOnInWhichTheyExist) {
  Runs growing;
  growing.again = growing.positions;
  for (std::vector<double>* const run : {&growing.positions, &growing.kicked, &growing.again}) {
    for (int64_t f = 0; f < 6; ++f)
      std::fill_n(run->begin() + static_cast<std::ptrdiff_t>(place(f, 2)), 3, std::nan(""));
  }
  const oracles::KickReport report = judged(growing.file());
  EXPECT_THAT(failing(report), IsEmpty());
  EXPECT_EQ(verdict_on(report, "finite").checked, 3 * 3 * (6 * kFrames - 6));
  EXPECT_EQ(verdict_on(report, "no ghost force").checked, 3 * kFrames - 6);
  // From then on it is held to what everybody is held to.
  Runs felt = growing;
  felt.kicked[place(7, 2)] += 1e-12;
  EXPECT_THAT(failing(judged(felt.file())), ElementsAre("no ghost force"));
  Runs lost = growing;
  lost.kicked[place(7, 2)] = std::nan("");
  EXPECT_THAT(failing(judged(lost.file())), ElementsAre("finite"));
  // What has blown up is not what does not exist yet, in every run alike or not.
  Runs blown_up = growing;
  for (std::vector<double>* const run : {&blown_up.positions, &blown_up.kicked, &blown_up.again}) {
    std::fill_n(run->begin() + static_cast<std::ptrdiff_t>(place(8, 2)), 3, std::nan(""));
  }
  EXPECT_THAT(failing(judged(blown_up.file())), ElementsAre("finite"));
  // That it comes to exist in another frame because a piece was kicked is a ghost force, too.
  Runs sooner = growing;
  for (int64_t axis = 0; axis < 3; ++axis) sooner.kicked[place(5, 2, axis)] = sooner.kicked[place(6, 2, axis)];
  const oracles::KickReport early = judged(sooner.file());
  EXPECT_THAT(failing(early), ElementsAre("no ghost force"));
  EXPECT_EQ(verdict_on(early, "no ghost force").frame, 5);
  EXPECT_THAT(verdict_on(early, "no ghost force").witness.text, HasSubstr("in one of the runs alone"));

  // The same by `alive`, which says of what is gone, too.
  io::ArrayFile file = lost.file();
  std::vector<uint8_t> alive(at(kFrames * kParticles), 1);
  for (int64_t f = 0; f < kFrames; ++f) alive[at(f * kParticles + 2)] = f == 6;
  file.arrays.push_back(make_array("alive", {kFrames, kParticles}, alive));
  EXPECT_THAT(failing(judged(file)), IsEmpty());
  EXPECT_EQ(verdict_on(judged(file), "no ghost force").checked, 3 * kFrames - 9);
  for (int64_t f = 0; f < kFrames; ++f) alive[at(f * kParticles + 2)] = 1;
  file.arrays.back() = make_array("alive", {kFrames, kParticles}, alive);
  EXPECT_THAT(failing(judged(file)), ElementsAre("finite"));
}

TEST(Kick, ThatIsFeltByLessThanASquareCanHoldIsRejected) {
  for (const double push : {1e-163, 5e-324}) {
    Runs runs;
    runs.positions[place(6, 0)] = 0;  // particle 0 is at x = 0 throughout
    runs.kicked[place(6, 0)] = push;
    const oracles::KickReport report = judged(runs.file());
    EXPECT_THAT(failing(report), ElementsAre("no ghost force")) << push;
    EXPECT_EQ(verdict_on(report, "no ghost force").measured, push);
  }
}

// --- A simulator that does not repeat itself -------------------------------------------------------------------------

TEST(Kick, OfASimulatorThatRepeatsItselfHasNoBoundWhetherItSaysSoOrNot) {
  Runs runs;
  runs.again = runs.positions;
  runs.kicked[place(9, 0)] += 1e-15;
  const oracles::KickReport report = judged(runs.file());
  EXPECT_TRUE(report.repeats);
  EXPECT_THAT(failing(report), ElementsAre("no ghost force"));
}

// Chaos: noise grows three times a frame. What it explains holds, wherever it begins.
TEST(Kick, InNoiseHoldsIfNothingElseHappens) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    for (const auto& [in_again, in_kicked] : {std::pair{0, 0}, std::pair{5, 0}, std::pair{0, 5}}) {
      Runs runs;
      runs.again = runs.positions;
      Runs::disturb(runs.again, 1e-9, 3, in_again, seed);
      Runs::disturb(runs.kicked, 1e-9, 3, in_kicked, seed + 1000);
      const oracles::KickReport report = judged(runs.file());
      EXPECT_FALSE(report.repeats);
      EXPECT_THAT(failing(report), IsEmpty()) << "seed " << seed << ", from frames " << in_again << ", " << in_kicked;
      EXPECT_EQ(report.kicks[0].kicked_piece, 7);
      EXPECT_EQ(report.kicks[0].kick_frame, 4);
      // Noise that begins late has not shown how far it grows.
      EXPECT_EQ(report.judged_frames, kFrames - in_again);
      EXPECT_EQ(verdict_on(report, "no ghost force").inconclusive, 3 * in_again);
    }
  }
}

// The least that is wrong: 64 times the noise of that frame, and a little.
TEST(Kick, InNoiseIsRejectedBeyondWhatNoiseExplains) {
  Runs runs;
  runs.again = runs.positions;
  for (int64_t f = 0; f < kFrames; ++f) runs.again[place(f, 5, 1)] += 1e-9 * std::pow(3, static_cast<double>(f));
  const double noise = 1e-9 * std::pow(3, 6);
  runs.kicked[place(6, 0)] += 63.9 * noise;
  oracles::KickReport report = judged(runs.file());
  EXPECT_THAT(failing(report), IsEmpty());
  EXPECT_EQ(verdict_on(report, "no ghost force").frame, 6);
  EXPECT_EQ(report.kicks[0].sharpest_frame, 4);
  EXPECT_NEAR(report.kicks[0].least_bound, 64e-9 * std::pow(3, 4), 1e-12);
  EXPECT_NEAR(report.kicks[0].kick_then, 0.01, 1e-12);
  runs.kicked[place(6, 0)] += 0.2 * noise;
  report = judged(runs.file());
  EXPECT_THAT(failing(report), ElementsAre("no ghost force"));
  EXPECT_NEAR(verdict_on(report, "no ghost force").bound, 64 * noise, 1e-12);
}

TEST(Kick, ThatIsLostInNoiseFails) {
  Runs runs;
  runs.again = runs.positions;
  Runs::disturb(runs.again, 0.01, 1, 0, 3);
  const oracles::KickReport report = judged(runs.file());
  EXPECT_THAT(failing(report), ElementsAre("the kick was felt"));
  EXPECT_THAT(verdict_on(report, "the kick was felt").witness.text, HasSubstr("noise"));
}

// --- A solver over all pieces at once --------------------------------------------------------------------------------

// Particles 0 to 2 feel this share of the kick in every frame.
io::ArrayFile coupled(double share) {
  Runs runs;
  for (int64_t f = 4; f < kFrames; ++f) {
    for (int64_t i = 0; i < 3; ++i) runs.kicked[place(f, i, 1)] += share * 0.01 * static_cast<double>(f - 3);
  }
  return runs.file();
}
io::ArrayFile with(io::ArrayFile file, Array array) {
  file.arrays.push_back(std::move(array));
  return file;
}
Array tolerance(double share) { return make_array("tolerance", {}, std::vector<double>{share}); }

TEST(Kick, ThatAllPiecesFeelALittleIsToldAsGlobalCoupling) {
  const Verdict verdict = verdict_on(judged(coupled(4e-9)), "no ghost force");
  EXPECT_FALSE(verdict.holds);
  EXPECT_THAT(verdict.witness.text, HasSubstr("global coupling, 4e-09 of the kick"));
  EXPECT_THAT(verdict.witness.text, HasSubstr("declare a tolerance"));
  // A force of that share, or one that few feel, has other causes.
  for (const io::ArrayFile& file : {coupled(0.23), [] {
                                      Runs runs;
                                      runs.kicked[place(6, 1, 1)] += 1e-9;
                                      return runs.file();
                                    }()}) {
    const std::string text = verdict_on(judged(file), "no ghost force").witness.text;
    EXPECT_THAT(text, Not(HasSubstr("global coupling")));
    EXPECT_THAT(text, HasSubstr("of the kick at most"));
  }
}

// The least that is wrong: the tolerated share of how far the kicked piece is off by then, and a little.
TEST(Kick, MayBeFeltAsMuchAsIsTolerated) {
  EXPECT_THAT(failing(judged(with(coupled(4e-9), tolerance(1e-6)))), IsEmpty());
  EXPECT_THAT(failing(judged(with(coupled(0.99e-6), tolerance(1e-6)))), IsEmpty());
  const oracles::KickReport report = judged(with(coupled(1.01e-6), tolerance(1e-6)));
  EXPECT_THAT(failing(report), ElementsAre("no ghost force"));
  const Verdict verdict = verdict_on(report, "no ghost force");
  EXPECT_EQ(verdict.frame, 4);
  EXPECT_NEAR(verdict.bound, 1e-8, 1e-16);
  EXPECT_THAT(verdict.witness.text, HasSubstr("tolerance is 1e-06"));
  // Of the kick so far, not of what it comes to later; and nothing before it.
  for (const auto& [frame, push] : {std::pair{4, 3e-8}, std::pair{2, 1e-15}}) {
    Runs runs;
    runs.kicked[place(frame, 0)] += push;
    io::ArrayFile file = with(runs.file(), make_array("kicked_piece", {}, std::vector<int32_t>{7}));
    EXPECT_THAT(failing(judged(with(file, tolerance(1e-6)))), ElementsAre("no ghost force")) << frame;
  }
}

// Where the kick tears a particle out of the kicked piece no distance is known, and none is tolerated.
TEST(Kick, ToleratesNoShareOfWhatIsNotThere) {
  Runs runs;
  for (std::vector<double>* const run : {&runs.positions, &runs.kicked}) {
    for (int64_t f = 0; f < 5; ++f)
      std::fill_n(run->begin() + static_cast<std::ptrdiff_t>(place(f, 5)), 3, std::nan(""));
  }
  for (int64_t axis = 0; axis < 3; ++axis) runs.kicked[place(4, 5, axis)] = 1;
  runs.kicked[place(4, 0)] += 1e-6;
  EXPECT_THAT(failing(judged(with(runs.file(), tolerance(1e-6)))), ElementsAre("no ghost force"));
}

// --- Several kicks, and how the kicked piece answers -----------------------------------------------------------------

// Both pieces fall by themselves; each kick adds `answers[k]` to all of its piece in each frame from 4 on.
template <class Real>
io::ArrayFile several(const std::vector<Vec3>& answers, std::vector<int32_t> kicked_piece,
                      const std::function<void(std::vector<Real>&)>& change = {}) {
  std::vector<Real> positions, kicked;
  for (const double x : Runs().positions) positions.push_back(static_cast<Real>(x));
  for (std::size_t k = 0; k < answers.size(); ++k) {
    std::vector<Real> run = positions;
    for (int64_t f = 4; f < kFrames; ++f) {
      for (int64_t i = 0; i < kParticles; ++i) {
        if ((i < 3 ? 2 : 7) != kicked_piece[k]) continue;
        for (int axis = 0; axis < 3; ++axis) {
          Real& x = run[place(f, i, axis)];
          x = static_cast<Real>(x + answers[k][axis] * static_cast<double>(f - 3));
        }
      }
    }
    kicked.insert(kicked.end(), run.begin(), run.end());
  }
  if (change) change(kicked);
  const auto count = static_cast<int64_t>(answers.size());
  io::ArrayFile file;
  file.arrays = {make_array("positions", {kFrames, kParticles, 3}, positions),
                 make_array("kicked", {count, kFrames, kParticles, 3}, kicked),
                 make_array("piece", {kParticles}, Runs().piece), make_array("kicked_piece", {count}, kicked_piece)};
  return file;
}
Array directions(const std::vector<double>& rows) { return make_array("directions", {std::ssize(rows) / 3, 3}, rows); }
Array equal(const std::vector<int32_t>& groups) { return make_array("equal", {std::ssize(groups)}, groups); }

TEST(Kicks, AreJudgedOneByOne) {
  const auto push = [](std::vector<double>& kicked) { kicked[at(3 * kFrames * kParticles) + place(6, 4, 2)] += 1e-9; };
  const oracles::KickReport report =
      judged(several<double>({{0, 0.01, 0}, {0.02, 0, 0}, {0, 0.01, 0}}, {7, 2, 7}, push));
  ASSERT_EQ(report.kicks.size(), 3u);
  EXPECT_EQ(report.kicks[0].kicked_piece, 7);
  EXPECT_EQ(report.kicks[1].kicked_piece, 2);
  EXPECT_NEAR(report.kicks[1].pieces[0].centre, 0.12, 1e-12);
  EXPECT_THAT(failing(report), ElementsAre("no ghost force"));
  const Verdict& verdict = report.kicks[1].verdicts.back();
  EXPECT_FALSE(verdict.holds);
  EXPECT_THAT(verdict.witness.text, HasSubstr("Particle 4 of piece 7 felt it first"));
  EXPECT_THAT(verdict.witness.text, HasSubstr("because piece 2 was kicked (kick 1)"));
  EXPECT_NEAR(report.kicks[1].pieces[1].of_kick, 1e-9 / 0.12, 1e-15);
  // Every one of them has to have been felt.
  EXPECT_THAT(failing(judged(several<double>({{0, 0.01, 0}, {0, 0, 0}}, {7, 2}))), ElementsAre("the kick was felt"));
  EXPECT_THAT(failing(judged(several<double>({{0, 0.01, 0}, {NAN, 0, 0}}, {7, 2}))), ElementsAre("finite"));
}

TEST(Kicks, AreAnsweredToTheSideToWhichTheyPush) {
  const auto failing_of = [](Vec3 answer, std::vector<double> direction) {
    return failing(judged(with(several<double>({answer}, {7}), directions(direction))));
  };
  EXPECT_THAT(failing_of({0, 0.01, 0}, {0, 2, 0}), IsEmpty());
  EXPECT_THAT(failing_of({0.05, 0.001, 0}, {0, 2, 0}), IsEmpty()) << "a wall may turn it aside";
  // The least that is wrong: a right angle.
  for (const auto& [answer, words] :
       {std::pair{Vec3{0, -0.01, 0}, "against"}, {Vec3{0.05, -1e-6, 0}, "against"}, {Vec3{0.05, 0, 0}, "across"}}) {
    const oracles::KickReport report = judged(with(several<double>({answer}, {7}), directions({0, 2, 0})));
    EXPECT_THAT(failing(report), ElementsAre("the answer follows the kick"));
    EXPECT_THAT(verdict_on(report, "the answer follows the kick").witness.text, HasSubstr(words));
  }
  // What rounding explains says nothing.
  const io::ArrayFile weak = with(several<float>({{0, 1e-7, 0}}, {7}), directions({0, 1, 0}));
  EXPECT_THAT(verdict_on(judged(weak), "the answer follows the kick").witness.text,
              HasSubstr("could not be judged: the centre of piece 7"));
}

// Only the first answer counts: what was pushed away may swing back.
TEST(Kicks, MaySwingBack) {
  const auto swing = [](std::vector<double>& kicked) {
    for (int64_t f = 6; f < kFrames; ++f) {
      for (int64_t i = 3; i < kParticles; ++i) kicked[place(f, i, 1)] = 0.45;
    }
  };
  EXPECT_THAT(failing(judged(with(several<double>({{0, 0.01, 0}}, {7}, swing), directions({0, 1, 0})))), IsEmpty());
}

// A heavy particle that is pushed makes light ones recoil: the centre of mass is what goes along.
TEST(Kicks, MoveTheCentreOfMass) {
  const auto recoil = [](std::vector<double>& kicked) {
    for (int64_t f = 4; f < kFrames; ++f) {
      kicked[place(f, 3, 1)] += 0.01;
      kicked[place(f, 4, 1)] -= 0.1;
    }
  };
  const io::ArrayFile file = with(several<double>({{0, 1e-12, 0}}, {7}, recoil), directions({0, 1, 0}));
  EXPECT_THAT(failing(judged(file)), ElementsAre("the answer follows the kick"));
  EXPECT_THAT(failing(judged(with(file, make_array("mass", {6}, std::vector<double>{1, 1, 1, 20, 1, 1})))), IsEmpty());
}

// Two tangential kicks of the same length; a piece that its blade holds in one direction alone.
template <class Real>
void expect_equal_answers() {
  SCOPED_TRACE(sizeof(Real));
  const auto judge = [](Vec3 a, Vec3 b, double share = 0) {
    return judged(with(with(several<Real>({a, b}, {7, 7}), equal({0, 0})), tolerance(share)));
  };
  // Places are rounded one by one: this is what a right simulator of this precision writes.
  EXPECT_THAT(failing(judge({0, 0.013, 0}, {0, 0, 0.013})), IsEmpty());
  EXPECT_THAT(failing(judge({0, 0.013, 0}, {0.6 * 0.013, 0, 0.8 * 0.013})), IsEmpty());
  const oracles::KickReport wrong = judge({0, 0.044, 0}, {0, 0, 0.4});
  EXPECT_THAT(failing(wrong), ElementsAre("equal answers"));
  EXPECT_THAT(
      verdict_on(wrong, "equal answers").witness.text,
      HasSubstr(
          "in frame 4 kick 1 moves the centre of piece 7 by 0.4 m, and kick 0 moves the centre of piece 7 by 0.044 m"));
  EXPECT_NEAR(verdict_on(wrong, "equal answers").measured, 0.89, 1e-6);
  // The least that is wrong: a little more than the bound that is printed, in the sharpest frame.
  const Verdict right = verdict_on(judge({0, 0.4, 0}, {0, 0, 0.4}), "equal answers");
  const double least = std::is_same_v<Real, float> ? 3e-4 : 6e-13;
  EXPECT_LE(right.bound, least);
  EXPECT_THAT(failing(judge({0, 0.4, 0}, {0, 0, 0.4 * (1 - least)})), ElementsAre("equal answers"));
  // A tolerance is a share of the larger answer.
  EXPECT_THAT(failing(judge({0, 0.4, 0}, {0, 0, 0.4 * (1 - 0.0099)}, 0.01)), IsEmpty());
  EXPECT_THAT(failing(judge({0, 0.4, 0}, {0, 0, 0.4 * (1 - 0.0110)}, 0.01)), ElementsAre("equal answers"));
}
TEST(Kicks, ThatAreEqualAreAnsweredEqually) {
  expect_equal_answers<double>();
  expect_equal_answers<float>();
}

TEST(Kicks, AreComparedWithinTheirGroup) {
  const std::vector<Vec3> answers = {{0, 0.01, 0},  {0.03, 0, 0}, {0, 0, 0.03},
                                     {0, -0.01, 0}, {0.5, 0, 0},  {0, 0.01, 0}};
  const std::vector<int32_t> pieces = {7, 2, 7, 7, 2, 2};
  EXPECT_THAT(failing(judged(with(several<double>(answers, pieces), equal({0, 3, 3, 0, -1, 0})))), IsEmpty());
  // The last of three is the one that is off.
  const oracles::KickReport report = judged(with(several<double>(answers, pieces), equal({0, -1, -1, 0, 0, -1})));
  EXPECT_THAT(verdict_on(report, "equal answers").witness.text,
              HasSubstr("kick 4 moves the centre of piece 2 by 0.5 m"));
}

// In single precision a thousand substeps round as much as a weak kick is: nobody could tell equal from other answers.
TEST(Kicks, ThatRoundingHidesAreNotEqual) {
  const io::ArrayFile file = with(several<float>({{0, 1e-5, 0}, {0, 0, 1e-5}}, {7, 7}), equal({0, 0}));
  EXPECT_THAT(failing(judged(with(file, make_array("steps", {}, std::vector<int32_t>{1000})))),
              ElementsAre("equal answers"));
  EXPECT_THAT(
      verdict_on(judged(with(file, make_array("steps", {}, std::vector<int32_t>{1000}))), "equal answers").witness.text,
      HasSubstr("could not be judged"));
}

// Answers differ by the noise of the simulator, each by another draw.
TEST(Kicks, AreAnsweredEquallyWithinNoise) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::vector<double> again = Runs().positions;
    Runs::disturb(again, 1e-9, 1.5, 0, seed);
    const auto noise = [&](std::vector<double>& kicked) {
      for (const std::size_t k : {0, 1}) {
        const auto begin = kicked.begin() + static_cast<std::ptrdiff_t>(k * again.size());
        std::vector<double> run(begin, begin + std::ssize(again));
        Runs::disturb(run, 1e-9, 1.5, 0, seed + 1000 * static_cast<unsigned>(k + 1));
        std::copy(run.begin(), run.end(), begin);
      }
    };
    for (const double other : {0.01, 0.0101}) {
      io::ArrayFile file = several<double>({{0, 0.01, 0}, {0, 0, other}}, {7, 7}, noise);
      file = with(with(file, equal({0, 0})), make_array("again", {kFrames, kParticles, 3}, again));
      if (other == 0.01) {
        EXPECT_THAT(failing(judged(file)), IsEmpty()) << "seed " << seed;
      } else {
        EXPECT_THAT(failing(judged(file)), ElementsAre("equal answers")) << "seed " << seed;
      }
    }
  }
}

// What rounds in a right simulator, however it rounds: a piece of springs in each precision, kicked in six directions.
template <class Real>
io::ArrayFile springs() {
  constexpr int kSteps = 20, kMasses = 12;
  const auto simulate = [&](int axis, Real push) {
    std::mt19937 random(7);
    std::vector<Real> run;
    std::array<std::array<Real, 3>, kMasses> x, v{};
    for (auto& each : x) {
      for (Real& c : each) c = static_cast<Real>(10 + std::uniform_real_distribution<double>(0, 1)(random));
    }
    const auto rest = x;
    const auto length = [](const auto& a, const auto& b) {
      return std::sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
    };
    const Real dt = Real(1e-3);
    for (int f = 0; f < kFrames; ++f) {
      for (auto& each : v) each[at(axis)] += f == 4 ? push : 0;
      for (int step = 0; step < kSteps; ++step) {
        std::array<std::array<Real, 3>, kMasses> force{};
        for (std::size_t i = 0; i < kMasses; ++i) {
          for (std::size_t j = 0; j < i; ++j) {
            const Real now = length(x[i], x[j]), pull = 1000 * (now - Real(1.05) * length(rest[i], rest[j])) / now;
            for (std::size_t c = 0; c < 3; ++c) {
              force[i][c] += pull * (x[j][c] - x[i][c]);
              force[j][c] -= pull * (x[j][c] - x[i][c]);
            }
          }
        }
        for (std::size_t i = 0; i < kMasses; ++i) {
          force[i][2] -= Real(9.81);
          for (std::size_t c = 0; c < 3; ++c) x[i][c] += dt * (v[i][c] += dt * force[i][c]);
        }
      }
      for (const auto& each : x) run.insert(run.end(), each.begin(), each.end());
      run.insert(run.end(), {Real(0), Real(0), Real(0)});  // another piece
    }
    return run;
  };
  std::vector<Real> kicked;
  std::vector<double> rows;
  for (int k = 0; k < 6; ++k) {
    const std::vector<Real> run = simulate(k / 2, Real(k % 2 == 0 ? 0.5 : -0.5));
    kicked.insert(kicked.end(), run.begin(), run.end());
    for (int axis = 0; axis < 3; ++axis) rows.push_back(axis != k / 2 ? 0 : k % 2 == 0 ? 0.5 : -0.5);
  }
  std::vector<int32_t> piece(kMasses + 1, 0);
  piece.back() = 1;
  io::ArrayFile file;
  file.arrays = {make_array("positions", {kFrames, kMasses + 1, 3}, simulate(0, 0)),
                 make_array("kicked", {6, kFrames, kMasses + 1, 3}, kicked),
                 make_array("piece", {kMasses + 1}, piece),
                 make_array("steps", {}, std::vector<int32_t>{kSteps}),
                 directions(rows),
                 equal({0, 0, 0, 0, 0, 0})};
  return file;
}
TEST(Kicks, OfARightSimulatorHoldInBothPrecisions) {
  for (const io::ArrayFile& file : {springs<double>(), springs<float>()}) {
    const oracles::KickReport report = judged(file);
    EXPECT_THAT(failing(report), IsEmpty());
    const Verdict verdict = verdict_on(report, "equal answers");
    EXPECT_GT(verdict.measured, 0) << "it rounds";
    EXPECT_LT(verdict.bound, 0.5) << "an answer of half the length is found";
  }
}

// --- What cannot be understood ---------------------------------------------------------------------------------------

TEST(Kick, ThatCannotBeUnderstoodIsRefused) {
  const auto replace = [](io::ArrayFile& file, Array array) {
    std::erase_if(file.arrays, [&](const Array& a) { return a.name == array.name; });
    file.arrays.push_back(std::move(array));
  };
  struct Bad {
    std::function<void(io::ArrayFile&)> change;
    std::vector<std::string> words;
  };
  using Doubles = std::vector<double>;
  using Integers = std::vector<int32_t>;
  const std::vector<Bad> all = {
      {[](auto& f) { f.arrays.erase(f.arrays.begin()); }, {"positions", "not there"}},
      {[](auto& f) { f.arrays.erase(f.arrays.begin() + 1); }, {"kicked", "not there"}},
      {[](auto& f) { f.arrays.pop_back(); }, {"piece", "not there"}},
      {[&](auto& f) { replace(f, make_array("velocities", {1}, Doubles{1})); },
       {"velocities", "no such array", "again"}},
      {[](auto& f) {
         f.texts = {{"promises", "covered"}};
       },
       {"promises", "no such text"}},
      {[&](auto& f) {
         replace(f, make_array("positions", {6, 3}, Doubles(18)));
       },
       {"positions", "(6, 3)"}},
      {[&](auto& f) {
         replace(f, make_array("positions", {0, 6, 3}, Doubles()));
       },
       {"positions", "no frames"}},
      {[&](auto& f) { replace(f, make_array("positions", {0}, Doubles())); }, {"positions", "(0,)"}},
      {[&](auto& f) {
         replace(f, make_array("kicked", {9, 6, 3}, Doubles(162)));
       },
       {"kicked", "(9, 6, 3)"}},
      {[&](auto& f) {
         replace(f, make_array("kicked", {10, 6, 3}, std::vector<float>(180)));
       },
       {"kicked", "float32"}},
      {[&](auto& f) {
         replace(f, make_array("again", {10, 6, 3}, Integers(180)));
       },
       {"again", "int32"}},
      {[&](auto& f) { replace(f, make_array("piece", {6}, Doubles(6))); }, {"piece", "integers"}},
      {[&](auto& f) { replace(f, make_array("piece", {5}, Integers(5))); }, {"piece", "(5,)"}},
      {[&](auto& f) { replace(f, make_array("kicked_piece", {}, Integers{3})); }, {"kicked_piece", "no piece 3"}},
      {[&](auto& f) { replace(f, make_array("spacing", {}, Doubles{-1})); }, {"spacing", "positive"}},
      {[&](auto& f) { replace(f, make_array("time", {9}, Doubles(9))); }, {"time", "(9,)"}},
      {[&](auto& f) {
         replace(f, make_array("alive", {10, 6}, Integers(60, 2)));
       },
       {"alive", "holds 2"}},
      {[&](auto& f) {
         replace(f, make_array("alive", {6, 10}, Integers(60)));
       },
       {"alive", "transposed"}},
      {[&](auto& f) {
         replace(f, make_array("kicked", {0, 10, 6, 3}, Doubles()));
       },
       {"kicked", "no kick"}},
      {[&](auto& f) {
         replace(f, make_array("kicked", {2, 9, 6, 3}, Doubles(324)));
       },
       {"kicked", "(2, 9, 6, 3)"}},
      {[&](auto& f) {
         replace(f, make_array("kicked_piece", {2}, Integers{2, 7}));
       },
       {"kicked_piece", "(2,)"}},
      {[&](auto& f) {
         replace(f, make_array("directions", {2, 3}, Doubles(6, 1)));
       },
       {"directions", "(2, 3)"}},
      {[&](auto& f) {
         replace(f, make_array("directions", {1, 3}, Doubles(3)));
       },
       {"directions", "Row 0 is (0, 0, 0)"}},
      {[&](auto& f) {
         replace(f, make_array("directions", {1, 3}, Doubles(3, HUGE_VAL)));
       },
       {"directions", "(inf, inf, inf)"}},
      {[&](auto& f) { replace(f, make_array("equal", {1}, Integers{4})); }, {"equal", "Only kick 0 has the number 4"}},
      {[&](auto& f) { replace(f, make_array("equal", {1}, Doubles{4})); }, {"equal", "integers"}},
      {[&](auto& f) { replace(f, make_array("tolerance", {}, Doubles{1})); }, {"tolerance", "less than 1"}},
      {[&](auto& f) { replace(f, make_array("tolerance", {}, Doubles{-1e-9})); }, {"tolerance", "at least 0"}},
      {[&](auto& f) { replace(f, make_array("tolerance", {}, Doubles{NAN})); }, {"tolerance", "nan"}},
      {[&](auto& f) { replace(f, make_array("steps", {}, Integers{0})); }, {"steps", "This is 0"}},
      {[&](auto& f) {
         replace(f, make_array("mass", {6}, Doubles{1, 1, 0, 1, 1, 1}));
       },
       {"mass", "particle 2 is 0"}},
      {[&](auto& f) { replace(f, make_array("mass", {5}, Doubles(5, 1))); }, {"mass", "(5,)"}},
      {[&](auto& f) { replace(f, make_array("position", {1}, Doubles{1})); },
       {"position", "Did you mean 'positions'?"}},
  };
  for (const Bad& bad : all) {
    io::ArrayFile file = Runs().file();
    bad.change(file);
    try {
      judged(file);
      ADD_FAILURE() << "not refused: " << bad.words.front();
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), "kick.npz");
      EXPECT_THAT(error.what(), HasSubstr("remedy: "));
      for (const std::string& word : bad.words) EXPECT_THAT(error.what(), HasSubstr(word));
    }
  }
}

}  // namespace
}  // namespace cutproof::recorded_kick_test
