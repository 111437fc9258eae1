// A plugin of a dual method, in REAL: surface nets, right or wrong as its parameters say.
#include "surface_nets.h"

#include <cutproof/plugin.h>

namespace {

std::string fault;

void* create(const cutproof_host*, const char* parameters) {
  fault = parameters != nullptr ? parameters : "";
  return &fault;
}

int surface(const cutproof_host* host, void*, const cutproof_tissue* tissue, const cutproof_array* alive,
            cutproof_array* vertices, cutproof_array* triangles) {
  const std::array<int32_t, 3> nodes = {tissue->nodes[0], tissue->nodes[1], tissue->nodes[2]};
  std::vector<uint8_t> living(static_cast<std::size_t>(nodes[0]) * static_cast<std::size_t>(nodes[1]) *
                              static_cast<std::size_t>(nodes[2]));
  const auto* const node = static_cast<const int32_t*>(tissue->node->data);
  for (int64_t i = 0; i < alive->rows; ++i) {
    living[static_cast<std::size_t>(node[3 * i] +
                                    int64_t{nodes[0]} * (node[3 * i + 1] + int64_t{nodes[1]} * node[3 * i + 2]))] =
        static_cast<const uint8_t*>(alive->data)[i];
  }
  const auto middle = [&](int64_t edge) {
    const int64_t low = edge / 3;
    surface_nets::Place place = {static_cast<double>(low % nodes[0]), static_cast<double>(low / nodes[0] % nodes[1]),
                                 static_cast<double>(low / nodes[0] / nodes[1])};
    place[static_cast<std::size_t>(edge % 3)] += 0.5;
    return place;
  };
  const surface_nets::Net net = surface_nets::make(nodes, living, middle, fault);
  if (host->grow(host, vertices, static_cast<int64_t>(net.vertices.size())) != 0) return 1;
  if (host->grow(host, triangles, static_cast<int64_t>(net.triangles.size())) != 0) return 1;
  auto* const places = static_cast<REAL*>(vertices->data);
  for (std::size_t v = 0; v < net.vertices.size(); ++v) {
    for (std::size_t k = 0; k < 3; ++k) {
      places[3 * v + k] = static_cast<REAL>(net.vertices[v][k]) * static_cast<REAL>(tissue->spacing);
    }
  }
  auto* const corners = static_cast<int32_t*>(triangles->data);
  for (std::size_t t = 0; t < net.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) corners[3 * t + k] = net.triangles[t][k];
  }
  return 0;
}

const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
    .name = "surface nets",
#ifdef PLUGIN_PROMISES
    .promises = PLUGIN_PROMISES,
#endif
    .real = sizeof(REAL) == 4 ? CUTPROOF_F32 : CUTPROOF_F64,
    .create = create,
    .surface = surface,
};

}  // namespace

CUTPROOF_PLUGIN(plugin)
