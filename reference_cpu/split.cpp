// Split (method.md §5): a cluster that lost particles becomes the connected components of its rest.
#include <algorithm>
#include <utility>

#include "reference_cpu/append_cluster.h"
#include "reference_cpu/reference.h"

namespace cutproof::reference {
namespace {

// Components of the subgraph of G induced by a set of particles: each ascending, ordered by smallest particle.
// Reusable, so that one set costs no more than its own size.
class ComponentSearch {
 public:
  ComponentSearch(const Body& body, const std::vector<uint8_t>& alive)
      : body_(body), alive_(alive), waiting_(static_cast<std::size_t>(body.particle_count()), 0) {}

  // `particles`: ascending; dead ones are skipped.
  std::vector<std::vector<int32_t>> components_of(std::span<const int32_t> particles) {
    for (const int32_t p : particles) waiting_[static_cast<std::size_t>(p)] = alive_[static_cast<std::size_t>(p)];
    std::vector<std::vector<int32_t>> components;
    for (const int32_t start : particles) {
      if (take(start)) components.push_back(component_from(start));
    }
    return components;
  }

 private:
  bool take(int32_t particle) { return std::exchange(waiting_[static_cast<std::size_t>(particle)], uint8_t{0}) != 0; }

  std::vector<int32_t> component_from(int32_t start) {
    std::vector<int32_t> reached = {start};
    for (std::size_t next = 0; next < reached.size(); ++next) {
      for (const int32_t neighbour : body_.neighbours(reached[next])) {
        if (take(neighbour)) reached.push_back(neighbour);
      }
    }
    std::sort(reached.begin(), reached.end());
    return reached;
  }

  const Body& body_;
  const std::vector<uint8_t>& alive_;
  std::vector<uint8_t> waiting_;  // [n] 1: in the set and not yet in a component
};

// Removes the components of G with fewer than `fewest` particles and returns the removed particles, ascending.
std::vector<int32_t> remove_debris(const Body& body, int32_t fewest, std::vector<uint8_t>& alive) {
  std::vector<int32_t> all(static_cast<std::size_t>(body.particle_count()));
  for (std::size_t p = 0; p < all.size(); ++p) all[p] = static_cast<int32_t>(p);
  std::vector<int32_t> debris;
  for (const auto& component : ComponentSearch(body, alive).components_of(all)) {
    if (component.size() < static_cast<std::size_t>(fewest)) {
      debris.insert(debris.end(), component.begin(), component.end());
    }
  }
  std::sort(debris.begin(), debris.end());
  for (const int32_t p : debris) alive[static_cast<std::size_t>(p)] = 0;
  return debris;
}

}  // namespace

void split(const Setup& setup, State& state) {
  if (setup.split.debris > 0) state.debris = remove_debris(setup.body, setup.split.debris, state.alive);

  const Clusters& before = state.clusters;
  const auto is_dead = [&](int32_t p) { return state.alive[static_cast<std::size_t>(p)] == 0; };
  ComponentSearch search(setup.body, state.alive);

  // By I2 no cluster contained a dead particle when the frame began, so a dead member was lost in this frame.
  Clusters after;
  std::vector<std::pair<int32_t, std::vector<int32_t>>> separated;  // parent, members; get new numbers
  bool changed = false;
  for (int32_t c = 0; c < before.count(); ++c) {
    const auto members = before.of(c);
    const int32_t number = before.number[static_cast<std::size_t>(c)];
    if (std::none_of(members.begin(), members.end(), is_dead)) {
      append_cluster(after, members, number, before, c);
      continue;
    }
    changed = true;
    auto components = search.components_of(members);
    if (components.empty()) continue;  // the cluster vanishes
    append_cluster(after, components.front(), number, before, c);
    for (std::size_t k = 1; k < components.size(); ++k) separated.emplace_back(c, std::move(components[k]));
  }
  if (!changed) return;

  int32_t next_number = before.number.back() + 1;
  for (const auto& [parent, members] : separated) append_cluster(after, members, next_number++, before, parent);
  update_rest_frames(setup.body, after);
  state.clusters = std::move(after);
}

}  // namespace cutproof::reference
