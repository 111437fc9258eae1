// Named arrays of a file from another program, read one by one. A wrong shape, a wrong kind of number and an unknown
// name are InputErrors. Habits of MATLAB and numpy are no errors: a list as a matrix of one row or one column, and an
// empty list without a type.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/io/array_file.h"
#include "model/precision.h"
#include "model/vec.h"

namespace cutproof::harness {

struct KnownArray {
  std::string_view name, text;  // what it holds, in a few words
};

class NamedArrays {
 public:
  // Keeps references. Throws InputError for an array or a text that is not among `known`, naming those that are.
  // Attributes of an HDF5 file's root that are unknown are passed over: notes() names them.
  NamedArrays(const io::ArrayFile& contents, const std::string& file, const std::vector<KnownArray>& known,
              const std::vector<KnownArray>& known_texts);

  [[noreturn]] void refuse(std::string_view name, const std::string& problem, const std::string& remedy) const;
  bool has(std::string_view name) const { return find_array(contents_.arrays, name) != nullptr; }
  // Null if it is not there. `shape`: extents, of which -1 may be any.
  const Array* find(std::string_view name, const std::vector<int64_t>& shape) const;
  const Array& require(std::string_view name, const std::vector<int64_t>& shape) const;
  const Array& require_either(std::string_view name, const std::vector<int64_t>& shape,
                              const std::vector<int64_t>& other) const;
  // Throws InputError unless both are there or neither.
  bool both(std::string_view a, std::string_view b) const;

  // Throws InputError if there are numbers and they are no integers.
  void require_whole(const Array& array) const;
  // Whole numbers, each of 32 bits.
  std::vector<int32_t> integers(const Array& array) const;
  std::vector<int64_t> long_integers(const Array& array) const;
  std::vector<double> numbers(const Array& array) const;
  // Floating-point numbers, three to an entry.
  std::vector<Vec3> vectors(const Array& array) const;
  // One number: of shape () or (1).
  std::optional<double> number(std::string_view name) const;
  std::optional<int64_t> whole_number(std::string_view name) const;

  const std::string& file() const { return file_; }
  const std::vector<std::string>& notes() const { return notes_; }  // for the reader of the verdicts

 private:
  const io::ArrayFile& contents_;
  const std::string& file_;
  std::vector<std::string> notes_;
};

bool is_real(const Array& array);
// The precision in which the numbers of an array were computed. float64 whose numbers are all float32's was single
// precision, unless it has no number of more than 16 bits: those are round, and tell nothing.
Precision precision_of(const Array& array);

}  // namespace cutproof::harness
