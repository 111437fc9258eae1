// Options of several subcommands.
#pragma once
#include <CLI/CLI.hpp>
#include <string>

#include "cli/validators.h"
#include "harness/backends.h"
#include "harness/depth.h"

namespace cutproof::cli {

// Throws InputError for an option of the command line.
[[noreturn]] void refuse(const std::string& option, const std::string& problem, const std::string& remedy);
// Refuses empty values, such as --json "", and values with line ends: a file name with one would print lines that look
// like output of this program.
void refuse_odd_words(const CLI::App& command);

// --backend alone. `what`: its explanation for help, which lists the backends that `offered` accepts.
void add_backend_name(CLI::App& command, std::string& name, const std::string& what,
                      const std::function<bool(const harness::BackendDescriptor&)>& offered = {});
// --backend, and the options of schedules.
void add_backend(CLI::App& command, harness::BackendChoice& choice, const std::string& what,
                 const std::function<bool(const harness::BackendDescriptor&)>& offered = {});
// --devices, for campaigns.
void add_devices(CLI::App& command, std::string& devices);
// For timed runs.
bool is_timed(const harness::BackendDescriptor& backend);

// --name N. A default of 0 says that there is none, and is not told.
template <class Integer>
CLI::Option* add_count(CLI::App& command, const std::string& name, Integer& value, const std::string& what,
                       const CLI::Validator& allowed) {
  CLI::Option* const option = command.add_option(name, value, what)->type_name("N")->check(allowed);
  if constexpr (std::is_integral_v<Integer>) {
    if (value != 0) option->capture_default_str();
  }
  return option;
}
// --seed N. A negative one would wrap around.
void add_seed(CLI::App& command, uint64_t& seed, const std::string& what, const std::string& name = "--seed");
// --name X,X..., of which `letter` is X; the default, if there is one, is told.
template <class Value>
void add_list(CLI::App& command, const std::string& name, std::vector<Value>& list, const std::string& what,
              const std::string& letter = "N") {
  CLI::Option* const option = command.add_option(name, list, what + ", separated by commas");
  if constexpr (std::is_integral_v<Value>) option->check(whole_number(0, std::numeric_limits<Value>::max()));
  if constexpr (std::is_floating_point_v<Value>) option->check(number());
  option->delimiter(',')->type_name(letter + "," + letter + "...");
  if (!list.empty()) option->capture_default_str();
}

// --check, which may be followed by a depth of judging. `asked` is empty unless it is given.
CLI::Option* add_check_depth(CLI::App& command, std::string& asked, const std::string& what);
// Throws InputError if there is no depth of this name.
harness::Depth depth_asked(const std::string& asked);

// --junit F, for a subcommand that judges.
void add_junit(CLI::App& command, std::string& path);

// A word as a shell takes it.
std::string quoted(const std::string& word);
// The command line of `command` as given, without its output files (--json, --junit, --record, --report), to repeat the
// command. Requires that it has been parsed.
std::string as_given(const CLI::App& command);

void add_json(CLI::App& command, std::string& path, const std::string& what);

}  // namespace cutproof::cli
