#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "model/at.h"
#include "model/coordinates.h"
#include "model/digest.h"
#include "model/error.h"
#include "model/io/hdf5_file.h"
#include "model/io/input_file.h"
#include "model/io/limits.h"
#include "model/io/recording.h"
#include "model/io/recording_archive.h"
#include "model/io/recording_format.h"
#include "model/io/recording_setup.h"
#include "model/io/setup_check.h"
#include "model/io/shown_run.h"
#include "model/io/vtkhdf.h"

namespace cutproof::io {
namespace {

constexpr const char* kRemedy = "Copy all files of the recording again, or record the scene again.";

// A file of a recording, opened and recognised.
hdf5::File open_part(const std::string& path, const char* kind) {
  std::error_code no_status;
  if (!std::filesystem::exists(path, no_status)) {
    throw InputError(path, "", "There is no such file.",
                     "Keep the files of a recording (index, particles, skin) in one folder.");
  }
  require_regular_file(path);
  constexpr std::array<char, 8> kSignature = {'\x89', 'H', 'D', 'F', '\r', '\n', '\x1a', '\n'};
  std::array<char, 8> begin = {};
  std::ifstream stream;
  stream.exceptions(std::ios::badbit);  // a lack of memory is reported as such
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
      throw InputError(path, "cutproof_file", "This HDF5 file is not a recording.",
                       "Give a recording made by cutproof.");
    }
    const std::string found = hdf5::read_text_attribute(file.id(), "cutproof_file");
    if (found != kind) {
      throw InputError(path, "cutproof_file", fmt::format("This is \"{}\", and should be \"{}\".", found, kind),
                       "Give the name of the index, which ends in \".cutproof.h5\".");
    }
    const auto version = hdf5::read_attribute<int32_t>(file.id(), "cutproof_format");
    if (version != kFormatVersion) {
      throw InputError(path, "cutproof_format",
                       fmt::format("The recording has format {}, and this program reads {}.", version, kFormatVersion),
                       version > kFormatVersion ? "Use a newer cutproof." : "Record the scene again.");
    }
    return file;
  } catch (const hdf5::Error& error) {
    throw InputError(path, "", fmt::format("The file is cut off or damaged. {}", error.what()), kRemedy);
  }
}

// `count` rows from `first`, as entry i of a column says, must be among `rows`.
void require_block(const std::string& column, std::size_t i, int64_t first, int64_t count, int64_t rows) {
  if (first >= 0 && count >= 0 && count <= rows && first <= rows - count) return;
  throw hdf5::Error(column, fmt::format("Entry {} is {}: {} rows from there are not among the {} that are stored.", i,
                                        first, count, rows));
}

void require_length(const std::string& field, std::size_t entries, std::size_t wanted) {
  if (entries == wanted) return;
  throw hdf5::Error(field, fmt::format("This has {} entries, and should have {}.", entries, wanted));
}

// Triangles `first` to `first + count` of a table of corners; of snapshot i, for the error.
std::vector<std::array<int32_t, 3>> triangles_in(const hdf5::Table& table, int64_t first, int64_t count,
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

}  // namespace

struct RecordingReader::File {
  explicit File(const std::string& name);
  Snapshot snapshot(std::size_t i) const;

  Recording header;
  std::string index_path;

 private:
  // One of the files.
  struct Part {
    std::string path;
    hdf5::File file;
    hdf5::InflationBudget* budget = nullptr;

    // Runs an action on its contents.
    template <class F>
    void reading(F&& action, const char* remedy = kRemedy) const {
      try {
        action(ReadingArchive(file.id(), "", *budget));
      } catch (const hdf5::Error& error) {
        throw InputError(path, error.where(), error.what(), remedy);
      }
    }
  };
  void read_index(const ReadingArchive& root);
  void check_ranges() const;
  void check_sizes() const;
  const Part& part_of(const RecordedField& recorded) const;
  int64_t count_in(IndexSpace space, std::size_t i) const;
  void check_shown();
  ShownStep shown(IndexSpace points, std::size_t step) const;
  void check_particles();
  void check_blade() const;
  void check_clusters(std::size_t i, const State& state) const;

  Part index, particles, skin;
  std::optional<Part> blade;
  hdf5::InflationBudget budget;
  uint64_t recording = 0, recorded_beginning = 0;
  bool absolute_coordinates = false;  // State::place_rounding follows from them
  SnapshotColumns columns;
  // Of the files for ParaView: the snapshot of each step, and how many frames are over in it.
  struct Step {
    std::size_t snapshot;
    int64_t frames;
  };
  std::vector<Step> steps;
  std::vector<double> starts;
  std::map<std::size_t, int64_t> cluster_row;                                            // by snapshot that is a step
  std::vector<hdf5::Table> tables = std::vector<hdf5::Table>(recorded_fields().size());  // of rows and cells
};

RecordingReader::File::File(const std::string& name) {
  const RecordingPaths paths = recording_paths(name);
  index_path = paths.index;
  std::error_code no_status;
  if (!std::filesystem::exists(paths.index, no_status)) {
    throw InputError(name, "", "There is no such file.",
                     "Give the name of a recording, with or without \".cutproof.h5\".");
  }
  index = {paths.index, open_part(paths.index, kIndexKind), &budget};
  particles = {paths.particles, open_part(paths.particles, kParticlesKind), &budget};
  skin = {paths.skin, open_part(paths.skin, kSkinKind), &budget};
  if (std::filesystem::exists(paths.blade, no_status)) {
    blade = Part{paths.blade, open_part(paths.blade, kBladeKind), &budget};
  }
  budget = hdf5::InflationBudget(index.file.bytes() + particles.file.bytes() + skin.file.bytes() +
                                 (blade ? blade->file.bytes() : 0));
  index.reading([&](const ReadingArchive& root) { read_index(root); });
  const Part* const of_blade = blade ? &*blade : nullptr;
  for (const Part* part : {static_cast<const Part*>(&index), static_cast<const Part*>(&particles),
                           static_cast<const Part*>(&skin), of_blade}) {
    if (part == nullptr) continue;
    part->reading([&](const ReadingArchive& archive) {
      uint64_t found = 0;
      archive("cutproof_recording", found);
      if (found != recording) {
        throw InputError(part->path, "cutproof_recording", "This file belongs to another recording than the index.",
                         kRemedy);
      }
      for (std::size_t k = 0; k < tables.size(); ++k) {
        const RecordedField& recorded = recorded_fields()[k];
        if (&part_of(recorded) != part) continue;
        if (recorded.storage == Storage::cells) {
          tables[k] = archive.table("VTKHDF/Polygons/Connectivity", hdf5::layout_of<int64_t>());
        } else if (recorded.storage == Storage::rows) {
          const std::string data = part == &index ? "clusters/" : "VTKHDF/PointData/";
          const bool is_points = part != &index && recorded.is_points();
          tables[k] = archive.table(is_points ? "VTKHDF/Points" : data + recorded.name(), recorded.entry);
        }
      }
    });
  }
  index.reading([&](const ReadingArchive&) {
    check_ranges();
    check_sizes();
  });
  header.snapshot_count = static_cast<int64_t>(columns.stage.size());
  check_shown();
  Digest beginning =
      digest_of_beginning(header.setup, header.scene_json, header.left_to_reference, header.frames_asked);
  if (header.snapshot_count > 0) beginning.add(cutproof::digest(snapshot(0).state));
  header.begins_as_recorded = beginning.value() == recorded_beginning;
}

void RecordingReader::File::read_index(const ReadingArchive& root) {
  root("cutproof_recording", recording);
  root("backend", header.backend);
  if (hdf5::has_attribute(index.file.id(), kLeftToReference)) {
    std::string left;
    root(kLeftToReference, left);
    header.left_to_reference = stages_of_words(left);
  }
  if (hdf5::has_attribute(index.file.id(), kPromises)) root(kPromises, header.promises);
  std::vector<uint8_t> scene;
  root("scene", scene);
  header.scene_json.assign(scene.begin(), scene.end());
  int64_t frames_asked = 0;
  root("frames_asked", frames_asked);
  if (frames_asked < -1)
    throw hdf5::Error("/frames_asked", fmt::format("This is {}, and should be at least -1.", frames_asked));
  if (frames_asked >= 0) header.frames_asked = frames_asked;
  root("cutproof_beginning", recorded_beginning);
  header.setup = read_setup(index.file.id(), budget);
  double u = 0;
  root("unit_roundoff", u);
  header.precision = u == unit_roundoff(Precision::binary64) ? Precision::binary64 : Precision::binary32;
  if (u != unit_roundoff(header.precision)) {
    throw hdf5::Error("/unit_roundoff", fmt::format("This is {}, and should be 2^-53 or 2^-24.", u));
  }
  if (hdf5::has_attribute(index.file.id(), kAbsoluteCoordinates)) {
    uint8_t absolute = 0;
    root(kAbsoluteCoordinates, absolute);
    absolute_coordinates = absolute != 0;
  }
  if (const auto defect = defect_of(header.setup)) throw hdf5::Error("/setup/" + defect->field, defect->problem);
  root.group("snapshots", [&](auto& archive) { walk_snapshots(archive, columns); });
}

// The file with the rows of a field.
const RecordingReader::File::Part& RecordingReader::File::part_of(const RecordedField& recorded) const {
  const IndexSpace space = recorded.field.space;
  if (space == IndexSpace::particle) return particles;
  return space == IndexSpace::vertex || space == IndexSpace::triangle ? skin : index;
}

// How many entries a field of this index space has in snapshot i.
int64_t RecordingReader::File::count_in(IndexSpace space, std::size_t i) const {
  if (space == IndexSpace::particle) return header.setup.body.particle_count();
  const bool ends = space == IndexSpace::cluster_end;
  const auto column = std::ranges::find(kCountColumns, ends ? IndexSpace::cluster : space, &CountColumn::space);
  const int64_t count = columns.counts[at(column - kCountColumns.begin())][i];
  return ends && count < std::numeric_limits<int64_t>::max() ? count + 1 : count;
}

void RecordingReader::File::check_ranges() const {
  const std::size_t count = columns.stage.size();
  const std::string at = "/snapshots/";
  if (count > static_cast<std::size_t>(kMostSnapshots)) {
    throw hdf5::Error(at + "stage", fmt::format("There are {} snapshots, more than {}.", count, kMostSnapshots));
  }
  if (!std::ranges::all_of(columns.stage, [](uint8_t s) { return s < kStages.size(); })) {
    throw hdf5::Error(at + "stage", "A stage is not one of 0 (step) to 5 (skin).");
  }
  for (std::size_t c = 0; c < kCountColumns.size(); ++c) {
    const std::string column = at + kCountColumns[c].name;
    require_length(column, columns.counts[c].size(), count);
    if (std::ranges::any_of(columns.counts[c], [](int64_t entry) { return entry < 0; })) {
      throw hdf5::Error(column, "A count is negative.");
    }
  }
  for (std::size_t k = 0; k < tables.size(); ++k) {
    const RecordedField& recorded = recorded_fields()[k];
    const auto& [values, index_column] = columns.fields[k];
    const std::string column = at + recorded.name();
    const std::size_t entries = values.size() / recorded.entry.bytes();
    switch (recorded.storage) {
      case Storage::value:
        require_length(column, entries, count);
        if (recorded.field.quantity == Quantity::flag) require_flags(column, values);
        break;
      case Storage::list:
        require_length(column + "_offsets", index_column.size(), count + 1);
        require_offsets(column + "_offsets", index_column, entries);
        break;
      case Storage::rows:
      case Storage::cells:
        require_length(column + "_row", index_column.size(), count);
        const int64_t rows = tables[k].rows() / (recorded.storage == Storage::cells ? 3 : 1);
        for (std::size_t i = 0; i < count; ++i) {
          require_block(column + "_row", i, index_column[i], count_in(recorded.field.space, i), rows);
        }
    }
  }
}

// A snapshot is read whole, too: each may be what the files may become.
void RecordingReader::File::check_sizes() const {
  for (std::size_t i = 0; i < columns.stage.size(); ++i) {
    hdf5::InflationBudget of_snapshot(budget.file_bytes());
    for (const RecordedField& recorded : recorded_fields()) {
      if (recorded.storage != Storage::rows && recorded.storage != Storage::cells) continue;
      of_snapshot.take("/snapshots/" + recorded.name() + "_row",
                       static_cast<uint64_t>(count_in(recorded.field.space, i)) * recorded.entry.bytes());
    }
  }
}

Snapshot RecordingReader::File::snapshot(std::size_t i) const {
  Snapshot snapshot;
  snapshot.stage = static_cast<Stage>(columns.stage[i]);
  State& state = snapshot.state;
  state.precision = header.precision;
  for (std::size_t k = 0; k < tables.size(); ++k) {
    const RecordedField& recorded = recorded_fields()[k];
    // No structured binding: clang 14 does not capture these.
    const std::vector<std::byte>& values = columns.fields[k].values;
    const std::vector<int64_t>& index_column = columns.fields[k].index;
    if (recorded.storage == Storage::value || recorded.storage == Storage::list) {
      const bool is_list = recorded.storage == Storage::list;
      const int64_t first = is_list ? index_column[i] : static_cast<int64_t>(i);
      const int64_t end = is_list ? index_column[i + 1] : first + 1;
      std::byte* const room = recorded.make_room(state, end - first);
      const auto size = static_cast<int64_t>(recorded.entry.bytes());
      std::copy(values.begin() + first * size, values.begin() + end * size, room);
      continue;
    }
    part_of(recorded).reading([&](const ReadingArchive&) {
      const int64_t first = index_column[i], count = count_in(recorded.field.space, i);
      if (recorded.storage == Storage::cells) {
        state.skin.triangles = triangles_in(tables[k], first, count, i);
      } else {
        tables[k].read(first, count, recorded.make_room(state, count));
      }
    });
  }
  if (absolute_coordinates) state.place_rounding = rounding_of_coordinates(header.setup.body, state);
  check_clusters(i, state);
  return snapshot;
}

// --- What the files for ParaView say of the same run -----------------------------------------------------------------

// A writer may leave them out: then they show nothing.
constexpr const char* kShownRemedy =
    "Copy all files of the recording again, or record the scene again. A program that writes recordings can leave out "
    "the group VTKHDF/Steps.";

// Expected contents of a step for the particles or the skin, except those that depend on the rest of the file.
ShownStep RecordingReader::File::shown(IndexSpace points, std::size_t step) const {
  const std::size_t i = steps[step].snapshot;
  ShownStep wanted;
  wanted.time = time_after(starts, steps[step].frames);
  wanted.points = count_in(points, i);
  for (std::size_t k = 0; k < tables.size(); ++k) {
    const RecordedField& recorded = recorded_fields()[k];
    if (recorded.field.space != points) continue;
    const int64_t row = columns.fields[k].index[i];
    if (recorded.is_points()) {
      wanted.point_row = row;
    } else {
      wanted.data_rows.emplace_back(row);
    }
  }
  return wanted;
}

void RecordingReader::File::check_shown() {
  starts = frame_starts(header.setup);
  const auto frame = std::ranges::find(recorded_fields(), "frame", &RecordedField::name) - recorded_fields().begin();
  for (std::size_t i = 0; i < columns.stage.size(); ++i) {
    int64_t in_progress = 0;
    std::memcpy(&in_progress, columns.fields[at(frame)].values.data() + i * sizeof in_progress, sizeof in_progress);
    const int64_t frames = frames_done(static_cast<Stage>(columns.stage[i]), in_progress);
    if (!steps.empty() && steps.back().frames == frames) steps.pop_back();
    steps.push_back({i, frames});
  }
  if (steps.empty()) return;
  particles.reading([&](const ReadingArchive&) { check_particles(); }, kShownRemedy);
  skin.reading(
      [&](const ReadingArchive& file) {
        std::vector<std::string> names;
        const RecordedField* triangles = nullptr;
        std::size_t of_triangles = 0;
        for (std::size_t k = 0; k < tables.size(); ++k) {
          const RecordedField& recorded = recorded_fields()[k];
          if (recorded.storage == Storage::cells) triangles = &recorded, of_triangles = k;
          if (recorded.field.space == IndexSpace::vertex && !recorded.is_points()) names.push_back(recorded.name());
        }
        std::vector<ShownStep> wanted;
        for (std::size_t s = 0; s < steps.size(); ++s) {
          const std::size_t i = steps[s].snapshot;
          wanted.push_back(shown(IndexSpace::vertex, s));
          wanted.back().cells = count_in(triangles->field.space, i);
          wanted.back().corner_row = 3 * columns.fields[of_triangles].index[i];
        }
        require_steps(file, PolyDataFile::Cells::polygons, 3, names, wanted);
      },
      kShownRemedy);
  if (blade) blade->reading([&](const ReadingArchive&) { check_blade(); }, kShownRemedy);
}

// Besides the fields of a state: the number of each particle, and of a cluster that holds it.
void RecordingReader::File::check_particles() {
  std::vector<std::string> names = {"particle"};
  for (const RecordedField& recorded : recorded_fields()) {
    if (recorded.field.space == IndexSpace::particle && !recorded.is_points()) names.push_back(recorded.name());
  }
  names.emplace_back("cluster");
  const int64_t n = header.setup.body.particle_count();
  std::vector<ShownStep> wanted;
  for (std::size_t s = 0; s < steps.size(); ++s) {
    wanted.push_back(shown(IndexSpace::particle, s));
    wanted.back().cells = n;
    wanted.back().data_rows.insert(wanted.back().data_rows.begin(), std::optional<int64_t>());
    wanted.back().data_rows.emplace_back();
  }
  const ReadingArchive file(particles.file.id(), "", budget);
  const auto rows = require_steps(file, PolyDataFile::Cells::vertices, 1, names, wanted);
  if (!rows) return;
  const std::string cells = "VTKHDF/Vertices/Connectivity", number = "VTKHDF/PointData/particle";
  for (const int64_t first : std::set(rows->corners.begin(), rows->corners.end())) {
    for_each_entry<int64_t>(file, cells, first, n, [&](int64_t k, int64_t corner) {
      require_entry(file.path_of(cells), first + k, corner, k);
    });
  }
  for (const int64_t first : std::set(rows->data.front().begin(), rows->data.front().end())) {
    for_each_entry<int32_t>(file, number, first, n, [&](int64_t k, int32_t particle) {
      require_entry(file.path_of(number), first + k, particle, static_cast<int32_t>(k));
    });
  }
  for (std::size_t s = 0; s < steps.size(); ++s) cluster_row[steps[s].snapshot] = rows->data.back()[s];
}

// Of a snapshot that a step shows, whose clusters are known once it is read.
void RecordingReader::File::check_clusters(std::size_t i, const State& state) const {
  const auto found = cluster_row.find(i);
  if (found == cluster_row.end()) return;
  particles.reading(
      [&](const ReadingArchive& file) {
        const std::string name = "VTKHDF/PointData/cluster";
        const std::vector<int32_t> wanted = cluster_of_particles(state.clusters, state.x.size());
        for_each_entry<int32_t>(file, name, found->second, std::ssize(wanted), [&](int64_t k, int32_t cluster) {
          require_entry(file.path_of(name), found->second + k, cluster, wanted[at(k)]);
        });
      },
      kShownRemedy);
}

void RecordingReader::File::check_blade() const {
  const int64_t faces = std::ssize(kBoxOffsets) - 1, corners = std::ssize(kBoxCorners);
  std::vector<ShownStep> wanted;
  std::vector<std::optional<std::vector<Vec3>>> boxes;
  for (const Step& step : steps) {
    boxes.push_back(blade_box(header.setup, step.frames));
    wanted.push_back({time_after(starts, step.frames), 0, 0, 0, {}, {}});
    if (!boxes.back()) continue;
    wanted.back().points = std::ssize(*boxes.back());
    wanted.back().cells = faces;
    wanted.back().point_row.reset();  // that of the same box
  }
  const ReadingArchive file(blade->file.id(), "", *blade->budget);
  const auto rows = require_steps(file, PolyDataFile::Cells::polygons, corners / faces, {}, wanted);
  if (!rows) return;
  const std::string places = "VTKHDF/Points", cells = "VTKHDF/Polygons/Connectivity";
  for (std::size_t s = 0; s < steps.size(); ++s) {
    if (!boxes[s]) continue;
    for_each_entry<Vec3>(file, places, rows->points[s], std::ssize(*boxes[s]), [&](int64_t k, const Vec3& corner) {
      const Vec3& box = (*boxes[s])[at(k)];
      for (int axis = 0; axis < 3; ++axis) {
        require_entry(file.path_of(places), rows->points[s] + k, corner[axis], box[axis]);
      }
    });
    for_each_entry<int64_t>(file, cells, rows->corners[s], corners, [&](int64_t k, int64_t corner) {
      require_entry(file.path_of(cells), rows->corners[s] + k, corner, kBoxCorners[at(k)]);
    });
  }
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
    throw std::out_of_range(fmt::format("There is no snapshot {} in {}, which has {}.", index, file_->index_path,
                                        file_->header.snapshot_count));
  }
  const hdf5::Quiet quiet;
  return file_->snapshot(static_cast<std::size_t>(index));
}

}  // namespace cutproof::io
