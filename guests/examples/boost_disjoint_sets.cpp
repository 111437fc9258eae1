// Components by Boost's disjoint sets, with union by rank: the edges one after the other, without a graph.
#include <cutproof/plugin.h>

#include <boost/pending/disjoint_sets.hpp>

static int components(const cutproof_host*, void*, const cutproof_tissue* tissue, const cutproof_array* alive,
                      cutproof_array* label) {
  const auto* const offsets = static_cast<const int64_t*>(tissue->edge_offsets->data);
  const auto* const ends = static_cast<const int32_t*>(tissue->edge_ends->data);
  const auto* const living = static_cast<const uint8_t*>(alive->data);
  boost::disjoint_sets_with_storage<> sets(alive->rows);
  for (int64_t i = 0; i < alive->rows; ++i) sets.make_set(i);
  for (int64_t i = 0; i < alive->rows; ++i) {
    for (int64_t k = offsets[i]; k < offsets[i + 1]; ++k) {
      if (living[i] && living[ends[k]]) sets.union_set<int64_t>(i, ends[k]);
    }
  }
  for (int64_t i = 0; i < alive->rows; ++i) static_cast<int32_t*>(label->data)[i] = sets.find_set(i);
  return 0;
}

static const cutproof_plugin plugin = {
    .size = sizeof(cutproof_plugin),
    .abi = CUTPROOF_ABI,
    .name = "Boost's disjoint_sets",
    .components = components,
};
CUTPROOF_PLUGIN(plugin)
