#include "benchmarks/machine_limits.h"

#include "benchmarks/suites/suites.h"

namespace cutproof::benchmarks {

nlohmann::json run_machine_limits(const MachineLimitsOptions& options, const Progress& progress) {
  const harness::BackendDescriptor& backend = require_timed_backend(options.backend);
  Report report("machine_limits", options.backend, {{"repeats", options.repeats}, {"holds", true}}, progress);
  for (const MachineLimit& limit : measure_machine_limits(backend, options.repeats)) {
    nlohmann::json row = {{"what", limit.what}, {"seconds", to_json(limit.seconds)}, {"lost", nullptr}};
    if (limit.bytes > 0) {
      row["bytes"] = limit.bytes;
      row["bytes_per_second"] = limit.bytes / limit.seconds.median;
    }
    if (limit.lost) row["lost"] = *limit.lost;
    report.add(std::move(row), limit.lost.value_or(0) == 0);
  }
  return report.complete();
}

}  // namespace cutproof::benchmarks
