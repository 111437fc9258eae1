// Runs of other simulators, in segments: judged to the end, whatever their arrays hold.
#include <array>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "harness/foreign_run.h"
#include "model/io/array_file.h"
#include "model/io/hdf5_file.h"
#include "tests/input_fuzzing/array_edits.h"
#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace of_runs {

constexpr std::size_t kSegments = 3;
using SmallRun = std::array<io::ArrayFile, kSegments>;

template <class T>
void add(io::ArrayFile& segment, const char* name, std::vector<int64_t> shape, const std::vector<T>& values) {
  segment.arrays.push_back(make_array(name, std::move(shape), values));
}

// A row of four particles at rest, two frames and one and one. In the second segment a blade parts the middle spring;
// in the third the last particle is gone.
SmallRun particles() {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> row = {0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0}, still(12, 0.0);
  SmallRun run;
  for (std::size_t k = 0; k < kSegments; ++k) {
    const int64_t frames = k == 0 ? 2 : 1;
    std::vector<double> x = row, v = still, time = {static_cast<double>(k) + 1}, blade(12, kNone);
    if (k == 0) {
      x.insert(x.end(), row.begin(), row.end());
      v.insert(v.end(), still.begin(), still.end());
      time = {0, 1};
      blade.resize(24, kNone);
    }
    if (k == 1) blade = {1.5, -1, -1, 1.5, 1, -1, 1.5, 1, 1, 1.5, -1, 1};
    const auto all = [&](uint8_t value) { return std::vector<uint8_t>(static_cast<std::size_t>(4 * frames), value); };
    add(run[k], "positions", {frames, 4, 3}, x);
    add(run[k], "velocities", {frames, 4, 3}, v);
    add(run[k], "spin", {frames, 4, 3}, v);
    add(run[k], "time", {frames}, time);
    add(run[k], "energy", {frames}, std::vector<float>(static_cast<std::size_t>(frames), 1));
    add(run[k], "contact_impulse", {frames, 3}, std::vector<double>(static_cast<std::size_t>(3 * frames), 0));
    add(run[k], "blade", {frames, 1, 4, 3}, blade);
    std::vector<uint8_t> removed = all(0);
    if (k == 2) removed[3] = 1;
    add(run[k], "removed", {frames, 4}, removed);
    add(run[k], "alive", {frames, 4}, all(1));
    add(run[k], "held", {frames, 4}, all(0));
    add(run[k], "piece", {4}, k == 0 ? std::vector<int32_t>{0, 0, 0, 0} : std::vector<int32_t>{0, 0, 7, 7});
    if (k == 2) continue;
    add(run[k], "groups_offsets", {k == 0 ? 4 : 3},
        k == 0 ? std::vector<int64_t>{0, 2, 4, 6} : std::vector<int64_t>{0, 2, 4});
    add(run[k], "groups_members", {k == 0 ? 6 : 4},
        k == 0 ? std::vector<int32_t>{0, 1, 1, 2, 2, 3} : std::vector<int32_t>{0, 1, 2, 3});
    add(run[k], "groups_weights", {k == 0 ? 6 : 4}, std::vector<float>(k == 0 ? 6 : 4, 1));
  }
  add(run[0], "rest", {4, 3}, row);
  add(run[0], "mass", {4}, std::vector<double>{1, 1, 1, 1});
  add(run[0], "gravity", {3}, std::vector<double>{0, 0, 0});
  add(run[0], "spacing", {}, std::vector<double>{1});
  add(run[0], "steps", {}, std::vector<int32_t>{2});
  add(run[0], "damping", {}, std::vector<double>{0.1});
  add(run[0], "cut_resolution", {}, std::vector<double>{0.01});
  add(run[0], "unit_roundoff", {}, std::vector<double>{0x1p-53});
  run[0].texts = {{"promises", "free angular_momentum energy deterministic"}};
  return run;
}

// Two tetrahedra in single precision, which a triangle of a blade parts; then three of five vertices are split.
SmallRun cells() {
  const std::vector<float> corners = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, -1};
  std::vector<float> split = corners;
  split.insert(split.end(), corners.begin() + 3, corners.begin() + 12);
  SmallRun run;
  for (std::size_t k = 0; k < kSegments; ++k) {
    const int64_t n = k == 0 ? 5 : 8;
    add(run[k], "positions", {1, n, 3}, k == 0 ? corners : split);
    add(run[k], "cells", {2, 4}, std::vector<int32_t>{1, 2, 3, 0, 1, 3, 2, 4});
  }
  for (const std::size_t k : {1, 2}) {
    run[k].arrays.back() = make_array("cells", {2, 4}, std::vector<int32_t>{1, 2, 3, 0, 5, 7, 6, 4});
  }
  add(run[1], "blade", {1, 1, 3, 3}, std::vector<float>{-9, -9, 0, 9, -9, 0, 0, 9, 0});
  add(run[1], "parent", {8}, std::vector<int32_t>{-1, -1, -1, -1, -1, 1, 2, 3});
  add(run[1], "mass", {8}, std::vector<float>{1, 0.5, 0.5, 0.5, 1, 0.5, 0.5, 0.5});
  add(run[2], "vertices", {1, 3, 3}, std::vector<float>(9, 0));
  add(run[2], "triangles", {1, 3}, std::vector<int32_t>{0, 1, 2});
  add(run[0], "rest", {5, 3}, corners);
  add(run[0], "mass", {5}, std::vector<float>(5, 1));
  add(run[0], "nodes", {5, 3}, std::vector<int32_t>{0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, -1});
  add(run[0], "edges", {1, 2}, std::vector<int32_t>{0, 1});
  return run;
}

constexpr SmallRun (*kSmallRuns[])() = {particles, cells};

std::string folder() {
  const std::string path = scratch_path("fed_run");
  std::filesystem::create_directory(path);
  return path;
}
void write_segments(const SmallRun& run) {
  for (std::size_t k = 0; k < kSegments; ++k)
    io::write_array_file(folder() + "/00000" + std::to_string(k) + ".npz", run[k]);
}

void judge(const std::string& path) {
  io::RunSegments segments(path);
  const harness::JudgedRun judged = harness::judge_run(segments);
  if (judged.verdicts.empty() || judged.frames < judged.segments) broken_contract("nothing was judged");
  for (const Verdict& verdict : judged.verdicts) {
    if (!verdict.holds && verdict.witness.text.empty()) broken_contract("a failure says nothing: " + verdict.property);
  }
}

// '0' and an NPZ file, the only segment of a folder; '1' and an HDF5 file; '2' and '3' and edits of one of the small
// runs: which segment, and an edit.
Outcome feed(std::string_view bytes) {
  if (bytes.empty() || bytes[0] < '0' || bytes[0] > '3') return Outcome::refused;
  const char kind = bytes[0];
  bytes.remove_prefix(1);
  return outcome_of([&] {
    if (kind == '1') {
      write_scratch("fed_run.h5", bytes);
      return judge(scratch_path("fed_run.h5"));
    }
    std::filesystem::remove_all(folder());
    if (kind == '0') {
      folder();
      write_scratch("fed_run/000000.npz", bytes);
    } else {
      SmallRun run = kSmallRuns[kind - '2']();
      for (; bytes.size() > kEditBytes; bytes.remove_prefix(kEditBytes + 1)) {
        edit(run[static_cast<unsigned char>(bytes[0]) % kSegments], bytes.substr(1, kEditBytes));
      }
      write_segments(run);
    }
    judge(folder());
  });
}

std::string hdf5_of(const SmallRun& run) {
  constexpr io::hdf5::Scalar kScalars[] = {io::hdf5::Scalar::i32, io::hdf5::Scalar::i64, io::hdf5::Scalar::u8,
                                           io::hdf5::Scalar::f32, io::hdf5::Scalar::f64};  // as ElementType, from 1
  io::hdf5::File file = io::hdf5::File::create(scratch_path("seed_run.h5"));
  for (std::size_t k = 0; k < kSegments; ++k) {
    const io::hdf5::Id group = io::hdf5::create_group(file.id(), "00000" + std::to_string(k));
    for (const Array& array : run[k].arrays) {
      io::hdf5::Layout layout{kScalars[static_cast<std::size_t>(array.type) - 1], {}};
      for (const int64_t extent : array.shape) layout.shape.push_back(static_cast<hsize_t>(extent));
      io::hdf5::write_dataset(group.get(), array.name, layout, array.bytes.data());
    }
  }
  for (const io::NamedText& text : run[0].texts) io::hdf5::write_text_attribute(file.id(), text.name, text.text);
  file.close();
  return bytes_of_file(scratch_path("seed_run.h5"));
}

std::vector<std::string> seeds() {
  std::vector<std::string> seeds;
  for (std::size_t k = 0; k < std::size(kSmallRuns); ++k) {
    const SmallRun run = kSmallRuns[k]();
    write_segments(run);
    seeds.push_back("0" + bytes_of_file(folder() + "/000000.npz"));
    seeds.push_back("1" + hdf5_of(run));
    // An edit that leaves the run one that can be understood: another place.
    seeds.push_back(std::string(1, static_cast<char>('2' + k)) + std::string(kEditBytes + 1, '\0'));
  }
  return seeds;
}

}  // namespace of_runs

const Target kRun = {"run", of_runs::feed, of_runs::seeds};

}  // namespace cutproof::input_fuzzing
