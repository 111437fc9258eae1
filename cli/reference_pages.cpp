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

// What a value is, by the name that help gives it.
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

// Calls `visit` with the program, each verb and each suite, and its name: "", "run", "bench solver".
void for_each_command(const CLI::App& command, const std::string& name,
                      const std::function<void(const CLI::App&, const std::string&)>& visit) {
  visit(command, name);
  for (const CLI::App* const each : shown_commands(command)) {
    for_each_command(*each, name.empty() ? each->get_name() : name + " " + each->get_name(), visit);
  }
}

// --- bash ------------------------------------------------------------------------------------------------------------

std::string offer_of(const CLI::Option& option) {
  const std::vector<std::string> words = words_of(option);
  const Value kind = kind_of(option.get_type_name());
  if (!words.empty()) {
    return fmt::format("words='{}'{}", fmt::join(words, " "), kind == Value::file ? " kind=file" : "");
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
                                           "Signal n ended it. fuzz, judge, tune and bench write what they "
                                           "have first; a second signal ends them at once."}};

constexpr const char* kEnvironment[][2] = {
    {"CUTPROOF_GUEST", "The program cutproof-guest, in which plugins run, where it is not beside cutproof."},
    {"CUTPROOF_COMMIT", "What documents of fuzz and bench tell as the commit that was run."}};

constexpr const char* kExamples[][2] = {
    {"cutproof run kidney_discontinuous --check", "Cuts a kidney in two steps and certifies every frame."},
    {"cutproof fuzz --backend host --cases 1000", "A thousand random dissections by the kernels on this processor."},
    {"cutproof judge ./libmine.so", "Kernels of your own."},
    {"cutproof info --scene", "Every field of a scene file."}};

}  // namespace

std::string bash_completion(const CLI::App& program) {
  std::string commands, values, arguments, inner;
  for_each_command(program, "", [&](const CLI::App& command, const std::string& name) {
    std::vector<std::string> options, below;
    for (const CLI::Option* const option : shown_options(command)) {
      const std::vector<std::string> names = names_of(*option);
      options.insert(options.end(), names.begin(), names.end());
      if (!takes_value(*option)) continue;
      for (const std::string& each : names)
        values += fmt::format("    '{} {}') {} ;;\n", name, each, offer_of(*option));
    }
    for (const CLI::App* const each : shown_commands(command)) below.push_back(each->get_name());
    commands +=
        fmt::format("    '{}') options='{}' below='{}' ;;\n", name, fmt::join(options, " "), fmt::join(below, " "));
    for (const std::string& each : below)
      inner += fmt::format("      '{}/{}') path='{}{}{}' ;;\n", name, each, name, name.empty() ? "" : " ", each);
    // Of several arguments the first stands for all: they are of one kind.
    if (const auto shown = shown_arguments(command); !shown.empty()) {
      arguments += fmt::format("    '{}') {} ;;\n", name, offer_of(*shown.front()));
    }
  });
  return fmt::format(R"(# bash completion for cutproof: made by `cutproof info --completion bash`.
_cutproof() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} path='' options='' below='' words='' kind='' k
  # --option=value comes as three words.
  [[ $current == '=' ]] && current=''
  [[ $before == '=' ]] && before=${{COMP_WORDS[COMP_CWORD-2]}}
  for ((k = 1; k < COMP_CWORD; ++k)); do
    case "$path/${{COMP_WORDS[k]}}" in
{}    esac
  done
  case "$path" in
{}  esac
  if [[ $current == -* ]]; then
    words=$options
  else
    case "$path $before" in
{}    esac
    if [[ -z $words$kind && -n $below ]]; then words=$below; fi
    if [[ -z $words$kind ]]; then
      case "$path" in
{}      esac
    fi
  fi
  COMPREPLY=()
  case "$kind" in
    none) ;;
    file) compopt -o filenames 2> /dev/null; mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"; compgen -f -- "$current") ;;
    folder) compopt -o filenames 2> /dev/null; mapfile -t COMPREPLY < <(compgen -d -- "$current") ;;
    *) mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current") ;;
  esac
}}
complete -F _cutproof cutproof
)",
                     inner, commands, values, arguments);
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
      "Cuts a body made of shape matching clusters, by a reference, by kernels, or by a program of yours, and "
      "certifies "
      "every frame: nothing that is separate is coupled, nothing is lost, the skin shows what is simulated, the motion "
      "is one of those that could be.");
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
