// The program as a user meets it: run in a folder of its own, its exit status and what it prints.
#pragma once
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

namespace files = std::filesystem;

struct Outcome {
  int status = -1;
  std::string output;  // standard output and standard error
};

// Of what was printed, whose lines are broken to fit a screen: every run of white space as one space.
inline std::string on_one_line(const std::string& text) {
  std::string line;
  for (const char c : text) {
    const bool is_space = c == ' ' || c == '\n';
    if (!is_space || (!line.empty() && line.back() != ' ')) line += is_space ? ' ' : c;
  }
  return line;
}

// A folder of its own for each test, removed at the end.
class Program : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    std::string name = std::string(info->test_suite_name()) + "." + info->name() + "." + std::to_string(getpid());
    for (char& c : name) c = c == '/' ? '_' : c;
    folder_ = files::temp_directory_path() / ("cutproof." + name);
    files::remove_all(folder_);  // of a process of the same number that was killed
    files::create_directories(folder_);
    // Where tests run there, the program would add annotations to what it prints.
    for (const char* const variable : {"GITHUB_ACTIONS", "GITHUB_STEP_SUMMARY"}) unsetenv(variable);
  }
  void TearDown() override { files::remove_all(folder_); }

  static std::string scene(const std::string& name) {
    return (files::path(CUTPROOF_SOURCE) / "fixtures/scenes" / (name + ".json")).string();
  }
  static Outcome shell(const std::string& command) {
    FILE* pipe = popen(command.c_str(), "r");
    Outcome outcome;
    std::array<char, 4096> buffer;
    for (std::size_t n; (n = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;)
      outcome.output.append(buffer.data(), n);
    const int status = pclose(pipe);
    outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return outcome;
  }
  // `environment`: variables for the program, as a shell writes them. With CUTPROOF_WHOLE=1 a document that it
  // writes follows its schema: 0.3 s each.
  Outcome cutproof(const std::string& arguments, const std::string& environment = "") const {
    const std::string document = document_of(arguments);
    const files::file_time_type before = time_of(document);
    Outcome outcome =
        shell("cd '" + folder_.string() + "' && " + environment + " '" CUTPROOF_PROGRAM "' " + arguments + " 2>&1");
    if (std::getenv("CUTPROOF_WHOLE") != nullptr && time_of(document) != before) expect_schema(document);
    return outcome;
  }
  // The file that --json names; empty if it needs quotes.
  std::string document_of(const std::string& arguments) const {
    std::istringstream words(arguments);
    for (std::string word; words >> word;) {
      if (word == "--json" && words >> word && word.find('\'') == std::string::npos) return path(word);
    }
    return "";
  }
  // When it was written last; the least of times if there is none.
  static files::file_time_type time_of(const std::string& file) {
    std::error_code error;
    return files::is_regular_file(file, error) ? files::last_write_time(file, error) : files::file_time_type::min();
  }
  static void expect_schema(const std::string& document) {
    const Outcome outcome =
        shell("/usr/bin/python3 '" CUTPROOF_SOURCE "/tests/cli/schemas.py' '" + document + "' 2>&1");
    EXPECT_EQ(outcome.status, 0) << outcome.output;
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
  }
  std::string read(const std::string& name) const {
    std::ifstream file(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::set<std::string> listing() const {
    std::set<std::string> names;
    for (const auto& entry : files::directory_iterator(folder_)) names.insert(entry.path().filename());
    return names;
  }
  // An error ends with its remedy, on a line of its own.
  static void expect_remedy(const std::string& output) {
    EXPECT_NE(output.find("\n  remedy: "), std::string::npos) << output;
    EXPECT_EQ(output.find("\\n"), std::string::npos) << "an error within an error:\n" << output;
  }
  void expect_refused(const std::string& arguments, const std::vector<std::string>& words) const {
    const std::set<std::string> before = listing();
    const Outcome outcome = cutproof(arguments);
    EXPECT_EQ(outcome.status, 2) << arguments << "\n" << outcome.output;
    for (const std::string& word : words) {
      EXPECT_NE(outcome.output.find(word), std::string::npos) << "no '" << word << "' in:\n" << outcome.output;
    }
    expect_remedy(outcome.output);
    EXPECT_EQ(listing(), before) << "something was written";
  }

  files::path folder_;
};
