// The error of a malformed command line.
#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace cutproof::cli {

// In words, with a remedy: for an unknown subcommand or option the nearest known one. `words`: of the command line,
// without the program.
std::string usage_error(const CLI::App& program, const CLI::ParseError& error, const std::vector<std::string>& words);

// Subcommands and options that help lists.
std::vector<const CLI::App*> shown_commands(const CLI::App& command);
std::vector<const CLI::Option*> shown_options(const CLI::App& command);
// Arguments without a name, in order.
std::vector<const CLI::Option*> shown_arguments(const CLI::App& command);

}  // namespace cutproof::cli
