#include "benchmarks/report.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cstdlib>
#include <ctime>

#include "model/error.h"

namespace cutproof::benchmarks {

namespace {

constexpr int kFormatVersion = 3;

}  // namespace

nlohmann::json begin_document(const std::string& suite, const std::string& backend) {
  nlohmann::json document = {{"format", "cutproof.bench"},
                             {"format_version", kFormatVersion},
                             {"suite", suite},
                             {"cutproof", CUTPROOF_VERSION},
                             {"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))},
                             {"backend", backend},
                             // The processor and its working threads, or the CUDA device.
                             {"device", harness::processor_of(harness::described_backend(backend))},
                             {"complete", false}};
  const char* const commit = std::getenv("CUTPROOF_COMMIT");
  if (commit != nullptr && *commit != '\0') document["commit"] = commit;
  return document;
}

Report::Report(const std::string& suite, const std::string& backend, const nlohmann::json& fields,
               const Progress& progress, const std::string& list)
    : document(begin_document(suite, backend)), progress_(progress), list_(list) {
  document[list_] = nlohmann::json::array();
  document.update(fields);
  progress_(document);
}

void Report::add(nlohmann::json row, bool holds) {
  if (!holds) document["holds"] = false;
  document[list_].push_back(std::move(row));
  progress_(document);
}

void Report::show_timed(nlohmann::json so_far) const {
  so_far["judging"] = true;
  progress_(so_far);
}

nlohmann::json Report::complete() {
  document["complete"] = true;
  return std::move(document);
}

const harness::BackendDescriptor& require_timed_backend(const std::string& backend) {
  const harness::BackendDescriptor& found = harness::described_backend(backend);
  require_option(found.is_timed, "--backend", fmt::format("'{}' is for finding faults, not for timing", backend),
                 fmt::format("use one of {}", harness::backend_names([](const auto& b) { return b.is_timed; })));
  static_cast<void>(make_timed_backend(backend));
  return found;
}

std::unique_ptr<Backend> make_timed_backend(const std::string& backend) {
  harness::BackendChoice choice;
  choice.name = backend;
  return harness::make_backend(choice);
}

void require_option(bool fine, const std::string& option, const std::string& problem, const std::string& remedy) {
  if (!fine) throw InputError("command line", option, problem, remedy);
}

}  // namespace cutproof::benchmarks
