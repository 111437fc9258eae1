// What a scene could do without, one part at a time.
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
  // Clusters are cooked by it, too: so that nothing else differs, a run without it begins with those of the scene as it
  // is.
  bool cooks = false;
};
// Those that `scene` has, in the order in which a frame comes to them. What is left of it has as many frames as before,
// `frames`, though it may end with what is left out; and without its blade what counts from the end of the last stroke
// still happens then (`strokes_end` [s]; none: the frames end before).
std::vector<ScenePart> parts_of(const Scene& scene, int64_t frames, std::optional<double> strokes_end);

}  // namespace cutproof::benchmarks
