// Recordings whose files are sound HDF5 with any contents: bytes are edits of the small recording, made through the
// HDF5 library, so that checksums are right and our own checks are all that stands between the values and the program.
#include <hdf5.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "model/io/hdf5_file.h"
#include "tests/input_fuzzing/recording_target.h"
#include "tests/model/recorded_items.h"

namespace cutproof::input_fuzzing {
namespace of_recording_contents {

namespace hdf5 = io::hdf5;

// A dataset, or an attribute of an object, in one of the three files.
struct Item {
  std::size_t part;
  std::string object;     // path
  std::string attribute;  // empty: the object itself, a dataset
};

// How an edit lies in the input.
struct Edit {
  static constexpr std::size_t kBytes = 12;
  enum class Action { overwrite, resize, remove, retype };
  std::size_t item;
  Action action;
  uint8_t place;
  uint64_t value;
};

Edit edit_at(std::string_view bytes) {
  const auto byte = [&](std::size_t i) { return static_cast<uint8_t>(bytes[i]); };
  uint64_t value = 0;
  for (std::size_t i = 0; i < 8; ++i) value |= uint64_t{byte(4 + i)} << (8 * i);
  return {byte(0) + std::size_t{256} * byte(1), static_cast<Edit::Action>(byte(2) % 4), byte(3), value};
}

std::string bytes_of(const Edit& edit) {
  std::string bytes = {static_cast<char>(edit.item % 256), static_cast<char>(edit.item / 256),
                       static_cast<char>(edit.action), static_cast<char>(edit.place)};
  for (std::size_t i = 0; i < 8; ++i) bytes += static_cast<char>(edit.value >> (8 * i));
  return bytes;
}

hdf5::Id opened(std::size_t part, unsigned flags) {
  const std::string path = recording_path(part);
  return {H5Fopen(path.c_str(), flags, H5P_DEFAULT), H5Fclose, path};
}

// Everything that can be edited, in the order of the files and of the names.
std::vector<Item> found_items() {
  const hdf5::Quiet quiet;
  std::vector<Item> items;
  for (std::size_t part = 0; part < 3; ++part) {
    write_recording_part(part, small_recording()[part]);
    for (const tests::RecordedItem& item : tests::items_of(recording_path(part))) {
      items.push_back({part, item.object, item.attribute});
    }
  }
  return items;
}

const std::vector<Item>& all_items() {
  static const std::vector<Item> items = found_items();
  return items;
}

// --- The edits. Where HDF5 refuses one, it throws hdf5::Error, and the edit is none. ---------------------------------

// Puts the first bytes of the value into the entry `place`, counted round, of `entries` of `size` bytes each.
void overwrite(std::string& content, std::size_t entries, std::size_t size, const Edit& edit) {
  if (entries == 0 || size == 0) return;
  std::memcpy(content.data() + edit.place % entries * size, &edit.value, std::min(size, sizeof edit.value));
}

// Types that no field of a recording has, or only some.
hid_t other_type(uint64_t value) {
  const std::array<hid_t, 6> types = {H5T_IEEE_F32LE, H5T_STD_I16BE, H5T_STD_U8LE,
                                      H5T_STD_I64LE,  H5T_C_S1,      H5T_IEEE_F64LE};
  return types[value % types.size()];
}

hdf5::Id other_space(uint64_t value) {
  constexpr std::array<hsize_t, 3> kExtents = {1, 3, 2};
  const int rank = static_cast<int>(value % 5) - 1;
  if (rank < 0) return {H5Screate(H5S_NULL), H5Sclose, "space"};
  if (rank == 0) return {H5Screate(H5S_SCALAR), H5Sclose, "space"};
  return {H5Screate_simple(rank, kExtents.data(), nullptr), H5Sclose, "space"};
}

void edit_dataset(hid_t file, const std::string& path, const Edit& edit) {
  if (edit.action == Edit::Action::remove || edit.action == Edit::Action::retype) {
    H5Ldelete(file, path.c_str(), H5P_DEFAULT);
    if (edit.action == Edit::Action::remove) return;
    const hdf5::Id space = other_space(edit.place);
    const hdf5::Id made(
        H5Dcreate2(file, path.c_str(), other_type(edit.value), space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
        H5Dclose, path);
    return;
  }
  const hdf5::Id dataset(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose, path);
  const hdf5::Id space(H5Dget_space(dataset.get()), H5Sclose, path);
  std::array<hsize_t, H5S_MAX_RANK> dims = {};
  H5Sget_simple_extent_dims(space.get(), dims.data(), nullptr);
  if (edit.action == Edit::Action::resize) {
    // Few rows, in most cases, or as many as the value says.
    dims[0] = edit.place < 255 ? edit.place : edit.value;
    H5Dset_extent(dataset.get(), dims.data());
    return;
  }
  const hdf5::Id type(H5Dget_type(dataset.get()), H5Tclose, path);
  const auto entries = static_cast<std::size_t>(std::max<hssize_t>(H5Sget_simple_extent_npoints(space.get()), 0));
  // An earlier edit may have made it as long as it likes.
  if (entries > (std::size_t{1} << 16)) return;
  std::string content(entries * H5Tget_size(type.get()), '\0');
  if (H5Dread(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, content.data()) < 0) return;
  overwrite(content, entries, H5Tget_size(type.get()), edit);
  H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, content.data());
}

void edit_attribute(hid_t file, const Item& item, const Edit& edit) {
  const hdf5::Id object(H5Oopen(file, item.object.c_str(), H5P_DEFAULT), H5Oclose, item.object);
  const char* name = item.attribute.c_str();
  hdf5::Id type;
  {
    const hdf5::Id attribute(H5Aopen(object.get(), name, H5P_DEFAULT), H5Aclose, name);
    type = hdf5::Id(H5Aget_type(attribute.get()), H5Tclose, name);
    if (edit.action == Edit::Action::overwrite) {
      const hdf5::Id space(H5Aget_space(attribute.get()), H5Sclose, name);
      const auto points = static_cast<std::size_t>(std::max<hssize_t>(H5Sget_simple_extent_npoints(space.get()), 0));
      std::string content(points * H5Tget_size(type.get()), '\0');
      if (content.empty() || H5Aread(attribute.get(), type.get(), content.data()) < 0) return;
      // A text is one point: its letters are what can be changed.
      const bool text = H5Tget_class(type.get()) == H5T_STRING;
      overwrite(content, text ? content.size() : points, text ? 1 : H5Tget_size(type.get()), edit);
      H5Awrite(attribute.get(), type.get(), content.data());
      return;
    }
  }
  H5Adelete(object.get(), name);
  if (edit.action == Edit::Action::remove) return;
  const hdf5::Id space = other_space(edit.place);
  const hdf5::Id made(
      H5Acreate2(object.get(), name, edit.action == Edit::Action::resize ? type.get() : other_type(edit.value),
                 space.get(), H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose, name);
}

void apply(const std::vector<Edit>& edits) {
  const hdf5::Quiet quiet;
  for (std::size_t part = 0; part < 3; ++part) {
    hdf5::Id file;
    for (const Edit& edit : edits) {
      const Item& item = all_items()[edit.item % all_items().size()];
      if (item.part != part) continue;
      if (file.get() < 0) file = opened(part, H5F_ACC_RDWR);
      try {
        if (item.attribute.empty()) {
          edit_dataset(file.get(), item.object, edit);
        } else {
          edit_attribute(file.get(), item, edit);
        }
      } catch (const hdf5::Error&) {
        // Gone, for example, by an earlier edit.
      }
    }
    file.close(recording_path(part));
  }
}

Outcome feed(std::string_view bytes) {
  constexpr std::size_t kMostEdits = 8;
  std::vector<Edit> edits;
  while (bytes.size() >= Edit::kBytes && edits.size() < kMostEdits) {
    edits.push_back(edit_at(bytes));
    bytes.remove_prefix(Edit::kBytes);
  }
  for (std::size_t part = 0; part < 3; ++part) write_recording_part(part, small_recording()[part]);
  apply(edits);
  return read_recording();
}

// No edit; and some after which it is still a recording, in each of the three files.
std::vector<std::string> seeds() {
  const auto edit = [](std::size_t part, const std::string& object, const std::string& attribute, uint64_t value) {
    const auto& items = all_items();
    const auto found = std::ranges::find_if(items, [&](const Item& item) {
      return item.part == part && item.object == object && item.attribute == attribute;
    });
    if (found == items.end()) broken_contract("the small recording has no " + object + " " + attribute);
    return bytes_of({static_cast<std::size_t>(found - items.begin()), Edit::Action::overwrite, 0, value});
  };
  constexpr uint64_t kNan = 0x7ff8000000000001;
  const std::vector<std::string> edits = {edit(0, "snapshots/frame", "", std::numeric_limits<uint64_t>::max()),
                                          edit(0, "setup/step", "iterations", 1000), edit(1, "VTKHDF/Points", "", kNan),
                                          edit(2, "VTKHDF/PointData/owner", "", 77)};
  std::vector<std::string> seeds = {""};
  std::string all;
  for (const std::string& one : edits) {
    seeds.push_back(one);
    all += one;
  }
  seeds.push_back(all);
  return seeds;
}

}  // namespace of_recording_contents

const Target kRecordingContents = {"recording_contents", of_recording_contents::feed, of_recording_contents::seeds};

}  // namespace cutproof::input_fuzzing
