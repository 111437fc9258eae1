// JUnit files are XML whatever stands in a witness, count what they hold, and come back as they were from another
// reader: Python's.
#include "model/io/junit.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <limits>

#include "model/io/atomic_file.h"

namespace cutproof::io::junit_test {
namespace {

// What Python reads: "NAME=VALUE" of the attributes, and texts, one per line, as Python literals.
std::string as_python_reads(const std::string& xml) {
  const auto file = std::filesystem::temp_directory_path() / ("cutproof.junit." + std::to_string(getpid()) + ".xml");
  write_text(file.string(), xml);
  const std::string command =
      "/usr/bin/python3 -c 'import sys, xml.etree.ElementTree as tree\n"
      "for e in tree.parse(sys.argv[1]).getroot().iter():\n"
      "    print(e.tag, *(k + \"=\" + ascii(v) for k, v in sorted(e.attrib.items())), ascii(e.text or \"\"))' '" +
      file.string() + "' 2>&1";
  FILE* const pipe = popen(command.c_str(), "r");
  std::string output;
  std::array<char, 4096> buffer;
  for (std::size_t n; (n = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) output.append(buffer.data(), n);
  EXPECT_EQ(pclose(pipe), 0) << output << xml;
  std::filesystem::remove(file);
  return output;
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(Junit, CountsWhatItHolds) {
  const std::vector<JunitSuite> suites = {
      {"first",
       1.5,
       {{"a", "c", 0.25},
        {"b", "c", 0, JunitOutcome::failed, "is wrong", "all of it"},
        {"d", "c", 0, JunitOutcome::failed, "is wrong, too"},
        {"e", "c", 0, JunitOutcome::skipped, "vacuous"}}},
      {"second", 2, {{"a", "c", 0, JunitOutcome::error, "lost"}, {"p", "c", 0, JunitOutcome::passed, "", "note"}}},
      {"third", 0, {}, {{"felt / kicked", "4e-09"}, {"<\"&", "\n"}}}};
  const std::string read = as_python_reads(junit_xml(suites));
  EXPECT_TRUE(has(read, "testsuites errors='1' failures='2' skipped='1' tests='6' time='3.500000'")) << read;
  EXPECT_TRUE(has(read, "testsuite errors='0' failures='2' name='first' skipped='1' tests='4' time='1.500000'"));
  EXPECT_TRUE(has(read, "testsuite errors='1' failures='0' name='second' skipped='0' tests='2' time='2.000000'"));
  EXPECT_TRUE(has(read, "testsuite errors='0' failures='0' name='third' skipped='0' tests='0' time='0.000000'"));
  EXPECT_TRUE(has(read, "testcase classname='c' name='a' time='0.250000' ''"));
  EXPECT_TRUE(has(read, "failure message='is wrong' 'all of it'"));
  EXPECT_TRUE(has(read, "skipped message='vacuous' ''"));
  EXPECT_TRUE(has(read, "error message='lost' ''"));
  EXPECT_TRUE(has(read, "system-out 'note'"));
  EXPECT_TRUE(has(read, "property name='felt / kicked' value='4e-09'"));
  EXPECT_TRUE(has(read, "property name='<\"&' value='\\n'"));
}

TEST(Junit, KeepsEveryCharacterThatXmlCanHold) {
  const std::string hard = "<a b='c' d=\"e\"> & ]]> \t 1\n2\r\n3\r4 — 𝄞 é";
  const std::string expected = R"(<a b=\'c\' d="e"> & ]]> \t 1\n2\r\n3\r4 \u2014 \U0001d11e \xe9)";
  const std::string read = as_python_reads(junit_xml({{hard, 1, {{hard, hard, 0, JunitOutcome::failed, hard, hard}}}}));
  EXPECT_TRUE(has(read, "name='" + expected + "'")) << read;
  EXPECT_TRUE(has(read, "classname='" + expected + "'")) << read;
  EXPECT_TRUE(has(read, "message='" + expected + "' '" + expected + "'")) << read;
}

TEST(Junit, ReplacesWhatXmlCannotHold) {
  using namespace std::string_literals;
  const struct {
    std::string text, read;
  } all[] = {{"a\0b"s, R"(a\\x00b)"},
             {"\x01\x1B[31m\x1F", R"(\\x01\\x1b[31m\\x1f)"},
             {"\xEF\xBF\xBE\xEF\xBF\xBF\xEF\xBF\xBD", R"(\\ufffe\\uffff\ufffd)"},  // U+FFFD stays as it is
             {"\x80x", R"(\\x80x)"},                                               // a byte that goes on
             {"\xC3", R"(\\xc3)"},                                                 // broken off
             {"\xE2\x82<", R"(\\xe2\\x82<)"},
             {"\xC0\xAF", R"(\\xc0\\xaf)"},                    // "/" in two bytes
             {"\xED\xA0\x80", R"(\\xed\\xa0\\x80)"},           // half of a pair
             {"\xF4\x90\x80\x80", R"(\\xf4\\x90\\x80\\x80)"},  // beyond U+10FFFF
             {"\xC2\x9B"
              "31m \xE2\x80\xAE",
              R"(\\u009b31m \\u202e)"},  // C1, and a direction of reading
             {"\xFF", R"(\\xff)"}};
  for (const auto& [text, expected] : all) {
    const std::string read = as_python_reads(junit_xml({{"s", 1, {{"n", "c", 0, JunitOutcome::failed, text, text}}}}));
    EXPECT_TRUE(has(read, "message='" + expected + "' '" + expected + "'")) << expected << " in " << read;
  }
}

TEST(Junit, WritesTimesThatReadersKnow) {
  for (const double none : {-1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_TRUE(has(junit_xml({{"s", none}}), "time=\"0.000000\"")) << none;
  }
  EXPECT_TRUE(has(junit_xml({{"s", 1e7}}), "time=\"10000000.000000\""));
}

}  // namespace
}  // namespace cutproof::io::junit_test
