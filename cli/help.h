// The pages of --help.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace cutproof::cli {

// What the parsed command line asks help for, in lines that fit the screen: what an option does stands below itself.
std::string help_page(const CLI::App& program);

}  // namespace cutproof::cli
