#include "oracles/comparison/cluster_system.h"

#include <unordered_map>

#include "oracles/support.h"

namespace cutproof::oracles {

namespace {

struct HashOfClusters {
  std::size_t operator()(const std::vector<int32_t>& clusters) const {
    uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
    for (const int32_t c : clusters) hash = (hash ^ static_cast<uint32_t>(c)) * 0x100000001b3;
    return hash;
  }
};

}  // namespace

ClusterSystem cluster_system(const Body& body, const Clusters& clusters, double s, const std::vector<uint8_t>& fixed) {
  ClusterSystem system;
  system.mass.assign(at(clusters.count()), 0.0);
  const Memberships memberships = memberships_of(clusters, body.particle_count());
  std::unordered_map<std::vector<int32_t>, std::size_t, HashOfClusters> index;
  std::vector<int32_t> key;
  std::size_t group = 0;
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    const auto of = memberships.of(i);
    if (of.empty()) continue;
    const double w = body.mass[at(i)] / static_cast<double>(of.size());
    for (const int32_t c : of) system.mass[at(c)] += w;
    if (fixed[at(i)] != 0) continue;
    if (!std::equal(of.begin(), of.end(), key.begin(), key.end())) {  // neighbours mostly lie in the same clusters
      key.assign(of.begin(), of.end());
      const auto [entry, is_new] = index.try_emplace(key, system.shared.size());
      if (is_new) system.shared.push_back({key, 0});
      group = entry->second;
    }
    system.shared[group].weight += s * w / static_cast<double>(of.size());
  }
  return system;
}

Sparse matrix_of(const ClusterSystem& system, Cholmod& cholmod) {
  std::vector<Entry> entries;
  for (const auto& [clusters, weight] : system.shared) {
    for (std::size_t p = 0; p < clusters.size(); ++p) {
      for (std::size_t q = 0; q <= p; ++q) entries.push_back({clusters[p], clusters[q], -weight});
    }
  }
  for (std::size_t c = 0; c < system.mass.size(); ++c) {
    entries.push_back({static_cast<int>(c), static_cast<int>(c), system.mass[c]});
  }
  return sparse_of(system.mass.size(), entries, cholmod);
}

}  // namespace cutproof::oracles
