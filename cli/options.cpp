#include "cli/options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/screen.h"
#include "model/error.h"
#include "model/nearest_word.h"
#include "model/printable.h"

namespace cutproof::cli {

void refuse(const std::string& option, const std::string& problem, const std::string& remedy) {
  throw InputError("command line", option, problem, remedy);
}

void refuse_odd_words(const CLI::App& command) {
  for (const CLI::Option* const option : command.get_options()) {
    for (const std::string& given : option->results()) {
      if (given.empty()) refuse(option->get_name(), "it is given but empty", "give a value, or leave the option out");
      if (given.find_first_of("\n\r") != std::string::npos) {
        refuse(option->get_name(), fmt::format("'{}' holds a line end", given), "rename the file");
      }
    }
  }
  for (const CLI::App* const named : command.get_subcommands()) refuse_odd_words(*named);
}

void add_backend_name(CLI::App& command, std::string& name, const std::string& what,
                      const std::function<bool(const harness::BackendDescriptor&)>& offered) {
  command.add_option("--backend", name, fmt::format("{}: {}, plugin:FILE.so", what, harness::backend_names(offered)))
      ->capture_default_str()
      ->type_name("B")
      ->check(usually_one_of(listed(harness::backend_names(offered))));
}

void add_backend(CLI::App& command, harness::BackendChoice& choice, const std::string& what,
                 const std::function<bool(const harness::BackendDescriptor&)>& offered) {
  add_backend_name(command, choice.name, what, offered);
  const std::string scheduled = harness::backend_names([](const auto& backend) { return backend.takes_schedule; });
  command
      .add_option("--schedule", choice.schedule,
                  fmt::format("{}: {}", scheduled, fmt::join(harness::schedule_names(), ", ")))
      ->capture_default_str()
      ->type_name("S")
      ->check(one_of(harness::schedule_names()));
  add_seed(command, choice.seed, scheduled + ": seed of random and pct", "--schedule-seed");
}

void add_devices(CLI::App& command, std::string& devices) {
  command.add_option("--devices", devices, "devices of the backend: numbers, or all of this host (default: 0)")
      ->type_name("N,N...|all");
}

bool is_timed(const harness::BackendDescriptor& backend) { return backend.is_timed; }

void add_seed(CLI::App& command, uint64_t& seed, const std::string& what, const std::string& name) {
  command.add_option(name, seed, what)->capture_default_str()->type_name("N")->check(seed_number());
}

CLI::Option* add_check_depth(CLI::App& command, std::string& asked, const std::string& what) {
  return command.add_option("--check", asked, fmt::format("{}: {}", what, fmt::join(harness::kDepthNames, " or ")))
      ->default_str(std::string(name_of(harness::Depth::motion)))
      ->type_name("D")
      ->check(usually_one_of({harness::kDepthNames.begin(), harness::kDepthNames.end()}));
}

harness::Depth depth_asked(const std::string& asked) {
  const std::optional<harness::Depth> depth = harness::depth_named(asked);
  if (!depth) {
    refuse("--check", fmt::format("'{}' is not a depth of judging", asked),
           did_you_mean(asked, harness::kDepthNames) + fmt::format("use {}", fmt::join(harness::kDepthNames, " or ")));
  }
  return *depth;
}

void add_junit(CLI::App& command, std::string& path) {
  command.add_option("--junit", path, "write each property as a test case (JUnit XML)")->type_name("F");
}

std::string quoted(const std::string& word) {
  constexpr const char* kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_./:=,+@%-";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  if (printable(word) != word) {  // as bash and zsh read it, and safe on a terminal
    std::string result = "$'";
    for_each_printable(word, false, [&](std::string_view piece, bool is_escape) {
      for (const char c : piece) {
        if (!is_escape && (c == '\'' || c == '\\')) result += '\\';
        result += c;
      }
    });
    return result + "'";
  }
  std::string result = "'";
  for (const char c : word) result += c == '\'' ? "'\\''" : std::string(1, c);
  return result + "'";
}

std::string as_given(const CLI::App& command) {
  // Words without an option stand first: behind an option of as many values as one likes they would be its own.
  std::string words, options;
  for (const CLI::Option* const option : command.get_options()) {
    const std::string name = option->get_name();
    if (option->count() == 0 || name == "--json" || name == "--junit" || name == "--record" || name == "--report" ||
        name == "--preview")
      continue;
    if (option->get_group() == kStyleGroup) continue;  // how it is printed changes nothing
    const bool is_word = option->get_lnames().empty() && option->get_snames().empty();
    std::string& text = is_word ? words : options;
    // Of one that takes one value each time, each value behind the name; else all behind one.
    const bool again = !is_word && !option->get_allow_extra_args() && option->results().size() > 1;
    if (!is_word && !again) text += " " + name;
    if (option->get_expected_max() == 0) continue;  // a flag
    for (const std::string& value : option->results()) {
      if (!value.empty()) text += (again ? " " + name : "") + " " + quoted(value);
    }
  }
  std::string name = command.get_name();
  for (const CLI::App* parent = command.get_parent(); parent != nullptr && parent->get_parent() != nullptr;
       parent = parent->get_parent()) {
    name = parent->get_name() + " " + name;
  }
  return "cutproof " + name + words + options;
}

void add_json(CLI::App& command, std::string& path, const std::string& what) {
  command.add_option("--json", path, what)->type_name("F");
}

}  // namespace cutproof::cli
