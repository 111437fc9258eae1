// I3 (method.md §2) and the lemma of §8: tissue and coupling fall into the same components, and so do tissue and skin.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "oracles/checks.h"
#include "oracles/piece_sizes.h"
#include "oracles/shells.h"

namespace cutproof::oracles {
namespace {

// A cluster that holds particles of two components of G: if anything coupled is not connected there is one.
void tell_of_ghost_coupling(Judged& judged, Verdict& verdict) {
  const std::vector<int32_t>& component = judged.components().label;
  for (int32_t c = 0; c < judged.clusters.count(); ++c) {
    int32_t first = -1;
    for (const int32_t i : judged.clusters.of(c)) {
      if (!judged.alive(i)) continue;
      if (first < 0) first = i;
      if (component[at(i)] == component[at(first)]) continue;
      return violate(verdict, {{judged.number(c)}, {first, i}},
                     "cluster {} couples particles {} and {}, which lie in components {} and {} of the tissue",
                     judged.number(c), first, i, component[at(first)], component[at(i)]);
    }
  }
}

}  // namespace

// Where both halves are violated the witness shows a coupling between components. Only such a witness names a cluster,
// so that an expectation of isolated clusters does not hide it (harness/expectations.cpp).
void check_component_match(Judged& judged, Verdict& verdict) {
  const Partition& components = judged.components();
  const Partition& coupling = judged.coupling();
  const int64_t pairs = judged.coupled_components();
  const int64_t surplus = pairs - components.count, ghosts = pairs - coupling.count;
  if (ghosts > 0) tell_of_ghost_coupling(judged, verdict);
  if (surplus > 0) {
    const Edge edge = judged.first_uncoupled_edge();
    violate(verdict, {{}, {edge.a, edge.b}, {edge.a, edge.b}},
            "particles {} and {} are neighbours in component {} of the tissue, but no chain of "
            "clusters couples them",
            edge.a, edge.b, components.label[at(edge.a)]);
  }
  if (!verdict.holds) {
    verdict.witness.text += fmt::format("; the tissue is {}, and what clusters couple is {}",
                                        pieces_in_words(components), pieces_in_words(coupling));
  }
  verdict.measured = static_cast<double>(surplus + ghosts);
  for (const int32_t label : components.label) verdict.checked += label >= 0 ? 1 : 0;
}

void check_skin_match(Judged& judged, Verdict& verdict) {
  if (!skin_is_due(judged.setup, judged.state)) return;
  const Skin& skin = judged.state.skin;
  const Partition& components = judged.components();
  std::vector<Vec3> at_rest;
  for (std::size_t v = 0; v < skin.owner.size(); ++v) at_rest.push_back(vertex_at_rest(judged.setup, skin, v));
  const Shells shells = shells_of(skin, at_rest);
  verdict.checked = components.count;
  const auto shell_count = static_cast<int32_t>(shells.volume.size());

  // Of the first violation only, which is the witness: each call walks the whole skin.
  const auto around = [&](std::size_t v) {
    return verdict.holds ? triangles_at(skin, {static_cast<int32_t>(v)}) : std::vector<int32_t>();
  };

  std::vector<int32_t> first_owner(at(shell_count), -1);
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t shell = shells.of_vertex[v], owner = skin.owner[v];
    if (shell < 0) continue;
    if (!judged.alive(owner)) {
      violate(verdict, {{}, {owner}, {}, around(v)}, "skin vertex {} is owned by particle {}, which is dead", v, owner);
      continue;
    }
    int32_t& first = first_owner[at(shell)];
    if (first < 0) first = owner;
    if (components.label[at(first)] != components.label[at(owner)]) {
      violate(verdict, {{}, {first, owner}, {}, around(v)},
              "one shell of the skin joins particles {} and {}, which lie in components {} and "
              "{} of the tissue",
              first, owner, components.label[at(first)], components.label[at(owner)]);
    }
  }
  // A shell that is turned inside out would be taken for one around a cavity, and one around a cavity for an outer one.
  for (int32_t shell = 0; shell < shell_count; ++shell) {
    const int32_t v = shells.farthest[at(shell)];
    const bool around_tissue = kDirections[skin.direction[at(v)]][0] > 0;
    if (around_tissue == (shells.volume[at(shell)] > 0)) continue;
    violate(verdict, {{}, {skin.owner[at(v)]}, {}, around(at(v))},
            "the shell {} particle {} is inside out: its triangles turn clockwise, seen from outside the tissue",
            around_tissue ? "around" : "of a cavity beside", skin.owner[at(v)]);
  }
  // Exactly one outer shell for each component of the tissue.
  std::vector<int32_t> outer_of(at(components.count), -1);
  int32_t inner = 0;
  for (int32_t shell = 0; shell < shell_count; ++shell) {
    const int32_t owner = first_owner[at(shell)];
    if (owner < 0) continue;
    if (shells.volume[at(shell)] < 0) {
      ++inner;
      continue;
    }
    int32_t& outer = outer_of[at(components.label[at(owner)])];
    if (outer >= 0) {
      violate(verdict, {{}, {first_owner[at(outer)], owner}},
              "component {} of the tissue has two outer shells, at particles {} and {}", components.label[at(owner)],
              first_owner[at(outer)], owner);
    }
    outer = shell;
  }
  for (int32_t i = 0; i < judged.body.particle_count(); ++i) {
    if (!judged.alive(i)) continue;
    int32_t& outer = outer_of[at(components.label[at(i)])];
    if (outer < 0) {
      violate(verdict, {{}, {i}},
              "component {} of the tissue, which holds particle {}, has no outer "
              "shell",
              components.label[at(i)], i);
      outer = shell_count;  // told once
    }
  }
  const int32_t cavities = count_cavities(judged);
  if (inner != cavities) {
    violate(verdict, {}, "the skin has {} inner shells, but the tissue has {} cavities", inner, cavities);
  }
  if (!verdict.holds) {
    verdict.witness.text +=
        fmt::format("; the tissue is {}, and the skin has {} shells", pieces_in_words(components), shell_count);
  }
}

Verdict free_skin_match(const Setup& setup, const State& state, const Skin& skin) {
  const Property& property = property_named(core_properties(), "skin match");
  Verdict verdict = start_verdict(property.name, state, property.unit, "tolerances.md, A surface with free places");
  Judged judged(setup, state);
  const Partition& components = judged.components();
  verdict.checked = components.count;
  const bool owned = skin.owner.size() == skin.position.size();
  const Shells shells = shells_of(skin, skin.position);
  std::vector<int32_t> first_owner(shells.volume.size(), -1);
  for (std::size_t v = 0; owned && v < skin.owner.size(); ++v) {
    const int32_t shell = shells.of_vertex[v], owner = skin.owner[v];
    if (shell < 0) continue;
    int32_t& first = first_owner[at(shell)];
    if (first < 0) first = owner;
    if (!judged.alive(owner)) {
      violate(verdict, {{}, {owner}}, "skin vertex {} is owned by particle {}, which is dead", v, owner);
    } else if (components.label[at(first)] != components.label[at(owner)]) {
      violate(verdict, {{}, {first, owner}},
              "one shell of the skin joins particles {} and {}, which lie in components "
              "{} and {} of the tissue",
              first, owner, components.label[at(first)], components.label[at(owner)]);
    }
  }
  int32_t outer = 0, inner = 0;
  double enclosed = 0;
  for (const double volume : shells.volume) {
    ++(volume > 0 ? outer : inner);
    enclosed += volume;
  }
  if (outer != components.count) {
    violate(verdict, {}, "the skin has {} outer shells, but the tissue has {} components", outer, components.count);
  }
  if (const int32_t cavities = judged.body.on_grid() ? count_cavities(judged) : inner; inner != cavities) {
    violate(verdict, {}, "the skin has {} inner shells, but the tissue has {} cavities", inner, cavities);
  }
  // Each shell inside out may leave their numbers as they were.
  if (outer + inner > 0 && !(enclosed > 0)) violate(verdict, {}, "the skin is inside out: it encloses no tissue");
  return conclude(std::move(verdict), property.nothing);
}

}  // namespace cutproof::oracles
