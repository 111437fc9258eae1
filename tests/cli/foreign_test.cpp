// `cutproof check` of a state and `cutproof kick`, used as on the page of runs, and what they print and write.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "model/io/array_file.h"
#include "tests/harness/foreign_files.h"
#include "tests/program.h"

namespace foreign_test {
namespace {

using namespace cutproof;
using nlohmann::json;
using tests::As;

class Foreign : public Program {
 protected:
  // What stands on the page of runs in Python: of a kick, of a state.
  static std::string program_of_the_page(const std::string& writes) {
    std::ifstream page(files::path(CUTPROOF_SOURCE) / "docs/how_to/judge_a_run.md");
    std::string program;
    bool in_program = false;
    for (std::string line; std::getline(page, line);) {
      if (in_program && line == "```") {
        if (program.find(writes) != std::string::npos) return program;
        in_program = false;
      } else if (in_program) {
        program += line + "\n";
      } else if (line == "```python") {
        in_program = true;
        program.clear();
      }
    }
    throw std::logic_error("no program on the page writes " + writes);
  }
  void python(const std::string& program) const {
    write("program.py", program);
    const std::string line = "cd '" + folder_.string() + "' && /usr/bin/python3 program.py";
    ASSERT_EQ(std::system(line.c_str()), 0) << program;
  }
  static std::string replaced(std::string text, const std::string& what, const std::string& by) {
    const std::size_t at = text.find(what);
    if (at == std::string::npos) throw std::logic_error("the page does not say \"" + what + "\" any more");
    return text.replace(at, what.size(), by);
  }
  static const json& entry(const json& list, const std::string& property) {
    for (const json& each : list) {
      if (each.at("property") == property) return each;
    }
    throw std::logic_error("there is nothing on " + property);
  }
};

TEST_F(Foreign, StateOfThePageHolds) {
  const std::string program = program_of_the_page("state.npz");
  EXPECT_LE(std::count(program.begin(), program.end(), '\n'), 10);
  python(program);
  const Outcome outcome = cutproof("check state.npz --json verdicts.json");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("36 particles in 3 clusters"), std::string::npos) << outcome.output;
  const std::string not_judged = outcome.output.substr(outcome.output.find("Not judged:\n"));
  EXPECT_NE(not_judged.find("\n  not promised: "), std::string::npos) << outcome.output;
  for (const json& each : json::parse(read("verdicts.json")).at("not_judged")) {
    EXPECT_NE(on_one_line(not_judged).find(each.at("property").get<std::string>()), std::string::npos)
        << each << outcome.output;
  }
  EXPECT_NE(outcome.output.find("what was judged holds."), std::string::npos) << outcome.output;
  const json document = json::parse(read("verdicts.json"));
  EXPECT_EQ(document.at("format"), "cutproof.check_state");
  EXPECT_EQ(document.at("promises"), json({"connected", "covered", "coupled", "edges_covered"}));
  EXPECT_TRUE(document.at("promises_given"));
  EXPECT_FALSE(document.at("single_precision"));
  EXPECT_TRUE(document.at("summary").at("holds"));
  EXPECT_EQ(document.at("body").at("particles"), 36);
  EXPECT_NEAR(document.at("body").at("spacing").get<double>(), 0.01, 1e-12);
  EXPECT_EQ(entry(document.at("verdicts"), "edge cover").at("checked"), 75);
  EXPECT_EQ(entry(document.at("not_judged"), "cap kept").at("why"), "one state does not show the effect of a stage");
}

TEST_F(Foreign, StateOfThePageIsRejectedOnceItIsWrong) {
  const std::string right = program_of_the_page("state.npz");
  // The middle slab is missing; two slabs are torn apart; one has a particle that is not there.
  for (const auto& [change, to, property] : std::vector<std::array<std::string, 3>>{
           {"for k in range(3)]", "for k in (0, 2)]", "component match"},
           {"(x == k + 1)", "(x == k + 3)", "cluster connectivity"},
           {"(x == k + 1)", "False", "edge cover"},
           {"np.concatenate(clusters)", "np.concatenate(clusters) + 1", "well formed"}}) {
    python(replaced(right, change, to));
    const Outcome outcome = cutproof("check state.npz --json verdicts.json");
    EXPECT_EQ(outcome.status, 1) << change << "\n" << outcome.output;
    EXPECT_NE(outcome.output.find("FAILS: " + property + "\n"), std::string::npos) << outcome.output;
    const json document = json::parse(read("verdicts.json"));
    EXPECT_FALSE(document.at("summary").at("holds"));
    EXPECT_FALSE(entry(document.at("verdicts"), property).at("witness").at("text").get<std::string>().empty());
  }
  python(replaced(right, "promises=\"connected covered coupled edges_covered\"", "promises=\"\""));
  EXPECT_EQ(cutproof("check state.npz").status, 1) << "nothing was judged";
  python(replaced(right, "positions=rest", "places=rest"));
  expect_refused("check state.npz", {"places", "positions", "remedy"});
  python(replaced(right, "np.savez(\"state.npz\", positions=rest", "np.savez(\"state.npz\", positions=rest[1:]"));
  expect_refused("check state.npz", {"rest", "(36, 3)", "(35, 3)"});
}

TEST_F(Foreign, KickOfThePageHoldsAndAGhostForceDoesNot) {
  const std::string right = program_of_the_page("kick.npz");
  python(right);
  Outcome outcome = cutproof("kick kick.npz --json kick.json");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  json document = json::parse(read("kick.json"));
  EXPECT_EQ(document.at("format"), "cutproof.kick");
  EXPECT_TRUE(document.at("repeats"));
  ASSERT_EQ(document.at("kicks").size(), 1u);
  EXPECT_EQ(document["kicks"][0].at("kicked_piece"), 1);
  EXPECT_EQ(document["kicks"][0].at("kick_frame"), 10);
  EXPECT_EQ(document["kicks"][0].at("pieces").at(1).at("felt"), 4);
  EXPECT_TRUE(document["kicks"][0].at("pieces").at(0).at("first_frame").is_null());
  EXPECT_TRUE(document.at("summary").at("holds"));

  python(replaced(right, "x[10:, 4:, 1] += kick", "x[10:, 4:, 1] += kick; x[12:, 3, 1] += 1e-6 * kick"));
  outcome = cutproof("kick kick.npz --json kick.json");
  EXPECT_EQ(outcome.status, 1) << outcome.output;
  EXPECT_NE(outcome.output.find("Particle 3 of piece 0 felt it first, from frame 12 on"), std::string::npos)
      << outcome.output;
  document = json::parse(read("kick.json"));
  EXPECT_EQ(document["kicks"][0].at("pieces").at(0).at("felt"), 1);
  EXPECT_EQ(document["kicks"][0].at("pieces").at(0).at("first_frame"), 12);
  EXPECT_NEAR(document["kicks"][0].at("pieces").at(0).at("of_kick"), 1e-6, 1e-12);
  EXPECT_EQ(entry(document.at("verdicts"), "no ghost force").at("witness").at("particles"), json({3}));

  python(replaced(right, "run(0.01)", "run(0)"));
  outcome = cutproof("kick kick.npz");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.output.find("nothing was tested"), std::string::npos) << outcome.output;

  // A simulator with noise says how blunt the test is.
  python(replaced(right, "    return x", "    return x + 1e-9 * np.random.default_rng().normal(size=x.shape)"));
  outcome = cutproof("kick kick.npz --json kick.json");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("the test is blunt"), std::string::npos) << outcome.output;
  document = json::parse(read("kick.json"));
  EXPECT_FALSE(document.at("repeats"));
  EXPECT_GT(document["kicks"][0].at("least_bound").get<double>(), 1e-8);
}

TEST_F(Foreign, KicksAreToldOneByOne) {
  const std::string one = replaced(program_of_the_page("kick.npz"), "x[10:, 4:, 1] += kick",
                                   "x[10:, 4:, 1] += kick; x[10:, :4, 1] += 4e-9 * kick");
  const std::string program = replaced(one, "kicked=run(0.01)", "kicked=[run(0.01), run(-0.02)]");
  python(replaced(program, "piece=", "tolerance=1e-6, directions=[[0, 1, 0], [0, -1, 0]], piece="));
  Outcome outcome = cutproof("kick kick.npz --json kick.json --junit kick.xml");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("30 frames of 8 particles, 2 kicks"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("8e-11   4e-09"), std::string::npos) << outcome.output;
  EXPECT_NE(on_one_line(outcome.output).find("Not judged: equal answers"), std::string::npos) << outcome.output;
  const json document = json::parse(read("kick.json"));
  EXPECT_EQ(document.at("tolerance"), 1e-6);
  ASSERT_EQ(document.at("kicks").size(), 2u);
  for (const json& each : document["kicks"]) {
    EXPECT_EQ(each.at("kicked_piece"), 1);
    EXPECT_NEAR(each.at("pieces").at(0).at("of_kick").get<double>(), 4e-9, 1e-20);
  }
  EXPECT_EQ(document["kicks"][1].at("direction"), json({0.0, -1.0, 0.0}));
  EXPECT_NEAR(document["kicks"][1].at("pieces").at(1).at("centre").get<double>(), 0.02, 1e-12);
  std::map<std::string, int> of_each;
  for (const json& verdict : document.at("verdicts")) of_each[verdict.contains("kick") ? "one" : "all"] += 1;
  EXPECT_EQ(of_each["all"], 2);
  EXPECT_EQ(of_each["one"], 6);
  EXPECT_NE(read("kick.xml").find("<property name=\"felt / kicked, kick 1, piece 0\" value=\"4e-09\"/>"),
            std::string::npos)
      << read("kick.xml");

  python(program);
  outcome = cutproof("kick kick.npz");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(on_one_line(outcome.output).find("global coupling, 4e-09 of the kick"), std::string::npos)
      << outcome.output;
}

// A run of the reference, cut, as NPZ and as HDF5, as a graph and on a grid.
TEST_F(Foreign, StateThatTheReferenceCutHolds) {
  const tests::CutBody cut = tests::cut_body();
  for (const As as : {As::grid, As::pairs, As::rows}) {
    for (const std::string name : {"cut.npz", "cut.h5"}) {
      io::write_array_file(path(name), tests::arrays_of(cut.setup, cut.state, as));
      const Outcome outcome = cutproof("check " + name);
      EXPECT_EQ(outcome.status, 0) << outcome.output;
      EXPECT_EQ(outcome.output.find(as == As::grid ? "on a grid" : "as a graph") != std::string::npos, true);
    }
  }
  const Outcome pieces = cutproof("check cut.h5 --json pieces.json");
  EXPECT_NE(pieces.output.find("; 2 pieces (of "), std::string::npos) << pieces.output;
  EXPECT_EQ(json::parse(read("pieces.json")).at("body").at("pieces"), 2);
  State torn = cut.state;
  torn.alive[0] = 0;
  io::write_array_file(path("torn.h5"), tests::arrays_of(cut.setup, torn, As::pairs));
  const Outcome outcome = cutproof("check torn.h5");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.output.find("FAILS: tissue kept"), std::string::npos) << outcome.output;
}

}  // namespace
}  // namespace foreign_test
