// --report F, for subcommands that run or judge a recording.
#pragma once
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "model/io/recording.h"
#include "report/page.h"

namespace cutproof::cli {

void add_report_option(CLI::App& command, std::string& path);
// A failure now rather than after the run: throws InputError if this build makes no pages, or the folder is not there
// or not writable. Nothing if `path` is empty.
void require_report(const std::string& path, const std::string& option = "--report");

// Here and now. `backend`: on whose processor the work was done; empty: the reference's.
report::Made made_by(const std::string& command, const std::string& backend = {});

// A recording that lies beside the one that a page is about, with the words for it.
struct ReadBeside {
  const io::RecordingReader& recording;
  bool is_shown = false;
  std::string name, own_name, obtained;  // as in report::Beside
};

// `document`: what --json writes of `run` or `check`. `made`: by the command that shows it again. `beside` may be null.
void write_report(const std::string& path, const io::RecordingReader& recording, const nlohmann::json& document,
                  const report::Made& made, const ReadBeside* beside = nullptr);
// The same of results that are read already. `again`: the command that judges it again.
void write_page(const std::string& path, const io::RecordingReader& recording, const report::Results& results,
                const std::string& again, const report::Made& made, const ReadBeside* beside);

}  // namespace cutproof::cli
