#include "harness/depth.h"

#include "oracles/surface/surface.h"

namespace cutproof::harness {

std::optional<Depth> depth_named(std::string_view name) {
  for (const Depth depth : {Depth::topology, Depth::motion}) {
    if (name == name_of(depth)) return depth;
  }
  return std::nullopt;
}

oracles::PropertyLists properties_of(Depth depth) {
  if (depth == Depth::motion) return oracles::properties();
  return {&oracles::core_properties(), &oracles::surface_properties()};
}

}  // namespace cutproof::harness
