// The kick test: who feels a kick that is none of his business is found, with when and by how much; a right simulator
// holds; a test that tested nothing fails; noise makes it blunt and does not make it blind.
#include "harness/recorded_kick.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
  for (const Verdict& verdict : report.verdicts) {
    if (!verdict.holds) names.push_back(verdict.property);
  }
  return names;
}
const Verdict& verdict_on(const oracles::KickReport& report, const std::string& property) {
  for (const Verdict& verdict : report.verdicts) {
    if (verdict.property == property) return verdict;
  }
  throw std::logic_error(property + " was not judged");
}

TEST(Kick, OfOnePieceThatNobodyElseFeelsHolds) {
  const oracles::KickReport report = judged(Runs().file());
  EXPECT_THAT(failing(report), IsEmpty());
  EXPECT_EQ(report.kicked_piece, 7);
  EXPECT_EQ(report.kick_frame, 4);
  EXPECT_EQ(verdict_on(report, "no ghost force").checked, 3 * kFrames);
  EXPECT_EQ(verdict_on(report, "no ghost force").bound, 0);
  ASSERT_EQ(report.pieces.size(), 2u);
  EXPECT_EQ(report.pieces[1].felt, 3);
  EXPECT_EQ(report.pieces[1].first_frame, 4);
  EXPECT_NEAR(report.pieces[1].greatest, 0.06, 1e-12);
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
  EXPECT_EQ(report.pieces[0].felt, 1);
  EXPECT_EQ(report.pieces[0].first_frame, 6);
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
              HasSubstr("particle 2 of piece 2 felt it first, from frame 4 on, by 4e-09 m (8e-09 h)"));
  EXPECT_THAT(verdict.witness.text, HasSubstr("2 of 3 particles of piece 2 did"));
}

// Piece 2 moves first, so it is the kicked one unless the file says who was.
TEST(Kick, TakesTheKickedPieceFromTheFileIfItIsThere) {
  Runs runs;
  runs.kicked[place(2, 0)] += 1e-3;
  EXPECT_EQ(judged(runs.file()).kicked_piece, 2);
  EXPECT_EQ(verdict_on(judged(runs.file()), "no ghost force").witness.particles, (std::vector<int32_t>{3}));
  io::ArrayFile file = runs.file();
  file.arrays.push_back(make_array("kicked_piece", {}, std::vector<int32_t>{7}));
  const oracles::KickReport report = judged(file);
  EXPECT_EQ(report.kick_frame, 4);
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

// --- A simulator that does not repeat itself
// --------------------------------------------------------------------------------

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
      EXPECT_EQ(report.kicked_piece, 7);
      EXPECT_EQ(report.kick_frame, 4);
      // Noise that begins late has not shown how far it grows.
      EXPECT_EQ(report.judged_frames, kFrames - in_again);
      EXPECT_EQ(verdict_on(report, "no ghost force").undecided, 3 * in_again);
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
  EXPECT_EQ(report.sharpest_frame, 4);
  EXPECT_NEAR(report.least_bound, 64e-9 * std::pow(3, 4), 1e-12);
  EXPECT_NEAR(report.kick_then, 0.01, 1e-12);
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
  EXPECT_THAT(report.verdicts.back().witness.text, HasSubstr("noise"));
}

// --- What cannot be understood
// -----------------------------------------------------------------------------------------------

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
