// Two states that differ in exactly one field of model/fields.h differ under that field's name, whatever the field is.
#include "oracles/comparison/state_difference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <type_traits>

#include "model/fields.h"
#include "tests/oracles/states.h"

namespace cutproof::oracles::state_difference_test {
namespace {

using tests::block_body;
using tests::box_clusters;
using tests::convex_cell_skin;
using tests::setup_of;
using tests::state_of;

// Another value, near the first and as well formed.
void change(int32_t& value) { ++value; }
void change(int64_t& value) { ++value; }
void change(uint8_t& value) { value ^= 1; }
void change(bool& value) { value = !value; }
void change(double& value) { value *= 1.5; }
void change(Vec3& value) { value.y += 0.25; }
void change(Mat3& value) { value = Mat3{{0, -1, 0, 1, 0, 0, 0, 0, 1}}; }
void change(std::array<int32_t, 3>& value) { std::swap(value[0], value[1]); }
template <class T>
void change(std::vector<T>& values) {
  if constexpr (std::is_same_v<T, int32_t>) {
    if (values.empty()) return values.push_back(1);  // a particle that was removed
  }
  ASSERT_FALSE(values.empty());
  change(values.back());
}
// The end of the last cluster has to stay.
void change_field(const Field& field, std::vector<int64_t>& offsets) {
  ASSERT_EQ(field.name, "offsets");
  change(offsets[offsets.size() / 2]);
}
template <class T>
void change_field(const Field&, T& value) {
  change(value);
}

struct Block {
  cutproof::Setup setup = setup_of(block_body(4, 3, 3, 0.01), 2);
  State state = state_of(setup.body, box_clusters(4, 3, 3, 2));
  Block() { state.skin = convex_cell_skin(setup, state); }
  std::vector<FieldError> errors(const State& other) const {
    return errors_of_fields(setup, state, other, 0.001, state.alive);
  }
};

template <class Check>
void for_each_state_with_one_field_changed(const Block& block, const Check& check) {
  for_each_field([&](const Field& field, auto get) {
    SCOPED_TRACE(std::string(field.name));
    State other = block.state;
    change_field(field, get(other));
    check(field, other);
  });
}

TEST(StateDifference, OfAStateFromItselfIsNone) {
  const Block block;
  ASSERT_FALSE(block.state.skin.triangles.empty());
  EXPECT_FALSE(first_difference_in_bits(block.state, block.state));
  EXPECT_FALSE(difference_of_decisions(block.state, block.state));
  for (const FieldError& error : block.errors(block.state)) {
    EXPECT_EQ(error.norm.max, 0) << error.field;
    EXPECT_GT(error.norm.count, 0) << error.field;
  }
}

TEST(StateDifference, InBitsIsFoundUnderTheNameOfTheOneFieldThatDiffers) {
  const Block block;
  int fields = 0;
  for_each_state_with_one_field_changed(block, [&](const Field& field, const State& other) {
    ++fields;
    const auto found = first_difference_in_bits(block.state, other);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->field, field.name);
    EXPECT_EQ(found->text, field.text);
  });
  EXPECT_EQ(fields, 22);
}

TEST(StateDifference, IsOneOfDecisionsExactlyInTheFieldsThatAreDecided) {
  const Block block;
  for_each_state_with_one_field_changed(block, [&](const Field& field, const State& other) {
    const auto found = difference_of_decisions(block.state, other);
    ASSERT_EQ(found.has_value(), field.is_decision);
    if (found) {
      EXPECT_EQ(found->field, field.name);
      EXPECT_FALSE(found->text.empty());
    }
  });
}

TEST(StateDifference, IsADistanceExactlyInTheFieldsThatAreComputed) {
  const Block block;
  for_each_state_with_one_field_changed(block, [&](const Field& field, const State& other) {
    bool known = false;
    for (const FieldError& error : block.errors(other)) {
      EXPECT_EQ(error.norm.max > 0, error.field == field.name) << error.field;
      known = known || error.field == field.name;
    }
    EXPECT_EQ(known, !field.is_decision);
  });
}

// Whichever entry it is, and whichever of the two states has it.
TEST(StateDifference, IsFoundInEveryEntryOfEveryField) {
  Block block;
  block.state.removed = block.state.debris = {1, 4, 6};
  int64_t entries = 0;
  for_each_field([&](const Field& field, auto get) {
    if constexpr (requires { get(block.state).size(); }) {
      const std::size_t ends = field.space == IndexSpace::cluster_end ? 1 : 0;  // they stay where they are
      for (std::size_t k = ends; k + ends < get(block.state).size(); ++k) {
        SCOPED_TRACE(std::string(field.name) + ", entry " + std::to_string(k));
        ++entries;
        State other = block.state;
        if (field.space == IndexSpace::state) {  // a list of particles
          get(other).erase(get(other).begin() + static_cast<std::ptrdiff_t>(k));
        } else {
          change(get(other)[k]);
        }
        for (const bool swapped : {false, true}) {
          const State &expected = swapped ? other : block.state, &actual = swapped ? block.state : other;
          const std::vector<FieldDifference> bits = differences_in_bits(expected, actual);
          ASSERT_EQ(bits.size(), 1u);
          EXPECT_EQ(bits.front().field, field.name);
          EXPECT_EQ(bits.front().index, static_cast<int64_t>(k));
          EXPECT_EQ(difference_of_decisions(expected, actual).has_value(), field.is_decision);
          for (const FieldError& error : errors_of_fields(block.setup, expected, actual, 0.001, block.state.alive)) {
            EXPECT_EQ(error.norm.max > 0, error.field == field.name) << error.field;
          }
        }
      }
    }
  });
  EXPECT_GT(entries, 600);
}

TEST(StateDifference, NamesTheEntry) {
  const Block block;
  State other = block.state;
  other.v[7].x = -0.0;
  EXPECT_EQ(first_difference_in_bits(block.state, other)->index, 7) << "-0 is not 0, bit for bit";
  other = block.state;
  other.removed = {3, 4};
  EXPECT_EQ(first_difference_in_bits(block.state, other)->index, 0) << "the first that only one has";
  State shorter = other;
  shorter.removed.pop_back();
  EXPECT_EQ(first_difference_in_bits(shorter, other)->index, 1);
  EXPECT_EQ(difference_of_decisions(shorter, other)->particles, std::vector<int32_t>{4});
}

TEST(StateDifference, InBitsKnowsThatANumberThatIsNoneEqualsItself) {
  Block block;
  block.state.x[2].z = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(first_difference_in_bits(block.state, block.state));
}

TEST(StateDifference, OfARoundingIsForgivenInVelocitiesAndMomentaOnly) {
  Block block;
  block.state.v[5] = {0.1, 0.2, 0.3};
  block.state.impulse = {0.1, 0.2, 0.3};
  const auto rounded = [](Vec3& v) {
    for (int axis = 0; axis < 3; ++axis) v[axis] = static_cast<float>(v[axis]);
  };
  State other = block.state;
  rounded(other.v[5]);
  rounded(other.impulse);
  EXPECT_TRUE(first_difference_in_bits(block.state, other));
  EXPECT_FALSE(first_difference_in_bits(block.state, other, true));
  other.v[5].x *= 1 + 0x1p-22;
  EXPECT_EQ(first_difference_in_bits(block.state, other, true)->field, "velocity");
  other = block.state;
  other.x[5].x *= 1 + 0x1p-50;
  EXPECT_EQ(first_difference_in_bits(block.state, other, true)->field, "position");
}

// What is compared as sets: the order of clusters is that of their numbers, the order of the skin is nobody's.
TEST(StateDifference, OfDecisionsDoesNotSeeTheOrderOfTheSkin) {
  const Block block;
  State other = block.state;
  Skin& skin = other.skin;
  std::reverse(skin.triangles.begin(), skin.triangles.end());
  for (auto& triangle : skin.triangles) std::rotate(triangle.begin(), triangle.begin() + 1, triangle.end());
  std::reverse(skin.owner.begin(), skin.owner.end());
  std::reverse(skin.direction.begin(), skin.direction.end());
  std::reverse(skin.reach.begin(), skin.reach.end());
  std::reverse(skin.position.begin(), skin.position.end());
  const auto last = static_cast<int32_t>(skin.owner.size()) - 1;
  for (auto& triangle : skin.triangles) {
    for (int32_t& vertex : triangle) vertex = last - vertex;
  }
  EXPECT_FALSE(difference_of_decisions(block.state, other));
  EXPECT_EQ(error_of(block.errors(other), "skin_position").max, 0) << "vertices are found by owner and direction";
  EXPECT_TRUE(first_difference_in_bits(block.state, other));
}

TEST(StateDifference, LeavesSetsOpenWhereARuleDoes) {
  const Block block;
  for_each_state_with_one_field_changed(block, [&](const Field& field, const State& other) {
    const bool open = (field.part & (kSets | kNumbers)) != 0 || field.name == "edge_covered";
    EXPECT_EQ(difference_of_decisions(block.state, other, Sets::open).has_value(), field.is_decision && !open);
  });
}

TEST(StateDifference, SaysACauseBeforeWhatFollowsFromIt) {
  const Block block;
  State other = block.state;
  tests::remove_particles(other, {0});
  other.edge_covered = !other.edge_covered;
  EXPECT_EQ(difference_of_decisions(block.state, other)->field, "removed");
  other.removed.clear();
  EXPECT_EQ(difference_of_decisions(block.state, other)->field, "alive");
  other.alive = block.state.alive;
  ++other.clusters.number.back();
  EXPECT_EQ(difference_of_decisions(block.state, other)->field, "number");
}

TEST(ErrorNorm, HasTheGreatestItsPlaceAndTheMeanSquare) {
  ErrorNorm norm;
  EXPECT_EQ(norm.rms(), 0);
  norm.add(3, 10);
  norm.add(4, 11);
  norm.add(0, 12);
  EXPECT_EQ(norm.max, 4);
  EXPECT_EQ(norm.where, 11);
  EXPECT_EQ(norm.count, 3);
  EXPECT_EQ(norm.beyond, 2);
  EXPECT_DOUBLE_EQ(norm.rms(), std::sqrt(25.0 / 3));
  ErrorNorm other;
  other.join(norm);
  other.add(std::numeric_limits<double>::quiet_NaN(), 13);
  EXPECT_TRUE(std::isinf(other.max)) << "what is not a number is infinitely wrong";
  EXPECT_EQ(other.where, 13);
  norm.join({});
  EXPECT_EQ(norm.count, 3);
}

}  // namespace
}  // namespace cutproof::oracles::state_difference_test
