#include "model/io/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <new>
#include <optional>
#include <stdexcept>
#include <utility>

#include "model/error.h"
#include "model/io/atomic_file.h"
#include "model/io/hdf5_file.h"
#include "model/io/recording_archive.h"
#include "model/io/recording_setup.h"
#include "model/io/vtkhdf.h"

namespace cutproof::io {
namespace {

constexpr int32_t kFormatVersion = 2;
constexpr std::string_view kIndexSuffix = ".cutproof.h5";

// What stands in the root attribute cutproof_file of each of the four files.
constexpr const char* kIndexKind = "recording index";
constexpr const char* kParticlesKind = "recording particles";
constexpr const char* kSkinKind = "recording skin";
constexpr const char* kBladeKind = "recording blade";

// --- What the index says of each snapshot ---

// One column per field, one row per snapshot. Whatever did not change since the snapshot before is stored once: the
// columns *_row name the first row of a block of rows, of which the lengths are known.
struct SnapshotColumns {
  std::vector<int64_t> frame;
  std::vector<uint8_t> stage, edge_covered;
  std::vector<int32_t> tau, cap;
  std::vector<Vec3> impulse;
  std::vector<int64_t> position_row, velocity_row, alive_row;        // of n rows, in the particles file
  std::vector<int64_t> removed_offsets = {0}, debris_offsets = {0};  // [snapshots + 1]
  std::vector<int32_t> removed, debris;
  std::vector<int64_t> cluster_set, rotation_row, degenerate_row;
  std::vector<int64_t> skin_vertices, skin_triangles;                                             // counts
  std::vector<int64_t> skin_owner_row, skin_direction_row, skin_position_row, skin_triangle_row;  // in the skin file
};

template <class Archive, class C>
void walk(Archive& a, C& c) {
  a.array("frame", c.frame);
  a.array("stage", c.stage);
  a.array("edge_covered", c.edge_covered);
  a.array("tau", c.tau);
  a.array("cap", c.cap);
  a.array("impulse", c.impulse);
  a.array("position_row", c.position_row);
  a.array("velocity_row", c.velocity_row);
  a.array("alive_row", c.alive_row);
  a.array("removed_offsets", c.removed_offsets);
  a.array("removed", c.removed);
  a.array("debris_offsets", c.debris_offsets);
  a.array("debris", c.debris);
  a.array("cluster_set", c.cluster_set);
  a.array("rotation_row", c.rotation_row);
  a.array("degenerate_row", c.degenerate_row);
  a.array("skin_vertices", c.skin_vertices);
  a.array("skin_triangles", c.skin_triangles);
  a.array("skin_owner_row", c.skin_owner_row);
  a.array("skin_direction_row", c.skin_direction_row);
  a.array("skin_position_row", c.skin_position_row);
  a.array("skin_triangle_row", c.skin_triangle_row);
}

// A set of clusters without what changes in every frame (rotations). Lengths are stored, not derived from the
// offsets: a recorded state may be broken, and the oracles are to see it as it was.
struct ClusterSetColumns {
  std::vector<int64_t> clusters, members;                    // counts
  std::vector<int64_t> offset_row, member_row, cluster_row;  // offsets: clusters + 1 rows
};

template <class Archive, class C>
void walk_sets(Archive& a, C& c) {
  a.array("clusters", c.clusters);
  a.array("members", c.members);
  a.array("offset_row", c.offset_row);
  a.array("member_row", c.member_row);
  a.array("cluster_row", c.cluster_row);
}

// The tables of the group /clusters.
struct ClusterTables {
  hdf5::Table<int64_t> offsets;
  hdf5::Table<int32_t> members, number;
  hdf5::Table<Vec3> rest_center;
  hdf5::Table<double> mass;
  hdf5::Table<Mat3> rotation;
  hdf5::Table<uint8_t> degenerate;
};

template <class F>
void for_each_table(ClusterTables& tables, F&& visit) {
  visit("offsets", tables.offsets);
  visit("members", tables.members);
  visit("number", tables.number);
  visit("rest_center", tables.rest_center);
  visit("mass", tables.mass);
  visit("rotation", tables.rotation);
  visit("degenerate", tables.degenerate);
}

// --- Writing ---

// Equal bits, where == would call NaN unequal and -0 equal to 0.
template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

// Names the contents of a recording, so that files of two recordings are not taken for one. Not cryptographic.
class Digest {
 public:
  void add(const void* data, std::size_t bytes) {
    const auto* from = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < bytes; i += 8) {
      uint64_t word = 0;
      std::memcpy(&word, from + i, std::min<std::size_t>(8, bytes - i));
      value_ = (value_ ^ word) * 0x9E3779B97F4A7C15u;
      value_ ^= value_ >> 32;
    }
    value_ = (value_ ^ bytes) * 0x9E3779B97F4A7C15u;
  }
  template <class T>
  void add(const std::vector<T>& values) {
    add(values.data(), values.size() * sizeof(T));
  }
  uint64_t value() const { return value_; }

 private:
  uint64_t value_ = 0xcbf29ce484222325u;
};

// A block of rows that was written last, to be named again while it does not change.
template <class T>
struct Latest {
  bool stored = false;
  std::vector<T> values;
  int64_t row = 0;
};

template <class T>
int64_t store(hdf5::Table<T>& table, Latest<T>& latest, const std::vector<T>& values, Digest& digest,
              bool anew = false) {
  if (anew || !latest.stored || !same_bits(latest.values, values)) {
    digest.add(values);
    latest.row = table.append(values);
    latest.values = values;
    latest.stored = true;
  }
  return latest.row;
}

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

void require_lengths(const Setup& setup, const State& state) {
  const std::size_t n = setup.body.node.size();
  const Clusters& c = state.clusters;
  const Skin& s = state.skin;
  const std::size_t m = c.offsets.size() - 1;
  if (state.x.size() != n || state.v.size() != n || state.alive.size() != n) {
    throw std::invalid_argument(fmt::format(
        "A state to be recorded has {} positions, {} velocities and {} alive flags for a body of {} particles.",
        state.x.size(), state.v.size(), state.alive.size(), n));
  }
  if (c.offsets.empty() || c.number.size() != m || c.rotation.size() != m || c.rest_center.size() != m ||
      c.mass.size() != m || c.degenerate.size() != m) {
    throw std::invalid_argument("The arrays of the clusters of a state to be recorded are not of one length.");
  }
  if (s.direction.size() != s.owner.size() || s.position.size() != s.owner.size()) {
    throw std::invalid_argument("The arrays of the skin of a state to be recorded are not of one length.");
  }
}

std::string stem_of(const std::string& name) {
  return name.ends_with(kIndexSuffix) ? name.substr(0, name.size() - kIndexSuffix.size()) : name;
}

}  // namespace

RecordingPaths recording_paths(const std::string& name) {
  const std::string stem = stem_of(name);
  return {stem + std::string(kIndexSuffix), stem + ".particles.vtkhdf", stem + ".skin.vtkhdf", stem + ".blade.vtkhdf"};
}

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
  hdf5::Id cluster_group;
  ClusterTables clusters;
  PolyDataFile particles, skin, blade;
  hdf5::Table<int32_t> particle_table, cluster_table, owner_table;
  hdf5::Table<Vec3> velocity_table;
  hdf5::Table<uint8_t> alive_table, direction_table;

  SnapshotColumns snapshots;
  ClusterSetColumns sets;
  Latest<Vec3> x, v, skin_position, blade_points;
  Latest<uint8_t> alive, degenerate, direction;
  Latest<int32_t> cluster_of, owner;
  Latest<Mat3> rotation;
  Clusters latest_clusters;
  std::vector<std::array<int32_t, 3>> triangles;
  PolyDataFile::Part body_part = PolyDataFile::kNothing, skin_part = PolyDataFile::kNothing,
                     blade_part = PolyDataFile::kNothing;
  std::vector<PolyDataFile::Step> particle_steps, skin_steps, blade_steps;
  std::optional<int64_t> step_frames;  // frames_done of the last step

 private:
  int64_t store_cluster_set(const Clusters& now);
  void store_skin(const Skin& now);
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
  digest.add(scene_json.data(), scene_json.size());
  digest.add(backend.data(), backend.size());
  hdf5::write_text_attribute(index.id(), "backend", backend);
  hdf5::write_table(index.id(), "scene", std::vector<uint8_t>(scene_json.begin(), scene_json.end()));
  write_setup(index.id(), setup);

  cluster_group = hdf5::create_group(index.id(), "clusters");
  for_each_table(clusters, [&]<class T>(const char* table_name, hdf5::Table<T>& table) {
    table = hdf5::Table<T>::create(cluster_group.get(), table_name);
  });
  particle_table = particles.make_point_data<int32_t>("particle");
  alive_table = particles.make_point_data<uint8_t>("alive");
  velocity_table = particles.make_point_data<Vec3>("velocity");
  cluster_table = particles.make_point_data<int32_t>("cluster");
  owner_table = skin.make_point_data<int32_t>("owner");
  direction_table = skin.make_point_data<uint8_t>("direction");

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
    particle_table.append(ids);
    body_part = particles.add_part(n, vertex_offsets, vertices);
  }
}

int64_t Recorder::File::store_cluster_set(const Clusters& now) {
  const Clusters& old = latest_clusters;
  const bool changed = sets.clusters.empty() || !same_bits(old.offsets, now.offsets) ||
                       !same_bits(old.members, now.members) || !same_bits(old.number, now.number) ||
                       !same_bits(old.rest_center, now.rest_center) || !same_bits(old.mass, now.mass);
  if (changed) {
    digest.add(now.offsets);
    digest.add(now.members);
    digest.add(now.number);
    digest.add(now.rest_center);
    digest.add(now.mass);
    sets.clusters.push_back(static_cast<int64_t>(now.number.size()));
    sets.members.push_back(static_cast<int64_t>(now.members.size()));
    sets.offset_row.push_back(clusters.offsets.append(now.offsets));
    sets.member_row.push_back(clusters.members.append(now.members));
    sets.cluster_row.push_back(clusters.number.append(now.number));
    clusters.rest_center.append(now.rest_center);
    clusters.mass.append(now.mass);
    latest_clusters.offsets = now.offsets;
    latest_clusters.members = now.members;
    latest_clusters.number = now.number;
    latest_clusters.rest_center = now.rest_center;
    latest_clusters.mass = now.mass;
  }
  return static_cast<int64_t>(sets.clusters.size()) - 1;
}

void Recorder::File::store_skin(const Skin& now) {
  const bool changed = !owner.stored || !same_bits(owner.values, now.owner) ||
                       !same_bits(direction.values, now.direction) || !same_bits(triangles, now.triangles);
  store(owner_table, owner, now.owner, digest, changed);
  store(direction_table, direction, now.direction, digest, changed);
  // Positions are written anew with new triangles: VTK takes equal points for an equal mesh.
  store(skin.points(), skin_position, now.position, digest, changed);
  if (changed) {
    digest.add(now.triangles);
    triangles = now.triangles;
    skin_part = PolyDataFile::kNothing;
    if (!now.owner.empty() || !now.triangles.empty()) {
      std::vector<int64_t> offsets = {0}, connectivity;
      for (const auto& triangle : now.triangles) {
        connectivity.insert(connectivity.end(), triangle.begin(), triangle.end());
        offsets.push_back(static_cast<int64_t>(connectivity.size()));
      }
      skin_part = skin.add_part(static_cast<int64_t>(now.owner.size()), offsets, connectivity);
    }
  }
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
  step.point_row =
      store(blade.points(), blade_points, blade_corners(setup.blade, last < 0 ? move.from : move.to), digest);
  return step;
}

void Recorder::File::add(Stage stage, const State& state) {
  SnapshotColumns& s = snapshots;
  s.frame.push_back(state.frame);
  s.stage.push_back(static_cast<uint8_t>(stage));
  s.edge_covered.push_back(state.edge_covered);
  s.tau.push_back(state.tau);
  s.cap.push_back(state.cap);
  s.impulse.push_back(state.impulse);
  s.position_row.push_back(store(particles.points(), x, state.x, digest));
  s.velocity_row.push_back(store(velocity_table, v, state.v, digest));
  s.alive_row.push_back(store(alive_table, alive, state.alive, digest));
  s.removed.insert(s.removed.end(), state.removed.begin(), state.removed.end());
  s.removed_offsets.push_back(static_cast<int64_t>(s.removed.size()));
  s.debris.insert(s.debris.end(), state.debris.begin(), state.debris.end());
  s.debris_offsets.push_back(static_cast<int64_t>(s.debris.size()));
  s.cluster_set.push_back(store_cluster_set(state.clusters));
  s.rotation_row.push_back(store(clusters.rotation, rotation, state.clusters.rotation, digest));
  s.degenerate_row.push_back(store(clusters.degenerate, degenerate, state.clusters.degenerate, digest));
  store_skin(state.skin);
  s.skin_vertices.push_back(static_cast<int64_t>(state.skin.owner.size()));
  s.skin_triangles.push_back(static_cast<int64_t>(state.skin.triangles.size()));
  s.skin_owner_row.push_back(owner.row);
  s.skin_direction_row.push_back(direction.row);
  s.skin_position_row.push_back(skin_position.row);
  s.skin_triangle_row.push_back(skin_part == PolyDataFile::kNothing ? 0 : skin.first_connectivity(skin_part) / 3);

  // ParaView sees one step per frame: a later snapshot of a frame takes the place of an earlier one.
  const int64_t frames = frames_done(stage, state.frame);
  if (step_frames == frames) {
    particle_steps.pop_back();
    skin_steps.pop_back();
    blade_steps.pop_back();
  }
  step_frames = frames;
  const double seconds = time_at(frames);
  const int64_t cluster_of_row =
      store(cluster_table, cluster_of, cluster_of_particles(state.clusters, state.x.size()), digest);
  particle_steps.push_back({seconds, body_part, x.row, {0, alive.row, v.row, cluster_of_row}});
  skin_steps.push_back({seconds, skin_part, skin_position.row, {owner.row, direction.row}});
  blade_steps.push_back(blade_step(frames, seconds));
}

void Recorder::File::finish() {
  {
    WritingArchive root(index.id());
    root.group("snapshots", [&](auto& archive) { walk(archive, snapshots); });
    root.value("unit_roundoff", unit_roundoff(precision.value_or(Precision::binary64)));
    WritingArchive inner(cluster_group.get());
    inner.group("sets", [&](auto& archive) { walk_sets(archive, sets); });
  }
  const std::pair<hid_t, const char*> kinds[] = {{index.id(), kIndexKind},
                                                 {particles.file().id(), kParticlesKind},
                                                 {skin.file().id(), kSkinKind},
                                                 {blade.file().id(), kBladeKind}};
  for (const auto& [file, kind] : kinds) {
    hdf5::write_text_attribute(file, "cutproof_file", kind);
    hdf5::write_attribute(file, "cutproof_format", kFormatVersion);
    hdf5::write_attribute(file, "cutproof_recording", digest.value());
  }
  for_each_table(clusters, [](const char*, auto& table) { table.close(); });
  particle_table.close();
  alive_table.close();
  velocity_table.close();
  cluster_table.close();
  owner_table.close();
  direction_table.close();
  cluster_group = {};
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
                                   file_->snapshots.frame.size() - 1, error.where(), error.what()));
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

// --- Reading ---

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

void require_blocks(const std::string& field, const std::vector<int64_t>& first, int64_t count, int64_t rows) {
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (!fits(first[i], count, rows)) {
      throw hdf5::Error(field, fmt::format("Entry {} is {}: {} rows from there are not among the {} that are stored.",
                                           i, first[i], count, rows));
    }
  }
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

}  // namespace

struct RecordingReader::File {
  explicit File(const std::string& name);
  Snapshot snapshot(std::size_t i) const;

  RecordingPaths paths;
  Recording header;

 private:
  void check_ranges() const;

  hdf5::File index, particles, skin;
  SnapshotColumns snapshots;
  ClusterSetColumns sets;
  ClusterTables clusters;
  hdf5::Table<Vec3> positions, velocities, skin_positions;
  hdf5::Table<uint8_t> alive, direction;
  hdf5::Table<int32_t> owner;
  hdf5::Table<int64_t> triangles;

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
    root.group("snapshots", [&](auto& archive) { walk(archive, snapshots); });
    root.group("clusters", [&](auto& archive) {
      archive.group("sets", [&](auto& inner) { walk_sets(inner, sets); });
      for_each_table(clusters, [&](const char* table, auto& opened) { archive.table(table, opened); });
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
    archive.group("VTKHDF", [&](auto& a) {
      a.table("Points", positions);
      a.group("PointData", [&](auto& data) {
        data.table("velocity", velocities);
        data.table("alive", alive);
      });
    });
  });
  reading(paths.skin, [&] {
    const ReadingArchive archive(skin.id(), "", skin.bytes());
    same_recording(paths.skin, archive);
    archive.group("VTKHDF", [&](auto& a) {
      a.table("Points", skin_positions);
      a.group("PointData", [&](auto& data) {
        data.table("owner", owner);
        data.table("direction", direction);
      });
      a.group("Polygons", [&](auto& polygons) { polygons.table("Connectivity", triangles); });
    });
  });
  reading(paths.index, [&] { check_ranges(); });
  header.snapshot_count = static_cast<int64_t>(snapshots.frame.size());
}

void RecordingReader::File::check_ranges() const {
  const SnapshotColumns& s = snapshots;
  const std::size_t count = s.frame.size();
  const std::string at = "/snapshots/";
  require_length(at + "stage", s.stage, count);
  require_length(at + "edge_covered", s.edge_covered, count);
  require_length(at + "tau", s.tau, count);
  require_length(at + "cap", s.cap, count);
  require_length(at + "impulse", s.impulse, count);
  require_length(at + "position_row", s.position_row, count);
  require_length(at + "velocity_row", s.velocity_row, count);
  require_length(at + "alive_row", s.alive_row, count);
  require_offsets(at + "removed_offsets", s.removed_offsets, count, s.removed.size());
  require_offsets(at + "debris_offsets", s.debris_offsets, count, s.debris.size());
  require_length(at + "cluster_set", s.cluster_set, count);
  require_length(at + "rotation_row", s.rotation_row, count);
  require_length(at + "degenerate_row", s.degenerate_row, count);
  require_length(at + "skin_vertices", s.skin_vertices, count);
  require_length(at + "skin_triangles", s.skin_triangles, count);
  require_length(at + "skin_owner_row", s.skin_owner_row, count);
  require_length(at + "skin_direction_row", s.skin_direction_row, count);
  require_length(at + "skin_position_row", s.skin_position_row, count);
  require_length(at + "skin_triangle_row", s.skin_triangle_row, count);
  if (!std::all_of(s.stage.begin(), s.stage.end(), [](uint8_t stage) { return stage < kStages.size(); })) {
    throw hdf5::Error(at + "stage", "A stage is not one of 0 (step) to 5 (skin).");
  }
  if (!std::all_of(s.edge_covered.begin(), s.edge_covered.end(), [](uint8_t flag) { return flag <= 1; })) {
    throw hdf5::Error(at + "edge_covered", "These should be 0 or 1.");
  }

  const ClusterSetColumns& c = sets;
  const std::size_t set_count = c.clusters.size();
  const std::string in = "/clusters/sets/";
  require_length(in + "members", c.members, set_count);
  require_length(in + "offset_row", c.offset_row, set_count);
  require_length(in + "member_row", c.member_row, set_count);
  require_length(in + "cluster_row", c.cluster_row, set_count);
  std::vector<int64_t> offset_counts;
  for (const int64_t m : c.clusters) {
    offset_counts.push_back(m == std::numeric_limits<int64_t>::max() ? m : m + 1);
  }
  require_blocks(in + "offset_row", c.offset_row, offset_counts, clusters.offsets.rows());
  require_blocks(in + "member_row", c.member_row, c.members, clusters.members.rows());
  const int64_t cluster_rows = std::min({clusters.number.rows(), clusters.rest_center.rows(), clusters.mass.rows()});
  require_blocks(in + "cluster_row", c.cluster_row, c.clusters, cluster_rows);

  require_blocks(at + "cluster_set", s.cluster_set, 1, static_cast<int64_t>(set_count));
  std::vector<int64_t> cluster_counts, corner_counts, corner_rows;
  for (std::size_t i = 0; i < count; ++i) {
    cluster_counts.push_back(c.clusters[static_cast<std::size_t>(s.cluster_set[i])]);
  }
  require_blocks(at + "rotation_row", s.rotation_row, cluster_counts, clusters.rotation.rows());
  require_blocks(at + "degenerate_row", s.degenerate_row, cluster_counts, clusters.degenerate.rows());
  const int64_t n = header.setup.body.particle_count();
  require_blocks(at + "position_row", s.position_row, n, positions.rows());
  require_blocks(at + "velocity_row", s.velocity_row, n, velocities.rows());
  require_blocks(at + "alive_row", s.alive_row, n, alive.rows());
  require_blocks(at + "skin_owner_row", s.skin_owner_row, s.skin_vertices, owner.rows());
  require_blocks(at + "skin_direction_row", s.skin_direction_row, s.skin_vertices, direction.rows());
  require_blocks(at + "skin_position_row", s.skin_position_row, s.skin_vertices, skin_positions.rows());
  require_blocks(at + "skin_triangle_row", s.skin_triangle_row, s.skin_triangles, triangles.rows() / 3);
}

Snapshot RecordingReader::File::snapshot(std::size_t i) const {
  const SnapshotColumns& s = snapshots;
  const auto part_of = [i](const std::vector<int32_t>& values, const std::vector<int64_t>& offsets) {
    return std::vector<int32_t>(values.begin() + offsets[i], values.begin() + offsets[i + 1]);
  };
  Snapshot snapshot;
  snapshot.stage = static_cast<Stage>(s.stage[i]);
  State& state = snapshot.state;
  state.frame = s.frame[i];
  state.precision = header.precision;
  state.tau = s.tau[i];
  state.cap = s.cap[i];
  state.edge_covered = s.edge_covered[i] == 1;
  state.impulse = s.impulse[i];
  state.removed = part_of(s.removed, s.removed_offsets);
  state.debris = part_of(s.debris, s.debris_offsets);
  const int64_t n = header.setup.body.particle_count();
  reading(paths.particles, [&] {
    state.x = positions.read(s.position_row[i], n);
    state.v = velocities.read(s.velocity_row[i], n);
    state.alive = alive.read(s.alive_row[i], n);
  });
  reading(paths.index, [&] {
    const auto set = static_cast<std::size_t>(s.cluster_set[i]);
    const int64_t count = sets.clusters[set];
    state.clusters.offsets = clusters.offsets.read(sets.offset_row[set], count + 1);
    state.clusters.members = clusters.members.read(sets.member_row[set], sets.members[set]);
    state.clusters.number = clusters.number.read(sets.cluster_row[set], count);
    state.clusters.rest_center = clusters.rest_center.read(sets.cluster_row[set], count);
    state.clusters.mass = clusters.mass.read(sets.cluster_row[set], count);
    state.clusters.rotation = clusters.rotation.read(s.rotation_row[i], count);
    state.clusters.degenerate = clusters.degenerate.read(s.degenerate_row[i], count);
  });
  reading(paths.skin, [&] {
    state.skin.owner = owner.read(s.skin_owner_row[i], s.skin_vertices[i]);
    state.skin.direction = direction.read(s.skin_direction_row[i], s.skin_vertices[i]);
    state.skin.position = skin_positions.read(s.skin_position_row[i], s.skin_vertices[i]);
    const std::vector<int64_t> corners = triangles.read(3 * s.skin_triangle_row[i], 3 * s.skin_triangles[i]);
    state.skin.triangles.resize(corners.size() / 3);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      if (corners[k] != static_cast<int32_t>(corners[k])) {
        throw hdf5::Error("/VTKHDF/Polygons/Connectivity",
                          fmt::format("Snapshot {} has a corner {}, which no 32-bit number holds.", i, corners[k]));
      }
      state.skin.triangles[k / 3][k % 3] = static_cast<int32_t>(corners[k]);
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
