// Results of campaigns: one, or two with a NUL between them, are put together and concluded from; the first is also
// read as a page reads it.
#include <nlohmann/json.hpp>

#include "model/io/json_reader.h"
#include "model/io/limits.h"
#include "property_tests/campaign_report.h"
#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace of_campaign {

Outcome feed(std::string_view bytes) {
  return outcome_of([&] {
    const std::size_t end = bytes.find('\0');
    std::vector<std::string> files = {scratch_path("first.json")};
    write_scratch("first.json", bytes.substr(0, end));
    if (end != std::string_view::npos) {
      files.push_back(scratch_path("second.json"));
      write_scratch("second.json", bytes.substr(end + 1));
    }
    const nlohmann::json whole = property_tests::merge_shards(files);
    const property_tests::CampaignConclusion conclusion = property_tests::conclude(whole, true);
    if (conclusion.holds() && !whole.at("violations").empty()) broken_contract("violations hold");
    // As a page of it reads it: alone, and not put together.
    property_tests::require_campaign(io::read_json(files.front(), io::kCampaignLimits, "Give a result."),
                                     files.front());
  });
}

nlohmann::json result(int64_t shard, int64_t shards) {
  property_tests::CampaignOptions options;
  options.shard = shard - 1;
  options.shards = shards;
  options.dynamics = true;
  property_tests::Campaign campaign;
  campaign.cases = 5;
  campaign.verdicts = 70;
  campaign.seconds = 1.5;
  harness::BackendChoice backend;
  backend.name = "host";
  nlohmann::json document = campaign_document(
      backend, options, campaign,
      nlohmann::json::array(
          {{{"index", shard}, {"property", "coverage"}, {"stage", "split"}, {"text", "found"}, {"file", "a.json"}}}));
  document["properties"].push_back({{"property", "admissible step"},
                                    {"stage", "step"},
                                    {"judged", 5},
                                    {"checked", 60},
                                    {"failed", 0},
                                    {"seconds", 0.5},
                                    {"inconclusive", 1},
                                    {"measured", 0.5},
                                    {"of_bound", 0.25},
                                    {"unit", "h"}});
  return document;
}

std::vector<std::string> seeds() {
  using namespace std::string_literals;
  return {result(1, 1).dump(), result(1, 2).dump() + "\0"s + result(2, 2).dump()};
}

}  // namespace of_campaign

const Target kCampaign = {"campaign", of_campaign::feed, of_campaign::seeds};

}  // namespace cutproof::input_fuzzing
