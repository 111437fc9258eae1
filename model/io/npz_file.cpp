// NPZ: a ZIP archive of .npy files (numpy.lib.format).
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>

#include "model/at.h"
#include "model/io/array_parts.h"
#include "model/io/atomic_file.h"
#include "model/io/input_file.h"
#include "model/io/zip_archive.h"

namespace cutproof::io {
namespace {

constexpr const char* kNpzRemedy = "Write the file again with numpy.savez or numpy.savez_compressed.";
constexpr std::string_view kMagic = "\x93NUMPY";
// Deflate shrinks by at most 1032.
constexpr uint64_t kMostDeflation = 1100;
constexpr std::size_t kMostHeaderBytes = std::size_t{1} << 16;

// --- The header of a .npy file
// -----------------------------------------------------------------------------------------

// A dictionary as Python writes it: {'descr': '<f8', 'fortran_order': False, 'shape': (3, 4), }
class HeaderReader {
 public:
  explicit HeaderReader(std::string_view text) : text_(text) {}
  // Whether the text goes on with this word; if so it is passed.
  bool passes(std::string_view word) {
    skip_space();
    if (!text_.substr(at_).starts_with(word)) return false;
    at_ += word.size();
    return true;
  }
  std::optional<std::string> text() {
    skip_space();
    if (at_ >= text_.size() || (text_[at_] != '\'' && text_[at_] != '"')) return std::nullopt;
    const std::size_t end = text_.find(text_[at_], at_ + 1);
    if (end == std::string_view::npos) return std::nullopt;
    std::string found(text_.substr(at_ + 1, end - at_ - 1));
    at_ = end + 1;
    return found;
  }
  std::optional<int64_t> number() {
    skip_space();
    int64_t value = 0;
    const std::size_t begin = at_;
    for (; at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9'; ++at_) {
      if (value > (std::numeric_limits<int64_t>::max() - 9) / 10) return std::nullopt;
      value = 10 * value + (text_[at_] - '0');
    }
    if (at_ == begin) return std::nullopt;
    passes("L");  // of Python 2
    return value;
  }
  bool at_end() {
    skip_space();
    return at_ == text_.size();
  }

 private:
  void skip_space() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\n')) ++at_;
  }
  std::string_view text_;
  std::size_t at_ = 0;
};

struct NpyHeader {
  std::string type;  // '<f8'
  bool fortran_order = false;
  std::vector<int64_t> shape;
};

std::optional<std::vector<int64_t>> read_shape(HeaderReader& reader) {
  if (!reader.passes("(")) return std::nullopt;
  std::vector<int64_t> shape;
  while (!reader.passes(")")) {
    const auto extent = reader.number();
    if (!extent || shape.size() > kMostArrayAxes) return std::nullopt;
    shape.push_back(*extent);
    if (!reader.passes(",")) {
      if (!reader.passes(")")) return std::nullopt;
      break;
    }
  }
  return shape;
}

// Nothing if this is no such dictionary.
std::optional<NpyHeader> read_header(std::string_view text) {
  HeaderReader reader(text);
  NpyHeader header;
  bool has_type = false, has_order = false, has_shape = false;
  if (!reader.passes("{")) return std::nullopt;
  while (!reader.passes("}")) {
    const auto key = reader.text();
    if (!key || !reader.passes(":")) return std::nullopt;
    if (*key == "descr" && !has_type) {
      has_type = true;
      if (reader.passes("[")) return NpyHeader{"[", false, {}};  // a structure: refused by its type
      const auto type = reader.text();
      if (!type) return std::nullopt;
      header.type = *type;
    } else if (*key == "fortran_order" && !has_order) {
      has_order = true;
      header.fortran_order = reader.passes("True");
      if (!header.fortran_order && !reader.passes("False")) return std::nullopt;
    } else if (*key == "shape" && !has_shape) {
      has_shape = true;
      const auto shape = read_shape(reader);
      if (!shape) return std::nullopt;
      header.shape = *shape;
    } else {
      return std::nullopt;
    }
    if (!reader.passes(",")) {
      if (!reader.passes("}")) return std::nullopt;
      break;
    }
  }
  if (!reader.at_end() || !has_type || !has_order || !has_shape) return std::nullopt;
  return header;
}

// Numbers of `each` bytes that lie column by column, the first index running fastest, row by row.
std::vector<std::byte> row_by_row(const std::vector<std::byte>& columns, const std::vector<int64_t>& shape,
                                  std::size_t each) {
  std::vector<std::byte> rows(columns.size());
  std::vector<int64_t> index(shape.size(), 0);
  for (std::size_t to = 0; to < rows.size(); to += each) {
    std::size_t from = 0;
    for (std::size_t axis = shape.size(); axis-- > 0;) from = from * at(shape[axis]) + at(index[axis]);
    std::memcpy(rows.data() + to, columns.data() + from * each, each);
    for (std::size_t axis = shape.size(); axis-- > 0 && ++index[axis] == shape[axis];) index[axis] = 0;
  }
  return rows;
}

void swap_bytes(std::byte* bytes, std::size_t count, std::size_t each) {
  for (std::size_t k = 0; k < count; k += each) std::reverse(bytes + k, bytes + k + each);
}

// --- Reading
// -------------------------------------------------------------------------------------------------------------

class NpzReader {
 public:
  explicit NpzReader(const std::string& path) : path_(path), found_(path, require_regular_file(path)) {}

  ArrayFile read() {
    try {
      archive_.emplace(path_);
      if (archive_->count() > kMostArrays) {
        refuse("", fmt::format("There are {} arrays, more than {}.", archive_->count(), kMostArrays),
               "Write only the arrays that are needed.");
      }
      entries_ = archive_->entries();
    } catch (const DamagedArchive& error) {
      refuse("", fmt::format("The archive cannot be read: {}.", error.what()), kNpzRemedy);
    }
    // The directory has all sizes: too large an entry is refused before inflating.
    for (const ZipEntry& entry : entries_) require_size_of(entry);
    for (const ZipEntry& entry : entries_) {
      name_ = entry.name;
      try {
        read_entry(entry);
      } catch (const DamagedArchive& error) {
        refuse(name_, fmt::format("It is damaged: {}.", error.what()), kNpzRemedy);
      }
    }
    return found_.take();
  }

 private:
  [[noreturn]] void refuse(const std::string& name, const std::string& problem, const std::string& remedy) const {
    throw InputError(path_, name, problem, remedy);
  }

  void require_size_of(const ZipEntry& entry) {
    const std::string& name = entry.name;
    if (entry.method != kZipStored && entry.method != kZipDeflated) {
      refuse(name, "It is compressed in a way that numpy does not know.", kNpzRemedy);
    }
    if (entry.encrypted) refuse(name, "It is encrypted.", kNpzRemedy);
    if (entry.bytes / kMostDeflation > entry.stored_bytes + 1) {
      refuse(name, fmt::format("It claims {} bytes, and {} are stored for it.", entry.bytes, entry.stored_bytes),
             kNpzRemedy);
    }
    // Headers are small, so that these may be counted as arrays.
    found_.require_sum(name, entry.bytes > kMostArrayBytes ? entry.bytes : bytes_ += entry.bytes);
  }

  void read_entry(const ZipEntry& entry) {
    if (!name_.ends_with(".npy")) {
      refuse(name_, "This is no array: its name does not end in \".npy\".", kNpzRemedy);
    }
    name_.resize(name_.size() - 4);
    archive_->open(entry);
    uint64_t left = entry.bytes;
    const NpyHeader header = read_npy_header(left);
    read_values(header, left);
    // Reading to the end checks the sum.
    char more;
    if (archive_->read(&more, 1) != 0) refuse(name_, "It goes on after its end.", kNpzRemedy);
  }

  // Exactly so many bytes, of which `left` are left.
  void take(void* to, uint64_t bytes, uint64_t& left) {
    if (bytes > left || archive_->read(to, bytes) < bytes) refuse(name_, "It is cut off.", kNpzRemedy);
    left -= bytes;
  }

  NpyHeader read_npy_header(uint64_t& left) {
    unsigned char begin[8];
    take(begin, sizeof begin, left);
    if (std::memcmp(begin, kMagic.data(), kMagic.size()) != 0)
      refuse(name_, "This is no array of numpy's.", kNpzRemedy);
    if (begin[6] != 1 && begin[6] != 2) {
      refuse(name_, fmt::format("It has version {}.{} of numpy's format, and 1 and 2 are read.", begin[6], begin[7]),
             "Write plain arrays of numbers or texts, not structures.");
    }
    unsigned char length[4] = {};
    take(length, begin[6] == 1 ? 2 : 4, left);
    const std::size_t bytes =
        length[0] | std::size_t{length[1]} << 8 | std::size_t{length[2]} << 16 | std::size_t{length[3]} << 24;
    if (bytes > kMostHeaderBytes) refuse(name_, fmt::format("Its header has {} bytes.", bytes), kNpzRemedy);
    std::string text(bytes, '\0');
    take(text.data(), text.size(), left);
    const auto header = read_header(text);
    if (!header) refuse(name_, "Its header is damaged.", kNpzRemedy);
    return *header;
  }

  void read_values(const NpyHeader& header, uint64_t& left) {
    const std::string& type = header.type;
    const char order = type.empty() ? '?' : type[0], kind = type.size() < 2 ? '?' : type[1];
    if (type == "[") refuse(name_, "This is an array of structures.", "Write an array of numbers for each field.");
    if (kind == 'O') refuse(name_, "This is an array of Python objects.", "Write an array of numbers or of texts.");
    int64_t each = 0;
    for (std::size_t k = 2; k < type.size(); ++k) {
      if (type[k] < '0' || type[k] > '9' || each > 1'000'000) each = -1;
      if (each < 0) break;
      each = 10 * each + (type[k] - '0');
    }
    const bool is_text = kind == 'U' || kind == 'S';
    const bool is_integer = kind == 'i' || kind == 'u';
    const bool is_known = is_text       ? each >= 0 && each <= 1'000'000
                          : is_integer  ? each == 1 || each == 2 || each == 4 || each == 8
                          : kind == 'f' ? each == 2 || each == 4 || each == 8
                                        : kind == 'b' && each == 1;
    if (!is_known || (order != '<' && order != '|' && order != '>' && order != '=')) {
      refuse(name_, fmt::format("Its type is \"{}\".", type),
             "Write truth values, integers, floating-point numbers of 32 or 64 bits, or texts.");
    }
    if (header.shape.size() > kMostArrayAxes) {
      refuse(name_, fmt::format("It has {} axes, more than {}.", header.shape.size(), kMostArrayAxes), kNpzRemedy);
    }
    const auto bytes_each = static_cast<uint64_t>(kind == 'U' ? 4 * each : each);
    uint64_t bytes = bytes_each;
    for (const int64_t extent : header.shape) {
      if (extent != 0 && bytes > kMostArrayBytes / static_cast<uint64_t>(extent)) bytes = kMostArrayBytes + 1;
      if (bytes <= kMostArrayBytes) bytes *= static_cast<uint64_t>(extent);
    }
    // An empty text has no bytes, and there could be any number of them.
    const auto has_no_end = [&](int64_t extent) { return extent > static_cast<int64_t>(kMostArrayBytes); };
    if (bytes != left || std::any_of(header.shape.begin(), header.shape.end(), has_no_end)) {
      refuse(name_, fmt::format("It has {} bytes, which do not fit its shape.", left), kNpzRemedy);
    }
    is_text ? found_.announce(name_, bytes) : found_.announce(name_, bytes, bytes_each);
    if (kind == 'f' && each == 2) refuse_half_precision(path_, name_);
    const bool big_endian = order == '>' && kind != 'S';
    if (is_text) return read_texts(header, kind, big_endian, bytes, left);
    RawNumbers raw{kind == 'f'   ? RawKind::real
                   : kind == 'i' ? RawKind::signed_integer
                                 : RawKind::unsigned_integer,
                   each,
                   header.shape,
                   {}};
    raw.bytes.resize(bytes);
    take(raw.bytes.data(), bytes, left);
    if (big_endian) swap_bytes(raw.bytes.data(), raw.bytes.size(), at(each));
    if (header.fortran_order && header.shape.size() > 1) raw.bytes = row_by_row(raw.bytes, header.shape, at(each));
    found_.add(name_, std::move(raw));
  }

  void read_texts(const NpyHeader& header, char kind, bool big_endian, uint64_t bytes, uint64_t& left) {
    if (header.shape.size() > 1) refuse(name_, "A text is one string, or a list of them.", "Write it as one string.");
    const uint64_t count = header.shape.empty() ? 1 : static_cast<uint64_t>(header.shape[0]);
    if (bytes > 8 * kMostTextBytes || count > kMostTextBytes) {
      refuse(name_, fmt::format("This text has {} bytes.", bytes), "Write a short text.");
    }
    std::string all(bytes, '\0');
    take(all.data(), bytes, left);
    if (big_endian) swap_bytes(reinterpret_cast<std::byte*>(all.data()), all.size(), 4);
    std::vector<std::string> texts(count);
    const std::size_t each = count == 0 ? 0 : bytes / count, step = kind == 'U' ? 4 : 1;
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t c = k * each; c < (k + 1) * each; c += step) {
        uint32_t letter = static_cast<unsigned char>(all[c]);
        if (kind == 'U') std::memcpy(&letter, all.data() + c, 4);
        if (letter > 127) refuse(name_, "This text has letters that are not ASCII.", "Write plain words.");
        if (letter != 0) texts[k] += static_cast<char>(letter);
      }
    }
    found_.add(name_, texts);
  }

  std::string path_;
  ArrayCollector found_;
  std::optional<ZipReader> archive_;
  std::vector<ZipEntry> entries_;
  std::string name_;    // of the array that is read
  uint64_t bytes_ = 0;  // as the directory says, of all so far
};

// --- Writing
// -------------------------------------------------------------------------------------------------------------

std::string npy_of(std::string_view type, const std::vector<int64_t>& shape, std::string_view bytes) {
  std::string extents;
  for (const int64_t extent : shape) extents += fmt::format("{}, ", extent);
  if (shape.size() > 1) extents.resize(extents.size() - 2);
  if (shape.size() == 1) extents.pop_back();
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, extents);
  // Numbers begin at a multiple of 64 bytes.
  constexpr std::size_t kBefore = 10;
  header.append(63 - (kBefore + header.size()) % 64, ' ');
  header += '\n';
  std::string npy(kMagic);
  npy += {'\x01', '\x00', static_cast<char>(header.size() & 0xff), static_cast<char>(header.size() >> 8)};
  return npy + header + std::string(bytes);
}

std::string npy_of(const Array& array) {
  constexpr std::string_view kTypes[] = {"<i4", "<i8", "|u1", "<f4", "<f8"};  // as ElementType, which begins with 1
  return npy_of(kTypes[static_cast<std::size_t>(array.type) - 1], array.shape,
                {reinterpret_cast<const char*>(array.bytes.data()), array.bytes.size()});
}

// As numpy has strings: four bytes a letter.
std::string npy_of(const NamedText& text) {
  const std::size_t length = std::max<std::size_t>(1, text.text.size());
  std::string letters(4 * length, '\0');
  for (std::size_t k = 0; k < text.text.size(); ++k) letters[4 * k] = text.text[k];
  return npy_of(fmt::format("<U{}", length), {}, letters);
}

}  // namespace

ArrayFile read_npz(const std::string& path) { return NpzReader(path).read(); }

void write_npz(const std::string& path, const ArrayFile& contents) {
  std::vector<std::pair<std::string, std::string>> entries;
  for (const Array& array : contents.arrays) entries.emplace_back(array.name + ".npy", npy_of(array));
  for (const NamedText& text : contents.texts) entries.emplace_back(text.name + ".npy", npy_of(text));
  write_text(path, zip_archive(entries));
}

}  // namespace cutproof::io
