#include "model/io/setup_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <string_view>

#include "model/at.h"
#include "model/bare_graph.h"
#include "model/setup_fields.h"

namespace cutproof::io {
namespace {

using Defect = std::optional<SetupDefect>;

// --- Each number by itself: what model/setup_fields.h says of it ---

// The defect of a value, as the rest of a sentence that begins with its name; empty if there is none.
std::optional<std::string> problem_of(const SetupField& field, double value) {
  if (!std::isfinite(value)) return fmt::format("is {}, and should be finite.", value);
  if (field.above ? value > field.least : value >= field.least) return std::nullopt;
  if (field.least != 0) return fmt::format("is {}, and should be at least {}.", value, field.least);
  return fmt::format("is {}, and should {}.", value, field.above ? "be positive" : "not be negative");
}
template <class T>
std::optional<std::string> problem_of(const SetupField& field, const T& value) {
  if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, std::string> || std::is_enum_v<T>) {
    return std::nullopt;
  } else if constexpr (std::is_arithmetic_v<T>) {
    return problem_of(field, static_cast<double>(value));
  } else if constexpr (std::is_same_v<T, Vec3>) {
    return problem_of(field, std::array{value.x, value.y, value.z});
  } else if constexpr (std::is_same_v<T, Mat3>) {
    return problem_of(field, value.m);
  } else {  // std::array
    for (const auto& component : value) {
      if (auto problem = problem_of(field, component)) return problem;
    }
    return std::nullopt;
  }
}

template <class T>
Defect defect_in(const SetupField& field, const T& value) {
  if (const auto problem = problem_of(field, value)) {
    return SetupDefect{fmt::format("{}/{}", field.group, field.name), "This " + *problem};
  }
  return std::nullopt;
}
template <class T>
Defect defect_in(const SetupField& field, const std::vector<T>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if constexpr (is_list_of_entries<std::vector<T>>) {
      Defect defect;
      for_each_entry_field<T>([&](const SetupField& inner, auto get) {
        if (!defect) defect = defect_in(inner, get(values[i]));
      });
      if (defect) return SetupDefect{defect->field, fmt::format("Entry {}: {}", i, defect->problem)};
    } else if (const auto problem = problem_of(field, values[i])) {
      const std::string group = field.group.empty() ? "" : std::string(field.group) + "/";
      return SetupDefect{group + std::string(field.name), fmt::format("Entry {} {}", i, *problem)};
    }
  }
  return std::nullopt;
}

Defect number_defect(const Setup& setup) {
  Defect defect;
  for_each_setup_field([&](const SetupField& field, auto get) {
    if (!defect) defect = defect_in(field, get(setup));
  });
  return defect;
}

// --- How they belong together. Each number is already as it should be by itself. ---

Defect bare_graph_defect(const Setup& setup) {
  const Body& body = setup.body;
  if (!body.node.empty() || !body.particle_at.empty() || body.grid.nodes != std::array<int32_t, 3>{0, 0, 0}) {
    return SetupDefect{"body/edge_offsets", "A body has a grid or edges of its own, not both."};
  }
  if (body.mass.size() != body.rest.size()) {
    return SetupDefect{"body/mass",
                       fmt::format("This has {} entries for {} particles.", body.mass.size(), body.rest.size())};
  }
  if (!body.surface_crossing.empty()) return SetupDefect{"body/surface_crossing", "Only a body on a grid has these."};
  if (setup.skin.wanted) return SetupDefect{"skin/wanted", "A body without a grid has no skin."};
  if (std::string problem = problem_of_edges(body); !problem.empty()) {
    problem.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(problem.front())));
    return SetupDefect{"body/edge_ends", problem + "."};
  }
  return std::nullopt;
}

Defect grid_defect(const Body& body) {
  const auto& nodes = body.grid.nodes;
  // Compared by division: the product of three corrupted counts need not fit.
  int64_t rest = static_cast<int64_t>(body.particle_at.size());
  const int64_t plane = int64_t{nodes[0]} * nodes[1];
  if (plane == 0 || nodes[2] == 0 ? rest != 0 : rest % plane != 0 || rest / plane != nodes[2]) {
    return SetupDefect{"body/particle_at", fmt::format("This has {} entries, and the grid has {} × {} × {} nodes.",
                                                       rest, nodes[0], nodes[1], nodes[2])};
  }
  const std::size_t n = body.node.size();
  if (!body.rest.empty() || !body.edge_ends.empty()) {
    return SetupDefect{"body/rest", "A body has a grid or edges of its own, not both."};
  }
  if (n > static_cast<std::size_t>(std::numeric_limits<int32_t>::max())) {
    return SetupDefect{"body/node", "There are more particles than 32-bit numbers can name."};
  }
  if (body.mass.size() != n) {
    return SetupDefect{"body/mass", fmt::format("This has {} entries for {} particles.", body.mass.size(), n)};
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (body.node[i] >= rest) {
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
    if (body.particle_at[at(body.node[i])] != static_cast<int32_t>(i)) {
      return SetupDefect{"body/particle_at", fmt::format("The node of particle {} does not name it.", i)};
    }
  }
  const auto occupied =
      std::count_if(body.particle_at.begin(), body.particle_at.end(), [](int32_t p) { return p >= 0; });
  const auto empty = std::count(body.particle_at.begin(), body.particle_at.end(), -1);
  if (occupied != static_cast<std::ptrdiff_t>(n) || occupied + empty != rest) {
    return SetupDefect{"body/particle_at", "A node names a particle that does not exist."};
  }
  if (body.surface_crossing.empty()) return std::nullopt;
  if (body.surface_crossing.size() != 6 * n) {
    return SetupDefect{"body/surface_crossing",
                       fmt::format("This has {} entries for {} particles, and should have six for each or none.",
                                   body.surface_crossing.size(), n)};
  }
  for (std::size_t k = 0; k < body.surface_crossing.size(); ++k) {
    const int crossing = body.surface_crossing[k];
    if (crossing == 0) continue;
    if (crossing < kLeastCrossing || crossing > kGreatestCrossing) {
      return SetupDefect{"body/surface_crossing", fmt::format("Entry {} is {}, and should be 0 or from {} to {}.", k,
                                                              crossing, kLeastCrossing, kGreatestCrossing)};
    }
    if (body.neighbour(static_cast<int32_t>(k / 6), static_cast<int>(k % 6)) >= 0) {
      return SetupDefect{"body/surface_crossing",
                         fmt::format("Entry {} is {}, and the grid edge of particle {} leads to another particle.", k,
                                     crossing, k / 6)};
    }
  }
  return std::nullopt;
}

// Numbers of a mesh's axes are rounded some dozens of times; a reflection is off by 2.
Defect orientation_defect(const Mat3& m) {
  constexpr double kRounding = 1e-12;
  const std::array<Vec3, 3> row = {
      {{m(0, 0), m(0, 1), m(0, 2)}, {m(1, 0), m(1, 1), m(1, 2)}, {m(2, 0), m(2, 1), m(2, 2)}}};
  const double off = std::max({std::abs(norm(row[0]) - 1), std::abs(norm(row[1]) - 1), std::abs(dot(row[0], row[1])),
                               norm(cross(row[0], row[1]) - row[2])});
  if (off <= kRounding) return std::nullopt;
  return SetupDefect{"body/orientation", fmt::format("This is off by {:.3g} from a rotation.", off)};
}

Defect parameter_defect(const Setup& setup) {
  if (setup.step.solver == Solver::published && setup.step.acceleration != Acceleration::none) {
    return SetupDefect{"step/acceleration", "The solver \"published\" has no acceleration."};
  }
  if (setup.step.solver == Solver::published && setup.step.retardation != 0) {
    return SetupDefect{"step/retardation", "The solver \"published\" has no elastic modulus, and so no viscosity."};
  }
  if (setup.step.volume_share != 0 && (setup.step.solver == Solver::published || !(setup.step.volume_share < 1))) {
    return SetupDefect{"step/volume_share", "This should be below 1, and 0 with the solver \"published\"."};
  }
  if (setup.detect.criterion != Criterion::distance && setup.detect.remove != RemovedEnds::both) {
    return SetupDefect{"detect/remove", fmt::format("The criterion \"{}\" judges particles, not edges.",
                                                    name_of(setup.detect.criterion))};
  }
  for (const Wall& wall : setup.walls) {
    if (wall.axis > 2) {
      return SetupDefect{"walls/axis", fmt::format("An axis is {}, and should be 0, 1 or 2.", wall.axis)};
    }
    if (wall.side != 1 && wall.side != -1) {
      return SetupDefect{"walls/side", fmt::format("A side is {}, and should be 1 or -1.", wall.side)};
    }
    for (const Wall& other : setup.walls) {
      if (!leave_no_room(wall, other)) continue;
      return SetupDefect{"walls/offset", fmt::format("Two walls across axis {} leave no room.", wall.axis)};
    }
  }
  return std::nullopt;
}

Defect schedule_defect(const Setup& setup) {
  const std::size_t substeps = setup.substep_length.size() * static_cast<std::size_t>(setup.step.substeps);
  if (setup.blade_moves.size() != (setup.has_blade ? substeps : 0)) {
    return SetupDefect{"blade_moves", fmt::format("There are {} moves of the blade, and there should be {}.",
                                                  setup.blade_moves.size(), setup.has_blade ? substeps : 0)};
  }
  for (const int64_t frame : setup.stroke_end) {
    if (frame >= setup.frame_count()) {
      return SetupDefect{"stroke_end", fmt::format("A stroke ends with frame {}, and there are {} frames.", frame,
                                                   setup.frame_count())};
    }
  }
  for (std::size_t g = 0; g < setup.grips.size(); ++g) {
    const Grip& grip = setup.grips[g];
    if (grip.active.size() != substeps || grip.displacement.size() != substeps) {
      return SetupDefect{"grips", fmt::format("Grip {} has {} and {} entries for {} substeps.", g, grip.active.size(),
                                              grip.displacement.size(), substeps)};
    }
    for (std::size_t i = 0; i < grip.particles.size(); ++i) {
      if (grip.particles[i] >= setup.body.particle_count()) {
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
  }
  return std::nullopt;
}

}  // namespace

std::optional<SetupDefect> defect_of(const Setup& setup) {
  if (Defect defect = number_defect(setup)) return defect;
  if (Defect defect = orientation_defect(setup.body.orientation)) return defect;
  if (Defect defect = setup.body.on_grid() ? grid_defect(setup.body) : bare_graph_defect(setup)) return defect;
  if (Defect defect = parameter_defect(setup)) return defect;
  return schedule_defect(setup);
}

}  // namespace cutproof::io
