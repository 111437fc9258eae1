// What the suites of `cutproof bench` share: times, the head of their JSON, tables on the terminal.
#pragma once
#include <chrono>
#include <cstdint>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace cutproof::cli {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point begin);

struct Times {
  double median = 0, min = 0, max = 0;  // [s]
  int64_t count = 0;                    // of samples; 0: nothing was measured
};
Times times_of(std::vector<double> seconds);
// null if nothing was measured.
nlohmann::json to_json(const Times& times);

// Refuses what cannot be timed: throws InputError for a backend that does not exist, is not in this build or is for
// finding faults, MachineError if there is no device.
void require_timed_backend(const std::string& backend);
// The processor and how many of its threads work, or the CUDA device.
std::string device_of(const std::string& backend);

// The fields with which every suite's JSON begins (docs/results_schema.md), and the line with which its output does.
// CUTPROOF_COMMIT in the environment says from which commit the program is.
nlohmann::json begin_report(const std::string& suite, const std::string& backend);
// Nothing if `path` is empty, else a failure now rather than after the measurements: throws InputError if the folder is
// not there or not writable.
void require_writable(const std::string& path);
// The whole document or nothing; nothing if `path` is empty.
void write_report(const std::string& path, const nlohmann::json& document);

// Lists one after the other: a table's row from its parts.
std::vector<std::string> joined(std::initializer_list<std::vector<std::string>> parts);

// Columns as wide as what stands in them; the first is flush left, the others flush right.
class Table {
 public:
  explicit Table(std::vector<std::string> head) { rows_.push_back(std::move(head)); }
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace cutproof::cli
