// The optional parts of a scene, one at a time.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/scene.h"

namespace cutproof::benchmarks {

struct ScenePart {
  std::string name;  // docs/reference/schemas/bench_parts.json lists them
  Scene without;     // has everything else
  // Cooking depends on it, too. A run without it begins with the clusters of the full scene, so that nothing else
  // differs.
  bool cooks = false;
};
// The parts of `scene`, in their order in a frame. The rest of the scene keeps its `frames`, even if it could end
// earlier. Without its blade, events timed from the end of the last stroke still happen then (`strokes_end` [s]; none:
// the frames end before).
std::vector<ScenePart> parts_of(const Scene& scene, int64_t frames, std::optional<double> strokes_end);

}  // namespace cutproof::benchmarks
