// One description of a recording's index, used by the writer and the reader: archive(name, value) for each field once.
// Single values, names and texts lie in the file as attributes, arrays as datasets.
#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "model/io/container_types.h"
#include "model/io/hdf5_file.h"
#include "model/rules.h"

namespace cutproof::io {

class WritingArchive {
 public:
  static constexpr bool kReading = false;
  explicit WritingArchive(hid_t group) : group_(group) {}

  template <class T>
  void operator()(const std::string& name, const T& value) {
    if constexpr (NamedChoice<T>) {
      hdf5::write_text_attribute(group_, name, std::string(name_of(value)));
    } else if constexpr (std::is_same_v<T, std::string>) {
      hdf5::write_text_attribute(group_, name, value);
    } else if constexpr (is_vector<T>) {
      hdf5::write_table(group_, name, value);
    } else {
      hdf5::write_attribute(group_, name, value);
    }
  }
  void rows(const std::string& name, const hdf5::Layout& row, const std::vector<std::byte>& bytes) {
    hdf5::write_table(group_, name, row, bytes);
  }
  // Adds to a group, which is made if it is not there.
  template <class F>
  void group(const std::string& name, F&& fields) {
    const hdf5::Id id = hdf5::group_in(group_, name);
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
  // `budget`: of all that is read whole.
  ReadingArchive(hid_t group, std::string path, hdf5::InflationBudget& budget)
      : group_(group), path_(std::move(path)), budget_(budget) {}

  template <class T>
  void operator()(const std::string& name, T& value) const {
    located(name, [&] {
      if constexpr (NamedChoice<T>) {
        const std::string found = hdf5::read_text_attribute(group_, name);
        const auto choice = choice_named<T>(found);
        if (!choice) throw hdf5::Error(name, fmt::format("This is \"{}\", which is not one of the names.", found));
        value = *choice;
      } else if constexpr (std::is_same_v<T, std::string>) {
        value = hdf5::read_text_attribute(group_, name);
      } else if constexpr (std::is_same_v<T, bool>) {
        const auto bit = hdf5::read_attribute<uint8_t>(group_, name);
        if (bit > 1) throw hdf5::Error(name, fmt::format("This is {}, and should be 0 or 1.", bit));
        value = bit == 1;
      } else if constexpr (is_vector<T>) {
        const hdf5::Table table =
            hdf5::Table::open(group_, name, hdf5::layout_of<typename T::value_type>(), budget_.file_bytes());
        budget_.take(name, static_cast<uint64_t>(table.rows()) * sizeof(typename T::value_type));
        value.resize(static_cast<std::size_t>(table.rows()));
        table.read(0, table.rows(), value.data());
      } else {
        value = hdf5::read_attribute<T>(group_, name);
      }
    });
  }
  void rows(const std::string& name, const hdf5::Layout& row, std::vector<std::byte>& bytes) const {
    const hdf5::Table stored = table(name, row);
    located(name, [&] {
      budget_.take(name, static_cast<uint64_t>(stored.rows()) * row.bytes());
      bytes.resize(static_cast<std::size_t>(stored.rows()) * row.bytes());
      stored.read(0, stored.rows(), bytes.data());
    });
  }
  hdf5::Table table(const std::string& name, const hdf5::Layout& row) const {
    return located(name, [&] { return hdf5::Table::open(group_, name, row, budget_.file_bytes()); });
  }
  // Whether a group or a dataset of this name is there.
  bool has(const std::string& name) const { return H5Lexists(group_, name.c_str(), H5P_DEFAULT) > 0; }
  std::string path_of(const std::string& name) const { return path_ + "/" + name; }
  template <class F>
  void group(const std::string& name, F&& fields) const {
    const hdf5::Id id = located(name, [&] { return hdf5::open_group(group_, name); });
    ReadingArchive inner(id.get(), path_ + "/" + name, budget_);
    fields(inner);
  }

 private:
  template <class F>
  std::invoke_result_t<F> located(const std::string& name, F&& action) const {
    try {
      return action();
    } catch (const hdf5::Error& error) {
      throw hdf5::Error(path_ + "/" + name, error.what());
    }
  }

  hid_t group_;
  std::string path_;
  hdf5::InflationBudget& budget_;
};

// Consistency of the data read; `field` is the full path. These throw hdf5::Error.
inline void require_offsets(const std::string& field, const std::vector<int64_t>& offsets, std::size_t values) {
  if (offsets.empty() || offsets.front() != 0 || !std::is_sorted(offsets.begin(), offsets.end()) ||
      offsets.back() != static_cast<int64_t>(values)) {
    throw hdf5::Error(field, fmt::format("These offsets should rise from 0 to {} without ever falling.", values));
  }
}
template <class Byte>
void require_flags(const std::string& field, const std::vector<Byte>& flags) {
  if (!std::ranges::all_of(flags, [](Byte flag) { return flag <= Byte{1}; })) {
    throw hdf5::Error(field, "These should be 0 or 1.");
  }
}

}  // namespace cutproof::io
