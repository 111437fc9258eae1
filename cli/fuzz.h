// A campaign of random dissections, for the verbs that run one.
#pragma once
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "harness/backends.h"
#include "property_tests/campaign.h"
#include "property_tests/campaign_report.h"

namespace cutproof::cli {

struct FuzzOptions {
  harness::BackendChoice backend = {.name = harness::kHostName};
  property_tests::CampaignOptions campaign;
  std::optional<int64_t> cases;  // default: 1000, or as many as its `seconds` allow
  std::string sizes = "0-79";    // of cases, which take turns: 0 is nothing, 100 up to about 20,000 particles
  int batch = 0;                 // bodies in one load; 0: by backend
  int threads = 0;               // 0: as many as the machine has
  std::string devices;           // "0,2" or "all"; empty: the first, of backends that need one
  std::string shard;             // "i/N"; empty: all
  double simplify = 60;          // [s] for each violation
  std::string save = ".";        // the folder for counterexamples
  std::string json, junit, report;
  std::string again;               // the command line
  std::vector<std::string> merge;  // results of shards, to be put together; nothing is run
};

// Runs it, shrinks and saves what is wrong, and says so. The document of docs/reference/schemas/fuzz.json.
nlohmann::json fuzz_campaign(const FuzzOptions& options);
// Says what a campaign came to, but not whether it holds as a whole.
void print_campaign(const nlohmann::json& document);

}  // namespace cutproof::cli
