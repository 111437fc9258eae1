// Bounds of the volume of a skin at rest (tolerances.md, "Volume of the skin"). Internal to oracles/.
#pragma once
#include <cstdint>
#include <vector>

#include "model/setup.h"

namespace cutproof::oracles {

struct VolumeRange {
  double low = 0, high = 0;  // [h³]
  void add(const VolumeRange& other, double times = 1) {
    low += times * other.low;
    high += times * other.high;
  }
};

// Whether all vertices lie equally far from their owners. Then so do those of all cells of a pattern.
bool lie_alike(const Skin& skin);

// Least and greatest volume under any triangulation of the cells' polygons. `tissue`: [node_count] 1 where an alive
// particle sits.
VolumeRange tissue_volume(const Setup& setup, const Skin& skin, const std::vector<uint8_t>& tissue);

}  // namespace cutproof::oracles
