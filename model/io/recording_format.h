// The format that the recorder and the reader of recordings share (docs/reference/recording.md). The place of each
// field of a State follows from model/fields.h.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/fields.h"
#include "model/io/hdf5_file.h"
#include "model/io/recording.h"

namespace cutproof::io {

inline constexpr std::string_view kIndexSuffix = ".cutproof.h5";

// Values of the root attribute cutproof_file of the four files.
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

// A field of a State by the bytes of its entries.
struct RecordedField {
  Field field;
  Storage storage;
  hdf5::Layout entry;
  std::span<const std::byte> (*bytes)(const State& state);
  std::byte* (*make_room)(State& state, int64_t entries);

  std::string name() const { return std::string(field.name); }
  // Of the tables on particles and skin vertices: the points of that VTKHDF file; all others are point data.
  bool is_points() const { return field.quantity == Quantity::point; }
};
// In the order of model/fields.h.
const std::vector<RecordedField>& recorded_fields();

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

// The group /snapshots.
struct SnapshotColumns {
  struct OfField {
    std::vector<std::byte> values;  // value, list: the entries of all snapshots
    std::vector<int64_t> index;     // list: offsets, [snapshots + 1]; rows, cells: the first row, [snapshots]
  };
  std::vector<uint8_t> stage;
  std::array<std::vector<int64_t>, kCountColumns.size()> counts;
  std::vector<OfField> fields = std::vector<OfField>(recorded_fields().size());
};

// Columns is SnapshotColumns or const SnapshotColumns.
template <class Archive, class Columns>
void walk_snapshots(Archive& archive, Columns& columns) {
  archive("stage", columns.stage);
  for (std::size_t c = 0; c < kCountColumns.size(); ++c) archive(kCountColumns[c].name, columns.counts[c]);
  for (std::size_t k = 0; k < columns.fields.size(); ++k) {
    const RecordedField& field = recorded_fields()[k];
    const bool elsewhere = field.storage == Storage::rows || field.storage == Storage::cells;
    if (elsewhere) archive(field.name() + "_row", columns.fields[k].index);
    if (field.storage == Storage::list) archive(field.name() + "_offsets", columns.fields[k].index);
    if (!elsewhere) archive.rows(field.name(), field.entry, columns.fields[k].values);
  }
}

// The root attribute of stages that the reference ran for the backend, as their names with blanks between them; absent
// if there are none.
inline constexpr const char* kLeftToReference = "left_to_reference";
std::string words_of_stages(const std::array<bool, 6>& stages);
// Throws hdf5::Error for a word that is no stage.
std::array<bool, 6> stages_of_words(const std::string& words);
// The root attribute of what the backend promises, as words with blanks between them; absent: everything.
inline constexpr const char* kPromises = "promises";
// The root attribute that says 1 where places were kept as absolute coordinates, so that State::place_rounding is not
// 0.
inline constexpr const char* kAbsoluteCoordinates = "absolute_coordinates";

// F for F and for F.cutproof.h5.
std::string stem_of(const std::string& name);

}  // namespace cutproof::io
