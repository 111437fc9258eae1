// The skin's shells and the tissue's cavities, which the lemma of method.md §8 compares.
#pragma once
#include "model/skin.h"
#include "oracles/judged.h"

namespace cutproof::oracles {

// Found from the triangles alone, joined at their vertices. Inside and outside are told apart by the sign of the
// volume, *at rest* where it is judged, because a body that is turned inside out in motion still has the same skin.
struct Shells {
  std::vector<int32_t> of_vertex;  // [v] shell, -1 if no triangle uses the vertex
  std::vector<double> volume;      // [shells] six times [m³]
  // [shells] its vertex that lies farthest along x, at rest: on an edge along x, because those on other edges lie in
  // planes of nodes, of which the last one has tissue, or emptiness, a part of an edge beyond. Tissue lies before it
  // where the shell goes around tissue, and behind it where it goes around a cavity, whatever way the triangles turn.
  std::vector<int32_t> farthest;
};
// `points`: where the vertices are [v]. Requires triangles to name vertices that exist.
Shells shells_of(const Skin& skin, const std::vector<Vec3>& points);

// Rest position of a vertex [m].
inline Vec3 vertex_at_rest(const Setup& setup, const Skin& skin, std::size_t v) {
  const auto& d = kDirections[skin.direction[v]];
  const double reach = skin.reach[v] * setup.body.grid.spacing;
  return setup.body.rest_position(skin.owner[v]) + reach * Vec3{1.0 * d[0], 1.0 * d[1], 1.0 * d[2]};
}

// Places of vertices by the clusters of their owners (method.md §8), and the rounding of a correct answer
// (tolerances.md, One skin vertex) [m]. Requires each owner to lie in a cluster.
struct VertexPlace {
  Vec3 place;
  double bound = 0;
};
// `skin`: the state's own, or other vertices that hang on its particles (owner, direction and reach alone are read).
std::vector<VertexPlace> vertex_places(const Setup& setup, const State& state, const Skin& skin,
                                       const Memberships& memberships);
// The same of particles, each where it rests itself; without a cluster where it is.
std::vector<VertexPlace> carried_places(const Setup& setup, const State& state, const std::vector<int32_t>& particles);

struct ShellCount {
  int32_t outer = 0, inner = 0;
  friend bool operator==(const ShellCount&, const ShellCount&) = default;
};
// By the sign of the volume at `position`; a shell without volume counts as an inner one. On a surface that is a
// manifold, which "skin surface" shows, these are the shells of triangles joined at their edges.
ShellCount count_shells(const Skin& skin);

// "skin match" of a skin whose vertices lie anywhere within the cells that it passes, so that nothing is known of where
// they are at rest: by where they are. One outer shell for each component of the tissue, an inner one for each cavity
// (on a grid), and all of them together enclose tissue. `skin`: the state's own, or one without owners. Requires
// triangles to name vertices that exist.
Verdict free_skin_match(const Setup& setup, const State& state, const Skin& skin);

// Components of the empty nodes (18 neighbours) that do not reach the outer ring.
int32_t count_cavities(const Judged& judged);

}  // namespace cutproof::oracles
