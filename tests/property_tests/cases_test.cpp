// What cases are drawn, how they are read and written, and what is made of them.
#include "property_tests/cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace cutproof::property_tests::cases_test {
namespace {

using nlohmann::json;

TEST(Cases, ComeBackFromJsonAsTheyWere) {
  for (uint64_t seed = 0; seed < 200; ++seed) {
    const int size = static_cast<int>(seed % 50);
    for (const Case& c : {draw_case(seed, size), draw_moving_case(seed, size)}) EXPECT_EQ(from_json(to_json(c)), c);
  }
  EXPECT_THROW(from_json("{}"), std::invalid_argument);
  EXPECT_THROW(from_json("not a case"), std::invalid_argument);
}

TEST(Cases, ThatLackAFieldAreRefusedByItsName) {
  Case given;
  given.nodes = {{0, 0, 0}};
  given.strokes = {{{0, 0, 0}, {4, 0, 0}, 4, true, Link::apart}};
  given.walls = {{}};
  given.grips = {{}};
  const json text = json::parse(to_json(given));
  ASSERT_NO_THROW(from_json(text.dump()));
  for (const char* const object : {"", "/strokes/0", "/walls/0", "/grips/0"}) {
    const json::json_pointer where(object);
    for (const auto& each : text.at(where).items()) {
      json lacking = text;
      lacking[where].erase(each.key());
      try {
        from_json(lacking.dump());
        ADD_FAILURE() << "accepted without " << object << "/" << each.key();
      } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find("'" + each.key() + "'"), std::string::npos) << error.what();
      }
    }
  }
}

TEST(Cases, WithNumbersThatNoCaseHasAreRefusedByField) {
  Case good;
  good.nodes = {{0, 0, 0}};
  good.strokes = {{{0, 0, 0}, {4, 0, 0}, 4, true, Link::apart}};
  good.walls = {{}};
  good.grips = {{}};
  const json text = json::parse(to_json(good));
  ASSERT_NO_THROW(from_json(text.dump()));
  const auto refused = [&](const json::json_pointer& where, const json& value, const std::string& field) {
    json bad = text;
    bad[where] = value;
    try {
      from_json(bad.dump());
      ADD_FAILURE() << "accepted: " << where << " = " << value;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
    }
  };
  using P = json::json_pointer;
  for (const auto& [field, values] :
       std::vector<std::pair<std::string, std::vector<json>>>{{"alpha", {0, 10}},
                                                              {"epsilon", {0, 1001}},
                                                              {"strain", {0, 100'001}},
                                                              {"relaxation", {0, 11}},
                                                              {"damping", {-1, 100'001}},
                                                              {"time_step", {0, 1'000'001}},
                                                              {"pace", {0, 1001}},
                                                              {"blade_friction", {-1, 10'001}},
                                                              {"gravity", {{10'001, 0, 0}, {0, 0, -10'001}}},
                                                              {"solver", {"explicit"}},
                                                              {"removal", {"none"}},
                                                              {"remove", {"none", "two"}},
                                                              {"acceleration", {"anderson"}},
                                                              {"merge", {"both"}},
                                                              {"alpha", {1e30, 5.5, "5"}}}) {
    for (const json& value : values)
      refused(P("/" + field), value, value.is_array() || value.is_number_integer() ? field : "");
  }
  refused(P("/gravity"), {1, 2}, "");
  refused(P("/strokes/0/tilt"), {0, 4, 0}, "strokes.tilt");
  refused(P("/strokes/0/along"), {0, 0, 1001}, "strokes.along");
  refused(P("/strokes/0/turn"), {0, -181, 0}, "strokes.turn");
  refused(P("/strokes/0/twist"), {0, 0, 0}, "strokes");
  refused(P("/walls/0/axis"), 3, "walls.axis");
  refused(P("/walls/0/side"), 0, "walls.side");
  refused(P("/walls/0/offset"), 1 << 23, "walls.offset");
  refused(P("/walls/0/friction"), -1, "walls.friction");
  refused(P("/grips/0/low"), {0, 0, 1 << 21}, "grips");
  refused(P("/grips/0/pull"), {0, 1001, 0}, "grips.pull");
  refused(P("/grips/0/from"), -1, "grips.from");
  refused(P("/grips/0/until"), -2, "until");
}

// What the fields say is what backends load.
TEST(ACase, BecomesTheSetupThatItsFieldsSay) {
  Case c;
  c.nodes = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  c.spacing = 0.5;
  c.strokes = {{{0, 0, 0}, {8, 0, 0}, 4, true, Link::apart}};
  c.alpha = 3;
  c.epsilon = 12;
  EXPECT_EQ(setup_of(c).skin.alpha, 0.3);
  EXPECT_EQ(setup_of(c).detect.criterion, Criterion::geometric);
  c.moves = true;
  c.solver = Solver::published;
  c.acceleration = Acceleration::chebyshev;
  c.relaxation = 8;
  c.damping = 100;
  c.time_step = 250;
  c.strain = 105;
  c.blade_friction = 7;
  c.gravity = {0, 0, -40};
  c.walls = {{1, -1, 6, 2}};
  c.grips = {{{0, 0, 0}, {1, 0, 0}, {0, 3, 0}, 1, 3}, {{1, 0, 0}, {9, 9, 9}, {0, 0, 0}, 0, -1}};
  const cutproof::Setup setup = setup_of(c);
  EXPECT_EQ(setup.detect.criterion, Criterion::distance);
  EXPECT_EQ(setup.detect.epsilon, 1.2);
  EXPECT_EQ(setup.detect.strain, 1.05);
  EXPECT_EQ(setup.step.solver, Solver::published);
  EXPECT_EQ(setup.step.acceleration, Acceleration::none) << "of the implicit solver only";
  EXPECT_EQ(setup.step.relaxation, 0.8);
  EXPECT_EQ(setup.step.damping, 100);
  EXPECT_EQ(setup.blade.friction, 0.7);
  for (const double dt : setup.substep_length) EXPECT_EQ(dt, 250e-6);
  EXPECT_NEAR(setup.step.gravity.z * 250e-6 * 250e-6, -0.04 * 0.5, 1e-15);
  ASSERT_EQ(setup.walls.size(), 1u);
  EXPECT_EQ(setup.walls[0], (Wall{1, -1, 0.5 + 0.75, 0.2})) << "the first node rests one spacing from the grid's";
  ASSERT_EQ(setup.grips.size(), 2u);
  EXPECT_EQ(setup.grips[0].particles, (std::vector<int32_t>{0, 1}));
  EXPECT_EQ(setup.grips[1].particles, (std::vector<int32_t>{2})) << "one grip a particle";
  // One that is shared takes what another holds at other times.
  for (const auto& [from, until, shared] : {std::tuple{3, -1, true}, {3, -1, false}, {0, 1, true}, {2, -1, true}}) {
    Case next = c;
    next.grips[1].from = from;
    next.grips[1].until = until;
    next.grips[1].shared = shared;
    const bool takes = shared && (from >= 3 || until == 1);
    EXPECT_EQ(setup_of(next).grips[1].particles, takes ? (std::vector<int32_t>{1, 2}) : std::vector<int32_t>{2});
    EXPECT_EQ(from_json(to_json(next)), next);
  }
  ASSERT_EQ(setup.grips[0].active.size(), setup.blade_moves.size());
  for (std::size_t s = 0; s < setup.grips[0].active.size(); ++s) {
    EXPECT_EQ(setup.grips[0].active[s], s == 1 || s == 2) << s;
    EXPECT_EQ(setup.grips[0].displacement[s], (s == 1 || s == 2 ? Vec3{0, 0.5 / 100 * 3, 0} : Vec3{})) << s;
    EXPECT_EQ(setup.grips[1].active[s], 1) << s;
  }
  Case slow = c;
  slow.pace = 4;
  EXPECT_EQ(setup_of(slow).frame_count(), 4 * setup.frame_count());
  c.removal = Removal::strain;
  EXPECT_EQ(setup_of(c).detect.criterion, Criterion::strain);
  c.removal = Removal::geometric;
  EXPECT_EQ(setup_of(c).detect.criterion, Criterion::geometric);
}

TEST(AStroke, StandsAndTurnsAsItSays) {
  Case c;
  c.nodes = {{0, 0, 0}};
  c.strokes = {{{0, 0, 0}, {4, 0, 0}, 4, true, Link::apart}};
  Stroke& stroke = c.strokes.front();
  EXPECT_EQ(setup_of(c).blade_moves.front().from.along, (Vec3{1, 0, 0}));
  stroke.along = {0, 2, 3};  // the part along the back counts for nothing
  EXPECT_EQ(setup_of(c).blade_moves.front().from.along, (Vec3{0, 1, 0}));
  stroke.along = {0, 0, 3};  // nothing is left: another axis
  EXPECT_EQ(setup_of(c).blade_moves.front().from.along, (Vec3{1, 0, 0}));
  stroke.along = {0, 0, 0};
  stroke.tilt = {3, 0, 0};
  const BladePose tilted = setup_of(c).blade_moves.front().from;
  EXPECT_NEAR(norm(tilted.back - Vec3{0.6, 0, 0.8}), 0, 1e-15);
  EXPECT_NEAR(norm(tilted.along - Vec3{0.8, 0, -0.6}), 0, 1e-15);
  stroke.tilt = {0, 0, 0};
  stroke.turn = {0, 0, 100};  // one radian about z, half of it before the middle
  const BladeMove turning = setup_of(c).blade_moves.front();
  EXPECT_NEAR(norm(turning.from.along - Vec3{std::cos(0.5), -std::sin(0.5), 0}), 0, 1e-15);
  EXPECT_NEAR(norm(turning.to.along - Vec3{std::cos(0.5), std::sin(0.5), 0}), 0, 1e-15);

  // Run back, it goes through the same poses: a plate is the same both ways round.
  c.strokes.push_back({{}, {}, 0, true, Link::retraced});
  const cutproof::Setup there_and_back = setup_of(c);
  const BladeMove &there = there_and_back.blade_moves[0], &back = there_and_back.blade_moves[1];
  EXPECT_EQ(back.from.edge, there.to.edge);
  EXPECT_EQ(back.to.edge, there.from.edge);
  EXPECT_NEAR(std::abs(dot(back.from.along, there.to.along)), 1, 1e-15);
  EXPECT_NEAR(std::abs(dot(back.to.along, there.from.along)), 1, 1e-15);
}

// Nothing tunnels (method.md §3, Blade). Of every point of the plate, at which corners are the fastest.
TEST(AMovingCase, TakesTheBladeNowhereTooFast) {
  int64_t divided = 0, turning = 0;
  for (uint64_t seed = 0; seed < 300; ++seed) {
    const Case c = draw_moving_case(seed, 50);
    const cutproof::Setup setup = setup_of(c);
    ASSERT_EQ(std::ssize(setup.blade_moves), setup.frame_count() * setup.step.substeps);
    divided += setup.frame_count() > std::ssize(c.strokes);
    const double most = blade_clearance(setup) * (1 + 1e-9);
    const double most_turning = std::min(setup.blade.length, setup.blade.depth) / 2 * (1 + 1e-9);
    bool turns = false;
    for (const BladeMove& move : setup.blade_moves) {
      for (const BladePose& pose : {move.from, move.to}) {
        ASSERT_NEAR(norm(pose.along), 1, 1e-14);
        ASSERT_NEAR(norm(pose.back), 1, 1e-14);
        ASSERT_NEAR(dot(pose.along, pose.back), 0, 1e-14);
      }
      for (const double u : {-0.5, 0.5}) {
        for (const double w : {0.0, 1.0}) {
          const auto arm = [&](const BladePose& pose) {
            return u * setup.blade.length * pose.along + w * setup.blade.depth * pose.back;
          };
          const Vec3 by_turning = arm(move.to) - arm(move.from);
          ASSERT_LE(norm(move.to.edge - move.from.edge + by_turning), most) << "seed " << seed;
          ASSERT_LE(norm(by_turning), most_turning) << "seed " << seed;
          turns |= norm(by_turning) > 1e-9;
        }
      }
    }
    turning += turns;
  }
  EXPECT_GT(divided, 100);
  EXPECT_GT(turning, 20);
}

// An appended stroke leaves the frames before it as they are: histories rely on it.
TEST(AMovingCase, KeepsItsFramesWhenAStrokeIsAppended) {
  for (uint64_t seed = 0; seed < 60; ++seed) {
    Case c = draw_moving_case(seed, 40);
    const cutproof::Setup setup = setup_of(c);
    c.strokes.push_back(draw_stroke(seed, c));
    const cutproof::Setup longer = setup_of(c);
    // The last frame may have been filled up by a lifted blade.
    const auto same = [](const auto& few, const auto& many, std::size_t count) {
      return std::equal(few.begin(), few.begin() + static_cast<std::ptrdiff_t>(count), many.begin());
    };
    ASSERT_GE(longer.frame_count(), setup.frame_count());
    EXPECT_TRUE(same(setup.blade_moves, longer.blade_moves, setup.blade_moves.size())) << seed;
    ASSERT_EQ(setup.grips.size(), longer.grips.size());
    for (std::size_t g = 0; g < setup.grips.size(); ++g) {
      EXPECT_EQ(setup.grips[g].particles, longer.grips[g].particles);
      EXPECT_TRUE(same(setup.grips[g].active, longer.grips[g].active, setup.grips[g].active.size()));
    }
  }
}

// Each is plain in most cases and something else in a good share of them.
TEST(DrawnCases, VaryEveryFieldAndArePlainInMost) {
  const Case plain;
  constexpr int kCases = 1000;
  const auto share = [&](const std::function<bool(const Case&)>& is_special, bool moving) {
    int special = 0;
    for (uint64_t seed = 0; seed < kCases; ++seed) {
      special += is_special(moving ? draw_moving_case(seed, 40) : draw_case(seed, 40));
    }
    return special / double{kCases};
  };
  const auto some_stroke = [](auto of) {
    return [of](const Case& c) { return std::any_of(c.strokes.begin(), c.strokes.end(), of); };
  };
  for (const bool moving : {false, true}) {
    for (const auto& [what, special] : std::vector<std::pair<std::string, std::function<bool(const Case&)>>>{
             {"alpha", [&](const Case& c) { return c.alpha != plain.alpha; }},
             {"tilt", some_stroke([](const Stroke& s) { return s.tilt != Quarters{}; })},
             {"turn", some_stroke([](const Stroke& s) { return s.turn != Quarters{}; })}}) {
      const double found = share(special, moving);
      EXPECT_GT(found, 0.05) << what;
      EXPECT_LT(found, 0.5) << what;
    }
  }
  for (const auto& [what, special] : std::vector<std::pair<std::string, std::function<bool(const Case&)>>>{
           {"removal by strain", [](const Case& c) { return c.removal == Removal::strain; }},
           {"geometric removal", [](const Case& c) { return c.removal == Removal::geometric; }},
           {"one end", [](const Case& c) { return c.remove == RemovedEnds::one; }},
           {"nearer end", [](const Case& c) { return c.remove == RemovedEnds::nearer; }},
           {"epsilon", [&](const Case& c) { return c.epsilon != plain.epsilon; }},
           {"solver", [](const Case& c) { return c.solver == Solver::published; }},
           {"relaxation", [&](const Case& c) { return c.relaxation != plain.relaxation; }},
           {"damping", [&](const Case& c) { return c.damping != plain.damping; }},
           {"time_step", [&](const Case& c) { return c.time_step != plain.time_step; }},
           {"pace", [&](const Case& c) { return c.pace != plain.pace; }},
           {"blade_friction", [&](const Case& c) { return c.blade_friction != plain.blade_friction; }},
           {"gravity", [&](const Case& c) { return c.gravity != plain.gravity; }},
           {"walls", [](const Case& c) { return !c.walls.empty(); }},
           {"grips", [](const Case& c) { return !c.grips.empty(); }}}) {
    const double found = share(special, true);
    EXPECT_GT(found, 0.05) << what;
    EXPECT_LT(found, what == "gravity" ? 0.6 : 0.5) << what;  // it presses on walls and blades
    EXPECT_EQ(share(special, false), 0) << what << ", where nothing moves";
  }
}

// Every field has its plain value in the end, unless the fault needs another.
TEST(Simplest, HasPlainFieldsWhereTheFaultNeedsNoOthers) {
  const auto has_nodes = [](const Case& c) { return c.moves && !c.nodes.empty() && !c.strokes.empty(); };
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const Case c = draw_moving_case(seed, 30);
    if (!has_nodes(c)) continue;
    const Case simple = simplest(c, has_nodes, [] { return false; });
    Case expected;  // plain in every field but these
    expected.moves = true;
    expected.nodes = {{0, 0, 0}};
    expected.strokes = simple.strokes;
    for (int32_t Case::*field : {&Case::substeps, &Case::iterations, &Case::side, &Case::most, &Case::cap}) {
      expected.*field = 1;
    }
    expected.tau = 0;
    expected.merge = MergeRule::none;
    expected.expand = ExpandRule::none;
    EXPECT_EQ(to_json(simple), to_json(expected));
    for (const Stroke& stroke : simple.strokes) {
      EXPECT_EQ(stroke.tilt, Quarters{});
      EXPECT_EQ(stroke.along, Quarters{});
      EXPECT_EQ(stroke.turn, Quarters{});
    }
  }
  // And keeps what it needs.
  const auto needs = [](const Case& c) {
    return c.grips.size() == 1 && c.grips[0].until >= 0 && c.walls.size() == 1 && c.walls[0].friction > 0;
  };
  int kept = 0;
  for (uint64_t seed = 0; seed < 2000 && kept < 3; ++seed) {
    const Case c = draw_moving_case(seed, 30);
    if (!needs(c)) continue;
    ++kept;
    EXPECT_TRUE(needs(simplest(c, needs, [] { return false; })));
  }
  EXPECT_EQ(kept, 3);
}

}  // namespace
}  // namespace cutproof::property_tests::cases_test
