// --report F of subcommands that write a document with --json, and pages of such documents.
#pragma once
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "harness/backends.h"
#include "report/html.h"

namespace cutproof::cli {

// Writes the page of a document that is finished; nothing if `path` is empty. `own_backend`: the plugin that this run
// was given, if it was one, which may be run again.
void write_document_report(const std::string& path, const nlohmann::json& document, const report::Made& made,
                           const std::optional<harness::BackendChoice>& own_backend = std::nullopt);

// `document`: of fuzz, judge, bench or tune, from its subcommand or from `file`. `file` is empty for the former.
// Counterexamples of a file are searched at their given paths, then beside the file.
struct DocumentPage {
  std::string text;
  std::optional<bool> holds;  // nothing: it judges nothing
};
DocumentPage page_of_documents(const std::vector<nlohmann::json>& documents, const std::vector<std::string>& files,
                               const std::optional<harness::BackendChoice>& chosen, const report::Made& made);

// The command that repeats a campaign, from its document.
std::string campaign_again(const nlohmann::json& document);

}  // namespace cutproof::cli
