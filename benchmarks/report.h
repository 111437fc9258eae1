// The document that a suite of `bench`, or `tune`, leaves: docs/reference/schemas/ says what each field means.
#pragma once
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "harness/backends.h"

namespace cutproof::benchmarks {

// Where a result comes from: the fields with which every document begins. `complete` is false, as in what a run leaves
// that fails or is stopped later.
nlohmann::json begin_document(const std::string& suite, const std::string& backend);

// Called before anything is measured, when there is only the head, and again after each row: so what has been measured
// can be shown, and is kept if a later measurement fails. What it throws ends the suite (model/stop.h).
using Progress = std::function<void(const nlohmann::json& so_far)>;

// A suite's document while it grows.
class Report {
 public:
  // Shows it, with the suite's own `fields` and no row. Rows are added to the list `list`.
  Report(const std::string& suite, const std::string& backend, const nlohmann::json& fields, const Progress& progress,
         const std::string& list = "rows");
  // `holds`: what the suite judges of it.
  void add(nlohmann::json row, bool holds = true);
  // Shows a copy that has what was timed, while it is being judged: whoever keeps it has the times if that is cut off.
  void show_timed(nlohmann::json so_far) const;
  // With the last row in it.
  nlohmann::json complete();

  nlohmann::json document;

 private:
  const Progress& progress_;
  std::string list_;
};

// Refuses what cannot be timed: throws InputError for a backend that does not exist, is not in this build or is for
// finding faults, MachineError if there is no device.
const harness::BackendDescriptor& require_timed_backend(const std::string& backend);
// One that is not refused.
std::unique_ptr<Backend> make_timed_backend(const std::string& backend);

// Throws InputError for an option of the command line unless `fine`.
void require_option(bool fine, const std::string& option, const std::string& problem, const std::string& remedy);

}  // namespace cutproof::benchmarks
