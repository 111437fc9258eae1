#include "benchmarks/system_change.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "model/at.h"

namespace cutproof::benchmarks {

namespace {

using oracles::cluster_system;
using oracles::ClusterSystem;

// [clusters after] the row of each, and the origins of new rows.
std::vector<int32_t> rows_after(const Clusters& before, const Clusters& after, std::vector<int32_t>& origin) {
  std::map<std::vector<int32_t>, int32_t> same;
  std::map<int32_t, std::vector<int32_t>> memberships;  // of particles
  const auto list = [](const Clusters& clusters, int32_t c) {
    return std::vector<int32_t>(clusters.of(c).begin(), clusters.of(c).end());
  };
  for (int32_t c = 0; c < before.count(); ++c) same[list(before, c)] = c;
  std::vector<uint8_t> taken(at(before.count()), 0);
  std::vector<int32_t> row(at(after.count()), -1), others;
  for (int32_t c = 0; c < after.count(); ++c) {
    const auto found = same.find(list(after, c));
    if (found == same.end()) {
      others.push_back(c);
    } else {
      row[at(c)] = found->second;
      taken[at(found->second)] = 1;
    }
  }
  for (int32_t c = 0; c < before.count(); ++c) {
    if (taken[at(c)]) continue;
    for (const int32_t i : before.of(c)) memberships[i].push_back(c);
  }
  std::stable_sort(others.begin(), others.end(), [&](int32_t a, int32_t b) { return after.size(a) > after.size(b); });
  origin.resize(at(before.count()));
  std::iota(origin.begin(), origin.end(), 0);
  for (const int32_t c : others) {
    std::map<int32_t, int64_t> common;
    for (const int32_t i : after.of(c)) {
      const auto found = memberships.find(i);
      if (found == memberships.end()) continue;  // an expansion took it in
      for (const int32_t b : found->second) ++common[b];
    }
    const auto most = [](const auto& a, const auto& b) { return a.second < b.second; };
    const auto from = std::max_element(common.begin(), common.end(), most);
    const int32_t parent = from == common.end() ? 0 : from->first;
    if (from != common.end() && taken[at(parent)] == 0) {
      row[at(c)] = parent;
      taken[at(parent)] = 1;
    } else {
      row[at(c)] = static_cast<int32_t>(origin.size());
      origin.push_back(parent);
    }
  }
  return row;
}

// The same system in other rows; a row that nothing lies in has the mass `empty`.
ClusterSystem in_rows(const ClusterSystem& system, const std::vector<int32_t>& row, std::size_t rows, double empty) {
  ClusterSystem result;
  result.mass.assign(rows, empty);
  for (std::size_t c = 0; c < row.size(); ++c) result.mass[at(row[c])] = system.mass[c];
  for (auto [clusters, weight] : system.shared) {
    for (int32_t& c : clusters) c = row[at(c)];
    std::sort(clusters.begin(), clusters.end());
    result.shared.push_back({std::move(clusters), weight});
  }
  return result;
}

}  // namespace

SystemDifferences differences(const SystemChange& change) {
  // Sums of the same terms in another order are not a difference.
  constexpr double kSame = 1e-12;
  std::map<std::vector<int32_t>, std::pair<double, double>> weights;
  for (const auto& [clusters, weight] : change.before.shared) weights[clusters].first = weight;
  for (const auto& [clusters, weight] : change.after.shared) weights[clusters].second = weight;
  SystemDifferences found;
  for (const auto& [clusters, weight] : weights) {
    const double difference = weight.second - weight.first;
    if (std::abs(difference) > kSame * std::max(weight.first, weight.second)) {
      found.shared.push_back({clusters, difference});
    }
  }
  for (std::size_t r = 0; r < change.before.mass.size(); ++r) {
    const double difference = change.after.mass[r] - change.before.mass[r];
    if (std::abs(difference) > kSame * change.before.mass[r]) {
      found.mass.emplace_back(static_cast<int32_t>(r), difference);
    }
  }
  return found;
}

SystemChange change_of(const Body& body, const State& before, const State& after, double s) {
  const std::vector<uint8_t> fixed(body.node.size(), 0);
  const ClusterSystem first = cluster_system(body, before.clusters, s, fixed);
  const ClusterSystem second = cluster_system(body, after.clusters, s, fixed);
  SystemChange change;
  change.s = s;
  const std::vector<int32_t> row = rows_after(before.clusters, after.clusters, change.origin);
  std::vector<int32_t> kept(first.mass.size());
  std::iota(kept.begin(), kept.end(), 0);
  const std::size_t rows = change.origin.size();
  const double mean = std::accumulate(first.mass.begin(), first.mass.end(), 0.0) / static_cast<double>(rows);
  change.before = in_rows(first, kept, rows, mean);
  change.after = in_rows(second, row, rows, mean);
  change.new_rows = static_cast<int32_t>(rows - first.mass.size());
  const SystemDifferences found = differences(change);
  std::vector<uint8_t> differs(rows, 0);
  for (const auto& [clusters, weight] : found.shared) {
    for (const int32_t r : clusters) differs[at(r)] = 1;
  }
  for (const auto& [r, mass] : found.mass) differs[at(r)] = 1;
  for (std::size_t r = 0; r < rows; ++r) {
    if (differs[r]) change.changed.push_back(static_cast<int32_t>(r));
  }
  return change;
}

}  // namespace cutproof::benchmarks
