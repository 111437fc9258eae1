#include "model/io/recording_setup.h"

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/io/recording_archive.h"
#include "model/io/recording_format.h"
#include "model/setup_fields.h"

namespace cutproof::io {
namespace {

// Lists of structs lie in the file as one array per field, and a field that is an array itself as all of them in a row,
// with offsets.
template <class T>
using Stored = std::conditional_t<std::is_same_v<T, bool>, uint8_t, T>;

template <class Archive, class Entry>
void write_entries(Archive& archive, const std::vector<Entry>& entries) {
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
      archive(name + "_offsets", offsets);
      archive(name, all);
    } else {
      std::vector<Stored<T>> column;
      for (const Entry& entry : entries) column.push_back(get(entry));
      archive(name, column);
    }
  });
}

template <class Entry>
void read_entries(const ReadingArchive& archive, std::vector<Entry>& entries) {
  bool is_first = true;
  const auto take_count = [&](const SetupField& field, std::size_t count) {
    if (std::exchange(is_first, false)) entries.resize(count);
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
      archive(name + "_offsets", offsets);
      archive(name, all);
      require_offsets(where + "_offsets", offsets, all.size());
      take_count(field, offsets.size() - 1);
      for (std::size_t i = 0; i < entries.size(); ++i) {
        get(entries[i]).assign(all.begin() + offsets[i], all.begin() + offsets[i + 1]);
      }
    } else {
      std::vector<Stored<T>> column;
      archive(name, column);
      take_count(field, column.size());
      if constexpr (std::is_same_v<T, bool>) require_flags(where, column);
      for (std::size_t i = 0; i < entries.size(); ++i) get(entries[i]) = static_cast<T>(column[i]);
    }
  });
}

// The whole of /setup. S is Setup or const Setup.
template <class Archive, class S>
void walk_setup(Archive& archive, S& setup) {
  for_each_setup_field([&](const SetupField& field, auto get) {
    const auto add = [&](auto& group) {
      if constexpr (!is_list_of_entries<std::remove_cvref_t<decltype(get(setup))>>) {
        group(std::string(field.name), get(setup));
      } else if constexpr (Archive::kReading) {
        read_entries(group, get(setup));
      } else {
        write_entries(group, get(setup));
      }
    };
    if (field.group.empty()) {
      add(archive);
    } else {
      archive.group(std::string(field.group), add);
    }
  });
}

// A visitor that digests fields.
class DigestArchive {
 public:
  static constexpr bool kReading = false;
  explicit DigestArchive(Digest& digest) : digest_(digest) {}

  template <class T>
  void operator()(const std::string& name, const T& value) {
    digest_.add(std::string_view(name));
    if constexpr (NamedChoice<T>) {
      digest_.add(name_of(value));
    } else if constexpr (std::is_same_v<T, std::string>) {
      digest_.add(std::string_view(value));
    } else {
      digest_.add(value);
    }
  }
  template <class F>
  void group(const std::string& name, F&& fields) {
    digest_.add(std::string_view(name));
    fields(*this);
  }

 private:
  Digest& digest_;
};

}  // namespace

void write_setup(hid_t file, const Setup& setup) {
  WritingArchive root(file);
  root.group("setup", [&](auto& archive) { walk_setup(archive, setup); });
}

Setup read_setup(hid_t file, hdf5::InflationBudget& budget) {
  Setup setup;
  const ReadingArchive root(file, "", budget);
  root.group("setup", [&](auto& archive) { walk_setup(archive, setup); });
  return setup;
}

Digest digest_of_beginning(const Setup& setup, std::string_view scene_json,
                           const std::array<bool, 6>& left_to_reference, std::optional<int64_t> frames_asked) {
  Digest digest;
  digest.add(scene_json);
  digest.add(std::string_view(words_of_stages(left_to_reference)));
  digest.add(frames_asked.value_or(-1));
  DigestArchive archive(digest);
  walk_setup(archive, setup);
  return digest;
}

}  // namespace cutproof::io
