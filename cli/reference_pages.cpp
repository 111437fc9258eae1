#include "cli/reference_pages.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>
#include <string_view>

#include "cli/commands.h"
#include "cli/usage.h"
#include "cli/validators.h"
#include "model/printable.h"

namespace cutproof::cli {

namespace {

// The kind of a value, by its type name in help.
enum class Value { word, file, folder };
Value kind_of(const std::string& type) {
  if (type == "DIR") return Value::folder;
  for (const char* const file : {"F", "FILE", "FILE.so", "SCENE", "RECORDING", "CASE", "ANSWERS", "JSON..."}) {
    if (type == file) return Value::file;
  }
  return Value::word;
}

bool takes_value(const CLI::Option& option) { return option.get_expected_max() > 0; }

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

// Calls `visit` with the program, each subcommand and each suite, and its name: "", "run", "bench solver".
void for_each_command(const CLI::App& command, const std::string& name,
                      const std::function<void(const CLI::App&, const std::string&)>& visit) {
  visit(command, name);
  for (const CLI::App* const each : shown_commands(command)) {
    for_each_command(*each, name.empty() ? each->get_name() : name + " " + each->get_name(), visit);
  }
}

// --- Shells ----------------------------------------------------------------------------------------------------------

// Common code of bash and zsh: assignments to `offered` and `kind`.
std::string offer_of(const CLI::Option& option) {
  const std::vector<std::string> words = words_of(option);
  const Value kind = kind_of(option.get_type_name());
  if (!words.empty()) {
    return fmt::format("offered='{}'{}", fmt::join(words, " "), kind == Value::file ? " kind=file" : "");
  }
  switch (kind) {
    case Value::folder:
      return "kind=folder";
    case Value::file:
      return "kind=file";
    case Value::word:
      return "kind=none";
  }
  return {};
}

// Alternatives of `case`, as bash and zsh have it.
struct Alternatives {
  std::string commands;   // "run/…": what a word makes of the command
  std::string flags;      // of each command its options and subcommands
  std::string values;     // of each option that takes one
  std::string arguments;  // of each command that takes some
};

Alternatives alternatives_of(const CLI::App& program) {
  Alternatives all;
  for_each_command(program, "", [&](const CLI::App& command, const std::string& name) {
    std::vector<std::string> options, below;
    for (const CLI::Option* const option : shown_options(command)) {
      const std::vector<std::string> names = names_of(*option);
      options.insert(options.end(), names.begin(), names.end());
      if (!takes_value(*option)) continue;
      for (const std::string& each : names)
        all.values += fmt::format("    '{} {}') {} ;;\n", name, each, offer_of(*option));
    }
    for (const CLI::App* const each : shown_commands(command)) below.push_back(each->get_name());
    all.flags +=
        fmt::format("    '{}') flags='{}' below='{}' ;;\n", name, fmt::join(options, " "), fmt::join(below, " "));
    for (const std::string& each : below)
      all.commands += fmt::format("      '{}/{}') at='{}{}{}' ;;\n", name, each, name, name.empty() ? "" : " ", each);
    // Of several arguments the first stands for all: they are of one kind.
    if (const auto shown = shown_arguments(command); !shown.empty()) {
      all.arguments += fmt::format("      '{}') {} ;;\n", name, offer_of(*shown.front()));
    }
  });
  return all;
}

// The offered words, given the position of the word.
std::string choice_among(const Alternatives& all) {
  return fmt::format(R"(  case "$at" in
{}  esac
  if [[ $current == -* ]]; then
    offered=$flags
  else
    case "$at $before" in
{}    esac
    if [[ -z $offered$kind && -n $below ]]; then offered=$below; fi
    if [[ -z $offered$kind ]]; then
      case "$at" in
{}      esac
    fi
  fi
)",
                     all.flags, all.values, all.arguments);
}

// In single quotes, as fish reads them.
std::string in_quotes_of_fish(std::string_view text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\\' || c == '\'') quoted += '\\';
    quoted += c;
  }
  return quoted + "'";
}

// The value of an option, or an argument, as `complete` of fish is told.
std::string offer_to_fish(const CLI::Option& option, bool is_value) {
  const std::vector<std::string> words = words_of(option);
  const Value kind = kind_of(option.get_type_name());
  const char* const required = is_value ? " -r" : "";
  std::string told = kind == Value::file ? fmt::format("{} -F", required) : fmt::format("{} -f", required);
  if (kind == Value::folder) told += " -a '(__fish_complete_directories)'";
  if (!words.empty()) told += fmt::format(" -a '{}'", fmt::join(words, " "));
  return told;
}

// --- man -------------------------------------------------------------------------------------------------------------

// As groff reads it: no backslash, hyphens that can be copied, letters beyond ASCII by number, and no line that begins
// as a request does.
std::string for_man(std::string_view text) {
  std::string result;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const auto c = static_cast<unsigned char>(text[k]);
    if (c == '\\') {
      result += "\\e";
    } else if (c == '-') {
      result += "\\-";
    } else if (c == '`') {
      result += "\\(ga";
    } else if (c == '\'') {
      result += "\\(aq";
    } else if (c == '^') {
      result += "\\(ha";
    } else if (c == '~') {
      result += "\\(ti";
    } else if (c < 0x80) {
      result += static_cast<char>(c);
    } else {
      const Character letter = first_character(text.substr(k));
      result += fmt::format("\\[u{:04X}]", letter.code);
      k += letter.bytes - 1;
    }
  }
  return result;
}

std::string paragraph(std::string_view text) {
  const std::string escaped = for_man(text);
  return (escaped.starts_with('.') ? "\\&" : "") + escaped + "\n";
}

std::string bold(const std::string& text) { return "\\fB" + for_man(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + for_man(text) + "\\fR"; }

std::string entry(const std::string& head, const CLI::Option& option) {
  std::string text = option.get_description();
  if (!option.get_default_str().empty()) {
    text += fmt::format("{}default: {}", text.empty() ? "" : "; ", option.get_default_str());
  }
  return ".TP\n" + head + "\n" + paragraph(text.empty() ? "\xe2\x80\x94" : text);
}

std::string option_entry(const CLI::Option& option) {
  std::string head;
  for (const std::string& name : names_of(option)) head += (head.empty() ? "" : ", ") + bold(name);
  if (takes_value(option)) head += " " + italic(option.get_type_name());
  return entry(head, option);
}

std::string synopsis(const CLI::App& command, const std::string& name) {
  std::string line = bold("cutproof " + name);
  for (const CLI::Option* const argument : shown_arguments(command)) {
    const std::string type = italic(argument->get_type_name());
    line += argument->get_required() ? " " + type : " [" + type + "]";
  }
  return line + " [" + italic("OPTION") + "]...\n";
}

constexpr const char* kExitStatus[][2] = {{"0", "Everything holds."},
                                          {"1", "A verdict failed, or nothing was judged."},
                                          {"2", "Bad input or usage."},
                                          {"3", "The machine failed: memory, disk, device."},
                                          {"77", "A plugin cannot run here."},
                                          {"128 + n",
                                           "Signal n ended the program. fuzz, judge, tune and bench first write their "
                                           "results so far; a second signal ends them at once."}};

constexpr const char* kEnvironment[][2] = {
    {"CUTPROOF_GUEST", "Path of cutproof-guest, the program that runs plugins, if it is not beside cutproof."},
    {"COLUMNS", "Width of errors on a terminal; default: the terminal's width, at most 80 columns."},
    {"CUTPROOF_COMMIT", "Commit that documents of fuzz and bench name."}};

constexpr const char* kExamples[][2] = {
    {"cutproof run kidney_discontinuous --check", "Cuts a kidney in two steps and certifies every frame."},
    {"cutproof fuzz --backend host --cases 1000", "A thousand random dissections by the kernels on this processor."},
    {"cutproof judge ./libmine.so", "Kernels of your own."},
    {"cutproof info --scene", "Every field of a scene file."}};

}  // namespace

std::string bash_completion(const CLI::App& program) {
  const Alternatives all = alternatives_of(program);
  return fmt::format(R"(# bash completion for cutproof: made by `cutproof info --completion bash`.
_cutproof() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} at='' flags='' below='' offered='' kind='' k
  # --option=value comes as three words.
  [[ $current == '=' ]] && current=''
  [[ $before == '=' ]] && before=${{COMP_WORDS[COMP_CWORD-2]}}
  for ((k = 1; k < COMP_CWORD; ++k)); do
    case "$at/${{COMP_WORDS[k]}}" in
{}    esac
  done
{}  COMPREPLY=()
  case "$kind" in
    none) ;;
    file) compopt -o filenames 2> /dev/null; mapfile -t COMPREPLY < <(compgen -W "$offered" -- "$current"; compgen -f -- "$current") ;;
    folder) compopt -o filenames 2> /dev/null; mapfile -t COMPREPLY < <(compgen -d -- "$current") ;;
    *) mapfile -t COMPREPLY < <(compgen -W "$offered" -- "$current") ;;
  esac
}}
complete -F _cutproof cutproof
)",
                     all.commands, choice_among(all));
}

std::string zsh_completion(const CLI::App& program) {
  const Alternatives all = alternatives_of(program);
  return fmt::format(R"(#compdef cutproof
# zsh completion for cutproof: made by `cutproof info --completion zsh`.
_cutproof() {{
  local current=$words[CURRENT] before=$words[CURRENT-1] at='' flags='' below='' offered='' kind='' k
  # --option=value is one word.
  if [[ $current == --*=* ]]; then
    before=${{current%%=*}}
    current=${{current#*=}}
    compset -P 1 '*='
  fi
  for ((k = 2; k < CURRENT; ++k)); do
    case "$at/$words[k]" in
{}    esac
  done
{}  case "$kind" in
    none) ;;
    file) compadd -- ${{=offered}}; _files ;;
    folder) _files -/ ;;
    *) compadd -- ${{=offered}} ;;
  esac
}}
# Found in a folder of completions this file is itself the function; otherwise it has been sourced.
if [[ $funcstack[1] == _cutproof ]]; then _cutproof "$@"; else compdef _cutproof cutproof; fi
)",
                     all.commands, choice_among(all));
}

std::string fish_completion(const CLI::App& program) {
  std::string commands, offers;
  for_each_command(program, "", [&](const CLI::App& command, const std::string& name) {
    const std::string here = fmt::format("complete -c cutproof -n \"__cutproof_at '{}'\"", name);
    for (const CLI::App* const each : shown_commands(command)) {
      commands += fmt::format("      case '{}/{}'\n        set at '{}{}{}'\n", name, each->get_name(), name,
                              name.empty() ? "" : " ", each->get_name());
      offers += fmt::format("{} -f -a {} -d {}\n", here, each->get_name(), in_quotes_of_fish(each->get_description()));
    }
    for (const CLI::Option* const option : shown_options(command)) {
      std::string names;
      for (const std::string& each : option->get_snames()) names += " -s " + each;
      for (const std::string& each : option->get_lnames()) names += " -l " + each;
      offers += fmt::format("{}{}{} -d {}\n", here, names, takes_value(*option) ? offer_to_fish(*option, true) : "",
                            in_quotes_of_fish(option->get_description()));
    }
    if (const auto shown = shown_arguments(command); !shown.empty()) {
      offers += fmt::format("{}{}\n", here, offer_to_fish(*shown.front(), false));
    }
  });
  return fmt::format(R"(# fish completion for cutproof: made by `cutproof info --completion fish`.
# Whether the words before name this verb, and this suite of it.
function __cutproof_at
  set -l at ''
  set -l given (commandline -opc)
  set -e given[1]
  for word in $given
    switch "$at/$word"
{}    end
  end
  test "$at" = "$argv[1]"
end
complete -c cutproof -f
{})",
                     commands, offers);
}

std::string manual_page(const CLI::App& program, const std::string& date) {
  std::string page = fmt::format(".TH CUTPROOF 1 {} \"cutproof {}\" \"User Commands\"\n", date, kVersion);
  page += ".SH NAME\ncutproof \\- judges real\\-time soft\\-body dissection\n.SH SYNOPSIS\n.nf\n";
  std::string verbs;
  for_each_command(program, "", [&](const CLI::App& command, const std::string& name) {
    if (name.empty()) return;
    if (!shown_commands(command).empty()) {
      verbs += fmt::format(".SS cutproof {}\n", for_man(name)) + paragraph(command.get_description());
      return;
    }
    page += synopsis(command, name);
    verbs += fmt::format(".SS cutproof {}\n", for_man(name)) + paragraph(command.get_description());
    for (const CLI::Option* const argument : shown_arguments(command)) {
      verbs += entry(italic(argument->get_type_name()), *argument);
    }
    for (const CLI::Option* const option : shown_options(command)) {
      if (option->get_name() != "--help") verbs += option_entry(*option);
    }
  });
  page += ".fi\n.SH DESCRIPTION\n";
  page += paragraph(
      "Cuts a body made of shape matching clusters with a reference, with kernels, or with your program, and certifies "
      "every frame: separate pieces are not coupled, no tissue is lost, the skin shows the simulated tissue, and the "
      "motion is admissible.");
  page += ".SH COMMANDS\n" + verbs;
  const auto table = [&](const char* title, const auto& rows) {
    page += fmt::format(".SH {}\n", title);
    for (const auto& row : rows) page += ".TP\n" + bold(row[0]) + "\n" + paragraph(row[1]);
  };
  table("EXIT STATUS", kExitStatus);
  table("ENVIRONMENT", kEnvironment);
  table("EXAMPLES", kExamples);
  return page;
}

}  // namespace cutproof::cli
