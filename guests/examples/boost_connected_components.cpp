// Components by Boost.Graph: connected_components of the graph of living particles.
#include <cutproof/plugin.h>

#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/connected_components.hpp>

static int components(const cutproof_host*, void*, const cutproof_tissue* tissue, const cutproof_array* alive,
                      cutproof_array* label) {
  const auto* const offsets = static_cast<const int64_t*>(tissue->edge_offsets->data);
  const auto* const ends = static_cast<const int32_t*>(tissue->edge_ends->data);
  const auto* const living = static_cast<const uint8_t*>(alive->data);
  boost::adjacency_list<boost::vecS, boost::vecS, boost::undirectedS> graph(alive->rows);
  for (int64_t i = 0; i < alive->rows; ++i) {
    for (int64_t k = offsets[i]; k < offsets[i + 1]; ++k) {
      if (i < ends[k] && living[i] && living[ends[k]]) boost::add_edge(i, ends[k], graph);
    }
  }
  boost::connected_components(graph, static_cast<int32_t*>(label->data));
  return 0;
}

static const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
    .name = "Boost's connected_components",
    .components = components,
};
CUTPROOF_PLUGIN(plugin)
