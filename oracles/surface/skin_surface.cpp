// The skin as a surface (method.md §8): first as a combinatorial object, cheap enough for every frame; then its shape
// at rest, with CGAL. The only file of the oracles that includes CGAL.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <fmt/format.h>

#include <array>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>

#include "oracles/shape_sums.h"
#include "oracles/support.h"

namespace cutproof::oracles {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
namespace pmp = CGAL::Polygon_mesh_processing;

Verdict not_judged(Verdict verdict, const std::string& why) {
  verdict.holds = false;
  verdict.witness.text = "not judged: " + why;
  return verdict;
}

// --- The skin as a combinatorial object ------------------------------------------------------------------------------

struct Defect {
  std::string text;
  std::vector<int32_t> vertices;
};

// Outgoing half-edges of each vertex: triangle (v, to, after) leaves v towards `to`.
struct HalfEdge {
  int32_t to = 0, after = 0, triangle = 0;
};
struct HalfEdges {
  std::vector<int64_t> offsets;
  std::vector<HalfEdge> edges;
  std::span<const HalfEdge> of(int32_t v) const {
    const auto i = static_cast<std::size_t>(v);
    return {edges.data() + offsets[i], static_cast<std::size_t>(offsets[i + 1] - offsets[i])};
  }
  // The first half-edge from a to b, and the next one if a surface has more than it may; null: there is none.
  const HalfEdge* between(int32_t a, int32_t b, const HalfEdge* after = nullptr) const {
    const auto leaving = of(a);
    const HalfEdge* const end = leaving.data() + leaving.size();
    for (const HalfEdge* e = after == nullptr ? leaving.data() : after + 1; e != end; ++e) {
      if (e->to == b) return e;
    }
    return nullptr;
  }
};

HalfEdges half_edges_of(const Skin& skin) {
  HalfEdges result;
  result.offsets.assign(skin.owner.size() + 1, 0);
  for (const auto& t : skin.triangles) {
    for (const int32_t v : t) ++result.offsets[static_cast<std::size_t>(v) + 1];
  }
  for (std::size_t v = 1; v < result.offsets.size(); ++v) result.offsets[v] += result.offsets[v - 1];
  result.edges.resize(3 * skin.triangles.size());
  std::vector<int64_t> next(result.offsets.begin(), result.offsets.end() - 1);
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    const auto& [a, b, c] = skin.triangles[t];
    const auto triangle = static_cast<int32_t>(t);
    result.edges[static_cast<std::size_t>(next[static_cast<std::size_t>(a)]++)] = {b, c, triangle};
    result.edges[static_cast<std::size_t>(next[static_cast<std::size_t>(b)]++)] = {c, a, triangle};
    result.edges[static_cast<std::size_t>(next[static_cast<std::size_t>(c)]++)] = {a, b, triangle};
  }
  return result;
}

// Arrays of one length, vertices on grid edges that exist, indices in range, three different ones per triangle.
std::optional<Defect> array_defect(const Skin& skin, int32_t particle_count) {
  if (skin.direction.size() != skin.owner.size() || skin.position.size() != skin.owner.size()) {
    return Defect{fmt::format("the skin has {} owners, {} directions and {} positions", skin.owner.size(),
                              skin.direction.size(), skin.position.size()),
                  {}};
  }
  const auto vertex_count = static_cast<int32_t>(skin.owner.size());
  for (int32_t v = 0; v < vertex_count; ++v) {
    const int32_t owner = skin.owner[static_cast<std::size_t>(v)];
    if (owner < 0 || owner >= particle_count) {
      return Defect{
          fmt::format("vertex {} is owned by particle {}, and the particles are 0 to {}", v, owner, particle_count - 1),
          {}};
    }
    if (skin.direction[static_cast<std::size_t>(v)] >= kDirections.size()) {
      return Defect{fmt::format("vertex {} has direction {}, and the directions are 0 to 5", v,
                                skin.direction[static_cast<std::size_t>(v)]),
                    {v}};
    }
  }
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    const auto& [a, b, c] = skin.triangles[t];
    for (const int32_t v : {a, b, c}) {
      if (v < 0 || v >= vertex_count) {
        return Defect{fmt::format("triangle {} names vertex {}, and the vertices are 0 to {}", t, v, vertex_count - 1),
                      {}};
      }
    }
    if (a == b || b == c || c == a) {
      return Defect{fmt::format("triangle {} names a vertex twice: {}, {}, {}", t, a, b, c), {a, b, c}};
    }
  }
  return std::nullopt;
}

// Each grid edge carries at most one vertex.
std::optional<Defect> duplicate_defect(const Skin& skin, int32_t particle_count) {
  std::vector<int32_t> vertex_at(6 * static_cast<std::size_t>(particle_count), -1);
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    int32_t& slot = vertex_at[6 * static_cast<std::size_t>(skin.owner[v]) + skin.direction[v]];
    if (slot >= 0) {
      return Defect{fmt::format("vertices {} and {} lie on the same grid edge: from particle {} in direction {}", slot,
                                v, skin.owner[v], skin.direction[v]),
                    {slot, static_cast<int32_t>(v)}};
    }
    slot = static_cast<int32_t>(v);
  }
  return std::nullopt;
}

// Closed and oriented: each half-edge is there once, and its opposite once.
std::optional<Defect> edge_defect(const Skin& skin, const HalfEdges& half_edges) {
  for (int32_t a = 0; a < static_cast<int32_t>(skin.owner.size()); ++a) {
    for (const HalfEdge& e : half_edges.of(a)) {
      const HalfEdge* const first = half_edges.between(a, e.to);
      if (const HalfEdge* const second = half_edges.between(a, e.to, first)) {
        return Defect{
            fmt::format("triangles {} and {} both run from vertex {} to vertex {}: one is flipped, doubled, or "
                        "the edge has more than two triangles",
                        first->triangle, second->triangle, a, e.to),
            {a, e.to}};
      }
      if (half_edges.between(e.to, a) == nullptr) {
        return Defect{
            fmt::format("the surface is open: triangle {} runs from vertex {} to vertex {}, and none runs back",
                        e.triangle, a, e.to),
            {a, e.to}};
      }
    }
  }
  return std::nullopt;
}

// Manifold: the triangles around each vertex are one cycle. Requires the surface to be closed and oriented.
std::optional<Defect> fan_defect(const Skin& skin, const HalfEdges& half_edges) {
  for (int32_t v = 0; v < static_cast<int32_t>(skin.owner.size()); ++v) {
    const auto fan = half_edges.of(v);
    if (fan.empty()) return Defect{fmt::format("no triangle uses vertex {}", v), {v}};
    std::size_t length = 0;
    const HalfEdge* at = &fan[0];
    do {
      ++length;
      at = half_edges.between(v, at->after);
    } while (at->triangle != fan[0].triangle && length <= fan.size());
    if (length != fan.size()) {
      return Defect{fmt::format("the surface is pinched at vertex {}: {} triangles meet there, but only {} of them lie "
                                "in one cycle",
                                v, fan.size(), length),
                    {v}};
    }
  }
  return std::nullopt;
}

std::optional<Defect> surface_defect(const Skin& skin, int32_t particle_count) {
  if (auto defect = array_defect(skin, particle_count)) return defect;
  if (auto defect = duplicate_defect(skin, particle_count)) return defect;
  const HalfEdges half_edges = half_edges_of(skin);
  if (auto defect = edge_defect(skin, half_edges)) return defect;
  return fan_defect(skin, half_edges);
}

void witness_vertices(Verdict& verdict, const Skin& skin, const std::vector<int32_t>& vertices) {
  std::set<int32_t> owners;
  for (const int32_t v : vertices) owners.insert(skin.owner[static_cast<std::size_t>(v)]);
  verdict.witness.particles.assign(owners.begin(), owners.end());
}

// A frame that has ended has a skin if the scene wants one and anything is alive. Before the first frame ends there
// may be none yet.
bool skin_is_missing(const Setup& setup, const State& state) {
  const bool any_alive = std::find(state.alive.begin(), state.alive.end(), 1) != state.alive.end();
  return setup.skin.wanted && state.frame > 0 && any_alive && state.skin.owner.empty() && state.skin.triangles.empty();
}

// --- Nodes: what is tissue, what is a cavity
// ---------------------------------------------------------------------------

// [node_count] 1 where an alive particle sits.
std::vector<uint8_t> tissue_nodes(const Body& body, const State& state) {
  std::vector<uint8_t> tissue(static_cast<std::size_t>(body.grid.node_count()), 0);
  for (std::size_t i = 0; i < body.node.size(); ++i) tissue[static_cast<std::size_t>(body.node[i])] = state.alive[i];
  return tissue;
}

// Components of the nodes with tissue == value; nodes are neighbours if they differ by at most one along each axis and
// along at most `axes` of them: 1 gives 6 neighbours, 2 gives 18.
int32_t count_node_components(const Grid& grid, const std::vector<uint8_t>& tissue, uint8_t value, int axes) {
  std::vector<std::array<int32_t, 3>> offsets;
  for (int32_t k = -1; k <= 1; ++k) {
    for (int32_t j = -1; j <= 1; ++j) {
      for (int32_t i = -1; i <= 1; ++i) {
        const int along = std::abs(i) + std::abs(j) + std::abs(k);
        if (along >= 1 && along <= axes) offsets.push_back({i, j, k});
      }
    }
  }
  std::vector<uint8_t> seen(tissue.size(), 0);
  std::vector<int64_t> stack;
  int32_t count = 0;
  for (std::size_t start = 0; start < tissue.size(); ++start) {
    if (seen[start] || tissue[start] != value) continue;
    ++count;
    seen[start] = 1;
    stack.push_back(static_cast<int64_t>(start));
    while (!stack.empty()) {
      const auto at = grid.coordinates(stack.back());
      stack.pop_back();
      for (const auto& o : offsets) {
        const std::array<int32_t, 3> to = {at[0] + o[0], at[1] + o[1], at[2] + o[2]};
        if (to[0] < 0 || to[1] < 0 || to[2] < 0 || to[0] >= grid.nodes[0] || to[1] >= grid.nodes[1] ||
            to[2] >= grid.nodes[2]) {
          continue;
        }
        const auto node = static_cast<std::size_t>(grid.index(to[0], to[1], to[2]));
        if (seen[node] || tissue[node] != value) continue;
        seen[node] = 1;
        stack.push_back(static_cast<int64_t>(node));
      }
    }
  }
  return count;
}

// --- Volume of one cell (docs/tolerances.md, "Volume of the skin")
// -----------------------------------------------------

struct VolumeRange {
  double low = 0, high = 0;  // [h³]
};

std::array<int, 3> corner_coordinates(int corner) { return {corner & 1, (corner >> 1) & 1, (corner >> 2) & 1}; }

// The four corners of each face of a cell, counter-clockwise seen from outside the cell. Corner number: x + 2y + 4z.
constexpr std::array<std::array<int, 4>, 6> kFaceCorners = {
    {{1, 3, 7, 5}, {0, 4, 6, 2}, {2, 6, 7, 3}, {0, 1, 5, 4}, {4, 5, 7, 6}, {0, 2, 3, 1}}};

// A skin vertex inside a cell, by the two ends of its edge.
struct CellVertex {
  int inside = 0, outside = 0;
  friend auto operator<=>(const CellVertex&, const CellVertex&) = default;
};

// Relative to the middle of the cell, in units of h.
Vec3 cell_position(CellVertex v, double alpha) {
  const auto a = corner_coordinates(v.inside), b = corner_coordinates(v.outside);
  Vec3 p;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    p[axis] = a[i] + alpha * (b[i] - a[i]) - 0.5;
  }
  return p;
}

// The closed polygons in which the skin meets a cell, outward. On each face every run of inside corners is cut off by
// one segment from where the run is entered to where it is left, which keeps diagonal inside corners apart.
std::vector<std::vector<CellVertex>> cell_loops(int pattern) {
  const auto inside = [pattern](int corner) { return ((pattern >> corner) & 1) != 0; };
  std::map<CellVertex, CellVertex> next;
  for (const auto& face : kFaceCorners) {
    for (std::size_t first = 0; first < 4; ++first) {
      const int before = face[(first + 3) % 4];
      if (!inside(face[first]) || inside(before)) continue;
      std::size_t last = first;
      while (inside(face[(last + 1) % 4])) ++last;
      next[{face[first], before}] = {face[last % 4], face[(last + 1) % 4]};
    }
  }
  std::vector<std::vector<CellVertex>> loops;
  while (!next.empty()) {
    std::vector<CellVertex> loop;
    for (auto at = next.begin(); at != next.end(); at = next.find(loop.back())) {
      loop.push_back(at->second);
      next.erase(at);
    }
    loops.push_back(std::move(loop));
  }
  return loops;
}

double cone_volume(Vec3 a, Vec3 b, Vec3 c) { return dot(a, cross(b, c)) / 6; }

// Least and greatest volume under any triangulation of one polygon, as cones to the middle of the cell.
VolumeRange polygon_volume(const std::vector<Vec3>& p) {
  const std::size_t n = p.size();
  std::vector<std::vector<VolumeRange>> best(n, std::vector<VolumeRange>(n));
  for (std::size_t width = 2; width < n; ++width) {
    for (std::size_t i = 0; i + width < n; ++i) {
      const std::size_t j = i + width;
      VolumeRange range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
      for (std::size_t k = i + 1; k < j; ++k) {
        const double volume = cone_volume(p[i], p[k], p[j]);
        range.low = std::min(range.low, best[i][k].low + best[k][j].low + volume);
        range.high = std::max(range.high, best[i][k].high + best[k][j].high + volume);
      }
      best[i][j] = range;
    }
  }
  return best[0][n - 1];
}

// Area of tissue on a face of a cell: marching squares, diagonal inside corners apart.
double face_area(int pattern, const std::array<int, 4>& face, double alpha) {
  std::array<bool, 4> in{};
  int count = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    in[i] = ((pattern >> face[i]) & 1) != 0;
    count += in[i];
  }
  switch (count) {
    case 0:
      return 0;
    case 1:
      return alpha * alpha / 2;
    case 2:
      return in[0] == in[2] ? alpha * alpha : alpha;
    case 3:
      return 1 - (1 - alpha) * (1 - alpha) / 2;
    default:
      return 1;
  }
}

VolumeRange cell_volume(int pattern, double alpha) {
  VolumeRange total;
  for (const auto& face : kFaceCorners) {
    const double cone = face_area(pattern, face, alpha) / 6;  // area times half an edge over three
    total.low += cone;
    total.high += cone;
  }
  for (const auto& loop : cell_loops(pattern)) {
    std::vector<Vec3> points;
    for (const CellVertex v : loop) points.push_back(cell_position(v, alpha));
    const VolumeRange range = polygon_volume(points);
    total.low += range.low;
    total.high += range.high;
  }
  return total;
}

VolumeRange tissue_volume(const Grid& grid, const std::vector<uint8_t>& tissue, double alpha) {
  std::array<int64_t, 256> cells{};
  for (int32_t k = 0; k + 1 < grid.nodes[2]; ++k) {
    for (int32_t j = 0; j + 1 < grid.nodes[1]; ++j) {
      for (int32_t i = 0; i + 1 < grid.nodes[0]; ++i) {
        const int64_t node = grid.index(i, j, k);
        int pattern = 0;
        for (int corner = 0; corner < 8; ++corner) {
          const auto c = corner_coordinates(corner);
          const int64_t at = node + c[0] + int64_t{grid.nodes[0]} * (c[1] + int64_t{grid.nodes[1]} * c[2]);
          pattern |= tissue[static_cast<std::size_t>(at)] << corner;
        }
        ++cells[static_cast<std::size_t>(pattern)];
      }
    }
  }
  VolumeRange total;
  for (int pattern = 1; pattern < 256; ++pattern) {
    const auto count = static_cast<double>(cells[static_cast<std::size_t>(pattern)]);
    if (count == 0) continue;
    const VolumeRange range = cell_volume(pattern, alpha);
    total.low += count * range.low;
    total.high += count * range.high;
  }
  return total;
}

// --- CGAL
// ---------------------------------------------------------------------------------------------------------------

// Nothing if the triangles are not those of a manifold with boundary.
std::optional<Mesh> mesh_of(const Skin& skin, const std::vector<Vec3>& points) {
  const auto vertex_count = static_cast<int32_t>(points.size());
  Mesh mesh;
  for (const Vec3 p : points) mesh.add_vertex({p.x, p.y, p.z});
  for (const auto& [a, b, c] : skin.triangles) {
    if (std::min({a, b, c}) < 0 || std::max({a, b, c}) >= vertex_count || a == b || b == c || c == a) {
      return std::nullopt;
    }
    const auto vertex = [](int32_t v) { return Mesh::Vertex_index(static_cast<uint32_t>(v)); };
    if (mesh.add_face(vertex(a), vertex(b), vertex(c)) == Mesh::null_face()) return std::nullopt;
  }
  return mesh;
}

struct Shells {
  std::vector<double> volume;      // [shells] signed [cube of the unit of `points`]
  std::vector<double> magnitude;   // [shells] sum of the absolute terms of that sum, for its rounding bound
  std::vector<int64_t> euler;      // [shells] V − E + F
  std::vector<int64_t> triangles;  // [shells]
  std::vector<int32_t> some_vertex;
};

// Volume of a closed surface as the sum over its triangles of projected area times mean height: with vertices at
// multiples of 1/2 every term is exact.
Shells shells_of(Mesh& mesh, const Skin& skin, const std::vector<Vec3>& points) {
  auto label = mesh.add_property_map<Mesh::Face_index, std::size_t>("f:shell", 0).first;
  const std::size_t count = pmp::connected_components(mesh, label);
  Shells shells;
  shells.volume.assign(count, 0);
  shells.magnitude.assign(count, 0);
  shells.euler.assign(count, 0);
  shells.triangles.assign(count, 0);
  shells.some_vertex.assign(count, -1);
  std::vector<uint8_t> counted(points.size(), 0);
  for (std::size_t t = 0; t < skin.triangles.size(); ++t) {
    const std::size_t shell = label[Mesh::Face_index(static_cast<uint32_t>(t))];
    const auto& triangle = skin.triangles[t];
    const Vec3 a = points[static_cast<std::size_t>(triangle[0])];
    const Vec3 b = points[static_cast<std::size_t>(triangle[1])] - a;
    const Vec3 c = points[static_cast<std::size_t>(triangle[2])] - a;
    const double height = 3 * a.z + b.z + c.z;
    shells.volume[shell] += height * (b.x * c.y - b.y * c.x);
    shells.magnitude[shell] += std::abs(height) * (std::abs(b.x * c.y) + std::abs(b.y * c.x));
    ++shells.triangles[shell];
    shells.some_vertex[shell] = triangle[0];
    for (const int32_t v : triangle) {
      if (counted[static_cast<std::size_t>(v)]) continue;
      counted[static_cast<std::size_t>(v)] = 1;
      ++shells.euler[shell];
    }
  }
  for (std::size_t s = 0; s < count; ++s) {
    shells.volume[s] /= 6;
    shells.magnitude[s] /= 6;
    shells.euler[s] += shells.triangles[s] - 3 * shells.triangles[s] / 2;
  }
  return shells;
}

// Every vertex where it is at rest, in units of h.
std::vector<Vec3> rest_points(const Setup& setup, const Skin& skin) {
  std::vector<Vec3> points(skin.owner.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    const auto node = setup.body.grid.coordinates(setup.body.node[static_cast<std::size_t>(skin.owner[v])]);
    const auto& step = kDirections[skin.direction[v]];
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(axis);
      points[v][axis] = node[i] + setup.skin.alpha * step[i];
    }
  }
  return points;
}

}  // namespace

Verdict skin_surface(const Setup& setup, const State& state) {
  Verdict verdict = start_verdict("skin surface", state, "1", "method.md §8: closed, oriented, 2-manifold");
  const Skin& skin = state.skin;
  verdict.checked = static_cast<int64_t>(skin.triangles.size());
  if (skin_is_missing(setup, state)) {
    verdict.holds = false;
    verdict.measured = 1;
    verdict.witness.text = "tissue is alive, and there is no skin";
    return verdict;
  }
  if (const auto defect = surface_defect(skin, setup.body.particle_count())) {
    verdict.holds = false;
    verdict.measured = 1;
    verdict.witness.text = defect->text;
    witness_vertices(verdict, skin, defect->vertices);
  }
  return verdict;
}

Verdict skin_geometry(const Setup& setup, const State& state) {
  Verdict verdict =
      start_verdict("skin geometry", state, "1", "method.md §8, lemma; docs/tolerances.md, Volume of the skin");
  const Skin& skin = state.skin;
  verdict.checked = static_cast<int64_t>(skin.triangles.size());
  if (skin.owner.empty() && skin.triangles.empty() && !skin_is_missing(setup, state)) return verdict;
  const Verdict surface = skin_surface(setup, state);
  if (!surface.holds)
    return not_judged(std::move(verdict), "the skin is not a closed surface (" + surface.witness.text + ")");
  const auto fail = [&](const std::string& text, const std::vector<int32_t>& vertices) {
    verdict.holds = false;
    verdict.witness.text = text;
    witness_vertices(verdict, skin, vertices);
    return verdict;
  };
  const auto vertices_of = [&](Mesh::Face_index face) {
    const auto& t = skin.triangles[static_cast<std::size_t>(face)];
    return std::vector<int32_t>{t.begin(), t.end()};
  };

  const std::vector<Vec3> points = rest_points(setup, skin);
  std::optional<Mesh> mesh = mesh_of(skin, points);
  if (!mesh) return not_judged(std::move(verdict), "CGAL does not take the triangles as a surface");

  std::vector<Mesh::Face_index> degenerate;
  pmp::degenerate_faces(*mesh, std::back_inserter(degenerate));
  if (!degenerate.empty()) {
    verdict.measured = static_cast<double>(degenerate.size());
    return fail(fmt::format("triangle {} has no area at rest", static_cast<uint32_t>(degenerate[0])),
                vertices_of(degenerate[0]));
  }
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> crossing;
  pmp::self_intersections(*mesh, std::back_inserter(crossing));
  if (!crossing.empty()) {
    verdict.measured = static_cast<double>(crossing.size());
    auto vertices = vertices_of(crossing[0].first);
    for (const int32_t v : vertices_of(crossing[0].second)) vertices.push_back(v);
    return fail(fmt::format("triangles {} and {} intersect at rest", static_cast<uint32_t>(crossing[0].first),
                            static_cast<uint32_t>(crossing[0].second)),
                vertices);
  }

  const Shells shells = shells_of(*mesh, skin, points);
  double volume = 0, magnitude = 0;
  int32_t outer = 0, inner = 0;
  for (std::size_t s = 0; s < shells.volume.size(); ++s) {
    volume += shells.volume[s];
    magnitude += shells.magnitude[s];
    (shells.volume[s] > 0 ? outer : inner) += 1;
    if (shells.euler[s] % 2 != 0 || shells.euler[s] > 2) {
      verdict.measured = static_cast<double>(shells.euler[s]);
      return fail(fmt::format("a shell has Euler number {}, which no closed surface has", shells.euler[s]),
                  {shells.some_vertex[s]});
    }
  }
  const std::vector<uint8_t> tissue = tissue_nodes(setup.body, state);
  const int32_t components = count_node_components(setup.body.grid, tissue, 1, 1);
  const int32_t cavities = count_node_components(setup.body.grid, tissue, 0, 2) - 1;  // all but the outside
  if (outer != components || inner != cavities) {
    verdict.measured = std::abs(outer - components) + std::abs(inner - cavities);
    return fail(fmt::format("the skin has {} outward and {} inward shells, and the tissue has {} components and {} "
                            "cavities",
                            outer, inner, components, cavities),
                {});
  }

  const VolumeRange range = tissue_volume(setup.body.grid, tissue, setup.skin.alpha);
  const double rounding =
      (static_cast<double>(skin.triangles.size()) + 512) * kUnitRoundoff * (magnitude + std::abs(range.high));
  const double outside = std::max(range.low - volume, volume - range.high);
  verdict.measured = std::max(0.0, outside);
  verdict.bound = rounding;
  verdict.unit = "h³";
  if (!(outside <= rounding)) {
    return fail(
        fmt::format("the skin holds {} h³, and this tissue between {} and {} h³", volume, range.low, range.high), {});
  }
  return verdict;
}

Verdict check_skin_vertices(const Setup& setup, const State& state) {
  Verdict verdict = start_verdict("skin vertices", state, "h", "docs/tolerances.md, One goal position");
  const Skin& skin = state.skin;
  verdict.checked = static_cast<int64_t>(skin.owner.size());
  if (skin.owner.empty() && skin.triangles.empty() && !skin_is_missing(setup, state)) return verdict;
  const Body& body = setup.body;
  if (const auto defect = array_defect(skin, body.particle_count())) {
    return not_judged(std::move(verdict), "the skin's arrays are not in order (" + defect->text + ")");
  }
  const auto fail = [&](const std::string& text, std::vector<int32_t> particles) {
    verdict.holds = false;
    verdict.witness.text = text;
    verdict.witness.particles = std::move(particles);
    return verdict;
  };

  // The vertices are those of the grid edges with one alive end, each once.
  const auto is_alive = [&](int32_t i) { return i >= 0 && state.alive[static_cast<std::size_t>(i)] != 0; };
  std::vector<uint8_t> vertices_on(6 * static_cast<std::size_t>(body.particle_count()), 0);
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t owner = skin.owner[v];
    const int direction = skin.direction[v];
    if (!is_alive(owner))
      return fail(fmt::format("vertex {} is owned by particle {}, which is dead", v, owner), {owner});
    const int32_t other = body.neighbour(owner, direction);
    if (is_alive(other)) {
      return fail(fmt::format("vertex {} lies on the edge from particle {} to particle {}, and both are alive", v,
                              owner, other),
                  {owner, other});
    }
    if (vertices_on[6 * static_cast<std::size_t>(owner) + static_cast<std::size_t>(direction)]++) {
      return fail(fmt::format("the edge from particle {} in direction {} carries two vertices", owner, direction),
                  {owner});
    }
  }
  for (int32_t i = 0; i < body.particle_count(); ++i) {
    for (int d = 0; d < 6 && is_alive(i); ++d) {
      if (is_alive(body.neighbour(i, d)) ||
          vertices_on[6 * static_cast<std::size_t>(i) + static_cast<std::size_t>(d)]) {
        continue;
      }
      return fail(
          fmt::format("the edge from particle {} in direction {} leaves the tissue and carries no vertex", i, d), {i});
    }
  }

  // Their places.
  const Clusters& clusters = state.clusters;
  const WeightedRest weighted = weighted_rest(body, membership_counts(clusters, body.particle_count()));
  const Memberships memberships_of_all = memberships_of(clusters, body.particle_count());
  std::vector<ClusterMeans> means;
  means.reserve(static_cast<std::size_t>(clusters.count()));
  for (int32_t c = 0; c < clusters.count(); ++c) means.push_back(cluster_means(weighted, clusters, state.x, c));
  const double h = body.grid.spacing;
  const double bound = 2 * goal_rounding(rounding_scale(setup, state)) / h;
  verdict.bound = bound;
  std::size_t worst = 0;
  for (std::size_t v = 0; v < skin.owner.size(); ++v) {
    const int32_t owner = skin.owner[v];
    const auto memberships = memberships_of_all.of(owner);
    if (memberships.empty())
      return fail(fmt::format("particle {} owns vertex {} and lies in no cluster", owner, v), {owner});
    const auto& step = kDirections[skin.direction[v]];
    const Vec3 rest =
        body.rest_position(owner) + setup.skin.alpha * h * Vec3{1.0 * step[0], 1.0 * step[1], 1.0 * step[2]};
    Vec3 sum;
    for (const int32_t c : memberships) {
      const ClusterMeans& m = means[static_cast<std::size_t>(c)];
      sum += m.current + clusters.rotation[static_cast<std::size_t>(c)] * (rest - m.rest);
    }
    const double distance = norm(skin.position[v] - sum / static_cast<double>(memberships.size())) / h;
    if (!(distance <= verdict.measured)) {  // also if it is not a number
      verdict.measured = distance;
      worst = v;
      if (!std::isfinite(distance)) break;
    }
  }
  if (!(verdict.measured <= bound)) {
    const int32_t owner = skin.owner[worst];
    return fail(fmt::format("vertex {} of particle {} is {} h from where the particle's clusters put it", worst, owner,
                            verdict.measured),
                {owner});
  }
  return verdict;
}

Verdict skin_vertices(const Setup& setup, const State& state) {
  const Verdict form = well_formed(setup, state);
  return form.holds ? check_skin_vertices(setup, state) : oracles::not_judged("skin vertices", form);
}

ShellCount skin_shells(const Skin& skin) {
  std::optional<Mesh> mesh = mesh_of(skin, skin.position);
  if (!mesh) return {-1, -1};
  ShellCount count;
  for (const double volume : shells_of(*mesh, skin, skin.position).volume)
    (volume > 0 ? count.outer : count.inner) += 1;
  return count;
}

}  // namespace cutproof::oracles
