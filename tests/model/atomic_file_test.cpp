#include "model/io/atomic_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "model/error.h"

namespace cutproof::io {
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

TEST_F(AtomicFileTest, NothingIsLeftWhereAProgramEndsWithoutUnwinding) {
  AtomicFile finished(in_folder("a")), unfinished(in_folder("b"));
  { const AtomicFile gone(in_folder("c")); }
  std::ofstream(finished.temporary()) << "new";
  std::ofstream(unfinished.temporary()) << "half";
  finished.commit();
  AtomicFile::remove_unfinished();
  EXPECT_EQ(entries(), 1u);
  EXPECT_EQ(read(in_folder("a")), "new");
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
}  // namespace cutproof::io
