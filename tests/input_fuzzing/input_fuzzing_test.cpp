// Every reader on its seeds, on damaged seeds, and on every input that once broke one (fixtures/regressions/inputs/).
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <string>

#include "tests/fixtures/mesh_files.h"
#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace {

namespace fs = std::filesystem;

const fs::path kRegressions = CUTPROOF_SOURCE_DIR "/fixtures/regressions/inputs";

class InputFuzzing : public testing::TestWithParam<Target> {};

TEST_P(InputFuzzing, SeedsAreRead) {
  const auto seeds = GetParam().seeds();
  ASSERT_FALSE(seeds.empty());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    EXPECT_NO_THROW(EXPECT_EQ(GetParam().feed(seeds[i]), Outcome::read)) << "seed " << i;
  }
}

TEST_P(InputFuzzing, WhatOnceBrokeAReaderIsReadOrRefused) {
  const fs::path folder = kRegressions / GetParam().name;
  if (!fs::is_directory(folder)) return;  // nothing was ever found
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) EXPECT_NO_THROW(GetParam().feed(bytes_of_file(file.string()))) << file;
}

// A little of what the fuzzers do, in every build: cut off, and with some bytes changed.
TEST_P(InputFuzzing, DamagedSeedsAreReadOrRefused) {
  constexpr unsigned kSeed = 20240611;
  SCOPED_TRACE("seed " + std::to_string(kSeed));
  std::mt19937 random(kSeed);
  int refused = 0;
  const auto seeds = GetParam().seeds();
  for (int i = 0; i < 60; ++i) {
    std::string input = seeds[random() % seeds.size()];
    if (input.empty()) continue;
    if (i % 4 == 0) {
      input.resize(random() % input.size());
    } else {
      for (unsigned changes = 1 + random() % 4; changes > 0; --changes) {
        input[random() % input.size()] = static_cast<char>(random());
      }
    }
    EXPECT_NO_THROW(refused += GetParam().feed(input) == Outcome::refused) << "damaged seed " << i;
  }
  EXPECT_GT(refused, 0);
}

INSTANTIATE_TEST_SUITE_P(Readers, InputFuzzing, testing::ValuesIn(all_targets().begin(), all_targets().end()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(InputFuzzingRegressions, AreAllOfAKnownTarget) {
  ASSERT_TRUE(fs::is_directory(kRegressions));
  for (const auto& entry : fs::directory_iterator(kRegressions)) {
    EXPECT_TRUE(std::ranges::any_of(all_targets(), [&](const Target& t) { return entry.path().filename() == t.name; }))
        << entry.path() << " is replayed by nobody";
  }
}

// --- The checks themselves see what is wrong ---------------------------------------------------------------------

fixtures::SurfaceMesh box() {
  const fixtures::Polygons cube = fixtures::cube();
  fixtures::SurfaceMesh mesh{"box", cube.points, {}};
  for (const auto& face : cube.faces) mesh.triangles.push_back({face[0], face[1], face[2]});
  return mesh;
}

TEST(InputFuzzingChecks, AcceptASoundMesh) { EXPECT_EQ(defect_of(box()), std::nullopt); }

TEST(InputFuzzingChecks, RejectMeshesThatAreNotSound) {
  const auto reject = [](const char* word, auto&& damage) {
    fixtures::SurfaceMesh mesh = box();
    damage(mesh);
    EXPECT_NE(defect_of(mesh).value_or("accepted").find(word), std::string::npos) << defect_of(mesh).value_or("-");
  };
  reject("no triangles", [](auto& mesh) { mesh = {}; });
  reject("finite", [](auto& mesh) { mesh.points[3].y = std::numeric_limits<double>::quiet_NaN(); });
  reject("are one", [](auto& mesh) { mesh.points[3] = mesh.points[4]; });
  reject("names the point 8 of 8", [](auto& mesh) { mesh.triangles[5][1] = 8; });
  reject("no triangle", [](auto& mesh) { mesh.points.push_back({7, 7, 7}); });
  reject("edge", [](auto& mesh) { mesh.triangles.pop_back(); });
  reject("edge", [](auto& mesh) { std::swap(mesh.triangles[0][0], mesh.triangles[0][1]); });
  reject("edge", [](auto& mesh) { mesh.triangles.push_back(mesh.triangles[0]); });
  reject("volume", [](auto& mesh) {
    for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  });
}

TEST(InputFuzzingChecks, ARefusalWithoutARemedyBreaksTheContract) {
  EXPECT_EQ(outcome_of([] {}), Outcome::read);
  EXPECT_EQ(outcome_of([] { throw InputError("a.json", "", "is wrong", "Mend it."); }), Outcome::refused);
  EXPECT_THROW(outcome_of([] { throw InputError("a.json", "", "is wrong", ""); }), std::logic_error);
  EXPECT_THROW(outcome_of([] { throw MachineError("full"); }), MachineError);
}

TEST(InputFuzzingChecks, ARefusalShowsWhatItQuotesWithoutControlCharacters) {
  using namespace std::string_literals;
  const InputError error("a.json", "name", "is \"\0\x1b[2J\x7f é\""s, "Mend it.");
  EXPECT_STREQ(error.what(), "a.json: name: is \"\\x00\\x1b[2J\\x7f é\"\n  remedy: Mend it.");
  EXPECT_EQ(outcome_of([&] { throw error; }), Outcome::refused);
}

}  // namespace
}  // namespace cutproof::input_fuzzing
