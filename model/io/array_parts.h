// Shared code of reading NPZ and HDF5. Internal to model/io/.
#pragma once
#include <algorithm>
#include <string>
#include <vector>

#include "model/error.h"
#include "model/io/array_file.h"
#include "model/io/limits.h"

namespace cutproof::io {

// Numbers as a file has them: in the machine's order of bytes, which is little endian.
enum class RawKind { signed_integer, unsigned_integer, real };
struct RawNumbers {
  RawKind kind = RawKind::real;
  int64_t bytes_each = 8;  // 1, 2, 4 or 8; a real: 4 or 8
  std::vector<int64_t> shape;
  std::vector<std::byte> bytes;
};

// As one of the five types of model/arrays.h. Throws InputError if a value fits none.
Array array_of(std::string name, RawNumbers raw, const std::string& file);

// Half precision is refused. Correct numbers would fail the bounds of single precision. Bounds of half precision, half
// a spacing wide at a thousand spacings from the origin, would reject little.
[[noreturn]] void refuse_half_precision(const std::string& file, const std::string& name);

// Adds to what was read. Throws InputError if the name is taken, if it is no plain name, or if the limits are exceeded.
class ArrayCollector {
 public:
  // Bytes of a number in memory: readers convert to 64 bits.
  static constexpr uint64_t kReadAs = 8;
  ArrayCollector(std::string file, uint64_t file_bytes) : file_(std::move(file)), file_bytes_(file_bytes) {}
  // Before an array of that size is allocated; `each`: bytes of one of its numbers.
  void announce(const std::string& name, uint64_t bytes, uint64_t each = kReadAs);
  void add(const std::string& name, RawNumbers raw);
  void add(const std::string& name, const std::vector<std::string>& texts, bool is_attribute = false);
  void ignore(std::string name) { contents_.ignored.push_back(std::move(name)); }
  // Throws InputError if a file of this size may not hold arrays of so many bytes in all.
  void require_sum(const std::string& name, uint64_t bytes) const;
  ArrayFile take() { return std::move(contents_); }

 private:
  void require_new(const std::string& name) const;
  [[noreturn]] void refuse_inflation(const std::string& name) const;
  std::string file_;
  uint64_t file_bytes_;
  ArrayFile contents_;
  uint64_t bytes_ = 0, read_bytes_ = 0;
};

// Of a file that is known to begin as such a file does.
ArrayFile read_npz(const std::string& path);
ArrayFile read_hdf5_arrays(const std::string& path);
// Of a run (run_segments.h): the names of its segments, ascending, and one of them; `with_root`: with what lies beside.
bool is_segment_name(const std::string& name);
std::vector<std::string> hdf5_segments(const std::string& path);
ArrayFile read_hdf5_segment(const std::string& path, const std::string& segment, bool with_root);
void write_npz(const std::string& path, const ArrayFile& contents);
void write_hdf5_arrays(const std::string& path, const ArrayFile& contents);

}  // namespace cutproof::io
