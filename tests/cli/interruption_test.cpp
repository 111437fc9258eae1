// The program, ended from outside at any moment: what it leaves, what it says, and its status.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <thread>

#include "tests/program.h"

namespace interruption_test {
namespace {

using nlohmann::json;

constexpr const char* kScene = R"({"version": 5, "name": "falling",
  "body": {"shape": {"kind": "box", "size": [0.05, 0.03, 0.03]}, "spacing": 0.005}, "frame": {"count": 20},
  "step": {"gravity": [0, 0, -9.81]}})";

constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT};

// Who takes so long hangs. No test asks whether something is faster.
constexpr std::chrono::seconds kHangs{120};
// Of its processor a campaign has used so much once it is in the middle of its cases.
constexpr double kInTheMiddle = 1;  // [s]

// Whatever is waited for.
void wait_for(const std::function<bool()>& there, const std::function<std::string()>& else_say) {
  const auto last = std::chrono::steady_clock::now() + kHangs;
  while (!there()) {
    if (std::chrono::steady_clock::now() > last) throw std::runtime_error("it hangs: " + else_say());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

// What a process and its threads have used of processors [s], however long that took; 0 of one that is gone.
double processor_seconds(pid_t process) {
  clockid_t clock = {};
  timespec used = {};
  if (clock_getcpuclockid(process, &clock) != 0 || clock_gettime(clock, &used) != 0) return 0;
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

// Of /proc/N/FILE; empty of a process that is gone.
std::string told_by_the_system(pid_t process, const std::string& file) {
  std::ifstream stream("/proc/" + std::to_string(process) + "/" + file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class Interrupted : public Program {
 protected:
  void TearDown() override {
    if (process_ > 0) {  // a test has ended before it
      kill(process_, SIGKILL);
      waitpid(process_, &status_, 0);
    }
    Program::TearDown();
  }

  // `arguments`: separated by blanks. What it prints goes into the files `out` and `error`. `prepare` is run in the new
  // process.
  void start(const std::string& arguments, const std::function<void()>& prepare = {}) {
    std::vector<std::string> words = {CUTPROOF_PROGRAM};
    std::istringstream stream(arguments);
    for (std::string word; stream >> word;) words.push_back(word);
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    // Of the program before it, which would be taken for those of this one as long as it has not opened them.
    files::remove(path("out"));
    files::remove(path("error"));
    process_ = fork();
    if (process_ < 0) throw std::runtime_error("fork");
    if (process_ != 0) return;
    bool fine = chdir(folder_.c_str()) == 0;
    for (const int signal : kSignals) ::signal(signal, SIG_DFL);
    for (const auto& [file, name] : {std::pair{1, "out"}, {2, "error"}}) {
      const int opened = open(name, O_CREAT | O_TRUNC | O_WRONLY, 0600);
      fine = fine && dup2(opened, file) == file;
    }
    if (prepare) prepare();
    if (fine) execv(argv[0], argv.data());
    _exit(127);
  }
  // For what shows that the program is where it is to be met. Throws if it ends before.
  void wait_until(const std::function<bool()>& there) {
    const auto printed = [&] { return read("out") + read("error"); };
    wait_for(
        [&] {
          if (there()) return true;
          if (has_ended()) throw std::runtime_error("it has ended: " + printed());
          return false;
        },
        printed);
  }
  void wait_until_in_the_middle() {
    wait_until([&] { return processor_seconds(process_) > kInTheMiddle; });
  }
  bool has_ended() {
    if (process_ > 0 && waitpid(process_, &status_, WNOHANG) == process_) process_ = -1;
    return process_ < 0;
  }
  // kill(-1) would end everything.
  void send(int signal) const {
    if (process_ <= 0) throw std::logic_error("there is no program to send a signal to");
    kill(process_, signal);
  }
  // The status as a shell has it.
  int end(int signal) {
    send(signal);
    return ended();
  }
  int ended() {
    wait_for([&] { return has_ended(); }, [&] { return read("out") + read("error"); });
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  }
  std::vector<std::string> unfinished(const files::path& inside = "") const {
    std::vector<std::string> found;
    for (const auto& entry : files::directory_iterator(folder_ / inside)) {
      const std::string name = entry.path().filename().string();
      if (name.ends_with(".tmp")) found.push_back(name);
    }
    return found;
  }
  // However its lines are broken.
  bool has_printed(const std::string& text) const { return on_one_line(read("out")).find(text) != std::string::npos; }
  // A number of trials or rows, of a document that is replaced as it grows.
  std::size_t count(const char* list) const {
    return files::exists(path("out.json")) ? json::parse(read("out.json")).at(list).size() : 0;
  }

  pid_t process_ = -1;
  int status_ = 0;
};

TEST_F(Interrupted, RunKeepsWhatItHasJudgedAndSaysHowFarItCame) {
  for (const int signal : kSignals) {
    start("run " + scene("kidney_discontinuous") + " --check --record seen --json out.json --junit out.xml");
    wait_until_in_the_middle();
    EXPECT_EQ(end(signal), 128 + signal);
    EXPECT_EQ(read("error"), "");
    const json document = json::parse(read("out.json"));
    const std::string frames = std::to_string(document.at("frames").size());
    EXPECT_FALSE(document.at("complete"));
    EXPECT_FALSE(document.at("summary").at("holds"));
    EXPECT_EQ(document.at("summary").at("failed"), 0) << "what is not reached is no failure";
    EXPECT_GT(document.at("verdicts").size(), 10u);
    EXPECT_THAT(document.at("not_reached").get<std::vector<std::string>>(), testing::Contains("components at the end"));
    EXPECT_TRUE(has_printed("it was stopped after " + frames + " of 94 frames")) << read("out");
    EXPECT_FALSE(has_printed("FAILS") || has_printed("verything holds")) << read("out");
    EXPECT_NE(read("out.xml").find("<error message=\"it was stopped after " + frames), std::string::npos);
    EXPECT_TRUE(unfinished().empty());
  }
  const Outcome judged = cutproof("check seen --check topology");
  EXPECT_EQ(judged.status, 1);
  EXPECT_NE(judged.output.find("FAILS: the run is whole"), std::string::npos) << judged.output;
}

// The first one waits for the end of a frame, which is far.
TEST_F(Interrupted, ASecondSignalEndsARunAtOnceAndLeavesNothing) {
  start("run " + scene("small_block") +
        " --record seen --json out.json --set step.substeps=100000 --set step.iterations=1000");
  wait_until([&] { return unfinished().size() == 4 && has_printed("long work"); });
  send(SIGINT);
  EXPECT_EQ(end(SIGTERM), 128 + SIGTERM);
  EXPECT_EQ(listing(), (std::set<std::string>{"out", "error"}));
}

TEST_F(Interrupted, WhatAKilledRecordingLeftIsGoneAfterTheNextOutputThere) {
  start("run " + scene("kidney_discontinuous") + " --check --record seen");
  wait_until([&] { return unfinished().size() == 4; });
  EXPECT_EQ(end(SIGKILL), 128 + SIGKILL);
  EXPECT_EQ(unfinished().size(), 4u);
  const Outcome next = cutproof("vectors split -o split.npz --cases 1");
  EXPECT_EQ(next.status, 0) << next.output;
  EXPECT_EQ(listing(), (std::set<std::string>{"out", "error", "split.npz"}));
}

// Those of a program that still runs are its own.
TEST_F(Interrupted, WhatALivingProgramWritesIsNotTouchedByAnother) {
  start("run " + scene("kidney_discontinuous") + " --record seen");
  wait_until([&] { return unfinished().size() == 4; });
  EXPECT_EQ(cutproof("vectors split -o split.npz --cases 1").status, 0);
  EXPECT_EQ(unfinished().size(), 4u);
  EXPECT_EQ(end(SIGTERM), 128 + SIGTERM);
}

TEST_F(Interrupted, FuzzWritesWhatItHasAndSaysHowFarItCame) {
  for (const int signal : kSignals) {
    start("fuzz --cases 100000000 --sizes 0-30 --json out.json --junit out.xml --save cases/new");
    wait_until_in_the_middle();
    EXPECT_EQ(end(signal), 128 + signal);
    const json document = json::parse(read("out.json"));
    EXPECT_FALSE(document.at("complete"));
    EXPECT_FALSE(document.at("holds"));
    EXPECT_GT(document.at("cases"), 0);
    EXPECT_GT(document.at("verdicts"), 0);
    EXPECT_TRUE(has_printed("it was stopped after " + std::to_string(document.at("cases").get<int64_t>()) +
                            " of 100000000 cases"))
        << read("out");
    EXPECT_FALSE(has_printed("all hold") || has_printed("FAILS")) << read("out");
    EXPECT_NE(read("out.xml").find("it was stopped after"), std::string::npos);
    EXPECT_TRUE(unfinished().empty());
    files::remove(path("out.json"));
  }
  EXPECT_TRUE(files::is_directory(path("cases/new"))) << "the folder for counterexamples is made before the run";
}

// Shards that were stopped are to be run again.
TEST_F(Interrupted, AStoppedShardIsMissingFromTheWhole) {
  start("fuzz --cases 100000000 --sizes 0-30 --shard 1/2 --json 1.json");
  wait_until_in_the_middle();
  EXPECT_EQ(end(SIGTERM), 128 + SIGTERM);
  start("fuzz --cases 100000000 --sizes 0-30 --shard 2/2 --json 2.json");
  wait_until_in_the_middle();
  EXPECT_EQ(end(SIGTERM), 128 + SIGTERM);
  // The second as if it had come to its end.
  json second = json::parse(read("2.json"));
  second["complete"] = true;
  write("2.json", second.dump());
  const Outcome merged = cutproof("fuzz --merge 1.json 2.json --json whole.json");
  EXPECT_EQ(merged.status, 1) << merged.output;
  EXPECT_NE(merged.output.find("INCOMPLETE: missing 1;"), std::string::npos) << merged.output;
  const json whole = json::parse(read("whole.json"));
  EXPECT_FALSE(whole.at("complete"));
  EXPECT_EQ(whole.at("missing_shards"), json({1}));
  EXPECT_EQ(whole.at("cases"),
            json::parse(read("1.json")).at("cases").get<int64_t>() + second.at("cases").get<int64_t>())
      << "what was judged counts";
}

TEST_F(Interrupted, TuneWritesWhatItHasTried) {
  write("falling.json", kScene);
  start("tune falling.json --tolerance 0.5 --repeats 1000 --reference substeps --json out.json --write tuned.json");
  wait_until([&] { return count("trials") >= 1; });
  EXPECT_EQ(end(SIGINT), 128 + SIGINT);
  const json document = json::parse(read("out.json"));
  EXPECT_FALSE(document.at("complete"));
  EXPECT_TRUE(document.at("found").is_null());
  EXPECT_TRUE(has_printed("INCOMPLETE: it was stopped after " + std::to_string(count("trials")) + " configuration"))
      << read("out");
  // What has been tried says something already.
  EXPECT_FALSE(document.at("front").empty());
  EXPECT_TRUE(has_printed("the cheapest that was tried, by tolerance")) << read("out");
  EXPECT_EQ(listing(), (std::set<std::string>{"out", "error", "out.json", "falling.json"}));
}

// The reference solution of a long scene takes minutes, and is a loop of its own.
TEST_F(Interrupted, TuneStopsBeforeItsReferenceSolutionIsKnown) {
  start("tune " + scene("kidney_discontinuous") + " --tolerance 0.0001 --json out.json");
  wait_until([&] { return has_printed("scene kidney_discontinuous"); });
  EXPECT_EQ(end(SIGTERM), 128 + SIGTERM);
  EXPECT_TRUE(has_printed("INCOMPLETE: it was stopped before the first configuration was tried")) << read("out");
  EXPECT_FALSE(json::parse(read("out.json")).at("complete"));
}

TEST_F(Interrupted, BenchWritesTheRowsThatItHas) {
  start("bench scale --sizes 1000,1000,1000,1000,1000,1000,1000,1000,1000 --repeats 1 --json out.json");
  wait_until([&] { return count("rows") >= 1; });
  EXPECT_EQ(end(SIGTERM), 128 + SIGTERM);
  EXPECT_FALSE(json::parse(read("out.json")).at("complete"));
  EXPECT_TRUE(has_printed("INCOMPLETE: it was stopped after " + std::to_string(count("rows")) + " row")) << read("out");
  EXPECT_EQ(listing(), (std::set<std::string>{"out", "error", "out.json"}));
}

// All that there are, as the program names them: one that is new is asked too, with what it does when nothing is said.
TEST_F(Interrupted, EverySuiteOfBenchWritesItsDocumentHoweverEarly) {
  const std::map<std::string, std::string> few = {
      {"stages", "--sizes 1000,1000,1000,1000"},   {"scale", "--sizes 1000,1000,1000,1000"},
      {"sampling", "--frames 1 --repeats 1"},      {"clusters", "--particles 500"},
      {"machine_limits", "--repeats 300"},         {"baselines", "--particles 300"},
      {"solver", "--particles 0 --iterations 1,2"}};
  const std::string refusal = on_one_line(cutproof("bench").output);
  constexpr std::string_view kBefore = "use one of ";
  const std::size_t begin = refusal.find(kBefore);
  ASSERT_NE(begin, std::string::npos) << refusal;
  std::istringstream suites(refusal.substr(begin + kBefore.size()));
  int asked = 0;
  for (std::string suite; suites >> suite; ++asked) {
    suite.erase(std::remove(suite.begin(), suite.end(), ','), suite.end());
    start("bench " + suite + " --json out.json " + (few.contains(suite) ? few.at(suite) : ""));
    // Its head is printed before anything is measured.
    wait_until([&] { return !read("out").empty(); });
    EXPECT_EQ(end(SIGINT), 128 + SIGINT) << suite << ": " << read("out") << read("error");
    EXPECT_EQ(read("error"), "") << suite;
    ASSERT_TRUE(files::exists(path("out.json"))) << suite;
    const json document = json::parse(read("out.json"));
    EXPECT_EQ(document.at("suite"), suite);
    EXPECT_FALSE(document.at("complete")) << suite;
    EXPECT_TRUE(has_printed("INCOMPLETE: it was stopped after ")) << suite << ": " << read("out");
    files::remove(path("out.json"));
  }
  EXPECT_GE(asked, 10) << refusal;
}

// A guest that hangs ends with its host, which is not reached by the terminal's signals.
TEST_F(Interrupted, JudgeWritesWhatItHas) {
  start("judge " CUTPROOF_PLUGIN_IN_C " --cases 100000000 --json out.json --junit out.xml --save kept");
  wait_until_in_the_middle();
  EXPECT_EQ(end(SIGINT), 128 + SIGINT);
  const json document = json::parse(read("out.json"));
  EXPECT_FALSE(document.at("complete"));
  EXPECT_FALSE(document.at("holds"));
  const json& operation = document.at("operations").at(0);
  EXPECT_FALSE(operation.at("complete"));
  EXPECT_GT(operation.at("questions"), 0);
  EXPECT_EQ(operation.at("failed"), 0) << "that it was stopped is no fault of the plugin";
  EXPECT_TRUE(has_printed("INCOMPLETE: it was stopped")) << read("out");
  EXPECT_NE(read("out.xml").find("it was stopped"), std::string::npos);
  EXPECT_TRUE(files::is_directory(path("kept")));
}

TEST_F(Interrupted, JudgeOfStagesCountsThemAsAnOperation) {
  start("judge " CUTPROOF_PLUGIN_OF_STAGES " --cases 100000000 --json out.json");
  wait_until_in_the_middle();
  EXPECT_EQ(end(SIGINT), 128 + SIGINT);
  EXPECT_FALSE(json::parse(read("out.json")).at("complete"));
  EXPECT_TRUE(has_printed("INCOMPLETE: it was stopped after 1 of 1 operation was begun")) << read("out");
}

TEST_F(Interrupted, TheTerminalsSignalIsForTheHostAndNotForItsGuest) {
  // A group of its own, as a shell makes one; all of it gets what a terminal sends.
  start("judge " CUTPROOF_PLUGIN_IN_C " --cases 100000000 --json out.json", [] { setpgid(0, 0); });
  wait_until_in_the_middle();
  ASSERT_EQ(getpgid(process_), process_) << "or this would go to others";
  kill(-process_, SIGINT);
  EXPECT_EQ(ended(), 128 + SIGINT);
  EXPECT_EQ(json::parse(read("out.json")).at("operations").at(0).at("failed"), 0) << read("out.json");
}

// The first signal waits for the guest's answer, which does not come; the second does not.
TEST_F(Interrupted, ASecondSignalEndsItAtOnceAndTheGuestToo) {
  start("judge " CUTPROOF_PLUGIN_IN_C " --time-limit 100 --json out.json --parameters hang");
  pid_t guest = 0;
  // A guest that hangs here counts for ever, and does little before.
  wait_until([&] {
    const std::string children = told_by_the_system(process_, "task/" + std::to_string(process_) + "/children");
    guest = children.empty() ? 0 : std::stoi(children);
    return guest > 0 && processor_seconds(guest) > 0.5;
  });
  send(SIGTERM);
  // Of two signals that wait the system delivers the one of the lower number first.
  wait_until([&] {
    const std::string status = told_by_the_system(process_, "status");
    return status.find("\nShdPnd:\t0000000000000000\n") != std::string::npos;
  });
  // By the second: of the first alone, and of a guest out of time, it would have ended as by the first.
  EXPECT_EQ(end(SIGINT), 128 + SIGINT);
  EXPECT_TRUE(unfinished().empty());
  EXPECT_FALSE(files::exists(path("out.json"))) << "the second does not wait for anything";
  // Gone, or the dead child of whoever adopts orphans here.
  wait_for(
      [&] {
        const std::string stat = told_by_the_system(guest, "stat");
        return stat.empty() || stat.find(") Z ") != std::string::npos;
      },
      [] { return std::string("the guest outlives its host"); });
}

// A pipe whose reading end is closed before the program begins: whatever it writes, the first is too late.
class InAClosedPipe : public Interrupted {
 protected:
  void start_in_closed_pipe(const std::string& arguments, const std::function<void()>& prepare = {}) {
    std::array<int, 2> ends = {};
    if (pipe(ends.data()) != 0) throw std::runtime_error("pipe");
    close(ends[0]);
    start(arguments, [&] {
      dup2(ends[1], STDOUT_FILENO);
      if (prepare) prepare();
    });
    close(ends[1]);
  }
};

TEST_F(InAClosedPipe, WhatOnlyPrintsEndsQuietly) {
  for (const char* command : {"info", "info --scene", "--help", "--version", "fuzz --help"}) {
    start_in_closed_pipe(command);
    EXPECT_EQ(ended(), 128 + SIGPIPE) << command;
    EXPECT_EQ(read("error"), "") << command;
  }
}

// Also where it has inherited that PIPE is ignored, as from Python.
TEST_F(InAClosedPipe, ItEndsQuietlyWhateverItInherits) {
  start_in_closed_pipe("info", [] { signal(SIGPIPE, SIG_IGN); });
  EXPECT_EQ(ended(), 128 + SIGPIPE);
  EXPECT_EQ(read("error"), "");
}

// Nobody has asked for more than is there at the first line that nobody reads.
TEST_F(InAClosedPipe, WhatACampaignHasFoundIsWrittenAllTheSame) {
  start_in_closed_pipe("fuzz --cases 100000000 --sizes 0-30 --keep-going --json out.json");
  EXPECT_EQ(ended(), 128 + SIGPIPE);
  EXPECT_EQ(read("error"), "");
  EXPECT_TRUE(unfinished().empty());
  EXPECT_FALSE(json::parse(read("out.json")).at("complete"));
}

// A run prints when it has ended, and has written its files by then.
TEST_F(InAClosedPipe, TheFilesOfARunAreWhole) {
  write("falling.json", kScene);
  start_in_closed_pipe("run falling.json --check --json run.json");
  EXPECT_EQ(ended(), 128 + SIGPIPE);
  EXPECT_EQ(read("error"), "");
  EXPECT_TRUE(unfinished().empty());
  EXPECT_TRUE(json::parse(read("run.json")).at("summary").at("holds"));
}

// A reader that has read what it wanted.
TEST_F(Interrupted, WhatNobodyReadsAnyMoreEndsQuietly) {
  for (const char* command : {"info", "info --scene", "--help", "fuzz --help"}) {
    const Outcome outcome = cutproof(std::string(command) + " 2> error | head -c 1 > first #");
    EXPECT_EQ(outcome.status, 0) << command;
    EXPECT_EQ(read("first").size(), 1u) << command;
    EXPECT_EQ(read("error"), "") << command;
  }
}

TEST_F(Interrupted, ALimitOnTheSizeOfFilesIsAnErrorOfWriting) {
  start("run " + scene("small_block") + " --frames 8 --record seen", [] {
    const rlimit limit = {100'000, 100'000};
    setrlimit(RLIMIT_FSIZE, &limit);
  });
  EXPECT_EQ(ended(), 3);
  EXPECT_TRUE(unfinished().empty());
  EXPECT_TRUE(read("error").starts_with("cutproof: ")) << read("error");
  EXPECT_FALSE(files::exists(path("seen.cutproof.h5")));
}

// As nohup has it.
TEST_F(Interrupted, ASignalThatIsIgnoredFromTheBeginningStaysIgnored) {
  start("fuzz --cases 100000000 --sizes 0-20 --json out.json", [] { signal(SIGHUP, SIG_IGN); });
  wait_until_in_the_middle();
  send(SIGHUP);
  // Had it been taken for the first, this were the second, and nothing be written.
  EXPECT_EQ(end(SIGTERM), 128 + SIGTERM);
  EXPECT_TRUE(files::exists(path("out.json")));
}

// --- --save ----------------------------------------------------------------------------------------------------------

TEST_F(Interrupted, SaveMakesItsFolderAndRefusesWhatCannotBeOneBeforeTheRun) {
  write("file", "");
  for (const std::string& verb : {std::string("fuzz --cases 5"), std::string("judge " CUTPROOF_PLUGIN_IN_C)}) {
    expect_refused(verb + " --save file", {"--save", "file"});
    expect_refused(verb + " --save file/below", {"--save", "file/below"});
    // Nobody can, as root neither.
    expect_refused(verb + " --save /proc/new", {"--save", "/proc/new"});
  }
  EXPECT_EQ(cutproof("fuzz --cases 5 --sizes 0-10 --save new/folder").status, 0);
  EXPECT_TRUE(files::is_directory(path("new/folder")));
}

}  // namespace
}  // namespace interruption_test
