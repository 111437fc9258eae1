// What can be changed in an HDF5 file through its library, so that checksums stay right: datasets and attributes.
#pragma once
#include <hdf5.h>

#include <string>
#include <vector>

#include "model/io/hdf5_file.h"

namespace cutproof::tests {

struct RecordedItem {
  std::string object;     // path
  std::string attribute;  // empty: the object itself, a dataset
};

// All of a file, in the order of names.
inline std::vector<RecordedItem> items_of(const std::string& file) {
  namespace hdf5 = io::hdf5;
  struct Object {
    std::string path;
    bool is_dataset;
  };
  const auto note_object = [](hid_t, const char* name, const H5O_info_t* info, void* objects) {
    static_cast<std::vector<Object>*>(objects)->push_back({name, info->type == H5O_TYPE_DATASET});
    return herr_t{0};
  };
  const auto note_attribute = [](hid_t, const char* name, const H5A_info_t*, void* names) {
    static_cast<std::vector<std::string>*>(names)->emplace_back(name);
    return herr_t{0};
  };
  const hdf5::Id id(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, file);
  std::vector<Object> objects;
  H5Ovisit2(id.get(), H5_INDEX_NAME, H5_ITER_INC, note_object, &objects, H5O_INFO_BASIC);
  std::vector<RecordedItem> items;
  for (const Object& object : objects) {
    const hdf5::Id of(H5Oopen(id.get(), object.path.c_str(), H5P_DEFAULT), H5Oclose, object.path);
    std::vector<std::string> attributes;
    H5Aiterate2(of.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, note_attribute, &attributes);
    if (object.is_dataset) items.push_back({object.path, ""});
    for (const std::string& name : attributes) items.push_back({object.path, name});
  }
  return items;
}

}  // namespace cutproof::tests
