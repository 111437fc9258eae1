// One line on a terminal that says how far something is, and when it will be done. Silent when piped.
#pragma once
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

namespace cutproof::cli {

// Of the terminal at standard error at this moment: it may be resized. kColumns where it does not say.
std::size_t terminal_columns();

// When something will be done, from how much of it was done when.
class Remaining {
 public:
  // `part` in [0, 1] was done `seconds` after the beginning; neither falls from one call to the next.
  void note(double seconds, double part);
  // [s]; empty as long as too little is known. By the rate of the latter half of the time, because early work often
  // differs: uncut tissue, or smaller cases.
  std::optional<double> seconds() const;

  // How many notes are kept, however many there were.
  static constexpr std::size_t kMostMarks = 512;
  std::size_t marks() const { return marks_.size(); }

 private:
  struct Mark {
    double seconds, part;
  };
  std::deque<Mark> marks_;
};

// "40 s", "2 min", "1 h 20 min": two figures at most.
std::string in_words(double seconds);
// "elapsed 12 s, about 2 min left"; without unknown parts.
std::string elapsed_and_remaining(double elapsed, std::optional<double> remaining);

class Progress {
 public:
  // Of `total` things of this name; 0: the number is not known.
  Progress(std::string thing, int64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(int64_t done, const std::string& what);
  // `part`: how much of the whole is done, where that is not done / total.
  void show(int64_t done, const std::string& what, double part);

  // The present work, where there is nothing to count; shown at once.
  void tell(std::string_view what);

  // Takes the line off the terminal, so that something else can be printed: of whichever there is.
  static void clear_all();

 private:
  void draw(const std::string& line);
  std::string thing_;
  int64_t total_;
  bool terminal_;
  double begin_, last_ = -1;
  Remaining remaining_;
};

}  // namespace cutproof::cli
