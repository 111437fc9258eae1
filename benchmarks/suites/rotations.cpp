#include "benchmarks/suites/rotations.h"

namespace cutproof::benchmarks {

nlohmann::json to_json(const RotationsResult& result) {
  nlohmann::json document = begin_document(result.provenance, result.complete);
  document["matrices"] = result.counts.matrices;
  document["timed"] = result.counts.timed;
  document["repeats"] = result.counts.repeats;
  document["seed"] = result.counts.seed;
  document["machine_limits"] = {{"copy_bytes_per_second", result.machine.copy_bytes_per_second}};
  document.update(to_json(result.report));
  return document;
}

RotationsResult run_rotations(const RotationsOptions& options, const Progress<RotationsResult>& progress,
                              const RotationProgress& step) {
  const harness::BackendDescriptor& backend = require_timed_backend(options.backend);
  RotationsResult result;
  result.counts = options.counts;
  result.counts.timed = options.timed.value_or(backend.takes_full_size ? 1'000'000 : 20'000);
  result.provenance = provenance_of("rotations", options.backend);
  result.machine = measure_machine(backend);
  progress(result);
  result.report = measure_rotations(rotation_methods(backend), result.counts, harness::default_rotation(),
                                    result.machine.copy_bytes_per_second, step);
  result.complete = true;
  progress(result);
  return result;
}

}  // namespace cutproof::benchmarks
