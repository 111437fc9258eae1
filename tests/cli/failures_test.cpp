// The program on a machine without enough memory, or without the GPU it is told to use: each allocation of a run on a
// small scene fails in turn. architecture.md, When the machine fails, says what is promised.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <vector>

#include "model/io/array_file.h"
#include "tests/cli/chosen_allocations.h"
#include "tests/cli/failing_allocations.h"
#include "tests/cut_scene.h"

namespace cutproof::tests::failures_test {
namespace {

namespace files = std::filesystem;
using nlohmann::json;

constexpr unsigned kMostSeconds = 60;  // beyond which a run hangs
constexpr int kStatusOfAKilled = 128;

constexpr const char* kOldJson = "what was there before\n";

using Files = std::map<std::string, std::string>;  // name -> content

struct Outcome {
  int status = -1;  // of exit; 128 + signal if it was killed
  std::string error;
  Files written;  // what was not there before the run, or is different
};

std::string read(const files::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}
void write(const files::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

Files contents(const files::path& folder) {
  Files found;
  for (const auto& entry : files::directory_iterator(folder)) found[entry.path().filename()] = read(entry.path());
  return found;
}

// --json without what depends on how fast the machine is.
json without_times(const std::string& text) {
  json document = json::parse(text);
  for (json& frame : document["frames"]) {
    frame.erase("seconds");
    frame.erase("total_seconds");
  }
  for (json& property : document["properties"]) property.erase("seconds");
  return document;
}

// One command, its files, and an AllocationControl in a file that the program and the test both map.
class Program {
 public:
  Program(const std::string& name, std::vector<std::string> arguments, Files given)
      : folder_(files::temp_directory_path() / ("cutproof." + name + "." + std::to_string(getpid()))),
        arguments_(std::move(arguments)),
        given_(std::move(given)) {
    files::create_directories(folder_);
    const int descriptor = open(control_file().c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    void* memory = MAP_FAILED;
    if (descriptor >= 0 && ftruncate(descriptor, sizeof(AllocationControl)) == 0) {
      memory = mmap(nullptr, sizeof(AllocationControl), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    }
    close(descriptor);
    if (memory == MAP_FAILED) throw std::system_error(errno, std::generic_category(), control_file());
    control_ = static_cast<AllocationControl*>(memory);
  }
  ~Program() {
    munmap(control_, sizeof(AllocationControl));
    files::remove_all(folder_);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  AllocationControl& control() { return *control_; }

  Outcome run() {
    const files::path inside = folder_ / "inside";
    files::remove_all(inside);
    files::create_directories(inside);
    for (const auto& [name, content] : given_) write(inside / name, content);
    Outcome outcome;
    outcome.status = execute(inside);
    outcome.error = read(folder_ / "stderr");
    for (auto& [name, content] : contents(inside)) {
      const auto before = given_.find(name);
      if (before == given_.end() || before->second != content) outcome.written[name] = content;
    }
    for (const auto& [name, content] : given_) {
      if (!files::exists(inside / name)) outcome.written[name] = "it was removed";
    }
    return outcome;
  }
  // With these allocations failing.
  Outcome run(uint64_t fail_at, uint64_t fail_count, int64_t limit) {
    new (control_) AllocationControl;
    control_->fail_at = fail_at;
    control_->fail_count = fail_count;
    control_->limit = limit;
    return run();
  }

 private:
  std::string control_file() const { return (folder_ / "control").string(); }

  int execute(const files::path& inside) const {
    std::vector<char*> arguments = {const_cast<char*>(CUTPROOF_PROGRAM)};
    for (const std::string& argument : arguments_) arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    const std::string control = control_file(), error = (folder_ / "stderr").string();
    const pid_t child = fork();
    if (child == 0) {
      const int to_error = open(error.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      const int to_nothing = open("/dev/null", O_WRONLY);
      if (chdir(inside.c_str()) != 0 || dup2(to_nothing, STDOUT_FILENO) < 0 || dup2(to_error, STDERR_FILENO) < 0) {
        _exit(126);
      }
      setenv(kControlVariable, control.c_str(), 1);
      setenv("LD_PRELOAD", CUTPROOF_FAILING_ALLOCATIONS, 1);
      setenv("CUDA_VISIBLE_DEVICES", "", 1);
      alarm(kMostSeconds);
      execv(CUTPROOF_PROGRAM, arguments.data());
      _exit(127);
    }
    int status = 0;
    if (child < 0 || waitpid(child, &status, 0) != child) throw std::system_error(errno, std::generic_category());
    return WIFEXITED(status) ? WEXITSTATUS(status) : kStatusOfAKilled + WTERMSIG(status);
  }

  files::path folder_;
  std::vector<std::string> arguments_;
  Files given_;
  AllocationControl* control_ = nullptr;
};

// What is wrong with how a run ended in which an allocation failed; empty: nothing.
std::string defect_of(const Outcome& outcome, const Outcome& undisturbed) {
  if (outcome.status == kStatusOfAKilled + SIGALRM) return "it hung";
  if (outcome.status > kStatusOfAKilled) return "signal " + std::to_string(outcome.status - kStatusOfAKilled);
  if (outcome.status != 3 && outcome.status != undisturbed.status) {
    return "exit status " + std::to_string(outcome.status);
  }
  if (outcome.status == 3) {
    const auto lines = std::count(outcome.error.begin(), outcome.error.end(), '\n');
    if (!outcome.error.starts_with("cutproof: ") || lines != 1 || !outcome.error.ends_with("\n")) {
      return "no single message";
    }
  } else if (outcome.error != undisturbed.error) {
    return "another message";
  }
  for (const auto& [name, content] : outcome.written) {
    const auto whole = undisturbed.written.find(name);
    if (whole == undisturbed.written.end()) return "it left " + name;
    if (!name.ends_with(".json")) {
      if (content != whole->second) return name + " is not what it should be";
    } else if (!json::accept(content) || without_times(content) != without_times(whole->second)) {
      return name + " is not what it should be";
    }
  }
  if (outcome.status != 3 && outcome.written.size() != undisturbed.written.size()) return "files are missing";
  return "";
}

// A file of arrays, as bytes: a row of four particles.
std::string state_file(const std::string& suffix) {
  io::ArrayFile state;
  state.arrays = {make_array<double>("positions", {4, 3}, {0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0}),
                  make_array<int32_t>("edges", {3, 2}, {0, 1, 1, 2, 2, 3}),
                  make_array<int32_t>("cluster_offsets", {4}, {0, 2, 4, 6}),
                  make_array<int32_t>("cluster_members", {6}, {0, 1, 1, 2, 2, 3})};
  state.texts = {{"promises", "connected covered coupled edges_covered"}};
  const files::path path = files::temp_directory_path() / ("cutproof.state." + std::to_string(getpid()) + suffix);
  io::write_array_file(path.string(), state);
  std::string bytes = read(path);
  files::remove(path);
  return bytes;
}

struct Case {
  const char* name;
  std::vector<std::string> arguments;
  int status;         // undisturbed
  std::size_t files;  // that it then writes
  bool reads_a_recording;
};
std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

class Allocations : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    if (std::string(CUTPROOF_SANITIZERS) != "") {
      GTEST_SKIP() << "failing allocations were not run: sanitizers (" CUTPROOF_SANITIZERS
                      ") bring their own allocator";
    }
    std::string bad = kCutScene;
    bad.replace(bad.find("speed"), 5, "spede");
    Files given = {{"cut.json", kCutScene},
                   {"bad.json", bad},
                   {"out.json", kOldJson},
                   {"state.npz", state_file(".npz")},
                   {"state.h5", state_file(".h5")}};
    const std::string name = GetParam().name;
    if (GetParam().reads_a_recording) {
      Program recording(name + "_recording", {"run", "cut.json", "--record", "seen"}, given);
      const Outcome outcome = recording.run();
      ASSERT_EQ(outcome.status, 0) << outcome.error;
      given.insert(outcome.written.begin(), outcome.written.end());
    }
    program_ = std::make_unique<Program>(name, GetParam().arguments, given);
    undisturbed_ = program_->run(0, 1, 0);
    made_ = program_->control().made;
    most_ = program_->control().most;
    ASSERT_EQ(undisturbed_.status, GetParam().status) << undisturbed_.error;
    ASSERT_EQ(undisturbed_.written.size(), GetParam().files);
    ASSERT_GT(made_, 500u) << "nothing counts";
  }

  static WantedAllocations wanted() { return wanted_allocations(40); }

  void fail_in_turn(uint64_t fail_count) {
    const uint64_t with = sample_seed();
    std::map<int, int> ended;
    for (const uint64_t number : chosen_numbers(made_, wanted(), with)) {
      const Outcome outcome = program_->run(number, fail_count, 0);
      ++ended[outcome.status];
      EXPECT_EQ(defect_of(outcome, undisturbed_), "")
          << "allocation " << number << " of " << made_ << ", seed " << with << "\n"
          << outcome.error;
      // With several threads a run may need fewer than the first did.
      if (program_->control().failed == 0) {
        EXPECT_EQ(outcome.status, undisturbed_.status);
      }
    }
    EXPECT_GT(ended[3], 0);
    print(ended, with);
    const Outcome beyond = program_->run(made_ + made_ / 2, fail_count, 0);
    EXPECT_EQ(program_->control().failed, 0u);
    EXPECT_EQ(beyond.status, undisturbed_.status) << beyond.error;
    EXPECT_EQ(defect_of(beyond, undisturbed_), "");
  }
  void print(const std::map<int, int>& ended, uint64_t with) const {
    std::cout << made_ << " allocations, at most " << most_ << " bytes, seed " << with << "; runs that ended";
    for (const auto& [status, count] : ended) std::cout << " with status " << status << ": " << count;
    std::cout << std::endl;
  }

  std::unique_ptr<Program> program_;
  Outcome undisturbed_;
  uint64_t made_ = 0;
  int64_t most_ = 0;
};

TEST_P(Allocations, EachThatFailsAloneEndsTheRunInOrder) { fail_in_turn(1); }

TEST_P(Allocations, EachThatFailsWithAllAfterItEndsTheRunInOrder) { fail_in_turn(AllocationControl::kAllFromThere); }

// A machine with less and less memory: what takes the run beyond the limit fails, in HDF5 too. The next limit is just
// enough for the first that failed.
TEST_P(Allocations, AnyAmountOfMemoryThatIsTooLittleEndsTheRunInOrder) {
  const WantedAllocations want = wanted();
  // A case takes 2 to 10 s: a run for each allocation that is the first beyond its limit, or by steps of the limit.
  const int64_t step = want.all ? 1 : std::max<int64_t>(1, most_ / 2000);
  // A share begins where the one before it ends; the last goes on until there is enough.
  const auto begins = [&](uint64_t share) {
    return 1 + static_cast<int64_t>((share - 1) * static_cast<uint64_t>(most_) / want.shares);
  };
  int64_t limit = begins(want.share);
  std::map<int, int> ended;
  for (;;) {
    const Outcome outcome = program_->run(0, 1, limit);
    ++ended[outcome.status];
    EXPECT_EQ(defect_of(outcome, undisturbed_), "") << "with " << limit << " bytes\n" << outcome.error;
    if (program_->control().failed == 0) {
      EXPECT_EQ(outcome.status, undisturbed_.status);
      break;
    }
    ASSERT_LT(limit, 2 * most_ + (int64_t{1} << 20)) << "there is no end to it";
    limit = std::max(limit, program_->control().wanted.load()) + step;
    if (want.share < want.shares && limit >= begins(want.share + 1)) break;
  }
  // A small share may lie between what one allocation and the next would need.
  EXPECT_TRUE(want.shares > 1 || ended[3] > 1);
  print(ended, 0);
}

INSTANTIATE_TEST_SUITE_P(
    Programs, Allocations,
    testing::Values(
        Case{"RunOnTheReference", {"run", "cut.json", "--check", "--record", "r", "--json", "out.json"}, 0, 5, false},
        Case{"RunOnHost",
             {"run", "cut.json", "--backend", "host", "--check", "--record", "r", "--json", "out.json"},
             0,
             5,
             false},
        Case{"Against",
             {"run", "cut.json", "--backend", "host", "--against", "reference", "--json", "out.json"},
             0,
             1,
             false},
        Case{"CheckOfARecording", {"check", "seen", "--json", "out.json"}, 0, 1, true},
        Case{"CheckOfAnNpzFile", {"check", "state.npz", "--json", "out.json"}, 0, 1, false},
        Case{"CheckOfAnHdf5File", {"check", "state.h5", "--json", "out.json"}, 0, 1, false},
        Case{"RunOfABadScene", {"run", "bad.json", "--check", "--record", "r", "--json", "out.json"}, 2, 0, false}),
    [](const auto& instance) { return std::string(instance.param.name); });

// Also where there is a GPU: it is hidden.
TEST(MissingDevice, IsAMachineErrorAndWritesNothing) {
  Program program("MissingDevice",
                  {"run", "cut.json", "--backend", "gpu", "--check", "--record", "r", "--json", "out.json"},
                  {{"cut.json", kCutScene}, {"out.json", kOldJson}});
  const Outcome outcome = program.run();
#if CUTPROOF_HAS_CUDA
  EXPECT_EQ(outcome.status, 3) << outcome.error;
  EXPECT_NE(outcome.error.find("the backend gpu finds no device: "), std::string::npos) << outcome.error;
#else
  EXPECT_EQ(outcome.status, 2) << outcome.error;
  EXPECT_NE(outcome.error.find("built without CUDA"), std::string::npos) << outcome.error;
#endif
  EXPECT_TRUE(outcome.written.empty()) << outcome.written.begin()->first;
}

}  // namespace
}  // namespace cutproof::tests::failures_test
