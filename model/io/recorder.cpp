#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "model/at.h"
#include "model/digest.h"
#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/hdf5_file.h"
#include "model/io/recording.h"
#include "model/io/recording_archive.h"
#include "model/io/recording_format.h"
#include "model/io/recording_setup.h"
#include "model/io/setup_check.h"
#include "model/io/shown_run.h"
#include "model/io/vtkhdf.h"

namespace cutproof::io {
namespace {

using Bytes = std::span<const std::byte>;

template <class T>
Bytes bytes_of(const T& values) {
  return std::as_bytes(std::span(values));
}

// A recording is of one backend, so all of its states are of one precision.
void require_precision(std::optional<Precision>& of_all, const State& state) {
  if (of_all.value_or(state.precision) != state.precision) {
    throw std::invalid_argument("The states of a recording must have been computed in one precision.");
  }
  of_all = state.precision;
}

// Broken contents may be recorded, but each array must have the length by which a reader finds its entries.
void require_lengths(const Setup& setup, const State& state) {
  if (static_cast<int64_t>(state.x.size()) != setup.body.particle_count()) {
    throw std::invalid_argument(fmt::format("A state to be recorded has {} positions for a body of {} particles.",
                                            state.x.size(), setup.body.particle_count()));
  }
  for (const RecordedField& recorded : recorded_fields()) {
    const Field& field = recorded.field;
    if (recorded.storage == Storage::value || recorded.storage == Storage::list) continue;
    const auto count = static_cast<int64_t>(recorded.bytes(state).size() / recorded.entry.bytes());
    if (count != count_of(field.space, state)) {
      throw std::invalid_argument(fmt::format("The field {} of a state to be recorded has {} entries instead of {}.",
                                              field.name, count, count_of(field.space, state)));
    }
  }
}

// Runs an action that writes. `what`: the failure if the disk fails, a sentence without a full stop.
template <class F>
auto writing(const std::string& file, const std::string& what, F&& action) {
  const hdf5::Quiet quiet;
  try {
    return action();
  } catch (const hdf5::Error& error) {
    throw MachineError(fmt::format("{}: {} ({}). {}", file, what, error.where(), error.what()));
  }
}

}  // namespace

struct Recorder::File {
  File(const std::string& name, const Setup& given, const std::string& scene_json, const std::string& backend,
       const std::array<bool, 6>& left_to_reference, std::optional<int64_t> frames_asked, const std::string& promises);
  void add(Stage stage, const State& state);
  void finish();

  // The rows of a table that were written last, to be named again while they do not change.
  struct Latest {
    bool is_stored = false;
    std::vector<std::byte> bytes;
    int64_t row = 0;

    bool is(Bytes values) const { return is_stored && std::ranges::equal(bytes, values); }
    void set(Bytes values, int64_t at) { *this = {true, {values.begin(), values.end()}, at}; }
    int64_t store(hdf5::Table& table, Bytes values, bool anew = false) {
      if (anew || !is(values)) set(values, table.append(values));
      return row;
    }
  };

  // Where the rows of a field go, and the rows written so far.
  struct Track {
    hdf5::Table own;               // unless they are the points of a VTKHDF file
    hdf5::Table* table = nullptr;  // where they go
    Latest latest;
  };
  // A file for ParaView.
  struct Shown {
    Shown(const std::string& path, PolyDataFile::Cells cells) : target(path), file(target.temporary(), cells) {}
    void show(PolyDataFile::Step step, bool instead_of_last) {
      if (instead_of_last) steps.pop_back();
      steps.push_back(std::move(step));
    }
    AtomicFile target;  // declared first, so that the temporary file is removed after HDF5 has let go of it
    PolyDataFile file;
    std::vector<PolyDataFile::Step> steps;
  };

  std::string name;
  Setup setup;
  std::vector<double> starts;          // [frames + 1] of frames [s]
  Digest beginning, digest;            // of the initial state, and of all states
  std::optional<Precision> precision;  // of all states
  bool absolute_coordinates = false;   // of any state
  bool is_open = true;                 // false: finished, or something could not be written

  AtomicFile index_target;
  hdf5::File index;
  Shown particles, skin, blade;
  hdf5::Table particle_table, cluster_table;

  // One row per snapshot. Fields that did not change from the previous snapshot are stored once.
  SnapshotColumns columns;
  std::vector<Track> tracks = std::vector<Track>(recorded_fields().size());
  Latest cluster_rows, blade_points;
  std::vector<int32_t> cluster_of;  // [n] of the last snapshot, not stored yet: another may take its place

  PolyDataFile::Part body_part = PolyDataFile::kNothing, skin_part = PolyDataFile::kNothing,
                     blade_part = PolyDataFile::kNothing;
  std::optional<int64_t> step_frames;  // frames_done of the last step

 private:
  bool is_new_mesh(const State& state) const;
  void store_clusters();
  int64_t store_triangles(Latest& latest, const State& state, bool anew);
  PolyDataFile::Step step_on(IndexSpace points, double seconds, PolyDataFile::Part part) const;
  PolyDataFile::Step blade_step(int64_t frames, double seconds);
};

Recorder::File::File(const std::string& given_name, const Setup& given, const std::string& scene_json,
                     const std::string& backend, const std::array<bool, 6>& left_to_reference,
                     std::optional<int64_t> frames_asked, const std::string& promises)
    : name(recording_paths(given_name).index),
      setup(given),
      starts(frame_starts(given)),
      beginning(digest_of_beginning(given, scene_json, left_to_reference, frames_asked)),
      index_target(name),
      index(hdf5::File::create(index_target.temporary())),
      particles(recording_paths(given_name).particles, PolyDataFile::Cells::vertices),
      skin(recording_paths(given_name).skin, PolyDataFile::Cells::polygons),
      blade(recording_paths(given_name).blade, PolyDataFile::Cells::polygons) {
  digest.add(beginning.value());
  digest.add(std::string_view(backend));
  hdf5::write_text_attribute(index.id(), "backend", backend);
  if (const std::string left = words_of_stages(left_to_reference); !left.empty()) {
    hdf5::write_text_attribute(index.id(), kLeftToReference, left);
  }
  if (promises != "*") hdf5::write_text_attribute(index.id(), kPromises, promises);
  hdf5::write_table(index.id(), "scene", std::vector<uint8_t>(scene_json.begin(), scene_json.end()));
  hdf5::write_attribute(index.id(), "frames_asked", frames_asked.value_or(-1));
  write_setup(index.id(), setup);

  // Point data is made in the order of the fields, after `particle` and before `cluster`.
  particle_table = particles.file.make_point_data("particle", hdf5::layout_of<int32_t>());
  const hdf5::Id cluster_group = hdf5::create_group(index.id(), "clusters");
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    const RecordedField& recorded = recorded_fields()[k];
    if (recorded.storage == Storage::list) columns.fields[k].index = {0};
    if (recorded.storage != Storage::rows) continue;
    Track& track = tracks[k];
    const bool on_particles = recorded.field.space == IndexSpace::particle;
    PolyDataFile& file = on_particles ? particles.file : skin.file;
    track.table = &track.own;
    if (!on_particles && recorded.field.space != IndexSpace::vertex) {
      track.own = hdf5::Table::create(cluster_group.get(), recorded.name(), recorded.entry);
    } else if (recorded.is_points()) {
      track.table = &file.points();
    } else {
      track.own = file.make_point_data(recorded.name(), recorded.entry);
    }
  }
  cluster_table = particles.file.make_point_data("cluster", hdf5::layout_of<int32_t>());

  const auto n = setup.body.particle_count();
  if (n > 0) {
    std::vector<int64_t> vertex_offsets(static_cast<std::size_t>(n) + 1);
    std::iota(vertex_offsets.begin(), vertex_offsets.end(), 0);
    const std::span<const int64_t> vertices = std::span(vertex_offsets).first(static_cast<std::size_t>(n));
    particle_table.append(bytes_of(std::vector<int32_t>(vertices.begin(), vertices.end())));
    body_part = particles.file.add_part(n, vertex_offsets, vertices);
  }
}

// Whether the triangles or the owners of their vertices differ from those of the previous snapshot; positions aside.
bool Recorder::File::is_new_mesh(const State& state) const {
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    const RecordedField& recorded = recorded_fields()[k];
    const bool of_mesh = recorded.field.space == IndexSpace::vertex || recorded.field.space == IndexSpace::triangle;
    if (of_mesh && !recorded.is_points() && !tracks[k].latest.is(recorded.bytes(state))) return true;
  }
  return false;
}

// The first row of the triangles, one row being three corners.
int64_t Recorder::File::store_triangles(Latest& latest, const State& state, bool anew) {
  if (!anew) return latest.row;
  const auto& triangles = state.skin.triangles;
  skin_part = PolyDataFile::kNothing;
  if (const int64_t vertices = count_of(IndexSpace::vertex, state); vertices > 0 || !triangles.empty()) {
    std::vector<int64_t> offsets = {0}, connectivity;
    for (const auto& triangle : triangles) {
      connectivity.insert(connectivity.end(), triangle.begin(), triangle.end());
      offsets.push_back(static_cast<int64_t>(connectivity.size()));
    }
    skin_part = skin.file.add_part(vertices, offsets, connectivity);
  }
  latest.set(bytes_of(triangles),
             skin_part == PolyDataFile::kNothing ? 0 : skin.file.first_connectivity(skin_part) / 3);
  return latest.row;
}

// A step of the particles or of the skin, with the rows that were stored last.
PolyDataFile::Step Recorder::File::step_on(IndexSpace points, double seconds, PolyDataFile::Part part) const {
  PolyDataFile::Step step{seconds, part, 0, {}};
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    const RecordedField& recorded = recorded_fields()[k];
    if (recorded.field.space != points) continue;
    if (recorded.is_points()) {
      step.point_row = tracks[k].latest.row;
    } else {
      step.data_rows.push_back(tracks[k].latest.row);
    }
  }
  return step;
}

PolyDataFile::Step Recorder::File::blade_step(int64_t frames, double seconds) {
  PolyDataFile::Step step{seconds, PolyDataFile::kNothing, 0, {}};
  const std::optional<std::vector<Vec3>> corners = blade_box(setup, frames);
  if (!corners) return step;
  if (blade_part == PolyDataFile::kNothing) blade_part = blade.file.add_part(8, kBoxOffsets, kBoxCorners);
  step.part = blade_part;
  step.point_row = blade_points.store(blade.file.points(), bytes_of(*corners));
  return step;
}

void Recorder::File::add(Stage stage, const State& state) {
  digest.add(stage);
  digest.add(cutproof::digest(state));
  if (columns.stage.empty()) beginning.add(cutproof::digest(state));
  columns.stage.push_back(static_cast<uint8_t>(stage));
  for (std::size_t c = 0; c < kCountColumns.size(); ++c) {
    columns.counts[c].push_back(count_of(kCountColumns[c].space, state));
  }
  // Positions are written again with new triangles: VTK takes equal points for an equal mesh.
  const bool new_mesh = is_new_mesh(state);
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    const RecordedField& recorded = recorded_fields()[k];
    const Bytes bytes = recorded.bytes(state);
    SnapshotColumns::OfField& column = columns.fields[k];
    if (recorded.storage == Storage::cells) {
      column.index.push_back(store_triangles(tracks[k].latest, state, new_mesh));
    } else if (recorded.storage == Storage::rows) {
      const bool anew = recorded.field.space == IndexSpace::vertex && new_mesh;
      column.index.push_back(tracks[k].latest.store(*tracks[k].table, bytes, anew));
    } else {
      column.values.insert(column.values.end(), bytes.begin(), bytes.end());
      const auto entries = static_cast<int64_t>(column.values.size() / recorded.entry.bytes());
      if (recorded.storage == Storage::list) column.index.push_back(entries);
    }
  }

  // ParaView sees one step per frame: a later snapshot of a frame takes the place of an earlier one.
  const int64_t frames = frames_done(stage, state.frame);
  const bool again = step_frames == frames;
  if (!again) store_clusters();
  cluster_of = cluster_of_particles(state.clusters, state.x.size());
  step_frames = frames;
  const double seconds = time_after(starts, frames);
  PolyDataFile::Step particle_step = step_on(IndexSpace::particle, seconds, body_part);
  particle_step.data_rows.insert(particle_step.data_rows.begin(), 0);  // `particle` is written once
  particle_step.data_rows.push_back(0);                                // of the clusters: store_clusters() says it
  particles.show(std::move(particle_step), again);
  skin.show(step_on(IndexSpace::vertex, seconds, skin_part), again);
  blade.show(blade_step(frames, seconds), again);
}

// Those that the last step of the particles shows.
void Recorder::File::store_clusters() {
  if (particles.steps.empty()) return;
  particles.steps.back().data_rows.back() = cluster_rows.store(cluster_table, bytes_of(cluster_of));
}

void Recorder::File::finish() {
  store_clusters();
  WritingArchive root(index.id());
  root("cutproof_beginning", beginning.value());
  root("unit_roundoff", unit_roundoff(precision.value_or(Precision::binary64)));
  if (absolute_coordinates) hdf5::write_attribute(index.id(), kAbsoluteCoordinates, uint8_t{1});
  root.group("snapshots", [&](auto& archive) { walk_snapshots(archive, columns); });
  const std::pair<hid_t, const char*> kinds[] = {{index.id(), kIndexKind},
                                                 {particles.file.id(), kParticlesKind},
                                                 {skin.file.id(), kSkinKind},
                                                 {blade.file.id(), kBladeKind}};
  for (const auto& [file, kind] : kinds) {
    hdf5::write_text_attribute(file, "cutproof_file", kind);
    hdf5::write_attribute(file, "cutproof_format", kFormatVersion);
    hdf5::write_attribute(file, "cutproof_recording", digest.value());
  }
  for (Track& track : tracks) track.own.close();
  particle_table.close();
  cluster_table.close();
  for (Shown* shown : {&particles, &skin, &blade}) shown->file.finish(shown->steps);
  index.close();
  // The index comes last: if the index exists, all files exist.
  for (Shown* shown : {&particles, &skin, &blade}) shown->target.commit();
  index_target.commit();
}

Recorder::Recorder(const std::string& name, const Setup& setup, const std::string& scene_json,
                   const std::string& backend, std::array<bool, 6> left_to_reference,
                   std::optional<int64_t> frames_asked, const std::string& promises) {
  const std::string stem = std::filesystem::path(stem_of(name)).filename().string();
  if (stem.empty()) {
    throw InputError(name, "", "This names no file to record to.", "Give a name such as \"run1\" or \"out/run1\".");
  }
  if (const auto defect = defect_of(setup)) {
    throw std::invalid_argument("A setup to be recorded is not valid: " + defect->field + ": " + defect->problem);
  }
  file_ = writing(recording_paths(name).index, "The recording cannot be begun", [&] {
    return std::make_unique<File>(name, setup, scene_json, backend, left_to_reference, frames_asked, promises);
  });
}

Recorder::~Recorder() {
  hdf5::release_memory();
  const hdf5::Quiet quiet;
  file_.reset();
}

void Recorder::add(Stage stage, const State& state) {
  if (!file_->is_open) {
    throw std::logic_error("A recording that is finished or that failed takes no further snapshot.");
  }
  require_lengths(file_->setup, state);
  require_precision(file_->precision, state);
  file_->absolute_coordinates = file_->absolute_coordinates || state.place_rounding > 0;
  file_->is_open = false;  // until all is done: after an exception its columns may differ in length
  writing(file_->name, fmt::format("Snapshot {} cannot be written", file_->columns.stage.size()),
          [&] { file_->add(stage, state); });
  file_->is_open = true;
}

void Recorder::finish() {
  if (!file_->is_open) throw std::logic_error("A recording that is finished or that failed cannot be finished.");
  file_->is_open = false;
  writing(file_->name, "The recording cannot be completed", [&] { file_->finish(); });
}

}  // namespace cutproof::io
