#include "cli/report_page.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cstdlib>
#include <ctime>
#include <optional>

#include "cli/commands.h"
#include "cli/output.h"
#include "harness/backends.h"
#include "model/io/atomic_file.h"

namespace cutproof::cli {

void add_report_option(CLI::App& command, std::string& path) {
  command.add_option("--report", path, "write a page for a browser: events, verdicts, and places of failures")
      ->type_name("F");
}

void require_report(const std::string& path, const std::string& option) {
  if (path.empty()) return;
  report::require_pages(option);
  require_writable(path);
}

report::Made made_by(const std::string& command, const std::string& backend) {
  const char* const commit = std::getenv("CUTPROOF_COMMIT");
  const harness::BackendDescriptor& worker =
      backend.empty() ? harness::reference_backend() : harness::described_backend(backend);
  return {kVersion, command, fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr))),
          harness::processor_of(worker), commit != nullptr ? commit : ""};
}

namespace {

report::Source source_of(const io::RecordingReader& recording) {
  return {recording.header().setup, recording.header().snapshot_count,
          [&recording](int64_t index) { return recording.snapshot(index); }};
}

}  // namespace

void write_page(const std::string& path, const io::RecordingReader& recording, const report::Results& results,
                const std::string& again, const report::Made& made, const ReadBeside* beside) {
  std::optional<report::Beside> other;
  if (beside != nullptr) {
    other.emplace(report::Beside{source_of(beside->recording), beside->is_shown, beside->name, beside->own_name,
                                 beside->obtained});
  }
  io::write_text(path, report::page(source_of(recording), results, again, made, other ? &*other : nullptr));
}

void write_report(const std::string& path, const io::RecordingReader& recording, const nlohmann::json& document,
                  const report::Made& made, const ReadBeside* beside) {
  write_page(path, recording, report::results_of(document, path), made.command, made, beside);
}

}  // namespace cutproof::cli
