// Where a result comes from: the fields with which every document of `bench` and `tune` begins
// (results_schema.md).
#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "harness/backends.h"

namespace cutproof::benchmarks {

struct Provenance {
  std::string suite, backend;
  std::string device;  // the processor and how many of its threads work, or the CUDA device
  std::string date;    // UTC
  std::string commit;  // what CUTPROOF_COMMIT in the environment says; empty: nothing
};
Provenance provenance_of(const std::string& suite, const std::string& backend);
// `complete`: false in what a run leaves that fails or is stopped later.
nlohmann::json begin_document(const Provenance& provenance, bool complete);

// Called before anything is measured, when there is only the provenance, and again whenever `so_far` has grown: so
// what has been measured can be shown, and is kept if a later measurement fails.
template <class Result>
using Progress = std::function<void(const Result& so_far)>;

// Refuses what cannot be timed: throws InputError for a backend that does not exist, is not in this build or is for
// finding faults, MachineError if there is no device.
const harness::BackendDescriptor& require_timed_backend(const std::string& backend);

}  // namespace cutproof::benchmarks
