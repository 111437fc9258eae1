#include "cli/usage.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "model/error.h"
#include "model/nearest_word.h"

namespace cutproof::cli {

namespace {

// The innermost subcommand or suite that the command line names.
const CLI::App& named_command(const CLI::App& program) {
  const CLI::App* command = &program;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().front();
  return *command;
}

std::string full_name(const CLI::App& command) {
  if (command.get_parent() == nullptr) return "cutproof";
  return full_name(*command.get_parent()) + " " + command.get_name();
}

std::string help_of(const CLI::App& command) {
  return fmt::format("`{} --help` lists what there is", full_name(command));
}

// Without the dashes, which are no letters that were hit: of '--seed' and '--help' most are other ones.
std::string_view letters_of(std::string_view option) {
  return option.substr(std::min(option.find_first_not_of('-'), option.size()));
}

// Words that options do not have, and the field's word.
constexpr std::pair<std::string_view, std::string_view> kOtherWords[] = {{"simplify", "shrink"}};

std::string option_meant(const std::string& given, const std::vector<std::string>& names) {
  std::vector<std::string_view> letters;
  for (const std::string& name : names) letters.push_back(letters_of(name));
  std::string nearest = nearest_word(letters_of(given), letters);
  for (const auto& [other, word] : kOtherWords) {
    if (letters_of(given) == other && std::find(letters.begin(), letters.end(), word) != letters.end()) nearest = word;
  }
  if (nearest.empty()) return "";
  const auto name =
      std::find_if(names.begin(), names.end(), [&](const std::string& n) { return letters_of(n) == nearest; });
  return fmt::format("did you mean '{}'? ", *name);
}

// One that was given more often than it may be, if there is one.
const CLI::Option* given_too_often(const CLI::App& command) {
  for (const CLI::App* app = &command; app != nullptr; app = app->get_parent()) {
    for (const CLI::Option* const option : app->get_options()) {
      const bool one_each = option->get_multi_option_policy() == CLI::MultiOptionPolicy::Throw;
      if (one_each && option->count() > static_cast<std::size_t>(option->get_items_expected_max())) return option;
    }
  }
  return nullptr;
}

std::vector<std::string> names_of_options(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* const option : shown_options(command)) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

std::string sentence(const std::string& where, const std::string& problem, const std::string& remedy) {
  return InputError("command line", where, problem, remedy).what();
}

}  // namespace

std::vector<const CLI::App*> shown_commands(const CLI::App& command) {
  std::vector<const CLI::App*> commands;
  for (const CLI::App* const each : command.get_subcommands([](const CLI::App*) { return true; })) {
    if (!each->get_group().empty()) commands.push_back(each);
  }
  return commands;
}

std::vector<const CLI::Option*> shown_options(const CLI::App& command) {
  return command.get_options(
      [](const CLI::Option* option) { return option->nonpositional() && !option->get_group().empty(); });
}

std::vector<const CLI::Option*> shown_arguments(const CLI::App& command) {
  return command.get_options(
      [](const CLI::Option* option) { return !option->nonpositional() && !option->get_group().empty(); });
}

std::string usage_error(const CLI::App& program, const CLI::ParseError& error, const std::vector<std::string>& words) {
  const CLI::App& command = named_command(program);
  if (&command == &program) {
    std::vector<std::string> verbs;
    for (const CLI::App* const verb : shown_commands(program)) verbs.push_back(verb->get_name());
    if (!words.front().starts_with('-')) {
      return sentence(words.front(), "there is no such subcommand",
                      did_you_mean(words.front(), verbs) + fmt::format("use one of {}", fmt::join(verbs, ", ")));
    }
  }
  // An option that does not exist may leave its value to an argument, or another option missing: it comes first.
  for (const std::string& word : program.remaining(true)) {
    if (!word.starts_with('-') || word == "--") continue;
    const std::string option = word.substr(0, word.find('='));
    return sentence(option, fmt::format("{} has no such option", full_name(command)),
                    option_meant(option, names_of_options(command)) + help_of(command));
  }
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
    return sentence(fmt::format("{}", fmt::join(program.remaining(true), " ")),
                    fmt::format("{} takes no further argument", full_name(command)), help_of(command));
  }
  const CLI::Option* const repeated = given_too_often(command);
  if (repeated != nullptr && dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    const std::size_t times = repeated->count();
    return sentence(repeated->get_name(), times == 2 ? "it is given twice" : fmt::format("it is given {} times", times),
                    "give it once");
  }
  return sentence("", error.what(), help_of(command));
}

}  // namespace cutproof::cli
