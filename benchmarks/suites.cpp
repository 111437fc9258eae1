#include "benchmarks/suites.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "model/error.h"

namespace cutproof::cli {

#define SUITE(name) Suite name##_suite();
#include "benchmarks/suites.inc"
#undef SUITE

std::vector<Suite> bench_suites() {
  return {
#define SUITE(name) name##_suite(),
#include "benchmarks/suites.inc"
#undef SUITE
  };
}

std::function<int()> add_bench(CLI::App& program) {
  CLI::App* bench = program.add_subcommand("bench", "times, each beside its error");
  std::vector<std::string> names;
  const auto run = std::make_shared<std::function<int()>>();
  for (const Suite& suite : bench_suites()) {
    names.push_back(suite.name);
    CLI::App* command = bench->add_subcommand(suite.name, suite.summary);
    command->callback([run, work = suite.declare(*command)] { *run = work; });
  }
  // What is no suite's name ends up here, where it is refused.
  const auto unknown = std::make_shared<std::vector<std::string>>();
  bench->add_option("suite", *unknown)->group("");
  const std::string remedy = fmt::format("use one of {}", fmt::join(names, ", "));
  return [run, unknown, remedy] {
    const auto refuse = [&](const std::string& problem) { throw InputError("command line", "bench", problem, remedy); };
    if (!unknown->empty()) refuse(fmt::format("there is no suite '{}'", unknown->front()));
    if (!*run) refuse("no suite is named");
    return (*run)();
  };
}

}  // namespace cutproof::cli
