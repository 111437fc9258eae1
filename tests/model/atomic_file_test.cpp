#include "model/io/atomic_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <thread>

#include "model/error.h"

namespace cutproof::io::atomic_file_test {
namespace {

namespace fs = std::filesystem;

std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// A folder of its own for each test, removed afterwards.
class AtomicFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() / ("cutproof_" + std::to_string(::getpid()) + "_" + test->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string in_folder(const std::string& name) const { return (folder_ / name).string(); }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  fs::path folder_;
};

TEST_F(AtomicFileTest, WhatIsWrittenIsReadBackByteForByte) {
  const std::string text("line\r\n\0 zero, \xc3\xa9\n", 18);
  write_text(in_folder("a"), text);
  EXPECT_EQ(read(in_folder("a")), text);
  EXPECT_EQ(entries(), 1u) << "a temporary file was left behind";
}

TEST_F(AtomicFileTest, NothingIsLeftWithoutACommit) {
  write_text(in_folder("a"), "old");
  {
    AtomicFile file(in_folder("a"));
    std::ofstream(file.temporary()) << "half of the ne";
    EXPECT_EQ(entries(), 2u);
  }
  EXPECT_EQ(entries(), 1u);
  EXPECT_EQ(read(in_folder("a")), "old");
}

// In a process of its own: the one that removes them is to end.
TEST_F(AtomicFileTest, NothingIsLeftWhereAProgramEndsWithoutUnwinding) {
  const auto end = [&] {
    AtomicFile finished(in_folder("a")), unfinished(in_folder("b"));
    { const AtomicFile gone(in_folder("c")); }
    std::ofstream(finished.temporary()) << "new";
    std::ofstream(unfinished.temporary()) << "half";
    finished.commit();
    fs::create_directory(folder_ / "d");
    const Unfinished folder(in_folder("d")), inside(in_folder("d/e"));
    std::ofstream(inside.path()) << "inside";
    Unfinished::remove_all();
    std::_Exit(7);
  };
  EXPECT_EXIT(end(), testing::ExitedWithCode(7), "");
  EXPECT_EQ(entries(), 1u);
  EXPECT_EQ(read(in_folder("a")), "new");
}

// Handlers run in the middle of anything, on any thread: also where the list is being changed.
TEST_F(AtomicFileTest, NothingIsLeftBySignalsWhileManyFilesAreWritten) {
  const auto write_until_signal = [&](int turn) {
    static std::atomic<bool> interrupted{false};
    std::signal(SIGALRM, [](int) {
      interrupted = true;
      Unfinished::remove_all();
      std::_Exit(7);
    });
    const auto write_for_ever = [&](int thread) {
      try {
        for (int k = 0;; ++k) write_text(in_folder(std::to_string(thread)), std::to_string(k));
      } catch (const MachineError&) {  // the handler has removed what this thread was about to rename
        if (!interrupted) throw;
        while (true) ::pause();
      }
    };
    std::thread(write_for_ever, 1).detach();
    std::thread(write_for_ever, 2).detach();
    ualarm(static_cast<useconds_t>(2000 + 500 * turn), 0);
    write_for_ever(0);
  };
  for (int turn = 0; turn < 20; ++turn) EXPECT_EXIT(write_until_signal(turn), testing::ExitedWithCode(7), "");
  // What another thread had named and not yet made may be left: by a process that is dead, for the next one.
  write_text(in_folder("0"), "after");
  for (const auto& entry : fs::directory_iterator(folder_)) {
    EXPECT_EQ(entry.path().filename().string().size(), 1u) << entry.path();
  }
}

TEST_F(AtomicFileTest, WhatAKilledProgramLeftIsRemovedByTheNextOneThatWritesThere) {
  // Killed in the middle.
  const auto be_killed = [&] {
    const AtomicFile half(in_folder("a.json"));
    std::ofstream(half.temporary()) << "half";
    std::raise(SIGKILL);
  };
  EXPECT_EXIT(be_killed(), testing::KilledBySignal(SIGKILL), "");
  ASSERT_EQ(entries(), 1u);
  const std::string left = fs::directory_iterator(folder_)->path().filename().string();
  const std::string machine = left.substr(left.size() - 13);  // "-MACHINE.tmp", with the hyphen
  ASSERT_TRUE(left.starts_with(".a.json.") && machine.starts_with('-') && machine.ends_with(".tmp")) << left;
  // Not ours, or of somebody who lives: these stay.
  const std::string dead = left.substr(8, left.find('-') - 8);  // its process
  const std::set<std::string> others = {"a.json." + dead + "-0" + machine,
                                        ".a.json." + dead + "-0.tmp",
                                        ".a.json." + dead + "-0-00000000.tmp",
                                        ".a.json." + dead + "-x" + machine,
                                        ".a.json." + dead + machine,
                                        ".a.json.-" + dead + "-0" + machine,
                                        ".a.json.0-0" + machine,
                                        ".a.json.99999999999-0" + machine,
                                        ".a.json.1-0" + machine,
                                        ".a.json." + std::to_string(::getpid()) + "-7" + machine,
                                        "." + dead + "-0" + machine,
                                        left + ".gz"};
  for (const std::string& name : others) std::ofstream(in_folder(name)) << "somebody's";
  fs::create_directory(folder_ / (".folder." + dead + "-0" + machine));
  write_text(in_folder("b"), "new");
  EXPECT_FALSE(fs::exists(folder_ / left));
  for (const std::string& name : others) EXPECT_TRUE(fs::exists(folder_ / name)) << name;
  EXPECT_TRUE(fs::exists(folder_ / (".folder." + dead + "-0" + machine)));
  EXPECT_EQ(entries(), others.size() + 2);
}

TEST_F(AtomicFileTest, TheTemporaryNameLiesInTheSameFolderAndIsNeverUsedTwice) {
  AtomicFile first(in_folder("a")), second(in_folder("a"));
  EXPECT_EQ(fs::path(first.temporary()).parent_path(), folder_);
  EXPECT_NE(first.temporary(), second.temporary());
  EXPECT_NE(first.temporary(), in_folder("a"));
}

TEST_F(AtomicFileTest, ASymbolicLinkKeepsPointingAtTheFileThatIsReplaced) {
  write_text(in_folder("target"), "old");
  fs::create_symlink("target", folder_ / "link");
  write_text(in_folder("link"), "new");
  EXPECT_TRUE(fs::is_symlink(fs::symlink_status(folder_ / "link")));
  EXPECT_EQ(read(in_folder("target")), "new");
}

TEST_F(AtomicFileTest, AMissingFolderIsAnInputErrorThatNamesIt) {
  const std::string path = in_folder("no_such_folder/a.json");
  try {
    write_text(path, "text");
    FAIL() << "the missing folder was accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), path);
    EXPECT_NE(std::string(error.what()).find("no_such_folder\" does not exist"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("remedy: "), std::string::npos);
  }
  EXPECT_EQ(entries(), 0u);
}

TEST_F(AtomicFileTest, AFolderInPlaceOfAFileIsAnInputError) {
  EXPECT_THROW(write_text(folder_.string(), "text"), InputError);
  EXPECT_THROW(write_text(folder_.string() + "/", "text"), InputError);
  EXPECT_THROW(write_text("", "text"), InputError);
}

TEST_F(AtomicFileTest, AFileInPlaceOfTheFolderIsAnInputError) {
  write_text(in_folder("a"), "text");
  EXPECT_THROW(write_text(in_folder("a/b"), "text"), InputError);
}

// These tests may run as root, for whom a file that is replaced by mistake is gone, devices included: so what cannot be
// replaced is a pipe in the test's own folder, and what is full is a limit on the size of files.
TEST_F(AtomicFileTest, AFullDiskIsAMachineErrorAndLeavesWhatWasThere) {
  write_text(in_folder("a"), "old");
  // In a process of its own, which ends with status 7 if all is as it should be. The text fits into what is buffered,
  // so the failure shows only when the file is closed; the longer one does not.
  const auto run = [&](std::size_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit = {1000, 1000};
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      write_text(in_folder("a"), std::string(bytes, 'x'));
    } catch (const MachineError& error) {
      const bool is_named = std::string(error.what()).find(in_folder("a")) != std::string::npos;
      std::exit(is_named && entries() == 1 && read(in_folder("a")) == "old" ? 7 : 2);
    }
    std::exit(1);
  };
  EXPECT_EXIT(run(1001), testing::ExitedWithCode(7), "");
  EXPECT_EXIT(run(1 << 20), testing::ExitedWithCode(7), "");
}

TEST_F(AtomicFileTest, WhatIsNoRegularFileIsWrittenToAndNotReplaced) {
  const std::string pipe = in_folder("pipe");
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  fs::create_symlink("pipe", folder_ / "link");
  const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK);  // who writes waits for a reader
  ASSERT_GE(reader, 0);
  for (const char* name : {"pipe", "link"}) {
    write_text(in_folder(name), "text");
    EXPECT_TRUE(fs::is_fifo(fs::symlink_status(pipe))) << name;
    char read[16] = {};
    EXPECT_EQ(::read(reader, read, sizeof read), 4) << name;
    EXPECT_STREQ(read, "text") << name;
    AtomicFile unfinished(in_folder(name));  // nor is it removed where nothing is finished
  }
  ::close(reader);
  EXPECT_TRUE(fs::is_fifo(fs::symlink_status(pipe)));
  EXPECT_EQ(entries(), 2u);
}

}  // namespace
}  // namespace cutproof::io::atomic_file_test
