// `cutproof check` of a file of arrays: one state that somebody else's simulator wrote.
#pragma once
#include <string>

namespace cutproof::cli {

// Judges, prints, and writes the document to `json` unless that is empty. Returns the exit status.
int check_state(const std::string& file, const std::string& json);

}  // namespace cutproof::cli
