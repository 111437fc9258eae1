#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "benchmarks/suites/suites.h"
#include "model/io/json_number.h"
#include "property_tests/campaign.h"

namespace cutproof::benchmarks {

namespace {

using nlohmann::json;
using property_tests::Campaign;
using property_tests::CampaignOptions;

struct CampaignKind {
  std::string_view name;
  int least_size, most_size;
  bool dynamics;
};
// By size: some 50 particles, 2,000, and 50 that move.
constexpr std::array<CampaignKind, 3> kKinds = {
    {{"small", 0, 79, false}, {"large", 106, 106, false}, {"moving", 0, 79, true}}};

std::vector<CampaignKind> kinds_of(const CampaignsOptions& options) {
  std::vector<CampaignKind> kinds;
  for (const std::string& name : options.kinds) {
    const auto* const known =
        std::find_if(kKinds.begin(), kKinds.end(), [&](const CampaignKind& k) { return k.name == name; });
    std::vector<std::string_view> names;
    for (const CampaignKind& kind : kKinds) names.push_back(kind.name);
    require_option(known != kKinds.end(), "--kinds", fmt::format("there is no campaign '{}'", name),
                   fmt::format("use some of {}", fmt::join(names, ", ")));
    kinds.push_back(*known);
  }
  return kinds;
}

// One backend, as it runs campaigns.
struct CampaignRunner {
  const harness::BackendDescriptor* described;
  std::vector<int> devices;
  property_tests::BackendSource source;
};
CampaignRunner runner_of(const std::string& backend, const std::string& devices) {
  const harness::BackendDescriptor& described = require_timed_backend(backend);
  CampaignRunner runner = {&described, harness::devices_of(devices, described), {}};
  runner.source = property_tests::source_of({.name = backend}, runner.devices);
  return runner;
}

CampaignOptions campaign_of(const CampaignsOptions& options, const CampaignKind& kind, const CampaignRunner& runner) {
  CampaignOptions campaign;
  campaign.seed = options.seed;
  campaign.least_size = kind.least_size;
  campaign.most_size = kind.most_size;
  campaign.dynamics = kind.dynamics;
  campaign.keep_going = true;
  campaign.stop_asked = options.stop_asked;
  if (options.cases) {
    campaign.cases = *options.cases;
  } else {
    campaign.cases = std::numeric_limits<int64_t>::max() / 2;
    campaign.seconds = options.seconds;
  }
  campaign.threads = options.threads > 0 ? options.threads : harness::cpu_threads();
  campaign.batch = options.batch > 0 ? options.batch : usual_batch(campaign, *runner.described);
  set_parallel_loads(campaign, *runner.described, static_cast<int>(runner.devices.size()));
  return campaign;
}

// A few cases on each device, each in a load of its own, so that no campaign pays for a process's first use.
void warm_up_devices(CampaignOptions campaign, const CampaignRunner& runner) {
  campaign.cases = 4 * campaign.backends;
  campaign.batch = 1;
  campaign.seconds.reset();
  static_cast<void>(run_campaign(campaign, runner.source, {}));
}

// The comparisons made while time was taken.
json compared_in(const CampaignOptions& asked, const Campaign& campaign, bool is_the_reference) {
  int64_t checked = 0, inconclusive = 0;
  for (const harness::PropertySummary& property : campaign.properties.all()) {
    checked += property.checked;
    inconclusive += property.inconclusive;
  }
  json error = {{"verdicts", campaign.verdicts}, {"violations", campaign.violations.size()},
                {"refused", campaign.refused},   {"checked", checked},
                {"inconclusive", inconclusive},  {"positions", nullptr},
                {"greatest_h", nullptr}};
  if (asked.dynamics && !is_the_reference) {
    error["positions"] = campaign.compared.particles;
    error["greatest_h"] = json_number(campaign.compared.greatest);
  }
  return error;
}

json row_of_campaign(const CampaignKind& kind, const CampaignRunner& runner, const CampaignOptions& asked,
                     const Campaign& campaign) {
  json devices = json::array();
  for (int k = 0; k < asked.devices; ++k)
    devices.push_back(harness::processor_of(*runner.described, runner.devices[k]));
  const auto cases = static_cast<double>(campaign.cases);
  return {{"campaign", kind.name},
          {"backend", runner.described->name},
          {"devices", devices},
          {"sizes", {kind.least_size, kind.most_size}},
          {"dynamics", kind.dynamics},
          {"threads", asked.threads},
          {"batch", asked.batch},
          {"loads_at_once", asked.backends},
          {"cases", campaign.cases},
          {"mean_particles", campaign.cases > 0 ? static_cast<double>(campaign.particles) / cases : 0.0},
          {"seconds", campaign.seconds},
          {"cases_per_second", campaign.seconds > 0 ? cases / campaign.seconds : 0.0},
          {"of_reference", nullptr},
          {"thread_seconds",
           {{"generating", campaign.generating},
            {"simulating", campaign.running},
            {"reference", campaign.reference},
            {"judging", campaign.judging},
            {"waiting", std::max(0.0, asked.threads * campaign.seconds - campaign.generating - campaign.running -
                                          campaign.reference - campaign.judging)}}},
          {"error", compared_in(asked, campaign, runner.described->is_the_reference)}};
}

}  // namespace

json run_campaigns(const CampaignsOptions& options, const Progress& progress) {
  const std::vector<CampaignKind> kinds = kinds_of(options);
  std::vector<CampaignRunner> runners = {runner_of(options.backend, options.devices)};
  // The comparison comes from the same run.
  if (!runners.front().described->is_the_reference) {
    runners.insert(runners.begin(), runner_of(harness::kReferenceName, ""));
  }
  Report report("campaigns", options.backend,
                {{"seed", options.seed},
                 {"processor", harness::processor_of(harness::described_backend(harness::kHostName))},
                 {"rows_at_most", kinds.size() * runners.size()},
                 {"holds", true}},
                progress);
  for (const CampaignKind& kind : kinds) {
    double of_reference = 0;
    for (const CampaignRunner& runner : runners) {
      const CampaignOptions asked = campaign_of(options, kind, runner);
      warm_up_devices(asked, runner);
      const Campaign campaign = run_campaign(asked, runner.source, {});
      throw_if_asked(options.stop_asked);
      json row = row_of_campaign(kind, runner, asked, campaign);
      const double rate = row.at("cases_per_second").get<double>();
      if (runner.described->is_the_reference) {
        of_reference = rate;
      } else if (of_reference > 0) {
        row["of_reference"] = rate / of_reference;
      }
      report.add(std::move(row), campaign.violations.empty() && campaign.verdicts > 0);
    }
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
