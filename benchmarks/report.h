// The document of a suite of `bench`, or of `tune`: docs/reference/schemas/ describes its fields.
#pragma once
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "harness/backends.h"

namespace cutproof::benchmarks {

// The fields with which every document begins. `complete` is false, as it stays if the run fails or is stopped.
nlohmann::json begin_document(const std::string& suite, const std::string& backend);

// Called with the head alone before any measurement, and again after each row. So rows can be shown at once, and
// survive a later failure. An exception that it throws ends the suite (model/stop.h).
using Progress = std::function<void(const nlohmann::json& so_far)>;

// A growing document.
class Report {
 public:
  // Shows it with the suite's own `fields` and no row. Rows go into the list `list`.
  Report(const std::string& suite, const std::string& backend, const nlohmann::json& fields, const Progress& progress,
         const std::string& list = "rows");
  // `holds`: the suite's judgement of the row.
  void add(nlohmann::json row, bool holds = true);
  // Shows a copy with times that are being judged, so that they survive if judging is interrupted.
  void show_timed(nlohmann::json so_far) const;
  // Includes the last row.
  nlohmann::json complete();

  nlohmann::json document;

 private:
  const Progress& progress_;
  std::string list_;
};

// Throws InputError for a backend that does not exist, is not in this build or only finds faults; MachineError if there
// is no device.
const harness::BackendDescriptor& require_timed_backend(const std::string& backend);
std::unique_ptr<Backend> make_timed_backend(const std::string& backend);

// Throws InputError for an option of the command line unless `fine`.
void require_option(bool fine, const std::string& option, const std::string& problem, const std::string& remedy);

}  // namespace cutproof::benchmarks
