#include "model/io/recording.h"

#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/resource.h>

#include <bit>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "model/bare_graph.h"
#include "model/coordinates.h"
#include "model/error.h"
#include "model/io/container_types.h"
#include "model/io/hdf5_file.h"
#include "model/io/recording_format.h"
#include "model/io/recording_setup.h"
#include "tests/model/recording_bits.h"

namespace cutproof::io::recording_test {
namespace {

namespace fs = std::filesystem;

// --- Setups and states made by hand ---

// A block of nx × ny × nz nodes with a ring of empty nodes around it, 3 frames of 2 substeps.
Setup block_setup(int32_t nx, int32_t ny, int32_t nz) {
  Setup setup;
  Body& body = setup.body;
  body.name = "block";
  body.grid = {{nx + 2, ny + 2, nz + 2}, 0.1};
  body.particle_at.assign(static_cast<std::size_t>(body.grid.node_count()), -1);
  for (int32_t k = 1; k <= nz; ++k) {
    for (int32_t j = 1; j <= ny; ++j) {
      for (int32_t i = 1; i <= nx; ++i) {
        const int64_t node = body.grid.index(i, j, k);
        body.particle_at[static_cast<std::size_t>(node)] = static_cast<int32_t>(body.node.size());
        body.node.push_back(node);
        body.mass.push_back(1.0 + 0.1 * i);
      }
    }
  }
  body.origin = {1e6, -2, 1.0 / 3};
  body.orientation = {{0, -1, 0, 1, 0, 0, 0, 0, 1}};
  setup.step.substeps = 2;
  setup.step.acceleration = Acceleration::chebyshev;
  setup.step.retardation = 0.003;
  setup.step.volume_share = 0.3;
  setup.substep_length = {0.004, 0.005, 0.1 / 3};
  setup.stroke_end = {1, -1};
  return setup;
}

// A blade that is up in frame 0, comes down in frame 1 and is up again in frame 2; walls; a pinned and a moving grip.
void add_surroundings(Setup& setup) {
  setup.step = {Solver::published, 2, 7, 1e-310, 0, 0.3, Acceleration::none, -0.0, 0, {0, 0, -9.81}};
  setup.detect = {Criterion::strain, RemovedEnds::both, 1.5000000000000002, 1.2, true};
  setup.split.debris = 3;
  setup.merge.rule = MergeRule::published;
  setup.expand = {ExpandRule::published, 2};
  setup.skin = {true, 0.25};
  Body& body = setup.body;
  body.surface_crossing.resize(6 * body.node.size());
  for (std::size_t k = 0; k < body.surface_crossing.size(); ++k) {
    const bool leaves = body.neighbour(static_cast<int32_t>(k / 6), static_cast<int>(k % 6)) < 0;
    if (leaves) body.surface_crossing[k] = static_cast<uint8_t>(kLeastCrossing + k % 225);
  }
  setup.walls = {{2, +1, 0.1, 0.3}, {0, -1, 2, 0}};
  setup.grips = {{{0, 2}, {1, 1, 1, 0, 0, 0}, std::vector<Vec3>(6)},
                 {{1}, {0, 0, 1, 1, 1, 1}, std::vector<Vec3>(6, {0, 0, 1e-3})}};
  setup.has_blade = true;
  setup.blade = {0.5, 0.4, 0.02, 0.1};
  for (int substep = 0; substep < 6; ++substep) {
    const bool down = substep == 2 || substep == 3;
    BladePose from, to;
    from.edge = {0.1 * substep, 0.2, 0.3};
    to.edge = {0.1 * (substep + 1), 0.2, 0.3};
    setup.blade_moves.push_back({from, to, down, down ? 0 : -1});
  }
}

void add_cluster(Clusters& clusters, const std::vector<int32_t>& members) {
  clusters.members.insert(clusters.members.end(), members.begin(), members.end());
  clusters.number.push_back(clusters.count());
  clusters.offsets.push_back(static_cast<int64_t>(clusters.members.size()));
  clusters.rotation.push_back({});
  clusters.rest_center.push_back({0.1 * static_cast<double>(members.size()), 0, 0});
  clusters.mass.push_back(static_cast<double>(members.size()));
  clusters.degenerate.push_back(0);
}

State rest_state(const Setup& setup) {
  State state;
  const int32_t n = setup.body.particle_count();
  for (int32_t i = 0; i < n; ++i) state.x.push_back(setup.body.rest_position(i));
  state.v.resize(static_cast<std::size_t>(n));
  state.alive.assign(static_cast<std::size_t>(n), 1);
  std::vector<int32_t> first, second;
  for (int32_t i = 0; i < n; ++i) {
    if (i <= n / 2) first.push_back(i);
    if (i >= n / 2) second.push_back(i);
  }
  if (!first.empty()) add_cluster(state.clusters, first);
  if (!second.empty()) add_cluster(state.clusters, second);
  state.tau = 2;
  state.cap = 9;
  state.edge_covered = true;
  return state;
}

// Not a true skin, but an array of the right kind: one triangle at each of the first `count` particles.
Skin some_skin(const State& state, int32_t count) {
  Skin skin;
  for (int32_t i = 0; i < count; ++i) {
    for (uint8_t direction = 0; direction < 3; ++direction) {
      skin.owner.push_back(i);
      skin.direction.push_back(static_cast<uint8_t>(2 * direction));
      skin.reach.push_back(0.25 + 0.125 * direction);
      Vec3 p = state.x[static_cast<std::size_t>(i)];
      p[direction] += 0.05;
      skin.position.push_back(p);
    }
    skin.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return skin;
}

// What a run of three frames records: the state as loaded (without skin), a frame that removes nothing, one that
// removes two particles (four snapshots), one in which everything moves.
std::vector<Snapshot> scripted_run(const Setup& setup) {
  std::vector<Snapshot> snapshots;
  State state = rest_state(setup);
  const auto record = [&](Stage stage) { snapshots.push_back({stage, state}); };
  const auto move = [&] {
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      state.x[i] += Vec3{1e-3 * static_cast<double>(i + 1), -1e-4, 1.0 / 3};
      state.v[i] = {0.1 * static_cast<double>(i), -0.0, 1e-320};
    }
    for (Mat3& r : state.clusters.rotation) r.m[1] += 0.125;
    state.impulse += Vec3{1e-9, 0, -1};
    state.removed.clear();
    state.debris.clear();
  };
  record(Stage::skin);

  move();
  state.skin = some_skin(state, 4);
  state.frame = 1;
  record(Stage::skin);

  move();
  state.alive[0] = state.alive[3] = 0;
  state.removed = {0, 3};
  record(Stage::detect);
  Clusters split;
  add_cluster(split, {1, 2, 4});
  add_cluster(split, {4, 5, 6});
  add_cluster(split, {6, 7});
  state.clusters = split;
  state.debris = {7};
  state.alive[7] = 0;
  record(Stage::split);
  record(Stage::merge);
  state.skin = some_skin(state, 6);
  state.frame = 2;
  record(Stage::skin);

  move();
  state.skin = some_skin(state, 6);
  state.frame = 3;
  record(Stage::skin);
  return snapshots;
}

// --- Files ---

class RecordingTest : public testing::Test {
 protected:
  using Setup = cutproof::Setup;  // and not testing::Test::Setup, which is there to catch misspellings

  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "cutproof_recording_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  std::size_t file_count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  // A whole recording of the scripted run under `name`.
  std::vector<Snapshot> record(const std::string& name, double shift = 0) const {
    Setup setup = block_setup(2, 2, 2);
    add_surroundings(setup);
    std::vector<Snapshot> snapshots = scripted_run(setup);
    for (Snapshot& snapshot : snapshots) snapshot.state.x[0].x += shift;
    write(name, setup, snapshots);
    return snapshots;
  }

  void write(const std::string& name, const Setup& setup, const std::vector<Snapshot>& snapshots) const {
    Recorder recorder(path(name), setup, "{\"version\": 1}", "reference");
    for (const Snapshot& snapshot : snapshots) recorder.add(snapshot.stage, snapshot.state);
    recorder.finish();
  }

  fs::path folder_;
};

std::string read_bytes(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// Everything that can be read of a recording, as bits; throws what the reader throws.
std::string read_everything(const std::string& name) {
  const RecordingReader reader(name);
  std::string bits = bits_of(reader.header().setup) + reader.header().scene_json + reader.header().backend;
  for (int64_t i = 0; i < reader.header().snapshot_count; ++i) bits += bits_of(reader.snapshot(i));
  return bits;
}

// Runs `action`, which must throw an InputError that names `file` and `field` and a remedy.
void expect_input_error(const std::function<void()>& action, const std::string& file, const std::string& field) {
  try {
    action();
    ADD_FAILURE() << "no InputError for " << file << " " << field;
  } catch (const InputError& error) {
    const std::string what = error.what();
    EXPECT_EQ(error.file(), file) << what;
    EXPECT_NE(what.find(field), std::string::npos) << what << "\nshould name " << field;
    EXPECT_NE(what.find("remedy: "), std::string::npos) << what;
  }
}

// Opens a file of a recording for tampering and hands it to `change`.
void tamper(const std::string& file, const std::function<void(hid_t)>& change) {
  const hdf5::Id id(H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose, file);
  change(id.get());
}

template <class T>
hid_t native();
template <>
hid_t native<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
hid_t native<int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
hid_t native<int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
hid_t native<uint8_t>() {
  return H5T_NATIVE_UINT8;
}

// Overwrites one scalar of a dataset, counted through all its dimensions.
template <class T>
void set_entry(hid_t file, const std::string& name, std::size_t index, T value) {
  const hdf5::Id dataset(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose, name);
  const hdf5::Id space(H5Dget_space(dataset.get()), H5Sclose, name);
  std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get())));
  ASSERT_LT(index, values.size()) << name;
  ASSERT_GE(H5Dread(dataset.get(), native<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  values[index] = value;
  ASSERT_GE(H5Dwrite(dataset.get(), native<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
}

template <class T>
void set_attribute(hid_t file, const std::string& object, const std::string& name, T value) {
  const hdf5::Id parent(H5Oopen(file, object.c_str(), H5P_DEFAULT), H5Oclose, object);
  const hdf5::Id attribute(H5Aopen(parent.get(), name.c_str(), H5P_DEFAULT), H5Aclose, name);
  ASSERT_GE(H5Awrite(attribute.get(), native<T>(), &value), 0);
}

int64_t stored_rows(const std::string& file, const std::string& name) {
  const hdf5::Id id(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, file);
  const hdf5::Id dataset(H5Dopen2(id.get(), name.c_str(), H5P_DEFAULT), H5Dclose, name);
  const hdf5::Id space(H5Dget_space(dataset.get()), H5Sclose, name);
  std::vector<hsize_t> dims(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space.get())));
  H5Sget_simple_extent_dims(space.get(), dims.data(), nullptr);
  return static_cast<int64_t>(dims[0]);
}

// --- What goes in comes out ---

TEST_F(RecordingTest, GivesBackEverySnapshotBitForBit) {
  const std::vector<Snapshot> snapshots = record("run");
  const RecordingReader reader(path("run"));
  ASSERT_EQ(reader.header().snapshot_count, static_cast<int64_t>(snapshots.size()));
  EXPECT_EQ(reader.header().scene_json, "{\"version\": 1}");
  EXPECT_EQ(reader.header().backend, "reference");
  for (std::size_t i = 0; i < snapshots.size(); ++i) {
    EXPECT_TRUE(bits_of(reader.snapshot(static_cast<int64_t>(i))) == bits_of(snapshots[i])) << "snapshot " << i;
  }
  // In any order.
  EXPECT_TRUE(bits_of(reader.snapshot(0)) == bits_of(snapshots[0]));
  EXPECT_THROW(reader.snapshot(-1), std::out_of_range);
  EXPECT_THROW(reader.snapshot(static_cast<int64_t>(snapshots.size())), std::out_of_range);
}

TEST_F(RecordingTest, GivesBackTheSetupBitForBit) {
  for (const bool with_surroundings : {false, true}) {
    Setup setup = block_setup(3, 2, 2);
    if (with_surroundings) add_surroundings(setup);
    setup.body.name = "Niere, linke — größer";
    write("run", setup, {});
    const RecordingReader reader(path("run"));
    EXPECT_TRUE(bits_of(reader.header().setup) == bits_of(setup));
    EXPECT_EQ(reader.header().setup.body.name, setup.body.name);
    EXPECT_EQ(reader.header().setup.walls, setup.walls);
    EXPECT_EQ(reader.header().setup.grips, setup.grips);
    EXPECT_EQ(reader.header().setup.blade_moves, setup.blade_moves);
  }
}

// Changes a value by as little as its type can show.
template <class T>
void change_a_little(T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    value = !value;
  } else if constexpr (std::is_same_v<T, std::string>) {
    value += '2';
  } else if constexpr (NamedChoice<T>) {
    value = static_cast<T>((static_cast<std::size_t>(value) + 1) % names_of(value).size());
  } else if constexpr (std::is_integral_v<T>) {
    value = static_cast<T>(value ^ 1);
  } else {
    static_assert(std::is_same_v<T, double>);
    value = std::bit_cast<double>(std::bit_cast<uint64_t>(value) ^ 1);
  }
}

// Calls check(changed) with each number of the value changed alone; of lists the first and the last entry, and the
// length. `whole` is what the value is a part of.
template <class Whole, class T, class Check>
void change_each(const Whole& whole, T& value, const Check& check) {
  const auto each_of = [&](auto& numbers) {
    for (auto& number : numbers) change_each(whole, number, check);
  };
  if constexpr (is_list_of_entries<T>) {
    for (std::size_t entry : {std::size_t{0}, value.size() - 1}) {
      for_each_entry_field<typename T::value_type>(
          [&](const SetupField&, auto get) { change_each(whole, get(value[entry]), check); });
    }
  } else if constexpr (is_vector<T>) {
    for (auto* entry : {&value.front(), &value.back()}) change_each(whole, *entry, check);
    const T before = value;
    value.push_back(value.back());
    check(whole);
    value = before;
  } else if constexpr (std::is_same_v<T, Vec3>) {
    for (double* number : {&value.x, &value.y, &value.z}) change_each(whole, *number, check);
  } else if constexpr (std::is_same_v<T, Mat3>) {
    each_of(value.m);
  } else if constexpr (std::is_class_v<T> && !std::is_same_v<T, std::string>) {  // std::array
    each_of(value);
  } else {
    const T before = value;
    change_a_little(value);
    check(whole);
    value = before;
  }
}

// Not through a recorder, which refuses setups whose parts do not fit together.
TEST_F(RecordingTest, GivesBackEachFieldOfASetupThatChangedAlone) {
  Setup base = block_setup(2, 2, 2);
  add_surroundings(base);
  const auto recorded = [&](const Setup& setup) {
    hdf5::File file = hdf5::File::create(path("setup.h5"));
    write_setup(file.id(), setup);
    file.close();
    const hdf5::File opened = hdf5::File::open(path("setup.h5"));
    hdf5::InflationBudget budget(opened.bytes());
    return bits_of(read_setup(opened.id(), budget));
  };
  // No body has both a grid and edges of its own, but each field is kept for itself.
  const Body bare = as_bare_graph(base.body);
  base.body.rest = bare.rest;
  base.body.edge_offsets = bare.edge_offsets;
  base.body.edge_ends = bare.edge_ends;
  const std::string before = bits_of(base);
  ASSERT_TRUE(recorded(base) == before);
  std::size_t fields = 0, changes = 0;
  Setup setup = base;
  for_each_setup_field([&](const SetupField& field, auto get) {
    ++fields;
    if constexpr (requires { get(setup).size(); }) {
      ASSERT_FALSE(get(setup).empty()) << field.group << "/" << field.name << ": there is nothing to change";
    }
    change_each(setup, get(setup), [&](const Setup& changed) {
      ++changes;
      const std::string bits = bits_of(changed);
      EXPECT_TRUE(bits != before) << field.group << "/" << field.name << ": change " << changes << " is none";
      EXPECT_TRUE(recorded(changed) == bits) << field.group << "/" << field.name << ", change " << changes;
    });
  });
  EXPECT_TRUE(bits_of(setup) == before);
  EXPECT_GT(changes, 3 * fields);
}

// A recording says once in which precision all of its states were computed.
TEST_F(RecordingTest, GivesBackThePrecisionOfItsStates) {
  const Setup setup = block_setup(2, 1, 1);
  State state = rest_state(setup);
  for (const Precision precision : {Precision::binary32, Precision::binary64}) {
    state.precision = precision;
    write("run", setup, {{Stage::skin, state}, {Stage::step, state}});
    const RecordingReader reader(path("run"));
    EXPECT_EQ(reader.header().precision, precision);
    for (const int64_t i : {0, 1}) EXPECT_EQ(reader.snapshot(i).state.precision, precision);
  }
  Recorder recorder(path("run"), setup, "{}", "reference");
  recorder.add(Stage::skin, state);
  state.precision = Precision::binary32;
  // What its coordinates round follows from them, where it says that places were kept so.
  state.place_rounding = rounding_of_coordinates(setup.body, state);
  EXPECT_GT(state.place_rounding, 0);
  State farther = state;
  farther.x[0] = 100 * farther.x[0];
  farther.place_rounding = rounding_of_coordinates(setup.body, farther);
  EXPECT_GT(farther.place_rounding, 10 * state.place_rounding);
  write("absolute", setup, {{Stage::skin, state}, {Stage::step, farther}});
  const RecordingReader absolute(path("absolute"));
  EXPECT_EQ(absolute.snapshot(0).state.place_rounding, state.place_rounding);
  EXPECT_EQ(absolute.snapshot(1).state.place_rounding, farther.place_rounding);
  EXPECT_THROW(recorder.add(Stage::step, state), std::invalid_argument);
}

TEST_F(RecordingTest, KeepsThePayloadOfNanAndTheSignOfZero) {
  const Setup setup = block_setup(2, 1, 1);
  State state = rest_state(setup);
  const auto quiet = std::bit_cast<double>(0x7ff8dead'beef0001u);
  const auto signalling = std::bit_cast<double>(0xfff00000'00000001u);
  state.x[0] = {quiet, signalling, -0.0};
  state.v[1] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::denorm_min(), -quiet};
  state.clusters.rotation[0].m[4] = signalling;
  state.clusters.rest_center[0].z = quiet;
  state.clusters.mass[0] = signalling;
  state.impulse.y = quiet;
  state.skin = some_skin(state, 1);
  // The second differs from the first in one bit that == does not see.
  State other = state;
  other.x[0].z = 0.0;
  const std::vector<Snapshot> snapshots = {{Stage::skin, state}, {Stage::step, other}};
  write("run", setup, snapshots);
  const RecordingReader reader(path("run"));
  EXPECT_TRUE(bits_of(reader.snapshot(0)) == bits_of(snapshots[0]));
  EXPECT_TRUE(bits_of(reader.snapshot(1)) == bits_of(snapshots[1]));
}

TEST_F(RecordingTest, KeepsBrokenClustersAndSkinForTheOraclesToJudge) {
  const Setup setup = block_setup(2, 2, 1);
  State state = rest_state(setup);
  state.clusters.offsets = {0, 1 << 20, -7};
  state.clusters.members = {-1, 99, 99, 0};
  state.clusters.number = {5, 5};
  state.alive[1] = 17;
  state.removed = {-3, 1000, 2};
  state.frame = std::numeric_limits<int64_t>::max();
  state.skin = some_skin(state, 1);
  state.skin.owner[0] = -4;
  state.skin.direction[0] = 200;
  state.skin.triangles[0] = {-1, std::numeric_limits<int32_t>::max(), std::numeric_limits<int32_t>::min()};
  const std::vector<Snapshot> snapshots = {{Stage::expand, state}};
  write("run", setup, snapshots);
  EXPECT_TRUE(bits_of(RecordingReader(path("run")).snapshot(0)) == bits_of(snapshots[0]));
}

TEST_F(RecordingTest, HoldsBodiesOfNoneAndOfOneParticle) {
  for (const int32_t count : {0, 1}) {
    const Setup setup = block_setup(count, count, count);
    ASSERT_EQ(setup.body.particle_count(), count);
    State state = rest_state(setup);
    std::vector<Snapshot> snapshots = {{Stage::skin, state}};
    state.frame = 1;
    if (count == 1) state.skin = some_skin(state, 1);
    snapshots.push_back({Stage::skin, state});
    state.skin = {};
    state.clusters = {};
    state.alive.assign(static_cast<std::size_t>(count), 0);
    snapshots.push_back({Stage::detect, state});
    write("run", setup, snapshots);
    const RecordingReader reader(path("run"));
    EXPECT_TRUE(bits_of(reader.header().setup) == bits_of(setup));
    for (std::size_t i = 0; i < snapshots.size(); ++i) {
      EXPECT_TRUE(bits_of(reader.snapshot(static_cast<int64_t>(i))) == bits_of(snapshots[i])) << i;
    }
  }
}

TEST_F(RecordingTest, OfNoSnapshotsIsStillARecording) {
  Recorder recorder(path("run"), block_setup(1, 1, 1), "", "");
  recorder.finish();
  const RecordingReader reader(path("run"));
  EXPECT_EQ(reader.header().snapshot_count, 0);
  EXPECT_EQ(reader.header().scene_json, "");
  EXPECT_EQ(reader.header().backend, "");
}

TEST_F(RecordingTest, StoresOnceWhatDidNotChange) {
  const Setup setup = block_setup(2, 2, 2);
  State state = rest_state(setup);
  state.skin = some_skin(state, 2);
  std::vector<Snapshot> snapshots;
  for (int i = 0; i < 50; ++i) {
    state.frame = i;
    snapshots.push_back({Stage::skin, state});
  }
  write("run", setup, snapshots);
  const RecordingPaths files = recording_paths(path("run"));
  EXPECT_EQ(stored_rows(files.particles, "/VTKHDF/Points"), 8);
  EXPECT_EQ(stored_rows(files.particles, "/VTKHDF/PointData/velocity"), 8);
  EXPECT_EQ(stored_rows(files.particles, "/VTKHDF/PointData/alive"), 8);
  EXPECT_EQ(stored_rows(files.skin, "/VTKHDF/Points"), 6);
  EXPECT_EQ(stored_rows(files.skin, "/VTKHDF/Polygons/Connectivity"), 6);
  EXPECT_EQ(stored_rows(files.index, "/clusters/number"), 2);
  EXPECT_EQ(stored_rows(files.index, "/clusters/rotation"), 2);
  EXPECT_EQ(stored_rows(files.index, "/snapshots/frame"), 50);

  // The scripted run: positions change three times, velocities once, the alive set twice, the clusters once.
  record("script");
  const RecordingPaths script = recording_paths(path("script"));
  EXPECT_EQ(stored_rows(script.particles, "/VTKHDF/Points"), 4 * 8);
  EXPECT_EQ(stored_rows(script.particles, "/VTKHDF/PointData/velocity"), 2 * 8);
  EXPECT_EQ(stored_rows(script.particles, "/VTKHDF/PointData/alive"), 3 * 8);
  EXPECT_EQ(stored_rows(script.index, "/clusters/number"), 2 + 3);
}

// Where the rows of a field lie, as docs/reference/recording.md says; nothing for what stands in columns.
std::optional<std::pair<std::string, std::string>> table_of(const RecordedField& recorded,
                                                            const RecordingPaths& files) {
  if (recorded.storage == Storage::cells) return {{files.skin, "/VTKHDF/Polygons/Connectivity"}};
  if (recorded.storage != Storage::rows) return std::nullopt;
  const IndexSpace space = recorded.field.space;
  if (space != IndexSpace::particle && space != IndexSpace::vertex)
    return {{files.index, "/clusters/" + recorded.name()}};
  const std::string place = recorded.is_points() ? "/VTKHDF/Points" : "/VTKHDF/PointData/" + recorded.name();
  return {{space == IndexSpace::particle ? files.particles : files.skin, place}};
}

// Each field in turn has one bit of one entry changed, and back again: the lowest and the highest bit of each number of
// the first and of the last entry. Whatever is compared by size, by ==, in part, or under another field's name, shows.
TEST_F(RecordingTest, GivesBackEachFieldThatChangedAloneAndStoresNoOtherAnew) {
  const Setup setup = block_setup(3, 2, 2);
  State base = rest_state(setup);
  for (std::size_t i = 0; i < base.v.size(); ++i) base.v[i] = {0.1, -0.2, 0.3 * static_cast<double>(i)};
  base.removed = {1, 4};
  base.debris = {5, 7, 9};
  base.skin = some_skin(base, 3);
  base.impulse = {1, 2, 3};

  std::vector<Snapshot> snapshots = {{Stage::skin, base}};
  const auto add = [&](const State& changed) {
    snapshots.push_back({Stage::skin, changed});
    snapshots.push_back({Stage::skin, base});
  };
  std::vector<int64_t> changes;  // [fields]
  for_each_field([&](const Field& field, auto get) {
    const std::size_t before = snapshots.size();
    const auto change_entry = [&](std::size_t entry) {
      State changed = base;
      auto* const bytes = [&] {
        if constexpr (requires { get(changed).data(); }) {
          return reinterpret_cast<unsigned char*>(&get(changed)[entry]);
        } else {
          return reinterpret_cast<unsigned char*>(&get(changed));
        }
      }();
      using T = std::remove_cvref_t<decltype(get(changed))>;
      using Entry = typename std::conditional_t<is_vector<T>, T, std::vector<T>>::value_type;
      const std::size_t numbers = [] {
        std::size_t count = 1;
        for (const hsize_t extent : hdf5::layout_of<Entry>().shape) count *= extent;
        return count;
      }();
      const std::size_t width = sizeof(Entry) / numbers;
      for (std::size_t number = 0; number < numbers; ++number) {
        for (const bool highest : {false, true}) {
          if (highest && std::is_same_v<Entry, bool>) continue;
          unsigned char& byte = bytes[number * width + (highest ? width - 1 : 0)];
          const unsigned char bit = highest ? 0x80 : 0x01;
          byte ^= bit;
          add(changed);
          byte ^= bit;
        }
      }
    };
    if constexpr (requires { get(base).size(); }) {
      ASSERT_FALSE(get(base).empty()) << field.name << ": there is nothing to change";
      change_entry(0);
      change_entry(get(base).size() - 1);
    } else {
      change_entry(0);
    }
    changes.push_back(static_cast<int64_t>(snapshots.size() - before) / 2);
  });
  ASSERT_EQ(changes.size(), recorded_fields().size());

  write("run", setup, snapshots);
  const RecordingReader reader(path("run"));
  ASSERT_EQ(reader.header().snapshot_count, static_cast<int64_t>(snapshots.size()));
  for (std::size_t i = 0; i < snapshots.size(); ++i) {
    const Snapshot read = reader.snapshot(static_cast<int64_t>(i));
    for_each_field([&](const Field& field, auto get) {
      EXPECT_TRUE(same_bits(get(read.state), get(snapshots[i].state))) << field.name << " of snapshot " << i;
    });
    ASSERT_FALSE(HasFailure());
    if (i % 2 == 1) {
      ASSERT_NE(parts_that_differ(base, read.state), 0u) << "snapshot " << i;
    }
  }

  // A change and the way back are two blocks more, of this field alone; of vertices all that is not a position and the
  // triangles belong to a mesh, which is written as a whole.
  const auto of_mesh = [](const RecordedField& recorded) {
    const IndexSpace space = recorded.field.space;
    return space == IndexSpace::triangle || (space == IndexSpace::vertex && !recorded.is_points());
  };
  int64_t meshes = 1;
  for (std::size_t k = 0; k < changes.size(); ++k) meshes += of_mesh(recorded_fields()[k]) ? 2 * changes[k] : 0;
  std::size_t tables = 0;
  for (std::size_t k = 0; k < changes.size(); ++k) {
    const RecordedField& recorded = recorded_fields()[k];
    const auto table = table_of(recorded, recording_paths(path("run")));
    if (!table) continue;
    ++tables;
    const bool on_skin = of_mesh(recorded) || recorded.field.space == IndexSpace::vertex;
    const int64_t blocks = (on_skin ? meshes : 1) + (of_mesh(recorded) ? 0 : 2 * changes[k]);
    const int64_t rows = count_of(recorded.field.space, base) * (recorded.storage == Storage::cells ? 3 : 1);
    EXPECT_EQ(stored_rows(table->first, table->second), blocks * rows) << recorded.name();
  }
  EXPECT_GE(tables, 14u);
}

// Lists of a length of their own: longer by one, and empty.
TEST_F(RecordingTest, GivesBackListsThatChangeTheirLengthAlone) {
  const Setup setup = block_setup(2, 2, 2);
  State base = rest_state(setup);
  base.removed = {1, 4};
  base.debris = {5, 7};
  std::vector<Snapshot> snapshots = {{Stage::split, base}};
  for_each_field([&](const Field& field, auto get) {
    if constexpr (requires { get(base).size(); }) {
      if (field.space != IndexSpace::state) return;
      for (const bool longer : {true, false}) {
        State changed = base;
        auto& list = get(changed);
        longer ? list.push_back(list.back()) : list.clear();
        snapshots.push_back({Stage::split, changed});
        snapshots.push_back({Stage::split, base});
      }
    }
  });
  ASSERT_EQ(snapshots.size(), 9u);
  write("run", setup, snapshots);
  const RecordingReader reader(path("run"));
  for (std::size_t i = 0; i < snapshots.size(); ++i) {
    EXPECT_TRUE(bits_of(reader.snapshot(static_cast<int64_t>(i))) == bits_of(snapshots[i])) << "snapshot " << i;
  }
}

// Particles, clusters, members, vertices and triangles beyond what 16 bits can number, each table in many chunks; and
// what changes lies beyond them too.
TEST_F(RecordingTest, HoldsMoreThan65536OfEverything) {
  constexpr int64_t kMany = 65536;
  const Setup setup = block_setup(41, 41, 40);
  State state = rest_state(setup);
  const int32_t n = setup.body.particle_count();
  ASSERT_GT(n, kMany);
  state.clusters = {};
  Clusters& clusters = state.clusters;
  for (int32_t i = 0; i < n; ++i) {
    clusters.members.push_back(i);
    clusters.number.push_back(i);
    clusters.offsets.push_back(i + 1);
    clusters.rest_center.push_back(setup.body.rest_position(i));
    clusters.mass.push_back(1 + 1e-3 * i);
    clusters.degenerate.push_back(static_cast<uint8_t>(i % 2));
    clusters.rotation.push_back({});
    clusters.rotation.back().m[5] = 1e-6 * i;
  }
  state.skin = some_skin(state, n);
  for (const IndexSpace space : {IndexSpace::particle, IndexSpace::cluster, IndexSpace::cluster_end, IndexSpace::member,
                                 IndexSpace::vertex, IndexSpace::triangle}) {
    ASSERT_GT(count_of(space, state), kMany);
  }
  std::vector<Snapshot> snapshots = {{Stage::skin, state}};
  state.removed = {1, 65535, 65536, n - 1};
  for (const int32_t i : state.removed) state.alive[static_cast<std::size_t>(i)] = 0;
  state.x[kMany].y += 1;
  state.v.back().z = 1;
  clusters.mass[kMany] = -0.0;
  clusters.members.back() = 65536;
  state.skin.triangles.back()[2] = 65537;
  state.skin.owner[kMany + 1] = 65536;
  snapshots.push_back({Stage::detect, state});
  write("run", setup, snapshots);

  const RecordingReader reader(path("run"));
  EXPECT_TRUE(bits_of(reader.header().setup) == bits_of(setup));
  for (std::size_t i = 0; i < snapshots.size(); ++i) {
    const Snapshot read = reader.snapshot(static_cast<int64_t>(i));
    for_each_field([&](const Field& field, auto get) {
      EXPECT_TRUE(same_bits(get(read.state), get(snapshots[i].state))) << field.name << " of snapshot " << i;
    });
  }
  // What stands in ParaView's file beside the fields: the number of the first cluster of each particle.
  EXPECT_EQ(stored_rows(recording_paths(path("run")).particles, "/VTKHDF/PointData/cluster"), 2 * int64_t{n});
}

TEST_F(RecordingTest, OfTheSameRunHasTheSameBytes) {
  record("a");
  record("b");
  const RecordingPaths a = recording_paths(path("a")), b = recording_paths(path("b"));
  EXPECT_TRUE(read_bytes(a.index) == read_bytes(b.index));
  EXPECT_TRUE(read_bytes(a.particles) == read_bytes(b.particles));
  EXPECT_TRUE(read_bytes(a.skin) == read_bytes(b.skin));
  EXPECT_TRUE(read_bytes(a.blade) == read_bytes(b.blade));
}

// --- Names and files ---

TEST_F(RecordingTest, IsNamedWithOrWithoutItsEnding) {
  EXPECT_EQ(recording_paths("out/run").index, "out/run.cutproof.h5");
  EXPECT_EQ(recording_paths("out/run.cutproof.h5").index, "out/run.cutproof.h5");
  EXPECT_EQ(recording_paths("out/run.cutproof.h5").particles, "out/run.particles.vtkhdf");
  EXPECT_EQ(recording_paths("run").skin, "run.skin.vtkhdf");
  EXPECT_EQ(recording_paths("run").blade, "run.blade.vtkhdf");
  record("run.cutproof.h5");
  EXPECT_TRUE(fs::exists(path("run.cutproof.h5")));
  EXPECT_EQ(read_everything(path("run")), read_everything(path("run.cutproof.h5")));
}

TEST_F(RecordingTest, AppearsWholeOrNotAtAll) {
  const Setup setup = block_setup(2, 2, 1);
  {
    Recorder recorder(path("run"), setup, "{}", "reference");
    recorder.add(Stage::skin, rest_state(setup));
    for (const auto& entry : fs::directory_iterator(folder_)) {
      EXPECT_EQ(entry.path().filename().string()[0], '.') << "visible before finish(): " << entry.path();
    }
  }
  EXPECT_EQ(file_count(), 0u) << "an unfinished recording left files behind";
  write("run", setup, {{Stage::skin, rest_state(setup)}});
  EXPECT_EQ(file_count(), 4u);
}

TEST_F(RecordingTest, LeavesAnOlderOneAloneUntilItIsFinished) {
  const std::vector<Snapshot> old = record("run");
  const std::string before = read_everything(path("run"));
  {
    const Setup setup = block_setup(2, 1, 1);
    Recorder recorder(path("run"), setup, "{}", "reference");
    recorder.add(Stage::skin, rest_state(setup));
    EXPECT_TRUE(read_everything(path("run")) == before);
  }
  EXPECT_TRUE(read_everything(path("run")) == before);
}

TEST_F(RecordingTest, CanBeMovedAndRenamedTogether) {
  record("run");
  const std::string before = read_everything(path("run"));
  fs::create_directory(path("elsewhere"));
  const RecordingPaths from = recording_paths(path("run")), to = recording_paths(path("elsewhere/other"));
  fs::rename(from.index, to.index);
  fs::rename(from.particles, to.particles);
  fs::rename(from.skin, to.skin);
  EXPECT_TRUE(read_everything(path("elsewhere/other")) == before);
}

TEST_F(RecordingTest, RefusesAFolderThatIsNotThere) {
  const Setup setup = block_setup(1, 1, 1);
  expect_input_error([&] { Recorder(path("missing/run"), setup, "{}", "reference"); }, path("missing/run.cutproof.h5"),
                     "folder");
  for (const char* name : {"", ".cutproof.h5"}) {
    expect_input_error([&] { Recorder(name, setup, "{}", "reference"); }, name, "names no file");
  }
  EXPECT_EQ(file_count(), 0u);
}

TEST_F(RecordingTest, RefusesStatesAndSetupsThatDoNotFit) {
  const Setup setup = block_setup(2, 2, 1);
  const State good = rest_state(setup);
  Recorder recorder(path("run"), setup, "{}", "reference");
  const auto refused = [&](const std::function<void(State&)>& spoil) {
    State state = good;
    spoil(state);
    EXPECT_THROW(recorder.add(Stage::skin, state), std::invalid_argument);
  };
  refused([](State& s) { s.x.pop_back(); });
  refused([](State& s) { s.v.emplace_back(); });
  refused([](State& s) { s.alive.clear(); });
  refused([](State& s) { s.clusters.offsets.clear(); });
  refused([](State& s) { s.clusters.mass.pop_back(); });
  refused([](State& s) { s.clusters.rotation.emplace_back(); });
  refused([](State& s) { s.skin.owner.push_back(0); });
  recorder.add(Stage::skin, good);
  recorder.finish();
  EXPECT_EQ(RecordingReader(path("run")).header().snapshot_count, 1) << "a refused state was recorded";
  EXPECT_THROW(recorder.add(Stage::skin, good), std::logic_error);
  EXPECT_THROW(recorder.finish(), std::logic_error);

  Setup bad = setup;
  bad.body.mass[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Recorder(path("bad"), bad, "{}", "reference"), std::invalid_argument);
  EXPECT_EQ(file_count(), 4u);
}

TEST_F(RecordingTest, SaysSoWhenTheDiskIsFull) {
  // A limit on the size of files stands in for a full disk. In a process of its own, which ends with status 7 if all
  // is as it should be.
  const auto limit_files = [](rlim_t bytes) {
    rlimit limit;
    getrlimit(RLIMIT_FSIZE, &limit);
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  };
  const auto run = [&](bool fail_in_finish) {
    std::signal(SIGXFSZ, SIG_IGN);
    const Setup setup = block_setup(20, 20, 20);
    State state = rest_state(setup);
    std::mt19937_64 random(1);
    int status = 1;
    {
      Recorder recorder(path("run"), setup, "{}", "reference");
      if (!fail_in_finish) limit_files(200'000);
      try {
        for (int frame = 0; frame < (fail_in_finish ? 2 : 100); ++frame) {
          state.frame = frame;
          for (Vec3& x : state.x) x = {std::bit_cast<double>(random()), std::bit_cast<double>(random()), 0};
          recorder.add(Stage::skin, state);
        }
        limit_files(1000);
        recorder.finish();
      } catch (const MachineError& error) {
        const std::string what = error.what();
        const bool in_finish = what.find("cannot be completed") != std::string::npos;
        status = what.find("run.cutproof.h5") != std::string::npos && in_finish == fail_in_finish ? 7 : 2;
        std::fprintf(stderr, "said: %s\n", error.what());
      }
    }
    // Nothing is left behind, and the next recording is none the worse for it.
    if (file_count() != 0) status = 3;
    limit_files(RLIM_INFINITY);
    std::string all;
    for (const Snapshot& snapshot : record("run")) all += bits_of(snapshot);
    if (!read_everything(path("run")).ends_with(all)) status = 4;
    for (const auto& entry : fs::directory_iterator(folder_)) fs::remove(entry.path());
    std::exit(status);
  };
  EXPECT_EXIT(run(false), testing::ExitedWithCode(7), "said: .*cannot be written.*: File too large");
  EXPECT_EXIT(run(true), testing::ExitedWithCode(7), "said: .*cannot be completed.*: File too large");
}

// --- Bad input ---

TEST_F(RecordingTest, IsRefusedIfItIsNoneAtAll) {
  const auto refused = [&](const std::string& name, const std::string& why) {
    expect_input_error([&] { RecordingReader reader(path(name)); }, path(name + ".cutproof.h5"), why);
  };
  expect_input_error([&] { RecordingReader reader(path("missing")); }, path("missing"), "no such file");
  fs::create_directory(path("folder.cutproof.h5"));
  refused("folder", "a folder");
  write_bytes(path("empty.cutproof.h5"), "");
  refused("empty", "empty");
  write_bytes(path("text.cutproof.h5"), "This is a text, and a rather long one.\n");
  refused("text", "not an HDF5 file");
  write_bytes(path("signature.cutproof.h5"), "\x89HDF\r\n\x1a\n");
  refused("signature", "cut off or damaged");
  hdf5::File::create(path("other.cutproof.h5")).close();
  refused("other", "not a recording");

  record("run");
  fs::copy(path("run.particles.vtkhdf"), path("swapped.cutproof.h5"));
  refused("swapped", "recording particles");
}

TEST_F(RecordingTest, IsRefusedIfItIsOfAnotherVersion) {
  record("run");
  tamper(path("run.cutproof.h5"),
         [](hid_t file) { set_attribute<int32_t>(file, "/", "cutproof_format", kFormatVersion + 1); });
  expect_input_error([&] { RecordingReader reader(path("run")); }, path("run.cutproof.h5"), "newer cutproof");
  tamper(path("run.cutproof.h5"), [](hid_t file) { set_attribute<int32_t>(file, "/", "cutproof_format", 7); });
  expect_input_error([&] { RecordingReader reader(path("run")); }, path("run.cutproof.h5"), "format 7");
}

TEST_F(RecordingTest, IsNotMadeOfASetupWhoseCriterionHasNoEndsToTake) {
  Setup setup = block_setup(2, 1, 1);
  setup.detect.remove = RemovedEnds::one;
  setup.detect.criterion = Criterion::geometric;
  EXPECT_THROW(Recorder(path("run"), setup, "{}", "reference"), std::invalid_argument);
}

TEST_F(RecordingTest, IsRefusedIfAFileOfItIsMissingOrOfAnother) {
  record("run");
  record("other", 1e-9);
  const RecordingPaths run = recording_paths(path("run")), other = recording_paths(path("other"));
  for (const auto& [ours, theirs] : {std::pair(run.particles, other.particles), std::pair(run.skin, other.skin)}) {
    fs::rename(ours, ours + ".kept");
    expect_input_error([&] { RecordingReader reader(path("run")); }, ours, "no such file");
    fs::copy(theirs, ours);
    expect_input_error([&] { RecordingReader reader(path("run")); }, ours, "another recording");
    fs::rename(ours + ".kept", ours);
  }
  read_everything(path("run"));
  // The blade's file is for ParaView alone, but it is of this run if it is there.
  fs::copy(other.blade, run.blade, fs::copy_options::overwrite_existing);
  expect_input_error([&] { RecordingReader reader(path("run")); }, run.blade, "another recording");
  fs::remove(run.blade);
  read_everything(path("run"));
}

TEST_F(RecordingTest, IsRefusedWhereverItIsCutOff) {
  record("run");
  const RecordingPaths files = recording_paths(path("run"));
  for (const std::string& file : {files.index, files.particles, files.skin, files.blade}) {
    const std::string whole = read_bytes(file);
    const std::size_t step = std::max<std::size_t>(1, whole.size() / 150);
    std::vector<std::size_t> lengths = {1, 7, 8, 9, 47, 48, 49, whole.size() - 1, whole.size() - 2};
    for (std::size_t length = 0; length < whole.size(); length += step) lengths.push_back(length);
    for (const std::size_t length : lengths) {
      write_bytes(file, whole.substr(0, length));
      SCOPED_TRACE(testing::Message() << file << " cut off after " << length << " bytes");
      expect_input_error([&] { read_everything(path("run")); }, file, "");
    }
    write_bytes(file, whole);
  }
  read_everything(path("run"));
}

// Checksums over structure and data: damage is either noticed, or lies where nothing is stored.
TEST_F(RecordingTest, NeverGivesWrongDataFromADamagedFile) {
  record("run");
  const std::string good = read_everything(path("run"));
  const RecordingPaths files = recording_paths(path("run"));
  constexpr unsigned kSeed = 20240229;
  std::cout << "seed " << kSeed << "\n";
  std::mt19937_64 random(kSeed);
  int refused = 0, unharmed = 0;
  for (const std::string& file : {files.index, files.particles, files.skin, files.blade}) {
    const std::string whole = read_bytes(file);
    for (int trial = 0; trial < 150; ++trial) {
      std::string damaged = whole;
      const int flips = trial % 3 == 0 ? 8 : 1;
      for (int k = 0; k < flips; ++k) {
        damaged[random() % damaged.size()] ^= static_cast<char>(1u << (random() % 8));
      }
      write_bytes(file, damaged);
      try {
        EXPECT_TRUE(read_everything(path("run")) == good) << file << " trial " << trial;
        ++unharmed;
      } catch (const InputError& error) {
        EXPECT_EQ(error.file(), file);
        ++refused;
      }
    }
    write_bytes(file, whole);
  }
  EXPECT_GT(refused, 0);
  EXPECT_GT(unharmed, 0);
}

TEST_F(RecordingTest, IsRefusedIfItIsInconsistent) {
  record("run");
  const RecordingPaths files = recording_paths(path("run"));
  const std::string whole = read_bytes(files.index);
  const auto refused = [&](const std::string& field, const std::function<void(hid_t)>& change) {
    SCOPED_TRACE(field);
    tamper(files.index, change);
    expect_input_error([&] { read_everything(path("run")); }, files.index, field);
    write_bytes(files.index, whole);
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr int64_t kHuge = std::numeric_limits<int64_t>::max();
  const auto entry = [&]<class T>(const std::string& name, std::size_t index, T value) {
    refused(name, [&](hid_t file) { set_entry<T>(file, name, index, value); });
  };
  const auto attribute = [&]<class T>(const std::string& group, const std::string& name, T value) {
    refused(name, [&](hid_t file) { set_attribute<T>(file, group, name, value); });
  };
  entry("/setup/body/node", 0, int64_t{-1});
  entry("/setup/body/node", 0, int64_t{1'000'000});
  entry("/setup/body/node", 0, int64_t{0});   // on the outer ring
  entry("/setup/body/node", 1, int64_t{21});  // twice the same
  entry("/setup/body/particle_at", 0, int32_t{3});
  entry("/setup/body/mass", 1, kNan);
  entry("/setup/body/mass", 1, -1.0);
  entry("/setup/body/surface_crossing", 1, uint8_t{15});
  entry("/setup/body/surface_crossing", 1, uint8_t{241});
  entry("/setup/body/surface_crossing", 0, uint8_t{128});  // of an edge that leads to another particle
  attribute("/setup/body", "spacing", kNan);
  attribute("/setup/body", "spacing", 0.0);
  attribute("/setup/step", "stiffness", kNan);
  attribute("/setup/step", "substeps", int32_t{0});
  attribute("/setup/step", "iterations", int32_t{-1});
  attribute("/setup/detect", "without_blade", uint8_t{2});
  attribute("/setup/blade", "thickness", kNan);
  for (const char* name : {"length", "depth", "thickness", "friction"}) attribute("/setup/blade", name, -0.25);
  attribute("/setup/expand", "depth", int32_t{0});
  refused("/setup/blade_moves",
          [](hid_t file) { set_attribute(file, "/setup/step", "substeps", std::numeric_limits<int32_t>::max()); });
  refused("/setup/blade_moves", [](hid_t file) { set_attribute(file, "/setup/blade", "present", uint8_t{0}); });
  entry("/setup/walls/axis", 0, int32_t{3});
  entry("/setup/walls/side", 0, int32_t{0});
  entry("/setup/walls/offset", 0, kNan);
  entry("/setup/walls/friction", 0, -0.25);
  entry("/setup/grips/particles", 0, int32_t{8});
  entry("/setup/grips/particles", 0, int32_t{-1});
  entry("/setup/grips/particles_offsets", 1, int64_t{4});
  entry("/setup/grips/active", 1, uint8_t{7});
  entry("/setup/grips/displacement", 1, kNan);
  entry("/setup/substep_length", 0, kNan);
  entry("/setup/substep_length", 0, 0.0);
  entry("/setup/stroke_end", 0, int64_t{3});
  entry("/setup/blade_moves/down", 0, uint8_t{9});
  refused("blade_moves", [&](hid_t file) { set_entry(file, "/setup/blade_moves/to_edge", 2, kNan); });
  entry("/snapshots/stage", 0, uint8_t{6});
  entry("/snapshots/edge_covered", 0, uint8_t{2});
  entry("/snapshots/removed_offsets", 3, int64_t{-1});
  entry("/snapshots/removed_offsets", 3, int64_t{100});
  entry("/snapshots/debris_offsets", 0, int64_t{1});
  entry("/snapshots/position_row", 0, int64_t{-1});
  entry("/snapshots/position_row", 0, kHuge);
  entry("/snapshots/velocity_row", 6, int64_t{25});  // 8 rows from there are one too many
  entry("/snapshots/alive_row", 1, kHuge);
  entry("/setup/grips/active_offsets", 1, int64_t{-1});
  entry("/snapshots/rotation_row", 2, kHuge);
  entry("/snapshots/degenerate_row", 2, int64_t{-5});
  entry("/snapshots/number_row", 4, int64_t{4});  // 3 rows from there are more than are stored
  entry("/snapshots/members_row", 0, int64_t{-1});
  for (const char* count : {"cluster_count", "member_count", "vertex_count", "triangle_count"}) {
    entry(std::string("/snapshots/") + count, 1, int64_t{-1});
  }
  refused("/snapshots/owner_row", [&](hid_t file) { set_entry(file, "/snapshots/vertex_count", 1, kHuge); });
  refused("/snapshots/triangles_row", [&](hid_t file) { set_entry(file, "/snapshots/triangle_count", 1, kHuge); });
  refused("/snapshots/offsets_row", [&](hid_t file) { set_entry(file, "/snapshots/cluster_count", 1, int64_t{400}); });
  refused("/snapshots/offsets_row", [&](hid_t file) { set_entry(file, "/snapshots/cluster_count", 1, kHuge); });
  refused("/snapshots/members_row", [&](hid_t file) { set_entry(file, "/snapshots/member_count", 0, kHuge); });
  refused("/snapshots/tau", [](hid_t file) { H5Ldelete(file, "/snapshots/tau", H5P_DEFAULT); });
  refused("/setup/skin", [](hid_t file) { H5Ldelete(file, "/setup/skin", H5P_DEFAULT); });
  refused("/clusters/members", [](hid_t file) {
    H5Ldelete(file, "/clusters/members", H5P_DEFAULT);
    const hdf5::Id group = hdf5::open_group(file, "clusters");
    hdf5::write_table(group.get(), "members", std::vector<double>(100));
  });
  read_everything(path("run"));
}

TEST_F(RecordingTest, DoesNotBelieveASizeThatTheFileCannotHold) {
  record("run");
  const RecordingPaths files = recording_paths(path("run"));
  for (const auto& [file, name] :
       {std::pair(files.index, "/setup/body/node"), std::pair(files.index, "/scene"),
        std::pair(files.index, "/snapshots/frame"), std::pair(files.particles, "/VTKHDF/Points"),
        std::pair(files.skin, "/VTKHDF/PointData/owner")}) {
    SCOPED_TRACE(name);
    const std::string whole = read_bytes(file);
    tamper(file, [&, table = name](hid_t id) {
      const hdf5::Id dataset(H5Dopen2(id, table, H5P_DEFAULT), H5Dclose, table);
      const hdf5::Id space(H5Dget_space(dataset.get()), H5Sclose, table);
      std::vector<hsize_t> dims(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space.get())));
      H5Sget_simple_extent_dims(space.get(), dims.data(), nullptr);
      dims[0] = hsize_t{1} << 50;
      ASSERT_GE(H5Dset_extent(dataset.get(), dims.data()), 0);
    });
    expect_input_error([&] { read_everything(path("run")); }, file, "are stored for it");
    write_bytes(file, whole);
  }
}

// --- For recording_layout.py ---

// Writes the recordings that recording_layout.py reads, into the folder that CUTPROOF_LAYOUT_FOLDER names (CTest sets
// it; otherwise they are only written and read back here).
TEST_F(RecordingTest, IsWrittenForTheLayoutCheck) {
  if (const char* folder = std::getenv("CUTPROOF_LAYOUT_FOLDER")) {
    fs::create_directories(folder);
    const fs::path own = std::exchange(folder_, folder);
    record("cut");
    write("nothing", block_setup(0, 0, 0), {});
    const Setup setup = block_setup(1, 1, 1);
    write("one", setup, {{Stage::skin, rest_state(setup)}});
    EXPECT_EQ(file_count(), 12u);
    folder_ = own;
    return;
  }
  record("cut");
  EXPECT_EQ(RecordingReader(path("cut")).header().snapshot_count, 7);
}

}  // namespace
}  // namespace cutproof::io::recording_test
