// `cutproof check` of a file of arrays: one state that somebody else's simulator wrote.
#pragma once
#include <string>

namespace cutproof::cli {

struct StateReports {
  std::string json, junit;  // files; empty: none
  std::string again;        // the command line
};

// Judges, prints, and writes what is asked for. Returns the exit status.
int check_state(const std::string& file, const StateReports& reports);

}  // namespace cutproof::cli
