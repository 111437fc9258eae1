#include "baselines/dissection.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace cutproof::baselines {
namespace {

const Patch kPatch = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)};

TEST(DissectionCrosses, OnlyWhatPassesThroughThePatch) {
  EXPECT_TRUE(crosses(kPatch, {0.2, 0.7, -1}, {0.2, 0.7, 1}));
  EXPECT_TRUE(crosses(kPatch, {0.7, 0.2, 1}, {0.7, 0.2, -1}));
  EXPECT_FALSE(crosses(kPatch, {1.2, 0.7, -1}, {1.2, 0.7, 1}));  // beside it
  EXPECT_FALSE(crosses(kPatch, {0.2, 0.7, 1}, {0.2, 0.7, 2}));   // above it
  EXPECT_TRUE(crosses(kPatch, {0.5, 0.5, -1}, {0.5, 0.5, 1}));   // where its triangles meet
}

TEST(DissectionCrosses, OneOfTwoSegmentsThatMeetInIt) {
  const Vec3 middle(0.3, 0.4, 0);
  EXPECT_TRUE(crosses(kPatch, {0.3, 0.4, -1}, middle));
  EXPECT_FALSE(crosses(kPatch, middle, {0.3, 0.4, 1}));
}

TEST(DissectionComponents, AreNumberedByTheirFirstMembers) {
  EXPECT_EQ(components(6, {{5, 0}, {2, 4}, {4, 1}}), (std::vector<int32_t>{0, 1, 1, 2, 1, 0}));
  EXPECT_EQ(components(0, {}), std::vector<int32_t>{});
}

TEST(DissectionParameters, TellWhatIsWrongWithThem) {
  const std::map<std::string, double> known = {{"steps", 4}, {"young", 1800}};
  EXPECT_EQ(Parameters("", known)("steps"), 4);
  EXPECT_EQ(Parameters(nullptr, known)("young"), 1800);
  EXPECT_EQ(Parameters("young=2e3,steps=8", known)("young"), 2000);
  for (const char* const wrong : {"stepz=4", "steps", "steps=", "steps=4x", "steps=nan", "=4"}) {
    try {
      const Parameters read(wrong, known);
      ADD_FAILURE() << wrong;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("steps, young"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace cutproof::baselines
