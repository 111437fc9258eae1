#include "model/io/recording_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "model/io/recording_archive.h"

namespace cutproof::io {
namespace {

constexpr std::array<std::string_view, 2> kSolverNames = {"implicit", "published"};
constexpr std::array<std::string_view, 2> kAccelerationNames = {"none", "chebyshev"};
constexpr std::array<std::string_view, 4> kCriterionNames = {"none", "distance", "geometric", "strain"};
constexpr std::array<std::string_view, 4> kMergeRuleNames = {"none", "deterministic", "published", "single_pass"};
constexpr std::array<std::string_view, 3> kExpandRuleNames = {"none", "edge_cover", "published"};

// Lists of structs lie in the file as one array per field.
struct WallColumns {
  std::vector<int32_t> axis, side;
  std::vector<double> offset, friction;
};

WallColumns columns_of(const std::vector<Wall>& walls) {
  WallColumns columns;
  for (const Wall& wall : walls) {
    columns.axis.push_back(wall.axis);
    columns.side.push_back(wall.side);
    columns.offset.push_back(wall.offset);
    columns.friction.push_back(wall.friction);
  }
  return columns;
}

void require_equal_length(std::initializer_list<std::size_t> sizes, const std::string& group) {
  if (std::adjacent_find(sizes.begin(), sizes.end(), std::not_equal_to<>()) != sizes.end()) {
    throw hdf5::Error(group, "The arrays of this group should be of equal length.");
  }
}

std::vector<Wall> walls_of(const WallColumns& columns) {
  require_equal_length({columns.axis.size(), columns.side.size(), columns.offset.size(), columns.friction.size()},
                       "/setup/walls");
  std::vector<Wall> walls;
  for (std::size_t i = 0; i < columns.axis.size(); ++i) {
    walls.push_back({columns.axis[i], columns.side[i], columns.offset[i], columns.friction[i]});
  }
  return walls;
}

struct GripColumns {
  std::vector<int64_t> particle_offsets = {0};  // [grips + 1]
  std::vector<int32_t> particles;
  std::vector<uint8_t> active;     // [grips · frames · substeps]
  std::vector<Vec3> displacement;  // [grips · frames · substeps]
};

GripColumns columns_of(const std::vector<Grip>& grips) {
  GripColumns columns;
  for (const Grip& grip : grips) {
    columns.particles.insert(columns.particles.end(), grip.particles.begin(), grip.particles.end());
    columns.particle_offsets.push_back(static_cast<int64_t>(columns.particles.size()));
    columns.active.insert(columns.active.end(), grip.active.begin(), grip.active.end());
    columns.displacement.insert(columns.displacement.end(), grip.displacement.begin(), grip.displacement.end());
  }
  return columns;
}

std::vector<Grip> grips_of(const GripColumns& columns) {
  const auto& offsets = columns.particle_offsets;
  if (offsets.empty() || offsets.front() != 0 || !std::is_sorted(offsets.begin(), offsets.end()) ||
      offsets.back() != static_cast<int64_t>(columns.particles.size())) {
    throw hdf5::Error("/setup/grips/particle_offsets",
                      "These offsets should rise from 0 to the length of `particles` without ever falling.");
  }
  const std::size_t count = offsets.size() - 1;
  const std::size_t substeps = count == 0 ? 0 : columns.active.size() / count;
  require_equal_length({columns.active.size(), columns.displacement.size(), substeps * count}, "/setup/grips");
  std::vector<Grip> grips(count);
  for (std::size_t g = 0; g < count; ++g) {
    grips[g].particles.assign(columns.particles.begin() + offsets[g], columns.particles.begin() + offsets[g + 1]);
    const auto from = static_cast<std::ptrdiff_t>(g * substeps), to = static_cast<std::ptrdiff_t>((g + 1) * substeps);
    grips[g].active.assign(columns.active.begin() + from, columns.active.begin() + to);
    grips[g].displacement.assign(columns.displacement.begin() + from, columns.displacement.begin() + to);
  }
  return grips;
}

struct MoveColumns {
  std::vector<Vec3> from_edge, from_along, from_back, to_edge, to_along, to_back;
  std::vector<uint8_t> down;
  std::vector<int32_t> stroke;
};

MoveColumns columns_of(const std::vector<BladeMove>& moves) {
  MoveColumns columns;
  for (const BladeMove& move : moves) {
    columns.from_edge.push_back(move.from.edge);
    columns.from_along.push_back(move.from.along);
    columns.from_back.push_back(move.from.back);
    columns.to_edge.push_back(move.to.edge);
    columns.to_along.push_back(move.to.along);
    columns.to_back.push_back(move.to.back);
    columns.down.push_back(move.down);
    columns.stroke.push_back(move.stroke);
  }
  return columns;
}

std::vector<BladeMove> moves_of(const MoveColumns& columns) {
  require_equal_length(
      {columns.from_edge.size(), columns.from_along.size(), columns.from_back.size(), columns.to_edge.size(),
       columns.to_along.size(), columns.to_back.size(), columns.down.size(), columns.stroke.size()},
      "/setup/blade_moves");
  std::vector<BladeMove> moves;
  for (std::size_t i = 0; i < columns.down.size(); ++i) {
    if (columns.down[i] > 1) throw hdf5::Error("/setup/blade_moves/down", "These should be 0 or 1.");
    moves.push_back({{columns.from_edge[i], columns.from_along[i], columns.from_back[i]},
                     {columns.to_edge[i], columns.to_along[i], columns.to_back[i]},
                     columns.down[i] == 1,
                     columns.stroke[i]});
  }
  return moves;
}

// The whole of /setup. S is Setup or const Setup.
template <class Archive, class S>
void walk(Archive& archive, S& setup) {
  archive.group("body", [&](auto& a) {
    a.text("name", setup.body.name);
    a.value("nodes", setup.body.grid.nodes);
    a.value("spacing", setup.body.grid.spacing);
    a.value("origin", setup.body.origin);
    a.value("orientation", setup.body.orientation);
    a.array("node", setup.body.node);
    a.array("particle_at", setup.body.particle_at);
    a.array("mass", setup.body.mass);
  });
  archive.group("step", [&](auto& a) {
    a.choice("solver", setup.step.solver, kSolverNames);
    a.value("substeps", setup.step.substeps);
    a.value("iterations", setup.step.iterations);
    a.value("stiffness", setup.step.stiffness);
    a.value("relaxation", setup.step.relaxation);
    a.later_choice("acceleration", setup.step.acceleration, kAccelerationNames);
    a.value("damping", setup.step.damping);
    a.value("gravity", setup.step.gravity);
  });
  archive.group("detect", [&](auto& a) {
    a.choice("criterion", setup.detect.criterion, kCriterionNames);
    a.value("epsilon", setup.detect.epsilon);
    a.value("strain", setup.detect.strain);
    a.flag("without_blade", setup.detect.without_blade);
  });
  archive.group("split", [&](auto& a) { a.value("debris", setup.split.debris); });
  archive.group("merge", [&](auto& a) { a.choice("rule", setup.merge.rule, kMergeRuleNames); });
  archive.group("expand", [&](auto& a) {
    a.choice("rule", setup.expand.rule, kExpandRuleNames);
    a.value("depth", setup.expand.depth);
  });
  archive.group("skin", [&](auto& a) {
    a.flag("wanted", setup.skin.wanted);
    a.value("alpha", setup.skin.alpha);
  });
  archive.group("walls", [&](auto& a) {
    WallColumns columns = columns_of(setup.walls);
    a.array("axis", columns.axis);
    a.array("side", columns.side);
    a.array("offset", columns.offset);
    a.array("friction", columns.friction);
    if constexpr (Archive::kReading) setup.walls = walls_of(columns);
  });
  archive.group("grips", [&](auto& a) {
    GripColumns columns = columns_of(setup.grips);
    a.array("particle_offsets", columns.particle_offsets);
    a.array("particles", columns.particles);
    a.array("active", columns.active);
    a.array("displacement", columns.displacement);
    if constexpr (Archive::kReading) setup.grips = grips_of(columns);
  });
  archive.group("blade", [&](auto& a) {
    a.flag("present", setup.has_blade);
    a.value("length", setup.blade.length);
    a.value("depth", setup.blade.depth);
    a.value("thickness", setup.blade.thickness);
    a.value("friction", setup.blade.friction);
  });
  archive.group("blade_moves", [&](auto& a) {
    MoveColumns columns = columns_of(setup.blade_moves);
    a.array("from_edge", columns.from_edge);
    a.array("from_along", columns.from_along);
    a.array("from_back", columns.from_back);
    a.array("to_edge", columns.to_edge);
    a.array("to_along", columns.to_along);
    a.array("to_back", columns.to_back);
    a.array("down", columns.down);
    a.array("stroke", columns.stroke);
    if constexpr (Archive::kReading) setup.blade_moves = moves_of(columns);
  });
  archive.array("substep_length", setup.substep_length);
  archive.array("stroke_end", setup.stroke_end);
}

using Defect = std::optional<SetupDefect>;

bool is_positive(double value) { return std::isfinite(value) && value > 0; }

Defect body_defect(const Body& body) {
  const auto& nodes = body.grid.nodes;
  if (*std::min_element(nodes.begin(), nodes.end()) < 0) return SetupDefect{"body/nodes", "A count is negative."};
  if (!is_positive(body.grid.spacing)) {
    return SetupDefect{"body/spacing", fmt::format("This is {}, and should be positive.", body.grid.spacing)};
  }
  // Compared by division: the product of three corrupted counts need not fit.
  int64_t rest = static_cast<int64_t>(body.particle_at.size());
  const int64_t plane = int64_t{nodes[0]} * nodes[1];
  if (plane == 0 || nodes[2] == 0 ? rest != 0 : rest % plane != 0 || rest / plane != nodes[2]) {
    return SetupDefect{"body/particle_at", fmt::format("This has {} entries, and the grid has {} × {} × {} nodes.",
                                                       rest, nodes[0], nodes[1], nodes[2])};
  }
  const std::size_t n = body.node.size();
  if (n > static_cast<std::size_t>(std::numeric_limits<int32_t>::max())) {
    return SetupDefect{"body/node", "There are more particles than 32-bit numbers can name."};
  }
  if (body.mass.size() != n) {
    return SetupDefect{"body/mass", fmt::format("This has {} entries for {} particles.", body.mass.size(), n)};
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (body.node[i] < 0 || body.node[i] >= rest) {
      return SetupDefect{"body/node", fmt::format("Particle {} is at node {}, outside the grid.", i, body.node[i])};
    }
    if (i > 0 && body.node[i] <= body.node[i - 1]) {
      return SetupDefect{"body/node", fmt::format("Nodes should ascend, and do not at particle {}.", i)};
    }
    const auto c = body.grid.coordinates(body.node[i]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (c[axis] == 0 || c[axis] == nodes[axis] - 1) {
        return SetupDefect{"body/node", fmt::format("Particle {} lies on the outer ring of nodes, which should be "
                                                    "empty.",
                                                    i)};
      }
    }
    if (!is_positive(body.mass[i])) {
      return SetupDefect{"body/mass",
                         fmt::format("The mass of particle {} is {}, and should be positive.", i, body.mass[i])};
    }
    if (body.particle_at[static_cast<std::size_t>(body.node[i])] != static_cast<int32_t>(i)) {
      return SetupDefect{"body/particle_at", fmt::format("The node of particle {} does not name it.", i)};
    }
  }
  const auto occupied =
      std::count_if(body.particle_at.begin(), body.particle_at.end(), [](int32_t p) { return p >= 0; });
  const auto empty = std::count(body.particle_at.begin(), body.particle_at.end(), -1);
  if (occupied != static_cast<std::ptrdiff_t>(n) || occupied + empty != rest) {
    return SetupDefect{"body/particle_at", "A node names a particle that is not there."};
  }
  if (!is_finite(body.origin)) return SetupDefect{"body/origin", "This should be finite."};
  if (!std::all_of(body.orientation.m.begin(), body.orientation.m.end(), [](double d) { return std::isfinite(d); })) {
    return SetupDefect{"body/orientation", "This should be finite."};
  }
  return std::nullopt;
}

Defect parameter_defect(const Setup& setup) {
  const std::pair<const char*, double> finite[] = {
      {"step/stiffness", setup.step.stiffness}, {"step/relaxation", setup.step.relaxation},
      {"step/damping", setup.step.damping},     {"step/gravity", setup.step.gravity.x},
      {"step/gravity", setup.step.gravity.y},   {"step/gravity", setup.step.gravity.z},
      {"detect/epsilon", setup.detect.epsilon}, {"detect/strain", setup.detect.strain},
      {"skin/alpha", setup.skin.alpha},         {"blade/length", setup.blade.length},
      {"blade/depth", setup.blade.depth},       {"blade/thickness", setup.blade.thickness},
      {"blade/friction", setup.blade.friction},
  };
  for (const auto& [field, value] : finite) {
    if (!std::isfinite(value)) return SetupDefect{field, fmt::format("This is {}, and should be finite.", value)};
  }
  if (setup.step.solver == Solver::published && setup.step.acceleration != Acceleration::none) {
    return SetupDefect{"step/acceleration", "The solver \"published\" has no acceleration."};
  }
  const std::pair<const char*, std::pair<int32_t, int32_t>> least[] = {
      {"step/substeps", {setup.step.substeps, 1}},
      {"step/iterations", {setup.step.iterations, 0}},
      {"split/debris", {setup.split.debris, 0}},
      {"expand/depth", {setup.expand.depth, 1}},
  };
  for (const auto& [field, value] : least) {
    if (value.first < value.second) {
      return SetupDefect{field, fmt::format("This is {}, and should be at least {}.", value.first, value.second)};
    }
  }
  const std::pair<const char*, double> not_negative[] = {
      {"blade/length", setup.blade.length},
      {"blade/depth", setup.blade.depth},
      {"blade/thickness", setup.blade.thickness},
      {"blade/friction", setup.blade.friction},
  };
  for (const auto& [field, value] : not_negative) {
    if (value < 0) return SetupDefect{field, fmt::format("This is {}, and should not be negative.", value)};
  }
  for (const Wall& wall : setup.walls) {
    if (wall.friction < 0) return SetupDefect{"walls/friction", "These should not be negative."};
    if (wall.axis < 0 || wall.axis > 2) {
      return SetupDefect{"walls/axis", fmt::format("An axis is {}, and should be 0, 1 or 2.", wall.axis)};
    }
    if (wall.side != 1 && wall.side != -1) {
      return SetupDefect{"walls/side", fmt::format("A side is {}, and should be 1 or -1.", wall.side)};
    }
    if (!std::isfinite(wall.offset)) return SetupDefect{"walls/offset", "These should be finite."};
    if (!std::isfinite(wall.friction)) return SetupDefect{"walls/friction", "These should be finite."};
  }
  return std::nullopt;
}

bool is_finite(const BladePose& pose) {
  return cutproof::is_finite(pose.edge) && cutproof::is_finite(pose.along) && cutproof::is_finite(pose.back);
}

Defect schedule_defect(const Setup& setup) {
  for (std::size_t f = 0; f < setup.substep_length.size(); ++f) {
    if (!is_positive(setup.substep_length[f])) {
      return SetupDefect{"substep_length",
                         fmt::format("In frame {} it is {}, and should be positive.", f, setup.substep_length[f])};
    }
  }
  const std::size_t substeps = setup.substep_length.size() * static_cast<std::size_t>(setup.step.substeps);
  if (setup.blade_moves.size() != (setup.has_blade ? substeps : 0)) {
    return SetupDefect{"blade_moves", fmt::format("There are {} moves of the blade, and there should be {}.",
                                                  setup.blade_moves.size(), setup.has_blade ? substeps : 0)};
  }
  for (const int64_t frame : setup.stroke_end) {
    if (frame < -1 || frame >= setup.frame_count()) {
      return SetupDefect{"stroke_end", fmt::format("A stroke ends with frame {}, and there are {} frames.", frame,
                                                   setup.frame_count())};
    }
  }
  for (const BladeMove& move : setup.blade_moves) {
    if (!is_finite(move.from) || !is_finite(move.to)) return SetupDefect{"blade_moves", "A pose is not finite."};
  }
  for (std::size_t g = 0; g < setup.grips.size(); ++g) {
    const Grip& grip = setup.grips[g];
    if (grip.active.size() != substeps || grip.displacement.size() != substeps) {
      return SetupDefect{"grips", fmt::format("Grip {} has {} and {} entries for {} substeps.", g, grip.active.size(),
                                              grip.displacement.size(), substeps)};
    }
    for (std::size_t i = 0; i < grip.particles.size(); ++i) {
      if (grip.particles[i] < 0 || grip.particles[i] >= setup.body.particle_count()) {
        return SetupDefect{"grips/particles", fmt::format("Grip {} holds particle {}, and there are {}.", g,
                                                          grip.particles[i], setup.body.particle_count())};
      }
      if (i > 0 && grip.particles[i] <= grip.particles[i - 1]) {
        return SetupDefect{"grips/particles", fmt::format("The particles of grip {} should ascend.", g)};
      }
    }
    if (!std::all_of(grip.active.begin(), grip.active.end(), [](uint8_t a) { return a <= 1; })) {
      return SetupDefect{"grips/active", "These should be 0 or 1."};
    }
    if (!std::all_of(grip.displacement.begin(), grip.displacement.end(),
                     [](Vec3 d) { return cutproof::is_finite(d); })) {
      return SetupDefect{"grips/displacement", "These should be finite."};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<SetupDefect> defect_of(const Setup& setup) {
  if (Defect defect = body_defect(setup.body)) return defect;
  if (Defect defect = parameter_defect(setup)) return defect;
  return schedule_defect(setup);
}

void write_setup(hid_t file, const Setup& setup) {
  WritingArchive root(file);
  root.group("setup", [&](auto& archive) { walk(archive, setup); });
}

Setup read_setup(hid_t file, uint64_t file_bytes) {
  Setup setup;
  const ReadingArchive root(file, "", file_bytes);
  root.group("setup", [&](auto& archive) { walk(archive, setup); });
  return setup;
}

}  // namespace cutproof::io
