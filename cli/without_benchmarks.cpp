// Replaces bench and tune in a program that is built without them (-DCUTPROOF_BENCHMARKS=OFF): both subcommands refuse,
// and help does not list them.
#include <CLI/CLI.hpp>
#include <string>

#include "cli/commands.h"
#include "model/error.h"

namespace cutproof::cli {

namespace {

void add_refused(CLI::App& program, Work& work, const std::string& verb) {
  CLI::App* const command =
      program.add_subcommand(verb, verb + " is not in this build: configure with -DCUTPROOF_BENCHMARKS=ON");
  command->group("")->allow_extras();
  command->callback([verb, &work] {
    work = [verb]() -> int {
      throw InputError("cutproof " + verb, "", "This program was built without it.",
                       "Configure the build with -DCUTPROOF_BENCHMARKS=ON, and build it again.");
    };
  });
}

}  // namespace

void add_bench(CLI::App& program, Work& work) { add_refused(program, work, "bench"); }
void add_tune(CLI::App& program, Work& work) { add_refused(program, work, "tune"); }

}  // namespace cutproof::cli
