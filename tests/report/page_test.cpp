// Which moments, particles and verdicts a page shows, and what is left out of it.
#include "report/page.h"

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "model/error.h"
#include "report/assets.h"
#include "report/beside.h"
#include "report/changes.h"
#include "report/document_page.h"
#include "report/pieces.h"
#include "tests/report/made_run.h"

namespace cutproof::report::page_test {
namespace {

using nlohmann::json;

json verdict(const std::string& property, const std::string& stage, int64_t frame, bool holds, double measured,
             double bound) {
  json one = {{"property", property},
              {"stage", stage},
              {"backend", "mine"},
              {"frame", frame},
              {"body", 0},
              {"holds", holds},
              {"measured", measured},
              {"bound", bound},
              {"unit", "h"},
              {"bound_source", "some page"},
              {"checked", 3}};
  if (!holds) one["witness"] = {{"text", "here"}, {"clusters", {7}}, {"particles", {3, 999'999}}, {"path", {4}}};
  return one;
}

json document(const std::vector<json>& verdicts) {
  json properties = json::array();
  for (const json& one : verdicts) {
    if (!one.at("property").get<std::string>().starts_with("expected"))
      properties.push_back({{"property", one.at("property")}, {"stage", one.at("stage")}});
  }
  return {{"format", "cutproof.run"},
          {"format_version", 2},
          {"cutproof", "1"},
          {"scene", "block"},
          {"backend", "mine"},
          {"checked", true},
          {"frames", json::array()},
          {"verdicts", verdicts},
          {"properties", properties},
          {"summary", {{"holds", true}}},
          {"body", {{"particles", 27}}}};
}

// --- Results ---

TEST(Results, PutWhatFailsFirstAndThenTheNearestToItsBound) {
  const Results results = results_of(
      document({verdict("far", "step", 0, true, 0.1, 1), verdict("near", "step", 0, true, 0.5, 1),
                verdict("near", "step", 4, true, 0.9, 1), verdict("wrong", "split", 9, false, 2, 1),
                verdict("wrong", "split", 3, false, 3, 1), verdict("expected pieces", "skin", 9, true, 4, 4)}),
      "results.json");
  std::vector<std::string> order;
  for (const PropertyRow& row : results.rows) order.push_back(row.property);
  EXPECT_EQ(order, (std::vector<std::string>{"wrong", "near", "far", "expected pieces"}));
  EXPECT_EQ(results.rows[1].frame, 4);
  EXPECT_EQ(results.rows[1].of_bound, 0.9);
  EXPECT_EQ(results.rows[3].of_bound, std::nullopt) << "what is to be met is no room that is left";
  ASSERT_EQ(results.findings.size(), 2u);
  EXPECT_EQ(results.findings[0].frame, 3);
  EXPECT_FALSE(results.holds);
  EXPECT_EQ(summary_sentence(results),
            "cutproof ran scene block on backend mine: 2 of 3 properties hold, and the one expectation of the scene is "
            "met; 'wrong' fails in frame 3 after split.");
}

TEST(Results, OfARunThatHoldsAndOfOneThatWasNotJudgedSaySo) {
  json holds = document({verdict("near", "step", 0, true, 0.5, 1)});
  EXPECT_EQ(summary_sentence(results_of(holds, "f")),
            "cutproof ran scene block on backend mine: the one property that was judged holds, in 1 verdict.");
  holds["checked"] = false;
  EXPECT_EQ(summary_sentence(results_of(holds, "f")), "cutproof ran scene block on backend mine. Nothing was judged.");
}

// Each as its command writes it.
TEST(Results, OfStatesKicksAndRelationsSayWhatWasJudgedAndWhereToLook) {
  const auto made = [](const char* format, json more) {
    json one = {{"format", format},
                {"cutproof", "1"},
                {"verdicts",
                 {verdict("finite", "skin", 0, true, 0, 0), verdict("something was judged", "skin", 0, true, 1, 2)}},
                {"summary", {{"holds", true}}},
                {"notes", {"a note"}}};
    one.update(more);
    return results_of(one, "f");
  };
  const Results state =
      made("cutproof.check_state", {{"source", "a.npz"},
                                    {"body", {{"particles", 6}, {"pieces", 2}}},
                                    {"not_judged", {{{"property", "motion"}, {"why", "one state"}}}}});
  EXPECT_EQ(summary_sentence(state),
            "cutproof judged the state a.npz: the one property that was judged holds, in 2 verdicts. Its tissue is 2 "
            "pieces.");
  EXPECT_EQ(state.rows.back().vacuous, "one state");
  for (const PropertyRow& row : state.rows) EXPECT_EQ(row.of_bound, std::nullopt) << row.property;
  const Results kick =
      made("cutproof.kick", {{"source", "k.npz"},
                             {"particles", 6},
                             {"kicks", {{{"kick_frame", 4}, {"pieces", {{{"piece", 0}}, {{"piece", 1}}}}}}}});
  EXPECT_EQ(kick.opens, 4);
  EXPECT_EQ(kick.pieces, "Its tissue is 2 pieces.");
  EXPECT_TRUE(kick.is_foreign());
  const Results relate =
      made("cutproof.relate",
           {{"sources", {"a.h5", "b.h5"}}, {"map", "units:4,1,1"}, {"particles", 6}, {"sharpest", {{"frame", 3}}}});
  EXPECT_EQ(relate.scene, "a.h5 and b.h5 (units:4,1,1)");
  EXPECT_EQ(relate.opens, 3);
  EXPECT_EQ(
      made("cutproof.relate", {{"sources", json::array()}, {"map", "same"}, {"particles", 6}, {"sharpest", nullptr}})
          .opens,
      -1);
}

// Nor does what fails hold because its summary says so.
TEST(Results, OfWhichNothingWasLookedAtOrWhoseSummaryFailsDoNotHold) {
  const json good = verdict("near", "step", 0, true, 0.5, 1);
  EXPECT_TRUE(results_of(document({good}), "f").holds);
  json vacuous = good;
  vacuous["checked"] = 0;
  EXPECT_FALSE(results_of(document({vacuous}), "f").holds);
  EXPECT_FALSE(results_of(document({}), "f").holds);
  EXPECT_FALSE(results_of(document({good, verdict("wrong", "split", 3, false, 3, 1)}), "f").holds);
  json failing = document({good});
  failing["summary"]["holds"] = false;
  EXPECT_FALSE(results_of(failing, "f").holds);
  EXPECT_EQ(summary_sentence(results_of(failing, "f")),
            "cutproof ran scene block on backend mine. It does not hold: nothing was judged, or not all of it.");
}

// As on a terminal: not each pair of a property and a stage.
TEST(Results, CountEachPropertyOnceAfterHoweverManyStages) {
  std::vector<json> verdicts = {verdict("near", "step", 0, true, 0.5, 1), verdict("near", "split", 0, true, 0.5, 1),
                                verdict("far", "split", 0, true, 0.1, 1),
                                verdict("expected pieces", "skin", 9, true, 4, 4),
                                verdict("expected shells", "skin", 9, true, 4, 4)};
  EXPECT_EQ(summary_sentence(results_of(document(verdicts), "f")),
            "cutproof ran scene block on backend mine: all 2 properties that were judged hold, and all 2 expectations "
            "of the scene are met, in 5 verdicts.");
  verdicts.push_back(verdict("near", "merge", 0, false, 2, 1));
  verdicts.push_back(verdict("wrong", "merge", 0, false, 2, 1));
  verdicts.back()["expected_failure"] = true;
  EXPECT_EQ(summary_sentence(results_of(document(verdicts), "f")),
            "cutproof ran scene block on backend mine: 1 of 3 properties holds, and 1 fails as the scene expects, and "
            "all 2 expectations of the scene are met; 'near' fails in frame 0 after merge.");
}

// A page opens at the first finding: of one moment at one that marks something.
TEST(Results, BeginOfOneMomentWithWhatNamesAPlace) {
  json nowhere = verdict("equal answers", "skin", 9, false, 2, 1);
  nowhere["witness"] = {
      {"text", "two differ"}, {"clusters", json::array()}, {"particles", json::array()}, {"path", json::array()}};
  const Results results = results_of(document({nowhere, verdict("no ghost force", "skin", 9, false, 2, 1)}), "f");
  EXPECT_EQ(results.findings.at(0).property, "no ghost force");
  EXPECT_EQ(results.findings.at(1).property, "equal answers");
}

TEST(Results, BeginWithWhatFailsFirst) {
  const Results results =
      results_of(document({verdict("momentum", "step", 0, true, 0.1, 1), verdict("exactness", "split", 0, false, 2, 1),
                           verdict("earlier", "detect", 0, false, 2, 1), verdict("momentum", "step", 1, false, 2, 1)}),
                 "f");
  std::vector<std::string> order;
  for (const PropertyRow& row : results.rows) order.push_back(row.property);
  EXPECT_EQ(order, (std::vector<std::string>{"earlier", "exactness", "momentum"}));
}

// Of one property after one stage: sums over all frames, and of the verdict that is shown its own figures.
TEST(Results, AddUpWhatVerdictsOfOnePropertyLookedAtAndLeftOpen) {
  std::vector<json> verdicts = {verdict("near", "step", 0, true, 0.9, 1), verdict("near", "step", 1, true, 0.5, 1),
                                verdict("near", "step", 2, true, 0, 0)};
  verdicts[0]["inconclusive"] = 2;
  verdicts[1]["inconclusive"] = 1;
  verdicts[2]["checked"] = 0;
  verdicts[2]["nothing_judged"] = "nothing is alive";
  const Results results = results_of(document(verdicts), "f");
  ASSERT_EQ(results.rows.size(), 1u);
  const PropertyRow& row = results.rows.front();
  EXPECT_EQ(row.checked, 6);
  EXPECT_EQ(row.judged, 2) << "one looked at nothing";
  EXPECT_EQ(row.inconclusive, 3);
  EXPECT_EQ(row.vacuous, "") << "others looked";
  EXPECT_EQ(row.frame, 0);
  EXPECT_EQ(results.verdicts, 3);
}

// Failures of several properties: the first ones by frame, and how many are left out.
TEST(Results, KeepTheFirstFailuresOfAllPropertiesAndCountTheOthers) {
  std::vector<json> verdicts;
  for (int property = 0; property < 20; ++property) {
    for (int frame = 0; frame < 20; ++frame) {
      verdicts.push_back(verdict("wrong " + std::to_string(property), "split", frame, false, 2, 1));
    }
  }
  const Results results = results_of(document(verdicts), "f");
  EXPECT_EQ(results.findings.size(), kMostFindings);
  EXPECT_EQ(results.findings_left_out, 400 - std::ssize(results.findings));
  EXPECT_EQ(results.findings.back().frame, 14) << "the earliest are kept";
}

TEST(Results, SayWhichStagesWereLeftToTheReference) {
  json split = document({verdict("exactness", "split", 0, true, 0.5, 1)});
  split["left_to_reference"] = {{"stages", {"step", "detect", "skin"}}, {"expected", {"shells at the end"}}};
  split["notes"] = {"The reference ran step, detect and skin for the backend: not judged."};
  const Results results = results_of(split, "f");
  EXPECT_EQ(summary_sentence(results),
            "cutproof ran scene block on backend mine: the one property that was judged holds, in 1 verdict. The "
            "reference ran step, detect and skin for the backend: not judged.");
  ASSERT_EQ(results.notes.size(), 2u);
  EXPECT_NE(results.notes[1].find("shells at the end"), std::string::npos);
}

TEST(Results, HaveNoFiguresOfWhatCouldNotBeJudged) {
  json open = verdict("geometry", "skin", 3, false, 0, 0);
  open["witness"]["text"] = "could not be judged: it is open";
  const Results results = results_of(document({open}), "f");
  EXPECT_FALSE(results.holds);
  EXPECT_EQ(results.rows.at(0).measured, "nothing");
  EXPECT_EQ(results.findings.at(0).measured, "nothing");
  EXPECT_EQ(results.findings.at(0).bound, "none");
  EXPECT_EQ(results.findings.at(0).unit, "");
}

TEST(Results, ThatAreExpectedToFailDoNotCount) {
  json expected = verdict("isolation", "skin", 2, false, 2, 0);
  expected["expected_failure"] = true;
  const Results results = results_of(document({expected, verdict("near", "step", 0, true, 0.5, 1)}), "f");
  EXPECT_TRUE(results.holds);
  EXPECT_TRUE(results.findings.at(0).is_expected);
}

TEST(Results, KeepSoManyFailuresOfOnePropertyAndCountTheOthers) {
  std::vector<json> verdicts;
  for (int frame = 0; frame < 100; ++frame) verdicts.push_back(verdict("wrong", "split", frame, false, 2, 1));
  const Results results = results_of(document(verdicts), "f");
  EXPECT_EQ(std::ssize(results.findings), kMostFindingsOfOne);
  EXPECT_EQ(results.findings_left_out, 100 - kMostFindingsOfOne);
  EXPECT_EQ(results.rows.at(0).failed, 100);
}

TEST(Results, ThatAreNoneAreRefusedByFieldWithARemedy) {
  const json good = document({verdict("wrong", "split", 3, false, 3, 1)});
  const auto refused = [&](const std::string& pointer, const json& value, const std::string& field) {
    json bad = good;
    bad[json::json_pointer(pointer)] = value;
    try {
      results_of(bad, "results.json");
      ADD_FAILURE() << pointer << " was read";
    } catch (const InputError& error) {
      EXPECT_EQ(error.file(), "results.json");
      EXPECT_EQ(error.field(), field);
      EXPECT_NE(std::string(error.what()).find("remedy"), std::string::npos) << error.what();
    }
  };
  refused("/format", "cutproof.bench", "format");
  refused("/format_version", 3, "format_version");
  refused("/scene", 5, "scene");
  refused("/verdicts", "none", "verdicts");
  refused("/verdicts/0/stage", "boil", "verdicts[0].stage");
  refused("/verdicts/0/holds", 1, "verdicts[0].holds");
  refused("/verdicts/0/frame", -1, "verdicts[0].frame");
  refused("/verdicts/0/measured", "much", "verdicts[0].measured");
  refused("/verdicts/0/witness", nullptr, "verdicts[0].witness");
  refused("/verdicts/0/witness/particles", {1.5}, "verdicts[0].witness.particles[0]");
  refused("/body/particles", nullptr, "body.particles");
  refused("/summary", json::object(), "summary.holds");
  // Of what is not there at all.
  for (const char* const field : {"body", "summary", "verdicts", "frames", "scene"}) {
    json bad = good;
    bad.erase(field);
    try {
      results_of(bad, "results.json");
      ADD_FAILURE() << field << " is not there";
    } catch (const InputError& error) {
      EXPECT_EQ(error.field().rfind(field, 0), 0u) << error.what();
    }
  }
}

// --- Pieces ---

TEST(Pieces, AreNumberedByTheirSize) {
  const auto setup = block(3);
  std::vector<uint8_t> alive(27, 1);
  for (std::size_t i = 0; i < 27; ++i) alive[i] = i / 9 == 1 ? 0 : 1;  // the middle layer is gone
  alive[0] = 0;                                                        // so the upper one is larger
  const Pieces pieces = pieces_of(setup.body, alive);
  EXPECT_EQ(pieces.count, 2);
  EXPECT_EQ(pieces.of[0], -1);
  EXPECT_EQ(pieces.of[1], 1);
  EXPECT_EQ(pieces.of[26], 0);
}

TEST(Holders, OfBrokenClustersReadNothingThatIsNotThere) {
  Clusters clusters;
  clusters.offsets = {0, 2, 1, 99, -3};
  clusters.members = {1, 2, 77, -5};
  clusters.number = {4, 5, 6, 7};
  const Holders holders = holders_of(clusters, 3);
  EXPECT_EQ(holders.lowest, (std::vector<int32_t>{-1, 1, 1}));
  EXPECT_EQ(holders.count, (std::vector<uint8_t>{0, 1, 1}));
  EXPECT_EQ(members_of(clusters, 4, 3), (std::vector<int32_t>{1, 2}));
  for (const int32_t number : {5, 6, 7, 8}) EXPECT_TRUE(members_of(clusters, number, 3).empty()) << number;
}

TEST(Pieces, OfWhatIsCoupledAreJoinedByWhatIsAlive) {
  Clusters clusters;
  clusters.offsets = {0, 2, 4, 5, 99};
  clusters.members = {3, 2, 2, 0, 4};
  EXPECT_EQ(coupled_of(clusters, {1, 1, 1, 1, 1}), (std::vector<int32_t>{0, -1, 0, 0, 4}));
  EXPECT_EQ(coupled_of(clusters, {1, 1, 0, 1, 1}), (std::vector<int32_t>{0, -1, -1, 3, 4}));
}

// --- Pictures ---

Finding finding_in(int64_t frame) {
  Finding finding;
  finding.property = "wrong";
  finding.stage = Stage::split;
  finding.frame = frame;
  finding.particles = {3, 999'999, -2};
  finding.clusters = {7};
  return finding;
}

TEST(Pictures, OfASmallRunHoldEveryMomentAndEveryParticle) {
  const auto setup = block(3);
  const Pictures pictures = pictures_of(source_of(setup, 5), {finding_in(2)}, kMostPictureBytes);
  EXPECT_EQ(pictures.moments.size(), 11u);
  EXPECT_EQ(pictures.particles, 27);
  EXPECT_EQ(pictures.thinning, Thinning());
  EXPECT_EQ(pictures.own.first_moment, (std::vector<std::size_t>{0, 1}))
      << "the first moment comes alone, to be there at once";
  const Marks& marks = pictures.marks.at(0);
  EXPECT_TRUE(marks.is_exact);
  EXPECT_EQ(pictures.moments.at(static_cast<std::size_t>(marks.moment)).frame, 2);
  EXPECT_EQ(pictures.moments.at(static_cast<std::size_t>(marks.moment)).stage, Stage::split);
  EXPECT_EQ(marks.particles, (std::vector<int32_t>{3})) << "particles that are not there are not marked";
  EXPECT_EQ(marks.clusters.size(), 27u);
  EXPECT_FALSE(marks.is_partly);
  // Half of one of 65,534 steps: of the body's 2 h, its drift of 3e-4 m a frame and what it sways.
  const double extent = 2 + (5 * 3e-4 + 2e-4) / kSpacing;
  EXPECT_LE(pictures.own.loss, extent / 65'534 / 2);
  EXPECT_GE(pictures.own.loss, 2.0 / 65'534 / 2);
}

TEST(Pictures, ThatAreTooLargeLoseFramesButNotTheOnesThatFail) {
  const auto setup = block(10);
  const Source source = source_of(setup, 200);
  const Pictures whole = pictures_of(source, {}, kMostPictureBytes);
  const Pictures thinned = pictures_of(source, {finding_in(101)}, whole.bytes / 3);
  EXPECT_GT(thinned.thinning.every_frame, 1);
  EXPECT_LE(thinned.bytes, whole.bytes / 3);
  EXPECT_EQ(thinned.frames.size(), 201u) << "plots have every frame";
  std::set<std::pair<int64_t, Stage>> shown;
  for (const Moment& moment : thinned.moments) shown.emplace(moment.frame, moment.stage);
  EXPECT_TRUE(shown.count({101, Stage::split})) << "a stage that fails";
  EXPECT_TRUE(shown.count({199, Stage::skin})) << "the end";
  EXPECT_TRUE(thinned.moments.front().is_start);
  EXPECT_EQ(thinned.particles, 1000);
}

TEST(Pictures, OfManyParticlesLoseParticlesButNotTheOnesThatAreNamed) {
  const auto setup = block(40);
  Finding finding = finding_in(0);
  finding.clusters.clear();
  finding.particles = {64'000 - 1, 1};
  const int64_t whole = pictures_of(source_of(setup, 3), {finding}, kMostPictureBytes).bytes;
  const Pictures pictures = pictures_of(source_of(setup, 3), {finding}, whole / 2);
  EXPECT_LE(pictures.bytes, whole / 2);
  EXPECT_GT(pictures.thinning.every_particle, 1);
  EXPECT_LE(pictures.particles, 64'000 / 2 + 1);
  EXPECT_EQ(pictures.marks.at(0).particles, (std::vector<int32_t>{pictures.particles - 1, 1}));
}

TEST(Pictures, OfAStateWithoutSenseAreDrawnAllTheSame) {
  const auto setup = block(3);
  const Source source = {setup, 2, [&](int64_t index) {
                           io::Snapshot snapshot = {Stage::skin, at_rest(setup.body)};
                           State& state = snapshot.state;
                           state.frame = index;
                           state.x[0].x = std::nan("");
                           state.x[1].y = 1e300;
                           state.x[2].z = std::nan("");
                           state.alive[2] = 0;
                           state.skin.position = {{0, 0, 0}, {0, std::nan(""), 0}};
                           state.skin.owner = {-4, 5000};
                           state.skin.direction = {0, 9};
                           state.skin.triangles = {{0, 1, 99}, {-1, 0, 1}};
                           state.clusters.offsets = {5, -2};
                           return snapshot;
                         }};
  const Pictures pictures = pictures_of(source, {finding_in(500)}, kMostPictureBytes);
  EXPECT_EQ(pictures.own.details.at(1).at("nowhere"), 2) << "who is gone is not missed";
  // The body's 2 h, and the skin's vertex one spacing before it; rounded once or twice.
  EXPECT_LE(pictures.own.loss, 3.0 / 65'534 / 2 * (1 + 1e-12)) << "what is far away costs the others no places";
  EXPECT_FALSE(pictures.marks.at(0).is_exact);
}

TEST(Pictures, OfNoParticlesAndOfOneAreDrawn) {
  for (const int32_t n : {0, 1}) {
    const auto setup = block(n);
    EXPECT_EQ(pictures_of(source_of(setup, 2), {}, kMostPictureBytes).moments.size(), 5u);
  }
}

// --- What a stage changed ---

std::vector<uint8_t> codes(std::initializer_list<Change> changes) {
  std::vector<uint8_t> found;
  for (const Change change : changes) found.push_back(static_cast<uint8_t>(change));
  return found;
}

State four_particles() {
  State state;
  for (int i = 0; i < 4; ++i) state.x.push_back({static_cast<double>(i), 0, 0});
  state.alive.assign(4, 1);
  state.clusters.offsets = {0, 2, 4};
  state.clusters.members = {0, 1, 2, 3};
  state.clusters.number = {3, 5};
  return state;
}

TEST(Changes, AreWhatAStageDoesToEachParticle) {
  const State before = four_particles();
  constexpr Change kNot = Change::nothing;
  EXPECT_EQ(changes_between(before, before), codes({kNot, kNot, kNot, kNot}));
  State moved = before;
  moved.x[2].y = 1e-9;
  EXPECT_EQ(changes_between(before, moved), codes({kNot, kNot, Change::moved, kNot}));
  State removed = before;
  removed.alive[1] = 0;
  EXPECT_EQ(changes_between(before, removed), codes({kNot, Change::removed, kNot, kNot}));
  EXPECT_EQ(changes_between(removed, removed), codes({kNot, kNot, kNot, kNot})) << "only once";
  State split = before;  // cluster 5 keeps particle 2, and 3 is a cluster of its own
  split.clusters.offsets = {0, 2, 3, 4};
  split.clusters.number = {3, 5, 6};
  EXPECT_EQ(changes_between(before, split), codes({kNot, kNot, Change::reclustered, Change::reclustered}));
  State merged = before;  // 3 takes over what 5 held
  merged.clusters.offsets = {0, 4};
  merged.clusters.number = {3};
  EXPECT_EQ(changes_between(before, merged), codes({Change::merged, Change::merged, Change::merged, Change::merged}));
  State expanded = before;  // 3 takes in particle 2, which 5 keeps
  expanded.clusters.offsets = {0, 3, 5};
  expanded.clusters.members = {0, 1, 2, 2, 3};
  EXPECT_EQ(changes_between(before, expanded), codes({kNot, kNot, Change::expanded, kNot}));
  State skinned = before;
  skinned.skin.owner = {1, -7, 99};
  skinned.skin.direction = {0, 0, 0};
  EXPECT_EQ(changes_between(before, skinned), codes({kNot, Change::skin, kNot, kNot}));
}

// --- Two runs beside each other ---

TEST(Apart, SaysHowFarAndInWhatFirst) {
  const State one = four_particles();
  Apart apart = apart_of(one, one, kSpacing);
  EXPECT_EQ(apart.differs, "");
  EXPECT_EQ(apart.max, 0);
  EXPECT_EQ(apart.codes, (std::vector<uint8_t>{0, 0, 0, 0}));
  State other = one;
  other.x[3].z = 3e-3 * kSpacing;
  other.x[1].z = 4e-3 * kSpacing;
  apart = apart_of(one, other, kSpacing);
  EXPECT_EQ(apart.differs, "positions");
  EXPECT_FALSE(apart.is_decision);
  EXPECT_EQ(apart.where, 1);
  EXPECT_NEAR(apart.max, 4e-3, 1e-15);
  EXPECT_NEAR(apart.rms, 2.5e-3, 1e-15);
  EXPECT_EQ(apart.codes[0], 0);
  EXPECT_NEAR(apart.codes[1], 4 * (std::log10(4e-3) + 18), 0.51);
  other.x[1].z = std::nan("");
  EXPECT_EQ(apart_of(one, other, kSpacing).max, std::numeric_limits<double>::infinity());
  EXPECT_EQ(apart_of(other, other, kSpacing).max, 0) << "equal to the bit, if nowhere";
  other.alive[1] = 0;
  apart = apart_of(one, other, kSpacing);
  EXPECT_TRUE(apart.is_decision);
  EXPECT_EQ(apart.codes[1], kIncomparable);
  EXPECT_EQ(apart.where, 3);
}

TEST(Together, RunsShareOneTimelineAndAStageThatDidNothingIsNoDifference) {
  const Moment start = {0, 0, Stage::skin, true};
  const std::vector<Moment> one = {start,
                                   {1, 0, Stage::step, false},
                                   {2, 0, Stage::detect, false},
                                   {3, 0, Stage::skin, false},
                                   {4, 1, Stage::step, false},
                                   {5, 1, Stage::skin, false}};
  const std::vector<Moment> other = {start, {1, 0, Stage::step, false}, {2, 0, Stage::skin, false}};
  const std::vector<Together> both = together(one, other, true);
  ASSERT_EQ(both.size(), 6u);
  EXPECT_EQ(both[2].other, 1) << "it has nothing of detect, so that is as after its step";
  EXPECT_TRUE(both[2].is_comparable);
  EXPECT_FALSE(both[4].is_comparable) << "it has ended";
  // Of a run that has the ends of frames alone nobody knows what lies between.
  const std::vector<Together> ends = together(one, {start, {1, 0, Stage::skin, false}}, true);
  EXPECT_FALSE(ends[1].is_comparable);
  EXPECT_TRUE(ends[3].is_comparable);
  EXPECT_EQ(together(other, one, false).size(), 3u) << "what is not shown adds no moments";
}

TEST(Pages, OfTwoRunsNameTheFirstMomentInWhichTheyDiffer) {
  const auto setup = block(3);
  const Source own = source_of(setup, 5);
  const Source other = {setup, own.count, [&](int64_t index) {
                          io::Snapshot snapshot = own.snapshot(index);
                          if (index >= 5) snapshot.state.x[7].x += 1e-6;
                          if (index >= 8) snapshot.state.alive[2] = 0;
                          return snapshot;
                        }};
  const Beside beside = {other, true, "other", "own", "it"};
  const Pictures pictures = pictures_of(own, {}, kMostPictureBytes, &beside);
  EXPECT_EQ(pictures.comparison.at("any").at("frame"), 2);
  EXPECT_EQ(pictures.comparison.at("any").at("stage"), "split");
  EXPECT_NEAR(pictures.comparison.at("any").at("max").get<double>(), 1e-6 / kSpacing, 1e-12);
  EXPECT_EQ(pictures.comparison.at("decision").at("frame"), 3);
  EXPECT_EQ(pictures.own.details.size(), pictures.beside.details.size());
  EXPECT_EQ(pictures.own.details.at(5).at("apart").at("particle"), 7);
  EXPECT_EQ(pictures.own.details.at(4).at("apart").at("differs"), "");
}

TEST(Pictures, OfAWitnessOfTheSkinMarkTheCornersOfItsTriangles) {
  const auto setup = block(3);
  const Source source = {setup, 2, [&](int64_t index) {
                           io::Snapshot snapshot = {Stage::skin, at_rest(setup.body)};
                           snapshot.state.frame = index;
                           snapshot.state.skin.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
                           snapshot.state.skin.triangles = {{0, 1, 2}, {2, 1, 0}, {0, 1, 99}};
                           return snapshot;
                         }};
  Finding finding = finding_in(0);
  finding.stage = Stage::skin;
  finding.triangles = {1, 2, -1, 77};
  EXPECT_EQ(pictures_of(source, {finding}, kMostPictureBytes).marks.at(0).corners, (std::vector<int32_t>{2, 1, 0}))
      << "a triangle that is not there, or whose vertices are not, is not marked";
}

// --- The page ---

constexpr const char* kHostile = "</script><script>window.hacked=1</script>";

TEST(Page, HoldsNamesAsTextOnly) {
  if (kPageScript.empty()) GTEST_SKIP() << "this build has no report pages";
  const auto setup = block(3);
  json given = document({verdict(kHostile, "split", 0, false, 3, 1)});
  given["scene"] = given["backend"] = kHostile;
  given["verdicts"][0]["witness"]["text"] = "@SCRIPT@ @DATA@ @FIRST_CHUNK@";
  const std::string text = page(source_of(setup, 2), results_of(given, "f"), kHostile, {"1"});
  EXPECT_EQ(text.find("<script>window"), std::string::npos);
  EXPECT_EQ(text.find("@LATER_CHUNKS@"), std::string::npos) << "every mark of the template is filled";
  const std::string begin = "id=\"data\">";
  const std::size_t first = text.find(begin) + begin.size();
  const json data = json::parse(text.substr(first, text.find("</script>", first) - first));
  EXPECT_EQ(data.at("scene"), kHostile);
  EXPECT_EQ(data.at("again"), kHostile);
  EXPECT_EQ(data.at("findings").at(0).at("property"), kHostile);
  EXPECT_EQ(data.at("findings").at(0).at("text"), "@SCRIPT@ @DATA@ @FIRST_CHUNK@") << "what it holds is no mark";
}

TEST(Page, HoldsTheBladesWayByStrokesAndNotInEveryStep) {
  auto setup = block(3);
  setup.has_blade = true;
  setup.blade = {1, 1, 0, 0};
  // 400 steps down, one up, and two down.
  for (int k = 0; k < 403; ++k) {
    const auto pose = [](double x) { return BladePose{{x, 0, 0}, {0, 1, 0}, {0, 0, 1}}; };
    setup.blade_moves.push_back({pose(k), pose(k + 1), k != 400, 0});
  }
  const json way = blade_json(setup).at("way");
  ASSERT_EQ(way.size(), 2u);
  EXPECT_LE(way.at(0).size(), 6u * 152);
  EXPECT_GE(way.at(0).size(), 6u * 100);
  EXPECT_EQ(way.at(0).at(0), 0) << "from where the stroke begins";
  EXPECT_EQ(way.at(0).at(way.at(0).size() - 6), 400) << "to where it ends";
  EXPECT_EQ(way.at(1).at(0), 401);
  EXPECT_EQ(way.at(1).at(way.at(1).size() - 6), 403);
  EXPECT_TRUE(blade_json(block(3)).is_null());
}

TEST(Page, AllowsItsOwnScriptAndNothingElse) {
  if (kPageScript.empty()) GTEST_SKIP() << "this build has no report pages";
  const auto setup = block(3);
  const std::string text = page(source_of(setup, 2), results_of(document({}), "f"), "again", {"1"});
  EXPECT_NE(text.find("default-src 'none'; script-src '" + std::string(kPageScriptHash) + "'; style-src '" +
                      std::string(kPageStyleHash) + "'; img-src data:;"),
            std::string::npos);
  EXPECT_NE(text.find("<script>" + std::string(kPageScript) + "</script>"), std::string::npos);
  for (const char* const outside : {" src=\"", "href=\"http", "@import", "url("})
    EXPECT_EQ(std::string(text).find(outside), std::string::npos) << outside;
}

// What a browser has to read before it shows verdicts, plots and the first frame.
TEST(Page, IsUnderTwoMegabytesUpToTheFirstFrame) {
  if (kPageScript.empty()) GTEST_SKIP() << "this build has no report pages";
  const auto setup = block(47);  // 103,823 particles
  std::vector<json> verdicts;
  for (int frame = 0; frame < 3000; ++frame) {
    verdicts.push_back(verdict("property " + std::to_string(frame % 50), "split", frame / 50, frame % 7 != 0, 1, 1));
  }
  const std::string text = page(source_of(setup, 2), results_of(document(verdicts), "f"), "again", {"1"});
  const std::size_t later = text.find("id=\"chunk-1\"");
  ASSERT_NE(later, std::string::npos);
  EXPECT_LT(later, 2'000'000u);
  std::printf("first page of 103,823 particles: %zu bytes, of %zu\n", later, text.size());
}

TEST(Page, RefusesResultsOfAnotherRun) {
  io::Recording recording;
  recording.setup = block(3);
  recording.backend = "mine";
  const Results results = results_of(document({}), "f");
  EXPECT_NO_THROW(require_same_run(recording, "block", "r", results, "f"));
  EXPECT_NO_THROW(require_same_run(recording, "", "r", results, "f")) << "a recording need not name its scene";
  EXPECT_THROW(require_same_run(recording, "another", "r", results, "f"), InputError);
  recording.backend = "other";
  EXPECT_THROW(require_same_run(recording, "block", "r", results, "f"), InputError);
  recording.backend = "mine";
  EXPECT_NO_THROW(require_same_body(recording, "r", recording, "o"));
  io::Recording larger = recording;
  larger.setup = block(4);
  EXPECT_THROW(require_same_body(recording, "r", larger, "o"), InputError);
  io::Recording wider = recording;
  wider.setup.body.grid.spacing *= 2;
  EXPECT_THROW(require_same_body(recording, "r", wider, "o"), InputError);
  recording.setup = block(4);
  EXPECT_THROW(require_same_run(recording, "block", "r", results, "f"), InputError);
}

}  // namespace
}  // namespace cutproof::report::page_test
