// Campaigns as documents (docs/reference/schemas/fuzz.json): one for each shard, merged to one of the whole campaign,
// and its conclusion.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "harness/backends.h"
#include "property_tests/campaign.h"

namespace cutproof::property_tests {

// `file`: where the counterexample was saved.
nlohmann::json violation_json(const Violation& violation, const std::string& file);
// `violations`: an array of violation_json(). A campaign that judged nothing does not hold.
nlohmann::json campaign_document(const harness::BackendChoice& backend, const CampaignOptions& options,
                                 const Campaign& campaign, const nlohmann::json& violations);

inline constexpr int64_t kMostShards = 1'000'000;

// The document of the whole from the documents (files) of its shards. A shard that is not there, or was stopped before
// its end, is listed in `missing_shards`, and `complete` is false. Throws InputError, naming the file, for anything
// that is not the result of a shard of one campaign, each once.
nlohmann::json merge_shards(const std::vector<std::string>& files);
// Missing shards of a merged document, as job arrays write them: "3,7-12"; empty: none.
std::string missing_shards(const nlohmann::json& document);

// Throws InputError, naming `file`, if something is missing, or of another kind, that a conclusion reads.
void require_campaign(const nlohmann::json& document, const std::string& file);

// The conclusion of a document. `whole`: the document is of all shards, so a class of cases that never occurred is a
// failure.
struct CampaignConclusion {
  std::string failure;  // the failure, as a sentence without a full stop; empty: all hold
  bool holds() const { return failure.empty(); }
};
CampaignConclusion conclude(const nlohmann::json& document, bool whole);

}  // namespace cutproof::property_tests
