// The suites of `cutproof bench`. A suite NAME stands in NAME.cpp, which defines NAME_suite(); its name in the list of
// CMakeLists.txt makes it known.
#pragma once
#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace cutproof::cli {

struct Suite {
  std::string name;     // on the command line
  std::string summary;  // one line of help
  // Adds the options of the suite to its command. What is returned runs it once the command line has been read: exit
  // status 0, or 1 if something that the suite judges does not hold; throws as commands.h says.
  std::function<std::function<int()>(CLI::App& command)> declare;
};

std::vector<Suite> bench_suites();

// Adds `bench` with all suites. What is returned runs the suite that was named.
std::function<int()> add_bench(CLI::App& program);

}  // namespace cutproof::cli
