#include "cli/document_report.h"

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>
#include <utility>

#include "cli/commands.h"
#include "cli/counterexample_cards.h"
#include "cli/options.h"
#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/json_number.h"
#include "property_tests/campaign_report.h"
#include "report/document_page.h"
#include "report/documents.h"

namespace cutproof::cli {

namespace {

using harness::BackendChoice;
using nlohmann::json;

// Where a document says, seen from here, or else beside the document.
std::string place_of(const std::string& named, const std::string& document) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (document.empty() || fs::exists(named, error)) return named;
  const fs::path beside = fs::path(document).parent_path() / fs::path(named).filename();
  return fs::exists(beside, error) ? beside.string() : named;
}

report::Sheet campaign(const json& document, const std::string& file, const std::optional<BackendChoice>& chosen,
                       std::vector<report::Scenery>& sceneries) {
  const std::string name = file.empty() ? "this campaign" : file;
  // Checks all fields first: the code below reads them unchecked.
  static_cast<void>(report::sheet_of(document, name));
  property_tests::require_campaign(document, name);
  const std::string failure = property_tests::conclude(document, document.at("shards") == 1).failure;
  report::Sheet sheet = report::sheet_of(document, name, document.at("violations").empty() ? failure : std::string());
  sheet.again = campaign_again(document);
  const json& violations = document.at("violations");
  for (std::size_t k = 0; k < sheet.cards.size(); ++k) {
    report::Card& card = sheet.cards[k];
    const std::string place = place_of(violations[k].at("file").get<std::string>(), file);
    try {
      add_counterexample(card, property_tests::read_counterexample(place), place, chosen, sceneries);
    } catch (const InputError& error) {
      card.facts.emplace_back("Run again", std::string("not for this page: ") + error.what());
    }
  }
  return sheet;
}

void add_sheets(const json& document, const std::string& file, const std::optional<BackendChoice>& chosen,
                std::vector<report::Sheet>& sheets, std::vector<report::Scenery>& sceneries) {
  const report::DocumentKind kind = report::kind_of(document, file.empty() ? "the document" : file);
  if (kind == report::DocumentKind::fuzz) {
    sheets.push_back(campaign(document, file, chosen, sceneries));
    return;
  }
  sheets.push_back(report::sheet_of(document, file.empty() ? "the document" : file));
  if (kind != report::DocumentKind::judge) return;
  for (const auto& [name, dissections] : report::dissections_in(document)) {
    report::Sheet sheet = campaign(*dissections, file, chosen, sceneries);
    sheet.title += name == "dissections" ? ", its stages" : ", its stages on moving bodies";
    sheets.push_back(std::move(sheet));
  }
}

}  // namespace

std::string campaign_again(const json& document) {
  // Fields that a campaign's document lacks are left out.
  const auto text = [&](const char* name) { return document.value(name, std::string()); };
  std::string command = "cutproof fuzz --backend " + quoted(text("backend"));
  if (!text("schedule").empty()) command += " --schedule " + quoted(text("schedule"));
  if (document.contains("schedule_seed"))
    command += fmt::format(" --schedule-seed {}", integer_from<uint64_t>(document.at("schedule_seed")));
  if (document.contains("cases_asked"))
    command += fmt::format(" --cases {}", integer_from<int64_t>(document.at("cases_asked")));
  if (document.contains("seconds_asked"))
    command += fmt::format(" --seconds {:g}", document.at("seconds_asked").get<double>());
  command +=
      fmt::format(" --seed {} --sizes {}-{}", integer_from<uint64_t>(document.at("seed")),
                  integer_from<int64_t>(document.at("sizes").at(0)), integer_from<int64_t>(document.at("sizes").at(1)));
  if (document.value("dynamics", false)) command += " --dynamics";
  if (document.contains("batch")) command += fmt::format(" --batch {}", integer_from<int64_t>(document.at("batch")));
  if (document.value("keep_going", false)) command += " --keep-going";
  if (integer_from<int64_t>(document.at("shards")) > 1)
    command += fmt::format(" --shard {}/{}", integer_from<int64_t>(document.at("shard")),
                           integer_from<int64_t>(document.at("shards")));
  return command;
}

DocumentPage page_of_documents(const std::vector<json>& documents, const std::vector<std::string>& files,
                               const std::optional<BackendChoice>& chosen, const report::Made& made) {
  std::vector<report::Sheet> sheets;
  std::vector<report::Scenery> sceneries;
  for (std::size_t k = 0; k < documents.size(); ++k) {
    const auto unreadable = [&](const std::exception& why) {
      return InputError(files[k].empty() ? "the document" : files[k], "", why.what(),
                        "give what this version of cutproof has written with --json");
    };
    try {
      add_sheets(documents[k], files[k], chosen, sheets, sceneries);
    } catch (const json::exception& error) {
      throw unreadable(error);
    } catch (const std::invalid_argument& error) {
      throw unreadable(error);
    }
  }
  DocumentPage page;
  for (const report::Sheet& sheet : sheets) {
    if (sheet.holds) page.holds = page.holds.value_or(true) && *sheet.holds;
  }
  page.text = report::document_page(sheets, sceneries, made);
  return page;
}

void write_document_report(const std::string& path, const json& document, const report::Made& made,
                           const std::optional<BackendChoice>& own_backend) {
  if (path.empty()) return;
  io::write_text(path, page_of_documents({document}, {""}, own_backend, made).text);
}

}  // namespace cutproof::cli
