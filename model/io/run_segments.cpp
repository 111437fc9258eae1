#include "model/io/run_segments.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "model/error.h"
#include "model/io/array_parts.h"
#include "model/io/input_file.h"
#include "model/io/recording.h"
#include "model/io/state_segments.h"

namespace cutproof::io {

bool is_segment_name(const std::string& name) {
  return name.size() == 6 && std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
}

namespace {

// The number that a file of a series ends in, as in run_000012.npz; "" if it is none of a series.
std::string number_of(const std::filesystem::path& file) {
  const std::string stem = file.stem().string();
  if (file.extension() != ".npz" || stem.size() < 6) return "";
  const std::string number = stem.substr(stem.size() - 6);
  return is_segment_name(number) ? number : "";
}

std::vector<std::string> files_in(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code failed;
  std::filesystem::directory_iterator entry(folder, failed);
  for (; !failed && entry != std::filesystem::directory_iterator(); entry.increment(failed)) {
    if (!number_of(entry->path()).empty()) files.push_back(entry->path().string());
    if (files.size() > kMostSegments)
      throw InputError(folder, "", "There are too many files.", "Write longer segments.");
  }
  if (failed) throw InputError(folder, "", "The folder cannot be read.", "Check its permissions.");
  std::sort(files.begin(), files.end());
  const auto series = [](const std::string& file) { return file.substr(0, file.size() - std::size("000000.npz") + 1); };
  for (const std::string& file : files) {
    if (series(file) != series(files.front())) {
      throw InputError(file, "", "The folder has another series as well: " + files.front() + ".",
                       "Keep one run in a folder.");
    }
  }
  return files;
}

// A segment that got lost would only make bounds wider. Numbers may count steps, of which every tenth was written.
void require_equal_steps(const std::string& path, const std::vector<int64_t>& numbers) {
  for (std::size_t k = 2; k < numbers.size(); ++k) {
    if (numbers[k] - numbers[k - 1] == numbers[1] - numbers[0]) continue;
    throw InputError(path, "",
                     fmt::format("Segment {:06} comes after {:06}, and {:06} is expected.", numbers[k], numbers[k - 1],
                                 numbers[k - 1] + numbers[1] - numbers[0]),
                     "Write all segments; their numbers ascend by equal steps.");
  }
}

}  // namespace

bool RunSegments::has_segments(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return true;
  if (path.ends_with(".npz") || !is_array_file(path)) return false;
  try {
    return !hdf5_segments(path).empty();
  } catch (const InputError&) {
    return false;  // the reader reports the error
  }
}

bool RunSegments::is_segment(const ArrayFile& contents) {
  const Array* const positions = find_array(contents.arrays, "positions");
  return positions != nullptr && positions->shape.size() == 3 && find_array(contents.arrays, "kicked") == nullptr;
}

struct RunSegments::Recorded {
  explicit Recorded(const std::string& name)
      : reader(name), states(reader.header().setup, reader.header().precision, StateSegments::WithSkin::yes) {}

  std::optional<ArrayFile> next() {
    while (next_snapshot < reader.header().snapshot_count) {
      const Snapshot snapshot = reader.snapshot(next_snapshot++);
      if (snapshot.stage == Stage::skin) return states.next(snapshot.state);
    }
    return std::nullopt;
  }

  RecordingReader reader;
  StateSegments states;
  int64_t next_snapshot = 0;
};

RunSegments RunSegments::of(const std::string& path) {
  if (has_segments(path)) return RunSegments(path);
  if (!is_array_file(path)) {
    RunSegments segments;
    segments.source_ = path;
    segments.recorded_ = std::make_shared<Recorded>(path);
    return segments;
  }
  std::vector<ArrayFile> only;
  only.push_back(read_array_file(path));
  if (find_array(only.front().arrays, "kicked") != nullptr)
    throw InputError(path, "kicked", "This is a kick, and no run.", "Use cutproof kick.");
  if (!is_segment(only.front()))
    throw InputError(path, "positions", "This is no run.", "Write positions with the axes frame, particle and 3.");
  return RunSegments(path, std::move(only));
}

RunSegments::RunSegments(std::string path) : path_(std::move(path)), source_(path_) {
  std::error_code ignored;
  is_folder_ = std::filesystem::is_directory(path_, ignored);
  names_ = is_folder_ ? files_in(path_) : hdf5_segments(path_);
  if (names_.empty()) {
    throw InputError(path_, "", "This folder has no file of a run.", "Write 000000.npz, 000001.npz, … into it.");
  }
  std::vector<int64_t> numbers;
  for (const std::string& name : names_) numbers.push_back(std::stoll(is_folder_ ? number_of(name) : name));
  require_equal_steps(path_, numbers);
  if (!is_folder_) file_bytes_ = require_regular_file(path_);
}

std::optional<ArrayFile> RunSegments::next() {
  if (recorded_) return recorded_->next();
  if (next_ < in_memory_.size()) return std::move(in_memory_[next_++]);
  if (next_ >= names_.size()) return std::nullopt;
  const std::string& name = names_[next_];
  const bool is_first = next_++ == 0;
  source_ = is_folder_ ? name : path_ + "/" + name;
  if (is_folder_) file_bytes_ += require_regular_file(name);
  ArrayFile contents = is_folder_ ? read_array_file(name) : read_hdf5_segment(path_, name, is_first);
  // One small dataset may be in a million segments, by links.
  for (const Array& array : contents.arrays)
    read_bytes_ += ArrayCollector::kReadAs * static_cast<uint64_t>(array.count());
  if (read_bytes_ > most_inflated(file_bytes_)) {
    throw InputError(source_, "",
                     fmt::format("With this segment {} bytes of files become more than {}.", file_bytes_,
                                 bytes_text(most_inflated(file_bytes_))),
                     "Write segments of their own, without compression.");
  }
  return contents;
}

}  // namespace cutproof::io
