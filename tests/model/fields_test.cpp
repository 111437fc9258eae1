// The lists of fields: that each of them is seen by what walks them.
#include "model/fields.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "model/digest.h"
#include "model/setup_fields.h"

namespace cutproof::fields_test {
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

// The lists against the structs themselves, by addresses: each member has one place in its list, under one name.
class Visited {
 public:
  template <class T>
  void see(const T& member) {
    ++times_[&member];
  }
  template <class... T>
  void expect_once(const T&... member) {
    (expect_once(static_cast<const void*>(&member)), ...);
    EXPECT_EQ(times_.size(), sizeof...(member)) << "the list visits what is no member";
  }

 private:
  void expect_once(const void* member) { EXPECT_EQ(times_[member], 1) << "member " << ++position_; }
  std::map<const void*, int> times_;
  int position_ = 0;
};

TEST(Fields, AreTheMembersOfAStateEachOnce) {
  const State state;
  Visited visited;
  for_each_field([&](const Field&, auto get) { visited.see(get(state)); });
  // All but the precision and the rounding of places, which are of the arithmetic and not of the body.
  const auto& [frame, x, v, alive, removed, debris, clusters, tau, cap, edge_covered, impulse, skin, precision,
               place_rounding] = state;
  const auto& [offsets, members, number, rotation, rest_center, mass, degenerate] = clusters;
  const auto& [owner, direction, reach, position, triangles] = skin;
  visited.expect_once(frame, x, v, alive, removed, debris, tau, cap, edge_covered, impulse, offsets, members, number,
                      rotation, rest_center, mass, degenerate, owner, direction, reach, position, triangles);
}

TEST(Fields, AreTheMembersOfASetupEachOnce) {
  const cutproof::Setup setup;
  Visited visited;
  for_each_setup_field([&](const SetupField&, auto get) { visited.see(get(setup)); });
  const auto& [body, step, detect, split, merge, expand, skin, walls, grips, has_blade, blade, substep_length,
               blade_moves, stroke_end, withheld_iterations] = setup;
  const auto& [name, grid, node, particle_at, rest, edge_offsets, edge_ends, mass, surface_crossing, origin,
               orientation] = body;
  const auto& [nodes, spacing] = grid;
  const auto& [solver, substeps, iterations, stiffness, volume_share, relaxation, acceleration, damping, retardation,
               gravity] = step;
  const auto& [criterion, remove, epsilon, strain, without_blade] = detect;
  const auto& [debris] = split;
  const auto& [merge_rule] = merge;
  const auto& [expand_rule, depth] = expand;
  const auto& [wanted, alpha, fit_cuts] = skin;
  const auto& [length, blade_depth, thickness, friction] = blade;
  visited.expect_once(name, nodes, spacing, node, particle_at, rest, edge_offsets, edge_ends, mass, surface_crossing,
                      origin, orientation, solver, substeps, iterations, stiffness, volume_share, relaxation,
                      acceleration, damping, retardation, gravity, criterion, remove, epsilon, strain, without_blade,
                      debris, merge_rule, expand_rule, depth, wanted, alpha, fit_cuts, walls, grips, has_blade, length,
                      blade_depth, thickness, friction, substep_length, blade_moves, stroke_end);
}

template <class Entry>
Visited visited_of(const Entry& entry) {
  Visited visited;
  for_each_entry_field<Entry>([&](const SetupField&, auto get) { visited.see(get(entry)); });
  return visited;
}

TEST(Fields, AreTheMembersOfTheEntriesOfASetupsListsEachOnce) {
  const Wall wall;
  const auto& [axis, side, offset, friction] = wall;
  visited_of(wall).expect_once(axis, side, offset, friction);
  const Grip grip;
  const auto& [particles, active, displacement] = grip;
  visited_of(grip).expect_once(particles, active, displacement);
  const BladeMove move;
  const auto& [from, to, down, stroke] = move;
  visited_of(move).expect_once(from.edge, from.along, from.back, to.edge, to.along, to.back, down, stroke);
}

// Whatever its length: bytes that fill no word of eight are part of it too.
TEST(Digest, TellsApartWhatDiffersInOneBit) {
  for (std::size_t bytes = 0; bytes <= 19; ++bytes) {
    std::vector<uint8_t> values(bytes, 0x5a);
    std::set<uint64_t> digests;
    const auto note = [&] {
      Digest digest;
      digest.add(values);
      digests.insert(digest.value());
    };
    note();
    for (uint8_t& value : values) {
      for (int bit = 0; bit < 8; ++bit) {
        value = static_cast<uint8_t>(value ^ 1u << bit);
        note();
        value = static_cast<uint8_t>(value ^ 1u << bit);
      }
    }
    EXPECT_EQ(digests.size(), 1 + 8 * bytes);
  }
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
  names_differ(MergeRule::published, 3);
  names_differ(ExpandRule::published, 3);
}

}  // namespace
}  // namespace cutproof::fields_test
