// NPZ: a ZIP archive of .npy files (numpy.lib.format). Only the archive is libzip's.
#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <string_view>

#include "model/at.h"
#include "model/io/array_parts.h"
#include "model/io/atomic_file.h"
#include "model/io/input_file.h"

namespace cutproof::io {
namespace {

constexpr const char* kNpzRemedy = "Write the file once more with numpy.savez or numpy.savez_compressed.";
constexpr std::string_view kMagic = "\x93NUMPY";
// Deflate shrinks by at most 1032.
constexpr uint64_t kMostDeflation = 1100;
constexpr std::size_t kZipNeeds = std::size_t{1} << 20;  // to open an archive of few files; more than it takes
constexpr std::size_t kMostHeaderBytes = std::size_t{1} << 16;

struct Discard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
  void operator()(zip_source_t* source) const { zip_source_free(source); }
};
using Archive = std::unique_ptr<zip_t, Discard>;
using Entry = std::unique_ptr<zip_file_t, Discard>;

// What libzip says, as bad input; a lack of memory as what it is.
std::string zip_reason(zip_error_t* error) {
  if (zip_error_code_zip(error) == ZIP_ER_MEMORY) throw std::bad_alloc();
  return zip_error_strerror(error);
}

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

// How many files an archive says at its end that it has; nothing if it has no such end, of which libzip says more.
// libzip takes seconds for a directory of hundreds of thousands before it says how many they are.
std::optional<uint64_t> count_of_archive(const std::string& path, uint64_t file_bytes) {
  constexpr uint64_t kEnd = 22, kLongestComment = 65535, kLocator = 20;
  const uint64_t bytes = std::min(file_bytes, kEnd + kLongestComment + kLocator);
  std::string tail(bytes, '\0');
  std::ifstream file(path, std::ios::binary);
  const auto read_at = [&](uint64_t at, char* to, uint64_t size) {
    file.seekg(static_cast<std::streamoff>(at));
    file.read(to, static_cast<std::streamsize>(size));
    return file.good();
  };
  if (bytes < kEnd || !read_at(file_bytes - bytes, tail.data(), bytes)) return std::nullopt;
  const std::size_t end = tail.rfind("PK\x05\x06", bytes - kEnd);
  if (end == std::string::npos) return std::nullopt;
  uint16_t count = 0;
  std::memcpy(&count, tail.data() + end + 10, sizeof count);
  if (count != 0xFFFF) return count;
  // More than that, or a large archive: a further end says it, and a locator before this end where that lies.
  if (end < kLocator || tail.compare(end - kLocator, 4, "PK\x06\x07") != 0) return count;
  uint64_t at = 0, large_count = 0;
  std::memcpy(&at, tail.data() + end - kLocator + 8, sizeof at);
  if (at > file_bytes || !read_at(at + 32, reinterpret_cast<char*>(&large_count), sizeof large_count)) return count;
  return large_count;
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
    require_few(count_of_archive(path_, require_regular_file(path_)).value_or(0));
    // libzip 1.7 says of some allocations that fail that this is no archive. So what it needs is asked for before, and
    // what it says is believed when it says it twice.
    int code = 0;
    for (int attempt = 0; attempt < 2 && archive_ == nullptr; ++attempt) {
      void* volatile block = std::malloc(kZipNeeds);  // volatile: or the compiler would see that nobody uses it
      if (block == nullptr) throw std::bad_alloc();
      std::free(block);
      archive_.reset(zip_open(path_.c_str(), ZIP_RDONLY | ZIP_CHECKCONS, &code));
    }
    if (archive_ == nullptr) {
      zip_error_t error;
      zip_error_init_with_code(&error, code);
      const std::string why = zip_reason(&error);
      zip_error_fini(&error);
      refuse("", fmt::format("The archive cannot be read: {}.", why), kNpzRemedy);
    }
    const zip_int64_t count = zip_get_num_entries(archive_.get(), 0);
    require_few(static_cast<uint64_t>(count));
    // The directory says how large everything is: what is too large is refused before any of it is inflated.
    for (zip_int64_t k = 0; k < count; ++k) require_size_of_entry(static_cast<zip_uint64_t>(k));
    for (zip_int64_t k = 0; k < count; ++k) read_entry(static_cast<zip_uint64_t>(k));
    return found_.take();
  }

 private:
  [[noreturn]] void refuse(const std::string& name, const std::string& problem, const std::string& remedy) const {
    throw InputError(path_, name, problem, remedy);
  }

  void require_few(uint64_t count) const {
    if (count <= kMostArrays) return;
    refuse("", fmt::format("There are {} arrays, more than {}.", count, kMostArrays),
           "Write only those that are to be read.");
  }

  zip_stat_t stat(zip_uint64_t index) {
    zip_stat_t stat;
    zip_stat_init(&stat);
    constexpr zip_uint64_t kNeeded = ZIP_STAT_NAME | ZIP_STAT_SIZE | ZIP_STAT_COMP_SIZE | ZIP_STAT_COMP_METHOD;
    if (zip_stat_index(archive_.get(), index, 0, &stat) != 0 || (stat.valid & kNeeded) != kNeeded) {
      refuse("", "The archive's directory is damaged.", kNpzRemedy);
    }
    return stat;
  }

  void require_size_of_entry(zip_uint64_t index) {
    const zip_stat_t entry = stat(index);
    const std::string name = entry.name;
    if (entry.comp_method != ZIP_CM_STORE && entry.comp_method != ZIP_CM_DEFLATE) {
      refuse(name, "It is compressed in a way that numpy does not know.", kNpzRemedy);
    }
    if ((entry.valid & ZIP_STAT_ENCRYPTION_METHOD) != 0 && entry.encryption_method != ZIP_EM_NONE) {
      refuse(name, "It is encrypted.", kNpzRemedy);
    }
    if (entry.size / kMostDeflation > entry.comp_size + 1) {
      refuse(name, fmt::format("It claims {} bytes, and {} are stored for it.", entry.size, entry.comp_size),
             kNpzRemedy);
    }
    // Headers are small, so that these may be counted as arrays.
    found_.require_sum(name, entry.size > kMostArrayBytes ? entry.size : bytes_ += entry.size);
  }

  void read_entry(zip_uint64_t index) {
    const zip_stat_t entry = stat(index);
    name_ = entry.name;
    if (!name_.ends_with(".npy")) {
      refuse(name_, "This is no array: its name does not end in \".npy\".", kNpzRemedy);
    }
    name_.resize(name_.size() - 4);
    file_.reset(zip_fopen_index(archive_.get(), index, 0));
    if (file_ == nullptr) {
      refuse(name_, fmt::format("It cannot be read: {}.", zip_reason(zip_get_error(archive_.get()))), kNpzRemedy);
    }
    uint64_t left = entry.size;
    const NpyHeader header = read_npy_header(left);
    read_values(header, left);
    // Reading on to the end is what checks the sum.
    char more;
    if (const zip_int64_t n = zip_fread(file_.get(), &more, 1); n != 0) {
      refuse(name_, n > 0 ? "It goes on after its end." : fmt::format("It is damaged: {}.", why_not_read()),
             kNpzRemedy);
    }
  }

  std::string why_not_read() { return zip_reason(zip_file_get_error(file_.get())); }

  // Exactly so many bytes, of which `left` are left.
  void take(void* to, uint64_t bytes, uint64_t& left) {
    if (bytes > left) refuse(name_, "It is cut off.", kNpzRemedy);
    left -= bytes;
    for (uint64_t done = 0; done < bytes;) {
      const zip_int64_t n = zip_fread(file_.get(), static_cast<char*>(to) + done, bytes - done);
      if (n < 0) refuse(name_, fmt::format("It is damaged: {}.", why_not_read()), kNpzRemedy);
      if (n == 0) refuse(name_, "It is cut off.", kNpzRemedy);
      done += static_cast<uint64_t>(n);
    }
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
  Archive archive_;
  Entry file_;          // closed before the archive
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

// Throws what a failing call of libzip means, which writes into memory here.
void require_zip(bool success, zip_error_t* error, const std::string& path) {
  if (!success) throw MachineError(fmt::format("{}: The archive could not be made: {}.", path, zip_reason(error)));
}

}  // namespace

ArrayFile read_npz(const std::string& path) { return NpzReader(path).read(); }

void write_npz(const std::string& path, const ArrayFile& contents) {
  std::vector<std::pair<std::string, std::string>> entries;  // names and bytes, which libzip reads when it closes
  for (const Array& array : contents.arrays) entries.emplace_back(array.name + ".npy", npy_of(array));
  for (const NamedText& text : contents.texts) entries.emplace_back(text.name + ".npy", npy_of(text));

  zip_error_t error;
  zip_error_init(&error);
  const std::unique_ptr<zip_source_t, Discard> bytes(zip_source_buffer_create(nullptr, 0, 0, &error));
  require_zip(bytes != nullptr, &error, path);
  zip_source_keep(bytes.get());
  Archive archive(zip_open_from_source(bytes.get(), ZIP_TRUNCATE, &error));
  if (archive == nullptr) zip_source_free(bytes.get());
  require_zip(archive != nullptr, &error, path);
  zip_error_t* const why = zip_get_error(archive.get());
  for (const auto& [name, npy] : entries) {
    zip_source_t* const source = zip_source_buffer(archive.get(), npy.data(), npy.size(), 0);
    require_zip(source != nullptr, why, path);
    const zip_int64_t index = zip_file_add(archive.get(), name.c_str(), source, ZIP_FL_ENC_UTF_8);
    if (index < 0) zip_source_free(source);
    require_zip(index >= 0, why, path);
    const auto entry = static_cast<zip_uint64_t>(index);
    // Stored as they are, and of no time: the same arrays give the same bytes.
    require_zip(zip_set_file_compression(archive.get(), entry, ZIP_CM_STORE, 0) == 0, why, path);
    require_zip(zip_file_set_dostime(archive.get(), entry, 0, (1 << 5) | 1, 0) == 0, why, path);
    require_zip(zip_file_set_external_attributes(archive.get(), entry, 0, ZIP_OPSYS_UNIX, 0600u << 16) == 0, why, path);
  }
  require_zip(zip_close(archive.get()) == 0, why, path);
  static_cast<void>(archive.release());  // closed

  zip_stat_t stat;
  zip_stat_init(&stat);
  require_zip(zip_source_stat(bytes.get(), &stat) == 0 && zip_source_open(bytes.get()) == 0,
              zip_source_error(bytes.get()), path);
  std::string all(stat.size, '\0');
  const zip_int64_t read = zip_source_read(bytes.get(), all.data(), all.size());
  zip_source_close(bytes.get());
  require_zip(read == static_cast<zip_int64_t>(all.size()), zip_source_error(bytes.get()), path);
  write_text(path, all);
}

}  // namespace cutproof::io
