#include "model/io/hdf5_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <limits>
#include <memory>
#include <new>
#include <string_view>
#include <utility>

#if defined(__has_feature)  // clang
#if __has_feature(address_sanitizer)
#define __SANITIZE_ADDRESS__ 1  // as gcc has it
#endif
#endif
#ifdef __SANITIZE_ADDRESS__
// HDF5 1.10 loses the memory of a damaged object header that it refuses to read. Not ours to mend.
extern "C" const char* __lsan_default_suppressions() { return "leak:libhdf5"; }
#endif

namespace cutproof::io::hdf5 {
namespace {

constexpr hsize_t kChunkBytes = hsize_t{1} << 17;
// Larger chunks than any writer of ours makes are a sign of damage: reading one row needs a whole chunk in memory.
constexpr hsize_t kMostChunkBytes = hsize_t{1} << 26;
// As stored, inflated, unshuffled, and in the table's cache.
constexpr hsize_t kCopiesOfChunk = 4;
// Deflate shrinks by at most 1032.
constexpr uint64_t kMostCompression = 1100;

// In the order of Scalar. HDF5's types exist only once the library runs.
struct ScalarType {
  const char* name;
  std::size_t bytes;
  hid_t (*in_file)();  // little-endian on every machine
  hid_t (*in_memory)();
};
constexpr std::array<ScalarType, 5> kScalarTypes = {
    {{"float64", 8, [] { return H5T_IEEE_F64LE; }, [] { return H5T_NATIVE_DOUBLE; }},
     {"int32", 4, [] { return H5T_STD_I32LE; }, [] { return H5T_NATIVE_INT32; }},
     {"int64", 8, [] { return H5T_STD_I64LE; }, [] { return H5T_NATIVE_INT64; }},
     {"uint8", 1, [] { return H5T_STD_U8LE; }, [] { return H5T_NATIVE_UINT8; }},
     {"uint64", 8, [] { return H5T_STD_U64LE; }, [] { return H5T_NATIVE_UINT64; }}}};

const ScalarType& type_of(const Layout& layout) { return kScalarTypes[static_cast<std::size_t>(layout.scalar)]; }

std::string describe(const Layout& row) {
  std::string text = type_of(row).name;
  for (const hsize_t extent : row.shape) text += fmt::format("[{}]", extent);
  return text;
}

// Dimensions of `rows` rows.
std::vector<hsize_t> extents(hsize_t rows, const Layout& row) {
  std::vector<hsize_t> dims = {rows};
  dims.insert(dims.end(), row.shape.begin(), row.shape.end());
  return dims;
}

// More than one call needs for what it keeps and for its work on chunks of ours: 1 MiB is a table's cache.
constexpr std::size_t kReserveBytes = std::size_t{8} << 20;

struct Free {
  void operator()(void* block) const { std::free(block); }
};
std::unique_ptr<void, Free> reserve;  // for closing what is open when an exception has been thrown

void* allocated(std::size_t bytes) {
  void* const block = std::malloc(bytes);
  if (block == nullptr) {
    release_memory();
    throw std::bad_alloc();
  }
  return block;
}

// HDF5 1.10 does not survive an allocation that fails within it: it follows null pointers, ends the process or recurses
// without end. So what it may need is asked for before it is called. `more`: bytes beyond what any call needs.
void require_memory(std::size_t more = 0) {
  if (reserve == nullptr) reserve.reset(allocated(kReserveBytes));
  void* volatile block = allocated(kReserveBytes + more);  // volatile: or the compiler would see that nobody uses it
  std::free(block);
}

struct Reason {
  std::string text;
  bool no_memory = false;
};

herr_t keep_deepest(unsigned depth, const H5E_error2_t* error, void* reason) {
  auto& kept = *static_cast<Reason*>(reason);
  if (depth == 0 && error->desc != nullptr) kept.text = error->desc;
  kept.no_memory = kept.no_memory || error->min_num == H5E_NOSPACE || error->min_num == H5E_CANTALLOC;
  return 0;
}

// What the library says of the last call that failed: its innermost reason. Throws std::bad_alloc if that is a lack of
// memory.
std::string last_message() {
  Reason reason;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_deepest, &reason);
  if (reason.no_memory) throw std::bad_alloc();
  const std::string& text = reason.text;
  // Failures of the system come with addresses and times; what a person needs is in the quotation marks.
  constexpr std::string_view kSystem = "error message = '";
  if (const std::size_t at = text.find(kSystem); at != std::string::npos) {
    const std::size_t from = at + kSystem.size();
    return text.substr(0, text.find(':')) + ": " + text.substr(from, text.find('\'', from) - from);
  }
  return text.empty() ? "no reason given" : text;
}

void check(herr_t status, const std::string& where) {
  if (status < 0) throw Error(where, fmt::format("HDF5 says: {}.", last_message()));
}

Id property_list(hid_t kind) { return Id(H5Pcreate(kind), H5Pclose, "property list"); }

// Times of creation would make two recordings of one run differ.
void forget_times(const Id& list) { check(H5Pset_obj_track_times(list.get(), false), "property list"); }

Id simple_space(const std::vector<hsize_t>& dims, const std::string& where) {
  if (dims.empty()) return Id(H5Screate(H5S_SCALAR), H5Sclose, where);
  return Id(H5Screate_simple(static_cast<int>(dims.size()), dims.data(), nullptr), H5Sclose, where);
}

std::vector<hsize_t> dimensions(const Id& space, const std::string& where) {
  const int rank = H5Sget_simple_extent_ndims(space.get());
  check(rank, where);
  if (H5Sget_simple_extent_type(space.get()) == H5S_NULL) throw Error(where, "This holds nothing at all.");
  std::vector<hsize_t> dims(static_cast<std::size_t>(rank));
  if (rank > 0) check(H5Sget_simple_extent_dims(space.get(), dims.data(), nullptr), where);
  return dims;
}

bool is_type(const Id& type, const Layout& layout) { return H5Tequal(type.get(), type_of(layout).in_file()) > 0; }

}  // namespace

std::size_t Layout::bytes() const {
  std::size_t bytes = type_of(*this).bytes;
  for (const hsize_t extent : shape) bytes *= extent;
  return bytes;
}

Quiet::Quiet() {
  static const bool room = (require_memory(), true);  // for the library's own beginning
  static_cast<void>(room);
  // Objects that could not be written stay open inside HDF5, and its clean-up at exit then crashes. We close what we
  // open, so there is nothing left for it to do. Counts only before the first call to the library.
  [[maybe_unused]] static const herr_t no_cleanup = H5dont_atexit();
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Quiet::~Quiet() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

void release_memory() { reserve.reset(); }

Id::Id(hid_t id, Close closer, const std::string& where) : id_(id), close_(closer) {
  if (id < 0) throw Error(where, fmt::format("HDF5 says: {}.", last_message()));
}

Id::Id(Id&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}

Id& Id::operator=(Id&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(close_, other.close_);
  return *this;
}

Id::~Id() {
  if (std::uncaught_exceptions() > 0) release_memory();
  if (id_ >= 0) close_(id_);
}

void Id::close(const std::string& where) {
  require_memory();
  if (id_ >= 0) check(close_(std::exchange(id_, H5I_INVALID_HID)), where);
}

File File::create(const std::string& path) {
  require_memory();
  const Id access = property_list(H5P_FILE_ACCESS);
  check(H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110), path);
  const Id creation = property_list(H5P_FILE_CREATE);
  forget_times(creation);
  File file;
  file.id_ = Id(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation.get(), access.get()), H5Fclose, path);
  return file;
}

File File::open(const std::string& path) {
  require_memory();
  File file;
  file.id_ = Id(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, path);
  std::error_code error;
  file.bytes_ = std::filesystem::file_size(path, error);
  if (error) throw Error(path, fmt::format("Its size cannot be found: {}.", error.message()));
  return file;
}

void File::close() {
  if (id_.get() < 0) return;
  require_memory();
  // Flushing first reports a full disk while the file can still be closed in order.
  check(H5Fflush(id_.get(), H5F_SCOPE_LOCAL), "file");
  id_.close("file");
}

Id create_group(hid_t parent, const std::string& name) {
  require_memory();
  const Id creation = property_list(H5P_GROUP_CREATE);
  forget_times(creation);
  return Id(H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, creation.get(), H5P_DEFAULT), H5Gclose, name);
}

Id open_group(hid_t parent, const std::string& name) {
  require_memory();
  return Id(H5Gopen2(parent, name.c_str(), H5P_DEFAULT), H5Gclose, name);
}

Id group_in(hid_t parent, const std::string& name) {
  require_memory();
  return H5Lexists(parent, name.c_str(), H5P_DEFAULT) > 0 ? open_group(parent, name) : create_group(parent, name);
}

bool has_attribute(hid_t object, const std::string& name) {
  require_memory();
  const htri_t found = H5Aexists(object, name.c_str());
  check(found, name);
  return found > 0;
}

void write_attribute(hid_t object, const std::string& name, const Layout& layout, const void* value) {
  require_memory();
  const Id space = simple_space(layout.shape, name);
  const Id attribute(H5Acreate2(object, name.c_str(), type_of(layout).in_file(), space.get(), H5P_DEFAULT, H5P_DEFAULT),
                     H5Aclose, name);
  check(H5Awrite(attribute.get(), type_of(layout).in_memory(), value), name);
}

void read_attribute(hid_t object, const std::string& name, const Layout& layout, void* value) {
  require_memory();
  const Id attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose, name);
  const Id type(H5Aget_type(attribute.get()), H5Tclose, name);
  const Id space(H5Aget_space(attribute.get()), H5Sclose, name);
  if (!is_type(type, layout) || dimensions(space, name) != layout.shape) {
    throw Error(name, fmt::format("This attribute should be {}.", describe(layout)));
  }
  check(H5Aread(attribute.get(), type_of(layout).in_memory(), value), name);
}

void write_text_attribute(hid_t object, const std::string& name, const std::string& text) {
  require_memory();
  const bool ascii = std::all_of(text.begin(), text.end(), [](char c) { return static_cast<signed char>(c) >= 0; });
  const Id type(H5Tcopy(H5T_C_S1), H5Tclose, name);
  // A type of length zero does not exist: empty text is one NUL.
  std::string padded = text.empty() ? std::string(1, '\0') : text;
  check(H5Tset_size(type.get(), padded.size()), name);
  check(H5Tset_strpad(type.get(), H5T_STR_NULLPAD), name);
  check(H5Tset_cset(type.get(), ascii ? H5T_CSET_ASCII : H5T_CSET_UTF8), name);
  const Id space = simple_space({}, name);
  const Id attribute(H5Acreate2(object, name.c_str(), type.get(), space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                     name);
  check(H5Awrite(attribute.get(), type.get(), padded.data()), name);
}

std::string read_text_attribute(hid_t object, const std::string& name) {
  require_memory();
  const Id attribute(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose, name);
  const Id type(H5Aget_type(attribute.get()), H5Tclose, name);
  const Id space(H5Aget_space(attribute.get()), H5Sclose, name);
  if (H5Tget_class(type.get()) != H5T_STRING || H5Tis_variable_str(type.get()) != 0 ||
      !dimensions(space, name).empty() || H5Tget_size(type.get()) > (std::size_t{1} << 16)) {
    throw Error(name, "This attribute should be one text of fixed length.");
  }
  std::string text(H5Tget_size(type.get()), '\0');
  check(H5Aread(attribute.get(), type.get(), text.data()), name);
  text.erase(std::find_if(text.rbegin(), text.rend(), [](char c) { return c != '\0'; }).base(), text.end());
  return text;
}

Table Table::create(hid_t parent, const std::string& name, const Layout& row, int64_t expected_rows) {
  require_memory();
  const hsize_t most = std::max<hsize_t>(1, kChunkBytes / row.bytes());
  const hsize_t rows = expected_rows > 0 ? std::min(most, static_cast<hsize_t>(expected_rows)) : most;
  const Id creation = property_list(H5P_DATASET_CREATE);
  const std::vector<hsize_t> chunk = extents(rows, row);
  check(H5Pset_chunk(creation.get(), static_cast<int>(chunk.size()), chunk.data()), name);
  // Doubles share their leading bytes; side by side these compress, and level 1 takes nearly all there is to take.
  check(H5Pset_shuffle(creation.get()), name);
  check(H5Pset_deflate(creation.get(), 1), name);
  check(H5Pset_fletcher32(creation.get()), name);
  forget_times(creation);

  const std::vector<hsize_t> none = extents(0, row);
  const std::vector<hsize_t> unlimited = extents(H5S_UNLIMITED, row);
  const Id space(H5Screate_simple(static_cast<int>(none.size()), none.data(), unlimited.data()), H5Sclose, name);
  Table table;
  table.id_ = Id(
      H5Dcreate2(parent, name.c_str(), type_of(row).in_file(), space.get(), H5P_DEFAULT, creation.get(), H5P_DEFAULT),
      H5Dclose, name);
  table.row_ = row;
  table.name_ = name;
  return table;
}

Table Table::open(hid_t parent, const std::string& name, const Layout& row, uint64_t file_bytes) {
  require_memory();
  Table table;
  table.id_ = Id(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose, name);
  table.row_ = row;
  table.name_ = name;
  const Id type(H5Dget_type(table.id_.get()), H5Tclose, name);
  const Id space(H5Dget_space(table.id_.get()), H5Sclose, name);
  const std::vector<hsize_t> dims = dimensions(space, name);
  if (!is_type(type, row) || dims.empty() || dims != extents(dims[0], row)) {
    throw Error(name, fmt::format("This dataset should hold rows of {}.", describe(row)));
  }
  const Id creation(H5Dget_create_plist(table.id_.get()), H5Pclose, name);
  if (H5Pget_layout(creation.get()) == H5D_CHUNKED) {
    std::vector<hsize_t> chunk(dims.size());
    check(H5Pget_chunk(creation.get(), static_cast<int>(chunk.size()), chunk.data()), name);
    hsize_t bytes = type_of(row).bytes;
    for (const hsize_t extent : chunk) {
      if (extent > kMostChunkBytes / bytes) throw Error(name, "Its chunks are larger than any recording has.");
      bytes *= extent;
    }
    table.chunk_bytes_ = bytes;
  }
  // A damaged extent must not make us allocate what the file cannot hold.
  const uint64_t stored = std::min<uint64_t>(H5Dget_storage_size(table.id_.get()), file_bytes);
  const uint64_t most = stored > std::numeric_limits<uint64_t>::max() / kMostCompression
                            ? std::numeric_limits<uint64_t>::max()
                            : stored * kMostCompression;
  if (dims[0] > most / row.bytes()) {
    throw Error(name, fmt::format("It claims {} rows, and only {} bytes are stored for it.", dims[0], stored));
  }
  table.rows_ = static_cast<int64_t>(dims[0]);
  return table;
}

template <class Transfer>
void Table::transfer(int64_t first, int64_t count, const Transfer& call) const {
  const std::vector<hsize_t> block = extents(static_cast<hsize_t>(count), row_);
  std::vector<hsize_t> start(block.size(), 0);
  start[0] = static_cast<hsize_t>(first);
  const Id memory = simple_space(block, name_);
  const Id file(H5Dget_space(id_.get()), H5Sclose, name_);
  check(H5Sselect_hyperslab(file.get(), H5S_SELECT_SET, start.data(), nullptr, block.data(), nullptr), name_);
  check(call(id_.get(), type_of(row_).in_memory(), memory.get(), file.get(), H5P_DEFAULT), name_);
}

int64_t Table::append(std::span<const std::byte> rows) {
  const int64_t first = rows_;
  if (rows.empty()) return first;
  require_memory();
  const auto count = static_cast<int64_t>(rows.size() / row_.bytes());
  check(H5Dset_extent(id_.get(), extents(static_cast<hsize_t>(first + count), row_).data()), name_);
  transfer(first, count, [&](auto... arguments) { return H5Dwrite(arguments..., rows.data()); });
  rows_ = first + count;
  return first;
}

void Table::read(int64_t first, int64_t count, void* values) const {
  if (count == 0) return;
  require_memory(kCopiesOfChunk * chunk_bytes_);
  transfer(first, count, [&](auto... arguments) { return H5Dread(arguments..., values); });
}

void write_table(hid_t parent, const std::string& name, const Layout& row, std::span<const std::byte> rows) {
  Table table = Table::create(parent, name, row, static_cast<int64_t>(rows.size() / row.bytes()));
  table.append(rows);
  table.close();
}

}  // namespace cutproof::io::hdf5
