// `cutproof check` of a file of arrays: one state that somebody else's simulator wrote.
#pragma once
#include <string>

#include "model/io/array_file.h"

namespace cutproof::cli {

struct StateReports {
  std::string json, junit;  // files; empty: none
  std::string again;        // the command line
};

// Judges, prints, and writes what is asked for. `contents`: of the file. Returns the exit status.
int check_state(const io::ArrayFile& contents, const std::string& file, const StateReports& reports);

}  // namespace cutproof::cli
