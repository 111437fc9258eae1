// What every verb does alike with what it is given.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/program.h"

namespace options_test {
namespace {

using nlohmann::json;

constexpr const char* kScene = R"({"version": 5, "name": "falling",
  "body": {"shape": {"kind": "box", "size": [0.04, 0.03, 0.03]}, "spacing": 0.01}, "frame": {"count": 2},
  "walls": [{"axis": 2, "offset": -0.5}], "step": {"gravity": [0, 0, -9.81]}})";

class Options : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("s.json", kScene);
  }
  json standard_output_of(const std::string& arguments) const {
    return json::parse(standard_output(arguments), nullptr, false);
  }
  std::string standard_output(const std::string& arguments) const {
    const Outcome outcome = cutproof(arguments + " 2> error #");
    EXPECT_EQ(outcome.status, 0) << arguments << "\n" << read("error");
    return outcome.output;
  }
  // What the first group of this expression matches.
  static std::set<std::string> matches(const std::string& text, const std::string& expression) {
    const std::regex regex(expression);
    std::set<std::string> found;
    for (std::sregex_iterator each(text.begin(), text.end(), regex), end; each != end; ++each)
      found.insert(each->str(1));
    return found;
  }
  // The line that begins so; empty if there is none.
  static std::string line_of(const std::string& text, const std::string& beginning) {
    const std::size_t at = text.find("\n" + beginning);
    return at == std::string::npos ? "" : text.substr(at + 1, text.find('\n', at + 1) - at - 1);
  }
  std::string words_offered(const std::string& words) const {
    write("complete.sh", "source <('" CUTPROOF_PROGRAM "' info --completion bash)\nCOMP_WORDS=(" + words +
                             ")\nCOMP_CWORD=$(( ${#COMP_WORDS[@]} - 1 ))\n_cutproof\necho \"${COMPREPLY[*]}\"\n");
    // The program's own status and output do not matter here.
    return cutproof("--version > version; bash complete.sh #").output;
  }
};

// What an option takes one at a time it has again before each value.
TEST_F(Options, AreSaidSoThatTheyCanBeGivenAgain) {
  const Outcome bad = cutproof("run s.json --set expect.components_at_end=7 --set step.iterations=3 --check topology");
  EXPECT_EQ(bad.status, 1) << bad.output;
  const std::string again = "run s.json --set expect.components_at_end=7 --set step.iterations=3 --check topology";
  std::string line = bad.output;
  std::replace(line.begin(), line.end(), '\n', ' ');
  ASSERT_NE(line.find("cutproof " + again), std::string::npos) << bad.output;
  EXPECT_EQ(cutproof(again).status, 1);
}

// Anybody can add a line: what is given, and what the error has to say.
TEST_F(Options, SayWhatWasMeant) {
  for (const auto& [command, words] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"rnu s.json", {"rnu", "did you mean 'run'?"}},
           {"run kidny_arc", {"did you mean 'kidney_arc'?"}},
           {"fuz", {"did you mean 'fuzz'?"}},
           {"run --frams 3 s.json", {"--frams", "did you mean '--frames'?", "cutproof run --help"}},
           {"run s.json --recrod=x", {"--recrod:", "did you mean '--record'?"}},
           {"fuzz --simplify 3", {"--simplify", "did you mean '--shrink'?"}},
           {"tune s.json --tolerence 1", {"--tolerence", "did you mean '--tolerance'?"}},
           {"bench solver --sampels 3", {"did you mean '--samples'?", "cutproof bench solver --help"}},
           {"bench solvr", {"solvr", "did you mean 'solver'?"}},
           {"fuzz --backend hots", {"hots", "did you mean 'host'?", "cutproof info"}},
           {"fuzz --backend simulated --schedule randm", {"did you mean 'random'?"}},
           {"run s.json --check moton", {"did you mean 'motion'?"}},
           {"run s.json --mesh m.stl --unit inch", {"inch", "mm, cm, m"}},
           {"run s.json --errors topologi", {"did you mean 'topology'?"}},
           {"run s.json --against reference --mode lockstp", {"did you mean 'lockstep'?"}},
           {"tune s.json --tolerance 1 --reference limt", {"did you mean 'limit'?"}},
           {"vectors splt -o v.npz", {"did you mean 'split'?"}},
           {"vectors split -o v.npz --precision doubel", {"did you mean 'double'?"}},
           {"bench sampling --clusters box", {"did you mean 'boxes'?"}}}) {
    expect_refused(command, words);
  }
  // Nothing is near to these: of short ones too most letters have to be right, and dashes are none.
  for (const char* command : {"run s.json --zzzzzzzzzz", "--seed 3", "check r --sead 3", "run s.json --abcd"}) {
    expect_refused(command, {"has no such option"});
    EXPECT_EQ(cutproof(command).output.find("did you mean"), std::string::npos) << command;
  }
}

TEST_F(Options, SayWhichOneIsGivenTwice) {
  for (const auto& [command, words] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"run s.json --json a --json b", {"--json: it is given twice", "give it once"}},
           {"run s.json --frames 1 --frames 1 --frames 1", {"--frames: it is given 3 times"}},
           {"run s.json --check motion --check topology", {"--check: it is given twice"}},
           {"bench solver --samples 3 --samples 4", {"--samples: it is given twice"}},
           {"judge x.so --seed 1 --seed 2", {"--seed: it is given twice"}}}) {
    expect_refused(command, words);
    EXPECT_EQ(cutproof(command).output.find("equired"), std::string::npos) << command;
  }
  EXPECT_EQ(cutproof("run s.json --set seed=1 --set frame.count=1").status, 0) << "this one is for many";
  expect_refused("run s.json --json", {"--json"});
}

TEST_F(Options, SayRangesInWordsAndTakeNoNumberForAnother) {
  for (const auto& [command, words] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"fuzz --cases -1", {"--cases: must be a whole number from 0", "'-1'"}},
           {"fuzz --cases 1.5", {"--cases: must be a whole number"}},
           {"fuzz --cases 0x10", {"--cases: must be a whole number"}},
           {"fuzz --cases 010", {"--cases: must be a whole number", "begins with 0"}},
           {"fuzz --cases 1e3", {"--cases: must be a whole number"}},
           {"fuzz --cases 99999999999999999999", {"too large"}},
           {"fuzz --seed -1", {"--seed: must be a whole number from 0 to 18446744073709551615"}},
           {"fuzz --seed 18446744073709551616", {"--seed", "too large"}},
           {"fuzz --schedule-seed 18446744073709551616", {"--schedule-seed", "too large"}},
           {"run s.json --seed -1", {"--seed"}},
           {"run s.json --seed 18446744073709551616", {"--seed"}},
           {"fuzz --batch 0", {"--batch: must be a whole number from 1 to 100000"}},
           {"fuzz --seconds nan", {"--seconds: must be a finite number from 0 up"}},
           {"fuzz --seconds inf", {"--seconds: must be a finite number from 0 up"}},
           {"fuzz --seconds 0x1p3", {"--seconds: must be a finite number"}},
           {"fuzz --shrink nan", {"--shrink"}},
           {"judge x.so --time-limit nan", {"--time-limit: must be a number from 0.01 to 1e+06"}},
           {"judge x.so --seconds inf", {"--seconds"}},
           {"tune s.json --tolerance nan", {"--tolerance: must be a finite number above 0"}},
           {"tune s.json --tolerance inf", {"--tolerance"}},
           {"run s.json --spacing nan", {"--spacing: must be a finite number above 0"}},
           {"run s.json --frames 99999999999999999999", {"--frames: must be a whole number from 0 up"}},
           {"bench stages --sizes 0x400", {"--sizes"}},
           {"bench solver --stiffness nan", {"--stiffness"}},
           {"bench solver --particles 1e3", {"--particles"}},
           {"bench rotations --seed 18446744073709551616", {"--seed"}}}) {
    expect_refused(command, words);
    const std::string said = cutproof(command).output;
    EXPECT_EQ(said.find("000000000000000000000"), std::string::npos) << said;
  }
  EXPECT_EQ(standard_output_of("run s.json --seed 18446744073709551615 --json -").at("seed"), UINT64_MAX);
}

TEST_F(Options, WriteADocumentToStandardOutputAloneAndTheRestToStandardError) {
  EXPECT_EQ(standard_output_of("run s.json --check --json -").at("format"), "cutproof.run");
  EXPECT_NE(read("error").find("everything holds"), std::string::npos) << read("error");
  EXPECT_EQ(read("error").find("wrote -"), std::string::npos);
  ASSERT_EQ(cutproof("run s.json --record seen").status, 0);
  EXPECT_EQ(standard_output_of("check seen --json -").at("format"), "cutproof.check");
  EXPECT_EQ(standard_output_of("fuzz --cases 20 --json -").at("format"), "cutproof.fuzz");
  EXPECT_EQ(standard_output_of("bench machine_limits --repeats 1 --json -").at("complete"), true);
  EXPECT_EQ(standard_output_of("tune s.json --tolerance 0.5 --repeats 1 --json -").at("complete"), true);
  EXPECT_TRUE(cutproof("run s.json --check --junit - 2> error #").output.starts_with("<?xml"));
  EXPECT_FALSE(files::exists(path("-")));
  expect_refused("run s.json --check --json - --junit -", {"--junit", "--json"});
  for (const char* output : {"run s.json --record -", "vectors split --cases 1 -o -", "fuzz --cases 5 --save -",
                             "tune s.json --tolerance 0.5 --write -"}) {
    expect_refused(output, {"standard output", "./-"});
  }
  EXPECT_EQ(cutproof("run s.json --json ./-").status, 0);
  EXPECT_TRUE(files::exists(path("-")));
  if (files::exists("/dev/full")) {
    EXPECT_EQ(cutproof("fuzz --cases 5 --json - 2> error > /dev/full; exit $? #").status, 3);
  }
}

TEST_F(Options, ChangeAnyFieldOfAScene) {
  ASSERT_EQ(cutproof("run s.json --record seen --set step.iterations=3 --set step.acceleration=none "
                     "--set 'step.gravity=[0,0,-1]' --set walls[0].friction=0.25 --set 'name=\"other\"'")
                .status,
            0);
  const json document = standard_output_of(
      "run s.json --set name=one --set name=two --set body.spacing=0.005 --particles 27 --seed 7 --json -");
  EXPECT_EQ(document.at("scene"), "two") << "the last counts";
  EXPECT_EQ(document.at("seed"), 7);
  EXPECT_EQ(document.at("changes"),
            json({"--set name=one", "--set name=two", "--set body.spacing=0.005", "--particles 27", "--seed 7"}));
  EXPECT_EQ(document.at("body").at("particles"), 27) << "--particles comes after --set";
  // The scene that a recording keeps is the one that was run.
  EXPECT_EQ(standard_output_of("check seen --json -").at("scene"), "other");
  EXPECT_DOUBLE_EQ(standard_output_of("run s.json --spacing 0.005 --json -").at("body").at("spacing"), 0.005);
  const json tuned = standard_output_of(
      "tune s.json --set step.iterations=3 --spacing 0.01 --seed 2 --tolerance 0.5 --repeats 1 --json -");
  EXPECT_EQ(tuned.at("changes"), json({"--set step.iterations=3", "--spacing 0.01", "--seed 2"}));
  EXPECT_EQ(tuned.at("trials").at(0).at("iterations"), 3);
}

TEST_F(Options, SayWhichChangeOfASceneIsWrong) {
  for (const auto& [change, words] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"--set step.iterations=-1", {"cutproof: --set step.iterations=-1: step.iterations: ", "out of bounds"}},
           {"--set step.iteration=8", {"--set step.iteration=8: ", "Did you mean \"iterations\"?"}},
           {"--set step.iterations=many", {"--set step.iterations=many", "the text \"many\""}},
           {"--set step.iterations=nan", {"--set step.iterations=nan", "the text \"nan\""}},
           {"--set step.stiffness=1e999", {"--set step.stiffness=1e999", "finite"}},
           {"--set 'step.gravity=[0,0'", {"--set step.gravity=[0,0", "not valid JSON"}},
           {"--set step.gravity=[0,0]", {"--set step.gravity=[0,0]", "three numbers"}},
           {"--set walls[1].offset=0", {"--set walls[1].offset=0", "the list has 1"}},
           {"--set name.first=x", {"--set name.first=x", "string"}},
           {"--set name[0]=x", {"--set name[0]=x", "not a list"}},
           {"--set step..iterations=8", {"--set step..iterations=8", "not a path"}},
           {"--set step.=8", {"not a path"}},
           {"--set step[x]=8", {"not a path"}},
           {"--set version=9", {"--set version=9", "only version 5 is read"}},
           {"--set step.iterations", {"--set", "step.iterations", "value"}},
           {"--set =8", {"--set", "value"}},
           {"--set body.particles=10", {"s.json with --set body.particles=10", "Both spacing and particles"}},
           {"--particles 10 --spacing 0.01", {"--spacing", "--particles"}},
           {"--particles 10", {"cutproof: --particles 10: body.particles: ", "the nearest counts are"}},
           {"--spacing 1e-9", {"cutproof: --spacing 1e-09: body.spacing", "memory"}}}) {
    expect_refused("run s.json " + change, words);
    expect_refused("tune s.json --tolerance 0.5 " + change, words);
  }
}

// A scene that was made for its own body does not fit every other.
TEST_F(Options, DoNotBlameASceneForAMesh) {
  write("cube.off",
        "OFF\n8 12 0\n0 0 0\n40 0 0\n40 40 0\n0 40 0\n0 0 40\n40 0 40\n40 40 40\n0 40 40\n3 0 2 1\n3 0 3 2\n"
        "3 4 5 6\n3 4 6 7\n3 0 1 5\n3 0 5 4\n3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n3 3 4 7\n");
  expect_refused("run s.json --mesh cube.off --particles 5", {"cutproof: cube.off in place of the body of s.json: "});
}

// What a remedy says that `cutproof info` lists.
TEST_F(Options, AreListedByInfo) {
  const std::string info = cutproof("info").output;
  for (const char* word : {"reference", "host-blocks", "plugin:FILE.so", "round_robin", "topology", "motion",
                           "conservation", "rotations, components", "connected", "version 5"}) {
    EXPECT_NE(info.find(word), std::string::npos) << "no '" << word << "' in:\n" << info;
  }
  EXPECT_NE(cutproof("info --scene").output.find("iterations"), std::string::npos);
}

TEST_F(Options, NameTheVersionAlikeInEveryDocument) {
  ASSERT_EQ(cutproof("run s.json --record seen").status, 0);
  for (const char* command : {"run s.json", "check seen", "fuzz --cases 5", "bench machine_limits --repeats 1",
                              "tune s.json --tolerance 0.5 --repeats 1"}) {
    const json document = standard_output_of(std::string(command) + " --json -");
    EXPECT_TRUE(document.at("cutproof").is_string()) << command;
    EXPECT_FALSE(document.contains("version")) << command;
  }
}

// --- What shells and man show ----------------------------------------------------------------------------------------

TEST_F(Options, AreOfferedByBash) {
  write("a scene.json", kScene);
  files::create_directory(folder_ / "afolder");
  for (const auto& [words, offered] :
       std::vector<std::pair<std::string, std::string>>{{"cutproof r", "run relate replay report"},
                                                        {"cutproof run --fr", "--frames"},
                                                        {"cutproof run --backend host-", "host-blocks"},
                                                        {"cutproof run --backend = sim", "simulated"},
                                                        {"cutproof fuzz --schedule f", "forward"},
                                                        {"cutproof bench so", "solver"},
                                                        {"cutproof bench solver --st", "--stiffness"},
                                                        {"cutproof tune x.json --reference ''", "limit substeps"},
                                                        {"cutproof vectors s", "surface split"},
                                                        {"cutproof run --unit ''", "mm cm m"},
                                                        {"cutproof run kidney_a", "kidney_arc"},
                                                        {"cutproof run a", "a scene.json afolder"},
                                                        {"cutproof fuzz --save a", "afolder"},
                                                        {"cutproof fuzz --cases ''", ""},
                                                        {"cutproof info --c", "--completion --color"},
                                                        {"cutproof fuzz --dynamics --se", "--seconds --seed"}}) {
    const std::string said = words_offered(words);
    if (words == "cutproof run a") {
      EXPECT_NE(said.find("a scene.json"), std::string::npos) << said;
      EXPECT_NE(said.find("afolder"), std::string::npos) << said;
    } else {
      EXPECT_EQ(said, offered + "\n") << words;
    }
  }
  expect_refused("info --completion csh", {"csh", "bash, zsh, fish"});
}

// Held against the help of each verb and suite, which is not made from the same tables: whatever it lists is offered
// there, and nothing else.
TEST_F(Options, AreOfferedByZshAndFish) {
  const std::string zsh = standard_output("info --completion zsh"), fish = standard_output("info --completion fish");
  EXPECT_TRUE(zsh.starts_with("#compdef cutproof\n"));
  int suites = 0, options = 0;
  std::vector<std::string> commands = {""};
  for (std::size_t k = 0; k < commands.size(); ++k) {
    const std::string command = commands[k];
    const std::string help = standard_output(command + " --help");
    const std::set<std::string> below =
        matches(help.substr(std::min(help.find("\nSubcommands:"), help.size())), "\n  ([a-z][a-z_-]*)");
    const std::set<std::string> listed = command.empty() ? matches(help.substr(help.find("\nOptions:")), "--([a-z-]+)")
                                                         : matches(help, "\n  (?:-[a-zA-Z],)?--([a-z-]+)");
    EXPECT_TRUE(listed.contains("quiet")) << command << "\n" << help;
    for (const std::string& each : below) commands.push_back(command.empty() ? each : command + " " + each);
    suites += command == "bench" ? static_cast<int>(below.size()) : 0;
    options += static_cast<int>(listed.size());

    const std::string line = line_of(zsh, "    '" + command + "') flags='");
    EXPECT_EQ(matches(line.substr(0, line.find(" below=")), "--([a-z-]+)"), listed) << command << ": " << line;
    EXPECT_EQ(matches(line.substr(std::min(line.find(" below="), line.size())), "[' ]([a-z][a-z_-]*)(?=[' ])"), below)
        << command << ": " << line;

    const std::string here = "complete -c cutproof -n \"__cutproof_at '" + command + "'\"";
    EXPECT_EQ(matches(fish, "\n" + here + "(?: -s [a-zA-Z])? -l ([a-z-]+)"), listed) << command;
    EXPECT_EQ(matches(fish, "\n" + here + " -f -a ([a-z][a-z_-]*) "), below) << command;
  }
  EXPECT_GE(commands.size(), 12u) << "verbs";
  EXPECT_GE(suites, 5);
  EXPECT_GE(options, 100);
  // What comes after: words that an option knows, files, folders, a number of which nobody knows anything.
  for (const char* words :
       {"    'fuzz --backend') offered='reference host ", "    'fuzz --save') kind=folder ;;\n",
        "    'fuzz --cases') kind=none ;;\n", "    'info --completion') offered='bash zsh fish' ;;\n"}) {
    EXPECT_NE(zsh.find(words), std::string::npos) << words;
  }
  for (const char* words :
       {" -l backend -r -f -a 'reference host ", " -l save -r -f -a '(__fish_complete_directories)'",
        " -l cases -r -f -d ", " -l completion -r -f -a 'bash zsh fish'", " -l json -r -F"}) {
    EXPECT_NE(fish.find(words), std::string::npos) << words;
  }
}

// By the shells themselves, where there are any.
class OptionsInShell : public Options, public testing::WithParamInterface<const char*> {};
TEST_P(OptionsInShell, AreWrittenAsItReads) {
  const std::string shell = GetParam();
  if (cutproof("--version > version; command -v " + shell + " #").status != 0) GTEST_SKIP() << "there is no " << shell;
  ASSERT_EQ(cutproof("info --completion " + shell + " > script").status, 0);
  const Outcome parsed = cutproof("--version > version; " + shell + " -n script 2>&1 #");
  EXPECT_EQ(parsed.status, 0) << parsed.output;
  EXPECT_EQ(parsed.output, "");
  write("script", read("script") + "\nif case (\n");
  EXPECT_NE(cutproof("--version > version; " + shell + " -n script 2>&1 #").status, 0) << "it reads this, too";
}
INSTANTIATE_TEST_SUITE_P(Each, OptionsInShell, testing::Values("bash", "zsh", "fish"),
                         [](const auto& shell) { return std::string(shell.param); });

TEST_F(Options, StandOnAManualPageWithoutWarnings) {
  ASSERT_EQ(cutproof("info --man > cutproof.1").status, 0);
  // The redirection stands before the #, or warnings would go elsewhere and none be seen.
  const auto warnings = [&](const std::string& page) {
    const Outcome outcome = cutproof("--version > version; groff -man -Tutf8 -ww -z " + page + " 2>&1 #");
    EXPECT_EQ(outcome.status, 0) << outcome.output;
    return outcome.output;
  };
  EXPECT_EQ(warnings("cutproof.1"), "");
  write("broken.1", read("cutproof.1") + "\\*[no_such_string]\n");
  EXPECT_NE(warnings("broken.1").find("no_such_string"), std::string::npos) << "groff tells what is wrong here";
  const std::string page = cutproof("--version > version; groff -man -Tutf8 -P-bcou -rLL=80n cutproof.1 #").output;
  for (const char* word :
       {"cutproof tune SCENE", "--set FIELD=V", "cutproof bench solver", "--stiffness", "EXIT STATUS"}) {
    EXPECT_NE(page.find(word), std::string::npos) << word << "\n" << page.substr(0, 2000);
  }
  EXPECT_EQ(page.find("\\["), std::string::npos);
}

}  // namespace
}  // namespace options_test
