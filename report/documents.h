// Documents that are results of campaigns and measurements, as sheets of a page (json.md).
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "report/sheet.h"

namespace cutproof::report {

enum class DocumentKind { run, fuzz, judge, bench, tune, counterexample };
// What a document is, by its own content. Throws InputError, naming `file`, for one of which no page is made.
DocumentKind kind_of(const nlohmann::json& document, const std::string& file);

// Of a document of fuzz, judge, bench or tune. Throws InputError, naming file and field, for anything that is not as
// json.md has it, and for any format version but the one that this program writes. `failure`: what is wrong
// with a campaign as a whole, as a sentence without an end (property_tests/campaign_report.h); empty: nothing.
Sheet sheet_of(const nlohmann::json& document, const std::string& file, const std::string& failure = {});

// Dissections by a plugin's stages that a document of judge holds: documents of fuzz, in their order.
std::vector<std::pair<std::string, const nlohmann::json*>> dissections_in(const nlohmann::json& document);

}  // namespace cutproof::report
