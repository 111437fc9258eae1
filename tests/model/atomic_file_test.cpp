#include "model/io/atomic_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "model/error.h"

namespace cutproof::io {
namespace {

namespace fs = std::filesystem;

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
  EXPECT_EQ(read_text(in_folder("a")), text);
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
  EXPECT_EQ(read_text(in_folder("a")), "old");
}

TEST_F(AtomicFileTest, NothingIsLeftWhereAProgramEndsWithoutUnwinding) {
  AtomicFile finished(in_folder("a")), unfinished(in_folder("b"));
  { const AtomicFile gone(in_folder("c")); }
  std::ofstream(finished.temporary()) << "new";
  std::ofstream(unfinished.temporary()) << "half";
  finished.commit();
  AtomicFile::remove_unfinished();
  EXPECT_EQ(entries(), 1u);
  EXPECT_EQ(read_text(in_folder("a")), "new");
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
  EXPECT_EQ(read_text(in_folder("target")), "new");
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
  EXPECT_THROW(read_text(folder_.string()), InputError);
}

TEST_F(AtomicFileTest, AFileInPlaceOfTheFolderIsAnInputError) {
  write_text(in_folder("a"), "text");
  EXPECT_THROW(write_text(in_folder("a/b"), "text"), InputError);
}

TEST_F(AtomicFileTest, AMissingFileIsAnInputError) {
  try {
    read_text(in_folder("missing"));
    FAIL() << "a file that is not there was read";
  } catch (const InputError& error) {
    EXPECT_EQ(error.file(), in_folder("missing"));
    EXPECT_NE(std::string(error.what()).find("No such file"), std::string::npos) << error.what();
  }
}

// Linux's file that is always full: the write is buffered, so the failure shows at the latest when it is closed.
TEST_F(AtomicFileTest, AFullDiskIsAMachineError) {
  EXPECT_THROW(write_text("/dev/full", "text"), MachineError);
  EXPECT_TRUE(fs::exists("/dev/full"));
}

TEST_F(AtomicFileTest, ADeviceIsWrittenToAndNotReplaced) {
  write_text("/dev/null", "text");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

}  // namespace
}  // namespace cutproof::io
