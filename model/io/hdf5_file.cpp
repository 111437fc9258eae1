#include "model/io/hdf5_file.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <limits>
#include <memory>
#include <new>
#include <string_view>
#include <utility>

#include "model/io/limits.h"

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

constexpr std::size_t kMostAxes = 8;

// In the order of Scalar. HDF5's types exist only once the library runs.
struct ScalarType {
  const char* name;
  std::size_t bytes;
  hid_t (*in_file)();  // little-endian on every machine
  hid_t (*in_memory)();
};
constexpr std::array<ScalarType, 6> kScalarTypes = {
    {{"float64", 8, [] { return H5T_IEEE_F64LE; }, [] { return H5T_NATIVE_DOUBLE; }},
     {"int32", 4, [] { return H5T_STD_I32LE; }, [] { return H5T_NATIVE_INT32; }},
     {"int64", 8, [] { return H5T_STD_I64LE; }, [] { return H5T_NATIVE_INT64; }},
     {"uint8", 1, [] { return H5T_STD_U8LE; }, [] { return H5T_NATIVE_UINT8; }},
     {"uint64", 8, [] { return H5T_STD_U64LE; }, [] { return H5T_NATIVE_UINT64; }},
     {"float32", 4, [] { return H5T_IEEE_F32LE; }, [] { return H5T_NATIVE_FLOAT; }}}};

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

// More than one call needs for its results and its work on chunks of ours: 1 MiB is a table's cache.
constexpr std::size_t kReserveBytes = std::size_t{8} << 20;

struct Free {
  void operator()(void* block) const { std::free(block); }
};
std::unique_ptr<void, Free> reserve;  // for closing handles after an exception

void* allocated(std::size_t bytes) {
  void* const block = std::malloc(bytes);
  if (block == nullptr) {
    release_memory();
    throw std::bad_alloc();
  }
  return block;
}

// HDF5 1.10 does not survive an allocation that fails within it: it follows null pointers, ends the process or recurses
// without end. So the memory that it may need is tested before each call. `more`: bytes beyond those of any call.
void require_memory(std::size_t more = 0) {
  if (reserve == nullptr) reserve.reset(allocated(kReserveBytes));
  void* volatile block = allocated(kReserveBytes + more);  // volatile: keeps the compiler from removing unused memory
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

// The library's innermost reason of the last failed call. Throws std::bad_alloc if that is a lack of memory.
std::string last_message() {
  Reason reason;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keep_deepest, &reason);
  if (reason.no_memory) throw std::bad_alloc();
  const std::string& text = reason.text;
  // Failures of the system come with addresses and times; the useful part is in the quotation marks.
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

// Links may lead to other files, and round in circles. `name` may have several parts.
void require_hard_links(hid_t parent, const std::string& name) {
  for (std::size_t end = name.find('/', 1);; end = name.find('/', end + 1)) {
    const std::string part = name.substr(0, end);
    H5L_info_t link;
    if (part == "/" || H5Lget_info(parent, part.c_str(), &link, H5P_DEFAULT) < 0) return;  // opening reports the error
    if (link.type != H5L_TYPE_HARD) throw Error(name, "This is a link to something elsewhere.");
    if (end == std::string::npos) return;
  }
}

// Checks that the data of a dataset lie in its file, behind HDF5's own filters alone.
void require_own_storage(const Id& creation, const std::string& name) {
  if (H5Pget_layout(creation.get()) == H5D_VIRTUAL) {
    throw Error(name, "This is a virtual dataset: its numbers lie in other files.");
  }
  if (H5Pget_external_count(creation.get()) > 0) throw Error(name, "Its numbers lie in other files.");
  const int filters = H5Pget_nfilters(creation.get());
  check(std::min(filters, 0), name);
  for (int k = 0; k < filters; ++k) {
    unsigned flags = 0, config = 0;
    std::size_t parameters = 0;
    const H5Z_filter_t filter =
        H5Pget_filter2(creation.get(), static_cast<unsigned>(k), &flags, &parameters, nullptr, 0, nullptr, &config);
    if (filter < 0 || filter > H5Z_FILTER_SCALEOFFSET) {
      throw Error(name, fmt::format("Its data passed filter {}, which is not one of HDF5's own.", filter));
    }
  }
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
  // A file must not make us load code that knows its filters.
  [[maybe_unused]] static const herr_t no_plugins = H5PLset_loading_state(0);
  H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Quiet::~Quiet() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }

void release_memory() { reserve.reset(); }

InflationBudget::InflationBudget(uint64_t file_bytes) : file_bytes_(file_bytes), left_(most_inflated(file_bytes)) {}

void InflationBudget::take(const std::string& where, uint64_t bytes) {
  if (bytes > left_) {
    throw Error(where, fmt::format("With this, files of {} become more than {}.", bytes_text(file_bytes_),
                                   bytes_text(most_inflated(file_bytes_))));
  }
  left_ -= bytes;
}

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

namespace {

// A process that this one starts, as a plugin's, must not hold the file open: HDF5 locks what is written, and the lock
// would last as long as that process.
void close_on_exec(hid_t file, const std::string& where) {
  void* handle = nullptr;
  check(H5Fget_vfd_handle(file, H5P_DEFAULT, &handle), where);
  const int descriptor = *static_cast<int*>(handle);
  if (::fcntl(descriptor, F_SETFD, FD_CLOEXEC) != 0)
    throw Error(where, fmt::format("It cannot be locked against other processes: {}.", std::strerror(errno)));
}

}  // namespace

File File::create(const std::string& path) {
  require_memory();
  const Id access = property_list(H5P_FILE_ACCESS);
  check(H5Pset_libver_bounds(access.get(), H5F_LIBVER_V110, H5F_LIBVER_V110), path);
  const Id creation = property_list(H5P_FILE_CREATE);
  forget_times(creation);
  File file;
  file.id_ = Id(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, creation.get(), access.get()), H5Fclose, path);
  close_on_exec(file.id_.get(), path);
  return file;
}

File File::open(const std::string& path) {
  require_memory();
  File file;
  file.id_ = Id(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, path);
  close_on_exec(file.id_.get(), path);
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
  require_hard_links(parent, name);
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
  require_hard_links(parent, name);
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
  require_own_storage(creation, name);
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
  // A damaged extent must not make us allocate more than the file can hold.
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

namespace {

// Names as an iteration meets them. Exceptions must not cross HDF5, so the error is kept.
struct Met {
  std::size_t most;
  std::vector<std::string> names;
  bool too_many = false, elsewhere = false;

  herr_t see(const char* name) {
    too_many = names.size() >= most;
    if (too_many) return 1;
    names.emplace_back(name);
    return 0;
  }
};

herr_t see_link(hid_t, const char* name, const H5L_info_t* link, void* met) {
  Met& all = *static_cast<Met*>(met);
  if (all.see(name) != 0) return 1;
  all.elsewhere = link->type != H5L_TYPE_HARD;
  return all.elsewhere ? 1 : 0;
}
herr_t see_attribute(hid_t, const char* name, const H5A_info_t*, void* met) {
  return static_cast<Met*>(met)->see(name);
}

}  // namespace

// In the order of the file, and sorted here: HDF5 1.10 sorts by a table, of which it frees unset entries if the group
// is damaged.
std::vector<std::string> names_in(hid_t group, std::size_t most) {
  require_memory();
  Met met{most, {}};
  check(H5Literate(group, H5_INDEX_NAME, H5_ITER_NATIVE, nullptr, see_link, &met), "/");
  if (met.too_many) throw Error("/", fmt::format("It holds more than {} objects.", most));
  if (met.elsewhere) throw Error(met.names.back(), "This is a link to something elsewhere.");
  std::sort(met.names.begin(), met.names.end());
  return met.names;
}

std::vector<std::string> attribute_names(hid_t object, std::size_t most) {
  require_memory();
  Met met{most, {}};
  hsize_t from = 0;
  check(H5Aiterate2(object, H5_INDEX_NAME, H5_ITER_NATIVE, &from, see_attribute, &met), "/");
  if (met.too_many) throw Error("/", fmt::format("It has more than {} attributes.", most));
  std::sort(met.names.begin(), met.names.end());
  return met.names;
}

// The kind of values, from their type and extent.
void Values::look(Id type, const Id& space, uint64_t most_bytes) {
  const H5T_class_t kind = H5Tget_class(type.get());
  std::size_t bytes = H5Tget_size(type.get());
  if (kind == H5T_STRING) {
    kind_ = ValueKind::text;
    if (H5Tis_variable_str(type.get()) > 0) bytes = sizeof(char*);
  } else if (kind == H5T_FLOAT && (bytes == 2 || bytes == 4 || bytes == 8)) {
    kind_ = ValueKind::real;
  } else if (kind == H5T_INTEGER || kind == H5T_ENUM) {  // truth values are enumerations
    const Id number = kind == H5T_ENUM ? Id(H5Tget_super(type.get()), H5Tclose, name_) : Id();
    const hid_t integer = kind == H5T_ENUM ? number.get() : type.get();
    kind_ = H5Tget_sign(integer) == H5T_SGN_NONE ? ValueKind::unsigned_integer : ValueKind::signed_integer;
    bytes = H5Tget_size(integer);
    if (bytes != 1 && bytes != 2 && bytes != 4 && bytes != 8) {
      throw Error(name_, fmt::format("Its integers have {} bytes.", bytes));
    }
  } else {
    throw Error(name_, "This is neither numbers nor text.");
  }
  bytes_each_ = static_cast<int64_t>(bytes);
  const std::vector<hsize_t> dims = dimensions(space, name_);
  if (dims.size() > kMostAxes) throw Error(name_, fmt::format("It has {} axes, more than {}.", dims.size(), kMostAxes));
  uint64_t all = bytes;
  for (const hsize_t extent : dims) {
    if (extent != 0 && all > most_bytes / extent) {
      throw Error(name_, fmt::format("It has more than {} bytes.", most_bytes));
    }
    all *= extent;
    shape_.push_back(static_cast<int64_t>(extent));
  }
  type_ = std::move(type);
}

Values Values::of_attribute(hid_t object, const std::string& name, uint64_t most_bytes, uint64_t file_bytes) {
  require_memory();
  Values values;
  values.name_ = name;
  values.file_bytes_ = file_bytes;
  values.id_ = Id(H5Aopen(object, name.c_str(), H5P_DEFAULT), H5Aclose, name);
  values.look(Id(H5Aget_type(values.id_.get()), H5Tclose, name), Id(H5Aget_space(values.id_.get()), H5Sclose, name),
              most_bytes);
  return values;
}

Values Values::of_dataset(hid_t parent, const std::string& name, uint64_t most_bytes, uint64_t file_bytes) {
  require_memory();
  Values values;
  values.name_ = name;
  values.file_bytes_ = file_bytes;
  values.is_dataset_ = true;
  require_hard_links(parent, name);
  {
    const Id object(H5Oopen(parent, name.c_str(), H5P_DEFAULT), H5Oclose, name);
    if (H5Iget_type(object.get()) != H5I_DATASET) throw Error(name, "This is no dataset.");
  }
  values.id_ = Id(H5Dopen2(parent, name.c_str(), H5P_DEFAULT), H5Dclose, name);
  const hid_t id = values.id_.get();
  values.look(Id(H5Dget_type(id), H5Tclose, name), Id(H5Dget_space(id), H5Sclose, name), most_bytes);
  const Id creation(H5Dget_create_plist(id), H5Pclose, name);
  const H5D_layout_t layout = H5Pget_layout(creation.get());
  require_own_storage(creation, name);
  if (layout == H5D_CHUNKED) {
    std::vector<hsize_t> chunk(values.shape_.size());
    check(H5Pget_chunk(creation.get(), static_cast<int>(chunk.size()), chunk.data()), name);
    uint64_t bytes = static_cast<uint64_t>(values.bytes_each_);
    for (const hsize_t extent : chunk) {
      if (extent != 0 && bytes > std::max<uint64_t>(kMostChunkBytes, values.bytes()) / extent) {
        throw Error(name, "Its chunks are larger than it is.");
      }
      bytes *= extent;
    }
    values.chunk_bytes_ = bytes;
  }
  const uint64_t stored = std::min<uint64_t>(H5Dget_storage_size(id), file_bytes);
  if (values.bytes() / kMostCompression > stored || (values.bytes() > 0 && stored == 0)) {
    throw Error(name, fmt::format("It claims {} bytes, and {} are stored for it.", values.bytes(), stored));
  }
  return values;
}

bool Values::has_text(const std::string& attribute, const std::string& text) const {
  if (!has_attribute(id_.get(), attribute)) return false;
  constexpr uint64_t kMost = 256;
  const Values found = of_attribute(id_.get(), attribute, kMost, file_bytes_);
  return found.kind() == ValueKind::text && found.texts(kMost) == std::vector{text};
}

uint64_t Values::bytes() const {
  auto bytes = static_cast<uint64_t>(bytes_each_);
  for (const int64_t extent : shape_) bytes *= static_cast<uint64_t>(extent);
  return bytes;
}

void Values::transfer(hid_t memory_type, void* values) const {
  require_memory(kCopiesOfChunk * chunk_bytes_);
  check(is_dataset_ ? H5Dread(id_.get(), memory_type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values)
                    : H5Aread(id_.get(), memory_type, values),
        name_);
}

void Values::read(std::byte* values) const {
  if (bytes() == 0) return;
  const bool is_signed = kind_ == ValueKind::signed_integer;
  hid_t type = bytes_each_ == 4 ? H5T_NATIVE_FLOAT : H5T_NATIVE_DOUBLE;
  if (kind_ != ValueKind::real) {
    type = bytes_each_ == 1   ? (is_signed ? H5T_NATIVE_INT8 : H5T_NATIVE_UINT8)
           : bytes_each_ == 2 ? (is_signed ? H5T_NATIVE_INT16 : H5T_NATIVE_UINT16)
           : bytes_each_ == 4 ? (is_signed ? H5T_NATIVE_INT32 : H5T_NATIVE_UINT32)
                              : (is_signed ? H5T_NATIVE_INT64 : H5T_NATIVE_UINT64);
  }
  transfer(type, values);
}

std::vector<std::string> Values::texts(uint64_t most) const {
  std::size_t count = 1;
  for (const int64_t extent : shape_) count *= static_cast<std::size_t>(extent);
  std::vector<std::string> texts;
  if (count == 0) return texts;
  const auto require_few = [&](uint64_t bytes) {
    if (bytes > most) throw Error(name_, fmt::format("This text has {} bytes, more than {}.", bytes, most));
  };
  if (H5Tis_variable_str(type_.get()) > 0) {
    // Each may be as long as the file, and all of them the same bytes of it.
    if (count > most_inflated(file_bytes_) / std::max<uint64_t>(file_bytes_, 1)) {
      throw Error(name_, fmt::format("There are {} texts of variable length.", count));
    }
    require_memory(file_bytes_ * count);
    std::vector<char*> pointers(count, nullptr);
    transfer(type_.get(), pointers.data());
    uint64_t bytes = 0;
    for (const char* const text : pointers) bytes += text == nullptr ? 0 : std::strlen(text);
    if (bytes <= most) {
      for (const char* const text : pointers) texts.emplace_back(text == nullptr ? "" : text);
    }
    const Id space = simple_space({count}, name_);
    H5Dvlen_reclaim(type_.get(), space.get(), H5P_DEFAULT, pointers.data());
    require_few(bytes);
    return texts;
  }
  require_few(bytes());
  const auto each = static_cast<std::size_t>(bytes_each_);
  std::string all(count * each, '\0');
  transfer(type_.get(), all.data());
  for (std::size_t k = 0; k < count; ++k) {
    std::string text = all.substr(k * each, each);
    if (const std::size_t end = text.find('\0'); end != std::string::npos) text.resize(end);
    texts.push_back(std::move(text));
  }
  return texts;
}

void write_dataset(hid_t parent, const std::string& name, const Layout& layout, const void* values) {
  require_memory();
  const Id creation = property_list(H5P_DATASET_CREATE);
  forget_times(creation);
  const Id space = simple_space(layout.shape, name);
  Id dataset(H5Dcreate2(parent, name.c_str(), type_of(layout).in_file(), space.get(), H5P_DEFAULT, creation.get(),
                        H5P_DEFAULT),
             H5Dclose, name);
  if (layout.bytes() > 0) {
    check(H5Dwrite(dataset.get(), type_of(layout).in_memory(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values), name);
  }
  dataset.close(name);
}

void write_table(hid_t parent, const std::string& name, const Layout& row, std::span<const std::byte> rows) {
  Table table = Table::create(parent, name, row, static_cast<int64_t>(rows.size() / row.bytes()));
  table.append(rows);
  table.close();
}

}  // namespace cutproof::io::hdf5
