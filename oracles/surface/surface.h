// Properties of the skin that CGAL decides: a second opinion on its shells, and its shape at rest. Target
// cutproof_surface_oracles links CGAL's mesh processing, which is under the GPL.
#pragma once
#include <optional>

#include "oracles/oracles.h"
#include "oracles/shells.h"

namespace cutproof::oracles {

const PropertyList& surface_properties();

// All there is: core_properties() and surface_properties().
PropertyLists properties();

// At rest (every X_v from the owner's rest position): no degenerate or self-intersecting triangle, outward, shells =
// components + cavities (18 neighbours), Euler number, volume between bounds. Costs about 10 ms on 3,000 triangles.
inline constexpr StateOracle skin_geometry{surface_properties, "skin geometry"};

// Triangles joined at their edges; by sign of the volume at `position`. Nothing if the triangles are no surface.
std::optional<ShellCount> skin_shells(const Skin& skin);

}  // namespace cutproof::oracles
