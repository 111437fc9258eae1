#include "benchmarks/provenance.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cstdlib>
#include <ctime>

#include "model/error.h"

namespace cutproof::benchmarks {

namespace {

constexpr int kFormatVersion = 2;

}  // namespace

Provenance provenance_of(const std::string& suite, const std::string& backend) {
  const char* const commit = std::getenv("CUTPROOF_COMMIT");
  return {suite, backend, harness::processor_of(harness::described_backend(backend)),
          fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))), commit == nullptr ? "" : commit};
}

nlohmann::json begin_document(const Provenance& provenance, bool complete) {
  nlohmann::json document = {{"format", "cutproof.bench"},  {"format_version", kFormatVersion},
                             {"suite", provenance.suite},   {"cutproof", CUTPROOF_VERSION},
                             {"date", provenance.date},     {"backend", provenance.backend},
                             {"device", provenance.device}, {"complete", complete}};
  if (!provenance.commit.empty()) document["commit"] = provenance.commit;
  return document;
}

const harness::BackendDescriptor& require_timed_backend(const std::string& backend) {
  const harness::BackendDescriptor& found = harness::described_backend(backend);
  if (!found.is_timed) {
    throw InputError("command line", "--backend", fmt::format("'{}' is for finding faults, not for timing", backend),
                     fmt::format("use one of {}", harness::backend_names([](const auto& b) { return b.is_timed; })));
  }
  harness::BackendChoice choice;
  choice.name = backend;
  static_cast<void>(harness::make_backend(choice));
  return found;
}

}  // namespace cutproof::benchmarks
