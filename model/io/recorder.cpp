#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "model/digest.h"
#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/hdf5_file.h"
#include "model/io/recording.h"
#include "model/io/recording_archive.h"
#include "model/io/recording_format.h"
#include "model/io/recording_setup.h"
#include "model/io/setup_check.h"
#include "model/io/vtkhdf.h"

namespace cutproof::io {
namespace {

// A block of rows that was written last, to be named again while it does not change.
template <class T>
struct Latest {
  bool stored = false;
  std::vector<T> values;
  int64_t row = 0;
};

template <class T>
bool is_new(const Latest<T>& latest, const std::vector<T>& values) {
  return !latest.stored || !same_bits(latest.values, values);
}

template <class T>
int64_t store(hdf5::RawTable& table, Latest<T>& latest, const std::vector<T>& values, bool anew = false) {
  if (anew || is_new(latest, values)) {
    latest.row = table.append(values.data(), static_cast<int64_t>(values.size()));
    latest.values = values;
    latest.stored = true;
  }
  return latest.row;
}

// What the recorder keeps of a field of type T.
template <class T>
struct WrittenField {
  std::vector<T> values;  // of each snapshot
};
template <class E>
struct WrittenField<std::vector<E>> {
  // A list.
  std::vector<int64_t> offsets = {0};  // [snapshots + 1]
  std::vector<E> values;
  // Rows, cells.
  hdf5::RawTable own;               // unless they are the points of a VTKHDF file
  hdf5::RawTable* table = nullptr;  // where they go
  Latest<E> latest;
  std::vector<int64_t> rows;  // of each snapshot: the first
};
template <>
struct WrittenField<bool> {
  std::vector<uint8_t> values;
};

// For each particle the number of the first cluster that holds it, -1 if none does. Makes sense of any clusters, also
// of broken ones.
std::vector<int32_t> cluster_of_particles(const Clusters& clusters, std::size_t particles) {
  std::vector<int32_t> found(particles, -1);
  const auto most = static_cast<int64_t>(clusters.members.size());
  for (std::size_t c = 0; c + 1 < clusters.offsets.size(); ++c) {
    const int64_t from = std::max<int64_t>(clusters.offsets[c], 0), to = std::min(clusters.offsets[c + 1], most);
    for (int64_t k = from; k < to; ++k) {
      const int32_t particle = clusters.members[static_cast<std::size_t>(k)];
      if (particle < 0 || static_cast<std::size_t>(particle) >= particles) continue;
      int32_t& number = found[static_cast<std::size_t>(particle)];
      if (number == -1) number = clusters.number[c];
    }
  }
  return found;
}

// The box around the rounded plate: the plate's mid-surface, thickness / 2 wider on all sides.
std::vector<Vec3> blade_corners(const Blade& blade, const BladePose& pose) {
  const double margin = blade.thickness / 2;
  const Vec3 normal = cross(pose.along, pose.back);
  std::vector<Vec3> corners;
  for (const double n : {-margin, margin}) {
    for (const double w : {-margin, blade.depth + margin}) {
      for (const double u : {-blade.length / 2 - margin, blade.length / 2 + margin}) {
        corners.push_back(pose.edge + u * pose.along + w * pose.back + n * normal);
      }
    }
  }
  return corners;
}

// Six quadrangles on the corners, counter-clockwise seen from outside (along, back, normal: right-handed).
constexpr std::array<int64_t, 7> kBoxOffsets = {0, 4, 8, 12, 16, 20, 24};
constexpr std::array<int64_t, 24> kBoxCorners = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4,
                                                 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};

// How many frames are over in a snapshot. Within a frame (any stage but skin) the positions are already those of its
// end.
int64_t frames_done(Stage stage, int64_t frame) {
  const bool within = stage != Stage::skin && frame < std::numeric_limits<int64_t>::max();
  return within ? frame + 1 : frame;
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
  if (state.x.size() != setup.body.node.size()) {
    throw std::invalid_argument(fmt::format("A state to be recorded has {} positions for a body of {} particles.",
                                            state.x.size(), setup.body.node.size()));
  }
  for_each_field([&](const Field& field, auto get) {
    using T = FieldType<decltype(get)>;
    if constexpr (is_vector<T>) {
      const auto count = static_cast<int64_t>(get(state).size());
      if (field.space != IndexSpace::state && count != count_of(field.space, state)) {
        throw std::invalid_argument(fmt::format("The field {} of a state to be recorded has {} entries instead of {}.",
                                                field.name, count, count_of(field.space, state)));
      }
    }
  });
}

}  // namespace

struct Recorder::File {
  File(const std::string& name, const Setup& given, const std::string& scene_json, const std::string& backend);
  void add(Stage stage, const State& state);
  void finish();

  // Declared first, so that temporary files are removed after HDF5 has let go of them.
  AtomicFile index_target, particles_target, skin_target, blade_target;
  std::string name;
  Setup setup;
  std::vector<double> time;  // [frames + 1] at the start of each frame [s]
  Digest digest;
  std::optional<Precision> precision;  // of all states
  bool broken = false, finished = false;

  hdf5::File index;
  PolyDataFile particles, skin, blade;
  hdf5::RawTable particle_table, cluster_table;

  // One row per snapshot. Whatever did not change since the snapshot before is stored once.
  std::vector<uint8_t> stage_column;
  std::array<std::vector<int64_t>, kCountColumns.size()> counts;
  PerField<WrittenField> fields;
  Latest<int32_t> cluster_of;
  Latest<Vec3> blade_points;

  PolyDataFile::Part body_part = PolyDataFile::kNothing, skin_part = PolyDataFile::kNothing,
                     blade_part = PolyDataFile::kNothing;
  std::vector<PolyDataFile::Step> particle_steps, skin_steps, blade_steps;
  std::optional<int64_t> step_frames;  // frames_done of the last step

 private:
  bool is_new_mesh(const State& state) const;
  int64_t store_triangles(Latest<std::array<int32_t, 3>>& latest, const State& state, bool anew);
  PolyDataFile::Step step_on(IndexSpace points, double seconds, PolyDataFile::Part part) const;
  PolyDataFile::Step blade_step(int64_t frames, double seconds);
  double time_at(int64_t frames) const {
    return time[static_cast<std::size_t>(std::clamp<int64_t>(frames, 0, setup.frame_count()))];
  }
};

Recorder::File::File(const std::string& given_name, const Setup& given, const std::string& scene_json,
                     const std::string& backend)
    : index_target(recording_paths(given_name).index),
      particles_target(recording_paths(given_name).particles),
      skin_target(recording_paths(given_name).skin),
      blade_target(recording_paths(given_name).blade),
      name(recording_paths(given_name).index),
      setup(given),
      time(1, 0.0),
      index(hdf5::File::create(index_target.temporary())),
      particles(particles_target.temporary(), PolyDataFile::Cells::vertices),
      skin(skin_target.temporary(), PolyDataFile::Cells::polygons),
      blade(blade_target.temporary(), PolyDataFile::Cells::polygons) {
  for (const double dt : setup.substep_length) time.push_back(time.back() + dt * setup.step.substeps);

  digest.add(setup.body.node);
  digest.add(std::string_view(scene_json));
  digest.add(std::string_view(backend));
  hdf5::write_text_attribute(index.id(), "backend", backend);
  hdf5::write_table(index.id(), "scene", std::vector<uint8_t>(scene_json.begin(), scene_json.end()));
  write_setup(index.id(), setup);

  // Point data is made in the order of the fields, after `particle` and before `cluster`.
  particle_table = particles.make_point_data("particle", hdf5::LayoutOf<int32_t>::get());
  const hdf5::Id cluster_group = hdf5::create_group(index.id(), "clusters");
  fields.for_each([&]<class T>(const Field& field, auto, WrittenField<T>& track) {
    if constexpr (is_vector<T>) {
      if (storage_of<T>(field) != Storage::rows) return;
      const bool on_particles = field.space == IndexSpace::particle;
      const std::string table_name(field.name);
      track.table = &track.own;
      if (!on_particles && field.space != IndexSpace::vertex) {
        track.own = hdf5::RawTable::create(cluster_group.get(), table_name, entry_layout<T>(), 0);
      } else if (PolyDataFile& file = on_particles ? particles : skin; is_points(field)) {
        track.table = &file.points();
      } else {
        track.own = file.make_point_data(table_name, entry_layout<T>());
      }
    }
  });
  cluster_table = particles.make_point_data("cluster", hdf5::LayoutOf<int32_t>::get());

  const auto n = setup.body.particle_count();
  if (n > 0) {
    std::vector<int64_t> vertex_offsets, vertices;
    std::vector<int32_t> ids;
    for (int32_t i = 0; i < n; ++i) {
      vertex_offsets.push_back(i);
      vertices.push_back(i);
      ids.push_back(i);
    }
    vertex_offsets.push_back(n);
    particle_table.append(ids.data(), n);
    body_part = particles.add_part(n, vertex_offsets, vertices);
  }
}

// Whether the triangles or what they stand on differ from those of the snapshot before; positions aside.
bool Recorder::File::is_new_mesh(const State& state) const {
  bool found = false;
  fields.for_each([&]<class T>(const Field& field, auto get, const WrittenField<T>& track) {
    if constexpr (is_vector<T>) {
      const bool of_mesh = field.space == IndexSpace::vertex || field.space == IndexSpace::triangle;
      if (of_mesh && !is_points(field)) found |= is_new(track.latest, get(state));
    }
  });
  return found;
}

// The first row of the triangles, one row being three corners.
int64_t Recorder::File::store_triangles(Latest<std::array<int32_t, 3>>& latest, const State& state, bool anew) {
  const auto& triangles = state.skin.triangles;
  if (anew) {
    latest.values = triangles;
    latest.stored = true;
    skin_part = PolyDataFile::kNothing;
    if (const int64_t vertices = count_of(IndexSpace::vertex, state); vertices > 0 || !triangles.empty()) {
      std::vector<int64_t> offsets = {0}, connectivity;
      for (const auto& triangle : triangles) {
        connectivity.insert(connectivity.end(), triangle.begin(), triangle.end());
        offsets.push_back(static_cast<int64_t>(connectivity.size()));
      }
      skin_part = skin.add_part(vertices, offsets, connectivity);
    }
    latest.row = skin_part == PolyDataFile::kNothing ? 0 : skin.first_connectivity(skin_part) / 3;
  }
  return latest.row;
}

// A step of the particles or of the skin, with the rows that were stored last.
PolyDataFile::Step Recorder::File::step_on(IndexSpace points, double seconds, PolyDataFile::Part part) const {
  PolyDataFile::Step step{seconds, part, 0, {}};
  fields.for_each([&]<class T>(const Field& field, auto, const WrittenField<T>& track) {
    if constexpr (is_vector<T>) {
      if (field.space != points) return;
      if (is_points(field)) {
        step.point_row = track.latest.row;
      } else {
        step.data_rows.push_back(track.latest.row);
      }
    }
  });
  return step;
}

PolyDataFile::Step Recorder::File::blade_step(int64_t frames, double seconds) {
  PolyDataFile::Step step{seconds, PolyDataFile::kNothing, 0, {}};
  if (!setup.has_blade || setup.blade_moves.empty()) return step;
  // Where it stands at the end of the frames that are over; before the first one, where it begins.
  const int64_t last = std::clamp<int64_t>(frames, 0, setup.frame_count()) * setup.step.substeps - 1;
  const BladeMove& move = setup.blade_moves[static_cast<std::size_t>(std::max<int64_t>(last, 0))];
  if (!move.down) return step;
  if (blade_part == PolyDataFile::kNothing) blade_part = blade.add_part(8, kBoxOffsets, kBoxCorners);
  step.part = blade_part;
  step.point_row = store(blade.points(), blade_points, blade_corners(setup.blade, last < 0 ? move.from : move.to));
  return step;
}

void Recorder::File::add(Stage stage, const State& state) {
  digest.add(stage);
  digest.add(cutproof::digest(state));
  stage_column.push_back(static_cast<uint8_t>(stage));
  for (std::size_t c = 0; c < counts.size(); ++c) counts[c].push_back(count_of(kCountColumns[c].space, state));
  // Positions are written anew with new triangles: VTK takes equal points for an equal mesh.
  const bool new_mesh = is_new_mesh(state);
  fields.for_each([&]<class T>(const Field& field, auto get, WrittenField<T>& track) {
    const T& value = get(state);
    if constexpr (!is_vector<T>) {
      track.values.push_back(value);
    } else if (storage_of<T>(field) == Storage::list) {
      track.values.insert(track.values.end(), value.begin(), value.end());
      track.offsets.push_back(static_cast<int64_t>(track.values.size()));
    } else if constexpr (std::is_same_v<T, std::vector<std::array<int32_t, 3>>>) {
      track.rows.push_back(store_triangles(track.latest, state, new_mesh));
    } else {
      track.rows.push_back(store(*track.table, track.latest, value, field.space == IndexSpace::vertex && new_mesh));
    }
  });

  // ParaView sees one step per frame: a later snapshot of a frame takes the place of an earlier one.
  const int64_t frames = frames_done(stage, state.frame);
  if (step_frames == frames) {
    particle_steps.pop_back();
    skin_steps.pop_back();
    blade_steps.pop_back();
  }
  step_frames = frames;
  const double seconds = time_at(frames);
  PolyDataFile::Step particle_step = step_on(IndexSpace::particle, seconds, body_part);
  particle_step.data_rows.insert(particle_step.data_rows.begin(), 0);  // `particle` is written once
  particle_step.data_rows.push_back(
      store(cluster_table, cluster_of, cluster_of_particles(state.clusters, state.x.size())));
  particle_steps.push_back(std::move(particle_step));
  skin_steps.push_back(step_on(IndexSpace::vertex, seconds, skin_part));
  blade_steps.push_back(blade_step(frames, seconds));
}

void Recorder::File::finish() {
  WritingArchive root(index.id());
  root.value("unit_roundoff", unit_roundoff(precision.value_or(Precision::binary64)));
  root.group("snapshots", [&](auto& archive) {
    archive.array("stage", stage_column);
    for (std::size_t c = 0; c < counts.size(); ++c) archive.array(kCountColumns[c].name, counts[c]);
    fields.for_each([&]<class T>(const Field& field, auto, const WrittenField<T>& track) {
      const std::string column(field.name);
      if constexpr (!is_vector<T>) {
        archive.array(column, track.values);
      } else if (storage_of<T>(field) == Storage::list) {
        archive.array(column + "_offsets", track.offsets);
        archive.array(column, track.values);
      } else {
        archive.array(column + "_row", track.rows);
      }
    });
  });
  const std::pair<hid_t, const char*> kinds[] = {{index.id(), kIndexKind},
                                                 {particles.file().id(), kParticlesKind},
                                                 {skin.file().id(), kSkinKind},
                                                 {blade.file().id(), kBladeKind}};
  for (const auto& [file, kind] : kinds) {
    hdf5::write_text_attribute(file, "cutproof_file", kind);
    hdf5::write_attribute(file, "cutproof_format", kFormatVersion);
    hdf5::write_attribute(file, "cutproof_recording", digest.value());
  }
  fields.for_each([]<class T>(const Field&, auto, WrittenField<T>& track) {
    if constexpr (is_vector<T>) {
      if (track.table == &track.own) track.own.close();
    }
  });
  particle_table.close();
  cluster_table.close();
  particles.finish(particle_steps);
  skin.finish(skin_steps);
  blade.finish(blade_steps);
  index.close();
  // The index comes last: whoever finds it finds all of them.
  particles_target.commit();
  skin_target.commit();
  blade_target.commit();
  index_target.commit();
  finished = true;
}

Recorder::Recorder(const std::string& name, const Setup& setup, const std::string& scene_json,
                   const std::string& backend) {
  const std::string stem = std::filesystem::path(stem_of(name)).filename().string();
  if (stem.empty()) {
    throw InputError(name, "", "This names no file to record to.", "Give a name such as \"run1\" or \"out/run1\".");
  }
  if (const auto defect = defect_of(setup)) {
    throw std::invalid_argument("A setup to be recorded is not valid: " + defect->field + ": " + defect->problem);
  }
  const hdf5::Quiet quiet;
  try {
    file_ = std::make_unique<File>(name, setup, scene_json, backend);
  } catch (const hdf5::Error& error) {
    throw MachineError(fmt::format("{}: The recording cannot be begun ({}). {}", recording_paths(name).index,
                                   error.where(), error.what()));
  }
}

Recorder::~Recorder() {
  hdf5::release_memory();
  const hdf5::Quiet quiet;
  file_.reset();
}

void Recorder::add(Stage stage, const State& state) {
  if (file_->broken || file_->finished) {
    throw std::logic_error("A recording that is finished or that failed takes no further snapshot.");
  }
  require_lengths(file_->setup, state);
  require_precision(file_->precision, state);
  const hdf5::Quiet quiet;
  file_->broken = true;  // until all is done: after an exception its columns may differ in length
  try {
    file_->add(stage, state);
  } catch (const hdf5::Error& error) {
    throw MachineError(fmt::format("{}: Snapshot {} cannot be written ({}). {}", file_->name,
                                   file_->stage_column.size() - 1, error.where(), error.what()));
  }
  file_->broken = false;
}

void Recorder::finish() {
  if (file_->broken || file_->finished) {
    throw std::logic_error("A recording that is finished or that failed cannot be finished.");
  }
  const hdf5::Quiet quiet;
  file_->broken = true;  // until all is done: after an exception there is nothing to go on with
  try {
    file_->finish();
  } catch (const hdf5::Error& error) {
    throw MachineError(
        fmt::format("{}: The recording cannot be completed ({}). {}", file_->name, error.where(), error.what()));
  }
  file_->broken = false;
}

}  // namespace cutproof::io
