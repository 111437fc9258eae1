// The subcommands of the program `cutproof`. Each has a file that declares the options, calls the library and prints
// the results.
#pragma once
#include <functional>

namespace CLI {
class App;
}

namespace cutproof::cli {

// The work of the command line. Returns an exit status: 0 everything holds, 1 a verdict failed or nothing was judged.
// Bad input is an InputError (status 2), a failing machine a MachineError (status 3), a plugin that cannot run here a
// guests::CannotRunHere (status 77, which CTest and others take for skipped); main() turns them into these.
using Work = std::function<int()>;

// Each adds a subcommand to `program`, and sets `work` if the command line names the subcommand.
void add_run(CLI::App& program, Work& work);
void add_check(CLI::App& program, Work& work);
void add_kick(CLI::App& program, Work& work);
void add_relate(CLI::App& program, Work& work);
void add_fuzz(CLI::App& program, Work& work);
void add_replay(CLI::App& program, Work& work);
void add_bench(CLI::App& program, Work& work);
void add_tune(CLI::App& program, Work& work);
void add_report(CLI::App& program, Work& work);
void add_digest(CLI::App& program, Work& work);
void add_judge(CLI::App& program, Work& work);
void add_vectors(CLI::App& program, Work& work);
void add_check_vectors(CLI::App& program, Work& work);
void add_info(CLI::App& program, Work& work);

inline constexpr const char* kVersion = CUTPROOF_VERSION;

}  // namespace cutproof::cli
