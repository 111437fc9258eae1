// One description of what a recording's index holds, walked by a writer or by a reader, so that the two cannot drift
// apart: walk(archive, value) names each field once.
#pragma once
#include <fmt/format.h>

#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "model/io/hdf5_file.h"

namespace cutproof::io {

class WritingArchive {
 public:
  static constexpr bool kReading = false;
  explicit WritingArchive(hid_t group) : group_(group) {}

  // A scalar or small vector, as an attribute.
  template <class T>
  void value(const std::string& name, const T& value) {
    hdf5::write_attribute(group_, name, value);
  }
  void flag(const std::string& name, bool value) { hdf5::write_attribute(group_, name, uint8_t{value}); }
  void text(const std::string& name, const std::string& value) { hdf5::write_text_attribute(group_, name, value); }
  // An enumerator by its name; `names` in the order of the enumerators.
  template <class E>
  void choice(const std::string& name, E value, std::span<const std::string_view> names) {
    text(name, std::string(names[static_cast<std::size_t>(value)]));
  }
  // An array, as a dataset.
  template <class T>
  void array(const std::string& name, const std::vector<T>& values) {
    hdf5::write_table(group_, name, values);
  }
  // Adds to a group, which is made if it is not there.
  template <class F>
  void group(const std::string& name, F&& fields) {
    const hdf5::Id id =
        hdf5::has_link(group_, name) ? hdf5::open_group(group_, name) : hdf5::create_group(group_, name);
    WritingArchive inner(id.get());
    fields(inner);
  }

 private:
  hid_t group_;
};

// Throws hdf5::Error, whose `where` is the full path of the field.
class ReadingArchive {
 public:
  static constexpr bool kReading = true;
  ReadingArchive(hid_t group, std::string path, uint64_t file_bytes)
      : group_(group), path_(std::move(path)), file_bytes_(file_bytes) {}

  template <class T>
  void value(const std::string& name, T& value) const {
    located(name, [&] { value = hdf5::read_attribute<T>(group_, name); });
  }
  void flag(const std::string& name, bool& value) const {
    uint8_t bit = 0;
    this->value(name, bit);
    if (bit > 1) throw hdf5::Error(path_ + "/" + name, fmt::format("This is {}, and should be 0 or 1.", bit));
    value = bit == 1;
  }
  void text(const std::string& name, std::string& value) const {
    located(name, [&] { value = hdf5::read_text_attribute(group_, name); });
  }
  template <class E>
  void choice(const std::string& name, E& value, std::span<const std::string_view> names) const {
    std::string found;
    text(name, found);
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (found == names[i]) {
        value = static_cast<E>(i);
        return;
      }
    }
    throw hdf5::Error(path_ + "/" + name, fmt::format("This is \"{}\", which is none of its names.", found));
  }
  template <class T>
  void array(const std::string& name, std::vector<T>& values) const {
    located(name, [&] { values = hdf5::Table<T>::open(group_, name, file_bytes_).read_all(); });
  }
  void table(const std::string& name, const hdf5::Layout& row, hdf5::RawTable& table) const {
    located(name, [&] { table = hdf5::RawTable::open(group_, name, row, file_bytes_); });
  }
  template <class F>
  void group(const std::string& name, F&& fields) const {
    hdf5::Id id;
    located(name, [&] { id = hdf5::open_group(group_, name); });
    ReadingArchive inner(id.get(), path_ + "/" + name, file_bytes_);
    fields(inner);
  }

 private:
  template <class F>
  void located(const std::string& name, F&& action) const {
    try {
      action();
    } catch (const hdf5::Error& error) {
      throw hdf5::Error(path_ + "/" + name, error.what());
    }
  }

  hid_t group_;
  std::string path_;
  uint64_t file_bytes_;
};

}  // namespace cutproof::io
