// A thin typed layer over the HDF5 library for recordings: handles that close themselves, tables that grow along
// their first axis, attributes, and errors with HDF5's own message. HDF5 keeps global state: use from one thread.
// Where the machine may not have the memory that HDF5 needs, std::bad_alloc is thrown before HDF5 is called.
#pragma once
#include <hdf5.h>

#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "model/vec.h"

namespace cutproof::io::hdf5 {

// HDF5 refused, or what it holds is not what was asked for. The callers know whether that is bad input or a failing
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

// Gives back the memory that is held for closing what is open. To be called before that is done, once nothing else will
// be.
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

enum class Scalar { f64, i32, i64, u8, u64 };

// How a C++ type lies in a file: scalars in an array of shape `shape` (none: one scalar).
struct Layout {
  Scalar scalar;
  std::vector<hsize_t> shape;
};
template <class T>
struct LayoutOf;
template <>
struct LayoutOf<double> {
  static Layout get() { return {Scalar::f64, {}}; }
};
template <>
struct LayoutOf<bool> {
  static_assert(sizeof(bool) == 1);
  static Layout get() { return {Scalar::u8, {}}; }
};
template <>
struct LayoutOf<int32_t> {
  static Layout get() { return {Scalar::i32, {}}; }
};
template <>
struct LayoutOf<int64_t> {
  static Layout get() { return {Scalar::i64, {}}; }
};
template <>
struct LayoutOf<uint8_t> {
  static Layout get() { return {Scalar::u8, {}}; }
};
template <>
struct LayoutOf<uint64_t> {
  static Layout get() { return {Scalar::u64, {}}; }
};
template <>
struct LayoutOf<Vec3> {
  static_assert(sizeof(Vec3) == 3 * sizeof(double));
  static Layout get() { return {Scalar::f64, {3}}; }
};
template <>
struct LayoutOf<Mat3> {
  static_assert(sizeof(Mat3) == 9 * sizeof(double));
  static Layout get() { return {Scalar::f64, {3, 3}}; }
};
template <class T, std::size_t N>
struct LayoutOf<std::array<T, N>> {
  static Layout get() { return {LayoutOf<T>::get().scalar, {N}}; }
};

// An HDF5 file. Its format has checksums on all metadata (HDF5 1.10), so that damage is noticed.
class File {
 public:
  File() = default;
  static File create(const std::string& path);
  static File open(const std::string& path);
  hid_t id() const { return id_.get(); }
  // Bytes of an opened file: an upper bound for what its tables can sensibly hold.
  uint64_t bytes() const { return bytes_; }
  void close();

 private:
  Id id_;
  uint64_t bytes_ = 0;
};

Id create_group(hid_t parent, const std::string& name);
Id open_group(hid_t parent, const std::string& name);
bool has_link(hid_t parent, const std::string& name);
bool has_attribute(hid_t object, const std::string& name);

void write_attribute(hid_t object, const std::string& name, const Layout& layout, const void* value);
void read_attribute(hid_t object, const std::string& name, const Layout& layout, void* value);
template <class T>
void write_attribute(hid_t object, const std::string& name, const T& value) {
  write_attribute(object, name, LayoutOf<T>::get(), &value);
}
template <class T>
T read_attribute(hid_t object, const std::string& name) {
  T value{};
  read_attribute(object, name, LayoutOf<T>::get(), &value);
  return value;
}
// Fixed-length text, padded with NUL, UTF-8 (ASCII if it is that); at most 64 KiB. Text must not end in NUL.
void write_text_attribute(hid_t object, const std::string& name, const std::string& text);
std::string read_text_attribute(hid_t object, const std::string& name);

// A dataset of rows: compressed, with a checksum per chunk, extendible.
class RawTable {
 public:
  RawTable() = default;
  // `expected_rows`: how many will be written, or 0 for a table that grows.
  static RawTable create(hid_t parent, const std::string& name, const Layout& row, int64_t expected_rows);
  // Throws Error if it is missing, or of another type or shape, or claims more rows than `file_bytes` can hold.
  static RawTable open(hid_t parent, const std::string& name, const Layout& row, uint64_t file_bytes);
  int64_t rows() const { return rows_; }
  int64_t append(const void* values, int64_t count);  // returns the index of the first new row
  void read(int64_t first, int64_t count, void* values) const;
  // Writes out what is buffered; throws Error where the destructor would stay silent.
  void close() { id_.close(name_); }
  const std::string& name() const { return name_; }

 private:
  Id id_;
  Layout row_;
  int64_t rows_ = 0;
  hsize_t chunk_bytes_ = 0;  // if opened: of a chunk, in memory
  std::string name_;
};

template <class T>
class Table {
 public:
  Table() = default;
  static Table create(hid_t parent, const std::string& name, int64_t expected_rows = 0) {
    return Table(RawTable::create(parent, name, LayoutOf<T>::get(), expected_rows));
  }
  static Table open(hid_t parent, const std::string& name, uint64_t file_bytes) {
    return Table(RawTable::open(parent, name, LayoutOf<T>::get(), file_bytes));
  }
  int64_t rows() const { return raw_.rows(); }
  const std::string& name() const { return raw_.name(); }
  void close() { raw_.close(); }
  int64_t append(std::span<const T> values) { return raw_.append(values.data(), static_cast<int64_t>(values.size())); }
  // Requires 0 <= first, 0 <= count, first + count <= rows(); throws Error otherwise.
  std::vector<T> read(int64_t first, int64_t count) const {
    if (first < 0 || count < 0 || first > rows() - count) {
      throw Error(name(), "Rows are asked for that the table does not have.");
    }
    std::vector<T> values(static_cast<std::size_t>(count));
    raw_.read(first, count, values.data());
    return values;
  }
  std::vector<T> read_all() const { return read(0, rows()); }

 private:
  explicit Table(RawTable raw) : raw_(std::move(raw)) {}
  RawTable raw_;
};

// A whole table at once.
template <class T>
void write_table(hid_t parent, const std::string& name, const std::vector<T>& values) {
  Table<T> table = Table<T>::create(parent, name, static_cast<int64_t>(values.size()));
  table.append(values);
  table.close();
}

}  // namespace cutproof::io::hdf5
