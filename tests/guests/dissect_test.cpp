// Whole simulators: a right one holds, and each way of being wrong is named for what it is.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "guests/questions/campaign.h"
#include "guests/questions/scenes.h"
#include "model/at.h"
#include "model/error.h"
#include "model/vec.h"

namespace cutproof::guests::dissect_test {
namespace {

const OperationDescription& dissect() { return *find_operation("dissect"); }

KernelCampaign judged(const std::string& mode, KernelCampaignOptions options) {
  Guest guest({PLUGIN_springs, mode, 20});
  return judge_kernel(guest, dissect(), promises_of(guest.plugin(), dissect(), ""), options, {});
}

PluginInfo with_limits(const std::string& words) {
  PluginInfo plugin;
  plugin.name = "a plugin";
  plugin.precision = Precision::binary64;
  plugin.limits = words;
  return plugin;
}

const Array& given(const Question& question, const char* name) { return *find_array(question.given, name); }

TEST(Dissect, ARightSimulatorHoldsInScenesOfEveryKind) {
  const KernelCampaign campaign = judged("right", {.seed = 3, .cases = 400});
  for (const KernelFailure& failure : campaign.failures) {
    ADD_FAILURE() << failure.verdict.property << ": " << failure.verdict.witness.text;
  }
  EXPECT_TRUE(campaign.holds()) << campaign.untested();
  EXPECT_EQ(campaign.refused, 0);
  EXPECT_EQ(campaign.kinds.size(), dissect().kinds().size());
  for (const KindSummary& kind : campaign.kinds) EXPECT_GT(kind.as_drawn, kind.questions / 4) << kind.kind;
  for (const char* const property :
       {"no coupling across pieces", "pieces coupled within", "linear momentum", "centre of mass", "angular momentum",
        "no teleport", "run as asked", "velocities as asked", "what is held stays", "determinism", "no ghost force",
        "mirrored run"}) {
    const auto& all = campaign.properties.all();
    const auto found = std::find_if(all.begin(), all.end(), [&](const auto& p) { return p.property == property; });
    ASSERT_NE(found, all.end()) << property;
    EXPECT_GT(found->judged, 50) << property;
  }
}

TEST(Dissect, EachFaultFailsThePropertyThatIsNamed) {
  const std::pair<const char*, const char*> faults[] = {{"heals", "no coupling across pieces"},
                                                        {"uncut", "no coupling across pieces"},
                                                        {"elsewhere", "pieces coupled within"},
                                                        {"nothing_left", "pieces coupled within"},
                                                        {"momentum", "linear momentum"},
                                                        {"weightless", "linear momentum"},
                                                        {"drops", "what is held stays"},
                                                        {"beside", "run as asked"},
                                                        {"short", "run as asked"},
                                                        {"offsets", "run as asked"},
                                                        {"index", "run well formed"},
                                                        {"last_bit", "determinism"},
                                                        {"unkicked", "the kick was felt"},
                                                        {"global", "no ghost force"},
                                                        {"handed", "mirrored run"}};
  for (const auto& [mode, property] : faults) {
    const KernelCampaign campaign = judged(mode, {.cases = 40, .simplify = 0});
    const bool is_found = std::any_of(campaign.failures.begin(), campaign.failures.end(),
                                      [&](const KernelFailure& f) { return f.verdict.property == property; });
    EXPECT_TRUE(is_found) << mode;
    EXPECT_FALSE(campaign.holds()) << mode;
  }
}

TEST(Dissect, AFailureIsShrunkSavedAndFailsAgain) {
  for (const char* const mode : {"heals", "elsewhere", "momentum", "drops"}) {
    SCOPED_TRACE(mode);
    Guest guest({PLUGIN_springs, mode, 20});
    const harness::Promises promises = promises_of(guest.plugin(), dissect(), "");
    const KernelCampaign campaign = judge_kernel(guest, dissect(), promises, {.seed = 2, .cases = 40}, {});
    ASSERT_FALSE(campaign.failures.empty());
    for (const KernelFailure& failure : campaign.failures) {
      EXPECT_EQ(failure.of_simplest.property, failure.verdict.property);
      EXPECT_LE(given(failure.simplest, "blades").integer(0), 1);
      EXPECT_LE(given(failure.simplest, "rest").rows(), 8) << failure.verdict.property;
      SavedQuestion saved;
      saved.operation = "dissect";
      saved.question = failure.simplest;
      saved.precision = Precision::binary64;
      const SavedQuestion read = question_from_json(to_json(saved), "a file");
      EXPECT_EQ(to_json(read), to_json(saved));
      bool fails = false;
      for (const Verdict& verdict : judge_answer(guest, dissect(), question_of(read), failure.at_end, false)) {
        fails |= !verdict.holds && verdict.property == failure.verdict.property;
      }
      EXPECT_TRUE(fails);
    }
  }
}

// Not that it cannot run here, which would be skipped.
TEST(Dissect, ParametersThatThePluginRefusesAreAnError) {
  try {
    const Guest guest({PLUGIN_springs, "stiff", 20});
    ADD_FAILURE() << "it has taken them";
  } catch (const InputError& error) {
    EXPECT_EQ(error.field(), "parameters");
    EXPECT_EQ(error.problem(), "there is no parameter 'stiff'");
  }
}

TEST(Dissect, ASimplerSceneLeavesOutAStrokeAndKeepsTheOther) {
  const Question two = dissect().draw_for(3, 5, with_limits(""));
  ASSERT_EQ(given(two, "blades").integer(0), 2);
  const auto both = given(two, "blade").of<double>();
  for (const std::size_t gone : {0u, 1u}) {
    const Question one = dissect().simpler(two)[gone];
    EXPECT_EQ(given(one, "blades").integer(0), 1);
    const auto left = given(one, "blade").of<double>();
    ASSERT_EQ(2 * left.size(), both.size());
    for (std::size_t k = 0; k < left.size(); ++k) {
      const double wanted = both[24 * (k / 12) + 12 * (1 - gone) + k % 12];
      EXPECT_TRUE(left[k] == wanted || (std::isnan(left[k]) && std::isnan(wanted))) << k;
    }
  }
}

TEST(Dissect, TellsWhereTwoRunsPart) {
  const KernelCampaign campaign = judged("last_bit", {.cases = 10, .simplify = 0});
  ASSERT_FALSE(campaign.failures.empty());
  const std::string& text = campaign.failures.front().verdict.witness.text;
  EXPECT_TRUE(text.starts_with("run again, particle ")) << text;
  const int64_t last = given(campaign.failures.front().simplest, "blade").rows() /
                           given(campaign.failures.front().simplest, "blades").integer(0) -
                       1;
  EXPECT_TRUE(text.ends_with("in frame " + std::to_string(last))) << text;
}

// An answer of the right simulator, and what the judge says once an array is another one.
struct Changed {
  explicit Changed(Question asked) : question(std::move(asked)) {
    Guest guest({PLUGIN_springs, "right", 20});
    answers = ask(guest, dissect(), question, true).arrays;
  }
  void set(Array array) {
    const auto known = std::ranges::find(answers, array.name, &Array::name);
    ASSERT_NE(known, answers.end()) << array.name;
    *known = std::move(array);
  }
  Verdict verdict(std::string_view property) const {
    for (const Verdict& verdict : dissect().judge(question, answers, Precision::binary64)) {
      if (verdict.property == property) return verdict;
    }
    ADD_FAILURE() << property;
    return {};
  }
  Question question;
  Arrays answers;
};

Question with_held() {
  for (int64_t index = 0;; ++index) {
    Question question = dissect().draw_for(3, index, with_limits(""));
    if (given(question, "held").integer(0) != 0) return question;
  }
}

TEST(Dissect, WhatIsHeldStaysWhileItExists) {
  Changed changed(with_held());
  const Array& position = *find_array(changed.answers, "run/position");
  const int64_t rows = position.rows(), n = given(changed.question, "rest").rows();
  std::vector<double> places(position.of<double>().begin(), position.of<double>().end());
  std::vector<uint8_t> alive(at(rows), 1);
  for (int64_t row = 3 * n; row < rows; row += n) places[at(3 * row)] += 1;  // of particle 0, from frame 3 on
  changed.set(make_array("run/position", {rows, 3}, places));
  EXPECT_FALSE(changed.verdict("what is held stays").holds);
  for (int64_t row = 3 * n; row < rows; row += n) alive[at(row)] = 0;
  changed.set(make_array("run/alive", {rows}, alive));
  EXPECT_TRUE(changed.verdict("what is held stays").holds);
}

TEST(Dissect, NothingIsWorseThanAVelocityThatIsNoNumber) {
  Changed changed(dissect().draw_for(3, 0, with_limits("no_grips")));
  const Array& velocity = *find_array(changed.answers, "run/velocity");
  std::vector<double> values(velocity.of<double>().begin(), velocity.of<double>().end());
  values[0] = std::nan(""), values[3] = 1e9;
  changed.set(make_array("run/velocity", {velocity.rows(), 3}, values));
  const Verdict verdict = changed.verdict("velocities as asked");
  EXPECT_FALSE(verdict.holds);
  EXPECT_TRUE(std::isnan(verdict.measured)) << verdict.measured;
  EXPECT_EQ(verdict.witness.particles, std::vector<int32_t>{0});
}

TEST(Dissect, AnswersThatContradictThemselvesAreRefused) {
  const auto said = [](const Changed& changed) { return changed.verdict("run as asked").witness.text; };
  const Question question = dissect().draw_for(3, 0, with_limits(""));
  Changed cells(question), weights(question), negative(question);
  cells.set(make_array("run/tetrahedra", {1, 4}, std::vector<int32_t>{0, 1, 2, 3}));
  cells.set(make_array("run/hexahedra", {1, 8}, std::vector<int32_t>{0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_NE(said(cells).find("are both given"), std::string::npos) << said(cells);
  weights.set(make_array("run/weights", {1}, std::vector<double>{1}));
  weights.set(make_array("run/group_count", {0}, std::vector<int32_t>{}));
  EXPECT_NE(said(weights).find("no groups are"), std::string::npos) << said(weights);
  const int64_t frames = given(question, "blade").rows() / given(question, "blades").integer(0);
  negative.set(make_array("run/particles", {frames}, std::vector<int32_t>(at(frames), -1)));
  EXPECT_FALSE(said(negative).empty());
  EXPECT_EQ(dissect().difference(question, negative.answers, Changed(question).answers), "");
}

TEST(Dissect, AMirroredRunThatCannotBeReadFails) {
  PluginInfo plugin = with_limits("");
  plugin.promises = "mirror";
  Guest guest({PLUGIN_springs, "right", 20});
  bool is_spoilt = false;
  const AskBeside beside = [&](const Question& next) -> std::optional<Arrays> {
    Arrays answers = ask(guest, dissect(), next, true).arrays;
    if (is_spoilt)
      *std::ranges::find(answers, "run/steps", &Array::name) = make_array("run/steps", {1}, std::vector<int64_t>{0});
    return answers;
  };
  int64_t judged = 0;
  for (int64_t index = 0; index < 10; ++index) {
    const Question question = dissect().draw_for(3, index, plugin);
    const Arrays answers = ask(guest, dissect(), question, true).arrays;
    const auto verdicts = [&] { return dissect().judge_beside(question, answers, Precision::binary64, beside); };
    is_spoilt = false;
    const std::vector<Verdict> right = verdicts();
    ASSERT_EQ(right.size(), 1U);
    EXPECT_TRUE(right[0].holds) << right[0].witness.text;
    if (right[0].checked == 0) continue;
    ++judged;
    is_spoilt = true;
    EXPECT_FALSE(verdicts().at(0).holds);
  }
  EXPECT_GT(judged, 3);
}

// A bar of 5 × 2 × 2 that flies along itself and breathes across. The blade splits it lengthwise in two frames; the
// first sweep ends so many spacings from the bar's end.
Question split_bar(double speed, double first_end, const PluginInfo& plugin, double spacing = 0x1p-7) {
  scenes::Scene scene;
  scene.h = spacing;
  scene.nodes = {5, 2, 2};
  scene.frames = 5;
  scene.frame_time = 0x1p-7;
  scene.blades = 1;
  for (int32_t i = 0; i < 20; ++i) {
    const std::array<int32_t, 3> node = {i % 5, i / 5 % 2, i / 10};
    scene.node.insert(scene.node.end(), node.begin(), node.end());
    scene.rest.push_back(scene.h * Vec3{double(node[0]), double(node[1]), double(node[2])});
    scene.velocity.push_back({speed, 2 * (scene.rest.back().y - 0.5 * scene.h), 0});
    if (node[0] < 4) scene.edges.push_back({i, i + 1});
    if (node[1] < 1) scene.edges.push_back({i, i + 5});
    if (node[2] < 1) scene.edges.push_back({i, i + 10});
  }
  scene.mass.assign(20, 1e-4);
  scene.held.assign(20, 0);
  scene.kick.assign(20, {});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  scene.blade.assign(at(4 * scene.frames), {nan, nan, nan});
  for (int f = 1; f <= 2; ++f) {
    const double from = f == 1 ? -1.5 : first_end - 0.5, to = f == 1 ? first_end : 5.5;
    for (int c = 0; c < 4; ++c) {
      const Vec3 corner = scene.h * Vec3{c < 2 ? from : to, 0.4, c == 0 || c == 3 ? 2.5 : -1.5};
      scene.blade[at(4 * f + c)] = corner + Vec3{f * scene.frame_time * speed, 0, 0};
    }
  }
  scenes::add_cells(scene);
  return scenes::question_of(scene, "cut through", plugin);
}

// Rounding decides in which frame an edge is cut on which a sweep ends, and the mirrored run rounds differently.
TEST(Dissect, AMirrorAsksNothingThatRoundingDecides) {
  PluginInfo plugin = with_limits("");
  plugin.promises = "mirror";
  Guest guest({PLUGIN_springs, "right", 20});
  const AskBeside beside = [&](const Question& next) -> std::optional<Arrays> {
    return ask(guest, dissect(), next, true).arrays;
  };
  for (int k = 1; k <= 4; ++k) {
    for (const double first_end : {1.0, 1.4}) {
      const Question question = split_bar(0.1 * k, first_end, plugin);
      const Arrays answers = ask(guest, dissect(), question, true).arrays;
      const std::vector<Verdict> verdicts = dissect().judge_beside(question, answers, Precision::binary64, beside);
      ASSERT_EQ(verdicts.size(), 1U);
      EXPECT_TRUE(verdicts[0].holds) << k << ": " << verdicts[0].witness.text;
      EXPECT_EQ(verdicts[0].checked > 0, first_end > 1) << k;
    }
  }
}

// As a contact does, the simulator amplifies what rounds: the mirrored run rounds otherwise, and so do disturbed ones.
TEST(Dissect, AMirrorAllowsForRoundingThatTheSimulatorAmplifies) {
  PluginInfo plugin = with_limits("");
  plugin.promises = "mirror";
  Guest guest({PLUGIN_springs, "right", 20});
  double handed = 0;  // [m] by which every place is to one side, also in the mirror
  const AskBeside ask_it = [&](const Question& next) -> std::optional<Arrays> {
    Arrays answers = ask(guest, dissect(), next, true).arrays;
    const std::vector<Vec3> rest = scenes::vectors_of(given(next, "rest"));
    Array& places = *std::ranges::find(answers, "run/position", &Array::name);
    std::vector<Vec3> moved = scenes::vectors_of(places);
    for (std::size_t k = rest.size(); k < moved.size(); ++k) {
      const double x = rest[k % rest.size()].x;
      moved[k].x += handed + 1e5 * ((x + 1) - 1 - x);
    }
    places = make_array(places.name, places.shape, scenes::numbers_of(moved));
    return answers;
  };
  const Question question = split_bar(0.1, 1.4, plugin, 0.0123);
  for (const double by : {0.0, 1e-8}) {
    handed = by;
    const Arrays answers = *ask_it(question);
    const std::vector<Verdict> verdicts = dissect().judge_beside(question, answers, Precision::binary64, ask_it);
    ASSERT_EQ(verdicts.size(), 1U);
    EXPECT_GT(verdicts[0].checked, 0);
    EXPECT_EQ(verdicts[0].holds, by == 0) << verdicts[0].witness.text;
  }
}

TEST(Dissect, WhereNearlyEverythingIsRefusedNothingIsKnown) {
  EXPECT_EQ(judged("refuse", {.cases = 20}).untested(), "all 20 questions were refused");
  const KernelCampaign most = judged("refuse_most", {.cases = 100});
  EXPECT_EQ(most.failed, 0);
  EXPECT_GT(most.questions, most.refused);
  EXPECT_FALSE(most.holds());
  EXPECT_NE(most.untested().find("questions were refused"), std::string::npos) << most.untested();
}

TEST(Dissect, AKindOfWhichNoSceneIsOneIsNotTested) {
  const auto kind = [](const char* name, int64_t questions, int64_t as_drawn) {
    KindSummary summary;
    summary.kind = name;
    summary.questions = questions;
    summary.as_drawn = as_drawn;
    return summary;
  };
  KernelCampaign campaign;
  campaign.operation = &dissect();
  campaign.questions = 30;
  campaign.kinds = {kind("cut through", 20, 1), kind("curved cut", 10, 0)};
  EXPECT_EQ(campaign.untested(), "none of 10 scenes of the kind 'curved cut' was one");
  campaign.kinds.back().as_drawn = 1;
  EXPECT_TRUE(campaign.holds());
  campaign.kinds = {kind("cut through", 9, 0), kind("beside the tissue", 9, 9), kind("along the grid", 9, 9)};
  EXPECT_EQ(campaign.untested(), "in none of 30 scenes was the tissue cut as drawn");
}

TEST(Dissect, ScenesAreWithinTheLimits) {
  const auto count = [](const Question& question, const auto& is_one) {
    int64_t most = 0;
    const int64_t blades = given(question, "blades").integer(0), frames = given(question, "blade").rows() / blades;
    for (int64_t f = 0; f < frames; ++f) {
      int64_t here = 0;
      for (int64_t b = 0; b < blades; ++b) here += is_one(given(question, "blade").number(12 * (f * blades + b)));
      most = std::max(most, here);
    }
    return most;
  };
  const auto is_there = [](double x) { return std::isfinite(x); };
  int64_t held = 0, at_once = 0, smallest = 100, diagonals = 0;
  for (int64_t index = 0; index < 300; ++index) {
    const Question free = dissect().draw_for(9, index, with_limits(""));
    EXPECT_LE(given(free, "rest").rows(), 60);
    EXPECT_LE(given(free, "blade").rows() / given(free, "blades").integer(0), 12);
    held += std::ranges::count(given(free, "held").of<uint8_t>(), 1);
    at_once = std::max(at_once, count(free, is_there));
    smallest = std::min(smallest, given(free, "rest").rows());
    EXPECT_GE(count(free, is_there), 1) << free.kind;

    const Question limited =
        dissect().draw_for(9, index, with_limits("particles=30 cells one_blade no_grips cut_resolution=0.5"));
    const auto corners = given(limited, "tetrahedra").of<int32_t>();
    EXPECT_LE(given(limited, "rest").rows(), 30);
    EXPECT_EQ(std::set<int32_t>(corners.begin(), corners.end()).size(), at(given(limited, "rest").rows()));
    EXPECT_EQ(std::ranges::count(given(limited, "held").of<uint8_t>(), 1), 0);
    EXPECT_EQ(count(limited, is_there), 1) << limited.kind;
    EXPECT_EQ(find_array(limited.known, "cut_resolution")->number(0), 0.5 * given(limited, "spacing").number(0));

    const Question more = dissect().draw_for(9, index, with_limits("diagonals"));
    diagonals += given(more, "edge_ends").rows() > given(free, "edge_ends").rows();
  }
  EXPECT_GT(held, 100);
  EXPECT_EQ(at_once, 2);
  EXPECT_LE(smallest, 4);
  EXPECT_GT(diagonals, 200);
  for (const char* const wrong : {"one_knife", "particles", "particles=7", "gap=x", "gap=1x", "cells=1"}) {
    EXPECT_THROW(dissect().draw_for(1, 0, with_limits(wrong)), InputError) << wrong;
  }
  // Two flat strokes side by side, in a frame that has both.
  int64_t measured = 0;
  for (int64_t index = 5; index < 300; index += 10) {
    const Question apart = dissect().draw_for(9, index, with_limits("gap=3"));
    ASSERT_EQ(apart.kind, "thin remains");
    const auto blade = given(apart, "blade").of<double>();
    for (std::size_t k = 0; k < blade.size(); k += 24) {
      const auto corner = [&](std::size_t c) {
        return Vec3{blade[k + 3 * c], blade[k + 3 * c + 1], blade[k + 3 * c + 2]};
      };
      if (!is_there(blade[k]) || !is_there(blade[k + 12])) continue;
      const Vec3 normal = cross(corner(1) - corner(0), corner(2) - corner(0));
      const double distance = std::abs(dot(corner(4) - corner(0), normal)) / norm(normal);
      EXPECT_NEAR(distance, 3 * given(apart, "spacing").number(0), 1e-9);
      ++measured;
    }
  }
  EXPECT_GT(measured, 10);
  Guest guest({PLUGIN_springs_of_another_limit, "", 20});
  try {
    judge_kernel(guest, dissect(), promises_of(guest.plugin(), dissect(), ""), {.cases = 1}, {});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("there is no limit 'one_knife'"), std::string::npos) << error.what();
  }
}

TEST(Dissect, CellsThatMeetInANodeOrAnEdgeAloneAreNotAskedFor) {
  EXPECT_TRUE(scenes::is_joined_by_faces({}));
  EXPECT_TRUE(scenes::is_joined_by_faces({0, 1, 2, 3, 3, 1, 2, 4, 5, 6, 7, 8}));
  EXPECT_FALSE(scenes::is_joined_by_faces({0, 1, 2, 3, 3, 4, 5, 6}));
  EXPECT_FALSE(scenes::is_joined_by_faces({2, 3, 4, 5, 2, 3, 6, 7}));
  for (uint64_t seed = 11; seed < 15; ++seed) {
    for (int64_t index = 0; index < 100; ++index) {
      const Question question = dissect().draw_for(seed, index, with_limits("cells"));
      EXPECT_TRUE(scenes::is_joined_by_faces(scenes::scene_of(question.given).tetrahedra)) << seed << ' ' << index;
    }
  }
}

// Of cells all are positive, whichever way they are counted.
TEST(Dissect, CellsOfAGridHaveAPositiveVolume) {
  for (int64_t index = 0; index < 20; ++index) {
    const Question question = dissect().draw_for(4, index, with_limits("cells"));
    const auto rest = given(question, "rest").of<double>();
    const auto place = [&](int32_t i) { return Vec3{rest[3 * at(i)], rest[3 * at(i) + 1], rest[3 * at(i) + 2]}; };
    const double h = given(question, "spacing").number(0);
    const auto tetrahedra = given(question, "tetrahedra").of<int32_t>();
    ASSERT_FALSE(tetrahedra.empty());
    EXPECT_EQ(tetrahedra.size() / 24, given(question, "hexahedra").of<int32_t>().size() / 8);
    for (std::size_t k = 0; k < tetrahedra.size(); k += 4) {
      const Vec3 a = place(tetrahedra[k]);
      const double volume =
          dot(place(tetrahedra[k + 1]) - a, cross(place(tetrahedra[k + 2]) - a, place(tetrahedra[k + 3]) - a)) / 6;
      EXPECT_NEAR(volume, h * h * h / 6, 1e-9 * h * h * h);
    }
  }
}

}  // namespace
}  // namespace cutproof::guests::dissect_test
