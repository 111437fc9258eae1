// What the recorder and the reader of recordings must agree on (docs/reference/recording.md). Where each field of a
// State lies follows from model/fields.h.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/fields.h"
#include "model/io/hdf5_file.h"

namespace cutproof::io {

inline constexpr int32_t kFormatVersion = 2;
inline constexpr std::string_view kIndexSuffix = ".cutproof.h5";

// What stands in the root attribute cutproof_file of each of the four files.
inline constexpr const char* kIndexKind = "recording index";
inline constexpr const char* kParticlesKind = "recording particles";
inline constexpr const char* kSkinKind = "recording skin";
inline constexpr const char* kBladeKind = "recording blade";

// How a field is recorded. All columns stand in /snapshots and have one row per snapshot.
enum class Storage {
  value,  // the column NAME
  list,   // snapshot i: NAME[NAME_offsets[i] .. NAME_offsets[i + 1])
  rows,   // rows of a table in one of the files, from the one on that the column NAME_row says
  cells   // as rows, but of triangles: three rows of a table of corners each
};

template <class T>
inline constexpr bool is_vector = false;
template <class T>
inline constexpr bool is_vector<std::vector<T>> = true;

// T: the type of the field.
template <class T>
constexpr Storage storage_of(const Field& field) {
  if (!is_vector<T>) return Storage::value;
  if (field.space == IndexSpace::state) return Storage::list;
  return field.space == IndexSpace::triangle ? Storage::cells : Storage::rows;
}

// One entry of a field in a file. T: the type of the field.
template <class T>
struct EntryOf {
  using type = T;
};
template <class T>
struct EntryOf<std::vector<T>> {
  using type = T;
};
template <class T>
hdf5::Layout entry_layout() {
  return hdf5::LayoutOf<typename EntryOf<T>::type>::get();
}

// Lengths that vary from snapshot to snapshot: a column each. They are stored and not derived from the offsets of
// clusters: a recorded state may be broken, and the oracles are to see it as it was.
struct CountColumn {
  const char* name;
  IndexSpace space;
};
inline constexpr std::array<CountColumn, 4> kCountColumns = {{{"cluster_count", IndexSpace::cluster},
                                                              {"member_count", IndexSpace::member},
                                                              {"vertex_count", IndexSpace::vertex},
                                                              {"triangle_count", IndexSpace::triangle}}};

constexpr std::size_t count_fields() {
  std::size_t count = 0;
  for_each_field([&](const Field&, auto) { ++count; });
  return count;
}
inline constexpr std::size_t kFieldCount = count_fields();

// visit(field, get, k) for each field, k counting from 0.
template <class Visit>
void for_each_numbered_field(Visit&& visit) {
  std::size_t k = 0;
  for_each_field([&](const Field& field, auto get) { visit(field, get, k++); });
}

// The type of the field that `get` gives.
template <class Get>
using FieldType = std::remove_cvref_t<decltype(std::declval<Get>()(std::declval<State&>()))>;

// One Of<T> for each field, T being its type. Of must have a name of its own in the whole program: GCC 12 gives a
// template whose argument is a template of an unnamed namespace one definition for all files.
template <template <class> class Of>
class PerField {
 public:
  PerField() {
    for_each_numbered_field(
        [this]<class Get>(const Field&, Get, std::size_t k) { all_[k] = std::make_shared<Of<FieldType<Get>>>(); });
  }
  // visit(field, get, of) for each field.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for_each_numbered_field([&]<class Get>(const Field& field, Get get, std::size_t k) {
      visit(field, get, *static_cast<Of<FieldType<Get>>*>(all_[k].get()));
    });
  }

 private:
  std::array<std::shared_ptr<void>, kFieldCount> all_;
};

// The points of a VTKHDF file; every other field on particles or skin vertices is point data of its name.
constexpr bool is_points(const Field& field) {
  return field.quantity == Quantity::point &&
         (field.space == IndexSpace::particle || field.space == IndexSpace::vertex);
}

// F for F and for F.cutproof.h5.
std::string stem_of(const std::string& name);

}  // namespace cutproof::io
