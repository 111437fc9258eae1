// The two kinds of exception that cross a boundary. A wrong simulation is neither: it is a failing Verdict.
#pragma once
#include <stdexcept>
#include <string>
#include <utility>

namespace cutproof {

// What errors quote from files may hold anything: a NUL would cut the message off, an escape would act on the terminal.
inline std::string without_control_characters(std::string text) {
  for (char& c : text) {
    if ((static_cast<unsigned char>(c) < 32 && c != '\n') || c == 127) c = '?';
  }
  return text;
}

// Bad input or usage; the program ends with exit status 2. Names the file, the field in it, what is wrong
// (with the value), and what would be right.
class InputError : public std::runtime_error {
 public:
  InputError(std::string file, std::string field, const std::string& problem, const std::string& remedy)
      : std::runtime_error(without_control_characters(file + (field.empty() ? "" : ": " + field) + ": " + problem +
                                                      (remedy.empty() ? "" : "\n  remedy: " + remedy))),
        file_(std::move(file)),
        field_(std::move(field)) {}
  const std::string& file() const { return file_; }
  const std::string& field() const { return field_; }

 private:
  std::string file_, field_;
};

// The device or the machine failed (memory, disk, GPU); exit status 3.
class MachineError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace cutproof
