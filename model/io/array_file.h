// Files of named arrays, as other programs write them: NPZ (numpy.savez) and HDF5 (a flat group of datasets).
#pragma once
#include <string>
#include <vector>

#include "model/arrays.h"
#include "model/io/limits.h"

namespace cutproof::io {

// Texts of the file. A list of texts is read as one, its entries joined by spaces.
struct NamedText {
  std::string name;
  std::string text;
  bool is_attribute = false;  // of the root of an HDF5 file, where other programs leave texts of their own
  friend bool operator==(const NamedText& a, const NamedText& b) { return a.name == b.name && a.text == b.text; }
};

// In the order of the file; no name is there twice, among arrays and texts together.
struct ArrayFile {
  Arrays arrays;
  std::vector<NamedText> texts;
  std::vector<std::string> ignored = {};  // attributes of the root of an HDF5 file that are no text
  friend bool operator==(const ArrayFile&, const ArrayFile&) = default;
};

// Null if there is none of that name.
const std::string* find_text(const ArrayFile& contents, std::string_view name);

// Whether this path is to be read as a file of arrays, not as a recording. That is so if its name ends in ".npz". It is
// also so if a file of exactly this name exists that is no part of a recording, and no recording of that name.
bool is_array_file(const std::string& path);

// NPZ or HDF5, told apart by how the file begins. Truth values, int8 and uint8 become u8; other integers i32 where
// every value fits, int64 i64 always. Fortran order and big-endian numbers are converted. Throws InputError, naming
// file, array, problem and remedy, for half precision and for anything that is not a file of arrays within the limits
// (model/io/limits.h), before anything large is allocated. Texts of HDF5 are string datasets, attributes of the root
// group, or what MATLAB calls char.
ArrayFile read_array_file(const std::string& path);

// NPZ if the name ends in ".npz", else HDF5. The file is complete or absent, and the same contents give the same bytes.
// Throws InputError if the folder does not exist or is not writable; MachineError if the disk fails;
// std::invalid_argument if a name is empty, too long, twice there or holds a '/' or a NUL, if a text is not ASCII, or
// if an array's bytes do not fit its shape.
void write_array_file(const std::string& path, const ArrayFile& contents);

}  // namespace cutproof::io
