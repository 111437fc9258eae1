// Completion scripts and the manual page, from the declared options.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace cutproof::cli {

// A script for a shell: subcommands, suites, options, values of an option, files and folders.
std::string bash_completion(const CLI::App& program);
std::string zsh_completion(const CLI::App& program);
std::string fish_completion(const CLI::App& program);
// cutproof(1), in man's macros. `date`: of the page.
std::string manual_page(const CLI::App& program, const std::string& date);

}  // namespace cutproof::cli
