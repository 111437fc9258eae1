#include "model/io/vtkhdf.h"

#include <algorithm>
#include <array>

namespace cutproof::io {
namespace {

constexpr std::array<const char*, 4> kCellGroups = {"Vertices", "Lines", "Polygons", "Strips"};

}  // namespace

PolyDataFile::PolyDataFile(const std::string& path, Cells cells) : file_(hdf5::File::create(path)), cells_(cells) {
  root_ = hdf5::create_group(file_.id(), "VTKHDF");
  hdf5::write_attribute(root_.get(), "Version", std::array<int64_t, 2>{2, 0});
  hdf5::write_text_attribute(root_.get(), "Type", "PolyData");
  points_ = hdf5::Table::create(root_.get(), "Points", hdf5::layout_of<Vec3>());
  point_data_ = hdf5::create_group(root_.get(), "PointData");
  const hdf5::Id group = hdf5::create_group(root_.get(), kCellGroups[static_cast<std::size_t>(cells)]);
  // 64 bits: VTK needs offsets and connectivity to be of one type.
  offsets_ = hdf5::Table::create(group.get(), "Offsets", hdf5::layout_of<int64_t>());
  connectivity_ = hdf5::Table::create(group.get(), "Connectivity", hdf5::layout_of<int64_t>());
}

PolyDataFile::Part PolyDataFile::add_part(int64_t point_count, std::span<const int64_t> offsets,
                                          std::span<const int64_t> connectivity) {
  first_cell_.push_back(cells_of_.empty() ? 0 : first_cell_.back() + cells_of_.back());
  offsets_.append(std::as_bytes(offsets));
  first_connectivity_.push_back(connectivity_.append(std::as_bytes(connectivity)));
  points_of_.push_back(point_count);
  cells_of_.push_back(static_cast<int64_t>(offsets.size()) - 1);
  connectivity_of_.push_back(static_cast<int64_t>(connectivity.size()));
  return static_cast<Part>(points_of_.size()) - 1;
}

void PolyDataFile::finish(const std::vector<Step>& given) {
  // No step at all is not foreseen by the format (readers divide by their number): then there is one, with nothing.
  std::vector<Step> steps = given;
  if (steps.empty()) steps.push_back({0, kNothing, 0, std::vector<int64_t>(data_names_.size(), 0)});

  // Where the offsets of a part begin is not stored in the file. VTK of 2023 takes CellOffsets + PartOffsets; since
  // 2024 it counts the parts before it until their cells add up to CellOffsets, and so passes over parts without
  // cells. The two agree if no part without cells stands before one that has some: the part of nothing comes last.
  if (std::any_of(steps.begin(), steps.end(), [](const Step& step) { return step.part == kNothing; })) {
    const std::array<int64_t, 1> no_cells = {0};
    const Part nothing = add_part(0, no_cells, {});
    for (Step& step : steps) {
      if (step.part == kNothing) step.part = nothing;
    }
  }

  const std::vector<int64_t> zeros(points_of_.size(), 0);
  hdf5::write_table(root_.get(), "NumberOfPoints", points_of_);
  for (std::size_t kind = 0; kind < kCellGroups.size(); ++kind) {
    const bool ours = kind == static_cast<std::size_t>(cells_);
    const hdf5::Id group = hdf5::group_in(root_.get(), kCellGroups[kind]);
    hdf5::write_table(group.get(), "NumberOfCells", ours ? cells_of_ : zeros);
    hdf5::write_table(group.get(), "NumberOfConnectivityIds", ours ? connectivity_of_ : zeros);
    if (ours) continue;
    hdf5::write_table(group.get(), "Offsets", zeros);  // a part without cells has one offset
    hdf5::write_table(group.get(), "Connectivity", std::vector<int64_t>());
  }

  std::vector<double> values;
  std::vector<int64_t> part_offsets, point_offsets;
  std::vector<std::array<int64_t, 4>> cell_offsets, connectivity_offsets;
  for (const Step& step : steps) {
    const auto part = static_cast<std::size_t>(step.part), kind = static_cast<std::size_t>(cells_);
    values.push_back(step.time);
    part_offsets.push_back(step.part);
    point_offsets.push_back(step.point_row);
    cell_offsets.emplace_back()[kind] = first_cell_[part];
    connectivity_offsets.emplace_back()[kind] = first_connectivity_[part];
  }
  const hdf5::Id group = hdf5::create_group(root_.get(), "Steps");
  hdf5::write_attribute(group.get(), "NSteps", static_cast<int64_t>(steps.size()));
  hdf5::write_table(group.get(), "Values", values);
  hdf5::write_table(group.get(), "PartOffsets", part_offsets);
  hdf5::write_table(group.get(), "NumberOfParts", std::vector<int64_t>(steps.size(), 1));
  hdf5::write_table(group.get(), "PointOffsets", point_offsets);
  hdf5::write_table(group.get(), "CellOffsets", cell_offsets);
  hdf5::write_table(group.get(), "ConnectivityIdOffsets", connectivity_offsets);
  const hdf5::Id data_group = hdf5::create_group(group.get(), "PointDataOffsets");
  for (std::size_t d = 0; d < data_names_.size(); ++d) {
    std::vector<int64_t> rows;
    for (const Step& step : steps) rows.push_back(step.data_rows[d]);
    hdf5::write_table(data_group.get(), data_names_[d], rows);
  }

  points_.close();
  offsets_.close();
  connectivity_.close();
  point_data_ = {};
  root_ = {};
  file_.close();
}

}  // namespace cutproof::io
