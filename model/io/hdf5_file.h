// A thin typed layer over the HDF5 library for recordings: handles that close themselves, tables that grow along
// their first axis, attributes, and errors with HDF5's own message. HDF5 keeps global state: use from one thread.
// Where the machine may not have the memory that HDF5 needs, std::bad_alloc is thrown before HDF5 is called.
#pragma once
#include <hdf5.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "model/vec.h"

namespace cutproof::io::hdf5 {

// HDF5 failed, or the file does not have the requested content. Callers know whether this is bad input or a failing
// machine, and translate.
class Error : public std::runtime_error {
 public:
  Error(std::string where, const std::string& problem) : std::runtime_error(problem), where_(std::move(where)) {}
  const std::string& where() const { return where_; }  // dataset, attribute or group

 private:
  std::string where_;
};

// While one lives, HDF5 prints nothing; its messages travel in Error.
class Quiet {
 public:
  Quiet();
  ~Quiet();
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

// Bytes that may still be read from files of this size: most_inflated() of it.
class InflationBudget {
 public:
  InflationBudget() = default;
  explicit InflationBudget(uint64_t file_bytes);
  uint64_t file_bytes() const { return file_bytes_; }
  // Throws Error, naming `where`, if no `bytes` are left.
  void take(const std::string& where, uint64_t bytes);

 private:
  uint64_t file_bytes_ = 0, left_ = 0;
};

// Releases the memory reserved for closing handles. Call before closing, when only closing is left to do.
void release_memory();

// Owns one HDF5 identifier.
class Id {
 public:
  using Close = herr_t (*)(hid_t);
  Id() = default;
  // Throws Error, with the library's message, if `id` is one of a failed call.
  Id(hid_t id, Close closer, const std::string& where);
  Id(Id&& other) noexcept;
  Id& operator=(Id&& other) noexcept;
  ~Id();
  hid_t get() const { return id_; }
  // Closes now; throws Error if that fails, which is when HDF5 could not write what it had buffered.
  void close(const std::string& where);

 private:
  hid_t id_ = H5I_INVALID_HID;
  Close close_ = nullptr;
};

enum class Scalar { f64, i32, i64, u8, u64, f32 };

// How a C++ type lies in a file: scalars in an array of shape `shape` (none: one scalar).
struct Layout {
  Scalar scalar;
  std::vector<hsize_t> shape;
  std::size_t bytes() const;
};
template <class T>
Layout layout_of() {
  static_assert(sizeof(bool) == 1 && sizeof(Vec3) == 3 * sizeof(double) && sizeof(Mat3) == 9 * sizeof(double));
  if constexpr (std::is_same_v<T, Vec3>) {
    return {Scalar::f64, {3}};
  } else if constexpr (std::is_same_v<T, Mat3>) {
    return {Scalar::f64, {3, 3}};
  } else if constexpr (std::is_class_v<T>) {  // std::array
    return {layout_of<typename T::value_type>().scalar, {std::tuple_size_v<T>}};
  } else if constexpr (std::is_same_v<T, double>) {
    return {Scalar::f64, {}};
  } else if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, uint8_t>) {
    return {Scalar::u8, {}};
  } else if constexpr (std::is_same_v<T, uint64_t>) {
    return {Scalar::u64, {}};
  } else {
    static_assert(std::is_same_v<T, int32_t> || std::is_same_v<T, int64_t>);
    return {sizeof(T) == 4 ? Scalar::i32 : Scalar::i64, {}};
  }
}

// An HDF5 file. Its format has checksums on all metadata (HDF5 1.10), so that damage is noticed.
class File {
 public:
  File() = default;
  static File create(const std::string& path);
  static File open(const std::string& path);
  hid_t id() const { return id_.get(); }
  // Bytes of an opened file: an upper bound for the contents of its tables.
  uint64_t bytes() const { return bytes_; }
  void close();

 private:
  Id id_;
  uint64_t bytes_ = 0;
};

Id create_group(hid_t parent, const std::string& name);
Id open_group(hid_t parent, const std::string& name);  // throws Error if a link on the way leads elsewhere
Id group_in(hid_t parent, const std::string& name);    // which is made if it is not there
bool has_attribute(hid_t object, const std::string& name);

void write_attribute(hid_t object, const std::string& name, const Layout& layout, const void* value);
void read_attribute(hid_t object, const std::string& name, const Layout& layout, void* value);
template <class T>
void write_attribute(hid_t object, const std::string& name, const T& value) {
  write_attribute(object, name, layout_of<T>(), &value);
}
template <class T>
T read_attribute(hid_t object, const std::string& name) {
  T value{};
  read_attribute(object, name, layout_of<T>(), &value);
  return value;
}
// Fixed-length text, padded with NUL, UTF-8 (ASCII if it is that); at most 64 KiB. Text must not end in NUL.
void write_text_attribute(hid_t object, const std::string& name, const std::string& text);
std::string read_text_attribute(hid_t object, const std::string& name);

// A dataset of rows: compressed, with a checksum per chunk, extendible.
class Table {
 public:
  Table() = default;
  // `expected_rows`: how many will be written, or 0 for a table that grows.
  static Table create(hid_t parent, const std::string& name, const Layout& row, int64_t expected_rows = 0);
  // Throws Error if the table is missing, has another type or shape, or claims more rows than `file_bytes` can hold.
  // Throws Error if its rows lie elsewhere: behind soft and external links, in other files, or behind filters that are
  // not HDF5's own.
  static Table open(hid_t parent, const std::string& name, const Layout& row, uint64_t file_bytes);
  int64_t rows() const { return rows_; }
  int64_t append(std::span<const std::byte> rows);  // whole ones; returns the index of the first new row
  // Requires 0 <= first, 0 <= count, first + count <= rows().
  void read(int64_t first, int64_t count, void* values) const;
  // Writes out what is buffered; throws Error where the destructor would stay silent.
  void close() { id_.close(name_); }

 private:
  // Calls H5Dread or H5Dwrite, with the types and spaces that they need, for `count` rows from `first`.
  template <class Transfer>
  void transfer(int64_t first, int64_t count, const Transfer& call) const;

  Id id_;
  Layout row_;
  int64_t rows_ = 0;
  hsize_t chunk_bytes_ = 0;  // if opened: of a chunk, in memory
  std::string name_;
};

// --- What others wrote: datasets and texts of any name, of any shape and of any type of number
// ------------------------

// Names of the objects in a group, ascending. Throws Error if there are more than `most`, or if a link leads elsewhere
// (a soft, external or user-defined one).
std::vector<std::string> names_in(hid_t group, std::size_t most);
std::vector<std::string> attribute_names(hid_t object, std::size_t most);

enum class ValueKind { signed_integer, unsigned_integer, real, text };

// A dataset or an attribute, opened.
class Values {
 public:
  // Throws Error if the dataset is neither number nor text, has more than 8 axes, leads to other files (external
  // storage, virtual datasets), or uses filters that are not HDF5's own. Throws Error if it claims more than
  // `most_bytes`, or more than its stored bytes can hold.
  static Values of_dataset(hid_t parent, const std::string& name, uint64_t most_bytes, uint64_t file_bytes);
  static Values of_attribute(hid_t object, const std::string& name, uint64_t most_bytes, uint64_t file_bytes);
  ValueKind kind() const { return kind_; }
  int64_t bytes_each() const { return bytes_each_; }  // of a number: 1, 2, 4 or 8; a real: 2, 4 or 8
  const std::vector<int64_t>& shape() const { return shape_; }
  uint64_t bytes() const;
  // Whether it has an attribute of this name that is this text. Throws Error if the attribute has more than 256 bytes.
  bool has_text(const std::string& attribute, const std::string& text) const;
  // Requires numbers (no reals of 2 bytes), and room for bytes(). In the machine's own order of bytes.
  void read(std::byte* values) const;
  // Requires text. Throws Error if there is more than `most` bytes of it.
  std::vector<std::string> texts(uint64_t most) const;

 private:
  void look(Id type, const Id& space, uint64_t most_bytes);
  void transfer(hid_t memory_type, void* values) const;

  Id id_;
  Id type_;
  bool is_dataset_ = false;
  ValueKind kind_ = ValueKind::real;
  int64_t bytes_each_ = 0;
  std::vector<int64_t> shape_;
  uint64_t chunk_bytes_ = 0;
  uint64_t file_bytes_ = 0;
  std::string name_;
};

// A dataset as others read it: plain, without compression.
void write_dataset(hid_t parent, const std::string& name, const Layout& layout, const void* values);

// A whole table at once.
void write_table(hid_t parent, const std::string& name, const Layout& row, std::span<const std::byte> rows);
template <class T>
void write_table(hid_t parent, const std::string& name, const std::vector<T>& values) {
  write_table(parent, name, layout_of<T>(), std::as_bytes(std::span(values)));
}

}  // namespace cutproof::io::hdf5
