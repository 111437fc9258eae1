#include "benchmarks/suites/machine_limits.h"

#include <algorithm>

namespace cutproof::benchmarks {

bool MachineLimitsResult::holds() const {
  return std::all_of(rows.begin(), rows.end(), [](const MachineLimit& row) { return row.lost.value_or(0) == 0; });
}

nlohmann::json to_json(const MachineLimitsResult& result) {
  nlohmann::json document = begin_document(result.provenance, result.complete);
  document["repeats"] = result.repeats;
  document["holds"] = result.holds();
  document["rows"] = nlohmann::json::array();
  for (const MachineLimit& limit : result.rows) {
    nlohmann::json row = {{"what", limit.what}, {"seconds", to_json(limit.seconds)}, {"lost", nullptr}};
    if (limit.bytes > 0) {
      row["bytes"] = limit.bytes;
      row["bytes_per_second"] = limit.bytes / limit.seconds.median;
    }
    if (limit.lost) row["lost"] = *limit.lost;
    document["rows"].push_back(std::move(row));
  }
  return document;
}

MachineLimitsResult run_machine_limits(const MachineLimitsOptions& options,
                                       const Progress<MachineLimitsResult>& progress) {
  const harness::BackendDescriptor& backend = require_timed_backend(options.backend);
  MachineLimitsResult result;
  result.provenance = provenance_of("machine_limits", options.backend);
  result.repeats = options.repeats;
  progress(result);
  result.rows = measure_machine_limits(backend, options.repeats);
  result.complete = true;
  progress(result);
  return result;
}

}  // namespace cutproof::benchmarks
