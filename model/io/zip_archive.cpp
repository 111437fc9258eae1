#include "model/io/zip_archive.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <string_view>

#include "model/error.h"
#include "model/io/input_file.h"

namespace cutproof::io {
namespace {

constexpr uint32_t kHeader = 0x04034B50, kInDirectory = 0x02014B50, kEnd = 0x06054B50, kLargeEnd = 0x06064B50,
                   kLocator = 0x07064B50;
constexpr std::size_t kHeaderBytes = 30, kInDirectoryBytes = 46, kEndBytes = 22, kLargeEndBytes = 56,
                      kLocatorBytes = 20, kLongestText = 65535;
// In place of a number that has 64 bits, and stands elsewhere.
constexpr uint64_t kElsewhere = 0xFFFFFFFF, kCountElsewhere = 0xFFFF;
constexpr uint16_t kLargeNumbers = 1;  // their field, among the extra fields of an entry

// A number with its least byte first, as numbers of this machine are (array_file.cpp).
template <class T>
uint64_t number(std::string_view bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.substr(at, sizeof value).data(), sizeof value);
  return value;
}
uint64_t number_16(std::string_view bytes, std::size_t at) { return number<uint16_t>(bytes, at); }
uint64_t number_32(std::string_view bytes, std::size_t at) { return number<uint32_t>(bytes, at); }
uint64_t number_64(std::string_view bytes, std::size_t at) { return number<uint64_t>(bytes, at); }

// Where in the last bytes of a file the archive's end begins: where its comment reaches to the file's end.
std::size_t find_end(std::string_view tail) {
  for (std::size_t at = tail.size() - std::min(tail.size(), kEndBytes) + 1; at-- > 0;) {
    if (tail.size() - at >= kEndBytes && number_32(tail, at) == kEnd &&
        number_16(tail, at + 20) == tail.size() - at - kEndBytes) {
      return at;
    }
  }
  throw DamagedArchive("it is cut off, or has no end");
}

// Puts large numbers of an entry of the directory in their places.
void take_large_numbers(std::string_view extra, ZipEntry& entry) {
  while (extra.size() >= 4) {
    const std::size_t bytes = number_16(extra, 2);
    if (extra.size() - 4 < bytes) break;
    if (number_16(extra, 0) == kLargeNumbers) {
      std::string_view large = extra.substr(4, bytes);
      for (uint64_t* const value : {&entry.bytes, &entry.stored_bytes, &entry.at}) {
        if (*value != kElsewhere) continue;
        if (large.size() < 8) throw DamagedArchive("a size is missing in its directory");
        *value = number_64(large, 0);
        large.remove_prefix(8);
      }
    }
    extra.remove_prefix(4 + bytes);
  }
}

}  // namespace

struct ZipReader::Inflating {
  z_stream stream = {};
  unsigned char block[1 << 16];
  bool ended = false;
  Inflating() {
    const int status = inflateInit2(&stream, -MAX_WBITS);  // without a head of its own
    if (status == Z_MEM_ERROR) throw std::bad_alloc();
    if (status != Z_OK) throw std::logic_error("zlib does not know its own parameters");
  }
  ~Inflating() { inflateEnd(&stream); }
  Inflating(const Inflating&) = delete;
  Inflating& operator=(const Inflating&) = delete;
};

ZipReader::ZipReader(const std::string& path)
    : file_bytes_(require_regular_file(path)), file_(std::fopen(path.c_str(), "rbe")) {
  if (file_ == nullptr) {
    if (errno == ENOMEM) throw std::bad_alloc();
    throw DamagedArchive(std::strerror(errno));
  }
  const auto tail_bytes = std::min<uint64_t>(file_bytes_, kLocatorBytes + kEndBytes + kLongestText);
  const std::string tail = bytes_at(file_bytes_ - tail_bytes, tail_bytes);
  const std::size_t end = find_end(tail);
  count_ = number_16(tail, end + 10);
  directory_bytes_ = number_32(tail, end + 12);
  directory_at_ = number_32(tail, end + 16);
  uint64_t end_at = file_bytes_ - tail_bytes + end;
  const bool is_large = count_ == kCountElsewhere || directory_bytes_ == kElsewhere || directory_at_ == kElsewhere;
  if (is_large && end >= kLocatorBytes && number_32(tail, end - kLocatorBytes) == kLocator) {
    end_at = number_64(tail, end - kLocatorBytes + 8);
    const std::string large = bytes_at(end_at, kLargeEndBytes);
    if (number_32(large, 0) != kLargeEnd) throw DamagedArchive("its end is damaged");
    count_ = number_64(large, 32);
    directory_bytes_ = number_64(large, 40);
    directory_at_ = number_64(large, 48);
  }
  if (directory_at_ > end_at || directory_bytes_ > end_at - directory_at_) {
    throw DamagedArchive("its directory does not lie before its end");
  }
}

ZipReader::~ZipReader() = default;

std::string ZipReader::bytes_at(uint64_t at, std::size_t bytes) {
  if (at > file_bytes_ || bytes > file_bytes_ - at) throw DamagedArchive("it is cut off");
  std::string read(bytes, '\0');
  if (fseeko(file_.get(), static_cast<off_t>(at), SEEK_SET) != 0) throw DamagedArchive(std::strerror(errno));
  read_stored(read.data(), bytes);
  return read;
}

void ZipReader::read_stored(void* to, std::size_t bytes) {
  if (std::fread(to, 1, bytes, file_.get()) == bytes) return;
  throw DamagedArchive(std::ferror(file_.get()) != 0 ? std::strerror(errno) : "it is cut off");
}

std::vector<ZipEntry> ZipReader::entries() {
  const auto damaged = [] { throw DamagedArchive("its directory is damaged"); };
  if (count_ > directory_bytes_ / kInDirectoryBytes) damaged();
  if (directory_bytes_ / (kInDirectoryBytes + 3 * kLongestText) > count_) damaged();
  const std::string directory = bytes_at(directory_at_, directory_bytes_);
  std::string_view rest = directory;
  std::vector<ZipEntry> entries(count_);
  for (ZipEntry& entry : entries) {
    if (rest.size() < kInDirectoryBytes || number_32(rest, 0) != kInDirectory) damaged();
    const std::size_t name = number_16(rest, 28), extra = number_16(rest, 30), comment = number_16(rest, 32);
    if (rest.size() - kInDirectoryBytes < name + extra + comment) damaged();
    entry.encrypted = (number_16(rest, 8) & 1) != 0;
    entry.method = static_cast<uint16_t>(number_16(rest, 10));
    entry.sum = static_cast<uint32_t>(number_32(rest, 16));
    entry.stored_bytes = number_32(rest, 20);
    entry.bytes = number_32(rest, 24);
    entry.at = number_32(rest, 42);
    entry.name = rest.substr(kInDirectoryBytes, name);
    take_large_numbers(rest.substr(kInDirectoryBytes + name, extra), entry);
    rest.remove_prefix(kInDirectoryBytes + name + extra + comment);
  }
  if (!rest.empty()) damaged();
  return entries;
}

void ZipReader::open(const ZipEntry& entry) {
  const std::string header = bytes_at(entry.at, kHeaderBytes);
  const std::size_t name = number_16(header, 26), extra = number_16(header, 28);
  if (number_32(header, 0) != kHeader || bytes_at(entry.at + kHeaderBytes, name) != entry.name) {
    throw DamagedArchive("its header is not that of the directory");
  }
  const uint64_t at = entry.at + kHeaderBytes + name + extra;
  if (at > directory_at_ || entry.stored_bytes > directory_at_ - at) throw DamagedArchive("it is cut off");
  bytes_at(at, 0);  // goes there
  entry_ = entry;
  left_ = entry.stored_bytes;
  given_ = 0;
  sum_ = 0;
  inflating_.reset(entry.method == kZipDeflated ? new Inflating : nullptr);
}

std::size_t ZipReader::read(void* to, std::size_t bytes) {
  std::size_t done = 0;
  while (done < bytes) {
    char* const next = static_cast<char*>(to) + done;
    std::size_t some = 0;
    if (inflating_ != nullptr) {
      some = inflate_some(next, bytes - done);
    } else {
      some = std::min<uint64_t>(bytes - done, left_);
      read_stored(next, some);
      left_ -= some;
    }
    if (some == 0) break;
    sum_ = static_cast<uint32_t>(crc32_z(sum_, reinterpret_cast<const unsigned char*>(next), some));
    done += some;
  }
  given_ += done;
  if (done < bytes) require_whole();
  return done;
}

// 0 at its end.
std::size_t ZipReader::inflate_some(char* to, std::size_t bytes) {
  z_stream& stream = inflating_->stream;
  const auto room = static_cast<uInt>(std::min<std::size_t>(bytes, 1 << 30));
  stream.next_out = reinterpret_cast<unsigned char*>(to);
  stream.avail_out = room;
  while (stream.avail_out == room && !inflating_->ended) {
    if (stream.avail_in == 0 && left_ > 0) {
      const std::size_t block = std::min<uint64_t>(sizeof inflating_->block, left_);
      read_stored(inflating_->block, block);
      left_ -= block;
      stream.next_in = inflating_->block;
      stream.avail_in = static_cast<uInt>(block);
    }
    const int status = inflate(&stream, Z_NO_FLUSH);
    if (status == Z_MEM_ERROR) throw std::bad_alloc();
    if (status == Z_BUF_ERROR) throw DamagedArchive("its compressed data are cut off");
    if (status != Z_OK && status != Z_STREAM_END) {
      throw DamagedArchive(stream.msg != nullptr ? stream.msg : "it cannot be inflated");
    }
    inflating_->ended = status == Z_STREAM_END;
  }
  return room - stream.avail_out;
}

void ZipReader::require_whole() const {
  if (given_ != entry_.bytes) {
    throw DamagedArchive(fmt::format("it has {} bytes, and {} by the directory", given_, entry_.bytes));
  }
  if (left_ > 0 || (inflating_ != nullptr && inflating_->stream.avail_in > 0)) {
    throw DamagedArchive("data follow its end");
  }
  if (sum_ != entry_.sum) throw DamagedArchive("its check sum differs from the directory's");
}

// --- Writing --------------------------------------------------------------------------------------------------------

namespace {

void append(std::string& to, uint64_t value, int bytes) {
  for (; bytes > 0; --bytes, value >>= 8) to += static_cast<char>(value & 0xFF);
}

void append_header(std::string& to, const ZipEntry& entry, bool in_directory) {
  constexpr uint64_t kVersion = 20, kUnix = 3 << 8, kFirstDay = (1 << 5) | 1, kForItsOwner = 0600u << 16;
  append(to, in_directory ? kInDirectory : kHeader, 4);
  if (in_directory) append(to, kUnix | kVersion, 2);
  append(to, kVersion, 2);
  append(to, 0, 2);  // flags
  append(to, entry.method, 2);
  append(to, 0, 2);  // the time
  append(to, kFirstDay, 2);
  append(to, entry.sum, 4);
  append(to, entry.stored_bytes, 4);
  append(to, entry.bytes, 4);
  append(to, entry.name.size(), 2);
  append(to, 0, 2);  // extra fields
  if (in_directory) {
    append(to, 0, 2 + 2 + 2);  // comment, disk, kind of contents
    append(to, kForItsOwner, 4);
    append(to, entry.at, 4);
  }
  to += entry.name;
}

}  // namespace

std::string zip_archive(const std::vector<std::pair<std::string, std::string>>& entries) {
  std::string archive, directory;
  for (const auto& [name, contents] : entries) {
    ZipEntry entry;
    entry.name = name;
    entry.sum =
        static_cast<uint32_t>(crc32_z(0, reinterpret_cast<const unsigned char*>(contents.data()), contents.size()));
    entry.stored_bytes = entry.bytes = contents.size();
    entry.at = archive.size();
    append_header(directory, entry, true);
    if (archive.size() + contents.size() + directory.size() + kHeaderBytes + kLongestText >= kElsewhere) {
      throw MachineError("An archive of 4 GiB or more would have to be written, and such are not read.");
    }
    append_header(archive, entry, false);
    archive += contents;
  }
  const uint64_t directory_at = archive.size();
  archive += directory;
  append(archive, kEnd, 4);
  append(archive, 0, 2 + 2);  // disks
  for (int twice = 0; twice < 2; ++twice) append(archive, entries.size(), 2);
  append(archive, directory.size(), 4);
  append(archive, directory_at, 4);
  append(archive, 0, 2);  // the comment
  return archive;
}

}  // namespace cutproof::io
