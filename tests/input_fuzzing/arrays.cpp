// Files of arrays: what is read can be written, reads back the same, and is judged as a state and as a kick, whatever
// its arrays hold.
#include <algorithm>
#include <cstring>

#include "harness/foreign_judge.h"
#include "harness/recorded_kick.h"
#include "model/io/array_file.h"
#include "tests/input_fuzzing/array_edits.h"
#include "tests/input_fuzzing/targets.h"

namespace cutproof::input_fuzzing {
namespace of_arrays {

// A row of four particles on a grid, cut between the second and the third, with all that a file may hold.
io::ArrayFile small_state() {
  io::ArrayFile file;
  const auto add = [&]<class T>(const char* name, std::vector<int64_t> shape, const std::vector<T>& values) {
    file.arrays.push_back(make_array(name, std::move(shape), values));
  };
  const std::vector<double> row = {0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0}, identity = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  add("positions", {4, 3}, row);
  add("rest", {4, 3}, row);
  add("velocities", {4, 3}, row);
  add("mass", {4}, std::vector<double>{1, 1, 1, 1});
  add("alive", {4}, std::vector<uint8_t>{1, 1, 0, 1});
  add("removed", {1}, std::vector<int32_t>{2});
  add("nodes", {4, 3}, std::vector<int32_t>{0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0});
  add("spacing", {}, std::vector<double>{1});
  add("cluster_offsets", {3}, std::vector<int64_t>{0, 2, 3});
  add("cluster_members", {3}, std::vector<int32_t>{0, 1, 3});
  add("numbers", {2}, std::vector<int32_t>{0, 1});
  add("rotations", {1, 9}, identity);
  file.arrays.back().shape = {2, 9};
  file.arrays.back().bytes.insert(file.arrays.back().bytes.end(), file.arrays.back().bytes.begin(),
                                  file.arrays.back().bytes.begin() + 72);
  add("rest_centers", {2, 3}, std::vector<double>{0.5, 0, 0, 3, 0, 0});
  add("cluster_masses", {2}, std::vector<double>{2, 1});
  add("tau", {}, std::vector<int32_t>{1});
  add("cap", {}, std::vector<int32_t>{4});
  file.texts = {{"promises", "connected covered coupled maximal rest_frames rotations tissue_kept"}};
  return file;
}

// Its edges instead of its grid, and a tetrahedron for a skin.
io::ArrayFile small_graph() {
  io::ArrayFile file = small_state();
  std::erase_if(file.arrays, [](const Array& array) { return array.name == "nodes"; });
  file.arrays.push_back(make_array("edges", {3, 2}, std::vector<int32_t>{0, 1, 1, 2, 2, 3}));
  file.arrays.push_back(make_array("vertices", {4, 3}, std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
  file.arrays.push_back(make_array("triangles", {4, 3}, std::vector<int32_t>{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}));
  file.texts.clear();
  return file;
}

io::ArrayFile small_kick() {
  io::ArrayFile file;
  const std::vector<int64_t> shape = {2, 2, 3};
  std::vector<double> run(12, 0.0), kicked(24, 0.0);
  kicked[9] = kicked[22] = 1;  // along x, and along y
  file.arrays = {make_array("positions", shape, run),
                 make_array("kicked", {2, 2, 2, 3}, kicked),
                 make_array("again", shape, run),
                 make_array("piece", {2}, std::vector<int32_t>{0, 1}),
                 make_array("kicked_piece", {2}, std::vector<int32_t>{1, 1}),
                 make_array("directions", {2, 3}, std::vector<double>{1, 0, 0, 0, 1, 0}),
                 make_array("equal", {2}, std::vector<int32_t>{0, 0}),
                 make_array("tolerance", {}, std::vector<double>{1e-6}),
                 make_array("mass", {2}, std::vector<double>{1, 2}),
                 make_array("steps", {}, std::vector<int32_t>{1}),
                 make_array("time", {2}, std::vector<double>{0, 1})};
  return file;
}

constexpr io::ArrayFile (*kSmallFiles[])() = {small_state, small_graph, small_kick};

// As a kick if it looks like one, else as a state. Verdicts may be anything but silent.
void judge(const io::ArrayFile& contents) {
  std::vector<Verdict> verdicts;
  if (find_array(contents.arrays, "kicked") != nullptr) {
    verdicts = oracles::judge_kick(harness::recorded_kick_of(contents, "fed").runs).verdicts;
  } else {
    verdicts = harness::judge_foreign_state(harness::foreign_state_of(contents, "fed")).verdicts;
  }
  if (verdicts.empty()) broken_contract("there is no verdict");
  for (const Verdict& verdict : verdicts) {
    if (!verdict.holds && verdict.witness.text.empty()) broken_contract("a failure says nothing: " + verdict.property);
  }
}

// '0' and an NPZ file, '1' and an HDF5 file, or '2' to '4' and edits of one of the small files.
Outcome feed(std::string_view bytes) {
  if (bytes.empty() || bytes[0] < '0' || bytes[0] > '4') return Outcome::refused;
  return outcome_of([&] {
    io::ArrayFile contents;
    if (bytes[0] > '1') {
      contents = kSmallFiles[bytes[0] - '2']();
      edit(contents, bytes.substr(1));
    } else {
      write_scratch("fed.arrays", bytes.substr(1));
      contents = io::read_array_file(scratch_path("fed.arrays"));
      for (const char* const name : {"again.npz", "again.h5"}) {
        const auto is_ascii = [](const io::NamedText& text) {
          return std::all_of(text.text.begin(), text.text.end(), [](char c) { return c > 0; });
        };
        if (!std::all_of(contents.texts.begin(), contents.texts.end(), is_ascii)) break;
        io::write_array_file(scratch_path(name), contents);
        const io::ArrayFile again = io::read_array_file(scratch_path(name));
        for (const Array& array : contents.arrays) {
          const Array* const back = find_array(again.arrays, array.name);
          if (back == nullptr || !(*back == array))
            broken_contract("an array changes when it is written: " + array.name);
        }
      }
    }
    judge(contents);
  });
}

std::vector<std::string> seeds() {
  std::vector<std::string> seeds;
  for (std::size_t k = 0; k < std::size(kSmallFiles); ++k) {
    const io::ArrayFile file = kSmallFiles[k]();
    io::write_array_file(scratch_path("seed.npz"), file);
    io::write_array_file(scratch_path("seed.h5"), file);
    seeds.push_back("0" + bytes_of_file(scratch_path("seed.npz")));
    seeds.push_back("1" + bytes_of_file(scratch_path("seed.h5")));
    // An edit that leaves the file one that can be understood: another value.
    seeds.push_back(std::string(1, static_cast<char>('2' + k)) + std::string(kEditBytes, '\0'));
  }
  return seeds;
}

}  // namespace of_arrays

void edit(io::ArrayFile& file, std::string_view bytes) {
  for (; bytes.size() >= kEditBytes; bytes.remove_prefix(kEditBytes)) {
    if (file.arrays.empty()) return;
    const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(bytes[k]); };
    Array& array = file.arrays[byte(0) % file.arrays.size()];
    const auto each = static_cast<std::size_t>(size_of(array.type));
    switch (byte(1) % 4) {
      case 0:
        if (!array.bytes.empty()) {
          std::memcpy(array.bytes.data() + byte(2) % (array.bytes.size() / each) * each, bytes.data() + 3, each);
        }
        break;
      case 1:  // another number of rows
        if (!array.shape.empty()) {
          array.shape[0] = byte(2) % 8;
          array.bytes.resize(static_cast<std::size_t>(array.count()) * each);
        }
        break;
      case 2:  // the same bytes as another type
        array = Array{array.name, static_cast<ElementType>(1 + byte(2) % 5), {}, array.bytes};
        array.shape = {static_cast<int64_t>(array.bytes.size()) / size_of(array.type)};
        array.bytes.resize(static_cast<std::size_t>(array.count() * size_of(array.type)));
        break;
      default:
        file.arrays.erase(file.arrays.begin() + (&array - file.arrays.data()));
    }
  }
}

const Target kArrays = {"arrays", of_arrays::feed, of_arrays::seeds};

}  // namespace cutproof::input_fuzzing
