#include "benchmarks/machine_limits.h"
#include "benchmarks/suites/suites.h"

namespace cutproof::benchmarks {

nlohmann::json run_rotations(const RotationsOptions& options, const Progress& progress, const RotationProgress& step) {
  const harness::BackendDescriptor& backend = require_timed_backend(options.backend);
  RotationCounts counts = options.counts;
  counts.timed = options.timed.value_or(backend.takes_full_size ? 1'000'000 : 20'000);
  const double copied = measure_machine(backend).copy_bytes_per_second;
  Report report("rotations", options.backend,
                {{"matrices", counts.matrices},
                 {"timed", counts.timed},
                 {"repeats", counts.repeats},
                 {"seed", counts.seed},
                 // A stopped suite has no rows: these follow once all methods are measured.
                 {"methods", nlohmann::json::array()},
                 {"machine_limits", {{"copy_bytes_per_second", copied}}}},
                progress);
  report.document.update(to_json(measure_rotations(rotation_methods(backend), counts, copied, step)));
  return report.complete();
}

}  // namespace cutproof::benchmarks
