// Results in a GitHub workflow: annotations, which are lines beside the tested change, and the summary of a step, a
// page in Markdown.
#pragma once
#include <string>
#include <vector>

namespace cutproof::cli {

// Something that does not hold.
struct Failure {
  std::string property;
  std::string text;   // the witness
  std::string again;  // the command that shows it again
};

// "::error title=cutproof: PROPERTY::TEXT; see it again: COMMAND", in one line, as GitHub demands it.
std::string annotation(const Failure& failure);
// "::warning title=cutproof: TITLE::TEXT", the same for a result that is no failure.
std::string warning(const std::string& title, const std::string& text);
// Prints one line for each where the environment variable GITHUB_ACTIONS is "true", and nothing elsewhere. GitHub shows
// ten of a step: beyond these the tenth line says how many more there are. `left`: stages that were left to the
// reference, if there are any, are one warning.
void print_annotations(const std::vector<Failure>& failures, const std::vector<std::string>& left = {});

struct ForGitHub {
  std::string command;  // that was given
  std::vector<Failure> failures = {};
  std::vector<std::string> left = {};   // stages that were left to the reference
  std::vector<std::string> known = {};  // properties that fail as they did in the baseline
  std::vector<std::string> notes = {};  // sentences beside that
};

// The section of one command.
std::string step_summary(const ForGitHub& said);
// Prints annotations, with one warning for all known failures, and appends the section to the file that the environment
// variable GITHUB_STEP_SUMMARY names, if there is one. Throws MachineError if that cannot be written.
void tell_github(const ForGitHub& said);

}  // namespace cutproof::cli
