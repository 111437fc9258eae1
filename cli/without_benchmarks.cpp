// Takes the place of benchmarks/ and tuning/ in a program that is built without them (-DCUTPROOF_BENCHMARKS=OFF): both
// verbs are there, and say so.
#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "benchmarks/suites.h"
#include "cli/commands.h"
#include "model/error.h"

namespace cutproof::cli {
namespace {

[[noreturn]] void refuse(const std::string& verb) {
  throw InputError("cutproof " + verb, "", "This program was built without it.",
                   "Configure the build with -DCUTPROOF_BENCHMARKS=ON, and build it again.");
}

}  // namespace

int tune(const TuneOptions&) { refuse("tune"); }

std::function<int()> add_bench(CLI::App& program) {
  program.add_subcommand("bench", "measure (not in this build: configure with -DCUTPROOF_BENCHMARKS=ON)")
      ->allow_extras();
  return []() -> int { refuse("bench"); };
}

}  // namespace cutproof::cli
