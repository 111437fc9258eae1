// What is printed: how wide, in which colours, how much of it, and what fails first.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "model/io/columns.h"
#include "tests/cli/verbs.h"

namespace screen_test {
namespace {

using nlohmann::json;

constexpr const char* kCut = R"({"version": 5, "name": "small",
  "body": {"shape": {"kind": "box", "size": [0.06, 0.05, 0.05]}, "spacing": 0.01},
  "frame": {"settle": 0.032}, "detect": {"criterion": "geometric"},
  "blade": {"speed": 1, "strokes": [{"points": [[0.45, 0.5, 1.3], [0.45, 0.5, -0.3]], "along": [0, 1, 0]}]},
  "expect": {"components_after_stroke": [2], "components_at_end": 2, "shells_at_end": 2}})";

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// A command or a path, which may stand on a line of its own, whole.
bool is_to_be_copied(const std::string& line) {
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  return line.compare(begin, 9, "cutproof ") == 0 || line.find(' ', begin) == std::string::npos;
}

void expect_narrow(const std::string& output, const std::string& command) {
  for (const std::string& line : lines_of(output)) {
    EXPECT_TRUE(cutproof::io::width_of(line) <= 80 || is_to_be_copied(line)) << command << ": " << line;
  }
}

class Screen : public Verbs {
 protected:
  json with_expectation(const std::string& what, const json& value) const {
    json scene = json::parse(kCut);
    scene["expect"] = {{what, value}};
    return scene;
  }
};

// --- 80 columns ------------------------------------------------------------------------------------------------------

TEST_F(Screen, IsNotLeftByAnyVerb) {
  record();
  std::vector<std::string> all = commands();
  for (const char* const command :
       {"run cut.json --check --verbose --against reference --errors all --backend host --record again --json run.json",
        "fuzz --cases 20 --sizes 0-30 --dynamics --verbose", "bench sampling --repeats 1 --frames 1",
        "bench clusters --particles 500 --tau 0.5", "bench scale --sizes 1000 --repeats 1 --frames 1",
        "bench rotations --matrices 1 --timed 10 --repeats 1 --cases", "bench baselines --particles 200",
        "bench solver --particles 0 --samples 1 --iterations 1,2 --substeps 1",
        "bench sensitivity --particles 100 --moments 1",
        "bench material --sides 2 --poisson-ratio 0 --across 4 --iterations 4 --backend host"}) {
    all.emplace_back(command);
  }
  for (const std::string& command : all) {
    const Outcome outcome = cutproof(command);
    EXPECT_EQ(outcome.status, 0) << command << "\n" << outcome.output;
    EXPECT_FALSE(outcome.output.empty()) << command;
    expect_narrow(outcome.output, command);
  }
}

TEST_F(Screen, IsNotLeftByWhatFails) {
  json scene = with_expectation("components_at_end", 7);
  scene["description"] = std::string(300, 'x') + " 肝臓 " + std::string(300, 'y');
  write("wrong.json", scene.dump());
  const std::string longest(150, 'r');
  for (const std::string& command :
       std::vector<std::string>{"run wrong.json --check --record " + longest, "check " + longest, "fuzz --cases 0"}) {
    expect_narrow(cutproof(command).output, command);
  }
  EXPECT_EQ(cutproof("check " + longest).status, 1);
}

TEST_F(Screen, IsNotLeftByAnyPageOfHelp) {
  std::vector<std::string> pages = {""};
  for (const char* verb : {"run",
                           "judge",
                           "check",
                           "kick",
                           "vectors",
                           "check-vectors",
                           "info",
                           "bench",
                           "tune",
                           "fuzz",
                           "replay",
                           "report",
                           "digest",
                           "bench stages",
                           "bench sampling",
                           "bench clusters",
                           "bench scale",
                           "bench rotations",
                           "bench machine_limits",
                           "bench solver",
                           "bench baselines",
                           "bench sensitivity",
                           "bench material"}) {
    pages.emplace_back(verb);
  }
  for (const std::string& page : pages) {
    const Outcome outcome = cutproof(page + " --help");
    EXPECT_EQ(outcome.status, 0) << page;
    EXPECT_NE(outcome.output.find("--color"), std::string::npos) << page << ": " << outcome.output;
    expect_narrow(outcome.output, page + " --help");
  }
}

// --- Colour ----------------------------------------------------------------------------------------------------------

TEST_F(Screen, IsColouredOnlyIfItIsAskedForWhereThereIsNoTerminal) {
  const auto coloured = [this](const std::string& options, const std::string& environment = "") {
    const Outcome outcome = cutproof(options, environment);
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    return outcome.output.find('\x1b') != std::string::npos;
  };
  EXPECT_FALSE(coloured("run cut.json --check", "TERM=xterm"));
  EXPECT_TRUE(coloured("run cut.json --check --color always"));
  EXPECT_TRUE(coloured("--color always run cut.json --check")) << "before the verb as well";
  EXPECT_TRUE(coloured("--color=always run cut.json --check", "NO_COLOR=1")) << "what is said outright counts";
  EXPECT_FALSE(coloured("run cut.json --check --color never", "TERM=xterm"));
  expect_refused("run cut.json --color mauve", {"--color", "mauve"});
  // Nothing is told by colour alone.
  std::string plain = cutproof("check-vectors vectors.npz answers.npz --color always").output;
  for (std::size_t at; (at = plain.find('\x1b')) != std::string::npos;) plain.erase(at, plain.find('m', at) + 1 - at);
  EXPECT_EQ(plain, cutproof("check-vectors vectors.npz answers.npz").output);
}

// --- Quiet -----------------------------------------------------------------------------------------------------------

TEST_F(Screen, SaysOnlyTheLastLineOfWhatHoldsIfItIsToBeQuiet) {
  record();
  for (const std::string& command : commands()) {
    if (command.starts_with("info") || command.starts_with("--")) continue;  // what is asked for is the text
    for (const std::string& quiet : {command + " --quiet", "--quiet " + command}) {
      const Outcome outcome = cutproof(quiet);
      EXPECT_EQ(outcome.status, 0) << quiet << "\n" << outcome.output;
      EXPECT_EQ(lines_of(outcome.output).size(), 1u) << quiet << "\n" << outcome.output;
    }
  }
  EXPECT_EQ(cutproof("run cut.json --check --quiet --json quiet.json --record quiet").status, 0);
  EXPECT_TRUE(json::parse(read("quiet.json")).at("summary").at("holds")) << "files are written all the same";
  EXPECT_TRUE(files::exists(path("quiet.cutproof.h5")));
}

TEST_F(Screen, SaysWhatFailsIfItIsToBeQuiet) {
  write("wrong.json", with_expectation("components_at_end", 3).dump());
  const Outcome outcome = cutproof("run wrong.json --check --quiet");
  EXPECT_EQ(outcome.status, 1);
  const std::vector<std::string> lines = lines_of(outcome.output);
  ASSERT_GT(lines.size(), 3u) << outcome.output;
  EXPECT_TRUE(lines.front().starts_with("FAILS: expected components at the end")) << outcome.output;
  EXPECT_NE(lines.back().find("1 failed: NOT everything holds."), std::string::npos) << outcome.output;
  EXPECT_EQ(outcome.output.find("note:"), std::string::npos);
  EXPECT_EQ(outcome.output.find("scene small"), std::string::npos);
}

// --- What fails ------------------------------------------------------------------------------------------------------

TEST_F(Screen, ShowsWhatFailsFirstWithTheFrameInWhichItBegan) {
  json foreign = json::parse(std::ifstream(scene("irregular_sampled")));
  foreign["expect"].erase("isolated_clusters");
  write("isolated.json", foreign.dump());
  const Outcome outcome = cutproof("run isolated.json --check topology --json out.json");
  EXPECT_EQ(outcome.status, 1);
  int64_t first = -1, failing = 0, all = 0;
  std::string stage, witness;
  const json document = json::parse(read("out.json"));
  for (const json& verdict : document.at("verdicts")) {
    if (verdict.at("property") != "isolation") continue;
    if (stage.empty() && !verdict.at("holds")) stage = verdict.at("stage");
    if (stage.empty() || verdict.at("stage") != stage || verdict.at("holds")) continue;
    if (first < 0) {
      first = verdict.at("frame");
      witness = verdict.at("witness").at("text");
    }
    ++failing;
  }
  for (const json& verdict : document.at("verdicts")) {
    all += verdict.at("property") == "isolation" && verdict.at("stage") == stage;
  }
  ASSERT_GT(failing, 1) << "the scene has to fail in several frames";
  const std::string printed = on_one_line(outcome.output);
  const std::string head = "FAILS: isolation after " + stage + ", first in frame " + std::to_string(first) + " (" +
                           std::to_string(failing) + " of " + std::to_string(all) + " verdicts) counted ";
  ASSERT_NE(printed.find(head), std::string::npos) << head << "\n" << outcome.output;
  EXPECT_NE(printed.find(on_one_line(witness)), std::string::npos) << witness << "\n" << outcome.output;
  EXPECT_LT(printed.find("FAILS: isolation"), printed.find("; the nearest to its bound"));
  EXPECT_NE(outcome.output.find("see it again: cutproof run isolated.json --check topology\n"), std::string::npos)
      << outcome.output;
  // A component that is not all coupled is told with the sizes of the pieces.
  EXPECT_NE(printed.find("; the tissue is 1 piece (of "), std::string::npos) << outcome.output;
  // Counts have no unit, and no "1" in its place.
  EXPECT_EQ(printed.find("measured 1 1"), std::string::npos) << outcome.output;
}

TEST_F(Screen, TellsTheSizesOfPiecesAndWhenThereWereTooMany) {
  write("wrong.json", with_expectation("components_at_end", 1).dump());
  const Outcome outcome = cutproof("run wrong.json --check --json out.json");
  EXPECT_EQ(outcome.status, 1);
  const json document = json::parse(read("out.json"));
  json failing;
  for (const json& verdict : document.at("verdicts")) {
    if (!verdict.at("holds")) failing = verdict;
  }
  const json& frames = document.at("frames");
  std::size_t last_cut = 0;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    if (frames[f].at("removed") > 0) last_cut = f;
  }
  ASSERT_LT(last_cut + 1, frames.size());
  EXPECT_EQ(failing.at("frame"), last_cut) << "it came apart when the last of it was cut, not at the end of the run";
  const int64_t particles = frames.back().at("particles");
  const std::string text = failing.at("witness").at("text");
  int64_t one = 0, other = 0;
  const std::size_t at = text.find("2 pieces (of ");
  ASSERT_NE(at, std::string::npos) << text;
  ASSERT_EQ(std::sscanf(text.c_str() + at, "2 pieces (of %ld and %ld", &one, &other), 2) << text;
  EXPECT_EQ(one + other, particles) << text;
  EXPECT_NE(on_one_line(outcome.output).find("in frame " + std::to_string(last_cut) + " measured 2, bound 1"),
            std::string::npos)
      << outcome.output;
}

// --- A run that stops early ------------------------------------------------------------------------------------------

TEST_F(Screen, JudgesWhatARunReachesThatStopsEarly) {
  json scene = json::parse(kCut);
  scene["expect"]["removed"] = {{"at_most", 1000}};
  scene["expect"]["particles"] = 150;
  write("long.json", scene.dump());
  const Outcome outcome = cutproof("run long.json --check --frames 3 --record short --json run.json --junit run.xml");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  const json document = json::parse(read("run.json"));
  EXPECT_EQ(document.at("not_reached"),
            json({"components after stroke 1", "components at the end", "shells at the end", "removed particles"}));
  for (const json& verdict : document.at("verdicts")) {
    EXPECT_NE(verdict.at("property"), "expected components at the end") << "what is not reached has no verdict";
  }
  EXPECT_TRUE(std::any_of(document.at("verdicts").begin(), document.at("verdicts").end(), [](const json& verdict) {
    return verdict.at("property") == "expected particles";
  })) << "what is known from the start is judged";
  EXPECT_NE(on_one_line(outcome.output)
                .find("Not reached, because the run stops before: components after stroke 1, components at the end, "),
            std::string::npos)
      << outcome.output;
  EXPECT_NE(outcome.output.find("0 failed: what was reached holds."), std::string::npos) << outcome.output;
  EXPECT_NE(on_one_line(outcome.output).find("As the scene expects: particles:\u00A0150."), std::string::npos)
      << outcome.output;
  EXPECT_NE(read("run.xml").find("not reached"), std::string::npos);
  // Its recording is one of a run that stops early.
  const Outcome checked = cutproof("check short --json check.json");
  EXPECT_EQ(checked.status, 0) << checked.output;
  EXPECT_EQ(json::parse(read("check.json")).at("not_reached"), document.at("not_reached"));
  // More frames than the scene has are the whole of it.
  ASSERT_EQ(cutproof("run long.json --check --frames 100000 --json whole.json").status, 0);
  EXPECT_EQ(json::parse(read("whole.json")).at("not_reached"), json::array());
}

TEST_F(Screen, SaysSoIfNothingThatIsExpectedWasReached) {
  write("cut_in_two.json", kCut);
  const Outcome outcome = cutproof("run cut_in_two.json --check --frames 2");
  EXPECT_EQ(outcome.status, 0) << outcome.output;
  EXPECT_NE(on_one_line(outcome.output).find("ends before any expectation of the scene could be judged"),
            std::string::npos)
      << outcome.output;
  // Nothing at all is not enough.
  EXPECT_EQ(cutproof("run cut_in_two.json --check --frames 0").status, 1);
}

TEST_F(Screen, FailsARunThatStopsEarlyForWhatIsTooMuchAlreadyAndForStrokesThatAreComplete) {
  write("removed.json", with_expectation("removed", {{"at_most", 1}}).dump());
  write("stroke.json", with_expectation("components_after_stroke", {5}).dump());
  ASSERT_EQ(cutproof("run stroke.json --json whole.json").status, 0);
  const std::size_t frames = json::parse(read("whole.json")).at("frames").size();
  const std::string early = " --check --json out.json --frames " + std::to_string(frames - 1);
  for (const std::string name : {"removed", "stroke"}) {
    const Outcome outcome = cutproof("run " + name + ".json" + early);
    EXPECT_EQ(outcome.status, 1) << outcome.output;
    EXPECT_EQ(json::parse(read("out.json")).at("not_reached"), json::array()) << outcome.output;
    EXPECT_EQ(json::parse(read("out.json")).at("summary").at("failed"), 1) << outcome.output;
  }
}

// A scene that ends by itself before its blade is through has not been cut short by anybody.
TEST_F(Screen, FailsASceneThatEndsBeforeItsOwnStroke) {
  json scene = json::parse(kCut);
  scene["frame"] = {{"count", 3}};
  write("ends.json", scene.dump());
  const Outcome outcome = cutproof("run ends.json --check");
  EXPECT_EQ(outcome.status, 1) << outcome.output;
  EXPECT_NE(on_one_line(outcome.output).find("the end of stroke 1 was never reached"), std::string::npos)
      << outcome.output;
}

}  // namespace
}  // namespace screen_test
