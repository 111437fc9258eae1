// Writes one temporal VTKHDF 2.0 file of type PolyData: points, one kind of cells, and data on the points, for each of
// a growing number of steps. Unchanged data are written once and shared by steps through offsets. Layout:
// docs/reference/recording.md, and https://docs.vtk.org, VTKHDF File Format.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "model/io/hdf5_file.h"
#include "model/io/recording_archive.h"
#include "model/vec.h"

namespace cutproof::io {

class PolyDataFile {
 public:
  // The four kinds of cells of PolyData, in the order of the format.
  enum class Cells { vertices, lines, polygons, strips };

  // A part: how many points, and which cells on them. Its points are chosen per step.
  using Part = int64_t;
  static constexpr Part kNothing = -1;  // no points, no cells

  struct Step {
    double time = 0;  // [s]
    Part part = kNothing;
    int64_t point_row = 0;           // first row in points()
    std::vector<int64_t> data_rows;  // first row in each point data, in the order of their making
  };

  // Throws hdf5::Error, as all the others do.
  PolyDataFile(const std::string& path, Cells cells);

  hid_t id() const { return file_.id(); }
  // Rows of three float64; closed by finish().
  hdf5::Table& points() { return points_; }
  hdf5::Table make_point_data(const std::string& name, const hdf5::Layout& row) {
    data_names_.push_back(name);
    return hdf5::Table::create(point_data_.get(), name, row);
  }
  // Cell k has the points connectivity[offsets[k] .. offsets[k + 1]), counted within the part.
  Part add_part(int64_t point_count, std::span<const int64_t> offsets, std::span<const int64_t> connectivity);
  // Rows of the first point index of each part in the table of connectivity.
  int64_t first_connectivity(Part part) const { return first_connectivity_[static_cast<std::size_t>(part)]; }

  // Writes the tables of parts and steps and closes the file. The tables handed out must be closed before.
  void finish(const std::vector<Step>& steps);

 private:
  hdf5::File file_;
  Cells cells_;
  hdf5::Id root_, point_data_;
  hdf5::Table points_;
  hdf5::Table offsets_, connectivity_;
  std::vector<std::string> data_names_;
  // By part: how many points, cells and entries of connectivity, and the rows in which the latter two begin.
  std::vector<int64_t> points_of_, cells_of_, connectivity_of_, first_cell_, first_connectivity_;
};

// Expected contents of a step of such a file, known from the index.
struct ShownStep {
  double time = 0;                   // [s]
  int64_t points = 0, cells = 0;     // of the step's part
  std::optional<int64_t> point_row;  // first row of each; nothing: wherever the same is stored
  std::optional<int64_t> corner_row;
  std::vector<std::optional<int64_t>> data_rows;  // in the order of `data_names`
};

// Where a file has what its steps show: first rows, by step.
struct ShownRows {
  std::vector<int64_t> points, corners;
  std::vector<std::vector<int64_t>> data;  // by name
};

// Holds all tables of parts and steps of a file against `steps`: each of its cells has `corners` corners. Throws
// hdf5::Error, which names the entry and both values. Nothing if the file has no steps: then it shows nothing.
std::optional<ShownRows> require_steps(const ReadingArchive& file, PolyDataFile::Cells cells, int64_t corners,
                                       const std::vector<std::string>& data_names, const std::vector<ShownStep>& steps);

// Calls see(i, entry) for `count` entries of a table of T from `first`, some at a time. Throws hdf5::Error if they are
// not all there.
template <class T, class See>
void for_each_entry(const ReadingArchive& group, const std::string& name, int64_t first, int64_t count,
                    const See& see) {
  constexpr int64_t kAtOnce = int64_t{1} << 14;
  const hdf5::Table table = group.table(name, hdf5::layout_of<T>());
  if (first < 0 || count < 0 || count > table.rows() || first > table.rows() - count) {
    throw hdf5::Error(group.path_of(name), fmt::format("{} rows from {} on are not among the {} that are stored.",
                                                       count, first, table.rows()));
  }
  std::vector<T> some;
  for (int64_t done = 0; done < count; done += std::ssize(some)) {
    some.resize(static_cast<std::size_t>(std::min(kAtOnce, count - done)));
    table.read(first + done, std::ssize(some), some.data());
    for (std::size_t k = 0; k < some.size(); ++k) see(done + static_cast<int64_t>(k), some[k]);
  }
}
// Throws hdf5::Error, which names the entry and both values, unless they are the same.
template <class T>
void require_entry(const std::string& path, int64_t i, const T& found, const T& wanted) {
  if (found == wanted) return;
  throw hdf5::Error(path, fmt::format("Entry {} is {}, and the rest of the recording makes it {}.", i, found, wanted));
}

}  // namespace cutproof::io
