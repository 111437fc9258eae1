// Arrays in HDF5: a flat group of datasets.
#include <fmt/format.h>

#include <functional>

#include "model/at.h"
#include "model/io/array_parts.h"
#include "model/io/atomic_file.h"
#include "model/io/hdf5_file.h"
#include "model/io/input_file.h"

namespace cutproof::io {
namespace {

constexpr const char* kArraysRemedy =
    "Write plain datasets of numbers and texts into the root of the file, without links, in HDF5's own formats.";

RawKind kind_of(hdf5::ValueKind kind) {
  if (kind == hdf5::ValueKind::real) return RawKind::real;
  return kind == hdf5::ValueKind::signed_integer ? RawKind::signed_integer : RawKind::unsigned_integer;
}

// MATLAB has texts as arrays of 16-bit letters, in one row.
std::string matlab_text(const std::string& name, const RawNumbers& raw) {
  std::string text;
  for (std::size_t k = 0; k + 1 < raw.bytes.size(); k += 2) {
    if (raw.bytes[k + 1] != std::byte{0} || raw.bytes[k] > std::byte{127}) {
      throw hdf5::Error(name, "This text has letters that are not ASCII.");
    }
    text += static_cast<char>(raw.bytes[k]);
  }
  return text;
}

// Other programs leave attributes of their own in the root. Those that are no text, or none that can be read, are
// named.
void collect_attribute(const hdf5::File& file, hid_t root, const std::string& name, ArrayCollector& found) {
  std::vector<std::string> texts;
  uint64_t bytes = 0;
  try {
    const hdf5::Values values = hdf5::Values::of_attribute(root, name, kMostTextBytes, file.bytes());
    if (values.kind() != hdf5::ValueKind::text || values.shape().size() > 1) return found.ignore(name);
    bytes = values.bytes();
    texts = values.texts(kMostTextBytes);
  } catch (const hdf5::Error&) {
    return found.ignore(name);
  }
  found.announce(name, bytes);
  found.add(name, texts, true);
}

// The datasets of one group; `without`: names that are passed over.
void collect(const hdf5::File& file, const std::string& path, const hdf5::Id& group, std::size_t most,
             const std::function<bool(const std::string&)>& without, ArrayCollector& found) {
  for (const std::string& name : hdf5::names_in(group.get(), most)) {
    if (without && without(name)) continue;
    const hdf5::Values values = hdf5::Values::of_dataset(group.get(), name, kMostArrayBytes, file.bytes());
    if (values.kind() == hdf5::ValueKind::real && values.bytes_each() == 2) refuse_half_precision(path, name);
    if (values.kind() == hdf5::ValueKind::text) {
      found.announce(name, values.bytes());
      if (values.shape().size() > 1) throw hdf5::Error(name, "A text is one string, or a list of them.");
      found.add(name, values.texts(kMostTextBytes));
      continue;
    }
    found.announce(name, values.bytes(), static_cast<uint64_t>(values.bytes_each()));
    RawNumbers raw{kind_of(values.kind()), values.bytes_each(), values.shape(), {}};
    raw.bytes.resize(values.bytes());
    values.read(raw.bytes.data());
    if (raw.bytes_each == 2 && values.has_text("MATLAB_class", "char")) {
      found.add(name, {matlab_text(name, raw)});
    } else {
      found.add(name, std::move(raw));
    }
  }
}
void collect_attributes(const hdf5::File& file, const hdf5::Id& root, ArrayCollector& found) {
  for (const std::string& name : hdf5::attribute_names(root.get(), kMostArrays)) {
    collect_attribute(file, root.get(), name, found);
  }
}

// Calls read(file) with HDF5's errors as those of the input, or of a part of it.
template <class Read>
void read_file(const std::string& path, const Read& read, const std::string& part = "") {
  const hdf5::Quiet quiet;
  try {
    read(hdf5::File::open(path));
  } catch (const hdf5::Error& error) {
    throw InputError(path + part, error.where() == path ? "" : error.where(), error.what(), kArraysRemedy);
  }
}

hdf5::Layout layout_of(const Array& array) {
  constexpr hdf5::Scalar kScalars[] = {hdf5::Scalar::i32, hdf5::Scalar::i64, hdf5::Scalar::u8, hdf5::Scalar::f32,
                                       hdf5::Scalar::f64};  // in the order of ElementType, which begins with 1
  hdf5::Layout layout{kScalars[static_cast<std::size_t>(array.type) - 1], {}};
  for (const int64_t extent : array.shape) layout.shape.push_back(static_cast<hsize_t>(extent));
  return layout;
}

}  // namespace

ArrayFile read_hdf5_arrays(const std::string& path) {
  ArrayCollector found(path, require_regular_file(path));
  read_file(path, [&](const hdf5::File& file) {
    const hdf5::Id root = hdf5::open_group(file.id(), "/");
    collect(file, path, root, kMostArrays, {}, found);
    collect_attributes(file, root, found);
  });
  return found.take();
}

std::vector<std::string> hdf5_segments(const std::string& path) {
  std::vector<std::string> names;
  read_file(path, [&](const hdf5::File& file) {
    for (std::string& name : hdf5::names_in(hdf5::open_group(file.id(), "/").get(), kMostSegments)) {
      if (is_segment_name(name)) names.push_back(std::move(name));
    }
  });
  return names;
}

ArrayFile read_hdf5_segment(const std::string& path, const std::string& segment, bool with_root) {
  const std::string part = "/" + segment;
  ArrayCollector found(path + part, require_regular_file(path));
  const auto read = [&](const hdf5::File& file) {
    const hdf5::Id root = hdf5::open_group(file.id(), "/");
    if (with_root) {
      const auto is_other = [](const std::string& name) { return is_segment_name(name) || name.ends_with(".part"); };
      collect(file, path, root, kMostSegments, is_other, found);
      collect_attributes(file, root, found);
    }
    collect(file, path + part, hdf5::open_group(root.get(), segment), kMostArrays, {}, found);
  };
  read_file(path, read, part);
  return found.take();
}

void write_hdf5_arrays(const std::string& path, const ArrayFile& contents) {
  AtomicFile target(path);
  const hdf5::Quiet quiet;
  try {
    hdf5::File file = hdf5::File::create(target.temporary());
    for (const Array& array : contents.arrays) {
      hdf5::write_dataset(file.id(), array.name, layout_of(array), array.bytes.data());
    }
    for (const NamedText& text : contents.texts) hdf5::write_text_attribute(file.id(), text.name, text.text);
    file.close();
  } catch (const hdf5::Error& error) {
    throw MachineError(fmt::format("{}: The file could not be written. {}", path, error.what()));
  }
  target.commit();
}

}  // namespace cutproof::io
