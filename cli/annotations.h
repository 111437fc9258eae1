// Failures as annotations of a GitHub workflow: lines that GitHub shows beside the change that is tested.
#pragma once
#include <string>
#include <vector>

namespace cutproof::cli {

// Something that does not hold.
struct Failure {
  std::string property;
  std::string text;   // what was found: the witness
  std::string again;  // the command that shows it again
};

// "::error title=cutproof: PROPERTY::TEXT; see it again: COMMAND", in one line, as GitHub demands it.
std::string annotation(const Failure& failure);
// "::warning title=cutproof: TITLE::TEXT", the same of what is no failure.
std::string warning(const std::string& title, const std::string& text);
// Prints one line for each where the environment variable GITHUB_ACTIONS is "true", and nothing elsewhere. GitHub shows
// ten of a step: beyond these the tenth line says how many more there are. `left`: stages that were left to the
// reference, if there are any, are one warning.
void print_annotations(const std::vector<Failure>& failures, const std::vector<std::string>& left = {});

}  // namespace cutproof::cli
