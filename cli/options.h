// Options that several verbs have.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "harness/backends.h"

namespace cutproof::cli {

// Throws InputError for an option of the command line.
[[noreturn]] void refuse(const std::string& option, const std::string& problem, const std::string& remedy);
// Refuses what was given but is empty, such as --json "": nobody means that.
void refuse_empty(const CLI::App& command);

// --backend alone. `what`: what it does, for the help, which lists those of which `offered` holds.
void add_backend_name(CLI::App& command, std::string& name, const std::string& what,
                      const std::function<bool(const harness::BackendDescriptor&)>& offered = {});
// --backend, and what may be said about kernels and schedules.
void add_backend(CLI::App& command, harness::BackendChoice& choice, const std::string& what,
                 const std::function<bool(const harness::BackendDescriptor&)>& offered = {});
// For what is timed.
bool is_timed(const harness::BackendDescriptor& backend);

void add_json(CLI::App& command, std::string& path, const std::string& what);

}  // namespace cutproof::cli
