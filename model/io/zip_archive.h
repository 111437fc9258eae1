// ZIP archives, as far as NPZ files are some: entries stored or deflated, with numbers of 64 bits where 32 do not
// suffice (PKWARE, APPNOTE.TXT 6.3). Internal to model/io/.
#pragma once
#include <cstdint>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace cutproof::io {

// The defect of an archive: "its directory is damaged".
struct DamagedArchive : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline constexpr uint16_t kZipStored = 0, kZipDeflated = 8;

struct ZipEntry {
  std::string name;
  uint16_t method = kZipStored;
  bool encrypted = false;
  uint32_t sum = 0;  // CRC-32
  uint64_t stored_bytes = 0, bytes = 0;
  uint64_t at = 0;  // where its own header lies
};

// All of it throws DamagedArchive.
class ZipReader {
 public:
  // The archive of a regular file. Reads the archive's end alone.
  explicit ZipReader(const std::string& path);
  ~ZipReader();
  ZipReader(const ZipReader&) = delete;
  ZipReader& operator=(const ZipReader&) = delete;

  // As the end says; any number.
  uint64_t count() const { return count_; }
  // As the directory says, which takes memory by their number.
  std::vector<ZipEntry> entries();
  // Starts reading this entry of `entries()`.
  void open(const ZipEntry& entry);
  // The next bytes of the entry: as many as requested, or the rest. The rest is given only if the entry is complete and
  // its check sum is right.
  std::size_t read(void* to, std::size_t bytes);

 private:
  struct Inflating;
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string bytes_at(uint64_t at, std::size_t bytes);
  void read_stored(void* to, std::size_t bytes);
  std::size_t inflate_some(char* to, std::size_t bytes);
  void require_whole() const;

  uint64_t file_bytes_;
  std::unique_ptr<std::FILE, Close> file_;
  uint64_t count_ = 0, directory_at_ = 0, directory_bytes_ = 0;
  // Of the entry that is read:
  ZipEntry entry_;
  uint64_t left_ = 0;   // stored bytes that the file still has
  uint64_t given_ = 0;  // by read()
  uint32_t sum_ = 0;    // of these
  std::unique_ptr<Inflating> inflating_;
};

// An archive of names and contents, 60,000 of them at most: stored as they are, and of no time, so that the same
// contents give the same bytes. Throws MachineError if it would have 4 GiB.
std::string zip_archive(const std::vector<std::pair<std::string, std::string>>& entries);

}  // namespace cutproof::io
