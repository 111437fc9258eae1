// Each value of a recording's files changed alone: either the recording contradicts itself and is refused, or what it
// shows is judged and fails. The values are those that the files hold, so that one that is new is asked of here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "fixtures/build.h"
#include "fixtures/recorded_scene.h"
#include "harness/frame_runner.h"
#include "harness/recorded_run.h"
#include "harness/scene_judge.h"
#include "model/error.h"
#include "model/io/hdf5_file.h"
#include "model/io/recording.h"
#include "model/io/scene_io.h"
#include "reference_cpu/reference.h"
#include "tests/model/recorded_items.h"

namespace cutproof::harness::recorded_values_test {
namespace {

namespace fs = std::filesystem;
namespace hdf5 = io::hdf5;
using ::testing::HasSubstr;

// Everything that a setup and a state can have, but for a mesh and a bare graph: small, and cut in the middle, so that
// particles die before the end.
constexpr const char* kScene = R"({"version": 5, "name": "every value",
  "body": {"shape": {"kind": "box", "size": [0.06, 0.04, 0.02]}, "spacing": 0.01, "origin": [0.1, 0.2, 0.3]},
  "clusters": {"side": 2},
  "frame": {"settle": 0.032}, "step": {"gravity": [0, 0, -9.81], "substeps": 2, "iterations": 3},
  "ground": {"friction": 0.5},
  "grips": [{"low": [0, 0, 0], "high": [0.1, 1, 1], "velocity": [0, 0.01, 0]}],
  "blade": {"speed": 1, "strokes": [{"points": [[0.5, 0.5, 2.6], [0.5, 0.5, -0.3]], "along": [0, 1, 0]}]},
  "expect": {"components_at_end": 2, "removed": {"at_least": 1, "at_most": 40}}})";

class RecordedValues : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("cutproof.recorded_values." + std::to_string(getpid()));
    fs::create_directories(folder_);
    record(whole(), {});
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static std::string whole() { return (folder_ / "whole").string(); }
  static std::string copy() { return (folder_ / "copy").string(); }
  static std::vector<std::string> files_of(const std::string& name) {
    const io::RecordingPaths paths = io::recording_paths(name);
    return {paths.index, paths.particles, paths.skin, paths.blade};
  }

  static void record(const std::string& name, std::optional<int64_t> frames) {
    const Scene scene = io::parse_scene(kScene, "the test's scene");
    fixtures::BuildOptions options;
    options.frames = frames;
    const fixtures::Built built = fixtures::build(scene, "the test's scene", options);
    const auto backend = reference::make_backend();
    FrameRunner runner(*backend, {built.setup}, {built.state});
    io::Recorder recorder(name, built.setup, io::write_scene(scene), "somebody", {},
                          built.schedule.is_cut_short ? frames : std::nullopt);
    recorder.add(Stage::skin, *runner.states().front());
    while (!runner.is_over()) {
      runner.run_frame([&](const Moment& moment) { recorder.add(moment.span.last, *moment.after); });
    }
    recorder.finish();
  }

  struct Outcome {
    bool is_refused = false;
    std::string text;  // the error, or the property that fails; empty: it holds
    bool is_cut_short = false;
  };
  static Outcome checked(const std::string& name) {
    try {
      const io::RecordingReader reader(name);
      const fixtures::RecordedScene recorded = fixtures::scene_of(reader, name);
      const auto initial = std::make_shared<const State>(reader.snapshot(0).state);
      SceneJudge judge(reader.header().setup, recorded.scene.expect, "somebody", initial, Depth::motion, {},
                       recorded.is_cut_short ? Extent::cut_short : Extent::whole);
      for (Verdict& wrong : walk_recording(
               reader, initial, [&](const Moment& moment) { judge.see(moment); }, [](const FrameResult&) {})) {
        judge.add(std::move(wrong));
      }
      judge.finish();
      const auto failing = std::find_if(judge.verdicts().begin(), judge.verdicts().end(),
                                        [](const Verdict& verdict) { return !verdict.holds; });
      const bool holds = failing == judge.verdicts().end();
      return {false, holds ? "" : failing->property + ": " + failing->witness.text, recorded.is_cut_short};
    } catch (const InputError& error) {
      return {true, error.what()};
    }
  }

  // change(file) of one of the four files of a copy.
  static Outcome changed(std::size_t part, const std::function<void(hid_t)>& change) {
    const std::vector<std::string> from = files_of(whole()), to = files_of(copy());
    for (std::size_t k = 0; k < from.size(); ++k) {
      fs::copy_file(from[k], to[k], fs::copy_options::overwrite_existing);
    }
    {
      const hdf5::Id file(H5Fopen(to[part].c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose, to[part]);
      change(file.get());
    }
    return checked(copy());
  }

  static inline fs::path folder_;
};

// --- Changing a value ------------------------------------------------------------------------------------------------

// Number `which` of `count` numbers of a type, far beyond rounding: flags and counts by one.
void change_number(std::string& bytes, hid_t type, std::size_t which) {
  const std::size_t size = H5Tget_size(type);
  char* const at = bytes.data() + which * size;
  if (H5Tget_class(type) == H5T_FLOAT) {
    double value = 0;
    ASSERT_EQ(size, sizeof value);
    std::memcpy(&value, at, size);
    value = 1.5 * value + 0.25;
    std::memcpy(at, &value, size);
  } else {
    *at = static_cast<char>(*at ^ 1);  // the least digit: little-endian
  }
}

using Content = std::string;
// Calls change(content, type, count) on what a dataset or an attribute holds.
void edit(hid_t file, const tests::RecordedItem& item,
          const std::function<void(Content& bytes, hid_t type, std::size_t count)>& change) {
  const hdf5::Id object(H5Oopen(file, item.object.c_str(), H5P_DEFAULT), H5Oclose, item.object);
  const bool is_dataset = item.attribute.empty();
  const hdf5::Id attribute =
      is_dataset ? hdf5::Id()
                 : hdf5::Id(H5Aopen(object.get(), item.attribute.c_str(), H5P_DEFAULT), H5Aclose, item.attribute);
  const hdf5::Id type(is_dataset ? H5Dget_type(object.get()) : H5Aget_type(attribute.get()), H5Tclose, "type");
  const hdf5::Id space(is_dataset ? H5Dget_space(object.get()) : H5Aget_space(attribute.get()), H5Sclose, "space");
  const auto count = static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get()));
  Content bytes(count * H5Tget_size(type.get()), '\0');
  if (is_dataset) {
    ASSERT_GE(H5Dread(object.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()), 0);
    change(bytes, type.get(), count);
    ASSERT_GE(H5Dwrite(object.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()), 0);
  } else {
    ASSERT_GE(H5Aread(attribute.get(), type.get(), bytes.data()), 0);
    change(bytes, type.get(), count);
    ASSERT_GE(H5Awrite(attribute.get(), type.get(), bytes.data()), 0);
  }
}

void change_all(hid_t file, const std::string& dataset) {
  edit(file, {dataset, ""}, [](Content& bytes, hid_t type, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) change_number(bytes, type, k);
  });
}
template <class T>
void set_all(hid_t file, const std::string& dataset, const std::function<T(T)>& changed) {
  edit(file, {dataset, ""}, [&](Content& bytes, hid_t, std::size_t count) {
    ASSERT_EQ(bytes.size(), count * sizeof(T));
    for (std::size_t k = 0; k < count; ++k) {
      T value;
      std::memcpy(&value, bytes.data() + k * sizeof value, sizeof value);
      value = changed(value);
      std::memcpy(bytes.data() + k * sizeof value, &value, sizeof value);
    }
  });
}

// --- Every value -----------------------------------------------------------------------------------------------------

// Said once, and by nobody but the author: there is nothing to hold it against.
const std::set<std::string> kAuthorsWord = {"0 / backend", "0 / unit_roundoff"};

bool same_states(const std::string& one, const std::string& other) {
  const io::RecordingReader a(one), b(other);
  bool same = a.header().snapshot_count == b.header().snapshot_count;
  for (int64_t i = 0; same && i < a.header().snapshot_count; ++i) same = a.snapshot(i).state == b.snapshot(i).state;
  return same;
}

TEST_F(RecordedValues, AreEachHeldAgainstTheOthersOrJudged) {
  const auto says_the_same = [] { return same_states(whole(), copy()); };
  ASSERT_EQ(checked(whole()).text, "");
  const std::vector<std::string> files = files_of(whole());
  int64_t changes = 0;
  for (std::size_t part = 0; part < files.size(); ++part) {
    for (const tests::RecordedItem& item : tests::items_of(files[part])) {
      const std::string name = std::to_string(part) + " " + item.object + " " + item.attribute;
      SCOPED_TRACE(name);
      const std::string shown = std::to_string(part) + " / " + item.attribute;
      if (item.object == "." && kAuthorsWord.contains(shown)) continue;
      std::set<std::size_t> places;
      {
        const hdf5::Id file(H5Fopen(files[part].c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, files[part]);
        const hdf5::Id object(H5Oopen(file.get(), item.object.c_str(), H5P_DEFAULT), H5Oclose, item.object);
        if (item.attribute.empty()) {
          const hdf5::Id space(H5Dget_space(object.get()), H5Sclose, "space");
          const auto count = static_cast<std::size_t>(H5Sget_simple_extent_npoints(space.get()));
          if (count > 0) places = {0, count - 1};
        } else {
          places = {0};
        }
      }
      if (places.empty()) {  // then nothing may be added
        const Outcome outcome = changed(part, [&](hid_t file) {
          const hdf5::Id dataset(H5Dopen2(file, item.object.c_str(), H5P_DEFAULT), H5Dclose, item.object);
          const hdf5::Id space(H5Dget_space(dataset.get()), H5Sclose, "space");
          std::array<hsize_t, 8> extent = {};
          H5Sget_simple_extent_dims(space.get(), extent.data(), nullptr);
          extent[0] = 1;
          ASSERT_GE(H5Dset_extent(dataset.get(), extent.data()), 0);
        });
        EXPECT_NE(outcome.text, "") << "one entry more";
        ++changes;
      }
      for (const std::size_t place : places) {
        const Outcome outcome = changed(part, [&](hid_t file) {
          edit(file, item, [&](Content& bytes, hid_t type, std::size_t count) {
            if (H5Tget_class(type) == H5T_STRING) {
              bytes.front() = static_cast<char>(bytes.front() ^ 1);
            } else {
              change_number(bytes, type, std::min(place, count - 1));
            }
          });
        });
        // Rows that hold the same, or none of them, are no other state.
        if (outcome.text.empty() && item.object.ends_with("_row") && says_the_same()) continue;
        EXPECT_NE(outcome.text, "") << "entry " << place;
        ++changes;
      }
    }
  }
  EXPECT_GT(changes, 200);
}

// --- What is in two places names both --------------------------------------------------------------------------------

TEST_F(RecordedValues, OfTheSceneAreThoseOfTheSetup) {
  const auto with_scene = [](const std::string& text) {
    return changed(0, [&](hid_t file) {
      ASSERT_GE(H5Ldelete(file, "scene", H5P_DEFAULT), 0);
      hdf5::write_table(file, "scene", std::vector<uint8_t>(text.begin(), text.end()));
    });
  };
  const auto refused = [&](const std::function<void(Scene&)>& change, const std::vector<std::string>& named) {
    Scene scene = io::parse_scene(kScene, "the test's scene");
    change(scene);
    const Outcome outcome = with_scene(io::write_scene(scene));
    EXPECT_TRUE(outcome.is_refused) << outcome.text;
    for (const std::string& word : named) EXPECT_THAT(outcome.text, HasSubstr(word));
    EXPECT_THAT(outcome.text, HasSubstr("remedy: "));
  };
  refused([](Scene& s) { s.step.stiffness = 2e5; }, {"/setup/step/stiffness", "100000", "200000"});
  refused([](Scene& s) { s.settle = 0.1; }, {"/setup/substep_length", "frames, and the scene's text makes"});
  refused([](Scene& s) { s.frames = 100; }, {"/setup/substep_length", "makes 100"});
  refused([](Scene& s) { s.frames = 1; }, {"/setup/substep_length", "makes 1"});
  refused([](Scene& s) { s.body.origin.x = 0.11; }, {"/setup/body/origin"});
  refused([](Scene& s) { s.body.density = 1001; }, {"/setup/body/mass"});
  refused([](Scene& s) { s.body.shape->size.x = 0.07; }, {"/setup/body/nodes"});
  refused([](Scene& s) { s.clusters.small = 5; }, {"tau of the first"});
  refused([](Scene& s) { s.clusters.cap = 5; }, {"cap of the first"});
  refused([](Scene& s) { s.blade->strokes.front().points.front().x = 0.55; }, {"/setup/blade_moves"});
  refused([](Scene& s) { s.grips.front().velocity.y = 0.02; }, {"/setup/grips/displacement"});
  refused([](Scene& s) { s.walls.front().friction = 0.25; }, {"/setup/walls/friction", "0.5", "0.25"});
  // The same run, of which less is asked.
  refused([](Scene& s) { s.expect = {}; }, {"cutproof_beginning"});
  refused([](Scene& s) { s.expect.removed->high = 41; }, {"cutproof_beginning"});
  const Outcome without = with_scene("");
  EXPECT_TRUE(without.is_refused);
  EXPECT_THAT(without.text, HasSubstr("cutproof_beginning"));
}

TEST_F(RecordedValues, OfTheSetupAreThoseOfTheScene) {
  const auto refused = [&](std::size_t part, const std::function<void(hid_t)>& change,
                           const std::vector<std::string>& named) {
    const Outcome outcome = changed(part, change);
    EXPECT_TRUE(outcome.is_refused) << outcome.text;
    for (const std::string& word : named) EXPECT_THAT(outcome.text, HasSubstr(word));
    EXPECT_THAT(outcome.text, HasSubstr("remedy: "));
  };
  for (const std::string limit : {"tau", "cap"}) {
    refused(0, [&](hid_t file) { set_all<int32_t>(file, "snapshots/" + limit, [](int32_t v) { return v + 1; }); },
            {limit + " of the first", "the scene's text makes it"});
  }
  refused(0, [](hid_t file) { set_all<int64_t>(file, "setup/stroke_end", [](int64_t v) { return v + 1; }); },
          {"/setup/stroke_end", "Entry 0 is"});
  refused(0,
          [](hid_t file) {
            edit(file, {"setup/body", "origin"},
                 [](Content& bytes, hid_t type, std::size_t) { change_number(bytes, type, 1); });
          },
          {"/setup/body/origin"});
  refused(0,
          [](hid_t file) {  // x to -x
            edit(file, {"setup/body", "orientation"},
                 [](Content& bytes, hid_t, std::size_t) { bytes[7] = static_cast<char>(bytes[7] ^ 0x80); });
          },
          {"/setup/body/orientation", "rotation"});
  refused(0,
          [](hid_t file) {  // a turn about z by half a turn
            edit(file, {"setup/body", "orientation"}, [](Content& bytes, hid_t, std::size_t) {
              bytes[7] = static_cast<char>(bytes[7] ^ 0x80);
              bytes[4 * 8 + 7] = static_cast<char>(bytes[4 * 8 + 7] ^ 0x80);
            });
          },
          {"/setup/body/orientation", "the scene's text makes it"});
}

TEST_F(RecordedValues, ForParaViewAreThoseOfTheIndex) {
  const auto refused = [&](std::size_t part, const std::function<void(hid_t)>& change, const std::string& named) {
    const Outcome outcome = changed(part, change);
    EXPECT_TRUE(outcome.is_refused) << outcome.text;
    EXPECT_THAT(outcome.text, HasSubstr(named));
    EXPECT_THAT(outcome.text, HasSubstr("remedy: "));
  };
  for (const std::size_t part : {1u, 2u, 3u}) {
    refused(
        part, [](hid_t file) { set_all<double>(file, "VTKHDF/Steps/Values", [](double t) { return 2 * t; }); },
        "/VTKHDF/Steps/Values: Entry 1 is 0.032, and the rest of the recording makes it 0.016");
    refused(
        part, [](hid_t file) { set_all<int64_t>(file, "VTKHDF/NumberOfPoints", [](int64_t n) { return n + 1; }); },
        "/VTKHDF/Steps/PartOffsets");
  }
  refused(
      1, [](hid_t file) { set_all<int32_t>(file, "VTKHDF/PointData/cluster", [](int32_t) { return 0; }); },
      "/VTKHDF/PointData/cluster");
  // The clusters that the first step shows stay as they are.
  refused(
      1,
      [](hid_t file) {
        int64_t before = cutproof::io::RecordingReader(whole()).header().setup.body.particle_count();
        set_all<int32_t>(file, "VTKHDF/PointData/cluster", [&](int32_t c) { return before-- > 0 ? c : 0; });
      },
      "/VTKHDF/PointData/cluster");
  refused(
      1, [](hid_t file) { set_all<int32_t>(file, "VTKHDF/PointData/particle", [](int32_t i) { return i + 1; }); },
      "/VTKHDF/PointData/particle");
  refused(
      3, [](hid_t file) { change_all(file, "VTKHDF/Points"); }, "/VTKHDF/Points");
  // What is not there contradicts nothing.
  for (const std::size_t part : {1u, 2u, 3u}) {
    EXPECT_EQ(changed(part, [](hid_t file) { H5Ldelete(file, "VTKHDF/Steps", H5P_DEFAULT); }).text, "");
  }
}

// --- Cut short -------------------------------------------------------------------------------------------------------

TEST_F(RecordedValues, SayWhetherTheRunWasCutShort) {
  EXPECT_FALSE(checked(whole()).is_cut_short);
  const std::string name = (folder_ / "short").string();
  record(name, 3);
  const Outcome outcome = checked(name);
  EXPECT_EQ(outcome.text, "");
  EXPECT_TRUE(outcome.is_cut_short);
  record(name, 1000);  // more than there are
  EXPECT_FALSE(checked(name).is_cut_short);
  EXPECT_EQ(checked(name).text, "");
}

}  // namespace
}  // namespace cutproof::harness::recorded_values_test
