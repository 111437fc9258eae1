// What the judge of a run remembers, part by part: from one state to one that differs from it in a single part of
// model/fields.h it must say what a judge says that has seen nothing; and each property must say of itself exactly the
// parts that it rests on.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "oracles/surface/surface.h"
#include "tests/oracles/corruptions.h"
#include "tests/oracles/expectations.h"

namespace cutproof::oracles::remembering_test {
namespace {

using namespace cutproof::tests;

constexpr unsigned kPartCount = std::bit_width(static_cast<unsigned>(kAll));

// A sheet of 4 × 2 particles, i + 4 j, under a blade that stands beside it in frame 0 and across it in frame 1.
cutproof::Setup sheet_under_a_blade() {
  cutproof::Setup setup = setup_of(block_body(4, 2, 1), 3);
  setup.has_blade = true;
  setup.blade = {6.0, 5.0, 0.1, 0};
  for (const double x : {-20.0, 2.5, -20.0}) {
    const BladePose pose = {{x, 1.5, 0.5}, {0, 1, 0}, {0, 0, 1}};
    setup.blade_moves.insert(setup.blade_moves.end(), 4, BladeMove{pose, pose, true, 0});
  }
  return setup;
}

// Vertices where the clusters of their owners put them.
void place_skin(const cutproof::Setup& setup, State& state) {
  const Body& body = setup.body;
  const Clusters& clusters = state.clusters;
  std::vector<int32_t> count(body.node.size(), 0);
  for (const int32_t i : clusters.members) ++count[static_cast<std::size_t>(i)];
  for (std::size_t v = 0; v < state.skin.owner.size(); ++v) {
    const int32_t owner = state.skin.owner[v];
    const auto& step = kDirections[state.skin.direction[v]];
    const Vec3 rest = body.rest_position(owner) +
                      setup.skin.alpha * body.grid.spacing * Vec3{1.0 * step[0], 1.0 * step[1], 1.0 * step[2]};
    Vec3 sum;
    int found = 0;
    for (int32_t c = 0; c < clusters.count(); ++c) {
      const auto members = clusters.of(c);
      if (std::find(members.begin(), members.end(), owner) == members.end()) continue;
      Vec3 now, then;
      double mass = 0;
      for (const int32_t i : members) {
        const double w = 1.0 / count[static_cast<std::size_t>(i)];
        now += w * state.x[static_cast<std::size_t>(i)];
        then += w * body.rest_position(i);
        mass += w;
      }
      sum += now / mass + clusters.rotation[static_cast<std::size_t>(c)] * (rest - then / mass);
      ++found;
    }
    if (found > 0) state.skin.position[v] = sum / found;
  }
}

// States of the sheet, of three clusters each, so that any part of one fits any other. Right and wrong ones: what
// counts is that for each property and each part that it rests on one pair tells them apart.
std::vector<State> pool_of(const cutproof::Setup& setup) {
  const Lists covering = {{0, 1, 4, 5}, {1, 2, 5, 6}, {2, 3, 6, 7}};
  const auto made = [&](const Lists& lists) {
    State state = state_of(setup.body, lists);
    state.skin = convex_cell_skin(setup, state);
    return state;
  };
  const auto without = [&](const Lists& lists, const Numbers& dead) {
    State state = made(lists);
    remove_particles(state, dead);
    state.skin = convex_cell_skin(setup, state);
    return state;
  };
  std::vector<State> pool;
  const auto add = [&](State state, const auto& change) {
    change(state);
    pool.push_back(std::move(state));
  };
  const auto as_it_is = [](State&) {};
  add(made(covering), [](State& s) { s.edge_covered = true; });
  add(made(covering), [](State& s) { s.tau = 5; });                 // all are small, and could merge
  add(made(covering), [](State& s) { s.frame = 1; });               // the blade stands across
  add(made(covering), [](State& s) { s.x[3].x = s.x[7].x = -1; });  // an edge reaches over the blade's first place
  add(made(covering), [](State& s) { s.x[3].x = s.x[7].x = -30; });
  add(made({{0, 1, 4, 5}, {1, 5}, {2, 3, 6, 7}}), as_it_is);        // two groups, isolated
  add(made({{0, 1, 4, 7}, {1, 2, 5, 6}, {2, 3, 6, 7}}), as_it_is);  // a cluster in two pieces
  add(made({{0, 1, 4}, {1, 2, 6}, {2, 3, 6, 7}}), as_it_is);        // a particle that nothing covers
  add(made({{0, 4}, {0, 1}, {1, 2, 3, 5, 6, 7}}), as_it_is);        // coupled through particles 0 and 1 alone
  add(without({{0, 4}, {0}, {2, 3, 5, 6, 7}}, {1}), as_it_is);      // and then not
  add(made({{0, 1, 2, 3}, {4, 5, 6, 7}, {3, 7}}), as_it_is);        // held together by 1 and 2
  add(without({{0, 4}, {2, 3, 6, 7}, {3, 7}}, {1, 5}), as_it_is);   // two components
  add(without({{0, 4}, {2, 3, 6, 7}, {3, 7}}, {1, 5}), [](State& s) { s.removed.clear(); });
  add(without({{0, 4}, {2, 3, 6, 7}, {3, 7}}, {1, 5}), [](State& s) { s.edge_covered = true; });
  add(without({{0, 4}, {2, 3, 6, 7}, {3, 7}}, {1, 5}), [](State& s) { s.frame = 1; });
  add(made({{0}, {1, 2, 3, 5, 6, 7}, {4, 5}}), [](State& s) { s.tau = 2; });  // one small cluster
  add(without({{0}, {1, 2, 3, 5, 6, 7}, {4, 5}}, {0}), [](State& s) { s.tau = 2; });
  add(made(covering), [](State& s) { s.skin = {}; });
  add(without({{}, {}, {}}, range(0, 8)), [](State& s) {
    s.frame = 2;
    s.clusters.mass.assign(3, 1);
  });
  add(made(covering), [](State& s) { std::swap(s.skin.triangles[3][0], s.skin.triangles[3][1]); });
  add(made(covering), [](State& s) { s.skin.triangles.pop_back(); });
  add(made(covering), [](State& s) { s.skin.position[2].x = kNan; });
  add(made(covering), [](State& s) { s.x[5].y = kNan; });
  add(made(covering), [](State& s) { s.clusters.rest_center[1].z = kNan; });
  add(made(covering), [](State& s) { s.clusters.rest_center[1].z += 1e-3; });
  add(made(covering), [](State& s) { s.clusters.rotation[1].m[4] = kNan; });
  add(made(covering), [](State& s) { s.clusters.rotation[1] = Mat3{{1, 0, 0, 0, 1, 0, 0, 0, -1}}; });
  add(made(covering), [&](State& s) {  // bent, its skin in place
    for (std::size_t i = 0; i < s.x.size(); ++i) s.x[i].z += 0.1 * s.x[i].x * s.x[i].x;
    s.clusters.rotation[0] = turn_about_z(0.3);
    place_skin(setup, s);
  });
  add(made(covering), [](State& s) { s.clusters.number = {0, 2, 5}; });
  add(made(covering), [](State& s) { s.impulse.x = 1; });
  // What cannot be read, by one part alone.
  add(made(covering), [](State& s) { s.clusters.members[3] = 99; });
  add(made(covering), [](State& s) { s.clusters.offsets[1] = 9; });
  add(made(covering), [](State& s) { s.clusters.number[1] = 0; });
  add(made(covering), [](State& s) { s.skin.triangles[0][0] = 999; });
  add(made(covering), [](State& s) { s.skin.owner[1] = 8; });
  add(made(covering), [](State& s) { s.alive[2] = 2; });
  add(made(covering), [](State& s) { s.removed = {8}; });
  add(made(covering), [](State& s) { s.x.pop_back(); });
  add(made(covering), [](State& s) { s.clusters.mass.pop_back(); });
  add(made(covering), [](State& s) { s.clusters.degenerate.push_back(0); });
  add(made(covering), [](State& s) { s.frame = -1; });
  return pool;
}

// `a`, but for one part, which is that of `b`.
State with_part_of(const State& a, const State& b, unsigned part) {
  State state = a;
  for_each_field([&](const Field& field, auto get) {
    if (field.part == part) get(state) = get(b);
  });
  return state;
}

std::string name_of_part(unsigned part) {
  std::string names;
  for_each_field([&](const Field& field, auto) {
    if (field.part == part) names += (names.empty() ? "" : ", ") + std::string(field.name);
  });
  return names;
}

// Equal to the bit, with numbers that are none.
bool same(const Verdict& a, const Verdict& b) {
  Verdict x = a, y = b;
  for (auto member : {&Verdict::measured, &Verdict::bound}) {
    if (!same_bits(x.*member, y.*member)) return false;
    x.*member = y.*member = 0;
  }
  return x == y;
}
// Whether the state, the frame aside, was judged in another way.
bool judged_otherwise(Verdict a, Verdict b) {
  a.frame = b.frame = 0;
  return !same(a, b);
}

class Remembering : public ::testing::Test {
 protected:
  // visit(a, b, part): `b` differs from `a` in exactly this part.
  template <class Visit>
  void for_each_pair(const Visit& visit) {
    const std::vector<State> pool = pool_of(setup_);
    for (unsigned bit = 0; bit < kPartCount; ++bit) {
      const unsigned part = 1u << bit;
      for (const State& a : pool) {
        std::vector<State> tried;
        for (const State& other : pool) {
          State b = with_part_of(a, other, part);
          const auto is_b = [&](const State& state) { return same_bits(state, b); };
          if (parts_that_differ(a, b) != part || std::any_of(tried.begin(), tried.end(), is_b)) continue;
          visit(a, b, part);
          tried.push_back(std::move(b));
        }
      }
    }
  }
  const cutproof::Setup setup_ = sheet_under_a_blade();
};

TEST_F(Remembering, SaysAfterAChangeOfOnePartWhatAJudgeSaysThatHasSeenNothing) {
  int64_t pairs = 0;
  std::map<std::string, std::set<unsigned>> failed_after_holding;
  for_each_pair([&](const State& a, const State& b, unsigned part) {
    if (HasFailure()) return;
    ++pairs;
    for (const Stage after : {Stage::detect, Stage::merge, Stage::skin}) {
      const bool thorough = after == Stage::skin && pairs % 8 == 0;
      const auto of_a = judge(setup_, a, after, thorough, properties());
      const auto of_b = judge(setup_, b, after, thorough, properties());
      const auto again = a;
      Judge remembering(setup_, properties());
      for (const auto& [state, fresh] : {std::pair(&a, &of_a), std::pair(&b, &of_b), std::pair(&again, &of_a)}) {
        const auto found = remembering.state(*state, after, thorough);
        ASSERT_EQ(found.size(), fresh->size()) << name_of_part(part) << " after " << name_of(after);
        for (std::size_t k = 0; k < found.size(); ++k) {
          ASSERT_TRUE(same(found[k], (*fresh)[k]))
              << (*fresh)[k].property << " after " << name_of(after) << ", where only " << name_of_part(part)
              << " changed: it remembers that it " << (found[k].holds ? "holds" : "fails") << " ("
              << found[k].witness.text << "), and it " << ((*fresh)[k].holds ? "holds" : "fails") << " ("
              << (*fresh)[k].witness.text << ")";
        }
      }
      for (const Verdict& one : of_a) {
        for (const Verdict& other : of_b) {
          if (one.property == other.property && one.holds && !other.holds && well_formed(setup_, b).holds) {
            failed_after_holding[one.property].insert(part);
          }
        }
      }
    }
  });
  EXPECT_GT(pairs, 1000);
  // The pool shows each property fail after it held, or this test says nothing of it.
  for (const PropertyList* list : properties()) {
    for (const Property& property : *list) {
      if (property.check_state == nullptr || property.cost == Cost::thorough || property.name == "well formed")
        continue;
      EXPECT_FALSE(failed_after_holding[std::string(property.name)].empty()) << property.name;
    }
  }
}

// From the registry: a property that is new, or rests on more, fails this until the pool has a pair that shows it.
TEST_F(Remembering, EachPropertyRestsOnExactlyThePartsThatItSays) {
  std::map<std::string_view, unsigned> changes, fails;  // verdicts that held; one that fails is never remembered
  for_each_pair([&](const State& a, const State& b, unsigned part) {
    if (!well_formed(setup_, a).holds || !well_formed(setup_, b).holds) return;
    for (const PropertyList* list : properties()) {
      for (const Property& property : *list) {
        if (property.check_state == nullptr || property.name == "well formed") continue;
        if (((changes[property.name] & fails[property.name]) & part) != 0) continue;
        const Verdict one = ask(property, setup_, a), other = ask(property, setup_, b);
        if (!one.holds || !judged_otherwise(one, other)) continue;
        changes[property.name] |= part;
        if (!other.holds) fails[property.name] |= part;
      }
    }
  });
  for (const PropertyList* list : properties()) {
    for (const Property& property : *list) {
      if (property.check_state == nullptr || property.name == "well formed") continue;
      for (unsigned bit = 0; bit < kPartCount; ++bit) {
        const unsigned part = 1u << bit;
        // When a skin must be there depends on the frame; that is asked before anything is remembered (Property::due).
        const bool of_due = part == kTime && (property.rests_on & kSkin) != 0;
        if ((property.rests_on & part) != 0) {
          EXPECT_NE(fails[property.name] & part, 0u) << property.name << " rests on " << name_of_part(part)
                                                     << ", and no pair of the pool shows it fail by that";
        } else if (!of_due) {
          EXPECT_EQ(changes[property.name] & part, 0u)
              << property.name << " depends on " << name_of_part(part) << " and does not say so";
        }
      }
    }
  }
}

// Bounds follow from the precision and from the rounding of places, which are no parts.
TEST_F(Remembering, AsksAgainWhereOnlyThePrecisionChanged) {
  State exact = pool_of(setup_).front();
  exact.clusters.rest_center[0].x *= 1 + 0x1p-26;
  State single = exact, absolute = exact;
  single.precision = Precision::binary32;
  absolute.place_rounding = 0x1p-24;
  for (const State& coarse : {single, absolute}) {
    const State fine = exact;
    Judge remembering(setup_, properties());
    const auto rest_frames_hold = [&](const State& state) {
      for (const Verdict& verdict : remembering.state(state, Stage::skin, false)) {
        if (verdict.property == "rest frames") return verdict.holds;
      }
      ADD_FAILURE() << "not asked";
      return false;
    };
    EXPECT_TRUE(rest_frames_hold(coarse));
    EXPECT_FALSE(rest_frames_hold(fine));
  }
}

// The same of stages: both states are looked at anew, whichever part has changed since the last one.
TEST_F(Remembering, JudgesAStageAsAJudgeDoesThatHasSeenNothing) {
  int64_t pairs = 0;
  for_each_pair([&](const State& a, const State& b, unsigned part) {
    if (HasFailure() || ++pairs % 3 != 0) return;
    const Stage stage = kStages[static_cast<std::size_t>(pairs / 3) % kStages.size()];
    Judge remembering(setup_, properties());
    (void)remembering.state(b, stage, false);
    for (const bool forward : {true, false}) {
      const State &before = forward ? a : b, &after = forward ? b : a;
      const auto found = remembering.stage(stage, before, after);
      const auto fresh = judge_stage(setup_, stage, before, after, properties());
      ASSERT_EQ(found.size(), fresh.size());
      for (std::size_t k = 0; k < found.size(); ++k) {
        ASSERT_TRUE(same(found[k], fresh[k]))
            << fresh[k].property << " of " << name_of(stage) << ", where only " << name_of_part(part) << " changed";
      }
    }
  });
}

}  // namespace
}  // namespace cutproof::oracles::remembering_test
