// The program, ended from outside at any moment: what it leaves, what it says, and its status.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "tests/cli/program.h"

namespace {

using nlohmann::json;

constexpr const char* kScene = R"({"version": 2, "name": "falling",
  "body": {"shape": {"kind": "box", "size": [0.05, 0.03, 0.03]}, "spacing": 0.005}, "frame": {"count": 20},
  "step": {"gravity": [0, 0, -9.81]}})";

constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT};

class Interrupted : public Program {
 protected:
  void TearDown() override {
    if (process_ > 0) end(SIGKILL);
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
    process_ = fork();
    ASSERT_GE(process_, 0);
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
  // For what shows that the program is where it is to be met.
  void wait_until(const std::function<bool()>& there) {
    const auto last = std::chrono::steady_clock::now() + std::chrono::seconds(120);
    while (!there()) {
      ASSERT_EQ(waitpid(process_, &status_, WNOHANG), 0) << "it has ended: " << read("out") << read("error");
      ASSERT_LT(std::chrono::steady_clock::now(), last) << read("out") << read("error");
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
  // The status as a shell has it.
  int end(int signal) {
    kill(process_, signal);
    return ended();
  }
  int ended() {
    waitpid(process_, &status_, 0);
    process_ = -1;
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
  bool has_printed(const std::string& text) const {
    std::istringstream words(read("out"));
    std::string printed;
    for (std::string word; words >> word;) printed += (printed.empty() ? "" : " ") + word;
    return printed.find(text) != std::string::npos;
  }
  // A number of trials or rows, of a document that is replaced as it grows.
  std::size_t count(const char* list) const {
    return files::exists(path("out.json")) ? json::parse(read("out.json")).at(list).size() : 0;
  }

  pid_t process_ = -1;
  int status_ = 0;
};

TEST_F(Interrupted, ARecordingInTheMiddleLeavesNothingAndEndsAtOnce) {
  for (const int signal : kSignals) {
    start("run " + scene("kidney_discontinuous") + " --check --record seen --json out.json");
    wait_until([&] { return unfinished().size() == 4; });
    EXPECT_EQ(end(signal), 128 + signal);
    EXPECT_EQ(listing(), (std::set<std::string>{"out", "error"})) << "after signal " << signal;
    EXPECT_EQ(read("error"), "");
  }
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
    wait_until([&] { return has_printed("fuzzing backend"); });
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
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
  wait_until([&] { return has_printed("fuzzing backend"); });
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_EQ(end(SIGTERM), 128 + SIGTERM);
  start("fuzz --cases 100000000 --sizes 0-30 --shard 2/2 --json 2.json");
  wait_until([&] { return has_printed("fuzzing backend"); });
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
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
  EXPECT_EQ(listing(), (std::set<std::string>{"out", "error", "out.json", "falling.json"}));
}

// The reference solution of a long scene takes minutes, and is a loop of its own.
TEST_F(Interrupted, TuneStopsBeforeItsReferenceSolutionIsKnown) {
  start("tune " + scene("kidney_discontinuous") + " --tolerance 0.0001 --json out.json");
  wait_until([&] { return has_printed("scene kidney_discontinuous"); });
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(end(SIGTERM), 128 + SIGTERM);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
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

// A guest that hangs ends with its host, which is not reached by the terminal's signals.
TEST_F(Interrupted, JudgeWritesWhatItHas) {
  start("judge " CUTPROOF_EXAMPLE_PLUGIN " --cases 100000000 --json out.json --junit out.xml --save kept");
  wait_until([&] { return has_printed("precision, on the host"); });
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
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

TEST_F(Interrupted, TheTerminalsSignalIsForTheHostAndNotForItsGuest) {
  // A group of its own, as a shell makes one; all of it gets what a terminal sends.
  start("judge " CUTPROOF_EXAMPLE_PLUGIN " --cases 100000000 --json out.json", [] { setpgid(0, 0); });
  wait_until([&] { return has_printed("precision, on the host"); });
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  kill(-process_, SIGINT);
  EXPECT_EQ(ended(), 128 + SIGINT);
  EXPECT_EQ(json::parse(read("out.json")).at("operations").at(0).at("failed"), 0) << read("out.json");
}

// The first signal waits for the guest's answer, which does not come; the second does not.
TEST_F(Interrupted, ASecondSignalEndsItAtOnceAndTheGuestToo) {
  start("judge " CUTPROOF_HANGING_PLUGIN " --time-limit 100 --json out.json --parameters hang");
  wait_until([&] { return has_printed("precision, on the host"); });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  std::string children;
  std::getline(std::ifstream("/proc/" + std::to_string(process_) + "/task/" + std::to_string(process_) + "/children"),
               children);
  const pid_t guest = std::stoi(children);
  ASSERT_GT(guest, 0);
  kill(process_, SIGTERM);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ASSERT_EQ(waitpid(process_, &status_, WNOHANG), 0) << "it waits for the guest";
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(end(SIGINT), 128 + SIGINT);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
  EXPECT_TRUE(unfinished().empty());
  // Gone, or the dead child of whoever adopts orphans here.
  const auto is_gone = [&] {
    std::ifstream stat("/proc/" + std::to_string(guest) + "/stat");
    const std::string text((std::istreambuf_iterator<char>(stat)), {});
    return text.empty() || text.find(") Z ") != std::string::npos;
  };
  const auto last = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!is_gone() && std::chrono::steady_clock::now() < last)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_TRUE(is_gone()) << "the guest outlives its host";
}

TEST_F(Interrupted, WhatNobodyReadsAnyMoreEndsQuietly) {
  for (const char* command : {"info", "info --scene", "--help", "fuzz --help"}) {
    const Outcome outcome =
        cutproof(std::string(command) + " 2> error | head -c 1 > first; sleep 0.1; cat error; echo \"[$?]\" #");
    EXPECT_EQ(outcome.output, "[0]\n") << command;
    EXPECT_EQ(read("first").size(), 1u) << command;
  }
  // What a campaign has found is written all the same.
  const Outcome outcome =
      cutproof("fuzz --seconds 2 --sizes 0-30 --keep-going --json out.json 2> error | head -n 1 > first; cat error #");
  EXPECT_EQ(outcome.output, "");
  EXPECT_TRUE(unfinished().empty());
  EXPECT_TRUE(json::parse(read("out.json")).contains("complete"));
  // Where only a run's end is printed to nobody, its files are whole.
  write("falling.json", kScene);
  EXPECT_EQ(cutproof("run falling.json --check --json run.json 2>&1 | head -n 1 > first #").output, "");
  EXPECT_TRUE(json::parse(read("run.json")).at("summary").at("holds"));
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
  wait_until([&] { return has_printed("fuzzing backend"); });
  kill(process_, SIGHUP);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ASSERT_EQ(waitpid(process_, &status_, WNOHANG), 0);
  EXPECT_EQ(end(SIGTERM), 128 + SIGTERM);
}

// --- --save ----------------------------------------------------------------------------------------------------------

TEST_F(Interrupted, SaveMakesItsFolderAndRefusesWhatCannotBeOneBeforeTheRun) {
  write("file", "");
  for (const std::string& verb : {std::string("fuzz --cases 5"), std::string("judge " CUTPROOF_EXAMPLE_PLUGIN)}) {
    expect_refused(verb + " --save file", {"--save", "file"});
    expect_refused(verb + " --save file/below", {"--save", "file/below"});
    if (geteuid() != 0) expect_refused(verb + " --save /proc/new", {"--save", "/proc/new"});
  }
  EXPECT_EQ(cutproof("fuzz --cases 5 --sizes 0-10 --save new/folder").status, 0);
  EXPECT_TRUE(files::is_directory(path("new/folder")));
}

}  // namespace
