#include "harness/depth.h"

#include "oracles/surface/surface.h"

namespace cutproof::harness {

std::optional<Depth> depth_named(std::string_view name) {
  for (const Depth depth : {Depth::topology, Depth::motion}) {
    if (name == name_of(depth)) return depth;
  }
  return std::nullopt;
}

oracles::PropertyLists properties_of(Depth) {
  // No list is of the motion alone yet: linear momentum, component momentum and motion cost as little as the rest.
  return oracles::properties();
}

}  // namespace cutproof::harness
