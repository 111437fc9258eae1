// Reading from outside within limits: files, and JSON.
#include "model/io/input_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "model/error.h"
#include "model/io/json_reader.h"
#include "model/io/json_text.h"
#include "model/printable.h"

namespace cutproof::io::input_file_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("\n  remedy: "), std::string::npos);
    return error.what();
  }
  return "nothing was refused";
}

void expect_refused(const std::function<void()>& action, const std::string& words) {
  const std::string said = refusal(action);
  EXPECT_NE(said.find(words), std::string::npos) << "no '" << words << "' in " << said;
}

class InputFileTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("cutproof_input_file." + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  fs::path folder_;
};

TEST_F(InputFileTest, WhatHasAsMuchAsAllowedIsReadByteForByteAndOneMoreIsRefused) {
  std::string text(100'000, 'x');
  text[7] = '\0';
  EXPECT_EQ(read_file(write("a", text), "A thing", text.size()), text);
  expect_refused([&] { read_file(path("a"), "A thing", text.size() - 1); }, "A thing has at most");
  EXPECT_EQ(read_file(write("empty", ""), "A thing", 0), "");
}

TEST_F(InputFileTest, ALinkIsFollowed) {
  write("a", "text");
  fs::create_symlink("a", path("link"));
  EXPECT_EQ(read_file(path("link"), "A thing", 10), "text");
}

TEST_F(InputFileTest, WhatDoesNotSayHowLargeItIsIsReadUpToTheLimit) {
  const std::string file = "/proc/self/status";
  ASSERT_EQ(fs::file_size(file), 0u);
  EXPECT_NE(read_file(file, "A thing", kMiB).find("Name:"), std::string::npos);
  expect_refused([&] { read_file(file, "A thing", 100); }, "at most 100 bytes");
}

TEST_F(InputFileTest, NothingButARegularFileIsOpened) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  expect_refused([&] { read_file(path("pipe"), "A thing", 10); }, "a pipe");
  expect_refused([&] { read_file(folder_.string(), "A thing", 10); }, "a folder");
  expect_refused([&] { read_file("/dev/zero", "A thing", 10); }, "a device");
  expect_refused([&] { read_file(path("missing"), "A thing", 10); }, "no such file");
}

constexpr JsonLimits kSmall = {"A thing", 1000, 3, 10};
json parse(const std::string& text) { return parse_json(text, "a.json", kSmall, "Give another."); }

TEST(JsonReader, LimitsAreThoseThatAreSaid) {
  EXPECT_EQ(parse("[[[1]]]"), json::parse("[[[1]]]"));
  expect_refused([] { parse("[[[[1]]]]"); }, "a.json: line 1, column 4: Brackets are nested too deeply");
  expect_refused([] { parse("\n [[[["); }, "line 2, column 5");
  EXPECT_EQ(parse("[1,2,3,4,5,6,7,8,9]").size(), 9u);
  expect_refused([] { parse("[1,2,3,4,5,6,7,8,9,0]"); }, "too many values");
  EXPECT_EQ(parse('"' + std::string(998, 'a') + '"').get<std::string>().size(), 998u);
  expect_refused([] { parse('"' + std::string(999, 'a') + '"'); }, "1001 bytes");
}

TEST(JsonReader, BracketsAndCommasInTextsAreNone) {
  const std::string text = R"(["[[[[[[{{{,,,,,,,,,,,,::\"[[[[\\"])";
  EXPECT_EQ(parse(text), json::parse(text));
  expect_refused([] { parse(R"(["\\",[[[)"); }, "nested too deeply");
}

TEST(JsonReader, AFieldThatIsThereTwiceIsRefused) {
  expect_refused([] { parse(R"({"a":{"b":1,"b":2}})"); }, "a.json: a.b: This field is given twice.");
  EXPECT_EQ(parse(R"({"a":{"b":1},"b":2})").at("b"), 2);
}

TEST(JsonReader, WhatIsQuotedIsShort) {
  const JsonLimits large = {"A thing", kMiB, 3, 10};
  for (const std::string& text :
       {std::string(900'000, '9'), std::string(900'000, 'x'), "\"" + std::string(900'000, 'x')}) {
    EXPECT_LT(refusal([&] { parse_json(text, "a.json", large, "Give another."); }).size(), 1000u);
  }
}

TEST(JsonText, IsValidWhateverTextsHold) {
  const json document = {{"caf\xe9", "\x1b[31m caf\xe9"}, {"list", {"\xc2\x9b", "\u202e", "\U000e0041", "é"}}};
  for (const int indent : {-1, 1}) {
    const std::string text = json_text(document, indent);
    EXPECT_EQ(text, printable_lines(text));
    const json read = json::parse(text);
    EXPECT_EQ(read.at(R"(caf\xe9)"), R"(\x1b[31m caf\xe9)");
    EXPECT_EQ(read.at("list"), document.at("list"));
  }
}

}  // namespace
}  // namespace cutproof::io::input_file_test
