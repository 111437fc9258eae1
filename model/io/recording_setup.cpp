#include "model/io/recording_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <type_traits>
#include <vector>

#include "model/io/recording_archive.h"
#include "model/setup_fields.h"

namespace cutproof::io {
namespace {

template <class T>
inline constexpr bool is_vector = false;
template <class T>
inline constexpr bool is_vector<std::vector<T>> = true;

// Lists of structs lie in the file as one array per field, and a field that is an array itself as all of them in a row,
// with offsets.
template <class T>
using Stored = std::conditional_t<std::is_same_v<T, bool>, uint8_t, T>;

template <class Entry>
void write_entries(WritingArchive& archive, const std::vector<Entry>& entries) {
  for_each_entry_field<Entry>([&](const SetupField& field, auto get) {
    using T = std::remove_cvref_t<decltype(get(entries[0]))>;
    const std::string name(field.name);
    if constexpr (is_vector<T>) {
      std::vector<int64_t> offsets = {0};
      T all;
      for (const Entry& entry : entries) {
        all.insert(all.end(), get(entry).begin(), get(entry).end());
        offsets.push_back(static_cast<int64_t>(all.size()));
      }
      archive.array(name + "_offsets", offsets);
      archive.array(name, all);
    } else {
      std::vector<Stored<T>> column;
      for (const Entry& entry : entries) column.push_back(get(entry));
      archive.array(name, column);
    }
  });
}

template <class Entry>
void read_entries(const ReadingArchive& archive, std::vector<Entry>& entries) {
  bool is_first = true;
  const auto take_count = [&](const SetupField& field, std::size_t count) {
    if (is_first) entries.resize(count);
    is_first = false;
    if (entries.size() != count) {
      throw hdf5::Error(fmt::format("/setup/{}", field.group), "The arrays of this group should be of equal length.");
    }
  };
  for_each_entry_field<Entry>([&](const SetupField& field, auto get) {
    using T = std::remove_cvref_t<decltype(get(entries[0]))>;
    const std::string name(field.name);
    const std::string where = fmt::format("/setup/{}/{}", field.group, name);
    if constexpr (is_vector<T>) {
      std::vector<int64_t> offsets;
      T all;
      archive.array(name + "_offsets", offsets);
      archive.array(name, all);
      if (offsets.empty() || offsets.front() != 0 || !std::is_sorted(offsets.begin(), offsets.end()) ||
          offsets.back() != static_cast<int64_t>(all.size())) {
        throw hdf5::Error(where + "_offsets",
                          fmt::format("These offsets should rise from 0 to {} without ever falling.", all.size()));
      }
      take_count(field, offsets.size() - 1);
      for (std::size_t i = 0; i < entries.size(); ++i) {
        get(entries[i]).assign(all.begin() + offsets[i], all.begin() + offsets[i + 1]);
      }
    } else {
      std::vector<Stored<T>> column;
      archive.array(name, column);
      take_count(field, column.size());
      for (std::size_t i = 0; i < entries.size(); ++i) {
        if constexpr (std::is_same_v<T, bool>) {
          if (column[i] > 1) throw hdf5::Error(where, "These should be 0 or 1.");
          get(entries[i]) = column[i] == 1;
        } else {
          get(entries[i]) = column[i];
        }
      }
    }
  });
}

// Single values lie in the file as attributes, arrays as datasets. Value is what a field holds, or const.
template <class Archive, class Value>
void walk_field(Archive& archive, const std::string& name, Value& value) {
  using T = std::remove_const_t<Value>;
  if constexpr (is_list_of_entries<T>) {
    if constexpr (Archive::kReading) {
      read_entries(archive, value);
    } else {
      write_entries(archive, value);
    }
  } else if constexpr (NamedChoice<T>) {
    archive.choice(name, value, names_of(T{}));
  } else if constexpr (std::is_same_v<T, bool>) {
    archive.flag(name, value);
  } else if constexpr (std::is_same_v<T, std::string>) {
    archive.text(name, value);
  } else if constexpr (is_vector<T>) {
    archive.array(name, value);
  } else {
    archive.value(name, value);
  }
}

// The whole of /setup. S is Setup or const Setup.
template <class Archive, class S>
void walk(Archive& archive, S& setup) {
  for_each_setup_field([&](const SetupField& field, auto get) {
    const std::string name(field.name);
    if (field.group.empty()) {
      walk_field(archive, name, get(setup));
    } else {
      archive.group(std::string(field.group), [&](auto& group) { walk_field(group, name, get(setup)); });
    }
  });
}

}  // namespace

void write_setup(hid_t file, const Setup& setup) {
  WritingArchive root(file);
  root.group("setup", [&](auto& archive) { walk(archive, setup); });
}

Setup read_setup(hid_t file, uint64_t file_bytes) {
  Setup setup;
  const ReadingArchive root(file, "", file_bytes);
  root.group("setup", [&](auto& archive) { walk(archive, setup); });
  return setup;
}

}  // namespace cutproof::io
