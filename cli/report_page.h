// --report F, for subcommands that run or judge a recording.
#pragma once
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "model/io/recording.h"
#include "report/page.h"

namespace cutproof::cli {

void add_report_option(CLI::App& command, std::string& path);
// Fails before the run, not after it: throws InputError if this build makes no pages, or if the folder does not exist
// or is not writable. Nothing if `path` is empty.
void require_report(const std::string& path, const std::string& option = "--report");

// With the present time and machine. `backend`: the backend whose processor did the work; empty: the reference.
report::Made made_by(const std::string& command, const std::string& backend = {});

// A recording that lies beside the one that a page is about, with the words for it.
struct ReadBeside {
  const io::RecordingReader& recording;
  bool is_shown = false;
  std::string name, own_name, obtained;  // as in report::Beside
};

// `document`: the --json document of `run` or `check`. `made`: with the command that repeats it. `beside` may be null.
void write_report(const std::string& path, const io::RecordingReader& recording, const nlohmann::json& document,
                  const report::Made& made, const ReadBeside* beside = nullptr);
// The same of results that are read already. `again`: the command that judges it again.
void write_page(const std::string& path, const io::RecordingReader& recording, const report::Results& results,
                const std::string& again, const report::Made& made, const ReadBeside* beside);

}  // namespace cutproof::cli
