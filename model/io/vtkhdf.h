// Writes one temporal VTKHDF 2.0 file of type PolyData: points, one kind of cells, and data on the points, for each
// of a growing number of steps. What did not change is written once and shared by steps through offsets.
// Layout: docs/reference/recording.md, and https://docs.vtk.org, VTKHDF File Format.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "model/io/hdf5_file.h"
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

}  // namespace cutproof::io
