// The pages of --help.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace cutproof::cli {

// The requested help page, in lines that fit the screen; explanations of options are aligned.
std::string help_page(const CLI::App& program);

}  // namespace cutproof::cli
