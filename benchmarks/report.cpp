#include "benchmarks/report.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fstream>

#include "cli/commands.h"
#include "gpu/backends.h"
#include "harness/backends.h"
#include "model/error.h"
#include "model/io/atomic_file.h"

namespace cutproof::cli {

namespace {

std::string cpu_description() {
  std::ifstream file("/proc/cpuinfo");
  std::string name = "CPU";
  for (std::string line; std::getline(file, line);) {
    const std::size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) {
      name = line.substr(colon + 2);
      break;
    }
  }
  return name;
}

// Of UTF-8, none of whose characters here is wider than one column.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

}  // namespace

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

Times times_of(std::vector<double> seconds) {
  if (seconds.empty()) return {};
  std::sort(seconds.begin(), seconds.end());
  const std::size_t n = seconds.size();
  return {(seconds[(n - 1) / 2] + seconds[n / 2]) / 2, seconds.front(), seconds.back(), static_cast<int64_t>(n)};
}

nlohmann::json to_json(const Times& times) {
  if (times.count == 0) return nullptr;
  return {{"median", times.median}, {"min", times.min}, {"max", times.max}};
}

void require_timed_backend(const std::string& backend) {
  if (backend == "simulated" || backend == "gpu-eager") {
    throw InputError("command line", "--backend", fmt::format("'{}' is for finding faults, not for timing", backend),
                     "use reference, host or gpu");
  }
  BackendChoice choice;
  choice.name = backend;
  static_cast<void>(make_backend(choice));
}

std::string device_of(const std::string& backend) {
  if (backend == "reference") return cpu_description() + ", 1 thread";
#if CUTPROOF_HAS_CUDA
  if (backend == "gpu") {
    std::string why;
    return gpu::device_description(why);
  }
#endif
  return fmt::format("{}, {} threads", cpu_description(), cpu_threads());
}

nlohmann::json begin_report(const std::string& suite, const std::string& backend) {
  const std::string date = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  const std::string device = device_of(backend);
  fmt::print("{} on {}, {}\n", backend, device, date);
  nlohmann::json document = {{"format", "cutproof.bench"}, {"format_version", 2}, {"suite", suite},
                             {"cutproof", kVersion},       {"date", date},        {"backend", backend},
                             {"device", device},           {"complete", false}};
  if (const char* commit = std::getenv("CUTPROOF_COMMIT"); commit != nullptr && *commit != '\0') {
    document["commit"] = commit;
  }
  return document;
}

void require_writable(const std::string& path) {
  if (!path.empty()) io::AtomicFile{path};
}

void write_report(const std::string& path, const nlohmann::json& document) {
  if (path.empty()) return;
  io::AtomicFile file(path);
  io::write_text(file.temporary(), document.dump(1) + "\n");
  file.commit();
}

std::vector<std::string> joined(std::initializer_list<std::vector<std::string>> parts) {
  std::vector<std::string> all;
  for (const std::vector<std::string>& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

std::string Table::text() const {
  std::vector<std::size_t> widths;
  for (const std::vector<std::string>& row : rows_) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], width_of(row[k]));
  }
  std::string text;
  for (const std::vector<std::string>& row : rows_) {
    std::string line;
    for (std::size_t k = 0; k < row.size(); ++k) {
      const std::string padding(widths[k] - width_of(row[k]), ' ');
      line += (k == 0 ? "  " + row[k] + padding : "  " + padding + row[k]);
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

}  // namespace cutproof::cli
