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
  const std::size_t count = system.mass.size();
  std::size_t entries = count;
  for (const ClusterSystem::Shared& shared : system.shared) {
    entries += shared.clusters.size() * (shared.clusters.size() + 1) / 2;
  }
  const Triplets triplets(cholmod_allocate_triplet(count, count, entries, -1, CHOLMOD_REAL, cholmod.get()), cholmod);
  auto* rows = static_cast<int*>(triplets->i);
  auto* columns = static_cast<int*>(triplets->j);
  auto* values = static_cast<double*>(triplets->x);
  const auto add = [&](int32_t row, int32_t column, double value) {
    rows[triplets->nnz] = row;
    columns[triplets->nnz] = column;
    values[triplets->nnz++] = value;
  };
  for (const auto& [clusters, weight] : system.shared) {
    for (std::size_t p = 0; p < clusters.size(); ++p) {
      for (std::size_t q = 0; q <= p; ++q) add(clusters[p], clusters[q], -weight);
    }
  }
  for (std::size_t c = 0; c < count; ++c) add(static_cast<int32_t>(c), static_cast<int32_t>(c), system.mass[c]);
  return Sparse(cholmod_triplet_to_sparse(triplets.get(), triplets->nnz, cholmod.get()), cholmod);
}

}  // namespace cutproof::oracles
