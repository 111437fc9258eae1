// The lists of fields: that each of them is seen by what walks them.
#include "model/fields.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <type_traits>

#include "model/digest.h"
#include "model/setup_fields.h"

namespace cutproof {
namespace {

template <class T>
void change(T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    value = !value;
  } else if constexpr (std::is_same_v<T, Vec3>) {
    value.z += 1;
  } else if constexpr (std::is_arithmetic_v<T>) {
    value += 1;
  } else {
    value.emplace_back();
  }
}

TEST(Fields, HaveNamesOfTheirOwn) {
  std::set<std::string> names;
  std::size_t count = 0;
  for_each_field([&](const Field& field, auto) {
    names.emplace(field.name);
    ++count;
  });
  EXPECT_EQ(names.size(), count);

  names.clear();
  count = 0;
  const auto note = [&](const SetupField& field, auto) {
    names.insert(std::string(field.group) + "/" + std::string(field.name));
    ++count;
  };
  for_each_setup_field(note);
  for_each_entry_field<Wall>(note);
  for_each_entry_field<Grip>(note);
  for_each_entry_field<BladeMove>(note);
  EXPECT_EQ(names.size(), count);
}

TEST(Digest, TellsStatesApartThatDifferInOneField) {
  const State state;
  EXPECT_EQ(digest(state), digest(State{}));
  std::set<uint64_t> digests = {digest(state)};
  std::size_t fields = 0;
  for_each_field([&](const Field& field, auto get) {
    State other = state;
    change(get(other));
    EXPECT_TRUE(digests.insert(digest(other)).second) << field.name;
    EXPECT_EQ(parts_that_differ(state, other), static_cast<unsigned>(field.part)) << field.name;
    ++fields;
  });
  EXPECT_EQ(digests.size(), fields + 1);
}

TEST(Digest, TellsZeroFromMinusZeroAndLengthsApart) {
  State plus, minus, longer;
  plus.x = {{0, 0, 0}};
  minus.x = {{0, -0.0, 0}};
  longer.x = {{0, 0, 0}, {0, 0, 0}};
  EXPECT_NE(digest(plus), digest(minus));
  EXPECT_NE(digest(plus), digest(longer));
}

TEST(Rules, HaveANameForEachEnumerator) {
  const auto names_differ = [](auto choice, std::size_t count) {
    const auto names = names_of(choice);
    EXPECT_EQ(names.size(), count);
    EXPECT_EQ(std::set<std::string_view>(names.begin(), names.end()).size(), count);
    EXPECT_EQ(name_of(choice), names.back());
  };
  names_differ(Solver::published, 2);
  names_differ(Acceleration::chebyshev, 2);
  names_differ(Criterion::strain, 4);
  names_differ(MergeRule::single_pass, 4);
  names_differ(ExpandRule::published, 3);
}

}  // namespace
}  // namespace cutproof
