#include "model/io/array_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <new>
#include <stdexcept>

#include "model/at.h"
#include "model/io/array_parts.h"
#include "model/io/hdf5_file.h"
#include "model/io/input_file.h"
#include "model/io/recording.h"

namespace cutproof::io {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are copied as they lie in the file");

enum class Format { npz, hdf5, other, empty };

// HDF5 begins at the start of the file, or behind a block of the user's: at 512 bytes, 1,024, 2,048, …
bool has_hdf5_behind(std::ifstream& stream, uint64_t file_bytes, std::string_view signature) {
  std::string found(signature.size(), '\0');
  for (uint64_t start = 512; start + signature.size() <= file_bytes; start *= 2) {
    stream.clear();
    stream.seekg(static_cast<std::streamoff>(start));
    stream.read(found.data(), static_cast<std::streamsize>(found.size()));
    if (stream.gcount() == static_cast<std::streamsize>(found.size()) && found == signature) return true;
  }
  return false;
}

// Throws InputError if there is no regular file, or if it cannot be opened.
Format format_of(const std::string& path) {
  const uint64_t file_bytes = require_regular_file(path);
  constexpr std::array<char, 8> kHdf5 = {'\x89', 'H', 'D', 'F', '\r', '\n', '\x1a', '\n'};
  std::array<char, 8> begin = {};
  std::ifstream stream;
  stream.exceptions(std::ios::badbit);  // a lack of memory is reported as such
  stream.open(path, std::ios::binary);
  if (!stream.is_open()) {
    if (errno == ENOMEM) throw std::bad_alloc();
    throw InputError(path, "", "The file cannot be opened.", "Check its permissions.");
  }
  stream.read(begin.data(), begin.size());
  if (stream.gcount() == 0) return Format::empty;
  if (begin == kHdf5) return Format::hdf5;
  // An archive begins with its first file, or, where it has none, with its end.
  const std::string_view head(begin.data(), 4);
  if (head == "PK\x03\x04" || head == "PK\x05\x06") return Format::npz;
  return has_hdf5_behind(stream, file_bytes, {kHdf5.data(), kHdf5.size()}) ? Format::hdf5 : Format::other;
}

int64_t count_of(const std::vector<int64_t>& shape) {
  int64_t count = 1;
  for (const int64_t extent : shape) count *= extent;
  return count;
}

template <class To, class From>
Array converted(std::string name, const RawNumbers& raw) {
  const auto count = at(count_of(raw.shape));
  std::vector<To> values(count);
  for (std::size_t k = 0; k < count; ++k) {
    From value;
    std::memcpy(&value, raw.bytes.data() + k * sizeof(From), sizeof(From));
    values[k] = static_cast<To>(value);
  }
  return make_array(std::move(name), raw.shape, values);
}

template <class From>
From greatest(const RawNumbers& raw) {
  From most = 0;
  for (std::size_t k = 0; k + sizeof(From) <= raw.bytes.size(); k += sizeof(From)) {
    From value;
    std::memcpy(&value, raw.bytes.data() + k, sizeof(From));
    most = std::max(most, value);
  }
  return most;
}

bool any_negative(const RawNumbers& raw) {
  return std::any_of(raw.bytes.begin(), raw.bytes.end(), [](std::byte b) { return std::to_integer<int>(b) > 127; });
}

void require_writable_contents(const ArrayFile& contents) {
  std::vector<std::string_view> names;
  const auto require = [](bool right, const std::string& what) {
    if (!right) throw std::invalid_argument(what);
  };
  for (const Array& array : contents.arrays) {
    names.push_back(array.name);
    require(array.count() >= 0 && static_cast<int64_t>(array.bytes.size()) == array.count() * size_of(array.type),
            fmt::format("The bytes of the array {} do not fit its shape.", array.name));
  }
  for (const NamedText& text : contents.texts) {
    names.push_back(text.name);
    const bool is_ascii = std::all_of(text.text.begin(), text.text.end(), [](char c) { return c > 0; });
    require(text.text.size() <= kMostTextBytes && is_ascii,
            fmt::format("The text {} is too long, or more than ASCII.", text.name));
  }
  for (const std::string_view name : names) {
    require(!name.empty() && name.size() < 200 && name.find_first_of(std::string_view("/\0", 2)) == name.npos &&
                std::count(names.begin(), names.end(), name) == 1,
            fmt::format("\"{}\" is not a valid name of an array, or is used twice.", name));
  }
}

}  // namespace

const std::string* find_text(const ArrayFile& contents, std::string_view name) {
  for (const NamedText& text : contents.texts) {
    if (text.name == name) return &text.text;
  }
  return nullptr;
}

void refuse_half_precision(const std::string& file, const std::string& name) {
  throw InputError(file, name, "It holds float16. Half precision has three digits, too few to be judged.",
                   "Write float32 or float64, as computed.");
}

Array array_of(std::string name, RawNumbers raw, const std::string& file) {
  const auto as_it_is = [&](ElementType type) { return Array{std::move(name), type, raw.shape, std::move(raw.bytes)}; };
  if (raw.kind == RawKind::real) return as_it_is(raw.bytes_each == 8 ? ElementType::f64 : ElementType::f32);
  const bool is_signed = raw.kind == RawKind::signed_integer;
  if (raw.bytes_each == 1) {
    if (is_signed && any_negative(raw)) return converted<int32_t, int8_t>(std::move(name), raw);
    return as_it_is(ElementType::u8);
  }
  if (raw.bytes_each == 2) {
    return is_signed ? converted<int32_t, int16_t>(std::move(name), raw)
                     : converted<int32_t, uint16_t>(std::move(name), raw);
  }
  if (raw.bytes_each == 4) {
    if (is_signed || greatest<uint32_t>(raw) <= uint32_t{std::numeric_limits<int32_t>::max()}) {
      return as_it_is(ElementType::i32);
    }
    return converted<int64_t, uint32_t>(std::move(name), raw);
  }
  if (!is_signed && greatest<uint64_t>(raw) > uint64_t{std::numeric_limits<int64_t>::max()}) {
    throw InputError(file, name,
                     fmt::format("{} does not fit into a signed number of 64 bits.", greatest<uint64_t>(raw)),
                     "Write numbers below 2^63.");
  }
  return as_it_is(ElementType::i64);
}

void ArrayCollector::require_new(const std::string& name) const {
  const bool is_plain = !name.empty() && name.size() < 256 && name.find('/') == std::string::npos;
  if (!is_plain) {
    throw InputError(file_, name, "This is not a valid name of an array.",
                     "Write all arrays into the root of the file, not into folders.");
  }
  if (find_array(contents_.arrays, name) != nullptr || find_text(contents_, name) != nullptr) {
    throw InputError(file_, name, "This name is used twice.", "Write each array once.");
  }
  if (contents_.arrays.size() + contents_.texts.size() >= kMostArrays) {
    throw InputError(file_, name, fmt::format("There are more than {} arrays.", kMostArrays),
                     "Write only the arrays that are needed.");
  }
}

void ArrayCollector::require_sum(const std::string& name, uint64_t bytes) const {
  if (bytes > kMostArrayBytes) {
    throw InputError(file_, name, fmt::format("With this array there are more than {} bytes.", kMostArrayBytes),
                     "Write fewer frames or a smaller body.");
  }
  if (bytes > most_inflated(file_bytes_)) refuse_inflation(name);
}

void ArrayCollector::refuse_inflation(const std::string& name) const {
  throw InputError(file_, name,
                   fmt::format("With this array a file of {} bytes becomes more than {}.", file_bytes_,
                               bytes_text(most_inflated(file_bytes_))),
                   "Write it without compression.");
}

void ArrayCollector::announce(const std::string& name, uint64_t bytes, uint64_t each) {
  require_new(name);
  require_sum(name, bytes > kMostArrayBytes ? bytes : bytes_ + bytes);
  bytes_ += bytes;
  read_bytes_ += bytes / each * kReadAs;
  if (read_bytes_ > most_inflated(file_bytes_)) refuse_inflation(name);
}

void ArrayCollector::add(const std::string& name, RawNumbers raw) {
  contents_.arrays.push_back(array_of(name, std::move(raw), file_));
}

void ArrayCollector::add(const std::string& name, const std::vector<std::string>& texts, bool is_attribute) {
  std::string joined;
  for (const std::string& text : texts) joined += (joined.empty() ? "" : " ") + text;
  if (joined.size() > kMostTextBytes) {
    throw InputError(file_, name, fmt::format("This text has {} bytes, more than {}.", joined.size(), kMostTextBytes),
                     "Write a short text.");
  }
  contents_.texts.push_back({name, std::move(joined), is_attribute});
}

bool is_array_file(const std::string& path) {
  if (path.ends_with(".npz")) return true;
  std::error_code ignored;
  if (path.ends_with(".cutproof.h5") || std::filesystem::exists(recording_paths(path).index, ignored) ||
      !std::filesystem::is_regular_file(path, ignored)) {
    return false;
  }
  if (format_of(path) != Format::hdf5) return true;
  const hdf5::Quiet quiet;
  try {
    return !hdf5::has_attribute(hdf5::File::open(path).id(), "cutproof_file");
  } catch (const hdf5::Error&) {
    return true;  // the reader reports the error
  }
}

ArrayFile read_array_file(const std::string& path) {
  switch (format_of(path)) {
    case Format::npz:
      return read_npz(path);
    case Format::hdf5:
      return read_hdf5_arrays(path);
    case Format::empty:
      throw InputError(path, "", "The file is empty.", "Write the file again.");
    case Format::other:
      break;
  }
  throw InputError(path, "", "This is neither an NPZ nor an HDF5 file.",
                   "Write it with numpy.savez, or as an HDF5 file of datasets.");
}

void write_array_file(const std::string& path, const ArrayFile& contents) {
  require_writable_contents(contents);
  path.ends_with(".npz") ? write_npz(path, contents) : write_hdf5_arrays(path, contents);
}

}  // namespace cutproof::io
