#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <new>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "model/error.h"
#include "model/io/hdf5_file.h"
#include "model/io/recording.h"
#include "model/io/recording_archive.h"
#include "model/io/recording_format.h"
#include "model/io/recording_setup.h"
#include "model/io/setup_check.h"

namespace cutproof::io {
namespace {

constexpr const char* kRemedy =
    "Copy all files of the recording once more from where they were made, or record the scene again.";

// A file of a recording, opened and recognised.
hdf5::File open_part(const std::string& path, const char* kind) {
  std::error_code no_status;
  const auto status = std::filesystem::status(path, no_status);
  if (!std::filesystem::exists(status)) {
    const bool companion = std::string_view(kind) != kIndexKind;
    throw InputError(path, "", "There is no such file.",
                     companion ? "Keep the files of a recording (index, particles, skin) in one folder."
                               : "Give the name of a recording, with or without \".cutproof.h5\".");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(path, "", "This is not a file.", "Give the name of a recording.");
  }
  constexpr std::array<char, 8> kSignature = {'\x89', 'H', 'D', 'F', '\r', '\n', '\x1a', '\n'};
  std::array<char, 8> begin = {};
  std::ifstream stream;
  stream.exceptions(std::ios::badbit);  // a lack of memory shows as what it is
  stream.open(path, std::ios::binary);
  if (!stream.is_open()) {
    if (errno == ENOMEM) throw std::bad_alloc();
    throw InputError(path, "", "The file cannot be opened.", "Check its permissions.");
  }
  stream.read(begin.data(), begin.size());
  if (begin != kSignature) {
    const std::string what = stream.gcount() == 0 ? "The file is empty." : "This is not an HDF5 file.";
    throw InputError(path, "", what, "Give a recording made by cutproof. If it is one: " + std::string(kRemedy));
  }
  try {
    hdf5::File file = hdf5::File::open(path);
    if (!hdf5::has_attribute(file.id(), "cutproof_file") || !hdf5::has_attribute(file.id(), "cutproof_format")) {
      throw InputError(path, "cutproof_file", "This is an HDF5 file, but no recording.",
                       "Give a recording made by cutproof.");
    }
    const std::string found = hdf5::read_text_attribute(file.id(), "cutproof_file");
    if (found != kind) {
      throw InputError(path, "cutproof_file", fmt::format("This is \"{}\", and should be \"{}\".", found, kind),
                       "Give the name of the index, which ends in \".cutproof.h5\".");
    }
    const auto version = hdf5::read_attribute<int32_t>(file.id(), "cutproof_format");
    if (version > kFormatVersion) {
      throw InputError(
          path, "cutproof_format",
          fmt::format("The recording has format {}, and this program reads up to {}.", version, kFormatVersion),
          "Use a newer cutproof.");
    }
    if (version < kFormatVersion) {
      throw InputError(path, "cutproof_format",
                       fmt::format("The recording has format {}, and this program reads {}.", version, kFormatVersion),
                       "Record the scene again.");
    }
    return file;
  } catch (const hdf5::Error& error) {
    throw InputError(path, "", fmt::format("The file is cut off or damaged. {}", error.what()), kRemedy);
  }
}

// Whether `count` rows from `first` are rows of a table.
bool fits(int64_t first, int64_t count, int64_t rows) {
  return first >= 0 && count >= 0 && count <= rows && first <= rows - count;
}

void require_blocks(const std::string& field, const std::vector<int64_t>& first, const std::vector<int64_t>& counts,
                    int64_t rows) {
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (!fits(first[i], counts[i], rows)) {
      throw hdf5::Error(field, fmt::format("Entry {} is {}: {} rows from there are not among the {} that are stored.",
                                           i, first[i], counts[i], rows));
    }
  }
}

template <class T>
void require_length(const std::string& field, const std::vector<T>& values, std::size_t length) {
  if (values.size() != length) {
    throw hdf5::Error(field, fmt::format("This has {} entries, and should have {}.", values.size(), length));
  }
}

void require_offsets(const std::string& field, const std::vector<int64_t>& offsets, std::size_t count,
                     std::size_t values) {
  require_length(field, offsets, count + 1);
  if (offsets.front() != 0 || !std::is_sorted(offsets.begin(), offsets.end()) ||
      offsets.back() != static_cast<int64_t>(values)) {
    throw hdf5::Error(field, fmt::format("These offsets should rise from 0 to {} without ever falling.", values));
  }
}

// Triangles `first` to `first + count` of a table of corners; of snapshot i, for the error.
std::vector<std::array<int32_t, 3>> triangles_in(const hdf5::RawTable& table, int64_t first, int64_t count,
                                                 std::size_t i) {
  std::vector<int64_t> corners(static_cast<std::size_t>(3 * count));
  table.read(3 * first, 3 * count, corners.data());
  std::vector<std::array<int32_t, 3>> triangles(static_cast<std::size_t>(count));
  for (std::size_t k = 0; k < corners.size(); ++k) {
    if (corners[k] != static_cast<int32_t>(corners[k])) {
      throw hdf5::Error("/VTKHDF/Polygons/Connectivity",
                        fmt::format("Snapshot {} has a corner {}, which no 32-bit number holds.", i, corners[k]));
    }
    triangles[k / 3][k % 3] = static_cast<int32_t>(corners[k]);
  }
  return triangles;
}

// What the reader keeps of a field of type T.
template <class T>
struct ReadField {
  std::vector<std::conditional_t<std::is_same_v<T, bool>, uint8_t, T>> values;  // of each snapshot
};
template <class E>
struct ReadField<std::vector<E>> {
  // A list.
  std::vector<int64_t> offsets;  // [snapshots + 1]
  std::vector<E> values;
  // Rows, cells.
  hdf5::RawTable table;
  std::vector<int64_t> first;  // row of each snapshot
};

}  // namespace

struct RecordingReader::File {
  explicit File(const std::string& name);
  Snapshot snapshot(std::size_t i) const;

  RecordingPaths paths;
  Recording header;

 private:
  void read_columns(const ReadingArchive& archive);
  void open_tables(const ReadingArchive& archive, IndexSpace points);
  void check_ranges() const;
  int64_t count_in(IndexSpace space, std::size_t i) const;

  hdf5::File index, particles, skin;
  std::vector<uint8_t> stage;
  std::array<std::vector<int64_t>, kCountColumns.size()> counts;
  PerField<ReadField> fields;

  template <class F>
  void reading(const std::string& path, F&& action) const {
    try {
      action();
    } catch (const hdf5::Error& error) {
      throw InputError(path, error.where(), error.what(), kRemedy);
    }
  }
};

RecordingReader::File::File(const std::string& name) : paths(recording_paths(name)) {
  index = open_part(paths.index, kIndexKind);
  particles = open_part(paths.particles, kParticlesKind);
  skin = open_part(paths.skin, kSkinKind);

  uint64_t recording = 0;
  const ReadingArchive root(index.id(), "", index.bytes());
  reading(paths.index, [&] {
    root.value("cutproof_recording", recording);
    root.text("backend", header.backend);
    std::vector<uint8_t> scene;
    root.array("scene", scene);
    header.scene_json.assign(scene.begin(), scene.end());
    header.setup = read_setup(index.id(), index.bytes());
    double u = 0;
    root.value("unit_roundoff", u);
    header.precision = u == unit_roundoff(Precision::binary64) ? Precision::binary64 : Precision::binary32;
    if (u != unit_roundoff(header.precision)) {
      throw hdf5::Error("/unit_roundoff", fmt::format("This is {}, and should be 2^-53 or 2^-24.", u));
    }
    if (const auto defect = defect_of(header.setup)) throw hdf5::Error("/setup/" + defect->field, defect->problem);
    root.group("snapshots", [&](auto& archive) { read_columns(archive); });
    root.group("clusters", [&](auto& archive) {
      fields.for_each([&]<class T>(const Field& field, auto, ReadField<T>& track) {
        if constexpr (is_vector<T>) {
          const bool elsewhere = field.space == IndexSpace::particle || field.space == IndexSpace::vertex;
          if (storage_of<T>(field) != Storage::rows || elsewhere) return;
          archive.table(std::string(field.name), entry_layout<T>(), track.table);
        }
      });
    });
  });
  const auto same_recording = [&](const std::string& path, const ReadingArchive& archive) {
    uint64_t found = 0;
    archive.value("cutproof_recording", found);
    if (found != recording) {
      throw InputError(path, "cutproof_recording", "This file belongs to another recording than the index.", kRemedy);
    }
  };
  reading(paths.particles, [&] {
    const ReadingArchive archive(particles.id(), "", particles.bytes());
    same_recording(paths.particles, archive);
    open_tables(archive, IndexSpace::particle);
  });
  reading(paths.skin, [&] {
    const ReadingArchive archive(skin.id(), "", skin.bytes());
    same_recording(paths.skin, archive);
    open_tables(archive, IndexSpace::vertex);
  });
  reading(paths.index, [&] { check_ranges(); });
  header.snapshot_count = static_cast<int64_t>(stage.size());
}

void RecordingReader::File::read_columns(const ReadingArchive& archive) {
  archive.array("stage", stage);
  for (std::size_t c = 0; c < counts.size(); ++c) archive.array(kCountColumns[c].name, counts[c]);
  fields.for_each([&]<class T>(const Field& field, auto, ReadField<T>& track) {
    const std::string column(field.name);
    if constexpr (!is_vector<T>) {
      archive.array(column, track.values);
    } else if (storage_of<T>(field) == Storage::list) {
      archive.array(column + "_offsets", track.offsets);
      archive.array(column, track.values);
    } else {
      archive.array(column + "_row", track.first);
    }
  });
}

// The tables of a VTKHDF file whose points are the particles or the vertices of the skin.
void RecordingReader::File::open_tables(const ReadingArchive& archive, IndexSpace points) {
  archive.group("VTKHDF", [&](auto& a) {
    fields.for_each([&]<class T>(const Field& field, auto, ReadField<T>& track) {
      if constexpr (is_vector<T>) {
        if (field.space == points && is_points(field)) {
          a.table("Points", entry_layout<T>(), track.table);
        } else if (field.space == points) {
          a.group("PointData",
                  [&](auto& data) { data.table(std::string(field.name), entry_layout<T>(), track.table); });
        } else if (storage_of<T>(field) == Storage::cells && points == IndexSpace::vertex) {
          a.group("Polygons",
                  [&](auto& cells) { cells.table("Connectivity", hdf5::LayoutOf<int64_t>::get(), track.table); });
        }
      }
    });
  });
}

// How many entries a field of this index space has in snapshot i.
int64_t RecordingReader::File::count_in(IndexSpace space, std::size_t i) const {
  if (space == IndexSpace::particle) return header.setup.body.particle_count();
  const bool ends = space == IndexSpace::cluster_end;
  const auto column = std::ranges::find(kCountColumns, ends ? IndexSpace::cluster : space, &CountColumn::space);
  const int64_t count = counts[static_cast<std::size_t>(column - kCountColumns.begin())][i];
  return ends && count < std::numeric_limits<int64_t>::max() ? count + 1 : count;
}

void RecordingReader::File::check_ranges() const {
  const std::size_t count = stage.size();
  const std::string at = "/snapshots/";
  if (!std::all_of(stage.begin(), stage.end(), [](uint8_t s) { return s < kStages.size(); })) {
    throw hdf5::Error(at + "stage", "A stage is not one of 0 (step) to 5 (skin).");
  }
  for (std::size_t c = 0; c < counts.size(); ++c) {
    const std::string column = at + kCountColumns[c].name;
    require_length(column, counts[c], count);
    if (std::ranges::any_of(counts[c], [](int64_t entry) { return entry < 0; })) {
      throw hdf5::Error(column, "A count is negative.");
    }
  }
  fields.for_each([&]<class T>(const Field& field, auto, const ReadField<T>& track) {
    const std::string column = at + std::string(field.name);
    if constexpr (std::is_same_v<T, bool>) {
      if (std::ranges::any_of(track.values, [](uint8_t flag) { return flag > 1; })) {
        throw hdf5::Error(column, "These should be 0 or 1.");
      }
    }
    if constexpr (!is_vector<T>) {
      require_length(column, track.values, count);
    } else if (storage_of<T>(field) == Storage::list) {
      require_offsets(column + "_offsets", track.offsets, count, track.values.size());
    } else {
      require_length(column + "_row", track.first, count);
      const bool corners = storage_of<T>(field) == Storage::cells;
      std::vector<int64_t> lengths(count);
      for (std::size_t i = 0; i < count; ++i) lengths[i] = count_in(field.space, i);
      require_blocks(column + "_row", track.first, lengths, track.table.rows() / (corners ? 3 : 1));
    }
  });
}

Snapshot RecordingReader::File::snapshot(std::size_t i) const {
  Snapshot snapshot;
  snapshot.stage = static_cast<Stage>(stage[i]);
  State& state = snapshot.state;
  state.precision = header.precision;
  fields.for_each([&]<class T>(const Field& field, auto get, const ReadField<T>& track) {
    T& value = get(state);
    if constexpr (std::is_same_v<T, bool>) {
      value = track.values[i] == 1;
    } else if constexpr (!is_vector<T>) {
      value = track.values[i];
    } else if (storage_of<T>(field) == Storage::list) {
      value.assign(track.values.begin() + track.offsets[i], track.values.begin() + track.offsets[i + 1]);
    } else {
      const bool on_particles = field.space == IndexSpace::particle;
      const bool on_skin = field.space == IndexSpace::vertex || field.space == IndexSpace::triangle;
      reading(on_particles ? paths.particles
              : on_skin    ? paths.skin
                           : paths.index,
              [&] {
                const int64_t count = count_in(field.space, i);
                if constexpr (std::is_same_v<T, std::vector<std::array<int32_t, 3>>>) {
                  value = triangles_in(track.table, track.first[i], count, i);
                } else {
                  value.resize(static_cast<std::size_t>(count));
                  track.table.read(track.first[i], count, value.data());
                }
              });
    }
  });
  return snapshot;
}

RecordingReader::RecordingReader(const std::string& name) {
  const hdf5::Quiet quiet;
  file_ = std::make_unique<File>(name);
}

RecordingReader::~RecordingReader() {
  hdf5::release_memory();
  const hdf5::Quiet quiet;
  file_.reset();
}

const Recording& RecordingReader::header() const { return file_->header; }

Snapshot RecordingReader::snapshot(int64_t index) const {
  if (index < 0 || index >= file_->header.snapshot_count) {
    throw std::out_of_range(fmt::format("There is no snapshot {} in {}, which has {}.", index, file_->paths.index,
                                        file_->header.snapshot_count));
  }
  const hdf5::Quiet quiet;
  return file_->snapshot(static_cast<std::size_t>(index));
}

}  // namespace cutproof::io
