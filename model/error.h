// The two kinds of exception that cross a boundary. A wrong simulation is neither: it is a failing Verdict.
#pragma once
#include <stdexcept>
#include <string>
#include <utility>

#include "model/printable.h"

namespace cutproof {

// Bad input or usage; the program ends with exit status 2. Names the file, the field, the error (with the value) and
// the remedy. All of these may quote files: what() is printable, of two lines, and of limited length.
class InputError : public std::runtime_error {
 public:
  InputError(std::string file, std::string field, const std::string& problem, const std::string& remedy)
      : std::runtime_error(shown(file, kMostNameBytes) + (field.empty() ? "" : ": " + shown(field, kMostFieldBytes)) +
                           ": " + shown(problem, kMostTextBytes) +
                           (remedy.empty() ? "" : "\n  remedy: " + shown(remedy, kMostTextBytes))),
        file_(std::move(file)),
        field_(std::move(field)),
        problem_(problem),
        remedy_(remedy) {}
  const std::string& file() const { return file_; }
  const std::string& field() const { return field_; }
  // As they were given: for an error that says the same of another source.
  const std::string& problem() const { return problem_; }
  const std::string& remedy() const { return remedy_; }

 private:
  static constexpr std::size_t kMostNameBytes = 4096, kMostFieldBytes = 300, kMostTextBytes = 4000;
  static std::string shown(std::string_view text, std::size_t most) { return printable(shortened(text, most)); }
  std::string file_, field_, problem_, remedy_;
};

// The device or the machine failed (memory, disk, GPU); exit status 3.
class MachineError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace cutproof
