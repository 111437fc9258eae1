#include "cli/progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "model/io/columns.h"

namespace cutproof::cli {

namespace {

constexpr double kLeastSeconds = 1;  // before that nothing is foretold

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// Whether a line of progress stands on the terminal.
bool& stands() {
  static bool line = false;
  return line;
}

}  // namespace

std::size_t terminal_columns() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : io::kColumns;
}

void Remaining::note(double seconds, double part) {
  if (marks_.size() >= kMostMarks) {  // every other one tells as much
    std::deque<Mark> fewer;
    for (std::size_t k = 0; k < marks_.size(); k += 2) fewer.push_back(marks_[k]);
    marks_ = std::move(fewer);
  }
  marks_.push_back({seconds, std::clamp(part, 0.0, 1.0)});
}

std::optional<double> Remaining::seconds() const {
  if (marks_.empty()) return std::nullopt;
  const Mark& last = marks_.back();
  if (last.part >= 1) return 0;
  if (last.seconds < kLeastSeconds || !(last.part > 0)) return std::nullopt;
  // The last mark in the former half of the time; before the first there was nothing done at time 0.
  Mark from{0, 0};
  for (const Mark& mark : marks_) {
    if (mark.seconds > last.seconds / 2) break;
    from = mark;
  }
  const double done = last.part - from.part, took = last.seconds - from.seconds;
  if (!(done > 0)) return std::nullopt;
  return took / done * (1 - last.part);
}

std::string in_words(double seconds) {
  const auto rounded = [](double value, double step) {
    return static_cast<long long>(std::max(1.0, std::round(value / step)) * step);
  };
  if (!(seconds < 360 * 3600.0)) return "days";
  if (seconds < 10) return fmt::format("{} s", rounded(seconds, 1));
  if (seconds < 57.5) return fmt::format("{} s", rounded(seconds, 5));
  const auto minutes = rounded(seconds / 60, seconds < 3570 ? 1 : 10);
  if (minutes < 60) return fmt::format("{} min", minutes);
  if (minutes % 60 == 0 || minutes >= 600) return fmt::format("{} h", (minutes + 30) / 60);
  return fmt::format("{} h {} min", minutes / 60, minutes % 60);
}

std::string elapsed_and_remaining(double elapsed, std::optional<double> remaining) {
  const std::string passed = "elapsed " + in_words(elapsed);
  if (!remaining) return passed;
  return *remaining < 1.5 ? passed + ", nearly done" : fmt::format("{}, about {} left", passed, in_words(*remaining));
}

Progress::Progress(std::string thing, int64_t total)
    : thing_(std::move(thing)), total_(total), terminal_(isatty(STDERR_FILENO) != 0), begin_(now()) {}

Progress::~Progress() { clear_all(); }

void Progress::clear_all() {
  if (!stands()) return;
  std::fputs("\r\x1b[K", stderr);
  std::fflush(stderr);
  stands() = false;
}

void Progress::draw(const std::string& line) {
  clear_all();
  // One column less: in the last one some terminals begin a new line.
  const std::string cut = io::cut_to_words(line, std::max<std::size_t>(terminal_columns(), 2) - 1);
  std::fflush(stdout);
  std::fwrite(cut.data(), 1, cut.size(), stderr);
  std::fflush(stderr);
  stands() = true;
}

void Progress::tell(std::string_view what) {
  if (terminal_) draw(fmt::format("{}: {}", thing_, what));
}

void Progress::show(int64_t done, const std::string& what) {
  show(done, what, total_ > 0 ? static_cast<double>(done) / static_cast<double>(total_) : 0);
}

void Progress::show(int64_t done, const std::string& what, double part) {
  if (!terminal_) return;
  const double time = now();
  remaining_.note(time - begin_, part);
  if (time - last_ < 0.1 && done != total_) return;
  last_ = time;
  const std::string count =
      total_ > 0 ? fmt::format("{} {} of {}", thing_, done, total_) : fmt::format("{} {}", thing_, done);
  // The least important part is last, where a narrow terminal cuts first.
  draw(fmt::format("{}, {}: {}", count, elapsed_and_remaining(time - begin_, remaining_.seconds()), what));
}

}  // namespace cutproof::cli
