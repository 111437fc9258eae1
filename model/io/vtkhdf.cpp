#include "model/io/vtkhdf.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>

#include "model/at.h"

namespace cutproof::io {
namespace {

constexpr std::array<const char*, 4> kCellGroups = {"Vertices", "Lines", "Polygons", "Strips"};
constexpr std::array<int64_t, 2> kVersion = {2, 0};
constexpr const char* kType = "PolyData";

}  // namespace

PolyDataFile::PolyDataFile(const std::string& path, Cells cells) : file_(hdf5::File::create(path)), cells_(cells) {
  root_ = hdf5::create_group(file_.id(), "VTKHDF");
  hdf5::write_attribute(root_.get(), "Version", kVersion);
  hdf5::write_text_attribute(root_.get(), "Type", kType);
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

  // The beginning of the offsets of a part is not stored in the file. VTK of 2023 takes CellOffsets + PartOffsets; VTK
  // of 2024 and newer counts the parts before it until their cells add up to CellOffsets, and so passes over parts
  // without cells. The two agree if no part without cells stands before one that has some: the part of nothing comes
  // last.
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

namespace {

// The parts of a file: how many points, and which rows of cells and corners.
struct Parts {
  std::vector<int64_t> points, cells, first_cell, first_corner;
};

void require_rows(const ReadingArchive& group, const std::string& name, int64_t found, int64_t wanted) {
  if (found == wanted) return;
  throw hdf5::Error(group.path_of(name), fmt::format("This has {} entries, and should have {}.", found, wanted));
}

// Cells of one kind, of which a part has `corners` corners each, or none.
void read_cells(const ReadingArchive& group, bool ours, int64_t corners, Parts& parts) {
  const auto count = std::ssize(parts.points);
  std::vector<int64_t> cells, ids;
  group("NumberOfCells", cells);
  group("NumberOfConnectivityIds", ids);
  require_rows(group, "NumberOfCells", std::ssize(cells), count);
  require_rows(group, "NumberOfConnectivityIds", std::ssize(ids), count);
  const int64_t stored = group.table("Offsets", hdf5::layout_of<int64_t>()).rows();
  int64_t all = 0;
  for (int64_t p = 0; p < count; ++p) {
    const int64_t found = cells[at(p)];
    if (!ours) require_entry<int64_t>(group.path_of("NumberOfCells"), p, found, 0);
    // Compared by division: a corrupted count times the corners need not fit.
    if (found < 0 || found >= stored || ids[at(p)] % corners != 0 || ids[at(p)] / corners != found) {
      throw hdf5::Error(group.path_of("NumberOfConnectivityIds"),
                        fmt::format("Entry {} is {}, for {} cells of {} corners.", p, ids[at(p)], found, corners));
    }
    if (ours) {
      parts.first_cell.push_back(all);
      parts.first_corner.push_back(all * corners);
    }
    all += found;
  }
  require_rows(group, "Offsets", stored, all + count);
  int64_t part = 0, cell = 0;  // each part has one more offset than cells
  for_each_entry<int64_t>(group, "Offsets", 0, stored, [&](int64_t i, int64_t offset) {
    require_entry(group.path_of("Offsets"), i, offset, corners * cell);
    const bool ends = cell == cells[at(part)];
    part += ends ? 1 : 0;
    cell = ends ? 0 : cell + 1;
  });
  require_rows(group, "Connectivity", group.table("Connectivity", hdf5::layout_of<int64_t>()).rows(), all * corners);
  if (ours) parts.cells = std::move(cells);
}

// Tables of parts and steps are read by entries, each of which must equal `wanted` for step i.
template <class T, class Wanted>
std::vector<T> read_steps(const ReadingArchive& group, const std::string& name, int64_t steps, const Wanted& wanted) {
  require_rows(group, name, group.table(name, hdf5::layout_of<T>()).rows(), steps);
  std::vector<T> values;
  for_each_entry<T>(group, name, 0, steps, [&](int64_t i, const T& value) {
    const std::optional<T> other = wanted(at(i));
    if (other) require_entry(group.path_of(name), i, value, *other);
    values.push_back(value);
  });
  return values;
}

}  // namespace

std::optional<ShownRows> require_steps(const ReadingArchive& file, PolyDataFile::Cells cells, int64_t corners,
                                       const std::vector<std::string>& data_names,
                                       const std::vector<ShownStep>& steps) {
  std::optional<ShownRows> rows;
  file.group("VTKHDF", [&](const ReadingArchive& root) {
    if (!root.has("Steps")) return;
    rows.emplace();
    std::array<int64_t, 2> version = {};
    std::string type;
    root("Version", version);
    root("Type", type);
    if (version != kVersion || type != kType) {
      throw hdf5::Error("/VTKHDF", fmt::format("This is {} of version {}.{}, and should be {} of version {}.{}.", type,
                                               version[0], version[1], kType, kVersion[0], kVersion[1]));
    }
    const auto kind = static_cast<std::size_t>(cells);
    const auto count = std::ssize(steps);
    Parts parts;
    root("NumberOfPoints", parts.points);
    for (std::size_t k = 0; k < kCellGroups.size(); ++k) {
      root.group(kCellGroups[k], [&](const ReadingArchive& group) { read_cells(group, k == kind, corners, parts); });
    }
    root.group("Steps", [&](const ReadingArchive& group) {
      int64_t found = 0;
      group("NSteps", found);
      if (found != count) {
        throw hdf5::Error(group.path_of("NSteps"),
                          fmt::format("This is {}, and the rest of the recording makes it {}.", found, count));
      }
      read_steps<double>(group, "Values", count, [&](std::size_t i) { return std::optional(steps[i].time); });
      read_steps<int64_t>(group, "NumberOfParts", count, [](std::size_t) { return std::optional<int64_t>(1); });
      const std::vector<int64_t> part =
          read_steps<int64_t>(group, "PartOffsets", count, [](std::size_t) { return std::optional<int64_t>(); });
      for (std::size_t i = 0; i < steps.size(); ++i) {
        const std::string name = group.path_of("PartOffsets");
        if (part[i] < 0 || part[i] >= std::ssize(parts.points)) {
          throw hdf5::Error(name,
                            fmt::format("Entry {} is {}, and there are {} parts.", i, part[i], parts.points.size()));
        }
        const int64_t points = parts.points[at(part[i])], of_part = parts.cells[at(part[i])];
        if (points == steps[i].points && of_part == steps[i].cells) continue;
        throw hdf5::Error(name, fmt::format("Entry {} leads to a part of {} points and {} cells, and the rest of the "
                                            "recording has {} and {}.",
                                            i, points, of_part, steps[i].points, steps[i].cells));
      }
      rows->points =
          read_steps<int64_t>(group, "PointOffsets", count, [&](std::size_t i) { return steps[i].point_row; });
      const auto of_kind = [&](const std::vector<int64_t>& first, std::size_t i) {
        std::array<int64_t, 4> wanted = {};
        wanted[kind] = first[at(part[i])];
        return std::optional(wanted);
      };
      read_steps<std::array<int64_t, 4>>(group, "CellOffsets", count,
                                         [&](std::size_t i) { return of_kind(parts.first_cell, i); });
      read_steps<std::array<int64_t, 4>>(group, "ConnectivityIdOffsets", count,
                                         [&](std::size_t i) { return of_kind(parts.first_corner, i); });
      for (std::size_t i = 0; i < steps.size(); ++i) {
        rows->corners.push_back(parts.first_corner[at(part[i])]);
        if (steps[i].corner_row && steps[i].cells > 0) {
          require_entry(group.path_of("ConnectivityIdOffsets"), static_cast<int64_t>(i), rows->corners.back(),
                        *steps[i].corner_row);
        }
      }
      group.group("PointDataOffsets", [&](const ReadingArchive& data) {
        for (std::size_t d = 0; d < data_names.size(); ++d) {
          rows->data.push_back(
              read_steps<int64_t>(data, data_names[d], count, [&](std::size_t i) { return steps[i].data_rows[d]; }));
        }
      });
    });
  });
  return rows;
}

}  // namespace cutproof::io
